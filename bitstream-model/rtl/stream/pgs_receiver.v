// One stream into the accelerator: checks its packets against the step, adds up its words,
// and keeps the beats in a FIFO until a record takes them.
//
// A step has a packet of velocities, one of collisions in every pass, and one of poses. Their lengths on
// this stream follow from the stripe (specification, sections 2 and 3); a warm pass has one of its own. A
// packet without a beat does not exist.
//
// All lengths are registered before `start`, and the end of a packet is a flag that a down-counter
// prepares: no comparison of lengths lies on the way of a beat.
`default_nettype none

module pgs_receiver #(
  parameter integer WIDTH = 128,        // of the stream; with 64 bits a beat is two transfers, low bits first
  parameter integer GROUP = 2           // beats of an issue in a pass, at most 4
) (
  input  wire         clk,
  input  wire         stop,             // reset, or the step has an error: no more beats are taken
  input  wire         start,            // a step begins; the arguments stay as they are
  input  wire         clear,            // reset or start
  input  wire [20:0]  velocity_beats,   // of a packet
  input  wire [20:0]  pass_beats,
  input  wire [20:0]  warm_beats,
  input  wire [20:0]  pose_beats,
  input  wire [9:0]   passes,           // 0 without collisions
  input  wire [8:0]   friction_passes,
  input  wire         warm_start,       // the first pass of each kind is a warm one

  input  wire [WIDTH-1:0]   tdata,
  input  wire [WIDTH/8-1:0] tkeep,
  input  wire         tlast,
  input  wire         tvalid,
  output wire         tready,

  output wire [127:0] head,             // the oldest beat
  output wire [5:0]   count,            // beats in the FIFO
  output wire         there,            // count > 0
  input  wire         pop,
  output wire         comes,            // a beat of a pass enters; on a stream of 128 bits it is `tdata`
  output reg  [1:0]   place,            // number of this beat in its issue

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

  reg        velocities_none, velocities_one, poses_none, poses_one, pass_one, warm_one;
  reg        passes_none, passes_one;
  reg [9:0]  before_friction;    // passes left when the last contact pass is under way
  always @(posedge clk) begin
    velocities_none <= velocity_beats == 21'd0;
    velocities_one  <= velocity_beats == 21'd1;
    poses_none      <= pose_beats == 21'd0;
    poses_one       <= pose_beats == 21'd1;
    pass_one        <= pass_beats == 21'd1;
    warm_one        <= warm_beats == 21'd1;
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
  reg [20:0] beat_number;    // number of the next beat in its packet

  wire has_room;
  assign tready = open & has_room;

  // A transfer becomes a beat, or half of one.
  wire         accepted;     // the last transfer of a beat
  wire [127:0] beat;
  wire         early, partial;
  wire         transfer = tvalid & tready;
  generate
    if (WIDTH == 128) begin : g_whole
      assign accepted = transfer;
      assign beat     = tdata;
      assign early    = 1'b0;
      assign partial  = ~&tkeep;
    end else begin : g_halves
      reg         second, low_last, low_partial;
      reg [127-WIDTH:0] low;
      always @(posedge clk) begin
        if (stop | start) second <= 1'b0;
        else if (transfer) second <= ~second;
        if (transfer & ~second) {low_last, low_partial, low} <= {tlast, ~&tkeep, tdata};
      end
      assign accepted = transfer & second;
      assign beat     = {tdata, low};
      assign early    = low_last;
      assign partial  = ~&tkeep | low_partial;
    end
  endgenerate
  wire in_pass = segment == PASSES;
  assign comes = accepted & in_pass;

  // The segment after this one.
  wire [1:0] after_passes  = poses_none ? FINISHED : POSES;
  wire [1:0] after_load    = passes_none ? after_passes : PASSES;
  wire [1:0] next_segment  = (segment == VELOCITIES) ? after_load
                           : (in_pass & ~pass_is_last) ? PASSES
                           : in_pass ? after_passes : FINISHED;
  wire [1:0] first_segment = velocities_none ? after_load : VELOCITIES;
  wire       next_is_warm  = warm_start & (~in_pass | (passes_left == before_friction));

  task begin_packet(input [1:0] of, input warm);
    begin
      segment      <= of;
      open         <= of != FINISHED;
      beat_number  <= 21'd0;
      place        <= 2'd0;
      left         <= (of == VELOCITIES) ? velocity_beats : (of == POSES) ? pose_beats
                    : warm ? warm_beats : pass_beats;
      beat_is_last <= (of == VELOCITIES) ? velocities_one : (of == POSES) ? poses_one
                    : warm ? warm_one : pass_one;
    end
  endtask

  localparam integer TOP = GROUP - 1;
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
        beat_number  <= beat_number + 21'd1;
        place        <= (place == TOP[1:0]) ? 2'd0 : place + 2'd1;
        left         <= left - 21'd1;
        beat_is_last <= left == 21'd2;
      end
      error      <= (tlast != beat_is_last) | early | partial;
      error_code <= ((tlast & ~beat_is_last) | early) ? ERROR_TLAST_EARLY
                  : (~tlast & beat_is_last) ? ERROR_TLAST_MISSING : ERROR_PARTIAL_BEAT;
      error_beat <= beat_number;
    end
  end

  pgs_fifo #(.WIDTH(128), .ADDRESS(5), .LIMIT(28)) beats (
    .clk(clk), .clear(clear), .push(accepted), .in(beat), .pop(pop), .head(head),
    .count(count), .some(there), .below(has_room)
  );

  pgs_word_sum words (
    .clk(clk), .clear(clear), .valid(accepted), .beat(beat), .sum(sum)
  );
endmodule

`default_nettype wire
