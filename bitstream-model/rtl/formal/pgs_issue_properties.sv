// Properties of the issue in the order of the stream (specification, section 8): no collision enters a pass within
// a window of another one that writes one of its bodies, each one issues once, and none waits without a hazard.
//
// The solver picks a body and follows it, through passes of either kind.
`default_nettype none

module pgs_issue_properties #(
  parameter integer COLLISION       = 17,
  parameter integer CONTACT_WINDOW  = 324,
  parameter integer FRICTION_WINDOW = 190
) (
  input wire                 clk,
  input wire                 clear,
  input wire                 phase,
  input wire                 passing,
  input wire                 draining,
  input wire                 friction,
  input wire                 parity,
  input wire                 streams_ready,
  input wire                 found,
  input wire [COLLISION:0]   last_use_a,
  input wire [COLLISION:0]   last_use_b,
  input wire                 moves_a,
  input wire                 moves_b,
  input wire                 issues,
  input wire                 stalls,
  input wire                 waits
);
  localparam integer LONGEST = (CONTACT_WINDOW > FRICTION_WINDOW) ? CONTACT_WINDOW : FRICTION_WINDOW;

  // ---- The sequence of a step: passes, each with a drain that is longer than a window

  reg       begun = 1'b0, before_phase, before_passing, before_parity, before_friction;
  reg [7:0] drained;
  always @(posedge clk) begin
    begun           <= 1'b1;
    before_phase    <= phase;
    before_passing  <= passing;
    before_parity   <= parity;
    before_friction <= friction;
    drained <= (clear | ~draining) ? 8'd0 : drained + {7'd0, drained != 8'hff};
  end
  always @* begin
    assume (clear == ~begun);
    assume (~(passing & draining));
    if (clear) assume (~passing & ~draining & ~phase);
    else begin
      assume (phase == ~before_phase);
      // A pass begins in a cycle of an issue, behind a drain, and ends in one with the last issue.
      if (passing & ~before_passing) assume (~phase & (drained > LONGEST));
      if (before_passing) assume (passing | (draining & phase));
      if (before_passing & ~passing) assume (last_issued);
      if (~before_passing & ~passing) assume (draining);
      // The parity changes as a pass ends, the kind as it begins.
      assume (parity == (before_parity ^ (before_passing & ~passing)));
      assume ((friction == before_friction) | (passing & ~before_passing));
    end
  end

  // ---- The finder: for each collision its last use of the body that is followed

  (* anyseq *) reg uses_a, uses_b;                // the next collision has the body
  reg  [COLLISION-1:0] number;                    // of the next collision in its pass
  reg                  used;                      // in this pass
  reg  [COLLISION-1:0] used_by;
  reg                  last_issued;
  reg  [7:0]           since;                     // cycles since a collision with the body was issued
  reg                  issued_before, asked_a, asked_b, asked_found;
  reg  [COLLISION:0]   asked_use_a, asked_use_b;
  reg                  asked_moves_a, asked_moves_b;
  wire                 uses = uses_a | uses_b;
  always @(posedge clk) begin
    last_issued   <= issues;
    issued_before <= issues;
    {asked_a, asked_b, asked_found} <= {uses_a, uses_b, found};
    {asked_use_a, asked_use_b, asked_moves_a, asked_moves_b} <= {last_use_a, last_use_b, moves_a, moves_b};
    if (clear | draining) begin
      number <= 0;
      used   <= 1'b0;
    end else if (issues) begin
      number <= number + 1'b1;
      if (uses) {used, used_by} <= {1'b1, number};
    end
    if (clear) since <= 8'hff;
    else if (issues & uses) since <= 8'd1;
    else if (since != 8'hff) since <= since + 8'd1;
  end
  always @* begin
    assume (~(uses_a & uses_b));
    // A pass has no more collisions than numbers.
    if (&number) assume (~issues | ~passing);
    // A body that moves comes with its last use; a use in another pass has the other parity.
    if (uses_a) assume (moves_a & (used ? last_use_a == {parity, used_by} : last_use_a[COLLISION] != parity));
    if (uses_b) assume (moves_b & (used ? last_use_b == {parity, used_by} : last_use_b[COLLISION] != parity));
    // Other bodies have been used by an earlier collision of this pass, or in another pass.
    if (~uses_a) assume ((last_use_a[COLLISION] != parity) | (last_use_a[COLLISION-1:0] < number));
    if (~uses_b) assume ((last_use_b[COLLISION] != parity) | (last_use_b[COLLISION-1:0] < number));
    // The next collision stays until it issues.
    if (begun & asked_found & ~issued_before & ~clear) begin
      assume (found & (uses_a == asked_a) & (uses_b == asked_b));
      assume ({last_use_a, last_use_b, moves_a, moves_b} == {asked_use_a, asked_use_b, asked_moves_a, asked_moves_b});
    end
  end

  // ---- Properties

  wire [7:0] window = friction ? FRICTION_WINDOW : CONTACT_WINDOW;
  reg        ready;                              // a collision and its beats were there in the cycle before
  always @(posedge clk) ready <= streams_ready & found & phase;
  always @* if (begun & ~clear) begin
    // No collision issues within a window of one that writes one of its bodies.
    if (issues & uses) assert (since >= window);
    // An issue needs a collision and its beats, and takes two cycles.
    if (issues) assert (ready & ~phase & passing);
    assert (~(issues & issued_before));
    // Each slot of a pass issues, stalls or waits.
    if (passing & ~phase) assert ({1'b0, issues} + {1'b0, stalls} + {1'b0, waits} == 2'd1);
    else assert (~issues & ~stalls & ~waits);
    if (passing & ~phase) assert (waits == ~ready);
    // A collision without a body that is under way does not stall.
    if (stalls & ~moves_a & ~moves_b) assert (0);
    if (stalls & uses_a & ~moves_b) assert (since < window);
    if (stalls & uses_b & ~moves_a) assert (since < window);
  end
endmodule

bind pgs_issue pgs_issue_properties #(
  .COLLISION(COLLISION), .CONTACT_WINDOW(CONTACT_WINDOW), .FRICTION_WINDOW(FRICTION_WINDOW)
) properties (.*);

`default_nettype wire
