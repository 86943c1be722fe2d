//! Copies beats into and out of device-mapped memory.
//!
//! Device memory takes aligned accesses only and merges none: `memcpy` and `memset` would use
//! unaligned vectors or `dc zva`, which end in SIGBUS. Each beat is two aligned 64-bit accesses, in
//! the order of their addresses.
//!
//! Source: Arm ARM (alignment faults on Device memory).

use pgs_interface::record::{BEAT_BYTES, Beat};

/// Memory that is reached by aligned 64-bit accesses.
pub(crate) trait Doublewords {
    /// One load; `at` is a multiple of 8 inside the memory.
    fn load(&self, at: usize) -> u64;
    /// One store; `at` is a multiple of 8 inside the memory.
    fn store(&self, at: usize, value: u64);
}

/// Copies `beats` to the memory, from byte `at` of it on, which is a multiple of 16.
pub(crate) fn store_beats(to: &impl Doublewords, at: usize, beats: &[Beat]) {
    assert!(at.is_multiple_of(BEAT_BYTES), "beats lie on multiples of their length");
    for (at, beat) in (at..).step_by(BEAT_BYTES).zip(beats) {
        let [low, high]: [u64; 2] = bytemuck::cast(*beat);
        to.store(at, low);
        to.store(at + 8, high);
    }
}

/// Copies `beats` from the memory, from byte `at` of it on, which is a multiple of 16.
pub(crate) fn load_beats(from: &impl Doublewords, at: usize, beats: &mut [Beat]) {
    assert!(at.is_multiple_of(BEAT_BYTES), "beats lie on multiples of their length");
    for (at, beat) in (at..).step_by(BEAT_BYTES).zip(beats) {
        *beat = bytemuck::cast([from.load(at), from.load(at + 8)]);
    }
}

#[cfg(test)]
mod tests {
    use std::cell::RefCell;
    use std::collections::BTreeMap;

    use super::*;

    /// Memory that writes down each access.
    #[derive(Default)]
    struct Recording {
        memory: RefCell<BTreeMap<usize, u64>>,
        accesses: RefCell<Vec<(char, usize)>>,
    }

    impl Doublewords for Recording {
        fn load(&self, at: usize) -> u64 {
            self.accesses.borrow_mut().push(('l', at));
            self.memory.borrow().get(&at).copied().unwrap_or(0)
        }

        fn store(&self, at: usize, value: u64) {
            self.accesses.borrow_mut().push(('s', at));
            self.memory.borrow_mut().insert(at, value);
        }
    }

    #[test]
    fn a_beat_is_two_aligned_accesses_in_order_either_way() {
        let memory = Recording::default();
        let beats = [Beat([1, 2, 3, 4]), Beat([5, 6, 7, 8])];
        store_beats(&memory, 48, &beats);
        let mut back = [Beat::default(); 2];
        load_beats(&memory, 48, &mut back);
        assert_eq!(back, beats);
        let places = [48, 56, 64, 72];
        let expected: Vec<_> =
            places.map(|at| ('s', at)).into_iter().chain(places.map(|at| ('l', at))).collect();
        assert_eq!(*memory.accesses.borrow(), expected);
    }

    #[test]
    fn lane_0_is_at_the_lowest_address() {
        let memory = Recording::default();
        store_beats(&memory, 0, &[Beat([0x1111, 0x2222, 0x3333, 0x4444])]);
        let bytes = memory.memory.borrow()[&0].to_ne_bytes();
        assert_eq!(bytes[..4], 0x1111_u32.to_ne_bytes());
        assert_eq!(bytes[4..], 0x2222_u32.to_ne_bytes());
    }

    #[test]
    fn nothing_is_touched_for_no_beats() {
        let memory = Recording::default();
        store_beats(&memory, 16, &[]);
        load_beats(&memory, 16, &mut []);
        assert!(memory.accesses.borrow().is_empty());
    }

    #[test]
    #[should_panic(expected = "beats lie on multiples")]
    fn a_place_between_beats_is_a_broken_invariant() {
        store_beats(&Recording::default(), 8, &[Beat::default()]);
    }
}
