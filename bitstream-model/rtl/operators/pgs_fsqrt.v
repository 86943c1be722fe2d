// Square root of a binary32 number, rounded to nearest even: y = sqrt(a).
//
// Latency 27, one root a cycle. Non-restoring square root, one bit of the root in each of 25 rows:
//
//    1        unpack  radicand with an even exponent, exponent of the root; zero, NaN, infinity
//    2 .. 26  rows    row r gives bit 24 - r of the root
//   27        round   rounding; zeros, infinities and NaN
//
// The root of a number of 24 bits is never half way between two numbers of 24 bits: the bit below
// the fraction decides the rounding, and the remainder is not needed.
//
// Subnormals: an operand counts as a zero of its sign; results are never subnormal. The root of -0
// is -0, NaN results (of other negative operands, too) are 7fc00000.
//
// Rules: bitstream-model/README.md, section 7.
// Rows: Ercegovac and Lang, Division and Square Root (1994), non-restoring, radix 2.
`default_nettype none

module pgs_fsqrt (
  input  wire        clk,
  input  wire [31:0] a,
  output reg  [31:0] y
);

  localparam ROWS = 25;

  // Stage 1: unpack. With biased exponent e the root's is (e + 127) / 2, or (e + 126) / 2 with the
  // significand doubled. The radicand is in 1 .. 4, with two bits before the point. The exponent
  // is noted less 1, which the leading bit of the root adds again.
  wire        doubled  = ~a[23];
  wire [25:0] scaled   = doubled ? {1'b1, a[22:0], 2'b00} : {2'b01, a[22:0], 1'b0};
  wire  [7:0] exponent = {1'b0, a[30:24]} + {7'd31, a[23]};
  wire        zero     = ~|a[30:23];
  wire        infinite = (&a[30:23]) & (~|a[22:0]) & ~a[31];
  wire        nan      = ((&a[30:23]) & (|a[22:0])) | (a[31] & ~zero);

  // Two shift registers run beside the rows: the radicand and the rest of the result. Row r takes
  // bit pair r of the radicand. From row 13 on the bits of the radicand are zeros.
  localparam RADICAND_ROWS = 13;
  localparam NOTES         = 12;

  reg [26*RADICAND_ROWS-1:0] radicand;
  reg [NOTES*(ROWS+1)-1:0]   notes;

  always @(posedge clk) begin
    radicand <= {radicand[26*(RADICAND_ROWS-1)-1:0], scaled};
    notes    <= {notes[NOTES*ROWS-1:0], exponent, a[31], zero, infinite, nan};
  end

  // Stages 2 to 26: the rows. Row r has r bits of root and a remainder of r + 2 bits, in two's
  // complement between -2 root - 1 and 2 root. It quadruples the remainder, appends two bits of the
  // radicand, and subtracts 4 root + 1 from a remainder that is not negative, or adds 4 root + 3 to
  // one that is: that subtracts the root, or its complement, followed by 01.
  //
  // `roots` and `remainders` hold the operands of the rows one behind the other, the root with a
  // zero in front: r + 1 bits of root and r + 2 bits of remainder for row r.
  reg [ROWS*(ROWS+1)/2-1:0] roots;
  reg [ROWS*(ROWS+3)/2-1:0] remainders;
  reg [ROWS-1:0]            root_s26;

  always @(posedge clk) begin
    roots[0]        <= 1'b0;
    remainders[1:0] <= 2'b00;
  end

  genvar row;
  generate
    for (row = 0; row < ROWS; row = row + 1) begin : rows
      localparam ROOT           = row * (row + 1) / 2;
      localparam NEXT_ROOT      = ROOT + row + 1;
      localparam REMAINDER      = row * (row + 3) / 2;
      localparam NEXT_REMAINDER = REMAINDER + row + 2;

      wire [row:0]   root     = roots[ROOT +: row+1];
      wire           add_back = remainders[REMAINDER+row+1];
      wire [1:0]     digits;
      wire [row+2:0] grown    = {remainders[REMAINDER +: row+1], digits};
      wire [row+2:0] step     = {root ^ {(row+1){add_back}}, 2'b01};
      wire [row+2:0] left     = grown - step;
      wire           bit_here = ~left[row+2];

      if (row < RADICAND_ROWS) begin : with_radicand
        assign digits = radicand[26*row + 24 - 2*row +: 2];
      end else begin : past_radicand
        assign digits = 2'b00;
      end

      if (row < ROWS - 1) begin : keep
        always @(posedge clk) begin
          roots[NEXT_ROOT +: row+2]           <= {root, bit_here};
          remainders[NEXT_REMAINDER +: row+3] <= left;
        end
      end else begin : last
        always @(posedge clk) begin
          root_s26 <= {root[row-1:0], bit_here};
        end

        wire unused = &{1'b0, root[row], left[row+1:0], radicand[26*RADICAND_ROWS-1 -: 24]};
      end
    end
  endgenerate

  // Stage 27: round. A carry out of the fraction raises the exponent.
  wire [7:0]  exponent_s26 = notes[NOTES*ROWS+4 +: 8];
  wire        sign_s26     = notes[NOTES*ROWS+3];
  wire        zero_s26     = notes[NOTES*ROWS+2];
  wire        infinite_s26 = notes[NOTES*ROWS+1];
  wire        nan_s26      = notes[NOTES*ROWS];
  wire [30:0] truncated    = {exponent_s26, 23'd0} + {7'd0, root_s26[24:1]};
  wire [30:0] rounded      = truncated + {30'd0, root_s26[0]};

  always @(posedge clk) begin
    if (nan_s26)
      y <= 32'h7fc00000;
    else if (infinite_s26)
      y <= {1'b0, 8'hff, 23'd0};
    else if (zero_s26)
      y <= {sign_s26, 31'd0};
    else
      y <= {1'b0, rounded};
  end

endmodule

`default_nettype wire
