//! Asks the kernel whether the programmable logic carries a bitstream.
//!
//! An access to a register of logic that is not programmed hangs the CPU: the question comes
//! before the first access. The answer is the state of the logic's FPGA manager, which is known by
//! its name: a board may have managers of other chips.
//!
//! Source: Linux `Documentation/ABI/testing/sysfs-class-fpga-manager`,
//! `drivers/fpga/zynqmp-fpga.c`.

use std::fmt;
use std::path::{Path, PathBuf};

use super::sysfs::{Attribute, numbered, read};
use crate::platform::{PlatformError, Result, System, ZYNQMP_MANAGER};

/// The state of programmable logic that is ready.
const OPERATING: &str = "operating";

/// Which FPGA manager knows whether the logic of a real board is programmed.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
#[non_exhaustive]
pub enum ManagerChoice {
    /// The one with the name of the chip's own, [`ZYNQMP_MANAGER`]. A kernel that has no managers
    /// cannot say, which is logged.
    #[default]
    Automatic,
    /// This one, whatever its name.
    Device(String),
    /// None: the caller knows that the logic is programmed, by JTAG for example, which the kernel
    /// does not see.
    ///
    /// An access to logic that is not programmed, or has no clock, hangs the processor.
    Unasked,
}

/// An FPGA manager.
#[derive(Debug, Clone, PartialEq, Eq)]
#[non_exhaustive]
pub struct FpgaManager {
    /// The kernel's name, `fpga0`.
    pub device: String,
    /// The name that its driver gives it; empty if it cannot be read.
    pub name: String,
    /// Its attributes.
    pub directory: PathBuf,
}

impl fmt::Display for FpgaManager {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} {:?}", self.device, self.name)
    }
}

impl FpgaManager {
    /// The state of its logic.
    ///
    /// # Errors
    /// It cannot be read.
    pub fn state(&self) -> Result<String, PlatformError> {
        read(&self.directory.join("state"))
    }
}

/// The FPGA managers under `class` (normally `/sys/class/fpga_manager`), by number.
///
/// # Errors
/// The directory cannot be listed.
pub fn fpga_managers(class: &Path) -> Result<Vec<FpgaManager>, PlatformError> {
    let manager = |(number, directory): (u32, PathBuf)| FpgaManager {
        device: format!("fpga{number}"),
        name: read(&directory.join("name")).unwrap_or_default(),
        directory,
    };
    Ok(numbered(class, "fpga")?.into_iter().map(manager).collect())
}

/// The manager of choice; `None` if the kernel has no manager, or for [`ManagerChoice::Unasked`].
///
/// # Errors
/// The requested manager does not exist; or, for [`ManagerChoice::Automatic`], several managers
/// have the name of the chip's own, or none has it.
pub fn find_manager(
    class: &Path,
    choice: &ManagerChoice,
) -> Result<Option<FpgaManager>, PlatformError> {
    let wanted = match choice {
        ManagerChoice::Unasked => return Ok(None),
        ManagerChoice::Automatic => None,
        ManagerChoice::Device(device) => Some(device),
    };
    let managers = fpga_managers(class)?;
    let found: Vec<_> = managers.iter().map(FpgaManager::to_string).collect();
    let found = found.join(", ");
    if let Some(wanted) = wanted {
        let named = managers.into_iter().find(|manager| manager.device == *wanted);
        let missing = || PlatformError::NoManager { wanted: wanted.clone(), found };
        return named.ok_or_else(missing).map(Some);
    }
    if managers.is_empty() {
        return Ok(None);
    }
    let mut own = managers.into_iter().filter(|manager| manager.name == ZYNQMP_MANAGER);
    match (own.next(), own.next()) {
        (Some(only), None) => Ok(Some(only)),
        (Some(_), Some(_)) => Err(PlatformError::SeveralManagers { found }),
        (None, _) => Err(PlatformError::OtherManagers { found }),
    }
}

/// Refuses logic that is not programmed by the state of its manager, and logic whose manager cannot
/// be identified. Without managers the kernel has no state, and the log says so.
///
/// # Errors
/// [`PlatformError::NoBitstream`], as [`find_manager`], or the state cannot be read.
pub fn require_bitstream(system: &System, choice: &ManagerChoice) -> Result<(), PlatformError> {
    LogicState::open(system, choice).map(drop)
}

/// The state of programmed logic, by its manager.
#[derive(Debug)]
pub(crate) struct LogicState(Option<Attribute>);

impl LogicState {
    /// As [`require_bitstream`]; the state can be asked again.
    pub(crate) fn open(system: &System, choice: &ManagerChoice) -> Result<Self> {
        let class = &system.fpga_manager;
        let Some(manager) = find_manager(class, choice)? else {
            if *choice == ManagerChoice::Unasked {
                log::info!("whether a bitstream is loaded is not asked for, as wished");
            } else {
                log::info!("no FPGA manager in {}: is a bitstream loaded?", class.display());
            }
            return Ok(Self(None));
        };
        let path = manager.directory.join("state");
        let state = Attribute::open(path.clone())?;
        if state.is_none() {
            // The managers of some kernels have no state.
            log::info!("there is no {}: is a bitstream loaded?", path.display());
        }
        let this = Self(state);
        match this.other()? {
            Some(found) => Err(PlatformError::NoBitstream { path, found }),
            None => Ok(this),
        }
    }

    /// Makes sure that the logic is still programmed: at most one system call.
    pub(crate) fn check(&self) -> Result<()> {
        match (self.other()?, &self.0) {
            (Some(found), Some(state)) => {
                let path = state.path().display();
                let why = format!("{path} went from {OPERATING:?} to {found:?}");
                Err(PlatformError::Lost { why })
            }
            _ => Ok(()),
        }
    }

    /// The state, unless it is [`OPERATING`] or there is nobody to ask, as after the manager's own
    /// driver was unbound.
    fn other(&self) -> Result<Option<String>> {
        let Some(state) = &self.0 else { return Ok(None) };
        state.read(|text| {
            let other = text?.trim_ascii();
            if other == OPERATING.as_bytes() {
                return None;
            }
            Some(String::from_utf8_lossy(other).into_owned())
        })
    }
}

#[cfg(test)]
pub(crate) mod fake {
    //! FPGA managers made of files.

    use crate::platform::System;
    use crate::platform::uio_fake::write;

    /// Adds the manager `fpga<number>`.
    pub(crate) fn add_manager(system: &System, number: u32, name: &str, state: &str) {
        let manager = system.fpga_manager.join(format!("fpga{number}"));
        write(manager.join("name"), name);
        write(manager.join("state"), state);
    }
}

#[cfg(test)]
mod tests {
    use super::fake::add_manager;
    use super::*;
    use crate::platform::uio_fake::empty_system;

    const SELECT_MAP: &str = "Xilinx Slave SelectMap FPGA Manager";

    fn ask(system: &System) -> Result<()> {
        require_bitstream(system, &ManagerChoice::Automatic)
    }

    #[test]
    fn only_an_operating_logic_or_one_nobody_knows_of_is_touched() {
        let (_root, system) = empty_system();
        ask(&system).expect("cannot be asked for");
        add_manager(&system, 0, ZYNQMP_MANAGER, "operating");
        ask(&system).expect("operating");
        for other in ["unknown", "power off", "write error", "operating soon", ""] {
            add_manager(&system, 0, ZYNQMP_MANAGER, other);
            let error = ask(&system).expect_err(other);
            assert!(
                matches!(&error, PlatformError::NoBitstream { found, .. } if found == other),
                "{error}"
            );
            require_bitstream(&system, &ManagerChoice::Unasked).expect("the caller knows");
        }
    }

    #[test]
    fn the_manager_of_another_chip_does_not_answer_for_this_one() {
        let (_root, system) = empty_system();
        add_manager(&system, 0, SELECT_MAP, "unknown");
        add_manager(&system, 1, ZYNQMP_MANAGER, "operating");
        ask(&system).expect("fpga1 runs");
        add_manager(&system, 0, SELECT_MAP, "operating");
        add_manager(&system, 1, ZYNQMP_MANAGER, "unknown");
        let error = ask(&system).expect_err("fpga0 runs");
        assert!(error.to_string().contains("fpga1/state"), "{error}");
    }

    #[test]
    fn where_several_fit_or_none_the_caller_is_asked() {
        let (_root, system) = empty_system();
        add_manager(&system, 0, ZYNQMP_MANAGER, "operating");
        add_manager(&system, 2, ZYNQMP_MANAGER, "unknown");
        let error = ask(&system).expect_err("which?");
        assert!(matches!(error, PlatformError::SeveralManagers { .. }), "{error}");
        let both = "fpga0 \"Xilinx ZynqMP FPGA Manager\", fpga2 \"Xilinx ZynqMP FPGA Manager\"";
        assert!(error.to_string().contains(both), "{error}");
        let named =
            |device: &str| require_bitstream(&system, &ManagerChoice::Device(device.to_owned()));
        named("fpga0").expect("it runs");
        named("fpga2").expect_err("it does not");
        let error = named("fpga1").expect_err("there is none");
        assert!(error.to_string().contains("\"fpga1\" (found: fpga0"), "{error}");

        // Another chip's, one without a name.
        for name in [SELECT_MAP, "Xilinx Versal FPGA Manager", ""] {
            add_manager(&system, 0, name, "operating");
            add_manager(&system, 2, name, "operating");
            let error = ask(&system).expect_err(name);
            assert!(matches!(error, PlatformError::OtherManagers { .. }), "{error}");
        }
        named("fpga2").expect("it runs");
    }
}
