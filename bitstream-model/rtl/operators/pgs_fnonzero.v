// Whether a flag is set and a number is not zero, binary32 or (WIDTH = 16) binary16:
// y = flag && a != 0.
//
// Latency 1. NaN does not count as zero. Subnormals of binary32 do: only the exponent is read.
`default_nettype none

module pgs_fnonzero #(
  parameter integer WIDTH = 32
) (
  input  wire             clk,
  input  wire             flag,
  input  wire [WIDTH-1:0] a,
  output reg              y
);

  localparam LOWEST = (WIDTH == 32) ? 23 : 0;   // bit from which on a number is not zero

  // Sign and fraction are part of the number, but not of the question.
  wire unused = &{1'b0, a};

  always @(posedge clk) begin
    y <= flag & (|a[WIDTH-2:LOWEST]);
  end

endmodule

`default_nettype wire
