// A binary32 number as binary16, rounded to nearest even.
//
// Latency 3, one number a cycle: a register, then hround. Subnormal results are kept; every
// subnormal operand is far below half of the smallest of them. A NaN gives 7e00.
`default_nettype none

module pgs_float_to_half (
  input  wire        clk,
  input  wire [31:0] number,
  output wire [15:0] half
);

  // The exponent with binary16's bias, in the range of hround: 2^-38 is as small as any smaller
  // number, and 2^32 as large as any larger one.
  wire [7:0]        field    = number[30:23];
  wire signed [6:0] exponent = (field < 8'd89)  ? -7'sd23
                             : (field > 8'd159) ? 7'sd47
                             : $signed(field[6:0] + 7'd16);

  reg [31:0] number_s1;

  always @(posedge clk) begin
    number_s1 <= number;
  end

  pgs_hround rounds (
    .clk(clk),
    .exponent(exponent),
    .significand({1'b1, number_s1[22:11]}),
    .sticky(|number_s1[10:0]),
    .sign(number_s1[31]),
    .zero(1'b0),
    .infinite((&number_s1[30:23]) & (~|number_s1[22:0])),
    .nan((&number_s1[30:23]) & (|number_s1[22:0])),
    .y(half)
  );

endmodule

`default_nettype wire
