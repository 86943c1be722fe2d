// Every operator beside the others, for the vectors of `rtlgen operators`. In each cycle four words
// go in and fourteen come out, each result after the latency of its operator.
`default_nettype none

module operators_top (
  input  wire         clk,
  input  wire [127:0] operands,
  output wire [447:0] results
);

  wire [31:0] a        = operands[31:0];
  wire [31:0] b        = operands[63:32];
  wire [31:0] radicand = operands[95:64];
  wire [31:0] argument = operands[127:96];

  wire [3:0] flags;

  assign results[383:352] = {28'd0, flags};

  pgs_fadd add (.clk(clk), .a(a), .b(b), .y(results[31:0]));
  pgs_fmul mul (.clk(clk), .a(a), .b(b), .y(results[63:32]));
  pgs_fdiv div (.clk(clk), .a(a), .b(b), .y(results[95:64]));
  pgs_fsqrt sqrt (.clk(clk), .a(radicand), .y(results[127:96]));
  pgs_fsincos sincos (.clk(clk), .a(argument), .y(results[191:128]));
  pgs_fmax max (.clk(clk), .a(a), .b(b), .y(results[223:192]));
  pgs_fmin min (.clk(clk), .a(a), .b(b), .y(results[255:224]));
  pgs_fselect select (.clk(clk), .condition(argument[0]), .a(a), .b(b), .y(results[287:256]));
  pgs_fmul #(.SMALLEST_NORMAL(0)) mul_0 (.clk(clk), .a(a), .b(b), .y(results[319:288]));
  pgs_fdiv #(.SMALLEST_NORMAL(0)) div_0 (.clk(clk), .a(a), .b(b), .y(results[351:320]));
  pgs_fless less (.clk(clk), .a(a), .b(b), .y(flags[0]));
  pgs_fnonzero nonzero (.clk(clk), .flag(argument[0]), .a(a), .y(flags[1]));
  pgs_flogic_or logic_or (.clk(clk), .a(argument[0]), .b(argument[1]), .y(flags[2]));
  pgs_flogic_and logic_and (.clk(clk), .a(argument[0]), .b(argument[1]), .y(flags[3]));
  pgs_fmax_or max_or (.clk(clk), .condition(argument[0]), .a(a), .b(b), .c(radicand), .y(results[415:384]));
  pgs_fmin_or min_or (.clk(clk), .condition(argument[0]), .a(a), .b(b), .c(radicand), .y(results[447:416]));

endmodule

`default_nettype wire
