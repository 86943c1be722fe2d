//! A served board from the command line: one driver at a time, Ctrl-C inside a step, and refusals.

use std::io::{BufRead as _, BufReader, Read as _, Write as _};
use std::os::unix::net::{UnixListener, UnixStream};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::mpsc::{Receiver, channel};

use crate::common;
use crate::common::{Ran, Tied, pgs, run, signal};
use bitstream_model::interface::address_map::dma_base;
use bitstream_model::interface::message::{
    ANSWER_BYTES, Answer, REQUEST_BYTES, Request, Status, VERSION,
};
use bitstream_model::remote::{receive_files, send_file};

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

    /// Runs a command on this board.
    fn command(&self, board: &Path) -> Command {
        let mut command = pgs();
        command.env("PGS_BOARD", format!("socket:{}", board.display()));
        // It describes real boards, and this one has memory of its own.
        command.env("PGS_MEMORY", "uio");
        command
    }

    /// Ends it; returns its output.
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
    assert!(check.stdout.ends_with("12 ok, 0 failed, 1 skipped\n"), "{}", check.stdout);
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
    assert!(ran.stderr.contains("because: No such file or directory"), "{}", ran.stderr);
    for (make, because, next) in [
        (left as fn(&Path), "because: Connection refused", "at it any more: start one with"),
        (plain, "because: Socket operation on non-socket", "is not a board's socket: name the one"),
    ] {
        make(&socket);
        let ran = run(["--board", &board, "--grid", "2x2x2"]);
        assert_eq!(ran.code, Some(3));
        assert!(ran.stderr.contains(because) && ran.stderr.contains(next), "{}", ran.stderr);
        std::fs::remove_file(&socket).expect("there");
    }
    let serve = |rest: &[&str]| {
        let mut command = pgs();
        command.arg("serve").arg("--socket").arg(&socket).args(rest);
        Ran::from(command.output().expect("it runs"))
    };
    for (rest, reason) in [
        (&["--memory", "uio"][..], "similar argument exists: '--memory-mib'"),
        (&["--board", "uio"], "this command builds its board itself: give emulated[:BUILD]"),
        (&["--board", "emulated:half,world"], "take float"),
    ] {
        let ran = serve(rest);
        assert_eq!((ran.code, ran.stdout.as_str()), (Some(2), ""), "{rest:?}");
        assert!(ran.stderr.contains(reason), "{rest:?}: {}", ran.stderr);
        assert!(!socket.exists());
    }
}

/// Leaves a socket without a server.
fn left(path: &Path) {
    drop(UnixListener::bind(path).expect("bound"));
}

/// Leaves a plain file.
fn plain(path: &Path) {
    std::fs::write(path, "mine").expect("written");
}

#[test]
fn a_board_that_somebody_else_has_is_busy() {
    let served = Served::new();
    let mut stream = UnixStream::connect(served.socket()).expect("connected");
    let hello = Request::Hello { version: VERSION }.encode();
    stream.write_all(&hello).expect("sent");
    stream.read_exact(&mut [0; ANSWER_BYTES]).expect("answered");
    let ran: Ran = served.command(&served.socket()).output().expect("it runs").into();
    assert_eq!((ran.code, ran.stdout.as_str()), (Some(3), ""));
    assert!(ran.stderr.contains("has another driver: end that first"), "{}", ran.stderr);
    drop(stream);
    served.end();
}

#[test]
fn memory_that_the_system_does_not_give_is_refused_and_nothing_is_left() {
    let folder = tempfile::tempdir().expect("a directory");
    let pgs = pgs();
    let mut command = Command::new("sh");
    command.args(["-c", "ulimit -f 64 && exec \"$@\"", "sh"]);
    command.arg(pgs.get_program()).args(pgs.get_args()).args(["serve", "--memory-mib", "16"]);
    command.arg("--socket").arg(folder.path().join("board")).env("PGS_BOARD", "emulated");
    let ran = Ran::from(command.output().expect("it runs"));
    assert_eq!((ran.code, ran.stdout.as_str()), (Some(2), ""), "{}", ran.stderr);
    for text in ["16777216 bytes of memory cannot be reserved", "File too large", "--memory-mib"] {
        assert!(ran.stderr.contains(text), "{text}: {}", ran.stderr);
    }
    assert_eq!(std::fs::read_dir(folder.path()).expect("there").count(), 0);
}

/// Stands between a driver and a board, and holds all interrupts back: the board seems to stall.
struct Stalling {
    socket: PathBuf,
    /// One message for every wait.
    waits: Receiver<()>,
    /// All other requests since the first wait, sent after the driver has left.
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
                    // Draining at opening waits for no time.
                    Request::WaitInterrupt { time } if !time.is_zero() => {
                        stalled = true;
                        let now = Answer::decode(&answer).expect("an answer").now;
                        let nothing = Answer { status: Status::Nothing, value: 0, number: 0, now };
                        answer = nothing.encode();
                        // The test may have stopped listening.
                        let _ = tell_wait.send(());
                    }
                    _ => {
                        if stalled {
                            since.push(asked);
                        }
                        board.write_all(&request).expect("the board is there");
                        // A short message comes whole.
                        let (count, files) =
                            receive_files(&board, &mut answer).expect("the board is there");
                        assert_eq!(count, ANSWER_BYTES);
                        if let Some(memory) = files.first() {
                            send_file(&driver, &answer, memory).expect("the driver waits");
                            continue;
                        }
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
    for verb in [&["run"][..], &["solve"], &["thesis", "formats"]] {
        let stalling = Stalling::new(&served);
        let mut command = served.command(&stalling.socket);
        command.args(verb);
        match verb[0] {
            "run" => command.args(["--grid", "3x3x3", "--steps", "40"]),
            "solve" => command.arg(common::golden("one_cube")),
            _ => command.args(["--grid", "3x3x3", "--step", "4"]),
        };
        let child = command
            // An hour, which passes on the stalling board within seconds.
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
        assert!(second.stderr.contains("has another driver: end that first"), "{}", second.stderr);

        signal("-INT", child.id());
        let ran = Ran::from(child.wait_with_output().expect("it ends"));
        assert_eq!((ran.code, ran.stderr.as_str()), (Some(130), ""), "{verb:?}");
        // The driver has reset every core before it left.
        let since = stalling.after.recv().expect("the driver is gone");
        for core in 0..4 {
            let reset = |request: &Request| {
                matches!(request, Request::Write { address, value }
                    if *address == dma_base(core) && value & 4 != 0)
            };
            assert!(since.iter().any(reset), "{verb:?}: core {core}");
        }
        std::fs::remove_file(&stalling.socket).expect("there");
        if verb[0] == "run" {
            assert!(ran.stdout.contains("interrupted after 0 of 40 steps"), "{}", ran.stdout);
        }
    }
    let ended = served.end();
    assert!(ended.stdout.contains(", 0 left engines running; "), "{}", ended.stdout);
    assert!(ended.stdout.contains(" 0 violations"), "{}", ended.stdout);
}

#[test]
fn memory_behind_the_fence_and_a_socket_that_is_the_simulator_are_refused_by_the_server() {
    let folder = tempfile::tempdir().expect("a folder");
    let socket = folder.path().join("board");
    let refused = |more: &[&str], said: &[&str]| {
        let ran = run(["serve", "--socket", common::text(&socket)].iter().chain(more));
        assert_eq!(ran.code, Some(2), "{}", ran.stderr);
        assert!(said.iter().all(|said| ran.stderr.contains(said)), "{}", ran.stderr);
    };
    let fenced = ["--board", "emulated:float,fence=0x50000000+64M", "--memory-mib", "128"];
    refused(&fenced, &["134217728 bytes", "0x50000000", "smaller --memory-mib"]);
    assert!(!socket.exists());
    std::fs::write(&socket, "a program").expect("written");
    let simulator = format!("rtl:{}", socket.display());
    refused(&["--accelerator", &simulator], &["--socket", "--accelerator", " are one file"]);
}
