// Sine and cosine of a binary16 number in 0 .. pi/8: y = {cos(a), sin(a)}.
//
// Latency 12, one argument a cycle. For every argument in the range both results have the bits of
// libm's sinf and cosf, rounded once more. With x = a * 2^16 (an integer from 2^-6 on; a smaller
// argument counts as 0), z = x * x, and all quotients rounded down:
//
//   sine    u = 87383 - 1100 * (z / 2^18) / 2^12       v = (z / 2^10) * u / 2^17
//           sin(a) = (x * 2^24 - x * v) / 2^40
//   cosine  u = 87382 -  711 * (z / 2^18) / 2^12       v = (z / 2^13) * u / 2^20
//           cos(a) = (2^39 - z * 2^6 + (z / 2^13) * v + 2^14) / 2^15, which has 24 fraction bits
//
// each rounded to nearest even. The coefficients are near 2^19 / 6 and 2^17 / 120, 2^21 / 24 and
// 2^19 / 720, chosen so that no argument is wrong. Between 1/2 and 1 the numbers of 24 fraction bits
// are the binary32 ones: the cosine is rounded twice, as the specification's is. The suffix _s<n>
// names a register at the end of stage n:
//
//    1        x
//    2 ..  3  z
//    4        u
//    5 ..  6  v
//    7 ..  8  products of x or z with v
//    9        sums
//   10 .. 11  hround
//   12        choice: below 2^-5 the sine is the argument, subnormal or not
//
// NaN and infinity give 7e00 twice. Elsewhere out of the range nothing is defined.
//
// Rules: bitstream-model/README.md, section 7. Check of every argument: `rtlgen operators`.
`default_nettype none

module pgs_hsincos (
  input  wire        clk,
  input  wire [15:0] a,
  output reg  [31:0] y
);

  localparam [16:0] S1 = 17'd87383;
  localparam [22:0] S2 = 23'd1100;
  localparam [16:0] C1 = 17'd87382;
  localparam [22:0] C2 = 23'd711;

  // The argument in stages 1 to 11, and x in stages 1 to 8.
  reg [16*11-1:0] arguments;
  reg [15*8-1:0]  xs;

  // Stage 1: x. The exponent is 9 (2^-6) to 13; an argument below does not move the cosine.
  wire [14:0] unshifted = {4'd0, 1'b1, a[9:0]};
  wire  [2:0] places    = a[12:10] - 3'd1;
  wire        below     = a[14:10] < 5'd9;

  always @(posedge clk) begin
    arguments <= {arguments[16*10-1:0], a};
    xs        <= {xs[15*7-1:0], below ? 15'd0 : unshifted << places};
  end

  wire [14:0] x_s1 = xs[14:0];
  wire [14:0] x_s6 = xs[15*5 +: 15];
  wire [14:0] x_s8 = xs[15*7 +: 15];

  // Stages 2 and 3: z, and z in stages 3 to 8.
  reg [29:0]     z_s2;
  reg [30*6-1:0] zs;

  always @(posedge clk) begin
    z_s2 <= {15'd0, x_s1} * {15'd0, x_s1};
    zs   <= {zs[30*5-1:0], z_s2};
  end

  wire [29:0] z_s3 = zs[29:0];
  wire [29:0] z_s4 = zs[30 +: 30];
  wire [29:0] z_s6 = zs[30*3 +: 30];
  wire [29:0] z_s8 = zs[30*5 +: 30];

  // Stage 4: u.
  wire [22:0] sine_term   = S2 * {11'd0, z_s3[29:18]};
  wire [22:0] cosine_term = C2 * {11'd0, z_s3[29:18]};
  reg  [16:0] sine_u_s4;
  reg  [16:0] cosine_u_s4;

  always @(posedge clk) begin
    sine_u_s4   <= S1 - {6'd0, sine_term[22:12]};
    cosine_u_s4 <= C1 - {6'd0, cosine_term[22:12]};
  end

  // Stages 5 and 6: v.
  reg [36:0] sine_v_s5;
  reg [36:0] sine_v_s6;
  reg [33:0] cosine_v_s5;
  reg [33:0] cosine_v_s6;

  always @(posedge clk) begin
    sine_v_s5   <= {17'd0, z_s4[29:10]} * {20'd0, sine_u_s4};
    sine_v_s6   <= sine_v_s5;
    cosine_v_s5 <= {17'd0, z_s4[29:13]} * {17'd0, cosine_u_s4};
    cosine_v_s6 <= cosine_v_s5;
  end

  // Stages 7 and 8: products.
  reg [34:0] sine_product_s7;
  reg [34:0] sine_product_s8;
  reg [30:0] cosine_product_s7;
  reg [30:0] cosine_product_s8;

  always @(posedge clk) begin
    sine_product_s7   <= {20'd0, x_s6} * {15'd0, sine_v_s6[36:17]};
    sine_product_s8   <= sine_product_s7;
    cosine_product_s7 <= {14'd0, z_s6[29:13]} * {17'd0, cosine_v_s6[33:20]};
    cosine_product_s8 <= cosine_product_s7;
  end

  // Stage 9: sums.
  wire [39:0] one_and_half = {1'b1, 39'd16384};
  wire [39:0] cosine       = one_and_half - {4'd0, z_s8, 6'd0} + {9'd0, cosine_product_s8};
  reg  [38:0] sine_s9;
  reg  [24:0] cosine_s9;

  always @(posedge clk) begin
    sine_s9   <= {x_s8, 24'd0} - {4'd0, sine_product_s8};
    cosine_s9 <= cosine[39:15];
  end

  // Stages 10 and 11: round. From 2^-5 to 2^-2 the exponent ends in 2, 3, 0 and 1 (10 to 13).
  wire  [1:0] exponent_s8 = arguments[16*7+10 +: 2];
  wire  [1:0] exponent_s9 = arguments[16*8+10 +: 2];
  wire        nan_s9      = &arguments[16*8+10 +: 5];
  wire [15:0] sine_s11;
  wire [15:0] cosine_s11;
  wire [38:0] shifted     = sine_s9 << {exponent_s9[1], ~exponent_s9[0]};

  pgs_hround rounds_sine (
    .clk(clk),
    .exponent({4'b0001, ~exponent_s8[1], exponent_s8}),
    .significand(shifted[38:26]),
    .sticky(|shifted[25:0]),
    .sign(1'b0),
    .zero(1'b0),
    .infinite(1'b0),
    .nan(nan_s9),
    .y(sine_s11)
  );

  pgs_hround rounds_cosine (
    .clk(clk),
    .exponent(7'd15),
    .significand(cosine_s9[24:12]),
    .sticky(|cosine_s9[11:0]),
    .sign(1'b0),
    .zero(1'b0),
    .infinite(1'b0),
    .nan(nan_s9),
    .y(cosine_s11)
  );

  // Stage 12: choice.
  wire [15:0] argument_s11 = arguments[16*10 +: 16];

  always @(posedge clk) begin
    y <= {cosine_s11, (argument_s11[14:10] < 5'd10) ? argument_s11 : sine_s11};
  end

  // Rounded off.
  wire unused = &{1'b0, sine_term[11:0], cosine_term[11:0], sine_v_s6[16:0], cosine_v_s6[19:0],
                  cosine[14:0], z_s4[9:0], z_s6[12:0], z_s3[17:0]};

endmodule

`default_nettype wire
