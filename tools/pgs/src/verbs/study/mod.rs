//! The verb `study`: measures again the claims of the thesis.
//!
//! Each study is a function from its options to its outcome, which other verbs can call, and a part
//! that shows the outcome.

pub(crate) mod determinism;
pub(crate) mod half;
pub(crate) mod ladder;
pub(crate) mod recorded;
mod run;
mod session;
pub(crate) mod split;
mod spread;
mod start;
pub(crate) mod stopping;
pub(crate) mod time_step;

use std::io::Write;

use clap::{Args, Subcommand};
use serde::Serialize;
use serde_json::Value;

pub(crate) use self::session::Session;
use crate::common::CommonArgs;
use crate::failure::{Failure, Verdict};
use crate::output::SCHEMA;

const EXAMPLES: &str = "\
Examples:
  pgs study time-step
  pgs study stopping --input tests/golden/pile5_step60
  pgs study split
  pgs study determinism --input tests/golden/pile5_step60
  pgs study half --input tests/golden/pile5_step60
  pgs study ladder --json

`pgs study NAME --help` tells how each one measures.";

/// The last line of an outcome that Ctrl-C has cut short.
const INTERRUPTED: &str = "interrupted: the figures are of the steps before Ctrl-C";

/// Measure again the claims of the thesis: time steps, stopping rules, orders, number formats, the
/// shares of a step, and the ladder of designs.
#[derive(Debug, Clone, Args)]
#[command(after_help = EXAMPLES)]
pub(crate) struct StudyArgs {
    #[command(subcommand)]
    study: Study,
}

/// A study and its options.
#[derive(Debug, Clone, Subcommand)]
enum Study {
    TimeStep(time_step::Options),
    Stopping(stopping::Options),
    Split(split::Options),
    Determinism(determinism::Options),
    Half(half::Options),
    Ladder(ladder::Options),
}

/// Measures and shows the outcome.
pub(crate) fn run(
    args: &StudyArgs,
    common: &CommonArgs,
    out: &mut dyn Write,
) -> Result<Verdict, Failure> {
    within(&args.study, &Session::new(common), out)
}

/// Measures and shows the outcome, as the session's Ctrl-C leaves it.
fn within(study: &Study, session: &Session, out: &mut dyn Write) -> Result<Verdict, Failure> {
    let common = &session.common;
    let complete = match study {
        Study::TimeStep(options) => {
            let outcome = time_step::measure(options, session)?;
            match common.json {
                true => write(out, "time-step", &outcome)?,
                false => time_step::show(&outcome, out)?,
            }
            outcome.complete
        }
        Study::Stopping(options) => {
            let outcome = stopping::measure(options, session)?;
            match common.json {
                true => write(out, "stopping", &outcome)?,
                false => stopping::show(&outcome, out)?,
            }
            outcome.complete
        }
        Study::Split(options) => {
            let outcome = split::measure(options, session)?;
            match common.json {
                true => write(out, "split", &outcome)?,
                false => split::show(&outcome, out)?,
            }
            outcome.complete
        }
        Study::Determinism(options) => {
            let outcome = determinism::measure(options, session)?;
            match common.json {
                true => write(out, "determinism", &outcome)?,
                false => determinism::show(&outcome, out)?,
            }
            outcome.complete
        }
        Study::Half(options) => {
            let outcome = half::measure(options, session)?;
            match common.json {
                true => write(out, "half", &outcome)?,
                false => half::show(&outcome, out)?,
            }
            outcome.complete
        }
        Study::Ladder(options) => {
            let outcome = ladder::measure(options);
            match common.json {
                true => write(out, "ladder", &outcome)?,
                false => ladder::show(&outcome, out)?,
            }
            true
        }
    };
    if complete {
        return Ok(Verdict::Done);
    }
    // The document has the member `complete`.
    if !common.json {
        writeln!(out, "{INTERRUPTED}")?;
    }
    Ok(Verdict::Interrupted)
}

/// Writes the document for programs.
fn write(out: &mut dyn Write, study: &str, outcome: &impl Serialize) -> Result<(), Failure> {
    let mut document = serde_json::to_value(outcome).map_err(Failure::input)?;
    document["schema"] = SCHEMA.into();
    document["verb"] = "study".into();
    document["study"] = Value::from(study);
    Ok(writeln!(out, "{document:#}")?)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cli;
    use crate::interrupt::Interrupt;
    use crate::verbs::Verb;
    use indicatif::ProgressBar;

    #[test]
    fn every_study_says_once_that_ctrl_c_has_cut_it_short() {
        for words in [
            "time-step --grid 2x2x2",
            "stopping --grid 2x2x2",
            "split --grid 2x2x2",
            "determinism --grid 2x2x2",
            "half --grid 2x2x2 --build half",
        ] {
            let words = ["pgs", "study"].into_iter().chain(words.split_whitespace());
            let command =
                cli::parse(words.chain(["--board", "emulated"]), |_| None).expect("words");
            let Verb::Study(args) = &command.verb else { panic!("{command:?}") };
            let interrupt = Interrupt::install();
            interrupt.cancellation().cancel();
            let session = Session::within(&command.common, interrupt, ProgressBar::hidden());
            let mut out = Vec::new();
            let verdict = within(&args.study, &session, &mut out).expect("an outcome");
            let text = String::from_utf8(out).expect("text");
            assert_eq!(verdict, Verdict::Interrupted, "{text}");
            assert_eq!(text.matches("interrupted: ").count(), 1, "{text}");
            assert!(text.ends_with(&format!("{INTERRUPTED}\n")), "{text}");
        }
    }
}
