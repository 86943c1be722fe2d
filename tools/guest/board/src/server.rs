//! Serves a guest with an emulated board: register accesses, memory, interrupt, time.
//!
//! The board's virtual time follows the host's clock: by the time since the last iteration, but at
//! most one slice at once. Time that the host cannot keep up with is dropped. The board is then
//! slow, as seen by the guest, and never anything else.

use std::io;
use std::time::{Duration, Instant};

use bitstream_model::{CpuPort, EmulatedBoard};

use crate::guest_file::GuestPage;
use crate::mailbox::{Access, Desk, MailboxError};

/// Longest virtual time between two reads of the mailbox.
const SLICE: Duration = Duration::from_micros(50);
/// Time after an access during which the next one is polled for without yielding the processor.
const EAGER: Duration = Duration::from_millis(2);
/// Sleep between two polls afterwards.
const NAP: Duration = Duration::from_micros(50);
/// Polls between two checks that the guest still runs.
const LOOKS: u32 = 256;
/// Longest time between two checks; a slice on a simulator takes most of a second.
const LOOK: Duration = Duration::from_secs(1);

/// The interrupt line into the guest.
pub trait Line {
    /// Sets the line's level.
    ///
    /// # Errors
    ///
    /// The guest cannot be reached.
    fn set(&mut self, level: bool) -> io::Result<()>;

    /// Whether the guest still runs.
    ///
    /// # Errors
    /// The guest cannot be reached.
    fn guest_runs(&mut self) -> io::Result<bool>;
}

/// Why serving ended before the guest did.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ServeError {
    /// The mailbox failed.
    #[error("the guest's request cannot be served")]
    Mailbox(#[from] MailboxError<io::Error>),
    /// The line failed.
    #[error("the interrupt line of the guest cannot be set")]
    Line(#[source] io::Error),
    /// The guest ran longer than its limit.
    #[error("the guest still runs after {limit:?}: give a larger --limit if it should")]
    Limit {
        /// The limit.
        limit: Duration,
    },
}

/// Counts of a served guest.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
#[non_exhaustive]
pub struct Served {
    /// Register reads.
    pub reads: u64,
    /// Register writes.
    pub writes: u64,
    /// Rising edges of the interrupt line.
    pub raised: u64,
}

/// A board that serves a guest.
#[derive(Debug)]
pub struct Server<L> {
    port: CpuPort,
    board: EmulatedBoard,
    desk: Desk<GuestPage>,
    line: L,
    level: bool,
    served: Served,
    /// The host's time up to which the board has run.
    run_until: Instant,
}

impl<L: Line> Server<L> {
    /// Serves the requests in a page; the line starts low.
    ///
    /// # Errors
    ///
    /// The page cannot be reached.
    pub fn new(board: EmulatedBoard, page: GuestPage, line: L) -> Result<Self, ServeError> {
        Ok(Self {
            port: board.cpu_port(),
            board,
            desk: Desk::open(page)?,
            line,
            level: false,
            served: Served::default(),
            run_until: Instant::now(),
        })
    }

    /// Serves until the guest has ended.
    ///
    /// # Errors
    ///
    /// [`ServeError`], at the latest after `limit`.
    pub fn serve(&mut self, limit: Duration) -> Result<Served, ServeError> {
        let started = Instant::now();
        let mut last_access = started;
        let mut looks = 0_u32;
        let mut looked = started;
        loop {
            if let Some(access) = self.desk.next_request()? {
                self.serve_one(access)?;
                last_access = Instant::now();
            } else if last_access.elapsed() > EAGER {
                std::thread::sleep(NAP);
            } else {
                std::thread::yield_now();
            }
            self.follow_the_clock()?;
            looks += 1;
            if looks == LOOKS || looked.elapsed() > LOOK {
                looks = 0;
                looked = Instant::now();
                if !self.line.guest_runs().map_err(ServeError::Line)? {
                    return Ok(self.served);
                }
                if started.elapsed() > limit {
                    return Err(ServeError::Limit { limit });
                }
            }
        }
    }

    fn serve_one(&mut self, access: Access) -> Result<(), ServeError> {
        let result = match access {
            Access::Read { address } => {
                self.served.reads += 1;
                self.port.read32(address)
            }
            Access::Write { address, value } => {
                self.served.writes += 1;
                self.port.write32(address, value);
                0
            }
        };
        log::trace!("{access} -> {result:#010x}");
        // Before the answer: an acknowledged interrupt must be gone when the guest goes on.
        self.pass_level_on()?;
        self.desk.answer(result)?;
        Ok(())
    }

    fn follow_the_clock(&mut self) -> Result<(), ServeError> {
        let now = Instant::now();
        self.port.pause(now.duration_since(self.run_until).min(SLICE));
        self.run_until = now;
        self.pass_level_on()
    }

    fn pass_level_on(&mut self) -> Result<(), ServeError> {
        let level = self.board.interrupt_level();
        if level != self.level {
            self.line.set(level).map_err(ServeError::Line)?;
            self.served.raised += u64::from(level);
            self.level = level;
        }
        Ok(())
    }
}
