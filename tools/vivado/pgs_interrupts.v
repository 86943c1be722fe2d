// The nine interrupts of the design as one: both channels of the four AXI DMAs, and the accelerator.
// All are levels, of two clocks, and the status registers tell which source it was.
`default_nettype none

module pgs_interrupts (
  input  wire mm2s0, mm2s1, mm2s2, mm2s3,
  input  wire s2mm0, s2mm1, s2mm2, s2mm3,
  input  wire accelerator,
  (* X_INTERFACE_INFO = "xilinx.com:signal:interrupt:1.0 irq INTERRUPT" *)
  (* X_INTERFACE_PARAMETER = "SENSITIVITY LEVEL_HIGH" *)
  output wire irq
);
  assign irq = mm2s0 | mm2s1 | mm2s2 | mm2s3 | s2mm0 | s2mm1 | s2mm2 | s2mm3 | accelerator;
endmodule

`default_nettype wire
