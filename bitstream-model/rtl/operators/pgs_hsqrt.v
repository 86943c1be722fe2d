// Square root of a binary16 number, rounded to nearest even: y = sqrt(a).
//
// Latency 9, one root a cycle. Non-restoring square root, 12 rows of one bit of the root, two rows
// a stage:
//
//    1        unpack     significand, exponent; zero, NaN and infinity
//    2        normalise  a subnormal significand shifted to its leading one
//    3 ..  8  rows       row r gives bit 11 - r of the root
//    9        round      rounding; zeros, infinities and NaN
//
// The root of a number of 11 bits is never half way between two numbers of 11 bits: the bit below
// the fraction decides the rounding, and the remainder is not needed. No root is subnormal. The
// root of -0 is -0, NaN results (of other negative operands, too) are 7e00.
//
// Rules: bitstream-model/README.md, section 7.
// Rows: Ercegovac and Lang, Division and Square Root (1994), non-restoring, radix 2.
`default_nettype none

module pgs_hsqrt (
  input  wire        clk,
  input  wire [15:0] a,
  output reg  [15:0] y
);

  localparam STAGES = 6;

  // Stage 1: unpack.
  wire zero     = ~|a[14:0];
  wire infinite = (a == {1'b0, 5'h1f, 10'd0});
  wire nan      = ((&a[14:10]) & (|a[9:0])) | (a[15] & ~zero);

  reg [10:0] plain_s1;
  reg  [5:0] exponent_s1;

  always @(posedge clk) begin
    plain_s1    <= {|a[14:10], a[9:0]};
    exponent_s1 <= {1'b0, a[14:11], a[10] | (~|a[14:10])} + 6'd13;
  end

  // Stage 2: normalise. With biased exponent e the root's is (e + 15) / 2, rounded down. It is noted
  // less 1, which the leading bit of the root adds again.
  wire [10:0] significand;
  wire  [3:0] leading;

  pgs_hnormal normal (
    .plain(plain_s1),
    .significand(significand),
    .leading(leading)
  );

  reg [10:0] significand_s2;
  reg  [5:0] twice_exponent_s2;

  always @(posedge clk) begin
    significand_s2    <= significand;
    twice_exponent_s2 <= exponent_s1 - {2'd0, leading};
  end

  // The significand of an odd exponent is as it is, of an even one doubled: 1 .. 4, with two bits
  // before the point. The rows of stages 3 to 5 take a pair of its bits each, later ones zeros.
  localparam RADICAND_STAGES = 3;
  localparam NOTES           = 4;

  wire [11:0] scaled = twice_exponent_s2[0] ? {significand_s2, 1'b0} : {1'b0, significand_s2};

  reg [12*(RADICAND_STAGES-1)-1:0] radicand;
  reg [5*STAGES-1:0]               exponent;
  reg [NOTES*(STAGES+2)-1:0]       notes;

  always @(posedge clk) begin
    radicand <= {radicand[12*(RADICAND_STAGES-2)-1:0], scaled};
    exponent <= {exponent[5*(STAGES-1)-1:0], twice_exponent_s2[5:1]};
    notes    <= {notes[NOTES*(STAGES+1)-1:0], a[15], zero, infinite, nan};
  end

  // Stages 3 to 8: the rows. Row r has r bits of root and a remainder of r + 2 bits, in two's
  // complement between -2 root - 1 and 2 root. It quadruples the remainder, appends two bits of the
  // radicand, and subtracts 4 root + 1 from a remainder that is not negative, or adds 4 root + 3 to
  // one that is: that subtracts the root, or its complement, followed by 01.
  //
  // Slot g of `roots` and of `remainders` has the results of the rows 2 g - 2 and 2 g - 1, the root with
  // a zero in front: 2 g + 1 bits of root and 2 g + 2 bits of remainder.
  reg [STAGES*STAGES-1:0]     roots;
  reg [STAGES*(STAGES+1)-1:0] remainders;
  reg [2*STAGES-1:0]          root_s8;

  always @(posedge clk) begin
    roots[0]        <= 1'b0;
    remainders[1:0] <= 2'b00;
  end

  genvar g;
  generate
    for (g = 0; g < STAGES; g = g + 1) begin : stages
      localparam R         = 2*g;
      localparam ROOT      = g*g;
      localparam REMAINDER = g*(g+1);

      wire [3:0] digits;
      if (g == 0) begin : begins
        assign digits = scaled[11:8];
      end else if (g < RADICAND_STAGES) begin : goes_on
        assign digits = radicand[12*(g-1) + 8 - 4*g +: 4];
      end else begin : past_radicand
        assign digits = 4'b0000;
      end

      wire [R:0]   root_0    = roots[ROOT +: R+1];
      wire         add_0     = remainders[REMAINDER+R+1];
      wire [R+2:0] left_0    = {remainders[REMAINDER +: R+1], digits[3:2]}
                             - {root_0 ^ {(R+1){add_0}}, 2'b01};
      wire [R+1:0] root_1    = {root_0, ~left_0[R+2]};
      wire         add_1     = left_0[R+2];
      wire [R+3:0] left_1    = {left_0[R+1:0], digits[1:0]} - {root_1 ^ {(R+2){add_1}}, 2'b01};
      wire [R+2:0] root_2    = {root_1, ~left_1[R+3]};

      if (g < STAGES - 1) begin : keep
        always @(posedge clk) begin
          roots[ROOT+R+1 +: R+3]           <= root_2;
          remainders[REMAINDER+R+2 +: R+4] <= left_1;
        end
      end else begin : last
        always @(posedge clk) root_s8 <= root_2[R+1:0];

        wire unused = &{1'b0, root_2[R+2], left_1[R+2:0], radicand[12*RADICAND_STAGES-13 -: 8]};
      end
    end
  endgenerate

  // Stage 9: round. A carry out of the fraction raises the exponent.
  wire  [4:0] exponent_s8 = exponent[5*(STAGES-1) +: 5];
  wire [14:0] truncated   = {exponent_s8, 10'd0} + {4'd0, root_s8[11:1]};
  wire [14:0] rounded     = truncated + {14'd0, root_s8[0]};

  always @(posedge clk) begin
    if (notes[NOTES*(STAGES+1)])
      y <= 16'h7e00;
    else if (notes[NOTES*(STAGES+1)+1])
      y <= {1'b0, 5'h1f, 10'd0};
    else if (notes[NOTES*(STAGES+1)+2])
      y <= {notes[NOTES*(STAGES+1)+3], 15'd0};
    else
      y <= {1'b0, rounded};
  end

endmodule

`default_nettype wire
