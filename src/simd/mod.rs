//! Vectors of the packing loops: four words of a beat, wide loops, halves, prefetch.

pub(crate) mod halves;
pub(crate) mod lanes;
pub(crate) mod prefetch;
pub(crate) mod vectors;

pub(crate) use halves::Narrow;
pub(crate) use lanes::{Integer, Lanes};
pub(crate) use prefetch::{
    fetch, later_with_those_behind, prefetch, soon_alone, soon_with_those_behind,
};
pub(crate) use vectors::{Vectors, Work, in_wide_vectors};
