// The smaller of two numbers, binary32 or (WIDTH = 16) binary16, or a third one: y = condition ? (a < b ? a : b) : c.
//
// Latency 1. The form decides the rest: equal operands, zeros of both signs among them, give b, and
// so does a NaN in either operand. Subnormals of binary32: a or b counts as a zero of its sign,
// also as the result; the bits of c pass as they are.
//
// Rules: bitstream-model/README.md, section 7.
`default_nettype none

module pgs_fmin_or #(
  parameter integer WIDTH = 32
) (
  input  wire             clk,
  input  wire             condition,
  input  wire [WIDTH-1:0] a,
  input  wire [WIDTH-1:0] b,
  input  wire [WIDTH-1:0] c,
  output reg  [WIDTH-1:0] y
);

  wire a_below_b;

  pgs_fbelow #(.WIDTH(WIDTH)) compare (
    .a(a),
    .b(b),
    .y(a_below_b)
  );

  // Binary16 has no subnormals that count as zeros.
  localparam FRACTION = (WIDTH == 32) ? 23 : 10;

  wire a_stays = (WIDTH != 32) | (|a[WIDTH-2:FRACTION]);
  wire b_stays = (WIDTH != 32) | (|b[WIDTH-2:FRACTION]);
  wire [WIDTH-1:0] a_flushed = {a[WIDTH-1:FRACTION], a[FRACTION-1:0] & {FRACTION{a_stays}}};
  wire [WIDTH-1:0] b_flushed = {b[WIDTH-1:FRACTION], b[FRACTION-1:0] & {FRACTION{b_stays}}};

  always @(posedge clk) begin
    y <= ~condition ? c : a_below_b ? a_flushed : b_flushed;
  end

endmodule

`default_nettype wire
