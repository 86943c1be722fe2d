//! Files that a verb writes at its end.

use std::path::{Path, PathBuf};

use thiserror::Error;

use crate::failure::Failure;

/// The folder of a file is missing.
#[derive(Debug, Error)]
#[error("{}: expected a folder to write {} in, found none", folder.display(), name.display())]
struct NoFolder {
    folder: PathBuf,
    name: PathBuf,
}

/// Refuses a file that could not be written: its folder is missing.
pub(crate) fn check_folder(path: &Path) -> Result<(), Failure> {
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty());
    match folder.filter(|folder| !folder.is_dir()) {
        None => Ok(()),
        Some(folder) => {
            let error = NoFolder { folder: folder.to_owned(), name: path.to_owned() };
            Err(Failure::input(error).next("make the folder, or name another file"))
        }
    }
}
