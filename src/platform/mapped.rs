//! This file reaches the registers behind a memory map of a UIO node.
#![allow(unsafe_code, reason = "a mapped register is reached through a raw pointer only")]

use std::fs::OpenOptions;
use std::path::Path;

use memmap2::{MmapOptions, MmapRaw};

use super::{PlatformError, RegisterWindow};

/// A register region, mapped.
#[derive(Debug)]
pub(crate) struct MappedWindow {
    map: MmapRaw,
    /// Where the region begins in the mapping, a multiple of 4.
    start: usize,
    bytes: usize,
}

impl MappedWindow {
    /// Maps `bytes` at `file_offset` of a device file; the region begins `start` bytes into them.
    pub(crate) fn open(
        path: &Path,
        file_offset: u64,
        start: usize,
        bytes: usize,
    ) -> Result<Self, PlatformError> {
        let error = |act, source| PlatformError::File { act, path: path.to_owned(), source };
        let file = OpenOptions::new()
            .read(true)
            .write(true)
            .open(path)
            .map_err(|source| error("open", source))?;
        let invalid = || {
            let text =
                format!("a region of {bytes} bytes at {start} is not one of 32-bit registers");
            error("map", std::io::Error::new(std::io::ErrorKind::InvalidData, text))
        };
        let length = start.checked_add(bytes).ok_or_else(invalid)?;
        if !start.is_multiple_of(4) || bytes < 4 {
            return Err(invalid());
        }
        let map = MmapOptions::new()
            .offset(file_offset)
            .len(length)
            .map_raw(&file)
            .map_err(|source| error("map", source))?;
        Ok(Self { map, start, bytes })
    }

    fn register(&self, at: u32) -> *mut u32 {
        let at = at as usize;
        assert!(at.is_multiple_of(4) && at + 4 <= self.bytes, "checked by Window");
        // Wrapping arithmetic needs no proof here; the proof stands at the accesses.
        let byte = self.map.as_mut_ptr().wrapping_add(self.start + at);
        #[allow(
            clippy::cast_ptr_alignment,
            reason = "a mapping begins on a page, start and at are multiples of 4"
        )]
        byte.cast::<u32>()
    }
}

impl RegisterWindow for MappedWindow {
    fn bytes(&self) -> u64 {
        self.bytes as u64
    }

    fn read32(&self, at: u32) -> u32 {
        let register = self.register(at);
        // SAFETY: `register` asserted that the four bytes lie inside the region, and `open` mapped
        // `start + bytes` bytes readable; `map` is alive as long as `self`. The address is a
        // multiple of 4 (page + multiples of 4). No reference to the mapping exists anywhere.
        unsafe { register.read_volatile() }
    }

    fn write32(&self, at: u32, value: u32) {
        let register = self.register(at);
        // SAFETY: as in `read32`; `open` mapped the region writable.
        unsafe { register.write_volatile(value) }
    }
}

#[cfg(test)]
mod tests {
    use std::io::{Read as _, Seek as _, Write as _};

    use super::*;

    #[test]
    fn registers_are_the_little_endian_words_of_the_mapping() {
        let mut file = tempfile::NamedTempFile::new().expect("a temporary file");
        let page: Vec<u8> =
            (0..4096u32).map(|k| u8::try_from(k % 251).expect("below 251")).collect();
        file.write_all(&page).expect("written");
        let window = MappedWindow::open(file.path(), 0, 0x100, 0x40).expect("mapped");
        assert_eq!(window.bytes(), 0x40);
        let word = |at: usize| u32::from_le_bytes(page[at..at + 4].try_into().expect("four bytes"));
        assert_eq!(window.read32(0), word(0x100));
        assert_eq!(window.read32(0x3C), word(0x13C));
        window.write32(8, 0x0403_0201);
        let mut after = Vec::new();
        file.rewind().expect("rewound");
        file.read_to_end(&mut after).expect("read");
        assert_eq!(after[0x108..0x10C], [1, 2, 3, 4]);
        assert_eq!((&after[..0x108], &after[0x10C..]), (&page[..0x108], &page[0x10C..]));
    }

    #[test]
    fn what_cannot_be_registers_is_an_error_that_names_the_file() {
        let missing = MappedWindow::open(Path::new("/nonexistent/uio0"), 0, 0, 16)
            .expect_err("there is no such file");
        assert!(missing.to_string().contains("/nonexistent/uio0"), "{missing}");
        let file = tempfile::NamedTempFile::new().expect("a temporary file");
        file.as_file().set_len(4096).expect("resized");
        assert!(MappedWindow::open(file.path(), 0, 2, 16).is_err());
        assert!(MappedWindow::open(file.path(), 0, 0, 0).is_err());
        assert!(MappedWindow::open(file.path(), 0, usize::MAX, 4).is_err());
    }
}
