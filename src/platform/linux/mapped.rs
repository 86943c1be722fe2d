//! Maps device files, and accesses the registers and the memory for DMA in the mapping.
#![allow(unsafe_code, reason = "what is mapped is reached through raw pointers only")]

use std::fs::File;
use std::io;
use std::path::Path;
use std::sync::Arc;

use memmap2::{MmapOptions, MmapRaw};
use pgs_interface::record::{BEAT_BYTES, Beat};

use super::lock::LockedFile;
use super::system::require_bytes;
use crate::platform::memory::copy::Doublewords;
use crate::platform::{PlatformError, RegisterWindow, Result};

/// The longest mapping, bytes: all physical addresses of the chip (UG1085, 40 bits).
const LONGEST: u64 = 1 << 40;

/// A region of a device file, mapped readable and writable and shared with the device.
///
/// The region begins on a multiple of 16 of the address space. Only
/// [`MappedBeats`](crate::platform::memory::volatile::MappedBeats) makes references to it.
///
/// Every access here relies on one invariant: a region has one owner, and under that owner no
/// access to a word meets a store to the same word from another thread. The lock keeps other
/// mappings of the device file away, also mappings of this process; a file that came to this
/// process alone needs none. The owners do the rest: the
/// public types store through `&mut self`, the accelerator steps through `&mut self`, and the pool
/// gives each piece of memory to one holder. The device's own accesses are not the language's
/// concern: words and doublewords are volatile and aligned, and beats are handed over.
#[derive(Debug)]
pub(crate) struct Mapping {
    map: MmapRaw,
    /// Where the region begins in the mapping, a multiple of 16.
    start: usize,
    bytes: usize,
    /// Dropped after the map: the device file is locked as long as it is mapped.
    _lock: Option<Arc<LockedFile>>,
}

impl Mapping {
    /// Maps `start + bytes` bytes at `file_offset` of a locked device file, a multiple of the page
    /// size; the region is the last `bytes` of them.
    pub(crate) fn new(
        lock: &Arc<LockedFile>,
        file_offset: u64,
        start: usize,
        bytes: usize,
    ) -> Result<Self> {
        Self::of_file(lock, lock.file(), file_offset, start, bytes)
    }

    /// The same through `file`, another opening of the locked file.
    pub(crate) fn of_file(
        lock: &Arc<LockedFile>,
        file: &File,
        file_offset: u64,
        start: usize,
        bytes: usize,
    ) -> Result<Self> {
        let map = Self::map(file, lock.path(), file_offset, start, bytes)?;
        Ok(Self { _lock: Some(Arc::clone(lock)), ..map })
    }

    /// Maps the first `bytes` bytes of a file that nobody else in this process has, and that cannot
    /// get shorter; `path` names it in errors.
    #[cfg(feature = "emulation")]
    pub(crate) fn of_private(file: &File, path: &Path, bytes: usize) -> Result<Self> {
        Self::map(file, path, 0, 0, bytes)
    }

    fn map(file: &File, path: &Path, file_offset: u64, start: usize, bytes: usize) -> Result<Self> {
        let error = |source| PlatformError::File { act: "map", path: path.to_owned(), source };
        if !start.is_multiple_of(BEAT_BYTES) || bytes < 4 {
            let text = format!("a region of {bytes} bytes at {start} cannot be mapped");
            return Err(error(io::Error::new(io::ErrorKind::InvalidData, text)));
        }
        let length = start.checked_add(bytes).filter(|length| *length as u64 <= LONGEST);
        let length = length.ok_or_else(|| PlatformError::TooLarge {
            region: path.display().to_string(),
            bytes: bytes as u64,
        })?;
        require_bytes(file, path, file_offset.saturating_add(length as u64))?;
        let map =
            MmapOptions::new().offset(file_offset).len(length).map_raw(file).map_err(error)?;
        Ok(Self { map, start, bytes, _lock: None })
    }

    /// Length of the region.
    pub(crate) fn bytes(&self) -> usize {
        self.bytes
    }

    /// A pointer to `bytes` bytes at `at`, a multiple of `bytes`.
    fn pointer(&self, at: usize, bytes: usize) -> *mut u8 {
        assert!(
            at.is_multiple_of(bytes) && at.checked_add(bytes).is_some_and(|end| end <= self.bytes),
            "callers check what they are asked for"
        );
        // Wrapping arithmetic needs no proof here; the proof stands at the accesses.
        self.map.as_mut_ptr().wrapping_add(self.start + at)
    }

    #[allow(clippy::cast_ptr_alignment, reason = "a page, plus start and at: multiples of 4")]
    fn word(&self, at: usize) -> *mut u32 {
        self.pointer(at, 4).cast()
    }

    #[allow(clippy::cast_ptr_alignment, reason = "a page, plus start and at: multiples of 8")]
    fn doubleword(&self, at: usize) -> *mut u64 {
        self.pointer(at, 8).cast()
    }

    /// Panics unless `beats` beats from byte `at` lie inside the region, on multiples of 16.
    pub(crate) fn check_beats(&self, at: usize, beats: usize) {
        let end = beats.checked_mul(BEAT_BYTES).and_then(|bytes| bytes.checked_add(at));
        assert!(
            at.is_multiple_of(BEAT_BYTES) && end.is_some_and(|end| end <= self.bytes),
            "callers check what they are asked for"
        );
    }

    /// A pointer to the beat at byte `at`, a multiple of 16 inside the region or its end.
    #[allow(clippy::cast_ptr_alignment, reason = "a page, plus start and at: multiples of 16")]
    pub(crate) fn beat(&self, at: usize) -> *mut Beat {
        self.check_beats(at, 0);
        self.map.as_mut_ptr().wrapping_add(self.start + at).cast()
    }

    /// One 32-bit load; `at` is a multiple of 4 inside the region.
    pub(crate) fn load_word(&self, at: usize) -> u32 {
        let word = self.word(at);
        // SAFETY: `pointer` asserted that the four bytes lie inside the region, and `new` mapped
        // `start + bytes` bytes readable; `map` is alive as long as `self`. The address is a
        // multiple of 4: a page, plus multiples of 4. No other thread stores to the word
        // meanwhile: the invariant of one owner, kept by `_lock` and the owners.
        unsafe { word.read_volatile() }
    }

    /// One 32-bit store; `at` is a multiple of 4 inside the region.
    pub(crate) fn store_word(&self, at: usize, value: u32) {
        let word = self.word(at);
        // SAFETY: as in `load_word`; `new` mapped the region writable.
        unsafe { word.write_volatile(value) }
    }
}

impl Doublewords for Mapping {
    fn load(&self, at: usize) -> u64 {
        let doubleword = self.doubleword(at);
        // SAFETY: `pointer` asserted that the eight bytes lie inside the region, and `new` mapped
        // `start + bytes` bytes readable; `map` is alive as long as `self`. The address is a
        // multiple of 8: a page, plus `start`, a multiple of 16, plus `at`, a multiple of 8. No
        // other thread stores to them meanwhile: the invariant of one owner.
        unsafe { doubleword.read_volatile() }
    }

    fn store(&self, at: usize, value: u64) {
        let doubleword = self.doubleword(at);
        // SAFETY: as in `load`; `new` mapped the region writable.
        unsafe { doubleword.write_volatile(value) }
    }
}

impl RegisterWindow for Mapping {
    fn bytes(&self) -> u64 {
        self.bytes as u64
    }

    fn read32(&self, at: u32) -> u32 {
        self.load_word(at as usize)
    }

    fn write32(&self, at: u32, value: u32) {
        self.store_word(at as usize, value);
    }
}

#[cfg(test)]
mod tests {
    use std::io::{Read as _, Seek as _, Write as _};

    use super::*;
    use crate::platform::memory::copy::{load_beats, store_beats};
    use crate::platform::memory::volatile::{DmaMemory, MappedBeats};

    fn page() -> Vec<u8> {
        (0..4096u32).map(|k| u8::try_from(k % 251).expect("below 251")).collect()
    }

    fn file_of(bytes: &[u8]) -> tempfile::NamedTempFile {
        let mut file = tempfile::NamedTempFile::new().expect("a temporary file");
        file.write_all(bytes).expect("written");
        file
    }

    fn map(file: &tempfile::NamedTempFile, start: usize, bytes: usize) -> Result<Mapping> {
        let lock = Arc::new(LockedFile::open(file.path(), 0).expect("nobody else has it"));
        Mapping::new(&lock, 0, start, bytes)
    }

    fn content(file: &mut tempfile::NamedTempFile) -> Vec<u8> {
        let mut bytes = Vec::new();
        file.rewind().expect("rewound");
        file.read_to_end(&mut bytes).expect("read");
        bytes
    }

    /// A region in anonymous memory, which Miri can map, unlike a file.
    fn anonymous(start: usize, bytes: usize) -> Mapping {
        let file = file_of(&[0; 16]);
        let lock = LockedFile::open(file.path(), 0).expect("nobody else has it");
        let map = MmapRaw::from(memmap2::MmapMut::map_anon(start + bytes).expect("mapped"));
        Mapping { map, start, bytes, _lock: Some(Arc::new(lock)) }
    }

    #[test]
    fn words_and_beats_of_one_region_are_the_same_memory() {
        let region = anonymous(0x10, 0x80);
        region.store_word(0x7C, 7);
        assert_eq!((region.load_word(0x7C), region.load(0x78)), (7, 7 << 32));
        store_beats(&region, 0x20, &[Beat([1, 2, 3, 4]); 2]);
        assert_eq!([0x2C, 0x30, 0x3C, 0x40].map(|at| region.load_word(at)), [4, 1, 4, 0]);
        let mut back = [Beat::default(); 3];
        load_beats(&region, 0x10, &mut back);
        assert_eq!(back, [Beat::default(), Beat([1, 2, 3, 4]), Beat([1, 2, 3, 4])]);
    }

    #[test]
    fn pieces_of_one_region_are_held_and_written_side_by_side() {
        let region = Arc::new(anonymous(0x10, 0x100));
        let piece = |at, beats| {
            // SAFETY: anonymous memory is normal memory, which no device writes; the two pieces do
            // not overlap, and nothing else reaches the region while they live.
            DmaMemory::Mapped(unsafe { MappedBeats::new(Arc::clone(&region), at, beats) })
        };
        let (mut one, mut other) = (piece(0, 8), piece(0x80, 8));
        std::thread::scope(|scope| {
            scope.spawn(|| one.beats_mut().fill(Beat([1; 4])));
            other.beats_mut().fill(Beat([2; 4]));
        });
        assert_eq!((one.beats()[7], other.beats()[0]), (Beat([1; 4]), Beat([2; 4])));
        // After a hand-over as in the pool the slices are gone, and the words are still there.
        drop((one, other));
        assert_eq!([0x7C, 0x80].map(|at| region.load_word(at)), [1, 2]);
    }

    #[test]
    fn registers_are_the_little_endian_words_of_the_mapping() {
        let page = page();
        let mut file = file_of(&page);
        let window = map(&file, 0x100, 0x40).expect("mapped");
        assert_eq!(RegisterWindow::bytes(&window), 0x40);
        let word = |at: usize| u32::from_le_bytes(page[at..at + 4].try_into().expect("four bytes"));
        assert_eq!(window.read32(0), word(0x100));
        assert_eq!(window.read32(0x3C), word(0x13C));
        window.write32(8, 0x0403_0201);
        let after = content(&mut file);
        assert_eq!(after[0x108..0x10C], [1, 2, 3, 4]);
        assert_eq!((&after[..0x108], &after[0x10C..]), (&page[..0x108], &page[0x10C..]));
    }

    #[test]
    fn beats_lie_in_the_mapping_as_in_the_interface() {
        let page = page();
        let mut file = file_of(&page);
        let memory = map(&file, 0x10, 0x100).expect("mapped");
        let beats = [Beat([1, 2, 3, 4]), Beat([5, 6, 7, 8])];
        store_beats(&memory, 0x20, &beats);
        let mut back = [Beat::default(); 2];
        load_beats(&memory, 0x20, &mut back);
        assert_eq!(back, beats);
        let after = content(&mut file);
        let words: Vec<u8> = (1..=8_u32).flat_map(u32::to_le_bytes).collect();
        assert_eq!(after[0x30..0x50], words[..]);
        assert_eq!((&after[..0x30], &after[0x50..]), (&page[..0x30], &page[0x50..]));
    }

    #[test]
    fn what_cannot_be_a_region_is_an_error_that_names_the_file() {
        let file = file_of(&page());
        let path = file.path().display().to_string();
        for (start, bytes) in [(2, 16), (8, 16), (0, 0)] {
            let error = map(&file, start, bytes).expect_err("not a region").to_string();
            assert!(error.contains(&path), "{error}");
        }
        let past = usize::try_from(LONGEST).expect("64 bits") + 1;
        for (start, bytes) in [(usize::MAX - 15, 4096), (0, usize::MAX), (16, 1 << 62), (0, past)] {
            let error = map(&file, start, bytes).expect_err("too large");
            assert!(matches!(error, PlatformError::TooLarge { .. }), "{error}");
            let error = error.to_string();
            assert!(error.contains(&path) && error.contains("correct its `reg`"), "{error}");
        }
    }

    #[test]
    fn a_plain_file_that_is_shorter_than_its_region_is_not_mapped() {
        for (length, bytes) in [(0, 4096), (100, 4096), (4096, 4112)] {
            let file = file_of(&page()[..length]);
            let error = map(&file, 0, bytes).expect_err("SIGBUS at an access");
            assert!(matches!(error, PlatformError::NotADevice { .. }), "{error}");
            assert!(error.to_string().contains(&format!("of {length} bytes, expected")), "{error}");
        }
    }

    #[test]
    fn the_file_is_locked_as_long_as_it_is_mapped() {
        let file = file_of(&page());
        let mapping = map(&file, 0, 0x40).expect("mapped");
        let error = LockedFile::open(file.path(), 0).expect_err("mapped");
        assert!(matches!(error, PlatformError::Busy { .. }), "{error}");
        drop(mapping);
        LockedFile::open(file.path(), 0).expect("free");
    }

    #[test]
    #[should_panic(expected = "callers check")]
    fn the_word_after_the_region_is_a_broken_invariant() {
        let file = file_of(&page());
        map(&file, 0, 0x40).expect("mapped").load_word(0x40);
    }
}
