// Sum modulo 2^32 of the words of all beats with `valid`. A beat counts two cycles later.
`default_nettype none

module pgs_word_sum (
  input  wire         clk,
  input  wire         clear,
  input  wire         valid,
  input  wire [127:0] beat,
  output reg  [31:0]  sum
);
  reg        valid_s1;
  reg [31:0] low_s1, high_s1;
  reg [31:0] beat_s2;

  always @(posedge clk) begin
    low_s1   <= beat[31:0] + beat[63:32];
    high_s1  <= beat[95:64] + beat[127:96];
    valid_s1 <= valid & ~clear;
    beat_s2  <= (valid_s1 & ~clear) ? low_s1 + high_s1 : 32'd0;
    sum      <= clear ? 32'd0 : sum + beat_s2;
  end
endmodule

`default_nettype wire
