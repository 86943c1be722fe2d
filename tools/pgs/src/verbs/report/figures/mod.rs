//! The figures of the thesis, drawn again from our own numbers; one file for each subject.

pub(super) mod designs;
pub(super) mod euler;
pub(super) mod formats;
pub(super) mod half;
pub(super) mod live;
pub(super) mod orders;
pub(super) mod separation;
