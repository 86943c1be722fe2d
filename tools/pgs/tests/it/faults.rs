//! Faults of the emulated board on the command line: planned ones, and the table of all faults.

use std::process::{Command, Output};

use serde_json::Value;

fn pgs(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_pgs"))
        .args(arguments)
        .env_remove("RUST_LOG")
        .output()
        .expect("the program runs")
}

fn document(output: &Output) -> Value {
    let text = String::from_utf8_lossy(&output.stdout);
    serde_json::from_str(&text).unwrap_or_else(|error| panic!("{error}: {text}"))
}

const SMALL: [&str; 8] =
    ["run", "--board", "emulated", "--grid", "3x3x3", "--steps", "4", "--drop"];

fn run(more: &[&str]) -> Output {
    let arguments: Vec<_> = SMALL.iter().chain(&["0.05"]).chain(more).copied().collect();
    pgs(&arguments)
}

/// Tests the design with the fewest cells; `pgs faults` tries the others.
#[test]
fn every_fault_at_every_place_of_the_simplest_design_is_met() {
    let output = pgs(&["faults", "--board", "emulated:naive", "--json"]);
    let found = document(&output);
    let naive = &found["profiles"][0];
    assert_eq!(naive["profile"], "naive");
    let wrong: Vec<_> = naive["cells"]
        .as_array()
        .expect("cells")
        .iter()
        .filter(|cell| cell["passed"] != true)
        .collect();
    assert!(wrong.is_empty(), "{wrong:#?}");
    let tally = &naive["tally"];
    assert!(tally["tried"].as_u64().is_some_and(|tried| tried > 500), "{tally}");
    for column in ["happened", "named", "bodies", "in_time", "next", "passed"] {
        assert_eq!(tally[column], tally["tried"], "{column}");
    }
    assert_eq!(output.status.code(), Some(0));
}

#[test]
fn a_cell_can_be_replayed_from_its_line() {
    let list = String::from_utf8(pgs(&["faults", "--list", "--board", "emulated:float"]).stdout);
    let list = list.expect("text");
    let line = "dma-dec-err@dma2.mm2s,phase=contact2,beat=0";
    assert!(list.lines().any(|found| found.ends_with(line)), "{list}");
    assert!(list.lines().count() > 1500);
    let output = run(&["--fault", line]);
    assert_eq!(output.status.code(), Some(4));
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(said.contains("DMADecErr on dma2 MM2S in contact pass 2"), "{said}");
}

#[test]
fn a_list_of_cells_for_programs_is_a_document_with_the_lines_for_people() {
    let naive = ["faults", "--list", "--board", "emulated:naive"];
    let list = |more: &[&str]| pgs(&[&naive, more].concat());
    let found = document(&list(&["--json"]));
    let profiles = found["profiles"].as_array().expect("profiles");
    let lines: Vec<String> = profiles
        .iter()
        .flat_map(|of| {
            of["cells"].as_array().expect("cells").iter().map(|cell| (&of["profile"], cell))
        })
        .map(|(name, cell)| {
            assert!(cell["kind"].is_string() && cell["phase"].is_string(), "{cell}");
            format!("{} {}", name.as_str().expect("text"), cell["fault"].as_str().expect("text"))
        })
        .collect();
    let text = String::from_utf8(list(&[]).stdout).expect("text");
    assert!(lines.len() > 500 && lines.iter().eq(text.lines()), "{text}");
}

#[test]
fn a_fault_that_is_survived_changes_nothing_and_one_that_is_not_is_taken_again() {
    let plain = document(&run(&["--json"]));
    for (fault, retries) in [("irq-drop,n=2", 0), ("stall@dma1.mm2s,step=2", 1)] {
        let retried = ["--json", "--retries", "1", "--deadline", "20", "--fault", fault];
        let found = document(&run(&retried));
        assert_eq!(found["digest"], plain["digest"], "{fault}");
        assert_eq!(found["faults"]["happened"], 1, "{fault}");
        let steps = found["steps"].as_array().expect("steps");
        let taken: u64 = steps.iter().filter_map(|step| step["retries"].as_u64()).sum();
        assert_eq!(taken, retries, "{fault}");
    }
    assert_eq!(plain["faults"], Value::Null);
}

#[test]
fn a_seed_is_a_plan_and_no_plan_is_refused() {
    let output = run(&["--fault", "seed:3", "--json"]);
    assert!(matches!(output.status.code(), Some(0 | 4)), "{output:?}");
    let output = run(&["--fault", "stal@dma1.mm2s"]);
    assert_eq!(output.status.code(), Some(2));
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(said.contains("no fault is named \"stal\"; expected one of"), "{said}");
}
