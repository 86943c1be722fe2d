//! Measures a step on the emulated board of every design, without short cuts and by default.

use std::error::Error;
use std::time::Duration;

use bench::step::{Emulated, Step};
use bench::{median, milliseconds, ratio};
use bitstream_model::BoardConfig;
use bitstream_model::interface::profile::{PROFILES, Profile};
use serde_json::{Value, json};
use step_folder::digest;

use crate::{Options, Outcome};

/// Ways of computing a step, with the same bits: the number of threads, and whether the board takes
/// its short cuts.
const WAYS: [(&str, usize, bool); 3] =
    [("the long way", 1, false), ("1 thread", 1, true), ("2 threads", 2, true)];

struct Row {
    profile: &'static str,
    /// The time of each way.
    times: [Duration; WAYS.len()],
    digest: u64,
}

/// Most runs of each way: without short cuts, a step in sixteen bits takes a second and more.
const RUNS_MAX: usize = 3;

pub(crate) fn measure(options: &Options) -> Outcome {
    let step = options.step()?;
    let mut rows = Vec::new();
    for profile in PROFILES {
        rows.push(row(&step, profile, options.common.runs().min(RUNS_MAX))?);
    }
    if !options.common.json {
        print(&step, &rows);
    }
    let rows: Vec<Value> = rows
        .iter()
        .map(|row| {
            let [long, one, two] = row.times.map(milliseconds);
            json!({
                "profile": row.profile,
                "digest": format!("{:016x}", row.digest),
                "long_way_ms": long,
                "one_thread_ms": one,
                "two_threads_ms": two,
            })
        })
        .collect();
    Ok(json!({ "step": step.name, "profiles": rows }))
}

/// Measures the ways of one design in turn.
fn row(step: &Step, profile: &'static Profile, runs: usize) -> Result<Row, Box<dyn Error>> {
    let mut boards = Vec::new();
    for (_, threads, shortcuts) in WAYS {
        let config = BoardConfig { profile, threads, shortcuts, ..BoardConfig::default() };
        boards.push(Emulated::new(step, config)?);
    }
    let mut times = [const { Vec::new() }; WAYS.len()];
    // The first run is not measured: it allocates all memory.
    for run in 0..=runs {
        for (board, times) in boards.iter_mut().zip(&mut times) {
            let taken = board.take()?;
            if run > 0 {
                times.push(taken.report.host.wait);
            }
        }
    }
    let digests: Vec<u64> = boards.iter().map(|board| digest::of_bodies(board.bodies())).collect();
    if digests.iter().any(|digest| *digest != digests[0]) {
        return Err(format!("{}: digests {digests:016x?}", profile.name).into());
    }
    Ok(Row { profile: profile.name, times: times.map(median), digest: digests[0] })
}

fn print(step: &Step, rows: &[Row]) {
    println!("A step on the emulated board of each design, beats to results: {}", step.name);
    print!("  {:<12}", "ms");
    for (name, ..) in WAYS {
        print!(" {name:>12}");
    }
    println!(" {:>13}  digest", "last by first");
    for row in rows {
        let [long, one, two] = row.times;
        println!(
            "  {:<12} {:>12.3} {:>12.3} {:>12.3} {:>13.3}  {:016x}",
            row.profile,
            milliseconds(long),
            milliseconds(one),
            milliseconds(two),
            ratio(two, long),
            row.digest
        );
    }
    println!();
}
