//! Loads a bitstream through the kernel. All checks come first, so that a refusal leaves the
//! board as it was.
//!
//! ```text
//! both files -> FPGA manager -> users, locks -> other overlays and drivers -> ours
//!            -> firmware file -> users -> fpga_manager -> state?
//!            -> overlay -> status? -> UIO node?
//! ```
//!
//! The locks of the device files are held until the end: a driver of this project that is started
//! meanwhile is refused. Another program that opens a node between the second look for users and
//! the write to the manager goes unnoticed.
//!
//! Source: linux-xlnx, `drivers/fpga/fpga-mgr.c` (attributes `flags`, `firmware`, `state`) and
//! `drivers/of/configfs.c` (`overlays/<name>/{dtbo,status}`); mainline has neither.
//!
//! A library of its own, so that `tools/fuzz` can call it, too.

#![forbid(unsafe_code)]

mod bitstream;
mod chip;
mod error;
mod firmware;
mod manager;
mod others;
mod overlay;
mod packets;
mod progress;
mod system;
#[cfg(test)]
mod tests;
mod tree;
mod users;

use std::path::PathBuf;
use std::time::{Duration, Instant};

use bitstream_model::interface::address_map::{
    CONTROL_BASE, CONTROL_BYTES, DMA_BASE, UIO_GUARD_NODE, UIO_MEMORY_NODE, UIO_NODE,
};
use bitstream_model::interface::usr_access;
use zynq_pgs::platform::{ManagerChoice, UioNode};
use zynq_pgs::platform::{UioListing, uio_listing};

pub use chip::Chip;
pub use error::{AtFault, LoadError};
pub use progress::{Progress, Stage};
pub use system::{Linux, System};

use bitstream::Bitstream;
use firmware::Firmware;
use manager::Manager;
use overlay::Overlays;
use tree::Overlay;

/// The manager's state while its logic runs.
const OPERATING: &str = "operating";

/// A bitstream to load.
#[derive(Debug, Clone)]
pub struct Request {
    /// Its file.
    pub bitstream: PathBuf,
    /// The file of the overlay to apply after it.
    pub overlay: Option<PathBuf>,
    /// The chip that the bitstream must be for.
    pub part: Chip,
    /// Whether to load files that cannot be judged or are refused for their content.
    pub unjudged: bool,
    /// The FPGA manager that loads it.
    pub manager: ManagerChoice,
    /// Whether to load although overlays and drivers of others are bound to the logic.
    pub replace_others: bool,
}

impl Request {
    /// Refuses with this error, or only logs it, as the request has it.
    fn unless_overridden(&self, error: LoadError) -> Result<(), LoadError> {
        if self.unjudged {
            log::warn!("{error}; loaded all the same, as asked for");
            return Ok(());
        }
        Err(error)
    }
}

/// The facts that the files of a request tell.
#[derive(Debug)]
pub struct Judged {
    bytes: Vec<u8>,
    /// The chip that the bitstream is for, if it tells.
    pub chip: Option<Chip>,
    /// The rate of the PL clock 0 that the bitstream asks for, MHz.
    pub wanted_mhz: Option<u32>,
    overlay: Option<(Overlay, Vec<u8>)>,
    doubt: Option<LoadError>,
}

impl Judged {
    /// The length of the bitstream.
    #[must_use]
    pub fn bytes(&self) -> u64 {
        self.bytes.len() as u64
    }

    /// The rate that the overlay, if there is one, sets for the PL clock 0, Hz.
    #[must_use]
    pub fn overlay_clock_hz(&self) -> Option<Option<u32>> {
        self.overlay.as_ref().map(|(overlay, _)| overlay.clock_hz)
    }
}

/// A loaded bitstream.
#[derive(Debug)]
pub struct Loaded {
    /// The files.
    pub judged: Judged,
    /// The firmware name given to the manager, relative to the kernel's firmware folder.
    pub firmware: String,
    /// Whether the file was copied for loading; the copy is removed.
    pub copied: bool,
    /// The device of the FPGA manager, as `fpga0`.
    pub manager: String,
    /// The manager's name.
    pub manager_name: String,
    /// The manager's state before loading.
    pub state_before: String,
    /// Its state after loading.
    pub state: String,
    /// The time that the kernel took.
    pub time: Duration,
    /// Name of the applied overlay.
    pub overlay: Option<&'static str>,
    /// The UIO nodes of the logic, by number.
    pub nodes: Vec<UioNode>,
}

/// Judges the files of a request by their content, and refuses doubtful ones too.
///
/// # Errors
/// [`LoadError`], of the caller's files alone.
pub fn check(request: &Request) -> Result<Judged, LoadError> {
    let mut judged = judge(request)?;
    judged.doubt.take().map_or(Ok(()), |doubt| request.unless_overridden(doubt))?;
    Ok(judged)
}

/// Judges the files of a request by their content. A bitstream that cannot be judged is not
/// refused yet.
fn judge(request: &Request) -> Result<Judged, LoadError> {
    let bytes = system::read_plain(&request.bitstream, bitstream::BYTES_MAX)?;
    let bytes = bytes.map_err(|found| LoadError::Bitstream {
        path: request.bitstream.clone(),
        found,
        next: bitstream::README.to_owned(),
    })?;
    let Bitstream { chip, user, doubt } = bitstream::judge(request, &bytes)?;
    let wanted_mhz = user.and_then(usr_access::pl_clock_mhz);
    let overlay = request.overlay.as_deref();
    let overlay = overlay.map(|path| tree::judge(request, path, wanted_mhz)).transpose()?;
    Ok(Judged { bytes, chip, wanted_mhz, overlay, doubt })
}

/// Loads a bitstream, and applies an overlay if the request names one.
///
/// # Errors
/// [`LoadError`].
pub fn load(
    system: &dyn System,
    request: &Request,
    progress: &Progress,
) -> Result<Loaded, LoadError> {
    let mut judged = judge(request)?;
    let manager = Manager::find(system, &request.manager)?;
    let listing = nodes(system)?;
    let devices = users::devices(system, &listing);
    let unseen = users::refuse_if_open(system, &devices)?;
    let locks = users::lock(system, &devices)?;
    for text in unseen {
        log::warn!("{text}");
    }
    if !request.replace_others {
        others::refuse_if_bound(system)?;
    }
    let overlays = match &judged.overlay {
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
    // The last refusal, as it is the one that an option lifts.
    match judged.doubt.take() {
        Some(doubt @ LoadError::Empty { .. }) => log::warn!("{doubt}; the kernel is asked"),
        Some(doubt) => request.unless_overridden(doubt)?,
        None => {}
    }

    let state_before = manager.state()?;
    let firmware = Firmware::provide(system, &request.bitstream, &judged.bytes, progress)?;
    if let (Some((overlay, _)), Some(path)) = (&judged.overlay, &request.overlay) {
        // The kernel takes that file when it applies the overlay.
        if let Some(own) = overlay.firmware.iter().find(|own| *own != firmware.name()) {
            return Err(LoadError::own_firmware(path, own, firmware.name()));
        }
    }
    // Copying a bitstream takes long enough for another program to start.
    users::refuse_if_open(system, &users::devices(system, &nodes(system)?))?;
    progress.reach(Stage::Programming);
    let start = Instant::now();
    let state = manager.program(system, firmware.name())?;
    let time = start.elapsed();
    progress.reach(Stage::Programmed);
    let (name, copied) = (firmware.name().to_owned(), firmware.is_copy());
    drop(firmware);

    let mut applied = None;
    if let (Some(overlays), Some((_, tree))) = (overlays, &judged.overlay) {
        applied = Some(overlays.apply(system, tree)?);
    }
    drop(locks);
    let mut nodes = nodes(system)?.nodes;
    if applied.is_some() && !nodes.iter().any(is_accelerator) {
        return Err(LoadError::NoNode);
    }
    nodes.retain(|node| node.is_in_logic() || is_ours(node));
    Ok(Loaded {
        judged,
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

/// Whether a node is the accelerator, its memory or the guard, by its name.
fn is_ours(node: &UioNode) -> bool {
    is_ours_by_name(&node.name) || [UIO_MEMORY_NODE, UIO_GUARD_NODE].contains(&node.name.as_str())
}

/// Whether a node with this name has registers of the accelerator. Memory and guard do not count:
/// their nodes are in the base tree.
fn is_ours_by_name(name: &str) -> bool {
    let rest = name.strip_prefix(UIO_NODE);
    let registers = ![UIO_MEMORY_NODE, UIO_GUARD_NODE].contains(&name);
    registers && rest.is_some_and(|rest| rest.is_empty() || rest.starts_with('-'))
}

/// Whether an address is one of the accelerator's registers.
fn has_registers(address: u64) -> bool {
    (DMA_BASE..CONTROL_BASE + u64::from(CONTROL_BYTES)).contains(&address)
}

/// Whether a node has registers of the accelerator, by its name or its addresses.
fn is_accelerator(node: &UioNode) -> bool {
    is_ours_by_name(&node.name) || node.maps.iter().any(|map| has_registers(map.address))
}
