//! Prints the results of the cells: one row for each kind of fault.

use std::io::{self, Write};

use serde_json::{Value, json};

use super::ProfileResults;
use super::cells::Cell;
use super::expected::Expected;
use super::trial::CellResult;
use pgs_command::numbers::grouped;
use pgs_command::output::BAD;
use pgs_command::output::facts::whole;
use pgs_command::output::table::{Cell as Shown, Table, text};
use pgs_command::output::width::terminal;

/// The number of cells that passed each check.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Tally {
    tried: u64,
    happened: u64,
    named: u64,
    bodies: u64,
    in_time: u64,
    next: u64,
    passed: u64,
    slowest_ms: f64,
}

impl Tally {
    pub(super) fn of<'a>(cells: impl Iterator<Item = &'a (Cell, CellResult)>) -> Self {
        let mut all = Self::default();
        for (_, found) in cells {
            all.tried += 1;
            all.happened += u64::from(found.happened);
            all.named += u64::from(found.named);
            all.bodies += u64::from(found.bodies);
            all.in_time += u64::from(found.in_time);
            all.next += u64::from(found.next);
            all.passed += u64::from(found.passed());
            all.slowest_ms = all.slowest_ms.max(found.elapsed.as_secs_f64() * 1e3);
        }
        all
    }

    fn row(&self, table: &mut Table, name: &str, must: &str) {
        table.row([
            ("fault", "fault", text(name)),
            ("must", "must", text(must)),
            ("tried", "tried\ncells", Shown::Whole(self.tried)),
            ("happened", "happened", Shown::Whole(self.happened)),
            ("named", "cause\nnamed", Shown::Whole(self.named)),
            ("bodies", "bodies\nright", Shown::Whole(self.bodies)),
            ("in_time", "in time", Shown::Whole(self.in_time)),
            ("next", "next\nstep", Shown::Whole(self.next)),
            ("slowest_ms", "slowest\nms", Shown::Number(self.slowest_ms, 3)),
        ]);
    }

    pub(super) fn to_json(self) -> Value {
        json!({
            "tried": self.tried,
            "happened": self.happened,
            "named": self.named,
            "bodies": self.bodies,
            "in_time": self.in_time,
            "next": self.next,
            "passed": self.passed,
            "slowest_ms": self.slowest_ms,
        })
    }
}

/// Prints a row for each kind over all profiles; then profiles, phases, impossible combinations,
/// and failures.
pub(super) fn print(all: &[ProfileResults], out: &mut dyn Write) -> io::Result<()> {
    let cells = || all.iter().flat_map(|tried| &tried.cells);
    let mut table = Table::new("kinds", "Kinds of faults");
    let mut kinds: Vec<&str> = Vec::new();
    for (cell, _) in cells() {
        if !kinds.contains(&cell.kind.name()) {
            kinds.push(cell.kind.name());
        }
    }
    for kind in kinds {
        let of_kind = || cells().filter(|(cell, _)| cell.kind.name() == kind);
        let survive = of_kind().all(|(cell, _)| cell.expected == Expected::SameBits);
        let must = if survive { "survive" } else { "fail" };
        Tally::of(of_kind()).row(&mut table, kind, must);
    }
    Tally::of(cells()).row(&mut table, "all", "");
    write!(out, "{}", table.to_text(usize::MAX, terminal()))?;

    writeln!(out)?;
    for ProfileResults { name, cells, .. } in all {
        let Tally { tried, passed, .. } = Tally::of(cells.iter());
        writeln!(out, "profile {:12} {} of {} passed", name, grouped(passed), grouped(tried))?;
    }
    let mut phases: Vec<String> = Vec::new();
    for (cell, _) in cells() {
        if !phases.contains(&cell.phase_text()) {
            phases.push(cell.phase_text());
        }
    }
    for phase in phases {
        let Tally { tried, passed, .. } =
            Tally::of(cells().filter(|(cell, _)| cell.phase_text() == phase));
        writeln!(out, "phase   {phase:10} {} of {} passed", grouped(passed), grouped(tried))?;
    }
    writeln!(out)?;
    for place in 0..all.first().map_or(0, |tried| tried.impossible.len()) {
        let these = all.iter().filter_map(|tried| tried.impossible.get(place));
        let count: usize = these.clone().map(|impossible| impossible.cells).sum();
        let what = these.map(|impossible| impossible.what).next().unwrap_or_default();
        let count = grouped(count as u64);
        whole(out, "not tried: ", 11, &format!("{what} ({count} cells)"))?;
    }
    for ProfileResults { name, cells, .. } in all {
        for (cell, found) in cells.iter().filter(|(_, found)| !found.passed()) {
            let wrong = format!(
                "{name} '{}': {}; cause {}, expected {:?}",
                cell.plan,
                found.failed_checks().join(", "),
                found.cause.unwrap_or("none"),
                cell.expected,
            );
            whole(out, &format!("{BAD}FAILED{BAD:#} "), 7, &wrong)?;
        }
    }
    Ok(())
}
