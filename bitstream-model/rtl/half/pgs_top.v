// The accelerator as a block design sees it: AXI4-Lite registers, three AXI4-Streams each way, of 128,
// 128 and 64 bits, and one level-sensitive interrupt. Tools infer the interfaces from the names of the ports.
`default_nettype none

module pgs_top (
  (* X_INTERFACE_INFO = "xilinx.com:signal:clock:1.0 aclk CLK" *)
  (* X_INTERFACE_PARAMETER = "ASSOCIATED_BUSIF s_axi:s0_axis:s1_axis:s2_axis:m0_axis:m1_axis:m2_axis, ASSOCIATED_RESET aresetn" *)
  input  wire         aclk,
  (* X_INTERFACE_INFO = "xilinx.com:signal:reset:1.0 aresetn RST" *)
  (* X_INTERFACE_PARAMETER = "POLARITY ACTIVE_LOW" *)
  input  wire         aresetn,

  input  wire [11:0]  s_axi_awaddr,
  input  wire [2:0]   s_axi_awprot,
  input  wire         s_axi_awvalid,
  output wire         s_axi_awready,
  input  wire [31:0]  s_axi_wdata,
  input  wire [3:0]   s_axi_wstrb,
  input  wire         s_axi_wvalid,
  output wire         s_axi_wready,
  output wire [1:0]   s_axi_bresp,
  output wire         s_axi_bvalid,
  input  wire         s_axi_bready,
  input  wire [11:0]  s_axi_araddr,
  input  wire [2:0]   s_axi_arprot,
  input  wire         s_axi_arvalid,
  output wire         s_axi_arready,
  output wire [31:0]  s_axi_rdata,
  output wire [1:0]   s_axi_rresp,
  output wire         s_axi_rvalid,
  input  wire         s_axi_rready,

  input  wire [127:0] s0_axis_tdata, s1_axis_tdata,
  input  wire [63:0]  s2_axis_tdata,
  input  wire [15:0]  s0_axis_tkeep, s1_axis_tkeep,
  input  wire [7:0]   s2_axis_tkeep,
  input  wire         s0_axis_tlast, s1_axis_tlast, s2_axis_tlast,
  input  wire         s0_axis_tvalid, s1_axis_tvalid, s2_axis_tvalid,
  output wire         s0_axis_tready, s1_axis_tready, s2_axis_tready,

  output wire [127:0] m0_axis_tdata, m1_axis_tdata,
  output wire [63:0]  m2_axis_tdata,
  output wire [15:0]  m0_axis_tkeep, m1_axis_tkeep,
  output wire [7:0]   m2_axis_tkeep,
  output wire         m0_axis_tlast, m1_axis_tlast, m2_axis_tlast,
  output wire         m0_axis_tvalid, m1_axis_tvalid, m2_axis_tvalid,
  input  wire         m0_axis_tready, m1_axis_tready, m2_axis_tready,

  output wire         irq
);
  wire        core_reset, core_clear, start, done, error;
  // The simulator sees whether a step is under way.
  wire        busy /* verilator public_flat_rd */;
  wire        starting /* verilator public_flat_rd */;
  wire [31:0] bodies, collisions, contact_iterations, friction_iterations, flags;
  wire [31:0] time_step, drift, coefficient, friction, damping, gravity_x, gravity_y, gravity_z;
  wire [31:0] spin_damping;
  wire [1:0]  shape_write;
  wire [5:0]  shape_address;
  wire [31:0] shape_in;
  wire [7:0]  error_code, error_channel;
  wire [31:0] error_detail, work_cycles, wait_cycles, hazards, sum_received, sum_sent;
  wire [63:0] cycles, impulse_total;

  assign s_axi_bresp = 2'b00;
  assign s_axi_rresp = 2'b00;
  assign m0_axis_tkeep = 16'hffff;
  assign m1_axis_tkeep = 16'hffff;
  assign m2_axis_tkeep = 8'hff;
  wire unused = &{1'b0, s_axi_awprot, s_axi_arprot, bodies[31:20], collisions[31:20],
                  contact_iterations[31:8], friction_iterations[31:8], flags[31:5], flags[2]};

  pgs_control_block control (
    .clk(aclk), .resetn(aresetn),
    .awaddr(s_axi_awaddr), .awvalid(s_axi_awvalid), .awready(s_axi_awready),
    .wdata(s_axi_wdata), .wstrb(s_axi_wstrb), .wvalid(s_axi_wvalid), .wready(s_axi_wready),
    .bvalid(s_axi_bvalid), .bready(s_axi_bready),
    .araddr(s_axi_araddr), .arvalid(s_axi_arvalid), .arready(s_axi_arready),
    .rdata(s_axi_rdata), .rvalid(s_axi_rvalid), .rready(s_axi_rready),
    .interrupt(irq), .core_reset(core_reset), .core_clear(core_clear), .starting(starting), .start(start),
    .bodies(bodies), .collisions(collisions),
    .contact_iterations(contact_iterations), .friction_iterations(friction_iterations), .flags(flags),
    .time_step(time_step), .drift(drift), .coefficient(coefficient), .friction(friction),
    .damping(damping), .gravity_x(gravity_x), .gravity_y(gravity_y), .gravity_z(gravity_z),
    .spin_damping(spin_damping),
    .shape_write(shape_write), .shape_address(shape_address), .shape_in(shape_in),
    .busy(busy), .done(done), .error(error), .error_code(error_code), .error_channel(error_channel),
    .error_detail(error_detail), .cycles(cycles), .work_cycles(work_cycles), .wait_cycles(wait_cycles),
    .hazards(hazards), .sum_received(sum_received), .sum_sent(sum_sent), .impulse_total(impulse_total)
  );

  pgs_half_core accelerator (
    .clk(aclk), .reset(core_reset), .start(start), .clear(core_clear),
    .bodies(bodies[19:0]), .collisions(collisions[19:0]),
    .contact_iterations(contact_iterations[7:0]), .friction_iterations(friction_iterations[7:0]),
    .integrate(flags[0]), .kinematic(flags[1]), .warm_start(flags[3]), .impulses_out(flags[4]),
    .time_step(time_step), .drift(drift), .coefficient(coefficient),
    .friction_coefficient(friction), .spin_damping(spin_damping), .damping(damping),
    .gravity({gravity_z, gravity_y, gravity_x}),
    .shape_write(shape_write), .shape_address(shape_address), .shape_in(shape_in),
    .s_tdata({s2_axis_tdata, s1_axis_tdata, s0_axis_tdata}),
    .s_tkeep({s2_axis_tkeep, s1_axis_tkeep, s0_axis_tkeep}),
    .s_tlast({s2_axis_tlast, s1_axis_tlast, s0_axis_tlast}),
    .s_tvalid({s2_axis_tvalid, s1_axis_tvalid, s0_axis_tvalid}),
    .s_tready({s2_axis_tready, s1_axis_tready, s0_axis_tready}),
    .m_tdata({m2_axis_tdata, m1_axis_tdata, m0_axis_tdata}),
    .m_tlast({m2_axis_tlast, m1_axis_tlast, m0_axis_tlast}),
    .m_tvalid({m2_axis_tvalid, m1_axis_tvalid, m0_axis_tvalid}),
    .m_tready({m2_axis_tready, m1_axis_tready, m0_axis_tready}),
    .busy(busy), .done(done), .error(error), .error_code(error_code), .error_channel(error_channel),
    .error_detail(error_detail), .cycles(cycles), .work_cycles(work_cycles), .wait_cycles(wait_cycles),
    .hazards(hazards), .sum_received(sum_received), .sum_sent(sum_sent), .impulse_total(impulse_total)
  );
endmodule

`default_nettype wire
