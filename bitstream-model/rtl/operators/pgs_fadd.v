// Sum of two binary32 numbers, rounded to nearest even: y = a + b.
//
// Latency 7, one sum a cycle. The suffix _s<n> names a register at the end of stage n:
//
//   1  compare    order of the magnitudes, both differences of the exponents
//   2  swap       operands by magnitude; NaN and infinity
//   3  align      smaller significand shifted to the larger one, lost bits kept as a sticky bit
//   4  add        sum or difference of the significands
//   5  count      leading zeros
//   6  normalise  24 bits of significand, exponent, decision of the rounding
//   7  round      rounding; zeros, infinities and NaN
//
// Subnormals: an operand counts as a zero of its sign, a subnormal result becomes one. Sums of
// normal numbers are multiples of 2^-149, so that a subnormal sum is exact: no rounding can lift it
// to the smallest normal number. NaN results are 7fc00000.
//
// Rules: bitstream-model/README.md, section 7.
`default_nettype none

module pgs_fadd (
  input  wire        clk,
  input  wire [31:0] a,
  input  wire [31:0] b,
  output reg  [31:0] y
);

  // Stage 1: compare.
  reg [31:0] a_s1;
  reg [31:0] b_s1;
  reg        a_is_smaller_s1;
  reg  [7:0] a_above_b_s1;
  reg  [7:0] b_above_a_s1;

  always @(posedge clk) begin
    a_s1            <= a;
    b_s1            <= b;
    a_is_smaller_s1 <= a[30:0] < b[30:0];
    a_above_b_s1    <= a[30:23] - b[30:23];
    b_above_a_s1    <= b[30:23] - a[30:23];
  end

  // Stage 2: swap. The bits of a NaN are larger than every number's, so that one NaN at
  // least is in `larger`, if there is one.
  wire [31:0] larger          = a_is_smaller_s1 ? b_s1 : a_s1;
  wire [30:0] smaller         = a_is_smaller_s1 ? a_s1[30:0] : b_s1[30:0];
  wire  [7:0] distance        = a_is_smaller_s1 ? b_above_a_s1 : a_above_b_s1;
  wire        subtract        = a_s1[31] ^ b_s1[31];
  wire        larger_is_zero  = ~|larger[30:23];
  wire        smaller_is_zero = ~|smaller[30:23];
  wire        both_infinite   = &smaller[30:23];
  wire        larger_is_nan   = |larger[22:0];

  reg  [23:0] larger_significand_s2;
  reg  [23:0] smaller_significand_s2;
  reg   [7:0] exponent_s2;
  reg   [4:0] distance_s2;
  reg         too_far_s2;
  reg         sign_s2;
  reg         subtract_s2;
  reg         infinite_s2;
  reg         nan_s2;

  always @(posedge clk) begin
    larger_significand_s2  <= larger_is_zero ? 24'd0 : {1'b1, larger[22:0]};
    smaller_significand_s2 <= smaller_is_zero ? 24'd0 : {1'b1, smaller[22:0]};
    exponent_s2            <= larger[30:23];
    distance_s2            <= distance[4:0];
    too_far_s2             <= |distance[7:5];
    sign_s2                <= larger[31];
    subtract_s2            <= subtract;
    infinite_s2            <= &larger[30:23];
    nan_s2                 <= (&larger[30:23]) & (larger_is_nan | (both_infinite & subtract));
  end

  // Stage 3: align. Below the 24 bits stand guard, round and sticky bit. The shift goes by
  // multiples of 8, then of 2, then by 1; each step tells whether it drops a one.
  wire [26:0] unshifted  = {smaller_significand_s2, 3'b000};
  wire [26:0] shifted_8s = unshifted >> {distance_s2[4:3], 3'b000};
  wire [26:0] shifted_2s = shifted_8s >> {distance_s2[2:1], 1'b0};
  wire [26:0] shifted    = shifted_2s >> distance_s2[0];
  wire        lost_in_8s = ((|distance_s2[4:3]) & (|unshifted[7:0]))
                         | (distance_s2[4] & (|unshifted[15:8]))
                         | ((&distance_s2[4:3]) & (|unshifted[23:16]));
  wire        lost_in_2s = ((|distance_s2[2:1]) & (|shifted_8s[1:0]))
                         | (distance_s2[2] & (|shifted_8s[3:2]))
                         | ((&distance_s2[2:1]) & (|shifted_8s[5:4]));
  wire        lost_in_1 = distance_s2[0] & shifted_2s[0];
  wire        sticky    = shifted[0] | lost_in_8s | lost_in_2s | lost_in_1;
  wire [26:0] aligned   = too_far_s2 ? {26'd0, |unshifted} : {shifted[26:1], sticky};

  reg  [26:0] smaller_aligned_s3;
  reg  [23:0] larger_significand_s3;
  reg   [7:0] exponent_s3;
  reg         sign_s3;
  reg         subtract_s3;
  reg         infinite_s3;
  reg         nan_s3;

  always @(posedge clk) begin
    smaller_aligned_s3    <= aligned;
    larger_significand_s3 <= larger_significand_s2;
    exponent_s3           <= exponent_s2;
    sign_s3               <= sign_s2;
    subtract_s3           <= subtract_s2;
    infinite_s3           <= infinite_s2;
    nan_s3                <= nan_s2;
  end

  // Stage 4: add. A sum is the difference to the complement, less 1: the bit below borrows it.
  wire [28:0] minuend    = {1'b0, larger_significand_s3, 3'b000, subtract_s3};
  wire [28:0] subtrahend = {{1'b0, smaller_aligned_s3} ^ {28{~subtract_s3}}, 1'b1};
  wire [28:0] difference = minuend - subtrahend;

  reg  [27:0] sum_s4;
  reg   [7:0] exponent_s4;
  reg         sign_s4;
  reg         subtract_s4;
  reg         infinite_s4;
  reg         nan_s4;

  always @(posedge clk) begin
    sum_s4      <= difference[28:1];
    exponent_s4 <= exponent_s3;
    sign_s4     <= sign_s3;
    subtract_s4 <= subtract_s3;
    infinite_s4 <= infinite_s3;
    nan_s4      <= nan_s3;
  end

  // Stage 5: count the leading zeros, each step in the half that holds the leading one.
  wire [31:0] in_32   = {sum_s4, 4'b1000};
  wire        skip_16 = ~|in_32[31:16];
  wire [15:0] in_16   = skip_16 ? in_32[15:0] : in_32[31:16];
  wire        skip_8  = ~|in_16[15:8];
  wire  [7:0] in_8    = skip_8 ? in_16[7:0] : in_16[15:8];
  wire        skip_4  = ~|in_8[7:4];
  wire  [3:0] in_4    = skip_4 ? in_8[3:0] : in_8[7:4];
  wire        skip_2  = ~|in_4[3:2];
  wire        skip_1  = skip_2 ? ~in_4[1] : ~in_4[3];

  reg  [27:0] sum_s5;
  reg   [4:0] leading_zeros_s5;
  reg   [7:0] exponent_s5;
  reg         zero_s5;
  reg         sign_s5;
  reg         infinite_s5;
  reg         nan_s5;

  always @(posedge clk) begin
    sum_s5           <= sum_s4;
    leading_zeros_s5 <= {skip_16, skip_8, skip_4, skip_2, skip_1};
    exponent_s5      <= exponent_s4;
    zero_s5          <= ~|sum_s4;
    sign_s5          <= sign_s4 & ~(subtract_s4 & (~|sum_s4));
    infinite_s5      <= infinite_s4;
    nan_s5           <= nan_s4;
  end

  // Stage 6: normalise. The exponent may be negative, two's complement.
  wire [27:0] normalised = sum_s5 << leading_zeros_s5;

  reg  [22:0] fraction_s6;
  reg         round_up_s6;
  reg   [9:0] exponent_s6;
  reg         zero_s6;
  reg         sign_s6;
  reg         infinite_s6;
  reg         nan_s6;

  always @(posedge clk) begin
    fraction_s6 <= normalised[26:4];
    round_up_s6 <= normalised[3] & (normalised[4] | (|normalised[2:0]));
    exponent_s6 <= {2'b00, exponent_s5} + 10'd1 - {5'd0, leading_zeros_s5};
    zero_s6     <= zero_s5 & ~infinite_s5;
    sign_s6     <= sign_s5;
    infinite_s6 <= infinite_s5;
    nan_s6      <= nan_s5;
  end

  // Stage 7: round. A carry out of the fraction raises the exponent.
  wire [32:0] rounded   = {exponent_s6, fraction_s6} + {32'd0, round_up_s6};
  wire        underflow = rounded[32] | (~|rounded[31:23]);
  wire        overflow  = ~rounded[32] & (rounded[31] | (&rounded[30:23]));

  always @(posedge clk) begin
    if (nan_s6)
      y <= 32'h7fc00000;
    else if (zero_s6)
      y <= {sign_s6, 31'd0};
    else if (infinite_s6 | overflow)
      y <= {sign_s6, 8'hff, 23'd0};
    else if (underflow)
      y <= {sign_s6, 31'd0};
    else
      y <= {sign_s6, rounded[30:0]};
  end

  // The bit that borrowed, one that no count needs, and the leading one.
  wire unused = &{1'b0, difference[0], in_4[0], normalised[27]};

endmodule

`default_nettype wire
