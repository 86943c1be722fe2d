//! Connections that have not sent their first request: none of them has the board, and none can
//! wait for long.

use std::io::{self, ErrorKind};
use std::os::fd::AsFd as _;
use std::os::unix::net::UnixListener;
use std::time::{Duration, Instant};

use nix::errno::Errno;
use nix::poll::{PollFd, PollFlags};

use super::connection::{Connection, Presence, late, wait};
use super::visit::Ended;
use pgs_interface::message::{Answer, Request, Status, VERSION};

/// How long a connection may take until it has sent its first request.
pub(super) const FIRST_LIMIT: Duration = Duration::from_secs(5);
/// Connections that wait at the same time; the next one takes the place of the oldest.
const GUESTS_MAX: usize = 32;
/// How long nobody is let in after the system has refused the means for it.
const REST: Duration = Duration::from_millis(100);

/// The board's socket, and who has come to it.
#[derive(Debug)]
pub(super) struct Lobby {
    listener: UnixListener,
    door: Door,
    /// The oldest first.
    guests: Vec<Guest>,
}

/// Whether somebody is let in.
#[derive(Debug)]
enum Door {
    Open,
    ShutUntil(Instant),
    Failed(io::Error),
}

#[derive(Debug)]
struct Guest {
    connection: Connection,
    due: Instant,
    /// How it ended, if it has.
    ended: Option<Ended>,
}

/// Who is next.
#[derive(Debug)]
pub(super) enum Caller {
    /// A connection whose first request is whole.
    Here(Connection),
    /// One that ended before.
    Ended(Ended),
}

impl Lobby {
    /// Takes over a listener.
    pub(super) fn new(listener: UnixListener) -> io::Result<Self> {
        listener.set_nonblocking(true)?;
        Ok(Self { listener, door: Door::Open, guests: Vec::new() })
    }

    /// The next caller, if there is one.
    pub(super) fn caller(&mut self) -> Option<Caller> {
        let called = |guest: &Guest| guest.ended.is_some() || guest.connection.is_whole();
        let guest = self.guests.remove(self.guests.iter().position(called)?);
        Some(guest.ended.map_or(Caller::Here(guest.connection), Caller::Ended))
    }

    /// Why nobody can come any more.
    pub(super) fn failure(&mut self) -> Option<io::Error> {
        match std::mem::replace(&mut self.door, Door::Open) {
            Door::Failed(error) => Some(error),
            door => {
                self.door = door;
                None
            }
        }
    }

    /// Tells everybody who calls that another driver has the board.
    pub(super) fn turn_away(&mut self, now: Duration) {
        while let Some(caller) = self.caller() {
            let Caller::Here(mut connection) = caller else { continue };
            let Some(request) = connection.take() else { continue };
            let status = match Request::decode(&request) {
                Ok(Request::Hello { version: VERSION }) => Status::Busy,
                Ok(Request::Hello { .. }) => Status::OtherVersion,
                _ => Status::Refused,
            };
            log::info!("somebody came while a driver has the board: {status:?}");
            let answer = Answer { status, value: VERSION, number: 0, now };
            if let Err(error) = connection.send(&answer.encode()) {
                log::info!("and left without the answer: {error}");
            }
        }
    }

    /// Waits until the visitor has sent something, which is then `true`, or something happens here,
    /// or it is too late. Everybody who came is let in.
    pub(super) fn attend(
        &mut self,
        visitor: Option<&Connection>,
        until: Option<Instant>,
    ) -> io::Result<bool> {
        let ready = self.wait(visitor, until)?;
        let now = Instant::now();
        for (place, guest) in self.guests.iter_mut().enumerate() {
            if ready.guests.get(place).is_some_and(|ready| *ready) {
                guest.ended = match guest.connection.take_in() {
                    Ok(Presence::There) => None,
                    Ok(Presence::Gone) => Some(Ended::Left),
                    Err(error) => Some(Ended::of(error)),
                };
            }
            if guest.ended.is_none() && !guest.connection.is_whole() && guest.due <= now {
                guest.ended = Some(Ended::Broken(late("sent no request", FIRST_LIMIT)));
            }
        }
        if ready.door {
            self.let_in(now);
        }
        Ok(ready.visitor)
    }

    fn wait(&mut self, visitor: Option<&Connection>, until: Option<Instant>) -> io::Result<Ready> {
        if matches!(self.door, Door::ShutUntil(end) if end <= Instant::now()) {
            self.door = Door::Open;
        }
        let shut = match self.door {
            Door::ShutUntil(end) => Some(end),
            _ => None,
        };
        // One that has called is not waited for.
        let waiting = |guest: &&Guest| guest.ended.is_none() && !guest.connection.is_whole();
        let dues = self.guests.iter().filter(waiting).map(|guest| guest.due);
        let until = dues.chain(until).chain(shut).min();
        let for_input = |end| PollFd::new(end, PollFlags::POLLIN);
        let mut ends = Vec::with_capacity(self.guests.len() + 2);
        ends.extend(self.guests.iter().map(|guest| for_input(guest.connection.as_fd())));
        ends.extend(visitor.map(|visitor| for_input(visitor.as_fd())));
        let open = matches!(self.door, Door::Open);
        ends.extend(open.then(|| for_input(self.listener.as_fd())));
        wait(&mut ends, until)?;
        let mut ready = ends.iter().map(|end| end.any().unwrap_or(true));
        Ok(Ready {
            guests: ready.by_ref().take(self.guests.len()).collect(),
            visitor: visitor.is_some() && ready.next().unwrap_or(false),
            door: open && ready.next().unwrap_or(false),
        })
    }

    /// Lets the next one in.
    fn let_in(&mut self, now: Instant) {
        let accepted = self.listener.accept().and_then(|(stream, _)| Connection::new(stream));
        match accepted {
            Ok(connection) => {
                if self.guests.len() == GUESTS_MAX {
                    log::warn!("{GUESTS_MAX} connections say nothing: the oldest has to go");
                    self.guests.remove(0);
                }
                self.guests.push(Guest { connection, due: now + FIRST_LIMIT, ended: None });
            }
            Err(error) => match error.kind() {
                // The last two came and went.
                ErrorKind::WouldBlock | ErrorKind::Interrupted | ErrorKind::ConnectionAborted => {}
                _ if is_scarce(&error) => {
                    log::warn!("nobody can be let in for now: {error}");
                    self.door = Door::ShutUntil(now + REST);
                }
                _ => self.door = Door::Failed(error),
            },
        }
    }
}

/// Who has something for us.
struct Ready {
    guests: Vec<bool>,
    visitor: bool,
    door: bool,
}

/// Whether the system lacks what it may have again later.
fn is_scarce(error: &io::Error) -> bool {
    let errno = error.raw_os_error().map(Errno::from_raw);
    matches!(errno, Some(Errno::EMFILE | Errno::ENFILE | Errno::ENOBUFS | Errno::ENOMEM))
}
