//! This file is what was asked for: a step, profiles, bandwidths.

use bitstream_model::Bandwidth;
use bitstream_model::estimate::{StepShape, thesis};
use bitstream_model::interface::profile::Variant;

use super::report::Cell;

/// What the tables are about.
#[derive(Debug, Clone)]
pub(super) struct Scene {
    pub(super) step: StepShape,
    pub(super) variants: Vec<Variant>,
    pub(super) bandwidths: Vec<Bandwidth>,
}

impl Scene {
    /// Whether it is the step of the thesis, so that its figures can be held against ours.
    pub(super) fn is_thesis_step(&self) -> bool {
        self.step == StepShape::new(thesis::BODIES, thesis::COLLISIONS)
    }

    /// By how much ours is off the thesis', percent.
    pub(super) fn difference(&self, ours: f64, thesis: f64) -> Cell {
        if self.is_thesis_step() { difference(ours, thesis) } else { Cell::Missing }
    }
}

/// By how much a figure is off another one, percent.
pub(super) fn difference(ours: f64, theirs: f64) -> Cell {
    Cell::Difference((ours / theirs - 1.0) * 100.0)
}

pub(super) fn mib(bytes: u64) -> f64 {
    bytes as f64 / f64::from(1 << 20)
}

/// MiB with the two digits that the thesis prints: what rounds to them is the same figure.
pub(super) fn printed_mib(bytes: u64) -> f64 {
    (mib(bytes) * 100.0).round() / 100.0
}

pub(super) fn yes_or_no(yes: bool) -> &'static str {
    if yes { "yes" } else { "no" }
}
