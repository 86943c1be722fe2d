// Properties of a stream in (specification, section 3): it takes the beats of the step and no more, it finds the
// first beat whose TLAST or TKEEP is wrong, and its FIFO does not run over.
//
// Numbers of bodies, collisions and passes are small; which ones, and when a beat comes and goes, is the solver's
// choice.
`default_nettype none

module pgs_receiver_properties (
  input wire         clk,
  input wire         stop,
  input wire         start,
  input wire         clear,
  input wire [20:0]  velocity_beats,
  input wire [20:0]  pass_beats,
  input wire [20:0]  warm_beats,
  input wire [20:0]  pose_beats,
  input wire [9:0]   passes,
  input wire [8:0]   friction_passes,
  input wire         warm_start,
  input wire [15:0]  tkeep,
  input wire         tlast,
  input wire         tvalid,
  input wire         tready,
  input wire [5:0]   count,
  input wire         there,
  input wire         pop,
  input wire         comes,
  input wire         error,
  input wire [7:0]   error_code,
  input wire [20:0]  error_beat
);
`include "pgs_interface.vh"

  // ---- The step

  (* anyseq *) reg [2:0] any_bodies;
  (* anyseq *) reg [1:0] any_collisions, any_contacts, any_frictions;
  (* anyseq *) reg       any_warm;
  reg  [2:0] b;
  reg  [1:0] c, contacts, frictions;
  reg        warm;
  reg  [2:0] age = 3'd0;                 // the arguments are settled before a start
  always @(posedge clk) begin
    if (age != 3'd4) age <= age + 3'd1;
    if (age == 3'd0) begin
      {b, c, contacts, frictions, warm} <= {any_bodies, any_collisions, any_contacts, any_frictions, any_warm};
    end
  end
  always @* if (age != 3'd0) begin
    assume ((b != 0) & ((c != 0) | ({contacts, frictions} == 0)));
    assume ((velocity_beats == {17'd0, dealt}) & (pose_beats == {17'd0, dealt}) & (warm_start == warm));
    assume ((pass_beats == {19'd0, c}) & (warm_beats == {18'd0, c, 1'b0}));
    assume (passes == {8'd0, contacts} + {8'd0, frictions});
    assume (friction_passes == {7'd0, frictions});
  end
  wire begins  = age == 3'd3;
  wire running = age == 3'd4;
  reg  stopped;                          // by an error, which the step does not survive
  always @(posedge clk) stopped <= running & stop;
  always @* begin
    assume ((start == begins) & (clear == (age <= 3'd3)));
    assume (running ? stop | ~stopped : stop == (age < 3'd3));
    assume (there | ~pop);
  end

  // The master: a beat that is offered stays.
  reg         offered;
  reg [16:0]  offer;
  always @(posedge clk) {offered, offer} <= {tvalid & ~tready, tlast, tkeep};
  always @* if (offered & (age != 3'd0)) assume (tvalid & ({tlast, tkeep} == offer));

  // ---- The packets of the step on this stream: 0 the velocities, then every pass, then the poses

  reg  [3:0] packet;
  reg  [3:0] taken;                      // beats of it
  // As on stream 3 of `float`: the last of four to which two beats a body are dealt in turn, and one beat a
  // collision, two in a warm pass.
  wire [3:0] dealt = {1'b0, b} / 2;
  function [3:0] beats(input [3:0] of);
    if ((of == 0) | (of > {2'd0, contacts} + {2'd0, frictions})) beats = dealt;
    else if (warm & ((of == 1) | (of == {2'd0, contacts} + 4'd1))) beats = {1'b0, c, 1'b0};
    else beats = {2'd0, c};
  endfunction
  wire [3:0] poses  = {2'd0, contacts} + {2'd0, frictions} + 4'd1;
  wire       none   = dealt == 0;        // a packet without a beat does not exist
  wire       in_pass = (packet != 0) & (packet < poses);
  wire       over   = (packet > poses) | (none & (packet == poses));
  wire       its_last = taken + 4'd1 == beats(packet);
  wire       takes  = tvalid & tready & running;
  reg        wrong;                      // a beat was wrong, so that later beats have no meaning
  wire       is_wrong = (tlast != its_last) | ~&tkeep;
  always @(posedge clk) begin
    if (~running) begin
      {taken, wrong} <= 5'd0;
      packet <= none ? 4'd1 : 4'd0;
    end else if (takes) begin
      wrong <= wrong | is_wrong;
      taken <= its_last ? 4'd0 : taken + 4'd1;
      if (its_last) packet <= packet + 4'd1;
    end
  end

  // ---- Beats in the FIFO, whose order is proven of the FIFO itself

  reg [5:0] inside;
  always @(posedge clk) inside <= clear ? 6'd0 : inside + {5'd0, takes} - {5'd0, pop};

  reg       had_wrong, was_early, was_missing, full;
  reg [3:0] its_number;
  always @(posedge clk) begin
    had_wrong   <= takes & is_wrong & ~wrong & ~stop;
    was_early   <= tlast & ~its_last;
    was_missing <= ~tlast & its_last;
    its_number  <= taken;
    full        <= inside >= 6'd28;
  end
  always @* if (running) begin
    // No beat is taken that the step does not have, and none once the step has stopped.
    if (~wrong & over) assert (~tready);
    if (stopped) assert (~tready);
    // A beat that the step has is taken while there is room.
    if (~wrong & ~over & ~stopped & ~full) assert (tready);
    // The first wrong beat is told in the next cycle, with its kind and its number, and no right one is.
    if (~wrong | had_wrong) assert (error == had_wrong);
    if (had_wrong) begin
      assert (error_beat == {17'd0, its_number});
      assert (error_code == (was_early ? ERROR_TLAST_EARLY : was_missing ? ERROR_TLAST_MISSING : ERROR_PARTIAL_BEAT));
    end
    // Each beat of a pass is told as it comes.
    if (~wrong) assert (comes == (takes & in_pass));
    // The FIFO does not run over.
    assert ((count == inside) & (inside <= 6'd32) & (there == (inside != 0)));
  end
endmodule

bind pgs_receiver pgs_receiver_properties properties (.*);

`default_nettype wire
