//! Serves one driver, from its hello until it is gone.

use std::io::{self, ErrorKind};
use std::ops::Range;
use std::time::{Duration, Instant};

use super::connection::{Connection, Ended, Presence, late};
use super::memory::{Memories, MemoryError};
use super::pending::PendingConnections;
use crate::handle::{CpuPort, EmulatedBoard};
use pgs_interface::message::{
    Answer, MEMORY_UNIT, REQUEST_BYTES, Request, RequestError, Status, VERSION,
};

/// Virtual time between two checks whether the driver is still there.
const SLICE: Duration = Duration::from_micros(20);

/// A driver's use of the board, from its hello until it was gone.
#[derive(Debug)]
#[non_exhaustive]
pub struct Visit {
    /// Number of requests served.
    pub requests: u64,
    /// The way in which it ended.
    pub ended: Ended,
    /// Whether the accelerator or a DMA engine was still at work when the driver was gone.
    pub left_running: bool,
}

/// A driver's session with the board.
#[derive(Debug)]
pub(super) struct Session<'a> {
    board: &'a EmulatedBoard,
    port: CpuPort,
    memory: &'a mut Memories,
    /// Whether the driver has got its memory.
    has_memory: bool,
    connection: Connection,
    pending: &'a mut PendingConnections,
}

impl Ended {
    /// The end of a connection that failed with `error`.
    pub(super) fn of(error: io::Error) -> Self {
        match error.kind() {
            ErrorKind::ConnectionReset | ErrorKind::BrokenPipe => Self::Left,
            _ => Self::Broken(error),
        }
    }
}

impl<'a> Session<'a> {
    pub(super) fn new(
        board: &'a EmulatedBoard,
        memory: &'a mut Memories,
        connection: Connection,
        pending: &'a mut PendingConnections,
    ) -> Self {
        let port = board.cpu_port();
        Self { board, port, memory, has_memory: false, connection, pending }
    }

    /// Serves until the driver is gone.
    pub(super) fn serve(mut self) -> Visit {
        let mut requests = 0;
        let ended = self.serve_all(&mut requests).unwrap_or_else(Ended::of);
        let left_running = self.board.is_running();
        self.memory.take_back(left_running);
        Visit { requests, ended, left_running }
    }

    fn serve_all(&mut self, requests: &mut u64) -> io::Result<Ended> {
        while let Some(bytes) = self.next_request()? {
            let first = *requests == 0;
            let request = Request::decode(&bytes).and_then(|request| match request {
                Request::Hello { .. } => Ok(request),
                found if first => Err(RequestError::NoHello { found }),
                Request::Memory if self.has_memory => Err(RequestError::SecondMemory),
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
            if self.serve_one(request)? == Presence::Gone {
                return Ok(Ended::Left);
            }
        }
        Ok(Ended::Left)
    }

    /// The next request; `None` if the driver is gone.
    fn next_request(&mut self) -> io::Result<Option<[u8; REQUEST_BYTES]>> {
        // A driver that has the memory may take any time between two requests, but not inside one.
        let limit = self.connection.limit();
        let first = (!self.has_memory).then(|| Instant::now() + limit);
        loop {
            if let Some(request) = self.connection.take_request() {
                return Ok(Some(request));
            }
            let until = self.connection.due().into_iter().chain(first).min();
            if until.is_some_and(|until| until <= Instant::now()) {
                return Err(match self.connection.due() {
                    Some(_) => late("sent half a request and no more", limit),
                    None => late("asked for no memory", limit),
                });
            }
            if self.check_presence(until)? == Presence::Gone {
                return Ok(None);
            }
        }
    }

    fn answer(&mut self, status: Status, value: u32, number: u64) -> io::Result<()> {
        let answer = Answer { status, value, number, now: self.port.now() };
        self.connection.send(&answer.encode(), None)
    }

    fn serve_one(&mut self, request: Request) -> io::Result<Presence> {
        log::trace!("board: {request:?}");
        self.memory.put_in(self.board);
        match request {
            Request::Hello { version } => {
                let status = if version == VERSION { Status::Done } else { Status::OtherVersion };
                self.answer(status, VERSION, 0)?;
                if version != VERSION {
                    // Its next requests would have another meaning.
                    return Ok(Presence::Gone);
                }
            }
            Request::Memory => self.hand_out()?,
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

    /// Gives the driver its memory.
    fn hand_out(&mut self) -> io::Result<()> {
        let Range { start, end } = self.memory.addresses();
        let now = self.port.now();
        let no_memory = |error: &MemoryError| {
            log::error!("a driver gets no memory: {error}");
            let errno = match error {
                MemoryError::NoRoom { source, .. } => source.raw_os_error(),
                MemoryError::Length { .. } => None,
            };
            let value = errno.and_then(|errno| u32::try_from(errno).ok()).unwrap_or(0);
            Answer { status: Status::NoMemory, value, number: 0, now }
        };
        match self.memory.make() {
            Ok(file) => {
                let value = u32::try_from((end - start) / MEMORY_UNIT).unwrap_or(u32::MAX);
                let answer = Answer { status: Status::Done, value, number: start, now };
                self.connection.send(&answer.encode(), Some(file))?;
                self.has_memory = true;
                Ok(())
            }
            Err(error) => self.connection.send(&no_memory(&error).encode(), None),
        }
    }

    /// Lets virtual time pass as long as the driver is there. If the driver is killed, the board
    /// stops at that time.
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
            if self.check_presence(Some(Instant::now()))? == Presence::Gone {
                return Ok(Passed::Gone);
            }
        }
    }

    /// Waits until the driver has sent bytes, or until the time `until`; returns whether it is
    /// still there. Other drivers that send a request meanwhile get a refusal.
    fn check_presence(&mut self, until: Option<Instant>) -> io::Result<Presence> {
        let sent = self.pending.wait_for(Some(&self.connection), until)?;
        let presence = if sent { self.connection.read_available()? } else { Presence::There };
        if presence == Presence::There {
            self.pending.refuse_callers(self.port.now());
        }
        Ok(presence)
    }
}

/// The reason why a stretch of virtual time ended.
enum Passed {
    Time,
    Event(u32),
    Gone,
}
