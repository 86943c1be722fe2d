//! The table of the ladder, with the formula of each design.

use super::{Outcome, Rung};
use crate::experiment::Part;
use crate::figure::{Figure, bars};
use crate::index::Row;
use crate::table::{Cell, Table, text};
use pgs_command::numbers::grouped;

impl Outcome {
    /// The facts and the table of the outcome.
    pub(super) fn part(&self) -> Part {
        let mut table =
            Table::new("ladder", "The designs of chapter 5, and the factor that each brings");
        for rung in &self.rungs {
            let interval = |cycles: Option<u32>| Cell::known(cycles, |n| Cell::Whole(n.into()));
            let [streams, ports] = [0, 1].map(|of| rung.intervals.map(|both| both[of]));
            let [cycles, most] = rung.cycles;
            let milliseconds = rung.milliseconds();
            table.row([
                ("design", "design", text(rung.design)),
                ("interval_by_streams", "streams\ncycles", interval(streams)),
                ("interval_by_ports", "ports\ncycles", interval(ports)),
                ("recorded_interval", "thesis\ncycles", interval(rung.recorded_interval)),
                (
                    "collisions_per_issue",
                    "each\ncoll.",
                    Cell::Whole(rung.collisions_per_issue.into()),
                ),
                ("cycles", "cycles\nmodelled", Cell::Whole(cycles)),
                (
                    "recorded_cycles",
                    "thesis\nrecorded",
                    Cell::known(rung.recorded_cycles, Cell::Whole),
                ),
                ("milliseconds", "time\nms", Cell::Number(milliseconds, 3)),
                (
                    "milliseconds_sustained",
                    "12.8 GB/s\nms",
                    Cell::Number(rung.sustained.unwrap_or(milliseconds), 3),
                ),
                ("factor", "factor", Cell::known(rung.factor, |factor| Cell::Number(factor, 2))),
                ("factor_in_all", "in all", Cell::Number(rung.factor_in_all, 1)),
                ("bound_by", "bound by", text(rung.bound_by)),
            ]);
            let range = match most > cycles {
                true => format!("; up to {} cycles", grouped(most)),
                false => String::new(),
            };
            table.note(format!(
                "{} ({}): {} = {}{range}",
                rung.design, rung.thesis, rung.change, rung.formula
            ));
        }
        let mut part = Part::of(vec![table]);
        let step = format!(
            "{} bodies, {} collisions, {} passes; numbers as the thesis packs them",
            grouped(self.step.bodies),
            grouped(self.step.collisions),
            self.step.passes()
        );
        part.fact("step", step);
        let (figure, rows) = self.figure();
        part.figure(figure, rows);
        part
    }

    /// The factor of each design.
    fn figure(&self) -> (Figure, Vec<Row>) {
        let names: Vec<String> = self.rungs.iter().map(|rung| rung.design.to_owned()).collect();
        let factors: Vec<_> = self.rungs.iter().map(|rung| vec![rung.factor]).collect();
        let figure = Figure::new(
            ("figure-ladder", "Chapter 5"),
            "How many times as fast each design is as the one before it",
            bars("times", &names, &["over the design before".to_owned()], &factors),
            "From words that the processor writes one by one to half precision, on the thesis' \
             step.",
        )
        .modelled();
        let row = |rung: &Rung, subject: &str, recorded: String, ours| Row {
            thesis: rung.thesis.to_owned(),
            ..figure.row(format!("{subject}: {}", rung.design), recorded, ours)
        };
        let mut rows = Vec::new();
        for rung in &self.rungs {
            let recorded = rung.recorded_cycles.map_or("not given".to_owned(), grouped);
            let ours = format!("{} ({:.2} ms)", grouped(rung.cycles[0]), rung.milliseconds());
            rows.push(row(rung, "cycles of a step", recorded, ours));
            let Some((recorded, [streams, ports])) = rung.recorded_interval.zip(rung.intervals)
            else {
                continue;
            };
            let most = streams.max(ports);
            let ours = format!("{most}: {streams} by the streams, {ports} by the ports");
            let subject = "cycles from an issue to the next (II)";
            rows.push(row(rung, subject, recorded.to_string(), ours));
        }
        (figure, rows)
    }
}
