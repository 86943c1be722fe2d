// Sum of the normal impulses, in units of 2^-20 N s: each collision's total is rounded down. Stops at
// the largest number. A total counts four cycles later.
`default_nettype none

module pgs_impulse_sum (
  input  wire        clk,
  input  wire        clear,
  input  wire        valid,
  input  wire [30:0] total,      // magnitude of a binary32; it is not negative
  output wire [63:0] sum
);
  // total = significand * 2^(exponent - 150). The significand at the top of 64 bits, 40 places further
  // up, has its unit of 2^-20 after a shift to the right of 170 - exponent places.
  localparam [7:0] NO_SHIFT = 8'd170;

  reg        valid_s1, large_s1;
  reg [23:0] significand_s1;
  reg [7:0]  places_s1;
  reg        valid_s2, large_s2;
  reg [2:0]  places_s2;
  reg [63:0] coarse_s2;          // shifted by a multiple of 8
  reg        large_s3;
  reg [63:0] fixed_s3;           // 0 without a total
  reg [63:0] exact;
  reg        full;

  wire [7:0]  exponent = total[30:23];
  wire [64:0] next     = {1'b0, exact} + {1'b0, fixed_s3};
  assign sum = exact | {64{full}};

  always @(posedge clk) begin
    valid_s1       <= valid & ~clear & (exponent != 8'd0);
    significand_s1 <= {1'b1, total[22:0]};
    large_s1       <= exponent > NO_SHIFT;
    places_s1      <= NO_SHIFT - exponent;

    valid_s2  <= valid_s1 & ~clear;
    large_s2  <= large_s1;
    places_s2 <= places_s1[2:0];
    coarse_s2 <= (places_s1[7:6] != 2'd0) ? 64'd0 : {significand_s1, 40'd0} >> {places_s1[5:3], 3'd0};

    large_s3 <= valid_s2 & large_s2 & ~clear;
    fixed_s3 <= valid_s2 ? coarse_s2 >> places_s2 : 64'd0;

    exact <= clear ? 64'd0 : next[63:0];
    full  <= ~clear & (full | large_s3 | next[64]);
    if (clear) fixed_s3 <= 64'd0;
  end
endmodule

`default_nettype wire
