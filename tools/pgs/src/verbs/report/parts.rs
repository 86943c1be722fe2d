//! Gathers the parts of the report, with progress.

use indicatif::{ProgressBar, ProgressStyle};

use super::ReportArgs;
use super::document::Part;
use super::figures;
use super::step::Step;
use super::studies::Effort;
use super::tables;
use crate::common::{BoardName, CommonArgs};
use crate::failure::Failure;
use crate::verbs::model::table::Table;
use crate::verbs::model::thesis_tables;
use crate::verbs::study::Session;

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
pub(super) fn gather(args: &ReportArgs, common: &CommonArgs) -> Result<Report, Failure> {
    let bar = ProgressBar::new_spinner();
    if let Ok(style) = ProgressStyle::with_template("{spinner} {elapsed} {msg}") {
        bar.set_style(style);
    }
    // The report measures the emulated board, also on a machine that has a real one.
    let mut common = common.clone();
    if common.board == BoardName::Auto {
        common.board = BoardName::Emulated;
    }
    let common = &common;
    let about = |what: &'static str| {
        bar.set_message(what);
        bar.tick();
    };
    about("the step to measure");
    let step = match &args.input {
        Some(path) => Step::folder(path)?,
        None => Step::of_pile(args, common, || bar.tick())?,
    };
    let session = Session::new(common);
    let effort = Effort::new(args, &session);
    // In the order of the thesis.
    about("time steps");
    let mut part = figures::time_step::part(&effort)?;
    part.append(figures::euler::part()?);
    part.append(figures::separation::part());
    about("stopping rules and shares of a step");
    part.append(figures::solver::part(&effort)?);
    about("the pile");
    part.append(figures::pile::part(&effort, common)?);
    let tables = thesis_tables();
    part.rows.extend(tables::of_chapter_4(&tables)?);
    about("orders of the collisions");
    part.append(figures::orders::part(&effort)?);
    about("the input in 16 bits");
    part.append(figures::formats::part(&step)?);
    about("16 bits against float");
    part.append(figures::half::part(&effort)?);
    about("live bodies of each order");
    part.append(figures::live::part(&step)?);
    about("stages of a step");
    part.append(figures::stages::part(common)?);
    part.append(figures::ladder::part()?);
    part.append(figures::designs::part()?);
    part.rows.extend(tables::of_chapter_6(&tables)?);
    bar.finish_and_clear();
    Ok(Report { step: step.name, given: args.input.is_some(), quick: args.quick, part, tables })
}
