//! All experiments at once: the thesis' tables and figures as a page, as Markdown and as JSON.

mod page;
mod parts;
mod text;
mod write;

use std::io::Write;
use std::path::{Path, PathBuf};

use clap::Args;
use pgs_command::common::CommonArgs;
use pgs_command::failure::{Failure, Result, Verdict};
use pgs_command::interrupt::Interrupt;
use pgs_command::output::files::Files;
use scene::Grid;

/// Options of all experiments together.
#[derive(Debug, Clone, Args)]
pub(crate) struct AllArgs {
    /// Run all experiments, and write their page into the folder of --out.
    #[arg(long, requires = "out")]
    all: bool,
    /// Folder to write the page into.
    #[arg(long, value_name = "DIR", requires = "all")]
    out: Option<PathBuf>,
    /// Take the step from this folder of .npy arrays instead of our own pile.
    #[arg(long, value_name = "DIR", requires = "all", conflicts_with_all = ["grid", "step"])]
    input: Option<PathBuf>,
    /// Fewer seeds and steps: about a minute instead of ten.
    #[arg(long, requires = "all")]
    quick: bool,
    /// Cubes of our own pile along each axis [default: 36x30x36; smaller ones for long studies with
    /// --quick]
    #[arg(long, value_name = "NXxNYxNZ", requires = "all")]
    grid: Option<Grid>,
    /// Step of our own pile that is measured; the steps before it are taken first.
    #[arg(
        long,
        value_name = "N",
        requires = "all",
        default_value_t = 70,
        value_parser = clap::value_parser!(u32).range(1..)
    )]
    step: u32,
}

impl AllArgs {
    /// Whether all experiments run.
    pub(crate) const fn is_asked(&self) -> bool {
        self.all
    }

    /// The pile whose step is measured.
    fn pile(&self) -> Grid {
        self.grid.unwrap_or_default()
    }
}

/// Measures, draws and writes.
pub(crate) fn run(args: &AllArgs, common: &CommonArgs, out: &mut dyn Write) -> Result<Verdict> {
    let folder = args.out.as_deref().ok_or_else(|| Failure::input("--all needs --out"))?;
    let read = args.input.as_deref().unwrap_or(Path::new(""));
    Files::of(common).write(write::named(folder)).read_folder(read, |_| false).check()?;
    write::check(folder)?;
    let interrupt = Interrupt::install();
    let report = match parts::gather(args, common, &interrupt) {
        Err(_) if interrupt.is_set() => {
            log::warn!("interrupted: no report was written");
            return Ok(Verdict::Interrupted);
        }
        gathered => gathered?,
    };
    let files = write::write(folder, &report)?;
    if common.json {
        writeln!(out, "{:#}", text::json(&report))?;
    } else {
        for file in files {
            writeln!(out, "{}", file.display())?;
        }
    }
    Ok(Verdict::Done)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::command::tests::parsed;

    /// A grid that `gather` refuses at once: an earlier refusal came before it.
    const TOO_LARGE: &str = "--grid 60x60x60";

    fn failure(out: &std::path::Path, options: &str) -> Failure {
        let line = format!("pgs thesis --all --out {} {options}", out.display());
        let args = parsed(&line).expect("words");
        args.run(&CommonArgs::emulated(), &mut Vec::new()).expect_err("a refusal")
    }

    #[test]
    fn a_folder_that_cannot_be_written_is_refused_before_anything_is_measured() {
        let folder = tempfile::tempdir().expect("a folder");
        let file = folder.path().join("file");
        std::fs::write(&file, "no folder").expect("written");
        let taken = folder.path().join("taken");
        std::fs::create_dir_all(taken.join("thesis.html")).expect("a folder with the file's name");
        for out in [&file, &file.join("below"), &taken] {
            let failure = failure(out, TOO_LARGE);
            let path = out.to_str().expect("text");
            assert!(failure.chain().contains(path), "{}", failure.chain());
            let mut said = Vec::new();
            let _ = failure.report(&mut said);
            let said = String::from_utf8(said).expect("text");
            assert!(said.contains("--out") && !said.contains("--grid"), "{said}");
        }
        let failure = failure(&folder.path().join("new"), TOO_LARGE);
        assert!(failure.chain().contains("bodies with the ground"), "{}", failure.chain());
    }

    /// The arrays of `--input` are read while the page is written.
    #[test]
    fn a_file_of_the_page_that_is_an_input_is_refused_before_anything_is_measured() {
        let folder = tempfile::tempdir().expect("a folder");
        let [input, out] = ["input", "out"].map(|name| folder.path().join(name));
        std::fs::create_dir_all(out.join("figures")).expect("a folder");
        std::fs::create_dir(&input).expect("a folder");
        std::fs::write(input.join("a.npy"), "read").expect("written");
        let options = format!("--input {}", input.display());
        for file in ["thesis.json", "figures/figure.svg"] {
            std::fs::hard_link(input.join("a.npy"), out.join(file)).expect("a link");
            let said = failure(&out, &options).chain();
            assert!(said.contains(file) && said.contains(" are one file"), "{said}");
            std::fs::remove_file(out.join(file)).expect("removed");
        }
        let refused = failure(&out, &options);
        assert!(refused.chain().contains(".npy"), "{}", refused.chain());
    }

    #[test]
    fn a_grid_that_no_board_takes_is_refused_before_it_is_built() {
        let folder = tempfile::tempdir().expect("a folder");
        for grid in ["180x1000x180", "60x60x60"] {
            let failure = failure(folder.path(), &format!("--grid {grid}"));
            assert!(failure.chain().contains("bodies with the ground"), "{}", failure.chain());
        }
    }
}
