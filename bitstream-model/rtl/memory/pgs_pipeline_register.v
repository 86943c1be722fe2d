// STAGES registers in a row; with STAGES = 0 a wire.
`default_nettype none

module pgs_pipeline_register #(
  parameter integer WIDTH  = 1,
  parameter integer STAGES = 1
) (
  input  wire             clk,
  input  wire [WIDTH-1:0] d,
  output wire [WIDTH-1:0] q
);
  generate
    if (STAGES == 0) begin : g_wire
      wire unused = clk;
      assign q = d;
    end else if (STAGES == 1) begin : g_one
      reg [WIDTH-1:0] value;
      always @(posedge clk) value <= d;
      assign q = value;
    end else begin : g_row
      reg [WIDTH*STAGES-1:0] values;
      always @(posedge clk) values <= {values[WIDTH*(STAGES-1)-1:0], d};
      assign q = values[WIDTH*STAGES-1 : WIDTH*(STAGES-1)];
    end
  endgenerate
endmodule

`default_nettype wire
