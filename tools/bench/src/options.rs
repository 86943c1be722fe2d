//! Options that the benchmarks share.

use clap::Args;
use scene::Grid;

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
