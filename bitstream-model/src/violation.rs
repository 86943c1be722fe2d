//! Violations: a driver's mistakes that a board detects, and the log of them with the register
//! accesses before each.

use std::collections::VecDeque;
use std::fmt;

use crate::memory::Denied;
use pgs_interface::axi_dma::Direction;

/// The kind of a driver's mistake.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum ViolationKind {
    /// A register access that is not 32 bits on a multiple of 4.
    #[error("unaligned register access at {address:#x}")]
    UnalignedRegister {
        /// Physical address.
        address: u64,
    },
    /// No region has this address.
    #[error("register access at {address:#x}, where no region is")]
    UnmappedRegister {
        /// Physical address.
        address: u64,
    },
    /// A region without a register at that offset.
    #[error("access to the reserved register at {address:#x}")]
    ReservedRegister {
        /// Physical address.
        address: u64,
    },
    /// CURDESC is writable only while halted with RS = 0.
    #[error("dma{core} {direction}: CURDESC written while not halted")]
    CurdescWhileRunning {
        /// Which DMA.
        core: usize,
        /// Which channel.
        direction: Direction,
    },
    /// A doorbell that starts nothing.
    #[error("dma{core} {direction}: TAILDESC or LENGTH written while halted")]
    DoorbellWhileHalted {
        /// Which DMA.
        core: usize,
        /// Which channel.
        direction: Direction,
    },
    /// TAILDESC on a core without scatter-gather, or LENGTH on one with it, while running.
    #[error("dma{core} {direction}: a doorbell of the mode that this core was not built for")]
    WrongMode {
        /// Which DMA.
        core: usize,
        /// Which channel.
        direction: Direction,
    },
    /// A direct transfer while one is running.
    #[error("dma{core} {direction}: LENGTH written while busy")]
    LengthWhileBusy {
        /// Which DMA.
        core: usize,
        /// Which channel.
        direction: Direction,
    },
    /// A length that the register or the descriptor cannot hold.
    #[error("dma{core} {direction}: length {wanted} does not fit {width} bits")]
    LengthTooWide {
        /// Which DMA.
        core: usize,
        /// Which channel.
        direction: Direction,
        /// The length that was written.
        wanted: u32,
        /// Width of the length register.
        width: u32,
    },
    /// RS set while an error bit stands.
    #[error("dma{core} {direction}: started with an error standing; only a reset clears it")]
    StartWithError {
        /// Which DMA.
        core: usize,
        /// Which channel.
        direction: Direction,
    },
    /// A data address or length that is not a multiple of the stream's width.
    #[error("dma{core} {direction}: address {address:#x} or length {length} is not whole beats")]
    Misaligned {
        /// Which DMA.
        core: usize,
        /// Which channel.
        direction: Direction,
        /// Bus address.
        address: u64,
        /// Bytes.
        length: u32,
    },
    /// A descriptor that is not on a multiple of 64 bytes.
    #[error("dma{core} {direction}: descriptor address {address:#x} is not a multiple of 64")]
    MisalignedDescriptor {
        /// Which DMA.
        core: usize,
        /// Which channel.
        direction: Direction,
        /// Bus address.
        address: u64,
    },
    /// An access of the device to memory that it was not granted, or a descriptor that would have
    /// let a longer packet there.
    #[error("dma{core} {direction}: {bytes} bytes at {address:#x}: {denied}")]
    OutsideGrant {
        /// Which DMA.
        core: usize,
        /// Which channel.
        direction: Direction,
        /// Bus address.
        address: u64,
        /// Bytes.
        bytes: u64,
        /// The reason.
        denied: Denied,
    },
    /// A descriptor with Cmplted still set.
    #[error("dma{core} {direction}: descriptor at {address:#x} still has Cmplted set")]
    StaleDescriptor {
        /// Which DMA.
        core: usize,
        /// Which channel.
        direction: Direction,
        /// Bus address.
        address: u64,
    },
    /// A descriptor of length 0.
    #[error("dma{core} {direction}: descriptor at {address:#x} has length 0")]
    ZeroLength {
        /// Which DMA.
        core: usize,
        /// Which channel.
        direction: Direction,
        /// Bus address.
        address: u64,
    },
    /// SOF within a packet, or no SOF at the start of one.
    #[error("dma{core} {direction}: SOF and EOF do not pair at descriptor {address:#x}")]
    UnpairedPacket {
        /// Which DMA.
        core: usize,
        /// Which channel.
        direction: Direction,
        /// Bus address.
        address: u64,
    },
    /// `ap_start` while a step runs, or while an error stands.
    #[error("accelerator started while it is not idle")]
    StartWhileBusy,
    /// An argument or a shape written while a step runs.
    #[error("control register {offset:#x} written while a step runs")]
    ArgumentWhileRunning {
        /// Offset in the control block.
        offset: u32,
    },
}

/// One register access.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct RegisterAccess {
    /// Clock cycle at which it happened.
    pub cycle: u64,
    /// Physical address.
    pub address: u64,
    /// Whether it was a write.
    pub write: bool,
    /// The value read or written.
    pub value: u32,
}

impl fmt::Display for RegisterAccess {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let arrow = if self.write { "<-" } else { "->" };
        write!(f, "cycle {:>10}  {:#012x} {arrow} {:#010x}", self.cycle, self.address, self.value)
    }
}

/// A driver's mistake, its time, and the register accesses before it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Violation {
    /// The mistake.
    pub kind: ViolationKind,
    /// Clock cycle.
    pub cycle: u64,
    /// The last register accesses, oldest first.
    pub accesses: Vec<RegisterAccess>,
}

impl fmt::Display for Violation {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "cycle {}: {}", self.cycle, self.kind)?;
        for access in &self.accesses {
            write!(f, "\n  {access}")?;
        }
        Ok(())
    }
}

/// Register accesses that are kept with a violation.
const ACCESSES_KEPT: usize = 32;
/// Violations kept; later ones are only counted.
const VIOLATIONS_KEPT: usize = 64;

/// The board's log of violations.
#[derive(Debug)]
pub(crate) struct Log {
    recent: VecDeque<RegisterAccess>,
    violations: Vec<Violation>,
    pub(crate) count: u64,
    now: u64,
    /// Whether the channels have lost their state without the driver's doing.
    pardons: bool,
}

impl Log {
    pub(crate) fn new() -> Self {
        Self {
            recent: VecDeque::with_capacity(ACCESSES_KEPT),
            violations: Vec::new(),
            count: 0,
            now: 0,
            pardons: false,
        }
    }

    /// The channels have lost their state. A driver that has not noticed yet goes on with its
    /// transfers: doorbells to halted channels are no violations from now on.
    pub(crate) fn pardon(&mut self) {
        self.pardons = true;
    }

    /// The driver has noticed and resets: doorbells to halted channels are violations again.
    pub(crate) fn withdraw_pardon(&mut self) {
        self.pardons = false;
    }

    /// Sets the time stamp of violations.
    pub(crate) fn at(&mut self, now: u64) {
        self.now = now;
    }

    pub(crate) fn access(&mut self, access: RegisterAccess) {
        if self.recent.len() == ACCESSES_KEPT {
            self.recent.pop_front();
        }
        self.recent.push_back(access);
    }

    pub(crate) fn violation(&mut self, kind: ViolationKind) {
        if self.pardons && matches!(kind, ViolationKind::DoorbellWhileHalted { .. }) {
            return;
        }
        log::debug!("board: violation: {kind}");
        self.count += 1;
        if self.violations.len() < VIOLATIONS_KEPT {
            let accesses = self.recent();
            self.violations.push(Violation { kind, cycle: self.now, accesses });
        }
    }

    /// The last register accesses, oldest first.
    pub(crate) fn recent(&self) -> Vec<RegisterAccess> {
        self.recent.iter().copied().collect()
    }

    pub(crate) fn violations(&self) -> &[Violation] {
        &self.violations
    }
}
