// Load: the velocities of a group of five bodies go from the streams to the memories in two cycles. Whether a body has
// a mass is found on the way.
//
//             stream 0     stream 1     stream 2
//   cycle 0   body 0       body 2
//   cycle 1   body 1       body 3       body 4
//
// The bodies of streams 0 and 1 lie in one bank of each memory, and the one of stream 2 in the other. A body of inverse
// mass 0 is at rest whatever its words are: its stored velocity is 0, unless such bodies may move in this step.
`default_nettype none

module pgs_half_loader #(
  parameter integer BODY  = 16,           // bits of a body's number
  parameter integer SHAPE = 6             // bits of a shape's number
) (
  input  wire               clk,
  input  wire               start,
  input  wire               run,
  input  wire [19:0]        bodies,
  input  wire [19:0]        groups,
  input  wire               kinematic,    // bodies of inverse mass 0 may move

  input  wire [2:0]         there,        // the oldest beat of each stream
  input  wire [383:0]       heads,
  output wire [2:0]         pop,
  output reg                finished,     // all groups have been taken

  output reg  [3*SHAPE-1:0] lookup,       // shapes whose masses are needed in the next cycle
  input  wire [2:0]         lookup_moves, // the body has a mass

  output reg  [2:0]         write,
  output reg  [3*BODY-1:0]  address,
  output reg  [23:0]        shape,
  output wire [287:0]       velocity,

  output reg                error,        // a shape index beyond the table
  output reg  [19:0]        error_body
);
  reg        second;                      // cycle 1 of a group
  reg [19:0] left;                        // groups
  wire       go = run & ~finished & there[0] & there[1] & (there[2] | ~second);
  assign     pop = {go & second, go, go};

  reg  [59:0]  body, body_s1;             // the next one of each stream
  reg  [2:0]   valid_s1, beyond_s1;
  reg  [287:0] velocity_s1, velocity_s2;
  reg  [23:0]  shape_s1;
  wire [2:0]   there_s1;                  // it is not padding
  wire [2:0]   wrong = valid_s1 & there_s1 & beyond_s1;
  wire         unused;
  wire [2:0]   unused_words;
  assign       unused = &{1'b0, unused_words};
  genvar k;
  generate
    for (k = 0; k < 3; k = k + 1) begin : g_stream
      localparam integer FIRST = 2 * k;
      wire [127:0] beat = heads[128*k +: 128];
      assign unused_words[k]         = &beat[127:112];
      assign there_s1[k]             = body_s1[20*k +: 20] < bodies;
      assign velocity[96*k +: 96]    = (lookup_moves[k] | kinematic) ? velocity_s2[96*k +: 96] : 96'd0;
      always @(posedge clk) begin
        if (start) body[20*k +: 20] <= FIRST[19:0];
        else if (pop[k]) body[20*k +: 20] <= body[20*k +: 20] + ((k == 2) ? 20'd5 : second ? 20'd4 : 20'd1);
        body_s1[20*k +: 20]      <= body[20*k +: 20];
        lookup[SHAPE*k +: SHAPE] <= beat[48 +: SHAPE];
        shape_s1[8*k +: 8]       <= beat[55:48];
        beyond_s1[k]             <= |beat[63:48+SHAPE];
        velocity_s1[96*k +: 96]  <= {beat[111:64], beat[47:0]};
        address[BODY*k +: BODY]  <= body_s1[20*k +: BODY];
      end
    end
  endgenerate

  always @(posedge clk) begin
    if (start) begin
      second   <= 1'b0;
      left     <= groups;
      finished <= 1'b0;
    end else if (go) begin
      second <= ~second;
      if (second) begin
        left     <= left - 20'd1;
        finished <= left == 20'd1;
      end
    end
    valid_s1    <= pop & {3{~start}};
    error       <= |wrong;
    error_body  <= wrong[0] ? body_s1[19:0] : wrong[1] ? body_s1[39:20] : body_s1[59:40];
    write       <= valid_s1 & there_s1;
    shape       <= shape_s1;
    velocity_s2 <= velocity_s1;
  end
endmodule

`default_nettype wire
