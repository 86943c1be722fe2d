// Whether one binary32 number is less than another: y = a < b. Combinational: the comparison inside
// fless, fmax and fmin.
//
// False if an operand is NaN. Subnormal operands count as zeros; zeros of both signs are equal.
`default_nettype none

module pgs_fbelow (
  input  wire [31:0] a,
  input  wire [31:0] b,
  output wire        y
);

  // The order of two negative numbers is the reverse of the order of their magnitudes.
  wire same_sign       = a[31] == b[31];
  wire magnitude_below = a[30:0] < b[30:0];
  wire magnitude_above = a[30:0] > b[30:0];
  wire a_is_less       = a[31] ? (magnitude_above | ~same_sign) : (magnitude_below & same_sign);

  wire both_zero = (~|a[30:23]) & (~|b[30:23]);
  wire a_is_nan  = (&a[30:23]) & (|a[22:0]);
  wire b_is_nan  = (&b[30:23]) & (|b[22:0]);

  assign y = a_is_less & ~(both_zero | a_is_nan | b_is_nan);

endmodule

`default_nettype wire
