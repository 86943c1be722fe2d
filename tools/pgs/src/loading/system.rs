//! Everything that loading does to the system; tests replace it with a kernel of their own.

use std::fmt::Debug;
use std::fs::{self, OpenOptions};
use std::io::{self, Write};
use std::path::{Path, PathBuf};

/// The files of a Linux system.
pub(crate) trait System: Debug {
    /// Resolves a path without its leading slash.
    fn path(&self, path: &str) -> PathBuf;

    /// Writes an existing attribute of the kernel in one piece.
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
    fn make_directory(&self, path: &Path) -> io::Result<()> {
        fs::create_dir(path)
    }

    /// Removes such a folder; attributes of the kernel in it do not keep it.
    fn remove_directory(&self, path: &Path) -> io::Result<()> {
        fs::remove_dir(path)
    }

    /// Copies a file to a path that does not exist yet.
    fn copy(&self, from: &Path, to: &Path) -> io::Result<()> {
        let mut source = fs::File::open(from)?;
        let mut target = OpenOptions::new().write(true).create_new(true).open(to)?;
        io::copy(&mut source, &mut target).and_then(|_| target.sync_all()).inspect_err(|_| {
            // Half a file is worse than none; the first error is reported.
            let _ = fs::remove_file(to);
        })
    }
}

/// This system, or the files of one below a folder.
#[derive(Debug, Clone)]
pub(crate) struct Linux {
    pub(crate) root: PathBuf,
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
