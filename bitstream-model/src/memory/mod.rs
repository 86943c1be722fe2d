//! The board's physical memory: every access of the device is checked against the owner of the
//! memory.
//!
//! Memory for DMA is allocated in ranges. A range of beats belongs to the CPU or to the device. The
//! beats of a CPU's buffer are not here at all: handing a buffer over *moves* it into the board, so
//! that an access of the device to a buffer of the CPU is a decode error by construction. Ranges of
//! words (descriptors) are shared for good.
//!
//! A board can be built on external memory instead (`external.rs`); then it allocates none.

pub(crate) mod external;

use std::ops::Range;
use std::sync::Arc;
use std::sync::atomic::{AtomicU32, Ordering};

use bytemuck::allocation::try_zeroed_slice_box;

use self::external::{DeviceMemory, ExternalMemory};
use crate::cast::index;
use crate::config::BoardConfig;
use crate::config::quirks::{Coherency, stale_from};
use pgs_interface::address_map::{DDR_HIGH, DDR_LOW};
use pgs_interface::axi_dma::Direction;
use pgs_interface::record::{BEAT_BYTES, Beat};

/// The device's right to a buffer.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum DeviceAccess {
    /// Read it (MM2S).
    Read,
    /// Write it (S2MM).
    Write,
}

/// A request of the CPU that the memory refuses.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum MemoryError {
    /// The memory has no room for the range.
    #[error("no contiguous memory for {bytes} bytes below {limit:#x}")]
    Exhausted {
        /// Bytes asked for.
        bytes: u64,
        /// The end of the addresses that the DMAs can carry.
        limit: u64,
    },
    /// The system has no room for the buffer.
    #[error(
        "the system has no memory for a buffer of {bytes} bytes: free some, or raise the limit on \
         it (ulimit -v)"
    )]
    System {
        /// Bytes asked for.
        bytes: u64,
    },
    /// No range begins there.
    #[error("no buffer was allocated at {address:#x}")]
    Unknown {
        /// The address.
        address: u64,
    },
    /// The range belongs to the other side, or has another length.
    #[error("the buffer at {address:#x} is not in the state for this: {state}")]
    State {
        /// The address.
        address: u64,
        /// The state that the buffer is in.
        state: &'static str,
    },
}

/// The reason why the device may not touch an address.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum Denied {
    /// No buffer there.
    #[error("no buffer is granted there")]
    Unmapped,
    /// The access leaves the buffer in which it begins.
    #[error("it runs past the end of its buffer")]
    PastEnd,
    /// The CPU owns the buffer.
    #[error("the CPU owns the buffer")]
    CpuOwned,
    /// The buffer was granted for the other direction.
    #[error("the buffer was granted for the other direction")]
    Direction,
    /// Descriptors where data is expected, or data where descriptors are.
    #[error("descriptor memory and data buffers are not interchangeable")]
    Kind,
    /// Memory outside the board that cannot be reached; the log says why.
    #[error("the memory there does not answer")]
    NoAnswer,
}

#[derive(Debug)]
enum Content {
    Cpu,
    /// A buffer of the device, and the number of its first beats that are granted.
    Device(Box<[Beat]>, DeviceAccess, usize),
    Words(Arc<[AtomicU32]>),
}

#[derive(Debug)]
struct Region {
    bytes: u64,
    content: Content,
    /// The buffer as the CPU's caches hold it, if they differ from memory.
    cached: Option<Box<[Beat]>>,
}

/// Bytes between two ranges, so that an access past an end reaches no other range.
const GUARD: u64 = 4096;

/// The indices of `count` beats of a buffer from an offset in bytes on, if all of them are among
/// the first `granted` beats.
fn granted_range(
    beats: &[Beat],
    granted: usize,
    offset: u64,
    count: usize,
) -> Option<Range<usize>> {
    let first = index(offset / BEAT_BYTES as u64);
    let end = first + count;
    (end <= beats.len().min(granted)).then_some(first..end)
}

/// Physical memory.
#[derive(Debug)]
pub(crate) struct Memory {
    /// Sorted by address.
    regions: Vec<(u64, Region)>,
    /// Addresses that were never allocated, on both sides of 4 GiB.
    low: Range<u64>,
    high: Range<u64>,
    /// Released ranges, guard included. They are reused only when no other memory is left, so that
    /// a use after release reaches no other buffer.
    released: Vec<Range<u64>>,
    /// Memory behind the fence, for one range at a time.
    guard: Option<Range<u64>>,
    guard_is_used: bool,
    address_limit: u64,
    next_is_high: bool,
    coherency: Coherency,
    /// External memory, which replaces all ranges.
    external: Option<ExternalMemory>,
}

impl Memory {
    /// Memory of a board.
    pub(crate) fn of(config: &BoardConfig) -> Self {
        let BoardConfig { fence, address_width, quirks, .. } = config;
        let memory = Self::new(*address_width, quirks.coherency);
        let Some(fence) = fence else { return memory };
        let guard = fence.guard().filter(|_| !quirks.no_guard);
        Self { low: fence.base()..fence.end(), high: 0..0, guard, ..memory }
    }

    /// Memory for DMAs with addresses of `address_width` bits.
    pub(crate) fn new(address_width: u32, coherency: Coherency) -> Self {
        // The kernel and the rest of the system keep the first gigabyte of low and the last of
        // high DDR: a high address cut to 32 bits must not reach a buffer.
        const SYSTEM: u64 = 1 << 30;
        Self {
            regions: Vec::new(),
            low: DDR_LOW.start + SYSTEM..DDR_LOW.end,
            high: DDR_HIGH.start..DDR_HIGH.end - SYSTEM,
            released: Vec::new(),
            guard: None,
            guard_is_used: false,
            address_limit: if address_width >= 64 { u64::MAX } else { 1 << address_width },
            next_is_high: false,
            coherency,
            external: None,
        }
    }

    /// Whether the board has memory of its own.
    pub(crate) fn is_own(&self) -> bool {
        self.external.is_none()
    }

    /// Memory outside the board; the device may touch the granted ranges only.
    pub(crate) fn external(memory: Box<dyn DeviceMemory>, granted: Vec<Range<u64>>) -> Self {
        Self {
            regions: Vec::new(),
            low: 0..0,
            high: 0..0,
            released: Vec::new(),
            guard: None,
            guard_is_used: false,
            address_limit: 0,
            next_is_high: false,
            coherency: Coherency::Coherent,
            external: Some(ExternalMemory::new(memory, granted)),
        }
    }

    fn insert(&mut self, bytes: u64, content: Content) -> Result<u64, MemoryError> {
        let taken = bytes.next_multiple_of(GUARD) + GUARD;
        let limit = self.address_limit;
        let fits = |free: &Range<u64>| free.end - free.start >= taken && free.end <= limit;
        // In turn from both sides of 4 GiB, so that no driver works with 32 bits by luck.
        let use_high = if self.next_is_high { fits(&self.high) } else { !fits(&self.low) };
        self.next_is_high = !self.next_is_high;
        let free = if use_high { &mut self.high } else { &mut self.low };
        let free = if fits(free) {
            free
        } else {
            let released = self.released.iter_mut().find(|free| fits(free));
            released.ok_or(MemoryError::Exhausted { bytes, limit })?
        };
        let address = free.start;
        free.start += taken;
        self.place(address, bytes, content);
        Ok(address)
    }

    fn place(&mut self, address: u64, bytes: u64, content: Content) {
        let position = self.regions.partition_point(|(start, _)| *start < address);
        let region = Region { bytes, content, cached: None };
        self.regions.insert(position, (address, region));
    }

    fn insert_in_guard(&mut self, bytes: u64, content: Content) -> Result<u64, MemoryError> {
        let guard = self.guard.clone().unwrap_or_default();
        if self.guard_is_used || bytes > guard.end - guard.start {
            return Err(MemoryError::Exhausted { bytes, limit: guard.end });
        }
        self.guard_is_used = true;
        self.place(guard.start, bytes, content);
        Ok(guard.start)
    }

    /// The memory behind the fence.
    pub(crate) fn guard(&self) -> Option<Range<u64>> {
        self.guard.clone()
    }

    pub(crate) fn allocate_guard(
        &mut self,
        beats: usize,
    ) -> Result<(u64, Box<[Beat]>), MemoryError> {
        let bytes = (beats as u64).saturating_mul(BEAT_BYTES as u64);
        let address = self.insert_in_guard(bytes, Content::Cpu)?;
        Ok((address, vec![Beat::default(); beats].into()))
    }

    pub(crate) fn allocate_guard_shared(
        &mut self,
        words: usize,
    ) -> Result<(u64, Arc<[AtomicU32]>), MemoryError> {
        let bytes = (words as u64).saturating_mul(4);
        let shared: Arc<[AtomicU32]> = (0..words).map(|_| AtomicU32::new(0)).collect();
        let address = self.insert_in_guard(bytes, Content::Words(Arc::clone(&shared)))?;
        Ok((address, shared))
    }

    pub(crate) fn allocate(&mut self, beats: usize) -> Result<(u64, Box<[Beat]>), MemoryError> {
        let bytes = (beats as u64).saturating_mul(BEAT_BYTES as u64);
        if bytes > DDR_LOW.end {
            return Err(MemoryError::Exhausted { bytes, limit: self.address_limit });
        }
        let buffer = try_zeroed_slice_box(beats).map_err(|()| MemoryError::System { bytes })?;
        Ok((self.insert(bytes, Content::Cpu)?, buffer))
    }

    pub(crate) fn allocate_shared(
        &mut self,
        words: usize,
    ) -> Result<(u64, Arc<[AtomicU32]>), MemoryError> {
        let bytes = (words as u64).saturating_mul(4);
        if bytes > DDR_LOW.end {
            return Err(MemoryError::Exhausted { bytes, limit: self.address_limit });
        }
        let shared: Arc<[AtomicU32]> = (0..words).map(|_| AtomicU32::new(0)).collect();
        let address = self.insert(bytes, Content::Words(Arc::clone(&shared)))?;
        Ok((address, shared))
    }

    /// The index of the range that begins at `address`.
    fn index_of_start(&self, address: u64) -> Result<usize, MemoryError> {
        let position = self.regions.binary_search_by_key(&address, |(start, _)| *start);
        position.map_err(|_| MemoryError::Unknown { address })
    }

    fn region_at(&mut self, address: u64) -> Result<&mut Region, MemoryError> {
        let position = self.index_of_start(address)?;
        Ok(&mut self.regions[position].1)
    }

    /// Gives the device the first `granted` beats of a buffer.
    pub(crate) fn hand_over(
        &mut self,
        address: u64,
        beats: Box<[Beat]>,
        granted: usize,
        access: DeviceAccess,
    ) -> Result<(), MemoryError> {
        let coherency = self.coherency;
        let region = self.region_at(address)?;
        if !matches!(region.content, Content::Cpu) {
            return Err(MemoryError::State { address, state: "the CPU does not own it" });
        }
        if (beats.len() * BEAT_BYTES) as u64 != region.bytes {
            return Err(MemoryError::State { address, state: "its length is another" });
        }
        let visible = match (coherency, access) {
            (Coherency::StaleReads { from_byte }, DeviceAccess::Read) => {
                let before = region.cached.replace(beats.clone());
                stale_from(from_byte, beats, before.as_deref())
            }
            (Coherency::StaleWrites { .. }, DeviceAccess::Write) if region.cached.is_some() => {
                region.cached = Some(beats.clone());
                beats
            }
            _ => beats,
        };
        region.content = Content::Device(visible, access, granted);
        Ok(())
    }

    pub(crate) fn take_back(&mut self, address: u64) -> Result<Box<[Beat]>, MemoryError> {
        let coherency = self.coherency;
        let region = self.region_at(address)?;
        match std::mem::replace(&mut region.content, Content::Cpu) {
            Content::Device(beats, access, _) => Ok(match (coherency, access) {
                (Coherency::StaleReads { .. }, DeviceAccess::Read) => {
                    region.cached.clone().unwrap_or(beats)
                }
                (Coherency::StaleWrites { from_byte }, DeviceAccess::Write) => {
                    let seen = stale_from(from_byte, beats, region.cached.as_deref());
                    region.cached = Some(seen.clone());
                    seen
                }
                _ => beats,
            }),
            other => {
                region.content = other;
                Err(MemoryError::State { address, state: "the device does not own it" })
            }
        }
    }

    pub(crate) fn release(&mut self, address: u64) -> Result<(), MemoryError> {
        let position = self.index_of_start(address)?;
        let (_, region) = self.regions.remove(position);
        if self.guard.as_ref().is_some_and(|guard| guard.start == address) {
            self.guard_is_used = false;
            return Ok(());
        }
        self.released.retain(|range| !range.is_empty());
        self.released.push(address..address + region.bytes.next_multiple_of(GUARD) + GUARD);
        Ok(())
    }

    /// The range that holds `address`, and the offset in it.
    fn find(&self, address: u64, bytes: u64) -> Result<(&Region, u64), Denied> {
        let (position, offset) = self.region_index(address, bytes)?;
        Ok((&self.regions[position].1, offset))
    }

    /// The index of the range that holds `address`, and the offset in it.
    fn region_index(&self, address: u64, bytes: u64) -> Result<(usize, u64), Denied> {
        let behind = self.regions.partition_point(|(start, _)| *start <= address);
        let position = behind.checked_sub(1).ok_or(Denied::Unmapped)?;
        let (start, region) = &self.regions[position];
        let offset = address - start;
        if offset >= region.bytes {
            return Err(Denied::Unmapped);
        }
        if bytes > region.bytes - offset {
            return Err(Denied::PastEnd);
        }
        Ok((position, offset))
    }

    /// Beats that the device reads. The address is a multiple of a beat.
    pub(crate) fn beats(&mut self, address: u64, count: usize) -> Result<&[Beat], Denied> {
        if let Some(ref mut external) = self.external {
            return external.read(address, count);
        }
        self.owned(address, count)
    }

    /// Beats that the device reads; `None` where it may not, and in external memory, which may
    /// change at any time. The address is a multiple of a beat.
    pub(crate) fn view(&self, address: u64, count: usize) -> Option<&[Beat]> {
        if self.external.is_some() {
            return None;
        }
        self.owned(address, count).ok()
    }

    /// Beats that the device reads in a buffer that it owns.
    fn owned(&self, address: u64, count: usize) -> Result<&[Beat], Denied> {
        let (region, offset) = self.find(address, (count * BEAT_BYTES) as u64)?;
        match &region.content {
            Content::Cpu => Err(Denied::CpuOwned),
            Content::Words(_) => Err(Denied::Kind),
            Content::Device(_, DeviceAccess::Write, _) => Err(Denied::Direction),
            Content::Device(beats, DeviceAccess::Read, granted) => {
                let range = granted_range(beats, *granted, offset, count).ok_or(Denied::PastEnd)?;
                Ok(&beats[range])
            }
        }
    }

    fn beats_mut(&mut self, address: u64, count: usize) -> Result<&mut [Beat], Denied> {
        let (position, offset) = self.region_index(address, (count * BEAT_BYTES) as u64)?;
        match &mut self.regions[position].1.content {
            Content::Cpu => Err(Denied::CpuOwned),
            Content::Words(_) => Err(Denied::Kind),
            Content::Device(_, DeviceAccess::Read, _) => Err(Denied::Direction),
            Content::Device(beats, DeviceAccess::Write, granted) => {
                let range = granted_range(beats, *granted, offset, count).ok_or(Denied::PastEnd)?;
                Ok(&mut beats[range])
            }
        }
    }

    /// Checks that the device may read or write these beats.
    pub(crate) fn check(
        &mut self,
        direction: Direction,
        address: u64,
        count: usize,
    ) -> Result<(), Denied> {
        match (&self.external, direction) {
            (Some(external), _) => external.check(address, (count * BEAT_BYTES) as u64),
            (None, Direction::Mm2s) => self.owned(address, count).map(drop),
            (None, Direction::S2mm) => self.beats_mut(address, count).map(drop),
        }
    }

    /// Whether the device may write these beats in a buffer that it owns, and the fence is no
    /// matter.
    pub(crate) fn may_write(&self, address: u64, count: usize) -> bool {
        let Ok((region, offset)) = self.find(address, (count * BEAT_BYTES) as u64) else {
            return false;
        };
        let Content::Device(beats, DeviceAccess::Write, granted) = &region.content else {
            return false;
        };
        granted_range(beats, *granted, offset, count).is_some() && !self.guard_is_used
    }

    /// Lets `fill` write beats for the device, if it may write them. The address is a multiple of a
    /// beat.
    pub(crate) fn write(
        &mut self,
        address: u64,
        count: usize,
        fill: impl FnOnce(&mut [Beat]),
    ) -> Result<(), Denied> {
        match &mut self.external {
            Some(external) => external.write(address, count, fill),
            None => self.beats_mut(address, count).map(fill),
        }
    }

    fn words(&self, address: u64, count: usize) -> Result<&[AtomicU32], Denied> {
        let (region, offset) = self.find(address, (count * 4) as u64)?;
        match &region.content {
            Content::Words(words) => {
                let first = index(offset / 4);
                words.get(first..first + count).ok_or(Denied::PastEnd)
            }
            _ => Err(Denied::Kind),
        }
    }

    /// Fetches words of a descriptor for the device. The address is a multiple of 4.
    pub(crate) fn read_words(&mut self, address: u64, to: &mut [u32]) -> Result<(), Denied> {
        if let Some(external) = &mut self.external {
            return external.read_words(address, to);
        }
        let words = self.words(address, to.len())?;
        for (to, from) in to.iter_mut().zip(words) {
            *to = from.load(Ordering::Acquire);
        }
        Ok(())
    }

    /// Updates a word of a descriptor for the device. The address is a multiple of 4.
    pub(crate) fn write_word(&mut self, address: u64, value: u32) -> Result<(), Denied> {
        if let Some(external) = &mut self.external {
            return external.write_word(address, value);
        }
        self.words(address, 1)?[0].store(value, Ordering::Release);
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Every beat of a buffer is granted.
    const ALL: usize = usize::MAX;

    #[test]
    fn a_buffer_of_the_cpu_is_out_of_the_devices_reach() {
        let mut memory = Memory::new(40, Coherency::Coherent);
        let (address, beats) = memory.allocate(4).expect("fits");
        assert_eq!(memory.beats(address, 1).err(), Some(Denied::CpuOwned));
        memory.hand_over(address, beats, ALL, DeviceAccess::Read).expect("the CPU owns it");
        assert_eq!(memory.beats(address, 4).map(<[Beat]>::len), Ok(4));
        assert_eq!(memory.beats_mut(address, 1).err(), Some(Denied::Direction));
        memory.take_back(address).expect("the device owns it");
        assert_eq!(memory.beats(address, 1).err(), Some(Denied::CpuOwned));
    }

    #[test]
    fn one_beat_past_the_end_is_denied() {
        let mut memory = Memory::new(40, Coherency::Coherent);
        let (address, beats) = memory.allocate(4).expect("fits");
        memory.hand_over(address, beats, ALL, DeviceAccess::Read).expect("the CPU owns it");
        assert_eq!(memory.beats(address + 48, 2).err(), Some(Denied::PastEnd));
        assert_eq!(memory.beats(address + 64, 1).err(), Some(Denied::Unmapped));
        assert_eq!(memory.beats(address - 16, 1).err(), Some(Denied::Unmapped));
    }

    #[test]
    fn a_released_buffer_is_gone_and_its_address_is_not_reused() {
        let mut memory = Memory::new(40, Coherency::Coherent);
        let (address, beats) = memory.allocate(4).expect("fits");
        memory.hand_over(address, beats, ALL, DeviceAccess::Write).expect("the CPU owns it");
        memory.release(address).expect("it is there");
        assert_eq!(memory.beats_mut(address, 1).err(), Some(Denied::Unmapped));
        for _ in 0..8 {
            assert_ne!(memory.allocate(4).expect("fits").0, address);
        }
    }

    #[test]
    fn released_memory_is_reused_when_nothing_else_is_left() {
        let mut memory = Memory::new(32, Coherency::Coherent);
        for _ in 0..100 {
            let address = memory.insert(64 << 20, Content::Cpu).expect("released ones are reused");
            memory.release(address).expect("it is there");
        }
    }

    #[test]
    fn buffers_stand_on_both_sides_of_4_gib_unless_addresses_have_32_bits() {
        let mut memory = Memory::new(40, Coherency::Coherent);
        let addresses: Vec<_> = (0..4).map(|_| memory.allocate(1).expect("fits").0).collect();
        assert!(addresses.iter().any(|a| *a < 1 << 32) && addresses.iter().any(|a| *a >= 1 << 32));
        let mut memory = Memory::new(32, Coherency::Coherent);
        assert!((0..4).all(|_| memory.allocate(1).expect("fits").0 < 1 << 32));
        let too_much = (1_usize << 30) / BEAT_BYTES;
        assert!(matches!(memory.allocate(too_much), Err(MemoryError::Exhausted { .. })));
    }

    #[test]
    fn descriptors_are_shared_and_are_no_data() {
        let mut memory = Memory::new(40, Coherency::Coherent);
        let (address, words) = memory.allocate_shared(16).expect("fits");
        words[3].store(7, Ordering::Relaxed);
        let mut read = [0; 2];
        memory.read_words(address + 8, &mut read).expect("granted");
        assert_eq!(read, [0, 7]);
        assert_eq!(memory.read_words(address + 60, &mut read).err(), Some(Denied::PastEnd));
        assert_eq!(memory.beats(address, 1).err(), Some(Denied::Kind));
        memory.write_word(address + 4, 9).expect("granted");
        assert_eq!(words[1].load(Ordering::Relaxed), 9);
    }

    /// Hands beats of `value` over, and lets the device read them or write others. Returns the
    /// words that the device has read, and the words that the CPU finds afterwards.
    fn round(memory: &mut Memory, address: u64, value: u32, access: DeviceAccess) -> [Vec<u32>; 2] {
        let first = |beats: &[Beat]| beats.iter().map(|beat| beat.0[0]).collect::<Vec<_>>();
        let beats = vec![Beat([value; 4]); 8].into();
        memory.hand_over(address, beats, ALL, access).expect("the CPU owns it");
        let read = match access {
            DeviceAccess::Read => first(memory.beats(address, 8).expect("granted")),
            DeviceAccess::Write => {
                memory.beats_mut(address, 8).expect("granted").fill(Beat([value + 100; 4]));
                Vec::new()
            }
        };
        [read, first(&memory.take_back(address).expect("handed over"))]
    }

    #[test]
    fn stale_reads_return_the_previous_hand_over_and_the_cpu_does_not_notice() {
        let mut memory = Memory::new(40, Coherency::StaleReads { from_byte: 64 });
        let (address, _) = memory.allocate(8).expect("fits");
        let mut rounds = (1..=3).map(|v| round(&mut memory, address, v, DeviceAccess::Read));
        assert_eq!(rounds.next(), Some([vec![1; 8], vec![1; 8]]));
        assert_eq!(rounds.next(), Some([vec![2, 2, 2, 2, 1, 1, 1, 1], vec![2; 8]]));
        assert_eq!(rounds.next(), Some([vec![3, 3, 3, 3, 2, 2, 2, 2], vec![3; 8]]));
    }

    #[test]
    fn stale_writes_leave_the_cpu_with_the_beats_that_it_handed_over() {
        let mut memory = Memory::new(40, Coherency::StaleWrites { from_byte: 64 });
        let (address, _) = memory.allocate(8).expect("fits");
        let mut rounds =
            (1..=3).map(|v| round(&mut memory, address, v, DeviceAccess::Write)[1].clone());
        assert_eq!(rounds.next(), Some(vec![101; 8]));
        assert_eq!(rounds.next(), Some(vec![102, 102, 102, 102, 2, 2, 2, 2]));
        assert_eq!(rounds.next(), Some(vec![103, 103, 103, 103, 3, 3, 3, 3]));
    }

    #[test]
    fn only_the_first_beats_of_a_buffer_may_be_granted() {
        let mut memory = Memory::new(40, Coherency::Coherent);
        for access in [DeviceAccess::Read, DeviceAccess::Write] {
            let (address, beats) = memory.allocate(8).expect("there is room");
            memory.hand_over(address, beats, 3, access).expect("the CPU owns it");
            let mut touch = |beat: u64, count| match access {
                DeviceAccess::Read => memory.beats(address + 16 * beat, count).map(|_| ()),
                DeviceAccess::Write => memory.write(address + 16 * beat, count, |_| ()),
            };
            assert_eq!(touch(0, 3), Ok(()));
            for (beat, count) in [(0, 4), (2, 2), (3, 1), (7, 1)] {
                assert_eq!(touch(beat, count), Err(Denied::PastEnd), "{access:?}");
            }
            assert_eq!(memory.take_back(address).expect("it is there").len(), 8);
        }
    }
}
