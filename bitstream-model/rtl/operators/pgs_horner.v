// A step of a polynomial in fixed point with 48 fraction bits:
// y = COEFFICIENT + floor(z * factor / 2^48 + 1/2).
//
// Latency 4, one step a cycle. z is not negative; the other numbers are in two's complement, and y
// is the low SUM_WIDTH bits of the result. The suffix _s<n> names a register at the end of stage n:
//
//   1  multiply  nine partial products of at most 17 x 17 bits, one multiplier each
//   2  rows      z times each limb of the factor; to the upper row the coefficient and the 1/2
//   3  add       the two lower rows; the two parts of the upper one
//   4  add       both sums
//
// Products of 23 x 17 bits would be six, which fit slices of UltraScale+ as well; multipliers of
// 18 x 18 bits need a sum behind each of them.
`default_nettype none

module pgs_horner #(
  parameter integer                FACTOR_WIDTH = 48,
  parameter integer                SUM_WIDTH    = 48,
  parameter signed [SUM_WIDTH-1:0] COEFFICIENT  = 0
) (
  input  wire                           clk,
  input  wire [45:0]                    z,
  input  wire signed [FACTOR_WIDTH-1:0] factor,
  output reg  signed [SUM_WIDTH-1:0]    y
);

  // Three limbs of each number; the factor's upper one has the sign.
  wire [50:0] extended = {{51-FACTOR_WIDTH{factor[FACTOR_WIDTH-1]}}, factor};

  wire [33:0] z_0      = {17'd0, z[16:0]};
  wire [33:0] z_1      = {17'd0, z[33:17]};
  wire [28:0] z_2      = {17'd0, z[45:34]};
  wire [33:0] factor_0 = {17'd0, extended[16:0]};
  wire [33:0] factor_1 = {17'd0, extended[33:17]};
  wire [33:0] factor_2 = {{17{extended[50]}}, extended[50:34]};

  // Stage 1: multiply. Names: limb of z, limb of the factor.
  reg [33:0] product_00_s1;
  reg [33:0] product_10_s1;
  reg [28:0] product_20_s1;
  reg [33:0] product_01_s1;
  reg [33:0] product_11_s1;
  reg [28:0] product_21_s1;
  reg [33:0] product_02_s1;
  reg [33:0] product_12_s1;
  reg [28:0] product_22_s1;

  always @(posedge clk) begin
    product_00_s1 <= z_0 * factor_0;
    product_10_s1 <= z_1 * factor_0;
    product_20_s1 <= z_2 * factor_0[28:0];
    product_01_s1 <= z_0 * factor_1;
    product_11_s1 <= z_1 * factor_1;
    product_21_s1 <= z_2 * factor_1[28:0];
    product_02_s1 <= $signed(z_0) * $signed(factor_2);
    product_12_s1 <= $signed(z_1) * $signed(factor_2);
    product_22_s1 <= $signed(z_2) * $signed(factor_2[28:0]);
  end

  // Stage 2: rows. Of the first one the bits from 17 on, where the next one begins. The coefficient
  // begins at bit 48, which is bit 14 of the third row, and the 1/2 that rounds is the bit below.
  localparam [62:0] ADDEND = {{49-SUM_WIDTH{COEFFICIENT[SUM_WIDTH-1]}}, COEFFICIENT, 1'b1, 13'd0};

  wire [45:0] row_0 = {product_20_s1, product_00_s1[33:17]} + {12'd0, product_10_s1};
  wire [45:0] row_1 = {product_21_s1, product_01_s1[33:17]} + {12'd0, product_11_s1};
  wire [33:0] row_2 = product_12_s1 + {{17{product_02_s1[33]}}, product_02_s1[33:17]};

  reg [45:0] row_0_s2;
  reg [62:0] row_1_s2;
  reg [50:0] row_2_s2;
  reg [28:0] upper_s2;

  always @(posedge clk) begin
    row_0_s2 <= row_0;
    row_1_s2 <= {row_1, product_01_s1[16:0]};
    row_2_s2 <= {row_2, product_02_s1[16:0]};
    upper_s2 <= product_22_s1 + ADDEND[62:34];
  end

  // Stage 3: add. Of the lower sum the bits from 17 on, where the third row begins.
  wire [62:0] lower = row_1_s2 + {17'd0, row_0_s2};

  reg [45:0] lower_s3;
  reg [62:0] upper_s3;

  always @(posedge clk) begin
    lower_s3 <= lower[62:17];
    upper_s3 <= {upper_s2, ADDEND[33:0]} + {{12{row_2_s2[50]}}, row_2_s2};
  end

  // Stage 4: add.
  wire [62:0] total = upper_s3 + {17'd0, lower_s3};

  always @(posedge clk) begin
    y <= total[SUM_WIDTH+13:14];
  end

  // Carries into nothing, above y, rounded off.
  wire unused = &{1'b0, product_00_s1[16:0], lower[16:0], total[62:SUM_WIDTH+14], total[13:0]};

endmodule

`default_nettype wire
