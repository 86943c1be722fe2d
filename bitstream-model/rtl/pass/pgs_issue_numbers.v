// Numbers of collisions in the stream, in the order in which they issued, four a beat: behind the impulses
// of each four, and behind the last ones of a pass.
`default_nettype none

module pgs_issue_numbers #(
  parameter integer COLLISION = 17
) (
  input  wire                 clk,
  input  wire                 clear,
  input  wire                 issues,        // a collision issues whose impulses go out
  input  wire [COLLISION-1:0] number,
  input  wire                 last,          // of the pass
  output reg                  follows,       // a beat of numbers follows the one that issued in the cycle before
  input  wire                 ends,          // its impulses go out a cycle later
  output reg                  valid,         // the beat, two cycles after the last of its collisions ended
  output reg  [127:0]         beat
);
  reg  [1:0]           issued, ended;        // of the four
  reg                  complete;
  wire [COLLISION-1:0] oldest;
  wire                 oldest_is_last, some, below;
  wire [8:0]           count;
  wire                 unused = &{1'b0, count, some, below};
  // Deeper than a pipeline.
  pgs_fifo #(.WIDTH(COLLISION + 1), .ADDRESS(8)) under_way (
    .clk(clk), .clear(clear), .push(issues), .in({last, number}), .pop(ends), .head({oldest_is_last, oldest}),
    .count(count), .some(some), .below(below)
  );
  wire [31:0] word = {{(32-COLLISION){1'b0}}, oldest};
  always @(posedge clk) begin
    follows  <= issues & (last | (issued == 2'd3)) & ~clear;
    complete <= ends & (oldest_is_last | (ended == 2'd3)) & ~clear;
    valid    <= complete & ~clear;
    if (issues) issued <= last ? 2'd0 : issued + 2'd1;
    if (ends) begin
      ended <= oldest_is_last ? 2'd0 : ended + 2'd1;
      beat  <= (ended == 2'd0) ? {96'd0, word}
             : (ended == 2'd1) ? {64'd0, word, beat[31:0]}
             : (ended == 2'd2) ? {32'd0, word, beat[63:0]} : {word, beat[95:0]};
    end
    if (clear) {issued, ended} <= 4'd0;
  end
endmodule

`default_nettype wire
