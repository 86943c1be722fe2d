//! This folder loads a bitstream through the kernel: everything is looked at first, so that a
//! refusal leaves the board as it was.
//!
//! ```text
//! users -> overlays -> firmware file -> users -> fpga_manager -> state? -> overlay -> status? -> UIO node?
//! ```
//!
//! Who opens a node between the second look for users and the write to the manager is not seen.
//!
//! Source: linux-xlnx, `drivers/fpga/fpga-mgr.c` (attributes `flags`, `firmware`, `state`) and
//! `drivers/of/configfs.c` (`overlays/<name>/{dtbo,status}`); mainline has neither.

mod error;
mod firmware;
mod manager;
mod overlay;
mod system;
#[cfg(test)]
mod tests;
mod users;

use std::fs;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use bitstream_model::interface::address_map::UIO_NODE;
use zynq_pgs::{UioNode, uio_nodes};

pub(crate) use error::LoadError;
pub(crate) use system::{Linux, System};

use firmware::Firmware;
use manager::Manager;
use overlay::Overlays;

/// First bytes of every compiled device tree.
const DEVICE_TREE_MAGIC: [u8; 4] = [0xD0, 0x0D, 0xFE, 0xED];
/// The state of a manager whose logic runs.
const OPERATING: &str = "operating";

/// What to load.
#[derive(Debug, Clone)]
pub(crate) struct Request {
    pub(crate) bitstream: PathBuf,
    pub(crate) overlay: Option<PathBuf>,
    pub(crate) partial: bool,
}

/// What was loaded.
#[derive(Debug, Clone)]
pub(crate) struct Loaded {
    pub(crate) bytes: u64,
    /// What the manager was told to load, below the kernel's firmware folder.
    pub(crate) firmware: String,
    /// Whether that was a copy, which is gone again.
    pub(crate) copied: bool,
    pub(crate) manager: String,
    pub(crate) manager_name: String,
    pub(crate) state_before: String,
    pub(crate) state: String,
    pub(crate) time: Duration,
    /// Name of the overlay that was applied.
    pub(crate) overlay: Option<&'static str>,
    /// The accelerator's UIO nodes, by number.
    pub(crate) nodes: Vec<UioNode>,
}

/// Loads a bitstream, and applies an overlay if one is asked for.
pub(crate) fn load(system: &dyn System, request: &Request) -> Result<Loaded, LoadError> {
    let bytes = check_bitstream(&request.bitstream)?;
    let tree = request.overlay.as_deref().map(read_overlay).transpose()?;
    let manager = Manager::find(system, request.partial)?;
    let nodes = our_nodes(system)?;
    users::refuse_if_open(system, &nodes)?;
    let overlays = match tree {
        Some(tree) => {
            let overlays = Overlays::find(system)?;
            if let Some(node) = nodes.iter().find(|node| is_accelerator(node)) {
                let (node, device) = (node.name.clone(), node.device.clone());
                return Err(LoadError::NodePresent { node, device });
            }
            Some((overlays, tree))
        }
        None => None,
    };

    let state_before = manager.state()?;
    let firmware = Firmware::provide(system, &request.bitstream)?;
    // Copying a bitstream takes long enough for a program to start.
    users::refuse_if_open(system, &our_nodes(system)?)?;
    let start = Instant::now();
    let state = manager.program(system, firmware.name(), request.partial)?;
    let time = start.elapsed();
    let (name, copied) = (firmware.name().to_owned(), firmware.is_copy());
    drop(firmware);

    let mut applied = None;
    if let Some((overlays, tree)) = overlays {
        applied = Some(overlays.apply(system, &tree)?);
    }
    let nodes = our_nodes(system)?;
    if applied.is_some() && !nodes.iter().any(is_accelerator) {
        return Err(LoadError::NoNode);
    }
    Ok(Loaded {
        bytes,
        firmware: name,
        copied,
        manager: manager.id().to_owned(),
        manager_name: manager.name(),
        state_before,
        state,
        time,
        overlay: applied,
        nodes,
    })
}

/// The accelerator's nodes, and that of its memory: the single one, or `pgs-...`.
fn our_nodes(system: &dyn System) -> Result<Vec<UioNode>, LoadError> {
    let mut nodes = uio_nodes(&system.path("sys/class/uio"))?;
    nodes.retain(|node| {
        let rest = node.name.strip_prefix(UIO_NODE);
        rest.is_some_and(|rest| rest.is_empty() || rest.starts_with('-'))
    });
    Ok(nodes)
}

/// Whether a node has registers of the accelerator; its memory is in the base tree.
fn is_accelerator(node: &UioNode) -> bool {
    !node.name.ends_with("-memory")
}

/// Looks at the file before the kernel does; its length in bytes.
fn check_bitstream(path: &Path) -> Result<u64, LoadError> {
    let meta = fs::metadata(path).map_err(|source| LoadError::unreadable(path, source))?;
    let expected = "a bitstream (.bit.bin)";
    if !meta.is_file() {
        return Err(LoadError::kind(path, expected, "no plain file"));
    }
    if meta.len() == 0 {
        return Err(LoadError::kind(path, expected, "an empty file"));
    }
    let start = beginning(path)?;
    if start == DEVICE_TREE_MAGIC {
        return Err(LoadError::kind(path, expected, "a compiled device tree"));
    }
    if start == *b"\x7fELF" {
        return Err(LoadError::kind(path, expected, "a program"));
    }
    Ok(meta.len())
}

fn read_overlay(path: &Path) -> Result<Vec<u8>, LoadError> {
    let tree = fs::read(path).map_err(|source| LoadError::unreadable(path, source))?;
    if !tree.starts_with(&DEVICE_TREE_MAGIC) {
        let expected = "a compiled overlay (.dtbo)";
        return Err(LoadError::kind(path, expected, "something else; compile sources by dtc -@"));
    }
    Ok(tree)
}

/// The first four bytes of a file; zeros where it has none.
fn beginning(path: &Path) -> Result<[u8; 4], LoadError> {
    use std::io::Read;
    let mut start = Vec::new();
    fs::File::open(path)
        .and_then(|file| file.take(4).read_to_end(&mut start))
        .map_err(|source| LoadError::unreadable(path, source))?;
    start.resize(4, 0);
    Ok([start[0], start[1], start[2], start[3]])
}
