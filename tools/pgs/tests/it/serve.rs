//! A served board from the command line: one driver at a time, Ctrl-C in the middle of a step, and
//! what is refused.

use std::io::{BufRead as _, BufReader, Read as _, Write as _};
use std::os::unix::net::{UnixListener, UnixStream};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::mpsc::{Receiver, channel};

use crate::common;
use crate::common::{Ran, Tied, pgs, run, signal};
use bitstream_model::interface::address_map::dma_base;
use bitstream_model::remote::message::{ANSWER_BYTES, Answer, REQUEST_BYTES, Request, Status};

/// `pgs serve` in a process of its own.
struct Served {
    folder: tempfile::TempDir,
    child: Tied,
}

impl Served {
    fn new() -> Self {
        let folder = tempfile::tempdir().expect("a directory");
        let child = pgs()
            .args(["serve", "--memory-mib", "16", "--socket"])
            .arg(folder.path().join("board"))
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .expect("it starts");
        let mut child = Tied(child);
        let mut lines = BufReader::new(child.0.stdout.as_mut().expect("a pipe")).lines();
        let serving =
            lines.find(|line| line.as_ref().is_ok_and(|line| line.starts_with("serving ")));
        assert!(serving.is_some(), "a board is served");
        Self { folder, child }
    }

    fn socket(&self) -> PathBuf {
        self.folder.path().join("board")
    }

    /// A command on this board.
    fn command(&self, board: &Path) -> Command {
        let mut command = pgs();
        command.arg("--board").arg(format!("socket:{}", board.display()));
        let memory = format!("file:{}.memory", self.socket().display());
        command.args(["--memory", &memory]);
        command
    }

    /// Ends it; what it did.
    fn end(mut self) -> Ran {
        signal("-TERM", self.child.0.id());
        let (mut stdout, mut stderr) = (String::new(), String::new());
        let child = &mut self.child.0;
        child.stdout.as_mut().expect("a pipe").read_to_string(&mut stdout).expect("text");
        child.stderr.as_mut().expect("a pipe").read_to_string(&mut stderr).expect("text");
        let code = child.wait().expect("it ends").code();
        assert!(!self.socket().exists(), "the socket is gone");
        Ran { code, stdout, stderr }
    }
}

#[test]
fn a_served_board_gives_the_digest_of_the_emulated_one() {
    let served = Served::new();
    let scene = ["--grid", "3x3x3", "--steps", "40"];
    let digest = |ran: &Ran| ran.stdout.lines().last().map(str::to_owned);
    let here = run(scene);
    for _ in 0..2 {
        let there: Ran =
            served.command(&served.socket()).args(scene).output().expect("it runs").into();
        assert_eq!((there.code, there.stderr.as_str()), (Some(0), ""));
        assert!(there.stdout.starts_with("board      served (as asked for)\n"), "{}", there.stdout);
        assert_eq!(digest(&there), digest(&here));
    }
    let check: Ran =
        served.command(&served.socket()).arg("check").output().expect("it runs").into();
    assert!(check.stdout.ends_with("11 ok, 0 failed, 0 skipped\n"), "{}", check.stdout);
    // How it is built is a matter of the one who serves it.
    let half: Ran = served
        .command(&served.socket())
        .args(["run", "--profile", "half"])
        .output()
        .expect("it runs")
        .into();
    assert_eq!(half.code, Some(2));
    assert!(half.stderr.contains("give --profile to its `pgs serve`"), "{}", half.stderr);

    let ended = served.end();
    assert_eq!((ended.code, ended.stderr.as_str()), (Some(0), ""));
    let last = ended.stdout.lines().last().expect("a summary").to_owned();
    assert!(last.starts_with("served     3 drivers, 0 left engines running; "), "{last}");
    assert!(last.ends_with(" 0 violations"), "{last}");
}

#[test]
fn where_no_board_is_served_there_is_none() {
    let folder = tempfile::tempdir().expect("a directory");
    let socket = folder.path().join("board");
    let board = format!("socket:{}", socket.display());
    let ran = run(["--board", &board, "--grid", "2x2x2"]);
    assert_eq!(ran.code, Some(3));
    assert!(ran.stderr.contains("start one with `pgs serve --socket"), "{}", ran.stderr);
    let serve = |rest: &[&str]| {
        let mut command = pgs();
        command.arg("serve").arg("--socket").arg(&socket).args(rest);
        Ran::from(command.output().expect("it runs"))
    };
    for (rest, reason) in [
        (&["--memory", "uio"][..], "the memory of a served board is a file"),
        (&["--board", "uio"], "serves an emulated board"),
        (&["--memory", "file:/nonexistent/memory"], "cannot be opened"),
        (&["--format", "thesis16"], "take a profile with streams of 16 bits"),
    ] {
        let ran = serve(rest);
        assert_eq!((ran.code, ran.stdout.as_str()), (Some(2), ""), "{rest:?}");
        assert!(ran.stderr.contains(reason), "{rest:?}: {}", ran.stderr);
        assert!(!socket.exists());
    }
}

/// Stands between a driver and a board, and lets no interrupt come: the board seems to stall.
struct Stalling {
    socket: PathBuf,
    /// One for every wait.
    waits: Receiver<()>,
    /// All other requests since the first wait, once the driver is gone.
    after: Receiver<Vec<Request>>,
}

impl Stalling {
    fn new(served: &Served) -> Self {
        let socket = served.folder.path().join("stalling");
        let listener = UnixListener::bind(&socket).expect("bound");
        let board = served.socket();
        let (tell_wait, waits) = channel();
        let (tell_after, after) = channel();
        std::thread::spawn(move || {
            let (mut driver, _) = listener.accept().expect("a driver");
            let mut board = UnixStream::connect(board).expect("a board");
            let mut request = [0; REQUEST_BYTES];
            let mut answer = [0; ANSWER_BYTES];
            let (mut stalled, mut since) = (false, Vec::new());
            while driver.read_exact(&mut request).is_ok() {
                let asked = Request::decode(&request).expect("a request");
                match asked {
                    // Draining, at opening, asks for no time.
                    Request::WaitInterrupt { time } if !time.is_zero() => {
                        stalled = true;
                        let now = Answer::decode(&answer).expect("an answer").now;
                        let nothing = Answer { status: Status::Nothing, value: 0, number: 0, now };
                        answer = nothing.encode();
                        // The test may have seen enough.
                        let _ = tell_wait.send(());
                    }
                    _ => {
                        if stalled {
                            since.push(asked);
                        }
                        board.write_all(&request).expect("the board is there");
                        board.read_exact(&mut answer).expect("the board is there");
                    }
                }
                driver.write_all(&answer).expect("the driver waits");
            }
            let _ = tell_after.send(since);
        });
        Self { socket, waits, after }
    }
}

#[test]
fn ctrl_c_ends_a_step_that_stalls_and_a_second_driver_is_refused_meanwhile() {
    let served = Served::new();
    for verb in ["run", "solve", "formats"] {
        let stalling = Stalling::new(&served);
        let mut command = served.command(&stalling.socket);
        command.arg(verb);
        match verb {
            "run" => command.args(["--grid", "3x3x3", "--steps", "40"]),
            "solve" => command.arg(common::golden("one_cube")),
            _ => command.args(["--grid", "3x3x3", "--step", "4"]),
        };
        let child = command
            // An hour, which the stalling board lets pass in some seconds.
            .args(["--deadline", "3600000"])
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .expect("it starts");
        stalling.waits.recv().expect("it waits");

        let second: Ran = served
            .command(&served.socket())
            .args(["--grid", "2x2x2"])
            .output()
            .expect("it runs")
            .into();
        assert_eq!((second.code, second.stdout.as_str()), (Some(3), ""));
        assert!(
            second.stderr.contains("board.memory is locked: another program"),
            "{}",
            second.stderr
        );

        signal("-INT", child.id());
        let ran = Ran::from(child.wait_with_output().expect("it ends"));
        assert_eq!((ran.code, ran.stderr.as_str()), (Some(130), ""), "{verb}");
        // It has reset every core before it went.
        let since = stalling.after.recv().expect("the driver is gone");
        for core in 0..4 {
            let reset = |request: &Request| {
                matches!(request, Request::Write { address, value }
                    if *address == dma_base(core) && value & 4 != 0)
            };
            assert!(since.iter().any(reset), "{verb}: core {core}");
        }
        std::fs::remove_file(&stalling.socket).expect("there");
        if verb == "run" {
            assert!(ran.stdout.contains("interrupted after 0 of 40 steps"), "{}", ran.stdout);
        }
    }
    let ended = served.end();
    assert!(ended.stdout.contains(", 0 left engines running; "), "{}", ended.stdout);
    assert!(ended.stdout.contains(" 0 violations"), "{}", ended.stdout);
}
