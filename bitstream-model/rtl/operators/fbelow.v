// Whether one binary32 number is less than another: y = a < b. Combinational: the comparison inside
// fless, fmax and fmin.
//
// False if an operand is NaN. Subnormal operands count as zeros; zeros of both signs are equal.
`default_nettype none

module fbelow (
  input  wire [31:0] a,
  input  wire [31:0] b,
  output wire        y
);

  // Unsigned integers in the order of the numbers.
  wire [31:0] a_rank = {~a[31], a[30:0] ^ {31{a[31]}}};
  wire [31:0] b_rank = {~b[31], b[30:0] ^ {31{b[31]}}};

  wire both_zero = (~|a[30:23]) & (~|b[30:23]);
  wire a_is_nan  = (&a[30:23]) & (|a[22:0]);
  wire b_is_nan  = (&b[30:23]) & (|b[22:0]);

  assign y = (a_rank < b_rank) & ~(both_zero | a_is_nan | b_is_nan);

endmodule

`default_nettype wire
