//! Instructions that packing uses: conversions to sixteen bits and back, sums, and prefetch.

mod halves;
mod prefetch;
mod sum;

pub(crate) use halves::{narrow, widen};
pub(crate) use prefetch::{prefetch, prefetch_at};
pub(crate) use sum::Sum;
