// The results of a group of five bodies as beats: two a body, ten a group, dealt out to the streams in four cycles.
//
//   cycle    0   1   2   3
//   stream 0 0   1   5   6
//   stream 1 2   3   7   8
//   stream 2 4       9
//
// The last group has five beats, in the first two cycles, if it has one body or two. Beats behind the last body are 0.
`default_nettype none

module pgs_half_results (
  input  wire         clk,
  input  wire         clear,
  input  wire [3:0]   phases,
  input  wire         valid,            // in cycle 0, with all that follows
  input  wire [4:0]   live,
  input  wire [1039:0] bodies,          // position, orientation, linear and angular velocity of each
  output wire [2:0]   push,
  output wire [383:0] rows
);
  reg          sends;
  reg  [4:0]   there;
  reg  [1039:0] results;
  always @(posedge clk) begin
    if (clear) sends <= 1'b0;
    else if (phases[0]) sends <= valid;
    if (phases[0]) {there, results} <= {live, bodies};
  end

  wire [127:0] beat [0:9];
  genvar k;
  generate
    for (k = 0; k < 5; k = k + 1) begin : g_body
      wire [207:0] body = results[208*k +: 208];
      assign beat[2*k]   = there[k] ? {body[111:48], 16'd0, body[47:0]} : 128'd0;
      assign beat[2*k+1] = there[k] ? {16'd0, body[207:160], 16'd0, body[159:112]} : 128'd0;
    end
  endgenerate

  // Cycles 0 to 3 have the phases 1, 2, 3 and 0.
  wire all = there[2];
  assign rows[127:0]   = phases[1] ? beat[0] : phases[2] ? beat[1] : phases[3] ? beat[5] : beat[6];
  assign rows[255:128] = phases[1] ? beat[2] : phases[2] ? beat[3] : phases[3] ? beat[7] : beat[8];
  assign rows[383:256] = phases[1] ? beat[4] : beat[9];
  wire four = sends & (phases[1] | phases[2] | all);
  assign push = {sends & (phases[1] | (phases[3] & all)), four, four};
endmodule

`default_nettype wire
