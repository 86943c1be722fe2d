//! A signal that arrives ignored stays ignored, as under `nohup`; each of the others ends a command
//! with its own exit code.

use crate::common;
use std::io::{BufRead as _, BufReader, Read as _};
use std::path::Path;
use std::process::{Command, Stdio};

use crate::common::{Ran, Tied, pgs, signal};

/// The command, started by a shell that ignores those signals first.
fn ignoring(signals: &str, arguments: &[&str]) -> Command {
    let pgs = pgs();
    let mut command = Command::new("sh");
    command.args(["-c", &format!("trap '' {signals}; exec \"$@\""), "sh"]);
    command.arg(pgs.get_program()).args(pgs.get_args()).args(arguments);
    command.envs(pgs.get_envs().filter_map(|(name, value)| Some((name, value?))));
    command
}

/// Whether this process, and so every one that it starts, ignores a signal: under `nohup`, or in a
/// script's background job.
pub(crate) fn is_ignored(signal: &str) -> bool {
    let number = match signal {
        "-HUP" => 1,
        "-INT" => 2,
        _ => 15,
    };
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let mask = status.lines().find_map(|line| line.strip_prefix("SigIgn:"));
    let mask = mask.map_or(0, |mask| u64::from_str_radix(mask.trim(), 16).expect("a mask"));
    mask >> (number - 1) & 1 == 1
}

/// A long run that has taken its first step.
fn run_ignoring(signals: &str) -> (Tied, BufReader<std::process::ChildStdout>) {
    let arguments = ["--grid", "2x2x2", "--steps", "100000000", "--report-every", "1"];
    let mut command = ignoring(signals, &arguments);
    let mut child =
        Tied(command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().expect("it starts"));
    let mut lines = BufReader::new(child.0.stdout.take().expect("a pipe"));
    read_row(&mut lines, 1);
    (child, lines)
}

/// Reads at least `bytes` bytes, up to the end of a step's row.
fn read_row(lines: &mut impl std::io::BufRead, bytes: usize) {
    let (mut read, mut is_row) = (0, false);
    while read < bytes || !is_row {
        let mut line = String::new();
        assert!(lines.read_line(&mut line).expect("text") > 0, "the run goes on");
        read += line.len();
        let first = line.split_whitespace().next();
        is_row = first.is_some_and(|word| word.parse::<u32>().is_ok());
    }
}

/// The rest of its output, and its exit code.
fn ended(mut child: Tied, mut lines: impl std::io::Read) -> Ran {
    let (mut stdout, mut stderr) = (String::new(), String::new());
    lines.read_to_string(&mut stdout).expect("text");
    child.0.stderr.take().expect("a pipe").read_to_string(&mut stderr).expect("text");
    Ran { code: child.0.wait().expect("it ends").code(), stdout, stderr }
}

/// More than a pipe and its reader hold, bytes: they were written behind whatever was sent before.
const MORE: usize = (64 + 16) << 10;

#[test]
fn a_signal_that_arrives_ignored_is_left_ignored() {
    if !Path::new("/proc/self/status").exists() {
        return common::skipped("ignored signals (no /proc)");
    }
    for (ignored, sent, ends) in
        [("HUP", "-HUP", "-TERM"), ("INT", "-INT", "-TERM"), ("TERM HUP", "-TERM", "-INT")]
    {
        if is_ignored(ends) {
            common::skipped(&format!("{ignored} ignored (as {ends} is for this test)"));
            continue;
        }
        let (child, mut lines) = run_ignoring(ignored);
        signal(sent, child.0.id());
        read_row(&mut lines, MORE);
        signal(ends, child.0.id());
        let ran = ended(child, lines);
        assert_eq!((ran.code, ran.stderr.as_str()), (Some(130), ""), "{ignored}");
        assert!(ran.stdout.contains("interrupted after "), "{ignored}: {}", ran.stdout);
    }
}

#[test]
fn every_signal_that_asks_to_end_ends_a_run_with_130() {
    for sent in ["-INT", "-TERM", "-HUP"] {
        if is_ignored(sent) {
            common::skipped(&format!("{sent} (ignored by this test)"));
            continue;
        }
        // Of no signal: the shell ignores one that it is never sent.
        let (child, lines) = run_ignoring("USR1");
        signal(sent, child.0.id());
        let ran = ended(child, lines);
        assert_eq!((ran.code, ran.stderr.as_str()), (Some(130), ""), "{sent}");
        assert!(ran.stdout.contains("interrupted after "), "{sent}: {}", ran.stdout);
    }
}

#[test]
fn a_served_board_outlives_a_hang_up_that_it_ignores() {
    let folder = tempfile::tempdir().expect("a directory");
    let socket = folder.path().join("board");
    let path = socket.to_str().expect("text");
    let mut command = ignoring("HUP", &["serve", "--memory-mib", "16", "--socket", path]);
    let mut server =
        Tied(command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().expect("it starts"));
    let mut lines = BufReader::new(server.0.stdout.take().expect("a pipe"));
    let mut line = String::new();
    while !line.starts_with("serving ") {
        line.clear();
        assert!(lines.read_line(&mut line).expect("text") > 0, "a board is served");
    }
    signal("-HUP", server.0.id());
    let board = format!("socket:{path}");
    let ran = common::run(["--board", &board, "--grid", "2x2x2", "--steps", "2"]);
    assert_eq!((ran.code, ran.stderr.as_str()), (Some(0), ""));
    signal("-TERM", server.0.id());
    let ran = ended(server, lines);
    assert_eq!(ran.code, Some(0), "{}", ran.stderr);
}
