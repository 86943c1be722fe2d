// Sine and cosine of a binary32 number in -pi/8 .. pi/8: y = {cos(a), sin(a)}.
//
// Latency 20, one argument a cycle. For every argument in the range both results have the bits of
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
//    2 ..  3  square of the significand
//    4        z
//    5 .. 16  four Horner steps of three stages
//   17 .. 18  product of significand and sine's factor
//   19        normalise
//   20        round
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

  // The argument in stages 1 to 19.
  reg [32*19-1:0] arguments;

  always @(posedge clk) begin
    arguments <= {arguments[32*18-1:0], a};
  end

  wire [23:0] significand_s1  = {1'b1, arguments[22:0]};
  wire  [3:0] exponent_s3     = arguments[32*2+23 +: 4];
  wire [23:0] significand_s16 = {1'b1, arguments[32*15 +: 23]};
  wire  [7:0] exponent_s18    = arguments[32*17+23 +: 8];
  wire [31:0] argument_s19    = arguments[32*18 +: 32];

  // Stages 2 and 3: square of the significand, with a register for the multiplier's inside.
  reg [47:0] square_s2;
  reg [47:0] square_s3;

  always @(posedge clk) begin
    square_s2 <= {24'd0, significand_s1} * {24'd0, significand_s1};
    square_s3 <= square_s2;
  end

  // Stage 4: z, which is below 1/4. The shift but for its last two bits is 250 - 2 biased exponent:
  // an even number from 0 to 20, for which four bits of the exponent are enough.
  wire [46:0] shifted = square_s3[47:1] >> {4'd13 - exponent_s3, 1'b0};
  wire [45:0] z       = shifted[46:1] + {45'd0, shifted[0]};

  // z in stages 4 to 13.
  reg [46*10-1:0] zs;

  always @(posedge clk) begin
    zs <= {zs[46*9-1:0], z};
  end

  wire [45:0] z_s4  = zs[0 +: 46];
  wire [45:0] z_s7  = zs[46*3 +: 46];
  wire [45:0] z_s10 = zs[46*6 +: 46];
  wire [45:0] z_s13 = zs[46*9 +: 46];

  // Stages 5 to 16: the polynomials. The last sums are just below 1, so that their low 48 bits are
  // their fraction, with nothing to add to the product.
  wire signed [36:0] sine_s7;
  wire signed [42:0] sine_s10;
  wire signed [46:0] sine_s13;
  wire        [47:0] sine_factor_s16;
  wire signed [39:0] cosine_s7;
  wire signed [44:0] cosine_s10;
  wire signed [47:0] cosine_s13;
  wire        [47:0] cosine_s16;

  pgs_horner #(.FACTOR_WIDTH(31), .SUM_WIDTH(37), .COEFFICIENT(S3)) sine_3 (
    .clk(clk),
    .z(z_s4),
    .factor(S4),
    .y(sine_s7)
  );

  pgs_horner #(.FACTOR_WIDTH(37), .SUM_WIDTH(43), .COEFFICIENT(S2)) sine_2 (
    .clk(clk),
    .z(z_s7),
    .factor(sine_s7),
    .y(sine_s10)
  );

  pgs_horner #(.FACTOR_WIDTH(43), .SUM_WIDTH(47), .COEFFICIENT(S1)) sine_1 (
    .clk(clk),
    .z(z_s10),
    .factor(sine_s10),
    .y(sine_s13)
  );

  pgs_horner #(.FACTOR_WIDTH(47), .SUM_WIDTH(48), .COEFFICIENT(48'sd0)) sine_0 (
    .clk(clk),
    .z(z_s13),
    .factor(sine_s13),
    .y(sine_factor_s16)
  );

  pgs_horner #(.FACTOR_WIDTH(34), .SUM_WIDTH(40), .COEFFICIENT(C3)) cosine_3 (
    .clk(clk),
    .z(z_s4),
    .factor(C4),
    .y(cosine_s7)
  );

  pgs_horner #(.FACTOR_WIDTH(40), .SUM_WIDTH(45), .COEFFICIENT(C2)) cosine_2 (
    .clk(clk),
    .z(z_s7),
    .factor(cosine_s7),
    .y(cosine_s10)
  );

  pgs_horner #(.FACTOR_WIDTH(45), .SUM_WIDTH(48), .COEFFICIENT(C1)) cosine_1 (
    .clk(clk),
    .z(z_s10),
    .factor(cosine_s10),
    .y(cosine_s13)
  );

  pgs_horner #(.FACTOR_WIDTH(48), .SUM_WIDTH(48), .COEFFICIENT(48'sd0)) cosine_0 (
    .clk(clk),
    .z(z_s13),
    .factor(cosine_s13),
    .y(cosine_s16)
  );

  // Stages 17 and 18: the sine is the significand times its factor.
  reg [71:0] sine_s17;
  reg [71:0] sine_s18;
  reg [47:0] cosine_s17;
  reg [47:0] cosine_s18;

  always @(posedge clk) begin
    sine_s17   <= {48'd0, significand_s16} * {24'd0, sine_factor_s16};
    sine_s18   <= sine_s17;
    cosine_s17 <= cosine_s16;
    cosine_s18 <= cosine_s17;
  end

  // Stage 19: normalise. The sine's significand is in 1/2 .. 1 times the argument's; bit 71
  // weighs 1. The cosine is in 1/2 .. 1, its bit 47 is a 1.
  wire top = sine_s18[71];

  reg [22:0] sine_fraction_s19;
  reg  [7:0] sine_exponent_s19;
  reg        sine_round_up_s19;
  reg [22:0] cosine_fraction_s19;
  reg        cosine_round_up_s19;
  reg        small_s19;
  reg        zero_s19;
  reg        nan_s19;

  always @(posedge clk) begin
    sine_fraction_s19 <= top ? sine_s18[70:48] : sine_s18[69:47];
    sine_exponent_s19 <= exponent_s18 - {7'd0, ~top};
    sine_round_up_s19 <= top ? sine_s18[47] & (sine_s18[48] | (|sine_s18[46:0]))
                               : sine_s18[46] & (sine_s18[47] | (|sine_s18[45:0]));
    cosine_fraction_s19 <= cosine_s18[46:24];
    cosine_round_up_s19 <= cosine_s18[23] & (cosine_s18[24] | (|cosine_s18[22:0]));
    small_s19           <= exponent_s18 < 8'd115;
    zero_s19            <= ~|exponent_s18;
    nan_s19             <= &exponent_s18;
  end

  // Stage 20: round. A carry out of a fraction raises the exponent.
  wire [30:0] sine_truncated = {sine_exponent_s19, sine_fraction_s19};
  wire [30:0] sine_rounded   = sine_truncated + {30'd0, sine_round_up_s19};
  wire [30:0] cosine_rounded = {8'd126, cosine_fraction_s19} + {30'd0, cosine_round_up_s19};

  always @(posedge clk) begin
    if (nan_s19)
      y <= {2{32'h7fc00000}};
    else if (zero_s19)
      y <= {32'h3f800000, argument_s19[31], 31'd0};
    else if (small_s19)
      y <= {32'h3f800000, argument_s19};
    else
      y <= {1'b0, cosine_rounded, argument_s19[31], sine_rounded};
  end

  // Always 1, and too low to round.
  wire unused = &{1'b0, cosine_s18[47], square_s3[0]};

endmodule

`default_nettype wire
