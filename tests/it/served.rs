//! Tests that a board in another process gives the same bits and cycles, and that no act of the
//! other side causes a panic or a wait without end.
#![cfg(feature = "emulation")]

use std::io::{Read as _, Write as _};
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
use bitstream_model::interface::address_map::{MEMORY_BASE, MEMORY_BYTES};
use bitstream_model::interface::fence::Fence;
use bitstream_model::interface::profile::Profile;
use bitstream_model::remote::{
    Ended, MemoryFile, MemoryFileError, ServeError, Server, Stopper, Visit,
};
use bitstream_model::{BoardConfig, Direction, EmulatedBoard, Fault, FaultKind};
use pgs_interface::message::{ANSWER_BYTES, Answer, Request, Status, VERSION};
use zynq_pgs::{
    Accelerator, BoardChoice, BoardKind, Body, Collision, Error, MemoryChoice, OpenError,
    OpenOptions, PlatformError, Shape, StepParameters, StepReport, Velocity,
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
        let memory = memory(&socket).expect("memory");
        let mut server = Server::bind(config, memory, &socket, accelerator).expect("served");
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

fn memory(socket: &Path) -> Result<MemoryFile, MemoryFileError> {
    let path = socket.with_extension("memory");
    MemoryFile::open(&path, MEMORY_BASE, None, MEMORY_BYTES)
}

fn bind(config: BoardConfig, socket: &Path) -> Result<Server, ServeError> {
    Server::bind(config, memory(socket)?, socket, None)
}

fn at(socket: &Path) -> OpenOptions {
    let board = BoardChoice::Served { socket: socket.to_owned() };
    OpenOptions { board, ..OpenOptions::default() }
}

/// The driver's memory is the file's 64 MiB at `0x5000_0000`.
#[test]
fn memory_outside_the_fence_is_refused_by_name_before_a_step() {
    let fence = |text: &str| Some(text.parse::<Fence>().expect("a fence"));
    let served =
        Served::new(BoardConfig { fence: fence("0x50000000+32M"), ..BoardConfig::default() });
    let error = Accelerator::open(served.options()).expect_err("half of the memory is outside");
    let Error::Open(OpenError::Platform(PlatformError::OutsideFence { region, .. })) = &error
    else {
        panic!("{error:?}");
    };
    assert!(region.ends_with("board.memory"), "{region}");
    let chain = format!("{error}: {}", std::error::Error::source(&error).expect("a cause"));
    for part in ["67108864 bytes at 0x50000000", "the fence 0x50000000+32M", "device tree"] {
        assert!(chain.contains(part), "{chain}");
    }
    let served =
        Served::new(BoardConfig { fence: fence("0x40000000+512M"), ..BoardConfig::default() });
    let mut accelerator = served.open();
    assert_eq!(accelerator.capabilities().fence, fence("0x40000000+512M"));
    steps(&mut accelerator, 5);
}

fn steps(accelerator: &mut Accelerator, cubes: u16) -> (Vec<u32>, Vec<StepReport>) {
    let (mut bodies, collisions) = scene(cubes);
    let step = |_| {
        let parameters = StepParameters::default();
        accelerator.step(&mut bodies, &collisions, &parameters).expect("a good step")
    };
    let reports = (0..4).map(step).collect();
    (bits(&bodies), reports)
}

/// Cycles, register accesses, interrupts, descriptors: all figures but host time.
fn counted(report: &StepReport) -> [u64; 9] {
    let StepReport { cycles, register_reads, register_writes, interrupts, .. } = *report;
    [
        cycles.total,
        cycles.work,
        cycles.stalls,
        cycles.waits,
        register_reads,
        register_writes,
        interrupts,
        report.descriptors,
        report.hazards,
    ]
}

#[test]
fn a_served_board_gives_the_bits_and_the_cycles_of_one_in_this_process() {
    for (profile, length_width) in [("float", 26), ("half", 14), ("naive", 26), ("windowed", 8)] {
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
    let Error::Open(OpenError::Platform(PlatformError::Busy { path })) = &error else {
        panic!("{error}")
    };
    assert!(path.ends_with("board.memory"), "{path:?}");
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
    let options = OpenOptions {
        memory: MemoryChoice::File { path: served.socket().with_extension("memory") },
        ..at(&relay.socket)
    };
    let mut accelerator = Accelerator::open(options).expect("a board that opens");
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
                let passed = board.write_all(&request).and_then(|()| board.read_exact(&mut answer));
                if let Some(falsify) = &falsify {
                    falsify(number, &request, &mut answer);
                }
                number += 1;
                if passed.and_then(|()| driver.write_all(&answer)).is_err()
                    || answer.len() < ANSWER_BYTES
                {
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
            let options = OpenOptions {
                memory: MemoryChoice::File { path: served.socket().with_extension("memory") },
                ..at(&relay.socket)
            };
            let (mut bodies, collisions) = scene(10);
            let before = bits(&bodies);
            let shapes = [Shape::STATIC, Shape::isotropic(1.0, 0.4)];
            let parameters = StepParameters::default();
            let stepped = Accelerator::open(options).and_then(|mut accelerator| {
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
    let options = OpenOptions {
        memory: MemoryChoice::File { path: served.socket().with_extension("memory") },
        ..at(&relay.socket)
    };
    let mut accelerator = Accelerator::open(options).expect("a board that opens");
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

    // A board with another version, or with another memory, names it.
    let mut stream = raw(&served);
    let other = Request::Hello { version: VERSION + 1 }.encode();
    assert_eq!(ask(&mut stream, &other).status, Status::OtherVersion);
    drop(stream);
    assert_eq!(served.visit().requests, 1);

    steps(&mut served.open(), 5);
    assert_eq!(served.board.violations(), []);
}

#[test]
fn another_file_than_the_boards_memory_is_refused() {
    let served = Served::new(BoardConfig::default());
    let other = served.folder.path().join("other");
    let options = || {
        let memory = MemoryChoice::File { path: other.clone() };
        OpenOptions { memory, ..served.options() }
    };
    let error = Accelerator::open(options()).expect_err("there is none");
    assert!(
        matches!(error, Error::Open(OpenError::Platform(PlatformError::ServedMemory { .. }))),
        "{error}"
    );
    std::fs::write(&other, [0; 1 << 16]).expect("written");
    let error = Accelerator::open(options()).expect_err("not the board's");
    assert!(
        matches!(&error, Error::Open(OpenError::Platform(PlatformError::OtherMemory { memory, .. }))
            if *memory == other),
        "{error}"
    );
    // A file is no other board's memory either.
    for memory in [MemoryChoice::Uio { node: "m".to_owned() }, MemoryChoice::File { path: other }] {
        let board = match memory {
            MemoryChoice::Uio { .. } => served.options().board,
            _ => BoardChoice::Automatic,
        };
        let options = OpenOptions { board, memory, ..OpenOptions::default() };
        let error = Accelerator::open(options).expect_err("not for this board");
        assert!(matches!(error, Error::Open(OpenError::ServedMemory)), "{error}");
    }
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

#[test]
fn memory_is_a_file_of_whole_pages_that_no_driver_has() {
    let served = Served::new(BoardConfig::default());
    let path = served.socket().with_extension("memory");
    let open = |wanted| MemoryFile::open(&path, MEMORY_BASE, wanted, MEMORY_BYTES);
    assert_eq!(open(None).expect("free").addresses(), 0x5000_0000..0x5400_0000);
    let accelerator = served.open();
    let error = open(None).expect_err("a driver has it");
    assert!(matches!(error, MemoryFileError::Busy { .. }), "{error}");
    drop(accelerator);
    for (wanted, found) in [(Some(1 << 20), MEMORY_BYTES), (Some(1 << 15), 1 << 15)] {
        let error = open(wanted).expect_err("another length");
        assert!(matches!(error, MemoryFileError::Length { found: f, .. } if f == found), "{error}");
    }
    let error = MemoryFile::open(served.folder.path(), 0, None, 1 << 16).expect_err("a directory");
    assert!(matches!(error, MemoryFileError::NotRegular { .. }), "{error}");
    let error = MemoryFile::open(&path.join("x"), 0, None, 1 << 16).expect_err("no directory");
    assert!(matches!(error, MemoryFileError::File { .. }), "{error}");
}

#[test]
fn a_file_that_no_board_has_made_is_refused_whatever_its_length() {
    let folder = tempfile::tempdir().expect("a directory");
    let path = folder.path().join("photos.tar");
    let open = || MemoryFile::open(&path, MEMORY_BASE, None, 1 << 20);
    for length in [1, 4096, 1 << 16, (1 << 16) + 4096, 1 << 21, (1 << 20) + 4096] {
        let content = vec![0x5A; length];
        std::fs::write(&path, &content).expect("written");
        let error = open().expect_err("a file of another owner");
        let found = length as u64;
        assert!(
            matches!(&error, MemoryFileError::NotMade { found: f, .. } if *f == found),
            "{error}"
        );
        assert!(error.to_string().contains("name another file, or remove it"), "{error}");
        assert_eq!(std::fs::read(&path).expect("there"), content);
    }

    // An empty file holds nothing to lose; from now on it belongs to the board.
    std::fs::write(&path, []).expect("written");
    for _ in 0..2 {
        let memory = open().expect("empty, then made");
        assert_eq!(memory.addresses(), MEMORY_BASE..MEMORY_BASE + (1 << 20));
    }
    // With another length it is another file.
    let made = std::fs::metadata(&path).expect("there").len();
    for length in [made - 1, made - 4096, made + 1] {
        let file = std::fs::File::options().write(true).open(&path).expect("there");
        file.set_len(length).expect("changed");
        let error = open().expect_err("changed");
        assert!(matches!(error, MemoryFileError::NotMade { .. }), "{length}: {error}");
    }
}

#[test]
fn memory_is_reserved_and_what_the_file_system_does_not_give_is_refused() {
    let folder = tempfile::tempdir().expect("a directory");
    let path = folder.path().join("memory");
    let blocks = || std::fs::metadata(&path).expect("there").blocks() * 512;
    MemoryFile::open(&path, MEMORY_BASE, None, 1 << 20).expect("room");
    assert!(blocks() >= 1 << 20, "{} bytes", blocks());
    // A hole in the board's own file is filled.
    let mark = std::fs::read(&path).expect("there").split_off(1 << 20);
    let file = std::fs::File::create(&path).expect("emptied");
    file.write_all_at(&mark, 1 << 20).expect("written");
    assert!(blocks() < 1 << 20, "{} bytes", blocks());
    MemoryFile::open(&path, MEMORY_BASE, None, 1 << 20).expect("room");
    assert!(blocks() >= 1 << 20, "{} bytes", blocks());

    // More bytes than any file system has.
    let most = 1 << 62;
    let whole = folder.path().join("whole");
    let error = MemoryFile::open(&whole, 0, Some(most), 0).expect_err("no such file system");
    assert!(matches!(&error, MemoryFileError::NoRoom { bytes, .. } if *bytes == most), "{error}");
    assert!(error.to_string().contains("serve a smaller one"), "{error}");
    assert!(!whole.exists(), "nothing that was begun is left");
    std::fs::write(&whole, []).expect("written");
    MemoryFile::open(&whole, 0, Some(most), 0).expect_err("no such file system");
    assert_eq!(std::fs::metadata(&whole).expect("there still").len(), 0);
}

#[test]
fn a_memory_that_was_changed_since_its_board_was_served_is_refused() {
    let served = Served::new(BoardConfig::default());
    let path = served.socket().with_extension("memory");
    let file = std::fs::File::options().write(true).open(&path).expect("there");
    file.set_len(1 << 16).expect("cut");
    let error = Accelerator::open(served.options()).expect_err("cut");
    assert!(
        matches!(
            error,
            Error::Open(OpenError::Platform(PlatformError::UnusableMemory { bytes: 0x1_0000, .. }))
        ),
        "{error}"
    );
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
    let source = std::error::Error::source(&error).expect("a cause").to_string();
    assert!(source.contains("Two worlds on one board"), "{source}");
    assert!(started.elapsed() < NOTICE_LIMIT, "{:?}", started.elapsed());
    mute.set_read_timeout(Some(NOTICE_LIMIT)).expect("set");
    assert_eq!(mute.read(&mut [0]).expect("hung up in time"), 0);
    let Ended::Broken(error) = served.visit().ended else { panic!("it was broken off") };
    assert_eq!(error.to_string(), "it asked for no memory within 1s");
    steps(&mut served.open(), 5);
    assert!(matches!(served.visit().ended, Ended::Left));

    // Half a request, or an answer that the driver does not read, ends the visit, too.
    let inode = std::fs::metadata(served.socket().with_extension("memory")).expect("there").ino();
    let memory = Request::Memory { inode }.encode();
    let mut half = raw(&served);
    assert_eq!(ask(&mut half, &hello).status, Status::Done);
    assert_eq!(ask(&mut half, &memory).status, Status::Done);
    half.write_all(&memory[..15]).expect("sent");
    half.set_read_timeout(Some(NOTICE_LIMIT)).expect("set");
    assert_eq!(half.read(&mut [0]).expect("hung up in time"), 0);
    let Ended::Broken(error) = served.visit().ended else { panic!("it was broken off") };
    assert_eq!(error.to_string(), "it sent half a request and no more within 1s");

    let mut unread = raw(&served);
    unread.set_write_timeout(Some(2 * NOTICE_LIMIT)).expect("set");
    let many = memory.repeat(1 << 12);
    unread.write_all(&hello).expect("sent");
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
            matches!(&error, Error::Open(OpenError::Platform(PlatformError::Busy { .. }))),
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
