// Whether one binary32 number is less than another: y = a < b.
//
// Latency 1. False if an operand is NaN. Subnormal operands count as zeros; zeros of both signs are
// equal.
`default_nettype none

module pgs_fless (
  input  wire        clk,
  input  wire [31:0] a,
  input  wire [31:0] b,
  output reg         y
);

  wire a_below_b;

  pgs_fbelow compare (
    .a(a),
    .b(b),
    .y(a_below_b)
  );

  always @(posedge clk) begin
    y <= a_below_b;
  end

endmodule

`default_nettype wire
