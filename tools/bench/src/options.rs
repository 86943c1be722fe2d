//! Options that the benchmarks share.

use clap::{Args, ValueEnum};
use scene::Grid;
use zynq_pgs::order::Order;

/// How to measure, and how to show the result.
#[derive(Debug, Clone, Copy, Args)]
pub struct Common {
    /// Runs of each of the compared items, in turn; medians are shown
    #[arg(
        long,
        value_name = "N",
        default_value_t = 11,
        value_parser = clap::value_parser!(u16).range(1..)
    )]
    runs: u16,
    /// cargo adds this option.
    #[arg(long, hide = true)]
    bench: bool,
}

impl Common {
    /// The number of runs of each item.
    #[must_use]
    pub fn runs(&self) -> usize {
        self.runs.into()
    }
}

/// A pile of the thesis' cubes.
#[derive(Debug, Clone, Copy, Args)]
pub struct Pile {
    /// Cubes along each axis; y is up
    #[arg(long, value_name = "NXxNYxNZ", default_value_t)]
    pub grid: Grid,
    /// Height of the lowest cubes above the ground at the start, m
    #[arg(long, value_name = "H", default_value_t = 0.0)]
    pub drop: f32,
    /// Steps taken on the emulated board
    #[arg(
        long,
        value_name = "N",
        default_value_t = 5,
        value_parser = clap::value_parser!(u32).range(1..)
    )]
    pub steps: u32,
}

impl Pile {
    /// The pile stands on the ground.
    #[must_use]
    pub fn standing(grid: Grid, steps: u32) -> Self {
        Self { grid, drop: 0.0, steps }
    }
}

/// The order in which collisions are packed or sent.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Sent {
    /// As the step has them
    AsGiven,
    /// Far places of the step in turn, for an issue queue
    Interleaved,
    /// Without hazards, near the order of the step
    HazardFree,
}

impl Sent {
    /// The name on the command line.
    #[must_use]
    pub fn name(self) -> String {
        self.to_possible_value().map(|value| value.get_name().to_owned()).unwrap_or_default()
    }

    /// The driver's order, if it is one that has to be made.
    ///
    /// # Errors
    ///
    /// Names the orders that are made if this is none.
    pub fn made(self) -> Result<Order, String> {
        match self {
            Self::AsGiven => Err("--order is interleaved or hazard-free here".to_owned()),
            Self::Interleaved | Self::HazardFree => Ok(self.order()),
        }
    }

    /// The driver's order.
    #[must_use]
    pub const fn order(self) -> Order {
        match self {
            Self::AsGiven => Order::AsGiven,
            Self::Interleaved => Order::Interleaved,
            Self::HazardFree => Order::HazardFree,
        }
    }
}
