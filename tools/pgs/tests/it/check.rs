//! `pgs check` names the cause of every defect of a board, and its exit code tells success.

use crate::common::{Ran, pgs, run, skipped};
use serde_json::Value;

fn check(arguments: &[&str]) -> Ran {
    run(["check"].iter().chain(arguments))
}

/// The names of the lines with this outcome.
fn lines_that(document: &Value, outcome: &str) -> Vec<String> {
    let lines = document["lines"].as_array().expect("the lines");
    lines
        .iter()
        .filter(|line| line["outcome"] == outcome)
        .map(|line| line["name"].as_str().expect("a name").to_owned())
        .collect()
}

#[test]
fn a_good_board_ends_with_0_and_thirteen_lines() {
    let ran = check(&["--board", "emulated:float,fence=0x50000000+64M"]);
    assert_eq!(ran.code, Some(0), "{}{}", ran.stdout, ran.stderr);
    assert_eq!(ran.stdout.lines().filter(|line| line.starts_with("ok    ")).count(), 13);
    assert!(ran.stdout.ends_with("13 ok, 0 failed, 0 skipped\n"), "{}", ran.stdout);
    let document = check(&["--json"]).json();
    assert_eq!(document["schema"], 1);
    assert_eq!(document["verb"], "check");
    assert_eq!(document["board"]["kind"], "emulated");
    assert_eq!(document["passed"], true);
    assert_eq!(lines_that(&document, "ok").len(), 12);
    assert_eq!(lines_that(&document, "skipped"), ["fence"]);
}

#[test]
fn without_a_guard_the_fence_is_not_proven() {
    let ran = check(&["--quirk", "no-guard"]);
    assert_eq!(ran.code, Some(0), "{}{}", ran.stdout, ran.stderr);
    assert!(ran.stdout.contains("\nskip  fence              not proven: "), "{}", ran.stdout);
    let ran = check(&["--board", "emulated:float,fence=0x50000000+63M"]);
    assert_eq!(ran.code, Some(2), "{}", ran.stderr);
    assert!(ran.stderr.contains("a power of two"), "{}", ran.stderr);
}

#[test]
fn every_quirk_ends_with_1_and_fails_its_own_line_alone() {
    for (quirk, line, cause) in [
        ("identity", "identification", "found 0xffff0000"),
        ("version", "interface version", "found 3.0"),
        ("length14", "length register", "found 14 bits on all 8 channels"),
        ("no-queue", "issue queue", "the bits of the order of the list"),
        ("no-interrupt", "interrupt", "found 0 of 3 steps"),
        ("stuck-interrupt", "interrupt", "nothing asks for one"),
        ("stale", "coherency", "MM2S read at byte 0x400 of its buffer"),
        ("stale-results", "coherency", "at byte 0x400 of the buffer of dma0 S2MM"),
        ("unconnected-stream", "echo", "no end after 200ms: dma2 MM2S"),
        ("held-reset", "reset", "found dma1 MM2S in reset"),
        ("open-fence", "fence", "found dma1 S2MM in reach of 0x54000000"),
    ] {
        let ran = check(&["--quirk", quirk]);
        assert_eq!(ran.code, Some(1), "{quirk}: {}{}", ran.stdout, ran.stderr);
        let failed: Vec<_> = ran.stdout.lines().filter(|text| text.starts_with("FAIL  ")).collect();
        assert_eq!(failed.len(), 1, "{quirk}: {}", ran.stdout);
        assert!(failed[0].starts_with(&format!("FAIL  {line} ")), "{quirk}: {}", ran.stdout);
        assert!(failed[0].contains(cause), "{quirk}: {}", ran.stdout);
        assert!(ran.stdout.contains(" next: "), "{quirk}: {}", ran.stdout);

        let ran = check(&["--json", "--quirk", quirk]);
        assert_eq!(ran.code, Some(1), "{quirk}");
        let document = ran.json();
        assert_eq!(document["passed"], false, "{quirk}");
        assert_eq!(lines_that(&document, "failed"), [line], "{quirk}");
        let total = lines_that(&document, "ok").len() + lines_that(&document, "skipped").len() + 1;
        assert_eq!(total, 13, "{quirk}");
    }
}

#[test]
fn a_quirk_of_a_real_board_is_wrong_usage() {
    let ran = check(&["--board", "uio", "--quirk", "stale"]);
    assert_eq!(ran.code, Some(2), "{}", ran.stderr);
    assert!(ran.stderr.contains("--quirk") && ran.stderr.contains("--board emulated"));
    assert_eq!(check(&["--quirk", "gremlins"]).code, Some(2));
}

#[test]
#[allow(clippy::print_stdout, reason = "a test says aloud what it skips")]
fn without_a_board_the_code_is_3() {
    if std::path::Path::new("/sys/class/uio").exists() {
        println!("skipped: this machine has UIO nodes");
        return;
    }
    let ran = check(&["--board", "uio"]);
    assert_eq!(ran.code, Some(3), "{}", ran.stderr);
    assert!(ran.stderr.contains("no UIO node named") && ran.stderr.contains("next: "));
    assert!(ran.stdout.is_empty());
}

#[test]
fn the_emulated_board_does_not_stand_in_for_one_that_is_missing() {
    if std::path::Path::new("/sys/class/uio").exists() {
        skipped("a check without a board (this machine has UIO nodes)");
        return;
    }
    for arguments in [&["check"][..], &["check", "--json"], &["check", "--quirk", "stale"]] {
        let mut command = pgs();
        let ran: Ran =
            command.env_remove("PGS_BOARD").args(arguments).output().expect("runs").into();
        assert_eq!(ran.code, Some(3), "{arguments:?}: {}", ran.stderr);
        assert!(ran.stdout.is_empty(), "{}", ran.stdout);
        assert!(ran.stderr.contains("there is no UIO node named \"pgs\""), "{}", ran.stderr);
        assert!(ran.stderr.contains("--board emulated"), "{}", ran.stderr);
    }
    // The option or the variable asks for the emulated board.
    let mut command = pgs();
    let ran = command.env_remove("PGS_BOARD").args(["check", "--board", "emulated"]).output();
    assert_eq!(ran.expect("runs").status.code(), Some(0));
    assert_eq!(check(&[]).code, Some(0));
}

#[test]
fn narrow_length_registers_that_are_declared_pass() {
    let ran = check(&["--board", "emulated:float,length-width=14,address-width=32"]);
    assert_eq!(ran.code, Some(0), "{}{}", ran.stdout, ran.stderr);
    assert!(ran.stdout.contains("14 bits on 8 channels"), "{}", ran.stdout);
}
