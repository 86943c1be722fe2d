// Inverse mass and inverse inertia about world axes of every body, as its velocity record brings them. Nothing
// writes them after the load.
//
// A body's number at `address` gives its properties 3 cycles later. In a step without streamed masses the mass
// is that of the body's shape: the load looks it up, and the passes need no shape.
`default_nettype none

module pgs_world_bodies #(
  parameter integer BODIES = 16384,
  parameter integer BODY   = 14,
  parameter integer SHAPE  = 6
) (
  input  wire             clk,
  input  wire             table_write,   // of the inverse mass of a shape
  input  wire [SHAPE-1:0] table_address,
  input  wire [31:0]      table_in,

  input  wire             streamed_masses,
  input  wire [SHAPE-1:0] lookup,        // shape of the body that is written in the next cycle
  input  wire [127:0]     diagonal,      // its rows 2 and 3, in the cycle of the lookup
  input  wire [127:0]     off_diagonal,
  output wire             written_moves, // its inverse mass is not 0
  input  wire             write,
  input  wire [BODY-1:0]  address_a,
  output wire [223:0]     properties_a,  // {inverse inertia, inverse mass}
  output wire             moves_a,
  input  wire [BODY-1:0]  address_b,
  output wire [223:0]     properties_b,
  output wire             moves_b
);
  (* ram_style = "distributed" *) reg [32:0] mass_of_shape [0:(1<<SHAPE)-1];
  always @(posedge clk) if (table_write) mass_of_shape[table_address] <= {|table_in[30:0], table_in};

  reg  [32:0]  mass;                     // with its flag
  reg  [191:0] inertia;
  wire         unused = &{1'b0, off_diagonal[127:96]};
  always @(posedge clk) begin
    mass    <= streamed_masses ? {|diagonal[126:96], diagonal[127:96]} : mass_of_shape[lookup];
    inertia <= {off_diagonal[95:0], diagonal[95:0]};
  end
  assign written_moves = mass[32];

  pgs_true_dual_port #(.WIDTH(225), .DEPTH(BODIES), .ADDRESS(BODY), .OUTPUT_STAGES(2)) properties (
    .clk(clk),
    .write_a(write), .address_a(address_a), .in_a({mass[32], inertia, mass[31:0]}), .out_a({moves_a, properties_a}),
    .write_b(1'b0), .address_b(address_b), .in_b(225'd0), .out_b({moves_b, properties_b})
  );
endmodule

`default_nettype wire
