//! Sets the `sync_mode` of a u-dma-buf, which decides how its two mappings are cached.
//!
//! Source: README and source of u-dma-buf 5.

use std::fs;
use std::path::Path;

use crate::platform::linux::sysfs::{read, read_number};
use crate::platform::{Caching, PlatformError, Result};

/// Bits 1:0 of `sync_mode`: cached even with `O_SYNC`.
const MODE_CACHED: u64 = 0;
/// Uncached with `O_SYNC`: Device memory on arm64.
const MODE_UNCACHED: u64 = 1;
/// Write-combining with `O_SYNC`.
const MODE_WRITE_COMBINING: u64 = 2;
/// Bit of `sync_mode`: the mode holds without `O_SYNC` too.
const MODE_ALWAYS: u64 = 4;

/// Makes sure of a mode in which the device file, opened with and without `O_SYNC`, gives the
/// mappings that `caching` needs.
pub(crate) fn set_mode(name: &str, buffer: &Path, caching: Caching, coherent: bool) -> Result<()> {
    let path = buffer.join("sync_mode");
    let found = read_number(&path)?;
    let (suits, wanted) = match caching {
        // With O_SYNC the mapping must be uncached, without it cached.
        Caching::Cached => (
            (found & MODE_ALWAYS == 0 && (found != MODE_CACHED || coherent))
                || (coherent && found == MODE_ALWAYS | MODE_CACHED),
            "cached buffers beside uncached descriptors",
        ),
        Caching::WriteCombining => (
            !matches!(found & !MODE_ALWAYS, MODE_CACHED | MODE_UNCACHED),
            "write-combining buffers",
        ),
    };
    if suits {
        return Ok(());
    }
    let refused = |source| PlatformError::SyncMode {
        name: name.to_owned(),
        found,
        wanted,
        path: path.clone(),
        source,
    };
    log::info!("u-dma-buf {name:?}: changing sync_mode from {found} to {MODE_WRITE_COMBINING}");
    fs::write(&path, format!("{MODE_WRITE_COMBINING}\n")).map_err(refused)?;
    // A driver may accept the write and keep its mode, and the mapping depends on the kept mode.
    let kept = read(&path)?;
    if kept.parse() == Ok(MODE_WRITE_COMBINING) {
        return Ok(());
    }
    let (name, written) = (name.to_owned(), MODE_WRITE_COMBINING);
    Err(PlatformError::SyncModeRefused { name, written, found: kept, wanted, path })
}

#[cfg(test)]
mod tests {
    use nix::sys::stat::Mode;
    use nix::unistd::mkfifo;

    use super::*;

    #[test]
    fn a_mode_that_does_not_suit_is_changed() {
        for (mode, caching) in [
            ("0", Caching::Cached),
            ("4", Caching::Cached),
            ("5", Caching::Cached),
            ("6", Caching::Cached),
            ("0", Caching::WriteCombining),
            ("1", Caching::WriteCombining),
            ("5", Caching::WriteCombining),
        ] {
            let root = tempfile::tempdir().expect("a directory");
            let path = root.path().join("sync_mode");
            fs::write(&path, format!("{mode}\n")).expect("written");
            set_mode("pgs", root.path(), caching, false).expect("changed");
            assert_eq!(fs::read_to_string(&path).expect("read"), "2\n", "{mode}");
        }
    }

    #[test]
    fn a_mode_that_the_driver_does_not_keep_is_an_error() {
        for kept in ["1", "3", "2 or so"] {
            let root = tempfile::tempdir().expect("a directory");
            let path = root.path().join("sync_mode");
            mkfifo(&path, Mode::S_IRWXU).expect("made");
            // Answers a read, takes a write, answers a read.
            let driver = std::thread::spawn(move || {
                fs::write(&path, "0\n").expect("read");
                let written = fs::read_to_string(&path).expect("written");
                fs::write(&path, format!("{kept}\n")).expect("read again");
                written
            });
            let error = set_mode("pgs", root.path(), Caching::Cached, false).expect_err("not kept");
            assert!(
                matches!(
                    &error,
                    PlatformError::SyncModeRefused { written: 2, found, .. } if found == kept
                ),
                "{error}"
            );
            assert_eq!(driver.join().expect("no panic"), "2\n");
        }
    }
}
