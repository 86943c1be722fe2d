//! The verb `study`: answers one question of the thesis with a series of runs or of models.

mod emulated;
pub(crate) mod ladder;

use std::io::{self, Write};

use clap::{Args, Subcommand};
use indicatif::ProgressBar;
use serde::Serialize;
use serde_json::Value;

use crate::common::{BoardName, CommonArgs};
use crate::failure::{Cause, Failure, Verdict};
use crate::output::SCHEMA;

const EXAMPLES: &str = "\
Examples:
  pgs study ladder                     each design of the thesis, and its factor on the one before";

/// Answer one question of the thesis with a series of runs or of models.
#[derive(Debug, Clone, Args)]
#[command(after_help = EXAMPLES)]
pub(crate) struct StudyArgs {
    #[command(subcommand)]
    study: Study,
}

/// A study and its options.
#[derive(Debug, Clone, Subcommand)]
enum Study {
    Ladder(ladder::Options),
}

/// Measures, and shows the outcome.
pub(crate) fn run(
    args: &StudyArgs,
    common: &CommonArgs,
    out: &mut dyn Write,
) -> Result<Verdict, Failure> {
    if !matches!(common.board, BoardName::Auto | BoardName::Emulated) {
        let error = "`pgs study` builds its boards itself and cannot use a real one";
        return Err(Failure::input(error).next("leave out --board"));
    }
    let progress = emulated::bar();
    let json = common.json;
    match &args.study {
        Study::Ladder(options) => answer(
            "ladder",
            json,
            ladder::measure(options, &progress),
            &progress,
            ladder::show,
            out,
        ),
    }
}

/// Writes an outcome as a document or as text.
fn answer<O: Serialize>(
    study: &str,
    json: bool,
    outcome: Result<O, Failure>,
    progress: &ProgressBar,
    show: fn(&O, &mut dyn Write) -> io::Result<()>,
    out: &mut dyn Write,
) -> Result<Verdict, Failure> {
    progress.finish_and_clear();
    let outcome = outcome?;
    if json {
        let mut document =
            serde_json::to_value(&outcome).map_err(|error| Failure::new(Cause::Output, error))?;
        if let Value::Object(keys) = &mut document {
            keys.insert("schema".to_owned(), SCHEMA.into());
            keys.insert("verb".to_owned(), "study".into());
            keys.insert("study".to_owned(), study.into());
        }
        writeln!(out, "{document:#}")?;
    } else {
        show(&outcome, out)?;
    }
    Ok(Verdict::Done)
}
