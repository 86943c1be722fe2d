// The first of the places that are asked for: in groups of eight, so that the first of each group and the
// first group are found side by side.
`default_nettype none

module pgs_queue_first #(
  parameter integer PLACES = 65,
  parameter integer WIDTH  = 41
) (
  input  wire [PLACES-1:0]       asked,
  input  wire [PLACES*WIDTH-1:0] records,   // of the places
  output wire [PLACES-1:0]       from,      // the first one, and all behind it
  output wire [PLACES-1:0]       first,
  output reg  [WIDTH-1:0]        record     // of the first one; 0 without one
);
  localparam GROUPS = (PLACES + 7) / 8;
  localparam ALL    = 8 * GROUPS;
  wire [ALL:0]           every = {{(ALL-PLACES+1){1'b0}}, asked};
  wire [(ALL+1)*WIDTH-1:0] every_record = {{((ALL-PLACES+1)*WIDTH){1'b0}}, records};
  wire [ALL-1:0]         every_from, every_first;
  wire [GROUPS-1:0]      some;
  wire [GROUPS*WIDTH-1:0] group_records;
  wire unused = &{1'b0, every[ALL], every_record[(ALL+1)*WIDTH-1:ALL*WIDTH], every_from, every_first, some[GROUPS-1]};
  assign from  = every_from[PLACES-1:0];
  assign first = every_first[PLACES-1:0];

  genvar g;
  generate
    for (g = 0; g < GROUPS; g = g + 1) begin : g_group
      wire [7:0] mine  = every[8*g +: 8];
      wire [7:0] since = {|mine[7:0], |mine[6:0], |mine[5:0], |mine[4:0], |mine[3:0], |mine[2:0], |mine[1:0], mine[0]};
      wire [7:0] one   = mine & ~{since[6:0], 1'b0};
      wire       later;                     // a group in front of this one has it
      if (g == 0) begin : g_none
        assign later = 1'b0;
      end else begin : g_some
        assign later = |some[g-1:0];
      end
      assign some[g]             = since[7];
      assign every_from[8*g +: 8]  = since | {8{later}};
      assign every_first[8*g +: 8] = one & {8{~later}};
      reg [WIDTH-1:0] its;
      integer k;
      always @* begin
        its = {WIDTH{1'b0}};
        for (k = 0; k < 8; k = k + 1) its = its | (every_record[WIDTH*(8*g+k) +: WIDTH] & {WIDTH{one[k]}});
      end
      assign group_records[WIDTH*g +: WIDTH] = its & {WIDTH{~later}};
    end
  endgenerate

  integer n;
  always @* begin
    record = {WIDTH{1'b0}};
    for (n = 0; n < GROUPS; n = n + 1) record = record | group_records[WIDTH*n +: WIDTH];
  end
endmodule

`default_nettype wire
