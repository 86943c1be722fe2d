//! Writes the course of one step on an emulated board: as a VCD for `GTKWave`, as trace events for
//! Perfetto, as a picture.
//!
//! The step was recorded by the board ([`recording`](bitstream_model::recording)). All three tell
//! its time by the board's clock. The host's own times are on another clock: the trace events have
//! a process of their own for them, the other two leave them out.

mod a53;
mod events;
mod names;
mod svg;
mod timeline;
mod vcd;

use bitstream_model::RegisterAccess;
use bitstream_model::recording::{Recording, Span};
use zynq_pgs::StepReport;

pub use events::SCHEMA;

/// A step that was recorded.
#[derive(Debug, Clone, Copy)]
pub struct TracedStep<'a> {
    /// Its recording.
    pub recording: &'a Recording,
    /// The name of the board's design.
    pub design: &'a str,
    /// The driver's report, unless the step failed or was interrupted.
    pub report: Option<&'a StepReport>,
}

impl TracedStep<'_> {
    /// Nanoseconds of a number of clocks.
    fn nanoseconds(&self, clocks: u64) -> f64 {
        clocks as f64 * 1e6 / f64::from(self.recording.clock_khz)
    }

    /// The clocks of a register access, which ends with its clock.
    fn span_of(&self, access: &RegisterAccess) -> Span {
        let begin = access.cycle.saturating_sub(self.recording.access_clocks);
        Span { begin: begin.max(self.recording.span.begin), end: access.cycle }
    }

    /// The clock's frequency in MHz.
    fn megahertz(&self) -> f64 {
        f64::from(self.recording.clock_khz) / 1e3
    }
}
