//! The files that show the inside of a step: what they have, who gets them, and the picture of the
//! README.

use std::fs;
use std::io::{BufRead as _, BufReader, Read as _};
use std::path::Path;
use std::process::Stdio;

use serde_json::Value;

use crate::common::{golden, pgs, run, signal, text};

/// The arguments that the page of the command line gives for the picture.
const PICTURE: &str = "run --grid 36x26x36 --drop 0 --steps 3 --contact-iterations 4 --friction-iterations 4 --board \
     emulated:float,bandwidth=16 --timeline docs/step.svg";

fn repository() -> &'static Path {
    Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../.."))
}

#[test]
fn the_picture_of_the_readme_is_what_its_command_draws() {
    let page = fs::read_to_string(repository().join("docs/command-line.md")).expect("the page");
    let command = format!("cargo run --release -- {PICTURE}");
    assert!(page.contains(&command), "the page names {command:?}");
    let folder = tempfile::tempdir().expect("a directory");
    let drawn = folder.path().join("step.svg");
    let words = PICTURE.split_whitespace();
    let ran = run(words.map(|word| if word == "docs/step.svg" { text(&drawn) } else { word }));
    assert_eq!(ran.code, Some(0), "{}", ran.stderr);
    let named = format!("timeline   {}", text(&drawn));
    assert!(ran.stdout.lines().any(|line| line == named), "{}", ran.stdout);
    let drawn = fs::read_to_string(drawn).expect("the picture");
    let kept = fs::read_to_string(repository().join("docs/step.svg")).expect("the picture");
    assert!(drawn == kept, "docs/step.svg is another picture; draw it anew: {command}");
}

#[test]
fn a_recorded_step_has_the_results_of_any_other() {
    let folder = tempfile::tempdir().expect("a directory");
    let [vcd, trace, timeline] =
        ["step.vcd", "step.json", "step.svg"].map(|name| folder.path().join(name));
    let step = golden("pile5_step60");
    let plain = run(["solve", text(&step), "--compare", "--json"]);
    let files = ["--vcd", text(&vcd), "--trace", text(&trace), "--timeline", text(&timeline)];
    let arguments = ["solve", text(&step), "--compare", "--json"].into_iter().chain(files);
    let traced = run(arguments);
    assert_eq!((traced.code, traced.stderr.as_str()), (Some(0), ""));
    let (plain, traced) = (plain.json(), traced.json());
    assert_eq!(traced["digest"], plain["digest"]);
    for key in ["cycles", "hazards", "register_reads", "register_writes", "doorbells"] {
        assert!(!traced["step"][key].is_null(), "{key}");
        assert_eq!(traced["step"][key], plain["step"][key], "{key}");
    }
    assert!(plain["traced"].is_null());
    assert_eq!(traced["traced"]["vcd"], text(&vcd));
    let dump = fs::read_to_string(vcd).expect("the dump");
    assert!(dump.contains("$scope module mm2s3 $end") && dump.contains(" tvalid $end"));
    let events: Value =
        serde_json::from_slice(&fs::read(trace).expect("the events")).expect("a document");
    assert_eq!(events["otherData"]["clock_khz"], 275_000);
    assert!(fs::read_to_string(timeline).expect("the picture").starts_with("<svg "));
}

#[test]
fn a_run_shows_the_step_that_is_named_or_the_last() {
    let folder = tempfile::tempdir().expect("a directory");
    let trace = folder.path().join("step.json");
    let scene = ["run", "--grid", "2x2x2", "--steps", "9", "--json", "--trace", text(&trace)];
    let clock = |rest: &[&str]| {
        let ran = run(scene.iter().chain(rest));
        assert_eq!(ran.code, Some(0), "{}", ran.stderr);
        let read = fs::read(&trace).expect("the events");
        let events: Value = serde_json::from_slice(&read).expect("a document");
        let stages: u64 = events["traceEvents"]
            .as_array()
            .expect("events")
            .iter()
            .filter(|event| event["args"].get("stalls").is_some())
            .map(|event| event["args"]["clocks"].as_u64().expect("a number"))
            .sum();
        let steps = &ran.json()["steps"];
        let place = steps
            .as_array()
            .expect("steps")
            .iter()
            .map(|step| step["cycles"]["total"].as_u64().expect("a number"));
        (stages, place.collect::<Vec<_>>(), events["otherData"]["first_clock"].as_u64())
    };
    let (fourth, steps, begin) = clock(&["--traced-step", "4"]);
    assert_eq!(fourth, steps[3]);
    let (last, steps, end) = clock(&[]);
    assert_eq!(last, steps[8]);
    assert!(begin < end);
}

#[test]
fn a_step_that_fails_is_shown_up_to_its_end() {
    let folder = tempfile::tempdir().expect("a directory");
    let trace = folder.path().join("step.json");
    let step = golden("two_cubes");
    let fault = ["--fault", "dma-dec-err@dma2.mm2s", "--trace", text(&trace)];
    let ran = run(["solve", text(&step)].into_iter().chain(fault));
    assert_eq!(ran.code, Some(4), "{}", ran.stderr);
    let read = fs::read(&trace).expect("the events");
    let events: Value = serde_json::from_slice(&read).expect("a document");
    let all = events["traceEvents"].as_array().expect("events");
    assert!(
        all.iter().any(|event| event["name"].as_str().is_some_and(|name| name.contains("DMASR")))
    );
    assert!(all.iter().all(|event| event["cat"] != "host"));
}

#[test]
fn a_step_that_is_refused_before_its_first_clock_has_no_files() {
    let folder = tempfile::tempdir().expect("a directory");
    let step = folder.path().join("step");
    fs::create_dir(&step).expect("a folder");
    for file in fs::read_dir(golden("two_cubes")).expect("the folder") {
        let file = file.expect("a file");
        fs::copy(file.path(), step.join(file.file_name())).expect("copied");
    }
    let turns = step.join("body_quat.npy");
    let mut bytes = fs::read(&turns).expect("the array");
    let values = 10 + usize::from(u16::from_le_bytes([bytes[8], bytes[9]]));
    // Body 1 has no orientation.
    bytes[values + 16..values + 32].fill(0);
    fs::write(&turns, bytes).expect("the array");
    let file = folder.path().join("step.svg");
    let mut command = pgs();
    command.env("RUST_LOG", "warn").args(["solve", text(&step), "--timeline", text(&file)]);
    let ran = command.output().expect("it starts");
    let said = String::from_utf8_lossy(&ran.stderr);
    assert_eq!((ran.status.code(), ran.stdout.as_slice()), (Some(2), &b""[..]), "{said}");
    assert!(said.contains("no file shows the step: no clock"), "{said}");
    assert!(!file.exists());
}

#[test]
fn a_run_that_ends_before_the_step_names_no_files() {
    let folder = tempfile::tempdir().expect("a directory");
    let file = folder.path().join("step.json");
    let mut command = pgs();
    command.args(["run", "--grid", "2x2x2", "--steps", "100000000", "--report-every", "1"]);
    command.arg("--trace").arg(&file);
    let child = command.stdout(Stdio::piped()).stderr(Stdio::null()).spawn().expect("it starts");
    let mut child = crate::common::Tied(child);
    let mut lines = BufReader::new(child.0.stdout.take().expect("a pipe"));
    let mut line = String::new();
    while line.split_whitespace().next() != Some("1") {
        line.clear();
        assert!(lines.read_line(&mut line).expect("text") > 0, "the run goes on");
    }
    signal("-TERM", child.0.id());
    let mut rest = String::new();
    lines.read_to_string(&mut rest).expect("text");
    assert_eq!(child.0.wait().expect("it ends").code(), Some(130));
    assert!(rest.contains("trace      not written: no clock"), "{rest}");
    assert!(!file.exists());
}

#[test]
fn only_an_emulated_board_of_this_process_shows_its_inside() {
    let folder = tempfile::tempdir().expect("a directory");
    let socket = folder.path().join("board");
    let mut serve = pgs();
    serve.args(["serve", "--memory-mib", "16", "--socket"]).arg(&socket);
    let child = serve.stdout(Stdio::piped()).stderr(Stdio::null()).spawn().expect("it starts");
    let mut child = crate::common::Tied(child);
    let out = child.0.stdout.as_mut().expect("a pipe");
    let serving = std::io::BufRead::lines(std::io::BufReader::new(out))
        .find(|line| line.as_ref().is_ok_and(|line| line.starts_with("serving ")));
    assert!(serving.is_some(), "a board is served");
    let board = format!("socket:{}", text(&socket));
    let file = folder.path().join("step.vcd");
    let step = golden("one_cube");
    for verb in [&["solve", text(&step)][..], &["run", "--grid", "2x2x2"]] {
        let there = ["--board", &board, "--vcd", text(&file)];
        let ran = run(verb.iter().copied().chain(there));
        assert_eq!((ran.code, ran.stdout.as_str()), (Some(2), ""));
        assert!(ran.stderr.contains("this board is served by another process"), "{}", ran.stderr);
        assert!(ran.stderr.contains("leave out --vcd"), "{}", ran.stderr);
        assert!(!file.exists());
    }
    for (arguments, reason) in [
        (&["--traced-step", "3"][..], "add --vcd, --trace or --timeline FILE"),
        (&["--traced-step", "7", "--steps", "6", "--vcd", text(&file)], "the run has 6 steps"),
    ] {
        let ran = run(["run", "--grid", "2x2x2"].iter().chain(arguments));
        assert_eq!(ran.code, Some(2));
        assert!(ran.stderr.contains(reason), "{}", ran.stderr);
    }
}
