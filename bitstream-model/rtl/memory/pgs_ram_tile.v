// Block RAM with two ports, in a shape of the device's blocks, and its output registers in the same
// module: a tool need not choose a shape or move a register.
//
// A port that is not selected does nothing, and its output stays. A read of an address that is written
// in the same cycle gives an undefined word (`no_rw_check` tells Yosys); with READ_FIRST the port that
// writes gives the word that it replaces. Latency of a read: 2 cycles.
`default_nettype none

module pgs_ram_tile #(
  parameter integer WIDTH      = 9,
  parameter integer ADDRESS    = 12,
  parameter integer READ_FIRST = 0
) (
  input  wire               clk,
  input  wire               select_a,
  input  wire               write_a,
  input  wire [ADDRESS-1:0] address_a,
  input  wire [WIDTH-1:0]   in_a,
  output reg  [WIDTH-1:0]   out_a,
  input  wire               select_b,
  input  wire               write_b,
  input  wire [ADDRESS-1:0] address_b,
  input  wire [WIDTH-1:0]   in_b,
  output reg  [WIDTH-1:0]   out_b
);
  reg [WIDTH-1:0] read_a, read_b;
  always @(posedge clk) begin
    out_a <= read_a;
    out_b <= read_b;
  end
  generate
    if (READ_FIRST != 0) begin : g_read_first
      (* ram_style = "block" *)
      reg [WIDTH-1:0] words [0:(1<<ADDRESS)-1];
      always @(posedge clk) if (select_a) begin
        if (write_a) words[address_a] <= in_a;
        read_a <= words[address_a];
      end
      always @(posedge clk) if (select_b) begin
        if (write_b) words[address_b] <= in_b;
        read_b <= words[address_b];
      end
    end else begin : g_unordered
      (* ram_style = "block", no_rw_check *)
      reg [WIDTH-1:0] words [0:(1<<ADDRESS)-1];
      always @(posedge clk) if (select_a) begin
        if (write_a) words[address_a] <= in_a;
        read_a <= words[address_a];
      end
      always @(posedge clk) if (select_b) begin
        if (write_b) words[address_b] <= in_b;
        read_b <= words[address_b];
      end
    end
  endgenerate
endmodule

`default_nettype wire
