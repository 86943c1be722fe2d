// Properties of the issue queue (specification, section 8): the oldest collision that is free issues, each one once
// and with its own record, and every slot that passes, idles or waits is told.
//
// A model stands beside the queue. It knows collisions by their number in the stream, and for each body the slots until
// it is free: no places, no records that move, no times modulo 256. Bodies, passes, the times of beats, and the room
// for impulses are the solver's choice. The last part gives the value of each register of the queue in terms of the
// model: with it, a cycle that keeps all properties follows from one that does.
`default_nettype none

module pgs_queue_properties #(
  parameter integer DEPTH     = 3,               // small: Yosys reads the module with these, too
  parameter integer SLOTS     = 5,
  parameter integer SLOT      = 3,
  parameter integer BODY      = 2,
  parameter integer COLLISION = 3,
  parameter integer WINDOW    = 4,
  parameter integer PATIENCE  = 5,
  parameter integer FACTS     = 9
) (
  input wire               clk,
  input wire               clear,
  input wire               phase,
  input wire               passing,
  input wire               parity,
  input wire [19:0]        collisions,
  input wire               has_slot,
  input wire               take,
  input wire               comes_s1,
  input wire [BODY-1:0]    a_s1,
  input wire [BODY-1:0]    b_s1,
  input wire [COLLISION:0] use_a_s2,
  input wire [COLLISION:0] use_b_s2,
  input wire               moves_a_s3,
  input wire               moves_b_s3,
  input wire [FACTS-1:0]   facts_s3,
  input wire               beats_there,
  input wire [511:0]       beats,
  input wire               loads,
  input wire               loads_rest,
  input wire               has_room,
  input wire               issues,
  input wire               stalls,
  input wire               waits,
  input wire [31:0]        hazards,
  input wire [511:0]       first,
  input wire [511:0]       rest,
  input wire [FACTS-1:0]   facts,
  input wire [BODY-1:0]    early_a,
  input wire [BODY-1:0]    early_b,
  input wire               early_moves_a,
  input wire               early_moves_b,
  input wire [BODY-1:0]    body_a,
  input wire [BODY-1:0]    body_b,
  input wire               body_moves_a,
  input wire               body_moves_b,
  input wire [COLLISION:0] use_of_body,

  // Inside the queue.
  input wire [SLOT-1:0]    next_slot,
  input wire [SLOT-1:0]    slot_s1,
  input wire [SLOT-1:0]    slot_s2,
  input wire [SLOT-1:0]    slot_s3,
  input wire               comes_s2,
  input wire               comes_s3,
  input wire [BODY-1:0]    a_s2,
  input wire [BODY-1:0]    b_s2,
  input wire [BODY-1:0]    a_s3,
  input wire [BODY-1:0]    b_s3,
  input wire [SLOT-1:0]    come,
  input wire               beats_some,
  input wire               enters,
  input wire               held_s5,
  input wire [7:0]         free_at_s5,
  input wire [7:0]         slot_after,
  input wire [7:0]         issue_free_at,
  input wire [SLOT-1:0]    asked_slot,
  input wire [BODY-1:0]    asked_a,
  input wire [BODY-1:0]    asked_b,
  input wire               asked_moves_a,
  input wire               asked_moves_b,
  input wire [SLOTS-1:0]   occupied,
  input wire [19:0]        to_enter,
  input wire [19:0]        to_fill,
  input wire [19:0]        filled_first,
  input wire               more,
  input wire               filling,
  input wire               owed,
  input wire               decides,
  input wire               some_free,
  input wire [SLOTS-1:0]   renewed,
  input wire [DEPTH-1:0]   not_held,
  input wire [DEPTH-1:0]   pick,
  input wire [DEPTH-1:0]   oldest,
  input wire [DEPTH-1:0]   from_pick,
  input wire [SLOTS-DEPTH-1:0] fresh,
  input wire [SLOTS-DEPTH-1:0] place,
  input wire [SLOTS-1:0]   held,
  input wire [DEPTH:0]     common,
  input wire [SLOTS-1:0]   moves,
  input wire [10:0]        patience,
  input wire               out_of_patience,
  input wire               oldest_goes,
  input wire [(SLOT+2*BODY+2)*(SLOTS+1)-1:0] in,
  input wire [8*(SLOTS+1)-1:0] in_free_at,
  input wire               held_before,
  input wire               meets_hazard,
  input wire [31:0]        met
);
  localparam integer ALL    = 1 << COLLISION;    // numbers of collisions
  localparam integer BODIES = 1 << BODY;
  localparam integer COMING = SLOTS - DEPTH;
  integer i;

  // ---- The sequence of a step: passes, with a drain of a window or more behind each. An error ends it at any time.

  (* anyseq *) reg begins, fails;
  reg       begun = 1'b0, running, in_pass, first_pass, later, pass_parity, before_phase;
  reg [19:0] settled;
  reg [7:0] idle;                                // cycles since the step began or a pass ended
  wire      pass_ends;
  wire [COLLISION:0] all = collisions[COLLISION:0];
  always @(posedge clk) begin
    begun        <= 1'b1;
    before_phase <= phase;
    settled      <= collisions;
    idle <= clear ? 8'd0 : pass_ends ? 8'd1 : idle + {7'd0, idle != 8'hff};
    if (clear) {running, in_pass, first_pass, later, pass_parity} <= 5'b10100;
    else if (fails) {running, in_pass} <= 2'b00;
    else if (begins) {in_pass, first_pass} <= 2'b10;
    else if (pass_ends) {in_pass, later, pass_parity} <= {2'b01, ~pass_parity};
  end
  always @* begin
    assume (begun | clear);
    assume (clear ? ~phase & ~in_pass & ~begins & ~fails : phase == ~before_phase);
    assume ((collisions != 20'd0) & (collisions <= ALL) & (clear | (collisions == settled)));
    assume (~begins | (running & ~in_pass & phase & (idle >= (first_pass ? 8'd2 : 2*WINDOW - 1))));
    assume ((passing == in_pass) & (parity == pass_parity));
  end

  // ---- Collisions that come, by their number in the pass

  reg  [COLLISION:0]   taken, known, loaded, loaded_rest;
  reg                  s1, s2, s3, s5;           // s5: at stage 4 in phase 1, at stage 5 in phase 0
  reg  [COLLISION-1:0] number_s1, number_s2, number_s3, number_s5;
  (* mem2reg *) reg [BODY-1:0] a [0:ALL-1], b [0:ALL-1];
  (* mem2reg *) reg [SLOT-1:0] slot_of [0:ALL-1];    // number of its record
  reg  [ALL-1:0]       moves_a, moves_b;
  always @(posedge clk) begin
    {s1, s2, s3} <= {take, s1, s2} & {3{~clear & ~fails}};
    {number_s1, number_s2, number_s3} <= {taken[COLLISION-1:0], number_s1, number_s2};
    if (clear) s5 <= 1'b0;
    else if (~phase) {s5, number_s5} <= {s3, number_s3};
    if (clear | pass_ends) {taken, known, loaded, loaded_rest} <= 0;
    else begin
      taken       <= taken + take;
      known       <= known + s3;
      loaded      <= loaded + loads;
      loaded_rest <= loaded_rest + loads_rest;
    end
    if (take) slot_of[taken[COLLISION-1:0]] <= next_slot;
    if (s1) a[number_s1] <= a_s1;
    if (s1) b[number_s1] <= b_s1;
    if (s3) moves_a[number_s3] <= moves_a_s3;
    if (s3) moves_b[number_s3] <= moves_b_s3;
  end
  always @* begin
    assume (~take | (phase & running & has_slot & (taken != all) & (~first_pass | (idle >= 8'd2))));
    assume (comes_s1 == s1);
    // All passes have the same collisions. A last use has one bit of the number of its pass, and relies on this.
    assume (~s1 | ~later | ((a_s1 == a[number_s1]) & (b_s1 == b[number_s1])));
    assume (~s3 | ~later | ((moves_a_s3 == moves_a[number_s3]) & (moves_b_s3 == moves_b[number_s3])));
    // A collision of a body with itself is an error, unless it is padding.
    assume (~s3 | (a[number_s3] != b[number_s3]) | ~(moves_a_s3 & moves_b_s3));
  end

  // ---- The model of the queue

  reg  [COLLISION:0] entered, issued;
  reg  [ALL-1:0]     done;                       // have issued
  (* mem2reg *) reg [7:0] busy [0:BODIES-1];     // slots until the body is free
  reg  [10:0]        passed_over;                // slots in which the oldest one did not issue
  reg                deciding;
  reg  [COLLISION-1:0] eldest, chosen;
  reg                  some_chosen, some_inside;
  reg  [BODY-1:0]      eldest_a, eldest_b;
  reg                  eldest_moves_a, eldest_moves_b;
  reg  [ALL-1:0]       shares, is_free;
  (* mem2reg *) reg [7:0] held_for [0:ALL-1];    // slots until both of its bodies are free
  always @* begin
    {some_inside, eldest} = 0;
    for (i = ALL - 1; i >= 0; i = i - 1) if ((i < entered) & ~done[i]) {some_inside, eldest} = {1'b1, i[COLLISION-1:0]};
    {eldest_a, eldest_moves_a} = {a[eldest], moves_a[eldest]};
    {eldest_b, eldest_moves_b} = {b[eldest], moves_b[eldest]};
    {some_chosen, chosen} = 0;
    for (i = ALL - 1; i >= 0; i = i - 1) begin
      shares[i] = (moves_a[i] & ((eldest_moves_a & (a[i] == eldest_a)) | (eldest_moves_b & (a[i] == eldest_b))))
                | (moves_b[i] & ((eldest_moves_a & (b[i] == eldest_a)) | (eldest_moves_b & (b[i] == eldest_b))));
      held_for[i] = moves_a[i] ? busy[a[i]] : 8'd0;
      if (moves_b[i] & (busy[b[i]] > held_for[i])) held_for[i] = busy[b[i]];
      is_free[i] = (i < entered) & ~done[i] & (held_for[i] == 0)
                 & ((passed_over < PATIENCE) | (i == eldest) | ~shares[i]);
      if (is_free[i]) {some_chosen, chosen} = {1'b1, i[COLLISION-1:0]};
    end
  end
  wire [COLLISION:0] least = (all < DEPTH) ? all : DEPTH;
  wire slot    = in_pass & ~phase;
  wire fills   = entered < least;
  wire is_full = (entered == all) | (entered - issued == DEPTH);
  wire there   = (entered < known) & (entered < loaded_rest);
  wire goes    = slot & deciding & some_chosen;
  wire joins   = slot & there & (fills | ~is_full | (goes & (entered != all)));
  wire passes  = slot & (deciding | (fills & there));       // a slot
  assign pass_ends = goes & (issued == all - 1'b1);
  reg  [BODY-1:0]      goes_a, goes_b;
  reg                  goes_moves_a, goes_moves_b;
  always @* begin
    {goes_a, goes_moves_a} = {a[chosen], moves_a[chosen] & goes};
    {goes_b, goes_moves_b} = {b[chosen], moves_b[chosen] & goes};
  end
  always @(posedge clk) begin
    deciding <= in_pass & phase & is_full & has_room & ~clear & ~fails;
    if (clear | pass_ends) {entered, issued} <= 0;
    else {entered, issued} <= {entered + joins, issued + goes};
    done <= (clear | pass_ends) ? 0 : done | ({{(ALL-1){1'b0}}, goes} << chosen);
    for (i = 0; i < BODIES; i = i + 1) begin
      if (~in_pass) busy[i] <= 0;
      else if ((goes_moves_a & (goes_a == i)) | (goes_moves_b & (goes_b == i))) busy[i] <= WINDOW - 1;
      else if (slot & deciding & (busy[i] != 0)) busy[i] <= busy[i] - 1'b1;
    end
    if (~in_pass | (goes & (chosen == eldest))) passed_over <= 0;
    else if (slot & deciding) passed_over <= passed_over + 1'b1;
  end

  // Collisions that met a hazard: not free in the first slot in which they were the oldest, told as they issue.
  reg  [1:0] met_now, met_before;
  reg        waited;
  always @(posedge clk) begin
    if (~in_pass | (goes & (chosen == eldest))) waited <= 1'b0;
    else if (slot & deciding) waited <= 1'b1;
    met_now    <= clear ? 2'd0 : met_now + (goes & (chosen == eldest) & waited);
    met_before <= clear ? 2'd0 : met_now;
  end

  // ---- What the parts of the queue do

  reg [7:0] slot_number, free_of_issue;          // number of the slot, modulo 256
  reg       goes_before;
  always @(posedge clk) begin
    goes_before <= goes;
    slot_number <= ~in_pass ? 8'd0 : slot_number + passes;
    if (goes) free_of_issue <= slot_number + WINDOW;
  end
`ifdef CUT
  // The proof by induction takes hazards and records for granted.
  `define OF_A_PART assume
`else
  `define OF_A_PART assert

  // Behind the issue stand the registers of the two slots before, and the last uses that they write.
  localparam [COLLISION:0] NEVER = {1'b1, {COLLISION{1'b0}}};
  reg                early_v_a, early_v_b, body_v_a, body_v_b, issued_now, ready;
  reg  [BODY-1:0]    early_of_a, early_of_b, body_of_a, body_of_b;
  reg  [COLLISION:0] early_use, body_use, read_a, read_b;
  (* mem2reg *) reg [COLLISION:0] last_use [0:BODIES-1];
  reg  [ALL-1:0]     bit_of_first, bit_of_rest;  // all bits of its rows go the same way: these stand for them
  reg                bit_of_second;
  always @(posedge clk) begin
    ready         <= phase & beats_there & (taken != loaded) & ~clear;
    issued_now    <= goes & ~fails;
    bit_of_second <= bit_of_rest[chosen];
    if (loads) bit_of_first[loaded[COLLISION-1:0]] <= beats[0];
    if (loads_rest) bit_of_rest[loaded_rest[COLLISION-1:0]] <= beats[0];
    {early_v_a, early_v_b}   <= {goes_moves_a, goes_moves_b} & {2{~clear}};
    {early_of_a, early_of_b} <= {goes_a, goes_b};
    early_use                <= {pass_parity, issued[COLLISION-1:0]};
    if (clear) {body_v_a, body_v_b} <= 2'b00;
    else if (phase) begin
      {body_v_a, body_v_b}   <= {early_v_a, early_v_b};
      {body_of_a, body_of_b} <= {early_of_a, early_of_b};
      body_use               <= early_use;
    end
    {read_a, read_b} <= {last_use[a_s1], last_use[b_s1]};
    for (i = 0; i < BODIES; i = i + 1) begin
      if (clear) last_use[i] <= NEVER;
      else if (~phase & ((body_v_a & (body_of_a == i)) | (body_v_b & (body_of_b == i)))) last_use[i] <= body_use;
    end
  end
  always @* begin
    assume ({early_moves_a, early_moves_b, body_moves_a, body_moves_b} == {early_v_a, early_v_b, body_v_a, body_v_b});
    assume ((~early_v_a | (early_a == early_of_a)) & (~early_v_b | (early_b == early_of_b)));
    assume ((~body_v_a | (body_a == body_of_a)) & (~body_v_b | (body_b == body_of_b)));
    if (s2) assume ({use_a_s2, use_b_s2} == {read_a, read_b});
    if (s3) assume (facts_s3 == {number_s3, a_s3, b_s3, moves_a_s3, moves_b_s3});
    if (running & ~clear) begin
      assert (loads == ready);
      if (issues) assert (facts == {chosen, goes_a, goes_b, goes_moves_a, goes_moves_b});
      if (issues) assert (first[0] == bit_of_first[chosen]);
      if (issued_now) assert (rest[0] == bit_of_second);
      if (body_v_a | body_v_b) assert (use_of_body == body_use);
    end
  end
`endif

  always @* if (running & ~clear) begin
    `OF_A_PART (~loads_rest | (loaded_rest != taken));
    `OF_A_PART (beats_some == (loaded_rest != entered));
    `OF_A_PART (slot_after == slot_number + 8'd1);
    if (goes_before) `OF_A_PART (issue_free_at == free_of_issue);
    if (s5 & ~phase) `OF_A_PART (held_s5 == (held_for[number_s5] != 0));
    if (s5 & ~phase & held_s5) `OF_A_PART (free_at_s5 == slot_number + held_for[number_s5]);
  end

  // ---- Properties

  (* mem2reg *) reg [7:0] since [0:BODIES-1];    // cycles since an issue that moves the body
  always @(posedge clk) for (i = 0; i < BODIES; i = i + 1) begin
    if (clear) since[i] <= 8'hff;
    else if (issues & ((asked_moves_a & (asked_a == i)) | (asked_moves_b & (asked_b == i)))) since[i] <= 8'd1;
    else if (since[i] != 8'hff) since[i] <= since[i] + 8'd1;
  end
  always @* if (running & ~clear) begin
    // The same collision issues in the same slot, with its bodies and its record.
    assert (issues == goes);
    if (issues) assert (asked_slot == slot_of[chosen]);
    if (issues) assert ({asked_moves_a, asked_moves_b} == {goes_moves_a, goes_moves_b});
    if (issues) assert ((asked_a == goes_a) & (asked_b == goes_b));
    // Each one issues once, in a pass that ends with the last of them.
    if (issues) assert (passing & ~phase & ~done[chosen] & (chosen < all));
    // No collision issues within a window of another that writes one of its bodies.
    if (issues & asked_moves_a) assert (since[asked_a] >= 2*WINDOW);
    if (issues & asked_moves_b) assert (since[asked_b] >= 2*WINDOW);
    // The oldest one goes a window after the end of its patience.
    assert (passed_over < PATIENCE + WINDOW);
    // Each slot issues, idles or waits, or a collision enters.
    assert (stalls == (slot & deciding & ~some_chosen));
    assert (waits == (slot & ~deciding & ~(fills & there)));
    assert (enters == joins);
    assert (hazards[1:0] == met_before | (&hazards));
    // The finder takes one while there is a place.
    assert (has_slot == (taken - entered != COMING));
  end

  // ---- The invariant: the value of each register of the queue, in terms of the model

  localparam integer WIDTH = SLOT + 2*BODY + 2;
  (* mem2reg *) reg [COLLISION-1:0] number_in [0:SLOTS];   // number of the collision in a place
  always @* number_in[SLOTS] = number_s3;
  always @(posedge clk) for (i = 0; i < SLOTS; i = i + 1) begin
    if ((i >= DEPTH) & place[(i >= DEPTH) ? i - DEPTH : 0]) number_in[i] <= number_s3;
    else if (moves[i]) number_in[i] <= number_in[i+1];
  end
  function [COLLISION:0] ones(input [ALL-1:0] of);
    begin
      ones = 0;
      for (i = 0; i < ALL; i = i + 1) ones = ones + of[i];
    end
  endfunction
  integer j;
  reg [WIDTH-1:0]      its;
  reg [COLLISION-1:0]  n;
  reg                  told, lower, found;
  wire [DEPTH-1:0]     low   = from_pick & ~(from_pick << 1);
  wire                 rests = ~in_pass & (idle >= 8'd2);
  wire                 still = rests | (in_pass & fills);      // nothing has issued yet
  always @* if (running & ~clear) begin
    // Collisions that come, and counts.
    assert ((issued <= entered) & (entered <= known) & (known <= taken) & (taken <= all) & (entered <= loaded_rest));
    assert ((loaded_rest <= taken) & (taken - entered <= COMING) & (come == taken - entered));
    assert ((taken == known + s1 + s2 + s3) & (phase ? ~s1 & ~s3 : ~s2));
    assert ({comes_s2, comes_s3} == {s2, s3});
    if (s1) assert ((number_s1 == known + s3) & (slot_s1 == slot_of[number_s1]));
    if (s2) assert ((number_s2 == known) & (slot_s2 == slot_of[number_s2]));
    if (s2) assert ((a_s2 == a[number_s2]) & (b_s2 == b[number_s2]));
    if (s3) assert ((number_s3 == known) & (slot_s3 == slot_of[number_s3]));
    if (s3) assert ((a_s3 == a[number_s3]) & (b_s3 == b[number_s3]));
    if (s5) assert ((entered < known) & (number_s5 + 1'b1 == known));
    assert ((issued == ones(done)) & (entered - issued <= DEPTH) & ((done >> entered) == 0));
    assert (~deciding | (slot & is_full));
    assert (filled_first == least);
    if (~in_pass) assert ((entered == 0) & ~deciding & (rests | (taken == 0)) & (first_pass | (idle != 0)));
    if (first_pass & (idle < 8'd2)) assert (phase == (idle == 8'd0));
    if (in_pass) assert ((issued != all) & ~first_pass);
    if (in_pass | rests) begin
      assert ((more == (entered != all)) & (to_enter == all - entered));
      assert ((filling == fills) & (~fills | (to_fill == least - entered)) & (owed == (~fills & ~is_full)));
      assert (patience == ((passed_over < PATIENCE) ? passed_over : PATIENCE));
      assert (out_of_patience == (passed_over >= PATIENCE));
    end
    assert ((decides == deciding) & (oldest_goes == (goes & (chosen == eldest))) & (held_before == waited));
    assert ((met[1:0] == met_before) & (met_now == met_before + meets_hazard));
    if (passed_over >= PATIENCE) assert (passed_over - PATIENCE + held_for[eldest] < WINDOW);
    if (still) assert ((issued == 0) & (passed_over == 0) & ~waited);
    for (i = 0; i < BODIES; i = i + 1) begin
      assert (busy[i] < WINDOW);
      if (still) assert (busy[i] == 0);
      if (first_pass) assert (since[i] == 8'hff);
      else assert (in_pass ? since[i] + phase >= 2 * (WINDOW - busy[i]) : since[i] >= idle);
    end

    // The slot that is decided.
    assert (~decides ? pick == 0 : (pick == low) & ((pick & ~occupied[DEPTH-1:0]) == 0) & (some_free == some_chosen));
    if (decides) assert ((|pick) == some_chosen);
    if (~phase & ~goes) assert (~asked_moves_a & ~asked_moves_b);
    if (phase & in_pass & some_inside) begin
      assert ((asked_a == eldest_a) & (asked_b == eldest_b));
      assert ((asked_moves_a == eldest_moves_a) & (asked_moves_b == eldest_moves_b));
    end

    // Places: the queue fills from the top, an issue leaves a hole in which the places behind it go.
    assert (occupied[SLOTS-1:DEPTH] == (1 << (known - entered)) - 1);
    if (~first_pass | rests) assert (ones(occupied[DEPTH-1:0]) == entered - issued);
    if (still) assert (&from_pick);
    if (in_pass & ~fills & ~is_full) assert ((from_pick != 0) & (occupied[DEPTH-1:0] == ~low));
    lower = 1'b0;
    for (i = 0; i < SLOTS; i = i + 1) begin
      its  = in[WIDTH*i +: WIDTH];
      n    = number_in[i];
      told = s5 & (n == number_s5);
      if (i < DEPTH - 1) assert (~from_pick[i] | from_pick[i + 1]);
      if ((i < DEPTH) & still) assert (occupied[i] == (i + entered >= DEPTH));
      if (occupied[i]) begin
        assert (its == {slot_of[n], a[n], b[n], moves_a[n], moves_b[n]});
        assert ((n < known) & ((i < DEPTH) ? (n < entered) & ~done[n] : n == entered + (i - DEPTH)));
        for (j = 0; j < i; j = j + 1) assert (~occupied[j] | (number_in[j] < n));
        if (i >= DEPTH) assert (fresh[(i >= DEPTH) ? i - DEPTH : 0] == told);
        if (i < DEPTH) assert (~told);
        // Free, or held until a slot.
        if (~told) begin
          if (phase & renewed[i]) begin
            assert (goes_before & (held_for[n] == WINDOW - 1));
            assert (free_of_issue == slot_number + held_for[n]);
          end else begin
            assert ((held[i] | renewed[i]) == (held_for[n] != 0));
            if (held_for[n] != 0) assert (in_free_at[8*i +: 8] == slot_number + held_for[n]);
          end
        end
      end
      if (i < DEPTH) begin
        if (phase & in_pass) assert ((not_held[i] & ~renewed[i]) == (occupied[i] & is_free[n]));
        if (~first_pass | rests) assert (oldest[i] == (occupied[i] & ~lower));
        if (pick[i]) assert (n == chosen);
      end
      lower = lower | occupied[i];
      if ((i <= DEPTH) & ~phase & in_pass & some_inside & occupied[i]) begin
        assert (common[(i <= DEPTH) ? i : 0] == (shares[n] & (n != eldest)));
      end
    end
    for (j = 0; j < ALL; j = j + 1) begin
      found = 1'b0;
      for (i = 0; i < DEPTH; i = i + 1) found = found | (occupied[i] & (number_in[i] == j));
      if ((j < entered) & ~done[j]) assert (found);
    end
  end
endmodule

bind pgs_queue pgs_queue_properties #(
  .DEPTH(DEPTH), .SLOTS(SLOTS), .SLOT(SLOT), .BODY(BODY), .COLLISION(COLLISION), .WINDOW(WINDOW), .PATIENCE(PATIENCE),
  .FACTS(FACTS)
) properties (.*);

`default_nettype wire
