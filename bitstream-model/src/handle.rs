//! The two handles of a board: [`CpuPort`] for its driver, [`EmulatedBoard`] for its builder.
//!
//! Every call of either goes through [`with_board`]: a board computes in the standard
//! floating-point environment, independently of the caller's.

use std::ops::Range;
use std::sync::atomic::AtomicU32;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use pgs_support::float_env::standard;

use crate::axi_dma::PacketCount;
use crate::board::{Board, Counts};
use crate::config::{BoardConfig, ConfigError};
use crate::external::ExternalAccelerator;
use crate::fast::Fast;
use crate::fault::FaultPlan;
use crate::memory::external::DeviceMemory;
use crate::memory::{DeviceAccess, Memory, MemoryError};
use crate::recording::Recording;
use crate::violation::{RegisterAccess, Violation};
use pgs_interface::record::Beat;

/// Locks a board and runs `act` on it in the standard floating-point environment.
fn with_board<R>(board: &Mutex<Board>, act: impl FnOnce(&mut Board) -> R) -> R {
    // A panic in another thread leaves wrong numbers at worst, never a broken structure.
    standard(|| act(&mut board.lock().unwrap_or_else(PoisonError::into_inner)))
}

/// An emulated board, as its builder sees it.
#[derive(Debug, Clone)]
pub struct EmulatedBoard(Arc<Mutex<Board>>);

impl EmulatedBoard {
    /// Builds a board.
    ///
    /// # Errors
    /// [`ConfigError`] if a number is outside its range.
    pub fn new(config: BoardConfig) -> Result<Self, ConfigError> {
        config.check()?;
        Ok(Self::of(config, Memory::of(&config), None))
    }

    /// Builds a board on external memory, around another accelerator if there is one. The device
    /// may touch the granted ranges only. Such a board allocates no memory itself.
    ///
    /// # Errors
    /// [`ConfigError`] if a number is outside its range.
    pub fn on_memory(
        config: BoardConfig,
        memory: Box<dyn DeviceMemory>,
        granted: Vec<Range<u64>>,
        accelerator: Option<Box<dyn ExternalAccelerator>>,
    ) -> Result<Self, ConfigError> {
        config.check()?;
        Ok(Self::of(config, Memory::external(memory, granted), accelerator))
    }

    /// Builds a board around another accelerator: registers, beats and interrupts are its own. It
    /// must be built as `config` says.
    ///
    /// # Errors
    /// [`ConfigError`] if a number is outside its range.
    pub fn with_accelerator(
        config: BoardConfig,
        accelerator: Box<dyn ExternalAccelerator>,
    ) -> Result<Self, ConfigError> {
        config.check()?;
        Ok(Self::of(config, Memory::of(&config), Some(accelerator)))
    }

    fn of(
        config: BoardConfig,
        memory: Memory,
        accelerator: Option<Box<dyn ExternalAccelerator>>,
    ) -> Self {
        let board = standard(|| {
            // It computes as the model does, in memory of the board; another accelerator has to
            // compute itself.
            let own = accelerator.is_none() && memory.is_own();
            let fast = if own { Fast::of(&config) } else { None };
            Board::new(config, memory, fast.map(Box::new), accelerator)
        });
        Self(Arc::new(Mutex::new(board)))
    }

    /// Why the external accelerator does not answer any more, in words.
    #[must_use]
    pub fn accelerator_error(&self) -> Option<String> {
        with_board(&self.0, |board| board.accelerator_error().map(ToString::to_string))
    }

    /// The handle for a driver of this board.
    #[must_use]
    pub fn cpu_port(&self) -> CpuPort {
        CpuPort(Arc::clone(&self.0))
    }

    /// How the board was built.
    #[must_use]
    pub fn config(&self) -> BoardConfig {
        with_board(&self.0, |board| board.config)
    }

    /// The driver's violations, oldest first; the first 64 are kept.
    #[must_use]
    pub fn violations(&self) -> Vec<Violation> {
        with_board(&self.0, |board| board.log.violations().to_vec())
    }

    /// The last register accesses of the driver, oldest first; 32 are kept.
    #[must_use]
    pub fn register_accesses(&self) -> Vec<RegisterAccess> {
        with_board(&self.0, |board| board.log.recent())
    }

    /// The board's counters since it was built.
    #[must_use]
    pub fn counts(&self) -> Counts {
        with_board(&self.0, |board| board.counts())
    }

    /// Whether the accelerator or a DMA engine is at work.
    #[must_use]
    pub fn is_running(&self) -> bool {
        with_board(&self.0, |board| board.running())
    }

    /// The level of the interrupt line.
    #[must_use]
    pub fn interrupt_level(&self) -> bool {
        with_board(&self.0, |board| board.interrupt.level())
    }

    /// Makes the board fail as planned, from now on. A fault of a part that does not exist never
    /// happens.
    pub fn inject(&self, plan: impl Into<FaultPlan>) {
        let plan = plan.into();
        with_board(&self.0, |board| {
            for fault in plan.faults {
                board.inject(fault);
            }
        });
    }

    /// Forgets the faults that have not happened.
    pub fn clear_faults(&self) {
        with_board(&self.0, |board| board.clear_faults());
    }

    /// Number of faults that have happened.
    #[must_use]
    pub fn faults(&self) -> u64 {
        with_board(&self.0, |board| board.faults())
    }

    /// Records the course of the board's time from now on.
    pub fn record(&self) {
        with_board(&self.0, Board::start_recording);
    }

    /// Ends the recording under way; none if there is none.
    #[must_use]
    pub fn take_recording(&self) -> Option<Recording> {
        with_board(&self.0, Board::take_recording)
    }

    /// The packets that have ended since the last step began, in the order of their ends.
    #[must_use]
    pub fn packets(&self) -> Vec<PacketCount> {
        with_board(&self.0, |board| board.packets().to_vec())
    }
}

/// An emulated board, as the CPU sees it: registers, memory, an interrupt and time.
#[derive(Debug, Clone)]
pub struct CpuPort(Arc<Mutex<Board>>);

impl CpuPort {
    /// Reads the register at a physical address.
    #[must_use]
    pub fn read32(&self, address: u64) -> u32 {
        with_board(&self.0, |board| board.read32(address))
    }

    /// Writes the register at a physical address.
    pub fn write32(&self, address: u64, value: u32) {
        with_board(&self.0, |board| board.write32(address, value));
    }

    /// Virtual time since the board was built.
    #[must_use]
    pub fn now(&self) -> Duration {
        let nanoseconds = with_board(&self.0, |board| {
            u128::from(board.now) * 1_000_000 / u128::from(board.config.profile.clock_khz)
        });
        Duration::from_nanos(u64::try_from(nanoseconds).unwrap_or(u64::MAX))
    }

    /// Lets virtual time pass.
    pub fn pause(&self, duration: Duration) {
        with_board(&self.0, |board| board.advance(deadline(board, duration), false));
    }

    /// Waits for the interrupt as a read of a UIO file does: an event masks the line and returns
    /// the number of events so far; `None` after `timeout`.
    #[must_use]
    pub fn wait_interrupt(&self, timeout: Duration) -> Option<u32> {
        with_board(&self.0, |board| {
            board.advance(deadline(board, timeout), true);
            board.interrupt.take()
        })
    }

    /// Lets the next event through, as a write of 1 to a UIO file does.
    pub fn unmask_interrupt(&self) {
        with_board(&self.0, |board| board.interrupt.unmask());
    }

    /// Allocates contiguous memory for DMA: its bus address, and the beats, which the CPU owns.
    ///
    /// # Errors
    /// [`MemoryError::Exhausted`] if there is no room below the DMA's address limit.
    pub fn allocate(&self, beats: usize) -> Result<(u64, Box<[Beat]>), MemoryError> {
        with_board(&self.0, |board| board.memory.allocate(beats))
    }

    /// Allocates memory for descriptors, which both sides may touch at any time.
    ///
    /// # Errors
    /// [`MemoryError::Exhausted`] if there is no room below the DMA's address limit.
    pub fn allocate_shared(&self, words: usize) -> Result<(u64, Arc<[AtomicU32]>), MemoryError> {
        with_board(&self.0, |board| board.memory.allocate_shared(words))
    }

    /// The guard: memory behind the fence, which the device tree reserves for a test of the fence.
    /// `None` on a board without a fence or without a guard.
    #[must_use]
    pub fn guard(&self) -> Option<Range<u64>> {
        with_board(&self.0, |board| board.memory.guard())
    }

    /// As [`allocate`](Self::allocate), in the guard, which holds one buffer or ring at a time.
    ///
    /// # Errors
    /// [`MemoryError::Exhausted`] if there is no guard, or no room in it.
    pub fn allocate_guard(&self, beats: usize) -> Result<(u64, Box<[Beat]>), MemoryError> {
        with_board(&self.0, |board| board.memory.allocate_guard(beats))
    }

    /// As [`allocate_shared`](Self::allocate_shared), in the guard.
    ///
    /// # Errors
    /// As for [`allocate_guard`](Self::allocate_guard).
    pub fn allocate_guard_shared(
        &self,
        words: usize,
    ) -> Result<(u64, Arc<[AtomicU32]>), MemoryError> {
        with_board(&self.0, |board| board.memory.allocate_guard_shared(words))
    }

    /// Moves a buffer to the device.
    ///
    /// # Errors
    /// [`MemoryError`] if nothing was allocated at `address`, or the CPU does not own it, or its
    /// length is another.
    pub fn hand_over(
        &self,
        address: u64,
        beats: Box<[Beat]>,
        access: DeviceAccess,
    ) -> Result<(), MemoryError> {
        let granted = beats.len();
        self.hand_over_first(address, beats, granted, access)
    }

    /// Moves a buffer to the device, which may touch its first `granted` beats and no more.
    ///
    /// # Errors
    /// As for [`hand_over`](Self::hand_over).
    pub fn hand_over_first(
        &self,
        address: u64,
        beats: Box<[Beat]>,
        granted: usize,
        access: DeviceAccess,
    ) -> Result<(), MemoryError> {
        with_board(&self.0, |board| board.memory.hand_over(address, beats, granted, access))
    }

    /// Moves a buffer back to the CPU.
    ///
    /// # Errors
    /// [`MemoryError`] if nothing was allocated at `address`, or the device does not own it.
    pub fn take_back(&self, address: u64) -> Result<Box<[Beat]>, MemoryError> {
        with_board(&self.0, |board| {
            board.catch_up();
            board.memory.take_back(address)
        })
    }

    /// Frees memory; from then on the device may not touch it.
    ///
    /// # Errors
    /// [`MemoryError::Unknown`] if nothing was allocated at `address`.
    pub fn release(&self, address: u64) -> Result<(), MemoryError> {
        with_board(&self.0, |board| {
            board.catch_up();
            board.memory.release(address)
        })
    }
}

/// The last clock cycle, after a thousand years: sums of clocks do not overflow.
const CLOCK_END: u64 = u64::MAX / 2;

/// The clock cycle at which `duration` from now has passed.
fn deadline(board: &Board, duration: Duration) -> u64 {
    let cycles = duration
        .as_nanos()
        .saturating_mul(board.config.profile.clock_khz.into())
        .div_ceil(1_000_000);
    board.now.saturating_add(u64::try_from(cycles).unwrap_or(u64::MAX)).min(CLOCK_END)
}
