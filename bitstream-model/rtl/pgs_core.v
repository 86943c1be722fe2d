// The accelerator without its registers: beats in, beats out.
//
//   receivers -> bodies ------------------------------------> velocities <-> solver
//            \-> finder -> issue or queue -> record registers -> solver: contact and friction
//            \-> integrator -> solver: integration -> senders
//
// An issue slot of two cycles carries a collision or nothing, and nothing behind the issue ever
// stops: no pipeline has a clock enable. README.md has the block diagram, the memories and the
// schedule of a step.
`default_nettype none

module pgs_core (
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
  input  wire         pair_friction,
  input  wire         warm_start,
  input  wire         impulses_out,
  input  wire         streamed_masses,
  input  wire         in_order,
  input  wire [31:0]  time_step,
  input  wire [31:0]  drift,
  input  wire [31:0]  coefficient,
  input  wire [31:0]  friction_coefficient,
  input  wire [31:0]  spin_damping,
  input  wire [31:0]  damping,
  input  wire [31:0]  gravity_x,
  input  wire [31:0]  gravity_y,
  input  wire [31:0]  gravity_z,
  input  wire [1:0]   shape_write,
  input  wire [5:0]   shape_address,
  input  wire [31:0]  shape_in,

  input  wire [511:0] s_tdata,
  input  wire [63:0]  s_tkeep,
  input  wire [3:0]   s_tlast,
  input  wire [3:0]   s_tvalid,
  output wire [3:0]   s_tready,
  output wire [511:0] m_tdata,
  output wire [3:0]   m_tlast,
  output wire [3:0]   m_tvalid,
  input  wire [3:0]   m_tready,

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
  localparam OUTPUT_STAGES  = MEMORY_OUTPUT_STAGES;
  localparam READ_LATENCY   = ADDRESS_STAGES + 1 + OUTPUT_STAGES;
  localparam BODY           = BODY_BITS;       // bits of a body's number
  localparam COLLISION      = COLLISION_BITS;  // bits of a collision's number
  localparam SHAPE          = 6;               // bits of a shape's number

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

  wire phase, slot_begins, loading, finding, passing, last_issue, draining, begin_pass, integrating;
  wire friction, first_of_kind, last_contact, parity;
  wire warm, next_warm, sends, next_sends;
  wire [1:0] load_pops;
  wire       load_finished;
  wire issues, stalls, waits, enters, enter_finished;
  wire [3:0] sender_finished;

  pgs_step_sequence #(
    .CONTACT_FILL(CONTACT_FILL), .FRICTION_FILL(FRICTION_FILL), .FINISH(READ_LATENCY + INTEGRATION_DEPTH + 5)
  ) steps (
    .clk(clk), .reset(reset), .start(start), .error(error),
    .collisions(collisions), .contact_passes(contact_passes), .friction_passes(friction_passes),
    .warm_start(warm_start), .impulses_out(impulses_out),
    .loads(|load_pops), .load_finished(load_finished),
    .issues(issues), .stalls(stalls), .waits(waits),
    .enters(enters), .enter_finished(enter_finished), .results_finished(&sender_finished),
    .busy(busy), .done(done), .phases({phase, slot_begins}), .loading(loading), .finding(finding), .passing(passing),
    .last_issue(last_issue), .draining(draining), .begin_pass(begin_pass), .integrating(integrating),
    .friction(friction), .first_of_kind(first_of_kind), .last_contact(last_contact), .parity(parity),
    .warm(warm), .next_warm(next_warm), .sends(sends), .next_sends(next_sends),
    .cycles(cycles), .work_cycles(work_cycles), .wait_cycles(wait_cycles)
  );

  wire [31:0] per_second, speed_limit, half_step, half_angle_limit, series;
  wire [95:0] gravity_step;
  pgs_constants #(.SMALLEST_NORMAL(DESIGN_SMALLEST_NORMAL)) numbers (
    .clk(clk), .start(start), .time_step(time_step),
    .gravity_x(gravity_x), .gravity_y(gravity_y), .gravity_z(gravity_z),
    .per_second(per_second), .speed_limit(speed_limit), .half_step(half_step),
    .half_angle_limit(half_angle_limit), .series(series),
    .gravity_step(gravity_step)
  );

  // ---- Streams in

  wire [255:0] body_pose;
  wire [127:0] head [0:3];
  wire [5:0]   count [0:3];
  wire [3:0]   there;                  // a beat in the FIFO
  wire [31:0]  received [0:3];
  wire [20:0]  wrong_beat [0:3];
  wire [7:0]   wrong_code [0:3];
  wire [3:0]   pop, wrong, comes, collision_begins;
  wire [1:0]   place [0:3];
  genvar k;
  generate
    for (k = 0; k < 4; k = k + 1) begin : g_receiver
      // The beats of a body are dealt to the four streams in turn: two a body, and four for a velocity with world
      // inertia. Of the seven beats of a collision, streams 0, 1 and 2 carry two, and stream 3 carries one. In a
      // warm pass stream 3 carries a second one, the impulses.
      localparam integer OFFSET = 3 - k;
      reg [20:0] body_beats;
      always @(posedge clk) body_beats <= ({bodies, 1'b0} + OFFSET[20:0]) >> 2;
      pgs_receiver #(.GROUP(2)) stream (
        .clk(clk), .stop(reset | error), .start(start), .clear(clear),
        .velocity_beats((DESIGN_WORLD_INERTIA != 0) ? {1'b0, bodies} : body_beats), .pose_beats(body_beats),
        .pass_beats((k == 3) ? {1'b0, collisions} : {collisions, 1'b0}), .warm_beats({collisions, 1'b0}),
        .passes(passes), .friction_passes(friction_passes), .warm_start(warm_start),
        .tdata(s_tdata[128*k +: 128]), .tkeep(s_tkeep[16*k +: 16]), .tlast(s_tlast[k]),
        .tvalid(s_tvalid[k]), .tready(s_tready[k]),
        .head(head[k]), .count(count[k]), .there(there[k]), .pop(pop[k]), .comes(comes[k]), .place(place[k]),
        .sum(received[k]), .error(wrong[k]), .error_code(wrong_code[k]), .error_beat(wrong_beat[k])
      );
      assign collision_begins[k] = comes[k] & (place[k] == 2'd0);
    end
  endgenerate
  reg [31:0] received_low, received_high;
  always @(posedge clk) begin
    received_low  <= received[0] + received[1];
    received_high <= received[2] + received[3];
    sum_received  <= received_low + received_high;
  end

  // ---- Load, and the mass properties of the bodies

  localparam PROPERTIES = (DESIGN_WORLD_INERTIA != 0) ? 224 : 64;   // bits of a body's mass and inertia
  wire [1:0]            load_write;
  wire [BODY-1:0]       load_address_a, load_address_b;
  wire [191:0]          load_velocity_a, load_velocity_b;
  wire                  load_error;
  wire [19:0]           load_error_body;
  wire [BODY-1:0]       next_a, next_b, entering;
  wire [PROPERTIES-1:0] properties_a, properties_b;
  wire                  has_mass_a, has_mass_b;
  pgs_bodies #(
    .WORLD_INERTIA(DESIGN_WORLD_INERTIA), .BODIES(BODIES), .BODY(BODY), .SHAPE(SHAPE), .PROPERTIES(PROPERTIES)
  ) loaded (
    .clk(clk), .clear(clear), .table_write(shape_write), .table_address(shape_address), .table_in(shape_in),
    .loading(loading), .finding(finding), .integrating(integrating),
    .bodies(bodies), .kinematic(kinematic), .streamed_masses(streamed_masses),
    .there(there), .head({head[3], head[2], head[1], head[0]}), .loads(load_pops), .finished(load_finished),
    .write(load_write), .write_address_a(load_address_a), .write_address_b(load_address_b),
    .velocity_a(load_velocity_a), .velocity_b(load_velocity_b), .error(load_error), .error_body(load_error_body),
    .found_a(next_a), .found_b(next_b), .entering(entering),
    .properties_a(properties_a), .moves_a(has_mass_a), .properties_b(properties_b), .moves_b(has_mass_b)
  );

  // ---- Collisions: found, issued, registered

  // The beats and the found facts of a collision, for the two cycles of its slot. Cycle 0 of a
  // pipeline is the first of them. The first of both registers takes whatever is there in a slot, and
  // `second` tells whether that is a collision. Row 7, the given impulses, means something in a warm pass alone.
  reg  [511:0]    early;               // rows 0 to 3
  reg  [1023:0]   rows;                // rows 0 to 7
  reg             valid;
  reg  [BODY-1:0] early_a, early_b, body_a, body_b;
  reg             early_moves_a, early_moves_b, moves_a, moves_b;
  reg  [PROPERTIES-1:0] early_mass_a, early_mass_b, mass_a, mass_b;
  reg  [2:0]      early_points, points;
  reg  [31:0]     friction_of;         // coefficient of the collision
  wire            ends;                // results are there
  wire [3:0]      room;                // for a row of each stream out
  reg             second;              // a collision was issued in the cycle before
  wire            unused = &{1'b0, collision_begins[3], body_pose[127:96], rows[127:96], rows[255:224], rows[383:352]};

  wire               found;
  wire [COLLISION:0] last_use_a, last_use_b;
  wire [BODY-1:0]    found_a, found_b;
  wire               found_moves_a, found_moves_b;
  wire [PROPERTIES-1:0] found_mass_a, found_mass_b;
  wire [2:0]         found_points;
  // Of the issue queue.
  wire               has_slot, take, comes_s1, moves_a_s3, moves_b_s3;
  wire [BODY-1:0]    a_s1, b_s1, a_s3, b_s3;
  wire [COLLISION:0] use_a_s2, use_b_s2, use_of_body;
  wire [2:0]         points_s3;
  wire [COLLISION-1:0] collision_s3;
  reg                queued;           // the step goes through it
  always @(posedge clk) queued <= (QUEUE_DEPTH != 0) & ~in_order;

  wire               find_error;
  wire [7:0]         find_error_code;
  wire [19:0]        find_error_collision;
  pgs_finder #(.BODIES(BODIES), .BODY(BODY), .COLLISION(COLLISION), .PROPERTIES(PROPERTIES)) find (
    .clk(clk), .clear(clear), .run(finding), .phase(phase), .bodies(bodies), .collisions(collisions),
    .pair_friction(pair_friction),
    .count_comes(collision_begins[0]), .count_word(s_tdata[127:96]),
    .body_a_comes(collision_begins[1]), .body_a_word(s_tdata[255:224]),
    .body_b_comes(collision_begins[2]), .body_b_word(s_tdata[383:352]),
    .load_a(load_write[0]), .load_address_a(load_address_a),
    .load_b(load_write[1]), .load_address_b(load_address_b),
    .next_body_a(next_a), .next_body_b(next_b),
    .properties_a(properties_a), .properties_b(properties_b), .has_mass_a(has_mass_a), .has_mass_b(has_mass_b),
    .queued(queued), .pass_ends(issues & last_issue), .has_slot(has_slot), .take(take), .comes_s1(comes_s1),
    .comes_a_s1(a_s1), .comes_b_s1(b_s1), .use_a_s2(use_a_s2), .use_b_s2(use_b_s2),
    .moves_a_s3(moves_a_s3), .moves_b_s3(moves_b_s3), .points_s3(points_s3), .body_a_s3(a_s3), .body_b_s3(b_s3),
    .collision_s3(collision_s3),
    .uses_a(queued & ~phase & valid & moves_a), .uses_b(queued & ~phase & valid & moves_b),
    .used_a(body_a), .used_b(body_b), .used_in(use_of_body),
    .pop(issues & ~queued), .found(found), .last_use_a(last_use_a), .last_use_b(last_use_b),
    .body_a(found_a), .body_b(found_b), .moves_a(found_moves_a), .moves_b(found_moves_b),
    .mass_a(found_mass_a), .mass_b(found_mass_b), .points(found_points),
    .error(find_error), .error_code(find_error_code), .error_collision(find_error_collision)
  );

  wire loads, loads_rest;              // into the queue
  wire takes_first = queued ? loads : issues;
  wire takes_rest  = queued ? loads_rest : second;
  // In the cycle before its first beats are taken the second ones of the collision before may still be in the FIFOs.
  wire [5:0] beats_needed = takes_rest ? 6'd3 : 6'd2;
  wire beats_there = (count[0] >= beats_needed) & (count[1] >= beats_needed) & (count[2] >= beats_needed)
                   & (next_warm ? count[3] >= beats_needed : there[3]);
  wire         in_order_issues, in_order_stalls, in_order_waits;
  wire [31:0]  in_order_hazards;
  pgs_issue #(
    .COLLISION(COLLISION), .INTERLOCKED(DESIGN_INTERLOCKED),
    .CONTACT_WINDOW(CONTACT_WINDOW), .FRICTION_WINDOW(FRICTION_WINDOW)
  ) issuer (
    .clk(clk), .clear(clear), .phase(phase), .passing(passing & ~queued), .draining(draining),
    .friction(friction), .parity(parity), .streams_ready(beats_there & (room[0] | ~next_sends)), .found(found),
    .last_use_a(last_use_a), .last_use_b(last_use_b), .moves_a(found_moves_a), .moves_b(found_moves_b),
    .issues(in_order_issues), .stalls(in_order_stalls), .waits(in_order_waits), .hazards(in_order_hazards)
  );

  // What issues, in its cycle; the second rows in the next one.
  localparam FACTS = COLLISION + 2 * BODY + 2 + 2 * PROPERTIES + 3;
  wire [511:0]         heads = {head[3], head[2], head[1], head[0]};
  wire [511:0]         first_rows, rest_rows;
  wire [BODY-1:0]      issue_a, issue_b;
  wire                 issue_moves_a, issue_moves_b;
  wire [PROPERTIES-1:0] issue_mass_a, issue_mass_b;
  wire [2:0]           issue_points;
  wire [COLLISION-1:0] issue_number;
  wire                 numbers_follow, numbers_valid;
  wire [127:0]         numbers_row;
  generate
    if (QUEUE_DEPTH != 0) begin : g_queue
      wire         queue_issues, queue_stalls, queue_waits;
      wire [31:0]  queue_hazards;
      wire [511:0] queue_first, queue_rest;
      wire [FACTS-1:0] facts;
      pgs_queue #(
        .DEPTH(QUEUE_DEPTH), .SLOTS(QUEUE_SLOTS), .SLOT(QUEUE_SLOT_BITS), .BODY(BODY), .COLLISION(COLLISION),
        .WINDOW(QUEUE_WINDOW), .PATIENCE(QUEUE_PATIENCE * QUEUE_WINDOW), .FACTS(FACTS)
      ) waiting (
        .clk(clk), .clear(clear), .phase(phase), .passing(passing & queued), .parity(parity),
        .collisions(collisions),
        .has_slot(has_slot), .take(take & queued), .comes_s1(comes_s1), .a_s1(a_s1), .b_s1(b_s1),
        .use_a_s2(use_a_s2), .use_b_s2(use_b_s2), .moves_a_s3(moves_a_s3), .moves_b_s3(moves_b_s3),
        .facts_s3({collision_s3, a_s3, b_s3, moves_a_s3, moves_b_s3, properties_a, properties_b, points_s3}),
        .beats_there(beats_there), .beats(heads), .loads(loads), .loads_rest(loads_rest),
        .has_room(room[0] | ~next_sends), .issues(queue_issues), .stalls(queue_stalls), .waits(queue_waits),
        .hazards(queue_hazards), .first(queue_first), .rest(queue_rest), .facts(facts),
        .early_a(early_a), .early_b(early_b), .early_moves_a(early_moves_a & second),
        .early_moves_b(early_moves_b & second), .body_a(body_a), .body_b(body_b),
        .body_moves_a(moves_a), .body_moves_b(moves_b), .use_of_body(use_of_body)
      );
      pgs_issue_numbers #(.COLLISION(COLLISION)) order_sent (
        .clk(clk), .clear(clear), .issues(queue_issues & sends), .number(issue_number), .last(last_issue),
        .follows(numbers_follow), .ends(ends & sends & queued), .valid(numbers_valid), .beat(numbers_row)
      );
      assign {issues, stalls, waits, hazards} = queued
        ? {queue_issues, queue_stalls, queue_waits, queue_hazards}
        : {in_order_issues, in_order_stalls, in_order_waits, in_order_hazards};
      assign first_rows = queued ? queue_first : heads;
      assign rest_rows  = queued ? queue_rest : heads;
      assign {issue_number, issue_a, issue_b, issue_moves_a, issue_moves_b, issue_mass_a, issue_mass_b, issue_points}
        = queued ? facts : {{COLLISION{1'b0}}, found_a, found_b, found_moves_a, found_moves_b,
                            found_mass_a, found_mass_b, found_points};
    end else begin : g_no_queue
      wire unused_of_queue = &{1'b0, take, comes_s1, a_s1, b_s1, use_a_s2, use_b_s2, moves_a_s3, moves_b_s3, a_s3, b_s3,
                       points_s3, collision_s3, issue_number, numbers_row, last_issue};
      assign {has_slot, loads, loads_rest, numbers_follow, numbers_valid} = 5'd0;
      assign use_of_body  = {(COLLISION+1){1'b0}};
      assign issue_number = {COLLISION{1'b0}};
      assign numbers_row  = 128'd0;
      assign {issues, stalls, waits, hazards} = {in_order_issues, in_order_stalls, in_order_waits, in_order_hazards};
      assign {first_rows, rest_rows} = {heads, heads};
      assign {issue_a, issue_b, issue_moves_a, issue_moves_b} = {found_a, found_b, found_moves_a, found_moves_b};
      assign {issue_mass_a, issue_mass_b, issue_points}       = {found_mass_a, found_mass_b, found_points};
    end
  endgenerate

  // Each of these is there in its own part of the step only.
  wire pop_even, pop_odd;              // pairs of streams, to the integration
  assign pop = {{2{load_pops[1] | pop_odd}}, {2{load_pops[0] | pop_even}}}
             | {takes_first | (takes_rest & next_warm), {3{takes_first | takes_rest}}};

  // What has issued moves on.
  wire [31:0]     own_friction;
  pgs_half_to_float widened (.half(early[126:112]), .number(own_friction));
  always @(posedge clk) begin
    second <= issues & ~clear;
    if (slot_begins) begin
      {early_a, early_b, early_moves_a, early_moves_b} <= {issue_a, issue_b, issue_moves_a, issue_moves_b};
      {early_mass_a, early_mass_b, early_points}       <= {issue_mass_a, issue_mass_b, issue_points};
    end
    if (phase) begin
      valid <= second & ~clear;
      friction_of              <= pair_friction ? own_friction : friction_coefficient;
      {body_a, body_b}         <= {early_a, early_b};
      {moves_a, moves_b}       <= {early_moves_a & second, early_moves_b & second};
      {mass_a, mass_b, points} <= {early_mass_a, early_mass_b, early_points};
    end
    if (clear) valid <= 1'b0;
  end
  // One register enables no more than 1,200 bits, so that the rows have copies of both.
  (* keep = "true" *) reg slot_of_rows, phase_of_rows;
  always @(posedge clk) begin
    slot_of_rows  <= phase;
    phase_of_rows <= slot_begins;
    if (slot_of_rows) early <= first_rows;
    if (phase_of_rows) rows <= {rest_rows, early};
  end

  wire [3:0] used = {points > 3'd3, points > 3'd2, points > 3'd1, points != 3'd0};
  wire [31:0] per_count = (points == 3'd1) ? 32'h3f800000 : (points == 3'd2) ? 32'h3f000000
                        : (points == 3'd3) ? 32'h3eaaaaab : 32'h3e800000;
  // A mass below the smallest normal number moves but counts as 0 in arithmetic.
  wire one_static = ~|mass_a[30:23] | ~|mass_b[30:23];

  // ---- Times of a collision in the pipelines, in slots after its cycle 0

  localparam LONGEST = ((CONTACT_DEPTH > FRICTION_DEPTH) ? CONTACT_DEPTH : FRICTION_DEPTH) / 2;
  reg [LONGEST-1:0] slots;             // valid records, one bit a slot
  always @(posedge clk) begin
    if (clear) slots <= {LONGEST{1'b0}};
    else if (slot_begins) slots <= {slots[LONGEST-2:0], valid};
  end
  wire contact_ends  = ~friction & slots[CONTACT_DEPTH/2 - 1];
  wire friction_ends = friction & slots[FRICTION_DEPTH/2 - 1];
  assign ends        = slot_begins & (contact_ends | friction_ends);
  wire reads_impulse = slot_begins & (friction ? slots[(FRICTION_IMPULSES - READ_LATENCY)/2 - 1]
                                          : slots[(CONTACT_IMPULSES - READ_LATENCY)/2 - 1]);

  wire [BODY-1:0] contact_read_a, contact_read_b, friction_read_a, friction_read_b;
  wire [BODY-1:0] contact_write_a, contact_write_b, friction_write_a, friction_write_b;
  wire            contact_moves_a, contact_moves_b, friction_moves_a, friction_moves_b;
  wire            contact_padding;
  pgs_delay #(.WIDTH(2*BODY), .SLOTS((CONTACT_VELOCITIES - READ_LATENCY)/2)) contact_reads (
    .clk(clk), .enable(slot_begins), .d({body_a, body_b}), .q({contact_read_a, contact_read_b})
  );
  pgs_delay #(.WIDTH(2*BODY), .SLOTS((FRICTION_VELOCITIES - READ_LATENCY)/2)) friction_reads (
    .clk(clk), .enable(slot_begins), .d({body_a, body_b}), .q({friction_read_a, friction_read_b})
  );
  pgs_delay #(.WIDTH(2*BODY + 3), .SLOTS(CONTACT_DEPTH/2)) contact_writes (
    .clk(clk), .enable(slot_begins), .d({body_a, body_b, moves_a, moves_b, points == 3'd0}),
    .q({contact_write_a, contact_write_b, contact_moves_a, contact_moves_b, contact_padding})
  );
  pgs_delay #(.WIDTH(2*BODY + 2), .SLOTS(FRICTION_DEPTH/2)) friction_writes (
    .clk(clk), .enable(slot_begins), .d({body_a, body_b, moves_a, moves_b}),
    .q({friction_write_a, friction_write_b, friction_moves_a, friction_moves_b})
  );

  // ---- Velocities: in a pass port A is body A's and port B body B's; reads in phase 0, writes in
  // phase 1, so that no address is read while it is written

  wire [191:0] velocity_a, velocity_b;
  wire [191:0] solved_velocity_a, solved_velocity_b;
  reg          write_a, write_b;
  reg  [BODY-1:0] write_address_a, write_address_b;
  reg  [191:0] write_velocity_a, write_velocity_b;
  always @(posedge clk) begin
    write_a          <= ~clear & ends & (friction ? friction_moves_a : contact_moves_a);
    write_b          <= ~clear & ends & (friction ? friction_moves_b : contact_moves_b);
    write_address_a  <= friction ? friction_write_a : contact_write_a;
    write_address_b  <= friction ? friction_write_b : contact_write_b;
    write_velocity_a <= solved_velocity_a;
    write_velocity_b <= solved_velocity_b;
  end
  wire in_pass = passing | draining;
  pgs_true_dual_port #(
    .WIDTH(192), .DEPTH(BODIES), .ADDRESS(BODY),
    .ADDRESS_STAGES(ADDRESS_STAGES), .OUTPUT_STAGES(OUTPUT_STAGES)
  ) velocities (
    .clk(clk),
    .write_a(in_pass ? write_a : load_write[0]),
    .address_a(integrating ? entering : ~in_pass ? load_address_a
               : phase ? write_address_a : friction ? friction_read_a : contact_read_a),
    .in_a(in_pass ? write_velocity_a : load_velocity_a), .out_a(velocity_a),
    .write_b(in_pass ? write_b : load_write[1]),
    .address_b(~in_pass ? load_address_b
               : phase ? write_address_b : friction ? friction_read_b : contact_read_b),
    .in_b(in_pass ? write_velocity_b : load_velocity_b), .out_b(velocity_b)
  );

  // ---- Impulses

  wire [31:0]  impulse0, impulse1, impulse2, impulse3;
  wire [127:0] solved_impulses;        // L_3 .. L_0; in a friction pass G_1 and G_0 in the middle
  wire [31:0]  contact_total;
  pgs_impulses #(
    .COLLISIONS(COLLISIONS), .COLLISION(COLLISION),
    .ADDRESS_STAGES(ADDRESS_STAGES), .OUTPUT_STAGES(OUTPUT_STAGES)
  ) accumulated (
    .clk(clk), .begin_pass(clear | begin_pass), .friction(friction), .first_of_kind(first_of_kind),
    .warm(warm), .give(warm & valid & phase), .given(rows[1023:896]),
    .last_contact(last_contact), .no_contacts(no_contacts), .read(reads_impulse),
    .impulse0(impulse0), .impulse1(impulse1), .impulse2(impulse2), .impulse3(impulse3),
    .write(ends), .solved(solved_impulses), .contact_total(contact_total)
  );
  pgs_impulse_sum impulse_words (
    .clk(clk), .clear(clear), .valid(ends & contact_ends & last_contact & ~contact_padding),
    .total(contact_total[30:0]), .sum(impulse_total)
  );

  // ---- Bodies into the integration

  wire         body_valid, body_free;
  wire [31:0]  body_damping;
  pgs_integrator #(.BODY(BODY), .READ_LATENCY(READ_LATENCY)) integrates (
    .clk(clk), .start(clear), .run(integrating), .integrate(integrate), .damping(damping),
    .bodies(bodies), .room(&room),
    .even_there(there[0] & there[1]), .even_pose({head[1], head[0]}),
    .odd_there(there[2] & there[3]), .odd_pose({head[3], head[2]}),
    .pop_even(pop_even), .pop_odd(pop_odd), .enters(enters), .finished(enter_finished),
    .address(entering), .has_mass(has_mass_a),
    .valid(body_valid), .pose(body_pose), .free(body_free), .body_damping(body_damping)
  );

  // ---- Contact passes, friction passes and the integration

  wire [95:0]  new_position, new_linear, new_angular;
  wire [127:0] new_orientation;
  pgs_solver solver (
    .clk(clk), .phase({phase, slot_begins}), .friction(friction), .integrating(integrating), .solves(~warm),
    .normal(rows[95:0]), .position_a(rows[223:128]), .position_b(rows[351:256]),
    .inverse_mass_a(mass_a[31:0]), .inverse_inertia_a(mass_a[PROPERTIES-1:32]),
    .inverse_mass_b(mass_b[31:0]), .inverse_inertia_b(mass_b[PROPERTIES-1:32]),
    .linear_a(velocity_a[95:0]), .angular_a(velocity_a[191:96]),
    .linear_b(velocity_b[95:0]), .angular_b(velocity_b[191:96]),
    .per_second(per_second), .drift(drift), .coefficient(coefficient),
    .per_count(per_count), .one_static(one_static), .coefficient_of_friction(friction_of),
    .spin_damping(spin_damping),
    .point0(rows[479:384]), .distance0(rows[511:480]), .used0(used[0]), .impulse0(impulse0),
    .point1(rows[607:512]), .distance1(rows[639:608]), .used1(used[1]), .impulse1(impulse1),
    .point2(rows[735:640]), .distance2(rows[767:736]), .used2(used[2]), .impulse2(impulse2),
    .point3(rows[863:768]), .distance3(rows[895:864]), .used3(used[3]), .impulse3(impulse3),
    .out_impulse0(solved_impulses[31:0]), .out_impulse1(solved_impulses[63:32]),
    .out_impulse2(solved_impulses[95:64]), .out_impulse3(solved_impulses[127:96]),
    .out_total(contact_total),
    .out_linear_a(solved_velocity_a[95:0]), .out_angular_a(solved_velocity_a[191:96]),
    .out_linear_b(solved_velocity_b[95:0]), .out_angular_b(solved_velocity_b[191:96]),
    .position(body_pose[95:0]), .orientation(body_pose[255:128]),
    .linear(velocity_a[95:0]), .angular(velocity_a[191:96]), .damping(body_damping),
    .integrates(integrate), .free(body_free),
    .time_step(time_step), .gravity_step(gravity_step),
    .half_step(half_step), .series(series), .speed_limit(speed_limit), .half_angle_limit(half_angle_limit),
    .out_position(new_position), .out_orientation(new_orientation),
    .out_linear(new_linear), .out_angular(new_angular)
  );

  // ---- Streams out

  wire result_valid;
  pgs_timed_flag #(.STAGES(INTEGRATION_DEPTH)) result_time (
    .clk(clk), .clear(clear), .d(body_valid), .q(result_valid)
  );
  wire [127:0] result [0:3];
  wire [31:0]  sent [0:3];
  // After the last pass of a kind the impulses of each collision, in front of the results; among them the numbers
  // of the collisions that a queue has issued.
  reg          impulse_valid;
  reg  [127:0] impulse_row;
  always @(posedge clk) begin
    impulse_valid <= ends & sends & ~clear;
    impulse_row   <= friction ? {64'd0, solved_impulses[95:32]} : solved_impulses;
  end
  assign result[0] = impulse_valid ? impulse_row : numbers_valid ? numbers_row : {32'd0, new_position};
  assign result[1] = new_orientation;
  assign result[2] = {32'd0, new_linear};
  assign result[3] = {32'd0, new_angular};
  generate
    for (k = 0; k < 4; k = k + 1) begin : g_sender
      pgs_sender #(.ADDRESS(10)) stream (
        .clk(clk), .clear(clear), .stop(error), .rows_of_results(bodies),
        .enters(enters | ((k == 0) & ((issues & sends) | numbers_follow))), .has_room(room[k]),
        .push(result_valid | ((k == 0) & (impulse_valid | numbers_valid))), .result(result_valid), .row(result[k]),
        .tdata(m_tdata[128*k +: 128]), .tlast(m_tlast[k]), .tvalid(m_tvalid[k]), .tready(m_tready[k]),
        .finished(sender_finished[k]), .sum(sent[k])
      );
    end
  endgenerate
  reg [31:0] sent_low, sent_high;
  always @(posedge clk) begin
    sent_low  <= sent[0] + sent[1];
    sent_high <= sent[2] + sent[3];
    sum_sent  <= sent_low + sent_high;
  end

  // ---- Errors: the first one stays

  always @(posedge clk) begin
    if (reset) begin
      error <= 1'b0;
    end else if (busy & ~error) begin
      if (|wrong) begin
        error         <= 1'b1;
        error_code    <= wrong[0] ? wrong_code[0] : wrong[1] ? wrong_code[1] : wrong[2] ? wrong_code[2] : wrong_code[3];
        error_channel <= wrong[0] ? 8'd0 : wrong[1] ? 8'd1 : wrong[2] ? 8'd2 : 8'd3;
        error_detail  <= {11'd0, wrong[0] ? wrong_beat[0] : wrong[1] ? wrong_beat[1] : wrong[2] ? wrong_beat[2] : wrong_beat[3]};
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
