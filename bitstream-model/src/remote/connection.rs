//! The board's end of a connection: requests come in piece by piece, and answers go out in bounded
//! time.

use std::fs::File;
use std::io::{self, ErrorKind, Read as _, Write as _};
use std::os::fd::{AsFd, BorrowedFd};
use std::os::unix::net::UnixStream;
use std::time::{Duration, Instant};

use nix::errno::Errno;
use nix::poll::{PollFd, PollFlags, PollTimeout, poll};

use super::passing::send_file;
use pgs_interface::message::{ANSWER_BYTES, REQUEST_BYTES, RequestError};

/// How a visit ended.
#[derive(Debug)]
#[non_exhaustive]
pub enum Ended {
    /// The driver closed the socket, or was killed.
    Left,
    /// It sent bytes that are not a request.
    Refused(RequestError),
    /// The socket failed, or a request was not complete in time.
    Broken(io::Error),
}

/// A connection, and the bytes of its next request that have arrived.
#[derive(Debug)]
pub(super) struct Connection {
    stream: UnixStream,
    request: [u8; REQUEST_BYTES],
    filled: usize,
    /// The time at which the request that has begun must be whole.
    due: Option<Instant>,
    limit: Duration,
}

/// Whether the other side is still there.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Presence {
    There,
    Gone,
}

impl Connection {
    /// `limit` bounds the wait for the rest of a request that has begun, and for the driver to read
    /// an answer.
    pub(super) fn new(stream: UnixStream, limit: Duration) -> io::Result<Self> {
        stream.set_nonblocking(true)?;
        Ok(Self { stream, request: [0; REQUEST_BYTES], filled: 0, due: None, limit })
    }

    /// The time limit of a driver.
    pub(super) fn limit(&self) -> Duration {
        self.limit
    }

    /// Another handle of its stream.
    pub(super) fn stream(&self) -> io::Result<UnixStream> {
        self.stream.try_clone()
    }

    /// The time at which the request that has begun must be whole; `None` between requests.
    pub(super) fn due(&self) -> Option<Instant> {
        self.due
    }

    /// Whether a whole request has arrived.
    pub(super) fn is_whole(&self) -> bool {
        self.filled == REQUEST_BYTES
    }

    /// Takes the request that has arrived, if it is whole.
    pub(super) fn take_request(&mut self) -> Option<[u8; REQUEST_BYTES]> {
        let whole = self.is_whole();
        if whole {
            (self.filled, self.due) = (0, None);
        }
        whole.then_some(self.request)
    }

    /// Reads the bytes of the next request that have arrived, without waiting.
    pub(super) fn read_available(&mut self) -> io::Result<Presence> {
        if self.is_whole() {
            return Ok(Presence::There);
        }
        match self.stream.read(&mut self.request[self.filled..]) {
            Ok(0) => Ok(Presence::Gone),
            Ok(read) => {
                self.filled += read;
                self.due = self.due.or_else(|| Instant::now().checked_add(self.limit));
                Ok(Presence::There)
            }
            Err(error)
                if matches!(error.kind(), ErrorKind::WouldBlock | ErrorKind::Interrupted) =>
            {
                Ok(Presence::There)
            }
            Err(error) => Err(error),
        }
    }

    /// Sends an answer, with a file beside it if there is one.
    pub(super) fn send(
        &mut self,
        answer: &[u8; ANSWER_BYTES],
        mut file: Option<&File>,
    ) -> io::Result<()> {
        let until = Instant::now() + self.limit;
        let mut rest = answer.as_slice();
        while !rest.is_empty() {
            let written = match file {
                Some(file) => send_file(&self.stream, rest, file),
                None => self.stream.write(rest),
            };
            match written {
                Ok(0) => return Err(ErrorKind::WriteZero.into()),
                Ok(written) => (rest, file) = (&rest[written..], None),
                Err(error) if error.kind() == ErrorKind::Interrupted => {}
                Err(error) if error.kind() == ErrorKind::WouldBlock => {
                    if Instant::now() >= until {
                        return Err(late("read no answer", self.limit));
                    }
                    let mut end = [PollFd::new(self.stream.as_fd(), PollFlags::POLLOUT)];
                    wait(&mut end, Some(until))?;
                }
                Err(error) => return Err(error),
            }
        }
        Ok(())
    }
}

impl AsFd for Connection {
    fn as_fd(&self) -> BorrowedFd<'_> {
        self.stream.as_fd()
    }
}

/// The error of a driver that took too long; `what` completes "it ...".
pub(super) fn late(what: &str, limit: Duration) -> io::Error {
    io::Error::new(ErrorKind::TimedOut, format!("it {what} within {limit:?}"))
}

/// Waits until one of `ends` is ready, or until the time `until`; without limit for `None`.
pub(super) fn wait(ends: &mut [PollFd<'_>], until: Option<Instant>) -> io::Result<()> {
    let timeout = match until {
        None => PollTimeout::NONE,
        Some(until) => {
            let left = until.saturating_duration_since(Instant::now());
            // Rounded up: a wait that ends too early would repeat in a busy loop.
            let left = left.as_micros().div_ceil(1000);
            PollTimeout::try_from(left).unwrap_or(PollTimeout::MAX)
        }
    };
    match poll(ends, timeout) {
        Ok(_) | Err(Errno::EINTR) => Ok(()),
        Err(errno) => Err(errno.into()),
    }
}
