//! A bare-metal host for the tests of the emulated board.
//!
//! It knows the board through register rows, record layouts and [`CpuPort`] alone, and shares no
//! code with the driver: it packs records from the layout tables.

#![allow(dead_code, reason = "each test file uses a part of it")]

pub(crate) mod fast;
pub(crate) mod packing;
pub(crate) mod ring;
pub(crate) mod scene;
pub(crate) mod sg;

use std::time::Duration;

use bitstream_model::{
    BoardConfig, CpuPort, DeviceAccess, Direction, EmulatedBoard, ViolationKind,
};
use pgs_interface::address_map::{CONTROL_BASE, dma_base};
use pgs_interface::axi_dma::{DMACR, DMASR, S2MM_OFFSET, dmacr, dmasr};
use pgs_interface::control;
use pgs_interface::profile::Variant;
use pgs_interface::record::Beat;
use pgs_interface::register::Register;

/// DMAs of the `float` profile.
pub(crate) const CORES: usize = 4;
pub(crate) const BOTH: [Direction; 2] = [Direction::Mm2s, Direction::S2mm];
/// Reads after which every state that changes by time alone must have changed.
const POLLS: usize = 1000;

pub(crate) const fn microseconds(count: u64) -> Duration {
    Duration::from_micros(count)
}

/// A board without an issue queue, on which collisions enter in the order of the stream.
pub(crate) fn without_queue() -> BoardConfig {
    BoardConfig { queue: Some(0), ..BoardConfig::default() }
}

/// A board with both of its handles.
#[derive(Debug)]
pub(crate) struct Host {
    pub(crate) board: EmulatedBoard,
    pub(crate) port: CpuPort,
}

impl Host {
    pub(crate) fn new(config: BoardConfig) -> Self {
        let board = EmulatedBoard::new(config).expect("the tests' boards can be built");
        let port = board.cpu_port();
        Self { board, port }
    }

    pub(crate) fn variant(&self) -> Variant {
        self.board.config().variant()
    }

    /// DMAs of the board.
    pub(crate) fn cores(&self) -> usize {
        self.variant().profile.mm2s_widths.len()
    }

    /// A board that counts violations and goes on.
    pub(crate) fn lenient(config: BoardConfig) -> Self {
        Self::new(BoardConfig { strict: false, ..config })
    }

    pub(crate) fn at(core: usize, direction: Direction, register: Register) -> u64 {
        let half = match direction {
            Direction::Mm2s => 0,
            Direction::S2mm => S2MM_OFFSET,
        };
        dma_base(core) + u64::from(half + register.offset)
    }

    pub(crate) fn read(&self, core: usize, direction: Direction, register: Register) -> u32 {
        self.port.read32(Self::at(core, direction, register))
    }

    pub(crate) fn write(&self, core: usize, direction: Direction, register: Register, value: u32) {
        self.port.write32(Self::at(core, direction, register), value);
    }

    pub(crate) fn status(&self, core: usize, direction: Direction) -> u32 {
        self.read(core, direction, DMASR)
    }

    pub(crate) fn control(&self, register: Register) -> u32 {
        self.port.read32(CONTROL_BASE + u64::from(register.offset))
    }

    pub(crate) fn set_control(&self, register: Register, value: u32) {
        self.port.write32(CONTROL_BASE + u64::from(register.offset), value);
    }

    pub(crate) fn pause(&self, count: u64) {
        self.port.pause(microseconds(count));
    }

    pub(crate) fn violations(&self) -> Vec<ViolationKind> {
        self.board.violations().into_iter().map(|violation| violation.kind).collect()
    }

    pub(crate) fn assert_no_violation(&self) {
        if let Some(violation) = self.board.violations().first() {
            panic!("{violation}");
        }
    }

    /// Polls DMASR until Halted is as wanted.
    pub(crate) fn wait_halted(&self, core: usize, direction: Direction, wanted: bool) {
        let reached =
            (0..POLLS).any(|_| dmasr::HALTED.is_set(self.status(core, direction)) == wanted);
        assert!(reached, "dma{core} {direction}: Halted never became {wanted}");
    }

    /// Sets RS beside `control` and waits until the channel runs.
    pub(crate) fn run_channel(&self, core: usize, direction: Direction, control: u32) {
        let threshold = dmacr::IRQ_THRESHOLD.put(0, 1);
        let value =
            if dmacr::IRQ_THRESHOLD.is_set(control) { control } else { control | threshold };
        self.write(core, direction, DMACR, dmacr::RS.put(value, 1));
        self.wait_halted(core, direction, false);
    }

    pub(crate) fn reset_dma(&self, core: usize) {
        self.write(core, Direction::Mm2s, DMACR, dmacr::RESET.mask());
        let done = (0..POLLS)
            .any(|_| BOTH.iter().all(|way| !dmacr::RESET.is_set(self.read(core, *way, DMACR))));
        assert!(done, "dma{core}: the reset never ended");
    }

    pub(crate) fn reset_accelerator(&self) {
        self.set_control(control::RESET, control::reset::RESET.mask());
        let done = (0..POLLS).any(|_| !control::reset::RESET.is_set(self.control(control::RESET)));
        assert!(done, "the accelerator's reset never ended");
    }

    pub(crate) fn reset_all(&self) {
        (0..self.cores()).for_each(|core| self.reset_dma(core));
        self.reset_accelerator();
    }

    /// A buffer with `beats` that the device reads.
    pub(crate) fn readable(&self, beats: &[Beat]) -> u64 {
        let (address, mut buffer) = self.port.allocate(beats.len()).expect("there is room");
        buffer.copy_from_slice(beats);
        self.port.hand_over(address, buffer, DeviceAccess::Read).expect("the CPU owns it");
        address
    }

    /// A buffer of `beats` beats that the device writes.
    pub(crate) fn writable(&self, beats: usize) -> u64 {
        let (address, buffer) = self.port.allocate(beats).expect("there is room");
        self.port.hand_over(address, buffer, DeviceAccess::Write).expect("the CPU owns it");
        address
    }

    pub(crate) fn take(&self, address: u64) -> Box<[Beat]> {
        self.port.take_back(address).expect("the device owns it")
    }

    /// The sticky error: code, stream, detail.
    pub(crate) fn error(&self) -> (u32, u32, u32) {
        let error = self.control(control::ERROR);
        let (code, channel) = (control::error::CODE.of(error), control::error::CHANNEL.of(error));
        (code, channel, self.control(control::ERROR_DETAIL))
    }
}

/// Beats that all differ.
pub(crate) fn numbered(beats: u32) -> Vec<Beat> {
    (0..beats).map(|k| Beat([k, k ^ 0x5555_5555, !k, k.wrapping_mul(0x9E37_79B9)])).collect()
}
