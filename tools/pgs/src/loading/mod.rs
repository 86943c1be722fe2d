//! Loads a bitstream through the kernel. All checks come first, so that a refusal leaves the
//! board as it was.
//!
//! ```text
//! users -> other overlays and drivers -> ours -> formats -> firmware file -> users
//!       -> fpga_manager -> state? -> overlay -> status? -> UIO node?
//! ```
//!
//! A program that opens a node between the second look for users and the write to the manager goes
//! unnoticed.
//!
//! Source: linux-xlnx, `drivers/fpga/fpga-mgr.c` (attributes `flags`, `firmware`, `state`) and
//! `drivers/of/configfs.c` (`overlays/<name>/{dtbo,status}`); mainline has neither.

mod error;
mod firmware;
mod format;
mod manager;
mod others;
mod overlay;
mod system;
#[cfg(test)]
mod tests;
mod users;

use std::fs;
use std::path::PathBuf;
use std::time::{Duration, Instant};

use bitstream_model::interface::address_map::{
    CONTROL_BASE, CONTROL_BYTES, DMA_BASE, UIO_GUARD_NODE, UIO_MEMORY_NODE, UIO_NODE,
};
use zynq_pgs::platform::{UioListing, uio_listing};
use zynq_pgs::{ManagerChoice, UioNode};

pub(crate) use error::{AtFault, LoadError};
pub(crate) use system::{Linux, System};

use firmware::Firmware;
use manager::Manager;
use overlay::Overlays;

/// The manager's state while its logic runs.
const OPERATING: &str = "operating";

/// A bitstream to load.
#[derive(Debug, Clone)]
pub(crate) struct Request {
    pub(crate) bitstream: PathBuf,
    pub(crate) overlay: Option<PathBuf>,
    pub(crate) partial: bool,
    pub(crate) manager: ManagerChoice,
    /// Whether to load although overlays and drivers of others are bound to the logic.
    pub(crate) replace_others: bool,
}

/// A loaded bitstream.
#[derive(Debug, Clone)]
pub(crate) struct Loaded {
    pub(crate) bytes: u64,
    /// The firmware name given to the manager, relative to the kernel's firmware folder.
    pub(crate) firmware: String,
    /// Whether the file was copied for loading; the copy is removed.
    pub(crate) copied: bool,
    pub(crate) manager: String,
    pub(crate) manager_name: String,
    pub(crate) state_before: String,
    pub(crate) state: String,
    pub(crate) time: Duration,
    /// Name of the applied overlay.
    pub(crate) overlay: Option<&'static str>,
    /// The UIO nodes of the logic, by number.
    pub(crate) nodes: Vec<UioNode>,
}

/// Loads a bitstream, and applies an overlay if the request names one.
pub(crate) fn load(system: &dyn System, request: &Request) -> Result<Loaded, LoadError> {
    let bytes = format::length(&request.bitstream)?;
    let tree = request.overlay.as_deref();
    let tree = tree.map(|path| fs::read(path).map_err(|error| LoadError::unreadable(path, error)));
    let tree = tree.transpose()?;
    let manager = Manager::find(system, &request.manager, request.partial)?;
    let listing = nodes(system)?;
    users::refuse_if_open(system, &listing)?;
    if !request.replace_others {
        others::refuse_if_bound(system)?;
    }
    let overlays = match &tree {
        Some(_) => {
            let overlays = Overlays::find(system)?;
            if let Some(node) = listing.nodes.iter().find(|node| is_accelerator(node)) {
                let (node, device) = (node.name.clone(), node.device.clone());
                return Err(LoadError::NodePresent { node, device });
            }
            Some(overlays)
        }
        None => None,
    };
    format::require_bitstream(&request.bitstream)?;
    if let (Some(path), Some(tree)) = (&request.overlay, &tree) {
        format::require_overlay(path, tree)?;
    }

    let state_before = manager.state()?;
    let firmware = Firmware::provide(system, &request.bitstream)?;
    // Copying a bitstream takes long enough for another program to start.
    users::refuse_if_open(system, &nodes(system)?)?;
    let start = Instant::now();
    let state = manager.program(system, firmware.name(), request.partial)?;
    let time = start.elapsed();
    let (name, copied) = (firmware.name().to_owned(), firmware.is_copy());
    drop(firmware);

    let mut applied = None;
    if let (Some(overlays), Some(tree)) = (overlays, tree) {
        applied = Some(overlays.apply(system, &tree)?);
    }
    let mut nodes = nodes(system)?.nodes;
    if applied.is_some() && !nodes.iter().any(is_accelerator) {
        return Err(LoadError::NoNode);
    }
    nodes.retain(|node| node.is_in_logic() || is_ours(node));
    Ok(Loaded {
        bytes,
        firmware: name,
        copied,
        manager: manager.id().to_owned(),
        manager_name: manager.name().to_owned(),
        state_before,
        state,
        time,
        overlay: applied,
        nodes,
    })
}

/// The UIO nodes of the system.
fn nodes(system: &dyn System) -> Result<UioListing, LoadError> {
    Ok(uio_listing(&system.path("sys/class/uio"))?)
}

/// Whether a node is the accelerator or its memory, by its name.
fn is_ours(node: &UioNode) -> bool {
    let rest = node.name.strip_prefix(UIO_NODE);
    rest.is_some_and(|rest| rest.is_empty() || rest.starts_with('-'))
}

/// Whether a node has registers of the accelerator, by its name or its addresses. Memory and guard do
/// not count: their nodes are in the base tree.
fn is_accelerator(node: &UioNode) -> bool {
    let end = CONTROL_BASE + u64::from(CONTROL_BYTES);
    let there = |address: u64| (DMA_BASE..end).contains(&address);
    (is_ours(node) && ![UIO_MEMORY_NODE, UIO_GUARD_NODE].contains(&node.name.as_str()))
        || node.maps.iter().any(|map| there(map.address))
}
