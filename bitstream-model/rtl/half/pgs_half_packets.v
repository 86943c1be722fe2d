// Lengths of the packets of a step in beats, by the stripes of `half` (specification, section 2), settled three cycles
// after the arguments.
//
// A group of velocities or poses is five beats, one a body: two each on streams 0 and 1, one on stream 2. A group of
// results is five beats, too, two a body. A pair of collisions is seven beats, 3 + 3 + 1, and eight in a warm pass.
`default_nettype none

module pgs_half_packets (
  input  wire        clk,
  input  wire [19:0] bodies,        // at most 2^17
  input  wire [19:0] collisions,
  output reg  [19:0] groups,        // of five bodies
  output reg  [19:0] result_groups, // of five beats
  output reg  [19:0] pairs,         // of collisions
  output reg         odd,           // the second collision of the last pair is none
  output reg  [2:0]  last_bodies    // of the last group: 1 to 5
);
  // A fifth, rounded down, of a number below 2^18: 209716 / 2^20 is a fifth and less than 2^-18 more.
  localparam [37:0] FIFTH = 38'd209716;
  reg  [17:0] bodies_up, beats_up;
  wire [37:0] fifth_of_bodies = {20'd0, bodies_up} * FIFTH;
  wire [37:0] fifth_of_beats  = {20'd0, beats_up} * FIFTH;
  wire [19:0] before_last = bodies - {groups[17:0], 2'b00} - groups + 20'd5;
  wire        unused = &{1'b0, bodies[19:18], before_last[19:3], fifth_of_bodies[19:0], fifth_of_beats[19:0]};
  always @(posedge clk) begin
    bodies_up     <= bodies[17:0] + 18'd4;
    beats_up      <= {bodies[16:0], 1'b0} + 18'd4;
    groups        <= {2'd0, fifth_of_bodies[37:20]};
    result_groups <= {2'd0, fifth_of_beats[37:20]};
    last_bodies   <= before_last[2:0];
    pairs         <= (collisions + 20'd1) >> 1;
    odd           <= collisions[0];
  end
endmodule

`default_nettype wire
