//! Passes register accesses from the guest to the host, through a shared page.
//!
//! ```text
//! 0x00 MARK      host    the host is there
//! 0x04 REQUEST   guest   number of the last request; written last
//! 0x08 ACTION    guest   1 read, 2 write
//! 0x0C ADDRESS   guest   bits 31:0 of the physical address
//! 0x10 ADDRESS   guest   bits 63:32
//! 0x14 VALUE     guest   what is written
//! 0x40 ANSWER    host    number of the last answered request; written last
//! 0x44 RESULT    host    what was read
//! ```
//!
//! Each end compares a number with the one that it expects, so that a half-written word counts as
//! not written yet.

use std::fmt;
use std::time::{Duration, Instant};

/// Name of the page's UIO node in the guest.
pub const NODE: &str = "pgs-mailbox";
/// Name of its only map.
pub const MAP: &str = "mailbox";

/// "PGSM": what MARK holds once the host serves.
const MARK_VALUE: u32 = 0x4D53_4750;
const MARK: u32 = 0x00;
const REQUEST: u32 = 0x04;
const ACTION: u32 = 0x08;
const ADDRESS_LOW: u32 = 0x0C;
const ADDRESS_HIGH: u32 = 0x10;
const VALUE: u32 = 0x14;
const ANSWER: u32 = 0x40;
const RESULT: u32 = 0x44;

const READ: u32 = 1;
const WRITE: u32 = 2;

/// Reads of a word before the thread yields the processor between two reads.
const EAGER_LOOKS: u32 = 1000;

/// The words of the page. Each access is one aligned access, in program order with the others.
pub trait Words {
    /// Why an access may fail.
    type Error: std::error::Error + Send + Sync + 'static;

    /// Reads the word at byte `at`.
    ///
    /// # Errors
    /// The page cannot be reached.
    fn load(&self, at: u32) -> Result<u32, Self::Error>;

    /// Writes the word at byte `at`.
    ///
    /// # Errors
    /// The page cannot be reached.
    fn store(&mut self, at: u32, value: u32) -> Result<(), Self::Error>;
}

/// An access to a register.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Access {
    /// A read.
    Read {
        /// Physical address.
        address: u64,
    },
    /// A write.
    Write {
        /// Physical address.
        address: u64,
        /// The value.
        value: u32,
    },
}

impl fmt::Display for Access {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Read { address } => write!(f, "read of {address:#x}"),
            Self::Write { address, value } => write!(f, "write of {value:#010x} to {address:#x}"),
        }
    }
}

/// Why a request was not answered, or not understood.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum MailboxError<E: std::error::Error + 'static> {
    /// The page cannot be reached.
    #[error("the mailbox cannot be reached")]
    Page(#[source] E),
    /// No host serves the page.
    #[error(
        "expected the mark {MARK_VALUE:#010x} in the mailbox, found {found:#010x} after {limit:?}: \
         is guest-board running, with this page as --mailbox?"
    )]
    NoHost {
        /// The value of MARK.
        found: u32,
        /// The time limit.
        limit: Duration,
    },
    /// No answer in time.
    #[error("no answer to the {access} within {limit:?}: does guest-board still run?")]
    NoAnswer {
        /// The request.
        access: Access,
        /// The time limit.
        limit: Duration,
    },
    /// A request that is neither a read nor a write.
    #[error("expected action 1 or 2 in request {request}, found {found}")]
    UnknownAction {
        /// Number of the request.
        request: u32,
        /// The value of ACTION.
        found: u32,
    },
}

/// The guest's end.
#[derive(Debug)]
pub struct Client<W> {
    words: W,
    last: u32,
    limit: Duration,
}

impl<W: Words> Client<W> {
    /// Waits until a host serves; `limit` bounds this wait and the wait for every answer.
    ///
    /// # Errors
    ///
    /// [`MailboxError::NoHost`] if no host serves in time.
    pub fn open(words: W, limit: Duration) -> Result<Self, MailboxError<W::Error>> {
        let mut client = Self { words, last: 0, limit };
        let mut found = 0;
        if !client.wait(MARK, MARK_VALUE, &mut found)? {
            return Err(MailboxError::NoHost { found, limit });
        }
        // An earlier client may have left before its answer.
        client.last = client.load(REQUEST)?;
        Ok(client)
    }

    fn load(&self, at: u32) -> Result<u32, MailboxError<W::Error>> {
        self.words.load(at).map_err(MailboxError::Page)
    }

    fn store(&mut self, at: u32, value: u32) -> Result<(), MailboxError<W::Error>> {
        self.words.store(at, value).map_err(MailboxError::Page)
    }

    /// Waits until the word at `at` is `wanted`; false after the time limit.
    fn wait(&self, at: u32, wanted: u32, found: &mut u32) -> Result<bool, MailboxError<W::Error>> {
        let started = Instant::now();
        loop {
            let late = started.elapsed() >= self.limit;
            for _ in 0..EAGER_LOOKS {
                *found = self.load(at)?;
                if *found == wanted {
                    return Ok(true);
                }
            }
            if late {
                return Ok(false);
            }
            std::thread::yield_now();
        }
    }

    /// Makes one access; returns the value read, or 0 for a write.
    ///
    /// # Errors
    ///
    /// [`MailboxError::NoAnswer`] if the host does not answer in time.
    pub fn request(&mut self, access: Access) -> Result<u32, MailboxError<W::Error>> {
        let (action, address, value) = match access {
            Access::Read { address } => (READ, address, 0),
            Access::Write { address, value } => (WRITE, address, value),
        };
        let [low, high] = halves(address);
        self.store(ACTION, action)?;
        self.store(ADDRESS_LOW, low)?;
        self.store(ADDRESS_HIGH, high)?;
        self.store(VALUE, value)?;
        self.last = self.last.wrapping_add(1);
        self.store(REQUEST, self.last)?;
        if !self.wait(ANSWER, self.last, &mut 0)? {
            return Err(MailboxError::NoAnswer { access, limit: self.limit });
        }
        self.load(RESULT)
    }
}

/// Bits 31:0 and 63:32.
#[expect(clippy::cast_possible_truncation, reason = "cuts on purpose")]
pub(crate) const fn halves(address: u64) -> [u32; 2] {
    [address as u32, (address >> 32) as u32]
}

/// The host's end.
#[derive(Debug)]
pub struct Desk<W> {
    words: W,
    last: u32,
}

impl<W: Words> Desk<W> {
    /// Marks the page as served.
    ///
    /// # Errors
    ///
    /// The page cannot be reached.
    pub fn open(words: W) -> Result<Self, MailboxError<W::Error>> {
        let mut desk = Self { last: words.load(REQUEST).map_err(MailboxError::Page)?, words };
        desk.words.store(ANSWER, desk.last).map_err(MailboxError::Page)?;
        desk.words.store(MARK, MARK_VALUE).map_err(MailboxError::Page)?;
        Ok(desk)
    }

    /// The next request, if there is one. It must be answered before the next call.
    ///
    /// # Errors
    /// [`MailboxError::UnknownAction`], or the page cannot be reached.
    pub fn next_request(&self) -> Result<Option<Access>, MailboxError<W::Error>> {
        let load = |at| self.words.load(at).map_err(MailboxError::Page);
        let request = self.last.wrapping_add(1);
        if load(REQUEST)? != request {
            return Ok(None);
        }
        let address = u64::from(load(ADDRESS_LOW)?) | (u64::from(load(ADDRESS_HIGH)?) << 32);
        match load(ACTION)? {
            READ => Ok(Some(Access::Read { address })),
            WRITE => Ok(Some(Access::Write { address, value: load(VALUE)? })),
            found => Err(MailboxError::UnknownAction { request, found }),
        }
    }

    /// Answers the last request.
    ///
    /// # Errors
    ///
    /// The page cannot be reached.
    pub fn answer(&mut self, result: u32) -> Result<(), MailboxError<W::Error>> {
        self.last = self.last.wrapping_add(1);
        self.words.store(RESULT, result).map_err(MailboxError::Page)?;
        self.words.store(ANSWER, self.last).map_err(MailboxError::Page)
    }
}

#[cfg(test)]
mod tests {
    use std::convert::Infallible;
    use std::sync::atomic::{AtomicU32, Ordering};

    use super::*;

    #[derive(Debug)]
    struct Page([AtomicU32; 32]);

    impl Page {
        fn new() -> Self {
            Self(std::array::from_fn(|_| AtomicU32::new(0)))
        }
    }

    impl Words for &Page {
        type Error = Infallible;

        fn load(&self, at: u32) -> Result<u32, Infallible> {
            Ok(self.0[at as usize / 4].load(Ordering::SeqCst))
        }

        fn store(&mut self, at: u32, value: u32) -> Result<(), Infallible> {
            self.0[at as usize / 4].store(value, Ordering::SeqCst);
            Ok(())
        }
    }

    const LIMIT: Duration = Duration::from_secs(20);

    /// Answers `count` requests: reads with the low half of the address plus one.
    fn serve(page: &Page, count: usize) -> Vec<Access> {
        let mut desk = Desk::open(page).expect("a page");
        let mut seen = Vec::new();
        let started = Instant::now();
        while seen.len() < count && started.elapsed() < LIMIT {
            if let Some(access) = desk.next_request().expect("understood") {
                seen.push(access);
                let Access::Read { address } = access else {
                    desk.answer(0).expect("a page");
                    continue;
                };
                desk.answer(halves(address)[0] + 1).expect("a page");
            }
        }
        seen
    }

    #[test]
    fn every_request_is_served_once_and_in_order() {
        let page = Page::new();
        // Request numbers wrap around during the test.
        (&page).store(REQUEST, u32::MAX - 2).expect("a page");
        std::thread::scope(|scope| {
            let host = scope.spawn(|| serve(&page, 6));
            let mut expected = Vec::new();
            for client in 0..2 {
                let mut guest = Client::open(&page, LIMIT).expect("a host");
                let read = Access::Read { address: 0x8_A004_0100 + client };
                let write = Access::Write { address: 0xA000_0000, value: u32::MAX };
                for access in [read, write, read] {
                    let result = guest.request(access).expect("answered");
                    let wanted = if access == write { 0 } else { 0xA004_0101 + client };
                    assert_eq!(u64::from(result), wanted);
                    expected.push(access);
                }
            }
            assert_eq!(host.join().expect("no panic"), expected);
        });
    }

    #[test]
    fn without_a_host_the_guest_gives_up_and_says_what_it_found() {
        let page = Page::new();
        let error = Client::open(&page, Duration::ZERO).expect_err("nobody there").to_string();
        assert!(error.contains("found 0x00000000") && error.contains("guest-board"), "{error}");
        let _desk = Desk::open(&page).expect("a page");
        let mut guest = Client::open(&page, Duration::ZERO).expect("a host");
        let error = guest.request(Access::Read { address: 0x10 }).expect_err("it is silent");
        assert!(matches!(error, MailboxError::NoAnswer { .. }), "{error}");
    }

    #[test]
    fn what_a_guest_left_behind_is_not_served_to_the_next() {
        let page = Page::new();
        (&page).store(REQUEST, 7).expect("a page");
        let desk = Desk::open(&page).expect("a page");
        assert_eq!(desk.next_request().expect("nothing"), None);
        (&page).store(ACTION, 3).expect("a page");
        (&page).store(REQUEST, 8).expect("a page");
        assert!(matches!(
            desk.next_request(),
            Err(MailboxError::UnknownAction { request: 8, found: 3 })
        ));
    }
}
