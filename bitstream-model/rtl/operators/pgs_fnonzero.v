// Whether a flag is set and a binary32 number is not zero: y = flag && a != 0.
//
// Latency 1. Subnormals count as zeros, NaN does not. Only the exponent is read.
`default_nettype none

module pgs_fnonzero (
  input  wire        clk,
  input  wire        flag,
  input  wire [31:0] a,
  output reg         y
);

  // Sign and fraction are part of the number, but not of the question.
  wire unused = &{1'b0, a[31], a[22:0]};

  always @(posedge clk) begin
    y <= flag & (|a[30:23]);
  end

endmodule

`default_nettype wire
