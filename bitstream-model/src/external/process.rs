//! An accelerator that runs in a process of its own: a simulator of the generated Verilog.
//!
//! The process reads requests on its standard input and answers each on its standard output, in
//! little-endian words of 32 bits:
//!
//! ```text
//! read    1, offset, 0             value
//! write   2, offset, value         0
//! run     3, clocks, 0,            clocks, level, taken of 4, sent of 4,
//!         offered of 4,              then each beat sent: 4 words, TLAST
//!         space of 4,              level: bit 0 interrupt, bit 1 busy
//!         each beat offered:
//!         4 words, marks             marks: bit 0 TLAST, bit 1 invalid bytes
//! record  4, 1 or 0, 0             1, or 0 from a simulator without waveforms
//! ```
//!
//! The marks of a beat that was sent hold in bits 31:8 the clock of the request in which it was
//! sent. `record` begins and ends a waveform in the file that is the program's fourth argument.
//!
//! `bitstream-model/rtl/simulator/main.cpp` is the other end, and `serve.rs` the same in Rust.

use std::io::{self, Read, Write};
use std::mem::{self, ManuallyDrop};
use std::path::Path;
use std::process::{Child, ChildStdin, Command, Stdio};
use std::sync::mpsc::{self, Receiver, RecvTimeoutError};
use std::thread;
use std::time::{Duration, Instant};

use pgs_support::Process;

use super::{Clocked, ExternalAccelerator, ExternalError, Offer, StreamBeat};
use crate::config::{BoardConfig, Hazards};
use pgs_interface::control::{
    FEATURES, FENCE_BASE, FENCE_SIZE, IDENTIFICATION, IDENTIFICATION_VALUE, PROFILE, features,
};
use pgs_interface::fence::Fence;
use pgs_interface::profile::{Inertia, Profile};
use pgs_interface::record::Beat;

pub(super) const STREAMS: usize = 4;
pub(super) const READ: u32 = 1;
pub(super) const WRITE: u32 = 2;
pub(super) const RUN: u32 = 3;
pub(super) const RECORD: u32 = 4;
/// Marks of a beat that is offered.
pub(super) const LAST: u32 = 1;
pub(super) const PARTIAL: u32 = 2;
/// Lowest bit of the clock in the marks of a beat that was sent.
pub(super) const CLOCK_LSB: u32 = 8;
/// Bits of the level.
pub(super) const INTERRUPT: u32 = 1;
pub(super) const BUSY: u32 = 2;

/// Deadline of an answer, which is computed in milliseconds.
const DEADLINE: Duration = Duration::from_secs(20);
/// Bytes that the reading thread passes on at once.
const CHUNK: usize = 1 << 16;

/// A simulator in a process of its own.
#[derive(Debug)]
pub struct SimulatorProcess {
    child: Child,
    /// The process that has started it.
    starter: Process,
    requests: Option<ChildStdin>,
    answers: Receiver<io::Result<Vec<u8>>>,
    /// Bytes that have come and were not read.
    rest: Vec<u8>,
    deadline: Duration,
}

impl SimulatorProcess {
    /// Starts a simulator and reads its IDENTIFICATION.
    ///
    /// # Errors
    /// [`ExternalError`] if the program cannot be started or does not answer as an accelerator.
    pub fn start(path: &Path) -> Result<Self, ExternalError> {
        Self::start_with(path, &[])
    }

    /// Starts a simulator as the accelerator of a board that is built as `config` says. The board
    /// has the fence that the simulator reports.
    ///
    /// # Errors
    /// [`ExternalError::Profile`], [`ExternalError::Hazards`] and [`ExternalError::Inertia`] for a
    /// simulator of another profile, that treats hazards in another way, or was built for another
    /// form of inertia; else as for [`start`](Self::start).
    pub fn start_for(config: &mut BoardConfig, path: &Path) -> Result<Self, ExternalError> {
        let mut simulator = Self::start(path)?;
        let profile = simulator.read(PROFILE.offset)?;
        if profile != config.profile.id {
            let simulator = Profile::by_id(profile).map_or("unknown", |profile| profile.name);
            return Err(ExternalError::Profile { simulator, board: config.profile.name });
        }
        let features = simulator.read(FEATURES.offset)?;
        let interlocked = features::INTERLOCKED.is_set(features);
        if interlocked != (config.hazards == Hazards::Interlocked) {
            let name = |interlocked| if interlocked { "interlocked" } else { "unchecked" };
            let (simulator, board) = (name(interlocked), name(!interlocked));
            return Err(ExternalError::Hazards { simulator, board });
        }
        let world = features::WORLD_INERTIA.is_set(features);
        if world != (config.inertia == Inertia::World) {
            let name = |world| if world { "world" } else { "isotropic" };
            return Err(ExternalError::Inertia { simulator: name(world), board: name(!world) });
        }
        let fence = [simulator.read(FENCE_BASE.offset)?, simulator.read(FENCE_SIZE.offset)?];
        config.fence = Fence::from_registers(fence).unwrap_or_default();
        Ok(simulator)
    }

    /// Starts a simulator with arguments of its own.
    ///
    /// # Errors
    /// As for [`start`](Self::start).
    pub fn start_with(path: &Path, arguments: &[String]) -> Result<Self, ExternalError> {
        let mut command = Command::new(path);
        let started = command.args(arguments).stdin(Stdio::piped()).stdout(Stdio::piped()).spawn();
        let start = |source| ExternalError::Start { path: path.display().to_string(), source };
        let mut child = started.map_err(start)?;
        let (sender, answers) = mpsc::sync_channel(4);
        let requests = child.stdin.take();
        if let Some(mut output) = child.stdout.take() {
            // A read of a pipe has no deadline; a thread reads, and the receiver has one. It ends
            // with the process.
            thread::spawn(move || {
                loop {
                    let mut bytes = vec![0; CHUNK];
                    let read = output.read(&mut bytes);
                    let ends = !matches!(read, Ok(n) if n > 0);
                    let chunk = read.and_then(|n| {
                        bytes.truncate(n);
                        if n == 0 { Err(io::ErrorKind::UnexpectedEof.into()) } else { Ok(bytes) }
                    });
                    if sender.send(chunk).is_err() || ends {
                        break;
                    }
                }
            });
        }
        let starter = Process::this();
        let (rest, deadline) = (Vec::new(), DEADLINE);
        let mut process = Self { child, starter, requests, answers, rest, deadline };
        let expected = IDENTIFICATION_VALUE;
        match process.read(IDENTIFICATION.offset)? {
            found if found == expected => Ok(process),
            found => Err(ExternalError::Identification { found, expected }),
        }
    }

    /// Sets the deadline of an answer, 20 s by default.
    pub fn set_deadline(&mut self, deadline: Duration) {
        self.deadline = deadline;
    }

    /// Begins or ends a waveform; false from a simulator that writes none.
    pub(super) fn record(&mut self, on: bool) -> Result<bool, ExternalError> {
        let act = "begin or end of a waveform";
        self.request(&[RECORD, on.into(), 0], act)?;
        let [recorded] = self.answer(act)?;
        Ok(recorded == 1)
    }

    fn request(&mut self, words: &[u32], act: &'static str) -> Result<(), ExternalError> {
        let bytes: Vec<u8> = words.iter().flat_map(|word| word.to_le_bytes()).collect();
        let closed = || io::Error::from(io::ErrorKind::BrokenPipe);
        let written = self.requests.as_mut().ok_or_else(closed);
        written
            .and_then(|requests| requests.write_all(&bytes).and_then(|()| requests.flush()))
            .map_err(|source| ExternalError::Ended { act, source })
    }

    fn answer<const N: usize>(&mut self, act: &'static str) -> Result<[u32; N], ExternalError> {
        let until = Instant::now() + self.deadline;
        while self.rest.len() < 4 * N {
            let left = until.saturating_duration_since(Instant::now());
            match self.answers.recv_timeout(left) {
                Ok(Ok(bytes)) => self.rest.extend(bytes),
                Ok(Err(source)) => return Err(ExternalError::Ended { act, source }),
                Err(RecvTimeoutError::Timeout) => {
                    return Err(ExternalError::Silent { act, deadline: self.deadline });
                }
                Err(RecvTimeoutError::Disconnected) => {
                    let source = io::ErrorKind::UnexpectedEof.into();
                    return Err(ExternalError::Ended { act, source });
                }
            }
        }
        let mut words = [0; N];
        for (word, bytes) in words.iter_mut().zip(self.rest.chunks_exact(4)) {
            *word = u32::from_le_bytes(bytes.try_into().unwrap_or_default());
        }
        self.rest.drain(..4 * N);
        Ok(words)
    }
}

/// A count of the answer, which must not exceed `most`.
fn count(what: &'static str, found: u32, most: usize) -> Result<usize, ExternalError> {
    let found_here = found as usize;
    let most_word = u32::try_from(most).unwrap_or(u32::MAX);
    if found_here > most {
        return Err(ExternalError::Answer { what, found, most: most_word });
    }
    Ok(found_here)
}

impl ExternalAccelerator for SimulatorProcess {
    fn read(&mut self, offset: u32) -> Result<u32, ExternalError> {
        let act = "read of a register";
        self.request(&[READ, offset, 0], act)?;
        let [value] = self.answer(act)?;
        Ok(value)
    }

    fn write(&mut self, offset: u32, value: u32) -> Result<(), ExternalError> {
        let act = "write of a register";
        self.request(&[WRITE, offset, value], act)?;
        let [_] = self.answer(act)?;
        Ok(())
    }

    fn run(&mut self, limit: u32, offer: &Offer) -> Result<Clocked, ExternalError> {
        let act = "run of some clocks";
        let offered: [&[StreamBeat]; STREAMS] =
            std::array::from_fn(|k| offer.beats.get(k).map_or(&[][..], Vec::as_slice));
        let space: [usize; STREAMS] =
            std::array::from_fn(|k| offer.space.get(k).copied().unwrap_or(0));
        let mut words = vec![RUN, limit, 0];
        words.extend(offered.map(|beats| u32::try_from(beats.len()).unwrap_or(u32::MAX)));
        words.extend(space.map(|space| u32::try_from(space).unwrap_or(u32::MAX)));
        for StreamBeat { beat, last, partial } in offered.into_iter().flatten() {
            words.extend(beat.0);
            words.push(if *last { LAST } else { 0 } | if *partial { PARTIAL } else { 0 });
        }
        self.request(&words, act)?;

        let [clocks, level] = self.answer(act)?;
        let taken: [u32; STREAMS] = self.answer(act)?;
        let sent: [u32; STREAMS] = self.answer(act)?;
        count("clocks", clocks, limit as usize)?;
        let mut clocked = Clocked {
            clocks,
            interrupt: level & INTERRUPT != 0,
            busy: level & BUSY != 0,
            ..Clocked::default()
        };
        for (taken, offered) in taken.into_iter().zip(offered) {
            clocked.taken.push(count("beats taken", taken, offered.len())?);
        }
        for (sent, space) in sent.into_iter().zip(space) {
            let (mut beats, mut clocks) = (Vec::new(), Vec::new());
            for _ in 0..count("beats sent", sent, space)? {
                let [a, b, c, d, marks] = self.answer(act)?;
                let last = marks & LAST != 0;
                beats.push(StreamBeat { beat: Beat([a, b, c, d]), last, partial: false });
                clocks.push(marks >> CLOCK_LSB);
            }
            clocked.sent.push(beats);
            clocked.sent_at.push(clocks);
        }
        Ok(clocked)
    }
}

impl Drop for SimulatorProcess {
    /// Closes its standard input and kills it: it has nothing left to do.
    fn drop(&mut self) {
        drop(self.requests.take());
        if !self.starter.is_this() {
            // A forked child: the simulator goes on for the parent, whose reading thread may have
            // had a lock of the channel.
            let (_, none) = mpsc::sync_channel(0);
            let _ = ManuallyDrop::new(mem::replace(&mut self.answers, none));
            return;
        }
        // Ended or not: the kill of a process that has ended does nothing.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}
