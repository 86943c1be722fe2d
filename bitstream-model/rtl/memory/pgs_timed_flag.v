// A flag that comes out STAGES cycles later; `clear` forgets the flags under way.
`default_nettype none

module pgs_timed_flag #(
  parameter integer STAGES = 2
) (
  input  wire clk,
  input  wire clear,
  input  wire d,
  output wire q
);
  reg [STAGES-1:0] flags;
  assign q = flags[STAGES-1];
  always @(posedge clk) flags <= clear ? {STAGES{1'b0}} : {flags[STAGES-2:0], d};
endmodule

`default_nettype wire
