// Quotient of two binary16 numbers, rounded to nearest even: y = a / b.
//
// Latency 11, one quotient a cycle. Non-restoring division, 13 rows of one bit of the quotient, two
// rows a stage. The suffix _s<n> names a register at the end of stage n:
//
//    1        unpack     difference of the exponents; zero, NaN and infinity
//    2        normalise  subnormal significands shifted to their leading ones
//    3 ..  9  rows       row r gives bit 12 - r of the quotient
//   10 .. 11  round      hround
//
// A subnormal quotient may be half way between two numbers, so that the remainder is needed.
// Subnormals are kept, NaN results are 7e00.
//
// Rules: bitstream-model/README.md, section 7.
// Rows: Ercegovac and Lang, Division and Square Root (1994), non-restoring, radix 2.
`default_nettype none

module pgs_hdiv (
  input  wire        clk,
  input  wire [15:0] a,
  input  wire [15:0] b,
  output wire [15:0] y
);

  localparam STAGES = 7;

  // Stage 1: unpack.
  wire       a_is_zero     = ~|a[14:0];
  wire       b_is_zero     = ~|b[14:0];
  wire       a_is_infinite = (&a[14:10]) & (~|a[9:0]);
  wire       b_is_infinite = (&b[14:10]) & (~|b[9:0]);
  wire       a_is_nan      = (&a[14:10]) & (|a[9:0]);
  wire       b_is_nan      = (&b[14:10]) & (|b[9:0]);
  wire [6:0] a_exponent    = {2'd0, a[14:11], a[10] | (~|a[14:10])};
  wire [6:0] b_exponent    = {2'd0, b[14:11], b[10] | (~|b[14:10])};
  wire       zero          = a_is_zero | b_is_infinite;
  wire       infinite      = a_is_infinite | b_is_zero;
  wire       nan           = a_is_nan | b_is_nan | (a_is_infinite & b_is_infinite)
                           | (a_is_zero & b_is_zero);


  reg [10:0] a_plain_s1;
  reg [10:0] b_plain_s1;
  reg  [6:0] exponent_s1;

  always @(posedge clk) begin
    a_plain_s1  <= {|a[14:10], a[9:0]};
    b_plain_s1  <= {|b[14:10], b[9:0]};
    exponent_s1 <= a_exponent - b_exponent + 7'd15;
  end

  // Stage 2: normalise.
  wire [10:0] a_significand, b_significand;
  wire  [3:0] a_leading, b_leading;

  pgs_hnormal normal_a (
    .plain(a_plain_s1),
    .significand(a_significand),
    .leading(a_leading)
  );

  pgs_hnormal normal_b (
    .plain(b_plain_s1),
    .significand(b_significand),
    .leading(b_leading)
  );

  reg [10:0] dividend_s2;
  reg  [6:0] exponent_s2;
  reg  [3:0] a_leading_s2;
  reg  [3:0] b_leading_s2;

  always @(posedge clk) begin
    dividend_s2  <= a_significand;
    exponent_s2  <= exponent_s1;
    a_leading_s2 <= a_leading;
    b_leading_s2 <= b_leading;
  end

  // Shift registers beside the rows: the divisor that each stage needs, the flags from stage 1 on, and
  // the exponent from stage 3 to stage 8.
  localparam NOTES = 4;

  reg [11*(STAGES+1)-1:0]    divisor;
  reg [NOTES*(STAGES+2)-1:0] notes;
  reg [7*(STAGES-1)-1:0]     exponent;

  always @(posedge clk) begin
    divisor  <= {divisor[11*STAGES-1:0], b_significand};
    notes    <= {notes[NOTES*(STAGES+1)-1:0], a[15] ^ b[15], zero, infinite, nan};
    exponent <= {exponent[7*(STAGES-2)-1:0], exponent_s2 - {3'd0, a_leading_s2} + {3'd0, b_leading_s2}};
  end

  // A row subtracts the divisor from a doubled remainder that was not negative and adds it to one
  // that was, which is to subtract its complement and 1: the bit below the difference borrows it.
  // The 12 bits of a remainder are a two's complement number between -divisor and divisor - 1.
  function [12:0] row(input add_back, input [11:0] doubled, input [10:0] by);
    row = {doubled, ~add_back} - {{1'b0, by} ^ {12{add_back}}, 1'b1};
  endfunction

  // Stages 3 to 9. Slot g of `remainder` and of `quotient` has the result of stage g + 3.
  reg [12*STAGES-1:0] remainder;
  reg [13*STAGES-1:0] quotient;

  genvar g;
  generate
    for (g = 0; g < STAGES; g = g + 1) begin : stages
      wire [12:0] first, second;
      wire  [1:0] digits;
      wire [12:0] so_far;

      if (g == 0) begin : begins
        assign first  = row(1'b0, {1'b0, dividend_s2}, divisor[10:0]);
        assign so_far = 13'd0;
      end else begin : goes_on
        assign first  = row(remainder[12*(g-1)+11], {remainder[12*(g-1) +: 11], 1'b0}, divisor[11*g +: 11]);
        assign so_far = quotient[13*(g-1) +: 13];
      end

      if (g < STAGES - 1) begin : two_rows
        assign second = row(first[12], {first[11:1], 1'b0}, divisor[11*g +: 11]);
        assign digits = {~first[12], ~second[12]};
      end else begin : one_row
        assign second = first;
        assign digits = {1'b0, ~first[12]};
      end

      wire unused_borrows = &{1'b0, first[0], second[0]};

      localparam BELOW = (g < STAGES - 1) ? 11 - 2*g : 0;

      always @(posedge clk) begin
        remainder[12*g +: 12] <= second[12:1];
        quotient[13*g +: 13]  <= so_far | ({11'd0, digits} << BELOW);
      end
    end
  endgenerate

  // Stages 10 and 11, the exponent from stage 9 on. A remainder that is negative lacks a divisor.
  wire [11:0] remainder_s9 = remainder[12*(STAGES-1) +: 12];
  wire [11:0] added_s9     = {1'b0, divisor[11*STAGES +: 11] & {11{remainder_s9[11]}}};
  wire [11:0] rest         = remainder_s9 + added_s9;

  pgs_hround rounds (
    .clk(clk),
    .exponent(exponent[7*(STAGES-2) +: 7]),
    .significand(quotient[13*(STAGES-1) +: 13]),
    .sticky(|rest),
    .sign(notes[NOTES*(STAGES+1)+3]),
    .zero(notes[NOTES*(STAGES+1)+2]),
    .infinite(notes[NOTES*(STAGES+1)+1]),
    .nan(notes[NOTES*(STAGES+1)]),
    .y(y)
  );

endmodule

`default_nettype wire
