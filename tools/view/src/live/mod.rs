//! Serves the page of a run while the board steps: its frames are server-sent events.
//!
//! The run never waits for a reader. A frame is encoded if a reader is there and the last one is
//! long enough ago; it goes to each reader through a bounded channel, and a reader that has no room
//! misses it. A reader that does not take a frame in time is dropped. A random token makes the
//! page's address secret, and pages of other origins get nothing.
//!
//! Source: WHATWG HTML, section 9.2 (server-sent events); RFC 9110, sections 7.2 (`Host`) and 15;
//! RFC 6454, section 7 (`Origin`).

mod request;

use std::fs::File;
use std::io::{self, Read as _, Write as _};
use std::net::{Shutdown, SocketAddr, TcpListener, TcpStream};
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::mpsc::{Receiver, SyncSender, TrySendError};
use std::sync::{Arc, Mutex, MutexGuard, OnceLock, PoisonError, mpsc};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

use base64::Engine as _;
use base64::prelude::BASE64_STANDARD;
use serde_json::json;
use zynq_pgs::Body;

use self::request::{Answer, Request};
use crate::error::ViewError;
use crate::page;
use crate::quantise;
use crate::recording::Recording;

/// Bounds of the server.
#[derive(Debug, Clone, Copy)]
struct Limits {
    /// Connections at a time.
    connections: usize,
    /// Time for a request to arrive.
    request: Duration,
    /// Time for a reader to take a page or a frame.
    write: Duration,
    /// Least time from one frame to the next.
    interval: Duration,
    /// Frames that wait for a reader.
    waiting: usize,
    /// Time from an error of the listener to its next try.
    pause: Duration,
}

const LIMITS: Limits = Limits {
    connections: 8,
    request: Duration::from_secs(5),
    write: Duration::from_secs(2),
    interval: Duration::from_millis(33),
    waiting: 4,
    pause: Duration::from_millis(100),
};

/// An event for all readers.
type Event = Arc<str>;

/// The parts that the run and the threads of the connections share.
#[derive(Debug)]
struct Hub {
    limits: Limits,
    token: String,
    page: String,
    is_closed: AtomicBool,
    connections: AtomicUsize,
    readers: Mutex<Vec<Reader>>,
    /// The frame of the end, for readers that no longer get another.
    last: OnceLock<Event>,
}

/// A reader of frames.
#[derive(Debug)]
struct Reader {
    events: SyncSender<Event>,
    /// Disconnected when the thread behind it ends.
    gone: Receiver<()>,
}

impl Hub {
    fn readers(&self) -> MutexGuard<'_, Vec<Reader>> {
        self.readers.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// A run that a browser may watch.
#[derive(Debug)]
pub struct Live {
    address: SocketAddr,
    hub: Arc<Hub>,
    /// The bodies, and the pose of each at the last frame.
    recording: Recording,
    sent: Option<Instant>,
    listener: Option<JoinHandle<()>>,
}

impl Live {
    /// Begins to serve; a recording of the start tells the bodies and the first view, `facts` are
    /// labels and texts about the run. Port 0 takes a free one.
    ///
    /// # Errors
    /// [`ViewError`]: the address cannot be used, or the bodies do not fit on a page.
    pub fn start(
        address: SocketAddr,
        start: &Recording,
        title: &str,
        facts: &[(&str, String)],
    ) -> Result<Self, ViewError> {
        Self::within(LIMITS, address, start, title, facts)
    }

    fn within(
        limits: Limits,
        address: SocketAddr,
        start: &Recording,
        title: &str,
        facts: &[(&str, String)],
    ) -> Result<Self, ViewError> {
        let page = page::live(start, title, facts)?;
        let served = || {
            let listener = TcpListener::bind(address)?;
            Ok((listener.local_addr()?, token()?, listener))
        };
        let unserved = |source| ViewError::Live { address, source };
        let (address, token, listener) = served().map_err(unserved)?;
        let hub = Arc::new(Hub {
            limits,
            token,
            page,
            is_closed: AtomicBool::new(false),
            connections: AtomicUsize::new(0),
            readers: Mutex::default(),
            last: OnceLock::new(),
        });
        let shared = Arc::clone(&hub);
        let accept = move || accept(listener.incoming(), &shared);
        let listener = thread::Builder::new().name("live".to_owned()).spawn(accept);
        let listener = Some(listener.map_err(unserved)?);
        Ok(Self { address, hub, recording: start.clone(), sent: None, listener })
    }

    /// The address of the page.
    #[must_use]
    pub fn url(&self) -> String {
        format!("http://{}/{}/", self.address, self.hub.token)
    }

    /// Shows the bodies after a step, with a note about it, to the readers that are there. Never
    /// waits. A frame that is too early after the last one, or that no page can show, is left out.
    pub fn show(&mut self, at: (u32, f32), note: impl FnOnce() -> String, bodies: &[Body]) {
        // Beside this a run without a reader has no cost.
        if self.hub.readers().is_empty()
            || self.sent.is_some_and(|sent| sent.elapsed() < self.hub.limits.interval)
        {
            return;
        }
        let Some(event) = self.event(at, &note(), bodies, false) else { return };
        self.sent = Some(Instant::now());
        self.hub.readers().retain(|reader| {
            let sent = reader.events.try_send(Arc::clone(&event));
            !matches!(sent, Err(TrySendError::Disconnected(_)))
        });
    }

    /// Shows the bodies at the end, and closes; waits for all readers together as long as one may
    /// take for two frames, the one that it is at and the last.
    pub fn end(mut self, at: (u32, f32), note: &str, bodies: &[Body]) {
        let readers = std::mem::take(&mut *self.hub.readers());
        if readers.is_empty() {
            return;
        }
        let Some(event) = self.event(at, note, bodies, true) else { return };
        self.hub.last.get_or_init(|| event);
        let deadline = Instant::now() + self.hub.limits.write * 2;
        // Without its channel a thread ends behind the last frame.
        let gone: Vec<_> = readers.into_iter().map(|reader| reader.gone).collect();
        for gone in gone {
            let _gone = gone.recv_timeout(deadline.saturating_duration_since(Instant::now()));
        }
    }

    fn event(
        &mut self,
        (step, time): (u32, f32),
        note: &str,
        bodies: &[Body],
        ended: bool,
    ) -> Option<Event> {
        let frame = self.recording.alone(step, time, bodies).ok()?;
        let (low, quantum, poses) = quantise::alone(&frame);
        let data = json!({
            "step": step, "time": time, "note": note, "ended": ended,
            "low": low, "quantum": quantum, "poses": BASE64_STANDARD.encode(poses),
        });
        Some(format!("data: {data}\n\n").into())
    }
}

impl Drop for Live {
    fn drop(&mut self) {
        self.hub.is_closed.store(true, Ordering::Release);
        self.hub.readers().clear();
        if let Some(listener) = &self.listener {
            listener.thread().unpark();
        }
        // A connection wakes the listener; an address of all interfaces takes it, too.
        if TcpStream::connect_timeout(&self.address, LIMITS.write).is_ok()
            && let Some(listener) = self.listener.take()
        {
            let _panicked = listener.join();
        }
    }
}

/// Sixteen random bytes as text.
fn token() -> io::Result<String> {
    let mut bytes = [0; 16];
    File::open("/dev/urandom")?.read_exact(&mut bytes)?;
    Ok(bytes.map(|byte| format!("{byte:02x}")).concat())
}

/// Takes connections until the run closes. Each has a thread of its own.
fn accept(connections: impl Iterator<Item = io::Result<TcpStream>>, hub: &Arc<Hub>) {
    let mut is_told = false;
    for stream in connections {
        if hub.is_closed.load(Ordering::Acquire) {
            return;
        }
        let stream = match stream {
            Ok(stream) => stream,
            Err(error) => {
                if !is_told {
                    log::warn!("the page of the run takes no reader for now: {error}");
                }
                is_told = true;
                // The system may lack files for a while, and says so at once: no busy loop.
                thread::park_timeout(hub.limits.pause);
                continue;
            }
        };
        let place = Place::take(hub);
        let Some(place) = place else {
            let deadline = Instant::now() + hub.limits.write;
            let busy = request::refusal(503, "as many readers as the run serves are there");
            let _refused = write(&stream, busy.as_bytes(), deadline);
            continue;
        };
        let connection = move || {
            // A reader that goes, or is slow, is no concern of the run.
            let _gone = serve(&stream, &place.0);
            let _closed = stream.shutdown(Shutdown::Both);
        };
        let _refused = thread::Builder::new().name("live reader".to_owned()).spawn(connection);
    }
}

/// One of the connections that may be there at a time.
struct Place(Arc<Hub>);

impl Place {
    fn take(hub: &Arc<Hub>) -> Option<Self> {
        // Only the listener takes places.
        let taken = hub.connections.load(Ordering::Acquire);
        (taken < hub.limits.connections).then(|| {
            hub.connections.fetch_add(1, Ordering::AcqRel);
            Self(Arc::clone(hub))
        })
    }
}

impl Drop for Place {
    fn drop(&mut self) {
        self.0.connections.fetch_sub(1, Ordering::AcqRel);
    }
}

/// Answers one request; stays with a reader of frames until the run or the reader ends.
fn serve(stream: &TcpStream, hub: &Hub) -> io::Result<()> {
    let local = stream.local_addr()?;
    let head = read(stream, Instant::now() + hub.limits.request)?;
    let answer = match Request::parse(&head) {
        Some(request) => request.answer(local, &hub.token),
        None => Answer::Refused(400, "expected a request of HTTP/1.1"),
    };
    let send = |text: &str| write(stream, text.as_bytes(), Instant::now() + hub.limits.write);
    match answer {
        Answer::Refused(code, reason) => send(&request::refusal(code, reason)),
        Answer::Page => send(&request::response(200, "text/html; charset=utf-8", &hub.page)),
        Answer::Frames => {
            send(&request::head(200, "text/event-stream", None))?;
            let (sender, events) = mpsc::sync_channel(hub.limits.waiting);
            let (_here, gone) = mpsc::channel();
            hub.readers().push(Reader { events: sender, gone });
            if hub.is_closed.load(Ordering::Acquire) {
                hub.readers().clear();
            }
            // The last frame goes before the ones that still wait.
            let mut waiting = events.iter().take_while(|_| hub.last.get().is_none());
            waiting.try_for_each(|event: Event| send(&event))?;
            hub.last.get().map_or(Ok(()), |event| send(event))
        }
    }
}

/// Most bytes of a request.
const REQUEST_MOST: usize = 8192;

/// Reads up to the end of a request's head, which has no body behind it.
fn read(mut stream: &TcpStream, deadline: Instant) -> io::Result<Vec<u8>> {
    let mut head = Vec::new();
    let mut part = [0; 1024];
    while !head.windows(4).any(|end| end == b"\r\n\r\n") {
        stream.set_read_timeout(Some(left(deadline)?))?;
        match stream.read(&mut part)? {
            0 => return Err(io::ErrorKind::UnexpectedEof.into()),
            count => head.extend_from_slice(&part[..count]),
        }
        if head.len() > REQUEST_MOST {
            return Err(io::ErrorKind::InvalidData.into());
        }
    }
    Ok(head)
}

/// Writes all bytes before the deadline, however slowly the other side takes them.
fn write(mut stream: &TcpStream, mut bytes: &[u8], deadline: Instant) -> io::Result<()> {
    while !bytes.is_empty() {
        stream.set_write_timeout(Some(left(deadline)?))?;
        match stream.write(bytes)? {
            0 => return Err(io::ErrorKind::WriteZero.into()),
            count => bytes = &bytes[count..],
        }
    }
    Ok(())
}

/// The time up to a deadline.
fn left(deadline: Instant) -> io::Result<Duration> {
    let left = deadline.saturating_duration_since(Instant::now());
    if left.is_zero() { Err(io::ErrorKind::TimedOut.into()) } else { Ok(left) }
}

#[cfg(test)]
mod tests;
