// Block RAM with two ports that read or write a word each in every cycle.
//
// A block of the device has 4,096 words of nine bits, or 8,192 of four, 16,384 of two, 32,768 of one. So the bits
// of a word, as far as they make whole nines, lie in tiles of 4,096 words, and the rest in the deepest tiles that
// hold it. With 131,072 words of 64 bits that takes 228 blocks, in tiles of 4,096 words alone 256.
//
// A read of an address that is written in the same cycle gives an undefined word.
// Both ports must not write one address in one cycle.
//
// Latency of a read: ADDRESS_STAGES + 1 + OUTPUT_STAGES cycles. A write passes the same
// ADDRESS_STAGES, so that accesses take effect in the order in which they are made. OUTPUT_STAGES is at
// least 1: the first output stage lies in the blocks, and the choice between the tiles follows it. Without READS_A
// nothing reads port A, and there is no choice for it.
`default_nettype none

module pgs_true_dual_port #(
  parameter integer WIDTH          = 32,
  parameter integer DEPTH          = 1024,
  parameter integer ADDRESS        = 10,
  parameter integer ADDRESS_STAGES = 0,
  parameter integer OUTPUT_STAGES  = 1,
  parameter integer READS_A        = 1
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
  localparam NINES  = WIDTH - WIDTH % 9;
  localparam REST   = WIDTH % 9;
  localparam TILE   = (REST == 1) ? 15 : (REST == 2) ? 14 : (REST <= 4) ? 13 : 12;

  wire               write_a_late, write_b_late;
  wire [ADDRESS-1:0] address_a_late, address_b_late;
  wire [WIDTH-1:0]   in_a_late, in_b_late;
  wire [WIDTH-1:0]   read_a, read_b;

  pgs_pipeline_register #(.WIDTH(ACCESS), .STAGES(ADDRESS_STAGES)) access_a (
    .clk(clk),
    .d({write_a, address_a, in_a}),
    .q({write_a_late, address_a_late, in_a_late})
  );
  pgs_pipeline_register #(.WIDTH(ACCESS), .STAGES(ADDRESS_STAGES)) access_b (
    .clk(clk),
    .d({write_b, address_b, in_b}),
    .q({write_b_late, address_b_late, in_b_late})
  );

  generate
    if (NINES != 0) begin : g_nines
      pgs_ram_lane #(.WIDTH(NINES), .DEPTH(DEPTH), .ADDRESS(ADDRESS), .TILE(12), .READS_A(READS_A)) lane (
        .clk(clk),
        .write_a(write_a_late), .address_a(address_a_late), .in_a(in_a_late[NINES-1:0]), .out_a(read_a[NINES-1:0]),
        .write_b(write_b_late), .address_b(address_b_late), .in_b(in_b_late[NINES-1:0]), .out_b(read_b[NINES-1:0])
      );
    end
    if (REST != 0) begin : g_rest
      pgs_ram_lane #(.WIDTH(REST), .DEPTH(DEPTH), .ADDRESS(ADDRESS), .TILE(TILE), .READS_A(READS_A)) lane (
        .clk(clk),
        .write_a(write_a_late), .address_a(address_a_late), .in_a(in_a_late[WIDTH-1:NINES]), .out_a(read_a[WIDTH-1:NINES]),
        .write_b(write_b_late), .address_b(address_b_late), .in_b(in_b_late[WIDTH-1:NINES]), .out_b(read_b[WIDTH-1:NINES])
      );
    end
  endgenerate

  pgs_pipeline_register #(.WIDTH(WIDTH), .STAGES((READS_A != 0) ? OUTPUT_STAGES - 1 : 0)) output_a (
    .clk(clk), .d(read_a), .q(out_a)
  );
  pgs_pipeline_register #(.WIDTH(WIDTH), .STAGES(OUTPUT_STAGES - 1)) output_b (
    .clk(clk), .d(read_b), .q(out_b)
  );
endmodule

`default_nettype wire
