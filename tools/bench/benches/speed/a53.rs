//! Estimates the time of packing a step on a Cortex-A53, on paper: nothing is measured on one.
//!
//! Instructions are counted on this machine; clock and bandwidth are published figures, see
//! `docs/a53-cost.md`.

use std::time::Duration;

use bench::milliseconds;
use bench::step::Emulated;
use bitstream_model::BoardConfig;
use bitstream_model::interface::profile::FLOAT;
use step_trace::A53_COPIES;

use crate::callgrind::{Only, count, is_there};
use crate::{Options, Outcome};

/// The APU's clock on the ZCU102, Hz.
const CLOCK: f64 = 1.2e9;
/// Instructions per clock: the core is in-order and issues at most two.
const PER_CLOCK: [f64; 2] = [1.0, 2.0];

fn seconds(time: f64) -> Duration {
    Duration::from_secs_f64(time)
}

pub(crate) fn measure(options: &Options) -> Outcome {
    if !is_there("a53") {
        return Ok(());
    }
    let (instructions, _, packed) =
        count(options, Only::Pack, "zynq_pgs::beat::collisions::CollisionPacker::write*")?;
    let each = instructions / packed;
    let step = options.step()?;
    let report = Emulated::new(&step, BoardConfig::default())?.take()?;
    let words = FLOAT.default_variant().words();
    let bytes = |words: u32, records: u64| f64::from(words * u32::BITS / 8) * records as f64;
    let entries = report.collisions + report.empty;
    let collisions = bytes(words.collision, entries);
    let bodies = bytes(words.velocity + words.pose, report.bodies);
    let results = bytes(words.result, report.bodies);
    let device = report.modelled_time();
    let computing = PER_CLOCK.map(|rate| seconds(each * entries as f64 / (CLOCK * rate)));
    let rows: Vec<(u32, Duration, Duration)> = A53_COPIES
        .iter()
        .map(|(cores, rate)| {
            (*cores, seconds((collisions + bodies) / rate), seconds(results / rate))
        })
        .collect();
    println!("A step on a Cortex-A53, on paper: {}", step.name);
    println!(
        "  {:.2} MB of collisions and {:.2} MB of bodies are written, {:.2} MB of results read",
        collisions / 1e6,
        bodies / 1e6,
        results / 1e6
    );
    let [one, two] = computing.map(milliseconds);
    println!(
        "  packing takes {each:.0} instructions a collision: {one:.1} ms at one a clock, {two:.1} \
         at two"
    );
    println!("  the accelerator takes {:.2} ms at 12.8 GB/s (modelled)", milliseconds(device));
    println!("  cores  writing  reading  one after the other  overlapped");
    for (cores, write, read) in &rows {
        let host = *write + *read;
        println!(
            "  {cores:>5} {:>8.2} {:>8.2} {:>20.2} {:>11.2}",
            milliseconds(*write),
            milliseconds(*read),
            milliseconds(host + device),
            milliseconds(host.max(device))
        );
    }
    println!();
    Ok(())
}
