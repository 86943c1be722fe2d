//! The values of a build's options: names, numbers and their ranges.

use std::fmt::Display;
use std::str::FromStr;

use bitstream_model::{Bandwidth, Hazards, THREADS_MAX};
use pgs_interface::axi_dma::{LENGTH_WIDTH_MAX, LENGTH_WIDTH_MIN};
use pgs_interface::control::QUEUE_MAX;
use pgs_interface::fence::{Fence, NoFence};
use pgs_interface::number::Precision;
use pgs_interface::profile::Inertia;

/// A value with its name.
type Named<T> = (&'static str, T);

pub(super) const PRECISIONS: [Named<Precision>; 2] =
    [(Precision::F32.name(), Precision::F32), (Precision::Binary16.name(), Precision::Binary16)];
pub(super) const HAZARDS: [Named<Hazards>; 2] =
    [("interlocked", Hazards::Interlocked), ("unchecked", Hazards::Unchecked)];
pub(super) const INERTIA: [Named<Inertia>; 2] =
    [("isotropic", Inertia::Isotropic), ("world", Inertia::World)];
pub(super) const SWITCH: [Named<bool>; 2] = [("on", true), ("off", false)];

/// The value of a name; the error has the expected names.
pub(super) fn named<T: Copy>(table: &[Named<T>], text: &str) -> Result<T, String> {
    let found = table.iter().find(|(name, _)| *name == text);
    found.map(|(_, value)| *value).ok_or_else(|| {
        let names: Vec<&str> = table.iter().map(|(name, _)| *name).collect();
        names.join(" or ")
    })
}

/// The name of a value, if it has one.
pub(super) fn name_of<T: PartialEq>(table: &[Named<T>], value: &T) -> Option<&'static str> {
    table.iter().find(|(_, other)| other == value).map(|(name, _)| *name)
}

/// Reads the depth of an issue queue.
pub(super) fn queue(text: &str) -> Result<u32, String> {
    whole(text, 0, QUEUE_MAX)
}

/// Reads a number of issue slots.
pub(super) fn window(text: &str) -> Result<u32, String> {
    whole(text, 1, u32::MAX)
}

/// Reads a number of threads.
pub(super) fn threads(text: &str) -> Result<usize, String> {
    whole(text, 1, THREADS_MAX)
}

/// Reads the width of a length register, bits.
pub(super) fn length_width(text: &str) -> Result<u32, String> {
    whole(text, LENGTH_WIDTH_MIN, LENGTH_WIDTH_MAX)
}

/// Reads the width of an address, bits.
pub(super) fn address_width(text: &str) -> Result<u32, String> {
    whole(text, 32, 64)
}

/// Reads a fence.
pub(super) fn fence(text: &str) -> Result<Fence, String> {
    text.parse().map_err(|expected: NoFence| expected.to_string())
}

fn whole<T: Copy + FromStr + PartialOrd + Display>(
    text: &str,
    low: T,
    high: T,
) -> Result<T, String> {
    match text.parse() {
        Ok(number) if (low..=high).contains(&number) => Ok(number),
        _ => Err(format!("a whole number from {low} to {high}")),
    }
}

const UNLIMITED: &str = "unlimited";
const BYTES_PER_GB: f64 = 1e9;
/// Faster than any memory, GB/s: a larger number is a typing error.
const BANDWIDTH_MAX: f64 = 1000.0;
/// Slower than any memory, GB/s.
const BANDWIDTH_MIN: f64 = 0.1;

/// Reads a bandwidth in GB/s.
pub(super) fn bandwidth(text: &str) -> Result<Bandwidth, String> {
    if text == UNLIMITED {
        return Ok(Bandwidth::Unlimited);
    }
    let number = text.parse().ok().filter(|rate| (BANDWIDTH_MIN..=BANDWIDTH_MAX).contains(rate));
    let number = number.ok_or_else(|| {
        format!("a number of GB/s from {BANDWIDTH_MIN} to {BANDWIDTH_MAX}, or {UNLIMITED:?}")
    })?;
    #[allow(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "a whole number between 1e8 and 1e12 after the check"
    )]
    let rate = (number * BYTES_PER_GB).round() as u64;
    Ok(Bandwidth::BytesPerSecond(rate))
}

/// Writes a bandwidth in GB/s.
pub(super) fn bandwidth_text(bandwidth: Bandwidth) -> String {
    match bandwidth {
        Bandwidth::Unlimited => UNLIMITED.to_owned(),
        Bandwidth::BytesPerSecond(rate) => (rate as f64 / BYTES_PER_GB).to_string(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bandwidths_are_read_as_they_are_written() {
        assert_eq!(bandwidth("12.8"), Ok(Bandwidth::ZCU102_SUSTAINED));
        assert_eq!(bandwidth("17.07"), Ok(Bandwidth::ZCU102_PEAK));
        assert_eq!(bandwidth("unlimited"), Ok(Bandwidth::Unlimited));
        assert_eq!(bandwidth_text(Bandwidth::ZCU102_SUSTAINED), "12.8");
        for wrong in ["", "0", "-1", "nan", "inf", "1e9", "12.8GB", "Unlimited"] {
            bandwidth(wrong).expect_err(wrong);
        }
    }
}
