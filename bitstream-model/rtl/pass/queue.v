// The issue queue of a pass (specification, section 8): the oldest collision that is free of hazards
// goes. It decides in slots of two cycles, so that nothing depends on the time at which a beat comes.
//
//   taken by the finder -> a slot -> last uses, pairs, timer -> enters -> free -> issues
//
// A record keeps its slot from the finder to its issue. There are a few more slots than the depth, for
// records that have not entered yet. A record may issue once it has entered. Two matrices have a bit for each pair of slots: which one is older, and whether they
// have a moving body in common. With them no number of a body lies on the way from one decision to the
// next one:
//
//   phase 1    the oldest of the free ones, by the order; the ones in conflict with the oldest of all
//   phase 0    it issues; timers of the ones in conflict with it; the free ones; the oldest of all
//
// A timer counts the slots until a collision is free. While nothing is under way, all are 0.
`default_nettype none

module queue #(
  parameter DEPTH     = 64,
  parameter SLOTS     = 68,
  parameter SLOT      = 7,                     // bits of a slot's number
  parameter BODY      = 16,
  parameter COLLISION = 17,
  parameter WINDOW    = 162,                   // slots; at most 255
  parameter FACTS     = 181
) (
  input  wire                 clk,
  input  wire                 clear,           // a step begins
  input  wire                 phase,           // 0 in the cycles in which a collision can be issued; alternates in a pass
  input  wire                 passing,         // a pass has collisions left
  input  wire                 parity,          // of the pass
  input  wire [19:0]          collisions,

  // From the finder: a collision is taken, and 1, 2 and 3 cycles later.
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
  output wire [FACTS-1:0]     facts,

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
`include "pgs_interface.vh"

  localparam [7:0]  HELD     = WINDOW - 1;     // timer of a collision after an issue in conflict
  localparam [10:0] PATIENCE = QUEUE_PATIENCE[10:0] * WINDOW;

  // ---- Slots and records

  wire [SLOT-1:0] next_slot;
  reg  [SLOT-1:0] pick_slot;
  wire            beats_some, enters;
  reg             comes_s2, comes_s3, comes_s4, comes_s5;
  reg  [SLOT-1:0] slot_s1, slot_s2, slot_s3, slot_s4, slot_s5;
  queue_records #(.SLOTS(SLOTS), .SLOT(SLOT), .FACTS(FACTS)) records (
    .clk(clk), .clear(clear), .phase(phase),
    .free(has_slot), .next(next_slot), .take(take), .release_slot(issues), .released(pick_slot),
    .beats_there(beats_there), .beats(beats), .loads(loads), .loads_rest(loads_rest),
    .facts_come(comes_s3), .facts_slot(slot_s3), .facts_in(facts_s3), .some(beats_some), .enters(enters),
    .slot(pick_slot), .first(first), .rest(rest), .facts(facts)
  );

  reg [BODY-1:0]  a_s2, b_s2;
  always @(posedge clk) begin
    {comes_s2, comes_s3, comes_s4, comes_s5} <= {comes_s1, comes_s2, comes_s3, comes_s4} & {4{~clear}};
    slot_s1 <= next_slot;
    {slot_s2, slot_s3, slot_s4, slot_s5} <= {slot_s1, slot_s2, slot_s3, slot_s4};
    {a_s2, b_s2} <= {a_s1, b_s1};
  end
  wire passes_slot;
  wire [7:0] slots_s5;
  queue_hazard #(.BODY(BODY), .COLLISION(COLLISION), .WINDOW(WINDOW)) first_hazard (
    .clk(clk), .idle(~passing), .parity(parity), .passes_slot(passes_slot), .issues(issues),
    .a_s2(a_s2), .b_s2(b_s2), .use_a_s2(use_a_s2), .use_b_s2(use_b_s2),
    .moves_a_s3(moves_a_s3), .moves_b_s3(moves_b_s3), .slots_s5(slots_s5),
    .early_a(early_a), .early_b(early_b), .early_moves_a(early_moves_a), .early_moves_b(early_moves_b),
    .body_a(body_a), .body_b(body_b), .body_moves_a(body_moves_a), .body_moves_b(body_moves_b),
    .use_of_body(use_of_body)
  );

  // The next one to enter.
  wire [SLOT-1:0] entry;
  wire [SLOT:0]   come_left;
  wire            come_some, come_below;
  wire            unused = &{1'b0, come_left, come_below};
  fifo #(.WIDTH(SLOT), .ADDRESS(SLOT)) come (
    .clk(clk), .clear(clear), .push(comes_s4), .in(slot_s4), .pop(enters), .head(entry),
    .count(come_left), .some(come_some), .below(come_below)
  );

  // ---- Slots of the pass

  localparam [19:0] FULL = DEPTH;
  reg  [19:0] to_enter, to_fill, filled_first;
  reg         more, filling, owed;   // some have not entered; the queue is not full at first, or after an issue
  reg         decides, some_free;
  wire        begins = ~phase & passing;
  wire        there  = come_some & beats_some;
  assign issues      = decides & some_free;
  assign stalls      = decides & ~some_free;
  assign enters      = begins & there & (filling | owed | (issues & more));
  assign waits       = begins & ~decides & ~(filling & there);
  assign passes_slot = decides | (begins & filling & there);
  always @(posedge clk) begin
    filled_first <= (collisions < FULL) ? collisions : FULL;
    decides      <= phase & passing & ~filling & ~owed & has_room;
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

  // ---- Candidates

  localparam [SLOTS-1:0] ONE = 1;
  wire [SLOTS-1:0] place_s1 = comes_s1 ? ONE << slot_s1 : {SLOTS{1'b0}};
  wire [SLOTS-1:0] place_s3 = comes_s3 ? ONE << slot_s3 : {SLOTS{1'b0}};
  wire [SLOTS-1:0] place_s5 = comes_s5 ? ONE << slot_s5 : {SLOTS{1'b0}};
  wire [SLOTS-1:0] enter    = enters ? ONE << entry : {SLOTS{1'b0}};
  reg  [SLOTS-1:0] entered, free, pick, oldest, common;
  wire [SLOTS-1:0] entered_next = (entered & ~pick) | enter;
  wire [SLOTS-1:0] in_conflict;      // with the collision that comes
  wire [SLOTS-1:0] older_met, conflict_met, over;

  // Among the asked: the ones that no other is older than.
  wire [SLOTS-1:0] asked      = phase ? free : entered & ~pick;
  wire [SLOTS-1:0] first_of   = asked & ~older_met;
  pair_matrix #(.SLOTS(SLOTS), .ORDER(1)) order (
    .clk(clk), .place(place_s3), .below({SLOTS{1'b1}}), .above({SLOTS{1'b0}}), .ask(asked), .met(older_met)
  );
  pair_matrix #(.SLOTS(SLOTS)) conflicts (
    .clk(clk), .place(place_s3), .below(in_conflict), .above(in_conflict),
    .ask(phase ? oldest : pick), .met(conflict_met)
  );

  reg  [SLOT-1:0] first_slot;
  integer n;
  always @* begin
    first_slot = {SLOT{1'b0}};
    for (n = 0; n < SLOTS; n = n + 1) first_slot = first_slot | (n[SLOT-1:0] & {SLOT{first_of[n]}});
  end

  // Slots of patience in which the oldest one did not issue.
  reg  [10:0] patience;
  reg         out_of_patience;
  wire        oldest_goes = |(pick & oldest);
  wire        blocks = ~oldest_goes & (out_of_patience | (decides & (patience == PATIENCE - 11'd1)));
  always @(posedge clk) begin
    if (~phase) oldest <= first_of;
    if (phase) common <= conflict_met;
    pick <= (phase & passing & ~filling & ~owed & has_room) ? first_of : {SLOTS{1'b0}};
    some_free <= |free;
    if (phase) pick_slot <= first_slot;
    if (~passing) {out_of_patience, patience} <= 12'd0;
    else if (oldest_goes) {out_of_patience, patience} <= 12'd0;
    else if (decides & ~out_of_patience) begin
      patience        <= patience + 11'd1;
      out_of_patience <= blocks;
    end
    if (~passing) {entered, free} <= {2*SLOTS{1'b0}};
    else if (~phase) begin
      entered <= entered_next;
      free    <= entered_next & over & ~(common & {SLOTS{blocks}});
    end
  end

  genvar i;
  generate
    for (i = 0; i < SLOTS; i = i + 1) begin : g_slot
      reg [BODY-1:0] a, b;
      reg            moves_a, moves_b;
      reg            a_is_a, a_is_b, b_is_a, b_is_b;   // numbers of the one that comes, and of this one
      reg [7:0]      timer;
      wire [7:0]     slots = place_s5[i] ? slots_s5 : timer;
      assign in_conflict[i] = (moves_a_s3 & ((a_is_a & moves_a) | (a_is_b & moves_b)))
                            | (moves_b_s3 & ((b_is_a & moves_a) | (b_is_b & moves_b)));
      assign over[i]  = ~conflict_met[i] & ((slots == 8'd0) | ((slots == 8'd1) & passes_slot));
      always @(posedge clk) begin
        if (place_s1[i]) {a, b} <= {a_s1, b_s1};
        {a_is_a, a_is_b, b_is_a, b_is_b} <= {a_s2 == a, a_s2 == b, b_s2 == a, b_s2 == b};
        if (place_s3[i]) {moves_a, moves_b} <= {moves_a_s3, moves_b_s3};
        if (~passing) timer <= 8'd0;
        else if (~phase) timer <= conflict_met[i] ? HELD
                                : (passes_slot & (slots != 8'd0)) ? slots - 8'd1 : slots;
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
