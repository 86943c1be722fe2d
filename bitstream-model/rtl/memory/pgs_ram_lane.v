// Some bits of each word of a memory with two ports: tiles of 2^TILE words, side by side over the
// addresses. Latency of a read: 2 cycles. Without READS_A nothing reads port A.
`default_nettype none

module pgs_ram_lane #(
  parameter integer WIDTH   = 9,
  parameter integer DEPTH   = 4096,
  parameter integer ADDRESS = 12,
  parameter integer TILE    = 12,
  parameter integer READS_A = 1
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
  localparam TILES = (DEPTH + (1 << TILE) - 1) >> TILE;
  genvar i;
  generate
    if (TILES == 1) begin : g_one
      localparam WITHIN = (ADDRESS < TILE) ? ADDRESS : TILE;
      wire unused = &{1'b0, address_a, address_b};
      pgs_ram_tile #(.WIDTH(WIDTH), .ADDRESS(WITHIN)) tile (
        .clk(clk),
        .select_a(1'b1), .write_a(write_a), .address_a(address_a[WITHIN-1:0]), .in_a(in_a), .out_a(out_a),
        .select_b(1'b1), .write_b(write_b), .address_b(address_b[WITHIN-1:0]), .in_b(in_b), .out_b(out_b)
      );
    end else begin : g_tiles
      // The tile of the word that is at the outputs.
      reg [ADDRESS-TILE-1:0] tile_a_s1, tile_b_s1, tile_a, tile_b;
      always @(posedge clk) begin
        tile_a_s1 <= address_a[ADDRESS-1:TILE];
        tile_b_s1 <= address_b[ADDRESS-1:TILE];
        tile_a    <= tile_a_s1;
        tile_b    <= tile_b_s1;
      end
      wire [WIDTH-1:0] from_a [0:TILES-1];
      wire [WIDTH-1:0] from_b [0:TILES-1];
      for (i = 0; i < TILES; i = i + 1) begin : g_tile
        pgs_ram_tile #(.WIDTH(WIDTH), .ADDRESS(TILE)) tile (
          .clk(clk),
          .select_a(address_a[ADDRESS-1:TILE] == i), .write_a(write_a), .address_a(address_a[TILE-1:0]),
          .in_a(in_a), .out_a(from_a[i]),
          .select_b(address_b[ADDRESS-1:TILE] == i), .write_b(write_b), .address_b(address_b[TILE-1:0]),
          .in_b(in_b), .out_b(from_b[i])
        );
      end
      assign out_a = (READS_A != 0) ? from_a[tile_a] : {WIDTH{1'b0}};
      assign out_b = from_b[tile_b];
    end
  endgenerate
endmodule

`default_nettype wire
