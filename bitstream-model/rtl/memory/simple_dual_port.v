// Block RAM with one write port and one read port.
//
// It consists of lanes of nine bits: the RAM blocks of the device are that wide with their parity
// bits, so that wide words fill them.
//
// Latency of a read: ADDRESS_STAGES + 1 + OUTPUT_STAGES cycles; a write passes the same
// ADDRESS_STAGES. A read of an address that is written in the same cycle gives an undefined word
// (`no_rw_check` tells Yosys).
`default_nettype none

module simple_dual_port #(
  parameter WIDTH          = 64,
  parameter DEPTH          = 1024,
  parameter ADDRESS        = 10,
  parameter ADDRESS_STAGES = 0,
  parameter OUTPUT_STAGES  = 0
) (
  input  wire               clk,
  input  wire               write,
  input  wire [ADDRESS-1:0] write_address,
  input  wire [WIDTH-1:0]   in,
  input  wire [ADDRESS-1:0] read_address,
  output wire [WIDTH-1:0]   out
);
  wire               write_late;
  wire [ADDRESS-1:0] write_address_late, read_address_late;
  wire [WIDTH-1:0]   in_late;
  wire [WIDTH-1:0]   read;

  pipeline_register #(.WIDTH(1 + ADDRESS + WIDTH), .STAGES(ADDRESS_STAGES)) write_access (
    .clk(clk),
    .d({write, write_address, in}),
    .q({write_late, write_address_late, in_late})
  );
  pipeline_register #(.WIDTH(ADDRESS), .STAGES(ADDRESS_STAGES)) read_access (
    .clk(clk), .d(read_address), .q(read_address_late)
  );

  genvar i;
  generate
    for (i = 0; i < WIDTH; i = i + 9) begin : g_lane
      localparam BITS = (WIDTH - i < 9) ? WIDTH - i : 9;

      (* ram_style = "block", ram_decomp = "area", no_rw_check *)
      reg [BITS-1:0] words [0:DEPTH-1];
      reg [BITS-1:0] read_lane;

      always @(posedge clk) begin
        if (write_late) words[write_address_late] <= in_late[i +: BITS];
        read_lane <= words[read_address_late];
      end
      assign read[i +: BITS] = read_lane;
    end
  endgenerate

  pipeline_register #(.WIDTH(WIDTH), .STAGES(OUTPUT_STAGES)) output_stage (
    .clk(clk), .d(read), .q(out)
  );
endmodule

`default_nettype wire
