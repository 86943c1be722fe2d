// For each collision that comes into the queue: the slot from which on no collision that has issued before
// writes one of its bodies. Later issues find it in the queue.
//
// A memory beside the finder has for each body {parity of the pass, ordinal of the issue} of its last
// use. It is written two slots after the issue, so that three issues may be missing in what is read: they
// are still in the registers behind the issue. The slots in which the last issues are over stand in a
// table by the low bits of the ordinal; there are fewer of them than slots in a window.
`default_nettype none

module pgs_queue_hazard #(
  parameter integer BODY      = 16,
  parameter integer COLLISION = 17,
  parameter integer WINDOW    = 162                   // slots; at most 255
) (
  input  wire                 clk,
  input  wire                 idle,           // nothing is under way
  input  wire                 parity,         // of the pass
  input  wire                 passes_slot,    // a slot of the pass ends
  input  wire                 issues,

  // The collision that comes, two cycles after it was taken, with its last uses, and a cycle later.
  input  wire [BODY-1:0]      a_s2,
  input  wire [BODY-1:0]      b_s2,
  input  wire [COLLISION:0]   use_a_s2,
  input  wire [COLLISION:0]   use_b_s2,
  input  wire                 moves_a_s3,
  input  wire                 moves_b_s3,
  output reg                  held_s5,        // it is not free yet
  output reg  [7:0]           free_at_s5,     // the slot from which on it is, modulo 256
  output reg  [7:0]           slot_after,     // the slot behind this one, modulo 256
  output reg  [7:0]           issue_free_at,  // the slot from which on the bodies of the last issue are free

  // Issues in the two slots before.
  input  wire [BODY-1:0]      early_a,
  input  wire [BODY-1:0]      early_b,
  input  wire                 early_moves_a,  // 0 without a collision
  input  wire                 early_moves_b,
  input  wire [BODY-1:0]      body_a,
  input  wire [BODY-1:0]      body_b,
  input  wire                 body_moves_a,
  input  wire                 body_moves_b,
  output reg  [COLLISION:0]   use_of_body     // of the issue whose bodies are body_a and body_b
);
  localparam [7:0] SLOTS = WINDOW[7:0];

  reg  [COLLISION-1:0] issued, over;          // issues of the pass; issues whose write-back can be read
  reg  [WINDOW-2:0]    under_way;             // one bit a slot, the newest in bit 0
  reg  [7:0]           slot;                  // number of the slot, modulo 256
  wire [7:0]           free_at = slot + SLOTS;
  reg  [COLLISION:0]   early_use, last_a_s3, last_b_s3;
  (* ram_style = "distributed" *) reg [7:0] ends [0:255];
  // Low bits of ordinals, also where these are short.
  wire [COLLISION+7:0] ordinal   = {8'd0, issued};
  wire [COLLISION+7:0] ordinal_a = {8'd0, last_a_s3[COLLISION-1:0]};
  wire [COLLISION+7:0] ordinal_b = {8'd0, last_b_s3[COLLISION-1:0]};
  wire                 unused    = &{1'b0, ordinal, ordinal_a, ordinal_b};

  always @(posedge clk) begin
    if (issues) ends[ordinal[7:0]] <= free_at;
    if (issues) issue_free_at <= free_at;
    if (idle) begin
      {issued, over} <= {(2*COLLISION){1'b0}};
      under_way      <= {(WINDOW-1){1'b0}};
      slot           <= 8'd0;
      slot_after     <= 8'd1;
    end else if (passes_slot) begin
      issued    <= issued + {{(COLLISION-1){1'b0}}, issues};
      over      <= over + {{(COLLISION-1){1'b0}}, under_way[WINDOW-2]};
      under_way <= {under_way[WINDOW-3:0], issues};
      slot       <= slot_after;
      slot_after <= slot_after + 8'd1;
    end
    if (issues) early_use <= {parity, issued};
    use_of_body <= early_use;
  end

  // Which of the issues that the memory does not tell of yet used the body.
  wire early_has_a = (early_moves_a & (early_a == a_s2)) | (early_moves_b & (early_b == a_s2));
  wire early_has_b = (early_moves_a & (early_a == b_s2)) | (early_moves_b & (early_b == b_s2));
  wire body_has_a  = (body_moves_a & (body_a == a_s2)) | (body_moves_b & (body_b == a_s2));
  wire body_has_b  = (body_moves_a & (body_a == b_s2)) | (body_moves_b & (body_b == b_s2));
  wire [COLLISION:0] last_a = early_has_a ? early_use : body_has_a ? use_of_body : use_a_s2;
  wire [COLLISION:0] last_b = early_has_b ? early_use : body_has_b ? use_of_body : use_b_s2;

  reg  [BODY-1:0]    a_s3, b_s3, a_s4, b_s4;
  reg                hazard_a_s4, hazard_b_s4, moves_a_s4, moves_b_s4;
  reg  [7:0]         end_a_s4, end_b_s4;
  wire [7:0]         slots_a = hazard_a_s4 ? end_a_s4 - slot : 8'd0;
  wire [7:0]         slots_b = hazard_b_s4 ? end_b_s4 - slot : 8'd0;
  wire last_has_a = (early_moves_a & (early_a == a_s4)) | (early_moves_b & (early_b == a_s4));
  wire last_has_b = (early_moves_a & (early_a == b_s4)) | (early_moves_b & (early_b == b_s4));
  wire last_has   = (moves_a_s4 & last_has_a) | (moves_b_s4 & last_has_b);
  always @(posedge clk) begin
    {a_s3, b_s3}           <= {a_s2, b_s2};
    {a_s4, b_s4}           <= {a_s3, b_s3};
    {last_a_s3, last_b_s3} <= {last_a, last_b};
    hazard_a_s4 <= moves_a_s3 & (last_a_s3[COLLISION] == parity) & (last_a_s3[COLLISION-1:0] >= over);
    hazard_b_s4 <= moves_b_s3 & (last_b_s3[COLLISION] == parity) & (last_b_s3[COLLISION-1:0] >= over);
    end_a_s4    <= ends[ordinal_a[7:0]];
    end_b_s4    <= ends[ordinal_b[7:0]];
    {moves_a_s4, moves_b_s4} <= {moves_a_s3, moves_b_s3};
    // The issue in the slot before is the newest that there can be.
    held_s5    <= last_has | (slots_a != 8'd0) | (slots_b != 8'd0);
    free_at_s5 <= last_has ? issue_free_at : (slots_a > slots_b) ? end_a_s4 : end_b_s4;
  end
endmodule

`default_nettype wire
