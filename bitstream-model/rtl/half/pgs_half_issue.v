// Issues pairs of collisions into a pass: one in every slot of three cycles, in the order of the records, as soon as
// the beats of a pair are there, with room for its impulses in a pass that sends them, and, interlocked, no collision
// under way writes one of their bodies. The second collision of a pair may have to wait for the first one, or for an
// earlier one: it then enters alone in a later slot, and nothing passes it.
//
// The beats of a pair and its impulses take their busiest stream four cycles in a warm pass, so that every fourth slot
// stays empty there: the slot behind the third pair, and so on.
//
// A collision is under way until it is *retired*: its write-back can then be read. Because all
// collisions of a pass take the same time, a count of the retired ones tells of each whether it is.
`default_nettype none

module pgs_half_issue #(
  parameter integer COLLISION       = 17,
  parameter integer INTERLOCKED     = 1,
  parameter integer CONTACT_WINDOW  = 324,
  parameter integer FRICTION_WINDOW = 189
) (
  input  wire                 clk,
  input  wire                 clear,           // a step begins
  input  wire                 slot_begins,     // the cycle of an issue
  input  wire                 slot_ends,       // the cycle before it
  input  wire                 passing,         // a pass has pairs left
  input  wire                 draining,        // no pair is left, some are under way
  input  wire                 friction,
  input  wire                 parity,          // of the pass
  input  wire                 warm,

  input  wire                 streams_ready,   // all beats of the next pair, and room for its impulses
  input  wire                 found,
  input  wire [4*COLLISION+3:0] last_uses,     // of the second collision, bodies B and A, and of the first one
  input  wire [3:0]           moves,

  output wire                 begins,          // its beats are taken, and the first collision enters
  output wire                 second_enters,
  output wire                 issues,          // all of the pair have entered
  output wire                 stalls,          // the slot is lost to the interlock
  output wire                 waits,           // the slot is lost to the streams
  output wire [31:0]          hazards          // collisions that met a hazard; saturates; counted a cycle later
);
  localparam WINDOW_SLOTS = ((CONTACT_WINDOW > FRICTION_WINDOW) ? CONTACT_WINDOW : FRICTION_WINDOW) / 3;

  reg [COLLISION-1:0]    retired;
  reg [WINDOW_SLOTS-2:0] first_under_way, second_under_way;   // one bit a slot, the newest in bit 0
  wire first_retires  = friction ? first_under_way[FRICTION_WINDOW/3-2] : first_under_way[CONTACT_WINDOW/3-2];
  wire second_retires = friction ? second_under_way[FRICTION_WINDOW/3-2] : second_under_way[CONTACT_WINDOW/3-2];

  // Compared in the cycle before the issue, in which neither side changes.
  reg  [1:0] hazard;                           // of the second collision, and of the first one
  reg        slot_there, slot_missing;
  wire [3:0] in_use;
  genvar k;
  generate
    for (k = 0; k < 4; k = k + 1) begin : g_side
      wire [COLLISION:0] last = last_uses[(COLLISION+1)*k +: COLLISION+1];
      assign in_use[k] = moves[k] & (last[COLLISION] == parity) & (last[COLLISION-1:0] >= retired);
    end
  endgenerate

  reg        in_second;                        // the first one has entered, the second one waits
  reg        empty_next;                       // the next slot stays empty
  reg  [1:0] since_empty;                      // pairs, 0 to 2
  wire slot        = passing & slot_begins;
  wire [1:0] held  = hazard & {2{INTERLOCKED != 0}};
  wire may_begin   = slot & ~in_second & ~empty_next;
  assign begins        = may_begin & slot_there & ~held[0];
  assign second_enters = (begins | (slot & in_second)) & ~held[1];
  assign issues        = second_enters;
  assign stalls        = (may_begin & slot_there & held[0]) | (slot & in_second);
  assign waits         = may_begin & slot_missing;

  reg        held_before;                      // the first collision has waited already
  reg  [1:0] meet;
  reg  [31:0] met;
  reg        full;                             // the count has run over
  assign hazards = met | {32{full}};
  always @(posedge clk) begin
    hazard       <= {|in_use[3:2], |in_use[1:0]};
    slot_there   <= slot_ends & streams_ready & found;
    slot_missing <= slot_ends & ~(streams_ready & found);

    if (clear | draining) begin
      retired          <= {COLLISION{1'b0}};
      first_under_way  <= {(WINDOW_SLOTS-1){1'b0}};
      second_under_way <= {(WINDOW_SLOTS-1){1'b0}};
      in_second        <= 1'b0;
      empty_next       <= 1'b0;
      since_empty      <= 2'd0;
    end else if (slot_begins) begin
      retired          <= retired + {{(COLLISION-1){1'b0}}, first_retires} + {{(COLLISION-1){1'b0}}, second_retires};
      first_under_way  <= {first_under_way[WINDOW_SLOTS-3:0], begins};
      second_under_way <= {second_under_way[WINDOW_SLOTS-3:0], second_enters};
      in_second        <= (begins | in_second) & ~second_enters;
      empty_next       <= warm & issues & (since_empty == 2'd2);
      if (issues) since_empty <= (since_empty == 2'd2) ? 2'd0 : since_empty + 2'd1;
    end

    if (clear | begins) held_before <= 1'b0;
    else if (stalls & ~in_second) held_before <= 1'b1;
    meet <= clear ? 2'd0
          : (INTERLOCKED != 0) ? {1'b0, (begins & held_before) | (second_enters & in_second)}
          : {1'b0, begins & hazard[0]} + {1'b0, second_enters & hazard[1]};
    if (clear) {full, met} <= 33'd0;
    else {full, met} <= {full, 32'd0} | ({1'b0, met} + {31'd0, meet});
  end
endmodule

`default_nettype wire
