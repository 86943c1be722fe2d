//! Measures a step with world inertia, warm start and pair friction beside the same step with isotropic
//! inertia and without both, on the emulated board of `float`.

use std::error::Error;
use std::time::Duration;

use bench::step::{Emulated, Step};
use bench::{median, milliseconds, ratio};
use bitstream_model::BoardConfig;
use bitstream_model::interface::profile::Inertia;
use serde_json::{Value, json};
use step_folder::digest;
use zynq_pgs::Shape;

use crate::{Options, Outcome};

/// Kinds of steps: the form of inertia of the board, and whether the step has the extensions.
const KINDS: [(&str, Inertia, bool); 3] = [
    ("isotropic inertia", Inertia::Isotropic, false),
    ("world inertia", Inertia::World, false),
    ("world inertia, warm start, pair friction", Inertia::World, true),
];

/// Numbers of threads of the board.
const THREADS: [usize; 2] = [1, 2];

/// Median times of one kind of step on a board of one number of threads.
struct Row {
    kind: &'static str,
    threads: usize,
    /// From the beats in memory to the results in memory.
    wait: Duration,
    /// The whole call.
    call: Duration,
    digest: u64,
}

pub(crate) fn measure(options: &Options) -> Outcome {
    let isotropic = options.step()?;
    let boxes = of_boxes(&isotropic);
    let pairs = with_frictions(&boxes);
    let steps = [&isotropic, &boxes, &pairs];
    let mut boards = Vec::new();
    for threads in THREADS {
        for ((kind, inertia, extended), step) in KINDS.into_iter().zip(steps) {
            let config = BoardConfig { threads, inertia, ..BoardConfig::default() };
            boards.push((kind, threads, open(step, config, extended)?, Vec::new()));
        }
    }
    // The first run is not measured: it allocates all memory.
    for run in 0..=options.common.runs() {
        for (_, _, board, taken) in &mut boards {
            let step = board.take()?;
            if run > 0 {
                taken.push(step);
            }
        }
    }
    let rows: Vec<Row> = boards
        .iter()
        .map(|(kind, threads, board, taken)| Row {
            kind,
            threads: *threads,
            wait: median(taken.iter().map(|taken| taken.report.host.wait).collect()),
            call: median(taken.iter().map(|taken| taken.call).collect()),
            digest: digest::of_bodies(board.bodies()),
        })
        .collect();
    check(&steps, &rows)?;
    if !options.common.json {
        print(&isotropic, &rows);
    }
    Ok(json!({ "step": isotropic.name, "steps": document(&rows) }))
}

/// The step with another inertia about each axis.
fn of_boxes(step: &Step) -> Step {
    let shape = |shape: &Shape| {
        let [x, y, z] = shape.inverse_inertia;
        Shape { inverse_inertia: [x, 1.25 * y, 0.75 * z], ..*shape }
    };
    Step { shapes: step.shapes.iter().map(shape).collect(), ..step.clone() }
}

/// The step with a friction of each pair.
fn with_frictions(step: &Step) -> Step {
    let own = |number: usize| step.parameters.friction * [0.75, 1.0, 1.25][number % 3];
    let collisions = step.collisions.iter().enumerate();
    let collisions = collisions.map(|(number, of)| of.with_friction(own(number))).collect();
    Step { collisions, ..step.clone() }
}

fn open(step: &Step, config: BoardConfig, extended: bool) -> Result<Emulated<'_>, Box<dyn Error>> {
    match extended {
        true => Emulated::extended(step, config),
        false => Emulated::new(step, config),
    }
}

/// Compares the results with the results of a board without short cuts.
fn check(steps: &[&Step; KINDS.len()], rows: &[Row]) -> Result<(), Box<dyn Error>> {
    for ((kind, inertia, extended), step) in KINDS.into_iter().zip(steps) {
        let config = BoardConfig { inertia, shortcuts: false, ..BoardConfig::default() };
        let mut board = open(step, config, extended)?;
        board.take()?;
        let expected = digest::of_bodies(board.bodies());
        for Row { threads, digest, .. } in rows.iter().filter(|row| row.kind == kind) {
            if *digest != expected {
                let found = format!("{kind}, {threads} threads: digest {digest:016x}");
                return Err(format!("{found}, without short cuts {expected:016x}").into());
            }
        }
    }
    Ok(())
}

/// The isotropic step of the same number of threads.
fn beside<'a>(rows: &'a [Row], row: &'a Row) -> &'a Row {
    let isotropic = |other: &&Row| other.kind == KINDS[0].0 && other.threads == row.threads;
    rows.iter().find(isotropic).unwrap_or(row)
}

fn print(step: &Step, rows: &[Row]) {
    println!("A step by what it asks for: {}", step.name);
    println!("{} bodies, {} collisions\n", step.bodies.len(), step.collisions.len());
    println!(
        "  {:<42} {:>7} {:>9} {:>13} {:>9} {:>13}  digest",
        "", "threads", "board, ms", "by isotropic", "call, ms", "by isotropic"
    );
    for row in rows {
        let of = beside(rows, row);
        println!(
            "  {:<42} {:>7} {:>9.3} {:>13.3} {:>9.3} {:>13.3}  {:016x}",
            row.kind,
            row.threads,
            milliseconds(row.wait),
            ratio(row.wait, of.wait),
            milliseconds(row.call),
            ratio(row.call, of.call),
            row.digest
        );
    }
    println!();
}

fn document(rows: &[Row]) -> Vec<Value> {
    let each = rows.iter().map(|row| {
        let of = beside(rows, row);
        json!({
            "kind": row.kind,
            "threads": row.threads,
            "wait_ms": milliseconds(row.wait),
            "wait_by_isotropic": ratio(row.wait, of.wait),
            "call_ms": milliseconds(row.call),
            "call_by_isotropic": ratio(row.call, of.call),
            "digest": format!("{:016x}", row.digest),
        })
    });
    each.collect()
}
