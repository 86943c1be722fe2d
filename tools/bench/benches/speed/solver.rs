//! Compares a step of the emulated board with the yardstick.

use std::time::Duration;

use bench::step::Emulated;
use bench::{median, milliseconds, ratio};
use bitstream_model::BoardConfig;
use step_folder::digest;
use yardstick::{Stages, Yardstick};

use crate::{Options, Outcome};

/// Numbers of threads of the board.
const THREADS: [usize; 2] = [1, 2];

/// Runs yardstick and boards in turn.
pub(crate) fn measure(options: &Options) -> Outcome {
    let step = options.step()?;
    let in_order = step.in_order(BoardConfig::default())?;
    let mut yardstick = Yardstick::new(&step.shapes, &step.bodies, &in_order, &step.parameters);
    let mut boards = Vec::new();
    for threads in THREADS {
        let config = BoardConfig { threads, ..BoardConfig::default() };
        boards.push((threads, Emulated::new(&step, config)?, Vec::new()));
    }
    let mut stages = Vec::new();
    // The first run is not measured: it allocates all memory.
    for run in 0..=options.common.runs() {
        let solved = yardstick.solve();
        for (_, board, waits) in &mut boards {
            let taken = board.take()?;
            if run > 0 {
                waits.push(taken.host.wait);
            }
        }
        if run > 0 {
            stages.push(solved);
        }
    }
    let expected = digest::of_bodies(&yardstick.bodies());
    for (threads, board, _) in &boards {
        let found = digest::of_bodies(board.bodies());
        if found != expected {
            return Err(format!(
                "board, {threads} threads: digest {found:016x}, the yardstick's is {expected:016x}"
            )
            .into());
        }
    }
    let stage = |time: fn(&Stages) -> Duration| median(stages.iter().map(time).collect());
    let total = stage(Stages::total);
    println!("A step beside the yardstick: {}", step.name);
    println!(
        "{} bodies, {} collisions in the order without hazards, digest {expected:016x} of all\n",
        step.bodies.len(),
        step.collisions.len(),
    );
    println!("  {:<38} {:>9} {:>12}", "host time", "ms", "by yardstick");
    let line = |name: &str, time: Duration| {
        println!("  {name:<38} {:>9.3} {:>12.4}", milliseconds(time), ratio(time, total));
    };
    line("yardstick, records to results", total);
    line("  constraint rows", stage(|s| s.rows));
    line("  contact passes", stage(|s| s.contact));
    line("  friction passes", stage(|s| s.friction));
    line("  integration", stage(|s| s.integration));
    for (threads, _, waits) in boards {
        line(&format!("board, {threads} threads, beats to results"), median(waits));
    }
    println!();
    Ok(())
}
