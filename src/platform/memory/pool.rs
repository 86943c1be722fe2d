//! Allocates buffers from a region of memory for DMA.
//!
//! First fit. Every piece begins on a cache line and is whole lines long, so that no two pieces
//! share a line. Handing over and taking back allocate nothing.

use std::collections::BTreeMap;
use std::fmt;
use std::ops::Range;
use std::sync::{Mutex, MutexGuard, PoisonError};

use pgs_interface::record::BEAT_BYTES;

use crate::platform::{Access, DmaMemory, DmaMemorySource, PlatformError, Result, SharedMemory};

/// Bytes of a cache line, the alignment and the unit of a piece.
const LINE: u64 = 64;

/// Contiguous physical memory for DMA. Offsets count from its first byte.
pub(crate) trait Region: fmt::Debug + Send + Sync {
    /// The name of its device or file.
    fn name(&self) -> &str;
    /// Bus address of the first byte.
    fn address(&self) -> u64;
    /// Length, bytes.
    fn bytes(&self) -> u64;
    /// The CPU's side of `beats` beats at `at`. The caller is the only holder: the pool cuts pieces
    /// that do not overlap, and gives a piece out again only after its release.
    fn memory(&self, at: usize, beats: usize) -> Result<DmaMemory>;
    /// `words` words at `at` that both sides see at any time.
    fn shared(&self, at: usize, words: usize) -> Result<SharedMemory>;
    /// Makes the first `used` beats of `memory` visible to the device.
    fn to_device(&self, at: usize, memory: &DmaMemory, used: usize, access: Access) -> Result<()>;
    /// Makes the first `used` beats that the device wrote visible in `memory`.
    fn to_cpu(&self, at: usize, memory: &mut DmaMemory, used: usize, access: Access) -> Result<()>;
}

/// A piece in use.
#[derive(Debug)]
struct Piece {
    range: Range<u64>,
    /// The memory, the used beats and their use, while the device holds the piece.
    handed_over: Option<(DmaMemory, usize, Access)>,
}

#[derive(Debug)]
struct State {
    /// Free ranges, by address; no two of them touch.
    free: Vec<Range<u64>>,
    /// Pieces in use, by address.
    pieces: BTreeMap<u64, Piece>,
}

/// The memory of a board.
#[derive(Debug)]
pub(crate) struct Pool {
    region: Box<dyn Region>,
    state: Mutex<State>,
}

impl Pool {
    /// A pool of a whole region.
    pub(crate) fn new(region: Box<dyn Region>) -> Self {
        let end = region.address().saturating_add(region.bytes());
        let free = lines(region.address()..end).into_iter().collect();
        Self { region, state: Mutex::new(State { free, pieces: BTreeMap::new() }) }
    }

    fn state(&self) -> MutexGuard<'_, State> {
        // No code under the lock panics between two changes that belong together.
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Cuts out a piece; returns its address and its offset in the region.
    fn cut(&self, bytes: u64) -> Result<(u64, usize)> {
        let mut state = self.state();
        let wanted = bytes.max(1).checked_next_multiple_of(LINE);
        let length = |range: &Range<u64>| range.end - range.start;
        let place = wanted.and_then(|wanted| {
            let place = state.free.iter().position(|range| length(range) >= wanted)?;
            Some((place, wanted))
        });
        let Some((place, wanted)) = place else {
            return Err(PlatformError::Exhausted {
                wanted: bytes,
                largest: state.free.iter().map(length).max().unwrap_or(0),
                total: self.region.bytes(),
            });
        };
        let range = &mut state.free[place];
        let piece = range.start..range.start + wanted;
        range.start = piece.end;
        if range.is_empty() {
            state.free.remove(place);
        }
        let address = piece.start;
        state.pieces.insert(address, Piece { range: piece, handed_over: None });
        Ok((address, self.offset(address)?))
    }

    fn offset(&self, address: u64) -> Result<usize> {
        address
            .checked_sub(self.region.address())
            .and_then(|offset| usize::try_from(offset).ok())
            .ok_or(PlatformError::NotGivenOut { address, state: "in the pool" })
    }

    /// Cuts out a piece and makes a value of it; if `make` fails, the piece is free again.
    fn give<T>(&self, bytes: u64, make: impl FnOnce(usize) -> Result<T>) -> Result<(u64, T)> {
        let (address, at) = self.cut(bytes)?;
        match make(at) {
            Ok(made) => Ok((address, made)),
            Err(error) => {
                self.release(address)?;
                Err(error)
            }
        }
    }
}

impl DmaMemorySource for Pool {
    fn name(&self) -> &str {
        self.region.name()
    }

    fn extent(&self) -> Option<(u64, u64)> {
        Some((self.region.address(), self.region.bytes()))
    }

    fn allocate(&self, beats: usize) -> Result<(u64, DmaMemory)> {
        let bytes = (beats as u64).saturating_mul(BEAT_BYTES as u64);
        self.give(bytes, |at| self.region.memory(at, beats))
    }

    fn allocate_shared(&self, words: usize) -> Result<(u64, SharedMemory)> {
        let bytes = (words as u64).saturating_mul(4);
        self.give(bytes, |at| self.region.shared(at, words))
    }

    fn hand_over(&self, at: u64, memory: DmaMemory, used: usize, access: Access) -> Result<()> {
        let offset = self.offset(at)?;
        let mut state = self.state();
        match state.pieces.get_mut(&at) {
            Some(Piece { handed_over: handed_over @ None, .. }) => {
                self.region.to_device(offset, &memory, used.min(memory.beats().len()), access)?;
                *handed_over = Some((memory, used, access));
                Ok(())
            }
            _ => Err(PlatformError::NotGivenOut { address: at, state: "with the CPU" }),
        }
    }

    fn take_back(&self, address: u64) -> Result<DmaMemory> {
        let at = self.offset(address)?;
        let mut state = self.state();
        let piece = state.pieces.get_mut(&address);
        let Some((mut memory, used, access)) = piece.and_then(|piece| piece.handed_over.take())
        else {
            return Err(PlatformError::NotGivenOut { address, state: "with the device" });
        };
        let used = used.min(memory.beats().len());
        self.region.to_cpu(at, &mut memory, used, access)?;
        Ok(memory)
    }

    /// Refuses a piece with the device, which may still write it.
    fn release(&self, address: u64) -> Result<()> {
        let mut state = self.state();
        match state.pieces.get(&address) {
            Some(Piece { handed_over: None, .. }) => {}
            _ => return Err(PlatformError::NotGivenOut { address, state: "with the CPU" }),
        }
        let Some(Piece { range, .. }) = state.pieces.remove(&address) else { return Ok(()) };
        let free = &mut state.free;
        let place = free.partition_point(|other| other.start < range.start);
        free.insert(place, range);
        if free.get(place + 1).is_some_and(|next| next.start == free[place].end) {
            free[place].end = free.remove(place + 1).end;
        }
        if place > 0 && free[place - 1].end == free[place].start {
            free[place - 1].end = free.remove(place).end;
        }
        Ok(())
    }
}

/// The whole lines of a range, if there are any.
fn lines(range: Range<u64>) -> Option<Range<u64>> {
    let start = range.start.checked_next_multiple_of(LINE)?;
    let end = range.end - range.end % LINE;
    (start < end).then_some(start..end)
}

#[cfg(test)]
mod tests {
    use pgs_interface::record::Beat;
    use proptest::prelude::*;

    use super::*;
    use crate::platform::memory::reserved::fake::{as_the_device, reserved};

    const KIB: u64 = 1024;

    fn pool(address: u64, bytes: u64) -> (tempfile::TempDir, Pool) {
        let (root, memory) = reserved(address, bytes);
        (root, Pool::new(Box::new(memory)))
    }

    fn address_of<T>(given: Result<(u64, T)>) -> u64 {
        given.expect("there is room").0
    }

    #[test]
    fn pieces_are_whole_lines_and_only_those_of_the_region() {
        // The region begins and ends inside a line.
        let (_root, pool) = pool(0x6000_0010, 256 + 64);
        let given: Vec<_> = (0..4).map(|_| address_of(pool.allocate(1))).collect();
        assert_eq!(given, [0x6000_0040, 0x6000_0080, 0x6000_00C0, 0x6000_0100]);
        let error = pool.allocate(1).expect_err("what is left is less than a line");
        assert!(
            matches!(error, PlatformError::Exhausted { wanted: 16, largest: 0, total: 320 }),
            "{error}"
        );
    }

    #[test]
    fn what_was_released_is_given_out_again_in_one_piece() {
        let (_root, pool) = pool(0x6000_0000, 4 * KIB);
        let given: Vec<_> = (0..4).map(|_| address_of(pool.allocate(64))).collect();
        for address in [given[2], given[0], given[3], given[1]] {
            pool.release(address).expect("given out");
        }
        assert_eq!(address_of(pool.allocate(256)), 0x6000_0000);
    }

    #[test]
    fn the_device_reads_what_the_cpu_wrote_and_the_cpu_what_the_device_wrote() {
        let (_root, memory) = reserved(0x6000_0000, 4 * KIB);
        let mut physical = as_the_device(&memory);
        let pool = Pool::new(Box::new(memory));
        pool.allocate(4).expect("so that the next does not lie at the start");
        let (address, mut memory) = pool.allocate(3).expect("there is room");
        let at = address - physical.address();
        memory.beats_mut().copy_from_slice(&[Beat([1; 4]), Beat([2; 4]), Beat([3; 4])]);
        pool.hand_over(address, memory, 2, Access::Read).expect("with the CPU");
        let mut seen = [Beat::default(); 3];
        physical.read(at, &mut seen).expect("inside");
        assert_eq!(seen, [Beat([1; 4]), Beat([2; 4]), Beat::default()], "two are used");

        let memory = pool.take_back(address).expect("with the device");
        pool.hand_over(address, memory, 3, Access::Write).expect("with the CPU");
        physical.write(at, &[Beat([7; 4]), Beat([8; 4]), Beat([9; 4])]).expect("inside");
        let memory = pool.take_back(address).expect("with the device");
        assert_eq!(memory.beats(), [Beat([7; 4]), Beat([8; 4]), Beat([9; 4])]);
    }

    #[test]
    fn shared_words_are_the_words_of_the_region() {
        let (_root, memory) = reserved(0x6000_0000, KIB);
        let mut physical = as_the_device(&memory);
        let pool = Pool::new(Box::new(memory));
        let (address, words) = pool.allocate_shared(16).expect("there is room");
        words.store(5, 0x1234);
        let mut seen = [Beat::default(); 4];
        physical.read(address - 0x6000_0000, &mut seen).expect("inside");
        assert_eq!(seen[1], Beat([0, 0x1234, 0, 0]));
        physical.write(address - 0x6000_0000, &[Beat([7, 8, 9, 10])]).expect("inside");
        assert_eq!([words.load(0), words.load(3)], [7, 10]);
        assert_eq!(words.len(), 16);
    }

    #[test]
    fn what_the_device_holds_is_never_given_out_again() {
        let (_root, pool) = pool(0x6000_0000, KIB);
        let (address, memory) = pool.allocate(64).expect("all of it");
        pool.hand_over(address, memory, 64, Access::Write).expect("with the CPU");
        pool.release(address).expect_err("the device may still write");
        pool.allocate(1).expect_err("nothing is free");
        drop(pool.take_back(address).expect("with the device"));
        pool.take_back(address).expect_err("the device has nothing");
        pool.release(address).expect("with the CPU");
        pool.release(address).expect_err("already free");
        assert_eq!(address_of(pool.allocate(64)), address);
    }

    #[test]
    fn a_request_without_end_is_exhaustion() {
        let (_root, pool) = pool(0x6000_0000, KIB);
        for beats in [65, usize::MAX] {
            let error = pool.allocate(beats).expect_err("too much");
            assert!(matches!(error, PlatformError::Exhausted { largest: 1024, .. }), "{error}");
        }
        pool.allocate_shared(usize::MAX).expect_err("too much");
    }

    proptest! {
        // Each case makes a folder of files.
        #![proptest_config(ProptestConfig::with_cases(48))]

        #[test]
        fn pieces_never_overlap_and_all_of_it_comes_back(
            acts in prop::collection::vec((any::<bool>(), 0_usize..40), 1..60),
        ) {
            let (_root, pool) = pool(0x6000_0000, 4 * KIB);
            let mut held: Vec<(u64, usize)> = Vec::new();
            for (give, number) in acts {
                if give {
                    let Ok((address, _)) = pool.allocate(number) else { continue };
                    let end = address + 16 * number as u64;
                    prop_assert!(address % 64 == 0);
                    prop_assert!(end <= 0x6000_0000 + 4 * KIB);
                    for (other, beats) in &held {
                        let other_end = other + 16 * *beats as u64;
                        prop_assert!(address != *other && (end <= *other || address >= other_end));
                    }
                    held.push((address, number));
                } else if !held.is_empty() {
                    let (address, _) = held.swap_remove(number % held.len());
                    pool.release(address).expect("given out");
                }
            }
            for (address, _) in held {
                pool.release(address).expect("given out");
            }
            prop_assert_eq!(address_of(pool.allocate(256)), 0x6000_0000);
        }
    }
}
