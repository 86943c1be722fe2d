// FIFO of 2^ADDRESS words in LUT memory whose oldest word is visible at `head` while `count` is not 0.
//
// The user pushes only while there is room and pops only while there is a word. `some` and `below` are
// registers, so that no comparison of the count lies on the way of a push or a pop.
`default_nettype none

module pgs_fifo #(
  parameter integer WIDTH   = 32,
  parameter integer ADDRESS = 5,
  parameter integer LIMIT   = 1 << ADDRESS
) (
  input  wire             clk,
  input  wire             clear,
  input  wire             push,
  input  wire [WIDTH-1:0] in,
  input  wire             pop,
  output wire [WIDTH-1:0] head,
  output reg  [ADDRESS:0] count,
  output reg              some,     // count > 0
  output reg              below     // count < LIMIT
);
  (* ram_style = "distributed" *) reg [WIDTH-1:0] words [0:(1<<ADDRESS)-1];
  reg [ADDRESS-1:0] newest, oldest;

  localparam [ADDRESS:0] TOP       = LIMIT[ADDRESS:0];
  localparam [ADDRESS:0] BELOW_TOP = TOP - 1'b1;

  assign head = words[oldest];

  always @(posedge clk) begin
    if (push) words[newest] <= in;
    if (clear) begin
      newest <= {ADDRESS{1'b0}};
      oldest <= {ADDRESS{1'b0}};
      count  <= {(ADDRESS+1){1'b0}};
      some   <= 1'b0;
      below  <= 1'b1;
    end else begin
      if (push) newest <= newest + 1'b1;
      if (pop) oldest <= oldest + 1'b1;
      if (push & ~pop) begin
        count <= count + 1'b1;
        some  <= 1'b1;
        below <= count < BELOW_TOP;
      end
      if (pop & ~push) begin
        count <= count - 1'b1;
        some  <= count != 1;
        below <= count <= TOP;
      end
    end
  end
endmodule

`default_nettype wire
