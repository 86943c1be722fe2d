// The bodies of a step as they are loaded, and their mass properties for the passes and the integration.
//
//                    isotropic inertia                        world inertia
//   a cycle loads    a pair: the even body from streams 0     one body from all streams, through port A
//                    and 1 through port A, the odd one from
//                    streams 2 and 3 through port B
//   on chip          the shape (body_shapes)                  mass and inertia (world_bodies)
//
// A body's number gives its properties 3 cycles later: {inverse inertia, inverse mass}.
`default_nettype none

module pgs_bodies #(
  parameter integer WORLD_INERTIA = 0,
  parameter integer BODIES        = 40960,
  parameter integer BODY          = 16,
  parameter integer SHAPE         = 6,
  parameter integer PROPERTIES    = 64
) (
  input  wire                  clk,
  input  wire                  clear,
  input  wire [1:0]            table_write,   // of the shapes: inverse mass, inverse inertia
  input  wire [SHAPE-1:0]      table_address,
  input  wire [31:0]           table_in,

  input  wire                  loading,       // the load is under way
  input  wire                  finding,       // a collision asks for both of its bodies
  input  wire                  integrating,   // the integration asks for a body
  input  wire [19:0]           bodies,
  input  wire                  kinematic,
  input  wire                  streamed_masses,
  input  wire [3:0]            there,         // the oldest beats of the streams
  input  wire [511:0]          head,

  output wire [1:0]            loads,         // beats are taken: of streams 0 and 1, of streams 2 and 3
  output wire                  finished,
  output wire [1:0]            write,         // of a velocity, on both ports
  output wire [BODY-1:0]       write_address_a,
  output wire [BODY-1:0]       write_address_b,
  output wire [191:0]          velocity_a,
  output wire [191:0]          velocity_b,
  output wire                  error,         // a shape index beyond the table
  output wire [19:0]           error_body,

  input  wire [BODY-1:0]       found_a,
  input  wire [BODY-1:0]       found_b,
  input  wire [BODY-1:0]       entering,
  output wire [PROPERTIES-1:0] properties_a,
  output wire                  moves_a,       // the inverse mass is not 0
  output wire [PROPERTIES-1:0] properties_b,
  output wire                  moves_b
);
  wire [BODY-1:0] asked_a = integrating ? entering : found_a;
  generate
    if (WORLD_INERTIA != 0) begin : g_world
      wire             load, lookup_moves;
      wire [SHAPE-1:0] lookup;
      wire [7:0]       shape;
      pgs_loader #(.BODY(BODY), .SHAPE(SHAPE), .FIRST(0), .STRIDE(1)) all (
        .clk(clk), .start(clear), .run(loading), .bodies(bodies), .kinematic(kinematic),
        .there(&there), .linear(head[127:0]), .angular(head[255:128]), .names_shape(~streamed_masses),
        .pop(load), .finished(finished),
        .lookup(lookup), .lookup_moves(lookup_moves),
        .write(write[0]), .address(write_address_a), .shape(shape), .velocity(velocity_a),
        .error(error), .error_body(error_body)
      );
      assign loads           = {2{load}};
      assign write[1]        = 1'b0;
      assign write_address_b = {BODY{1'b0}};
      assign velocity_b      = 192'd0;

      reg [255:0] inertia;                    // rows 2 and 3, beside `lookup`
      always @(posedge clk) inertia <= head[511:256];
      pgs_world_bodies #(.BODIES(BODIES), .BODY(BODY), .SHAPE(SHAPE)) masses (
        .clk(clk), .table_write(table_write[0]), .table_address(table_address), .table_in(table_in),
        .streamed_masses(streamed_masses), .lookup(lookup),
        .diagonal(inertia[127:0]), .off_diagonal(inertia[255:128]), .written_moves(lookup_moves),
        .write(write[0]), .address_a(write[0] ? write_address_a : asked_a),
        .properties_a(properties_a), .moves_a(moves_a),
        .address_b(found_b), .properties_b(properties_b), .moves_b(moves_b)
      );
      wire unused = &{1'b0, finding, table_write[1], shape};
    end else begin : g_isotropic
      wire [1:0]       whole = {there[3] & there[2], there[1] & there[0]};
      wire [1:0]       done, wrong;
      wire [1:0]       ready = done | whole;     // the body is there, or its side has no more
      wire [SHAPE-1:0] lookup [0:1];
      wire [7:0]       shape [0:1];
      wire [BODY-1:0]  address [0:1];
      wire [191:0]     velocity [0:1];
      wire [19:0]      wrong_body [0:1];
      wire [1:0]       moves = {moves_b, moves_a};
      genvar k;
      for (k = 0; k < 2; k = k + 1) begin : g_loader
        pgs_loader #(.BODY(BODY), .SHAPE(SHAPE), .FIRST(k), .STRIDE(2)) side (
          .clk(clk), .start(clear), .run(loading & ready[1-k]), .bodies(bodies), .kinematic(kinematic),
          .there(whole[k]), .linear(head[256*k +: 128]), .angular(head[256*k+128 +: 128]),
          .names_shape(1'b1), .pop(loads[k]), .finished(done[k]),
          .lookup(lookup[k]), .lookup_moves(moves[k]),
          .write(write[k]), .address(address[k]), .shape(shape[k]), .velocity(velocity[k]),
          .error(wrong[k]), .error_body(wrong_body[k])
        );
      end
      assign finished        = &done;
      assign error           = |wrong;
      assign error_body      = wrong[0] ? wrong_body[0] : wrong_body[1];
      assign write_address_a = address[0];
      assign write_address_b = address[1];
      assign velocity_a      = velocity[0];
      assign velocity_b      = velocity[1];
      pgs_body_shapes #(.BODIES(BODIES), .BODY(BODY), .SHAPE(SHAPE)) shapes (
        .clk(clk), .table_write(table_write), .table_address(table_address), .table_in(table_in),
        .loading(~finding & ~integrating),
        .write_a(write[0]), .address_a(write[0] ? address[0] : asked_a),
        .shape_a(shape[0]), .lookup_a(lookup[0]), .properties_a(properties_a), .moves_a(moves_a),
        .write_b(write[1]), .address_b(write[1] ? address[1] : found_b),
        .shape_b(shape[1]), .lookup_b(lookup[1]), .properties_b(properties_b), .moves_b(moves_b)
      );
      wire unused = &{1'b0, streamed_masses};
    end
  endgenerate
endmodule

`default_nettype wire
