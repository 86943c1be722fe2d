//! DMACR and DMASR as values with named fields.

use std::fmt;

use pgs_interface::axi_dma::{DMACR, DMASR, dmacr, dmasr};

use crate::platform::fields;

/// A value of the status register.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Dmasr(pub(crate) u32);

impl Dmasr {
    /// The register as it was read.
    #[must_use]
    pub fn raw(self) -> u32 {
        self.0
    }

    /// Whether the channel is stopped.
    #[must_use]
    pub fn halted(self) -> bool {
        dmasr::HALTED.is_set(self.0)
    }

    /// Whether the tail was reached and every descriptor done.
    #[must_use]
    pub fn idle(self) -> bool {
        dmasr::IDLE.is_set(self.0)
    }

    /// Whether the core was built with scatter-gather.
    pub(crate) fn scatter_gather(self) -> bool {
        dmasr::SG_INCLD.is_set(self.0)
    }

    /// The error bits that are set, in place.
    #[must_use]
    pub fn errors(self) -> u32 {
        self.0 & dmasr::ERRORS
    }

    /// The interrupt bits that are set, in place.
    pub(crate) fn interrupts(self) -> u32 {
        self.0 & dmasr::IRQS
    }

    /// Whether a packet is complete.
    pub(crate) fn complete(self) -> bool {
        dmasr::IOC_IRQ.is_set(self.0)
    }

    /// Whether this is what a bus without a device reads.
    pub(crate) fn gone(self) -> bool {
        self.0 == u32::MAX
    }
}

impl fmt::Display for Dmasr {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:#010x}", self.0)?;
        fields(f, &DMASR, self.0)
    }
}

/// A value of the control register.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Dmacr(pub(crate) u32);

impl Dmacr {
    /// The register as it was read.
    #[must_use]
    pub fn raw(self) -> u32 {
        self.0
    }

    /// Stopped, no interrupts.
    pub(crate) const STOPPED: Self = Self(DMACR.reset);
    /// Resets the core.
    pub(crate) const RESET: Self = Self(DMACR.reset | dmacr::RESET.mask());
    /// Running, interrupt on errors.
    pub(crate) const RUNNING: Self =
        Self(DMACR.reset | dmacr::RS.mask() | dmacr::ERR_IRQ_EN.mask());
    /// Running, interrupt on errors and on each complete packet.
    pub(crate) const RUNNING_WITH_COMPLETION: Self =
        Self(Self::RUNNING.0 | dmacr::IOC_IRQ_EN.mask());

    /// Whether a reset is under way.
    pub(crate) fn resetting(self) -> bool {
        dmacr::RESET.is_set(self.0)
    }

    /// The interrupt bits of DMASR that reach the line. The enables stand at the same bits.
    pub(crate) fn enabled(self) -> u32 {
        self.0 & dmasr::IRQS
    }
}

const _: () = assert!(
    dmacr::IOC_IRQ_EN.mask() == dmasr::IOC_IRQ.mask()
        && dmacr::DLY_IRQ_EN.mask() == dmasr::DLY_IRQ.mask()
        && dmacr::ERR_IRQ_EN.mask() == dmasr::ERR_IRQ.mask()
);

impl fmt::Display for Dmacr {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:#010x}", self.0)?;
        fields(f, &DMACR, self.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_status_seen_on_boards_reads_as_it_should() {
        // A slave error of the descriptor port, halted (reported by users of real boards).
        let status = Dmasr(0x0001_0209);
        assert!(status.halted() && status.scatter_gather() && !status.complete());
        assert_eq!(status.errors(), 0x200);
        assert_eq!(status.to_string(), "0x00010209 Halted SGIncld SGSlvErr IRQThresholdSts=1");
    }

    #[test]
    fn every_error_bit_is_an_error() {
        for bit in [4, 5, 6, 8, 9, 10] {
            assert_eq!(Dmasr(1 << bit).errors(), 1 << bit);
        }
        assert_eq!(Dmasr(!0x770).errors(), 0);
    }

    #[test]
    fn a_running_channel_interrupts_on_errors_and_one_on_completion_too() {
        assert_eq!(Dmacr::RUNNING.0, 0x0001_4003);
        assert_eq!(Dmacr::RUNNING_WITH_COMPLETION.0, 0x0001_5003);
        assert_eq!(Dmacr::RUNNING.enabled(), 0x4000);
        assert_eq!(Dmacr::RESET.0, 0x0001_0006);
    }
}
