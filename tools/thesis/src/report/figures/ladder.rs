//! Chapter 5: the designs from single words to half precision, and the factor of each.

use crate::experiment::Part;
use crate::figure::Figure;
use crate::figure::bars;
use crate::index::{Origin, Row};
use crate::study::ladder::{Options, Rung, measure};
use pgs_command::failure::Failure;
use pgs_command::numbers::grouped;

const COMMAND: &str = "pgs thesis ladder";

pub(crate) fn part() -> Result<Part, Failure> {
    let outcome = measure(&Options::default());
    let names: Vec<String> = outcome.rungs.iter().map(|rung| rung.design.to_owned()).collect();
    let factors: Vec<Vec<Option<f64>>> =
        outcome.rungs.iter().map(|rung| vec![rung.factor]).collect();
    let figure = Figure {
        id: "figure-ladder",
        thesis: "Chapter 5",
        title: "How many times as fast each design is as the one before it".to_owned(),
        svg: bars("times", &names, &["over the design before".to_owned()], &factors),
        caption: "From words that the processor writes one by one to half precision, on the thesis' step."
            .to_owned(),
        origin: Origin::Modelled,
        playback: None,
    };
    let row = |rung: &Rung| Row {
        thesis: rung.thesis.to_owned(),
        subject: format!("cycles of a step: {}", rung.design),
        recorded: rung.recorded_cycles.map_or("not given".to_owned(), grouped),
        ours: format!("{} ({:.2} ms)", grouped(rung.cycles), rung.milliseconds),
        origin: Origin::Modelled,
        command: COMMAND.to_owned(),
        shown: figure.id.to_owned(),
    };
    let interval = |rung: &Rung| {
        let recorded = rung.recorded_interval?;
        let (streams, ports) = (rung.interval_by_streams?, rung.interval_by_ports?);
        Some(Row {
            subject: format!("cycles from an issue to the next (II): {}", rung.design),
            recorded: recorded.to_string(),
            ours: format!("{}: {streams} by the streams, {ports} by the ports", streams.max(ports)),
            ..row(rung)
        })
    };
    let rows = outcome.rungs.iter().flat_map(|rung| [Some(row(rung)), interval(rung)]);
    let rows = rows.flatten().collect();
    Ok(Part { figures: vec![figure], rows, ..Part::default() })
}
