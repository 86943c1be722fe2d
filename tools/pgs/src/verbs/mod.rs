//! The verbs, one file each.

pub(crate) mod check;
pub(crate) mod faults;
pub(crate) mod list;
pub(crate) mod load;
pub(crate) mod run;
pub(crate) mod serve;
pub(crate) mod solve;

use std::io::Write;

use clap::Subcommand;
use pgs_thesis::ThesisArgs;

use self::check::CheckArgs;
use self::faults::FaultsArgs;
use self::list::ListArgs;
use self::load::LoadArgs;
use self::run::RunArgs;
use self::serve::ServeArgs;
use self::solve::SolveArgs;
use pgs_command::common::CommonArgs;
use pgs_command::failure::{Failure, Verdict};

/// A verb and its options.
#[derive(Debug, Clone, Subcommand)]
pub(crate) enum Verb {
    Run(RunArgs),
    Solve(SolveArgs),
    List(ListArgs),
    Load(LoadArgs),
    Serve(ServeArgs),
    Check(CheckArgs),
    Faults(FaultsArgs),
    Thesis(ThesisArgs),
}

impl Verb {
    /// Runs the verb and writes its results to `out`.
    pub(crate) fn run(&self, common: &CommonArgs, out: &mut dyn Write) -> Result<Verdict, Failure> {
        match self {
            Self::Run(args) => run::run(args, common, out),
            Self::Solve(args) => solve::run(args, common, out),
            Self::List(args) => list::run(args, common, out),
            Self::Load(args) => load::run(args, common, out),
            Self::Serve(args) => serve::run(args, common, out),
            Self::Check(args) => check::run(args, common, out),
            Self::Faults(args) => faults::run(args, common, out),
            Self::Thesis(args) => args.run(common, out),
        }
    }
}
