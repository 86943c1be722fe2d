//! The command line of the thesis part: a list, one experiment, or all of them.

use std::io::Write;

use clap::{Arg, ArgAction, ArgMatches, Args, Command, FromArgMatches};
use pgs_command::common::{AcceleratorOptions, BoardOptions, CommonArgs, Given};
use pgs_command::failure::{Failure, Result, Verdict};
use pgs_command::options::build::ThreadsArgs;
use pgs_command::output::width::terminal;
use serde_json::json;

use crate::experiment::{Boards, Experiment, SCHEMA};
use crate::index::section_key;
use crate::report::{self, AllArgs};
use crate::session::Session;
use crate::table::{Table, text};
use crate::{compare, detect, formats, formulas, order, study};

const EXAMPLES: &str = "\
Examples:
  pgs thesis                                    the list of experiments
  pgs thesis step                               the headline: two designs, time and energy
  pgs thesis cycles --collisions 90000 --bodies 38880
  pgs thesis determinism --input tests/golden/pile5_step60
  pgs thesis ladder --markdown
  pgs thesis --all --out report                 all of them: one page, Markdown, JSON, figures
  pgs thesis --all --out report --quick --input tests/golden/pile5_step60

With --all the folder of --out gets thesis.html, one page that needs no network, thesis.md,
thesis.json and figures/*.svg. With --input, rows that need a step of Bullet take the folder's;
without it they take a step of our own pile, and say so.

`pgs thesis NAME --help` tells how each experiment measures.";

/// Name of the option that asks for Markdown.
const MARKDOWN: &str = "markdown";

/// The options of the thesis part.
#[derive(Debug, Clone)]
pub struct ThesisArgs {
    all: AllArgs,
    /// The name of an experiment, and its options.
    one: Option<(String, ArgMatches)>,
}

/// All experiments, in the order of the thesis.
pub(crate) fn experiments() -> Vec<&'static Experiment> {
    let mut all: Vec<&'static Experiment> = vec![
        &study::time_step::TIME_STEP,
        &study::stopping::STOPPING,
        &study::split::SPLIT,
        &study::pile::PILE,
        &study::stages::STAGES,
        &study::step::STEP,
        &study::determinism::ORDERS,
        &study::half::HALF,
        &study::ladder::LADDER,
        &formats::FORMATS,
        &order::ORDER,
        &detect::DETECTION,
        &compare::COMPARE,
    ];
    all.extend(&formulas::FORMULAS);
    all.sort_by_key(|experiment| section_key(experiment.thesis));
    all
}

impl Args for ThesisArgs {
    fn augment_args(command: Command) -> Command {
        let markdown = Arg::new(MARKDOWN)
            .long(MARKDOWN)
            .action(ArgAction::SetTrue)
            .help("Print Markdown instead of text");
        let each = experiments().into_iter().map(|experiment| {
            let command = (experiment.arguments)(Command::new(experiment.id)).arg(markdown.clone());
            let command = match experiment.boards {
                Boards::None => command,
                Boards::Own => AcceleratorOptions::augment_args(command),
                Boards::Any => AcceleratorOptions::augment_args(ThreadsArgs::augment_args(
                    BoardOptions::augment_args(command),
                )),
            };
            // Last, because options bring texts of their own.
            command.about(experiment.about).long_about(None)
        });
        AllArgs::augment_args(command)
            .about("Measure the thesis again: its tables and figures from our own numbers")
            .after_help(EXAMPLES)
            .args_conflicts_with_subcommands(true)
            .subcommand_value_name("NAME")
            .subcommand_help_heading("Experiments")
            .subcommands(each)
    }

    fn augment_args_for_update(command: Command) -> Command {
        Self::augment_args(command)
    }
}

impl FromArgMatches for ThesisArgs {
    fn from_arg_matches(matches: &ArgMatches) -> Result<Self, clap::Error> {
        let one = matches.subcommand().map(|(name, options)| (name.to_owned(), options.clone()));
        Ok(Self { all: AllArgs::from_arg_matches(matches)?, one })
    }

    fn update_from_arg_matches(&mut self, matches: &ArgMatches) -> Result<(), clap::Error> {
        *self = Self::from_arg_matches(matches)?;
        Ok(())
    }
}

impl ThesisArgs {
    /// Lists the experiments, runs one or all, and writes to `out`.
    ///
    /// # Errors
    ///
    /// Fails as the experiment does, or where `out` or a file takes no more.
    pub fn run(&self, common: &CommonArgs, out: &mut dyn Write) -> Result<Verdict> {
        match &self.one {
            None if self.all.is_asked() => report::run(&self.all, common, out),
            None => list(common, out),
            Some(_) => self.run_one(&Session::new(common), out),
        }
    }

    /// The options of a board that the experiment has.
    #[must_use]
    pub fn given(&self) -> Given {
        let Some((name, options)) = &self.one else {
            // All of them step emulated boards.
            let accelerator = self.all.is_asked().then(AcceleratorOptions::default);
            return Given { accelerator, ..Given::default() };
        };
        let boards = experiments().iter().find(|each| each.id == name).map(|each| each.boards);
        let has = |least| boards.filter(|boards| *boards >= least);
        // The same parser has put the options there.
        Given {
            board: has(Boards::Any).and_then(|_| BoardOptions::from_arg_matches(options).ok()),
            accelerator: has(Boards::Own)
                .and_then(|_| AcceleratorOptions::from_arg_matches(options).ok()),
            threads: options.try_get_one("threads").ok().flatten().copied(),
            manager: None,
        }
    }

    /// Runs one experiment within a session.
    pub(crate) fn run_one(&self, session: &Session, out: &mut dyn Write) -> Result<Verdict> {
        let named = self.one.as_ref().and_then(|(name, options)| {
            let experiment = experiments().into_iter().find(|each| each.id == name)?;
            Some((experiment, options))
        });
        let Some((experiment, options)) = named else { return list(&session.common, out) };
        let markdown = options.get_flag(MARKDOWN);
        if session.common.json && markdown {
            return Err(Failure::input("--json and --markdown exclude each other")
                .next("leave one of them out"));
        }
        let part = (experiment.run)(options, session)?;
        match (session.common.json, markdown) {
            (true, _) => writeln!(out, "{:#}", part.to_json(experiment))?,
            (_, true) => part.write_markdown(experiment, out)?,
            _ => part.write_text(out)?,
        }
        Ok(part.verdict())
    }
}

/// Writes the list of experiments.
fn list(common: &CommonArgs, out: &mut dyn Write) -> Result<Verdict> {
    let columns = [("name", "name"), ("thesis", "thesis"), ("about", "")];
    let mut table = Table::with_columns("experiments", "Experiments", &columns);
    for experiment in experiments() {
        table.row([text(experiment.id), text(experiment.thesis), text(experiment.about)]);
    }
    match common.json {
        true => {
            let document = json!({
                "schema": SCHEMA,
                "verb": "thesis",
                "tables": [table.to_json()],
            });
            writeln!(out, "{document:#}")?;
        }
        false => write!(out, "{}", table.to_text(usize::MAX, terminal()))?,
    }
    Ok(Verdict::Done)
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use indicatif::ProgressBar;
    use pgs_command::interrupt::Interrupt;

    use crate::experiment::INTERRUPTED;

    /// Parses a line such as `pgs thesis ladder`.
    pub(crate) fn parsed(line: &str) -> Result<ThesisArgs, clap::Error> {
        let words = line.split_whitespace().skip(1).collect::<Vec<_>>();
        let matches =
            ThesisArgs::augment_args(Command::new("thesis")).try_get_matches_from(words)?;
        ThesisArgs::from_arg_matches(&matches)
    }

    #[test]
    fn every_experiment_says_once_that_ctrl_c_has_cut_it_short() {
        for words in [
            "time-step --grid 2x2x2",
            "stopping --grid 2x2x2",
            "split --grid 2x2x2",
            "step --grid 2x2x2",
            "determinism --grid 2x2x2",
            "half --grid 2x2x2 --build half",
            "compare float half --grid 2x2x2",
        ] {
            let args = parsed(&format!("pgs thesis {words}")).expect("words");
            let interrupt = Interrupt::install();
            interrupt.cancellation().cancel();
            let common = CommonArgs::emulated();
            let session = Session::within(&common, interrupt, ProgressBar::hidden());
            let mut out = Vec::new();
            let verdict = args.run_one(&session, &mut out).expect("an outcome");
            let text = String::from_utf8(out).expect("text");
            assert_eq!(verdict, Verdict::Interrupted, "{text}");
            assert_eq!(text.matches("interrupted: ").count(), 1, "{text}");
            assert!(text.ends_with(&format!("{INTERRUPTED}\n")), "{text}");
        }
    }

    #[test]
    fn the_definition_is_consistent_and_each_name_stands_once() {
        let mut command = ThesisArgs::augment_args(Command::new("thesis"));
        for experiment in experiments() {
            let found = command.find_subcommand(experiment.id).and_then(Command::get_about);
            assert_eq!(found.map(ToString::to_string).as_deref(), Some(experiment.about));
        }
        command.build();
        command.debug_assert();
        let mut names: Vec<_> = experiments().iter().map(|each| each.id).collect();
        names.sort_unstable();
        assert!(names.windows(2).all(|two| two[0] != two[1]), "{names:?}");
        for wrong in ["pgs thesis frobnicate", "pgs thesis --all", "pgs thesis --quick"] {
            parsed(wrong).expect_err(wrong);
        }
    }
}
