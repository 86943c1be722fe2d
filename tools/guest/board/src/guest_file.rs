//! Accesses a guest's memory: a file that QEMU shares (`memory-backend-file`, share=on).
//!
//! Byte 0 of the file is physical address 0. Whole system calls access it, and nothing maps it, so
//! that no reference can change under the guest's writes. A word that the guest may read during a
//! write is complete once its last byte is there.

use std::fs::{File, OpenOptions};
use std::io;
use std::os::unix::fs::FileExt as _;
use std::path::Path;
use std::sync::Arc;

use bitstream_model::ByteMemory;

use crate::mailbox::Words;

/// A guest's physical memory.
#[derive(Debug, Clone)]
pub struct GuestFile {
    file: Arc<File>,
    bytes: u64,
}

impl GuestFile {
    /// Opens the file behind a guest's memory.
    ///
    /// # Errors
    /// It cannot be opened to read and write.
    pub fn open(path: &Path) -> io::Result<Self> {
        let file = OpenOptions::new().read(true).write(true).open(path)?;
        let bytes = file.metadata()?.len();
        Ok(Self { file: Arc::new(file), bytes })
    }

    /// The words of a page.
    ///
    /// # Errors
    /// The page does not lie in the memory.
    pub fn page(&self, address: u64) -> io::Result<GuestPage> {
        self.check(address, 4096)?;
        Ok(GuestPage { memory: self.clone(), address })
    }

    /// A write past the end would extend the guest's memory.
    fn check(&self, address: u64, bytes: usize) -> io::Result<()> {
        if address.checked_add(bytes as u64).is_some_and(|end| end <= self.bytes) {
            return Ok(());
        }
        let text = format!(
            "{bytes} bytes at {address:#x} do not lie in a guest memory of {:#x} bytes",
            self.bytes
        );
        Err(io::Error::new(io::ErrorKind::InvalidInput, text))
    }

    fn load(&self, address: u64) -> io::Result<u32> {
        let mut bytes = [0; 4];
        self.read(address, &mut bytes)?;
        Ok(u32::from_le_bytes(bytes))
    }
}

impl ByteMemory for GuestFile {
    fn read(&self, address: u64, to: &mut [u8]) -> io::Result<()> {
        self.check(address, to.len())?;
        self.file.read_exact_at(to, address)
    }

    fn write(&self, address: u64, from: &[u8]) -> io::Result<()> {
        self.check(address, from.len())?;
        self.file.write_all_at(from, address)
    }
}

/// A page of a guest's memory, word by word.
#[derive(Debug)]
pub struct GuestPage {
    memory: GuestFile,
    address: u64,
}

impl Words for GuestPage {
    type Error = io::Error;

    fn load(&self, at: u32) -> io::Result<u32> {
        self.memory.load(self.address + u64::from(at))
    }

    fn store(&mut self, at: u32, value: u32) -> io::Result<()> {
        self.memory.write_upwards(self.address + u64::from(at), value)
    }
}

#[cfg(test)]
mod tests {
    use bitstream_model::DeviceMemory as _;
    use bitstream_model::interface::record::Beat;

    use super::*;

    fn memory(bytes: u64) -> (tempfile::NamedTempFile, GuestFile) {
        let file = tempfile::NamedTempFile::new().expect("a temporary file");
        file.as_file().set_len(bytes).expect("resized");
        let memory = GuestFile::open(file.path()).expect("opened");
        (file, memory)
    }

    #[test]
    fn addresses_are_offsets_and_words_are_little_endian() {
        let (file, mut memory) = memory(0x3000);
        memory.write_beats(0x2000, &[Beat([0x0403_0201, 5, 6, 7])]).expect("inside");
        memory.write_word(0x2008, 0x8000_0010).expect("inside");
        let mut page = memory.page(0x2000).expect("inside");
        page.store(0x10, 9).expect("inside");
        let bytes = std::fs::read(file.path()).expect("read");
        assert_eq!(bytes[0x2000..0x2004], [1, 2, 3, 4]);
        assert_eq!(bytes[0x2008..0x2011], [0x10, 0, 0, 0x80, 7, 0, 0, 0, 9]);
        let mut beats = [Beat::default(); 2];
        memory.read_beats(0x2000, &mut beats).expect("inside");
        assert_eq!(beats, [Beat([0x0403_0201, 5, 0x8000_0010, 7]), Beat([9, 0, 0, 0])]);
        let mut words = [0; 2];
        memory.read_words(0x2004, &mut words).expect("inside");
        assert_eq!(words, [5, 0x8000_0010]);
        assert_eq!(page.load(8).expect("inside"), 0x8000_0010);
    }

    #[test]
    fn nothing_is_read_or_written_past_the_end() {
        let (file, mut memory) = memory(0x1000);
        let mut beats = [Beat::default(); 2];
        assert!(memory.read_beats(0xFF0, &mut beats).is_err());
        assert!(memory.write_beats(0xFF0, &beats).is_err());
        assert!(memory.write_word(u64::MAX - 1, 1).is_err());
        assert!(memory.page(0x10).is_err());
        let length = file.as_file().metadata().expect("there").len();
        assert_eq!(length, 0x1000, "the file has not grown");
    }
}
