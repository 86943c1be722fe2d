// Sum of two binary16 numbers, rounded to nearest even: y = a + b.
//
// Latency 5, one sum a cycle. The suffix _s<n> names a register at the end of stage n:
//
//   1  swap       operands by magnitude, distance of their exponents; NaN and infinity
//   2  align      smaller significand shifted to the larger one, lost bits kept as a sticky bit
//   3  add        sum or difference of the significands, its leading zeros
//   4  normalise  11 bits of significand, exponent, decision of the rounding
//   5  round      rounding; infinities and NaN
//
// Subnormals are kept: their exponent counts as 1, and no sum is shifted beyond that exponent.
// There every sum is exact. NaN results are 7e00.
//
// Rules: bitstream-model/README.md, section 7.
`default_nettype none

module pgs_hadd (
  input  wire        clk,
  input  wire [15:0] a,
  input  wire [15:0] b,
  output reg  [15:0] y
);

  // Stage 1: swap. The bits of a NaN are larger than every number's, so that one NaN at least is
  // in `larger`, if there is one.
  wire        a_is_smaller = a[14:0] < b[14:0];
  wire  [4:0] a_exponent   = {a[14:11], a[10] | (~|a[14:10])};
  wire  [4:0] b_exponent   = {b[14:11], b[10] | (~|b[14:10])};
  wire  [4:0] a_above_b    = a_exponent - b_exponent;
  wire  [4:0] b_above_a    = b_exponent - a_exponent;

  reg  [15:0] larger_s1;
  reg  [10:0] smaller_significand_s1;
  reg   [4:0] exponent_s1;
  reg   [4:0] distance_s1;
  reg         subtract_s1;
  reg         both_infinite_s1;

  always @(posedge clk) begin
    larger_s1              <= a_is_smaller ? b : a;
    smaller_significand_s1 <= a_is_smaller ? {|a[14:10], a[9:0]} : {|b[14:10], b[9:0]};
    exponent_s1            <= a_is_smaller ? b_exponent : a_exponent;
    distance_s1            <= a_is_smaller ? b_above_a : a_above_b;
    subtract_s1            <= a[15] ^ b[15];
    both_infinite_s1       <= (&a[14:10]) & (&b[14:10]);
  end

  // Stage 2: align. Below the 11 bits stand guard, round and sticky bit. The shift goes by
  // multiples of 4, then by 1 to 3; each step tells whether it drops a one.
  wire        largest    = &larger_s1[14:10];
  wire [13:0] unshifted  = {smaller_significand_s1, 3'b000};
  wire [13:0] shifted_4s = unshifted >> {distance_s1[3:2], 2'b00};
  wire [13:0] shifted    = shifted_4s >> distance_s1[1:0];
  wire        lost_in_4s = ((|distance_s1[3:2]) & unshifted[3])
                         | (distance_s1[3] & (|unshifted[7:4]))
                         | ((&distance_s1[3:2]) & (|unshifted[11:8]));
  wire        lost_in_1s = ((|distance_s1[1:0]) & shifted_4s[0])
                         | (distance_s1[1] & shifted_4s[1])
                         | ((&distance_s1[1:0]) & shifted_4s[2]);
  wire        sticky     = shifted[0] | lost_in_4s | lost_in_1s;

  reg  [13:0] smaller_aligned_s2;
  reg  [10:0] larger_significand_s2;
  reg   [4:0] exponent_s2;
  reg         sign_s2;
  reg         subtract_s2;
  reg         infinite_s2;
  reg         nan_s2;

  always @(posedge clk) begin
    smaller_aligned_s2    <= distance_s1[4] ? {13'd0, |unshifted} : {shifted[13:1], sticky};
    larger_significand_s2 <= {|larger_s1[14:10], larger_s1[9:0]};
    exponent_s2           <= exponent_s1;
    sign_s2               <= larger_s1[15];
    subtract_s2           <= subtract_s1;
    infinite_s2           <= largest;
    nan_s2                <= largest & ((|larger_s1[9:0]) | (both_infinite_s1 & subtract_s1));
  end

  // Stage 3: add. A sum is the difference to the complement, less 1: the bit below borrows it.
  wire [15:0] minuend    = {1'b0, larger_significand_s2, 3'b000, subtract_s2};
  wire [15:0] subtrahend = {{1'b0, smaller_aligned_s2} ^ {15{~subtract_s2}}, 1'b1};
  wire [15:0] difference = minuend - subtrahend;
  wire [14:0] sum        = difference[15:1];

  // Leading zeros, each step in the half that holds the leading one.
  wire [15:0] in_16  = {sum, 1'b1};
  wire        skip_8 = ~|in_16[15:8];
  wire  [7:0] in_8   = skip_8 ? in_16[7:0] : in_16[15:8];
  wire        skip_4 = ~|in_8[7:4];
  wire  [3:0] in_4   = skip_4 ? in_8[3:0] : in_8[7:4];
  wire        skip_2 = ~|in_4[3:2];
  wire        skip_1 = skip_2 ? ~in_4[1] : ~in_4[3];

  reg  [14:0] sum_s3;
  reg   [3:0] leading_zeros_s3;
  reg   [4:0] exponent_s3;
  reg         sign_s3;
  reg         subtract_s3;
  reg         infinite_s3;
  reg         nan_s3;

  always @(posedge clk) begin
    sum_s3           <= sum;
    leading_zeros_s3 <= {skip_8, skip_4, skip_2, skip_1};
    exponent_s3      <= exponent_s2;
    sign_s3          <= sign_s2;
    subtract_s3      <= subtract_s2;
    infinite_s3      <= infinite_s2;
    nan_s3           <= nan_s2;
  end

  // Stage 4: normalise, by the exponent at most: the leading bit is then a zero, and so is the
  // exponent. A sum of zero has 15 zeros.
  wire        lowest     = {1'b0, leading_zeros_s3} > exponent_s3;
  wire  [3:0] shift      = lowest ? exponent_s3[3:0] : leading_zeros_s3;
  wire [14:0] normalised = sum_s3 << shift;
  wire        zero       = &leading_zeros_s3;

  reg   [9:0] fraction_s4;
  reg         round_up_s4;
  reg   [4:0] exponent_s4;
  reg         sign_s4;
  reg         infinite_s4;
  reg         nan_s4;

  always @(posedge clk) begin
    fraction_s4 <= normalised[13:4];
    round_up_s4 <= normalised[3] & (normalised[4] | (|normalised[2:0]));
    exponent_s4 <= (lowest | zero) ? 5'd0 : exponent_s3 + 5'd1 - {1'b0, leading_zeros_s3};
    sign_s4     <= sign_s3 & ~(subtract_s3 & zero);
    infinite_s4 <= infinite_s3;
    nan_s4      <= nan_s3;
  end

  // Stage 5: round. A carry out of the fraction raises the exponent.
  wire [14:0] rounded  = {exponent_s4, fraction_s4} + {14'd0, round_up_s4};
  wire        overflow = (&exponent_s4) | (&rounded[14:10]);

  always @(posedge clk) begin
    if (nan_s4)
      y <= 16'h7e00;
    else if (infinite_s4 | overflow)
      y <= {sign_s4, 5'h1f, 10'd0};
    else
      y <= {sign_s4, rounded};
  end

  // The bit that borrowed, one that no count needs, and the leading one.
  wire unused = &{1'b0, difference[0], in_4[0], normalised[14]};

endmodule

`default_nettype wire
