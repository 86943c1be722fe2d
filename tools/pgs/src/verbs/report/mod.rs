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
mod place;
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
#[cfg(feature = "report")]
use std::path::Path;
use std::path::PathBuf;

use clap::Args;
use scene::Grid;

use crate::common::CommonArgs;
use crate::failure::{Failure, Verdict};
#[cfg(feature = "report")]
use crate::interrupt::Interrupt;
#[cfg(feature = "report")]
use crate::output::files::Files;

const EXAMPLES: &str = "\
Examples:
  pgs report --out report
  pgs report --out report --quick
  pgs report --out report --quick --input tests/golden/pile5_step60

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
    let read = args.input.as_deref().unwrap_or(Path::new(""));
    Files::of(common).write(write::named(&args.out)).read_folder(read, |_| false).check()?;
    write::check(&args.out)?;
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

#[cfg(all(test, feature = "report"))]
mod tests {
    use super::*;
    use crate::cli;
    use crate::verbs::Verb;

    /// Reports a board that `gather` refuses at once: an earlier refusal came before it.
    fn failure(out: &std::path::Path, options: &str) -> Failure {
        let out = out.to_str().expect("text");
        let words = ["pgs", "report", "--out", out].into_iter().chain(options.split_whitespace());
        let command = cli::parse(words, |_| None).expect("words");
        let Verb::Report(args) = &command.verb else { panic!("{command:?}") };
        run(args, &command.common, &mut Vec::new()).expect_err("a refusal")
    }

    #[test]
    fn a_folder_that_cannot_be_written_is_refused_before_anything_is_measured() {
        let folder = tempfile::tempdir().expect("a folder");
        let file = folder.path().join("file");
        std::fs::write(&file, "no folder").expect("written");
        let taken = folder.path().join("taken");
        std::fs::create_dir_all(taken.join("report.html")).expect("a folder with the file's name");
        for out in [&file, &file.join("below"), &taken] {
            let failure = failure(out, "--board uio");
            let path = out.to_str().expect("text");
            assert!(failure.chain().contains(path), "{}", failure.chain());
            let mut said = Vec::new();
            let _ = failure.report(&mut said);
            let said = String::from_utf8(said).expect("text");
            assert!(said.contains("--out") && !said.contains("--board"), "{said}");
        }
        let failure = failure(&folder.path().join("new"), "--board uio");
        assert!(failure.chain().contains("the emulated board"), "{}", failure.chain());
    }

    /// The arrays of `--input` are read while the report is written.
    #[test]
    fn a_file_of_the_report_that_is_an_input_is_refused_before_anything_is_measured() {
        let folder = tempfile::tempdir().expect("a folder");
        let [input, out] = ["input", "out"].map(|name| folder.path().join(name));
        std::fs::create_dir_all(out.join("figures")).expect("a folder");
        std::fs::create_dir(&input).expect("a folder");
        std::fs::write(input.join("a.npy"), "read").expect("written");
        let options = format!("--board uio --input {}", input.display());
        for file in ["report.json", "figures/figure.svg"] {
            std::fs::hard_link(input.join("a.npy"), out.join(file)).expect("a link");
            let said = failure(&out, &options).chain();
            assert!(said.contains(file) && said.contains(" are one file"), "{said}");
            std::fs::remove_file(out.join(file)).expect("removed");
        }
        assert!(failure(&out, &options).chain().contains("the emulated board"));
    }

    #[test]
    fn a_grid_that_no_board_takes_is_refused_before_it_is_built() {
        let folder = tempfile::tempdir().expect("a folder");
        for grid in ["180x1000x180", "60x60x60"] {
            let failure = failure(folder.path(), &format!("--board emulated --grid {grid}"));
            assert!(failure.chain().contains("bodies with the ground"), "{}", failure.chain());
        }
    }
}
