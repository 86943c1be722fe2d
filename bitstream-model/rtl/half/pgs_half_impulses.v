// The accumulated impulses of every first, or every second, collision of a pair: four words of binary16 a collision,
// read and written in the order of the records.
//
//                      word 0    word 1    word 2    word 3
//   contact passes     L_0       L_1       L_2       L_3
//   last one writes    L_0       L_1       L_2       their total
//   friction passes    G_0       G_1                 the total
//
// All start at 0. Nothing clears the memory: the first pass of a kind reads 0 instead of it. In a warm pass
// the given impulses of a collision are written as its record enters the pipeline, in a cycle of a slot in
// which no result is written, and read in the place of the 0.
`default_nettype none

module pgs_half_impulses #(
  parameter integer COLLISIONS     = 65536,
  parameter integer COLLISION      = 16,
  parameter integer ADDRESS_STAGES = 2,
  parameter integer OUTPUT_STAGES  = 3     // the last one holds the words for a slot
) (
  input  wire         clk,
  input  wire         slot_ends,
  input  wire         begin_pass,       // the counters go back to the first collision
  input  wire         friction,
  input  wire         first_of_kind,
  input  wire         warm,             // the first pass of its kind takes the given impulses
  input  wire         last_contact,
  input  wire         no_contacts,      // the step has no contact pass, so that all totals are 0

  input  wire         read,             // the next collision; its impulses follow the latency later
  output wire [63:0]  impulses,         // L_3 .. L_0, or G_1, G_0 and the total

  input  wire         give,             // never together with `write`
  input  wire [63:0]  given,            // L_3 .. L_0, or G_1 and G_0

  input  wire         write,
  input  wire [63:0]  results,          // L_3 .. L_0, or G_1 and G_0 in words 2 and 1
  input  wire [15:0]  total             // of a contact pass
);
  reg  [COLLISION-1:0] next_read, next_given, next_write, write_address;
  reg                  write_low, write_high;
  reg  [47:0]          low_in;
  reg  [15:0]          high_in;
  wire [47:0]          low;
  wire [15:0]          high;

  always @(posedge clk) begin
    if (begin_pass) next_read <= {COLLISION{1'b0}};
    else if (read) next_read <= next_read + 1'b1;
    if (begin_pass) next_given <= {COLLISION{1'b0}};
    else if (give) next_given <= next_given + 1'b1;
    if (begin_pass) next_write <= {COLLISION{1'b0}};
    else if (write) next_write <= next_write + 1'b1;
    write_address <= give ? next_given : next_write;
    write_low     <= give | write;
    write_high    <= (give | write) & ~friction;
    low_in        <= give ? given[47:0] : friction ? {16'd0, results[47:16]} : results[47:0];
    high_in       <= give ? given[63:48] : last_contact ? total : results[63:48];
  end

  // A pass writes all words of a memory or none. Port A writes, port B reads.
  wire [63:0] unused_words;
  wire        unused = &{1'b0, unused_words};
  pgs_true_dual_port #(
    .WIDTH(48), .DEPTH(COLLISIONS), .ADDRESS(COLLISION),
    .ADDRESS_STAGES(ADDRESS_STAGES), .OUTPUT_STAGES(OUTPUT_STAGES - 1), .READS_A(0)
  ) low_words (
    .clk(clk), .write_a(write_low), .address_a(write_address), .in_a(low_in), .out_a(unused_words[47:0]),
    .write_b(1'b0), .address_b(next_read), .in_b(48'd0), .out_b(low)
  );
  pgs_true_dual_port #(
    .WIDTH(16), .DEPTH(COLLISIONS), .ADDRESS(COLLISION),
    .ADDRESS_STAGES(ADDRESS_STAGES), .OUTPUT_STAGES(OUTPUT_STAGES - 1), .READS_A(0)
  ) high_words (
    .clk(clk), .write_a(write_high), .address_a(write_address), .in_a(high_in), .out_a(unused_words[63:48]),
    .write_b(1'b0), .address_b(next_read), .in_b(16'd0), .out_b(high)
  );

  reg [63:0] held;
  always @(posedge clk) if (slot_ends) held <= {high, low};
  wire all_are_zero  = first_of_kind & ~warm;
  wire total_is_zero = friction ? no_contacts : all_are_zero;
  wire [47:0] kept   = all_are_zero ? 48'd0 : held[47:0];
  wire [15:0] outer  = total_is_zero ? 16'd0 : held[63:48];
  assign impulses = friction ? {16'd0, kept[31:0], outer} : {outer, kept};
endmodule

`default_nettype wire
