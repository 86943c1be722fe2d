//! Experiments that step a board, and measure again a claim of the thesis.

pub(crate) mod course;
pub(crate) mod determinism;
pub(crate) mod given;
pub(crate) mod half;
pub(crate) mod ladder;
pub(crate) mod pile;
pub(crate) mod recorded;
pub(crate) mod split;
mod spread;
pub(crate) mod stages;
pub(crate) mod start;
pub(crate) mod step;
pub(crate) mod stopping;
pub(crate) mod time_step;
mod words;
