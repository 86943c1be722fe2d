// Whether one number is less than another, binary32 or (WIDTH = 16) binary16: y = a < b.
// Combinational: the comparison inside fless, fmax and fmin.
//
// False if an operand is NaN. Subnormal operands of binary32 count as zeros; zeros of both signs are
// equal.
`default_nettype none

module pgs_fbelow #(
  parameter integer WIDTH = 32
) (
  input  wire [WIDTH-1:0] a,
  input  wire [WIDTH-1:0] b,
  output wire             y
);

  localparam FRACTION = (WIDTH == 32) ? 23 : 10;
  localparam LOWEST   = (WIDTH == 32) ? FRACTION : 0;   // bit from which on a number is not zero

  // The order of two negative numbers is the reverse of the order of their magnitudes.
  wire same_sign       = a[WIDTH-1] == b[WIDTH-1];
  wire magnitude_below = a[WIDTH-2:0] < b[WIDTH-2:0];
  wire magnitude_above = a[WIDTH-2:0] > b[WIDTH-2:0];
  wire a_is_less       = a[WIDTH-1] ? (magnitude_above | ~same_sign) : (magnitude_below & same_sign);

  wire both_zero = (~|a[WIDTH-2:LOWEST]) & (~|b[WIDTH-2:LOWEST]);
  wire a_is_nan  = (&a[WIDTH-2:FRACTION]) & (|a[FRACTION-1:0]);
  wire b_is_nan  = (&b[WIDTH-2:FRACTION]) & (|b[FRACTION-1:0]);

  assign y = a_is_less & ~(both_zero | a_is_nan | b_is_nan);

endmodule

`default_nettype wire
