//! A driver that is killed at any moment leaves a board that the next driver can use: with the same
//! digest as on a fresh board, and undisturbed by the transfers of the killed one.
//!
//! `PGS_KILLS=200 cargo test --release -p pgs --test it kill:: -- --nocapture` kills two hundred
//! times.

use std::io::{BufRead as _, BufReader, Read as _, Write as _};
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::Instant;

use crate::common::{Tied, pgs, signal, variable};

/// Default number of kills.
const KILLS: u32 = 8;
/// Seed of the moments.
const SEED: u64 = 0x9E37_79B9_7F4A_7C15;

/// A run is short, and each of its steps takes long on the board.
const RUN: [&str; 6] = ["--grid", "8x8x8", "--steps", "12", "--report-every", "12"];

/// Starts a run on the board at `socket`.
fn driver(socket: &Path) -> Command {
    let mut command = pgs();
    command.arg("--board").arg(format!("socket:{}", socket.display())).args(RUN);
    command
}

/// Completes a run; returns its digest.
fn digest(socket: &Path, after: &str) -> String {
    let output = driver(socket).output().expect("it runs");
    let stderr = String::from_utf8_lossy(&output.stderr);
    assert_eq!((output.status.code(), &*stderr), (Some(0), ""), "{after}");
    let stdout = String::from_utf8(output.stdout).expect("text");
    let last = stdout.lines().last().expect("a digest");
    assert!(last.starts_with("digest "), "{after}: {last}");
    last.to_owned()
}

/// The next random number (xorshift64).
fn next(state: &mut u64) -> u64 {
    *state ^= *state << 13;
    *state ^= *state >> 7;
    *state ^= *state << 17;
    *state
}

#[test]
fn a_board_whose_driver_was_killed_serves_the_next_one_as_if_nothing_had_been() {
    let kills = variable("PGS_KILLS").map_or(KILLS, |text| text.parse().expect("a number"));
    let folder = tempfile::tempdir().expect("a directory");
    let socket = folder.path().join("board");
    let server = pgs()
        .args(["serve", "--memory-mib", "16", "--socket"])
        .arg(&socket)
        .stdout(Stdio::piped())
        .spawn()
        .expect("it starts");
    let mut server = Tied(server);
    let mut lines = BufReader::new(server.0.stdout.take().expect("a pipe"));
    let mut line = String::new();
    while !line.starts_with("serving ") {
        line.clear();
        assert!(lines.read_line(&mut line).expect("text") > 0, "a board is served");
    }

    let expected = digest(&socket, "before any kill");
    // The first run takes longer than the ones after it.
    let begin = Instant::now();
    assert_eq!(digest(&socket, "once more"), expected);
    let whole = begin.elapsed();
    let mut state = SEED;
    for kill in 1..=kills {
        let mut child =
            driver(&socket).stdout(Stdio::null()).stderr(Stdio::null()).spawn().expect("it starts");
        let share = next(&mut state) % 1000;
        let moment = whole * u32::try_from(share).expect("below 1000") / 1000;
        // Not a synchronisation: this is the random moment.
        std::thread::sleep(moment);
        child.kill().expect("killed, or ended by itself");
        child.wait().expect("it ends");
        let after = format!("kill {kill}, after {moment:?} of {whole:?}");
        assert_eq!(digest(&socket, &after), expected, "{after}");
    }

    signal("-TERM", server.0.id());
    let mut rest = String::new();
    lines.read_to_string(&mut rest).expect("text");
    assert!(server.0.wait().expect("it ends").success());
    let summary = rest.lines().last().expect("a summary").to_owned();
    let _ = writeln!(std::io::stderr(), "{kills} kills in a run of {whole:?}: {summary}");
    assert!(summary.ends_with(", 0 violations"), "{summary}");
    // Whole runs leave a board at rest, so each of these was killed inside a step.
    let running = rest.lines().filter(|line| line.ends_with("left, engines running")).count();
    assert!(running >= kills as usize / 10, "{running} of {kills} kills met a running engine");
}
