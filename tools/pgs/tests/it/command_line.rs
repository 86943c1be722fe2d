//! The command line keeps its promises: help, exit codes, JSON, closed pipes, Ctrl-C.

#![allow(clippy::print_stdout, reason = "a test says aloud what it skips")]

use std::io::{BufRead, BufReader};
use std::process::{Command, Stdio};

use crate::common;
use crate::common::{Ran, golden, patch, pgs, run};
use serde_json::Value;

fn assert_keys(value: &Value, keys: &[&str]) {
    for key in keys {
        assert!(value.get(key).is_some(), "no key {key} in {value:#}");
    }
}

#[test]
fn every_help_has_an_example() {
    for verb in [
        &[][..],
        &["run"],
        &["solve"],
        &["thesis"],
        &["thesis", "compare"],
        &["thesis", "formats"],
        &["thesis", "order"],
        &["list"],
        &["load"],
        &["check"],
        &["serve"],
    ] {
        let ran = run(verb.iter().copied().chain(["--help"]));
        assert_eq!(ran.code, Some(0), "{verb:?}");
        let example = format!("  pgs{}", verb.iter().map(|v| format!(" {v}")).collect::<String>());
        assert!(ran.stdout.contains("\nExamples"), "{verb:?}: {}", ran.stdout);
        assert!(ran.stdout.contains(&example), "{verb:?}: {}", ran.stdout);
        assert!(ran.stderr.is_empty());
    }
}

#[test]
fn wrong_usage_ends_with_2_and_says_so_on_stderr() {
    let folder = golden("two_cubes");
    let folder = folder.to_str().expect("a path in UTF-8");
    for arguments in [
        &["frobnicate"][..],
        &["--steps", "0"],
        &["--grid", "0x1x1"],
        &["--grid", "180x1000x180"],
        &["thesis", "order", "--grid", "180x1000x180"],
        &["--steps", "5", "list"],
        &["list", "--board", "abacus"],
        &["solve"],
        &["solve", "/nonexistent"],
        &["thesis", "cycles", "--collisions", "1"],
        &["solve", folder, "--compare", "--contact-iterations", "3"],
        &[
            "solve",
            folder,
            "--compare",
            "--no-integrate",
            "--contact-iterations",
            "5",
            "--friction-iterations",
            "0",
        ],
        &[
            "solve",
            folder,
            "--compare",
            "--no-integrate",
            "--contact-iterations",
            "3",
            "--friction-iterations",
            "1",
        ],
        &[
            "solve",
            folder,
            "--compare",
            "--no-integrate",
            "--contact-iterations",
            "0",
            "--friction-iterations",
            "0",
        ],
        &["solve", folder, "--contact-iterations", "256"],
    ] {
        let ran = run(arguments);
        assert_eq!(ran.code, Some(2), "{arguments:?}: {}", ran.stderr);
        assert!(ran.stderr.starts_with("error: "), "{arguments:?}: {}", ran.stderr);
        assert!(!ran.stderr.contains("panicked"), "{arguments:?}: {}", ran.stderr);
        assert!(ran.stdout.is_empty(), "{arguments:?}: {}", ran.stdout);
    }
}

#[test]
fn a_wrong_verb_or_option_gets_a_suggestion() {
    for (words, similar) in [
        ("checks", "check"),
        ("solves x", "solve"),
        ("thesis determine", "determinism"),
        ("--step 4", "--steps"),
        ("run --boards emulated", "--board"),
        ("serve --sockets x", "--socket"),
    ] {
        let ran = run(words.split(' '));
        assert_eq!(ran.code, Some(2), "{}", ran.stderr);
        let tip = ran.stderr.lines().find(|line| line.contains("similar"));
        assert!(tip.is_some_and(|tip| tip.contains(similar)), "{words}: {}", ran.stderr);
    }
}

#[test]
fn a_wrong_board_is_refused_with_the_words_that_name_one() {
    for (board, part) in [
        ("abacus", "give auto, uio[:NODE], devmem, emulated[:BUILD] or socket:PATH"),
        ("emulated:quick", "begin with a profile (naive, float, half)"),
        ("emulated:float,quick", "give one of f32, binary16, interlocked, unchecked, queue=DEPTH"),
        ("emulated:float,window=0", "expected a whole number from 1 to"),
        ("emulated:float,bandwidth=0", "expected a number of GB/s from 0.1 to 1000"),
        ("uio:", "give auto"),
    ] {
        let ran = run(["run", "--board", board]);
        assert_eq!(ran.code, Some(2), "{}", ran.stderr);
        assert!(ran.stderr.contains(part), "{board}: {}", ran.stderr);
    }
    let quirk = run(["check", "--board", "devmem", "--quirk", "stale"]);
    assert_eq!(quirk.code, Some(2), "{}", quirk.stderr);
    assert!(quirk.stderr.contains("--board emulated"), "{}", quirk.stderr);
}

#[test]
fn memory_is_refused_for_an_emulated_board() {
    let ran = run(["--board", "emulated", "--memory", "uio"]);
    assert_eq!(ran.code, Some(2), "{}", ran.stderr);
    assert!(ran.stderr.contains("--memory is for real boards"), "{}", ran.stderr);
}

#[test]
fn a_missing_board_ends_with_3_and_the_next_step() {
    if std::path::Path::new("/sys/class/uio").exists() {
        common::skipped("this machine has UIO nodes");
        return;
    }
    let ran = run(["--board", "uio"]);
    assert_eq!(ran.code, Some(3), "{}", ran.stderr);
    assert!(ran.stderr.contains("because: no UIO node named \"pgs\""), "{}", ran.stderr);
    assert!(ran.stderr.contains("next: "), "{}", ran.stderr);
}

#[test]
fn falling_back_to_the_emulated_board_is_said_without_a_warning() {
    if std::path::Path::new("/sys/class/uio").exists() {
        common::skipped("this machine has UIO nodes");
        return;
    }
    let ran = |arguments: &str| {
        let mut pgs = pgs();
        let pgs = pgs.env_remove("RUST_LOG").args(arguments.split(' ')).args(["--board", "auto"]);
        let ran = Ran::from(pgs.output().expect("it starts"));
        assert_eq!(ran.code, Some(0), "{}", ran.stderr);
        ran
    };
    let run = ran("run --grid 1x1x1 --steps 1");
    assert!(run.stdout.starts_with("board      emulated (there is no UIO node"), "{}", run.stdout);
    assert_eq!(run.stderr, "");
    let board = ran("run --grid 1x1x1 --steps 1 --json").json()["board"].clone();
    assert_eq!(board["kind"], "emulated");
    assert!(board["reason"].as_str().is_some_and(|why| why.starts_with("there is no UIO node")));
    // The results of other verbs do not name the board.
    let order = ran("thesis order --grid 2x2x2 --steps 1");
    assert!(order.stderr.starts_with("board: emulated (there is no UIO node"), "{}", order.stderr);
    assert_eq!(order.stderr.lines().count(), 1, "{}", order.stderr);
}

#[test]
fn run_reports_every_step_as_json() {
    let ran = run(["--json", "--grid", "4x4x4", "--steps", "3", "--drop", "0"]);
    assert_eq!(ran.code, Some(0), "{}", ran.stderr);
    let document = ran.json();
    assert_keys(&document, &["schema", "verb", "config", "board", "complete", "steps", "digest"]);
    assert_eq!(document["schema"], 1);
    assert_eq!(document["digest"]["algorithm"], "fnv1a-64");
    let steps = document["steps"].as_array().expect("an array of steps");
    assert_eq!(steps.len(), 3);
    for (k, step) in steps.iter().enumerate() {
        assert_eq!(step["step"], k + 1);
        assert_keys(
            step,
            &[
                "collisions",
                "ground_pairs",
                "impulse_sum_n_s",
                "kinetic_energy_j",
                "cycles",
                "modelled_ms",
                "limit",
                "hazards",
                "register_reads",
                "register_writes",
                "doorbells",
                "interrupts",
                "host_ms",
                "host_on_a53_ms",
            ],
        );
    }
    assert_eq!(steps[0]["ground_pairs"], 16);
    let host = steps[2]["host_on_a53_ms"].as_object().expect("an object");
    let sum = |skip: [&str; 3]| -> f64 {
        let parts = host.iter().filter(|(name, _)| !skip.contains(&name.as_str()));
        parts.map(|(_, ms)| ms.as_f64().expect("a number")).sum()
    };
    let step = host["step"].as_f64().expect("a number");
    assert!(step > 0.0 && (sum(["step", "detection", "software"]) - step).abs() < 1e-9, "{host:?}");
}

#[test]
fn reports_say_how_the_board_is_built() {
    let scene = ["--grid", "2x2x2", "--steps", "2", "--drop", "0"];
    let board = ["--json", "--board", "emulated:half,f32,unchecked,window=64"];
    let ran = run([&board, &scene[..]].concat());
    assert_eq!(ran.code, Some(0), "{}", ran.stderr);
    let board = &ran.json()["board"];
    assert_eq!(board["profile"], "half");
    assert_eq!(board["design"], "half,f32");
    assert_eq!(board["emulation"]["build"], "half,f32,unchecked,window=64");
    assert!(ran.json()["steps"][1]["host_on_a53_ms"].is_null(), "sixteen bits are not counted");
    let text = run([&["--board", "emulated:half,f32"], &scene[..]].concat()).stdout;
    assert!(text.contains("bitstream  half,f32, 250 MHz"), "{text}");
    assert!(text.contains("\nratio      not counted "), "{text}");
}

#[test]
fn two_runs_have_one_digest_and_another_scene_has_another() {
    let digest = |arguments: &[&str]| {
        let ran = run(arguments);
        assert_eq!(ran.code, Some(0), "{}", ran.stderr);
        ran.stdout.lines().last().expect("a last line").to_owned()
    };
    let scene = ["run", "--grid", "3x3x3", "--steps", "5", "--drop", "0"];
    let first = digest(&scene);
    assert!(first.starts_with("digest     fnv1a-64 "), "{first}");
    assert_eq!(first, digest(&scene[1..]), "without the verb");
    assert_ne!(first, digest(&["run", "--grid", "3x3x4", "--steps", "5", "--drop", "0"]));
}

#[test]
fn a_step_takes_as_long_as_the_deadline_says_and_no_longer() {
    let slow = "run --board emulated:float,bandwidth=0.1 --grid 6x6x6 --steps 1";
    let slow: Vec<&str> = slow.split(' ').collect();
    let with = |deadline: &[&str]| run(slow.iter().chain(deadline));
    let late = with(&["--deadline", "1"]);
    assert_eq!(late.code, Some(4), "{}", late.stderr);
    assert!(late.stderr.contains("did not come within 1ms"), "{}", late.stderr);
    let patient = with(&["--deadline", "60000"]);
    assert_eq!(patient.code, Some(0), "{}", patient.stderr);
    assert_eq!(with(&["--deadline", "0"]).code, Some(2));
}

/// A step beyond its deadline is reported: in lines, as a document, in a report.
#[test]
fn a_step_that_fails_is_told_with_every_channel_for_people_programs_and_bug_reports() {
    let folder = tempfile::tempdir().expect("a directory");
    let report = folder.path().join("fault.json");
    let path = report.to_str().expect("text");
    let scene = "--board emulated:float,bandwidth=0.1 --grid 6x6x6 --steps 1 --retries 2";
    let scene: Vec<&str> = scene.split(' ').collect();
    let passes = ["--contact-iterations", "4", "--friction-iterations", "4"];
    let slow = [&scene[..], &passes].concat();
    let late = ["--deadline", "1", "--report", path];

    let ran = run(["run"].iter().chain(&slow).chain(&late));
    assert_eq!((ran.code, ran.stdout.as_str()), (Some(4), ""), "{}", ran.stderr);
    assert!(ran.stderr.contains("\ndiagnosis  deadline in contact pass 2, "), "{}", ran.stderr);
    assert!(ran.stderr.contains("\n  dma2 MM2S         2/10  "), "{}", ran.stderr);
    assert!(ran.stderr.contains(&format!("for a bug report, see {path}")), "{}", ran.stderr);

    let text = std::fs::read_to_string(&report).expect("it was written");
    let bundle: serde_json::Value = serde_json::from_str(&text).expect("one document");
    assert_keys(&bundle, &["version", "host", "arguments", "registers", "error"]);
    assert_eq!(bundle["board"]["profile"], "float");
    assert_eq!(bundle["parameters"]["deadline_ms"], 1.0);
    assert_eq!(bundle["parameters"]["retries"], 2);
    assert_eq!(bundle["accesses"].as_array().map(Vec::len), Some(64));
    let registers = bundle["registers"].to_string();
    assert!(registers.contains("dma3 S2MM DMASR = 0x00010008 SGIncld"), "{registers}");

    std::fs::remove_file(&report).expect("it is there");
    let ran = run(["run", "--json"].iter().chain(&slow).chain(&late));
    assert_eq!(ran.code, Some(4), "{}", ran.stderr);
    let error = &ran.json()["error"];
    assert_eq!((&error["fault"], &error["aftermath"]), (&"deadline".into(), &"ready".into()));
    let channels = error["diagnosis"]["channels"].as_array().expect("channels");
    assert_eq!(channels.len(), 8);
    assert_eq!(channels[6]["channel"], "dma2 MM2S");
    assert_eq!(channels[6]["descriptors_complete"], 2);

    // Without a failure nothing is written.
    std::fs::remove_file(&report).expect("it is there");
    let ran = run(["run"].iter().chain(&slow).chain(&["--report", path]));
    assert_eq!(ran.code, Some(0), "{}", ran.stderr);
    assert!(!report.exists() && !ran.stdout.contains("retries"), "{}", ran.stdout);

    // A report that cannot be written does not hide the fault.
    let nowhere = ["--deadline", "1", "--report", "/nonexistent/fault.json"];
    let ran = run(["run"].iter().chain(&slow).chain(&nowhere));
    assert_eq!(ran.code, Some(4), "{}", ran.stderr);
    assert!(ran.stderr.contains("/nonexistent/fault.json cannot be written"), "{}", ran.stderr);
}

#[test]
fn the_pile_has_impulses_after_landing_and_none_before() {
    let ran = run(["--json", "--grid", "3x2x3", "--steps", "70", "--drop", "5"]);
    let document = ran.json();
    let impulses = |step: usize| {
        document["steps"][step - 1]["impulse_sum_n_s"].as_f64().expect("the board counts them")
    };
    assert_eq!(impulses(60).to_bits(), 0.0_f64.to_bits(), "in free fall");
    assert!(impulses(70) > 1.0, "landed: {}", impulses(70));
}

#[test]
fn solve_compares_with_every_stage_of_the_golden_step() {
    let folder = golden("pile5_step60");
    let folder = folder.to_str().expect("a path in UTF-8");
    let mut cases = vec![vec![]];
    for k in ["1", "2", "3", "4"] {
        cases.push(vec!["--no-integrate", "--contact-iterations", k, "--friction-iterations", "0"]);
        cases.push(vec!["--no-integrate", "--friction-iterations", k]);
    }
    for case in cases {
        for profile in ["float", "naive"] {
            let board = format!("emulated:{profile}");
            let arguments = ["solve", folder, "--compare", "--json", "--board", &board];
            let ran = run(arguments.iter().chain(&case));
            assert_eq!(ran.code, Some(0), "{case:?}: {} {}", ran.stdout, ran.stderr);
            let document = ran.json();
            assert_keys(
                &document,
                &["schema", "folder", "board", "step", "digest", "hazard_share"],
            );
            assert_eq!(document["equal"], true);
            let comparison = document["comparison"].as_array().expect("an array");
            assert!(comparison.len() >= 3 && comparison.iter().all(|c| c["values"] != 0));
        }
    }
}

#[test]
fn a_difference_ends_with_1_and_is_measured() {
    let folder = common::copy("two_cubes");
    patch(&folder, "out_pos.npy", 4, 0.0_f32.to_le_bytes());
    let path = folder.path().to_str().expect("a path in UTF-8");
    let ran = run(["solve", path, "--compare"]);
    assert_eq!(ran.code, Some(1), "{}", ran.stderr);
    assert!(
        ran.stdout.contains("out_pos.npy: 1 of 9 values differ in bits, by "),
        "{}",
        ran.stdout
    );
    assert!(ran.stdout.contains("first at 4"), "{}", ran.stdout);
    assert!(ran.stdout.contains("out_quat.npy: 0 of 12 values differ in bits"), "{}", ran.stdout);
    assert!(ran.stderr.is_empty(), "the answer is a result: {}", ran.stderr);
    let ran = run(["solve", path, "--compare", "--json"]);
    assert_eq!((ran.code, &ran.json()["equal"]), (Some(1), &Value::Bool(false)));
}

#[test]
fn written_results_are_the_golden_files() {
    let out = tempfile::tempdir().expect("a temporary folder");
    let folder = golden("pile5_step60");
    let into = out.path().join("a/b");
    let ran =
        pgs().args(["solve", "--order", "as-given"]).arg(&folder).arg("--out").arg(&into).output();
    assert_eq!(Ran::from(ran.expect("it starts")).code, Some(0));
    for name in ["out_pos.npy", "out_quat.npy", "out_linvel.npy", "out_angvel.npy"] {
        let bytes = |path: &std::path::Path| std::fs::read(path.join(name)).expect(name);
        assert!(bytes(&into) == bytes(&folder), "{name}");
    }
}

#[test]
fn list_names_the_board_that_would_be_opened() {
    let ran = run(["list", "--json"]);
    assert_eq!(ran.code, Some(0), "{}", ran.stderr);
    let document = ran.json();
    assert_keys(&document, &["schema", "board", "uio_nodes", "uio_error", "emulated"]);
    assert_keys(&document, &["u_dma_bufs", "logic_error", "unreadable_uio_nodes"]);
    assert_keys(&document, &["u_dma_buf_states", "fpga_managers"]);
    assert_eq!(document["board"]["kind"], "emulated");
    assert!(run(["list"]).stdout.contains("would open  emulated (as asked for)"));
}

#[test]
fn trace_shows_register_accesses_on_stderr_only() {
    let arguments = ["solve", "--digest"];
    let mut command = pgs();
    command.env("RUST_LOG", "trace").args(arguments).arg(golden("one_cube"));
    let ran = Ran::from(command.output().expect("it starts"));
    assert_eq!(ran.code, Some(0), "{}", ran.stderr);
    assert!(ran.stderr.contains("DMASR"), "{}", ran.stderr);
    assert_eq!(ran.stdout.lines().count(), 1, "{}", ran.stdout);
    assert!(ran.stdout.starts_with("fnv1a-64 "), "{}", ran.stdout);
}

#[test]
fn a_closed_pipe_ends_quietly_with_0() {
    let mut child = pgs()
        .args(["--grid", "2x2x2", "--steps", "100000", "--report-every", "1"])
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("it starts");
    let mut stdout = BufReader::new(child.stdout.take().expect("a pipe"));
    let mut line = String::new();
    stdout.read_line(&mut line).expect("a first line");
    drop(stdout);
    let ran = Ran::from(child.wait_with_output().expect("it ends"));
    assert_eq!((ran.code, ran.stderr.as_str()), (Some(0), ""));
}

#[test]
fn ctrl_c_ends_after_the_step_with_130_and_a_digest() {
    let mut child = pgs()
        .args(["--grid", "2x2x2", "--steps", "1000000", "--report-every", "1000000"])
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("it starts");
    let mut lines = BufReader::new(child.stdout.take().expect("a pipe")).lines();
    // Ctrl-C is handled before the row of the first step appears.
    let row =
        lines.find(|line| line.as_ref().is_ok_and(|line| line.trim_start().starts_with("1 ")));
    assert!(row.is_some(), "a row of the first step");
    let kill = Command::new("kill").args(["-INT", &child.id().to_string()]).status();
    assert!(kill.expect("kill runs").success());
    let rest: Vec<String> = lines.map(|line| line.expect("text")).collect();
    let ran = Ran::from(child.wait_with_output().expect("it ends"));
    assert_eq!((ran.code, ran.stderr.as_str()), (Some(130), ""));
    assert!(rest.iter().any(|line| line.starts_with("interrupted after ")), "{rest:?}");
    assert!(rest.iter().any(|line| line.starts_with("digest ")), "{rest:?}");
}

#[test]
fn a_full_stdout_is_named_and_ends_with_2() {
    for arguments in [
        &["--help"][..],
        &["run", "-h"],
        &["help", "solve"],
        &["--version"],
        &["--grid", "2x2x2", "--steps", "2"],
        &["--grid", "2x2x2", "--steps", "2", "--json"],
        &["thesis", "compare", "float", "half", "--grid", "2x2x2", "--steps", "1"],
        &["list"],
        &["thesis", "cycles", "--collisions", "1", "--bodies", "2"],
        &["check"],
        &["faults", "--list", "--board", "emulated:naive"],
    ] {
        let full = std::fs::File::options().write(true).open("/dev/full").expect("a full device");
        let ran: Ran = pgs().args(arguments).stdout(full).output().expect("it starts").into();
        assert_eq!(ran.code, Some(2), "{arguments:?}: {}", ran.stderr);
        assert!(
            ran.stderr.contains("error: standard output cannot be written\n  because: No space"),
            "{arguments:?}: {}",
            ran.stderr
        );
    }
    // The same for the results of a folder of arrays, and for a wrong command line.
    let full = || std::fs::File::options().write(true).open("/dev/full").expect("a full device");
    let digest = pgs().args(["solve", "--digest"]).arg(golden("one_cube")).stdout(full()).output();
    let ran = Ran::from(digest.expect("it starts"));
    assert_eq!(ran.code, Some(2));
    assert!(ran.stderr.contains("standard output"), "{}", ran.stderr);
    let wrong = pgs().arg("--frobnicate").stderr(full()).output().expect("it starts");
    assert_eq!(wrong.status.code(), Some(2));
}
