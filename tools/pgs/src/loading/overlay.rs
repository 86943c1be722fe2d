//! Applies an overlay to the kernel's device tree.

use std::path::PathBuf;

use super::LoadError;
use super::system::{System, read};

/// Usual mount points of configfs; the vendor's fpgautil uses the second.
const MOUNTS: [&str; 2] = ["sys/kernel/config", "configfs"];
/// The overlays' folder in configfs.
const OVERLAYS: &str = "device-tree/overlays";
/// The name of this project's overlay.
pub(super) const NAME: &str = "pgs";

/// The folder of the overlays.
pub(super) fn interface(system: &dyn System) -> Result<PathBuf, LoadError> {
    let usual = MOUNTS.map(|mount| system.path(mount));
    let elsewhere = mounts(&read(&system.path("proc/mounts")).unwrap_or_default())
        .map(|mount| system.path(mount))
        .collect::<Vec<_>>();
    let places = usual.iter().chain(&elsewhere).map(|mount| mount.join(OVERLAYS));
    if let Some(overlays) = places.into_iter().find(|path| path.is_dir()) {
        return Ok(overlays);
    }
    let searched = usual[0].clone();
    // A mounted configfs has an entry for each subsystem.
    let entries = searched.read_dir().is_ok_and(|mut entries| entries.next().is_some());
    let mounted = entries || !elsewhere.is_empty();
    let reason = match mounted {
        true => "this kernel does not apply overlays at run time (mainline kernels do not)",
        false => "configfs is not mounted",
    };
    Err(LoadError::NoOverlays { searched, reason, mounted })
}

/// Mount points of configfs in the kernel's table of mounts, relative to the root.
fn mounts(table: &str) -> impl Iterator<Item = &str> {
    table.lines().filter_map(|line| {
        let mut words = line.split_ascii_whitespace().skip(1);
        let (place, kind) = (words.next()?, words.next()?);
        (kind == "configfs").then(|| place.trim_start_matches('/'))
    })
}

/// The folder of an overlay that does not exist yet.
#[derive(Debug)]
pub(super) struct Overlays {
    directory: PathBuf,
}

impl Overlays {
    /// Finds the folder; refuses if the overlay is applied already.
    pub(super) fn find(system: &dyn System) -> Result<Self, LoadError> {
        let directory = interface(system)?.join(NAME);
        if directory.exists() {
            let status = read(&directory.join("status")).unwrap_or_else(|error| error.to_string());
            return Err(LoadError::OverlayPresent { directory, status });
        }
        Ok(Self { directory })
    }

    /// Applies a compiled overlay; returns its name.
    pub(super) fn apply(self, system: &dyn System, tree: &[u8]) -> Result<&'static str, LoadError> {
        system
            .make_directory(&self.directory)
            .map_err(|source| LoadError::attribute(&self.directory, source))?;
        // The kernel applies the overlay when the file is closed, and reports a failure in the
        // status only.
        let written = system.write(&self.directory.join("dtbo"), tree);
        let status = read(&self.directory.join("status")).unwrap_or_else(|error| error.to_string());
        if written.is_ok() && status == "applied" {
            return Ok(NAME);
        }
        if let Err(error) = system.remove_directory(&self.directory) {
            log::warn!("{} stays: {error}", self.directory.display());
        }
        Err(LoadError::NotApplied { status, source: written.err() })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn configfs_is_found_wherever_it_is_mounted() {
        let table = "sysfs /sys sysfs rw 0 0\nnone /config configfs rw,relatime 0 0\nodd\n";
        assert_eq!(mounts(table).collect::<Vec<_>>(), ["config"]);
    }
}
