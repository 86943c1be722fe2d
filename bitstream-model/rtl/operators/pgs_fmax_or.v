// The larger of two binary32 numbers, or a third one: y = condition ? (a > b ? a : b) : c.
//
// Latency 1. The form decides the rest: equal operands, zeros of both signs among them, give b, and
// so does a NaN in either operand. Subnormals: a or b counts as a zero of its sign, also as the
// result; the bits of c pass as they are.
//
// Rules: bitstream-model/README.md, section 7.
`default_nettype none

module pgs_fmax_or (
  input  wire        clk,
  input  wire        condition,
  input  wire [31:0] a,
  input  wire [31:0] b,
  input  wire [31:0] c,
  output reg  [31:0] y
);

  wire a_above_b;

  pgs_fbelow compare (
    .a(b),
    .b(a),
    .y(a_above_b)
  );

  wire [31:0] a_flushed = {a[31:23], a[22:0] & {23{|a[30:23]}}};
  wire [31:0] b_flushed = {b[31:23], b[22:0] & {23{|b[30:23]}}};

  always @(posedge clk) begin
    y <= ~condition ? c : a_above_b ? a_flushed : b_flushed;
  end

endmodule

`default_nettype wire
