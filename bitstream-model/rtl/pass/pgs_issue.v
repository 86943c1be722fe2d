// Issues collisions into a pass: one in every second cycle, in the order of the records, as soon as
// its beats are there, with room for its impulses in a pass that sends them, and, interlocked, no
// collision under way writes one of its bodies.
//
// A collision is under way until it is *retired*: its write-back can then be read. Because all
// collisions of a pass take the same time, a count of the retired ones tells of each whether it is.
`default_nettype none

module pgs_issue #(
  parameter integer COLLISION      = 17,
  parameter integer INTERLOCKED    = 1,
  parameter integer CONTACT_WINDOW = 324,
  parameter integer FRICTION_WINDOW = 190
) (
  input  wire                 clk,
  input  wire                 clear,           // a step begins
  input  wire                 phase,           // 0 in the cycles in which a collision can be issued; alternates in a pass
  input  wire                 passing,         // a pass has collisions left
  input  wire                 draining,        // no collision is left, some are under way
  input  wire                 friction,
  input  wire                 parity,          // of the pass

  input  wire                 streams_ready,   // all beats of the next collision, and room for its impulses
  input  wire                 found,
  input  wire [COLLISION:0]   last_use_a,
  input  wire [COLLISION:0]   last_use_b,
  input  wire                 moves_a,
  input  wire                 moves_b,

  output wire                 issues,
  output wire                 stalls,          // the slot is lost to the interlock
  output wire                 waits,           // the slot is lost to the streams
  output wire [31:0]          hazards          // collisions that met a hazard; saturates; counted a cycle later
);
  localparam WINDOW_SLOTS = ((CONTACT_WINDOW > FRICTION_WINDOW) ? CONTACT_WINDOW : FRICTION_WINDOW) / 2;

  reg [COLLISION-1:0]    retired;
  reg [WINDOW_SLOTS-2:0] under_way;            // issues, one bit a slot, the newest in bit 0
  wire retires = friction ? under_way[FRICTION_WINDOW/2-2] : under_way[CONTACT_WINDOW/2-2];

  // Compared in the cycle before the issue, in which neither side changes. That cycle has phase 1, and
  // tells of the next one, too, that a collision can be issued in it.
  reg  hazard, slot_there, slot_missing;
  wire there = streams_ready & found;
  wire hazard_a = moves_a & (last_use_a[COLLISION] == parity) & (last_use_a[COLLISION-1:0] >= retired);
  wire hazard_b = moves_b & (last_use_b[COLLISION] == parity) & (last_use_b[COLLISION-1:0] >= retired);
  always @(posedge clk) begin
    hazard <= hazard_a | hazard_b;
    slot_there   <= phase & there;
    slot_missing <= phase & ~there;
  end

  wire held   = hazard & (INTERLOCKED != 0);
  assign issues = passing & slot_there & ~held;
  assign stalls = passing & slot_there & held;
  assign waits  = passing & slot_missing;

  reg held_before;                             // the next collision has waited already
  reg  meets_hazard;
  reg  [31:0] met;
  reg         full;                            // the count has run over
  assign hazards = met | {32{full}};
  always @(posedge clk) begin
    if (clear | draining) begin
      retired   <= {COLLISION{1'b0}};
      under_way <= {(WINDOW_SLOTS-1){1'b0}};
    end else if (~phase) begin
      retired   <= retired + {{(COLLISION-1){1'b0}}, retires};
      under_way <= {under_way[WINDOW_SLOTS-3:0], issues};
    end
    if (clear | issues) held_before <= 1'b0;
    else if (stalls) held_before <= 1'b1;
    meets_hazard <= ~clear & issues & ((INTERLOCKED != 0) ? held_before : hazard);
    if (clear) {full, met} <= 33'd0;
    else {full, met} <= {full, 32'd0} | ({1'b0, met} + {32'd0, meets_hazard});
  end
endmodule

`default_nettype wire
