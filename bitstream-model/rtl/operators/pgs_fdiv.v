// Quotient of two binary32 numbers, rounded to nearest even: y = a / b.
//
// Latency 29, one quotient a cycle. Non-restoring division, one bit of the quotient in each of 26
// rows. The suffix _s<n> names a register at the end of stage n:
//
//    1        unpack     significands, difference of the exponents; zero, NaN and infinity
//    2 .. 27  rows       row r gives bit 25 - r of the quotient
//   28        normalise  23 bits of fraction, exponent, decision of the rounding
//   29        round      rounding; zeros, infinities and NaN
//
// The quotient of two significands of 24 bits is never half way between two numbers of 24 bits:
// the first bit below the fraction decides the rounding, and the remainder is not needed.
//
// Subnormals: an operand counts as a zero of its sign. A result is rounded on the grid of the
// subnormal numbers, and becomes a zero of its sign if it is still subnormal; a fraction of ones
// just below the smallest normal number rounds up to it (00ffffff / 2 = 00800000, see fmul.v), and
// with SMALLEST_NORMAL = 0 becomes a zero. NaN results are 7fc00000.
//
// Rules: bitstream-model/README.md, section 7.
// Rows: Ercegovac and Lang, Division and Square Root (1994), non-restoring, radix 2.
`default_nettype none

module pgs_fdiv #(
  parameter integer SMALLEST_NORMAL = 1
) (
  input  wire        clk,
  input  wire [31:0] a,
  input  wire [31:0] b,
  output reg  [31:0] y
);

  localparam ROWS = 26;

  // Stage 1: unpack. The exponent is biased and may be negative, two's complement.
  wire       a_is_zero     = ~|a[30:23];
  wire       b_is_zero     = ~|b[30:23];
  wire       a_is_infinite = (&a[30:23]) & (~|a[22:0]);
  wire       b_is_infinite = (&b[30:23]) & (~|b[22:0]);
  wire       a_is_nan      = (&a[30:23]) & (|a[22:0]);
  wire       b_is_nan      = (&b[30:23]) & (|b[22:0]);
  wire [9:0] exponent      = {2'b00, a[30:23]} - {2'b00, b[30:23]} + 10'd127;
  wire       sign          = a[31] ^ b[31];
  wire       zero          = a_is_zero | b_is_infinite;
  wire       infinite      = a_is_infinite | b_is_zero;
  wire       nan           = a_is_nan | b_is_nan | (a_is_infinite & b_is_infinite)
                           | (a_is_zero & b_is_zero);

  reg [23:0] dividend_s1;

  always @(posedge clk) begin
    dividend_s1 <= {1'b1, a[22:0]};
  end

  // Shift registers beside the rows: the divisor that each row needs, and the rest of the result.
  localparam NOTES = 14;

  reg [24*ROWS-1:0]        divisor;
  reg [NOTES*(ROWS+1)-1:0] notes;

  always @(posedge clk) begin
    divisor <= {divisor[24*(ROWS-1)-1:0], 1'b1, b[22:0]};
    notes   <= {notes[NOTES*ROWS-1:0], exponent, sign, zero, infinite, nan};
  end

  // Stage 2: row 0, whether the divisor goes into the dividend.
  //
  // The 25 bits of a remainder are a two's complement number between -divisor and divisor - 1.
  // Slot r of `remainder` and of `quotient` is what row r leaves.
  reg  [25*(ROWS-1)-1:0] remainder;
  reg  [ROWS*ROWS-1:0]   quotient;
  wire [24:0]            first = {1'b0, dividend_s1} - {1'b0, divisor[23:0]};

  always @(posedge clk) begin
    remainder[24:0] <= first;
    quotient[ROWS-1:0] <= {~first[24], {(ROWS-1){1'b0}}};
  end

  // Stages 3 to 27: rows 1 to 25. A row doubles the remainder, then subtracts the divisor from one
  // that is not negative and adds it to one that is, which is to subtract its complement and 1: the
  // bit below the difference borrows it.
  genvar row;
  generate
    for (row = 1; row < ROWS; row = row + 1) begin : rows
      wire        add_back   = remainder[25*(row-1)+24];
      wire [24:0] doubled    = {remainder[25*(row-1) +: 24], 1'b0};
      wire [24:0] step       = {1'b0, divisor[24*row +: 24]} ^ {25{add_back}};
      wire [25:0] difference = {doubled, ~add_back} - {step, 1'b1};
      wire [24:0] left       = difference[25:1];
      wire [25:0] bit_here   = {{(ROWS-1){1'b0}}, ~left[24]} << (ROWS - 1 - row);

      wire unused_borrow = difference[0];

      always @(posedge clk) begin
        quotient[ROWS*row +: ROWS] <= quotient[ROWS*(row-1) +: ROWS] | bit_here;
      end

      if (row < ROWS - 1) begin : keep
        always @(posedge clk) begin
          remainder[25*row +: 25] <= left;
        end
      end else begin : drop
        wire unused_remainder = &{1'b0, left[23:0]};
      end
    end
  endgenerate

  // Stage 28: normalise. The quotient of two significands is in 1/2 .. 2; bit 25 weighs 1.
  wire [25:0] quotient_s27  = quotient[ROWS*(ROWS-1) +: ROWS];
  wire  [9:0] exponent_s27  = notes[NOTES*ROWS+4 +: 10];
  wire        one_or_more   = quotient_s27[25];
  wire [22:0] fraction      = one_or_more ? quotient_s27[24:2] : quotient_s27[23:1];
  wire        guard         = one_or_more ? quotient_s27[1] : quotient_s27[0];
  wire  [9:0] normalised    = exponent_s27 - {9'd0, ~one_or_more};
  wire        nearly_normal = (SMALLEST_NORMAL != 0) & (~|normalised) & (&fraction);

  reg  [22:0] fraction_s28;
  reg         round_up_s28;
  reg   [9:0] exponent_s28;
  reg         sign_s28;
  reg         zero_s28;
  reg         infinite_s28;
  reg         nan_s28;

  always @(posedge clk) begin
    fraction_s28 <= fraction;
    round_up_s28 <= guard | nearly_normal;
    exponent_s28 <= normalised;
    sign_s28     <= notes[NOTES*ROWS+3];
    zero_s28     <= notes[NOTES*ROWS+2];
    infinite_s28 <= notes[NOTES*ROWS+1];
    nan_s28      <= notes[NOTES*ROWS];
  end

  // Stage 29: round. A carry out of the fraction raises the exponent.
  wire [32:0] rounded   = {exponent_s28, fraction_s28} + {32'd0, round_up_s28};
  wire        underflow = rounded[32] | (~|rounded[31:23]);
  wire        overflow  = ~rounded[32] & (rounded[31] | (&rounded[30:23]));

  always @(posedge clk) begin
    if (nan_s28)
      y <= 32'h7fc00000;
    else if (infinite_s28)
      y <= {sign_s28, 8'hff, 23'd0};
    else if (zero_s28 | underflow)
      y <= {sign_s28, 31'd0};
    else if (overflow)
      y <= {sign_s28, 8'hff, 23'd0};
    else
      y <= {sign_s28, rounded[30:0]};
  end

endmodule

`default_nettype wire
