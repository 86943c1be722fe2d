// Lets the bodies into the integration, one a cycle: even ones with the pose on streams 0 and 1, odd
// ones with the pose on streams 2 and 3. The velocity and the mass of a body are read on the way.
`default_nettype none

module pgs_integrator #(
  parameter integer BODY         = 16,
  parameter integer READ_LATENCY = 6           // of the velocities; the masses take 3 cycles
) (
  input  wire            clk,
  input  wire            start,
  input  wire            run,
  input  wire            integrate,    // 0: all bodies keep their state
  input  wire [31:0]     damping,
  input  wire [19:0]     bodies,

  input  wire            room,         // all senders have
  input  wire            even_there,   // pose on streams 0 and 1
  input  wire [255:0]    even_pose,
  input  wire            odd_there,
  input  wire [255:0]    odd_pose,
  output wire            pop_even,
  output wire            pop_odd,

  output wire            enters,
  output reg             finished,     // all bodies have entered
  output reg  [BODY-1:0] address,      // of velocity and mass
  input  wire            has_mass,     // 3 cycles after the address

  // Cycle 0 of the pipeline.
  output wire            valid,
  output wire [255:0]    pose,
  output wire            free,         // the body has a mass, and is integrated
  output wire [31:0]     body_damping  // of its spin: 1 without a mass
);
  localparam MASS_LATENCY = 3;
  localparam [31:0] ONE = 32'h3f800000;

  reg [19:0] body, left;
  reg        valid_s1;
  reg [255:0] pose_s1;
  wire       odd = body[0];

  assign enters   = run & ~finished & room & (odd ? odd_there : even_there);
  assign pop_even = enters & ~odd;
  assign pop_odd  = enters & odd;

  always @(posedge clk) begin
    if (start) begin
      body     <= 20'd0;
      left     <= bodies;
      finished <= 1'b0;
    end else if (enters) begin
      body     <= body + 20'd1;
      left     <= left - 20'd1;
      finished <= left == 20'd1;
    end
    valid_s1 <= enters & ~start;
    address  <= body[BODY-1:0];
    pose_s1  <= odd ? odd_pose : even_pose;
  end

  reg        free_now;
  reg [31:0] damping_now;
  always @(posedge clk) begin
    free_now    <= has_mass & integrate;
    damping_now <= has_mass ? damping : ONE;
  end
  pgs_timed_flag #(.STAGES(READ_LATENCY)) valid_late (.clk(clk), .clear(start), .d(valid_s1), .q(valid));
  pgs_pipeline_register #(.WIDTH(256), .STAGES(READ_LATENCY)) pose_late (.clk(clk), .d(pose_s1), .q(pose));
  pgs_pipeline_register #(.WIDTH(33), .STAGES(READ_LATENCY - MASS_LATENCY - 1)) free_late (
    .clk(clk), .d({free_now, damping_now}), .q({free, body_damping})
  );
endmodule

`default_nettype wire
