//! Gives the CPU access to memory for DMA, mapped or on the heap.
#![allow(unsafe_code, reason = "a slice of mapped memory is made from a raw pointer")]

use std::sync::Arc;
#[cfg(any(test, feature = "emulation"))]
use std::sync::atomic::{AtomicU32, Ordering};

use pgs_interface::record::Beat;

use crate::platform::linux::mapped::Mapping;

/// Beats for DMA, held by the CPU.
#[derive(Debug)]
pub(crate) enum DmaMemory {
    /// On the heap: memory of the emulated board, which takes and returns it whole; or the CPU's
    /// copy of device-mapped memory, which a hand-over copies.
    Heap(Box<[Beat]>),
    /// In memory that the device reaches.
    Mapped(MappedBeats),
}

impl DmaMemory {
    /// The beats.
    pub(crate) fn beats(&self) -> &[Beat] {
        match self {
            Self::Heap(beats) => beats,
            Self::Mapped(beats) => beats.beats(),
        }
    }

    /// The beats, to write.
    pub(crate) fn beats_mut(&mut self) -> &mut [Beat] {
        match self {
            Self::Heap(beats) => beats,
            Self::Mapped(beats) => beats.beats_mut(),
        }
    }
}

/// A range of mapped normal memory with one holder, until it is handed over.
#[derive(Debug)]
pub(crate) struct MappedBeats {
    mapping: Arc<Mapping>,
    at: usize,
    beats: usize,
}

impl MappedBeats {
    /// `beats` beats from byte `at` of a mapping.
    ///
    /// # Safety
    /// The mapping is of normal memory (cached or write-combining). While the value lives, no other
    /// one is made of a range that overlaps: not of this mapping, and, by the lock that the mapping
    /// holds, not of another one of the same device file. Whenever one of its slices exists the
    /// device does not write the range.
    pub(crate) unsafe fn new(mapping: Arc<Mapping>, at: usize, beats: usize) -> Self {
        mapping.check_beats(at, beats);
        Self { mapping, at, beats }
    }

    fn beats(&self) -> &[Beat] {
        let first = self.mapping.beat(self.at);
        // SAFETY: `new` checked that `beats` beats from `at` lie inside the mapping, which is
        // readable and alive as long as `self`; `beat` is aligned to 16 bytes; every bit pattern is
        // a beat. They are not written meanwhile: not by the CPU, as `new`'s caller promised that
        // no other range overlaps, the device file's lock keeps other mappings away, and `&self`
        // keeps `beats_mut` out; not by the device, as promised too.
        unsafe { std::slice::from_raw_parts(first, self.beats) }
    }

    fn beats_mut(&mut self) -> &mut [Beat] {
        let first = self.mapping.beat(self.at);
        // SAFETY: as in `beats`; the mapping is writable, and `&mut self` keeps other slices out.
        unsafe { std::slice::from_raw_parts_mut(first, self.beats) }
    }
}

/// Coherent 32-bit words that CPU and device may both touch at any time.
#[derive(Debug)]
pub(crate) enum SharedMemory {
    /// Words of the emulated board.
    #[cfg(any(test, feature = "emulation"))]
    Heap(Arc<[AtomicU32]>),
    /// Mapped uncached or write-combining: the words from byte `at` of a mapping.
    Mapped {
        /// The mapping.
        mapping: Arc<Mapping>,
        /// First byte, a multiple of 4.
        at: usize,
        /// Number of words.
        words: usize,
    },
}

impl SharedMemory {
    /// Number of words.
    pub(crate) fn len(&self) -> usize {
        match self {
            #[cfg(any(test, feature = "emulation"))]
            Self::Heap(words) => words.len(),
            Self::Mapped { words, .. } => *words,
        }
    }

    /// One load.
    pub(crate) fn load(&self, index: usize) -> u32 {
        match self {
            #[cfg(any(test, feature = "emulation"))]
            Self::Heap(words) => words[index].load(Ordering::Relaxed),
            Self::Mapped { mapping, at, words } => {
                assert!(index < *words, "a ring knows its length");
                mapping.load_word(at + 4 * index)
            }
        }
    }

    /// One store.
    pub(crate) fn store(&self, index: usize, value: u32) {
        match self {
            #[cfg(any(test, feature = "emulation"))]
            Self::Heap(words) => words[index].store(value, Ordering::Relaxed),
            Self::Mapped { mapping, at, words } => {
                assert!(index < *words, "a ring knows its length");
                mapping.store_word(at + 4 * index, value);
            }
        }
    }
}
