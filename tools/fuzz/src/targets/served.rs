//! Speaks the messages of a served board: as a driver without sense, and as a board whose answers
//! are falsified on their way to the driver.

use std::fs::File;
use std::io::{Read as _, Write as _};
use std::net::Shutdown;
use std::os::unix::fs::FileExt as _;
use std::os::unix::net::{UnixListener, UnixStream};
use std::path::{Path, PathBuf};
use std::thread;
use std::time::Duration;

use bitstream_model::interface::address_map::{CONTROL_BASE, MEMORY_BASE, dma_base};
use bitstream_model::remote::{Server, Stopper, receive_files, send_file};
use bitstream_model::{BoardConfig, Counts};
use pgs_interface::message::{
    ANSWER_BYTES, Answer, LONGEST_WAIT, MEMORY_UNIT, REQUEST_BYTES, Request, Status, VERSION,
};
use zynq_pgs::{Accelerator, BoardChoice, OpenOptions};

use super::scenes::{InvalidValues, Scene, bits, parameters};
use crate::input::Input;
use crate::tally::Tally;

/// Most requests of an execution.
const REQUESTS_MAX: u32 = 40;

/// Serves a board while `act` runs with its socket; returns the result and the board's counts.
fn with_board<R>(units: u64, act: impl FnOnce(&Path) -> R) -> (R, Counts) {
    let folder = tempfile::tempdir().expect("a folder");
    let socket = folder.path().join("board");
    let config = BoardConfig { strict: false, ..BoardConfig::default() };
    let memory = MEMORY_BASE..MEMORY_BASE + units * MEMORY_UNIT;
    let mut server = Server::bind(config, memory, &socket, None).expect("served");
    let (board, stop) = (server.board().clone(), Stop(server.stopper()));
    let done = thread::scope(|scope| {
        scope.spawn(move || server.serve(|_, _| ()).expect("until it is stopped"));
        let _stop = stop;
        act(&socket)
    });
    (done, board.counts())
}

/// Stops a server when it goes, also in a panic: the server's thread is waited for.
struct Stop(Stopper);

impl Drop for Stop {
    fn drop(&mut self) {
        self.0.stop();
    }
}

/// One execution of the target `requests`.
pub(super) fn requests(bytes: &[u8]) -> Tally {
    let mut input = Input::new(bytes);
    let mut tally = Tally::default();
    let ((), counts) = with_board(1, |socket| {
        for _ in 0..2 {
            let mut driver = Driver::connect(socket);
            for _ in 0..REQUESTS_MAX {
                let request = request(&mut input, driver.greeted);
                if input.is_empty() {
                    break;
                }
                if !driver.ask(&mut input, request) {
                    tally.refused += 1;
                    break;
                }
            }
        }
        // The next driver gets the board all the same.
        let mut next = Driver::connect(socket);
        let hello = Request::Hello { version: VERSION }.encode();
        assert!(next.ask(&mut Input::new(&[]), hello) && next.greeted);
    });
    tally.add_board(&counts);
    tally
}

/// The bytes of a request: mostly sensible at this point, sometimes damaged.
fn request(input: &mut Input<'_>, greeted: bool) -> [u8; REQUEST_BYTES] {
    let time = Duration::from_nanos(u64::from(input.below(20_000)));
    let request = match input.below(16) {
        _ if !greeted => Request::Hello { version: VERSION },
        0 | 1 => Request::Memory,
        2..=5 => Request::Read { address: address(input) },
        6..=11 => Request::Write { address: address(input), value: input.telling_word() },
        12 => Request::Pause { time },
        13 => Request::WaitInterrupt { time },
        14 => Request::Unmask,
        _ => Request::Hello { version: input.telling_word() },
    };
    let mut bytes = request.encode();
    if input.one_in(16) {
        bytes[input.index(REQUEST_BYTES)] ^= input.byte();
    }
    bytes
}

/// An address, mostly of a register.
fn address(input: &mut Input<'_>) -> u64 {
    let at = u64::from(input.byte() & !3);
    match input.below(6) {
        core @ 0..=3 => dma_base(core as usize) + at,
        4 => CONTROL_BASE + at,
        _ => input.long(),
    }
}

/// A driver's end of the socket, and the state that the messages give it.
struct Driver {
    stream: UnixStream,
    greeted: bool,
    memory: Option<File>,
}

impl Driver {
    fn connect(socket: &Path) -> Self {
        let stream = UnixStream::connect(socket).expect("a server");
        Self { stream, greeted: false, memory: None }
    }

    /// Sends a request, and checks its answer; returns whether the connection stays.
    fn ask(&mut self, input: &mut Input<'_>, request: [u8; REQUEST_BYTES]) -> bool {
        self.stream.write_all(&request).expect("sent");
        let mut bytes = [0; ANSWER_BYTES];
        let (count, mut files) = receive_files(&self.stream, &mut bytes).expect("answered");
        assert_eq!(count, ANSWER_BYTES, "a short answer comes whole");
        let answer = Answer::decode(&bytes).expect("an answer");
        let decoded = Request::decode(&request);
        let expected: &[Status] = match decoded {
            Err(_) => &[Status::Refused],
            Ok(Request::Hello { version: VERSION }) => &[Status::Done],
            Ok(Request::Hello { .. }) => &[Status::OtherVersion],
            Ok(_) if !self.greeted => &[Status::Refused],
            Ok(Request::Memory) if self.memory.is_some() => &[Status::Refused],
            Ok(Request::WaitInterrupt { .. }) => &[Status::Done, Status::Nothing],
            Ok(_) => &[Status::Done],
        };
        assert!(expected.contains(&answer.status), "{decoded:?}: {answer:?}");
        self.greeted = true;
        let with_memory = decoded == Ok(Request::Memory) && answer.status == Status::Done;
        assert_eq!(files.len(), usize::from(with_memory), "{decoded:?}");
        if let Some(memory) = files.pop() {
            assert_eq!(memory.metadata().expect("measured").len(), MEMORY_UNIT);
            assert_eq!((answer.value, answer.number), (1, MEMORY_BASE));
            // Descriptors, for engines that are sent there.
            let at = 64 * u64::from(input.byte());
            memory.write_all_at(input.bytes(64), at).expect("inside");
            self.memory = Some(memory);
        }
        let stays = !matches!(answer.status, Status::Refused | Status::OtherVersion);
        if !stays {
            assert_eq!(self.stream.read(&mut bytes).expect("closed"), 0, "it hangs up");
        }
        stays
    }
}

/// One execution of the target `answers`.
pub(super) fn answers(bytes: &[u8]) -> Tally {
    let mut input = Input::new(bytes);
    let mut tally = Tally::default();
    let (ended, counts) = with_board(64, |socket| {
        let relay = Relay::new(socket, &mut input);
        let board = BoardChoice::Served { socket: relay.socket.clone() };
        let scene = Scene::any(&mut input, 6, 6, InvalidValues::Never);
        Accelerator::open(OpenOptions { board, ..OpenOptions::default() }).and_then(
            |mut accelerator| {
                accelerator.set_shapes(&scene.shapes)?;
                let variant = accelerator.capabilities().variant;
                let parameters = parameters(&mut input, 3, InvalidValues::Never, &variant)
                    .with_deadline(Some(LONGEST_WAIT));
                let mut bodies = scene.bodies.clone();
                for _ in 0..2 {
                    let before = bits(&bodies);
                    let ended = accelerator.step(&mut bodies, &scene.given(), &parameters);
                    if ended.is_err() {
                        assert_eq!(bits(&bodies), before, "a step that failed");
                    }
                    ended?;
                }
                Ok(())
            },
        )
    });
    match ended {
        Ok(()) => tally.steps += 1,
        Err(error) => {
            assert!(!error.to_string().is_empty());
            tally.refused += 1;
        }
    }
    tally.add_board(&counts);
    tally
}

/// Stands between a driver and a board, and falsifies some answers.
struct Relay {
    _folder: tempfile::TempDir,
    socket: PathBuf,
    thread: Option<thread::JoinHandle<()>>,
}

impl Relay {
    fn new(board: &Path, input: &mut Input<'_>) -> Self {
        let folder = tempfile::tempdir().expect("a folder");
        let socket = folder.path().join("relay");
        let listener = UnixListener::bind(&socket).expect("bound");
        let board = board.to_owned();
        // The number of the answer, the byte in it, and its bits that flip; the first answers open
        // the board.
        let lies: Vec<_> = (0..input.below(4))
            .map(|_| {
                let most = input.pick(&[4, 40, 250, 1000]);
                (input.below(most), input.index(ANSWER_BYTES), input.byte())
            })
            .collect();
        let cut = input.one_in(8).then(|| input.below(400));
        let thread = thread::spawn(move || {
            let (driver, _) = listener.accept().expect("a driver");
            let board = UnixStream::connect(board).expect("a board");
            let passed = pass(&driver, &board, &lies, cut);
            // Both ends have left, or one of them.
            drop((passed, driver.shutdown(Shutdown::Both)));
        });
        Self { _folder: folder, socket, thread: Some(thread) }
    }
}

fn pass(
    mut driver: &UnixStream,
    mut board: &UnixStream,
    lies: &[(u32, usize, u8)],
    cut: Option<u32>,
) -> std::io::Result<()> {
    let mut request = [0; REQUEST_BYTES];
    for number in 0.. {
        driver.read_exact(&mut request)?;
        board.write_all(&request)?;
        let mut answer = [0; ANSWER_BYTES];
        let (_, files) = receive_files(board, &mut answer)?;
        for (_, byte, mask) in lies.iter().filter(|(at, ..)| *at == number) {
            answer[*byte] ^= mask;
        }
        if cut == Some(number) {
            return Ok(());
        }
        match files.first() {
            Some(memory) => send_file(driver, &answer, memory).map(drop)?,
            None => driver.write_all(&answer)?,
        }
    }
    Ok(())
}

impl Drop for Relay {
    fn drop(&mut self) {
        // A driver that was refused before it connected leaves the thread without a driver.
        drop(UnixStream::connect(&self.socket));
        if let Some(thread) = self.thread.take() {
            // A panic of the relay is a finding.
            assert!(thread.join().is_ok() || thread::panicking(), "the relay panicked");
        }
    }
}
