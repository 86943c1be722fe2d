//! Replaces files as a whole: a failure leaves the earlier ones unchanged.
//!
//! Each file is written under a temporary name in its own folder. Only after all of them are
//! complete and on the disk do they get their names, one after the other. If a step of this fails,
//! the earlier files get their names back. A process that is killed in between leaves temporary
//! files (`.pgs-...`), and every name with either its earlier or its new content.
//!
//! A new file has the owner, the group and the mode of the earlier one, as far as the file system
//! and the caller's rights allow it: a result is not lost because they cannot be set.

use std::fs::{self, File, Metadata, OpenOptions};
use std::io;
use std::os::unix::fs::{MetadataExt as _, fchown};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU32, Ordering};

use thiserror::Error;

/// A file that cannot be written, with the reason.
#[derive(Debug, Error)]
#[error("{} cannot be written", path.display())]
pub struct ReplaceError {
    /// The file.
    pub path: PathBuf,
    /// The system's error.
    #[source]
    pub source: io::Error,
}

/// Files that replace earlier ones together. Dropping it without a commit leaves the earlier files
/// unchanged.
#[derive(Debug, Default)]
pub struct Replacement {
    files: Vec<Staged>,
}

/// A complete file that does not have its name yet.
#[derive(Debug)]
struct Staged {
    /// The file to replace.
    target: PathBuf,
    /// Its path until it has its name.
    temporary: Option<PathBuf>,
    /// The temporary path of the earlier file.
    earlier: Option<PathBuf>,
}

/// Replaces one file by the output of `write`.
///
/// # Errors
///
/// [`ReplaceError`]: the earlier file, if there is one, is unchanged.
pub fn replace(
    path: &Path,
    write: impl FnOnce(&mut File) -> io::Result<()>,
) -> Result<(), ReplaceError> {
    let mut replacement = Replacement::default();
    replacement.stage(path, write)?;
    replacement.commit()
}

impl Replacement {
    /// Writes the replacement of the file at `path`, or its first content.
    ///
    /// A symbolic link stays one, and the file that it leads to is replaced. A device or a pipe
    /// cannot be replaced: it is written at once.
    ///
    /// # Errors
    ///
    /// [`ReplaceError`]: the file cannot be written, or must not be. Nothing is replaced then.
    pub fn stage(
        &mut self,
        path: &Path,
        write: impl FnOnce(&mut File) -> io::Result<()>,
    ) -> Result<(), ReplaceError> {
        self.try_stage(path, write)
            .map_err(|source| ReplaceError { path: path.to_path_buf(), source })
    }

    fn try_stage(
        &mut self,
        path: &Path,
        write: impl FnOnce(&mut File) -> io::Result<()>,
    ) -> io::Result<()> {
        let (target, earlier) = match destination(path)? {
            Destination::Stream(mut stream) => return write(&mut stream),
            Destination::Nothing => (path.to_path_buf(), None),
            Destination::File(path, metadata) => (path, Some(metadata)),
        };
        let (mut file, temporary) = temporary(&target)?;
        // From here on a failure removes the temporary file.
        self.files.push(Staged { target, temporary: Some(temporary.clone()), earlier: None });
        write(&mut file)?;
        if let Some(earlier) = earlier {
            make_like(&file, &earlier);
        }
        sync(&file)
    }

    /// Gives every file its name.
    ///
    /// # Errors
    ///
    /// [`ReplaceError`]: a file cannot get its name. The earlier files then have theirs.
    pub fn commit(mut self) -> Result<(), ReplaceError> {
        for at in 0..self.files.len() {
            if let Err(source) = self.files[at].take_name() {
                let path = self.files[at].target.clone();
                self.files[..at].iter_mut().for_each(Staged::give_name_back);
                return Err(ReplaceError { path, source });
            }
        }
        // After a power failure, a name that is not on the disk yet leads to the earlier file,
        // which is no worse.
        for staged in &self.files {
            let _ = File::open(folder_of(&staged.target)).and_then(|folder| folder.sync_all());
        }
        Ok(())
    }
}

impl Drop for Replacement {
    /// Removes temporary files.
    fn drop(&mut self) {
        for Staged { temporary, earlier, .. } in &self.files {
            for left in temporary.iter().chain(earlier) {
                // A leftover file does no harm.
                let _ = fs::remove_file(left);
            }
        }
    }
}

impl Staged {
    /// Puts the new file in the place of the earlier one, which is kept under another name.
    fn take_name(&mut self) -> io::Result<()> {
        let Some(temporary) = &self.temporary else { return Ok(()) };
        match fs::symlink_metadata(&self.target) {
            Ok(found) if found.is_dir() => return Err(io::ErrorKind::IsADirectory.into()),
            Ok(_) => self.earlier = Some(keep(&self.target)?),
            Err(error) if error.kind() == io::ErrorKind::NotFound => {}
            Err(error) => return Err(error),
        }
        match fs::rename(temporary, &self.target) {
            Ok(()) => {
                self.temporary = None;
                Ok(())
            }
            Err(error) => {
                self.restore();
                Err(error)
            }
        }
    }

    /// Undoes [`take_name`](Self::take_name).
    fn give_name_back(&mut self) {
        if self.earlier.is_none() {
            // There was no earlier file. The error that led here is reported.
            let _ = fs::remove_file(&self.target);
        }
        self.restore();
    }

    /// Gives the earlier file its name again. If this fails as well, the file keeps its temporary
    /// name.
    fn restore(&mut self) {
        let Some(earlier) = self.earlier.take() else { return };
        if fs::rename(&earlier, &self.target).is_ok() {
            // If both are names of one file, both stay.
            let _ = fs::remove_file(&earlier);
        }
    }
}

/// Keeps a file under another name. Where the file system has hard links it is a second name, so
/// that the first always exists.
fn keep(path: &Path) -> io::Result<PathBuf> {
    let kept = free_name(path);
    fs::hard_link(path, &kept).or_else(|_| fs::rename(path, &kept))?;
    Ok(kept)
}

/// Gives a file the owner, the group and the mode of an earlier one. Where that cannot be, as on a
/// FAT file system or without the rights, it keeps its own.
fn make_like(file: &File, earlier: &Metadata) {
    let found = file.metadata().map(|metadata| (metadata.uid(), metadata.gid())).ok();
    if found != Some((earlier.uid(), earlier.gid())) {
        // Whoever may not give a file away may still give it to a group of his.
        let _ = fchown(file, Some(earlier.uid()), Some(earlier.gid()))
            .or_else(|_| fchown(file, None, Some(earlier.gid())));
    }
    // After the owner, whose change takes bits of the mode away.
    let _ = file.set_permissions(earlier.permissions());
}

/// Has a file's data reach the disk, where the file system and the sandbox have such a call.
///
/// # Errors
///
/// The data did not reach the disk; some file systems report a full one only here.
pub fn sync(file: &File) -> io::Result<()> {
    file.sync_all().or_else(|error| if is_lost(&error) { Err(error) } else { Ok(()) })
}

/// Whether an error of `fsync` says that data did not reach the disk. Every other one says that the
/// file system, or a sandbox, has no such call.
fn is_lost(error: &io::Error) -> bool {
    matches!(
        error.kind(),
        io::ErrorKind::StorageFull
            | io::ErrorKind::QuotaExceeded
            | io::ErrorKind::FileTooLarge
            | io::ErrorKind::StaleNetworkFileHandle
    ) || error.raw_os_error() == Some(EIO)
}

/// The number of the kernel's input/output error, which has no kind of its own.
const EIO: i32 = 5;

/// The target of a write.
enum Destination {
    /// A free name.
    Nothing,
    /// A regular file, behind all links.
    File(PathBuf, Metadata),
    /// A device or a pipe.
    Stream(File),
}

fn destination(path: &Path) -> io::Result<Destination> {
    let metadata = match fs::metadata(path) {
        Ok(metadata) => metadata,
        Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(Destination::Nothing),
        Err(error) => return Err(error),
    };
    // Fails on a folder, and where the file must not be written; the folder's rights alone would
    // not tell.
    let file = OpenOptions::new().write(true).open(path)?;
    if !metadata.is_file() {
        return Ok(Destination::Stream(file));
    }
    Ok(Destination::File(fs::canonicalize(path)?, metadata))
}

/// Makes a new file in the folder of `beside`.
fn temporary(beside: &Path) -> io::Result<(File, PathBuf)> {
    loop {
        let path = free_name(beside);
        match OpenOptions::new().write(true).create_new(true).open(&path) {
            // Another process took the name first.
            Err(error) if error.kind() == io::ErrorKind::AlreadyExists => {}
            made => return Ok((made?, path)),
        }
    }
}

/// A free name in the folder of `beside`, unused even by files of a killed process.
fn free_name(beside: &Path) -> PathBuf {
    static NUMBER: AtomicU32 = AtomicU32::new(0);
    loop {
        let number = NUMBER.fetch_add(1, Ordering::Relaxed);
        let path = folder_of(beside).join(format!(".pgs-{}-{number}", std::process::id()));
        if fs::symlink_metadata(&path).is_err() {
            return path;
        }
    }
}

/// The folder of a file.
fn folder_of(path: &Path) -> &Path {
    match path.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new("."),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs::Permissions;
    use std::io::Write as _;
    use tempfile::TempDir;

    /// A folder with two files of an earlier run.
    fn earlier() -> TempDir {
        let folder = tempfile::tempdir().expect("a temporary folder");
        for name in ["a", "b"] {
            fs::write(folder.path().join(name), format!("earlier {name}")).expect("written");
        }
        folder
    }

    /// Names and contents, by name; nothing for a folder.
    fn content(folder: &Path) -> Vec<(String, String)> {
        let entries = fs::read_dir(folder).expect("the folder").map(|entry| {
            let entry = entry.expect("an entry");
            let name = entry.file_name().into_string().expect("text");
            (name, fs::read_to_string(entry.path()).unwrap_or_default())
        });
        let mut found: Vec<_> = entries.collect();
        found.sort();
        found
    }

    fn stage(replacement: &mut Replacement, path: &Path, text: &str) -> Result<(), ReplaceError> {
        replacement.stage(path, |file| file.write_all(text.as_bytes()))
    }

    #[test]
    fn files_are_replaced_together_and_nothing_else_is_left() {
        let folder = earlier();
        let [a, c] = ["a", "c"].map(|name| folder.path().join(name));
        let mut replacement = Replacement::default();
        stage(&mut replacement, &a, "new a").expect("staged");
        stage(&mut replacement, &c, "new c").expect("staged");
        let visible = |name: &str| fs::read_to_string(folder.path().join(name)).ok();
        assert_eq!((visible("a"), visible("c")), (Some("earlier a".to_owned()), None));
        replacement.commit().expect("committed");
        let expected = [("a", "new a"), ("b", "earlier b"), ("c", "new c")];
        let expected = expected.map(|(name, text)| (name.to_owned(), text.to_owned()));
        assert_eq!(content(folder.path()), expected);
    }

    #[test]
    fn a_writer_that_fails_leaves_everything_as_it_was() {
        let folder = earlier();
        let before = content(folder.path());
        let [a, b] = ["a", "b"].map(|name| folder.path().join(name));
        let mut replacement = Replacement::default();
        stage(&mut replacement, &a, "new a").expect("staged");
        let full = replacement.stage(&b, |file| {
            file.write_all(b"half of")?;
            Err(io::ErrorKind::StorageFull.into())
        });
        let error = full.expect_err("no room");
        assert!(error.to_string().ends_with("b cannot be written"), "{error}");
        drop(replacement);
        assert_eq!(content(folder.path()), before);
    }

    #[test]
    fn a_device_that_is_full_is_an_error() {
        let full = Path::new("/dev/full");
        if !full.exists() {
            return;
        }
        let error = replace(full, |file| file.write_all(b"text")).expect_err("no room");
        assert_eq!(error.source.kind(), io::ErrorKind::StorageFull);
        replace(Path::new("/dev/null"), |file| file.write_all(b"text")).expect("it takes all");
        assert!(!fs::metadata("/dev/null").expect("there").is_file());
    }

    #[test]
    fn a_name_that_cannot_be_taken_gives_the_others_back() {
        let folder = earlier();
        let before = content(folder.path());
        let path = |name: &str| folder.path().join(name);
        let mut replacement = Replacement::default();
        for name in ["a", "new", "b", "taken"] {
            stage(&mut replacement, &path(name), "new").expect("staged");
        }
        fs::create_dir(path("taken")).expect("a folder in the way");
        let error = replacement.commit().expect_err("a folder has the name");
        assert!(error.path.ends_with("taken"), "{error}");
        fs::remove_dir(path("taken")).expect("it is still there, and empty");
        assert_eq!(content(folder.path()), before);
    }

    #[test]
    fn a_folder_is_not_replaced() {
        let folder = earlier();
        let error = replace(folder.path(), |_| Ok(())).expect_err("a folder");
        assert_eq!(error.source.kind(), io::ErrorKind::IsADirectory);
    }

    #[test]
    fn links_stay_links_and_permissions_stay() {
        use std::os::unix::fs::{PermissionsExt, symlink};
        let (folder, elsewhere) = (earlier(), earlier());
        let target = elsewhere.path().join("a");
        fs::set_permissions(&target, Permissions::from_mode(0o640)).expect("owned");
        let link = folder.path().join("link");
        symlink(&target, &link).expect("a link");
        replace(&link, |file| file.write_all(b"new")).expect("replaced");
        assert!(fs::symlink_metadata(&link).expect("there").is_symlink());
        assert_eq!(fs::read_to_string(&target).expect("there"), "new");
        assert_eq!(fs::metadata(&target).expect("there").permissions().mode() & 0o777, 0o640);
        assert_eq!((content(folder.path()).len(), content(elsewhere.path()).len()), (3, 2));
    }

    /// Root that replaces a user's file leaves it to the user.
    #[test]
    fn the_owner_of_a_file_stays() {
        use std::os::unix::fs::{PermissionsExt, chown};
        let folder = earlier();
        let path = folder.path().join("a");
        if chown(&path, Some(1234), Some(1235)).is_err() {
            let _ = writeln!(io::stderr(), "skipped: another owner (not root)");
            return;
        }
        fs::set_permissions(&path, Permissions::from_mode(0o4640)).expect("owned");
        replace(&path, |file| file.write_all(b"new")).expect("replaced");
        let found = fs::metadata(&path).expect("there");
        assert_eq!((found.uid(), found.gid(), found.mode() & 0o7777), (1234, 1235, 0o4640));
        assert_eq!(fs::read_to_string(&path).expect("there"), "new");
    }
}
