// The accumulated impulses: four words a collision, read and written in the order of the records.
//
//                      word 0          word 1      word 2      word 3
//   contact passes     L_0             L_1         L_2         L_3
//   last one writes    their total     L_1         L_2         L_3
//   friction passes    the total       G_0         G_1
//
// All start at 0. Nothing clears the memory: the first pass of a kind reads 0 instead of it. In a warm pass
// the given impulses of a collision are written as its record enters the pipeline, in the cycle of a slot in
// which no result is written, and read in the place of the 0. A test of the generator holds that they are
// there in time.
`default_nettype none

module pgs_impulses #(
  parameter integer COLLISIONS     = 131072,
  parameter integer COLLISION      = 17,
  parameter integer ADDRESS_STAGES = 2,
  parameter integer OUTPUT_STAGES  = 3
) (
  input  wire         clk,
  input  wire         begin_pass,       // both counters go back to the first collision
  input  wire         friction,
  input  wire         first_of_kind,
  input  wire         warm,             // the first pass of its kind takes the given impulses
  input  wire         last_contact,
  input  wire         no_contacts,      // the step has no contact pass, so that all totals are 0

  input  wire         read,             // the next collision; its impulses follow the latency later
  output wire [31:0]  impulse0,         // L_0, or the total
  output wire [31:0]  impulse1,         // L_1, or G_0
  output wire [31:0]  impulse2,         // L_2, or G_1
  output wire [31:0]  impulse3,         // L_3

  input  wire         give,             // never together with `write`
  input  wire [127:0] given,            // L_3 .. L_0, or G_1 and G_0

  input  wire         write,
  input  wire [127:0] solved,           // L_3 .. L_0; in a friction pass G_1 and G_0 in the middle
  input  wire [31:0]  contact_total
);
  reg  [COLLISION-1:0] next_read, next_given, next_write, write_address;
  reg                  write_outer, write_inner;
  reg  [63:0]          outer_in, inner_in;      // words 3 and 0; words 2 and 1
  wire [63:0]          outer, inner;

  always @(posedge clk) begin
    if (begin_pass) next_read <= {COLLISION{1'b0}};
    else if (read) next_read <= next_read + 1'b1;
    if (begin_pass) next_given <= {COLLISION{1'b0}};
    else if (give) next_given <= next_given + 1'b1;
    if (begin_pass) next_write <= {COLLISION{1'b0}};
    else if (write) next_write <= next_write + 1'b1;
    write_address <= give ? next_given : next_write;
    write_outer   <= (give | write) & ~friction;
    write_inner   <= give | write;
    outer_in      <= give ? {given[127:96], given[31:0]}
                   : {solved[127:96], last_contact ? contact_total : solved[31:0]};
    inner_in      <= give ? (friction ? given[63:0] : given[95:32]) : solved[95:32];
  end

  // A pass writes both words of a memory or none. Port A writes, port B reads.
  wire [63:0] unused_outer, unused_inner;
  wire        unused = &{1'b0, unused_outer, unused_inner};
  pgs_true_dual_port #(
    .WIDTH(64), .DEPTH(COLLISIONS), .ADDRESS(COLLISION),
    .ADDRESS_STAGES(ADDRESS_STAGES), .OUTPUT_STAGES(OUTPUT_STAGES), .READS_A(0)
  ) outer_words (
    .clk(clk), .write_a(write_outer), .address_a(write_address), .in_a(outer_in), .out_a(unused_outer),
    .write_b(1'b0), .address_b(next_read), .in_b(64'd0), .out_b(outer)
  );
  pgs_true_dual_port #(
    .WIDTH(64), .DEPTH(COLLISIONS), .ADDRESS(COLLISION),
    .ADDRESS_STAGES(ADDRESS_STAGES), .OUTPUT_STAGES(OUTPUT_STAGES), .READS_A(0)
  ) inner_words (
    .clk(clk), .write_a(write_inner), .address_a(write_address), .in_a(inner_in), .out_a(unused_inner),
    .write_b(1'b0), .address_b(next_read), .in_b(64'd0), .out_b(inner)
  );

  wire all_are_zero  = first_of_kind & ~warm;
  wire total_is_zero = friction ? no_contacts : all_are_zero;
  assign impulse0 = total_is_zero ? 32'd0 : outer[31:0];
  assign impulse1 = all_are_zero ? 32'd0 : inner[31:0];
  assign impulse2 = all_are_zero ? 32'd0 : inner[63:32];
  assign impulse3 = all_are_zero ? 32'd0 : outer[63:32];
endmodule

`default_nettype wire
