//! Replaces files as a whole: a failure leaves the earlier ones as they were.
//!
//! Each file is written under a temporary name in its own folder. Only when all of them are complete, and
//! on the disk, do they get their names, one after the other; if that fails, the earlier files get them
//! back. A process that is killed in between leaves temporary files (`.pgs-...`), and every name with
//! either its earlier or its new content.

use std::fs::{self, File, OpenOptions, Permissions};
use std::io;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU32, Ordering};

use thiserror::Error;

/// A file that cannot be written, and why.
#[derive(Debug, Error)]
#[error("{} cannot be written", path.display())]
pub struct ReplaceError {
    /// The file.
    pub path: PathBuf,
    /// What the system says.
    #[source]
    pub source: io::Error,
}

/// Files that replace earlier ones together. Dropped, it leaves these as they are.
#[derive(Debug, Default)]
pub struct Replacement {
    files: Vec<Staged>,
}

/// A file that is complete and has not got its name yet.
#[derive(Debug)]
struct Staged {
    /// What it is to replace.
    target: PathBuf,
    /// Where it is until it has its name.
    temporary: Option<PathBuf>,
    /// Where the earlier file is meanwhile.
    earlier: Option<PathBuf>,
}

/// Replaces one file by what `write` writes.
///
/// # Errors
/// [`ReplaceError`]: the earlier file, if there is one, is as it was.
pub fn replace(
    path: &Path,
    write: impl FnOnce(&mut File) -> io::Result<()>,
) -> Result<(), ReplaceError> {
    let mut replacement = Replacement::default();
    replacement.stage(path, write)?;
    replacement.commit()
}

impl Replacement {
    /// Writes what is to replace the file at `path`, or to be the first one there.
    ///
    /// A symbolic link stays one, and the file that it leads to is replaced. A device or a pipe cannot be
    /// replaced: it gets what is written at once.
    ///
    /// # Errors
    /// [`ReplaceError`]: the file cannot be written, or may not be. Nothing is replaced then.
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
        let (target, permissions) = match destination(path)? {
            Destination::Stream(mut stream) => return write(&mut stream),
            Destination::Nothing => (path.to_path_buf(), None),
            Destination::File(path, permissions) => (path, Some(permissions)),
        };
        let (mut file, temporary) = temporary(&target)?;
        // From here on it is removed when something fails.
        self.files.push(Staged { target, temporary: Some(temporary.clone()), earlier: None });
        write(&mut file)?;
        if let Some(permissions) = permissions {
            fs::set_permissions(&temporary, permissions)?;
        }
        // Some file systems say only here that there is no room.
        file.sync_all()
    }

    /// Gives every file its name.
    ///
    /// # Errors
    /// [`ReplaceError`]: a file cannot have its name. The earlier files have theirs then.
    pub fn commit(mut self) -> Result<(), ReplaceError> {
        for at in 0..self.files.len() {
            if let Err(source) = self.files[at].take_name() {
                let path = self.files[at].target.clone();
                self.files[..at].iter_mut().for_each(Staged::give_name_back);
                return Err(ReplaceError { path, source });
            }
        }
        // Names that are not on the disk yet are the earlier ones after a power failure, no worse.
        for staged in &self.files {
            let _ = File::open(folder_of(&staged.target)).and_then(|folder| folder.sync_all());
        }
        Ok(())
    }
}

impl Drop for Replacement {
    /// Removes what is left under temporary names.
    fn drop(&mut self) {
        for Staged { temporary, earlier, .. } in &self.files {
            for left in temporary.iter().chain(earlier) {
                // It is no harm but a file too many.
                let _ = fs::remove_file(left);
            }
        }
    }
}

impl Staged {
    /// Puts the new file in the place of the earlier one, which is kept beside it.
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
            // There was no earlier file. The error that counts is the one that led here.
            let _ = fs::remove_file(&self.target);
        }
        self.restore();
    }

    /// Gives the earlier file its name again. Where this fails as well, the file stays under its temporary
    /// name.
    fn restore(&mut self) {
        let Some(earlier) = self.earlier.take() else { return };
        if fs::rename(&earlier, &self.target).is_ok() {
            // Of two names of one file this leaves both.
            let _ = fs::remove_file(&earlier);
        }
    }
}

/// Keeps a file under another name; as a second name where the file system has such, so that the first is
/// never without a file.
fn keep(path: &Path) -> io::Result<PathBuf> {
    let kept = free_name(path);
    fs::hard_link(path, &kept).or_else(|_| fs::rename(path, &kept))?;
    Ok(kept)
}

/// What is written to.
enum Destination {
    /// A name that is free.
    Nothing,
    /// A regular file, where it really is.
    File(PathBuf, Permissions),
    /// A device or a pipe.
    Stream(File),
}

fn destination(path: &Path) -> io::Result<Destination> {
    let metadata = match fs::metadata(path) {
        Ok(metadata) => metadata,
        Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(Destination::Nothing),
        Err(error) => return Err(error),
    };
    // Fails where the file may not be written, as its folder alone would not; and on a folder.
    let file = OpenOptions::new().write(true).open(path)?;
    if !metadata.is_file() {
        return Ok(Destination::Stream(file));
    }
    Ok(Destination::File(fs::canonicalize(path)?, metadata.permissions()))
}

/// Makes a file of another name in the folder of a file.
fn temporary(beside: &Path) -> io::Result<(File, PathBuf)> {
    loop {
        let path = free_name(beside);
        match OpenOptions::new().write(true).create_new(true).open(&path) {
            // Another process was faster.
            Err(error) if error.kind() == io::ErrorKind::AlreadyExists => {}
            made => return Ok((made?, path)),
        }
    }
}

/// A name in the folder of a file that nothing has, not even what a killed process has left.
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

/// The folder that a file is in.
fn folder_of(path: &Path) -> &Path {
    match path.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new("."),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
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

    /// Names and contents, in the order of the names; nothing for a folder.
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
}
