//! Gathers the parts of the report, with progress.

use std::time::Duration;

use indicatif::{ProgressBar, ProgressStyle};

use super::AllArgs;
use super::figures;
use super::step::Step;
use super::studies::Effort;
use super::tables;
use crate::experiment::Part;
use crate::formulas::thesis_tables;
use crate::session::Session;
use pgs_command::common::CommonArgs;
use pgs_command::failure::Failure;
use pgs_command::interrupt::Interrupt;

/// Time between two pictures of the spinner.
const TICK: Duration = Duration::from_millis(200);

/// Everything that the report shows.
#[derive(Debug)]
pub(super) struct Report {
    /// The step that was measured.
    pub(super) step: String,
    /// The step is a folder's.
    pub(super) given: bool,
    pub(super) quick: bool,
    pub(super) part: Part,
}

/// Measures and draws all parts.
pub(super) fn gather(
    args: &AllArgs,
    common: &CommonArgs,
    interrupt: &Interrupt,
) -> Result<Report, Failure> {
    let bar = ProgressBar::new_spinner();
    if let Ok(style) = ProgressStyle::with_template("{spinner} {elapsed} {msg}") {
        bar.set_style(style);
    }
    bar.enable_steady_tick(TICK);
    let session = Session::within(common, interrupt.clone(), bar.clone());
    let gathered = of_all(args, &session.emulated(), &session, &bar);
    bar.finish_and_clear();
    gathered
}

fn of_all(
    args: &AllArgs,
    common: &CommonArgs,
    session: &Session,
    bar: &ProgressBar,
) -> Result<Report, Failure> {
    let effort = Effort::new(args, session);
    let about = |what: &'static str| {
        bar.set_message(what);
        effort.go_on()
    };
    about("the step to measure")?;
    let step = match &args.input {
        Some(path) => Step::folder(path)?,
        None => Step::of_pile(args, common, &effort)?,
    };
    about("time steps")?;
    let mut part = figures::time_step::part(&effort)?;
    part.append(figures::euler::part()?);
    part.append(figures::separation::part());
    about("stopping rules and shares of a step")?;
    part.append(figures::solver::part(&effort)?);
    about("the pile")?;
    part.append(figures::pile::part(&effort, common)?);
    part.tables = thesis_tables();
    part.rows.extend(tables::of_chapter_4(&part.tables)?);
    about("orders of the collisions")?;
    part.append(figures::orders::part(&effort)?);
    about("the input in 16 bits")?;
    part.append(figures::formats::part(&step)?);
    about("16 bits against float")?;
    part.append(figures::half::part(&effort)?);
    about("live bodies of each order")?;
    part.append(figures::live::part(&step)?);
    about("stages of a step")?;
    part.append(figures::stages::part(common)?);
    part.append(figures::ladder::part()?);
    part.rows.extend(tables::of_chapter_6(&part.tables)?);
    part.append(figures::designs::part()?);
    part.sort();
    Ok(Report { step: step.name, given: args.input.is_some(), quick: args.quick, part })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::command::tests::parsed;
    use crate::index::{Origin, Row, section_key};
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

    /// `tests/golden/report.json` has every cell of the tables, and every row of the index that is not
    /// measured and needs no step of a pile, as recorded before the experiments had a crate of their own.
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
        let figures = report.part.figures.iter().map(|figure| section_key(figure.thesis));
        assert!(rows.clone().is_sorted() && figures.clone().is_sorted());
        assert!(rows.chain(figures).all(|place| !place.is_empty()));
        let ours = |figure: &str| report.part.rows.iter().filter(|row| row.shown == figure).count();
        for figure in &report.part.figures {
            assert!(ours(figure.id) > 0 || SIBLINGS.contains(&figure.id), "{}", figure.id);
        }
    }

    /// The document that a command prints.
    fn printed(command: &str) -> Value {
        let common = CommonArgs { json: true, ..CommonArgs::emulated() };
        let session = Session::within(&common, Interrupt::install(), ProgressBar::hidden());
        let mut out = Vec::new();
        parsed(command).expect("words").run_one(&session, &mut out).expect("it runs");
        serde_json::from_slice(&out).expect("a document")
    }

    /// The rows of a report on steps that are found in the same report again, by the command of each.
    #[test]
    fn rows_of_formats_and_orders_have_the_figures_that_their_commands_print() {
        let (args, common) = (&options(), CommonArgs::emulated());
        let session = Session::within(&common, Interrupt::install(), ProgressBar::hidden());
        let effort = Effort::new(args, &session);
        let step = Step::of_pile(args, &common, &effort).expect("a step");
        let mut part = figures::formats::part(&step).expect("figures");
        part.append(figures::orders::part(&effort).expect("figures"));
        let percent = |value: &Value| value.as_f64().expect("a number");
        let (mut once, mut often, mut documents) = (0, 0, Vec::new());
        for row in &part.rows {
            if !documents.iter().any(|(command, _)| *command == row.command) {
                documents.push((row.command.clone(), printed(&row.command)));
            }
            let document = documents.iter().find(|(command, _)| *command == row.command);
            let document = &document.expect("just made").1;
            let last = |list: &Value| list.as_array().and_then(|all| all.last()).cloned();
            let gpu = || last(&document["gpu"]["curve"]).expect("a step")["position"].clone();
            let expected = if row.subject.starts_with("mean error") {
                let rows = document["tables"][0]["rows"].as_array().expect("rows");
                let sum = rows.iter().find(|row| row["kind"] == "each once").expect("the sum");
                format!("{:.4} %", percent(&sum["binary16_mean_percent"]))
            } else if row.subject.starts_with("mean deviation of positions between") {
                let pairs = last(&document["over_pairs"]).expect("a step");
                format!("{:.4}", percent(&pairs["position_mean_percent"]["mean"]))
            } else if row.subject.starts_with("mean deviation of positions: ") {
                format!("{:.4} %", percent(&gpu()["relative_mean_percent"]))
            } else if row.subject.starts_with("positions that deviate") {
                format!("{:.3} %", percent(&gpu()["under_1_percent_share"]) * 100.0)
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
