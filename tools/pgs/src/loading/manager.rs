//! This file has the kernel's FPGA manager program the logic.

use std::fs;
use std::io;
use std::path::PathBuf;

use super::system::{System, read};
use super::{LoadError, OPERATING};

const CLASS: &str = "sys/class/fpga_manager";

/// An FPGA manager that takes bitstreams from programs.
#[derive(Debug)]
pub(super) struct Manager {
    id: String,
    directory: PathBuf,
    has_flags: bool,
}

impl Manager {
    /// The first manager by number; the chip has one.
    pub(super) fn find(system: &dyn System, partial: bool) -> Result<Self, LoadError> {
        let class = system.path(CLASS);
        let entries = match fs::read_dir(&class) {
            Err(source) if source.kind() == io::ErrorKind::NotFound => {
                return Err(LoadError::NoManager { class });
            }
            entries => entries.map_err(|source| LoadError::file("list", &class, source))?,
        };
        let number = |id: &str| id.strip_prefix("fpga").and_then(|n| n.parse::<u32>().ok());
        let first = entries
            .filter_map(Result::ok)
            .filter_map(|entry| entry.file_name().into_string().ok())
            .filter_map(|id| Some((number(&id)?, id)))
            .min();
        let Some((_, id)) = first else { return Err(LoadError::NoManager { class }) };
        let directory = class.join(&id);
        if !directory.join("firmware").exists() {
            return Err(LoadError::NoFirmwareFile { manager: id, directory });
        }
        // The oldest vendor kernels have no flags, and load full bitstreams.
        let has_flags = directory.join("flags").exists();
        if partial && !has_flags {
            return Err(LoadError::NoFlags { manager: id, directory });
        }
        Ok(Self { id, directory, has_flags })
    }

    /// `fpga0`.
    pub(super) fn id(&self) -> &str {
        &self.id
    }

    /// What the driver calls itself.
    pub(super) fn name(&self) -> String {
        read(&self.directory.join("name")).unwrap_or_default()
    }

    pub(super) fn state(&self) -> Result<String, LoadError> {
        let path = self.directory.join("state");
        read(&path).map_err(|source| LoadError::file("read", &path, source))
    }

    /// Programs the logic and waits for it; the state afterwards, which is "operating".
    pub(super) fn program(
        &self,
        system: &dyn System,
        firmware: &str,
        partial: bool,
    ) -> Result<String, LoadError> {
        if self.has_flags {
            let path = self.directory.join("flags");
            let flags = if partial { "1" } else { "0" };
            system
                .write(&path, flags.as_bytes())
                .map_err(|source| LoadError::file("write", &path, source))?;
        }
        // The kernel answers this write when the logic is programmed, or when that failed.
        let path = self.directory.join("firmware");
        if let Err(source) = system.write(&path, firmware.as_bytes()) {
            if source.kind() == io::ErrorKind::PermissionDenied {
                return Err(LoadError::file("write", &path, source));
            }
            let (state, detail) = (self.state()?, self.detail());
            return Err(LoadError::Refused { manager: self.id.clone(), state, detail, source });
        }
        let state = self.state()?;
        if state != OPERATING {
            let detail = self.detail();
            return Err(LoadError::NotOperating { manager: self.id.clone(), state, detail });
        }
        Ok(state)
    }

    /// What else the manager says of a failure.
    fn detail(&self) -> String {
        match read(&self.directory.join("status")) {
            Ok(status) if !status.is_empty() => format!(" ({})", status.replace('\n', ", ")),
            _ => String::new(),
        }
    }
}
