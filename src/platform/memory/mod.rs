//! Memory for DMA: buffers, where they come from, and who owns them.

pub(crate) mod buffer;
pub(crate) mod copy;
pub(crate) mod pool;
pub(crate) mod reserved;
pub(crate) mod sync_mode;
pub(crate) mod u_dma_buf;
pub(crate) mod volatile;
