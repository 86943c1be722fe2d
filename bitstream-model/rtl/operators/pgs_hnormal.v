// The significand of a binary16 number with a leading one, a subnormal one shifted to it.
// Combinational: the second stage of hmul, hdiv and hsqrt.
//
// The exponent of the number, 1 of a subnormal one, goes down by `leading`. A zero keeps significand 0.
`default_nettype none

module pgs_hnormal (
  input  wire [10:0] plain,        // the fraction, behind a 1 if the number is normal
  output wire [10:0] significand,
  output wire  [3:0] leading       // zeros in front of the leading one
);

  // Each step looks into the half that holds the leading one.
  wire [15:0] in_16  = {plain, 5'b10000};
  wire        skip_8 = ~|in_16[15:8];
  wire  [7:0] in_8   = skip_8 ? in_16[7:0] : in_16[15:8];
  wire        skip_4 = ~|in_8[7:4];
  wire  [3:0] in_4   = skip_4 ? in_8[3:0] : in_8[7:4];
  wire        skip_2 = ~|in_4[3:2];
  wire        skip_1 = skip_2 ? ~in_4[1] : ~in_4[3];

  assign leading     = {skip_8, skip_4, skip_2, skip_1};
  assign significand = plain << leading;

  wire unused = in_4[0];

endmodule

`default_nettype wire
