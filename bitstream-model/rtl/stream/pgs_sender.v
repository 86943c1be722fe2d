// One stream out of the accelerator: a FIFO for the rows of the results, TLAST with the last one, and
// the credits that keep the FIFO from running over. On stream 0 impulses of collisions go in front of the
// results, in the same packet.
//
// A body that enters the integration takes a credit of every sender, and a collision whose impulses go out
// one of sender 0, long before its row arrives. A beat that leaves gives it back.
//
// An error stops the rows, but a beat that is offered stays until it is taken, as AXI4-Stream asks. RESET
// withdraws it: the beat would be the first one of the next packet.
`default_nettype none

module pgs_sender #(
  parameter integer WIDTH   = 128,     // of the stream; with 64 bits a row is two transfers, low bits first
  parameter integer ADDRESS = 10,      // the FIFO holds 2^ADDRESS rows
  parameter integer SPARE   = 3        // rows that may enter before `has_room` tells of them
) (
  input  wire         clk,
  input  wire         clear,    // reset, or a step begins
  input  wire         stop,     // the step has an error: no more rows are offered
  input  wire [19:0]  rows_of_results,

  input  wire         enters,   // a body enters the integration, or a collision its last pass
  output reg          has_room, // one may enter in the next cycle
  input  wire         push,
  input  wire         result,   // the row is one of a result
  input  wire [127:0] row,

  output wire [WIDTH-1:0] tdata,
  output wire         tlast,
  output wire         tvalid,
  input  wire         tready,

  output reg          finished, // all rows of the step have left, the last one two cycles ago
  output wire [31:0]  sum
);
  localparam [ADDRESS:0] CREDITS = (1 << ADDRESS) - 4;

  reg [ADDRESS:0]  credits;
  reg [19:0]       rows_left;        // of the results
  reg              row_is_last, one_row;
  reg              taken, given;     // a credit, in the cycle before; a beat gives one as it leaves
  reg              last_left;        // the beat in the cycle before was the last one
  reg              stopped;          // nothing is offered until the next step
  wire             there;            // a row in the FIFO
  wire             last;             // the oldest one is the last one
  wire [127:0]     head;
  assign           tvalid = there & ~stopped;
  wire             leaves;           // the last transfer of a row
  generate
    if (WIDTH == 128) begin : g_whole
      assign tdata  = head;
      assign tlast  = last;
      assign leaves = tvalid & tready;
    end else begin : g_halves
      reg second;
      always @(posedge clk) begin
        if (clear) second <= 1'b0;
        else if (tvalid & tready) second <= ~second;
      end
      assign tdata  = second ? head[127 -: WIDTH] : head[WIDTH-1:0];
      assign tlast  = last & second;
      assign leaves = tvalid & tready & second;
    end
  endgenerate

  always @(posedge clk) begin
    one_row <= rows_of_results == 20'd1;
    taken   <= enters & ~clear;
    given   <= leaves & ~clear;
    last_left <= leaves & last & ~clear;
    if (clear) begin
      credits      <= CREDITS;
      has_room     <= 1'b1;
      rows_left    <= rows_of_results;
      row_is_last  <= one_row;
      finished     <= 1'b0;
      stopped      <= 1'b0;
    end else begin
      if (taken & ~given) credits <= credits - 1'b1;
      if (given & ~taken) credits <= credits + 1'b1;
      has_room <= credits > SPARE[ADDRESS:0];
      if (push & result) begin
        rows_left   <= rows_left - 20'd1;
        row_is_last <= rows_left == 20'd2;
      end
      if (last_left) finished <= 1'b1;
      if (stop & (~tvalid | tready)) stopped <= 1'b1;
    end
  end

  pgs_block_fifo #(.WIDTH(129), .ADDRESS(ADDRESS)) rows (
    .clk(clk), .clear(clear), .push(push), .in({row_is_last & result, row}), .pop(leaves),
    .head({last, head}), .some(there)
  );

  pgs_word_sum words (
    .clk(clk), .clear(clear), .valid(push), .beat(row), .sum(sum)
  );
endmodule

`default_nettype wire
