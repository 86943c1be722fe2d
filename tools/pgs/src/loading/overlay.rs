//! This file applies an overlay to the kernel's device tree.

use std::path::PathBuf;

use super::LoadError;
use super::system::{System, read};

/// Where configfs is mounted; the second is where the vendor's fpgautil mounts it.
const MOUNTS: [&str; 2] = ["sys/kernel/config", "configfs"];
/// Where the overlays are, below it.
const OVERLAYS: &str = "device-tree/overlays";
/// The name of ours.
const NAME: &str = "pgs";

/// The place for an overlay that is not there yet.
#[derive(Debug)]
pub(super) struct Overlays {
    directory: PathBuf,
}

impl Overlays {
    /// Finds the interface; refuses if the overlay is applied already.
    pub(super) fn find(system: &dyn System) -> Result<Self, LoadError> {
        let mounts = MOUNTS.map(|mount| system.path(mount));
        let Some(overlays) =
            mounts.iter().map(|mount| mount.join(OVERLAYS)).find(|path| path.is_dir())
        else {
            let searched = mounts[0].clone();
            // A mounted configfs has the entries of some subsystem.
            let mounted = searched.read_dir().is_ok_and(|mut entries| entries.next().is_some());
            let reason = match mounted {
                true => "this kernel does not apply overlays at run time (mainline kernels do not)",
                false => "configfs is not mounted",
            };
            return Err(LoadError::NoOverlays { searched, reason, mounted });
        };
        let directory = overlays.join(NAME);
        if directory.exists() {
            let status = read(&directory.join("status")).unwrap_or_else(|error| error.to_string());
            return Err(LoadError::OverlayPresent { directory, status });
        }
        Ok(Self { directory })
    }

    /// Applies a compiled overlay; its name.
    pub(super) fn apply(self, system: &dyn System, tree: &[u8]) -> Result<&'static str, LoadError> {
        system
            .make_directory(&self.directory)
            .map_err(|source| LoadError::file("make", &self.directory, source))?;
        // The kernel applies it when the file is closed, and tells of failure in the status only.
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
