//! Experiments that step a board, and measure again a claim of the thesis.

pub(crate) mod determinism;
pub(crate) mod given;
pub(crate) mod half;
pub(crate) mod ladder;
pub(crate) mod pile;
pub(crate) mod recorded;
pub(crate) mod run;
pub(crate) mod split;
mod spread;
pub(crate) mod stages;
mod start;
pub(crate) mod stopping;
pub(crate) mod time_step;
