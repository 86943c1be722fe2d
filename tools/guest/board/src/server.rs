//! This file lets an emulated board serve a guest: register accesses, memory, interrupt, time.
//!
//! The board's time is virtual. Here it follows the host's clock: as much as has passed since the
//! last look, but not more than a slice at once; what the host cannot keep up with is dropped. The
//! board is then slow, as seen by the guest, and never anything else.

use std::io;
use std::time::{Duration, Instant};

use bitstream_model::{CpuPort, EmulatedBoard};

use crate::guest_file::GuestPage;
use crate::mailbox::{Access, Desk, MailboxError};

/// The longest stretch of virtual time between two looks at the mailbox.
const SLICE: Duration = Duration::from_micros(50);
/// How long after an access the next one is awaited without giving the processor away.
const EAGER: Duration = Duration::from_millis(2);
/// How long the processor is given away otherwise.
const NAP: Duration = Duration::from_micros(50);
/// Looks between two questions whether the guest still runs.
const LOOKS: u32 = 256;

/// The interrupt line into the guest.
pub trait Line {
    /// Sets its level.
    ///
    /// # Errors
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
    /// The guest took too long.
    #[error("the guest still runs after {limit:?}: give a larger --limit if it should")]
    Limit {
        /// How long it was given.
        limit: Duration,
    },
}

/// What was served.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
#[non_exhaustive]
pub struct Served {
    /// Register reads.
    pub reads: u64,
    /// Register writes.
    pub writes: u64,
    /// Times that the interrupt line rose.
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
    /// Until when the board has run, on the host's clock.
    run_until: Instant,
}

impl<L: Line> Server<L> {
    /// Serves requests in that page; the line is low.
    ///
    /// # Errors
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
    /// [`ServeError`], at the latest after `limit`.
    pub fn serve(&mut self, limit: Duration) -> Result<Served, ServeError> {
        let started = Instant::now();
        let mut last_access = started;
        let mut looks = 0_u32;
        loop {
            if let Some(access) = self.desk.take()? {
                self.serve_one(access)?;
                last_access = Instant::now();
            } else if last_access.elapsed() > EAGER {
                std::thread::sleep(NAP);
            } else {
                std::thread::yield_now();
            }
            self.follow_the_clock()?;
            looks += 1;
            if looks == LOOKS {
                looks = 0;
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
        // Before the answer: an interrupt that was acknowledged must be gone when the guest goes on.
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
