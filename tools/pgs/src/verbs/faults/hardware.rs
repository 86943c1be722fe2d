//! Tries the faults of the streams on a simulator of the hardware and on the model, and prints the
//! driver's diagnoses side by side.

use std::io::Write;

use bitstream_model::Direction;
use serde_json::json;

use super::cells::{self, Cell};
use super::trial::{Bench, CellResult};
use super::{FaultsArgs, list, try_all};
use pgs_command::board;
use pgs_command::common::CommonArgs;
use pgs_command::failure::{Result, Verdict};
use pgs_command::output::table::{Cell as Shown, Table, text};
use pgs_command::output::width::terminal;
use pgs_command::output::{BAD, SCHEMA};

/// A cell, and its results on the model and on the hardware.
struct Pair {
    cell: Cell,
    model: CellResult,
    hardware: CellResult,
}

impl Pair {
    /// Whether both passed with the same diagnosis.
    fn equal(&self) -> bool {
        self.model.passed() && self.hardware.passed() && self.model.cause == self.hardware.cause
    }

    /// The kind of fault, the direction of its channel and the diagnoses.
    fn row(&self) -> [&'static str; 4] {
        let way = match self.cell.channel() {
            Some((_, Direction::S2mm)) => "S2MM",
            Some((_, Direction::Mm2s)) => "MM2S",
            None => "any",
        };
        let cause = |found: &CellResult| found.cause.unwrap_or("none");
        [self.cell.kind.name(), way, cause(&self.model), cause(&self.hardware)]
    }
}

/// Tries all cells on both.
pub(super) fn run(args: &FaultsArgs, common: &CommonArgs, out: &mut dyn Write) -> Result<Verdict> {
    let build = args.built.board.unwrap_or_default();
    let bench = Bench::like_simulator(&build)?;
    let cells = cells::for_simulator(&bench);
    if args.list {
        return list(&[(build.to_string(), cells)], common, out);
    }
    // A simulator that cannot be used is refused here, with the reason, and not cell by cell.
    board::emulated_board(bench.config, &common.accelerator)?;
    let of_model = try_all(&bench, cells.clone());
    let bench = bench.with(common.accelerator.clone());
    let of_hardware = try_all(&bench, cells);
    let pairs: Vec<Pair> = of_model
        .into_iter()
        .zip(of_hardware)
        .map(|((cell, model), (_, hardware))| Pair { cell, model, hardware })
        .collect();
    if common.json {
        let cells: Vec<_> = pairs
            .iter()
            .map(|pair| {
                json!({
                    "fault": pair.cell.plan.to_string(),
                    "model": pair.model.cause,
                    "hardware": pair.hardware.cause,
                    "equal": pair.equal(),
                })
            })
            .collect();
        writeln!(out, "{:#}", json!({ "schema": SCHEMA, "verb": "faults", "cells": cells }))?;
    } else {
        print(&pairs, out)?;
    }
    let equal = !pairs.is_empty() && pairs.iter().all(Pair::equal);
    Ok(if equal { Verdict::Done } else { Verdict::Differs })
}

fn print(pairs: &[Pair], out: &mut dyn Write) -> Result<()> {
    let mut table = Table::new("pairs", "Kinds of faults on the model and on the hardware");
    let mut rows: Vec<[&str; 4]> = Vec::new();
    for pair in pairs {
        if !rows.contains(&pair.row()) {
            rows.push(pair.row());
        }
    }
    for row in rows {
        let of_row = || pairs.iter().filter(|pair| pair.row() == row);
        let [kind, way, model, hardware] = row.map(text);
        let equal = of_row().filter(|pair| pair.equal()).count();
        let [tried, equal] = [of_row().count(), equal].map(|count| Shown::Whole(count as u64));
        table.row([
            ("fault", "fault", kind),
            ("on", "on", way),
            ("tried", "tried\ncells", tried),
            ("model", "model's diagnosis", model),
            ("hardware", "hardware's", hardware),
            ("equal", "equal\ncells", equal),
        ]);
    }
    write!(out, "{}", table.to_text(usize::MAX, terminal()))?;
    for pair in pairs.iter().filter(|pair| !pair.equal()) {
        writeln!(
            out,
            "{BAD}FAILED{BAD:#} '{}': model {}, hardware {} ({})",
            pair.cell.plan,
            pair.model.cause.unwrap_or("none"),
            pair.hardware.cause.unwrap_or("none"),
            pair.hardware.failed_checks().join(", "),
        )?;
    }
    Ok(())
}
