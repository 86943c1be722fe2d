// FIFO like fifo.v whose words are in block RAM.
//
// The RAM is read a cycle ahead, so that the oldest word is at its output in time. It does not give
// a word that is written in the same cycle: that one comes from a register.
`default_nettype none

module pgs_block_fifo #(
  parameter integer WIDTH   = 32,
  parameter integer ADDRESS = 10
) (
  input  wire             clk,
  input  wire             clear,
  input  wire             push,
  input  wire [WIDTH-1:0] in,
  input  wire             pop,
  output wire [WIDTH-1:0] head,
  output wire             some       // there is a word
);
  (* ram_style = "block" *) reg [WIDTH-1:0] words [0:(1<<ADDRESS)-1];
  reg [ADDRESS-1:0] newest, oldest, after_oldest;
  reg [ADDRESS:0]   count;
  reg [WIDTH-1:0]   read, pushed;
  reg               none_left, one_left;       // count is 0, count is 1
  reg               head_is_pushed;

  wire [ADDRESS-1:0] next_oldest = pop ? after_oldest : oldest;
  assign some = ~none_left;
  assign head = head_is_pushed ? pushed : read;

  always @(posedge clk) begin
    if (push) words[newest] <= in;
    read           <= words[next_oldest];
    pushed         <= in;
    head_is_pushed <= none_left | (one_left & pop);
    if (clear) begin
      newest       <= {ADDRESS{1'b0}};
      oldest       <= {ADDRESS{1'b0}};
      after_oldest <= {{(ADDRESS-1){1'b0}}, 1'b1};
      count        <= {(ADDRESS+1){1'b0}};
      none_left    <= 1'b1;
      one_left     <= 1'b0;
    end else begin
      if (push) newest <= newest + 1'b1;
      if (pop) begin
        oldest       <= after_oldest;
        after_oldest <= after_oldest + 1'b1;
      end
      if (push & ~pop) begin
        count     <= count + 1'b1;
        none_left <= 1'b0;
        one_left  <= none_left;
      end
      if (pop & ~push) begin
        count     <= count - 1'b1;
        none_left <= one_left;
        one_left  <= count == 2;
      end
    end
  end
endmodule

`default_nettype wire
