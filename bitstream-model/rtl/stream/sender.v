// One stream out of the accelerator: a FIFO for the rows of the results, TLAST with the last one, and
// the credits that keep the FIFO from running over.
//
// A body that enters the integration takes a credit of every sender, long before its row arrives. A
// beat that leaves gives it back.
`default_nettype none

module sender #(
  parameter ADDRESS = 10       // the FIFO holds 2^ADDRESS rows
) (
  input  wire         clk,
  input  wire         reset,
  input  wire         start,
  input  wire         run,      // rows leave
  input  wire [19:0]  bodies,

  input  wire         enters,   // a body enters the integration
  output reg          has_room, // a body may enter in the next cycle
  input  wire         push,
  input  wire [127:0] row,

  output wire [127:0] tdata,
  output wire         tlast,
  output wire         tvalid,
  input  wire         tready,

  output reg          finished, // all rows of the step have left
  output wire [31:0]  sum
);
  localparam [ADDRESS:0] CREDITS = (1 << ADDRESS) - 4;

  reg [ADDRESS:0]  credits;
  reg [19:0]       rows_left, beats_left;
  reg              row_is_last;
  wire [ADDRESS:0] count;
  wire             leaves = tvalid & tready;

  assign tvalid = run & (count != {(ADDRESS+1){1'b0}});

  always @(posedge clk) begin
    if (reset | start) begin
      credits     <= CREDITS;
      has_room    <= 1'b1;
      rows_left   <= bodies;
      row_is_last <= bodies == 20'd1;
      beats_left  <= bodies;
      finished    <= 1'b0;
    end else begin
      if (enters & ~leaves) credits <= credits - 1'b1;
      if (leaves & ~enters) credits <= credits + 1'b1;
      // One body may enter before this flag is seen.
      has_room <= credits > 2;
      if (push) begin
        rows_left   <= rows_left - 20'd1;
        row_is_last <= rows_left == 20'd2;
      end
      if (leaves) begin
        beats_left <= beats_left - 20'd1;
        finished   <= beats_left == 20'd1;
      end
    end
  end

  block_fifo #(.WIDTH(129), .ADDRESS(ADDRESS)) rows (
    .clk(clk), .clear(reset | start), .push(push), .in({row_is_last, row}), .pop(leaves),
    .head({tlast, tdata}), .count(count)
  );

  word_sum words (
    .clk(clk), .clear(reset | start), .valid(push), .beat(row), .sum(sum)
  );
endmodule

`default_nettype wire
