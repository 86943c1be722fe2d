//! An open board, from opening and bring-up over the start and end of a step to recovery.

pub(crate) mod anomalies;
pub(crate) mod bank;
pub(crate) mod bring_up;
pub(crate) mod cancellation;
mod choice_text;
pub(crate) mod completion;
pub(crate) mod device;
pub(crate) mod guarded;
pub(crate) mod open;
pub(crate) mod outline;
pub(crate) mod plan;
pub(crate) mod port;
pub(crate) mod recovery;
pub(crate) mod root_cause;
pub(crate) mod snapshot;
pub(crate) mod symptom;
#[cfg(test)]
pub(crate) mod tests;

pub(crate) use bring_up::{Core, check_given_width, check_memory, connect, drain_interrupt};
pub use cancellation::Cancellation;
pub(crate) use device::Device;
pub(crate) use guarded::{Guarded, Master};
pub(crate) use open::Found;
pub use open::{BoardChoice, BoardDescription, BoardKind, OpenOptions};
