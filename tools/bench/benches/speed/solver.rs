//! Compares a step of the emulated board with the yardstick, and measures the driver's share.

use std::hint::black_box;
use std::time::{Duration, Instant};

use bench::step::{Emulated, Step, Taken};
use bench::{median, milliseconds, ratio};
use bitstream_model::BoardConfig;
use serde_json::{Value, json};
use step_folder::digest;
use yardstick::{Record, Stages, Yardstick};

use crate::{Options, Outcome};

/// Builds of the emulated board with the same bits.
fn variants() -> [(&'static str, BoardConfig); 3] {
    let with = |threads, lanes| BoardConfig { threads, lanes, ..BoardConfig::default() };
    [
        ("board, 1 thread", with(1, true)),
        ("board, 2 threads", with(2, true)),
        ("board, 1 thread, without lanes", with(1, false)),
    ]
}

/// Median times of one build.
struct Measured {
    name: &'static str,
    wait: Duration,
    /// Time outside packing, ordering and waiting.
    rest: Duration,
    validate: Duration,
    start: Duration,
    unpack: Duration,
    commit: Duration,
}

impl Measured {
    fn new(name: &'static str, taken: &[Taken]) -> Self {
        let of = |time: fn(&Taken) -> Duration| median(taken.iter().map(time).collect());
        Self {
            name,
            wait: of(|t| t.report.host.wait),
            rest: of(|t| {
                let host = &t.report.host;
                t.call.saturating_sub(host.order + host.pack + host.wait)
            }),
            validate: of(|t| t.report.host.validate),
            start: of(|t| t.report.host.start),
            unpack: of(|t| t.report.host.unpack),
            commit: of(|t| t.report.host.commit),
        }
    }
}

/// Median times of the yardstick and of a copy of its records.
struct Measure {
    rows: Duration,
    contact: Duration,
    friction: Duration,
    integration: Duration,
    passes: Duration,
    total: Duration,
    copy: Duration,
}

impl Measure {
    fn new(stages: &[Stages], copies: Vec<Duration>) -> Self {
        let of = |time: fn(&Stages) -> Duration| median(stages.iter().map(time).collect());
        Self {
            rows: of(|s| s.rows),
            contact: of(|s| s.contact),
            friction: of(|s| s.friction),
            integration: of(|s| s.integration),
            passes: of(Stages::passes),
            total: of(Stages::total),
            copy: median(copies),
        }
    }
}

/// Runs yardstick, copy and boards in turn.
pub(crate) fn measure(options: &Options) -> Outcome {
    let step = options.step()?;
    let config = BoardConfig::default();
    let in_order = step.in_order(config)?;
    let mut yardstick = Yardstick::new(&step.shapes, &step.bodies, &in_order, &step.parameters);
    let mut boards = Vec::new();
    for (name, config) in variants() {
        boards.push((name, Emulated::new(&step, config)?, Vec::new()));
    }
    let mut copy: Vec<Record> = Vec::new();
    let (mut stages, mut copies) = (Vec::new(), Vec::new());
    // The first run is not measured: it allocates all memory.
    for run in 0..=options.common.runs() {
        let solved = yardstick.solve();
        let begin = Instant::now();
        // The elements are plain words: a memcpy.
        copy.clear();
        copy.extend_from_slice(black_box(yardstick.records()));
        black_box(&copy);
        let copied = begin.elapsed();
        for (_, board, taken) in &mut boards {
            let step = board.take()?;
            if run > 0 {
                taken.push(step);
            }
        }
        if run > 0 {
            stages.push(solved);
            copies.push(copied);
        }
    }
    let expected = digest::of_bodies(&yardstick.bodies());
    for (name, board, _) in &boards {
        let found = digest::of_bodies(board.bodies());
        if found != expected {
            let error = format!("{name}: digest {found:016x}, the yardstick's is {expected:016x}");
            return Err(error.into());
        }
    }
    let measure = Measure::new(&stages, copies);
    let boards: Vec<Measured> =
        boards.iter().map(|(name, _, taken)| Measured::new(name, taken)).collect();
    if !options.common.json {
        print(&step, &measure, &boards, expected);
    }
    Ok(document(&step, &measure, &boards, expected))
}

/// Nanoseconds per collision and pass.
fn each(time: Duration, collisions: usize, passes: u32) -> f64 {
    time.as_secs_f64() * 1e9 / (collisions as f64 * f64::from(passes))
}

fn passes(step: &Step) -> u32 {
    step.parameters.contact_iterations + step.parameters.friction_iterations
}

fn print(step: &Step, measure: &Measure, boards: &[Measured], digest: u64) {
    let collisions = step.collisions.len();
    println!("A step beside the yardstick: {}", step.name);
    println!(
        "{} bodies, {collisions} collisions in the order without hazards, digest {digest:016x} of all\n",
        step.bodies.len(),
    );
    println!("  {:<38} {:>9} {:>12}", "host time", "ms", "by yardstick");
    let line = |name: &str, time: Duration| {
        let (ms, ratio) = (milliseconds(time), ratio(time, measure.total));
        println!("  {name:<38} {ms:>9.3} {ratio:>12.4}");
    };
    line("yardstick, records to results", measure.total);
    line("  constraint rows", measure.rows);
    line("  contact passes", measure.contact);
    line("  friction passes", measure.friction);
    line("  integration", measure.integration);
    line("memcpy of its records", measure.copy);
    for board in boards {
        line(&format!("{}, beats to results (wait)", board.name), board.wait);
    }
    println!();
    println!(
        "  yardstick {:.1} ns a pair and pass in the passes, {:.1} with rows and integration; memcpy of \
         the records {:.1} ns a pair\n",
        each(measure.passes, collisions, passes(step)),
        each(measure.total, collisions, passes(step)),
        each(measure.copy, collisions, 1),
    );
    if let Some(board) = boards.first() {
        println!(
            "  {:<38} {:>9} {:>12}",
            "driver, beside packing and ordering", "ms", "by yardstick"
        );
        line("outside packing, ordering and waiting", board.rest);
        line("  validate", board.validate);
        line("  start", board.start);
        line("  unpack", board.unpack);
        line("  commit", board.commit);
        println!();
    }
}

fn document(step: &Step, measure: &Measure, boards: &[Measured], digest: u64) -> Value {
    let collisions = step.collisions.len();
    let boards: Vec<Value> = boards
        .iter()
        .map(|board| {
            json!({
                "name": board.name,
                "wait_ms": milliseconds(board.wait),
                "wait_by_yardstick": ratio(board.wait, measure.total),
                "rest_ms": milliseconds(board.rest),
                "rest_by_yardstick": ratio(board.rest, measure.total),
                "validate_ms": milliseconds(board.validate),
                "start_ms": milliseconds(board.start),
                "unpack_ms": milliseconds(board.unpack),
                "commit_ms": milliseconds(board.commit),
            })
        })
        .collect();
    json!({
        "step": step.name,
        "bodies": step.bodies.len(),
        "collisions": collisions,
        "digest": { "algorithm": digest::ALGORITHM, "value": format!("{digest:016x}") },
        "yardstick": {
            "total_ms": milliseconds(measure.total),
            "rows_ms": milliseconds(measure.rows),
            "contact_ms": milliseconds(measure.contact),
            "friction_ms": milliseconds(measure.friction),
            "integration_ms": milliseconds(measure.integration),
            "ns_per_pair_and_pass": each(measure.passes, collisions, passes(step)),
            "ns_per_pair_and_pass_of_total": each(measure.total, collisions, passes(step)),
            "memcpy_ms": milliseconds(measure.copy),
            "memcpy_ns_per_pair": each(measure.copy, collisions, 1),
        },
        "boards": boards,
    })
}
