// Block RAM with two ports that read or write a word each in every cycle. It consists of lanes of
// nine bits, as simple_dual_port.v does.
//
// A read of an address that is written in the same cycle gives an undefined word (`no_rw_check` tells
// Yosys).
// Both ports must not write one address in one cycle.
//
// Latency of a read: ADDRESS_STAGES + 1 + OUTPUT_STAGES cycles. A write passes the same
// ADDRESS_STAGES, so that accesses take effect in the order in which they are made.
`default_nettype none

module true_dual_port #(
  parameter WIDTH          = 32,
  parameter DEPTH          = 1024,
  parameter ADDRESS        = 10,
  parameter ADDRESS_STAGES = 0,
  parameter OUTPUT_STAGES  = 0
) (
  input  wire               clk,
  input  wire               write_a,
  input  wire [ADDRESS-1:0] address_a,
  input  wire [WIDTH-1:0]   in_a,
  output wire [WIDTH-1:0]   out_a,
  input  wire               write_b,
  input  wire [ADDRESS-1:0] address_b,
  input  wire [WIDTH-1:0]   in_b,
  output wire [WIDTH-1:0]   out_b
);
  localparam ACCESS = 1 + ADDRESS + WIDTH;

  wire               write_a_late, write_b_late;
  wire [ADDRESS-1:0] address_a_late, address_b_late;
  wire [WIDTH-1:0]   in_a_late, in_b_late;

  pipeline_register #(.WIDTH(ACCESS), .STAGES(ADDRESS_STAGES)) access_a (
    .clk(clk),
    .d({write_a, address_a, in_a}),
    .q({write_a_late, address_a_late, in_a_late})
  );
  pipeline_register #(.WIDTH(ACCESS), .STAGES(ADDRESS_STAGES)) access_b (
    .clk(clk),
    .d({write_b, address_b, in_b}),
    .q({write_b_late, address_b_late, in_b_late})
  );

  wire [WIDTH-1:0] read_a, read_b;
  genvar i;
  generate
    for (i = 0; i < WIDTH; i = i + 9) begin : g_lane
      localparam BITS = (WIDTH - i < 9) ? WIDTH - i : 9;

      (* ram_style = "block", ram_decomp = "area", no_rw_check *)
      reg [BITS-1:0] words [0:DEPTH-1];
      reg [BITS-1:0] read_lane_a, read_lane_b;

      always @(posedge clk) begin
        if (write_a_late) words[address_a_late] <= in_a_late[i +: BITS];
        read_lane_a <= words[address_a_late];
      end
      always @(posedge clk) begin
        if (write_b_late) words[address_b_late] <= in_b_late[i +: BITS];
        read_lane_b <= words[address_b_late];
      end
      assign read_a[i +: BITS] = read_lane_a;
      assign read_b[i +: BITS] = read_lane_b;
    end
  endgenerate

  pipeline_register #(.WIDTH(WIDTH), .STAGES(OUTPUT_STAGES)) output_a (
    .clk(clk), .d(read_a), .q(out_a)
  );
  pipeline_register #(.WIDTH(WIDTH), .STAGES(OUTPUT_STAGES)) output_b (
    .clk(clk), .d(read_b), .q(out_b)
  );
endmodule

`default_nettype wire
