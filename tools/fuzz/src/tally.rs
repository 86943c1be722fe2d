//! This file counts what executions did, so that a campaign that did nothing shows.

use std::ops::AddAssign;

use bitstream_model::Counts;

/// What was done, by one execution or by many.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Tally {
    /// Steps that were completed.
    pub steps: u64,
    /// Inputs that were refused, or ended with an error, as they should be.
    pub refused: u64,
    /// Register accesses of the CPU.
    pub registers: u64,
    /// Beats that the DMAs read and wrote, each checked against what they were granted.
    pub beats: u64,
    /// Descriptors that were completed: fetched and written back, checked likewise.
    pub descriptors: u64,
    /// Accesses outside what was granted, and other wrong-doings, recorded by the board.
    pub violations: u64,
    /// Faults that the board had as it was told.
    pub faults: u64,
}

impl Tally {
    /// Adds what happened on a board.
    pub fn add_board(&mut self, counts: &Counts) {
        self.registers += counts.register_reads + counts.register_writes;
        self.beats += counts.beats_read + counts.beats_written;
        self.descriptors += counts.descriptors;
        self.violations += counts.violations;
    }

    /// Name and value of each count.
    #[must_use]
    pub fn entries(&self) -> [(&'static str, u64); 7] {
        [
            ("steps", self.steps),
            ("refused", self.refused),
            ("registers", self.registers),
            ("beats", self.beats),
            ("descriptors", self.descriptors),
            ("violations", self.violations),
            ("faults", self.faults),
        ]
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
