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
  input  wire         clear,    // reset, or a step begins
  input  wire         stop,     // the step has an error: no more rows leave
  input  wire [19:0]  bodies,

  input  wire         enters,   // a body enters the integration
  output reg          has_room, // a body may enter in the next cycle
  input  wire         push,
  input  wire [127:0] row,

  output wire [127:0] tdata,
  output wire         tlast,
  output wire         tvalid,
  input  wire         tready,

  output reg          finished, // all rows of the step have left, the last one two cycles ago
  output wire [31:0]  sum
);
  localparam [ADDRESS:0] CREDITS = (1 << ADDRESS) - 4;

  reg [ADDRESS:0]  credits;
  reg [19:0]       rows_left, beats_left;
  reg              row_is_last, beat_is_last, one_row;
  reg              taken, given;     // a credit, in the cycle before; a beat gives one as it leaves
  wire             leaves = tvalid & tready;

  always @(posedge clk) begin
    one_row <= bodies == 20'd1;
    taken   <= enters & ~clear;
    given   <= leaves & ~clear;
    if (clear) begin
      credits      <= CREDITS;
      has_room     <= 1'b1;
      rows_left    <= bodies;
      row_is_last  <= one_row;
      beats_left   <= bodies;
      beat_is_last <= one_row;
      finished     <= 1'b0;
    end else begin
      if (taken & ~given) credits <= credits - 1'b1;
      if (given & ~taken) credits <= credits + 1'b1;
      // Two bodies may enter before this flag tells of them.
      has_room <= credits > 3;
      if (push) begin
        rows_left   <= rows_left - 20'd1;
        row_is_last <= rows_left == 20'd2;
      end
      if (given) begin
        beats_left   <= beats_left - 20'd1;
        beat_is_last <= beats_left == 20'd2;
        finished     <= beat_is_last;
      end
    end
  end

  block_fifo #(.WIDTH(129), .ADDRESS(ADDRESS)) rows (
    .clk(clk), .clear(clear | stop), .push(push), .in({row_is_last, row}), .pop(leaves),
    .head({tlast, tdata}), .some(tvalid)
  );

  word_sum words (
    .clk(clk), .clear(clear), .valid(push), .beat(row), .sum(sum)
  );
endmodule

`default_nettype wire
