// Product of two binary16 numbers, rounded to nearest even: y = a * b.
//
// Latency 5, one product a cycle. The suffix _s<n> names a register at the end of stage n:
//
//   1  unpack     significands, sum of the exponents; zero, NaN and infinity
//   2  normalise  a subnormal significand shifted to its leading one
//   3  multiply   11 x 11 bits, one DSP slice
//   4  shift      hround
//   5  round      hround
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

  reg [10:0] lower_s1;
  reg [10:0] higher_s1;
  reg  [6:0] exponent_s1;
  reg        sign_s1;
  reg        zero_s1;
  reg        infinite_s1;
  reg        nan_s1;

  always @(posedge clk) begin
    lower_s1    <= {|lower[14:10], lower[9:0]};
    higher_s1   <= {|higher[14:10], higher[9:0]};
    exponent_s1 <= {2'd0, a[14:11], a[10] | a_is_low} + {2'd0, b[14:11], b[10] | b_is_low} - 7'd14;
    sign_s1     <= a[15] ^ b[15];
    zero_s1     <= a_is_zero | b_is_zero;
    infinite_s1 <= a_is_infinite | b_is_infinite;
    nan_s1      <= a_is_nan | b_is_nan | (a_is_infinite & b_is_zero) | (a_is_zero & b_is_infinite);
  end

  // Stage 2: normalise.
  wire [10:0] significand;
  wire  [3:0] leading;

  pgs_hnormal normal (
    .plain(lower_s1),
    .significand(significand),
    .leading(leading)
  );

  reg [10:0] lower_s2;
  reg [10:0] higher_s2;
  reg  [6:0] exponent_s2;
  reg  [3:0] leading_s2;

  always @(posedge clk) begin
    lower_s2    <= significand;
    higher_s2   <= higher_s1;
    exponent_s2 <= exponent_s1;
    leading_s2  <= leading;
  end

  // Stage 3: multiply.
  reg [21:0] product_s3;

  always @(posedge clk) begin
    product_s3 <= {11'd0, lower_s2} * {11'd0, higher_s2};
  end

  // Stages 3 to 5 of the exponent, 4 and 5 of the rest.
  reg [7:0] notes;

  always @(posedge clk) begin
    notes <= {notes[3:0], sign_s1, zero_s1, infinite_s1, nan_s1};
  end

  pgs_hround rounds (
    .clk(clk),
    .exponent(exponent_s2 - {3'd0, leading_s2}),
    .significand(product_s3[21:9]),
    .sticky(|product_s3[8:0]),
    .sign(notes[7]),
    .zero(notes[6]),
    .infinite(notes[5]),
    .nan(notes[4]),
    .y(y)
  );

endmodule

`default_nettype wire
