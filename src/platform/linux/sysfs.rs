//! Reads the small text files in which the kernel describes devices.

use std::fs::{self, File};
use std::io;
use std::os::unix::fs::FileExt as _;
use std::path::{Path, PathBuf};

use nix::errno::Errno;

use crate::platform::{PlatformError, Result};

/// The entries `<prefix><number>` of a directory, by number; none if there is no such directory.
pub(crate) fn numbered(directory: &Path, prefix: &str) -> Result<Vec<(u32, PathBuf)>> {
    let error = |source| PlatformError::File { act: "list", path: directory.to_owned(), source };
    let entries = match fs::read_dir(directory) {
        Err(source) if source.kind() == io::ErrorKind::NotFound => return Ok(Vec::new()),
        entries => entries.map_err(error)?,
    };
    let mut found = Vec::new();
    for entry in entries {
        let entry = entry.map_err(error)?;
        let name = entry.file_name();
        let number = name.to_str().and_then(|name| name.strip_prefix(prefix)?.parse().ok());
        if let Some(number) = number {
            found.push((number, entry.path()));
        }
    }
    found.sort_unstable();
    Ok(found)
}

/// The text of a file, without white space around it.
pub(crate) fn read(path: &Path) -> Result<String> {
    let text = fs::read_to_string(path).map_err(|source| PlatformError::File {
        act: "read",
        path: path.to_owned(),
        source,
    })?;
    Ok(text.trim().to_owned())
}

/// The text of a file that may be absent.
pub(crate) fn read_if_present(path: &Path) -> Result<Option<String>> {
    match read(path) {
        Err(PlatformError::File { source, .. }) if source.kind() == io::ErrorKind::NotFound => {
            Ok(None)
        }
        text => text.map(Some),
    }
}

/// The number in a file, decimal or with `0x`.
pub(crate) fn read_number(path: &Path) -> Result<u64> {
    let text = read(path)?;
    let number = match text.strip_prefix("0x") {
        Some(digits) => u64::from_str_radix(digits, 16),
        None => text.parse(),
    };
    number.map_err(|_| PlatformError::NotANumber { path: path.to_owned(), found: text })
}

/// Whether a file is gone: it was removed, or its device was.
pub(crate) fn is_gone(error: &PlatformError) -> bool {
    matches!(error, PlatformError::File { source, .. } if source.kind() == io::ErrorKind::NotFound
        || source.raw_os_error() == Some(Errno::ENODEV as i32))
}

/// An attribute that is kept open. It belongs to the device that had it at the opening: when that
/// is gone, the attribute is too, even if another device has its path by then.
#[derive(Debug)]
pub(crate) struct Attribute {
    file: File,
    path: PathBuf,
}

/// Longer texts are cut off.
const TEXT_BYTES: usize = 64;

impl Attribute {
    /// Opens an attribute that may be absent.
    pub(crate) fn open(path: PathBuf) -> Result<Option<Self>> {
        match File::open(&path) {
            Ok(file) => Ok(Some(Self { file, path })),
            Err(source) if source.kind() == io::ErrorKind::NotFound => Ok(None),
            Err(source) => Err(PlatformError::File { act: "open", path, source }),
        }
    }

    /// Hands over its bytes of now; `None` once its device is gone. One system call, no allocation.
    pub(crate) fn read<T>(&self, see: impl FnOnce(Option<&[u8]>) -> T) -> Result<T> {
        let mut text = [0; TEXT_BYTES];
        match self.file.read_at(&mut text, 0) {
            Ok(bytes) => Ok(see(Some(&text[..bytes]))),
            Err(source) => {
                let error = PlatformError::File { act: "read", path: self.path.clone(), source };
                if is_gone(&error) { Ok(see(None)) } else { Err(error) }
            }
        }
    }

    /// Where it lies.
    pub(crate) fn path(&self) -> &Path {
        &self.path
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_read_in_both_notations_and_nothing_else_is() {
        let root = tempfile::tempdir().expect("a directory");
        let file = root.path().join("size");
        for (text, number) in
            [("0x1000\n", Some(4096)), ("12\n", Some(12)), ("-1", None), ("", None)]
        {
            fs::write(&file, text).expect("written");
            match (read_number(&file), number) {
                (Ok(found), Some(expected)) => assert_eq!(found, expected),
                (Err(error), None) => assert!(error.to_string().contains("size"), "{error}"),
                (found, _) => panic!("{text:?} gave {found:?}"),
            }
        }
    }

    #[test]
    fn an_attribute_that_is_kept_open_shows_its_text_of_now() {
        let root = tempfile::tempdir().expect("a directory");
        let path = root.path().join("state");
        assert!(Attribute::open(path.clone()).expect("may be absent").is_none());
        fs::write(&path, "operating\n").expect("written");
        let state = Attribute::open(path.clone()).expect("opened").expect("there");
        let text = || state.read(|text| text.map(<[u8]>::to_vec)).expect("read");
        assert_eq!(text().as_deref(), Some(&b"operating\n"[..]));
        fs::write(&path, "x".repeat(100)).expect("written");
        assert_eq!(text().map(|text| text.len()), Some(64), "longer texts are cut off");
        // ENODEV, of a device that is gone, comes from a real kernel only: tools/guest asks it.
        fs::write(&path, "").expect("emptied");
        assert_eq!(text().as_deref(), Some(&[][..]));
    }

    #[test]
    fn an_absent_file_is_no_error_where_it_may_be_absent() {
        let root = tempfile::tempdir().expect("a directory");
        assert_eq!(read_if_present(&root.path().join("state")).expect("no error"), None);
        read_if_present(root.path()).expect_err("a directory is no text");
    }
}
