//! Drives the emulated board: the platform without hardware.

use std::time::Duration;

use bitstream_model::{CpuPort, DeviceAccess};
use pgs_interface::record::BEAT_BYTES;

use crate::platform::{
    Access, DmaMemory, DmaMemorySource, Platform, PlatformError, RegisterMap, RegisterWindow,
    Result, SharedMemory,
};

/// The emulated board from the side of its processor.
#[derive(Debug)]
pub(crate) struct EmulatedPlatform {
    port: CpuPort,
    /// Where the guard begins, and its length, if the guard takes the place of the memory.
    guard: Option<(u64, u64)>,
}

impl EmulatedPlatform {
    /// The board behind this port.
    pub(crate) fn new(port: CpuPort) -> Self {
        Self { port, guard: None }
    }
}

/// A register region of the emulated board.
#[derive(Debug)]
struct EmulatedWindow {
    port: CpuPort,
    base: u64,
    bytes: u32,
}

impl RegisterWindow for EmulatedWindow {
    fn bytes(&self) -> u64 {
        u64::from(self.bytes)
    }

    fn read32(&self, at: u32) -> u32 {
        self.port.read32(self.base + u64::from(at))
    }

    fn write32(&self, at: u32, value: u32) {
        self.port.write32(self.base + u64::from(at), value);
    }
}

fn refused<E: std::error::Error + Send + Sync + 'static>(
    act: &'static str,
    what: &'static str,
    value: u64,
) -> impl FnOnce(E) -> PlatformError {
    move |source| PlatformError::Memory { act, what, value, source: Box::new(source) }
}

impl DmaMemorySource for EmulatedPlatform {
    fn name(&self) -> &str {
        if self.guard.is_some() { "guard" } else { "emulated" }
    }

    fn extent(&self) -> Option<(u64, u64)> {
        self.guard
    }

    fn allocate(&self, beats: usize) -> Result<(u64, DmaMemory)> {
        let bytes = beats.saturating_mul(BEAT_BYTES) as u64;
        let allocated = match self.guard {
            Some(_) => self.port.allocate_guard(beats),
            None => self.port.allocate(beats),
        };
        let (address, beats) = allocated.map_err(refused("allocate", "bytes", bytes))?;
        Ok((address, DmaMemory::Heap(beats)))
    }

    fn allocate_shared(&self, words: usize) -> Result<(u64, SharedMemory)> {
        let bytes = words.saturating_mul(4) as u64;
        let allocated = match self.guard {
            Some(_) => self.port.allocate_guard_shared(words),
            None => self.port.allocate_shared(words),
        };
        let (address, words) = allocated.map_err(refused("allocate", "bytes", bytes))?;
        Ok((address, SharedMemory::Heap(words)))
    }

    fn hand_over(&self, at: u64, memory: DmaMemory, used: usize, access: Access) -> Result<()> {
        let DmaMemory::Heap(beats) = memory else {
            unreachable!("a buffer goes back to the platform that it came from");
        };
        let access = match access {
            Access::Read => DeviceAccess::Read,
            Access::Write => DeviceAccess::Write,
        };
        let given = self.port.hand_over_first(at, beats, used, access);
        given.map_err(refused("hand over", "address", at))
    }

    fn take_back(&self, address: u64) -> Result<DmaMemory> {
        let taken = self.port.take_back(address);
        Ok(DmaMemory::Heap(taken.map_err(refused("take back", "address", address))?))
    }

    fn release(&self, address: u64) -> Result<()> {
        self.port.release(address).map_err(refused("free", "address", address))
    }
}

impl Platform for EmulatedPlatform {
    fn window(&self, map: RegisterMap) -> Result<Box<dyn RegisterWindow>> {
        let (base, bytes) = map.place();
        Ok(Box::new(EmulatedWindow { port: self.port.clone(), base, bytes }))
    }

    fn memory(&self) -> &dyn DmaMemorySource {
        self
    }

    fn guard(&self) -> Result<Option<Box<dyn DmaMemorySource>>> {
        let port = self.port.clone();
        Ok(self.port.guard().map(|guard| -> Box<dyn DmaMemorySource> {
            let guard = Some((guard.start, guard.end - guard.start));
            Box::new(Self { port, guard })
        }))
    }

    fn now(&self) -> Duration {
        self.port.now()
    }

    fn pause(&self, duration: Duration) {
        self.port.pause(duration);
    }

    fn wait_interrupt(&self, timeout: Duration) -> Result<Option<u32>> {
        Ok(self.port.wait_interrupt(timeout))
    }

    fn unmask_interrupt(&self) -> Result<()> {
        self.port.unmask_interrupt();
        Ok(())
    }
}
