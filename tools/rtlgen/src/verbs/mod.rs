//! One module per verb of the command line.

use std::io;

use indicatif::{ProgressBar, ProgressStyle};
use rtlgen::design::BuildError;
use rtlgen::verify;

pub(crate) mod build;
pub(crate) mod generate;
pub(crate) mod operators;
pub(crate) mod schedule;
pub(crate) mod simulator;
pub(crate) mod sincos;

/// Why a verb has no result.
#[derive(Debug, thiserror::Error)]
pub(crate) enum Error {
    /// The result reaches no reader.
    #[error("standard output cannot be written")]
    Output(#[from] io::Error),
    /// The options describe no build.
    #[error(transparent)]
    Build(#[from] BuildError),
    /// A check could not be made.
    #[error(transparent)]
    Verify(#[from] verify::Error),
}

/// A bar over a number of `things`: on stderr, and only if it is a terminal.
fn progress_bar(number: u64, things: &str) -> ProgressBar {
    let bar = ProgressBar::new(number);
    let style =
        format!("{{bar:30}} {{human_pos}}/{{human_len}} {things}, {{per_sec}}, {{eta}} left");
    if let Ok(style) = ProgressStyle::with_template(&style) {
        bar.set_style(style);
    }
    bar
}
