// The smaller of two binary32 numbers: y = a < b ? a : b.
//
// Latency 1. The form decides the rest: equal operands, zeros of both signs among them, give b, and
// so does a NaN in either operand. Subnormals: an operand counts as a zero of its sign, also as the
// result.
`default_nettype none

module fmin (
  input  wire        clk,
  input  wire [31:0] a,
  input  wire [31:0] b,
  output reg  [31:0] y
);

  wire a_below_b;

  fbelow compare (
    .a(a),
    .b(b),
    .y(a_below_b)
  );

  wire [31:0] chosen = a_below_b ? a : b;
  wire        zero   = ~|chosen[30:23];

  always @(posedge clk) begin
    y <= {chosen[31:23], zero ? 23'd0 : chosen[22:0]};
  end

endmodule

`default_nettype wire
