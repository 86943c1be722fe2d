//! The board's socket, and its pending connections: connections that have not sent their first
//! request. A pending connection does not have the board, and its time is limited.

use std::io::{self, ErrorKind};
use std::os::fd::AsFd as _;
use std::os::unix::net::UnixListener;
use std::time::{Duration, Instant};

use nix::errno::Errno;
use nix::poll::{PollFd, PollFlags};

use super::connection::{Connection, Ended, Presence, late, wait};
use pgs_interface::message::{Answer, Request, Status, VERSION};

/// Time limit of a driver for its first request and its next, for the rest of a request that has
/// begun, and to read an answer.
pub(super) const DRIVER_LIMIT: Duration = Duration::from_secs(5);
/// Most pending connections; the next one replaces the oldest.
const PENDING_MAX: usize = 32;
/// Pause of accepting after the system had no resources for a connection.
const PAUSE: Duration = Duration::from_millis(100);

/// The board's socket, and its pending connections.
#[derive(Debug)]
pub(super) struct PendingConnections {
    listener: UnixListener,
    accepting: Accepting,
    /// The oldest first.
    pending: Vec<Pending>,
    limit: Duration,
}

/// Whether the socket accepts connections.
#[derive(Debug)]
enum Accepting {
    Yes,
    PausedUntil(Instant),
    Failed(io::Error),
}

#[derive(Debug)]
struct Pending {
    connection: Connection,
    due: Instant,
    /// The way in which it ended, if it has ended.
    ended: Option<Ended>,
}

/// A pending connection that needs the server.
#[derive(Debug)]
pub(super) enum Caller {
    /// Its first request is whole.
    Requesting(Connection),
    /// It ended before its first request.
    Ended(Ended),
}

impl PendingConnections {
    /// Takes over a listener.
    pub(super) fn new(listener: UnixListener) -> io::Result<Self> {
        listener.set_nonblocking(true)?;
        Ok(Self { listener, accepting: Accepting::Yes, pending: Vec::new(), limit: DRIVER_LIMIT })
    }

    /// Sets the time limit of the drivers that connect from now on.
    pub(super) fn set_limit(&mut self, limit: Duration) {
        // An instant beyond a year can overflow.
        self.limit = limit.min(Duration::from_secs(366 * 24 * 3600));
    }

    /// Removes the oldest connection that has sent a request or has ended.
    pub(super) fn caller(&mut self) -> Option<Caller> {
        let called = |entry: &Pending| entry.ended.is_some() || entry.connection.is_whole();
        let entry = self.pending.remove(self.pending.iter().position(called)?);
        Some(entry.ended.map_or(Caller::Requesting(entry.connection), Caller::Ended))
    }

    /// The error that ended accepting for good, if there was one.
    pub(super) fn failure(&mut self) -> Option<io::Error> {
        match std::mem::replace(&mut self.accepting, Accepting::Yes) {
            Accepting::Failed(error) => Some(error),
            accepting => {
                self.accepting = accepting;
                None
            }
        }
    }

    /// Answers every pending connection that has sent a request: another driver has the board.
    pub(super) fn refuse_callers(&mut self, now: Duration) {
        while let Some(caller) = self.caller() {
            let Caller::Requesting(mut connection) = caller else { continue };
            let Some(request) = connection.take_request() else { continue };
            let status = match Request::decode(&request) {
                Ok(Request::Hello { version: VERSION }) => Status::Busy,
                Ok(Request::Hello { .. }) => Status::OtherVersion,
                _ => Status::Refused,
            };
            log::info!("refused a connection while a driver has the board: {status:?}");
            let answer = Answer { status, value: VERSION, number: 0, now };
            if let Err(error) = connection.send(&answer.encode(), None) {
                log::info!("the refused connection ended before the answer: {error}");
            }
        }
    }

    /// Waits until the visitor has sent bytes, a pending connection changes, or the time is
    /// `until`. Accepts a new connection and reads from the pending ones. Returns whether the
    /// visitor has sent bytes.
    pub(super) fn wait_for(
        &mut self,
        visitor: Option<&Connection>,
        until: Option<Instant>,
    ) -> io::Result<bool> {
        let ready = self.wait(visitor, until)?;
        let now = Instant::now();
        for (index, entry) in self.pending.iter_mut().enumerate() {
            if ready.pending.get(index).is_some_and(|ready| *ready) {
                entry.ended = match entry.connection.read_available() {
                    Ok(Presence::There) => None,
                    Ok(Presence::Gone) => Some(Ended::Left),
                    Err(error) => Some(Ended::of(error)),
                };
            }
            if entry.ended.is_none() && !entry.connection.is_whole() && entry.due <= now {
                entry.ended =
                    Some(Ended::Broken(late("sent no request", entry.connection.limit())));
            }
        }
        if ready.accepting {
            self.accept(now);
        }
        Ok(ready.visitor)
    }

    fn wait(&mut self, visitor: Option<&Connection>, until: Option<Instant>) -> io::Result<Ready> {
        if matches!(self.accepting, Accepting::PausedUntil(end) if end <= Instant::now()) {
            self.accepting = Accepting::Yes;
        }
        let paused = match self.accepting {
            Accepting::PausedUntil(end) => Some(end),
            _ => None,
        };
        // A connection with a whole request, or that has ended, has no deadline any more.
        let waiting = |entry: &&Pending| entry.ended.is_none() && !entry.connection.is_whole();
        let dues = self.pending.iter().filter(waiting).map(|entry| entry.due);
        let until = dues.chain(until).chain(paused).min();
        let for_input = |end| PollFd::new(end, PollFlags::POLLIN);
        let mut ends = Vec::with_capacity(self.pending.len() + 2);
        ends.extend(self.pending.iter().map(|entry| for_input(entry.connection.as_fd())));
        ends.extend(visitor.map(|visitor| for_input(visitor.as_fd())));
        let open = matches!(self.accepting, Accepting::Yes);
        ends.extend(open.then(|| for_input(self.listener.as_fd())));
        wait(&mut ends, until)?;
        let mut ready = ends.iter().map(|end| end.any().unwrap_or(true));
        Ok(Ready {
            pending: ready.by_ref().take(self.pending.len()).collect(),
            visitor: visitor.is_some() && ready.next().unwrap_or(false),
            accepting: open && ready.next().unwrap_or(false),
        })
    }

    /// Accepts the next connection.
    fn accept(&mut self, now: Instant) {
        let limit = self.limit;
        let accepted =
            self.listener.accept().and_then(|(stream, _)| Connection::new(stream, limit));
        match accepted {
            Ok(connection) => {
                if self.pending.len() == PENDING_MAX {
                    log::warn!("{PENDING_MAX} connections sent no request: dropping the oldest");
                    self.pending.remove(0);
                }
                self.pending.push(Pending { connection, due: now + limit, ended: None });
            }
            Err(error) => match error.kind() {
                // Not an error: with the last two, the connection is gone already.
                ErrorKind::WouldBlock | ErrorKind::Interrupted | ErrorKind::ConnectionAborted => {}
                _ if is_scarce(&error) => {
                    log::warn!("no connection is accepted for {PAUSE:?}: {error}");
                    self.accepting = Accepting::PausedUntil(now + PAUSE);
                }
                _ => self.accepting = Accepting::Failed(error),
            },
        }
    }
}

/// The sockets that are ready to read.
struct Ready {
    pending: Vec<bool>,
    visitor: bool,
    accepting: bool,
}

/// Whether the system lacks resources that it may have again later.
fn is_scarce(error: &io::Error) -> bool {
    let errno = error.raw_os_error().map(Errno::from_raw);
    matches!(errno, Some(Errno::EMFILE | Errno::ENFILE | Errno::ENOBUFS | Errno::ENOMEM))
}
