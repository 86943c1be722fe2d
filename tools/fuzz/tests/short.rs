//! Runs every target briefly; the program does the long runs.

use std::time::Duration;

use fuzz::campaign::{self, Plan, Summary};
use fuzz::finding::{self, Ending, Finding};
use fuzz::targets;

fn short(name: &str, executions: u64) -> Summary {
    let target = targets::by_name(name).expect("a target");
    let limit = Duration::from_secs(60);
    let plan = Plan { executions, time: Duration::MAX, seed: 7, threads: 2, limit };
    let summary = campaign::run(target, &plan, |_| ());
    if let Some(finding) = &summary.finding {
        panic!("{name}, execution {}: {}\n{:02x?}", finding.number, finding.ending, finding.input);
    }
    assert_eq!(summary.executions, executions);
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
            finding::run(target, input)
                .unwrap_or_else(|message| panic!("{}: {message}", target.name));
        }
    }
}

#[test]
fn a_saved_finding_is_loaded_as_it_was() {
    let folder = tempfile::tempdir().expect("a folder");
    let input: Vec<u8> = (0..=255).collect();
    let ending = Ending::Panic("one\ntwo".to_owned());
    let finding = Finding { target: "chains", number: 5, input: input.clone(), ending };
    let path = finding.save(&folder.path().join("new")).expect("written");
    let (target, loaded) = finding::load(&path).expect("its own file");
    assert_eq!((target.name, loaded), ("chains", input));

    std::fs::write(&path, "target chains\n0g\n").expect("written");
    let error = finding::load(&path).expect_err("no digit").to_string();
    assert!(error.contains("line 2: expected pairs of hexadecimal digits"), "{error}");
    std::fs::write(&path, "target nothing\n").expect("written");
    let error = finding::load(&path).expect_err("no target").to_string();
    assert!(error.contains("line 1: expected \"target\""), "{error}");
}
