//! Provides memory for DMA: buffers with an owner, and the memory that they are cut from.

use std::fmt;

use super::{Access, DmaMemory, Result, SharedMemory};

pub(crate) mod buffer;
pub(crate) mod copy;
pub(crate) mod guard;
pub(crate) mod pool;
pub(crate) mod reserved;
pub(crate) mod sync_mode;
pub(crate) mod u_dma_buf;
pub(crate) mod volatile;

/// How the CPU sees the buffers of a u-dma-buf.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[non_exhaustive]
pub enum Caching {
    /// Through its caches, with maintenance when a buffer changes hands: best for reading results.
    #[default]
    Cached,
    /// Past its caches, stores combined: no maintenance, slow to read.
    WriteCombining,
}

/// Memory for DMA, in pieces that belong to the CPU or to the device.
///
/// A piece is addressed by the bus address of its first byte, as `allocate` returned it.
pub(crate) trait DmaMemorySource: fmt::Debug + Send + Sync {
    /// The name by which its user knows it.
    fn name(&self) -> &str;
    /// Bus address and length of the whole, if it is one piece.
    fn extent(&self) -> Option<(u64, u64)> {
        None
    }
    /// Contiguous memory, aligned to 64 bytes on the bus, owned by the CPU.
    fn allocate(&self, beats: usize) -> Result<(u64, DmaMemory)>;
    /// Coherent words that both sides may touch at any time.
    fn allocate_shared(&self, words: usize) -> Result<(u64, SharedMemory)>;
    /// Gives memory to the device, which will touch its first `used` beats.
    fn hand_over(&self, at: u64, memory: DmaMemory, used: usize, access: Access) -> Result<()>;
    /// Takes memory back that the device has finished with.
    fn take_back(&self, address: u64) -> Result<DmaMemory>;
    /// Frees memory that the CPU owns, or shared words that no engine runs on.
    fn release(&self, address: u64) -> Result<()>;
}
