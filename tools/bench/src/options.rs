//! This file holds the options that the benchmarks share.

use clap::{Args, ValueEnum};
use scene::Grid;
use zynq_pgs::order::Order;

/// How it is measured and shown.
#[derive(Debug, Clone, Copy, Args)]
pub struct Common {
    /// Runs of each of the things compared, in turn; medians are shown
    #[arg(long, value_name = "N", default_value_t = 11, value_parser = clap::value_parser!(u16).range(1..))]
    runs: u16,
    /// One JSON document, for programs
    #[arg(long)]
    pub json: bool,
    /// What cargo adds.
    #[arg(long, hide = true)]
    bench: bool,
}

impl Common {
    /// Runs of each.
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
    #[arg(long, value_name = "N", default_value_t = 5, value_parser = clap::value_parser!(u32).range(1..))]
    pub steps: u32,
}

impl Pile {
    /// Standing on the ground.
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
    /// Without hazards, swept through the scene
    HazardFree,
    /// Without hazards, about where the step has them
    HazardFreeNearby,
}

impl Sent {
    /// As it is written on the command line.
    #[must_use]
    pub fn name(self) -> String {
        self.to_possible_value().map(|value| value.get_name().to_owned()).unwrap_or_default()
    }

    /// One without hazards, as the driver calls it.
    ///
    /// # Errors
    /// If it is none, which to ask for.
    pub fn without_hazards(self) -> Result<Order, String> {
        match self {
            Self::AsGiven => Err("--order is hazard-free or hazard-free-nearby here".to_owned()),
            Self::HazardFree | Self::HazardFreeNearby => Ok(self.order()),
        }
    }

    /// As the driver calls it.
    #[must_use]
    pub const fn order(self) -> Order {
        match self {
            Self::AsGiven => Order::AsGiven,
            Self::HazardFree => Order::HazardFree,
            Self::HazardFreeNearby => Order::HazardFreeNearby,
        }
    }
}
