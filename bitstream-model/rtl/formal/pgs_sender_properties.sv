// Properties of a stream out: the rules of AXI4-Stream, rows in order, TLAST with the last row and nowhere else,
// and credits that keep the FIFO from running over.
//
// The user is the one of stream 0, which has the most kinds of rows. The assumptions about it are the rules that
// pgs_issue, pgs_queue, pgs_issue_numbers and pgs_integrator follow.
`default_nettype none

module pgs_sender_properties #(
  parameter integer ADDRESS = 10
) (
  input wire         clk,
  input wire         clear,
  input wire         stop,
  input wire [19:0]  rows_of_results,
  input wire         enters,
  input wire         has_room,
  input wire         push,
  input wire         result,
  input wire [127:0] row,
  input wire [127:0] tdata,
  input wire         tlast,
  input wire         tvalid,
  input wire         tready,
  input wire         finished,
  input wire [ADDRESS:0] credits,
  input wire [19:0]  rows_left,
  input wire         row_is_last
);
  localparam [ADDRESS:0] ROWS    = {1'b1, {ADDRESS{1'b0}}};
  localparam [ADDRESS:0] CREDITS = ROWS - 4;

  // ---- The user

  // The number of rows is settled for longer than a cycle as a step begins.
  reg begun = 1'b0, settled = 1'b0;
  always @(posedge clk) begin
    {begun, settled} <= {1'b1, begun};
    assume (settled | clear);
    if (begun) assume (~clear | (rows_of_results == $past(rows_of_results)));
    if (settled) assume (clear | (rows_of_results == $past(rows_of_results)));
    assume (rows_of_results != 0);
  end

  // A collision issues in every second cycle at most, in the cycle behind one in which there is room. Each
  // fourth one and the last of a pass are followed by their numbers. It takes longer than eight cycles from there
  // to the next pass or to the first body. A body enters in a cycle in which there is room.
  (* anyseq *) reg issues, last, integrates;
  reg  [1:0] issued;
  reg        follows, issued_now, had_room, integrating;
  reg  [3:0] drains;
  reg  [19:0] results_left;
  wire body_enters = enters & integrates;
  always @(posedge clk) begin
    if (clear) begin
      {issued, follows, issued_now, had_room, integrating, drains} <= 0;
    end else begin
      if (issues) issued <= last ? 2'd0 : issued + 2'd1;
      follows     <= issues & (last | (issued == 2'd3));
      issued_now  <= issues;
      had_room    <= has_room;
      integrating <= integrates;
      drains      <= (issues & last) ? 4'd8 : drains - (drains != 0);
    end
    assume (~issues | (had_room & ~issued_now & ~integrates & (drains == 0)));
    assume (~integrates | (drains == 0) & ~follows);
    assume (~integrating | integrates | clear);
    assume (integrates ? ~enters | (has_room & (results_left != {{(19-ADDRESS){1'b0}}, results_owed})) : enters == (issues | follows));
    assume (~clear | ~(enters | issues | push));
  end

  // The row of each comes later, impulses and numbers in front of the results.
  reg [ADDRESS:0] impulses_owed, results_owed;
  always @(posedge clk) begin
    if (clear) {impulses_owed, results_owed} <= 0;
    else begin
      impulses_owed <= impulses_owed + (enters & ~integrates) - (push & ~result);
      results_owed  <= results_owed + body_enters - (push & result);
    end
    assume (~push | (result ? (results_owed != 0) & (impulses_owed == 0) : impulses_owed != 0));
  end

  // ---- Rows that are inside, and the one that is followed

  wire leaves = tvalid & tready;
  (* anyseq *) reg picks;
  reg  [ADDRESS:0] inside, in_front;
  reg              followed, its_last;
  reg  [1:0]       its_bits;             // all bits of a row go the same way: these stand for them
  always @(posedge clk) begin
    if (clear) begin
      inside       <= 0;
      followed     <= 1'b0;
      results_left <= rows_of_results;
    end else begin
      inside <= inside + push - leaves;
      if (push & result) results_left <= results_left - 20'd1;
      if (followed & leaves) begin
        in_front <= in_front - 1'b1;
        followed <= in_front != 0;
      end else if (~followed & push & picks) begin
        followed <= 1'b1;
        in_front <= inside - leaves;
        its_bits <= row[1:0];
        its_last <= result & (results_left == 20'd1);
      end
    end
  end

  // The last row has left, and how long ago; nothing is offered any more.
  reg last_left, last_left_before, over;
  always @(posedge clk) begin
    if (clear) {last_left, last_left_before, over} <= 3'b000;
    else begin
      last_left        <= last_left | (leaves & tlast);
      last_left_before <= last_left;
      over             <= over | (stop & (~tvalid | tready));
    end
  end

  // Rows that have a credit; the count follows a cycle later.
  wire [ADDRESS:0] with_credit = impulses_owed + results_owed + inside;

  always @(posedge clk) if (settled) begin
    // AXI4-Stream: a beat that is offered stays, unchanged, until it is taken. A reset alone withdraws it.
    if ($past(tvalid & ~tready & ~clear)) begin
      assert (tvalid);
      assert (tlast == $past(tlast));
      assert (tdata[1:0] == $past(tdata[1:0]));
    end
    if ($past(clear)) assert (~tvalid);

    // A row that is there is offered, until an error stops them.
    assert (tvalid == ((inside != 0) & ~over));

    // Rows come out in order, and TLAST is that of the last result.
    if (followed & (in_front == 0)) begin
      assert (tlast == its_last);
      assert (tdata[1:0] == its_bits);
    end

    // The FIFO never runs over; credits are neither lost nor invented.
    assert (inside <= ROWS);
    assert (with_credit <= CREDITS);
    assert (rows_left == results_left);
    assert (row_is_last == (results_left == 20'd1));
    if (~$past(clear)) assert (credits == CREDITS - $past(with_credit));

    // The end is told when the last row has left two cycles ago, and not before.
    assert (finished == last_left_before);
  end
endmodule

bind pgs_sender pgs_sender_properties #(.ADDRESS(ADDRESS)) properties (.*);

`default_nettype wire
