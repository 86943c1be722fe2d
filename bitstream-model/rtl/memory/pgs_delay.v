// Delay of SLOTS issue slots: what is at `d` in a cycle with `enable` is at `q` from the next cycle
// on after SLOTS such cycles.
//
// Up to SHIFT_SLOTS slots are a shift register without reset, which tools map to SRLs; longer
// delays are a memory with a pointer and an output register.
`default_nettype none

module pgs_delay #(
  parameter integer WIDTH = 32,
  parameter integer SLOTS = 1,
  parameter integer SHIFT_SLOTS = 33
) (
  input wire clk,
  input wire enable,
  input wire [WIDTH-1:0] d,
  output wire [WIDTH-1:0] q
);
  generate
    if (SLOTS == 1) begin : g_register
      reg [WIDTH-1:0] value;
      always @(posedge clk) if (enable) value <= d;
      assign q = value;
    end else if (SLOTS <= SHIFT_SLOTS) begin : g_shift
      reg [WIDTH*SLOTS-1:0] line;
      always @(posedge clk) if (enable) line <= {line[WIDTH*(SLOTS-1)-1:0], d};
      assign q = line[WIDTH*SLOTS-1 : WIDTH*(SLOTS-1)];
    end else begin : g_memory
      localparam LAST    = SLOTS - 2;
      localparam POINTER = (LAST < 64) ? 6 : (LAST < 128) ? 7 : (LAST < 256) ? 8 : 9;
      reg [WIDTH-1:0] line [0:LAST];
      reg [WIDTH-1:0] value;
      reg [POINTER-1:0] at = {POINTER{1'b0}};
      always @(posedge clk) if (enable) begin
        value <= line[at];
        line[at] <= d;
        at <= (at == LAST[POINTER-1:0]) ? {POINTER{1'b0}} : at + 1'b1;
      end
      assign q = value;
    end
  endgenerate
endmodule

`default_nettype wire
