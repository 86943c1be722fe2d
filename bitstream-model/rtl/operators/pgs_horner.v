// A step of a polynomial in fixed point with 48 fraction bits:
// y = COEFFICIENT + floor(z * factor / 2^48 + 1/2).
//
// Latency 3, one step a cycle. z is not negative; the other numbers are in two's complement, and y
// is the low SUM_WIDTH bits of the result. The suffix _s<n> names a register at the end of stage n.
`default_nettype none

module pgs_horner #(
  parameter integer                FACTOR_WIDTH = 48,
  parameter integer                SUM_WIDTH    = 48,
  parameter signed [SUM_WIDTH-1:0] COEFFICIENT  = 0
) (
  input  wire                           clk,
  input  wire [45:0]                    z,
  input  wire signed [FACTOR_WIDTH-1:0] factor,
  output reg  signed [SUM_WIDTH-1:0]    y
);

  localparam PRODUCT_WIDTH = FACTOR_WIDTH + 46;

  // Stages 1 and 2: product, with a register for the inside of the multiplier.
  wire signed [PRODUCT_WIDTH-1:0] wide_z      = {{FACTOR_WIDTH{1'b0}}, z};
  wire signed [PRODUCT_WIDTH-1:0] wide_factor = {{46{factor[FACTOR_WIDTH-1]}}, factor};

  reg signed [PRODUCT_WIDTH-1:0] product_s1;
  reg signed [PRODUCT_WIDTH-1:0] product_s2;

  always @(posedge clk) begin
    product_s1 <= wide_z * wide_factor;
    product_s2 <= product_s1;
  end

  // Stage 3: sum. One bit more below: there the coefficient brings the 1/2 that rounds the product.
  localparam EXTENSION = SUM_WIDTH + 2 - FACTOR_WIDTH;

  wire               negative = product_s2[PRODUCT_WIDTH-1];
  wire [SUM_WIDTH:0] scaled   = {{EXTENSION{negative}}, product_s2[PRODUCT_WIDTH-1:47]};
  wire [SUM_WIDTH:0] total    = scaled + {COEFFICIENT, 1'b1};

  always @(posedge clk) begin
    y <= total[SUM_WIDTH:1];
  end

  // Rounded off.
  wire unused = &{1'b0, product_s2[46:0], total[0]};

endmodule

`default_nettype wire
