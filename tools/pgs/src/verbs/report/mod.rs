//! The verb `report`: writes the thesis' tables and figures again from our own numbers, as a page, as
//! Markdown and as JSON.
//!
//! Its charts come from a library that only this verb needs: it is built with the feature `report`.

#[cfg(feature = "report")]
mod chart;
#[cfg(feature = "report")]
mod document;
#[cfg(feature = "report")]
mod figures;
#[cfg(feature = "report")]
mod page;
#[cfg(feature = "report")]
mod parts;
#[cfg(feature = "report")]
mod step;
#[cfg(feature = "report")]
mod studies;
#[cfg(feature = "report")]
mod tables;
#[cfg(feature = "report")]
mod text;
#[cfg(feature = "report")]
mod write;

use std::io::Write;
use std::path::PathBuf;

use clap::Args;
use scene::Grid;

use crate::common::CommonArgs;
use crate::failure::{Failure, Verdict};
#[cfg(feature = "report")]
use crate::interrupt::Interrupt;

const EXAMPLES: &str = "\
Examples:
  pgs report --out report
  pgs report --out report --quick
  pgs report --out report --input vectors/full_step186

Writes report.html, one page that needs no network, report.md, report.json, and figures/*.svg. With
a folder, rows that need a step of Bullet take its step; without one they take a step of our own
pile, and say so.

The verb is built with the feature report: cargo run --release -p pgs --features report -- report ...";

/// Write the thesis' tables and figures again from our own numbers: a page, Markdown and JSON.
#[derive(Debug, Clone, Args)]
#[command(after_help = EXAMPLES)]
pub(crate) struct ReportArgs {
    /// Folder to write the report into.
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// Take the step from this folder of .npy arrays instead of our own pile.
    #[arg(long, value_name = "DIR", conflicts_with_all = ["grid", "step"])]
    input: Option<PathBuf>,
    /// Fewer seeds and steps: about a minute instead of ten.
    #[arg(long)]
    quick: bool,
    /// Cubes of our own pile along each axis [default: 36x30x36; smaller ones for long studies with
    /// --quick]
    #[arg(long, value_name = "NXxNYxNZ")]
    grid: Option<Grid>,
    /// Step of our own pile that is measured; the steps before it are taken first.
    #[arg(long, value_name = "N", default_value_t = 70, value_parser = clap::value_parser!(u32).range(1..))]
    step: u32,
}

#[cfg(feature = "report")]
impl ReportArgs {
    /// The pile whose step is measured.
    fn pile(&self) -> Grid {
        self.grid.unwrap_or_default()
    }
}

/// Measures, draws and writes.
#[cfg(feature = "report")]
pub(crate) fn run(
    args: &ReportArgs,
    common: &CommonArgs,
    out: &mut dyn Write,
) -> Result<Verdict, Failure> {
    let interrupt = Interrupt::install();
    let report = match parts::gather(args, common, &interrupt) {
        Err(_) if interrupt.is_set() => {
            log::warn!("interrupted: no report was written");
            return Ok(Verdict::Interrupted);
        }
        gathered => gathered?,
    };
    let files = write::write(&args.out, &report)?;
    if common.json {
        writeln!(out, "{:#}", text::json(&report))?;
    } else {
        for file in files {
            writeln!(out, "{}", file.display())?;
        }
    }
    Ok(Verdict::Done)
}

/// Refuses: the charts are not built in.
#[cfg(not(feature = "report"))]
pub(crate) fn run(
    args: &ReportArgs,
    _: &CommonArgs,
    _: &mut dyn Write,
) -> Result<Verdict, Failure> {
    let ReportArgs { out, input, quick, grid, step } = args;
    log::debug!("not built: report --out {out:?}, {input:?}, quick {quick}, {grid:?}, step {step}");
    Err(Failure::input("this pgs was built without the report's charts").next(
        "build it with them: cargo run --release -p pgs --features report -- report --out DIR",
    ))
}
