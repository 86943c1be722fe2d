//! The figures of the thesis, drawn again from our own numbers; one file for each subject.

pub(super) mod designs;
pub(super) mod euler;
pub(super) mod formats;
pub(super) mod half;
pub(super) mod ladder;
pub(super) mod live;
pub(super) mod orders;
pub(super) mod pile;
pub(super) mod separation;
pub(super) mod solver;
pub(super) mod stages;
pub(super) mod time_step;
