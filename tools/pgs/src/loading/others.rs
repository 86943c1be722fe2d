//! Finds overlays and kernel drivers that are bound to the logic which a bitstream replaces.

use std::fs;
use std::path::{Path, PathBuf};

use bitstream_model::interface::address_map::is_in_logic;

use super::LoadError;
use super::overlay::{self, NAME};
use super::system::{System, read};

/// Devices of the kernel, named by address.
const DEVICES: &str = "sys/bus/platform/devices";
/// First letters of drivers whose devices in the logic have no address: XRT's, and drivers that
/// hand DMA channels to programs.
const WITHOUT_ADDRESS: [&str; 4] = ["zocl", "dma_proxy", "dma-proxy", "axidma"];
/// Drivers that hand a device to programs; `users` checks these.
const UIO_DRIVERS: [&str; 2] = ["uio_pdrv_genirq", "uio_dmem_genirq"];

/// Refuses if an overlay of another name is applied, or a kernel driver is bound to the logic.
pub(super) fn refuse_if_bound(system: &dyn System) -> Result<(), LoadError> {
    let overlays = overlays(system)?;
    if !overlays.is_empty() {
        return Err(LoadError::OtherOverlays { overlays });
    }
    let drivers = drivers(&system.path(DEVICES));
    if !drivers.is_empty() {
        return Err(LoadError::Drivers { drivers: drivers.join(", ") });
    }
    Ok(())
}

/// Overlays of other names that are or may be applied, with their status.
fn overlays(system: &dyn System) -> Result<Vec<(PathBuf, String)>, LoadError> {
    let Ok(directory) = overlay::interface(system) else {
        log::info!("without an interface for overlays, an applied one does not show");
        return Ok(Vec::new());
    };
    let entries = fs::read_dir(&directory);
    let entries = entries.map_err(|source| LoadError::attribute(&directory, source))?;
    let mut others = Vec::new();
    for path in entries.filter_map(|entry| Some(entry.ok()?.path())) {
        if !path.is_dir() || path.ends_with(NAME) {
            continue;
        }
        let status = read(&path.join("status"));
        let status = status.unwrap_or_else(|error| format!("its status cannot be read: {error}"));
        // An overlay directory without a tree binds nothing.
        if status != "unapplied" {
            others.push((path, status));
        }
    }
    others.sort_unstable();
    Ok(others)
}

/// Drivers bound to devices of the logic, with the devices.
fn drivers(devices: &Path) -> Vec<String> {
    let Ok(entries) = fs::read_dir(devices) else { return Vec::new() };
    let bound = |path: PathBuf| {
        let id = path.file_name()?.to_str()?.to_owned();
        let driver = driver(&path)?;
        // `a0000000.dma` begins with the address of the device's first register.
        let address = id.split_once('.').and_then(|(at, _)| u64::from_str_radix(at, 16).ok());
        let there = address.is_some_and(|address| is_in_logic(address, 1));
        let counts = there && !UIO_DRIVERS.contains(&driver.as_str()) || is_of_logic(&driver);
        counts.then(|| format!("{driver} to {id}"))
    };
    let mut drivers: Vec<_> = entries.filter_map(|entry| bound(entry.ok()?.path())).collect();
    drivers.sort_unstable();
    drivers
}

/// The name of a device's driver.
pub(super) fn driver(device: &Path) -> Option<String> {
    let link = fs::read_link(device.join("driver")).ok()?;
    Some(link.file_name()?.to_str()?.to_owned())
}

/// Whether a driver, or the device file of one, is for the logic by its name.
pub(super) fn is_of_logic(name: &str) -> bool {
    WITHOUT_ADDRESS.iter().any(|start| name.starts_with(start))
}
