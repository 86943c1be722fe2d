// One of two binary32 numbers: y = condition ? a : b.
//
// Latency 1. The bits pass as they are, NaN and subnormals too; the operator that reads them takes
// subnormals as zeros.
`default_nettype none

module pgs_fselect (
  input  wire        clk,
  input  wire        condition,
  input  wire [31:0] a,
  input  wire [31:0] b,
  output reg  [31:0] y
);

  always @(posedge clk) begin
    y <= condition ? a : b;
  end

endmodule

`default_nettype wire
