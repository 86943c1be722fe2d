//! Measures how the time of a step grows with the scene.

use std::time::Duration;

use bench::median;
use bench::options::Pile;
use bench::step::{Emulated, Step};
use bitstream_model::BoardConfig;
use bitstream_model::interface::profile::FLOAT;
use scene::Grid;
use serde_json::{Value, json};

use crate::{Options, Outcome};

/// Steps of a pile before the measured one.
const STEPS: u32 = 3;

/// Piles of growing size.
const PILES: [&str; 3] = ["10x10x10", "20x20x20", "36x30x36"];

/// Cubes of the pile that the others are compared with.
const FROM: u32 = 20 * 20 * 20;

struct Row {
    cubes: u32,
    collisions: usize,
    wait: Duration,
}

impl Row {
    /// Nanoseconds a collision.
    fn each(&self) -> f64 {
        self.wait.as_secs_f64() * 1e9 / self.collisions as f64
    }
}

pub(crate) fn measure(options: &Options) -> Outcome {
    let mut steps = Vec::new();
    let config = BoardConfig::default();
    for grid in PILES {
        let grid: Grid = grid.parse()?;
        steps.push((grid, Step::of_pile(&Pile::standing(grid, STEPS), config)?));
    }
    let mut boards = Vec::new();
    for (_, step) in &steps {
        boards.push((Emulated::new(step, config)?, Vec::new()));
    }
    for run in 0..=options.common.runs() {
        for (board, times) in &mut boards {
            let taken = board.take()?;
            if run > 0 {
                times.push(taken.report.host.wait);
            }
        }
    }
    let rows: Vec<Row> = steps
        .iter()
        .zip(boards)
        .map(|((grid, step), (_, times))| Row {
            cubes: grid.cubes(),
            collisions: step.collisions.len(),
            wait: median(times),
        })
        .collect();
    let (cubes, times) = growth_ratio(&rows)?;
    if !options.common.json {
        println!("Time of a step by the size of the scene, beats to results");
        println!("      cubes  collisions         ms  ns a collision");
        for row in &rows {
            println!(
                "  {:>9} {:>11} {:>10.3} {:>15.1}",
                row.cubes,
                row.collisions,
                bench::milliseconds(row.wait),
                row.each()
            );
        }
        println!("  a collision takes {times:.3} times as long in {cubes} cubes as in {FROM}\n");
    }
    let rows: Vec<Value> = rows
        .iter()
        .map(|row| {
            json!({
                "profile": FLOAT.name,
                "cubes": row.cubes,
                "collisions": row.collisions,
                "wait_ms": bench::milliseconds(row.wait),
                "ns_per_collision": row.each(),
            })
        })
        .collect();
    let growth =
        json!([{ "profile": FLOAT.name, "from_cubes": FROM, "to_cubes": cubes, "times": times }]);
    Ok(json!({ "piles": rows, "growth": growth }))
}

/// The size of the largest pile, and the ratio of its time per collision to that of [`FROM`] cubes.
fn growth_ratio(rows: &[Row]) -> Result<(u32, f64), String> {
    let missing = || format!("a pile of {FROM} cubes, and a larger one");
    let from = rows.iter().find(|row| row.cubes == FROM).ok_or_else(missing)?;
    let larger = rows.iter().filter(|row| row.cubes > FROM);
    let last = larger.max_by_key(|row| row.cubes).ok_or_else(missing)?;
    Ok((last.cubes, last.each() / from.each()))
}
