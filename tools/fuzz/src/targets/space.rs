//! Memory that checks every access, independently of the board.
//!
//! The board keeps a record of grants; this is a second one. The device may read or write only in a
//! granted range, and only at the request of a descriptor that it fetched from this memory, or of a
//! direct transfer that was [announced](Space::announce).

use std::io;
use std::ops::Range;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use bitstream_model::DeviceMemory;
use bitstream_model::interface::descriptor::{BUFFER, BUFFER_MSB, BYTES, CONTROL, STATUS, control};
use bitstream_model::interface::record::{BEAT_BYTES, Beat};

/// Words of a beat.
const LANES: usize = BEAT_BYTES / 4;
/// The value of words that must not change.
const CANARY: u32 = 0xC0DE_CAFE;

/// One range of memory, partly granted.
#[derive(Debug)]
struct Stretch {
    base: u64,
    words: Vec<u32>,
}

/// The checked state.
#[derive(Debug)]
pub(super) struct State {
    stretches: Vec<Stretch>,
    granted: Vec<Range<u64>>,
    /// Requested data.
    requested: Vec<Range<u64>>,
    /// Fetched descriptors.
    fetched: Vec<u64>,
}

/// Memory that checks every access; clones share it.
#[derive(Debug, Clone)]
pub(super) struct Space(Arc<Mutex<State>>);

impl Space {
    /// Ranges of `bytes` bytes at these addresses, with the middle half of each granted.
    pub(super) fn new(bases: &[u64], bytes: u64) -> Self {
        let words = usize::try_from(bytes / 4).expect("a small memory");
        let stretch = |base: &u64| Stretch { base: *base, words: vec![CANARY; words] };
        let granted = |base: &u64| base + bytes / 4..base + bytes / 4 * 3;
        Self(Arc::new(Mutex::new(State {
            stretches: bases.iter().map(stretch).collect(),
            granted: bases.iter().map(granted).collect(),
            requested: Vec::new(),
            fetched: Vec::new(),
        })))
    }

    fn state(&self) -> MutexGuard<'_, State> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// The granted ranges.
    pub(super) fn granted(&self) -> Vec<Range<u64>> {
        self.state().granted.clone()
    }

    /// Allows a direct transfer to access these bytes.
    pub(super) fn announce(&self, address: u64, bytes: u32) {
        self.state().request(address, bytes);
    }

    /// The CPU's store to a granted word.
    pub(super) fn store(&self, address: u64, value: u32) {
        let mut state = self.state();
        state.check_granted(address, 4);
        *state.word(address) = value;
    }

    /// Panics if anything outside the granted ranges has changed.
    pub(super) fn check_canaries(&self) {
        let state = self.state();
        for (stretch, granted) in state.stretches.iter().zip(&state.granted) {
            for (address, word) in (stretch.base..).step_by(4).zip(&stretch.words) {
                assert!(
                    granted.contains(&address) || *word == CANARY,
                    "{address:#x}, which was not granted, has become {word:#x}"
                );
            }
        }
    }
}

impl State {
    fn request(&mut self, address: u64, bytes: u32) {
        // The engines have no byte lanes: they access whole beats.
        let beat = BEAT_BYTES as u64;
        let start = address & !(beat - 1);
        let end = start.saturating_add(u64::from(bytes).next_multiple_of(beat));
        self.requested.push(start..end);
    }

    fn check_granted(&self, address: u64, bytes: u64) {
        let inside = |range: &Range<u64>| {
            range.start <= address && address.checked_add(bytes).is_some_and(|end| end <= range.end)
        };
        assert!(self.granted.iter().any(inside), "{bytes} bytes at {address:#x} were not granted");
    }

    /// Whether these bytes were requested; one access may span the transfers of adjacent buffers.
    fn check_requested(&self, address: u64, beats: usize) {
        let step = BEAT_BYTES as u64;
        let mut at = address;
        for _ in 0..beats {
            assert!(
                self.requested.iter().any(|range| range.contains(&at)),
                "no transfer requested the beat at {at:#x}"
            );
            at += step;
        }
    }

    fn word(&mut self, address: u64) -> &mut u32 {
        let found = self.stretches.iter_mut().find_map(|stretch| {
            let word = usize::try_from(address.checked_sub(stretch.base)? / 4).ok()?;
            stretch.words.get_mut(word)
        });
        found.unwrap_or_else(|| panic!("there is no memory at {address:#x}"))
    }
}

impl DeviceMemory for Space {
    fn read_beats(&mut self, address: u64, to: &mut [Beat]) -> io::Result<()> {
        let mut state = self.state();
        state.check_granted(address, (to.len() * BEAT_BYTES) as u64);
        state.check_requested(address, to.len());
        let mut at = address;
        for word in to.iter_mut().flat_map(|beat| &mut beat.0) {
            *word = *state.word(at);
            at += 4;
        }
        Ok(())
    }

    fn write_beats(&mut self, address: u64, from: &[Beat]) -> io::Result<()> {
        let mut state = self.state();
        state.check_granted(address, (from.len() * BEAT_BYTES) as u64);
        state.check_requested(address, from.len());
        let mut at = address;
        for word in from.iter().flat_map(|beat: &Beat| -> [u32; LANES] { beat.0 }) {
            *state.word(at) = word;
            at += 4;
        }
        Ok(())
    }

    fn read_words(&mut self, address: u64, to: &mut [u32]) -> io::Result<()> {
        let mut state = self.state();
        state.check_granted(address, (to.len() * 4) as u64);
        assert!(address.is_multiple_of(BYTES as u64), "a descriptor at {address:#x}");
        let mut at = address;
        for word in to.iter_mut() {
            *word = *state.word(at);
            at += 4;
        }
        let buffer = u64::from(to[BUFFER]);
        let bytes = control::LENGTH.of(to[CONTROL]);
        // Engines with addresses of 32 bits ignore the upper half.
        state.request(buffer, bytes);
        state.request(buffer | (u64::from(to[BUFFER_MSB]) << 32), bytes);
        state.fetched.push(address);
        Ok(())
    }

    fn write_word(&mut self, address: u64, value: u32) -> io::Result<()> {
        let mut state = self.state();
        state.check_granted(address, 4);
        let descriptor = address.wrapping_sub(4 * STATUS as u64);
        assert!(state.fetched.contains(&descriptor), "the status of no descriptor: {address:#x}");
        *state.word(address) = value;
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn descriptor(space: &mut Space, at: u64, buffer: u32, length: u32) {
        space.store(at + 4 * BUFFER as u64, buffer);
        space.store(at + 4 * BUFFER_MSB as u64, 0);
        space.store(at + 4 * CONTROL as u64, length);
        space.read_words(at, &mut [0; 13]).expect("granted");
    }

    #[test]
    fn what_was_granted_and_asked_for_is_there() {
        let mut space = Space::new(&[0x1000], 0x400);
        descriptor(&mut space, 0x1100, 0x1200, 20);
        space.write_beats(0x1200, &[Beat([1, 2, 3, 4]); 2]).expect("asked for");
        space.write_word(0x111C, 1).expect("fetched");
        let mut beat = [Beat::default()];
        space.read_beats(0x1210, &mut beat).expect("asked for");
        assert_eq!(beat, [Beat([1, 2, 3, 4])]);
        space.check_canaries();
    }

    #[test]
    #[should_panic(expected = "no transfer requested the beat at 0x1220")]
    fn a_beat_more_than_the_descriptor_says_is_found() {
        let mut space = Space::new(&[0x1000], 0x400);
        descriptor(&mut space, 0x1100, 0x1200, 32);
        let _ = space.write_beats(0x1200, &[Beat::default(); 3]);
    }

    #[test]
    #[should_panic(expected = "were not granted")]
    fn a_beat_beyond_the_grant_is_found() {
        let mut space = Space::new(&[0x1000], 0x400);
        descriptor(&mut space, 0x1100, 0x12F0, 32);
        let _ = space.read_beats(0x12F0, &mut [Beat::default(); 2]);
    }

    #[test]
    #[should_panic(expected = "the status of no descriptor")]
    fn a_status_that_belongs_nowhere_is_found() {
        let mut space = Space::new(&[0x1000], 0x400);
        descriptor(&mut space, 0x1100, 0x1200, 32);
        let _ = space.write_word(0x1120, 1);
    }
}
