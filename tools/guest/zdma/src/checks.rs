//! Checks without a transfer: names, addresses, bounds, memory.

use zynq_pgs::interface::address_map::{MEMORY_BASE, MEMORY_BYTES, UIO_MEMORY_NODE};
use zynq_pgs::interface::record::{BEAT_BYTES, Beat};
use zynq_pgs::platform::PlatformError;
use zynq_pgs::platform::{ReservedMemory, UioDevice};

use crate::Outcome;
use crate::transfer::pattern;

/// The UIO node of the engine's channel.
pub(crate) const ZDMA_NODE: &str = "zdma";
/// Address and length of the channel in the device tree.
const CHANNEL: (u64, u64) = (0xFD50_0000, 0x1000);

/// Nodes and maps are found at the addresses of the device tree; a missing one is reported missing.
pub(crate) fn nodes_by_name() -> Outcome {
    let device = UioDevice::open(ZDMA_NODE)?;
    let registers = device.window("channel")?;
    let found = (registers.address(), registers.bytes());
    if found != CHANNEL {
        return Err(format!("expected {CHANNEL:#x?}, found {found:#x?}").into());
    }
    let memory = ReservedMemory::open(UIO_MEMORY_NODE)?;
    let found = (memory.address(), memory.bytes());
    if found != (MEMORY_BASE, MEMORY_BYTES) {
        return Err(format!("memory is {found:#x?}").into());
    }
    match UioDevice::open("nonesuch") {
        Err(error @ PlatformError::NoNode { .. }) => {
            if !error.to_string().contains(ZDMA_NODE) {
                return Err(format!("does not list the nodes: {error}").into());
            }
        }
        other => return Err(format!("expected no node, found {other:?}").into()),
    }
    match device.window("nonesuch") {
        Err(PlatformError::NoMap { .. }) => {}
        other => return Err(format!("expected no map, found {other:?}").into()),
    }
    for second in [
        ReservedMemory::open(UIO_MEMORY_NODE).map(|_| ()),
        UioDevice::open(UIO_MEMORY_NODE).map(|_| ()),
        UioDevice::open(ZDMA_NODE).map(|_| ()),
    ] {
        match second {
            Err(PlatformError::Busy { .. }) => {}
            other => return Err(format!("expected it to be in use, found {other:?}").into()),
        }
    }
    drop(memory);
    match UioDevice::open(UIO_MEMORY_NODE)?.unmask() {
        Err(PlatformError::NoInterrupt { .. }) => {}
        other => return Err(format!("expected no interrupt, found {other:?}").into()),
    }
    Ok(format!("{} at {:#x}, memory at {:#x}", device.node().device, CHANNEL.0, MEMORY_BASE))
}

/// Memory holds written data, from its first beat to its last.
pub(crate) fn memory() -> Outcome {
    let mut memory = ReservedMemory::open(UIO_MEMORY_NODE)?;
    let beats = 4097;
    let written = pattern(beats, 7);
    let last = memory.bytes() - (beats * BEAT_BYTES) as u64;
    for at in [0, 16, last / 32 * 16, last] {
        memory.write(at, &written)?;
        let mut read = vec![Beat::default(); beats];
        memory.read(at, &mut read)?;
        if read != written {
            return Err(format!("differs at {at:#x}").into());
        }
    }
    Ok(format!("4 times {beats} beats, up to {:#x}", memory.address() + memory.bytes()))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The guest is built from other files than this program; they must agree.
    #[test]
    fn the_guests_device_tree_has_the_memory_of_the_interface() {
        let tree = include_str!("../../zcu102.dts");
        let region = |(address, bytes): (u64, u64)| {
            format!(
                "reg = <{:#x} {:#010x} 0x0 {bytes:#010x}>;",
                address >> 32,
                address & 0xFFFF_FFFF
            )
        };
        let memory = region((MEMORY_BASE, MEMORY_BYTES));
        assert_eq!(tree.matches(&memory).count(), 2, "{memory}: reserved, and a UIO node");
        assert_eq!(tree.matches(&format!("uio-name = \"{UIO_MEMORY_NODE}\";")).count(), 1);
        assert_eq!(tree.matches(&format!("uio-name = \"{ZDMA_NODE}\";")).count(), 1);
        assert!(tree.contains("reg = <0x0 0xfd500000 0x0 0x1000>;"));
    }
}
