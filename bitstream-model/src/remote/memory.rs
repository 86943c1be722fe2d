//! The memory of a served board: new for each driver, and seen by that driver and the board alone.
//!
//! This side reads and writes with system calls and maps nothing: no byte changes under a
//! reference. The driver maps the file. So all its bytes are reserved, and its length is sealed: a
//! page that is not there would end the driver with SIGBUS.

use std::fs::{self, File};
use std::io;
use std::ops::Range;
use std::os::unix::fs::FileExt as _;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use nix::errno::Errno;
use nix::fcntl::{FallocateFlags, FcntlArg, SealFlag, fallocate, fcntl};
use nix::sys::memfd::{MFdFlags, memfd_create};
use thiserror::Error;

use crate::handle::EmulatedBoard;
use crate::memory::external::ByteMemory;
use pgs_interface::message::MEMORY_UNIT;

/// The seals of a board's memory: its length never changes, and no seal is added.
pub const SEALS: SealFlag =
    SealFlag::F_SEAL_SHRINK.union(SealFlag::F_SEAL_GROW).union(SealFlag::F_SEAL_SEAL);

/// The reason why there is no memory for a board.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum MemoryError {
    /// No board has memory of this length.
    #[error("expected memory of a multiple of {MEMORY_UNIT} bytes, found {bytes}")]
    Length {
        /// The length, bytes.
        bytes: u64,
    },
    /// The system has no room for it.
    #[error("{bytes} bytes of memory cannot be reserved")]
    NoRoom {
        /// The length, bytes.
        bytes: u64,
        /// The kernel's error.
        #[source]
        source: io::Error,
    },
}

/// Memory that was made for one driver.
#[derive(Debug)]
struct DriverMemory {
    file: File,
    /// Its addresses on the bus.
    addresses: Range<u64>,
}

impl DriverMemory {
    /// Reserves memory, all zeros.
    fn reserve(addresses: Range<u64>) -> Result<Self, MemoryError> {
        let bytes = addresses.end.saturating_sub(addresses.start);
        if bytes == 0 || !bytes.is_multiple_of(MEMORY_UNIT) {
            return Err(MemoryError::Length { bytes });
        }
        let no_room = |source| MemoryError::NoRoom { bytes, source };
        let file = sealed(bytes, &[room_of_system(), room_of_group()]).map_err(no_room)?;
        Ok(Self { file, addresses })
    }

    /// Offset of an address in the file.
    fn offset(&self, address: u64, bytes: usize) -> io::Result<u64> {
        let Range { start, end } = self.addresses;
        let inside = address.checked_add(bytes as u64).is_some_and(|last| last <= end);
        address.checked_sub(start).filter(|_| inside).ok_or_else(|| {
            let text = format!("{bytes} bytes at {address:#x} do not lie in {start:#x}..{end:#x}");
            io::Error::new(io::ErrorKind::InvalidInput, text)
        })
    }
}

/// A sealed file of `bytes` bytes that are all reserved; `rooms` has the room that is known.
fn sealed(bytes: u64, rooms: &[Option<u64>]) -> io::Result<File> {
    // The kernel would end a process to make room, mostly this one.
    if rooms.iter().flatten().any(|room| *room < bytes) {
        return Err(Errno::ENOMEM.into());
    }
    let length = i64::try_from(bytes).map_err(|_| Errno::EFBIG)?;
    let flags = MFdFlags::MFD_CLOEXEC | MFdFlags::MFD_ALLOW_SEALING;
    let file = File::from(memfd_create("pgs-memory", flags)?);
    loop {
        match fallocate(&file, FallocateFlags::empty(), 0, length) {
            Ok(()) => break,
            Err(Errno::EINTR) => {}
            Err(errno) => return Err(errno.into()),
        }
    }
    fcntl(&file, FcntlArg::F_ADD_SEALS(SEALS))?;
    Ok(file)
}

/// The memory that the system can give, bytes; `None` if it does not tell.
fn room_of_system() -> Option<u64> {
    let info = fs::read_to_string("/proc/meminfo").ok()?;
    let kib = number(&info, "MemAvailable:")? + number(&info, "SwapFree:")?;
    kib.checked_mul(1024)
}

/// The memory that the limit of a container leaves, bytes; `None` without such a limit.
fn room_of_group() -> Option<u64> {
    let read = |name| fs::read_to_string(format!("/sys/fs/cgroup/memory.{name}")).ok();
    let (limit, used, parts) = (read("max")?, read("current")?, read("stat")?);
    // The kernel gives up pages of files to make room.
    let files = number(&parts, "active_file ")? + number(&parts, "inactive_file ")?;
    Some((number(&limit, "")? + files).saturating_sub(number(&used, "")?))
}

/// The number behind `name` on a line of its own.
fn number(text: &str, name: &str) -> Option<u64> {
    let rest = text.lines().find_map(|line| line.strip_prefix(name))?;
    rest.split_whitespace().next()?.parse().ok()
}

/// The memory of each driver, from its making until the board has no more use for it.
#[derive(Debug)]
pub(super) struct Memories {
    addresses: Range<u64>,
    /// Made, and not given to a driver.
    spare: Option<DriverMemory>,
    /// The driver's, as long as the engines that an earlier driver left running have not stopped.
    next: Option<DriverMemory>,
    board: BoardMemory,
}

impl Memories {
    /// Reserves the first driver's memory at these addresses of the bus.
    pub(super) fn new(addresses: Range<u64>) -> Result<Self, MemoryError> {
        let spare = Some(DriverMemory::reserve(addresses.clone())?);
        Ok(Self { addresses, spare, next: None, board: BoardMemory::default() })
    }

    /// Its addresses on the bus.
    pub(super) fn addresses(&self) -> Range<u64> {
        self.addresses.clone()
    }

    /// The memory that the board works on.
    pub(super) fn of_board(&self) -> BoardMemory {
        self.board.clone()
    }

    /// Makes the memory of a new driver; returns the file for it.
    pub(super) fn make(&mut self) -> Result<&File, MemoryError> {
        let memory = match self.spare.take() {
            Some(memory) => memory,
            None => DriverMemory::reserve(self.addresses.clone())?,
        };
        Ok(&self.next.insert(memory).file)
    }

    /// Puts the driver's memory into the board, once the engines are at rest.
    pub(super) fn put_in(&mut self, board: &EmulatedBoard) {
        if self.next.is_some() && !board.is_running() {
            *self.board.lock() = self.next.take();
        }
    }

    /// Frees the memory of a driver that has left; engines that still run keep theirs.
    pub(super) fn take_back(&mut self, running: bool) {
        self.next = None;
        if !running {
            *self.board.lock() = None;
        }
    }
}

/// The memory that the board works on; none if no driver has it and the engines are at rest.
#[derive(Debug, Clone, Default)]
pub(super) struct BoardMemory(Arc<Mutex<Option<DriverMemory>>>);

impl BoardMemory {
    fn lock(&self) -> MutexGuard<'_, Option<DriverMemory>> {
        // No code under the lock changes two things that belong together.
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn with<R>(
        &self,
        address: u64,
        bytes: usize,
        act: impl FnOnce(&File, u64) -> io::Result<R>,
    ) -> io::Result<R> {
        match &*self.lock() {
            Some(memory) => act(&memory.file, memory.offset(address, bytes)?),
            None => Err(io::Error::new(io::ErrorKind::NotFound, "no driver has memory")),
        }
    }
}

impl ByteMemory for BoardMemory {
    fn read(&self, address: u64, to: &mut [u8]) -> io::Result<()> {
        self.with(address, to.len(), |file, at| file.read_exact_at(to, at))
    }

    fn write(&self, address: u64, from: &[u8]) -> io::Result<()> {
        self.with(address, from.len(), |file, at| file.write_all_at(from, at))
    }
}

#[cfg(test)]
mod tests {
    use std::os::unix::fs::MetadataExt as _;

    use pgs_interface::record::Beat;

    use super::*;
    use crate::memory::external::DeviceMemory as _;

    #[test]
    fn memory_is_reserved_to_its_last_byte_and_keeps_its_length_for_good() {
        let memory = DriverMemory::reserve(0x5000_0000..0x5010_0000).expect("there is room");
        let metadata = memory.file.metadata().expect("measured");
        assert_eq!((metadata.len(), metadata.blocks() * 512), (1 << 20, 1 << 20));
        for length in [0, (1 << 20) - 1, (1 << 20) + 1] {
            let error = memory.file.set_len(length).expect_err("sealed");
            assert_eq!(error.raw_os_error(), Some(Errno::EPERM as i32), "{length}");
        }
        let write = FcntlArg::F_ADD_SEALS(SealFlag::F_SEAL_WRITE);
        assert_eq!(fcntl(&memory.file, write), Err(Errno::EPERM));
    }

    #[test]
    fn memory_that_no_board_has_is_refused() {
        for (start, end) in [(0, 0), (0, 1 << 15), (0, (1 << 16) + 1), (1, 0)] {
            let error = DriverMemory::reserve(start..end).expect_err("no length");
            assert!(matches!(error, MemoryError::Length { .. }), "{error}");
        }
    }

    #[test]
    fn memory_beyond_the_room_that_is_known_is_not_even_tried() {
        for rooms in [[Some((1 << 20) - 1), None], [None, Some(0)]] {
            let error = sealed(1 << 20, &rooms).expect_err("no room");
            assert_eq!(error.raw_os_error(), Some(Errno::ENOMEM as i32));
        }
        sealed(1 << 20, &[None, Some(1 << 20)]).expect("there is room");
        // More than any system has.
        let error = DriverMemory::reserve(0..1 << 62).expect_err("no room");
        assert!(matches!(error, MemoryError::NoRoom { bytes, .. } if bytes == 1 << 62), "{error}");
        assert_eq!(number("MemTotal: 9 kB\nMemAvailable:    12 kB\n", "MemAvailable:"), Some(12));
        assert_eq!(
            [number("max\n", ""), number("7\n", ""), number("7\n", "x")],
            [None, Some(7), None]
        );
    }

    #[test]
    fn the_board_reaches_the_memory_that_it_has_and_no_byte_behind_it() {
        let mut board = BoardMemory::default();
        let mut beats = [Beat::default(); 2];
        board.read_beats(0x5000_0000, &mut beats).expect_err("no memory yet");
        let memory = DriverMemory::reserve(0x5000_0000..0x5001_0000).expect("there is room");
        let drivers = memory.file.try_clone().expect("cloned");
        *board.lock() = Some(memory);
        board.write_beats(0x5000_FFF0, &[Beat([1, 2, 3, 4])]).expect("the last beat");
        board.write_word(0x5000_FFF4, 0x8765_4321).expect("in it");
        let mut bytes = [0; 8];
        drivers.read_exact_at(&mut bytes, 0xFFF0).expect("read");
        assert_eq!(bytes, [1, 0, 0, 0, 0x21, 0x43, 0x65, 0x87]);
        let mut words = [0; 2];
        board.read_words(0x5000_FFF8, &mut words).expect("in it");
        assert_eq!(words, [3, 4]);
        for address in [0x4FFF_FFF0, 0x5000_FFF0, 0x5001_0000, u64::MAX - 15] {
            board.read_beats(address, &mut beats).expect_err("outside");
            board.write_beats(address, &beats).expect_err("outside");
        }
    }
}
