//! Opens memory that the device tree reserves for DMA and the kernel does not map.
//!
//! The CPU maps it as Device memory: whole aligned beats only, through [`super::copy`].

use std::io;
use std::sync::Arc;

use bytemuck::allocation::try_zeroed_slice_box;
use pgs_interface::address_map::UIO_MEMORY_MAP;
use pgs_interface::record::{BEAT_BYTES, Beat};

use super::copy::{load_beats, store_beats};
use super::pool::Region;
use crate::platform::linux::mapped::Mapping;
use crate::platform::{
    Access, DmaMemory, PlatformError, Result, SharedMemory, System, UioDevice, acquire_from_device,
    release_to_device,
};

/// A contiguous piece of physical memory for DMA, mapped as Device memory.
///
/// Its device file is locked as long as it exists, and a store needs `&mut self`: no two threads
/// meet at a beat.
#[derive(Debug)]
pub struct ReservedMemory {
    mapping: Arc<Mapping>,
    address: u64,
    name: String,
}

impl ReservedMemory {
    /// Maps the memory of the UIO node of that name on this system: its map `memory`, or the only
    /// one that it has.
    ///
    /// # Errors
    /// As [`UioDevice::open`], [`PlatformError::Misaligned`] for memory between beats, and
    /// [`PlatformError::RegionLength`] if the end of the memory is not known.
    pub fn open(name: &str) -> Result<Self, PlatformError> {
        Self::open_in(&System::default(), name)
    }

    /// The same on a system whose files lie elsewhere.
    ///
    /// # Errors
    /// As [`Self::open`].
    pub fn open_in(system: &System, name: &str) -> Result<Self, PlatformError> {
        let device = UioDevice::open_in(system, name)?;
        let window = device.map(device.node().map_or_only(UIO_MEMORY_MAP)?)?;
        let address = window.address();
        Self::new(window.into_mapping(), address, name.to_owned())
    }

    /// Memory that was mapped, at that physical address.
    pub(crate) fn new(mapping: Mapping, address: u64, name: String) -> Result<Self> {
        if !address.is_multiple_of(BEAT_BYTES as u64) {
            return Err(PlatformError::Misaligned { region: name, address });
        }
        Ok(Self { mapping: Arc::new(mapping), address, name })
    }

    /// Physical address of its first byte, for a DMA engine.
    #[must_use]
    pub fn address(&self) -> u64 {
        self.address
    }

    /// Its length, bytes.
    #[must_use]
    pub fn bytes(&self) -> u64 {
        self.mapping.bytes() as u64
    }

    /// Copies `beats` to byte `at`, a multiple of 16. The device sees them after the next register
    /// write.
    ///
    /// # Errors
    /// [`PlatformError::OutOfRegion`] if they do not lie in the memory, or between its beats.
    pub fn write(&mut self, at: u64, beats: &[Beat]) -> Result<(), PlatformError> {
        self.store(at, beats)
    }

    /// For the only holder of these beats.
    fn store(&self, at: u64, beats: &[Beat]) -> Result<()> {
        let at = self.checked(at, beats.len())?;
        store_beats(&*self.mapping, at, beats);
        release_to_device();
        Ok(())
    }

    /// Copies `beats` from byte `at`, a multiple of 16: the device's stores up to the completion
    /// that a register has shown.
    ///
    /// # Errors
    /// [`PlatformError::OutOfRegion`] if they do not lie in the memory, or between its beats.
    pub fn read(&self, at: u64, beats: &mut [Beat]) -> Result<(), PlatformError> {
        let at = self.checked(at, beats.len())?;
        acquire_from_device();
        load_beats(&*self.mapping, at, beats);
        Ok(())
    }

    fn checked(&self, at: u64, beats: usize) -> Result<usize> {
        let bytes = (beats as u64).saturating_mul(BEAT_BYTES as u64);
        let inside = at.checked_add(bytes).is_some_and(|end| end <= self.bytes());
        match usize::try_from(at) {
            Ok(place) if inside && place % BEAT_BYTES == 0 => Ok(place),
            _ => Err(PlatformError::OutOfRegion {
                region: self.name.clone(),
                at,
                bytes,
                region_bytes: self.bytes(),
            }),
        }
    }
}

/// The CPU works on the heap, and a hand-over copies. Shared words take aligned 32-bit accesses,
/// which Device memory allows. The pool gives each piece to one holder: no two threads meet at a
/// beat here either.
impl Region for ReservedMemory {
    fn name(&self) -> &str {
        &self.name
    }

    fn address(&self) -> u64 {
        self.address
    }

    fn bytes(&self) -> u64 {
        ReservedMemory::bytes(self)
    }

    fn memory(&self, _: usize, beats: usize) -> Result<DmaMemory> {
        let heap = try_zeroed_slice_box(beats).map_err(|()| PlatformError::Memory {
            act: "allocate",
            what: "beats",
            value: beats as u64,
            source: Box::new(io::Error::from(io::ErrorKind::OutOfMemory)),
        })?;
        Ok(DmaMemory::Heap(heap))
    }

    fn shared(&self, at: usize, words: usize) -> Result<SharedMemory> {
        Ok(SharedMemory::Mapped { mapping: Arc::clone(&self.mapping), at, words })
    }

    fn to_device(&self, at: usize, memory: &DmaMemory, used: usize, access: Access) -> Result<()> {
        match access {
            Access::Read => self.store(at as u64, &memory.beats()[..used]),
            Access::Write => Ok(()),
        }
    }

    fn to_cpu(&self, at: usize, memory: &mut DmaMemory, used: usize, access: Access) -> Result<()> {
        match access {
            Access::Read => Ok(()),
            Access::Write => self.read(at as u64, &mut memory.beats_mut()[..used]),
        }
    }
}

#[cfg(test)]
pub(crate) mod fake {
    //! Reserved memory that is a file.

    use super::*;
    use crate::platform::uio_fake::{add_node, empty_system};

    /// The same memory from the side of the device.
    pub(crate) fn as_the_device(memory: &ReservedMemory) -> ReservedMemory {
        let ReservedMemory { mapping, address, name } = memory;
        ReservedMemory { mapping: Arc::clone(mapping), address: *address, name: name.clone() }
    }

    /// Memory of `bytes` bytes at `address`; it lasts as long as the folder.
    pub(crate) fn reserved(address: u64, bytes: u64) -> (tempfile::TempDir, ReservedMemory) {
        let (root, system) = empty_system();
        add_node(&system, 0, "pgs-memory", &[("memory", address, bytes)]);
        let memory = ReservedMemory::open_in(&system, "pgs-memory").expect("mapped");
        (root, memory)
    }
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::*;
    use crate::platform::uio_fake::{add_node, add_reg, empty_system};

    fn memory() -> (tempfile::TempDir, System) {
        let (root, system) = empty_system();
        add_node(&system, 0, "other", &[("memory", 0x1000_0000, 0x1000)]);
        add_node(&system, 1, "pgs-memory", &[("buffer@60000000", 0x6000_0000, 0x2000)]);
        (root, system)
    }

    #[test]
    fn beats_lie_in_physical_memory_where_the_address_says() {
        let (_root, system) = memory();
        let mut memory = ReservedMemory::open_in(&system, "pgs-memory").expect("mapped");
        assert_eq!((memory.address(), memory.bytes()), (0x6000_0000, 0x2000));
        let beats = [Beat([1, 2, 3, 4]), Beat([5, 6, 7, 8])];
        memory.write(0x1FE0, &beats).expect("inside");
        let file = fs::read(system.dev.join("uio1")).expect("read");
        let words: Vec<u8> = (1..=8_u32).flat_map(u32::to_le_bytes).collect();
        assert_eq!(file[0x1FE0..0x2000], words[..]);
        let mut back = [Beat::default(); 2];
        memory.read(0x1FE0, &mut back).expect("inside");
        assert_eq!(back, beats);
    }

    #[test]
    fn what_lies_outside_or_between_beats_is_refused_and_not_touched() {
        let (_root, system) = memory();
        let mut memory = ReservedMemory::open_in(&system, "pgs-memory").expect("mapped");
        let mut beats = [Beat([9; 4]); 2];
        for at in [8, 0x1FF0, 0x2000, u64::MAX - 15] {
            let error = memory.write(at, &beats).expect_err("refused");
            assert!(matches!(error, PlatformError::OutOfRegion { bytes: 32, .. }), "{error}");
            memory.read(at, &mut beats).expect_err("refused");
        }
        let file = fs::read(system.dev.join("uio1")).expect("read");
        assert!(file.iter().all(|byte| *byte == 0));
    }

    #[test]
    fn memory_has_one_user_also_after_its_node_was_closed() {
        let (_root, system) = memory();
        let memory = ReservedMemory::open_in(&system, "pgs-memory").expect("mapped");
        let error = ReservedMemory::open_in(&system, "pgs-memory").expect_err("in use");
        assert!(
            matches!(&error, PlatformError::Busy { path } if path.ends_with("uio1")),
            "{error}"
        );
        ReservedMemory::open_in(&system, "other").expect("another one");
        // A piece from the pool keeps it, too.
        let words = memory.shared(0, 4).expect("inside");
        drop(memory);
        ReservedMemory::open_in(&system, "pgs-memory").expect_err("a ring is left");
        drop(words);
        ReservedMemory::open_in(&system, "pgs-memory").expect("nobody has it");
    }

    #[test]
    fn a_reservation_that_is_no_whole_pages_is_not_overrun() {
        let (_root, system) = memory();
        add_reg(&system, 1, &[(0x6000_0000, 0x1050)]);
        let mut memory = ReservedMemory::open_in(&system, "pgs-memory").expect("mapped");
        assert_eq!(memory.bytes(), 0x1050);
        memory.write(0x1040, &[Beat([1; 4])]).expect("the last beat");
        memory.write(0x1050, &[Beat([1; 4])]).expect_err("behind the reservation");
        drop(memory);
        add_reg(&system, 1, &[(0x6000_0000, 0x1000), (0x6000_1000, 0x1000)]);
        let error = ReservedMemory::open_in(&system, "pgs-memory").expect_err("which end?");
        let (kernel, found) = (0x2000, Some(0x1000));
        assert!(
            matches!(
                error,
                PlatformError::RegionLength { kernel: k, found: f, .. } if (k, f) == (kernel, found)
            ),
            "{error}"
        );
    }

    #[test]
    fn memory_between_beats_is_refused() {
        let (_root, system) = memory();
        fs::write(system.uio.join("uio1/maps/map0/addr"), "0x60000008\n").expect("written");
        let error = ReservedMemory::open_in(&system, "pgs-memory").expect_err("between beats");
        assert!(matches!(error, PlatformError::Misaligned { .. }), "{error}");
    }
}
