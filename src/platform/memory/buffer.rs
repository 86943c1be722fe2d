//! Tracks by type whether the CPU or the device owns a DMA buffer.
//!
//! ```text
//! CpuBuffer --into_device--> DeviceBuffer     no slice of it exists, only bus addresses
//!     ^                        |
//!     +------- into_cpu -------+            once the device has finished with it
//! ```
//!
//! A dropped [`CpuBuffer`] is freed. A dropped [`DeviceBuffer`] is not: the device may still reach
//! it.

use std::sync::Arc;

use pgs_interface::fence::Fence;
use pgs_interface::record::{BEAT_BYTES, Beat};
use pgs_support::Process;

use crate::platform::{
    Access, DmaMemory, Platform, PlatformError, Result, SharedMemory, acquire_from_device,
    release_to_device,
};

/// An address that a DMA core may be given: it lies inside memory of this driver.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct BusAddress(u64);

impl BusAddress {
    /// All bits.
    pub(crate) const fn raw(self) -> u64 {
        self.0
    }

    /// Bits 31:0.
    #[allow(clippy::cast_possible_truncation, reason = "the other half is high()")]
    pub(crate) const fn low(self) -> u32 {
        self.0 as u32
    }

    /// Bits 63:32.
    pub(crate) const fn high(self) -> u32 {
        (self.0 >> 32) as u32
    }
}

/// The memory that the DMA cores of a bitstream reach.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Reach {
    /// Bits of their bus addresses.
    pub(crate) address_width: u32,
    /// The segment that holds them, if the bitstream has a fence.
    pub(crate) fence: Option<Fence>,
}

impl Reach {
    /// Refuses memory of `region` that the cores do not reach.
    pub(crate) fn check(self, region: &str, address: u64, bytes: u64) -> Result<()> {
        let Self { address_width, fence } = self;
        let end = address.checked_add(bytes);
        let reachable = match 1u64.checked_shl(address_width) {
            Some(limit) => end.is_some_and(|end| end <= limit),
            None => end.is_some(),
        };
        if !reachable {
            return Err(PlatformError::OutOfReach { address, bytes, address_width });
        }
        match fence {
            Some(fence) if !fence.contains(address, bytes) => {
                let region = region.to_owned();
                Err(PlatformError::OutsideFence { region, address, bytes, fence })
            }
            _ => Ok(()),
        }
    }
}

#[cfg(test)]
impl From<u32> for Reach {
    fn from(address_width: u32) -> Self {
        Self { address_width, fence: None }
    }
}

/// Who frees the memory when it is dropped.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Owner {
    Cpu,
    Device,
}

/// Memory of the platform, released on drop unless the device owns it.
#[derive(Debug)]
struct Allocation {
    platform: Arc<dyn Platform>,
    address: u64,
    bytes: u64,
    owner: Owner,
    process: Process,
}

impl Allocation {
    fn new(platform: &Arc<dyn Platform>, address: u64, bytes: u64, reach: Reach) -> Result<Self> {
        let platform = Arc::clone(platform);
        let this = Self { platform, address, bytes, owner: Owner::Cpu, process: Process::this() };
        reach.check(this.platform.memory().name(), address, bytes)?;
        Ok(this)
    }

    fn range(&self, offset: u64, bytes: u64) -> Result<BusAddress> {
        match offset.checked_add(bytes) {
            Some(end) if end <= self.bytes => Ok(BusAddress(self.address + offset)),
            _ => Err(PlatformError::OutOfBuffer { offset, bytes, buffer_bytes: self.bytes }),
        }
    }
}

impl Drop for Allocation {
    fn drop(&mut self) {
        if !self.process.is_this() {
            // A forked child: the board's memory is its parent's, and a lock on it may be held.
            return;
        }
        let Self { address, bytes, .. } = *self;
        match self.owner {
            Owner::Cpu => {
                if let Err(error) = self.platform.memory().release(address) {
                    log::error!("cannot free {bytes} bytes of DMA memory at {address:#x}: {error}");
                }
            }
            Owner::Device => log::error!(
                "{bytes} bytes of DMA memory at {address:#x} are left to the device, which may \
                 still reach them"
            ),
        }
    }
}

/// A buffer that the CPU owns.
#[derive(Debug)]
pub(crate) struct CpuBuffer {
    // Dropped before the allocation, whose drop frees the memory for others.
    memory: DmaMemory,
    allocation: Allocation,
}

impl CpuBuffer {
    /// A buffer of `beats` within reach.
    pub(crate) fn allocate(
        platform: &Arc<dyn Platform>,
        beats: usize,
        reach: Reach,
    ) -> Result<Self> {
        let (address, memory) = platform.memory().allocate(beats)?;
        let bytes = (memory.beats().len() as u64) * BEAT_BYTES as u64;
        let allocation = Allocation::new(platform, address, bytes, reach)?;
        Ok(Self { memory, allocation })
    }

    /// The beats.
    pub(crate) fn beats(&self) -> &[Beat] {
        self.memory.beats()
    }

    /// The beats, to write.
    pub(crate) fn beats_mut(&mut self) -> &mut [Beat] {
        self.memory.beats_mut()
    }

    /// Leaves the buffer to the device for good: an engine could not be stopped.
    pub(crate) fn leave_to_device(mut self) {
        self.allocation.owner = Owner::Device;
    }

    /// Gives the buffer to the device, which will touch its first `used` beats.
    pub(crate) fn into_device(self, used: usize, access: Access) -> Result<DeviceBuffer> {
        let Self { memory, mut allocation } = self;
        allocation.owner = Owner::Device;
        let source = allocation.platform.memory();
        source.hand_over(allocation.address, memory, used, access)?;
        release_to_device();
        Ok(DeviceBuffer { allocation })
    }
}

/// A buffer that the device owns.
#[derive(Debug)]
pub(crate) struct DeviceBuffer {
    allocation: Allocation,
}

impl DeviceBuffer {
    /// Where `bytes` from `offset` lie for the device.
    pub(crate) fn range(&self, offset: u64, bytes: u64) -> Result<BusAddress> {
        self.allocation.range(offset, bytes)
    }

    /// Takes the buffer back. Only for a buffer whose descriptors are all complete, or whose core
    /// was reset.
    pub(crate) fn into_cpu(self) -> Result<CpuBuffer> {
        let Self { mut allocation } = self;
        acquire_from_device();
        let memory = allocation.platform.memory().take_back(allocation.address)?;
        allocation.owner = Owner::Cpu;
        Ok(CpuBuffer { memory, allocation })
    }
}

/// Coherent 32-bit words that CPU and device may both touch: descriptors.
#[derive(Debug)]
pub(crate) struct SharedWords {
    words: SharedMemory,
    allocation: Allocation,
}

impl SharedWords {
    /// `words` zeroed words.
    pub(crate) fn allocate(
        platform: &Arc<dyn Platform>,
        words: usize,
        reach: Reach,
    ) -> Result<Self> {
        let (address, memory) = platform.memory().allocate_shared(words)?;
        let bytes = (memory.len() as u64) * 4;
        let allocation = Allocation::new(platform, address, bytes, reach)?;
        let this = Self { words: memory, allocation };
        for index in 0..words {
            this.write(index, 0);
        }
        Ok(this)
    }

    /// One load.
    pub(crate) fn read(&self, index: usize) -> u32 {
        self.words.load(index)
    }

    /// One store.
    pub(crate) fn write(&self, index: usize, value: u32) {
        self.words.store(index, value);
    }

    /// Where `count` words from `index` lie for the device.
    pub(crate) fn range(&self, index: usize, count: usize) -> Result<BusAddress> {
        self.allocation.range(index as u64 * 4, count as u64 * 4)
    }

    /// Bus address of a word, to compare with an engine's CURDESC.
    pub(crate) fn address(&self, index: usize) -> u64 {
        self.allocation.address.saturating_add(index as u64 * 4)
    }

    /// Leaves the words to the device for good: an engine could not be stopped.
    pub(crate) fn leave_to_device(&mut self) {
        self.allocation.owner = Owner::Device;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::platform::registers::window::fake::FakePlatform;

    fn platform() -> (Arc<FakePlatform>, Arc<dyn Platform>) {
        let fake = Arc::new(FakePlatform::default());
        (Arc::clone(&fake), fake)
    }

    #[test]
    fn a_buffer_comes_back_with_its_beats_and_is_freed_once() {
        let (fake, platform) = platform();
        let mut buffer = CpuBuffer::allocate(&platform, 4, 40.into()).expect("in reach");
        buffer.beats_mut()[3] = Beat([1, 2, 3, 4]);
        let device = buffer.into_device(4, Access::Read).expect("handed over");
        assert_eq!(fake.device.lock().expect("unpoisoned").len(), 1);
        let back = device.into_cpu().expect("handed over before");
        assert_eq!(back.beats()[3], Beat([1, 2, 3, 4]));
        drop(back);
        assert_eq!(*fake.released.lock().expect("unpoisoned"), [0x8_0000_0000]);
    }

    #[test]
    fn a_buffer_dropped_with_the_device_is_not_freed() {
        let (fake, platform) = platform();
        let buffer = CpuBuffer::allocate(&platform, 4, 40.into()).expect("in reach");
        drop(buffer.into_device(4, Access::Write).expect("handed over"));
        assert!(fake.released.lock().expect("unpoisoned").is_empty());
    }

    #[test]
    fn a_buffer_that_is_left_to_the_device_is_not_freed() {
        let (fake, platform) = platform();
        CpuBuffer::allocate(&platform, 4, 40.into()).expect("in reach").leave_to_device();
        let mut words = SharedWords::allocate(&platform, 16, 40.into()).expect("in reach");
        words.leave_to_device();
        drop(words);
        assert!(fake.released.lock().expect("unpoisoned").is_empty());
    }

    #[test]
    fn an_address_outside_the_buffer_cannot_be_made() {
        let (_, platform) = platform();
        let buffer = CpuBuffer::allocate(&platform, 4, 40.into()).expect("in reach");
        let device = buffer.into_device(4, Access::Read).expect("handed over");
        let address = device.range(16, 48).expect("inside");
        assert_eq!((address.low(), address.high()), (16, 8));
        assert!(matches!(device.range(16, 49), Err(PlatformError::OutOfBuffer { .. })));
        assert!(matches!(device.range(u64::MAX, 16), Err(PlatformError::OutOfBuffer { .. })));
    }

    #[test]
    fn memory_out_of_the_cores_reach_is_refused_and_freed() {
        let (fake, platform) = platform();
        let refused = CpuBuffer::allocate(&platform, 4, 32.into());
        assert!(matches!(refused, Err(PlatformError::OutOfReach { address_width: 32, .. })));
        assert_eq!(fake.released.lock().expect("unpoisoned").len(), 1);
        assert!(SharedWords::allocate(&platform, 16, 64.into()).is_ok());
    }

    #[test]
    fn memory_outside_the_fence_is_refused_by_name_and_freed() {
        let (fake, platform) = platform();
        // The platform's memory begins at 0x8_0000_0000.
        let reach =
            |text: &str| Reach { address_width: 40, fence: Some(text.parse().expect("a fence")) };
        let error = SharedWords::allocate(&platform, 16, reach("0x50000000+64M"));
        let text = error.expect_err("outside").to_string();
        for part in ["\"fake\"", "64 bytes at 0x800000000", "0x50000000+64M", "--memory"] {
            assert!(text.contains(part), "{part}: {text}");
        }
        assert_eq!(fake.released.lock().expect("unpoisoned").len(), 1);
        let inside = CpuBuffer::allocate(&platform, 4, reach("0x800000000+64K")).expect("inside");
        // A buffer that begins inside and ends behind it.
        let error = CpuBuffer::allocate(&platform, 4096, reach("0x800000000+64K"));
        assert!(matches!(error, Err(PlatformError::OutsideFence { bytes: 0x1_0000, .. })));
        drop(inside);
    }
}
