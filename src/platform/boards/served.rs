//! Drives a board in another process: registers, interrupt and time through a socket, memory for
//! DMA in a file that comes through it, new for each driver.
//!
//! The board has one driver at a time, by its server's rule. The clock is the board's and virtual:
//! it advances with each request, and each answer carries its time.

use std::fmt;
use std::fs::File;
use std::io::{self, Read as _, Write as _};
use std::os::unix::net::UnixStream;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use bitstream_model::remote::{SEALS, connect, receive_files};
use nix::fcntl::{FcntlArg, SealFlag, fcntl};
use pgs_interface::message::{ANSWER_BYTES, Answer, MEMORY_UNIT, Request, Status, VERSION};

use crate::platform::linux::mapped::Mapping;
use crate::platform::memory::pool::Pool;
use crate::platform::{
    DmaMemorySource, Platform, PlatformError, RegisterMap, RegisterWindow, ReservedMemory, Result,
};

/// Longest wait of one request, shorter than the protocol allows: a simulator of the accelerator
/// needs ten seconds for a millisecond of the board's time.
const ONE_WAIT: Duration = Duration::from_millis(1);

/// Longest real time for an answer, in which the board's process computes at most [`ONE_WAIT`] of
/// the board's time.
const ANSWER_LIMIT: Duration = Duration::from_secs(60);

/// Longest real time in which a free board answers the hello of a driver.
const HELLO_LIMIT: Duration = Duration::from_secs(10);

/// A board in another process.
#[derive(Debug)]
pub(crate) struct RemotePlatform {
    line: Arc<Line>,
    pool: Pool,
}

impl RemotePlatform {
    /// Connects to the board served at `socket`. No register is touched.
    pub(crate) fn open(socket: &Path) -> Result<Self> {
        Self::open_within(socket, HELLO_LIMIT)
    }

    /// The same for a board that answers the hello within `limit`.
    fn open_within(socket: &Path, limit: Duration) -> Result<Self> {
        let line = Line::connect(socket, limit)?;
        let hello = line.hello(limit)?;
        let socket = || socket.to_owned();
        match hello.status {
            Status::Done if hello.value == VERSION => {}
            Status::Busy => return Err(PlatformError::ServerBusy { socket: socket() }),
            Status::Done | Status::OtherVersion if hello.value != VERSION => {
                return Err(PlatformError::OtherServer {
                    socket: socket(),
                    expected: VERSION,
                    found: hello.value,
                });
            }
            status => {
                return Err(PlatformError::ServerRefuses { socket: socket(), found: status });
            }
        }
        line.set_limit(ANSWER_LIMIT)?;
        let (placed, files) = line.exchange(Request::Memory)?;
        if placed.status == Status::NoMemory {
            let errno = i32::try_from(placed.value).unwrap_or(0);
            let source = io::Error::from_raw_os_error(errno);
            return Err(PlatformError::ServerNoMemory { socket: socket(), source });
        }
        let (file, length) = checked_memory(&placed, files)
            .map_err(|found| PlatformError::ServerMemory { socket: socket(), found })?;
        let mapping = Mapping::of_private(&file, &line.socket, length)?;
        let memory =
            ReservedMemory::new(mapping, placed.number, line.socket.display().to_string())?;
        log::info!("memory for DMA: {} bytes at {:#x}", memory.bytes(), memory.address());
        Ok(Self { line: Arc::new(line), pool: Pool::new(Box::new(memory)) })
    }
}

/// The file of a board's memory and its length, or what came instead. Nobody can take a byte of it
/// away, which would end this process with SIGBUS.
fn checked_memory(placed: &Answer, mut files: Vec<File>) -> Result<(File, usize), String> {
    if placed.status != Status::Done {
        return Err(format!("the status {:?}", placed.status));
    }
    let count = files.len();
    let (Some(file), 1) = (files.pop(), count) else { return Err(format!("{count} files")) };
    let announced = u64::from(placed.value) * MEMORY_UNIT;
    let bytes = file.metadata().map_or(0, |metadata| metadata.len());
    if bytes != announced || bytes == 0 || placed.number.checked_add(bytes).is_none() {
        return Err(format!("{bytes} bytes at {:#x}, announced as {announced}", placed.number));
    }
    // No file but a memfd has seals.
    let seals =
        fcntl(&file, FcntlArg::F_GET_SEALS).map_or(SealFlag::empty(), SealFlag::from_bits_retain);
    if !seals.contains(SEALS) {
        return Err(format!("a file with the seals {seals:?}"));
    }
    let length = usize::try_from(bytes).map_err(|_| format!("{bytes} bytes"))?;
    Ok((file, length))
}

/// The connection to a board.
struct Line {
    socket: PathBuf,
    state: Mutex<State>,
}

/// The state of a connection.
struct State {
    stream: UnixStream,
    /// Longest real time for an answer.
    limit: Duration,
    /// The board's time at its last answer. A lost board has no clock: our own waits advance this
    /// time then, so that they end.
    now: Duration,
    lost: Option<Arc<io::Error>>,
}

impl fmt::Debug for Line {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Line").field("socket", &self.socket).finish_non_exhaustive()
    }
}

impl Line {
    fn connect(socket: &Path, limit: Duration) -> Result<Self> {
        let stream = connect(socket, limit)
            .map_err(|source| PlatformError::NoServer { socket: socket.to_owned(), source })?;
        let state = State { stream, limit, now: Duration::ZERO, lost: None };
        let line = Self { socket: socket.to_owned(), state: Mutex::new(state) };
        line.set_limit(limit)?;
        Ok(line)
    }

    /// Bounds every request and its answer from here on.
    fn set_limit(&self, limit: Duration) -> Result<()> {
        let mut state = self.state();
        state.limit = limit;
        let set = state.stream.set_write_timeout(Some(limit));
        set.and_then(|()| state.stream.set_read_timeout(Some(limit)))
            .map_err(|source| self.lost_to(Arc::new(source)))
    }

    /// The first request. A board that does not answer it is silent, not lost: no step has begun.
    fn hello(&self, limit: Duration) -> Result<Answer> {
        self.ask(Request::Hello { version: VERSION }).map_err(|error| match &error {
            PlatformError::ServerLost { socket, source }
                if source.kind() == io::ErrorKind::TimedOut =>
            {
                PlatformError::ServerSilent { socket: socket.clone(), limit }
            }
            _ => error,
        })
    }

    fn state(&self) -> MutexGuard<'_, State> {
        // No code under the lock panics between two changes that belong together.
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// One request and its answer.
    fn ask(&self, request: Request) -> Result<Answer> {
        self.exchange(request).map(|(answer, _)| answer)
    }

    /// One request, its answer, and the files that come beside it. After the first failure the
    /// board is lost for good.
    fn exchange(&self, request: Request) -> Result<(Answer, Vec<File>)> {
        let mut state = self.state();
        if state.lost.is_none() {
            let limit = state.limit;
            match exchange(&mut state.stream, request, limit) {
                Ok((answer, files)) => {
                    // A clock that stands still or runs backwards would make waits endless.
                    let waited = match (request, answer.status) {
                        (Request::Pause { time }, _)
                        | (Request::WaitInterrupt { time }, Status::Nothing) => time,
                        _ => Duration::ZERO,
                    };
                    state.now = answer.now.max(state.now.saturating_add(waited));
                    return Ok((answer, files));
                }
                Err(error) => {
                    log::error!("the board served at {} is lost: {error}", self.socket.display());
                    state.lost = Some(Arc::new(error));
                }
            }
        }
        let source = state.lost.clone().unwrap_or_else(|| Arc::new(closed()));
        Err(self.lost_to(source))
    }

    fn lost_to(&self, source: Arc<io::Error>) -> PlatformError {
        PlatformError::ServerLost { socket: self.socket.clone(), source }
    }

    /// The value of a register: all ones if the board is lost, like a board without power.
    fn read(&self, address: u64) -> u32 {
        self.ask(Request::Read { address }).map_or(u32::MAX, |answer| answer.value)
    }
}

/// Sends a request and reads its answer, and the files beside it. The whole answer must arrive
/// within `limit`.
fn exchange(
    stream: &mut UnixStream,
    request: Request,
    limit: Duration,
) -> io::Result<(Answer, Vec<File>)> {
    let until = Instant::now() + limit;
    let late = || io::Error::new(io::ErrorKind::TimedOut, format!("no answer within {limit:?}"));
    // The kernel reports a transfer that has timed out as `WouldBlock`.
    let timed = |error: io::Error| match error.kind() {
        io::ErrorKind::WouldBlock => late(),
        _ => error,
    };
    stream.write_all(&request.encode()).map_err(timed)?;
    let mut bytes = [0; ANSWER_BYTES];
    let (mut filled, mut files) = (0, Vec::new());
    while filled < ANSWER_BYTES {
        let rest = &mut bytes[filled..];
        // Files that come beside any other answer are closed unseen.
        let read = match request {
            Request::Memory => receive_files(stream, rest).map(|(read, more)| {
                files.extend(more);
                read
            }),
            _ => stream.read(rest),
        };
        match read {
            Ok(0) => return Err(closed()),
            Ok(read) => filled += read,
            Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
            Err(error) => return Err(timed(error)),
        }
        if filled < ANSWER_BYTES && Instant::now() >= until {
            return Err(late());
        }
    }
    let answer = Answer::decode(&bytes)
        .map_err(|error| io::Error::new(io::ErrorKind::InvalidData, error))?;
    if answer.status == Status::Refused {
        let text = format!("it does not understand {request:?}");
        return Err(io::Error::new(io::ErrorKind::InvalidData, text));
    }
    Ok((answer, files))
}

fn closed() -> io::Error {
    io::Error::new(io::ErrorKind::UnexpectedEof, "its process has closed the socket")
}

/// A register region of the board.
#[derive(Debug)]
struct RemoteWindow {
    line: Arc<Line>,
    base: u64,
    bytes: u32,
}

impl RegisterWindow for RemoteWindow {
    fn bytes(&self) -> u64 {
        u64::from(self.bytes)
    }

    fn read32(&self, at: u32) -> u32 {
        self.line.read(self.base + u64::from(at))
    }

    fn write32(&self, at: u32, value: u32) {
        // A write to a lost board goes nowhere; the next wait reports the loss.
        let _ = self.line.ask(Request::Write { address: self.base + u64::from(at), value });
    }
}

impl Platform for RemotePlatform {
    fn window(&self, map: RegisterMap) -> Result<Box<dyn RegisterWindow>> {
        let (base, bytes) = map.place();
        Ok(Box::new(RemoteWindow { line: Arc::clone(&self.line), base, bytes }))
    }

    fn memory(&self) -> &dyn DmaMemorySource {
        &self.pool
    }

    fn now(&self) -> Duration {
        self.line.state().now
    }

    fn pause(&self, duration: Duration) {
        let mut left = duration;
        while !left.is_zero() {
            let time = left.min(ONE_WAIT);
            if self.line.ask(Request::Pause { time }).is_err() {
                let mut state = self.line.state();
                state.now = state.now.saturating_add(left);
                return;
            }
            left -= time;
        }
    }

    fn wait_interrupt(&self, timeout: Duration) -> Result<Option<u32>> {
        let mut left = timeout;
        loop {
            let time = left.min(ONE_WAIT);
            let answer = self.line.ask(Request::WaitInterrupt { time })?;
            left -= time;
            match answer.status {
                Status::Nothing if left.is_zero() => return Ok(None),
                Status::Nothing => {}
                _ => return Ok(Some(answer.value)),
            }
        }
    }

    fn unmask_interrupt(&self) -> Result<()> {
        self.line.ask(Request::Unmask).map(|_| ())
    }

    fn lost(&self) -> Option<PlatformError> {
        let source = self.line.state().lost.clone()?;
        Some(self.line.lost_to(source))
    }
}

#[cfg(test)]
mod tests {
    use std::os::unix::net::UnixListener;

    use bitstream_model::remote::send_file;
    use nix::sys::memfd::{MFdFlags, memfd_create};
    use pgs_interface::message::REQUEST_BYTES;

    use super::*;
    use crate::platform::memory::reserved::fake::reserved;
    use crate::platform::{Deadline, poll_until};

    #[test]
    fn a_server_that_is_silent_is_lost_and_every_wait_ends() {
        let folder = tempfile::tempdir().expect("a directory");
        let socket = folder.path().join("silent");
        let listener = UnixListener::bind(&socket).expect("bound");
        let line = Line::connect(&socket, Duration::from_millis(20)).expect("somebody listens");
        let error = line.ask(Request::Unmask).expect_err("no answer");
        let PlatformError::ServerLost { source, .. } = &error else { panic!("{error}") };
        assert_eq!(source.kind(), io::ErrorKind::TimedOut);
        assert!(source.to_string().contains("no answer within 20ms"), "{source}");

        // From here on nothing is sent, and no time of ours passes.
        let (_root, memory) = reserved(0x6000_0000, 1 << 16);
        let platform = RemotePlatform { line: Arc::new(line), pool: Pool::new(Box::new(memory)) };
        let window = platform.window(RegisterMap::Control).expect("a window");
        assert_eq!(window.read32(0), u32::MAX);
        assert!(matches!(platform.lost(), Some(PlatformError::ServerLost { .. })));
        window.write32(0, 1);
        platform.wait_interrupt(Duration::from_secs(3600)).expect_err("lost");
        platform.unmask_interrupt().expect_err("lost");
        let deadline = Deadline::after(&platform, Duration::from_secs(3600));
        assert!(poll_until(&platform, &deadline, || None::<()>).is_none());
        assert!(platform.now() >= Duration::from_secs(3600));
        let (mut stream, _) = listener.accept().expect("the driver");
        let mut sent = Vec::new();
        drop((window, platform));
        stream.read_to_end(&mut sent).expect("closed");
        assert_eq!(sent, Request::Unmask.encode());
    }

    /// A folder with a bound socket.
    fn bound() -> (tempfile::TempDir, PathBuf, UnixListener) {
        let folder = tempfile::tempdir().expect("a directory");
        let socket = folder.path().join("board");
        let listener = UnixListener::bind(&socket).expect("bound");
        (folder, socket, listener)
    }

    #[test]
    fn a_server_that_does_not_answer_the_first_message_is_silent_and_not_lost() {
        let (_folder, socket, _listener) = bound();
        let limit = Duration::from_millis(20);
        let error = RemotePlatform::open_within(&socket, limit).expect_err("no answer");
        assert!(matches!(&error, PlatformError::ServerSilent { socket: s, .. } if *s == socket));
        assert!(error.to_string().contains("says nothing within 20ms"), "{error}");
    }

    /// What a driver says to a server that gives these answers, the second with these files beside
    /// it.
    fn refused(answers: [(Status, u32); 2], files: Vec<File>) -> PlatformError {
        let (_folder, socket, listener) = bound();
        let server = std::thread::spawn(move || {
            let (mut stream, _) = listener.accept().expect("the driver");
            let mut request = [0; REQUEST_BYTES];
            for (number, (status, value)) in answers.into_iter().enumerate() {
                if stream.read_exact(&mut request).is_err() {
                    return;
                }
                let answer = Answer { status, value, number: 0x5000_0000, now: Duration::ZERO };
                let mut rest = &answer.encode()[..];
                for file in files.iter().filter(|_| number == 1) {
                    send_file(&stream, &rest[..4], file).expect("sent");
                    rest = &rest[4..];
                }
                stream.write_all(rest).expect("sent");
            }
        });
        let error = RemotePlatform::open(&socket).expect_err("refused");
        server.join().expect("no panic");
        error
    }

    #[test]
    fn a_hello_that_is_refused_with_the_right_version_is_no_board() {
        for status in [Status::OtherVersion, Status::NoMemory, Status::Nothing] {
            let error = refused([(status, VERSION), (Status::Done, 1)], Vec::new());
            assert!(
                matches!(&error, PlatformError::ServerRefuses { found, .. } if *found == status),
                "{error}"
            );
        }
        for status in [Status::OtherVersion, Status::Done] {
            let error = refused([(status, VERSION + 1), (Status::Done, 1)], Vec::new());
            assert!(
                matches!(error, PlatformError::OtherServer { found, .. } if found == VERSION + 1),
                "{error}"
            );
        }
        let error = refused([(Status::Busy, VERSION), (Status::Done, 1)], Vec::new());
        assert!(matches!(error, PlatformError::ServerBusy { .. }), "{error}");
    }

    /// A file of memory with these seals.
    fn memory(bytes: u64, seals: SealFlag) -> File {
        let file = memfd_create("test", MFdFlags::MFD_ALLOW_SEALING).expect("made");
        let file = File::from(file);
        file.set_len(bytes).expect("set");
        fcntl(&file, FcntlArg::F_ADD_SEALS(seals)).expect("sealed");
        file
    }

    #[test]
    fn memory_that_could_be_taken_away_is_refused_by_name() {
        let (shrink, grow) = (SealFlag::F_SEAL_SHRINK, SealFlag::F_SEAL_GROW);
        let good = || memory(MEMORY_UNIT, SEALS);
        let cases: [(Vec<File>, u32, &str); 7] = [
            (Vec::new(), 1, "found 0 files"),
            (vec![good(), good()], 1, "found 2 files"),
            (vec![good()], 2, "found 65536 bytes at 0x50000000, announced as 131072"),
            (vec![memory(0, SEALS)], 0, "found 0 bytes"),
            (
                vec![memory(MEMORY_UNIT, shrink | grow)],
                1,
                "seals SealFlag(F_SEAL_SHRINK | F_SEAL_GROW)",
            ),
            (vec![memory(MEMORY_UNIT, (SEALS - shrink) | SealFlag::F_SEAL_SEAL)], 1, "F_SEAL_GROW"),
            (vec![tempfile::tempfile().expect("a file")], 1, "found 0 bytes"),
        ];
        for (files, value, text) in cases {
            let error = refused([(Status::Done, VERSION), (Status::Done, value)], files);
            assert!(matches!(error, PlatformError::ServerMemory { .. }), "{error}");
            assert!(error.to_string().contains(text), "{text}: {error}");
        }
        let plain = tempfile::tempfile().expect("a file");
        plain.set_len(MEMORY_UNIT).expect("set");
        let error = refused([(Status::Done, VERSION), (Status::Done, 1)], vec![plain]);
        assert!(error.to_string().contains("found a file with the seals"), "{error}");
        let errno = nix::errno::Errno::ENOMEM as u32;
        let error = refused([(Status::Done, VERSION), (Status::NoMemory, errno)], Vec::new());
        let PlatformError::ServerNoMemory { source, .. } = &error else { panic!("{error}") };
        assert_eq!(source.kind(), io::ErrorKind::OutOfMemory, "{source}");
    }

    #[test]
    fn an_answer_that_comes_drop_by_drop_is_late() {
        let (_folder, socket, listener) = bound();
        let limit = Duration::from_millis(200);
        let line = Line::connect(&socket, limit).expect("somebody listens");
        let dripping = std::thread::spawn(move || {
            let (mut stream, _) = listener.accept().expect("the driver");
            // Each byte is in time, and the whole would take twelve limits.
            let taken = |_: &usize| {
                std::thread::park_timeout(limit / 2);
                stream.write_all(&[0]).is_ok()
            };
            (0..ANSWER_BYTES).take_while(taken).count()
        });
        let error = line.ask(Request::Unmask).expect_err("late");
        let PlatformError::ServerLost { source, .. } = &error else { panic!("{error}") };
        assert_eq!(source.kind(), io::ErrorKind::TimedOut, "{source}");
        drop(line);
        assert!(dripping.join().expect("no panic") < ANSWER_BYTES);
    }
}
