//! This file is a board's memory that lies in a file, where another process sees it too.
//!
//! Whole system calls, no mapping: nothing here can be changed under a reference.

use std::fs::{File, OpenOptions};
use std::io;
use std::ops::Range;
use std::os::unix::fs::{FileExt as _, MetadataExt as _};
use std::path::{Path, PathBuf};

use nix::errno::Errno;
use nix::fcntl::{Flock, FlockArg};
use thiserror::Error;

use crate::memory::external::DeviceMemory;
use pgs_interface::record::Beat;

/// The least that is of any use, bytes.
const LEAST: u64 = 1 << 16;
/// A file has whole pages of the largest size that there is.
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

/// Why a file cannot be a board's memory.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum MemoryFileError {
    /// It cannot be opened, made, or measured.
    #[error("the memory {} cannot be {act}", path.display())]
    File {
        /// What was tried.
        act: &'static str,
        /// Which file.
        path: PathBuf,
        /// Why.
        #[source]
        source: io::Error,
    },
    /// It is no regular file.
    #[error("the memory {} is no regular file: name another", path.display())]
    NotRegular {
        /// Which.
        path: PathBuf,
    },
    /// It has a length that memory cannot have, or another than was asked for.
    #[error(
        "the memory {} has {found} bytes, expected {}: remove it, or name another",
        path.display(),
        match wanted {
            Some(wanted) => format!("{wanted}"),
            None => format!("a multiple of {PAGE}, at least {LEAST}"),
        }
    )]
    Length {
        /// Which file.
        path: PathBuf,
        /// Its length, bytes.
        found: u64,
        /// What was asked for, if anything was.
        wanted: Option<u64>,
    },
    /// A driver is at work on it.
    #[error("the memory {} is in use: end the driver that has it, or name another", path.display())]
    Busy {
        /// Which file.
        path: PathBuf,
    },
}

impl MemoryFile {
    /// Opens the file at `path`, or makes one of `wanted` bytes, for `default` if nothing is
    /// wanted. Its first byte is at `base` on the bus.
    ///
    /// # Errors
    /// [`MemoryFileError`]; a file that is there keeps its length and its content.
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
        let file = OpenOptions::new()
            .read(true)
            .write(true)
            .create(true)
            .truncate(false)
            .open(path)
            .map_err(failed("opened"))?;
        // Only to see that nobody has it: a driver holds the lock as long as it has the board.
        let file = match Flock::lock(file, FlockArg::LockExclusiveNonblock) {
            Ok(locked) => locked.unlock().map_err(|(_, errno)| failed("unlocked")(errno.into()))?,
            Err((_, Errno::EWOULDBLOCK)) => {
                return Err(MemoryFileError::Busy { path: path_buf() });
            }
            Err((_, errno)) => return Err(failed("locked")(errno.into())),
        };
        let metadata = file.metadata().map_err(failed("measured"))?;
        let bytes = match metadata.len() {
            0 => {
                file.set_len(new).map_err(failed("made"))?;
                new
            }
            found if !fits(found) || wanted.is_some_and(|wanted| wanted != found) => {
                return Err(length(found));
            }
            found => found,
        };
        Ok(Self { file, base, bytes, inode: metadata.ino() })
    }

    /// The addresses that it answers.
    #[must_use]
    pub fn addresses(&self) -> Range<u64> {
        self.base..self.base + self.bytes
    }

    /// The file's inode.
    #[must_use]
    pub fn inode(&self) -> u64 {
        self.inode
    }

    /// Where an address lies in the file. A write past the end would make the file longer.
    fn place(&self, address: u64, bytes: usize) -> io::Result<u64> {
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
        self.file.read_exact_at(to, self.place(address, to.len())?)
    }

    fn write(&self, address: u64, from: &[u8]) -> io::Result<()> {
        self.file.write_all_at(from, self.place(address, from.len())?)
    }
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

    /// The uppermost byte last: there stand the flags that say that a descriptor is complete.
    fn write_word(&mut self, address: u64, value: u32) -> io::Result<()> {
        let bytes = value.to_le_bytes();
        self.write(address, &bytes[..3])?;
        self.write(address + 3, &bytes[3..])
    }
}
