//! `pgs run --live`: a page plays the run while the board steps.

use std::io::{BufRead as _, BufReader, Read as _, Write as _};
use std::net::TcpStream;
use std::process::Stdio;

use crate::common::{Tied, pgs, run, signal, skipped};
use crate::signals::is_ignored;

const SCENE: [&str; 5] = ["run", "--grid", "6x6x6", "--board", "emulated"];
/// More than a test waits for.
const MANY: &str = "10000000";

/// Starts the run; returns it with the address of its server and the path of its page.
fn started() -> (Tied, String, String) {
    let mut run = pgs();
    run.args(SCENE)
        .args(["--steps", MANY, "--live", "0"])
        .stdout(Stdio::piped())
        .stderr(Stdio::piped());
    let mut run = Tied(run.spawn().expect("it starts"));
    let mut lines = BufReader::new(run.0.stderr.take().expect("a pipe")).lines();
    let line = lines.next().expect("a line").expect("text");
    let url = line.strip_prefix("live at http://").expect("its address");
    let (address, path) = url.split_once('/').expect("a path");
    (run, address.to_owned(), format!("/{path}"))
}

/// Asks for the frames; returns the answer.
fn ask(address: &str, path: &str, lines: &str) -> BufReader<TcpStream> {
    let mut stream = TcpStream::connect(address).expect("a connection");
    let head = format!("GET {path}frames HTTP/1.1\r\nHost: {address}\r\n{lines}\r\n");
    stream.write_all(head.as_bytes()).expect("sent");
    BufReader::new(stream)
}

fn digest(stdout: &str) -> &str {
    stdout.lines().find(|line| line.starts_with("digest")).expect("a digest")
}

#[test]
fn frames_arrive_while_the_run_goes_on_and_a_reader_that_leaves_changes_no_bit() {
    if is_ignored("-INT") {
        return skipped("a run that Ctrl-C ends (it is ignored)");
    }
    let (mut running, address, path) = started();
    let mut foreign = String::new();
    let mut answer = ask(&address, &path, "Origin: http://evil.example\r\n");
    answer.read_line(&mut foreign).expect("an answer");
    assert_eq!(foreign.trim_end(), "HTTP/1.1 403 403");
    let mut lines = ask(&address, &path, "").lines().map(|line| line.expect("text"));
    let mut frames = lines.by_ref().filter(|line| line.starts_with("data: "));
    let step = |frame: String| {
        let frame: serde_json::Value = serde_json::from_str(&frame[6..]).expect("JSON");
        frame["step"].as_u64().expect("a step")
    };
    let [first, second] = [(); 2].map(|()| step(frames.next().expect("a frame")));
    assert!(0 < first && first < second, "{first}, {second}");
    assert!(running.0.try_wait().expect("its state").is_none(), "the run goes on");
    drop(lines);
    signal("-INT", running.0.id());
    let mut with = String::new();
    let mut stdout = running.0.stdout.take().expect("a pipe");
    stdout.read_to_string(&mut with).expect("text");
    assert_eq!(running.0.wait().expect("it ends").code(), Some(130), "{with}");
    let done = with.lines().find_map(|line| line.strip_prefix("interrupted after "));
    let done = done.and_then(|line| line.split(' ').next()).expect("the steps");
    let without = run(SCENE.iter().copied().chain(["--steps", done]));
    assert_eq!(digest(&with), digest(&without.stdout));
}

#[test]
fn an_address_that_is_taken_is_refused_before_the_first_step() {
    let taken = std::net::TcpListener::bind("127.0.0.1:0").expect("a free port");
    let address = taken.local_addr().expect("its address").to_string();
    let ran = run(SCENE.iter().copied().chain(["--live", &address]));
    assert!(ran.code != Some(0) && ran.stdout.is_empty(), "{:?} {}", ran.code, ran.stdout);
    assert!(ran.stderr.contains("cannot be served at") && ran.stderr.contains("free port"));
    let ran = run(SCENE.iter().copied().chain(["--live", "everywhere"]));
    assert_eq!(ran.code, Some(2));
    assert!(ran.stderr.contains("expected a port, or an address with one"), "{}", ran.stderr);
    for all in ["0.0.0.0:8000", "[::]:8000", "[::ffff:0.0.0.0]:8000"] {
        let ran = run(SCENE.iter().copied().chain(["--live", all]));
        assert_eq!((ran.code, ran.stdout.as_str()), (Some(2), ""), "{all}");
        assert!(ran.stderr.contains("take the one of the network"), "{}", ran.stderr);
    }
}
