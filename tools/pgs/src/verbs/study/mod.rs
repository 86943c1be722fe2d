//! The verb `study`: measures again the claims of the thesis' fourth chapter.
//!
//! Each study is a function from its options to its outcome, which other verbs can call, and a part
//! that shows the outcome.

pub(crate) mod determinism;
pub(crate) mod half;
mod recorded;
mod run;
mod session;
mod spread;
mod start;

use std::io::Write;

use clap::{Args, Subcommand};
use serde::Serialize;
use serde_json::Value;

pub(crate) use self::session::Session;
use crate::common::CommonArgs;
use crate::failure::{Failure, Verdict};
use crate::output::SCHEMA;

/// Measure again the claims of the thesis' chapter 4: how far orders and number formats lead apart.
#[derive(Debug, Clone, Args)]
pub(crate) struct StudyArgs {
    #[command(subcommand)]
    study: Study,
}

/// A study and its options.
#[derive(Debug, Clone, Subcommand)]
enum Study {
    Determinism(determinism::Options),
    Half(half::Options),
}

/// Measures and shows the outcome.
pub(crate) fn run(
    args: &StudyArgs,
    common: &CommonArgs,
    out: &mut dyn Write,
) -> Result<Verdict, Failure> {
    let session = Session::new(common);
    let complete = match &args.study {
        Study::Determinism(options) => {
            let outcome = determinism::measure(options, &session)?;
            match common.json {
                true => write(out, "determinism", &outcome)?,
                false => determinism::show(&outcome, out)?,
            }
            outcome.complete
        }
        Study::Half(options) => {
            let outcome = half::measure(options, &session)?;
            match common.json {
                true => write(out, "half", &outcome)?,
                false => half::show(&outcome, out)?,
            }
            outcome.complete
        }
    };
    Ok(if complete { Verdict::Done } else { Verdict::Interrupted })
}

/// Writes the document for programs.
fn write(out: &mut dyn Write, study: &str, outcome: &impl Serialize) -> Result<(), Failure> {
    let mut document = serde_json::to_value(outcome).map_err(Failure::input)?;
    document["schema"] = SCHEMA.into();
    document["verb"] = "study".into();
    document["study"] = Value::from(study);
    Ok(writeln!(out, "{document:#}")?)
}
