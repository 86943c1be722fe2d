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
        let mut table = Table::new(
            "ladder",
            "The designs of chapter 5, and the factor that each brings",
            &[
                ("design", "design"),
                ("interval_by_streams", "streams\ncycles"),
                ("interval_by_ports", "ports\ncycles"),
                ("recorded_interval", "thesis\ncycles"),
                ("collisions_per_issue", "each\ncoll."),
                ("cycles", "cycles\nmodelled"),
                ("recorded_cycles", "thesis\nrecorded"),
                ("milliseconds", "time\nms"),
                ("milliseconds_sustained", "12.8 GB/s\nms"),
                ("factor", "factor"),
                ("factor_in_all", "in all"),
                ("bound_by", "bound by"),
            ],
        );
        for rung in &self.rungs {
            let interval = |cycles: Option<u32>| Cell::known(cycles, |n| Cell::Whole(n.into()));
            table.row([
                text(rung.design),
                interval(rung.interval_by_streams),
                interval(rung.interval_by_ports),
                interval(rung.recorded_interval),
                Cell::Whole(rung.collisions_per_issue.into()),
                Cell::Whole(rung.cycles),
                Cell::known(rung.recorded_cycles, Cell::Whole),
                Cell::Number(rung.milliseconds, 3),
                Cell::Number(rung.milliseconds_sustained, 3),
                Cell::known(rung.factor, |factor| Cell::Number(factor, 2)),
                Cell::Number(rung.factor_in_all, 1),
                text(rung.bound_by),
            ]);
            let range = match rung.cycles_most > rung.cycles {
                true => format!("; up to {} cycles", grouped(rung.cycles_most)),
                false => String::new(),
            };
            table.note(format!(
                "{} ({}): {} = {}{range}",
                rung.design, rung.thesis, rung.change, rung.formula
            ));
        }
        let mut part = Part::of(vec![table]).with(self);
        let step = format!(
            "{} bodies, {} collisions, {} passes; numbers as the thesis packs them",
            grouped(self.bodies),
            grouped(self.collisions),
            self.passes
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
            "From words that the processor writes one by one to half precision, on the thesis' step.",
        )
        .modelled();
        let row = |rung: &Rung, subject: &str, recorded: String, ours| Row {
            thesis: rung.thesis.to_owned(),
            ..figure.row(format!("{subject}: {}", rung.design), recorded, ours)
        };
        let mut rows = Vec::new();
        for rung in &self.rungs {
            let recorded = rung.recorded_cycles.map_or("not given".to_owned(), grouped);
            let ours = format!("{} ({:.2} ms)", grouped(rung.cycles), rung.milliseconds);
            rows.push(row(rung, "cycles of a step", recorded, ours));
            let intervals = rung.interval_by_streams.zip(rung.interval_by_ports);
            let Some((recorded, (streams, ports))) = rung.recorded_interval.zip(intervals) else {
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
