//! Drives one channel of the ZDMA, the DMA engine of the processing system, in simple mode: one
//! transfer, described in registers.
//!
//! Source: UG1087 (register reference), modules GDMA and ADMA; UG1085, "DMA controller".

use std::error::Error;
use std::time::{Duration, Instant};

use zynq_pgs::interface::record::BEAT_BYTES;
use zynq_pgs::platform::PlatformError;
use zynq_pgs::platform::{ReservedMemory, UioDevice, UioWindow};

/// Interrupt status; a written 1 clears.
const ISR: u32 = 0x100;
/// Interrupt enable: a written 1 enables.
const IEN: u32 = 0x108;
/// Interrupt disable: a written 1 disables.
const IDS: u32 = 0x10C;
const CTRL0: u32 = 0x110;
const DATA_ATTR: u32 = 0x120;
/// Source and destination: address low and high, length, control.
const SOURCE: u32 = 0x128;
const DESTINATION: u32 = 0x138;
/// Interrupts counted after each descriptor; a read clears.
const SOURCE_COUNT: u32 = 0x190;
const DESTINATION_COUNT: u32 = 0x194;
const CTRL2: u32 = 0x200;

/// `ISR`, `IEN`, `IDS`: the transfer is done.
const DONE: u32 = 1 << 10;
/// `ISR`: every cause that is no error.
const HARMLESS: u32 = DONE | 1 << 4 | 1 << 5;
/// All bits of `ISR`.
const ALL: u32 = 0xFFF;
/// `CTRL0` after reset: reads and writes, from registers, with prefetching.
const SIMPLE_MODE: u32 = 0x80;
/// `DATA_ATTR` after reset: incrementing bursts of 16.
const BURSTS: u32 = 0x0483_D20F;
/// `CTRL2`: begin.
const ENABLE: u32 = 1;

/// A channel, and the memory for its transfers.
#[derive(Debug)]
pub(crate) struct Engine {
    pub(crate) device: UioDevice,
    pub(crate) registers: UioWindow,
    pub(crate) memory: ReservedMemory,
}

impl Engine {
    /// Opens both UIO nodes and stops a transfer that an earlier user may have left.
    pub(crate) fn open(node: &str, memory: &str) -> Result<Self, PlatformError> {
        let memory = ReservedMemory::open(memory)?;
        let device = UioDevice::open(node)?;
        let registers = device.window("channel")?;
        let mut this = Self { device, registers, memory };
        this.disable_interrupt()?;
        this.registers.write32(ISR, ALL)?;
        this.registers.write32(CTRL0, SIMPLE_MODE)?;
        this.registers.write32(DATA_ATTR, BURSTS)?;
        this.registers.read32(SOURCE_COUNT)?;
        this.registers.read32(DESTINATION_COUNT)?;
        this.device.unmask()?;
        // A pending interrupt comes now.
        this.device.wait_interrupt(Duration::from_millis(20))?;
        this.device.unmask()?;
        Ok(this)
    }

    /// Lets the engine's interrupt reach the processor.
    pub(crate) fn enable_interrupt(&mut self) -> Result<(), PlatformError> {
        self.registers.write32(IEN, DONE)
    }

    /// Keeps the engine's interrupt from the processor.
    pub(crate) fn disable_interrupt(&mut self) -> Result<(), PlatformError> {
        self.registers.write32(IDS, ALL)
    }

    /// Starts to copy `beats` from byte `from` of the memory to byte `to`.
    pub(crate) fn start(&mut self, from: u64, to: u64, beats: usize) -> Result<(), PlatformError> {
        let bytes = beats as u64 * BEAT_BYTES as u64;
        for (register, at) in [(SOURCE, from), (DESTINATION, to)] {
            let [low, high] = halves(self.memory.address() + at);
            self.registers.write32(register, low)?;
            self.registers.write32(register + 4, high)?;
            self.registers.write32(register + 8, halves(bytes)[0])?;
            self.registers.write32(register + 12, 0)?;
        }
        self.registers.write32(CTRL2, ENABLE)
    }

    /// Whether the transfer is done.
    pub(crate) fn is_done(&self) -> Result<bool, Box<dyn Error>> {
        let isr = self.registers.read32(ISR)?;
        if isr & !HARMLESS != 0 {
            return Err(format!("expected DMA done in ISR, found {isr:#05x}").into());
        }
        Ok(isr & DONE != 0)
    }

    /// Polls until the transfer is done.
    pub(crate) fn poll_done(&self, limit: Duration) -> Result<(), Box<dyn Error>> {
        let begin = Instant::now();
        loop {
            let last = begin.elapsed() >= limit;
            if self.is_done()? {
                return Ok(());
            }
            if last {
                return Err(format!("no DMA done within {limit:?}").into());
            }
            std::thread::yield_now();
        }
    }

    /// Clears the interrupt in the engine.
    pub(crate) fn acknowledge(&mut self) -> Result<(), PlatformError> {
        self.registers.write32(ISR, ALL)
    }
}

#[allow(clippy::cast_possible_truncation, reason = "split into two registers")]
fn halves(value: u64) -> [u32; 2] {
    [value as u32, (value >> 32) as u32]
}
