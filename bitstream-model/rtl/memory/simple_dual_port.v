// Block RAM of WORDS words of 32 bits an address, with one write port, which has a strobe for each
// word, and one read port.
//
// Latency of a read: ADDRESS_STAGES + 1 + OUTPUT_STAGES cycles; a write passes the same
// ADDRESS_STAGES. An address must not be read in the cycle in which it is written.
`default_nettype none

module simple_dual_port #(
  parameter WORDS          = 4,
  parameter DEPTH          = 1024,
  parameter ADDRESS        = 10,
  parameter ADDRESS_STAGES = 0,
  parameter OUTPUT_STAGES  = 0
) (
  input  wire                clk,
  input  wire [WORDS-1:0]    write,
  input  wire [ADDRESS-1:0]  write_address,
  input  wire [32*WORDS-1:0] in,
  input  wire [ADDRESS-1:0]  read_address,
  output wire [32*WORDS-1:0] out
);
  genvar i;
  generate
    for (i = 0; i < WORDS; i = i + 1) begin : g_word
      (* ram_style = "block" *) reg [31:0] words [0:DEPTH-1];

      wire               write_late;
      wire [ADDRESS-1:0] write_address_late, read_address_late;
      wire [31:0]        in_late;
      reg  [31:0]        read;

      pipeline_register #(.WIDTH(1 + ADDRESS + 32), .STAGES(ADDRESS_STAGES)) write_access (
        .clk(clk),
        .d({write[i], write_address, in[32*i +: 32]}),
        .q({write_late, write_address_late, in_late})
      );
      pipeline_register #(.WIDTH(ADDRESS), .STAGES(ADDRESS_STAGES)) read_access (
        .clk(clk), .d(read_address), .q(read_address_late)
      );
      always @(posedge clk) begin
        if (write_late) words[write_address_late] <= in_late;
        read <= words[read_address_late];
      end
      pipeline_register #(.WIDTH(32), .STAGES(OUTPUT_STAGES)) output_stage (
        .clk(clk), .d(read), .q(out[32*i +: 32])
      );
    end
  endgenerate
endmodule

`default_nettype wire
