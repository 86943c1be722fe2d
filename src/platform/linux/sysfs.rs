//! Reads the small text files in which the kernel describes devices.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use nix::errno::Errno;

use crate::platform::PlatformError;

/// The entries `<prefix><number>` of a directory, by number; none if there is no such directory.
pub(crate) fn numbered(
    directory: &Path,
    prefix: &str,
) -> Result<Vec<(u32, PathBuf)>, PlatformError> {
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
pub(crate) fn read(path: &Path) -> Result<String, PlatformError> {
    let text = fs::read_to_string(path).map_err(|source| PlatformError::File {
        act: "read",
        path: path.to_owned(),
        source,
    })?;
    Ok(text.trim().to_owned())
}

/// The text of a file that may be absent.
pub(crate) fn read_if_present(path: &Path) -> Result<Option<String>, PlatformError> {
    match read(path) {
        Err(PlatformError::File { source, .. }) if source.kind() == io::ErrorKind::NotFound => {
            Ok(None)
        }
        text => text.map(Some),
    }
}

/// The number in a file, decimal or with `0x`.
pub(crate) fn read_number(path: &Path) -> Result<u64, PlatformError> {
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
    fn an_absent_file_is_no_error_where_it_may_be_absent() {
        let root = tempfile::tempdir().expect("a directory");
        assert_eq!(read_if_present(&root.path().join("state")).expect("no error"), None);
        read_if_present(root.path()).expect_err("a directory is no text");
    }
}
