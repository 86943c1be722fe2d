//! The driver's AXI DMA against a model that is not ours.

mod qemu;
