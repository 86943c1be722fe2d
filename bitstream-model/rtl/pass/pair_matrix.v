// A bit for each pair of slots, written while a record takes one of them, and the slots that have it
// with some others.
//
// Between records that conflict the bit is the same from both sides. Between an older and a younger one
// (`ORDER`) it is 1 from the side of the younger. It stands once, with the upper slot of the pair.
`default_nettype none

module pair_matrix #(
  parameter SLOTS = 68,
  parameter ORDER = 0
) (
  input  wire             clk,
  input  wire [SLOTS-1:0] place,    // the slot that a record takes, or none
  input  wire [SLOTS-1:0] below,    // its bits with the slots below it
  input  wire [SLOTS-1:0] above,    // the bits that the slots above it have with it
  input  wire [SLOTS-1:0] ask,
  output wire [SLOTS-1:0] met       // slots whose bit is 1 with one of these
);
  wire [SLOTS*SLOTS-1:0] pairs;     // row i, bit j < i: the bit of slot i with slot j
  wire [SLOTS-1:0]       met_below;
  wire                   unused = &{1'b0, below[SLOTS-1], above[0]};   // no slot is there
  assign pairs[SLOTS-1:0] = {SLOTS{1'b0}};
  assign met_below[0]     = 1'b0;

  genvar i;
  generate
    for (i = 1; i < SLOTS; i = i + 1) begin : g_row
      reg [i-1:0] row;
      always @(posedge clk) begin
        if (place[i]) row <= below[i-1:0];
        else row <= (row & ~place[i-1:0]) | (place[i-1:0] & {i{above[i]}});
      end
      assign met_below[i] = |(row & ask[i-1:0]);
      assign pairs[SLOTS*i +: SLOTS] = {{(SLOTS-i){1'b0}}, (ORDER != 0) ? ~row : row};
    end
  endgenerate

  // The same from below: tools make a tree of it.
  reg [SLOTS-1:0] met_above;
  integer k;
  always @* begin
    met_above = {SLOTS{1'b0}};
    for (k = 1; k < SLOTS; k = k + 1) begin
      met_above = met_above | (pairs[SLOTS*k +: SLOTS] & {SLOTS{ask[k]}});
    end
  end
  assign met = met_below | met_above;
endmodule

`default_nettype wire
