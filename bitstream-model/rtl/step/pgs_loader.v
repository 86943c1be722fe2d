// Load: the velocities of the bodies FIRST, FIRST + STRIDE and so on go from the streams to the memories, one
// a cycle. Whether a body has a mass is found on the way.
//
// A body of inverse mass 0 is at rest whatever its words are: its stored velocity is 0, unless such bodies may
// move in this step.
`default_nettype none

module pgs_loader #(
  parameter integer BODY      = 16,      // bits of a body's number
  parameter integer SHAPE     = 6,       // bits of a shape's number
  parameter integer FIRST     = 0,
  parameter integer STRIDE    = 2        // loaders side by side: 1 or 2
) (
  input  wire            clk,
  input  wire            start,
  input  wire            run,             // the load is under way, and the loader beside this one is ready
  input  wire [19:0]     bodies,
  input  wire            kinematic,       // bodies of inverse mass 0 may move

  input  wire            there,           // the oldest beats of a record
  input  wire [127:0]    linear,
  input  wire [127:0]    angular,
  input  wire            names_shape,     // the mass is that of a shape
  output wire            pop,
  output reg             finished,        // all bodies have been taken

  output reg  [SHAPE-1:0] lookup,         // shape whose properties are needed in the next cycle
  input  wire            lookup_moves,    // the body has a mass

  output reg             write,
  output reg  [BODY-1:0] address,
  output reg  [7:0]      shape,
  output wire [191:0]    velocity,

  output reg             error,           // a shape index beyond the table
  output reg  [19:0]     error_body
);
  reg  [19:0] body;         // the next one
  reg         write_s1, beyond_s1;
  reg  [BODY-1:0] body_s1;
  reg  [7:0]  shape_s1;
  reg [191:0] velocity_s1, velocity_s2;

  // Bodies left on this side, as a down-counter with a prepared flag. Its first values are registers,
  // settled before a start.
  reg  [19:0] left, share;
  reg         no_share;

  assign pop      = run & ~finished & there;
  wire unused = &{1'b0, angular[127:96]};
  assign velocity = (lookup_moves | kinematic) ? velocity_s2 : 192'd0;

  always @(posedge clk) begin
    share    <= (STRIDE == 1) ? bodies : (bodies + ((FIRST == 0) ? 20'd1 : 20'd0)) >> 1;
    no_share <= share == 20'd0;
    if (start) begin
      body     <= FIRST[19:0];
      left     <= share;
      finished <= no_share;
    end else if (pop) begin
      body     <= body + STRIDE[19:0];
      left     <= left - 20'd1;
      finished <= left == 20'd1;
    end

    write_s1    <= pop;
    body_s1     <= body[BODY-1:0];
    lookup      <= linear[96 +: SHAPE];
    shape_s1    <= linear[103:96];
    velocity_s1 <= {angular[95:0], linear[95:0]};
    beyond_s1   <= |linear[127:96+SHAPE];
    error       <= write_s1 & beyond_s1 & names_shape;
    error_body  <= {{(20-BODY){1'b0}}, body_s1};

    write       <= write_s1;
    address     <= body_s1;
    shape       <= shape_s1;
    velocity_s2 <= velocity_s1;
  end
endmodule

`default_nettype wire
