// A binary16 number that is not negative as f32: exact, without a register, subnormal numbers included.
`default_nettype none

module pgs_half_to_float (
  input  wire [14:0] half,
  output wire [31:0] number
);
  wire [4:0] exponent = half[14:10];
  wire [9:0] fraction = half[9:0];

  // Below 2^-14 the leading one is found, and the fraction shifted until it is gone.
  reg [3:0] leading;         // zeros above the leading one
  integer i;
  always @* begin
    leading = 4'd0;
    for (i = 0; i < 10; i = i + 1) if (fraction[i]) leading = 4'd9 - i[3:0];
  end
  wire [9:0] shifted = fraction << leading;
  wire unused = &{1'b0, shifted[9]};     // the leading one

  assign number = (exponent == 5'd31) ? {9'h0ff, fraction, 13'd0}
                : (exponent != 5'd0)  ? {1'b0, {3'd0, exponent} + 8'd112, fraction, 13'd0}
                : (fraction == 10'd0) ? 32'd0
                : {1'b0, 8'd112 - {4'd0, leading}, shifted[8:0], 14'd0};
endmodule

`default_nettype wire
