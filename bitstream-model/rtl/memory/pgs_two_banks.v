// A memory with two ports in two banks, by the lowest bit of the address. While both ports are at work in one bank, the
// other bank takes a third write.
//
// Latency of a read: ADDRESS_STAGES + 1 + OUTPUT_STAGES cycles, and a choice between the banks behind the last register.
// All rules of `pgs_true_dual_port` hold for each bank.
`default_nettype none

module pgs_two_banks #(
  parameter integer WIDTH          = 32,
  parameter integer DEPTH          = 1024,
  parameter integer ADDRESS        = 10,
  parameter integer ADDRESS_STAGES = 0,
  parameter integer OUTPUT_STAGES  = 1,
  parameter integer READ_FIRST     = 0
) (
  input  wire               clk,
  input  wire               write_a,
  input  wire [ADDRESS-1:0] address_a,
  input  wire [WIDTH-1:0]   in_a,
  output wire [WIDTH-1:0]   out_a,
  input  wire               write_b,
  input  wire [ADDRESS-1:0] address_b,
  input  wire [WIDTH-1:0]   in_b,
  output wire [WIDTH-1:0]   out_b,
  input  wire               write_c,     // not into the bank of `address_a`, whose port it takes
  input  wire [ADDRESS-1:0] address_c,
  input  wire [WIDTH-1:0]   in_c
);
  wire [WIDTH-1:0] from_a [0:1];
  wire [WIDTH-1:0] from_b [0:1];
  genvar k;
  generate
    for (k = 0; k < 2; k = k + 1) begin : g_bank
      wire third = write_c & (address_c[0] == k);
      pgs_true_dual_port #(
        .WIDTH(WIDTH), .DEPTH((DEPTH + 1) / 2), .ADDRESS(ADDRESS - 1),
        .ADDRESS_STAGES(ADDRESS_STAGES), .OUTPUT_STAGES(OUTPUT_STAGES), .READ_FIRST(READ_FIRST)
      ) bank (
        .clk(clk),
        .write_a(third | (write_a & (address_a[0] == k))),
        .address_a(third ? address_c[ADDRESS-1:1] : address_a[ADDRESS-1:1]),
        .in_a(third ? in_c : in_a), .out_a(from_a[k]),
        .write_b(write_b & (address_b[0] == k)), .address_b(address_b[ADDRESS-1:1]),
        .in_b(in_b), .out_b(from_b[k])
      );
    end
  endgenerate

  localparam LATENCY = ADDRESS_STAGES + 1 + OUTPUT_STAGES;
  wire bank_a, bank_b;
  pgs_pipeline_register #(.WIDTH(2), .STAGES(LATENCY)) banks (
    .clk(clk), .d({address_b[0], address_a[0]}), .q({bank_b, bank_a})
  );
  assign out_a = bank_a ? from_a[1] : from_a[0];
  assign out_b = bank_b ? from_b[1] : from_b[0];
endmodule

`default_nettype wire
