//! Keeps the descriptors of one channel in a ring that is linked once and never stopped.
//!
//! ```text
//!   first            tail   spare
//!     v               v       v
//!   [BD]-[BD]-[BD]-[BD]-[BD]-[BD]-.      one step's chain; the next begins after the tail
//!     ^-----------------------------'
//! ```
//!
//! The engine pauses after the tail and may have fetched the tail's link long before: so the links
//! never change. One descriptor stays free, so that the tail never meets the engine from behind.

use std::sync::Arc;

use pgs_interface::descriptor::{CONTROL, NXTDESC, NXTDESC_MSB, STATUS, WORDS, control};

use super::Direction;
use super::descriptor::{Descriptor, DescriptorStatus};
use crate::platform::{BusAddress, Platform, PlatformError, Reach, SharedWords};

/// How far the engine is with a chain.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Progress {
    /// Descriptors are still outstanding.
    Running,
    /// All descriptors are complete.
    Complete {
        /// Bytes moved: the sum of the descriptors' counts.
        bytes: u64,
        /// Whether a received packet ended with the last.
        packet_ended: bool,
    },
    /// A received packet ended before the chain did.
    Short,
    /// A descriptor failed.
    Failed,
}

/// One descriptor of a step's chain.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub struct DescriptorState {
    /// Its place in the chain, from 0.
    pub index: usize,
    /// Where it lies, on the bus.
    pub address: u64,
    /// Bytes that it asks for.
    pub bytes: u32,
    /// Its status word.
    pub status: DescriptorStatus,
}

/// How a whole chain stands, for a diagnosis.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(crate) struct ChainState {
    /// Descriptors in the chain.
    pub(crate) descriptors: usize,
    /// Descriptors complete from its head on.
    pub(crate) complete: usize,
    /// Bytes moved by the complete descriptors and the descriptor after them.
    pub(crate) bytes_moved: u64,
    /// Bytes that the chain asks for.
    pub(crate) bytes_expected: u64,
    /// Where a received packet ended, if it did.
    pub(crate) packet_end: Option<usize>,
    /// The first that failed.
    pub(crate) failed: Option<DescriptorState>,
    /// The first that is not complete.
    pub(crate) in_work: Option<DescriptorState>,
    /// The one at the address asked for.
    pub(crate) at_address: Option<DescriptorState>,
}

/// A ring of descriptors, and the chain of the current step in it.
#[derive(Debug)]
pub(crate) struct Ring {
    words: SharedWords,
    direction: Direction,
    count: usize,
    /// First descriptor of the chain.
    first: usize,
    /// Descriptors in the chain.
    used: usize,
    /// Descriptors at the head of the chain that were seen complete, and their bytes.
    seen: (usize, u64),
}

impl Ring {
    /// A linked ring that takes chains of up to `chain` descriptors.
    pub(crate) fn new(
        platform: &Arc<dyn Platform>,
        direction: Direction,
        chain: usize,
        reach: Reach,
    ) -> Result<Self, PlatformError> {
        let count = chain.max(1) + 1;
        let words = SharedWords::allocate(platform, count * WORDS, reach)?;
        let ring = Self { words, direction, count, first: 0, used: 0, seen: (0, 0) };
        for index in 0..count {
            let next = ring.address_of((index + 1) % count)?;
            ring.words.write(index * WORDS + NXTDESC, next.low());
            ring.words.write(index * WORDS + NXTDESC_MSB, next.high());
        }
        Ok(ring)
    }

    fn address_of(&self, index: usize) -> Result<BusAddress, PlatformError> {
        self.words.range(index * WORDS, WORDS)
    }

    /// Descriptors that a chain may have.
    pub(crate) fn capacity(&self) -> usize {
        self.count - 1
    }

    /// Descriptors in the chain.
    pub(crate) fn used(&self) -> usize {
        self.used
    }

    /// Starts a new chain after the last chain, whose descriptors are all complete.
    pub(crate) fn begin(&mut self) {
        self.first = (self.first + self.used) % self.count;
        self.used = 0;
        self.seen = (0, 0);
    }

    /// Appends a descriptor to the chain.
    pub(crate) fn push(&mut self, descriptor: &Descriptor) {
        assert!(self.used < self.capacity(), "the ring was sized for the chain before it began");
        let index = (self.first + self.used) % self.count;
        for (word, value) in descriptor.words() {
            self.words.write(index * WORDS + word, value);
        }
        self.used += 1;
    }

    /// Where the chain begins.
    pub(crate) fn start(&self) -> Result<BusAddress, PlatformError> {
        self.address_of(self.first)
    }

    /// The last descriptor of the chain; `None` if the chain is empty.
    pub(crate) fn tail(&self) -> Result<Option<BusAddress>, PlatformError> {
        match self.used.checked_sub(1) {
            Some(last) => self.address_of((self.first + last) % self.count).map(Some),
            None => Ok(None),
        }
    }

    /// Looks how far the engine is, from the oldest descriptor that was not seen complete.
    pub(crate) fn progress(&mut self) -> Progress {
        let (mut seen, mut bytes) = self.seen;
        let mut packet_ended = false;
        while seen < self.used {
            let index = (self.first + seen) % self.count;
            let status = DescriptorStatus(self.words.read(index * WORDS + STATUS));
            if status.failed() {
                return Progress::Failed;
            }
            if !status.complete() {
                return Progress::Running;
            }
            seen += 1;
            bytes += u64::from(status.transferred());
            packet_ended = self.ends_packet(status);
            if packet_ended && seen < self.used {
                return Progress::Short;
            }
            // The last descriptor is read again on every call: it shows whether the packet ended.
            if seen < self.used {
                self.seen = (seen, bytes);
            }
        }
        Progress::Complete { bytes, packet_ended }
    }

    /// Whether a received packet ended with a descriptor. Where packets are sent the bit is
    /// reserved.
    fn ends_packet(&self, status: DescriptorStatus) -> bool {
        self.direction == Direction::S2mm && status.packet_ended()
    }

    /// A descriptor of the chain, as it stands in memory.
    fn state(&self, place: usize) -> DescriptorState {
        let index = (self.first + place) % self.count;
        DescriptorState {
            index: place,
            address: self.words.address(index * WORDS),
            bytes: control::LENGTH.of(self.words.read(index * WORDS + CONTROL)),
            status: DescriptorStatus(self.words.read(index * WORDS + STATUS)),
        }
    }

    /// Looks at every descriptor of the chain, and for the one at `address`.
    pub(crate) fn survey(&self, address: u64) -> ChainState {
        let mut chain = ChainState { descriptors: self.used, ..ChainState::default() };
        for place in 0..self.used {
            let state = self.state(place);
            chain.bytes_expected += u64::from(state.bytes);
            if state.address == address {
                chain.at_address = Some(state);
            }
            if chain.in_work.is_some() {
                continue;
            }
            chain.bytes_moved += u64::from(state.status.transferred());
            if state.status.failed() {
                chain.failed.get_or_insert(state);
            }
            if self.ends_packet(state.status) {
                chain.packet_end.get_or_insert(place);
            }
            if state.status.complete() {
                chain.complete = place + 1;
            } else {
                chain.in_work = Some(state);
            }
        }
        chain
    }

    /// Leaves the ring's memory to an engine that could not be stopped.
    pub(crate) fn leave_to_device(&mut self) {
        self.words.leave_to_device();
    }

    #[cfg(test)]
    fn complete(&self, place: usize, status: u32) {
        self.words.write((self.first + place) % self.count * WORDS + STATUS, status);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::platform::fake::FakePlatform;
    use crate::platform::{Access, CpuBuffer};

    const COMPLETE: u32 = 1 << 31;
    const RXEOF: u32 = 1 << 26;

    fn ring(chain: usize) -> (Ring, BusAddress) {
        ring_of(Direction::S2mm, chain)
    }

    fn ring_of(direction: Direction, chain: usize) -> (Ring, BusAddress) {
        let platform: Arc<dyn Platform> = Arc::new(FakePlatform::default());
        let ring = Ring::new(&platform, direction, chain, 40.into()).expect("allocated");
        let buffer = CpuBuffer::allocate(&platform, 16, 40.into()).expect("allocated");
        let buffer = buffer.into_device(16, Access::Read).expect("handed over");
        (ring, buffer.range(0, 256).expect("inside"))
    }

    fn descriptor(address: BusAddress) -> Descriptor {
        Descriptor { address, bytes: 64, starts_packet: true, ends_packet: false }
    }

    #[test]
    fn the_last_descriptor_links_to_the_first() {
        let (ring, _) = ring(3);
        let links: Vec<_> = (0..4).map(|index| ring.words.read(index * 16)).collect();
        assert_eq!(links, [0x40, 0x80, 0xC0, 0x00]);
        assert!((0..4).all(|index| ring.words.read(index * 16 + 1) == 8));
    }

    #[test]
    fn each_chain_begins_after_the_tail_of_the_last_and_wraps() {
        let (mut ring, address) = ring(3);
        let mut tails = Vec::new();
        for _ in 0..4 {
            ring.begin();
            for place in 0..3 {
                ring.push(&descriptor(address));
                ring.complete(place, COMPLETE | 64);
            }
            tails.push(ring.tail().expect("inside").expect("not empty").low());
            assert_eq!(ring.progress(), Progress::Complete { bytes: 192, packet_ended: false });
        }
        // Four descriptors, three a chain: the spare moves one back each time.
        assert_eq!(tails, [0x80, 0x40, 0x00, 0xC0]);
    }

    #[test]
    fn a_ring_takes_a_chain_as_long_as_it_was_asked_for() {
        for (asked, most) in [(0, 1), (1, 1), (3, 3)] {
            let (mut ring, address) = ring(asked);
            assert_eq!(ring.capacity(), most);
            for _ in 0..most {
                ring.push(&descriptor(address));
            }
            assert_eq!(ring.used(), most);
        }
    }

    #[test]
    fn a_used_descriptor_is_written_with_its_status_cleared() {
        let (mut ring, address) = ring(1);
        ring.push(&descriptor(address));
        ring.complete(0, COMPLETE | 64);
        assert_eq!(ring.progress(), Progress::Complete { bytes: 64, packet_ended: false });
        ring.begin();
        ring.push(&descriptor(address));
        ring.complete(0, COMPLETE | 64);
        ring.begin();
        ring.push(&descriptor(address));
        assert_eq!(ring.progress(), Progress::Running);
        assert_eq!(ring.words.read(6), 0x0800_0040);
    }

    #[test]
    fn an_empty_chain_has_no_tail_and_is_complete() {
        let (mut ring, _) = ring(3);
        ring.begin();
        assert_eq!(ring.tail().expect("no error"), None);
        assert_eq!(ring.progress(), Progress::Complete { bytes: 0, packet_ended: false });
    }

    #[test]
    fn a_packet_that_ends_early_is_short() {
        let (mut ring, address) = ring(3);
        ring.push(&descriptor(address));
        ring.push(&descriptor(address));
        assert_eq!(ring.progress(), Progress::Running);
        ring.complete(0, COMPLETE | RXEOF | 48);
        assert_eq!(ring.progress(), Progress::Short);
    }

    #[test]
    fn a_packet_that_is_sent_does_not_end_by_a_reserved_bit() {
        let (mut ring, address) = ring_of(Direction::Mm2s, 3);
        ring.push(&descriptor(address));
        ring.push(&descriptor(address));
        ring.complete(0, COMPLETE | RXEOF | 64);
        ring.complete(1, COMPLETE | RXEOF | 64);
        assert_eq!(ring.survey(0).packet_end, None);
        assert_eq!(ring.progress(), Progress::Complete { bytes: 128, packet_ended: false });
    }

    #[test]
    fn a_packet_that_ends_with_the_chain_is_whole_however_often_one_looks() {
        let (mut ring, address) = ring(3);
        ring.push(&descriptor(address));
        ring.push(&descriptor(address));
        ring.complete(0, COMPLETE | 64);
        assert_eq!(ring.progress(), Progress::Running);
        ring.complete(1, COMPLETE | RXEOF | 32);
        let whole = Progress::Complete { bytes: 96, packet_ended: true };
        assert_eq!([ring.progress(), ring.progress()], [whole, whole]);
    }

    #[test]
    fn a_survey_counts_bytes_and_finds_what_failed_and_what_is_in_work() {
        let (mut ring, address) = ring(4);
        // Not at the ring's start: the chain wraps.
        for _ in 0..3 {
            ring.push(&descriptor(address));
        }
        ring.begin();
        for _ in 0..4 {
            ring.push(&descriptor(address));
        }
        ring.complete(0, COMPLETE | 64);
        ring.complete(1, COMPLETE | (1 << 28) | RXEOF | 48);
        ring.complete(2, 16);
        let third = ring.state(2);
        // Five descriptors: the chain's third is the ring's first.
        assert_eq!((third.index, third.address, third.bytes), (2, 0x8_0000_0000, 64));
        let chain = ring.survey(third.address);
        assert_eq!((chain.descriptors, chain.complete), (4, 2));
        assert_eq!((chain.bytes_moved, chain.bytes_expected), (64 + 48 + 16, 4 * 64));
        assert_eq!(chain.failed.map(|state| state.index), Some(1));
        assert_eq!(chain.packet_end, Some(1));
        assert_eq!((chain.in_work, chain.at_address), (Some(third), Some(third)));
        assert_eq!(ring.survey(0x1234).at_address, None);
    }

    #[test]
    fn a_failed_descriptor_is_found() {
        let (mut ring, address) = ring(3);
        ring.push(&descriptor(address));
        ring.push(&descriptor(address));
        ring.complete(0, COMPLETE | 64);
        ring.complete(1, 1 << 30);
        assert_eq!(ring.progress(), Progress::Failed);
    }
}
