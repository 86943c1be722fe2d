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
use pgs_command::common::{CommonArgs, Given};
use pgs_command::failure::{Result, Verdict};

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
    /// The options of a board that the verb has.
    pub(crate) fn given(&self) -> Given {
        let none = Given::default();
        match self.clone() {
            Self::Run(RunArgs { board, threads, accelerator, .. })
            | Self::Solve(SolveArgs { board, threads, accelerator, .. }) => {
                let (board, accelerator) = (Some(board), Some(accelerator));
                Given { board, accelerator, threads: threads.threads, ..none }
            }
            Self::Check(CheckArgs { board, accelerator, .. }) => {
                Given { board: Some(board), accelerator: Some(accelerator), ..none }
            }
            Self::List(ListArgs { board, .. }) => Given { board: Some(board), ..none },
            Self::Load(LoadArgs { manager, .. }) => Given { manager: Some(manager), ..none },
            Self::Serve(ServeArgs { accelerator, .. })
            | Self::Faults(FaultsArgs { accelerator, .. }) => {
                Given { accelerator: Some(accelerator), ..none }
            }
            Self::Thesis(args) => args.given(),
        }
    }

    /// Runs the verb and writes its results to `out`.
    pub(crate) fn run(&self, common: &CommonArgs, out: &mut dyn Write) -> Result<Verdict> {
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
