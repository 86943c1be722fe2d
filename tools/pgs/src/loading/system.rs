//! Everything that loading does to the system; tests replace it with a kernel of their own.

use std::fmt::Debug;
use std::fs::{self, OpenOptions};
use std::io::{self, Read as _, Write};
use std::os::unix::fs::OpenOptionsExt as _;
use std::path::{Path, PathBuf};

use nix::libc::O_NONBLOCK;
use step_folder::replace::sync;

use super::LoadError;

/// The files of a Linux system.
pub trait System: Debug {
    /// Resolves a path without its leading slash.
    fn path(&self, path: &str) -> PathBuf;

    /// Writes an existing attribute of the kernel in one piece.
    ///
    /// # Errors
    /// The system's.
    fn write(&self, path: &Path, bytes: &[u8]) -> io::Result<()> {
        let mut file = OpenOptions::new().write(true).truncate(true).open(path)?;
        // The kernel acts on each write: a second write would set another value.
        let written = file.write(bytes)?;
        if written != bytes.len() {
            return Err(io::Error::new(
                io::ErrorKind::WriteZero,
                format!("{written} of {} bytes were taken", bytes.len()),
            ));
        }
        file.flush()
    }

    /// Makes a folder, which may create an object of the kernel.
    ///
    /// # Errors
    /// The system's.
    fn make_directory(&self, path: &Path) -> io::Result<()> {
        fs::create_dir(path)
    }

    /// Removes such a folder; attributes of the kernel in it do not keep it.
    ///
    /// # Errors
    /// The system's.
    fn remove_directory(&self, path: &Path) -> io::Result<()> {
        fs::remove_dir(path)
    }

    /// Writes a file at a path that does not exist yet.
    ///
    /// # Errors
    /// The system's.
    fn create(&self, path: &Path, bytes: &[u8]) -> io::Result<()> {
        let mut file = OpenOptions::new().write(true).create_new(true).open(path)?;
        file.write_all(bytes).and_then(|()| sync(&file)).inspect_err(|_| {
            // Half a file is worse than none; the first error is reported.
            let _ = fs::remove_file(path);
        })
    }
}

/// This system, or the files of one below a folder.
#[derive(Debug, Clone)]
pub struct Linux {
    /// The folder.
    pub root: PathBuf,
}

impl System for Linux {
    fn path(&self, path: &str) -> PathBuf {
        self.root.join(path)
    }
}

/// Reads an attribute's text.
pub(super) fn read(path: &Path) -> io::Result<String> {
    fs::read_to_string(path).map(|text| text.trim().to_owned())
}

/// Reads a plain file of the caller; otherwise says what it is. A pipe or device is not waited for.
pub(super) fn read_plain(path: &Path, max: u64) -> Result<Result<Vec<u8>, String>, LoadError> {
    let unreadable = |source| LoadError::unreadable(path, source);
    let opened = OpenOptions::new().read(true).custom_flags(O_NONBLOCK).open(path);
    let file = match opened {
        // A socket cannot be opened.
        Err(_) if path.metadata().is_ok_and(|meta| !meta.is_file()) => {
            return Ok(Err("no plain file".to_owned()));
        }
        opened => opened.map_err(unreadable)?,
    };
    let meta = file.metadata().map_err(unreadable)?;
    if !meta.is_file() {
        return Ok(Err("no plain file".to_owned()));
    }
    let mut bytes = Vec::new();
    if meta.len() <= max {
        file.take(max + 1).read_to_end(&mut bytes).map_err(unreadable)?;
    }
    match meta.len().max(bytes.len() as u64) {
        length if length > max => Ok(Err(format!("a file of more than {max} bytes"))),
        _ => Ok(Ok(bytes)),
    }
}
