//! Runs every target briefly; the program does the long runs.

use std::time::Duration;

use fuzz::campaign::{self, Plan, Summary};
use fuzz::targets;

fn short(name: &str, executions: u64) -> Summary {
    let target = targets::by_name(name).expect("a target");
    let time = Duration::MAX;
    let plan = Plan { first: 0, executions, time, seed: 7, threads: 2 };
    let summary = campaign::run(target, &plan);
    assert_eq!((summary.executions, summary.panicked), (executions, None), "{name}");
    summary
}

#[test]
fn registers() {
    let tally = short("registers", 2000).tally;
    assert!(tally.beats > 100 && tally.descriptors > 10 && tally.violations > 100, "{tally:?}");
}

#[test]
fn chains() {
    let tally = short("chains", 800).tally;
    assert!(tally.beats > 10_000 && tally.descriptors > 500 && tally.violations > 500, "{tally:?}");
}

#[test]
fn packets() {
    let tally = short("packets", 400).tally;
    assert!(tally.steps > 100 && tally.refused > 50 && tally.violations == 0, "{tally:?}");
}

#[test]
fn folders() {
    let tally = short("folders", 2000).tally;
    assert!(tally.steps > 500 && tally.refused > 200, "{tally:?}");
}

#[test]
fn confinement() {
    let tally = short("confinement", 150).tally;
    assert!(tally.steps > 500 && tally.refused > 10 && tally.violations == 0, "{tally:?}");
}

#[test]
fn faults() {
    let tally = short("faults", 300).tally;
    assert!(tally.steps > 500 && tally.refused > 50 && tally.faults > 100, "{tally:?}");
}

#[test]
fn requests() {
    let tally = short("requests", 300).tally;
    assert!(tally.registers > 200 && tally.refused > 20, "{tally:?}");
}

#[test]
fn answers() {
    let tally = short("answers", 60).tally;
    assert!(tally.steps > 5 && tally.refused > 5, "{tally:?}");
}

#[test]
fn devices() {
    let tally = short("devices", 400).tally;
    assert!(tally.steps > 40 && tally.refused > 40, "{tally:?}");
}

#[test]
fn loads() {
    let tally = short("loads", 2000).tally;
    assert!(tally.steps > 200 && tally.refused > 500, "{tally:?}");
}

#[test]
fn calls() {
    let tally = short("calls", 400).tally;
    assert!(tally.steps > 20 && tally.refused > 200, "{tally:?}");
}

#[test]
fn the_shortest_inputs_are_taken_too() {
    for target in targets::ALL {
        for input in [&[][..], &[0], &[255], &[0; 64], &[255; 64]] {
            (target.run)(input);
        }
    }
}
