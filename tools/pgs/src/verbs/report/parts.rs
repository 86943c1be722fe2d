//! Gathers the parts of the report, with progress.

use std::time::Duration;

use indicatif::{ProgressBar, ProgressStyle};

use super::ReportArgs;
use super::document::Part;
use super::figures;
use super::step::Step;
use super::studies::Effort;
use super::tables;
use crate::common::{BoardName, CommonArgs};
use crate::failure::Failure;
use crate::interrupt::Interrupt;
use crate::verbs::model::table::Table;
use crate::verbs::model::thesis_tables;
use crate::verbs::study::Session;

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
    pub(super) tables: Vec<Table>,
}

/// Measures and draws all parts.
pub(super) fn gather(
    args: &ReportArgs,
    common: &CommonArgs,
    interrupt: &Interrupt,
) -> Result<Report, Failure> {
    if !matches!(common.board, BoardName::Auto | BoardName::Emulated) {
        return Err(Failure::input("the report measures the emulated board")
            .next("leave out --board, and PGS_BOARD"));
    }
    let common = CommonArgs { board: BoardName::Emulated, ..common.clone() };
    let bar = ProgressBar::new_spinner();
    if let Ok(style) = ProgressStyle::with_template("{spinner} {elapsed} {msg}") {
        bar.set_style(style);
    }
    bar.enable_steady_tick(TICK);
    let session = Session::within(&common, interrupt.clone(), bar.clone());
    let gathered = of_all(args, &common, &session, &bar);
    bar.finish_and_clear();
    gathered
}

fn of_all(
    args: &ReportArgs,
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
    let tables = thesis_tables();
    part.rows.extend(tables::of_chapter_4(&tables)?);
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
    part.rows.extend(tables::of_chapter_6(&tables)?);
    part.append(figures::designs::part()?);
    part.sort();
    Ok(Report { step: step.name, given: args.input.is_some(), quick: args.quick, part, tables })
}

#[cfg(test)]
mod tests {
    use super::super::document::{Origin, Row};
    use super::super::place::section_key;
    use super::*;
    use crate::cli;
    use crate::verbs::Verb;
    use serde_json::Value;

    fn parsed(command: &str) -> cli::Command {
        let found = cli::parse(command.split_whitespace(), |_| None);
        found.unwrap_or_else(|error| panic!("{command}: {error}"))
    }

    /// On a pile of our own; a folder's path changes one option of the commands.
    #[test]
    fn every_row_of_the_index_has_a_command_and_leads_to_a_figure_or_a_table() {
        let command = parsed("pgs report --out unused --quick --grid 3x3x3 --step 35");
        let Verb::Report(args) = &command.verb else { panic!("{command:?}") };
        let report = gather(args, &command.common, &Interrupt::install()).expect("a report");
        let anchors: Vec<String> = (report.part.figures.iter().map(|figure| figure.id.to_owned()))
            .chain(report.tables.iter().map(tables::anchor))
            .collect();
        for row in &report.part.rows {
            if row.command.starts_with("pgs ") {
                parsed(&row.command);
            } else {
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
        let command = parsed(&format!("{command} --json --board emulated"));
        let mut out = Vec::new();
        command.verb.run(&command.common, &mut out).expect("it runs");
        serde_json::from_slice(&out).expect("a document")
    }

    /// The rows of a report on steps that are found in the same report again, by the command of each.
    #[test]
    fn rows_of_formats_and_orders_have_the_figures_that_their_commands_print() {
        let command = parsed("pgs report --out unused --quick --grid 3x3x3 --step 35");
        let Verb::Report(args) = &command.verb else { panic!("{command:?}") };
        let common = CommonArgs { board: BoardName::Emulated, ..command.common.clone() };
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
                let loss = &document["each_once"]["formats"]["binary16"];
                format!("{:.4} %", percent(&loss["relative_mean_percent"]))
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
            figures: Vec::new(),
            rows: ["§4.6.3, Figure 4.9", "§4.6.2", "§4.4", "§4.3", "§4.4.1"].map(row).into(),
        };
        part.sort();
        let found: Vec<_> = part.rows.iter().map(|row| row.thesis.as_str()).collect();
        assert_eq!(found, ["§4.3", "§4.4", "§4.4.1", "§4.6.2", "§4.6.3, Figure 4.9"]);
    }

    /// Figures whose numbers stand in the row of the figure before.
    const SIBLINGS: [&str; 1] = ["figure-4-6"];
}
