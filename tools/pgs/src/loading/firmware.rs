//! This file puts a bitstream where the kernel looks for it.

use std::fs;
use std::path::{Path, PathBuf};

use super::LoadError;
use super::system::System;

/// Where the kernel looks for firmware, last.
const FOLDER: &str = "lib/firmware";
/// The longest name that the manager takes: its buffer has 255 bytes with the terminator.
const NAME_BYTES_MAX: usize = 254;

/// A bitstream in the kernel's firmware folder. A copy goes when this does.
#[derive(Debug)]
pub(super) struct Firmware {
    name: String,
    copy: Option<PathBuf>,
}

impl Firmware {
    /// Names the file if it lies below the firmware folder, else copies it there.
    pub(super) fn provide(system: &dyn System, bitstream: &Path) -> Result<Self, LoadError> {
        let folder = system.path(FOLDER);
        let real = fs::canonicalize(bitstream)
            .map_err(|source| LoadError::unreadable(bitstream, source))?;
        // The folder is usually reached through a link, /lib -> /usr/lib.
        if let Ok(below) = fs::canonicalize(&folder)
            && let Ok(name) = real.strip_prefix(below)
        {
            return Ok(Self { name: kernel_name(name)?, copy: None });
        }
        let name = format!("pgs-load-{}.bit.bin", std::process::id());
        let copy = folder.join(&name);
        fs::create_dir_all(&folder).map_err(|source| LoadError::file("make", &folder, source))?;
        system
            .copy(&real, &copy)
            .map_err(|source| LoadError::file("copy the bitstream to", &copy, source))?;
        Ok(Self { name, copy: Some(copy) })
    }

    /// What the manager is to be told.
    pub(super) fn name(&self) -> &str {
        &self.name
    }

    pub(super) fn is_copy(&self) -> bool {
        self.copy.is_some()
    }
}

impl Drop for Firmware {
    fn drop(&mut self) {
        if let Some(copy) = &self.copy
            && let Err(error) = fs::remove_file(copy)
        {
            log::warn!("the copy {} stays: {error}", copy.display());
        }
    }
}

/// The name as the manager reads it: it copies it unchecked, and cuts a line end off.
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
