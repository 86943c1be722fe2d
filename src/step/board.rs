//! This file opens a board: the one place that knows every kind.

use std::fmt;
use std::sync::Arc;

use bitstream_model::interface::address_map::{UIO_CONTROL_MAP, UIO_NODE};
use bitstream_model::interface::profile::Profile;

use crate::accelerator::identify;
use crate::error::OpenError;
use crate::platform::{
    AccessCounts, Platform, RegisterMap, System, UioDevice, UioNode, Window, node_named, uio_nodes,
};

/// How to open the accelerator. The default takes whatever board is there.
#[derive(Debug, Clone, Default)]
pub struct OpenOptions {
    /// Which board.
    pub board: BoardChoice,
    /// Width of the DMA cores' length registers, bits; `None` believes the bitstream. Either is
    /// checked against the cores themselves.
    pub length_width: Option<u32>,
}

/// Which board to open.
#[derive(Debug, Clone, Default)]
#[non_exhaustive]
pub enum BoardChoice {
    /// The UIO node `pgs` if there is one, else an emulated board, which is said at warn level.
    #[default]
    Automatic,
    /// The UIO node of that name (`linux,uio-name`).
    Uio {
        /// The name, as in `/sys/class/uio/uio*/name`.
        node: String,
    },
    /// An emulated board.
    #[cfg(feature = "emulation")]
    Emulated(bitstream_model::CpuPort),
}

/// What kind of board was opened.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum BoardKind {
    /// A software-emulated board.
    Emulated,
    /// A board behind a UIO node.
    Uio,
}

/// Which board was opened, and why.
#[derive(Debug, Clone, PartialEq, Eq)]
#[non_exhaustive]
pub struct BoardDescription {
    /// What kind.
    pub kind: BoardKind,
    /// Its name: the UIO node, or "emulated".
    pub name: String,
    /// Why this board and no other.
    pub reason: String,
}

impl fmt::Display for BoardDescription {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} ({})", self.name, self.reason)
    }
}

/// A board that was found.
#[derive(Debug)]
pub(super) struct Found {
    pub(super) platform: Arc<dyn Platform>,
    pub(super) description: BoardDescription,
}

/// Finds the board of choice.
pub(super) fn find(choice: &BoardChoice, system: &System) -> Result<Found, OpenError> {
    match choice {
        BoardChoice::Automatic => {
            let nodes = uio_nodes(&system.uio)?;
            match nodes.iter().find(|node| node.name == UIO_NODE) {
                Some(node) => Err(identify_node(node, system)),
                None => fall_back(),
            }
        }
        BoardChoice::Uio { node: wanted } => {
            let nodes = uio_nodes(&system.uio)?;
            Err(identify_node(&node_named(&nodes, wanted)?, system))
        }
        #[cfg(feature = "emulation")]
        BoardChoice::Emulated(port) => Ok(emulated(port.clone(), "asked for")),
    }
}

/// Identifies the bitstream behind a node, to say why the board cannot be opened: there is no DMA
/// memory for real hardware.
fn identify_node(node: &UioNode, system: &System) -> OpenError {
    let identified = || -> Result<_, OpenError> {
        let registers = UioDevice::of_node(system, node.clone())?.window(UIO_CONTROL_MAP)?;
        let counts = Arc::<AccessCounts>::default();
        Ok(identify(&Window::new(registers.into(), RegisterMap::Control, counts)?)?)
    };
    match identified() {
        Ok(capabilities) => OpenError::NoMemory {
            node: node.name.clone(),
            device: node.device.clone(),
            profile: Profile::by_id(capabilities.profile_id)
                .map_or("unknown", |profile| profile.name),
            major: capabilities.version.0,
            minor: capabilities.version.1,
        },
        Err(error) => error,
    }
}

#[cfg(feature = "emulation")]
fn fall_back() -> Result<Found, OpenError> {
    log::warn!("no UIO node named \"{UIO_NODE}\": using the software-emulated board");
    let board = bitstream_model::EmulatedBoard::new(bitstream_model::BoardConfig::default())?;
    Ok(emulated(board.cpu_port(), "no UIO node named \"pgs\""))
}

#[cfg(not(feature = "emulation"))]
fn fall_back() -> Result<Found, OpenError> {
    Err(OpenError::NoEmulation { wanted: UIO_NODE.to_owned() })
}

#[cfg(feature = "emulation")]
fn emulated(port: bitstream_model::CpuPort, reason: &str) -> Found {
    Found {
        platform: Arc::new(crate::platform::EmulatedPlatform::new(port)),
        description: BoardDescription {
            kind: BoardKind::Emulated,
            name: "emulated".to_owned(),
            reason: reason.to_owned(),
        },
    }
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::*;
    use crate::accelerator::fake as bitstream;
    use crate::platform::fake::FakeRegisters;
    use crate::platform::uio_fake;

    fn uio(node: &str) -> BoardChoice {
        BoardChoice::Uio { node: node.to_owned() }
    }

    /// A system with the nodes `fabric` and `pgs`, whose control block says what `describe` makes it.
    fn system_with(describe: impl Fn(&FakeRegisters)) -> (tempfile::TempDir, System) {
        let root = tempfile::tempdir().expect("a directory");
        let system = System::under(root.path());
        uio_fake::add_node(&system, 0, "fabric", &[]);
        uio_fake::add_node(&system, 1, "pgs", &uio_fake::regions());
        let registers = FakeRegisters::default();
        describe(&registers);
        // Pages of up to 64 KiB; the control block is map 4.
        let path = system.dev.join("uio1");
        let mut device = fs::read(&path).expect("read");
        for page in [1 << 12, 1 << 14, 1 << 16] {
            registers.with(|state| {
                for (at, value) in &state.values {
                    let at = 4 * page + *at as usize;
                    device[at..at + 4].copy_from_slice(&value.to_le_bytes());
                }
            });
        }
        fs::write(path, device).expect("written");
        (root, system)
    }

    fn error_of(choice: &BoardChoice, system: &System) -> OpenError {
        find(choice, system).expect_err("no board")
    }

    #[test]
    fn a_node_that_is_not_there_is_named_beside_those_that_are() {
        let (_root, system) = system_with(bitstream::describe);
        let error = error_of(&uio("pgs2"), &system);
        let text = error.to_string();
        assert!(text.contains("\"pgs2\" (found: fabric, pgs)"), "{text}");
    }

    #[test]
    fn a_real_board_is_identified_and_never_replaced_by_an_emulated_one() {
        let (_root, system) = system_with(bitstream::describe);
        for choice in [BoardChoice::Automatic, uio("pgs")] {
            let error = error_of(&choice, &system);
            assert!(
                matches!(&error, OpenError::NoMemory { device, profile: "float", .. } if device == "uio1"),
                "{error}"
            );
        }
    }

    #[test]
    fn another_bitstream_behind_the_node_is_refused_as_such() {
        let (_root, system) = system_with(|_| ());
        let error = error_of(&uio("pgs"), &system);
        assert!(matches!(error, OpenError::Identity(_)), "{error}");
    }

    #[test]
    fn without_a_node_the_emulated_board_says_why_it_was_taken() {
        let system = System::under(std::path::Path::new("/nonexistent"));
        let found = find(&BoardChoice::Automatic, &system);
        if cfg!(feature = "emulation") {
            let description = found.expect("the emulated board").description;
            assert_eq!(description.kind, BoardKind::Emulated);
            assert_eq!(description.to_string(), "emulated (no UIO node named \"pgs\")");
        } else {
            assert!(matches!(found, Err(OpenError::NoEmulation { .. })));
        }
    }
}
