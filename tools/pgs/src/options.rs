//! This file holds the options of the emulated board and of a step, and how they are written on the
//! command line.

use std::time::Duration;

use bitstream_model::{Bandwidth, BoardConfig, Hazards, Subnormals};
use clap::{Args, ValueEnum};
use zynq_pgs::StepParameters;

/// How the emulated board is built; a real board is as its bitstream is.
#[derive(Debug, Clone, Copy, Default, Args)]
#[command(next_help_heading = "Emulated board")]
pub(crate) struct BuildArgs {
    /// On a hazard, wait for the velocity or read the stale one [default: interlocked]
    #[arg(long)]
    hazards: Option<HazardsName>,
    /// Hazard window in issue slots [default: that of the profile]
    #[arg(long, value_name = "SLOTS", value_parser = clap::value_parser!(u32).range(1..))]
    window: Option<u32>,
    /// Keep subnormal numbers or flush them to zero [default: keep]
    #[arg(long)]
    subnormals: Option<SubnormalsName>,
    /// Memory bandwidth in GB/s, or "unlimited" [default: 12.8]
    #[arg(long, value_name = "GBPS", value_parser = bandwidth)]
    bandwidth: Option<Bandwidth>,
    /// Width of the DMA length registers in bits, 8 to 26 [default: 26]
    #[arg(long, value_name = "BITS", value_parser = clap::value_parser!(u32).range(8..=26))]
    length_width: Option<u32>,
    /// Width of DMA addresses in bits, 32 to 64 [default: 40]
    #[arg(long, value_name = "BITS", value_parser = clap::value_parser!(u32).range(32..=64))]
    address_width: Option<u32>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum HazardsName {
    Interlocked,
    Unchecked,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum SubnormalsName {
    Keep,
    Flush,
}

impl BuildArgs {
    /// The first option that was given.
    pub(crate) fn given(&self) -> Option<&'static str> {
        [
            ("--hazards", self.hazards.is_some()),
            ("--window", self.window.is_some()),
            ("--subnormals", self.subnormals.is_some()),
            ("--bandwidth", self.bandwidth.is_some()),
            ("--length-width", self.length_width.is_some()),
            ("--address-width", self.address_width.is_some()),
        ]
        .into_iter()
        .find_map(|(name, given)| given.then_some(name))
    }

    /// The board that they describe.
    pub(crate) fn config(&self) -> BoardConfig {
        let default = BoardConfig::default();
        BoardConfig {
            hazards: match self.hazards {
                None => default.hazards,
                Some(HazardsName::Interlocked) => Hazards::Interlocked,
                Some(HazardsName::Unchecked) => Hazards::Unchecked,
            },
            window_slots: self.window,
            subnormals: match self.subnormals {
                None => default.subnormals,
                Some(SubnormalsName::Keep) => Subnormals::Keep,
                Some(SubnormalsName::Flush) => Subnormals::Flush,
            },
            bandwidth: self.bandwidth.unwrap_or(default.bandwidth),
            length_width: self.length_width.unwrap_or(default.length_width),
            address_width: self.address_width.unwrap_or(default.address_width),
            ..default
        }
    }
}

/// How long a step may take on the board.
#[derive(Debug, Clone, Copy, Default, Args)]
pub(crate) struct DeadlineArgs {
    /// How long a step may take on the board, ms [default: 10, and four times what its collisions
    /// take one after the other]
    #[arg(long, value_name = "MS", value_parser = clap::value_parser!(u32).range(1..=3_600_000))]
    deadline: Option<u32>,
}

impl DeadlineArgs {
    /// The same parameters with this deadline.
    pub(crate) fn apply(self, mut parameters: StepParameters) -> StepParameters {
        if let Some(milliseconds) = self.deadline {
            parameters.deadline = Some(Duration::from_millis(milliseconds.into()));
        }
        parameters
    }
}

const BYTES_PER_GB: f64 = 1e9;
/// Faster than any memory; beyond it a typing error is likelier.
const BANDWIDTH_MAX: f64 = 1000.0;
/// Slower than any memory.
const BANDWIDTH_MIN: f64 = 0.1;

/// A bandwidth, as it is written on the command line.
pub(crate) fn bandwidth(text: &str) -> Result<Bandwidth, String> {
    if text == "unlimited" {
        return Ok(Bandwidth::Unlimited);
    }
    let wrong = || {
        format!(
            "expected a number of GB/s from {BANDWIDTH_MIN} to {BANDWIDTH_MAX}, or \"unlimited\""
        )
    };
    let number: f64 = text.parse().map_err(|_| wrong())?;
    if !(BANDWIDTH_MIN..=BANDWIDTH_MAX).contains(&number) {
        return Err(wrong());
    }
    #[allow(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "a whole number between 1e6 and 1e12 after the check"
    )]
    let rate = (number * BYTES_PER_GB).round() as u64;
    Ok(Bandwidth::BytesPerSecond(rate))
}

/// A bandwidth for people.
pub(crate) fn bandwidth_text(bandwidth: Bandwidth) -> String {
    match bandwidth {
        Bandwidth::Unlimited => "unlimited".to_owned(),
        Bandwidth::BytesPerSecond(rate) => format!("{} GB/s", rate as f64 / BYTES_PER_GB),
    }
}

/// A bandwidth for programs: bytes a second, or null.
pub(crate) fn bandwidth_number(bandwidth: Bandwidth) -> Option<u64> {
    match bandwidth {
        Bandwidth::Unlimited => None,
        Bandwidth::BytesPerSecond(rate) => Some(rate),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bandwidths_are_read_as_they_are_shown() {
        assert_eq!(bandwidth("12.8"), Ok(Bandwidth::ZCU102_SUSTAINED));
        assert_eq!(bandwidth("17.07"), Ok(Bandwidth::ZCU102_PEAK));
        assert_eq!(bandwidth("unlimited"), Ok(Bandwidth::Unlimited));
        assert_eq!(bandwidth_text(Bandwidth::ZCU102_SUSTAINED), "12.8 GB/s");
        for wrong in ["", "0", "-1", "nan", "inf", "1e9", "12.8GB", "Unlimited"] {
            bandwidth(wrong).expect_err(wrong);
        }
    }

    #[test]
    fn no_option_is_the_default_board() {
        assert_eq!(BuildArgs::default().config(), BoardConfig::default());
        assert_eq!(BuildArgs::default().given(), None);
    }
}
