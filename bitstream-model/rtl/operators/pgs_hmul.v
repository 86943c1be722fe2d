// Product of two binary16 numbers, rounded to nearest even: y = a * b.
//
// Latency 4, one product a cycle. The suffix _s<n> names a register at the end of stage n:
//
//   1  unpack    significands, a subnormal one shifted to its leading one; zero, NaN and infinity
//   2  multiply  11 x 11 bits, one DSP slice
//   3  shift     hround
//   4  round     hround
//
// One operand at most is shifted: the product of two subnormal numbers lies below half of the
// smallest number, whatever their significands are. Subnormals are kept, NaN results are 7e00.
//
// Rules: bitstream-model/README.md, section 7.
`default_nettype none

module pgs_hmul (
  input  wire        clk,
  input  wire [15:0] a,
  input  wire [15:0] b,
  output wire [15:0] y
);

  // Stage 1: unpack.
  wire        a_is_low      = ~|a[14:10];
  wire        b_is_low      = ~|b[14:10];
  wire        a_is_zero     = ~|a[14:0];
  wire        b_is_zero     = ~|b[14:0];
  wire        a_is_infinite = (&a[14:10]) & (~|a[9:0]);
  wire        b_is_infinite = (&b[14:10]) & (~|b[9:0]);
  wire        a_is_nan      = (&a[14:10]) & (|a[9:0]);
  wire        b_is_nan      = (&b[14:10]) & (|b[9:0]);
  wire [14:0] lower         = a_is_low ? a[14:0] : b[14:0];
  wire [14:0] higher        = a_is_low ? b[14:0] : a[14:0];
  wire [10:0] lower_significand;
  wire  [3:0] leading;

  pgs_hnormal normal (
    .a(lower),
    .significand(lower_significand),
    .leading(leading)
  );

  reg        [10:0] lower_significand_s1;
  reg        [10:0] higher_significand_s1;
  reg signed  [6:0] exponent_s1;
  reg         [3:0] leading_s1;
  reg               sign_s1;
  reg               zero_s1;
  reg               infinite_s1;
  reg               nan_s1;

  always @(posedge clk) begin
    lower_significand_s1  <= lower_significand;
    higher_significand_s1 <= {|higher[14:10], higher[9:0]};
    exponent_s1 <= {2'd0, a[14:11], a[10] | a_is_low} + {2'd0, b[14:11], b[10] | b_is_low} - 7'd14;
    leading_s1  <= leading;
    sign_s1     <= a[15] ^ b[15];
    zero_s1     <= a_is_zero | b_is_zero;
    infinite_s1 <= a_is_infinite | b_is_infinite;
    nan_s1      <= a_is_nan | b_is_nan | (a_is_infinite & b_is_zero) | (a_is_zero & b_is_infinite);
  end

  // Stage 2: multiply.
  reg [21:0] product_s2;
  reg        sign_s2;
  reg        zero_s2;
  reg        infinite_s2;
  reg        nan_s2;

  always @(posedge clk) begin
    product_s2  <= {11'd0, lower_significand_s1} * {11'd0, higher_significand_s1};
    sign_s2     <= sign_s1;
    zero_s2     <= zero_s1;
    infinite_s2 <= infinite_s1;
    nan_s2      <= nan_s1;
  end

  // Stages 2 to 4 of the exponent, 3 and 4 of the rest.
  pgs_hround rounds (
    .clk(clk),
    .exponent(exponent_s1 - {3'd0, leading_s1}),
    .significand(product_s2[21:9]),
    .sticky(|product_s2[8:0]),
    .sign(sign_s2),
    .zero(zero_s2),
    .infinite(infinite_s2),
    .nan(nan_s2),
    .y(y)
  );

endmodule

`default_nettype wire
