//! Opens a device file for one user alone.
//!
//! The lock is `flock(2)`. It belongs to one opening of the file: a second opening is refused,
//! whether another program makes it or another part of this one. Every device file that this folder
//! maps is opened here, and a [`Mapping`](super::mapped::Mapping) holds the lock as long as it
//! exists, which makes it the only mapping of its memory. The lock binds only programs that ask for
//! it, and a second device file of the same device (`mknod`) has a lock of its own.

use std::fs::{File, TryLockError};
use std::path::{Path, PathBuf};

use pgs_support::Process;

use super::system::open_device;
use crate::platform::{PlatformError, Result};

/// An open device file with its lock, which is released on drop.
#[derive(Debug)]
pub(crate) struct LockedFile {
    file: File,
    path: PathBuf,
    process: Process,
    /// Other device files that show the same memory, locked for the same time.
    others: Vec<LockedFile>,
}

impl LockedFile {
    /// Opens and locks a device file to read and write; `flags` as for `open`.
    ///
    /// [`PlatformError::Busy`] if the file is locked already.
    pub(crate) fn open(path: &Path, flags: i32) -> Result<Self> {
        Self::of_file(open_device(path, flags)?, path)
    }

    /// Locks an open file.
    pub(crate) fn of_file(file: File, path: &Path) -> Result<Self> {
        let path = path.to_owned();
        match file.try_lock() {
            Ok(()) => Ok(Self { file, path, process: Process::this(), others: Vec::new() }),
            Err(TryLockError::WouldBlock) => Err(PlatformError::Busy { path }),
            Err(TryLockError::Error(source)) => {
                Err(PlatformError::File { act: "lock", path, source })
            }
        }
    }

    /// Holds other files for the same time.
    pub(crate) fn with(mut self, others: Vec<LockedFile>) -> Self {
        self.others.extend(others);
        self
    }

    /// The open file.
    pub(crate) fn file(&self) -> &File {
        &self.file
    }

    /// Where it lies.
    pub(crate) fn path(&self) -> &Path {
        &self.path
    }
}

impl Drop for LockedFile {
    /// Unlocks at once, although a forked child may still have the file open. In such a child,
    /// which shares the lock, it only closes the file: the lock stays with the parent.
    fn drop(&mut self) {
        if self.process.is_this() {
            // Closing the file unlocks it as well.
            let _ = self.file.unlock();
        }
    }
}

/// The lock of a device file, held without a use of the device: no other program, and no other part
/// of this one, opens the device through this driver meanwhile.
#[derive(Debug)]
pub struct DeviceLock {
    _file: LockedFile,
}

impl DeviceLock {
    /// Locks a device file.
    ///
    /// # Errors
    /// [`PlatformError::Busy`] if it is locked already; the file cannot be opened to read and
    /// write.
    pub fn new(path: &Path) -> Result<Self, PlatformError> {
        Ok(Self { _file: LockedFile::open(path, nix::libc::O_NONBLOCK)? })
    }
}

#[cfg(test)]
mod tests {
    use std::io::{BufRead as _, BufReader, Write as _};
    use std::process::{Command, Stdio};
    use std::thread;
    use std::time::{Duration, Instant};

    use super::*;

    fn device() -> (tempfile::TempDir, PathBuf) {
        let root = tempfile::tempdir().expect("a directory");
        let path = root.path().join("uio0");
        File::create(&path).expect("made");
        (root, path)
    }

    fn assert_busy(path: &Path) {
        let error = LockedFile::open(path, 0).expect_err("somebody has it");
        assert!(matches!(&error, PlatformError::Busy { path: busy } if busy == path), "{error}");
    }

    /// Free within ten seconds: a program that another test starts has copies of all open files,
    /// and so of the lock, from its fork to its first instruction.
    fn assert_free(path: &Path) {
        let until = Instant::now() + Duration::from_secs(10);
        while let Err(error) = LockedFile::open(path, 0) {
            assert!(Instant::now() < until, "{error}");
            thread::yield_now();
        }
    }

    #[test]
    fn a_second_opening_in_this_process_is_refused_until_the_first_is_closed() {
        let (_root, path) = device();
        let first = LockedFile::open(&path, 0).expect("free");
        assert_busy(&path);
        assert_busy(&path);
        drop(first);
        assert_free(&path);
    }

    #[test]
    fn a_lock_without_a_use_keeps_every_user_away() {
        let (_root, path) = device();
        let lock = DeviceLock::new(&path).expect("free");
        assert_busy(&path);
        DeviceLock::new(&path).expect_err("a second one");
        drop(lock);
        assert_free(&path);
    }

    #[test]
    fn what_is_held_along_is_free_at_the_same_time() {
        let (_root, path) = device();
        let (_other_root, other) = device();
        let held = LockedFile::open(&other, 0).expect("free");
        let both = LockedFile::open(&path, 0).expect("free").with(vec![held]);
        assert_busy(&other);
        drop(both);
        assert_free(&other);
    }

    /// The lock belongs to the opening, which a forked child shares: an unlock there would unlock
    /// here.
    #[test]
    fn a_forked_child_that_drops_a_lock_leaves_it_to_its_parent() {
        let (_root, path) = device();
        let mut held = Some(LockedFile::open(&path, 0).expect("free"));
        let in_child = || {
            drop(held.take());
            7
        };
        assert_eq!(pgs_support::in_forked_child(in_child), Some(7));
        assert_busy(&path);
        drop(held);
        assert_free(&path);
    }

    /// `flock(1)` is another program that asks for the same lock.
    #[test]
    fn another_process_is_refused_and_refuses() {
        let version = Command::new("flock").arg("--version").output();
        if !version.is_ok_and(|version| version.status.success()) {
            let _ = writeln!(std::io::stderr(), "skipped: two processes (no flock program)");
            return;
        }
        let (_root, path) = device();
        let ours = LockedFile::open(&path, 0).expect("free");
        let try_lock = || Command::new("flock").arg("-n").arg(&path).arg("true").status();
        assert_eq!(try_lock().expect("it runs").code(), Some(1), "we have it");
        drop(ours);
        assert!(try_lock().expect("it runs").success(), "free");

        // It holds the lock until its standard input ends.
        let mut other = Command::new("flock")
            .arg("-n")
            .arg(&path)
            .args(["sh", "-c", "echo held; cat"])
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()
            .expect("it runs");
        let mut line = String::new();
        BufReader::new(other.stdout.as_mut().expect("piped")).read_line(&mut line).expect("read");
        assert_eq!(line, "held\n");
        assert_busy(&path);
        drop(other.stdin.take());
        assert!(other.wait().expect("it ends").success());
        assert_free(&path);
    }
}
