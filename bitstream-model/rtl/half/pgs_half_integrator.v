// Lets the bodies into the integration in groups of five, a group every four cycles: as fast as the streams take the
// results. Each body of a group has a pipeline of its own.
//
//   cycle of a group
//   0          beats of bodies 0, 2, 4; velocities of bodies 0 to 3, masses of 0 and 1
//   1          beats of bodies 1, 3;    velocity of body 4,         masses of 2 and 3
//   2                                                               mass of 4
//   4 x SLOTS  cycle 0 of the pipelines
`default_nettype none

module pgs_half_integrator #(
  parameter integer BODY         = 16,
  parameter integer READ_LATENCY = 6     // of the velocities, with the register that holds them; the masses take 3
) (
  input  wire              clk,
  input  wire              start,
  input  wire              run,
  input  wire              integrate,    // 0: all bodies keep their state
  input  wire [15:0]       damping,
  input  wire [19:0]       groups,
  input  wire [2:0]        last_bodies,  // of the last group

  input  wire              ready,        // the beats of a group, and room in all senders
  input  wire [383:0]      heads,
  output wire [2:0]        pop,

  output wire              enters,       // the cycles of a group: four, and two of a last one of one or two bodies
  output wire [2:0]        takes,        // a place in each sender
  output reg               finished,     // all groups have entered
  output wire [4*BODY-1:0] address,      // of velocities
  output wire [2*BODY-1:0] mass_address,
  input  wire [383:0]      velocities,   // one cycle before READ_LATENCY after the address
  input  wire [1:0]        has_mass,     // 3 cycles after the address

  // Of the five bodies, from cycle 0 of the pipelines on for four cycles.
  output reg  [3:0]        phases,
  output wire              valid,
  output wire [4:0]        live,         // of the group
  output wire [559:0]      poses,        // position and orientation
  output reg  [479:0]      moving,       // linear and angular velocity
  output reg  [4:0]        free,         // the body has a mass, and is integrated
  output reg  [79:0]       body_damping  // of its spin: 1 without a mass
);
  localparam SLOTS = (READ_LATENCY + 4) / 4;
  localparam [15:0] ONE = 16'h3c00;

  reg  [19:0]       left;
  reg               is_last, is_short, only, only_short;
  reg  [5*BODY-1:0] body;                // numbers of the five bodies of the next group
  reg               under_way;           // cycles 1 to 3 of a group
  wire              begins = run & ~finished & phases[0] & ready;
  wire              over   = is_last & is_short;
  wire [4:0]        bodies_live = is_last ? ~(5'h1f << last_bodies) : 5'h1f;
  assign enters = begins | (under_way & ~finished);
  assign takes  = {enters & (phases[0] | phases[2]), enters, enters};
  wire              second = under_way & phases[1];
  assign pop = {begins, begins | second, begins | second};

  // Cycles since a group has begun: bit k is cycle k + 1.
  localparam CYCLES = 4 * SLOTS;
  reg [CYCLES-1:0]  since;
  reg [SLOTS-1:0]   valid_slots;
  assign valid = valid_slots[SLOTS-1];

  assign address = second ? {body[4*BODY-1:BODY], body[5*BODY-1:4*BODY]} : body[4*BODY-1:0];
  assign mass_address = (phases[2]) ? {body[2*BODY-1:BODY], body[5*BODY-1:4*BODY]}
                      : second ? body[4*BODY-1:2*BODY] : body[2*BODY-1:0];

  integer i;
  always @(posedge clk) begin
    only       <= groups == 20'd1;
    only_short <= last_bodies < 3'd3;
    phases     <= run ? {phases[2:0], phases[3]} : 4'b0001;
    since      <= {since[CYCLES-2:0], begins} & {CYCLES{~start}};
    if (start) begin
      left        <= groups;
      is_last     <= only;
      is_short    <= only_short;
      finished    <= 1'b0;
      under_way   <= 1'b0;
      valid_slots <= {SLOTS{1'b0}};
      for (i = 0; i < 5; i = i + 1) body[BODY*i +: BODY] <= i[BODY-1:0];
    end else begin
      if (begins) under_way <= 1'b1;
      else if (phases[3]) under_way <= 1'b0;
      if (enters & is_last & (phases[3] | (phases[1] & over))) finished <= 1'b1;
      if (under_way & phases[3]) begin
        left    <= left - 20'd1;
        is_last <= left == 20'd2;
        for (i = 0; i < 5; i = i + 1) body[BODY*i +: BODY] <= body[BODY*i +: BODY] + 5;
      end
      if (phases[3]) valid_slots <= {valid_slots[SLOTS-2:0], under_way};
    end
  end

  // The poses of a group wait for its velocities.
  reg [559:0] pose;
  wire [111:0] poses_in [0:2];
  wire [2:0]   unused_words;
  genvar k;
  generate
    for (k = 0; k < 3; k = k + 1) begin : g_stream
      assign poses_in[k]     = {heads[128*k+64 +: 64], heads[128*k +: 48]};
      assign unused_words[k] = &heads[128*k+48 +: 16];
    end
  endgenerate
  wire unused = &{1'b0, unused_words};
  always @(posedge clk) begin
    if (begins) {pose[559:448], pose[335:224], pose[111:0]} <= {poses_in[2], poses_in[1], poses_in[0]};
    if (second) {pose[447:336], pose[223:112]} <= {poses_in[1], poses_in[0]};
  end
  pgs_delay #(.WIDTH(565), .SLOTS(SLOTS)) poses_late (
    .clk(clk), .enable(phases[3]), .d({bodies_live, pose}), .q({live, poses})
  );

  reg [479:0] velocity;
  reg [4:0]   mass;
  always @(posedge clk) begin
    if (since[READ_LATENCY-2]) velocity[383:0]   <= velocities;
    if (since[READ_LATENCY-1]) velocity[479:384] <= velocities[95:0];
    if (since[2]) mass[1:0] <= has_mass;
    if (since[3]) mass[3:2] <= has_mass;
    if (since[4]) mass[4]   <= has_mass[0];
    if (since[CYCLES-2]) begin
      moving <= velocity;
      free   <= mass & {5{integrate}};
      for (i = 0; i < 5; i = i + 1) body_damping[16*i +: 16] <= mass[i] ? damping : ONE;
    end
  end
endmodule

`default_nettype wire
