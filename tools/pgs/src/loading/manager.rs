//! Programs the logic through the kernel's FPGA manager.

use std::io;

use zynq_pgs::platform::ManagerChoice;
use zynq_pgs::platform::{FpgaManager, find_manager};

use super::system::{System, read};
use super::{LoadError, OPERATING};

const CLASS: &str = "sys/class/fpga_manager";

/// An FPGA manager that takes bitstreams from programs.
#[derive(Debug)]
pub(super) struct Manager {
    found: FpgaManager,
    has_flags: bool,
}

impl Manager {
    /// The chosen manager; by default the manager of the programmable logic.
    pub(super) fn find(system: &dyn System, choice: &ManagerChoice) -> Result<Self, LoadError> {
        if *choice == ManagerChoice::Unasked {
            return Err(LoadError::Unasked);
        }
        let class = system.path(CLASS);
        let Some(found) = find_manager(&class, choice)? else {
            return Err(LoadError::NoManager { class });
        };
        let (manager, directory) = (found.device.clone(), found.directory.clone());
        if !directory.join("firmware").exists() {
            return Err(LoadError::NoFirmwareFile { manager, directory });
        }
        // The oldest vendor kernels have no flags, and load full bitstreams only.
        let has_flags = directory.join("flags").exists();
        Ok(Self { found, has_flags })
    }

    /// The device's name, as `fpga0`.
    pub(super) fn id(&self) -> &str {
        &self.found.device
    }

    /// The driver's name.
    pub(super) fn name(&self) -> &str {
        &self.found.name
    }

    pub(super) fn state(&self) -> Result<String, LoadError> {
        Ok(self.found.state()?)
    }

    /// Programs the logic and waits for it; returns the state afterwards, "operating".
    pub(super) fn program(&self, system: &dyn System, firmware: &str) -> Result<String, LoadError> {
        let attribute = |name| self.found.directory.join(name);
        if self.has_flags {
            let path = attribute("flags");
            // A full bitstream, whatever was loaded before.
            system.write(&path, b"0").map_err(|source| LoadError::attribute(&path, source))?;
        }
        // The kernel answers this write when programming has ended or failed.
        let path = attribute("firmware");
        if let Err(source) = system.write(&path, firmware.as_bytes()) {
            let unwritable = [io::ErrorKind::PermissionDenied, io::ErrorKind::ReadOnlyFilesystem];
            if unwritable.contains(&source.kind()) {
                return Err(LoadError::attribute(&path, source));
            }
            let (manager, firmware) = (self.id().to_owned(), firmware.to_owned());
            let (state, detail) = (self.state()?, self.detail());
            return Err(LoadError::Refused { manager, firmware, state, detail, source });
        }
        let state = self.state()?;
        if state != OPERATING {
            let (manager, detail) = (self.id().to_owned(), self.detail());
            return Err(LoadError::NotOperating { manager, state, detail });
        }
        Ok(state)
    }

    /// Further details that the manager reports of a failure.
    fn detail(&self) -> String {
        match read(&self.found.directory.join("status")) {
            Ok(status) if !status.is_empty() => format!(" ({})", status.replace('\n', ", ")),
            _ => String::new(),
        }
    }
}
