//! Tests that a board in another process gives the same bits and cycles, and that no act of the
//! other side causes a panic or a wait without end.
#![cfg(feature = "emulation")]

use std::fs::File;
use std::io::{Read as _, Write as _};
use std::ops::Range;
use std::os::unix::fs::{FileExt as _, MetadataExt as _, PermissionsExt as _};
use std::os::unix::net::{UnixListener, UnixStream};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, channel};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use crate::common::{bits, row};
use bitstream_model::external::{ExternalAccelerator, ModelAccelerator};
use bitstream_model::interface::address_map::MEMORY_BASE;
use bitstream_model::interface::fence::Fence;
use bitstream_model::interface::profile::Profile;
use bitstream_model::remote::{
    Ended, ServeError, Server, Stopper, Visit, receive_files, send_file,
};
use bitstream_model::{BoardConfig, Direction, EmulatedBoard, Fault, FaultKind};
use pgs_interface::message::{
    ANSWER_BYTES, Answer, LONGEST_WAIT, MEMORY_UNIT, Request, RequestError, Status, VERSION,
};
use zynq_pgs::board::BoardKind;
use zynq_pgs::error::OpenError;
use zynq_pgs::platform::{MemoryChoice, PlatformError};
use zynq_pgs::{
    Accelerator, BoardChoice, Body, Collision, Error, OpenOptions, Shape, StepParameters,
    StepReport, Velocity,
};

/// A row of cubes on the ground.
fn scene(cubes: u16) -> (Vec<Body>, Vec<Collision>) {
    row(cubes, 2.2, |x| Velocity { linear: [0.1, -1.0 - x, 0.0], angular: [0.0, 0.1, 0.0] })
}

/// A board served by another thread.
pub(crate) struct Served {
    folder: tempfile::TempDir,
    pub(crate) board: EmulatedBoard,
    stopper: Stopper,
    visits: Receiver<Visit>,
    thread: Option<JoinHandle<()>>,
}

impl Served {
    pub(crate) fn new(config: BoardConfig) -> Self {
        Self::with(config, None)
    }

    fn with(config: BoardConfig, accelerator: Option<Box<dyn ExternalAccelerator>>) -> Self {
        let folder = tempfile::tempdir().expect("a directory");
        let socket = folder.path().join("board");
        let mut server = Server::bind(config, MEMORY, &socket, accelerator).expect("served");
        server.set_driver_limit(DRIVER_LIMIT);
        let (board, stopper) = (server.board().clone(), server.stopper());
        let (sender, visits) = channel();
        let thread = std::thread::spawn(move || {
            let report = |_: &EmulatedBoard, visit: Visit| drop(sender.send(visit));
            server.serve(report).expect("served until it is stopped");
        });
        Self { folder, board, stopper, visits, thread: Some(thread) }
    }

    fn socket(&self) -> PathBuf {
        self.folder.path().join("board")
    }

    fn options(&self) -> OpenOptions {
        at(&self.socket())
    }

    pub(crate) fn open(&self) -> Accelerator {
        let mut accelerator = Accelerator::open(self.options()).expect("a board that opens");
        let shapes = [Shape::STATIC, Shape::isotropic(1.0, 0.4)];
        accelerator.set_shapes(&shapes).expect("shapes that fit");
        accelerator
    }

    /// The end of the last visit.
    fn visit(&self) -> Visit {
        self.visits.recv().expect("a visit that ended")
    }

    pub(crate) fn stop(&mut self) {
        self.stopper.stop();
        self.thread.take().expect("stopped once").join().expect("no panic");
    }
}

/// Bus addresses of the memory of a driver.
const MEMORY: Range<u64> = MEMORY_BASE..MEMORY_BASE + (8 << 20);

fn bind(config: BoardConfig, socket: &Path) -> Result<Server, ServeError> {
    Server::bind(config, MEMORY, socket, None)
}

fn at(socket: &Path) -> OpenOptions {
    let board = BoardChoice::Served { socket: socket.to_owned() };
    OpenOptions { board, ..OpenOptions::default() }
}

/// The driver's memory is 8 MiB at `MEMORY_BASE`.
#[test]
fn memory_outside_the_fence_is_refused_by_name_before_a_step() {
    let fence = |text: &str| Some(text.parse::<Fence>().expect("a fence"));
    let served =
        Served::new(BoardConfig { fence: fence("0x50000000+4M"), ..BoardConfig::default() });
    let error = Accelerator::open(served.options()).expect_err("half of the memory is outside");
    let Error::Open(OpenError::Platform(PlatformError::OutsideFence { region, .. })) = &error
    else {
        panic!("{error:?}");
    };
    assert!(region.ends_with("board"), "{region}");
    let chain = format!("{error}: {}", std::error::Error::source(&error).expect("a cause"));
    for part in ["8388608 bytes at 0x50000000", "the fence 0x50000000+4M", "device tree"] {
        assert!(chain.contains(part), "{chain}");
    }
    let served =
        Served::new(BoardConfig { fence: fence("0x40000000+512M"), ..BoardConfig::default() });
    let mut accelerator = served.open();
    assert_eq!(accelerator.capabilities().fence, fence("0x40000000+512M"));
    steps(&mut accelerator, 5);
}

/// Load, passes by default, integration.
const SEGMENTS: u64 = 1 + 8 + 1;

fn steps(accelerator: &mut Accelerator, cubes: u16) -> (Vec<u32>, Vec<StepReport>) {
    let (mut bodies, collisions) = scene(cubes);
    let step = |_| {
        let parameters = StepParameters::default();
        accelerator.step(&mut bodies, &collisions, &parameters).expect("a good step")
    };
    let reports = (0..4).map(step).collect();
    (bits(&bodies), reports)
}

/// Cycles without waits, register accesses, interrupts, descriptors: all figures but host time.
fn counted(report: &StepReport) -> [u64; 8] {
    let StepReport { cycles, register_reads, register_writes, interrupts, .. } = *report;
    [
        cycles.total - cycles.waits,
        cycles.work,
        cycles.stalls,
        register_reads,
        register_writes,
        interrupts,
        report.descriptors,
        report.hazards,
    ]
}

#[test]
fn a_served_board_gives_the_bits_and_the_cycles_of_one_in_this_process() {
    for (profile, length_width) in [("float", 26), ("half", 14), ("naive", 8)] {
        let profile = Profile::by_name(profile).expect("a profile");
        let config = BoardConfig { profile, length_width, ..BoardConfig::default() };
        let own = EmulatedBoard::new(config).expect("a board that can be built");
        let board = BoardChoice::Emulated(own.cpu_port());
        let mut here = Accelerator::open(OpenOptions { board, ..OpenOptions::default() })
            .expect("a board that opens");
        here.set_shapes(&[Shape::STATIC, Shape::isotropic(1.0, 0.4)]).expect("shapes that fit");
        let (expected, reports) = steps(&mut here, 300);

        let served = Served::new(config);
        let mut there = served.open();
        assert_eq!(there.board().kind, BoardKind::Served);
        assert_eq!(there.board().name, served.socket().display().to_string());
        let (found, served_reports) = steps(&mut there, 300);
        assert_eq!(found, expected, "{}", profile.name);
        for (here, there) in reports.iter().zip(&served_reports) {
            assert_eq!(counted(there), counted(here), "{}", profile.name);
            // The board in this process takes the step at once: waits within a slice of each
            // segment.
            let apart = there.cycles.waits.abs_diff(here.cycles.waits);
            assert!(apart <= 64 * SEGMENTS, "{}: {apart}", profile.name);
        }
        drop(there);
        assert!(!served.visit().left_running);
        assert_eq!(served.board.violations(), []);
    }
}

#[test]
fn a_served_board_with_another_accelerator_gives_the_same_bits() {
    let config = BoardConfig::default();
    let own = Served::new(config);
    let (expected, reports) = steps(&mut own.open(), 40);

    let model = ModelAccelerator::new(&config).expect("it can be built");
    let served = Served::with(config, Some(Box::new(model)));
    let mut there = served.open();
    let (found, there_reports) = steps(&mut there, 40);
    assert_eq!(found, expected);
    // Its clocks come in batches, so that waits differ; its work does not.
    let fixed = |report: &StepReport| {
        let StepReport { cycles, register_writes, interrupts, descriptors, .. } = *report;
        (cycles.work, register_writes, interrupts, descriptors)
    };
    for (here, there) in reports.iter().zip(&there_reports) {
        assert_eq!(fixed(there), fixed(here));
    }
    drop(there);
    assert!(!served.visit().left_running);
    assert_eq!((served.board.violations(), served.board.accelerator_error()), (vec![], None));
}

#[test]
fn a_board_has_one_driver_at_a_time() {
    let served = Served::new(BoardConfig::default());
    let mut first = served.open();
    let error = Accelerator::open(served.options()).expect_err("another driver has it");
    assert!(
        matches!(&error, Error::Open(OpenError::Platform(PlatformError::ServerBusy { socket }))
            if *socket == served.socket()),
        "{error}"
    );
    steps(&mut first, 5);
    drop(first);
    steps(&mut served.open(), 5);
    assert_eq!(served.board.violations(), []);
}

#[test]
fn a_driver_that_leaves_in_the_middle_of_a_step_leaves_the_engines_running_for_the_next_to_stop() {
    let mut alone = Served::new(BoardConfig::default());
    let (expected, _) = steps(&mut alone.open(), 40);
    alone.stop();

    // The messages of an opening and of a step's start, in their order; then silence.
    let served = Served::new(BoardConfig::default());
    let (mut bodies, collisions) = scene(40);
    let relay = Relay::new(&served.socket(), None);
    let mut accelerator = Accelerator::open(at(&relay.socket)).expect("a board that opens");
    accelerator.set_shapes(&[Shape::STATIC, Shape::isotropic(1.0, 0.4)]).expect("shapes that fit");
    let parameters = StepParameters::default();
    let flight = accelerator.submit(&bodies, &collisions, &parameters).expect("it starts");
    relay.cut();
    let visit = served.visit();
    assert!(matches!(visit.ended, Ended::Left) && visit.left_running, "{visit:?}");
    assert!(served.board.is_running());

    // The driver that was cut off cannot even stop the step; its bodies are unchanged.
    let before = bits(&bodies);
    let error = flight.wait(&mut bodies).expect_err("no board any more");
    assert!(error.must_reopen(), "{error}");
    assert_eq!(bits(&bodies), before);
    assert!(matches!(
        accelerator.step(&mut bodies, &collisions, &parameters),
        Err(Error::MustReopen)
    ));
    drop(accelerator);

    let (found, _) = steps(&mut served.open(), 40);
    assert_eq!(found, expected);
    assert_eq!(served.board.violations(), []);
}

/// Falsifies an answer of the board, by the number of the request.
type Falsify = Box<dyn Fn(usize, &[u8], &mut Vec<u8>) + Send>;

/// Falsifies one answer.
fn once(at: usize, falsify: fn(&mut Vec<u8>)) -> Falsify {
    Box::new(move |number, _, answer| {
        if number == at {
            falsify(answer);
        }
    })
}

/// Passes messages between a driver and a board, until it is cut.
struct Relay {
    _folder: tempfile::TempDir,
    socket: PathBuf,
    ends: Receiver<[UnixStream; 2]>,
}

impl Relay {
    /// Makes a relay to `board`.
    fn new(board: &Path, falsify: Option<Falsify>) -> Self {
        let folder = tempfile::tempdir().expect("a directory");
        let socket = folder.path().join("relay");
        let listener = UnixListener::bind(&socket).expect("bound");
        let board = board.to_owned();
        let (sender, ends) = channel();
        std::thread::spawn(move || {
            let (mut driver, _) = listener.accept().expect("a driver");
            let mut board = UnixStream::connect(board).expect("a board");
            let ends = [&driver, &board].map(|end| end.try_clone().expect("cloned"));
            sender.send(ends).expect("the test waits");
            let mut request = [0; pgs_interface::message::REQUEST_BYTES];
            let mut number = 0;
            while driver.read_exact(&mut request).is_ok() {
                let mut answer = vec![0; ANSWER_BYTES];
                // A short message comes whole.
                let passed = board
                    .write_all(&request)
                    .and_then(|()| receive_files(&board, &mut answer))
                    .and_then(|(count, files)| match count {
                        ANSWER_BYTES => Ok(files),
                        _ => Err(std::io::ErrorKind::UnexpectedEof.into()),
                    });
                if let Some(falsify) = &falsify {
                    falsify(number, &request, &mut answer);
                }
                number += 1;
                let sent = passed.and_then(|files| match files.first() {
                    Some(memory) => send_file(&driver, &answer, memory).map(drop),
                    None => driver.write_all(&answer),
                });
                if sent.is_err() || answer.len() < ANSWER_BYTES {
                    // The test holds a copy of the socket.
                    let _ = driver.shutdown(std::net::Shutdown::Both);
                    return;
                }
            }
        });
        Self { _folder: folder, socket, ends }
    }

    /// Cuts both ends.
    fn cut(&self) {
        for end in self.ends.recv().expect("a driver came") {
            end.shutdown(std::net::Shutdown::Both).expect("cut");
        }
    }
}

/// An error's texts, down to its cause.
fn chain(error: &Error) -> Vec<String> {
    let sources = std::iter::successors(Some(error as &dyn std::error::Error), |e| e.source());
    sources.map(ToString::to_string).collect()
}

#[test]
fn a_server_that_is_stopped_in_the_middle_is_a_lost_board() {
    let mut served = Served::new(BoardConfig::default());
    let mut accelerator = served.open();
    let (mut bodies, collisions) = scene(40);
    let before = bits(&bodies);
    let parameters = StepParameters::default();
    let flight = accelerator.submit(&bodies, &collisions, &parameters).expect("it starts");
    served.stop();
    assert!(!served.socket().exists(), "the socket is gone");
    let error = flight.wait(&mut bodies).expect_err("no board any more");
    assert!(error.must_reopen(), "{error}");
    let texts = chain(&error);
    assert!(texts.iter().any(|text| text.contains("is lost: serve it again")), "{texts:?}");
    assert_eq!(error.fault().expect("a fault").name(), "platform");
    assert!(error.diagnosis().is_none(), "there was nothing to read");
    assert_eq!(bits(&bodies), before);
    drop(accelerator);
    let error = Accelerator::open(served.options()).expect_err("no server");
    assert!(
        matches!(&error, Error::Open(OpenError::Platform(PlatformError::NoServer { socket, .. }))
            if *socket == served.socket()),
        "{error}"
    );
}

#[test]
fn answers_that_make_no_sense_are_errors_at_every_point_of_a_step() {
    let spoils: [fn(&mut Vec<u8>); 3] =
        [|answer| answer[0] = 9, |answer| answer.truncate(11), |answer| answer[0] = 4];
    for falsify in spoils {
        // The hello, the memory, the first register, and later ones.
        for number in [0, 1, 2, 30, 60, 90, 110] {
            let served = Served::new(BoardConfig::default());
            let relay = Relay::new(&served.socket(), Some(once(number, falsify)));
            let (mut bodies, collisions) = scene(10);
            let before = bits(&bodies);
            let shapes = [Shape::STATIC, Shape::isotropic(1.0, 0.4)];
            let parameters = StepParameters::default();
            let stepped = Accelerator::open(at(&relay.socket)).and_then(|mut accelerator| {
                accelerator.set_shapes(&shapes)?;
                accelerator.step(&mut bodies, &collisions, &parameters)
            });
            let error = stepped.expect_err("a false answer");
            assert!(matches!(error, Error::Open(_)) || error.must_reopen(), "{number}: {error}");
            // The error is a lost board, and not a board without power.
            let texts = chain(&error);
            assert!(texts.iter().any(|text| text.contains("is lost")), "{number}: {texts:?}");
            assert_eq!(bits(&bodies), before);
        }
    }
}

#[test]
fn a_board_of_endless_interrupts_and_no_time_is_given_up_in_time() {
    let served = Served::new(BoardConfig::default());
    let started = Arc::new(AtomicBool::new(false));
    let lying = Arc::clone(&started);
    let falsify: Falsify = Box::new(move |_, request, answer| {
        if !lying.load(Ordering::Relaxed) {
            return;
        }
        let bytes = answer.as_slice().try_into().expect("an answer");
        let mut decoded = Answer::decode(bytes).expect("the board's");
        decoded.now = Duration::ZERO;
        let wait = Request::WaitInterrupt { time: Duration::ZERO }.encode();
        if request[0] == wait[0] {
            (decoded.status, decoded.value) = (Status::Done, 1);
        }
        *answer = decoded.encode().to_vec();
    });
    let relay = Relay::new(&served.socket(), Some(falsify));
    let mut accelerator = Accelerator::open(at(&relay.socket)).expect("a board that opens");
    let shapes = [Shape::STATIC, Shape::isotropic(1.0, 0.4)];
    accelerator.set_shapes(&shapes).expect("shapes that fit");
    let (mut bodies, collisions) = scene(10);
    let before = bits(&bodies);
    served.board.inject(Fault::new(FaultKind::Stall).on(0, Direction::S2mm));
    started.store(true, Ordering::Relaxed);
    let error = accelerator
        .step(&mut bodies, &collisions, &StepParameters::default())
        .expect_err("nothing happens");
    assert_eq!(error.fault().expect("a fault").name(), "deadline", "{error}");
    assert_eq!(bits(&bodies), before);
}

/// A driver's end of the socket, without a driver.
fn raw(served: &Served) -> UnixStream {
    UnixStream::connect(served.socket()).expect("connected")
}

fn ask(stream: &mut UnixStream, request: &[u8]) -> Answer {
    stream.write_all(request).expect("sent");
    let mut answer = [0; ANSWER_BYTES];
    stream.read_exact(&mut answer).expect("answered");
    Answer::decode(&answer).expect("an answer")
}

#[test]
fn requests_that_make_no_sense_end_the_visit_and_nothing_else() {
    let served = Served::new(BoardConfig::default());
    let hello = Request::Hello { version: VERSION }.encode();
    let refused = |first: Option<&[u8]>, request: &[u8]| {
        let mut stream = raw(&served);
        if let Some(first) = first {
            assert_eq!(ask(&mut stream, first).status, Status::Done);
        }
        assert_eq!(ask(&mut stream, request).status, Status::Refused);
        assert_eq!(stream.read(&mut [0]).expect("hung up"), 0);
        let visit = served.visit();
        assert!(matches!(visit.ended, Ended::Refused(_)), "{visit:?}");
    };
    refused(None, &[0; 16]);
    refused(None, &[0xFF; 16]);
    // A register before the hello.
    refused(None, &Request::Read { address: 0xA004_0000 }.encode());
    refused(Some(&hello), &[8; 16]);
    // An hour.
    let mut wait = Request::Unmask.encode();
    wait[0] = 6;
    wait[8..].copy_from_slice(&3_600_000_000_000_u64.to_le_bytes());
    refused(Some(&hello), &wait);

    // Half a request, and more than one at once.
    let mut stream = raw(&served);
    stream.write_all(&hello[..7]).expect("sent");
    drop(stream);
    assert!(matches!(served.visit().ended, Ended::Left));
    let mut stream = raw(&served);
    let wait = Request::WaitInterrupt { time: Duration::from_millis(1) }.encode();
    stream.write_all(&[hello, wait, wait].concat()).expect("sent");
    let mut answers = [0; 3 * ANSWER_BYTES];
    stream.read_exact(&mut answers).expect("one after the other");
    drop(stream);
    let visit = served.visit();
    assert!(matches!(visit.ended, Ended::Left) && visit.requests == 3, "{visit:?}");

    // Each connection has one memory.
    let (mut stream, _memory) = take_memory(&served);
    assert_eq!(ask(&mut stream, &Request::Memory.encode()).status, Status::Refused);
    drop(stream);
    assert!(matches!(served.visit().ended, Ended::Refused(RequestError::SecondMemory)));

    // A board with another version names it.
    let mut stream = raw(&served);
    let other = Request::Hello { version: VERSION + 1 }.encode();
    assert_eq!(ask(&mut stream, &other).status, Status::OtherVersion);
    drop(stream);
    assert_eq!(served.visit().requests, 1);

    steps(&mut served.open(), 5);
    assert_eq!(served.board.violations(), []);
}

#[test]
fn a_choice_of_memory_is_refused_for_a_board_that_brings_it() {
    let served = Served::new(BoardConfig::default());
    let memory = MemoryChoice::Uio { node: "m".to_owned() };
    let options = OpenOptions { memory, ..served.options() };
    let error = Accelerator::open(options).expect_err("not for this board");
    assert!(matches!(error, Error::Open(OpenError::EmulatedMemory)), "{error}");
    assert_eq!(served.board.violations(), []);
}

/// Says hello and takes the memory; returns it with the connection.
fn take_memory(served: &Served) -> (UnixStream, File) {
    let mut stream = raw(served);
    let hello = Request::Hello { version: VERSION }.encode();
    assert_eq!(ask(&mut stream, &hello).status, Status::Done);
    stream.write_all(&Request::Memory.encode()).expect("sent");
    let mut answer = [0; ANSWER_BYTES];
    let (count, mut files) = receive_files(&stream, &mut answer).expect("answered");
    let answer = Answer::decode(&answer).expect("an answer");
    assert_eq!((count, answer.status, files.len()), (ANSWER_BYTES, Status::Done, 1));
    let length = u64::from(answer.value) * MEMORY_UNIT;
    assert_eq!((answer.number, answer.number + length), (MEMORY.start, MEMORY.end));
    (stream, files.remove(0))
}

#[test]
fn each_driver_gets_new_memory_that_nobody_else_reaches() {
    let served = Served::new(BoardConfig::default());
    let (stream, first) = take_memory(&served);
    assert!(first.set_len(0).is_err() && first.set_len(1 << 30).is_err(), "its length is sealed");
    first.write_all_at(b"secret", 0x1000).expect("its own");
    // The board works on the driver's memory, and on no other.
    let names: Vec<_> = std::fs::read_dir(served.folder.path()).expect("there").collect();
    assert_eq!(names.len(), 1, "the socket alone: {names:?}");
    drop(stream);
    served.visit();
    let (_stream, second) = take_memory(&served);
    assert_ne!(inode(&first), inode(&second));
    let mut found = [1; 6];
    second.read_exact_at(&mut found, 0x1000).expect("inside");
    assert_eq!(found, [0; 6], "nothing of the driver before");
}

fn inode(file: &File) -> u64 {
    file.metadata().expect("measured").ino()
}

#[test]
fn engines_that_a_driver_left_running_go_on_in_its_memory_and_in_no_other() {
    let served = Served::new(BoardConfig::default());
    let relay = Relay::new(&served.socket(), None);
    let (mut bodies, collisions) = scene(40);
    let mut accelerator = Accelerator::open(at(&relay.socket)).expect("a board that opens");
    accelerator.set_shapes(&[Shape::STATIC, Shape::isotropic(1.0, 0.4)]).expect("shapes that fit");
    let parameters = StepParameters::default();
    let flight = accelerator.submit(&bodies, &collisions, &parameters).expect("it starts");
    relay.cut();
    assert!(served.visit().left_running);
    flight.wait(&mut bodies).expect_err("no board any more");

    // The next driver resets nothing, so that the step goes on to its end.
    let written = served.board.counts().beats_written;
    let (mut stream, memory) = take_memory(&served);
    let pause = Request::Pause { time: LONGEST_WAIT }.encode();
    for _ in 0..100 {
        assert_eq!(ask(&mut stream, &pause).status, Status::Done);
    }
    assert!(!served.board.is_running());
    assert!(served.board.counts().beats_written > written, "the step had its memory");
    let bytes = usize::try_from(MEMORY.end - MEMORY.start).expect("a few MiB");
    let mut found = vec![1; bytes];
    memory.read_exact_at(&mut found, 0).expect("read");
    assert!(found.iter().all(|byte| *byte == 0), "the new memory is untouched");
    drop(stream);
    assert!(!served.visit().left_running);
    steps(&mut served.open(), 40);
    assert_eq!(served.board.violations(), []);
}

#[test]
fn a_socket_has_one_server_and_one_that_was_left_behind_is_replaced() {
    let served = Served::new(BoardConfig::default());
    let error = bind(BoardConfig::default(), &served.socket()).expect_err("in use");
    assert!(matches!(error, ServeError::InUse { .. }), "{error}");
    steps(&mut served.open(), 5);

    // A server that is killed leaves its socket.
    let left = served.folder.path().join("left");
    drop(UnixListener::bind(&left).expect("bound"));
    assert!(left.exists());
    let server = bind(BoardConfig::default(), &left).expect("replaced");
    drop(server);
    assert!(!left.exists());

    // A file that is no socket stays.
    std::fs::write(&left, "mine").expect("written");
    let error = bind(BoardConfig::default(), &left).expect_err("a file");
    assert!(matches!(error, ServeError::NoSocket { .. }), "{error}");
    assert_eq!(std::fs::read(&left).expect("there"), b"mine");
}

/// The server's time limit of a driver.
const DRIVER_LIMIT: Duration = Duration::from_secs(1);

/// Time in which a driver or a board must notice a failure of the other side.
const NOTICE_LIMIT: Duration = Duration::from_secs(9);

#[test]
fn connections_that_say_nothing_do_not_hold_the_board() {
    let served = Served::new(BoardConfig::default());
    let hello = Request::Hello { version: VERSION }.encode();
    let silent = raw(&served);
    let mut half = raw(&served);
    half.write_all(&hello[..7]).expect("sent");
    let started = Instant::now();
    steps(&mut served.open(), 5);
    assert!(matches!(served.visit().ended, Ended::Left));
    // They do not keep the board for more than seconds, either.
    for mut stream in [silent, half] {
        stream.set_read_timeout(Some(NOTICE_LIMIT)).expect("set");
        assert_eq!(stream.read(&mut [0]).expect("hung up in time"), 0);
        let Ended::Broken(error) = served.visit().ended else { panic!("it was broken off") };
        assert_eq!(error.to_string(), "it sent no request within 1s");
    }
    assert!(started.elapsed() >= DRIVER_LIMIT / 2, "they had their time");
    steps(&mut served.open(), 5);
}

#[test]
fn who_says_hello_and_no_more_loses_the_board_in_seconds_and_keeps_nobody_waiting() {
    let served = Served::new(BoardConfig::default());
    let hello = Request::Hello { version: VERSION }.encode();
    let mut mute = raw(&served);
    assert_eq!(ask(&mut mute, &hello).status, Status::Done);
    let started = Instant::now();
    let error = Accelerator::open(served.options()).expect_err("another driver has it");
    assert!(
        matches!(&error, Error::Open(OpenError::Platform(PlatformError::ServerBusy { socket }))
            if *socket == served.socket()),
        "{error}"
    );
    assert!(started.elapsed() < NOTICE_LIMIT, "{:?}", started.elapsed());
    mute.set_read_timeout(Some(NOTICE_LIMIT)).expect("set");
    assert_eq!(mute.read(&mut [0]).expect("hung up in time"), 0);
    let Ended::Broken(error) = served.visit().ended else { panic!("it was broken off") };
    assert_eq!(error.to_string(), "it asked for no memory within 1s");
    steps(&mut served.open(), 5);
    assert!(matches!(served.visit().ended, Ended::Left));

    // Half a request, or an answer that the driver does not read, ends the visit, too.
    let unmask = Request::Unmask.encode();
    let (mut half, _memory) = take_memory(&served);
    half.write_all(&unmask[..15]).expect("sent");
    half.set_read_timeout(Some(NOTICE_LIMIT)).expect("set");
    assert_eq!(half.read(&mut [0]).expect("hung up in time"), 0);
    let Ended::Broken(error) = served.visit().ended else { panic!("it was broken off") };
    assert_eq!(error.to_string(), "it sent half a request and no more within 1s");

    let (mut unread, _memory) = take_memory(&served);
    unread.set_write_timeout(Some(2 * NOTICE_LIMIT)).expect("set");
    let many = unmask.repeat(1 << 12);
    while unread.write_all(&many).is_ok() {}
    let Ended::Broken(error) = served.visit().ended else { panic!("it was broken off") };
    assert_eq!(error.to_string(), "it read no answer within 1s");
    steps(&mut served.open(), 5);
}

#[test]
fn a_driver_that_is_idle_keeps_the_board_and_others_are_told_at_once() {
    let served = Served::new(BoardConfig::default());
    let mut idle = served.open();
    let (first, _) = steps(&mut idle, 5);
    // Longer than the limit for others; other drivers come meanwhile.
    let until = Instant::now() + DRIVER_LIMIT + DRIVER_LIMIT / 5;
    let hello = Request::Hello { version: VERSION }.encode();
    let other = Request::Hello { version: VERSION + 1 }.encode();
    let silent = raw(&served);
    while Instant::now() < until {
        let mut stream = raw(&served);
        stream.set_read_timeout(Some(NOTICE_LIMIT)).expect("set");
        assert_eq!(ask(&mut stream, &hello).status, Status::Busy);
        assert_eq!(stream.read(&mut [0]).expect("hung up"), 0);
        assert_eq!(ask(&mut raw(&served), &other).status, Status::OtherVersion);
        assert_eq!(ask(&mut raw(&served), &[0; 16]).status, Status::Refused);
        let error = Accelerator::open(served.options()).expect_err("another driver has it");
        assert!(
            matches!(&error, Error::Open(OpenError::Platform(PlatformError::ServerBusy { .. }))),
            "{error}"
        );
        std::thread::park_timeout(Duration::from_millis(50));
    }
    drop(silent);
    let (again, _) = steps(&mut idle, 5);
    assert_eq!(again, first);
    drop(idle);
    let visit = served.visit();
    assert!(matches!(visit.ended, Ended::Left) && !visit.left_running, "{visit:?}");
    assert_eq!(served.board.violations(), []);
}

#[test]
fn a_crowd_of_silent_connections_keeps_no_driver_away() {
    let served = Served::new(BoardConfig::default());
    let crowd: Vec<_> = (0..100).map(|_| raw(&served)).collect();
    let started = Instant::now();
    steps(&mut served.open(), 5);
    assert!(started.elapsed() < NOTICE_LIMIT, "{:?}", started.elapsed());
    drop(crowd);
}

#[test]
fn what_keeps_a_driver_from_a_socket_is_said_with_the_next_step() {
    let folder = tempfile::tempdir().expect("a directory");
    let refused = |socket: &Path, errno: i32, next: &str| {
        let error = Accelerator::open(at(socket)).expect_err("no board");
        let Error::Open(OpenError::Platform(PlatformError::NoServer { source, .. })) = &error
        else {
            panic!("{error}")
        };
        assert_eq!(source.raw_os_error(), Some(errno), "{source}");
        let found = error.next_step().expect("a next step");
        assert!(found.contains(next), "{found}");
    };
    use nix::errno::Errno;
    let socket = folder.path().join("board");
    refused(&socket, Errno::ENOENT as i32, "start one with `pgs serve --socket");
    drop(UnixListener::bind(&socket).expect("bound"));
    refused(&socket, Errno::ECONNREFUSED as i32, "nobody serves a board at it any more: start");
    let file = folder.path().join("file");
    std::fs::write(&file, "mine").expect("written");
    refused(&file, Errno::ENOTSOCK as i32, "is not a board's socket");
    refused(folder.path(), Errno::ENOTSOCK as i32, "is not a board's socket");
    refused(&file.join("x"), Errno::ENOTDIR as i32, "is not a board's socket");
    let long = folder.path().join("x".repeat(120));
    refused(&long, Errno::ENAMETOOLONG as i32, "at most 107 bytes");
    let other = folder.path().join("datagrams");
    let _datagrams = std::os::unix::net::UnixDatagram::bind(&other).expect("bound");
    refused(&other, Errno::EPROTOTYPE as i32, "is not a board's socket");

    // Connecting needs the right to write to the socket; root always has it.
    let served = Served::new(BoardConfig::default());
    let forbid = std::fs::Permissions::from_mode(0o000);
    std::fs::set_permissions(served.socket(), forbid).expect("ours");
    if UnixStream::connect(served.socket()).is_ok() {
        let _ = writeln!(std::io::stderr(), "skipped: a socket without rights (as root)");
    } else {
        refused(&served.socket(), Errno::EACCES as i32, "run as the user who serves it");
    }
}
