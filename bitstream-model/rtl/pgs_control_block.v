// The registers of the accelerator (specification, section 4) behind AXI4-Lite.
//
// Offsets, capabilities and reset values come from the generated headers. Each READY is a register's
// and follows no VALID. Addresses and written data are registered before anything looks at them: a
// read is answered in the third cycle after its address, and a write takes effect in the second one
// after the later of its two parts. The specification allows 32 bits only: a write without all four
// strobes has no effect. It is answered OKAY like every access, since an error response to a
// write is an SError of the processors, which ends their kernel.
`default_nettype none

module pgs_control_block (
  input  wire        clk,
  input  wire        resetn,

  input  wire [11:0] awaddr,
  input  wire        awvalid,
  output wire        awready,
  input  wire [31:0] wdata,
  input  wire [3:0]  wstrb,
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
  output reg         core_clear,     // core_reset | start
  output wire        starting,       // a start is being checked, or the end of a step recorded
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
  output reg  [31:0] spin_damping,
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
  (* ram_style = "distributed" *) reg [31:0] inverse_mass [0:SHAPES-1];
  (* ram_style = "distributed" *) reg [31:0] inverse_inertia [0:SHAPES-1];

  reg        gie, done_bit, ready_bit, sticky;
  reg [2:0]  ier, isr;
  reg [7:0]  code, channel;
  reg [31:0] detail;
  reg [63:0] last_cycles, last_impulse_total;
  reg [31:0] last_work, last_wait, last_hazards, last_received, last_sent;

  assign interrupt = gie & |isr;

  // ---- Reset: it clears one shape a cycle

  reg       resets;                  // reset begins, by the pin or by the register
  reg [6:0] reset_left;
  wire      resetting = reset_left != 7'd0;

  // ---- Start: checked in steps, so that no product lies on the way of a register

  reg        go, check, refused, done_late;
  reg [31:0] bytes_bodies, bytes_collisions, bytes;
  reg        bodies_wrong, contacts_wrong, frictions_wrong, too_many;
  wire       running = busy | go | check | start;
  assign starting = go | check | start | refused | done | done_late;

  reg         has_address, has_data;  // of a write
  reg         whole;                 // the data are four bytes
  reg  [11:0] write_address;
  reg  [31:0] write_data;
  reg         reading;               // a read is under way
  reg         read_s1, read_s2;
  reg  [11:0] read_address;
  wire        writes     = has_address & has_data & ~bvalid;  // the registered write is done
  wire        write_here = writes & whole & ~resetting;
  wire        reads      = arvalid & ~reading;
  assign awready = ~has_address;
  assign wready  = ~has_data;
  assign arready = ~reading;

  wire shape_space_w = (write_address[11:10] == SHAPE_TABLE[11:10]) & (write_address[1:0] == 2'd0);
  wire shape_space_r = (read_address[11:10] == SHAPE_TABLE[11:10]) & (read_address[1:0] == 2'd0);

  always @(posedge clk) begin
    // The memory that the arguments need, and their checks, in registers: settled long before a start.
    // More bodies than 18 bits can tell are refused before their bytes matter.
    bytes_bodies     <= bodies[17:0] * BYTES_PER_BODY;
    bytes_collisions <= collisions * BYTES_PER_COLLISION;
    bytes            <= bytes_bodies + bytes_collisions;
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

  // A step that ends while a reset begins has not ended for the registers.
  wire done_here = done & ~resetting;
  wire ends      = done_here | refused;
  wire failed    = refused | (done_here & error);
  wire [2:0] raised = ends ? {failed, 2'b11} & ier : 3'b000;
  wire isr_write = write_here & (write_address == OFFSET_ISR);
  wire arguments_wrong = bodies_wrong | contacts_wrong | frictions_wrong | too_many;

  always @(posedge clk) begin
    go      <= 1'b0;
    check   <= go;
    start   <= 1'b0;
    refused <= 1'b0;
    if (check) begin
      refused <= arguments_wrong;
      start   <= ~arguments_wrong;
      if (bodies_wrong) fail(ERROR_ARGUMENT, 8'd0, {20'd0, OFFSET_BODIES});
      else if (contacts_wrong) fail(ERROR_ARGUMENT, 8'd0, {20'd0, OFFSET_CONTACT_ITERATIONS});
      else if (frictions_wrong) fail(ERROR_ARGUMENT, 8'd0, {20'd0, OFFSET_FRICTION_ITERATIONS});
      else if (too_many) fail(ERROR_CAPACITY, 8'd0, bytes);
    end
    if (done_here & error) fail(error_code, error_channel, error_detail);

    if (ends) begin
      done_bit  <= 1'b1;
      ready_bit <= 1'b1;
    end else if (read_s1 & (read_address == OFFSET_AP_CTRL)) begin
      done_bit  <= 1'b0;
      ready_bit <= 1'b0;
    end
    isr <= (isr ^ (isr_write ? write_data[2:0] : 3'b000)) | raised;
    done_late <= done;
    if (done_late) begin
      last_cycles        <= cycles;
      last_work          <= work_cycles;
      last_wait          <= wait_cycles;
      last_hazards       <= hazards;
      last_received      <= sum_received;
      last_sent          <= sum_sent;
      last_impulse_total <= impulse_total;
    end

    // Writes.
    if (~has_address) write_address <= awaddr;
    if (~has_data) {whole, write_data} <= {&wstrb, wdata};
    has_address <= ~writes & (has_address | awvalid);
    has_data    <= ~writes & (has_data | wvalid);
    shape_write <= 2'b00;
    if (bready) bvalid <= 1'b0;
    if (writes) bvalid <= 1'b1;
    if (write_here) begin
      if ((write_address == OFFSET_AP_CTRL) & write_data[0] & ~running & ~sticky & ~failed) go <= 1'b1;
      if (write_address == OFFSET_GIE) gie <= write_data[0];
      if (write_address == OFFSET_IER) ier <= write_data[2:0];
      if (~running) begin
        case (write_address)
          OFFSET_BODIES:               bodies              <= write_data;
          OFFSET_COLLISIONS:           collisions          <= write_data;
          OFFSET_CONTACT_ITERATIONS:   contact_iterations  <= write_data;
          OFFSET_FRICTION_ITERATIONS:  friction_iterations <= write_data;
          OFFSET_FLAGS:                flags               <= write_data;
          OFFSET_TIME_STEP:            time_step           <= write_data;
          OFFSET_POSITION_DRIFT:       drift               <= write_data;
          OFFSET_POSITION_COEFFICIENT: coefficient         <= write_data;
          OFFSET_FRICTION:             friction            <= write_data;
          OFFSET_ANGULAR_DAMPING:      damping             <= write_data;
          OFFSET_GRAVITY_X:            gravity_x           <= write_data;
          OFFSET_GRAVITY_Y:            gravity_y           <= write_data;
          OFFSET_GRAVITY_Z:            gravity_z           <= write_data;
          OFFSET_SPIN_DAMPING:         spin_damping        <= write_data;
          default: ;
        endcase
        if (shape_space_w & ~write_address[3]) begin
          shape_write   <= write_address[2] ? 2'b10 : 2'b01;
          shape_address <= write_address[9:4];
          shape_in      <= write_data;
        end
      end
    end

    // Reset.
    resets     <= ~resetn | (write_here & (write_address == OFFSET_RESET) & write_data[0]);
    core_reset <= resetting;
    core_clear <= resetting | resets | (check & ~arguments_wrong);
    if (resetting) begin
      reset_left    <= reset_left - 7'd1;
      shape_write   <= 2'b11;
      shape_address <= reset_left[5:0];
      shape_in      <= 32'd0;
    end
    if (resets) begin
      reset_left <= 7'd64;
      core_reset <= 1'b1;
      {gie, ier, isr, done_bit, ready_bit}        <= 9'd0;
      {sticky, code, channel, detail}             <= 49'd0;
      {go, check, start, refused}                 <= 4'd0;
      {bodies, collisions, flags}                 <= 96'd0;
      {contact_iterations, friction_iterations}   <= 64'd0;
      {time_step, drift, coefficient, friction}   <= 128'd0;
      {damping, gravity_x, gravity_y, gravity_z}  <= 128'd0;
      spin_damping                                <= RESET_SPIN_DAMPING;
    end
    if (~resetn) begin
      {bvalid, has_address, has_data, done_late} <= 4'b0000;
      {last_cycles, last_impulse_total}                    <= 128'd0;
      {last_work, last_wait, last_hazards}                 <= 96'd0;
      {last_received, last_sent}                           <= 64'd0;
    end
  end

  // ---- Reads: each kind of register has a selection of its own, which gives 0 for other addresses

  reg [31:0] inverse_mass_read, inverse_inertia_read;
  reg [31:0] argument_read, state_read, capability_read, result_read;
  reg        asks_mass, asks_inertia;
  always @(posedge clk) begin
    read_address <= araddr;
    if (shape_write[0]) inverse_mass[shape_address] <= shape_in;
    if (shape_write[1]) inverse_inertia[shape_address] <= shape_in;
    inverse_mass_read    <= inverse_mass[read_address[9:4]];
    inverse_inertia_read <= inverse_inertia[read_address[9:4]];
    asks_mass            <= shape_space_r & (read_address[3:2] == 2'd0);
    asks_inertia         <= shape_space_r & (read_address[3:2] == 2'd1);
    case (read_address)
      OFFSET_BODIES:               argument_read <= bodies;
      OFFSET_COLLISIONS:           argument_read <= collisions;
      OFFSET_CONTACT_ITERATIONS:   argument_read <= contact_iterations;
      OFFSET_FRICTION_ITERATIONS:  argument_read <= friction_iterations;
      OFFSET_FLAGS:                argument_read <= flags;
      OFFSET_TIME_STEP:            argument_read <= time_step;
      OFFSET_POSITION_DRIFT:       argument_read <= drift;
      OFFSET_POSITION_COEFFICIENT: argument_read <= coefficient;
      OFFSET_FRICTION:             argument_read <= friction;
      OFFSET_ANGULAR_DAMPING:      argument_read <= damping;
      OFFSET_GRAVITY_X:            argument_read <= gravity_x;
      OFFSET_GRAVITY_Y:            argument_read <= gravity_y;
      OFFSET_GRAVITY_Z:            argument_read <= gravity_z;
      OFFSET_SPIN_DAMPING:         argument_read <= spin_damping;
      default:                     argument_read <= 32'd0;
    endcase
    case (read_address)
      OFFSET_AP_CTRL:      state_read <= {28'd0, ready_bit, ~running, done_bit, running};
      OFFSET_GIE:          state_read <= {31'd0, gie};
      OFFSET_IER:          state_read <= {29'd0, ier};
      OFFSET_ISR:          state_read <= {29'd0, isr};
      OFFSET_ERROR:        state_read <= {16'd0, channel, code};
      OFFSET_ERROR_DETAIL: state_read <= detail;
      OFFSET_RESET:        state_read <= {31'd0, resetting};
      default:             state_read <= 32'd0;
    endcase
    case (read_address)
      OFFSET_IDENTIFICATION:     capability_read <= CAPABILITY_IDENTIFICATION;
      OFFSET_VERSION:            capability_read <= CAPABILITY_VERSION;
      OFFSET_PROFILE:            capability_read <= CAPABILITY_PROFILE;
      OFFSET_FEATURES:           capability_read <= CAPABILITY_FEATURES;
      OFFSET_CHANNELS:           capability_read <= CAPABILITY_CHANNELS;
      OFFSET_MM2S_WIDTHS:        capability_read <= CAPABILITY_MM2S_WIDTHS;
      OFFSET_S2MM_WIDTHS:        capability_read <= CAPABILITY_S2MM_WIDTHS;
      OFFSET_ISSUE:              capability_read <= CAPABILITY_ISSUE;
      OFFSET_CONTACT_DEPTH:      capability_read <= CAPABILITY_CONTACT_DEPTH;
      OFFSET_FRICTION_DEPTH:     capability_read <= CAPABILITY_FRICTION_DEPTH;
      OFFSET_CLOCK_KHZ:          capability_read <= CAPABILITY_CLOCK_KHZ;
      OFFSET_BODY_CAPACITY:      capability_read <= CAPABILITY_BODY_CAPACITY;
      OFFSET_COLLISION_CAPACITY: capability_read <= CAPABILITY_COLLISION_CAPACITY;
      OFFSET_SHAPE_CAPACITY:     capability_read <= SHAPES;
      OFFSET_MEMORY_BYTES:       capability_read <= CAPABILITY_MEMORY_BYTES;
      OFFSET_MEMORY_PER_RECORD:  capability_read <= CAPABILITY_MEMORY_PER_RECORD;
      OFFSET_DMA:                capability_read <= CAPABILITY_DMA;
      OFFSET_NUMBERS:            capability_read <= CAPABILITY_NUMBERS;
      OFFSET_QUEUE:              capability_read <= CAPABILITY_QUEUE;
      OFFSET_FENCE_BASE:         capability_read <= CAPABILITY_FENCE_BASE;
      OFFSET_FENCE_SIZE:         capability_read <= CAPABILITY_FENCE_SIZE;
      default:                   capability_read <= 32'd0;
    endcase
    case (read_address)
      OFFSET_CYCLES_LO:      result_read <= last_cycles[31:0];
      OFFSET_CYCLES_HI:      result_read <= last_cycles[63:32];
      OFFSET_WORK_CYCLES:    result_read <= last_work;
      OFFSET_WAIT_CYCLES:    result_read <= last_wait;
      OFFSET_HAZARDS:        result_read <= last_hazards;
      OFFSET_SUM_RECEIVED:   result_read <= last_received;
      OFFSET_SUM_SENT:       result_read <= last_sent;
      OFFSET_IMPULSE_SUM_LO: result_read <= last_impulse_total[31:0];
      OFFSET_IMPULSE_SUM_HI: result_read <= last_impulse_total[63:32];
      default:               result_read <= 32'd0;
    endcase

    read_s1 <= reads;
    read_s2 <= read_s1;
    if (rvalid & rready) {reading, rvalid} <= 2'b00;
    if (reads) reading <= 1'b1;
    if (read_s2) begin
      rvalid <= 1'b1;
      rdata  <= argument_read | state_read | capability_read | result_read
              | (inverse_mass_read & {32{asks_mass}}) | (inverse_inertia_read & {32{asks_inertia}});
    end
    if (~resetn) {reading, read_s1, read_s2, rvalid} <= 4'b0000;
  end
endmodule

`default_nettype wire
