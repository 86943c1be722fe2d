// The issue queue of a pass (specification, section 8): the oldest collision that is free of hazards
// goes. It decides in slots of two cycles, so that nothing depends on the time at which a beat comes.
//
// Collisions stand in places, the oldest in the lowest: the queue, and behind it a few places for collisions
// that have left the finder and not entered. When a collision enters, all collisions behind the one that
// issued move on by a place. So the order of the places is the order of the stream. A place holds the bodies
// of its collision, the slot from which on it is free, and the number of its record: records do not move.
//
//   phase 1    find the first of the free places, and the places that share a body with the oldest collision
//   phase 0    issue it, hold the places that share a body with it for the window, let a collision enter, and
//              find the free places
//
// Both cycles of a slot have the same comparators. They compare the bodies of all places with the bodies of
// the collision that issues, or with the bodies of the oldest collision.
`default_nettype none

module pgs_queue #(
  parameter integer DEPTH     = 64,
  parameter integer SLOTS     = 68,                    // places and records: COMING more than the depth
  parameter integer SLOT      = 7,                     // bits of a record's number
  parameter integer BODY      = 16,
  parameter integer COLLISION = 17,
  parameter integer WINDOW    = 162,                   // slots; at most 255
  parameter integer PATIENCE  = 648,                   // slots; at most 2047
  parameter integer FACTS     = 181
) (
  input  wire                 clk,
  input  wire                 clear,           // a step begins
  input  wire                 phase,           // 0 in the cycles in which a collision can be issued; alternates
  input  wire                 passing,         // a pass has collisions left
  input  wire                 parity,          // of the pass
  input  wire [19:0]          collisions,

  // From the finder: a collision is taken in phase 1, and 1, 2 and 3 cycles later.
  output wire                 has_slot,
  input  wire                 take,
  input  wire                 comes_s1,
  input  wire [BODY-1:0]      a_s1,
  input  wire [BODY-1:0]      b_s1,
  input  wire [COLLISION:0]   use_a_s2,
  input  wire [COLLISION:0]   use_b_s2,
  input  wire                 moves_a_s3,
  input  wire                 moves_b_s3,
  input  wire [FACTS-1:0]     facts_s3,

  input  wire                 beats_there,     // all beats of the next record
  input  wire [511:0]         beats,
  output wire                 loads,
  output wire                 loads_rest,

  // Issues.
  input  wire                 has_room,        // for the impulses
  output wire                 issues,
  output wire                 stalls,          // the slot is idle
  output wire                 waits,           // no slot passes
  output wire [31:0]          hazards,         // collisions that met a hazard; saturates; counted a cycle later
  output wire [511:0]         first,           // rows 0 to 3 in the cycle of an issue
  output wire [511:0]         rest,            // rows 4 to 7 in the next one
  output wire [FACTS-1:0]     facts,           // in the cycle of an issue

  // Issues in the two slots before.
  input  wire [BODY-1:0]      early_a,
  input  wire [BODY-1:0]      early_b,
  input  wire                 early_moves_a,
  input  wire                 early_moves_b,
  input  wire [BODY-1:0]      body_a,
  input  wire [BODY-1:0]      body_b,
  input  wire                 body_moves_a,
  input  wire                 body_moves_b,
  output wire [COLLISION:0]   use_of_body
);
  localparam integer COMING  = SLOTS - DEPTH;

  // ---- Collisions that come, and records

  wire [SLOT-1:0] next_slot;
  reg  [SLOT-1:0] asked_slot;        // record of the one that issues, in phase 0; of the oldest one, in phase 1
  reg  [BODY-1:0] asked_a, asked_b;  // its bodies
  reg             asked_moves_a, asked_moves_b;
  wire            beats_some, enters;
  reg             comes_s2, comes_s3;
  reg  [SLOT-1:0] slot_s1, slot_s2, slot_s3;
  pgs_queue_records #(.SLOTS(SLOTS), .SLOT(SLOT), .FACTS(FACTS)) records (
    .clk(clk), .clear(clear), .phase(phase),
    .next(next_slot), .take(take), .release_slot(issues), .released(asked_slot),
    .beats_there(beats_there), .beats(beats), .loads(loads), .loads_rest(loads_rest),
    .facts_come(comes_s3), .facts_slot(slot_s3), .facts_in(facts_s3), .some(beats_some), .enters(enters),
    .slot(asked_slot), .first(first), .rest(rest), .facts(facts)
  );

  // Taken and not entered: there is a place for each.
  localparam [SLOT-1:0] ALL_COME = COMING[SLOT-1:0];
  reg  [SLOT-1:0] come;
  assign has_slot = come != ALL_COME;
  reg  [BODY-1:0] a_s2, b_s2, a_s3, b_s3;
  always @(posedge clk) begin
    come <= clear ? {SLOT{1'b0}} : come + {{(SLOT-1){1'b0}}, take} - {{(SLOT-1){1'b0}}, enters};
    {comes_s2, comes_s3}           <= {comes_s1, comes_s2} & {2{~clear}};
    {slot_s1, slot_s2, slot_s3}    <= {next_slot, slot_s1, slot_s2};
    {a_s2, b_s2, a_s3, b_s3}       <= {a_s1, b_s1, a_s2, b_s2};
  end

  wire       passes_slot, held_s5;
  wire [7:0] free_at_s5, slot_after, issue_free_at;
  pgs_queue_hazard #(.BODY(BODY), .COLLISION(COLLISION), .WINDOW(WINDOW)) first_hazard (
    .clk(clk), .idle(~passing), .parity(parity), .passes_slot(passes_slot), .issues(issues),
    .a_s2(a_s2), .b_s2(b_s2), .use_a_s2(use_a_s2), .use_b_s2(use_b_s2),
    .moves_a_s3(moves_a_s3), .moves_b_s3(moves_b_s3), .held_s5(held_s5), .free_at_s5(free_at_s5),
    .slot_after(slot_after), .issue_free_at(issue_free_at),
    .early_a(early_a), .early_b(early_b), .early_moves_a(early_moves_a), .early_moves_b(early_moves_b),
    .body_a(body_a), .body_b(body_b), .body_moves_a(body_moves_a), .body_moves_b(body_moves_b),
    .use_of_body(use_of_body)
  );

  // ---- Slots of the pass

  localparam [19:0] FULL = DEPTH[19:0];
  reg  [SLOTS-1:0] occupied;         // places
  reg  [19:0] to_enter, to_fill, filled_first;
  reg         more, filling, owed;   // some have not entered; the queue is not full at first, or after an issue
  reg         decides, some_free;
  wire        begins      = ~phase & passing;
  wire        there       = occupied[DEPTH] & beats_some;
  wire        will_decide = phase & passing & ~filling & ~owed & has_room;
  assign issues      = decides & some_free;
  assign stalls      = decides & ~some_free;
  assign enters      = begins & there & (filling | owed | (issues & more));
  assign waits       = begins & ~decides & ~(filling & there);
  assign passes_slot = decides | (begins & filling & there);
  always @(posedge clk) begin
    filled_first <= (collisions < FULL) ? collisions : FULL;
    decides      <= will_decide;
    if (~passing) begin
      to_enter <= collisions;
      to_fill  <= filled_first;
      {more, filling, owed} <= 3'b110;
    end else begin
      if (enters) begin
        to_enter <= to_enter - 20'd1;
        more     <= to_enter != 20'd1;
        to_fill  <= to_fill - 20'd1;
        if (to_fill == 20'd1) filling <= 1'b0;
      end
      if (enters) owed <= 1'b0;
      else if (issues & more) owed <= 1'b1;
    end
  end

  // ---- The first place that is asked for: free, or without the one that issues the oldest. One that enters is
  // the oldest if there is no other.

  localparam WIDTH = SLOT + 2*BODY + 2;
  reg  [SLOTS-1:0] renewed;          // had a body in common with the one that issued in the slot before
  reg  [DEPTH-1:0] not_held, pick, oldest, from_pick;
  wire [DEPTH-1:0] free  = not_held & ~renewed[DEPTH-1:0];
  wire [DEPTH:0]   asked = phase ? {1'b0, free} : {1'b1, occupied[DEPTH-1:0] & ~pick};
  wire [DEPTH:0]   from_first, first_of;
  wire [WIDTH*(SLOTS+1)-1:0] in;     // where the record of a place is, and its bodies; last, of the one that comes
  wire [WIDTH-1:0] first_record;
  pgs_queue_first #(.PLACES(DEPTH + 1), .WIDTH(WIDTH)) of_the_places (
    .asked(asked), .records(in[WIDTH*(DEPTH+1)-1:0]), .from(from_first), .first(first_of), .record(first_record)
  );

  // ---- Places

  // What places have behind a cycle in which these of them take over from the next one.
  function [SLOTS-1:0] moved;
    input [SLOTS-1:0] moves, of;
    moved = (moves & (of >> 1)) | (~moves & of);
  endfunction

  reg  [COMING-1:0] fresh;           // the place of the collision at stages 4 and 5
  reg  [SLOTS-1:0]  held;            // not free since an earlier slot
  reg  [DEPTH:0]    common;          // with the oldest
  wire [SLOTS-1:0]  moves = {{COMING{enters}}, {DEPTH{enters}} & from_pick};
  // A collision comes to the first place behind the queue that is empty then.
  wire [COMING-1:0] behind = occupied[SLOTS-1:DEPTH];
  wire [COMING-1:0] place  = {COMING{comes_s3}}
                           & (enters ? behind & ~(behind >> 1) : ~behind & {behind[COMING-2:0], 1'b1});
  wire [SLOTS-1:0]  told   = {fresh, {DEPTH{1'b0}}};
  wire [SLOTS-1:0]  meets, over;
  wire              holds_s5 = held_s5 & ~(passes_slot & (free_at_s5 == slot_after));
  wire [SLOTS-1:0]  holds    = (told & {SLOTS{holds_s5}}) | (~told & (held | renewed) & ~over);

  reg  [10:0] patience;              // slots in which the oldest one did not issue
  reg         out_of_patience, oldest_goes;
  wire        blocks = ~oldest_goes & (out_of_patience | (decides & (patience == PATIENCE[10:0] - 11'd1)));
  wire [SLOTS-1:0] blocked = {{(COMING-1){1'b0}}, common} & {SLOTS{blocks}};
  wire [SLOTS-1:0] stays   = occupied & {{COMING{1'b1}}, ~pick};
  wire [SLOTS-1:0] frees   = moved(moves, stays & ~holds & ~blocked);
  wire [SLOTS-1:0] firsts  = moved(moves, {{(COMING-1){1'b0}}, first_of});
  wire unused = &{1'b0, frees, firsts, from_first[DEPTH]};   // bits of the places behind the queue
  always @(posedge clk) begin
    {asked_slot, asked_a, asked_b, asked_moves_a, asked_moves_b} <= first_record;
    if (phase & ~will_decide) {asked_moves_a, asked_moves_b} <= 2'b00;
    pick        <= first_of[DEPTH-1:0] & {DEPTH{will_decide}};
    some_free   <= |free;
    oldest_goes <= will_decide & |(oldest & free);
    if (~passing) from_pick <= {DEPTH{1'b1}};
    else if (will_decide) from_pick <= from_first[DEPTH-1:0];

    if (phase) common <= meets[DEPTH:0] & {1'b1, ~oldest};
    else begin
      oldest        <= firsts[DEPTH-1:0];
      occupied      <= moved(moves, stays) | {place, {DEPTH{1'b0}}};
      fresh         <= place;
      not_held      <= frees[DEPTH-1:0];
      held          <= moved(moves, holds);
      renewed       <= moved(moves, meets);
    end
    if (clear) occupied <= {SLOTS{1'b0}};
    if (~passing) begin
      not_held <= {DEPTH{1'b0}};
      held     <= {SLOTS{1'b0}};
      {out_of_patience, patience} <= 12'd0;
    end else if (oldest_goes) {out_of_patience, patience} <= 12'd0;
    else if (decides & ~out_of_patience) begin
      patience        <= patience + 11'd1;
      out_of_patience <= blocks;
    end
  end

  wire [8*(SLOTS+1)-1:0] in_free_at;
  assign in[WIDTH*SLOTS +: WIDTH]  = {slot_s3, a_s3, b_s3, moves_a_s3, moves_b_s3};
  assign in_free_at[8*SLOTS +: 8] = free_at_s5;
  wire unused_free_at = &{1'b0, in_free_at[7:0]};
  genvar i;
  generate
    for (i = 0; i < SLOTS; i = i + 1) begin : g_place
      reg [SLOT-1:0] slot;
      reg [BODY-1:0] a, b;
      reg            moves_a, moves_b;
      reg [7:0]      free_at;
      wire           comes = (i >= DEPTH) & place[(i >= DEPTH) ? i - DEPTH : 0];
      assign in[WIDTH*i +: WIDTH]  = {slot, a, b, moves_a, moves_b};
      assign in_free_at[8*i +: 8] = told[i] ? free_at_s5 : free_at;
      assign over[i]  = passes_slot & (free_at == slot_after);
      assign meets[i] = (asked_moves_a & ((moves_a & (a == asked_a)) | (moves_b & (b == asked_a))))
                      | (asked_moves_b & ((moves_a & (a == asked_b)) | (moves_b & (b == asked_b))));
      always @(posedge clk) begin
        if (comes) {slot, a, b, moves_a, moves_b} <= in[WIDTH*SLOTS +: WIDTH];
        else if (moves[i]) {slot, a, b, moves_a, moves_b} <= in[WIDTH*(i+1) +: WIDTH];
        if (phase) begin
          if (renewed[i]) free_at <= issue_free_at;
        end else if (moves[i]) free_at <= in_free_at[8*(i+1) +: 8];
        else if (told[i]) free_at <= free_at_s5;
      end
    end
  endgenerate

  // ---- Collisions that met a hazard: the oldest one that does not go at once

  reg         held_before, meets_hazard, full;
  reg  [31:0] met;
  assign hazards = met | {32{full}};
  always @(posedge clk) begin
    if (~passing | oldest_goes) held_before <= 1'b0;
    else if (decides) held_before <= 1'b1;
    meets_hazard <= oldest_goes & held_before & ~clear;
    if (clear) {full, met} <= 33'd0;
    else {full, met} <= {full, 32'd0} | ({1'b0, met} + {32'd0, meets_hazard});
  end
endmodule

`default_nettype wire
