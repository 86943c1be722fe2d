// The shape of every body, and the mass properties of every shape.
//
// A body's number at `address` gives its properties 3 cycles later. From the cycle after `loading`
// begins to the one after it ends, the properties of the shape at `lookup` come one cycle later instead.
//
// The table holds beside each inverse mass whether it is other than 0, so that no reader has to look
// at its 31 bits.
`default_nettype none

module pgs_body_shapes #(
  parameter integer BODIES = 40960,
  parameter integer BODY   = 16,
  parameter integer SHAPE  = 6
) (
  input  wire             clk,
  input  wire [1:0]       table_write,   // inverse mass, inverse inertia
  input  wire [SHAPE-1:0] table_address,
  input  wire [31:0]      table_in,

  input  wire             loading,
  input  wire             write_a,
  input  wire [BODY-1:0]  address_a,
  input  wire [7:0]       shape_a,
  input  wire [SHAPE-1:0] lookup_a,
  output reg  [63:0]      properties_a,  // {inverse inertia, inverse mass}
  output reg              moves_a,       // the inverse mass is not 0
  input  wire             write_b,
  input  wire [BODY-1:0]  address_b,
  input  wire [7:0]       shape_b,
  input  wire [SHAPE-1:0] lookup_b,
  output reg  [63:0]      properties_b,
  output reg              moves_b
);
  (* ram_style = "distributed" *) reg [32:0] inverse_mass [0:(1<<SHAPE)-1];
  (* ram_style = "distributed" *) reg [31:0] inverse_inertia [0:(1<<SHAPE)-1];
  always @(posedge clk) begin
    if (table_write[0]) inverse_mass[table_address] <= {|table_in[30:0], table_in};
    if (table_write[1]) inverse_inertia[table_address] <= table_in;
  end

  wire [7:0] found_a, found_b;
  pgs_true_dual_port #(.WIDTH(8), .DEPTH(BODIES), .ADDRESS(BODY), .OUTPUT_STAGES(1)) shape_of_body (
    .clk(clk),
    .write_a(write_a), .address_a(address_a), .in_a(shape_a), .out_a(found_a),
    .write_b(write_b), .address_b(address_b), .in_b(shape_b), .out_b(found_b)
  );

  wire unused = &{1'b0, found_a[7:SHAPE], found_b[7:SHAPE]};

  // In a register: it selects the address of four tables.
  reg looks_up;
  always @(posedge clk) looks_up <= loading;
  wire [SHAPE-1:0] index_a = looks_up ? lookup_a : found_a[SHAPE-1:0];
  wire [SHAPE-1:0] index_b = looks_up ? lookup_b : found_b[SHAPE-1:0];
  always @(posedge clk) begin
    properties_a[63:32]             <= inverse_inertia[index_a];
    {moves_a, properties_a[31:0]}   <= inverse_mass[index_a];
    properties_b[63:32]             <= inverse_inertia[index_b];
    {moves_b, properties_b[31:0]}   <= inverse_mass[index_b];
  end
endmodule

`default_nettype wire
