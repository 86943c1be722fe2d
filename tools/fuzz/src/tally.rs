//! Counts what executions did, so that a campaign without effect shows.

use std::ops::AddAssign;

use bitstream_model::Counts;

/// Counts of one execution or of many.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Tally {
    /// Completed steps.
    pub steps: u64,
    /// Inputs that were rightly refused, or rightly ended with an error.
    pub refused: u64,
    /// Register accesses of the CPU.
    pub registers: u64,
    /// Beats that the DMAs read and wrote, each checked against the grants.
    pub beats: u64,
    /// Completed descriptors: fetched and written back, checked likewise.
    pub descriptors: u64,
    /// Violations that the board recorded, such as accesses outside the grants.
    pub violations: u64,
    /// Injected faults that happened.
    pub faults: u64,
}

impl Tally {
    /// Adds a board's counts.
    pub fn add_board(&mut self, counts: &Counts) {
        self.registers += counts.register_reads + counts.register_writes;
        self.beats += counts.beats_read + counts.beats_written;
        self.descriptors += counts.descriptors;
        self.violations += counts.violations;
    }
}

impl AddAssign for Tally {
    fn add_assign(&mut self, other: Self) {
        self.steps += other.steps;
        self.refused += other.refused;
        self.registers += other.registers;
        self.beats += other.beats;
        self.descriptors += other.descriptors;
        self.violations += other.violations;
        self.faults += other.faults;
    }
}
