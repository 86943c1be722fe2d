//! Beats to results: the stripes of the channels, joined and read.

pub(crate) mod results;
pub(crate) mod stripe_reader;
