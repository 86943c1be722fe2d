// Sine and cosine of a binary32 number in -pi/8 .. pi/8: y = {cos(a), sin(a)}.
//
// Latency 26, one argument a cycle. For every argument in the range both results have the bits of
// libm's sinf and cosf: its polynomials, in fixed point with F = 48 fraction bits. With exponent e
// and significand m of 24 bits (|a| = m * 2^(e-23)) and round(v) = floor(v / 2^48 + 1/2):
//
//   square  z = m * m shifted right by -2e - 2, rounded half up
//   sine    s = S1 + round(z * (S2 + round(z * (S3 + round(z * S4)))))
//   cosine  c = C1 + round(z * (C2 + round(z * (C3 + round(z * C4)))))
//   results sin(a) = m * (2^48 + round(z * s)) * 2^(e-71), cos(a) = (2^48 + round(z * c)) / 2^48,
//           each rounded to nearest even
//
// S and C are libm's coefficients times 2^48, rounded. Below 2^-12 the results are a and 1.
// The suffix _s<n> names a register at the end of stage n:
//
//    1        argument
//    2        square of the significand: three partial products
//    3        add
//    4        shift
//    5        z
//    6 .. 21  four Horner steps of four stages
//   22        significand times sine's factor: six partial products
//   23        rows: the factor times each limb of the significand
//   24        add
//   25        normalise
//   26        round
//
// Subnormals: an argument counts as a zero of its sign. NaN and infinity give 7fc00000 twice.
// Beyond pi/8 the results are not defined.
//
// Polynomials: FreeBSD's msun, k_sinf.c and k_cosf.c, as in the crate libm. The definition above in
// integers, and its comparison with libm: tools/rtlgen/src/verify/sincos.rs.
`default_nettype none

module pgs_fsincos (
  input  wire        clk,
  input  wire [31:0] a,
  output reg  [63:0] y
);

  // Coefficients in the widths of the sums that they begin.
  localparam signed [46:0] S1 = -47'sd46912496047961;
  localparam signed [42:0] S2 =  43'sd2345623694815;
  localparam signed [36:0] S3 = -37'sd55842763109;
  localparam signed [30:0] S4 =  31'sd765136664;
  localparam signed [47:0] C1 = -48'sd140737487581562;
  localparam signed [44:0] C2 =  45'sd11728111829661;
  localparam signed [39:0] C3 = -40'sd390877651004;
  localparam signed [33:0] C4 =  34'sd6865301007;

  // The argument in stages 1 to 25.
  reg [32*25-1:0] arguments;

  always @(posedge clk) begin
    arguments <= {arguments[32*24-1:0], a};
  end

  wire [23:0] significand_s1  = {1'b1, arguments[22:0]};
  wire  [3:0] exponent_s3     = arguments[32*2+23 +: 4];
  wire [23:0] significand_s21 = {1'b1, arguments[32*20 +: 23]};
  wire  [7:0] exponent_s24    = arguments[32*23+23 +: 8];
  wire [31:0] argument_s25    = arguments[32*24 +: 32];

  // Stages 2 and 3: square of the significand.
  wire [16:0] low_s1  = significand_s1[16:0];
  wire  [6:0] high_s1 = significand_s1[23:17];

  reg [33:0] low_square_s2;
  reg [23:0] both_s2;
  reg [13:0] high_square_s2;
  reg [47:0] square_s3;

  wire [29:0] square_upper = {high_square_s2, low_square_s2[33:18]} + {6'd0, both_s2};

  always @(posedge clk) begin
    low_square_s2  <= {17'd0, low_s1} * {17'd0, low_s1};
    both_s2        <= {7'd0, low_s1} * {17'd0, high_s1};
    high_square_s2 <= {7'd0, high_s1} * {7'd0, high_s1};
    square_s3      <= {square_upper, low_square_s2[17:0]};
  end

  // Stages 4 and 5: z, which is below 1/4. The shift but for its last two bits is 250 - 2 biased
  // exponent: an even number from 0 to 20, for which four bits of the exponent are enough.
  reg [46:0] shifted_s4;

  wire [45:0] z = shifted_s4[46:1] + {45'd0, shifted_s4[0]};

  // z in stages 5 to 17.
  reg [46*13-1:0] zs;

  always @(posedge clk) begin
    shifted_s4 <= square_s3[47:1] >> {4'd13 - exponent_s3, 1'b0};
    zs         <= {zs[46*12-1:0], z};
  end

  wire [45:0] z_s5  = zs[0 +: 46];
  wire [45:0] z_s9  = zs[46*4 +: 46];
  wire [45:0] z_s13 = zs[46*8 +: 46];
  wire [45:0] z_s17 = zs[46*12 +: 46];

  // Stages 6 to 21: the polynomials. The last sums are just below 1, so that their low 48 bits are
  // their fraction, with nothing to add to the product.
  wire signed [36:0] sine_s9;
  wire signed [42:0] sine_s13;
  wire signed [46:0] sine_s17;
  wire        [47:0] sine_factor_s21;
  wire signed [39:0] cosine_s9;
  wire signed [44:0] cosine_s13;
  wire signed [47:0] cosine_s17;
  wire        [47:0] cosine_s21;

  pgs_horner #(.FACTOR_WIDTH(31), .SUM_WIDTH(37), .COEFFICIENT(S3)) sine_3 (
    .clk(clk),
    .z(z_s5),
    .factor(S4),
    .y(sine_s9)
  );

  pgs_horner #(.FACTOR_WIDTH(37), .SUM_WIDTH(43), .COEFFICIENT(S2)) sine_2 (
    .clk(clk),
    .z(z_s9),
    .factor(sine_s9),
    .y(sine_s13)
  );

  pgs_horner #(.FACTOR_WIDTH(43), .SUM_WIDTH(47), .COEFFICIENT(S1)) sine_1 (
    .clk(clk),
    .z(z_s13),
    .factor(sine_s13),
    .y(sine_s17)
  );

  pgs_horner #(.FACTOR_WIDTH(47), .SUM_WIDTH(48), .COEFFICIENT(48'sd0)) sine_0 (
    .clk(clk),
    .z(z_s17),
    .factor(sine_s17),
    .y(sine_factor_s21)
  );

  pgs_horner #(.FACTOR_WIDTH(34), .SUM_WIDTH(40), .COEFFICIENT(C3)) cosine_3 (
    .clk(clk),
    .z(z_s5),
    .factor(C4),
    .y(cosine_s9)
  );

  pgs_horner #(.FACTOR_WIDTH(40), .SUM_WIDTH(45), .COEFFICIENT(C2)) cosine_2 (
    .clk(clk),
    .z(z_s9),
    .factor(cosine_s9),
    .y(cosine_s13)
  );

  pgs_horner #(.FACTOR_WIDTH(45), .SUM_WIDTH(48), .COEFFICIENT(C1)) cosine_1 (
    .clk(clk),
    .z(z_s13),
    .factor(cosine_s13),
    .y(cosine_s17)
  );

  pgs_horner #(.FACTOR_WIDTH(48), .SUM_WIDTH(48), .COEFFICIENT(48'sd0)) cosine_0 (
    .clk(clk),
    .z(z_s17),
    .factor(cosine_s17),
    .y(cosine_s21)
  );

  // Stages 22 to 24: the sine is the significand times its factor. Names of products: limb
  // of the significand, limb of the factor.
  wire [16:0] low_s21  = significand_s21[16:0];
  wire  [6:0] high_s21 = significand_s21[23:17];
  wire [16:0] factor_0 = sine_factor_s21[16:0];
  wire [16:0] factor_1 = sine_factor_s21[33:17];
  wire [13:0] factor_2 = sine_factor_s21[47:34];

  reg [33:0] product_00_s22;
  reg [33:0] product_01_s22;
  reg [30:0] product_02_s22;
  reg [23:0] product_10_s22;
  reg [23:0] product_11_s22;
  reg [20:0] product_12_s22;
  reg [64:0] row_0_s23;
  reg [54:0] row_1_s23;
  reg [71:0] sine_s24;
  reg [47:0] cosine_s22;
  reg [47:0] cosine_s23;
  reg [47:0] cosine_s24;

  wire [47:0] row_0 = {product_02_s22, product_00_s22[33:17]} + {14'd0, product_01_s22};
  wire [37:0] row_1 = {product_12_s22, 10'd0, product_10_s22[23:17]} + {14'd0, product_11_s22};
  wire [54:0] upper = row_1_s23 + {7'd0, row_0_s23[64:17]};

  always @(posedge clk) begin
    product_00_s22 <= {17'd0, low_s21} * {17'd0, factor_0};
    product_01_s22 <= {17'd0, low_s21} * {17'd0, factor_1};
    product_02_s22 <= {14'd0, low_s21} * {17'd0, factor_2};
    product_10_s22 <= {17'd0, high_s21} * {7'd0, factor_0};
    product_11_s22 <= {17'd0, high_s21} * {7'd0, factor_1};
    product_12_s22 <= {14'd0, high_s21} * {7'd0, factor_2};
    row_0_s23      <= {row_0, product_00_s22[16:0]};
    row_1_s23      <= {row_1, product_10_s22[16:0]};
    sine_s24       <= {upper, row_0_s23[16:0]};
    cosine_s22     <= cosine_s21;
    cosine_s23     <= cosine_s22;
    cosine_s24     <= cosine_s23;
  end

  // Stage 25: normalise. The sine's significand is in 1/2 .. 1 times the argument's; bit 71
  // weighs 1. The cosine is in 1/2 .. 1, its bit 47 is a 1.
  wire top = sine_s24[71];

  reg [22:0] sine_fraction_s25;
  reg  [7:0] sine_exponent_s25;
  reg        sine_round_up_s25;
  reg [22:0] cosine_fraction_s25;
  reg        cosine_round_up_s25;
  reg        small_s25;
  reg        zero_s25;
  reg        nan_s25;

  always @(posedge clk) begin
    sine_fraction_s25 <= top ? sine_s24[70:48] : sine_s24[69:47];
    sine_exponent_s25 <= exponent_s24 - {7'd0, ~top};
    sine_round_up_s25 <= top ? sine_s24[47] & (sine_s24[48] | (|sine_s24[46:0]))
                               : sine_s24[46] & (sine_s24[47] | (|sine_s24[45:0]));
    cosine_fraction_s25 <= cosine_s24[46:24];
    cosine_round_up_s25 <= cosine_s24[23] & (cosine_s24[24] | (|cosine_s24[22:0]));
    small_s25           <= exponent_s24 < 8'd115;
    zero_s25            <= ~|exponent_s24;
    nan_s25             <= &exponent_s24;
  end

  // Stage 26: round. A carry out of a fraction raises the exponent.
  wire [30:0] sine_truncated = {sine_exponent_s25, sine_fraction_s25};
  wire [30:0] sine_rounded   = sine_truncated + {30'd0, sine_round_up_s25};
  wire [30:0] cosine_rounded = {8'd126, cosine_fraction_s25} + {30'd0, cosine_round_up_s25};

  always @(posedge clk) begin
    if (nan_s25)
      y <= {2{32'h7fc00000}};
    else if (zero_s25)
      y <= {32'h3f800000, argument_s25[31], 31'd0};
    else if (small_s25)
      y <= {32'h3f800000, argument_s25};
    else
      y <= {1'b0, cosine_rounded, argument_s25[31], sine_rounded};
  end

  // Always 1, and too low to round.
  wire unused = &{1'b0, cosine_s24[47], square_s3[0]};

endmodule

`default_nettype wire
