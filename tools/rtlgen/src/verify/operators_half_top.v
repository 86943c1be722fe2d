// The operators of binary16, as operators_top.v has the ones of binary32: a and b in the low halves
// of the first two words, the operand of the root and the argument of the sine in the third, a
// binary32 number in the fourth.
`default_nettype none

module operators_top (
  input  wire         clk,
  input  wire [127:0] operands,
  output wire [447:0] results
);

  wire [15:0] a        = operands[15:0];
  wire [15:0] b        = operands[47:32];
  wire [15:0] radicand = operands[79:64];
  wire [15:0] argument = operands[95:80];
  wire [31:0] number   = operands[127:96];

  wire [15:0] y [0:13];
  wire        less, nonzero;

  genvar k;
  generate
    for (k = 0; k < 14; k = k + 1) begin : g_word
      assign results[32*k +: 32] = {16'd0, y[k]};
    end
  endgenerate
  assign y[11] = {14'd0, nonzero, less};

  pgs_hadd add (.clk(clk), .a(a), .b(b), .y(y[0]));
  pgs_hmul mul (.clk(clk), .a(a), .b(b), .y(y[1]));
  pgs_hdiv div (.clk(clk), .a(a), .b(b), .y(y[2]));
  pgs_hsqrt sqrt (.clk(clk), .a(radicand), .y(y[3]));
  pgs_hsincos sincos (.clk(clk), .a(argument), .y({y[5], y[4]}));
  pgs_fmax #(.WIDTH(16)) max (.clk(clk), .a(a), .b(b), .y(y[6]));
  pgs_fmin #(.WIDTH(16)) min (.clk(clk), .a(a), .b(b), .y(y[7]));
  pgs_fselect #(.WIDTH(16)) select (.clk(clk), .condition(number[0]), .a(a), .b(b), .y(y[8]));
  pgs_float_to_half round (.clk(clk), .number(number), .half(y[9]));
  assign y[10] = 16'd0;
  pgs_fless #(.WIDTH(16)) below (.clk(clk), .a(a), .b(b), .y(less));
  pgs_fnonzero #(.WIDTH(16)) any (.clk(clk), .flag(number[0]), .a(a), .y(nonzero));
  pgs_fmax_or #(.WIDTH(16)) max_or (.clk(clk), .condition(number[0]), .a(a), .b(b), .c(radicand), .y(y[12]));
  pgs_fmin_or #(.WIDTH(16)) min_or (.clk(clk), .condition(number[0]), .a(a), .b(b), .c(radicand), .y(y[13]));

endmodule

`default_nettype wire
