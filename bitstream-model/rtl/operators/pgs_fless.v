// Whether one number is less than another, binary32 or (WIDTH = 16) binary16: y = a < b.
//
// Latency 1. False if an operand is NaN. Subnormal operands of binary32 count as zeros; zeros of both
// signs are equal.
`default_nettype none

module pgs_fless #(
  parameter integer WIDTH = 32
) (
  input  wire             clk,
  input  wire [WIDTH-1:0] a,
  input  wire [WIDTH-1:0] b,
  output reg              y
);

  wire a_below_b;

  pgs_fbelow #(.WIDTH(WIDTH)) compare (
    .a(a),
    .b(b),
    .y(a_below_b)
  );

  always @(posedge clk) begin
    y <= a_below_b;
  end

endmodule

`default_nettype wire
