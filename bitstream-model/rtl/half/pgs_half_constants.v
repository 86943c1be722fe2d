// Numbers of a step that depend on its arguments alone (specification, section 7), in binary16: the reciprocal of
// the time step, the largest angular speed, and the factors of the integration.
//
// One divider and one multiplier compute them after `start`. Nothing waits for them.
`default_nettype none

module pgs_half_constants (
  input  wire        clk,
  input  wire        start,
  input  wire [15:0] time_step,
  input  wire [47:0] gravity,
  output reg  [15:0] per_second,    // 1 / dt
  output reg  [15:0] speed_limit,   // limit / dt
  output reg  [15:0] half_step,     // 0.5 * dt
  output reg  [15:0] series,        // ((dt * dt) * dt) * 0.020833334
  output reg  [47:0] gravity_step   // g * dt
);
`include "pgs_interface.vh"
`include "pgs_operators.vh"

  localparam MULTIPLY = HMUL_LATENCY;
  localparam DIVIDE   = HDIV_LATENCY;
  localparam [5:0] SQUARE = 6'd4;              // cycle in which dt * dt enters
  localparam [5:0] CUBE   = SQUARE + MULTIPLY + 6'd1;
  localparam [5:0] SERIES = CUBE + MULTIPLY + 6'd1;

  reg [5:0] cycle;
  reg       running;
  always @(posedge clk) begin
    if (start) begin
      cycle   <= 6'd0;
      running <= 1'b1;
    end else if (running) begin
      cycle   <= cycle + 6'd1;
      running <= cycle != 6'd40;
    end
  end

  // The operands are registered in these cycles; the product comes out MULTIPLY + 1 cycles later.
  wire [15:0] product, quotient;
  reg  [15:0] a, b, numerator;
  always @(posedge clk) begin
    numerator <= (cycle == 6'd0) ? 16'h3c00 : SOLVER_ROTATION_LIMIT_HALF;
    b <= time_step;
    case (cycle)
      6'd0:    a <= gravity[15:0];
      6'd1:    a <= gravity[31:16];
      6'd2:    a <= gravity[47:32];
      6'd3:    a <= 16'h3800;
      SQUARE:  a <= time_step;
      CUBE:    a <= product;
      default: begin
        a <= product;
        b <= SOLVER_SERIES_TERM_HALF;
      end
    endcase
  end
  pgs_hmul multiplier (.clk(clk), .a(a), .b(b), .y(product));
  pgs_hdiv divider (.clk(clk), .a(numerator), .b(time_step), .y(quotient));

  always @(posedge clk) if (running) begin
    if (cycle == 6'd1 + MULTIPLY) gravity_step[15:0]  <= product;
    if (cycle == 6'd2 + MULTIPLY) gravity_step[31:16] <= product;
    if (cycle == 6'd3 + MULTIPLY) gravity_step[47:32] <= product;
    if (cycle == 6'd4 + MULTIPLY) half_step           <= product;
    if (cycle == SERIES + MULTIPLY + 6'd1) series     <= product;
    if (cycle == DIVIDE + 6'd1) per_second            <= quotient;
    if (cycle == DIVIDE + 6'd2) speed_limit           <= quotient;
  end
endmodule

`default_nettype wire
