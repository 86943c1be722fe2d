// The slots of the queue and the records in them.
//
// The finder gives a slot to each collision that it takes. The beats of a record leave the FIFOs of the
// streams in the two cycles of an issue slot, the facts come from the finder, and both wait under the
// number of the slot. A slot is free again when its collision issues: its last words are read long before
// the next record is written.
`default_nettype none

module pgs_queue_records #(
  parameter integer SLOTS = 68,
  parameter integer SLOT  = 7,                // bits of a slot's number
  parameter integer FACTS = 181
) (
  input  wire             clk,
  input  wire             clear,
  input  wire             phase,

  // Slots, in the order in which they are given.
  output wire [SLOT-1:0]  next,       // of the one that is taken: the queue lets the finder take no more than there are
  input  wire             take,
  input  wire             release_slot,
  input  wire [SLOT-1:0]  released,

  // Records in.
  input  wire             beats_there,
  input  wire [511:0]     beats,
  output reg              loads,      // rows 0 to 3 are taken
  output reg              loads_rest, // rows 4 to 7
  input  wire             facts_come,
  input  wire [SLOT-1:0]  facts_slot,
  input  wire [FACTS-1:0] facts_in,

  // Collisions whose beats are there wait for their entry.
  output reg              some,
  input  wire             enters,

  // Records out.
  input  wire [SLOT-1:0]  slot,
  output wire [511:0]     first,      // rows 0 to 3
  output wire [511:0]     rest,
  output wire [FACTS-1:0] facts
);
  localparam integer LAST = SLOTS - 1;

  // The slots are given out in turn first; after that, each slot that an issue has left.
  reg  [SLOT-1:0] fresh;
  reg             none_fresh;
  wire [SLOT-1:0] freed, loading;
  wire [SLOT:0]   freed_left, loading_left;
  wire            some_freed, some_loading, freed_below, loading_below;
  wire            unused = &{1'b0, freed_left, loading_left, some_freed, freed_below, loading_below};
  assign next = none_fresh ? freed : fresh;
  always @(posedge clk) begin
    if (clear) {none_fresh, fresh} <= {1'b0, {SLOT{1'b0}}};
    else if (take & ~none_fresh) {none_fresh, fresh} <= {fresh == LAST[SLOT-1:0], fresh + 1'b1};
  end
  pgs_fifo #(.WIDTH(SLOT), .ADDRESS(SLOT)) free_slots (
    .clk(clk), .clear(clear), .push(release_slot), .in(released), .pop(take & none_fresh), .head(freed),
    .count(freed_left), .some(some_freed), .below(freed_below)
  );
  pgs_fifo #(.WIDTH(SLOT), .ADDRESS(SLOT)) without_beats (
    .clk(clk), .clear(clear), .push(take), .in(next), .pop(loads), .head(loading),
    .count(loading_left), .some(some_loading), .below(loading_below)
  );

  (* ram_style = "distributed" *) reg [511:0]     first_rows [0:SLOTS-1];
  (* ram_style = "distributed" *) reg [511:0]     rest_rows [0:SLOTS-1];
  (* ram_style = "distributed" *) reg [FACTS-1:0] found [0:SLOTS-1];
  reg [SLOT-1:0] loading_rest, slot_rest;
  reg [SLOT:0]   waiting;
  assign first = first_rows[slot];
  assign rest  = rest_rows[slot_rest];
  assign facts = found[slot];
  always @(posedge clk) begin
    loads        <= phase & some_loading & beats_there & ~clear;
    loads_rest   <= loads & ~clear;
    loading_rest <= loading;
    slot_rest    <= slot;
    if (loads) first_rows[loading] <= beats;
    if (loads_rest) rest_rows[loading_rest] <= beats;
    if (facts_come) found[facts_slot] <= facts_in;
    if (clear) begin
      waiting <= {(SLOT+1){1'b0}};
      some    <= 1'b0;
    end else begin
      if (loads_rest & ~enters) {waiting, some} <= {waiting + 1'b1, 1'b1};
      if (enters & ~loads_rest) {waiting, some} <= {waiting - 1'b1, waiting != 1};
    end
  end
endmodule

`default_nettype wire
