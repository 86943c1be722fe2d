// Conjunction of two flags: y = a && b.
//
// Latency 1.
`default_nettype none

module pgs_flogic_and (
  input  wire clk,
  input  wire a,
  input  wire b,
  output reg  y
);

  always @(posedge clk) begin
    y <= a & b;
  end

endmodule

`default_nettype wire
