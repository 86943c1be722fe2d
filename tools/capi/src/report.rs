//! The report of a step as C has it.

use zynq_pgs::StepReport;

/// Counts and times of one step. The caller sets `size` to `sizeof(zpgs_report)` before the call.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[repr(C)]
pub struct Report {
    /// Size of the structure, as the caller's header has it.
    pub size: usize,
    /// Clock cycles of the board from start to done.
    pub cycles: u64,
    /// Cycles in which a collision waited for a velocity of an earlier one.
    pub stalls: u64,
    /// Cycles in which the board waited for memory.
    pub waits: u64,
    /// Collisions that met a hazard, over all passes.
    pub hazards: u64,
    /// Time from start to done by the board's clock, s; 0 if the bitstream gives no clock.
    pub seconds: f64,
    /// Sum of the normal impulses after the last contact pass, N s; not a number if the bitstream
    /// does not count it, or not as far.
    pub impulse_sum: f64,
    /// Number of bodies.
    pub bodies: u64,
    /// Number of collisions with contact points.
    pub collisions: u64,
    /// Number of repetitions after faults.
    pub retries: u64,
}

impl From<&StepReport> for Report {
    fn from(report: &StepReport) -> Self {
        Self {
            size: size_of::<Self>(),
            cycles: report.cycles.total,
            stalls: report.cycles.stalls,
            waits: report.cycles.waits,
            hazards: report.hazards,
            seconds: report.modelled_time().as_secs_f64(),
            impulse_sum: report.impulse_sum.unwrap_or(f64::NAN),
            bodies: report.bodies,
            collisions: report.collisions,
            retries: report.retries.into(),
        }
    }
}
