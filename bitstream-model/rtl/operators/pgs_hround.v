// Rounds a significand to a binary16 number, subnormal ones included: the last step of hmul, hdiv
// and float_to_half.
//
// Latency 3 from the exponent, 2 from the rest of the operands, which come a cycle later. The
// suffix _s<n> names a register at the end of stage n:
//
//   1  limit   exponent below 1: distance to the grid of the subnormal numbers
//   2  shift   leading one to the front, or to that grid; decision of the rounding
//   3  round   rounding to nearest even; zeros, infinities and NaN
//
// The leading one is in bit 12 of the significand or in bit 11. `exponent` is the biased exponent
// of the first case, in two's complement. NaN results are 7e00.
`default_nettype none

module pgs_hround (
  input  wire              clk,
  input  wire signed [6:0] exponent,
  // A cycle later:
  input  wire       [12:0] significand,
  input  wire              sticky,       // a one was cut off below the significand
  input  wire              sign,
  input  wire              zero,
  input  wire              infinite,
  input  wire              nan,
  output reg        [15:0] y
);

  // Stage 1: limit. From a distance of 13 on nothing of the significand is left but a sticky bit.
  wire              subnormal = exponent < 7'sd1;
  wire signed [6:0] below     = 7'sd1 - exponent;

  reg  [5:0] exponent_s1;
  reg        lowest_s1;
  reg  [3:0] distance_s1;

  always @(posedge clk) begin
    exponent_s1 <= subnormal ? 6'd1 : exponent[5:0];
    lowest_s1   <= exponent <= 7'sd1;
    distance_s1 <= ~subnormal ? 4'd0 : (|below[6:4]) ? 4'd15 : below[3:0];
  end

  // Stage 2: shift. The lowest exponent has no number below it to which a one could be moved.
  wire        moves   = ~significand[12] & ~lowest_s1;
  wire [12:0] leading = moves ? {significand[11:0], 1'b0} : significand;
  wire [11:0] by_4s   = leading[12:1] >> {distance_s1[3:2], 2'b00};
  wire [11:0] shifted = by_4s >> distance_s1[1:0];
  wire        lost    = ((|distance_s1[3:2]) & (|leading[4:1]))
                      | (distance_s1[3] & (|leading[8:5]))
                      | ((&distance_s1[3:2]) & (|leading[12:9]))
                      | ((|distance_s1[1:0]) & by_4s[0])
                      | (distance_s1[1] & by_4s[1])
                      | ((&distance_s1[1:0]) & by_4s[2]);
  wire        below_guard = lost | leading[0] | sticky;

  reg  [9:0] fraction_s2;
  reg        round_up_s2;
  reg  [5:0] exponent_s2;
  reg        sign_s2;
  reg        zero_s2;
  reg        infinite_s2;
  reg        nan_s2;

  always @(posedge clk) begin
    fraction_s2 <= shifted[10:1];
    round_up_s2 <= shifted[0] & (shifted[1] | below_guard);
    exponent_s2 <= exponent_s1 - {5'd0, ~significand[12] | (|distance_s1)};
    sign_s2     <= sign;
    zero_s2     <= zero;
    infinite_s2 <= infinite;
    nan_s2      <= nan;
  end

  // Stage 3: round. A carry out of the fraction raises the exponent.
  wire [15:0] rounded  = {exponent_s2, fraction_s2} + {15'd0, round_up_s2};
  wire        overflow = rounded[15] | (&rounded[14:10]);

  always @(posedge clk) begin
    if (nan_s2)
      y <= 16'h7e00;
    else if (infinite_s2)
      y <= {sign_s2, 5'h1f, 10'd0};
    else if (zero_s2)
      y <= {sign_s2, 15'd0};
    else if (overflow)
      y <= {sign_s2, 5'h1f, 10'd0};
    else
      y <= {sign_s2, rounded[14:0]};
  end

  // The leading one.
  wire unused = shifted[11];

endmodule

`default_nettype wire
