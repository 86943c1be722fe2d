//! Measures how the time of a step grows with the scene.

use std::time::Duration;

use bench::median;
use bench::options::Pile;
use bench::step::{Emulated, Step};
use bitstream_model::BoardConfig;
use bitstream_model::interface::profile::{FLOAT, Profile, WINDOWED};
use scene::Grid;
use serde_json::{Value, json};

use crate::{Options, Outcome};

/// Steps of a pile before the measured one.
const STEPS: u32 = 3;

/// Piles and the designs that carry them: the on-chip memory of `windowed` holds the live bodies
/// only. The longest pile is no thicker across than the thesis', so that its bodies live as long.
const PILES: [(&str, &Profile); 6] = [
    ("10x10x10", &FLOAT),
    ("20x20x20", &FLOAT),
    ("36x30x36", &FLOAT),
    ("20x20x20", &WINDOWED),
    ("36x30x36", &WINDOWED),
    ("100x25x40", &WINDOWED),
];

/// Cubes of the pile that each design's piles are compared with.
const FROM: u32 = 20 * 20 * 20;

struct Row {
    profile: &'static str,
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
    for (grid, profile) in PILES {
        let grid: Grid = grid.parse()?;
        let config = BoardConfig { profile, ..BoardConfig::default() };
        steps.push((grid, config, Step::of_pile(&Pile::standing(grid, STEPS), config)?));
    }
    let mut boards = Vec::new();
    for (_, config, step) in &steps {
        boards.push((Emulated::new(step, *config)?, Vec::new()));
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
        .map(|((grid, config, step), (_, times))| Row {
            profile: config.profile.name,
            cubes: grid.cubes(),
            collisions: step.collisions.len(),
            wait: median(times),
        })
        .collect();
    let growth = [growth_ratio(&rows, FLOAT.name)?, growth_ratio(&rows, WINDOWED.name)?];
    if !options.common.json {
        println!("Time of a step by the size of the scene, beats to results");
        println!("  profile       cubes  collisions         ms  ns a collision");
        for row in &rows {
            println!(
                "  {:<9} {:>9} {:>11} {:>10.3} {:>15.1}",
                row.profile,
                row.cubes,
                row.collisions,
                bench::milliseconds(row.wait),
                row.each()
            );
        }
        for (profile, cubes, times) in &growth {
            println!(
                "  {profile}: a collision takes {times:.3} times as long in {cubes} cubes as in {FROM}"
            );
        }
        println!();
    }
    let rows: Vec<Value> = rows
        .iter()
        .map(|row| {
            json!({
                "profile": row.profile,
                "cubes": row.cubes,
                "collisions": row.collisions,
                "wait_ms": bench::milliseconds(row.wait),
                "ns_per_collision": row.each(),
            })
        })
        .collect();
    let growth: Vec<Value> = growth
        .iter()
        .map(|(profile, cubes, times)| {
            json!({ "profile": profile, "from_cubes": FROM, "to_cubes": cubes, "times": times })
        })
        .collect();
    Ok(json!({ "piles": rows, "growth": growth }))
}

/// The ratio of the time per collision in a design's largest pile to that in its smallest, and the
/// size of the largest.
fn growth_ratio(rows: &[Row], profile: &'static str) -> Result<(&'static str, u32, f64), String> {
    let missing = || format!("a pile of {FROM} cubes, and a larger one, for {profile}");
    let of = || rows.iter().filter(|row| row.profile == profile);
    let from = of().find(|row| row.cubes == FROM).ok_or_else(missing)?;
    let last = of().filter(|row| row.cubes > FROM).max_by_key(|row| row.cubes);
    let last = last.ok_or_else(missing)?;
    Ok((profile, last.cubes, last.each() / from.each()))
}
