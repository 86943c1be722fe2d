// One of two numbers, binary32 or (WIDTH = 16) binary16: y = condition ? a : b.
//
// Latency 1. The bits pass as they are, NaN and subnormals too; the operator of binary32 that reads
// them takes subnormals as zeros.
`default_nettype none

module pgs_fselect #(
  parameter integer WIDTH = 32
) (
  input  wire             clk,
  input  wire             condition,
  input  wire [WIDTH-1:0] a,
  input  wire [WIDTH-1:0] b,
  output reg  [WIDTH-1:0] y
);

  always @(posedge clk) begin
    y <= condition ? a : b;
  end

endmodule

`default_nettype wire
