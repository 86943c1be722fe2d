// Looks up, for each pair of collisions before it may be issued, the mass properties of its bodies and the last
// collision before each that used one of them; and refuses a collision that no pass can carry out.
//
// The finder runs ahead of the issue, in the order of the records and without waiting: the first collision of a pair in
// one cycle, the second in the next one. A memory holds for each body {parity of the pass, number of the collision} of
// its last use. A use takes the place of the one before it, which comes out: one access of each port for a collision.
// A use in an earlier pass has the other parity, and so has the value that the load writes: neither is a hazard.
`default_nettype none

module pgs_half_finder #(
  parameter integer BODIES    = 40960,
  parameter integer BODY      = 16,
  parameter integer COLLISION = 17
) (
  input  wire                 clk,
  input  wire                 clear,
  input  wire                 run,
  input  wire [19:0]          bodies,
  input  wire [19:0]          pairs,
  input  wire                 odd,           // the second collision of the last pair is none

  // Beats of streams 0 and 1, as they enter the accelerator, and their places in the records of a pair.
  input  wire [1:0]           comes,
  input  wire [1:0]           place_0,
  input  wire [1:0]           place_1,
  input  wire [127:0]         beat_0,
  input  wire [127:0]         beat_1,

  // The load clears the last uses.
  input  wire [2:0]           load,
  input  wire [3*BODY-1:0]    load_address,

  // Properties of the bodies, 3 cycles after their numbers.
  output wire [BODY-1:0]      next_body_a,
  output wire [BODY-1:0]      next_body_b,
  input  wire [63:0]          properties,
  input  wire [1:0]           has_mass,

  // The pair that is issued next; of its two collisions the second one in the upper half.
  input  wire                 pop,
  output wire                 found,
  output wire [4*COLLISION+3:0] last_uses,   // of bodies B and A: {parity, collision}
  output wire [4*BODY-1:0]    pair_bodies,   // B and A
  output wire [3:0]           moves,         // B and A; hazards and write-backs; 0 for padding
  output wire [127:0]         masses,        // B and A
  output wire [5:0]           points,        // 0 for padding
  output wire [1:0]           is_there,      // 0: a pair's second half that is no collision

  output reg                  error,
  output reg  [7:0]           error_code,
  output reg  [19:0]          error_collision
);
`include "pgs_interface.vh"

  // The words of the records, shortened. An extra bit keeps an index that is too long for a body's number; a count that
  // is too large for three bits becomes 7. Rows 0 to 3 are in the first two beats of stream 0, and rows 6 to 9 in the
  // first two of stream 1.
  function [2:0] count_of(input [15:0] word);
    count_of = (|word[15:3]) ? 3'd7 : word[2:0];
  endfunction
  function [BODY:0] body_of(input [15:0] word);
    body_of = {|({16'd0, word} >> BODY), word[BODY-1:0]};
  endfunction
  wire [2:0]    count_0, count_1;
  wire [BODY:0] a_0, b_0, a_1, b_1;
  wire [3:0]    there;
  wire [5:0]    left_0, left_1, left_2, left_3, found_left;
  wire [3:0]    below;
  wire          has_room;
  wire          unused = &{1'b0, left_0, left_1, left_2, left_3, found_left, below, beat_0[111:64],
                           beat_0[47:0], beat_1[111:64], beat_1[47:0]};
  wire take, second;
  wire takes_pair = take & second;
  pgs_fifo #(.WIDTH(BODY + 4), .ADDRESS(5)) first_heads (
    .clk(clk), .clear(clear), .push(comes[0] & (place_0 == 2'd0)), .in({count_of(beat_0[63:48]), body_of(beat_0[127:112])}),
    .pop(takes_pair), .head({count_0, a_0}), .count(left_0), .some(there[0]), .below(below[0])
  );
  pgs_fifo #(.WIDTH(BODY + 1), .ADDRESS(5)) first_rest (
    .clk(clk), .clear(clear), .push(comes[0] & (place_0 == 2'd1)), .in(body_of(beat_0[63:48])),
    .pop(takes_pair), .head(b_0), .count(left_1), .some(there[1]), .below(below[1])
  );
  pgs_fifo #(.WIDTH(3), .ADDRESS(5)) second_heads (
    .clk(clk), .clear(clear), .push(comes[1] & (place_1 == 2'd0)), .in(count_of(beat_1[127:112])),
    .pop(takes_pair), .head(count_1), .count(left_2), .some(there[2]), .below(below[2])
  );
  pgs_fifo #(.WIDTH(2*BODY + 2), .ADDRESS(5)) second_rest (
    .clk(clk), .clear(clear), .push(comes[1] & (place_1 == 2'd1)), .in({body_of(beat_1[127:112]), body_of(beat_1[63:48])}),
    .pop(takes_pair), .head({b_1, a_1}), .count(left_3), .some(there[3]), .below(below[3])
  );

  // The number and the pass of the pair that is taken.
  reg                 in_second;
  reg [COLLISION-2:0] number;
  reg [19:0]          left;
  reg                 pair_is_last, parity, one_pair;
  assign second = in_second;
  assign take   = in_second | (run & (&there) & has_room);
  wire absent   = in_second & pair_is_last & odd;
  wire [BODY:0] next_a     = in_second ? a_1 : a_0;
  wire [BODY:0] next_b     = in_second ? b_1 : b_0;
  wire [2:0]    next_count = absent ? 3'd0 : in_second ? count_1 : count_0;
  always @(posedge clk) begin
    one_pair  <= pairs == 20'd1;              // settled before a start
    in_second <= take & ~in_second & ~clear;
    if (clear) begin
      number       <= {(COLLISION-1){1'b0}};
      left         <= pairs;
      pair_is_last <= one_pair;
      parity       <= 1'b0;
    end else if (takes_pair) begin
      if (pair_is_last) begin
        number       <= {(COLLISION-1){1'b0}};
        left         <= pairs;
        pair_is_last <= one_pair;
        parity       <= ~parity;
      end else begin
        number       <= number + 1'b1;
        left         <= left - 20'd1;
        pair_is_last <= left == 20'd2;
      end
    end
  end

  // Stage 0 reads and writes, stage 3 has everything.
  reg                 valid_s1, valid_s2, valid_s3;
  reg [BODY:0]        a_s1, b_s1;
  reg [BODY-1:0]      a_s2, a_s3, b_s2, b_s3;
  reg [COLLISION-1:0] number_s1, number_s2, number_s3;
  reg [2:0]           count_s1, count_s2, count_s3;
  reg                 there_s1, there_s2, there_s3;
  reg                 beyond_s2, beyond_s3;
  reg                 same_s2, same_s3;
  wire                beyond_a = a_s1[BODY] | ({{(20-BODY){1'b0}}, a_s1[BODY-1:0]} >= bodies);
  wire                beyond_b = b_s1[BODY] | ({{(20-BODY){1'b0}}, b_s1[BODY-1:0]} >= bodies);
  always @(posedge clk) begin
    valid_s1  <= take & ~clear;
    a_s1      <= next_a;
    b_s1      <= next_b;
    number_s1 <= {number, in_second};
    count_s1  <= next_count;
    there_s1  <= ~absent;

    valid_s2  <= valid_s1 & ~clear;
    {a_s2, b_s2, number_s2, count_s2, there_s2}
      <= {a_s1[BODY-1:0], b_s1[BODY-1:0], number_s1, count_s1, there_s1};
    beyond_s2 <= beyond_a | beyond_b;
    same_s2   <= a_s1 == b_s1;

    valid_s3  <= valid_s2 & ~clear;
    {a_s3, b_s3, number_s3, count_s3, there_s3, beyond_s3, same_s3}
      <= {a_s2, b_s2, number_s2, count_s2, there_s2, beyond_s2, same_s2};
  end

  assign next_body_a = next_a[BODY-1:0];
  assign next_body_b = next_b[BODY-1:0];

  localparam [COLLISION:0] NEVER = {1'b1, {COLLISION{1'b0}}};
  wire               loads = |load;
  wire               uses = take & (next_count != 3'd0) & ~clear;
  wire [COLLISION:0] use_in = loads ? NEVER : {parity, number, in_second};
  wire [COLLISION:0] use_a_s2, use_b_s2;
  reg  [COLLISION:0] use_a_s3, use_b_s3;
  pgs_two_banks #(.WIDTH(COLLISION + 1), .DEPTH(BODIES), .ADDRESS(BODY), .READ_FIRST(1)) uses_of_bodies (
    .clk(clk),
    .write_a(loads ? load[0] : uses), .address_a(loads ? load_address[BODY-1:0] : next_body_a),
    .in_a(use_in), .out_a(use_a_s2),
    .write_b(loads ? load[1] : uses), .address_b(loads ? load_address[2*BODY-1:BODY] : next_body_b),
    .in_b(use_in), .out_b(use_b_s2),
    .write_c(load[2]), .address_c(load_address[3*BODY-1:2*BODY]), .in_c(NEVER)
  );
  always @(posedge clk) begin
    use_a_s3 <= use_a_s2;
    use_b_s3 <= use_b_s2;
  end

  wire padding = count_s3 == 3'd0;
  wire [1:0] moves_s3 = has_mass & {2{~padding}};
  localparam FACTS = 2 * (COLLISION + 1) + 2 * BODY + 2 + 64 + 3 + 1;
  wire [FACTS-1:0] facts = {use_b_s3, use_a_s3, b_s3, a_s3, moves_s3, properties, count_s3, there_s3};
  reg  [FACTS-1:0] first_facts;
  always @(posedge clk) if (~number_s3[0]) first_facts <= facts;
  pgs_fifo #(.WIDTH(2 * FACTS), .ADDRESS(5), .LIMIT(24)) found_pairs (
    .clk(clk), .clear(clear), .push(valid_s3 & number_s3[0]), .in({facts, first_facts}), .pop(pop),
    .head({last_uses[4*COLLISION+3:2*COLLISION+2], pair_bodies[4*BODY-1:2*BODY], moves[3:2], masses[127:64],
           points[5:3], is_there[1],
           last_uses[2*COLLISION+1:0], pair_bodies[2*BODY-1:0], moves[1:0], masses[63:0], points[2:0], is_there[0]}),
    .count(found_left), .some(found), .below(has_room)
  );

  always @(posedge clk) begin
    error <= valid_s3 & ~padding & ~clear
           & ((count_s3 > 3'd4) | beyond_s3 | same_s3 | ~|moves_s3);
    error_code <= (count_s3 > 3'd4) ? ERROR_CONTACT_COUNT
                : beyond_s3 ? ERROR_BODY_INDEX
                : same_s3 ? ERROR_SELF_COLLISION : ERROR_STATIC_PAIR;
    error_collision <= {{(20-COLLISION){1'b0}}, number_s3};
  end
endmodule

`default_nettype wire
