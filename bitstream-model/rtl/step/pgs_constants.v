// Numbers of a step that depend on its arguments alone (specification, section 7): the reciprocal of
// the time step, the largest angular speed, and the factors of the integration.
//
// One divider and one multiplier compute them. Nothing waits for them: a test of the generator holds
// the first cycle in which a pipeline can read one against the cycle in which it is there.
`default_nettype none

module pgs_constants #(
  parameter integer SMALLEST_NORMAL = 1
) (
  input  wire        clk,
  input  wire        start,
  input  wire [31:0] time_step,
  input  wire [31:0] gravity_x,
  input  wire [31:0] gravity_y,
  input  wire [31:0] gravity_z,
  output reg  [31:0] per_second,       // 1 / dt
  output reg  [31:0] speed_limit,      // limit / dt
  output reg  [31:0] half_angle_limit, // (speed_limit * dt) * 0.5
  output reg  [31:0] half_step,        // 0.5 * dt
  output reg  [31:0] series,           // ((dt * dt) * dt) * 0.020833334
  output reg  [95:0] gravity_step      // g * dt
);
`include "pgs_interface.vh"
`include "pgs_operators.vh"

  localparam MULTIPLY = FMUL_LATENCY;
  localparam DIVIDE   = FDIV_LATENCY;
  localparam [5:0] SQUARE = 6'd0;              // cycle in which dt * dt enters
  localparam [5:0] CUBE   = SQUARE + MULTIPLY + 6'd1;
  localparam [5:0] SERIES = CUBE + MULTIPLY + 6'd1;
  localparam [5:0] LIMIT  = DIVIDE + 6'd2;     // in which speed_limit is there
  localparam [5:0] HALF   = LIMIT + MULTIPLY + 6'd1;
  localparam [5:0] LAST   = HALF + MULTIPLY + 6'd1;

  reg [5:0] cycle;
  reg       running;
  always @(posedge clk) begin
    if (start) begin
      cycle   <= 6'd0;
      running <= 1'b1;
    end else if (running) begin
      cycle   <= cycle + 6'd1;
      running <= cycle != LAST;
    end
  end

  // The operands are registered in these cycles; the product comes out MULTIPLY + 1 cycles later.
  wire [31:0] product, quotient;
  reg  [31:0] a, b, numerator;
  always @(posedge clk) begin
    numerator <= (cycle == 6'd0) ? 32'h3f800000 : SOLVER_ROTATION_LIMIT;
    b <= time_step;
    case (cycle)
      SQUARE:  a <= time_step;
      6'd1:    a <= 32'h3f000000;
      6'd2:    a <= gravity_x;
      6'd3:    a <= gravity_y;
      6'd4:    a <= gravity_z;
      CUBE:    a <= product;
      LIMIT:   a <= quotient;
      HALF: begin
        a <= product;
        b <= 32'h3f000000;
      end
      default: begin
        a <= product;
        b <= SOLVER_SERIES_TERM;
      end
    endcase
  end
  pgs_fmul #(.SMALLEST_NORMAL(SMALLEST_NORMAL)) multiplier (.clk(clk), .a(a), .b(b), .y(product));
  pgs_fdiv #(.SMALLEST_NORMAL(SMALLEST_NORMAL)) divider (.clk(clk), .a(numerator), .b(time_step), .y(quotient));

  always @(posedge clk) if (running) begin
    if (cycle == 6'd2 + MULTIPLY) half_step           <= product;
    if (cycle == 6'd3 + MULTIPLY) gravity_step[31:0]  <= product;
    if (cycle == 6'd4 + MULTIPLY) gravity_step[63:32] <= product;
    if (cycle == 6'd5 + MULTIPLY) gravity_step[95:64] <= product;
    if (cycle == SERIES + MULTIPLY + 6'd1) series     <= product;
    if (cycle == DIVIDE + 6'd1) per_second            <= quotient;
    if (cycle == LIMIT) speed_limit                   <= quotient;
    if (cycle == LAST) half_angle_limit               <= product;
  end
endmodule

`default_nettype wire
