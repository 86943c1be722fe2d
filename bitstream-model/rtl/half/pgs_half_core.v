// The accelerator of profile `half` without its registers: beats in, beats out.
//
//   receivers -> loader ------------------------------------> velocities, 2 copies <-> solvers, one a collision of a pair
//            \-> finder -> issue -> record registers -> solvers
//            \-> integrator -> solvers: integration -> results -> senders
//
// A slot of three cycles carries a pair of collisions, one of them, or nothing, and nothing behind the issue ever
// stops: no pipeline has a clock enable. The memories of bodies have two banks each, so that five bodies load in two
// cycles. README.md has the memories and the schedule of a step.
`default_nettype none

module pgs_half_core (
  input  wire         clk,
  input  wire         reset,
  input  wire         start,
  input  wire         clear,           // reset | start, in a register of its own

  // Arguments; they do not change while a step runs.
  input  wire [19:0]  bodies,
  input  wire [19:0]  collisions,
  input  wire [7:0]   contact_iterations,
  input  wire [7:0]   friction_iterations,
  input  wire         integrate,
  input  wire         kinematic,
  input  wire         warm_start,
  input  wire         impulses_out,
  input  wire [31:0]  time_step,
  input  wire [31:0]  drift,
  input  wire [31:0]  coefficient,
  input  wire [31:0]  friction_coefficient,
  input  wire [31:0]  spin_damping,
  input  wire [31:0]  damping,
  input  wire [95:0]  gravity,
  input  wire [1:0]   shape_write,
  input  wire [5:0]   shape_address,
  input  wire [31:0]  shape_in,

  input  wire [319:0] s_tdata,         // streams of 128, 128 and 64 bits, stream 0 in the low bits
  input  wire [39:0]  s_tkeep,
  input  wire [2:0]   s_tlast,
  input  wire [2:0]   s_tvalid,
  output wire [2:0]   s_tready,
  output wire [319:0] m_tdata,
  output wire [2:0]   m_tlast,
  output wire [2:0]   m_tvalid,
  input  wire [2:0]   m_tready,

  output wire         busy,
  output wire         done,
  output reg          error,           // stays until reset
  output reg  [7:0]   error_code,
  output reg  [7:0]   error_channel,
  output reg  [31:0]  error_detail,
  output wire [63:0]  cycles,
  output wire [31:0]  work_cycles,
  output wire [31:0]  wait_cycles,
  output wire [31:0]  hazards,
  output reg  [31:0]  sum_received,
  output reg  [31:0]  sum_sent,
  output wire [63:0]  impulse_total
);
`include "pgs_interface.vh"
`include "pgs_schedule.vh"

  localparam ADDRESS_STAGES = MEMORY_ADDRESS_STAGES;
  localparam OUTPUT_STAGES  = MEMORY_OUTPUT_STAGES;     // the last one is the register that holds a word
  localparam READ_LATENCY   = ADDRESS_STAGES + 1 + OUTPUT_STAGES;
  localparam BODY           = BODY_BITS;       // bits of a body's number
  localparam COLLISION      = COLLISION_BITS;  // bits of a collision's number
  localparam SHAPE          = 6;               // bits of a shape's number
  localparam SETUP          = 12;              // cycles in front of the first pass

  wire [19:0] groups, result_groups, pairs;
  wire        odd;
  wire [2:0]  last_bodies;
  pgs_half_packets lengths (
    .clk(clk), .bodies(bodies), .collisions(collisions), .groups(groups), .result_groups(result_groups),
    .pairs(pairs), .odd(odd), .last_bodies(last_bodies)
  );

  // Passes of the step. A kind with passes has a warm pass in front of them. A step without collisions has no pass.
  reg [8:0] contact_passes, friction_passes;
  reg [9:0] passes;
  reg       no_contacts;
  always @(posedge clk) begin
    no_contacts     <= contact_passes == 9'd0;
    contact_passes  <= (collisions == 20'd0) ? 9'd0
                     : {1'b0, contact_iterations} + {8'd0, warm_start & |contact_iterations};
    friction_passes <= (collisions == 20'd0) ? 9'd0
                     : {1'b0, friction_iterations} + {8'd0, warm_start & |friction_iterations};
    passes          <= {1'b0, contact_passes} + {1'b0, friction_passes};
  end

  // ---- Sequence

  wire [2:0] phases;
  wire loading, finding, passing, draining, begin_pass, integrating;
  wire friction, first_of_kind, last_contact, parity;
  wire warm, next_warm, sends, next_sends;
  wire [2:0] load_pops, pose_pops;
  wire       load_finished;
  wire issues, stalls, waits, enters, enter_finished;
  wire [2:0] sender_finished;
  wire last_issue;
  wire unused = &{1'b0, last_issue};

  pgs_step_sequence #(
    .INTERVAL(3), .SETUP(SETUP), .CONTACT_FILL(CONTACT_FILL), .FRICTION_FILL(FRICTION_FILL),
    .FINISH(INTEGRATION_DEPTH + 17)
  ) steps (
    .clk(clk), .reset(reset), .start(start), .error(error),
    .collisions(pairs), .contact_passes(contact_passes), .friction_passes(friction_passes),
    .warm_start(warm_start), .impulses_out(impulses_out),
    .loads(|load_pops), .load_finished(load_finished),
    .issues(issues), .stalls(stalls), .waits(waits),
    .enters(enters), .enter_finished(enter_finished), .results_finished(&sender_finished),
    .busy(busy), .done(done), .phases(phases), .loading(loading), .finding(finding), .passing(passing),
    .last_issue(last_issue), .draining(draining), .begin_pass(begin_pass), .integrating(integrating),
    .friction(friction), .first_of_kind(first_of_kind), .last_contact(last_contact), .parity(parity),
    .warm(warm), .next_warm(next_warm), .sends(sends), .next_sends(next_sends),
    .cycles(cycles), .work_cycles(work_cycles), .wait_cycles(wait_cycles)
  );

  // ---- Arguments in binary16

  wire [15:0] half_time_step, half_drift, half_coefficient, half_friction, half_spin_damping, half_damping;
  wire [47:0] half_gravity;
  wire [287:0] arguments = {gravity, damping, spin_damping, friction_coefficient, coefficient, drift, time_step};
  wire [143:0] rounded;
  genvar k;
  generate
    for (k = 0; k < 9; k = k + 1) begin : g_argument
      pgs_float_to_half rounds (.clk(clk), .number(arguments[32*k +: 32]), .half(rounded[16*k +: 16]));
    end
  endgenerate
  assign {half_gravity, half_damping, half_spin_damping, half_friction, half_coefficient, half_drift, half_time_step}
    = rounded;

  wire [15:0] per_second, speed_limit, half_step, series;
  wire [47:0] gravity_step;
  pgs_half_constants numbers (
    .clk(clk), .start(start), .time_step(half_time_step), .gravity(half_gravity),
    .per_second(per_second), .speed_limit(speed_limit), .half_step(half_step), .series(series),
    .gravity_step(gravity_step)
  );

  // ---- Streams in

  wire [383:0] heads;
  wire [5:0]   count [0:2];
  wire [2:0]   there;                  // a beat in the FIFO
  wire [31:0]  received [0:2];
  wire [20:0]  wrong_beat [0:2];
  wire [7:0]   wrong_code [0:2];
  wire [2:0]   pop, wrong, comes;
  wire [1:0]   place [0:2];
  generate
    for (k = 0; k < 3; k = k + 1) begin : g_receiver
      // The bits of the stream on the ports of all, and the beats of a pair of collisions.
      localparam integer WIDTH = (k == 2) ? 64 : 128;
      wire [20:0] body_beats = (k == 2) ? {1'b0, groups} : {groups, 1'b0};
      wire [20:0] three      = {pairs, 1'b0} + {1'b0, pairs};
      pgs_receiver #(.WIDTH(WIDTH), .GROUP((k == 2) ? 1 : 3)) stream (
        .clk(clk), .stop(reset | error), .start(start), .clear(clear),
        .velocity_beats(body_beats), .pose_beats(body_beats),
        .pass_beats((k == 2) ? {1'b0, pairs} : three), .warm_beats((k == 2) ? {pairs, 1'b0} : three),
        .passes(passes), .friction_passes(friction_passes), .warm_start(warm_start),
        .tdata(s_tdata[128*k +: WIDTH]), .tkeep(s_tkeep[16*k +: WIDTH/8]), .tlast(s_tlast[k]),
        .tvalid(s_tvalid[k]), .tready(s_tready[k]),
        .head(heads[128*k +: 128]), .count(count[k]), .there(there[k]), .pop(pop[k]),
        .comes(comes[k]), .place(place[k]),
        .sum(received[k]), .error(wrong[k]), .error_code(wrong_code[k]), .error_beat(wrong_beat[k])
      );
    end
  endgenerate
  wire unused_places = &{1'b0, comes[2], place[2]};
  reg [31:0] received_low;
  always @(posedge clk) begin
    received_low <= received[0] + received[1];
    sum_received <= received_low + received[2];
  end

  // ---- Load, and the mass properties of the bodies

  wire [2:0]         load_write, load_moves;
  wire [3*BODY-1:0]  load_address;
  wire [3*SHAPE-1:0] load_lookup;
  wire [23:0]        load_shape;
  wire [287:0]       load_velocity;
  wire               load_error;
  wire [19:0]        load_error_body;
  pgs_half_loader #(.BODY(BODY), .SHAPE(SHAPE)) loader (
    .clk(clk), .start(clear), .run(loading), .bodies(bodies), .groups(groups), .kinematic(kinematic),
    .there(there), .heads(heads), .pop(load_pops), .finished(load_finished),
    .lookup(load_lookup), .lookup_moves(load_moves),
    .write(load_write), .address(load_address), .shape(load_shape), .velocity(load_velocity),
    .error(load_error), .error_body(load_error_body)
  );

  wire [BODY-1:0]   next_a, next_b;
  wire [2*BODY-1:0] mass_address;
  wire [63:0]       properties;
  wire [1:0]        has_mass = load_moves[1:0];
  pgs_half_shapes #(.BODIES(BODIES), .BODY(BODY), .SHAPE(SHAPE)) shapes (
    .clk(clk), .table_write(shape_write), .table_address(shape_address), .table_in(shape_in),
    .loading(~finding & ~integrating), .write(load_write),
    .address({load_address[3*BODY-1:2*BODY], (|load_write) ? load_address[2*BODY-1:0]
              : integrating ? mass_address : {next_b, next_a}}),
    .shape(load_shape), .lookup(load_lookup), .moves(load_moves), .properties(properties)
  );

  // ---- Pairs of collisions: found, issued, registered

  wire                   find_error;
  wire [7:0]             find_error_code;
  wire [19:0]            find_error_collision;
  wire                   found;
  wire [4*COLLISION+3:0] last_uses;
  wire [4*BODY-1:0]      found_bodies;
  wire [3:0]             found_moves;
  wire [127:0]           found_masses;
  wire [5:0]             found_points;
  wire [1:0]             found_there;
  pgs_half_finder #(.BODIES(BODIES), .BODY(BODY), .COLLISION(COLLISION)) find (
    .clk(clk), .clear(clear), .run(finding), .bodies(bodies), .pairs(pairs), .odd(odd),
    .comes(comes[1:0]), .place_0(place[0]), .place_1(place[1]),
    .beat_0(s_tdata[127:0]), .beat_1(s_tdata[255:128]),
    .load(load_write), .load_address(load_address),
    .next_body_a(next_a), .next_body_b(next_b), .properties(properties), .has_mass(has_mass),
    .pop(issues), .found(found), .last_uses(last_uses), .pair_bodies(found_bodies), .moves(found_moves),
    .masses(found_masses), .points(found_points), .is_there(found_there),
    .error(find_error), .error_code(find_error_code), .error_collision(find_error_collision)
  );

  // A pair's beats are taken in the three cycles of its slot. In the last of them the third ones of the pair before
  // may still be in the FIFOs.
  wire       begins, second_enters;
  reg        takes_second, takes_third;
  wire [2:0] room;
  wire [5:0] beats_needed = takes_third ? 6'd4 : 6'd3;
  wire beats_there = (count[0] >= beats_needed) & (count[1] >= beats_needed)
                   & (count[2] >= (next_warm ? 6'd2 : 6'd1));
  pgs_half_issue #(
    .COLLISION(COLLISION), .INTERLOCKED(DESIGN_INTERLOCKED),
    .CONTACT_WINDOW(CONTACT_WINDOW), .FRICTION_WINDOW(FRICTION_WINDOW)
  ) issuer (
    .clk(clk), .clear(clear), .slot_begins(phases[0]), .slot_ends(phases[2]), .passing(passing), .draining(draining),
    .friction(friction), .parity(parity), .warm(warm),
    .streams_ready(beats_there & (room[0] | ~next_sends)), .found(found),
    .last_uses(last_uses), .moves(found_moves),
    .begins(begins), .second_enters(second_enters), .issues(issues), .stalls(stalls), .waits(waits), .hazards(hazards)
  );

  // Each of these is there in its own part of the step only.
  wire takes_pair = begins | takes_second | takes_third;
  assign pop = load_pops | pose_pops | {begins | (takes_second & warm), takes_pair, takes_pair};

  // The beats and the found facts of a pair, for the three cycles of its slot, and longer if the second collision
  // waits. Cycle 0 of a pipeline is the first of them.
  reg  [767:0]  early;                 // beats 0 and 1 of each stream
  reg  [1023:0] rows;                  // 14 rows of 64 bits, and two of impulses
  reg  [4*BODY-1:0] early_bodies, pair_bodies;
  reg  [3:0]    early_moves, moves;
  reg  [127:0]  early_masses, masses;
  reg  [5:0]    early_points, points;
  reg  [1:0]    early_there, is_there;
  reg  [1:0]    entered, valid;        // the second collision of a pair, and the first
  always @(posedge clk) begin
    takes_second <= begins & ~clear;
    takes_third  <= takes_second & ~clear;
    if (phases[0]) begin
      entered <= {second_enters, begins};
      {early[127:0], early[383:256], early[639:512]} <= {heads[127:0], heads[255:128], heads[383:256]};
    end
    if (phases[1]) {early[255:128], early[511:384], early[767:640]} <= {heads[127:0], heads[255:128], heads[383:256]};
    if (begins) {early_bodies, early_moves, early_masses, early_points, early_there}
      <= {found_bodies, found_moves, found_masses, found_points, found_there};
    if (takes_third) begin
      rows <= {early[767:512], heads[255:128], early[511:256], heads[127:0], early[255:0]};
      {pair_bodies, moves, masses, points, is_there}
        <= {early_bodies, early_moves, early_masses, early_points, early_there};
    end
    if (phases[2]) valid <= entered;
    if (clear) {valid, entered} <= 4'd0;
  end

  // ---- Times of a collision in the pipelines, in slots after its cycle 0; of the second one of a pair and the first

  localparam LONGEST = ((CONTACT_DEPTH > FRICTION_DEPTH) ? CONTACT_DEPTH : FRICTION_DEPTH) / 3;
  wire [1:0] ends, reads_impulse, moves_a, moves_b, write_padding, write_there;
  wire [BODY-1:0] read_a [0:1];
  wire [BODY-1:0] read_b [0:1];
  wire [BODY-1:0] results_a [0:1];
  wire [BODY-1:0] results_b [0:1];
  generate
    for (k = 0; k < 2; k = k + 1) begin : g_time
      reg [LONGEST-1:0] slots;             // valid records, one bit a slot
      always @(posedge clk) begin
        if (clear) slots <= {LONGEST{1'b0}};
        else if (phases[0]) slots <= {slots[LONGEST-2:0], valid[k]};
      end
      assign ends[k] = phases[0] & (friction ? slots[FRICTION_DEPTH/3 - 1] : slots[CONTACT_DEPTH/3 - 1]);
      assign reads_impulse[k] = phases[0] & (friction ? slots[(FRICTION_IMPULSES - READ_LATENCY)/3 - 1]
                                                      : slots[(CONTACT_IMPULSES - READ_LATENCY)/3 - 1]);
      wire [2*BODY-1:0] sides = pair_bodies[2*BODY*k +: 2*BODY];
      wire [2*BODY-1:0] contact_reads, friction_reads;
      pgs_delay #(.WIDTH(2*BODY), .SLOTS((CONTACT_VELOCITIES - READ_LATENCY)/3)) contact_late (
        .clk(clk), .enable(phases[0]), .d(sides), .q(contact_reads)
      );
      pgs_delay #(.WIDTH(2*BODY), .SLOTS((FRICTION_VELOCITIES - READ_LATENCY)/3)) friction_late (
        .clk(clk), .enable(phases[0]), .d(sides), .q(friction_reads)
      );
      assign {read_b[k], read_a[k]} = friction ? friction_reads : contact_reads;
      localparam FACTS = 2*BODY + 4;
      wire [FACTS-1:0] contact_writes, friction_writes;
      wire [FACTS-1:0] facts = {sides, moves[2*k +: 2], points[3*k +: 3] == 3'd0, is_there[k]};
      pgs_delay #(.WIDTH(FACTS), .SLOTS(CONTACT_DEPTH/3)) contact_results (
        .clk(clk), .enable(phases[0]), .d(facts), .q(contact_writes)
      );
      pgs_delay #(.WIDTH(FACTS), .SLOTS(FRICTION_DEPTH/3)) friction_results (
        .clk(clk), .enable(phases[0]), .d(facts), .q(friction_writes)
      );
      assign {results_b[k], results_a[k], moves_b[k], moves_a[k], write_padding[k], write_there[k]}
        = friction ? friction_writes : contact_writes;
    end
  endgenerate

  // ---- Velocities: in a pass a copy is read for each collision in phase 0; the first collision is written to both
  // copies in phase 1, the second one in phase 2. Port A is body A's and port B body B's.

  wire [95:0]  solved_a [0:1];
  wire [95:0]  solved_b [0:1];
  reg  [1:0]   write_a, write_b;
  reg  [2*BODY-1:0] write_address_a, write_address_b;
  reg  [191:0] write_velocity_a, write_velocity_b;
  always @(posedge clk) if (phases[0]) begin
    write_a          <= ends & moves_a & {2{~clear}};
    write_b          <= ends & moves_b & {2{~clear}};
    write_address_a  <= {results_a[1], results_a[0]};
    write_address_b  <= {results_b[1], results_b[0]};
    write_velocity_a <= {solved_a[1], solved_a[0]};
    write_velocity_b <= {solved_b[1], solved_b[0]};
  end
  wire               in_pass = passing | draining;
  wire [4*BODY-1:0]  entering;
  wire [383:0]       read_velocities;   // of both copies, ports A and B
  reg  [383:0]       velocities;        // held for a slot
  always @(posedge clk) if (phases[2]) velocities <= read_velocities;
  wire               writes_a = in_pass & ((phases[1] & write_a[0]) | (phases[2] & write_a[1]));
  wire               writes_b = in_pass & ((phases[1] & write_b[0]) | (phases[2] & write_b[1]));
  wire [BODY-1:0]    written_a = phases[1] ? write_address_a[BODY-1:0] : write_address_a[2*BODY-1:BODY];
  wire [BODY-1:0]    written_b = phases[1] ? write_address_b[BODY-1:0] : write_address_b[2*BODY-1:BODY];
  generate
    for (k = 0; k < 2; k = k + 1) begin : g_copy
      pgs_two_banks #(
        .WIDTH(96), .DEPTH(BODIES), .ADDRESS(BODY),
        .ADDRESS_STAGES(ADDRESS_STAGES), .OUTPUT_STAGES(OUTPUT_STAGES - 1)
      ) copy (
        .clk(clk),
        .write_a(in_pass ? writes_a : load_write[0]),
        .address_a(integrating ? entering[2*BODY*k +: BODY] : ~in_pass ? load_address[BODY-1:0]
                   : phases[0] ? read_a[k] : written_a),
        .in_a(~in_pass ? load_velocity[95:0] : phases[1] ? write_velocity_a[95:0] : write_velocity_a[191:96]),
        .out_a(read_velocities[192*k +: 96]),
        .write_b(in_pass ? writes_b : load_write[1]),
        .address_b(integrating ? entering[2*BODY*k+BODY +: BODY] : ~in_pass ? load_address[2*BODY-1:BODY]
                   : phases[0] ? read_b[k] : written_b),
        .in_b(~in_pass ? load_velocity[191:96] : phases[1] ? write_velocity_b[95:0] : write_velocity_b[191:96]),
        .out_b(read_velocities[192*k+96 +: 96]),
        .write_c(~in_pass & load_write[2]), .address_c(load_address[3*BODY-1:2*BODY]), .in_c(load_velocity[287:192])
      );
    end
  endgenerate

  // ---- Bodies into the integration: the five of a group in three cycles, two solvers side by side

  wire [3:0]   quarters;
  wire         group_valid;
  wire [4:0]   group_live, body_free;
  wire [559:0] body_poses;
  wire [479:0] body_moving;
  wire [79:0]  body_damping;
  wire [2:0]   takes;
  pgs_half_integrator #(.BODY(BODY), .READ_LATENCY(READ_LATENCY)) integrates (
    .clk(clk), .start(clear), .run(integrating), .integrate(integrate), .damping(half_damping),
    .groups(groups), .last_bodies(last_bodies),
    .ready((count[0] >= 6'd2) & (count[1] >= 6'd2) & there[2] & (&room)), .heads(heads), .pop(pose_pops),
    .enters(enters), .takes(takes), .finished(enter_finished), .address(entering), .mass_address(mass_address),
    .velocities(read_velocities), .has_mass(has_mass),
    .phases(quarters), .valid(group_valid), .live(group_live), .poses(body_poses), .moving(body_moving),
    .free(body_free), .body_damping(body_damping)
  );
  localparam LANE = 225;               // pose, velocity, damping, and whether the body falls
  wire [5*LANE-1:0] group_bodies;
  generate
    for (k = 0; k < 5; k = k + 1) begin : g_body
      assign group_bodies[LANE*k +: LANE]
        = {body_free[k], body_damping[16*k +: 16], body_moving[96*k +: 96], body_poses[112*k +: 112]};
    end
  endgenerate
  reg [2*LANE-1:0] lanes;              // bodies 0 and 1, then 2 and 3, then 4; one cycle later
  always @(posedge clk) begin
    lanes <= quarters[0] ? group_bodies[2*LANE-1:0]
           : quarters[1] ? group_bodies[4*LANE-1:2*LANE] : {{LANE{1'b0}}, group_bodies[5*LANE-1:4*LANE]};
  end
  wire [415:0] lane_results;

  // ---- Impulses and a solver, for each collision of a pair

  wire [63:0] solved_impulses [0:1];
  wire [15:0] solved_total [0:1];
  generate
    for (k = 0; k < 2; k = k + 1) begin : g_collision
      wire [63:0] impulses;
      pgs_half_impulses #(
        .COLLISIONS((COLLISIONS + 1) / 2), .COLLISION(COLLISION - 1),
        .ADDRESS_STAGES(ADDRESS_STAGES), .OUTPUT_STAGES(OUTPUT_STAGES)
      ) accumulated (
        .clk(clk), .slot_ends(phases[2]), .begin_pass(clear | begin_pass), .friction(friction),
        .first_of_kind(first_of_kind), .warm(warm), .last_contact(last_contact), .no_contacts(no_contacts),
        .read(reads_impulse[k]), .impulses(impulses),
        .give(warm & valid[k] & phases[1]), .given(rows[64*(14+k) +: 64]),
        .write(ends[k]), .results(solved_impulses[k]), .total(solved_total[k])
      );

      wire [447:0] record = rows[448*k +: 448];
      wire [2:0]   number = points[3*k +: 3];
      wire [3:0]   used   = {number > 3'd3, number > 3'd2, number > 3'd1, number != 3'd0};
      wire [15:0]  per_count = (number == 3'd1) ? 16'h3c00 : (number == 3'd2) ? 16'h3800
                             : (number == 3'd3) ? 16'h3555 : 16'h3400;
      wire [63:0]  mass = masses[64*k +: 64];
      wire         one_static = ~|mass[14:0] | ~|mass[46:32];
      wire [191:0] moving = velocities[192*k +: 192];
      wire         unused_words = &{1'b0, record[63:48], record[127:112], record[191:176]};
      wire [LANE-1:0] body = lanes[LANE*k +: LANE];
      pgs_solver pipeline (
        .clk(clk), .phase(phases), .friction(friction), .integrating(integrating), .solves(~warm),
        .normal(record[47:0]), .position_a(record[111:64]), .position_b(record[175:128]),
        .inverse_mass_a(mass[15:0]), .inverse_inertia_a(mass[31:16]),
        .inverse_mass_b(mass[47:32]), .inverse_inertia_b(mass[63:48]),
        .linear_a(moving[47:0]), .angular_a(moving[95:48]), .linear_b(moving[143:96]), .angular_b(moving[191:144]),
        .per_second(per_second), .drift(half_drift), .coefficient(half_coefficient),
        .per_count(per_count), .one_static(one_static), .coefficient_of_friction(half_friction),
        .spin_damping(half_spin_damping),
        .point0(record[239:192]), .distance0(record[255:240]), .used0(used[0]), .impulse0(impulses[15:0]),
        .point1(record[303:256]), .distance1(record[319:304]), .used1(used[1]), .impulse1(impulses[31:16]),
        .point2(record[367:320]), .distance2(record[383:368]), .used2(used[2]), .impulse2(impulses[47:32]),
        .point3(record[431:384]), .distance3(record[447:432]), .used3(used[3]), .impulse3(impulses[63:48]),
        .out_impulse0(solved_impulses[k][15:0]), .out_impulse1(solved_impulses[k][31:16]),
        .out_impulse2(solved_impulses[k][47:32]), .out_impulse3(solved_impulses[k][63:48]),
        .out_total(solved_total[k]),
        .out_linear_a(solved_a[k][47:0]), .out_angular_a(solved_a[k][95:48]),
        .out_linear_b(solved_b[k][47:0]), .out_angular_b(solved_b[k][95:48]),
        .position(body[47:0]), .orientation(body[111:48]), .linear(body[159:112]), .angular(body[207:160]),
        .damping(body[223:208]), .integrates(integrate), .free(body[224]),
        .time_step(half_time_step), .gravity_step(gravity_step),
        .half_step(half_step), .series(series), .speed_limit(speed_limit),
        .out_position(lane_results[208*k +: 48]), .out_orientation(lane_results[208*k+48 +: 64]),
        .out_linear(lane_results[208*k+112 +: 48]), .out_angular(lane_results[208*k+160 +: 48])
      );
    end
  endgenerate

  // ---- Impulses that go out, and their sum: the first collision in phase 1, the second one in phase 2

  reg  [1:0]   out_ends, out_sends, out_padding;
  reg          out_contact;
  reg  [127:0] out_impulses;
  reg  [31:0]  out_totals;
  always @(posedge clk) if (phases[0]) begin
    out_ends     <= ends & {2{~clear}};
    out_sends    <= ends & write_there & {2{sends & ~clear}};
    out_padding  <= write_padding;
    out_contact  <= ~friction;
    out_impulses <= {solved_impulses[1], solved_impulses[0]};
    out_totals   <= {solved_total[1], solved_total[0]};
  end
  wire         second_out  = phases[2];
  wire         impulse_valid = ~phases[0] & (second_out ? out_sends[1] : out_sends[0]);
  wire         is_padding  = second_out ? out_padding[1] : out_padding[0];
  wire [63:0]  out_words   = second_out ? out_impulses[127:64] : out_impulses[63:0];
  wire [63:0]  out_chosen  = is_padding ? 64'd0 : out_contact ? out_words : {32'd0, out_words[47:16]};
  wire [127:0] impulse_row;
  wire [31:0]  total_wide;
  wire         unused_signs = &{1'b0, total_wide[31]};
  generate
    for (k = 0; k < 4; k = k + 1) begin : g_word
      wire [31:0] wide;
      wire        unused_sign = &{1'b0, wide[31]};
      pgs_half_to_float widened (.half(out_chosen[16*k +: 15]), .number(wide));
      assign impulse_row[32*k +: 32] = {out_chosen[16*k+15], wide[30:0]};
    end
  endgenerate
  wire [15:0] out_total = second_out ? out_totals[31:16] : out_totals[15:0];
  pgs_half_to_float total_widened (.half(out_total[14:0]), .number(total_wide));
  wire        unused_sign = &{1'b0, out_total[15]};
  pgs_impulse_sum impulse_words (
    .clk(clk), .clear(clear),
    .valid(~phases[0] & out_contact & last_contact & ~is_padding & (second_out ? out_ends[1] : out_ends[0])),
    .total(total_wide[30:0]), .sum(impulse_total)
  );

  // ---- Streams out

  // Results of bodies 0 and 1 leave the solvers a cycle and the depth after cycle 0 of their group. All five are in
  // registers four cycles and the depth after it, which is cycle 0 of `result_quarters`.
  localparam AT  = INTEGRATION_DEPTH % 4;
  localparam WAY = (INTEGRATION_DEPTH + 7) / 4;
  wire [3:0]    result_quarters = (quarters >> AT) | (quarters << (4 - AT));
  reg  [1039:0] new_bodies;
  always @(posedge clk) begin
    if (result_quarters[1]) new_bodies[415:0]    <= lane_results;
    if (result_quarters[2]) new_bodies[831:416]  <= lane_results;
    if (result_quarters[3]) new_bodies[1039:832] <= lane_results[207:0];
  end

  reg  [WAY-1:0] valid_groups;
  wire [4:0]     result_live;
  always @(posedge clk) begin
    if (clear) valid_groups <= {WAY{1'b0}};
    else if (quarters[0]) valid_groups <= {valid_groups[WAY-2:0], group_valid};
  end
  pgs_delay #(.WIDTH(5), .SLOTS(WAY)) live_late (
    .clk(clk), .enable(quarters[0]), .d(group_live), .q(result_live)
  );
  wire [2:0]   result_push;
  wire [383:0] result_rows;
  pgs_half_results leaves (
    .clk(clk), .clear(clear), .phases(result_quarters), .valid(valid_groups[WAY-1]), .live(result_live),
    .bodies(new_bodies), .push(result_push), .rows(result_rows)
  );

  wire [31:0] sent [0:2];
  generate
    for (k = 0; k < 3; k = k + 1) begin : g_sender
      localparam integer WIDTH = (k == 2) ? 64 : 128;
      pgs_sender #(.WIDTH(WIDTH), .ADDRESS(10), .SPARE(8)) stream (
        .clk(clk), .clear(clear), .stop(error),
        .rows_of_results((k == 2) ? result_groups : {result_groups[18:0], 1'b0}),
        .enters(takes[k] | ((k == 0) & sends & (begins | (takes_second & early_there[1])))), .has_room(room[k]),
        .push(result_push[k] | ((k == 0) & impulse_valid)), .result(result_push[k]),
        .row(((k == 0) & impulse_valid) ? impulse_row : result_rows[128*k +: 128]),
        .tdata(m_tdata[128*k +: WIDTH]), .tlast(m_tlast[k]), .tvalid(m_tvalid[k]), .tready(m_tready[k]),
        .finished(sender_finished[k]), .sum(sent[k])
      );
    end
  endgenerate
  reg [31:0] sent_low;
  always @(posedge clk) begin
    sent_low <= sent[0] + sent[1];
    sum_sent <= sent_low + sent[2];
  end

  // ---- Errors: the first one stays

  always @(posedge clk) begin
    if (reset) begin
      error <= 1'b0;
    end else if (busy & ~error) begin
      if (|wrong) begin
        error         <= 1'b1;
        error_code    <= wrong[0] ? wrong_code[0] : wrong[1] ? wrong_code[1] : wrong_code[2];
        error_channel <= wrong[0] ? 8'd0 : wrong[1] ? 8'd1 : 8'd2;
        error_detail  <= {11'd0, wrong[0] ? wrong_beat[0] : wrong[1] ? wrong_beat[1] : wrong_beat[2]};
      end else if (load_error) begin
        error         <= 1'b1;
        error_code    <= ERROR_SHAPE_INDEX;
        error_channel <= 8'd0;
        error_detail  <= {12'd0, load_error_body};
      end else if (find_error) begin
        error         <= 1'b1;
        error_code    <= find_error_code;
        error_channel <= 8'd0;
        error_detail  <= {12'd0, find_error_collision};
      end
    end
  end
endmodule

`default_nettype wire
