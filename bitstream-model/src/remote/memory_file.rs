//! A board's memory in a file that another process sees too.
//!
//! This side reads and writes with system calls and maps nothing: no byte changes under a
//! reference. The driver maps the file. So all its bytes are reserved: a page without room in the
//! file system would end the driver with SIGBUS.

use std::fs::{self, File, OpenOptions};
use std::io;
use std::ops::Range;
use std::os::unix::fs::{FileExt as _, MetadataExt as _};
use std::path::{Path, PathBuf};

use nix::errno::Errno;
use nix::fcntl::{FallocateFlags, Flock, FlockArg, fallocate};
use thiserror::Error;

use super::mark::{self, MARK_BYTES};
use crate::memory::external::DeviceMemory;
use pgs_interface::record::Beat;

/// Shortest memory that is of any use, bytes.
const LEAST: u64 = 1 << 16;
/// Bytes of the largest page of any kernel; the memory has whole pages of this size.
const PAGE: u64 = 1 << 16;

/// Memory in a file.
#[derive(Debug)]
pub struct MemoryFile {
    file: File,
    /// Bus address of its first byte.
    base: u64,
    bytes: u64,
    inode: u64,
}

/// The reason why a file cannot be a board's memory.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum MemoryFileError {
    /// The file cannot be opened, made, or measured.
    #[error("the memory {} cannot be {act}", path.display())]
    File {
        /// The operation that failed: "opened", "locked", ...
        act: &'static str,
        /// The file.
        path: PathBuf,
        /// The kernel's error.
        #[source]
        source: io::Error,
    },
    /// The path is not a regular file.
    #[error("the memory {} is not a regular file: name another", path.display())]
    NotRegular {
        /// The path.
        path: PathBuf,
    },
    /// No board has made the file.
    #[error(
        "the memory {} has {found} bytes and not the mark of a file that a board has made: refusing \
         to overwrite it; name another file, or remove it if it is not needed",
        path.display()
    )]
    NotMade {
        /// The file.
        path: PathBuf,
        /// Its length, bytes.
        found: u64,
    },
    /// The file system has no room for the memory.
    #[error(
        "the memory {} of {bytes} bytes cannot be reserved: serve a smaller one, or name a file on \
         another file system",
        path.display()
    )]
    NoRoom {
        /// The file.
        path: PathBuf,
        /// The memory's length, bytes.
        bytes: u64,
        /// The kernel's error.
        #[source]
        source: io::Error,
    },
    /// The memory cannot have this length, or the file's length differs from the wanted one.
    #[error(
        "the memory {} has {found} bytes, expected {}: remove it, or name another",
        path.display(),
        match wanted {
            Some(wanted) => format!("{wanted}"),
            None => format!("a multiple of {PAGE}, at least {LEAST}"),
        }
    )]
    Length {
        /// The file.
        path: PathBuf,
        /// The memory's length, bytes.
        found: u64,
        /// The wanted length, if the caller wants one.
        wanted: Option<u64>,
    },
    /// A driver uses the file.
    #[error("the memory {} is in use: end the driver that has it, or name another", path.display())]
    Busy {
        /// The file.
        path: PathBuf,
    },
}

impl MemoryFile {
    /// Opens the file at `path`, or makes a file with a memory of `wanted` bytes, or of `default`
    /// bytes if `wanted` is `None`. The memory's first byte is at `base` on the bus. An empty file
    /// counts as a new one.
    ///
    /// # Errors
    /// [`MemoryFileError`]. An existing file then keeps its length and its content, and a new file
    /// is removed.
    pub fn open(
        path: &Path,
        base: u64,
        wanted: Option<u64>,
        default: u64,
    ) -> Result<Self, MemoryFileError> {
        let path_buf = || path.to_owned();
        let failed = |act| move |source| MemoryFileError::File { act, path: path_buf(), source };
        let length = |found| MemoryFileError::Length { path: path_buf(), found, wanted };
        let fits = |bytes: u64| bytes >= LEAST && bytes.is_multiple_of(PAGE);
        let new = wanted.unwrap_or(default);
        if !fits(new) || base.checked_add(new).is_none() {
            return Err(MemoryFileError::Length { path: path_buf(), found: new, wanted: None });
        }
        if path.exists() && !path.is_file() {
            return Err(MemoryFileError::NotRegular { path: path_buf() });
        }
        let (file, made) = open_or_make(path)?;
        // The lock excludes every driver: a driver holds it as long as it has the board.
        let file = match Flock::lock(file, FlockArg::LockExclusiveNonblock) {
            Ok(locked) => locked,
            Err((_, Errno::EWOULDBLOCK)) => {
                return Err(MemoryFileError::Busy { path: path_buf() });
            }
            Err((_, errno)) => return Err(failed("locked")(errno.into())),
        };
        let metadata = file.metadata().map_err(failed("measured"))?;
        let bytes = match metadata.len() {
            0 => new,
            found => mark::memory_bytes(&file)
                .map_err(failed("read"))?
                .ok_or_else(|| MemoryFileError::NotMade { path: path_buf(), found })?,
        };
        if !fits(bytes) || wanted.is_some_and(|wanted| wanted != bytes) {
            return Err(length(bytes));
        }
        // The mark first: an incomplete file is then known as ours.
        let written = if metadata.len() == 0 { mark::write(&file, bytes) } else { Ok(()) };
        if let Err(source) = written.and_then(|()| reserve(&file, bytes + MARK_BYTES)) {
            if made {
                fs::remove_file(path).map_err(failed("removed"))?;
            } else if metadata.len() == 0 {
                file.set_len(0).map_err(failed("emptied"))?;
            }
            return Err(MemoryFileError::NoRoom { path: path_buf(), bytes, source });
        }
        let file = file.unlock().map_err(|(_, errno)| failed("unlocked")(errno.into()))?;
        Ok(Self { file, base, bytes, inode: metadata.ino() })
    }

    /// Bus addresses of the memory.
    #[must_use]
    pub fn addresses(&self) -> Range<u64> {
        self.base..self.base + self.bytes
    }

    /// The file's inode.
    #[must_use]
    pub fn inode(&self) -> u64 {
        self.inode
    }

    /// Offset of an address in the file. A range past the end is an error: a write there would make
    /// the file longer.
    fn offset(&self, address: u64, bytes: usize) -> io::Result<u64> {
        let place = address
            .checked_sub(self.base)
            .filter(|place| place.checked_add(bytes as u64).is_some_and(|end| end <= self.bytes));
        place.ok_or_else(|| {
            let Range { start, end } = self.addresses();
            let text = format!("{bytes} bytes at {address:#x} do not lie in {start:#x}..{end:#x}");
            io::Error::new(io::ErrorKind::InvalidInput, text)
        })
    }

    fn read(&self, address: u64, to: &mut [u8]) -> io::Result<()> {
        self.file.read_exact_at(to, self.offset(address, to.len())?)
    }

    fn write(&self, address: u64, from: &[u8]) -> io::Result<()> {
        self.file.write_all_at(from, self.offset(address, from.len())?)
    }
}

/// Opens the file or makes it; returns whether it was made.
fn open_or_make(path: &Path) -> Result<(File, bool), MemoryFileError> {
    let mut options = OpenOptions::new();
    options.read(true).write(true);
    let failed = |act| move |source| MemoryFileError::File { act, path: path.to_owned(), source };
    match options.open(path) {
        Ok(file) => Ok((file, false)),
        Err(error) if error.kind() == io::ErrorKind::NotFound => {
            let made = options.create_new(true).open(path);
            made.map(|file| (file, true)).map_err(failed("made"))
        }
        Err(error) => Err(failed("opened")(error)),
    }
}

/// Reserves room in the file system for a file's first `bytes` bytes, and keeps their content.
fn reserve(file: &File, bytes: u64) -> io::Result<()> {
    let length = i64::try_from(bytes).map_err(|_| io::Error::from(Errno::EFBIG))?;
    loop {
        match fallocate(file, FallocateFlags::empty(), 0, length) {
            Ok(()) => return Ok(()),
            Err(Errno::EINTR) => {}
            // Some file systems cannot reserve, for example NFS before 4.2.
            Err(Errno::EOPNOTSUPP | Errno::ENOSYS) => return rewrite(file, bytes),
            Err(errno) => return Err(errno.into()),
        }
    }
}

/// Writes a file's first bytes back unchanged, so that the file system allocates them.
fn rewrite(file: &File, bytes: u64) -> io::Result<()> {
    let mut piece = vec![0; 1 << 16];
    let mut place = 0;
    while place < bytes {
        let rest = usize::try_from(bytes - place).unwrap_or(usize::MAX);
        let length = piece.len().min(rest);
        let piece = &mut piece[..length];
        file.read_exact_at(piece, place)?;
        file.write_all_at(piece, place)?;
        place += length as u64;
    }
    file.sync_data()
}

impl DeviceMemory for MemoryFile {
    fn read_beats(&mut self, address: u64, to: &mut [Beat]) -> io::Result<()> {
        self.read(address, bytemuck::cast_slice_mut(to))
    }

    fn write_beats(&mut self, address: u64, from: &[Beat]) -> io::Result<()> {
        self.write(address, bytemuck::cast_slice(from))
    }

    fn read_words(&mut self, address: u64, to: &mut [u32]) -> io::Result<()> {
        self.read(address, bytemuck::cast_slice_mut(to))
    }

    /// Writes the uppermost byte last: it holds the flags that show that a descriptor is complete.
    fn write_word(&mut self, address: u64, value: u32) -> io::Result<()> {
        let bytes = value.to_le_bytes();
        self.write(address, &bytes[..3])?;
        self.write(address + 3, &bytes[3..])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A sparse file of `bytes` bytes that begins with `begin`.
    fn sparse(begin: &[u8], bytes: u64) -> (tempfile::TempDir, File) {
        let folder = tempfile::tempdir().expect("a directory");
        let mut options = OpenOptions::new();
        let file = options.read(true).write(true).create_new(true);
        let file = file.open(folder.path().join("sparse")).expect("made");
        file.write_all_at(begin, 0).expect("written");
        file.set_len(bytes).expect("a hole");
        (folder, file)
    }

    #[test]
    fn reserved_bytes_are_allocated_and_keep_their_content() {
        const BYTES: u64 = (1 << 20) + 3;
        for act in [reserve, rewrite] {
            let (_folder, file) = sparse(b"mine", BYTES);
            let given = || file.metadata().expect("measured").blocks() * 512;
            assert!(given() < BYTES, "a hole");
            act(&file, BYTES).expect("room");
            assert!(given() >= BYTES, "{}", given());
            let mut found = vec![1; 1 << 20];
            file.read_exact_at(&mut found, 0).expect("read");
            assert_eq!(&found[..4], b"mine");
            assert!(found[4..].iter().all(|byte| *byte == 0));
            assert_eq!(file.metadata().expect("measured").len(), BYTES);
        }
    }
}
