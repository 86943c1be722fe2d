// The registers of the accelerator (specification, section 4) behind AXI4-Lite.
//
// Offsets, capabilities and reset values come from the generated headers. Reads take one cycle; a
// write takes effect in the cycle after both address and data are there. An AXI access of less than
// 32 bits does not exist here: strobes are ignored, as the specification allows 32 bits only.
`default_nettype none

module control_block (
  input  wire        clk,
  input  wire        resetn,

  input  wire [11:0] awaddr,
  input  wire        awvalid,
  output wire        awready,
  input  wire [31:0] wdata,
  input  wire        wvalid,
  output wire        wready,
  output reg         bvalid,
  input  wire        bready,
  input  wire [11:0] araddr,
  input  wire        arvalid,
  output wire        arready,
  output reg  [31:0] rdata,
  output reg         rvalid,
  input  wire        rready,

  output wire        interrupt,
  output reg         core_reset,
  output wire        starting,       // a start is being checked, or its end recorded
  output reg         start,

  output reg  [31:0] bodies,
  output reg  [31:0] collisions,
  output reg  [31:0] contact_iterations,
  output reg  [31:0] friction_iterations,
  output reg  [31:0] flags,
  output reg  [31:0] time_step,
  output reg  [31:0] drift,
  output reg  [31:0] coefficient,
  output reg  [31:0] friction,
  output reg  [31:0] damping,
  output reg  [31:0] gravity_x,
  output reg  [31:0] gravity_y,
  output reg  [31:0] gravity_z,
  output reg  [1:0]  shape_write,
  output reg  [5:0]  shape_address,
  output reg  [31:0] shape_in,

  input  wire        busy,
  input  wire        done,
  input  wire        error,
  input  wire [7:0]  error_code,
  input  wire [7:0]  error_channel,
  input  wire [31:0] error_detail,
  input  wire [63:0] cycles,
  input  wire [31:0] work_cycles,
  input  wire [31:0] wait_cycles,
  input  wire [31:0] hazards,
  input  wire [31:0] sum_received,
  input  wire [31:0] sum_sent,
  input  wire [63:0] impulse_total
);
`include "pgs_interface.vh"
`include "pgs_schedule.vh"

  localparam [31:0] BODIES_MAX     = CAPABILITY_BODY_CAPACITY;
  localparam [31:0] ITERATIONS_TOP = ITERATIONS_MAX;

  // The shape table as it was written, for reads.
  reg [31:0] inverse_mass [0:SHAPES-1];
  reg [31:0] inverse_inertia [0:SHAPES-1];

  reg        gie, done_bit, ready_bit, sticky;
  reg [2:0]  ier, isr;
  reg [7:0]  code, channel;
  reg [31:0] detail;
  reg [63:0] last_cycles, last_impulse_total;
  reg [31:0] last_work, last_wait, last_hazards, last_received, last_sent;

  assign interrupt = gie & |isr;

  // ---- Reset: it clears one shape a cycle

  reg [6:0] reset_left;
  wire      resetting = reset_left != 7'd0;

  // ---- Start: checked in steps, so that no product lies on the way of a register

  reg        go, check, refused;
  reg [31:0] bytes_bodies, bytes_collisions;
  reg        bodies_wrong, contacts_wrong, frictions_wrong, too_many;
  wire       running = busy | go | check | start;
  assign starting = go | check | start | refused | done;

  wire        writes     = awvalid & wvalid & ~bvalid;
  wire        write_here = writes & ~resetting;
  wire        reads      = arvalid & ~rvalid;
  assign awready = writes;
  assign wready  = writes;
  assign arready = reads;

  wire shape_space_w = awaddr[11:10] == SHAPE_TABLE[11:10];
  wire shape_space_r = araddr[11:10] == SHAPE_TABLE[11:10];

  always @(posedge clk) begin
    // The memory that the arguments need, and their checks, in registers: settled long before a start.
    bytes_bodies     <= bodies * BYTES_PER_BODY;
    bytes_collisions <= collisions * BYTES_PER_COLLISION;
    bodies_wrong     <= (bodies == 32'd0) | (bodies > BODIES_MAX);
    contacts_wrong   <= contact_iterations > ITERATIONS_TOP;
    frictions_wrong  <= friction_iterations > ITERATIONS_TOP;
    too_many         <= collisions > CAPABILITY_COLLISION_CAPACITY;
  end

  task fail(input [7:0] with_code, input [7:0] with_channel, input [31:0] with_detail);
    begin
      sticky  <= 1'b1;
      code    <= with_code;
      channel <= with_channel;
      detail  <= with_detail;
    end
  endtask

  wire ends   = done | refused;
  wire failed = refused | (done & error);
  wire [2:0] raised = ends ? {failed, 2'b11} & ier : 3'b000;
  wire isr_write = write_here & (awaddr == OFFSET_ISR);

  always @(posedge clk) begin
    go      <= 1'b0;
    check   <= go;
    start   <= 1'b0;
    refused <= 1'b0;
    if (check) begin
      refused <= bodies_wrong | contacts_wrong | frictions_wrong | too_many;
      start   <= ~(bodies_wrong | contacts_wrong | frictions_wrong | too_many);
      if (bodies_wrong) fail(ERROR_ARGUMENT, 8'd0, {20'd0, OFFSET_BODIES});
      else if (contacts_wrong) fail(ERROR_ARGUMENT, 8'd0, {20'd0, OFFSET_CONTACT_ITERATIONS});
      else if (frictions_wrong) fail(ERROR_ARGUMENT, 8'd0, {20'd0, OFFSET_FRICTION_ITERATIONS});
      else if (too_many) fail(ERROR_CAPACITY, 8'd0, bytes_bodies + bytes_collisions);
    end
    if (done & error) fail(error_code, error_channel, error_detail);

    if (ends) begin
      done_bit  <= 1'b1;
      ready_bit <= 1'b1;
    end else if (reads & (araddr == OFFSET_AP_CTRL)) begin
      done_bit  <= 1'b0;
      ready_bit <= 1'b0;
    end
    isr <= (isr ^ (isr_write ? wdata[2:0] & ier : 3'b000)) | raised;
    if (done) begin
      last_cycles        <= cycles;
      last_work          <= work_cycles;
      last_wait          <= wait_cycles;
      last_hazards       <= hazards;
      last_received      <= sum_received;
      last_sent          <= sum_sent;
      last_impulse_total <= impulse_total;
    end

    // Writes.
    shape_write <= 2'b00;
    if (bready) bvalid <= 1'b0;
    if (writes) bvalid <= 1'b1;
    if (write_here) begin
      if ((awaddr == OFFSET_AP_CTRL) & wdata[0] & ~running & ~sticky) go <= 1'b1;
      if (awaddr == OFFSET_GIE) gie <= wdata[0];
      if (awaddr == OFFSET_IER) ier <= wdata[2:0];
      if (~running) begin
        case (awaddr)
          OFFSET_BODIES:               bodies              <= wdata;
          OFFSET_COLLISIONS:           collisions          <= wdata;
          OFFSET_CONTACT_ITERATIONS:   contact_iterations  <= wdata;
          OFFSET_FRICTION_ITERATIONS:  friction_iterations <= wdata;
          OFFSET_FLAGS:                flags               <= wdata;
          OFFSET_TIME_STEP:            time_step           <= wdata;
          OFFSET_POSITION_DRIFT:       drift               <= wdata;
          OFFSET_POSITION_COEFFICIENT: coefficient         <= wdata;
          OFFSET_FRICTION:             friction            <= wdata;
          OFFSET_ANGULAR_DAMPING:      damping             <= wdata;
          OFFSET_GRAVITY_X:            gravity_x           <= wdata;
          OFFSET_GRAVITY_Y:            gravity_y           <= wdata;
          OFFSET_GRAVITY_Z:            gravity_z           <= wdata;
          default: ;
        endcase
        if (shape_space_w & ~awaddr[3]) begin
          shape_write   <= awaddr[2] ? 2'b10 : 2'b01;
          shape_address <= awaddr[9:4];
          shape_in      <= wdata;
          if (awaddr[2]) inverse_inertia[awaddr[9:4]] <= wdata;
          else inverse_mass[awaddr[9:4]] <= wdata;
        end
      end
    end

    // Reset, by the pin or by the register.
    core_reset <= resetting;
    if (resetting) begin
      reset_left    <= reset_left - 7'd1;
      shape_write   <= 2'b11;
      shape_address <= reset_left[5:0];
      shape_in      <= 32'd0;
      inverse_mass[reset_left[5:0]]    <= 32'd0;
      inverse_inertia[reset_left[5:0]] <= 32'd0;
    end
    if (~resetn | (write_here & (awaddr == OFFSET_RESET) & wdata[0])) begin
      reset_left <= 7'd64;
      core_reset <= 1'b1;
      {gie, ier, isr, done_bit, ready_bit}        <= 9'd0;
      {sticky, code, channel, detail}             <= 49'd0;
      {go, check, start, refused}                 <= 4'd0;
      {bodies, collisions, flags}                 <= 96'd0;
      {contact_iterations, friction_iterations}   <= 64'd0;
      {time_step, drift, coefficient, friction}   <= 128'd0;
      {damping, gravity_x, gravity_y, gravity_z}  <= 128'd0;
    end
    if (~resetn) begin
      bvalid <= 1'b0;
      {last_cycles, last_impulse_total}                    <= 128'd0;
      {last_work, last_wait, last_hazards}                 <= 96'd0;
      {last_received, last_sent}                           <= 64'd0;
    end
  end

  // ---- Reads

  wire [31:0] shape_mass    = inverse_mass[araddr[9:4]];
  wire [31:0] shape_inertia = inverse_inertia[araddr[9:4]];
  reg  [31:0] read;
  always @* begin
    case (araddr)
      OFFSET_AP_CTRL:              read = {28'd0, ready_bit, ~running, done_bit, running};
      OFFSET_GIE:                  read = {31'd0, gie};
      OFFSET_IER:                  read = {29'd0, ier};
      OFFSET_ISR:                  read = {29'd0, isr};
      OFFSET_BODIES:               read = bodies;
      OFFSET_COLLISIONS:           read = collisions;
      OFFSET_CONTACT_ITERATIONS:   read = contact_iterations;
      OFFSET_FRICTION_ITERATIONS:  read = friction_iterations;
      OFFSET_FLAGS:                read = flags;
      OFFSET_TIME_STEP:            read = time_step;
      OFFSET_POSITION_DRIFT:       read = drift;
      OFFSET_POSITION_COEFFICIENT: read = coefficient;
      OFFSET_FRICTION:             read = friction;
      OFFSET_ANGULAR_DAMPING:      read = damping;
      OFFSET_GRAVITY_X:            read = gravity_x;
      OFFSET_GRAVITY_Y:            read = gravity_y;
      OFFSET_GRAVITY_Z:            read = gravity_z;
      OFFSET_IDENTIFICATION:       read = CAPABILITY_IDENTIFICATION;
      OFFSET_VERSION:              read = CAPABILITY_VERSION;
      OFFSET_PROFILE:              read = CAPABILITY_PROFILE;
      OFFSET_FEATURES:             read = CAPABILITY_FEATURES;
      OFFSET_CHANNELS:             read = CAPABILITY_CHANNELS;
      OFFSET_MM2S_WIDTHS:          read = CAPABILITY_MM2S_WIDTHS;
      OFFSET_S2MM_WIDTHS:          read = CAPABILITY_S2MM_WIDTHS;
      OFFSET_ISSUE:                read = CAPABILITY_ISSUE;
      OFFSET_CONTACT_DEPTH:        read = CAPABILITY_CONTACT_DEPTH;
      OFFSET_FRICTION_DEPTH:       read = CAPABILITY_FRICTION_DEPTH;
      OFFSET_CLOCK_KHZ:            read = CAPABILITY_CLOCK_KHZ;
      OFFSET_BODY_CAPACITY:        read = CAPABILITY_BODY_CAPACITY;
      OFFSET_COLLISION_CAPACITY:   read = CAPABILITY_COLLISION_CAPACITY;
      OFFSET_SHAPE_CAPACITY:       read = SHAPES;
      OFFSET_MEMORY_BYTES:         read = CAPABILITY_MEMORY_BYTES;
      OFFSET_MEMORY_PER_RECORD:    read = CAPABILITY_MEMORY_PER_RECORD;
      OFFSET_DMA:                  read = CAPABILITY_DMA;
      OFFSET_ERROR:                read = {16'd0, channel, code};
      OFFSET_ERROR_DETAIL:         read = detail;
      OFFSET_CYCLES_LO:            read = last_cycles[31:0];
      OFFSET_CYCLES_HI:            read = last_cycles[63:32];
      OFFSET_WORK_CYCLES:          read = last_work;
      OFFSET_WAIT_CYCLES:          read = last_wait;
      OFFSET_HAZARDS:              read = last_hazards;
      OFFSET_SUM_RECEIVED:         read = last_received;
      OFFSET_SUM_SENT:             read = last_sent;
      OFFSET_IMPULSE_SUM_LO:       read = last_impulse_total[31:0];
      OFFSET_IMPULSE_SUM_HI:       read = last_impulse_total[63:32];
      OFFSET_RESET:                read = {31'd0, resetting};
      default: read = ~shape_space_r | araddr[3] ? 32'd0
                    : araddr[2] ? shape_inertia : shape_mass;
    endcase
  end
  always @(posedge clk) begin
    if (rready) rvalid <= 1'b0;
    if (reads) begin
      rvalid <= 1'b1;
      rdata  <= read;
    end
    if (~resetn) rvalid <= 1'b0;
  end
endmodule

`default_nettype wire
