//! Runs all experiments, with progress.

use std::path::Path;
use std::time::Duration;

use clap::Command;
use indicatif::{ProgressBar, ProgressStyle};
use scene::Grid;

use super::AllArgs;
use crate::command::experiments;
use crate::experiment::{Part, shown};
use crate::index::Row;
use crate::session::Session;
use pgs_command::common::CommonArgs;
use pgs_command::failure::{Cause, Failure, Result};
use pgs_command::interrupt::Interrupt;
use pgs_command::options::scenes::DROP;

/// Time between two pictures of the spinner.
const TICK: Duration = Duration::from_millis(200);

/// Depth of the pipeline at which orders are compared, issue slots.
const DEPTH: u32 = 64;

/// Everything that the page shows.
#[derive(Debug)]
pub(super) struct Report {
    /// The step that was measured.
    pub(super) step: String,
    /// The step is a folder's.
    pub(super) given: bool,
    pub(super) quick: bool,
    /// The eight numbers of the headline.
    pub(super) numbers: Vec<Row>,
    pub(super) part: Part,
}

/// Runs all experiments.
pub(super) fn gather(args: &AllArgs, common: &CommonArgs, interrupt: &Interrupt) -> Result<Report> {
    let bar = ProgressBar::new_spinner();
    if let Ok(style) = ProgressStyle::with_template("{spinner} {elapsed} {msg}") {
        bar.set_style(style);
    }
    bar.enable_steady_tick(TICK);
    let common = CommonArgs { board: CommonArgs::emulated().board, ..common.clone() };
    let session = Session::within(&common, interrupt.clone(), bar.clone());
    let gathered = of_all(args, &session, &bar);
    bar.finish_and_clear();
    gathered
}

fn of_all(args: &AllArgs, session: &Session, bar: &ProgressBar) -> Result<Report> {
    let (mut part, mut numbers) = (Part::default(), Vec::new());
    for (id, words) in args.runs() {
        bar.set_message(id);
        let (command, mut one) = run(id, &words, session)?;
        if session.is_interrupted() || !one.complete {
            return Err(Failure::new(Cause::Output, "interrupted: no page was written"));
        }
        one.printed_by(&command);
        // The page has the tables of the headline and of the formulas; the others stand in its
        // figures.
        if id == HEADLINE && numbers.is_empty() {
            numbers.clone_from(&one.rows);
        } else if id != HEADLINE && !FORMULAS.contains(&id) {
            one.tables.clear();
        }
        part.append(one);
    }
    part.sort();
    let (step, given, quick) = (args.subject(), args.input.is_some(), args.quick);
    Ok(Report { step, given, quick, numbers, part })
}

/// The experiment that opens the page.
const HEADLINE: &str = "step";

/// The formulas, in the order of their tables on the page.
const FORMULAS: [&str; 6] = ["cycles", "data", "memory", "warm", "comparison", "euler"];

/// Runs an experiment with these options; also the command that repeats it.
fn run(id: &str, words: &[String], session: &Session) -> Result<(String, Part)> {
    let named = words.iter().map(|word| quoted(&shown(Path::new(word))));
    let command: Vec<String> =
        ["pgs thesis", id].into_iter().map(str::to_owned).chain(named).collect();
    let command = command.join(" ");
    let refused = |error: &dyn std::fmt::Display| {
        Failure::new(Cause::Input, format!("{command} is refused: {error}"))
    };
    let all = experiments();
    let experiment = all.iter().find(|each| each.id == id);
    let experiment = experiment.ok_or_else(|| refused(&"there is no such experiment"))?;
    let matches = (experiment.arguments)(Command::new(experiment.id))
        .try_get_matches_from(std::iter::once(&id.to_owned()).chain(words))
        .map_err(|error| refused(&error))?;
    let part = (experiment.run)(&matches, session)?;
    Ok((command, part))
}

/// A word as a shell reads it.
fn quoted(word: &str) -> String {
    let plain = |letter: char| letter.is_ascii_alphanumeric() || "_./=,:+-".contains(letter);
    if !word.is_empty() && word.chars().all(plain) {
        return word.to_owned();
    }
    format!("'{}'", word.replace('\'', "'\\''"))
}

impl AllArgs {
    /// The step that is measured, for people.
    fn subject(&self) -> String {
        match &self.input {
            Some(path) => format!("the step in {}", shown(path)),
            None => format!("step {} of our pile of {} cubes", self.step, self.pile()),
        }
    }

    /// The grid that the user gave; otherwise this small one for a quick page, and the thesis'.
    fn grid(&self, [x, y, z]: [u16; 3]) -> Grid {
        let small = || Grid::new(x, y, z).ok().filter(|_| self.quick);
        self.grid.or_else(small).unwrap_or_default()
    }

    /// The experiments with the options of each, the one that is refused soonest first.
    fn runs(&self) -> Vec<(&'static str, Vec<String>)> {
        let (pile, before) = (self.pile(), self.step.saturating_sub(1));
        // The same step, by an option of each experiment.
        let step = |options: String| match &self.input {
            Some(path) => vec!["--input".to_owned(), path.display().to_string()],
            None => words(&format!("--grid {pile} {options}")),
        };
        let from = || step(format!("--from {before} --steps 1"));
        let with = |mut all: Vec<String>, more: &str| {
            all.extend(words(more));
            all
        };
        let (small, steps) = (self.grid([12, 12, 12]), if self.quick { 200 } else { 240 });
        let many = || words(&format!("--grid {small} --drop {LONG_DROP} --steps {steps}"));
        let either = |quick, slow| words(if self.quick { quick } else { slow });
        let own = self.grid.or_else(|| Grid::new(12, 12, 12).ok().filter(|_| self.quick));
        let own = own.map_or_else(Vec::new, |grid| words(&format!("--grid {grid}")));
        let given = self.input.iter().map(|_| (HEADLINE, step(String::new())));
        let mut runs: Vec<_> = given.chain([(HEADLINE, own)]).collect();
        runs.extend([
            ("formats", step(format!("--step {}", self.step))),
            (
                "order",
                with(step(format!("--drop {DROP} --steps {before}")), &format!("--depth {DEPTH}")),
            ),
            ("time-step", either("--grid 4x4x4", "--grid 8x8x8 --seconds 4")),
            ("stopping", either("--passes 32", "--passes 128 --grid 10x10x10")),
            ("split", words(&format!("--grid {small}"))),
            ("pile", words(&format!("--grid {}", self.grid([18, 15, 18])))),
            ("determinism", with(from(), if self.quick { "--pairs 5" } else { "--pairs 20" })),
            ("determinism", with(many(), "--pairs 1")),
            ("half", from()),
            ("half", many()),
            ("stages", Vec::new()),
            ("ladder", Vec::new()),
        ]);
        runs.extend(FORMULAS.map(|id| (id, Vec::new())));
        runs
    }
}

/// The height from which the piles of many steps fall, m.
const LONG_DROP: u32 = 5;

fn words(text: &str) -> Vec<String> {
    text.split_whitespace().map(str::to_owned).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::command::tests::parsed;
    use crate::experiment::PILES;
    use crate::index::{Origin, section_key};
    use crate::report::AllArgs;
    use crate::table::Table;
    use clap::{Args as _, Command, FromArgMatches as _};
    use serde_json::Value;
    use std::sync::LazyLock;

    /// The options of a report on step 35 of a small pile.
    fn options() -> AllArgs {
        let words = "all --all --out unused --quick --grid 3x3x3 --step 35";
        let matches = AllArgs::augment_args(Command::new("all"))
            .try_get_matches_from(words.split_whitespace())
            .expect("options");
        AllArgs::from_arg_matches(&matches).expect("options")
    }

    /// On a pile of our own; a folder's path changes one option of the commands.
    static REPORT: LazyLock<Report> = LazyLock::new(|| {
        let common = CommonArgs::emulated();
        gather(&options(), &common, &Interrupt::install()).expect("a report")
    });

    /// `tests/golden/report.json` has every cell of the tables, and every row of the index that is
    /// not measured and needs no step of a pile, as recorded before the experiments had a crate of
    /// their own.
    #[test]
    fn modelled_and_counted_figures_are_the_recorded_ones() {
        let golden: Value =
            serde_json::from_str(include_str!("../../tests/golden/report.json")).expect("JSON");
        // The same rounding of a text to numbers on both sides.
        let found = crate::report::text::json(&REPORT).to_string();
        let found: Value = serde_json::from_str(&found).expect("JSON");
        let list = |value: &Value| value.as_array().expect("a list").clone();
        let rows = list(&found["index"]);
        for row in list(&golden["index"]) {
            let member = |row: &Value| {
                let keys = ["thesis", "subject", "recorded", "ours", "origin"];
                Value::from(keys.map(|key| row[key].clone()).to_vec())
            };
            assert!(rows.iter().any(|found| member(found) == row), "{row}");
        }
        for table in list(&golden["tables"]) {
            let found = list(&found["tables"]).into_iter().find(|found| found["id"] == table["id"]);
            let found = found.unwrap_or_else(|| panic!("no table {}", table["id"]));
            let cells = |row: &Value| {
                let keys = list(&table["columns"]).into_iter();
                Value::from(
                    keys.map(|key| row[key.as_str().expect("a key")].clone()).collect::<Vec<_>>(),
                )
            };
            let rows: Vec<_> = list(&found["rows"]).iter().map(cells).collect();
            assert_eq!(rows, list(&table["rows"]), "{}", table["id"]);
        }
    }

    #[test]
    fn every_row_of_the_index_has_a_command_and_leads_to_a_figure_or_a_table() {
        let report = &*REPORT;
        let anchors: Vec<String> = (report.part.figures.iter().map(|figure| figure.id.to_owned()))
            .chain(report.part.tables.iter().map(Table::anchor))
            .collect();
        for row in &report.part.rows {
            if row.command.starts_with("pgs thesis ") {
                parsed(&row.command).unwrap_or_else(|error| panic!("{row:?}: {error}"));
            } else if !row.command.starts_with("pgs run ") {
                let script = concat!(env!("CARGO_MANIFEST_DIR"), "/../../");
                assert!(std::path::Path::new(script).join(&row.command).is_file(), "{row:?}");
            }
            assert!(anchors.contains(&row.shown), "{row:?}");
            let cells = [&row.thesis, &row.subject, &row.recorded, &row.ours];
            assert!(cells.iter().all(|cell| !cell.is_empty()), "{row:?}");
        }
        let rows = report.part.rows.iter().map(|row| section_key(&row.thesis));
        assert_eq!(report.part.figures[0].id, PILES, "the headline's figure is the first");
        assert_eq!(report.numbers.len(), 8);
        let figures = report.part.figures[1..].iter().map(|figure| section_key(figure.thesis));
        assert!(rows.clone().is_sorted() && figures.clone().is_sorted());
        assert!(rows.chain(figures).all(|place| !place.is_empty()));
        let ours = |figure: &str| report.part.rows.iter().filter(|row| row.shown == figure).count();
        for figure in &report.part.figures {
            assert!(ours(figure.id) > 0 || SIBLINGS.contains(&figure.id), "{}", figure.id);
        }
    }

    #[test]
    fn the_commands_of_the_page_are_those_that_it_runs() {
        let session =
            Session::within(&CommonArgs::emulated(), Interrupt::install(), ProgressBar::hidden());
        let (command, _) = run("ladder", &words("--collisions 9"), &session).expect("a part");
        assert_eq!(command, "pgs thesis ladder --collisions 9");
        let refused = run("formats", &["--no".to_owned()], &session).expect_err("refused");
        let said = refused.chain();
        assert!(said.contains("pgs thesis formats --no is refused"), "{said}");
        let input = ["--input", "/home/somebody/two_cubes"].map(str::to_owned);
        let missing = run("formats", &input, &session).expect_err("no folder").chain();
        assert!(missing.contains("/home/somebody/two_cubes"), "{missing}");
        assert_eq!(quoted("../a/step_1"), "../a/step_1");
        assert_eq!(quoted("my step's"), "'my step'\\''s'");
    }

    /// The document that a command prints.
    fn printed(command: &str) -> Value {
        let common = CommonArgs { json: true, ..CommonArgs::emulated() };
        let session = Session::within(&common, Interrupt::install(), ProgressBar::hidden());
        let mut out = Vec::new();
        parsed(command).expect("words").run_one(&session, &mut out).expect("it runs");
        serde_json::from_slice(&out).expect("a document")
    }

    /// The rows of a report on steps that are found in the same report again, by the command of
    /// each.
    #[test]
    fn rows_of_formats_and_orders_have_the_figures_that_their_commands_print() {
        let percent = |value: &Value| value.as_f64().expect("a number");
        let (mut once, mut often, mut documents) = (0, 0, Vec::new());
        let of = |row: &&Row| {
            ["pgs thesis formats", "pgs thesis determinism"]
                .iter()
                .any(|verb| row.command.starts_with(verb))
        };
        for row in REPORT.part.rows.iter().filter(of) {
            if !documents.iter().any(|(command, _)| *command == row.command) {
                documents.push((row.command.clone(), printed(&row.command)));
            }
            let document = documents.iter().find(|(command, _)| *command == row.command);
            let document = &document.expect("just made").1;
            let last = |side: &str, cell: &str| {
                let rows = document["tables"][0]["rows"].as_array().expect("rows").iter();
                percent(&rows.rev().find(|row| row["side"] == side).expect("a step")[cell])
            };
            let [gpu, pairs] = ["as-given against gpu", "random pairs"];
            let expected = if row.subject.starts_with("mean error") {
                let rows = document["tables"][0]["rows"].as_array().expect("rows");
                let sum = rows.iter().find(|row| row["kind"] == "each once").expect("the sum");
                format!("{:.4} %", percent(&sum["binary16_mean_percent"]))
            } else if row.subject.starts_with("mean deviation of positions between") {
                format!("{:.4}", last(pairs, "position_mean_percent"))
            } else if row.subject.starts_with("mean deviation of positions: ") {
                format!("{:.4} %", last(gpu, "position_mean_percent"))
            } else if row.subject.starts_with("positions that deviate") {
                format!("{:.3} %", last(gpu, "position_under_1_percent"))
            } else {
                continue;
            };
            assert!(row.ours.starts_with(&expected), "{expected}: {row:?}");
            once += u32::from(row.subject.ends_with("after one step"));
            often += u32::from(row.subject.ends_with("after 200 steps"));
        }
        assert_eq!((once, often), (3, 3));
    }

    #[test]
    fn rows_and_figures_are_in_the_order_of_the_thesis() {
        let row = |thesis: &str| Row {
            thesis: thesis.to_owned(),
            subject: String::new(),
            recorded: String::new(),
            ours: String::new(),
            origin: Origin::Open,
            command: String::new(),
            shown: String::new(),
        };
        let mut part = Part {
            rows: ["§4.6.3, Figure 4.9", "§4.6.2", "§4.4", "§4.3", "§4.4.1"].map(row).into(),
            ..Part::default()
        };
        part.sort();
        let found: Vec<_> = part.rows.iter().map(|row| row.thesis.as_str()).collect();
        assert_eq!(found, ["§4.3", "§4.4", "§4.4.1", "§4.6.2", "§4.6.3, Figure 4.9"]);
    }

    /// Figures whose numbers stand in the row of the figure before.
    const SIBLINGS: [&str; 1] = ["figure-4-6"];
}
