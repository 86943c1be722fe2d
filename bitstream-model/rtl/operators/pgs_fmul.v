// Product of two binary32 numbers, rounded to nearest even: y = a * b.
//
// Latency 5, one product a cycle. The suffix _s<n> names a register at the end of stage n:
//
//   1  unpack     significands, sum of the exponents; zero, NaN and infinity
//   2  multiply   two partial products: 24 x 17 and 24 x 7 bits, one DSP slice each
//   3  add        product of 48 bits
//   4  normalise  23 bits of fraction, exponent, decision of the rounding
//   5  round      rounding; zeros, infinities and NaN
//
// Subnormals: an operand counts as a zero of its sign. A result is rounded on the grid of the
// subnormal numbers, and becomes a zero of its sign if it is still subnormal. That grid is twice as
// coarse as 24 bits of significand below the smallest normal number: a fraction of ones there lies
// half way to that number or above, and rounds up to it (00ffffff * 0.5 = 00800000). With
// SMALLEST_NORMAL = 0 such a result is rounded as if the exponent had no lower end, and is a zero
// unless that alone reaches the smallest normal number. NaN results are 7fc00000.
//
// Rules: bitstream-model/README.md, section 7.
`default_nettype none

module pgs_fmul #(
  parameter integer SMALLEST_NORMAL = 1
) (
  input  wire        clk,
  input  wire [31:0] a,
  input  wire [31:0] b,
  output reg  [31:0] y
);

  // Stage 1: unpack. The exponent is biased and may be negative, two's complement.
  wire a_is_zero     = ~|a[30:23];
  wire b_is_zero     = ~|b[30:23];
  wire a_is_infinite = (&a[30:23]) & (~|a[22:0]);
  wire b_is_infinite = (&b[30:23]) & (~|b[22:0]);
  wire a_is_nan      = (&a[30:23]) & (|a[22:0]);
  wire b_is_nan      = (&b[30:23]) & (|b[22:0]);

  reg [23:0] a_significand_s1;
  reg [23:0] b_significand_s1;
  reg  [9:0] exponent_s1;
  reg        sign_s1;
  reg        zero_s1;
  reg        infinite_s1;
  reg        nan_s1;

  always @(posedge clk) begin
    a_significand_s1 <= {1'b1, a[22:0]};
    b_significand_s1 <= {1'b1, b[22:0]};
    exponent_s1      <= {2'b00, a[30:23]} + {2'b00, b[30:23]} - 10'd127;
    sign_s1          <= a[31] ^ b[31];
    zero_s1          <= a_is_zero | b_is_zero;
    infinite_s1      <= a_is_infinite | b_is_infinite;
    nan_s1           <= a_is_nan | b_is_nan | (a_is_infinite & b_is_zero)
                      | (a_is_zero & b_is_infinite);
  end

  // Stage 2: multiply.
  reg [40:0] low_product_s2;
  reg [30:0] high_product_s2;
  reg  [9:0] exponent_s2;
  reg        sign_s2;
  reg        zero_s2;
  reg        infinite_s2;
  reg        nan_s2;

  always @(posedge clk) begin
    low_product_s2  <= {17'd0, a_significand_s1} * {24'd0, b_significand_s1[16:0]};
    high_product_s2 <= {7'd0, a_significand_s1} * {24'd0, b_significand_s1[23:17]};
    exponent_s2     <= exponent_s1;
    sign_s2         <= sign_s1;
    zero_s2         <= zero_s1;
    infinite_s2     <= infinite_s1;
    nan_s2          <= nan_s1;
  end

  // Stage 3: add.
  wire [30:0] high_sum = high_product_s2 + {7'd0, low_product_s2[40:17]};

  reg  [47:0] product_s3;
  reg   [9:0] exponent_s3;
  reg         sign_s3;
  reg         zero_s3;
  reg         infinite_s3;
  reg         nan_s3;

  always @(posedge clk) begin
    product_s3  <= {high_sum, low_product_s2[16:0]};
    exponent_s3 <= exponent_s2;
    sign_s3     <= sign_s2;
    zero_s3     <= zero_s2;
    infinite_s3 <= infinite_s2;
    nan_s3      <= nan_s2;
  end

  // Stage 4: normalise. The product of two significands is in 1 .. 4; bit 46 weighs 1.
  wire        two_or_more   = product_s3[47];
  wire [22:0] fraction      = two_or_more ? product_s3[46:24] : product_s3[45:23];
  wire        guard         = two_or_more ? product_s3[23] : product_s3[22];
  wire        sticky        = (two_or_more & product_s3[22]) | (|product_s3[21:0]);
  wire  [9:0] exponent      = exponent_s3 + {9'd0, two_or_more};
  wire        nearly_normal = (SMALLEST_NORMAL != 0) & (~|exponent) & (&fraction);

  reg  [22:0] fraction_s4;
  reg         round_up_s4;
  reg   [9:0] exponent_s4;
  reg         sign_s4;
  reg         zero_s4;
  reg         infinite_s4;
  reg         nan_s4;

  always @(posedge clk) begin
    fraction_s4 <= fraction;
    round_up_s4 <= (guard & (fraction[0] | sticky)) | nearly_normal;
    exponent_s4 <= exponent;
    sign_s4     <= sign_s3;
    zero_s4     <= zero_s3;
    infinite_s4 <= infinite_s3;
    nan_s4      <= nan_s3;
  end

  // Stage 5: round. A carry out of the fraction raises the exponent.
  wire [32:0] rounded   = {exponent_s4, fraction_s4} + {32'd0, round_up_s4};
  wire        underflow = rounded[32] | (~|rounded[31:23]);
  wire        overflow  = ~rounded[32] & (rounded[31] | (&rounded[30:23]));

  always @(posedge clk) begin
    if (nan_s4)
      y <= 32'h7fc00000;
    else if (infinite_s4)
      y <= {sign_s4, 8'hff, 23'd0};
    else if (zero_s4 | underflow)
      y <= {sign_s4, 31'd0};
    else if (overflow)
      y <= {sign_s4, 8'hff, 23'd0};
    else
      y <= {sign_s4, rounded[30:0]};
  end

endmodule

`default_nettype wire
