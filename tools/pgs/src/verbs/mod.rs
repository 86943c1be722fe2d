//! The verbs, one file each.

pub(crate) mod check;
pub(crate) mod compare;
pub(crate) mod detect;
pub(crate) mod faults;
pub(crate) mod formats;
pub(crate) mod list;
pub(crate) mod load;
pub(crate) mod model;
pub(crate) mod order;
pub(crate) mod report;
pub(crate) mod run;
pub(crate) mod serve;
pub(crate) mod solve;
pub(crate) mod study;

use std::io::Write;

use clap::Subcommand;

use self::check::CheckArgs;
use self::compare::CompareArgs;
use self::detect::DetectArgs;
use self::faults::FaultsArgs;
use self::formats::FormatsArgs;
use self::list::ListArgs;
use self::load::LoadArgs;
use self::model::ModelArgs;
use self::order::OrderArgs;
use self::report::ReportArgs;
use self::run::RunArgs;
use self::serve::ServeArgs;
use self::solve::SolveArgs;
use self::study::StudyArgs;
use crate::common::CommonArgs;
use crate::failure::{Failure, Verdict};

/// A verb and its options.
#[derive(Debug, Clone, Subcommand)]
pub(crate) enum Verb {
    Run(RunArgs),
    Solve(SolveArgs),
    Compare(CompareArgs),
    Detect(DetectArgs),
    Formats(FormatsArgs),
    Model(ModelArgs),
    Order(OrderArgs),
    Report(ReportArgs),
    Study(StudyArgs),
    List(ListArgs),
    Load(LoadArgs),
    Serve(ServeArgs),
    Check(CheckArgs),
    Faults(FaultsArgs),
}

impl Verb {
    /// Runs the verb and writes its results to `out`.
    pub(crate) fn run(&self, common: &CommonArgs, out: &mut dyn Write) -> Result<Verdict, Failure> {
        match self {
            Self::Run(args) => run::run(args, common, out),
            Self::Solve(args) => solve::run(args, common, out),
            Self::Compare(args) => compare::run(args, common, out),
            Self::Detect(args) => detect::run(args, common, out),
            Self::Formats(args) => formats::run(args, common, out),
            Self::Model(args) => model::run(args, common, out),
            Self::Order(args) => order::run(args, common, out),
            Self::Report(args) => report::run(args, common, out),
            Self::Study(args) => study::run(args, common, out),
            Self::List(args) => list::run(args, common, out),
            Self::Load(args) => load::run(args, common, out),
            Self::Serve(args) => serve::run(args, common, out),
            Self::Check(args) => check::run(args, common, out),
            Self::Faults(args) => faults::run(args, common, out),
        }
    }
}
