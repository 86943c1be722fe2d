//! The first sign of a fault, for which a step is given up. The
//! [diagnosis](crate::fault::diagnosis) finds its cause.

use std::time::Duration;

use crate::axi_dma::{DmaError, Dmasr};
use crate::control_block::{ControlError, StickyError};
use crate::fault::{Awaited, Fault};
use crate::platform::PlatformError;

/// Why a step was given up.
#[derive(Debug)]
pub(crate) enum Symptom {
    /// The status of a channel shows an error, or nothing at all.
    Status {
        /// Place of the channel among all ports.
        place: usize,
        status: Dmasr,
    },
    /// A descriptor has failed, or a received packet does not end where it should.
    Chain {
        /// Place of the channel among all ports.
        place: usize,
    },
    /// The accelerator's sticky error is set.
    Sticky(StickyError),
    /// A deadline has passed.
    Late { awaited: Awaited, limit: Duration },
    /// The cause is known, unless something worse stands behind it.
    Known(Fault),
}

impl From<Fault> for Symptom {
    fn from(fault: Fault) -> Self {
        Self::Known(fault)
    }
}

impl From<DmaError> for Symptom {
    fn from(error: DmaError) -> Self {
        Self::Known(error.into())
    }
}

impl From<ControlError> for Symptom {
    fn from(error: ControlError) -> Self {
        Self::Known(error.into())
    }
}

impl From<PlatformError> for Symptom {
    fn from(error: PlatformError) -> Self {
        Self::Known(error.into())
    }
}

/// The fault of an accelerator whose registers are as after a reset.
pub(super) fn control_block_reset() -> Fault {
    Fault::LogicReset { region: "the control block".to_owned() }
}
