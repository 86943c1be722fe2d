//! This file asks the kernel whether the programmable logic carries a bitstream.
//!
//! An access to a register that is not there hangs the CPU: so the question comes before every
//! first access.
//!
//! Source: Linux `Documentation/ABI/testing/sysfs-class-fpga-manager`.

use super::sysfs::read_if_present;
use super::{PlatformError, System};

/// The state of a programmable logic that is ready.
const OPERATING: &str = "operating";

/// Refuses a programmable logic that the kernel says is not programmed. A kernel that has no
/// `fpga_manager` cannot say, which is logged.
///
/// # Errors
/// [`PlatformError::NoBitstream`], or the state cannot be read.
pub fn require_bitstream(system: &System) -> Result<(), PlatformError> {
    let path = system.fpga_manager.join("state");
    match read_if_present(&path)? {
        Some(state) if state == OPERATING => Ok(()),
        Some(found) => Err(PlatformError::NoBitstream { path, found }),
        None => {
            log::info!(
                "there is no {}: whether a bitstream is loaded cannot be asked for",
                path.display()
            );
            Ok(())
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::platform::uio_fake::write;

    #[test]
    fn only_an_operating_logic_or_an_unknown_one_is_touched() {
        let root = tempfile::tempdir().expect("a directory");
        let system = System::under(root.path());
        require_bitstream(&system).expect("cannot be asked for");
        let state = system.fpga_manager.join("state");
        write(state.clone(), "operating");
        require_bitstream(&system).expect("operating");
        for other in ["unknown", "power off", "write error", "operating soon", ""] {
            write(state.clone(), other);
            let error = require_bitstream(&system).expect_err(other);
            assert!(
                matches!(&error, PlatformError::NoBitstream { found, .. } if found == other),
                "{error}"
            );
        }
    }
}
