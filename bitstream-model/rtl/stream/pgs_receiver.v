// One stream into the accelerator: checks its packets against the step, adds up its words,
// and keeps the beats in a FIFO until a record takes them.
//
// A step has a packet of velocities, one of collisions in every pass, and one of poses. The beats of a
// body are dealt to the four streams in turn: two a body, and four for a velocity with world inertia.
// Of the seven beats of a collision, streams 0, 1 and 2 carry two, and stream 3 carries one. In a warm
// pass stream 3 carries a second one, the impulses (specification, sections 2 and 3). A packet without
// a beat does not exist.
//
// All lengths are registered before `start`, and the end of a packet is a flag that a down-counter
// prepares: no comparison of lengths lies on the way of a beat.
`default_nettype none

module pgs_receiver #(
  parameter integer CHANNEL       = 0,
  parameter integer WORLD_INERTIA = 0
) (
  input  wire         clk,
  input  wire         stop,             // reset, or the step has an error: no more beats are taken
  input  wire         start,            // a step begins; the arguments stay as they are
  input  wire         clear,            // reset or start
  input  wire [19:0]  bodies,
  input  wire [19:0]  collisions,
  input  wire [9:0]   passes,           // 0 without collisions
  input  wire [8:0]   friction_passes,
  input  wire         warm_start,       // the first pass of each kind is a warm one

  input  wire [127:0] tdata,
  input  wire [15:0]  tkeep,
  input  wire         tlast,
  input  wire         tvalid,
  output wire         tready,

  output wire [127:0] head,             // the oldest beat
  output wire [5:0]   count,            // beats in the FIFO
  output wire         there,            // count > 0
  input  wire         pop,
  output wire         collision_begins, // `tdata` is the first beat of a collision on stream 0, 1 or 2

  output wire [31:0]  sum,
  output reg          error,
  output reg  [7:0]   error_code,
  output reg  [20:0]  error_beat
);
`include "pgs_interface.vh"

  // Segments of a step.
  localparam VELOCITIES = 2'd0;
  localparam PASSES     = 2'd1;
  localparam POSES      = 2'd2;
  localparam FINISHED   = 2'd3;

  // Beats of a packet on this stream.
  localparam integer OFFSET = 3 - CHANNEL;
  localparam [20:0] BODY_OFFSET = OFFSET[20:0];
  reg [20:0] body_beats, pass_beats;
  reg        one_body, body_beats_none, body_beats_one, pass_beats_one, passes_none, passes_one;
  reg [9:0]  before_friction;    // passes left when the last contact pass is under way
  wire [20:0] body_beats_next = ({bodies, 1'b0} + BODY_OFFSET) >> 2;
  wire [20:0] pass_beats_next = (CHANNEL == 3) ? {1'b0, collisions} : {collisions, 1'b0};
  always @(posedge clk) begin
    one_body        <= bodies == 20'd1;
    body_beats      <= body_beats_next;
    pass_beats      <= pass_beats_next;
    body_beats_none <= body_beats_next == 21'd0;
    body_beats_one  <= body_beats_next == 21'd1;
    pass_beats_one  <= pass_beats_next == 21'd1;
    passes_none     <= passes == 10'd0;
    passes_one      <= passes == 10'd1;
    before_friction <= {1'b0, friction_passes} + 10'd1;
  end

  reg [1:0]  segment;
  reg        open;           // segment != FINISHED
  reg [9:0]  passes_left;
  reg        pass_is_last;
  reg [20:0] left;           // beats of the packet that have not come
  reg        beat_is_last;   // left == 1
  reg [20:0] beat;           // number of the next beat in its packet
  reg        second;         // the second beat of a collision comes next

  wire has_room;
  wire accepted = tvalid & tready;
  wire in_pass  = segment == PASSES;
  assign tready           = open & has_room;
  assign collision_begins = accepted & in_pass & ~second;

  // The segment after this one.
  wire [1:0] after_passes  = body_beats_none ? FINISHED : POSES;
  wire [1:0] after_load    = passes_none ? after_passes : PASSES;
  wire [1:0] next_segment  = (segment == VELOCITIES) ? after_load
                           : (in_pass & ~pass_is_last) ? PASSES
                           : in_pass ? after_passes : FINISHED;
  wire [1:0] first_segment = ((WORLD_INERTIA == 0) & body_beats_none) ? after_load : VELOCITIES;
  wire       next_is_warm  = warm_start & (~in_pass | (passes_left == before_friction));

  task begin_packet(input [1:0] of, input warm);
    begin
      segment      <= of;
      open         <= of != FINISHED;
      beat         <= 21'd0;
      second       <= 1'b0;
      left         <= ((WORLD_INERTIA != 0) & (of == VELOCITIES)) ? {1'b0, bodies}
                    : (of != PASSES) ? body_beats
                    : ((CHANNEL == 3) & warm) ? {collisions, 1'b0} : pass_beats;
      beat_is_last <= ((WORLD_INERTIA != 0) & (of == VELOCITIES)) ? one_body
                    : (of != PASSES) ? body_beats_one
                    : pass_beats_one & ~((CHANNEL == 3) & warm);
    end
  endtask

  always @(posedge clk) begin
    error <= 1'b0;
    if (stop) begin
      segment <= FINISHED;
      open    <= 1'b0;
    end else if (start) begin
      begin_packet(first_segment, warm_start);
      passes_left  <= passes;
      pass_is_last <= passes_one;
    end else if (accepted) begin
      if (beat_is_last) begin
        begin_packet(next_segment, next_is_warm);
        if (in_pass) begin
          passes_left  <= passes_left - 10'd1;
          pass_is_last <= passes_left == 10'd2;
        end
      end else begin
        beat         <= beat + 21'd1;
        second       <= ~second;
        left         <= left - 21'd1;
        beat_is_last <= left == 21'd2;
      end
      error      <= (tlast != beat_is_last) | ~&tkeep;
      error_code <= (tlast & ~beat_is_last) ? ERROR_TLAST_EARLY
                  : (~tlast & beat_is_last) ? ERROR_TLAST_MISSING : ERROR_PARTIAL_BEAT;
      error_beat <= beat;
    end
  end

  pgs_fifo #(.WIDTH(128), .ADDRESS(5), .LIMIT(28)) beats (
    .clk(clk), .clear(clear), .push(accepted), .in(tdata), .pop(pop), .head(head),
    .count(count), .some(there), .below(has_room)
  );

  pgs_word_sum words (
    .clk(clk), .clear(clear), .valid(accepted), .beat(tdata), .sum(sum)
  );
endmodule

`default_nettype wire
