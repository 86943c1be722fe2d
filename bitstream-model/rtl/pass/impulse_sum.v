// Sum of the normal impulses, in units of 2^-20 N s: each collision's total is rounded down. Stops at
// the largest number.
`default_nettype none

module impulse_sum (
  input  wire        clk,
  input  wire        clear,
  input  wire        valid,
  input  wire [30:0] total,      // magnitude of a binary32; it is not negative
  output reg  [63:0] sum
);
  // total = significand * 2^(exponent - 150), so that the shift to 2^-20 is exponent - 130.
  localparam [7:0] NO_SHIFT = 8'd130;
  localparam [7:0] TOO_LARGE = NO_SHIFT + 8'd41;

  reg         valid_s1, large_s1, left_s1;
  reg  [23:0] significand_s1;
  reg  [7:0]  shift_s1;
  reg         valid_s2;
  reg  [63:0] fixed_s2;
  wire [7:0]  exponent = total[30:23];
  wire [63:0] wide_s1  = {40'd0, significand_s1};
  wire [64:0] next     = {1'b0, sum} + {1'b0, fixed_s2};

  always @(posedge clk) begin
    valid_s1       <= valid & ~clear & (exponent != 8'd0);
    significand_s1 <= {1'b1, total[22:0]};
    left_s1        <= exponent >= NO_SHIFT;
    large_s1       <= exponent >= TOO_LARGE;
    shift_s1       <= (exponent >= NO_SHIFT) ? exponent - NO_SHIFT : NO_SHIFT - exponent;

    valid_s2 <= valid_s1 & ~clear;
    fixed_s2 <= large_s1 ? {64{1'b1}} : left_s1 ? wide_s1 << shift_s1 : wide_s1 >> shift_s1;

    if (clear) sum <= 64'd0;
    else if (valid_s2) sum <= next[64] ? {64{1'b1}} : next[63:0];
  end
endmodule

`default_nettype wire
