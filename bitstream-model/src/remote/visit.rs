//! This file serves one driver, from its hello until it is gone.

use std::io::{self, ErrorKind, Read as _, Write as _};
use std::os::unix::net::UnixStream;
use std::time::Duration;

use crate::handle::{CpuPort, EmulatedBoard};
use pgs_interface::message::{
    ANSWER_BYTES, Answer, REQUEST_BYTES, Request, RequestError, Status, VERSION,
};

/// How much virtual time passes between two looks whether the driver is still there.
const SLICE: Duration = Duration::from_micros(20);
/// How long the rest of a request that has begun may take, and an answer that nobody reads.
const TRANSFER_LIMIT: Duration = Duration::from_secs(5);

/// How a visit ended.
#[derive(Debug)]
#[non_exhaustive]
pub enum Ended {
    /// The driver closed the socket, or was killed.
    Left,
    /// It sent something that is no request.
    Refused(RequestError),
    /// The socket failed, or a request did not come to its end in time.
    Broken(io::Error),
}

/// What one driver did.
#[derive(Debug)]
#[non_exhaustive]
pub struct Visit {
    /// Requests that were served.
    pub requests: u64,
    /// How it ended.
    pub ended: Ended,
    /// Whether the accelerator or a DMA engine was still at work when the driver was gone.
    pub left_running: bool,
}

/// A driver, and the board that it has.
#[derive(Debug)]
pub(super) struct Host<'a> {
    board: &'a EmulatedBoard,
    port: CpuPort,
    /// Inode and bus address of the memory.
    memory: (u64, u64),
    stream: UnixStream,
    /// What has come of the next request.
    request: [u8; REQUEST_BYTES],
    filled: usize,
}

/// Whether a driver waits for an answer, or is gone.
enum Presence {
    There,
    Gone,
}

impl<'a> Host<'a> {
    pub(super) fn new(board: &'a EmulatedBoard, memory: (u64, u64), stream: UnixStream) -> Self {
        let port = board.cpu_port();
        Self { board, port, memory, stream, request: [0; REQUEST_BYTES], filled: 0 }
    }

    /// Serves until the driver is gone.
    pub(super) fn serve(mut self) -> Visit {
        let mut requests = 0;
        let ended = self.serve_all(&mut requests).unwrap_or_else(|error| match error.kind() {
            ErrorKind::ConnectionReset | ErrorKind::BrokenPipe => Ended::Left,
            _ => Ended::Broken(error),
        });
        Visit { requests, ended, left_running: self.board.is_running() }
    }

    fn serve_all(&mut self, requests: &mut u64) -> io::Result<Ended> {
        self.stream.set_write_timeout(Some(TRANSFER_LIMIT))?;
        while let Some(bytes) = self.next_request()? {
            let first = *requests == 0;
            let request = Request::decode(&bytes).and_then(|request| match request {
                Request::Hello { .. } => Ok(request),
                found if first => Err(RequestError::NoHello { found }),
                _ => Ok(request),
            });
            let request = match request {
                Ok(request) => request,
                Err(error) => {
                    self.answer(Status::Refused, 0, 0)?;
                    return Ok(Ended::Refused(error));
                }
            };
            *requests += 1;
            match self.serve_one(request)? {
                Presence::There => {}
                Presence::Gone => return Ok(Ended::Left),
            }
        }
        Ok(Ended::Left)
    }

    /// The next request; `None` if the driver is gone.
    fn next_request(&mut self) -> io::Result<Option<[u8; REQUEST_BYTES]>> {
        // A driver may take all the time of the world between two requests, but not inside one.
        while self.filled < REQUEST_BYTES {
            let limit = (self.filled > 0).then_some(TRANSFER_LIMIT);
            if limit.is_some() {
                self.stream.set_read_timeout(limit)?;
            }
            let read = self.stream.read(&mut self.request[self.filled..]);
            if limit.is_some() {
                self.stream.set_read_timeout(None)?;
            }
            match read {
                Ok(0) => return Ok(None),
                Ok(read) => self.filled += read,
                Err(error) if error.kind() == ErrorKind::Interrupted => {}
                Err(error) => return Err(error),
            }
        }
        self.filled = 0;
        Ok(Some(self.request))
    }

    fn answer(&mut self, status: Status, value: u32, number: u64) -> io::Result<()> {
        let bytes: [u8; ANSWER_BYTES] =
            Answer { status, value, number, now: self.port.now() }.encode();
        self.stream.write_all(&bytes)
    }

    fn serve_one(&mut self, request: Request) -> io::Result<Presence> {
        log::trace!("board: {request:?}");
        match request {
            Request::Hello { version } => {
                let status = if version == VERSION { Status::Done } else { Status::OtherVersion };
                self.answer(status, VERSION, 0)?;
                if version != VERSION {
                    // Whatever it says next means something else.
                    return Ok(Presence::Gone);
                }
            }
            Request::Memory { inode } => {
                let (own, address) = self.memory;
                let status = if inode == own { Status::Done } else { Status::OtherMemory };
                self.answer(status, 0, address)?;
            }
            Request::Read { address } => {
                let value = self.port.read32(address);
                self.answer(Status::Done, value, 0)?;
            }
            Request::Write { address, value } => {
                self.port.write32(address, value);
                self.answer(Status::Done, 0, 0)?;
            }
            Request::Pause { time } => {
                let passed = self.pass(time, |port, slice| {
                    port.pause(slice);
                    None
                })?;
                if matches!(passed, Passed::Gone) {
                    return Ok(Presence::Gone);
                }
                self.answer(Status::Done, 0, 0)?;
            }
            Request::WaitInterrupt { time } => {
                match self.pass(time, |port, slice| port.wait_interrupt(slice))? {
                    Passed::Gone => return Ok(Presence::Gone),
                    Passed::Event(number) => self.answer(Status::Done, number, 0)?,
                    Passed::Time => self.answer(Status::Nothing, 0, 0)?,
                }
            }
            Request::Unmask => {
                self.port.unmask_interrupt();
                self.answer(Status::Done, 0, 0)?;
            }
        }
        Ok(Presence::There)
    }

    /// Lets virtual time pass as long as the driver is there: one that is killed leaves the board
    /// where it is then.
    fn pass(
        &mut self,
        time: Duration,
        act: impl Fn(&CpuPort, Duration) -> Option<u32>,
    ) -> io::Result<Passed> {
        let mut left = time;
        loop {
            let slice = left.min(SLICE);
            if let Some(event) = act(&self.port, slice) {
                return Ok(Passed::Event(event));
            }
            left -= slice;
            if left.is_zero() {
                return Ok(Passed::Time);
            }
            if matches!(self.look()?, Presence::Gone) {
                return Ok(Passed::Gone);
            }
        }
    }

    /// Whether the driver is still there.
    fn look(&mut self) -> io::Result<Presence> {
        if self.filled == REQUEST_BYTES {
            return Ok(Presence::There);
        }
        self.stream.set_nonblocking(true)?;
        let read = self.stream.read(&mut self.request[self.filled..]);
        self.stream.set_nonblocking(false)?;
        match read {
            Ok(0) => Ok(Presence::Gone),
            Ok(read) => {
                self.filled += read;
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
}

/// What ended a stretch of virtual time.
enum Passed {
    Time,
    Event(u32),
    Gone,
}
