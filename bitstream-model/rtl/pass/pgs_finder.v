// Looks up, for each collision before it may be issued, the mass properties of its bodies and the
// last collision before it that used one of them; and refuses a collision that no pass can carry out.
//
// The finder runs ahead of the issue, in the order of the records and without waiting. A memory
// holds for each body {parity of the pass, number of the collision} of its last use: read in a cycle
// with phase 1, written in the next one. A use in an earlier pass has the other parity, and so has
// the value that the load writes: neither is a hazard.
//
// In a step through the issue queue a collision is taken while the queue has a slot for it, and not before
// its pass, and the last uses are the queue's: written as collisions issue.
`default_nettype none

module pgs_finder #(
  parameter integer BODIES    = 40960,
  parameter integer BODY      = 16,
  parameter integer COLLISION = 17,
  parameter integer PROPERTIES = 64                  // bits of a body's mass and inertia
) (
  input  wire                 clk,
  input  wire                 clear,
  input  wire                 run,
  input  wire                 phase,         // 1 in every second cycle
  input  wire [19:0]          bodies,
  input  wire [19:0]          collisions,
  input  wire                 pair_friction, // a friction is above the contact count

  // The first beats of a collision, as they enter the accelerator.
  input  wire                 count_comes,
  input  wire [31:0]          count_word,
  input  wire                 body_a_comes,
  input  wire [31:0]          body_a_word,
  input  wire                 body_b_comes,
  input  wire [31:0]          body_b_word,

  // The load clears the last uses.
  input  wire                 load_a,
  input  wire [BODY-1:0]      load_address_a,
  input  wire                 load_b,
  input  wire [BODY-1:0]      load_address_b,

  // Properties of the bodies, 3 cycles after their numbers.
  output wire [BODY-1:0]      next_body_a,
  output wire [BODY-1:0]      next_body_b,
  input  wire [PROPERTIES-1:0] properties_a,
  input  wire [PROPERTIES-1:0] properties_b,
  input  wire                 has_mass_a,
  input  wire                 has_mass_b,

  // The issue queue: a collision is taken, and 1, 2 and 3 cycles later; a use that it writes while the phase is 0.
  input  wire                 queued,        // the step goes through it
  input  wire                 pass_ends,     // its last collision issues
  input  wire                 has_slot,
  output wire                 take,
  output wire                 comes_s1,
  output wire [BODY-1:0]      comes_a_s1,
  output wire [BODY-1:0]      comes_b_s1,
  output wire [COLLISION:0]   use_a_s2,
  output wire [COLLISION:0]   use_b_s2,
  output wire                 moves_a_s3,
  output wire                 moves_b_s3,
  output wire [2:0]           points_s3,
  output wire [BODY-1:0]      body_a_s3,
  output wire [BODY-1:0]      body_b_s3,
  output wire [COLLISION-1:0] collision_s3,
  input  wire                 uses_a,
  input  wire                 uses_b,
  input  wire [BODY-1:0]      used_a,
  input  wire [BODY-1:0]      used_b,
  input  wire [COLLISION:0]   used_in,

  // The collision that is issued next, in the order of the records.
  input  wire                 pop,
  output wire                 found,         // a collision waits for its issue
  output wire [COLLISION:0]   last_use_a,    // {parity, collision}
  output wire [COLLISION:0]   last_use_b,
  output wire [BODY-1:0]      body_a,
  output wire [BODY-1:0]      body_b,
  output wire                 moves_a,       // hazards and write-backs; 0 for padding
  output wire                 moves_b,
  output wire [PROPERTIES-1:0] mass_a,
  output wire [PROPERTIES-1:0] mass_b,
  output wire [2:0]           points,        // 0 for padding

  output reg                  error,
  output reg  [7:0]           error_code,
  output reg  [19:0]          error_collision
);
`include "pgs_interface.vh"

  // The words of a record, shortened. An extra bit keeps an index that is too long for a body's
  // number; a count that is too large for three bits becomes 7.
  wire [BODY:0] next_a, next_b;
  wire [2:0]    next_count;
  wire          there_a, there_b, there_count, has_room;
  wire [5:0]    counts_left, a_left, b_left, found_left;
  wire          counts_below, a_below, b_below;
  wire          unused = &{1'b0, counts_left, a_left, b_left, found_left, counts_below, a_below, b_below};
  wire          count_large = |count_word[15:3] | count_word[31] | (|count_word[30:16] & ~pair_friction);
  wire [2:0]    count_in = count_large ? 3'd7 : count_word[2:0];

  pgs_fifo #(.WIDTH(3), .ADDRESS(5)) counts (
    .clk(clk), .clear(clear), .push(count_comes), .in(count_in),
    .pop(take), .head(next_count), .count(counts_left), .some(there_count), .below(counts_below)
  );
  pgs_fifo #(.WIDTH(BODY + 1), .ADDRESS(5)) bodies_a (
    .clk(clk), .clear(clear), .push(body_a_comes), .in({|body_a_word[31:BODY], body_a_word[BODY-1:0]}),
    .pop(take), .head(next_a), .count(a_left), .some(there_a), .below(a_below)
  );
  pgs_fifo #(.WIDTH(BODY + 1), .ADDRESS(5)) bodies_b (
    .clk(clk), .clear(clear), .push(body_b_comes), .in({|body_b_word[31:BODY], body_b_word[BODY-1:0]}),
    .pop(take), .head(next_b), .count(b_left), .some(there_b), .below(b_below)
  );

  reg  pass_taken;                    // all collisions of the pass
  assign take = run & phase & there_a & there_b & there_count & (queued ? has_slot & ~pass_taken : has_room);

  // The number and the pass of the collision that is taken.
  reg [COLLISION-1:0] number;
  reg [19:0]          left;
  reg                 number_is_last, parity, one_collision;
  always @(posedge clk) begin
    one_collision <= collisions == 20'd1;     // settled before a start
    if (clear | pass_ends) pass_taken <= 1'b0;
    else if (take & number_is_last) pass_taken <= 1'b1;
    if (clear) begin
      number         <= {COLLISION{1'b0}};
      left           <= collisions;
      number_is_last <= one_collision;
      parity         <= 1'b0;
    end else if (take) begin
      if (number_is_last) begin
        number         <= {COLLISION{1'b0}};
        left           <= collisions;
        number_is_last <= one_collision;
        parity         <= ~parity;
      end else begin
        number         <= number + 1'b1;
        left           <= left - 20'd1;
        number_is_last <= left == 20'd2;
      end
    end
  end

  // Stage 0 reads, stage 1 writes and compares, stage 3 has everything.
  reg                 valid_s1, valid_s2, valid_s3;
  reg [BODY:0]        a_s1, b_s1;
  reg [BODY-1:0]      a_s2, a_s3, b_s2, b_s3;
  reg [COLLISION-1:0] number_s1, number_s2, number_s3;
  reg                 parity_s1;
  reg [2:0]           count_s1, count_s2, count_s3;
  reg                 beyond_s2, beyond_s3;
  reg                 same_s2, same_s3;
  wire                beyond_a = a_s1[BODY] | ({{(20-BODY){1'b0}}, a_s1[BODY-1:0]} >= bodies);
  wire                beyond_b = b_s1[BODY] | ({{(20-BODY){1'b0}}, b_s1[BODY-1:0]} >= bodies);
  always @(posedge clk) begin
    valid_s1  <= take & ~clear;
    a_s1      <= next_a;
    b_s1      <= next_b;
    number_s1 <= number;
    parity_s1 <= parity;
    count_s1  <= next_count;

    valid_s2  <= valid_s1 & ~clear;
    {a_s2, b_s2, number_s2, count_s2} <= {a_s1[BODY-1:0], b_s1[BODY-1:0], number_s1, count_s1};
    beyond_s2 <= beyond_a | beyond_b;
    same_s2   <= a_s1 == b_s1;

    valid_s3  <= valid_s2 & ~clear;
    {a_s3, b_s3, number_s3, count_s3, beyond_s3, same_s3}
      <= {a_s2, b_s2, number_s2, count_s2, beyond_s2, same_s2};
  end

  assign next_body_a = next_a[BODY-1:0];
  assign next_body_b = next_b[BODY-1:0];

  localparam [COLLISION:0] NEVER = {1'b1, {COLLISION{1'b0}}};
  wire                 uses = valid_s1 & (count_s1 != 3'd0) & ~queued;
  wire                 load = load_a | load_b;
  wire [BODY-1:0]      use_address_a = load ? load_address_a : phase ? next_a[BODY-1:0] : queued ? used_a : a_s1[BODY-1:0];
  wire [BODY-1:0]      use_address_b = load ? load_address_b : phase ? next_b[BODY-1:0] : queued ? used_b : b_s1[BODY-1:0];
  wire [COLLISION:0]   use_in = load ? NEVER : queued ? used_in : {parity_s1, number_s1};
  reg  [COLLISION:0]   use_a_s3, use_b_s3;
  pgs_true_dual_port #(
    .WIDTH(COLLISION + 1), .DEPTH(BODIES), .ADDRESS(BODY), .OUTPUT_STAGES(1)
  ) last_uses (
    .clk(clk),
    .write_a(load ? load_a : uses | uses_a), .address_a(use_address_a), .in_a(use_in), .out_a(use_a_s2),
    .write_b(load ? load_b : uses | uses_b), .address_b(use_address_b), .in_b(use_in), .out_b(use_b_s2)
  );
  always @(posedge clk) begin
    use_a_s3 <= use_a_s2;
    use_b_s3 <= use_b_s2;
  end

  wire padding    = count_s3 == 3'd0;
  assign moves_a_s3   = has_mass_a & ~padding;
  assign moves_b_s3   = has_mass_b & ~padding;
  assign comes_s1     = valid_s1 & queued;
  assign comes_a_s1   = a_s1[BODY-1:0];
  assign comes_b_s1   = b_s1[BODY-1:0];
  assign body_a_s3    = a_s3;
  assign body_b_s3    = b_s3;
  assign collision_s3 = number_s3;
  assign points_s3    = count_s3;

  localparam WIDTH = 2 * (COLLISION + 1) + 2 * BODY + 2 + 2 * PROPERTIES + 3;
  pgs_fifo #(.WIDTH(WIDTH), .ADDRESS(5), .LIMIT(24)) found_collisions (
    .clk(clk), .clear(clear), .push(valid_s3 & ~queued),
    .in({use_a_s3, use_b_s3, a_s3, b_s3, moves_a_s3, moves_b_s3, properties_a, properties_b, count_s3}),
    .pop(pop),
    .head({last_use_a, last_use_b, body_a, body_b, moves_a, moves_b, mass_a, mass_b, points}),
    .count(found_left), .some(found), .below(has_room)
  );

  always @(posedge clk) begin
    error <= valid_s3 & ~padding & ~clear
           & ((count_s3 > 3'd4) | beyond_s3 | same_s3 | ~(moves_a_s3 | moves_b_s3));
    error_code <= (count_s3 > 3'd4) ? ERROR_CONTACT_COUNT
                : beyond_s3 ? ERROR_BODY_INDEX
                : same_s3 ? ERROR_SELF_COLLISION : ERROR_STATIC_PAIR;
    error_collision <= {{(20-COLLISION){1'b0}}, number_s3};
  end
endmodule

`default_nettype wire
