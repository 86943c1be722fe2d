//! Messages between a driver and a board in another process.
//!
//! All requests have one length, and all answers another, so that no message is too long. Numbers
//! are little-endian.
//!
//! ```text
//! request, 16 bytes   0 act      4 value    8 operand
//! answer, 24 bytes    0 status   4 value    8 number    16 virtual time, ns
//!
//! act                       value               operand                 answer
//! 1 hello                   protocol's version  HELLO                   value: version
//! 2 memory                  0                   0                       number: its bus address; value:
//!                                                                       its MEMORY_UNITs, or an errno
//! 3 read                    0                   address                 value: the register's
//! 4 write                   the new value       address
//! 5 pause                   0                   ns, up to LONGEST_WAIT
//! 6 wait for the interrupt  0                   ns, up to LONGEST_WAIT  value: the event's number
//! 7 unmask                  0                   0
//! ```
//!
//! A driver sends the next request when it has the answer to the last one. The first is a hello,
//! the second asks for the memory. Both come within seconds: from then on the driver has the board,
//! and may take its time. The board answers every other hello with busy meanwhile.
//!
//! The memory is a new `memfd` for each connection, which comes beside the answer (`SCM_RIGHTS`).
//! Its length is the announced one, for good: it is sealed with `F_SEAL_SHRINK`, `F_SEAL_GROW` and
//! `F_SEAL_SEAL`. Byte 0 has the bus address of the answer.

use std::time::Duration;

use thiserror::Error;

/// Version of these messages.
pub const VERSION: u32 = 3;
/// "PGSBOARD": operand of a hello.
pub const HELLO: u64 = u64::from_le_bytes(*b"PGSBOARD");
/// Length of a request, bytes.
pub const REQUEST_BYTES: usize = 16;
/// Length of an answer, bytes.
pub const ANSWER_BYTES: usize = 24;
/// The longest virtual time that one request lets pass. A driver that waits longer sends the
/// request again, so that an answer always comes soon.
pub const LONGEST_WAIT: Duration = Duration::from_millis(10);

/// The memory's length is a multiple of this, bytes: the largest page of any kernel.
pub const MEMORY_UNIT: u64 = 1 << 16;

/// One request of a driver.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Request {
    /// Who is there?
    Hello {
        /// Version of the messages that the driver speaks.
        version: u32,
    },
    /// Memory of this driver's own, and its place on the bus.
    Memory,
    /// A register read.
    Read {
        /// Physical address.
        address: u64,
    },
    /// A register write.
    Write {
        /// Physical address.
        address: u64,
        /// The new value.
        value: u32,
    },
    /// Virtual time passes.
    Pause {
        /// Length of the pause.
        time: Duration,
    },
    /// Virtual time passes until an interrupt comes.
    WaitInterrupt {
        /// The longest wait.
        time: Duration,
    },
    /// Lets the next interrupt through.
    Unmask,
}

/// Bytes that are not a request.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum RequestError {
    /// No act has this number.
    #[error("expected an act from 1 to 7, found {found}")]
    Act {
        /// The act's number as received.
        found: u32,
    },
    /// A hello with another operand.
    #[error("expected a hello with {HELLO:#018x}, found {found:#018x}: is this a driver?")]
    Hello {
        /// The operand as received.
        found: u64,
    },
    /// A wait that is too long.
    #[error("expected a wait of at most {LONGEST_WAIT:?}, found {found:?}")]
    Wait {
        /// The wait as received.
        found: Duration,
    },
    /// A driver asks twice.
    #[error("expected one request for memory, found another")]
    SecondMemory,
    /// The first request is not a hello.
    #[error("expected a hello first, found {found:?}")]
    NoHello {
        /// The first request.
        found: Request,
    },
}

impl Request {
    /// The request's bytes on the socket.
    #[must_use]
    pub fn encode(&self) -> [u8; REQUEST_BYTES] {
        let nanoseconds = |time: Duration| u64::try_from(time.as_nanos()).unwrap_or(u64::MAX);
        let (act, value, operand) = match *self {
            Self::Hello { version } => (1_u32, version, HELLO),
            Self::Memory => (2, 0, 0),
            Self::Read { address } => (3, 0, address),
            Self::Write { address, value } => (4, value, address),
            Self::Pause { time } => (5, 0, nanoseconds(time)),
            Self::WaitInterrupt { time } => (6, 0, nanoseconds(time)),
            Self::Unmask => (7, 0, 0),
        };
        let mut bytes = [0; REQUEST_BYTES];
        bytes[..4].copy_from_slice(&act.to_le_bytes());
        bytes[4..8].copy_from_slice(&value.to_le_bytes());
        bytes[8..].copy_from_slice(&operand.to_le_bytes());
        bytes
    }

    /// The request that these bytes encode.
    ///
    /// # Errors
    /// [`RequestError`] if the bytes are not a request.
    pub fn decode(bytes: &[u8; REQUEST_BYTES]) -> Result<Self, RequestError> {
        let (act, value, operand) = (word(bytes, 0), word(bytes, 4), number(bytes, 8));
        let time = || match Duration::from_nanos(operand) {
            time if time <= LONGEST_WAIT => Ok(time),
            found => Err(RequestError::Wait { found }),
        };
        Ok(match act {
            1 if operand == HELLO => Self::Hello { version: value },
            1 => return Err(RequestError::Hello { found: operand }),
            2 => Self::Memory,
            3 => Self::Read { address: operand },
            4 => Self::Write { address: operand, value },
            5 => Self::Pause { time: time()? },
            6 => Self::WaitInterrupt { time: time()? },
            7 => Self::Unmask,
            found => return Err(RequestError::Act { found }),
        })
    }
}

/// How a request went.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Status {
    /// Done.
    Done,
    /// No interrupt came.
    Nothing,
    /// The server's system does not give the memory: the value is its error number.
    NoMemory,
    /// The board speaks another version.
    OtherVersion,
    /// The bytes were not a request. The board hangs up.
    Refused,
    /// Another driver has the board, which hangs up.
    Busy,
}

impl Status {
    const ALL: [Self; 6] =
        [Self::Done, Self::Nothing, Self::NoMemory, Self::OtherVersion, Self::Refused, Self::Busy];
}

/// The board's answer to a request.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Answer {
    /// How the request went.
    pub status: Status,
    /// A register, a version, a length, an error number, or the number of an interrupt.
    pub value: u32,
    /// An address.
    pub number: u64,
    /// Virtual time since the board was built.
    pub now: Duration,
}

/// Bytes that are not an answer.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Error)]
#[error("expected a status from 0 to 5, found {found}")]
pub struct AnswerError {
    /// The status as received.
    pub found: u32,
}

impl Answer {
    /// The answer's bytes on the socket.
    #[must_use]
    pub fn encode(&self) -> [u8; ANSWER_BYTES] {
        let status = Status::ALL.iter().position(|status| *status == self.status);
        let status = status.and_then(|status| u32::try_from(status).ok()).unwrap_or(u32::MAX);
        let now = u64::try_from(self.now.as_nanos()).unwrap_or(u64::MAX);
        let mut bytes = [0; ANSWER_BYTES];
        bytes[..4].copy_from_slice(&status.to_le_bytes());
        bytes[4..8].copy_from_slice(&self.value.to_le_bytes());
        bytes[8..16].copy_from_slice(&self.number.to_le_bytes());
        bytes[16..].copy_from_slice(&now.to_le_bytes());
        bytes
    }

    /// The answer that these bytes encode.
    ///
    /// # Errors
    /// [`AnswerError`] if the bytes are not an answer.
    pub fn decode(bytes: &[u8; ANSWER_BYTES]) -> Result<Self, AnswerError> {
        let found = word(bytes, 0);
        let status = usize::try_from(found).ok().and_then(|index| Status::ALL.get(index));
        Ok(Self {
            status: *status.ok_or(AnswerError { found })?,
            value: word(bytes, 4),
            number: number(bytes, 8),
            now: Duration::from_nanos(number(bytes, 16)),
        })
    }
}

fn word(bytes: &[u8], at: usize) -> u32 {
    (0..4).fold(0, |word, k| word | u32::from(bytes[at + k]) << (8 * k))
}

fn number(bytes: &[u8], at: usize) -> u64 {
    u64::from(word(bytes, at)) | u64::from(word(bytes, at + 4)) << 32
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn every_request_is_read_as_it_was_written() {
        let time = Duration::from_nanos(9_876_543);
        for request in [
            Request::Hello { version: 7 },
            Request::Memory,
            Request::Read { address: 0x1_0203_0405_0607 },
            Request::Write { address: 0xA004_0000, value: 0xF00D_CAFE },
            Request::Pause { time },
            Request::WaitInterrupt { time: LONGEST_WAIT },
            Request::Unmask,
        ] {
            assert_eq!(Request::decode(&request.encode()), Ok(request));
        }
        let bytes = Request::Write { address: 0xA0, value: 0x0102_0304 }.encode();
        assert_eq!(bytes, [4, 0, 0, 0, 4, 3, 2, 1, 0xA0, 0, 0, 0, 0, 0, 0, 0]);
    }

    #[test]
    fn every_answer_is_read_as_it_was_written() {
        for status in Status::ALL {
            let now = Duration::from_nanos(0x0102_0304_0506);
            let answer = Answer { status, value: u32::MAX, number: 1 << 63, now };
            assert_eq!(Answer::decode(&answer.encode()), Ok(answer));
        }
        let mut bytes = [0; ANSWER_BYTES];
        bytes[0] = 6;
        assert_eq!(Answer::decode(&bytes), Err(AnswerError { found: 6 }));
    }

    #[test]
    fn a_wait_that_is_too_long_is_refused() {
        let time = LONGEST_WAIT + Duration::from_nanos(1);
        for request in [Request::Pause { time }, Request::WaitInterrupt { time }] {
            let error = Request::decode(&request.encode());
            assert_eq!(error, Err(RequestError::Wait { found: time }));
        }
    }

    proptest! {
        #[test]
        fn bytes_that_decode_encode_to_the_same_request(bytes: [u8; REQUEST_BYTES]) {
            if let Ok(request) = Request::decode(&bytes) {
                prop_assert_eq!(Request::decode(&request.encode()), Ok(request));
            }
        }
    }
}
