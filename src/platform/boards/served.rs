//! Drives a board in another process: registers, interrupt and time through a socket, memory for
//! DMA in a file that both processes have open.
//!
//! The file is locked like every device file: the board has one driver at a time. The clock is the
//! board's and virtual: it advances with each request, and each answer carries its time.

use std::ffi::OsString;
use std::fmt;
use std::fs::File;
use std::io::{self, Read as _, Write as _};
use std::os::unix::fs::MetadataExt as _;
use std::os::unix::net::UnixStream;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use bitstream_model::remote::{connect, mark};

use pgs_interface::message::{ANSWER_BYTES, Answer, MEMORY_SUFFIX, Request, Status, VERSION};

use crate::platform::linux::lock::LockedFile;
use crate::platform::linux::mapped::Mapping;
use crate::platform::memory::pool::Pool;
use crate::platform::{
    DmaMemorySource, Platform, PlatformError, RegisterMap, RegisterWindow, ReservedMemory,
};

/// Longest wait of one request, shorter than the protocol allows: a simulator of the accelerator needs
/// ten seconds for a millisecond of the board's time.
const ONE_WAIT: Duration = Duration::from_millis(1);

/// Longest real time for an answer, in which the board's process computes at most [`ONE_WAIT`] of
/// the board's time.
const ANSWER_LIMIT: Duration = Duration::from_secs(60);

/// Longest real time in which a free board answers the hello of a driver.
const HELLO_LIMIT: Duration = Duration::from_secs(10);

/// The default file for the memory of a board served at `socket`.
pub(crate) fn memory_beside(socket: &Path) -> PathBuf {
    let mut path = OsString::from(socket);
    path.push(MEMORY_SUFFIX);
    path.into()
}

/// A board in another process.
#[derive(Debug)]
pub(crate) struct RemotePlatform {
    line: Arc<Line>,
    pool: Pool,
}

impl RemotePlatform {
    /// Connects to the board served at `socket`, whose memory is the file `memory`. No register is
    /// touched.
    pub(crate) fn open(socket: &Path, memory: &Path) -> Result<Self, PlatformError> {
        Self::open_within(socket, memory, HELLO_LIMIT)
    }

    /// The same for a board that answers the hello within `limit`.
    fn open_within(socket: &Path, memory: &Path, limit: Duration) -> Result<Self, PlatformError> {
        let line = Line::connect(socket, limit)?;
        let error = |act| {
            move |source| PlatformError::ServedMemory {
                act,
                memory: memory.to_owned(),
                socket: socket.to_owned(),
                source,
            }
        };
        let file = File::options().read(true).write(true).open(memory).map_err(error("open"))?;
        let lock = Arc::new(LockedFile::of_file(file, memory)?);
        let metadata = lock.file().metadata().map_err(error("measure"))?;

        let hello = line.hello(limit)?;
        if hello.status == Status::Busy {
            return Err(PlatformError::ServerBusy { socket: socket.to_owned() });
        }
        line.set_limit(ANSWER_LIMIT)?;
        if hello.status != Status::Done || hello.value != VERSION {
            return Err(PlatformError::OtherServer {
                socket: socket.to_owned(),
                expected: VERSION,
                found: hello.value,
            });
        }
        let placed = line.ask(Request::Memory { inode: metadata.ino() })?;
        if placed.status != Status::Done {
            let (socket, memory) = (socket.to_owned(), memory.to_owned());
            return Err(PlatformError::OtherMemory { socket, memory });
        }
        let name = memory.display().to_string();
        let address = placed.number;
        let marked = mark::memory_bytes(lock.file()).map_err(error("measure"))?;
        let bytes = marked.ok_or_else(|| PlatformError::UnusableMemory {
            region: name.clone(),
            address,
            bytes: metadata.len(),
            reason: "it was changed since its board was served; end that `pgs serve`, remove the \
                     file, and serve the board again",
        })?;
        let length = usize::try_from(bytes).map_err(|_| PlatformError::UnusableMemory {
            region: name.clone(),
            address,
            bytes,
            reason: "make it smaller",
        })?;
        let mapping = Mapping::new(&lock, 0, 0, length)?;
        let memory = ReservedMemory::new(mapping, address, name)?;
        log::info!("memory for DMA: {} bytes at {:#x}", memory.bytes(), memory.address());
        Ok(Self { line: Arc::new(line), pool: Pool::new(Box::new(memory)) })
    }
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
    fn connect(socket: &Path, limit: Duration) -> Result<Self, PlatformError> {
        let stream = connect(socket, limit)
            .map_err(|source| PlatformError::NoServer { socket: socket.to_owned(), source })?;
        let state = State { stream, limit, now: Duration::ZERO, lost: None };
        let line = Self { socket: socket.to_owned(), state: Mutex::new(state) };
        line.set_limit(limit)?;
        Ok(line)
    }

    /// Bounds every request and its answer from here on.
    fn set_limit(&self, limit: Duration) -> Result<(), PlatformError> {
        let mut state = self.state();
        state.limit = limit;
        let set = state.stream.set_write_timeout(Some(limit));
        set.and_then(|()| state.stream.set_read_timeout(Some(limit)))
            .map_err(|source| self.lost_to(Arc::new(source)))
    }

    /// The first request. A board that does not answer it is silent, not lost: no step has begun.
    fn hello(&self, limit: Duration) -> Result<Answer, PlatformError> {
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

    /// One request and its answer. After the first failure the board is lost for good.
    fn ask(&self, request: Request) -> Result<Answer, PlatformError> {
        let mut state = self.state();
        if state.lost.is_none() {
            let limit = state.limit;
            match exchange(&mut state.stream, request, limit) {
                Ok(answer) => {
                    // A clock that stands still or runs backwards would make waits endless.
                    let waited = match (request, answer.status) {
                        (Request::Pause { time }, _)
                        | (Request::WaitInterrupt { time }, Status::Nothing) => time,
                        _ => Duration::ZERO,
                    };
                    state.now = answer.now.max(state.now.saturating_add(waited));
                    return Ok(answer);
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

/// Sends a request and reads its answer. The whole answer must arrive within `limit`.
fn exchange(stream: &mut UnixStream, request: Request, limit: Duration) -> io::Result<Answer> {
    let until = Instant::now() + limit;
    let late = || io::Error::new(io::ErrorKind::TimedOut, format!("no answer within {limit:?}"));
    // The kernel reports a transfer that has timed out as `WouldBlock`.
    let timed = |error: io::Error| match error.kind() {
        io::ErrorKind::WouldBlock => late(),
        _ => error,
    };
    stream.write_all(&request.encode()).map_err(timed)?;
    let mut bytes = [0; ANSWER_BYTES];
    let mut filled = 0;
    while filled < ANSWER_BYTES {
        match stream.read(&mut bytes[filled..]) {
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
    Ok(answer)
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
    fn window(&self, map: RegisterMap) -> Result<Box<dyn RegisterWindow>, PlatformError> {
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

    fn wait_interrupt(&self, timeout: Duration) -> Result<Option<u32>, PlatformError> {
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

    fn unmask_interrupt(&self) -> Result<(), PlatformError> {
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

    /// A folder with a bound socket and a file for the memory.
    fn bound() -> (tempfile::TempDir, PathBuf, PathBuf, UnixListener) {
        let folder = tempfile::tempdir().expect("a directory");
        let (socket, memory) = (folder.path().join("board"), folder.path().join("memory"));
        let listener = UnixListener::bind(&socket).expect("bound");
        File::create(&memory).expect("made");
        (folder, socket, memory, listener)
    }

    #[test]
    fn a_server_that_does_not_answer_the_first_message_is_silent_and_not_lost() {
        let (_folder, socket, memory, _listener) = bound();
        let limit = Duration::from_millis(20);
        let error = RemotePlatform::open_within(&socket, &memory, limit).expect_err("no answer");
        assert!(matches!(&error, PlatformError::ServerSilent { socket: s, .. } if *s == socket));
        assert!(error.to_string().contains("says nothing within 20ms"), "{error}");
    }

    #[test]
    fn an_answer_that_comes_drop_by_drop_is_late() {
        let (_folder, socket, _memory, listener) = bound();
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
