// Properties of both FIFOs: every word that is pushed comes out once, in order and unchanged, and the counts
// are right at all times.
//
// The solver picks a word as it is pushed and follows it. It may pick any, so that a property of this word holds for
// all.
`default_nettype none

module pgs_fifo_properties #(
  parameter integer WIDTH   = 32,
  parameter integer ADDRESS = 5,
  parameter integer LIMIT   = 1 << ADDRESS
) (
  input wire             clk,
  input wire             clear,
  input wire             push,
  input wire [WIDTH-1:0] in,
  input wire             pop,
  input wire [WIDTH-1:0] head,
  input wire [ADDRESS:0] count,
  input wire             some,
  input wire             below
);
  localparam [ADDRESS:0] FULL = {1'b1, {ADDRESS{1'b0}}};

  reg begun = 1'b0;
  always @(posedge clk) begin
    begun <= 1'b1;

    // The user clears it first, pushes only while there is room, and pops only while there is a word.
    assume (begun | clear);
    assume (clear | ~push | (words != FULL));
    assume (clear | ~pop | (words != 0));
  end

  // The words inside, and the place of the one that is followed: the number of words in front of it.
  (* anyseq *) reg  picks;
  reg  [ADDRESS:0]  words, in_front;
  reg               follows;
  reg  [WIDTH-1:0]  word;
  always @(posedge clk) begin
    if (clear) begin
      words   <= 0;
      follows <= 1'b0;
    end else begin
      words <= words + push - pop;
      if (follows & pop) begin
        in_front <= in_front - 1'b1;
        follows  <= in_front != 0;
      end else if (~follows & push & picks) begin
        in_front <= words - pop;
        follows  <= 1'b1;
        word     <= in;
      end
    end
  end

  always @(posedge clk) if (begun) begin
    // The count is the number of words that were pushed and not popped yet.
    assert (count == words);
    assert (words <= FULL);
    assert (some == (words != 0));
    assert (below == (words < LIMIT));
    // The word that is followed comes to the head behind the words in front of it, unchanged.
    if (follows) assert (in_front < words);
    if (follows & (in_front == 0)) assert (head == word);
  end
endmodule

bind pgs_fifo pgs_fifo_properties
  #(.WIDTH(WIDTH), .ADDRESS(ADDRESS), .LIMIT(LIMIT)) properties (.*);

// The FIFO in block RAM counts for itself alone, and has no limit.
bind pgs_block_fifo pgs_fifo_properties
  #(.WIDTH(WIDTH), .ADDRESS(ADDRESS)) properties (.below(~count[ADDRESS]), .*);

`default_nettype wire
