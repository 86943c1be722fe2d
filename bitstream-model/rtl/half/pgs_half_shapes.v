// The shape of every body, and the mass properties of every shape in binary16.
//
// A body's number at `address` gives its properties 3 cycles later. From the cycle after `loading`
// begins to the one after it ends, the properties of the shape at `lookup` come one cycle later instead.
//
// A body moves if its inverse mass in f32 is not 0: one that is too small for binary16 moves and counts as 0 in
// arithmetic. The table holds the flag beside each inverse mass.
`default_nettype none

module pgs_half_shapes #(
  parameter integer BODIES = 40960,
  parameter integer BODY   = 16,
  parameter integer SHAPE  = 6
) (
  input  wire               clk,
  input  wire [1:0]         table_write,   // inverse mass, inverse inertia
  input  wire [SHAPE-1:0]   table_address,
  input  wire [31:0]        table_in,

  input  wire               loading,
  input  wire [2:0]         write,
  input  wire [3*BODY-1:0]  address,
  input  wire [23:0]        shape,
  input  wire [3*SHAPE-1:0] lookup,
  output wire [2:0]         moves,         // of the two properties below, and of the third lookup
  output wire [63:0]        properties     // of bodies B and A, each {inverse inertia, inverse mass}
);
`include "pgs_operators.vh"

  // An entry waits for its rounding.
  localparam integer ROUNDING = {26'd0, FLOAT_TO_HALF_LATENCY};
  wire [15:0]      rounded;
  wire [1:0]       write_late;
  wire [SHAPE-1:0] address_late;
  wire             not_zero;
  pgs_float_to_half rounds (.clk(clk), .number(table_in), .half(rounded));
  pgs_pipeline_register #(.WIDTH(3 + SHAPE), .STAGES(ROUNDING)) entry (
    .clk(clk), .d({table_write, table_address, |table_in[30:0]}), .q({write_late, address_late, not_zero})
  );

  wire [7:0] found_a, found_b;
  pgs_two_banks #(.WIDTH(8), .DEPTH(BODIES), .ADDRESS(BODY)) shape_of_body (
    .clk(clk),
    .write_a(write[0]), .address_a(address[BODY-1:0]), .in_a(shape[7:0]), .out_a(found_a),
    .write_b(write[1]), .address_b(address[2*BODY-1:BODY]), .in_b(shape[15:8]), .out_b(found_b),
    .write_c(write[2]), .address_c(address[3*BODY-1:2*BODY]), .in_c(shape[23:16])
  );
  wire unused = &{1'b0, found_a[7:SHAPE], found_b[7:SHAPE]};

  // In a register: it selects the address of the tables.
  reg looks_up;
  always @(posedge clk) looks_up <= loading;
  wire [3*SHAPE-1:0] index = looks_up ? lookup
                           : {lookup[3*SHAPE-1:2*SHAPE], found_b[SHAPE-1:0], found_a[SHAPE-1:0]};
  genvar k;
  generate
    for (k = 0; k < 3; k = k + 1) begin : g_mass
      (* ram_style = "distributed" *) reg have [0:(1<<SHAPE)-1];
      reg has;
      always @(posedge clk) begin
        if (write_late[0]) have[address_late] <= not_zero;
        has <= have[index[SHAPE*k +: SHAPE]];
      end
      assign moves[k] = has;
    end
    for (k = 0; k < 2; k = k + 1) begin : g_properties
      (* ram_style = "distributed" *) reg [15:0] inverse_mass [0:(1<<SHAPE)-1];
      (* ram_style = "distributed" *) reg [15:0] inverse_inertia [0:(1<<SHAPE)-1];
      reg [31:0] found;
      always @(posedge clk) begin
        if (write_late[0]) inverse_mass[address_late] <= rounded;
        if (write_late[1]) inverse_inertia[address_late] <= rounded;
        found <= {inverse_inertia[index[SHAPE*k +: SHAPE]], inverse_mass[index[SHAPE*k +: SHAPE]]};
      end
      assign properties[32*k +: 32] = found;
    end
  endgenerate
endmodule

`default_nettype wire
