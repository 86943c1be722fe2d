//! Puts a bitstream where the kernel looks for firmware.

use std::fs;
use std::path::Path;

use super::LoadError;
use super::progress::Progress;
use super::system::{System, read};

/// The folder that the kernel searches last.
const FOLDER: &str = "lib/firmware";
/// Names the folder that the kernel searches first; empty if there is none.
const FIRST_FOLDER: &str = "sys/module/firmware_class/parameters/path";
/// The longest name that the manager takes: its buffer has 255 bytes with the terminator.
const NAME_BYTES_MAX: usize = 254;

/// A bitstream in a firmware folder of the kernel. Dropping it removes a copy.
#[derive(Debug)]
pub(super) struct Firmware {
    name: String,
    is_copy: bool,
    progress: Progress,
}

impl Firmware {
    /// Names the file if it lies below a firmware folder; otherwise copies it to the folder
    /// searched first.
    pub(super) fn provide(
        system: &dyn System,
        bitstream: &Path,
        bytes: &[u8],
        progress: &Progress,
    ) -> Result<Self, LoadError> {
        let progress = progress.clone();
        let first = read(&system.path(FIRST_FOLDER)).unwrap_or_default();
        let first = Some(first.trim_start_matches('/')).filter(|path| !path.is_empty());
        let folders: Vec<_> =
            first.into_iter().chain([FOLDER]).map(|folder| system.path(folder)).collect();
        let real = fs::canonicalize(bitstream)
            .map_err(|source| LoadError::unreadable(bitstream, source))?;
        for (place, folder) in folders.iter().enumerate() {
            // The folder is usually reached through a link, /lib -> /usr/lib.
            let below = fs::canonicalize(folder).ok();
            let name = below.as_ref().and_then(|below| real.strip_prefix(below).ok());
            let Some(name) = name else { continue };
            // A file of the same name in a folder searched earlier hides this one.
            if !folders[..place].iter().any(|before| before.join(name).exists()) {
                return Ok(Self { name: kernel_name(name)?, is_copy: false, progress });
            }
        }
        let name = format!("pgs-load-{}.bit.bin", std::process::id());
        let folder = &folders[0];
        let copy = folder.join(&name);
        let length = bytes.len() as u64;
        let error = |source| LoadError::Copy { path: copy.clone(), bytes: length, source };
        fs::create_dir_all(folder).map_err(error)?;
        progress.keep(&copy);
        if let Err(source) = system.create(&copy, bytes) {
            progress.forget();
            return Err(error(source));
        }
        Ok(Self { name, is_copy: true, progress })
    }

    /// The name for the manager.
    pub(super) fn name(&self) -> &str {
        &self.name
    }

    pub(super) fn is_copy(&self) -> bool {
        self.is_copy
    }
}

impl Drop for Firmware {
    fn drop(&mut self) {
        self.progress.remove_copy();
    }
}

/// The name as the manager reads it: the manager copies it unchecked, and cuts off a line end.
fn kernel_name(path: &Path) -> Result<String, LoadError> {
    let refuse =
        |reason| Err(LoadError::Name { name: path.to_string_lossy().into_owned(), reason });
    let Some(name) = path.to_str() else { return refuse("it is not UTF-8") };
    if name.chars().any(char::is_control) {
        return refuse("it has control characters");
    }
    if name.len() > NAME_BYTES_MAX {
        return refuse("it is longer than 254 bytes");
    }
    Ok(name.to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_that_the_kernel_would_misread_are_refused() {
        assert_eq!(kernel_name(Path::new("a/b.bit.bin")).expect("a name"), "a/b.bit.bin");
        assert_eq!(kernel_name(Path::new(&"a".repeat(254))).expect("a name").len(), 254);
        for wrong in ["a".repeat(255), "a\n".to_owned()] {
            let error = kernel_name(Path::new(&wrong)).expect_err("refused");
            assert!(matches!(error, LoadError::Name { .. }), "{error}");
        }
    }
}
