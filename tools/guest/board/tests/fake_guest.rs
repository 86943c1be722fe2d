//! A whole step between a server and a guest that is a thread: a file is the memory, the mailbox
//! carries the registers, and a flag is the interrupt.

use std::io;
use std::sync::{Arc, Condvar, Mutex};
use std::time::Duration;

use bitstream_model::external::{ExternalAccelerator, ModelAccelerator};
use bitstream_model::interface::record::Beat;
use bitstream_model::{BoardConfig, DeviceMemory, EmulatedBoard, ViolationKind};
use guest_board::guest_file::{GuestFile, GuestPage};
use guest_board::mailbox::{Access, Client, MailboxError};
use guest_board::one_cube::{self, Machine, StepError};
use guest_board::server::{Line, Served, Server};

const GUEST_BYTES: u64 = 0x20_0000;
const MAILBOX: u64 = 0x10_0000;
const BUFFERS: u64 = 0x11_0000;
const LIMIT: Duration = Duration::from_secs(60);

/// The line, the kernel's mask of it, and whether the guest runs.
#[derive(Debug, Default)]
struct Kernel {
    level: bool,
    masked: bool,
    ended: bool,
}

#[derive(Debug, Clone, Default)]
struct Wire(Arc<(Mutex<Kernel>, Condvar)>);

impl Wire {
    fn with<T>(&self, act: impl FnOnce(&mut Kernel) -> T) -> T {
        let result = act(&mut self.0.0.lock().expect("no test panics with the lock"));
        self.0.1.notify_all();
        result
    }
}

impl Line for Wire {
    fn set(&mut self, level: bool) -> io::Result<()> {
        self.with(|kernel| kernel.level = level);
        Ok(())
    }

    fn guest_runs(&mut self) -> io::Result<bool> {
        Ok(!self.with(|kernel| kernel.ended))
    }
}

struct Guest {
    memory: GuestFile,
    base: u64,
    registers: Client<GuestPage>,
    wire: Wire,
}

#[derive(Debug, thiserror::Error)]
enum GuestError {
    #[error(transparent)]
    Mailbox(#[from] MailboxError<io::Error>),
    #[error(transparent)]
    Memory(#[from] io::Error),
}

impl Machine for Guest {
    type Error = GuestError;

    fn read(&mut self, address: u64) -> Result<u32, GuestError> {
        Ok(self.registers.request(Access::Read { address })?)
    }

    fn write(&mut self, address: u64, value: u32) -> Result<(), GuestError> {
        self.registers.request(Access::Write { address, value })?;
        Ok(())
    }

    fn memory(&self) -> u64 {
        self.base
    }

    fn store(&mut self, at: u64, beats: &[Beat]) -> Result<(), GuestError> {
        Ok(self.memory.write_beats(self.base + at, beats)?)
    }

    fn load(&mut self, at: u64, beats: &mut [Beat]) -> Result<(), GuestError> {
        Ok(self.memory.read_beats(self.base + at, beats)?)
    }

    fn wait_interrupt(&mut self, timeout: Duration) -> Result<bool, GuestError> {
        let (kernel, changed) = &*self.wire.0;
        let kernel = kernel.lock().expect("no test panics with the lock");
        let (mut kernel, _) = changed
            .wait_timeout_while(kernel, timeout, |kernel| !kernel.level || kernel.masked)
            .expect("no test panics with the lock");
        let came = kernel.level && !kernel.masked;
        kernel.masked |= came;
        Ok(came)
    }

    fn unmask_interrupt(&mut self) -> Result<(), GuestError> {
        self.wire.with(|kernel| kernel.masked = false);
        Ok(())
    }
}

/// Ends the guest, even when its test panics, so that the server ends too.
struct Ending(Wire);

impl Drop for Ending {
    fn drop(&mut self) {
        self.0.with(|kernel| kernel.ended = true);
    }
}

/// Runs a guest whose buffers begin at `base` against a board with a grant of the buffers.
fn with_guest<T>(base: u64, run: impl FnOnce(&mut Guest) -> T) -> (T, Served, EmulatedBoard) {
    with_guest_on(None, base, run)
}

/// The same with another accelerator on the board, if there is one.
fn with_guest_on<T>(
    accelerator: Option<Box<dyn ExternalAccelerator>>,
    base: u64,
    run: impl FnOnce(&mut Guest) -> T,
) -> (T, Served, EmulatedBoard) {
    let file = tempfile::NamedTempFile::new().expect("a temporary file");
    file.as_file().set_len(GUEST_BYTES).expect("resized");
    let memory = GuestFile::open(file.path()).expect("opened");
    let granted = std::iter::once(BUFFERS..GUEST_BYTES).collect();
    let space = Box::new(memory.clone());
    let board = EmulatedBoard::on_memory(BoardConfig::default(), space, granted, accelerator)
        .expect("the default board can be built");
    let wire = Wire::default();
    let page = memory.page(MAILBOX).expect("inside");
    let mut server = Server::new(board.clone(), page, wire.clone()).expect("a page");
    std::thread::scope(|scope| {
        let host = scope.spawn(move || server.serve(LIMIT));
        let ending = Ending(wire.clone());
        let page = memory.page(MAILBOX).expect("inside");
        let registers = Client::open(page, LIMIT).expect("a host");
        let result = run(&mut Guest { memory, base, registers, wire });
        drop(ending);
        let served = host.join().expect("no panic").expect("served to the end");
        (result, served, board)
    })
}

#[test]
fn a_whole_step_in_shared_memory_ends_in_bullets_bits() {
    two_steps(None);
}

#[test]
fn another_accelerator_takes_the_same_steps() {
    let model = ModelAccelerator::new(&BoardConfig::default()).expect("it can be built");
    two_steps(Some(Box::new(model)));
}

fn two_steps(accelerator: Option<Box<dyn ExternalAccelerator>>) {
    // Twice: the first step's remains in registers and memory must not matter.
    let (done, served, board) = with_guest_on(accelerator, BUFFERS, |guest| {
        [one_cube::run(guest, LIMIT), one_cube::run(guest, LIMIT)]
    });
    assert_eq!(board.accelerator_error(), None);
    for done in done {
        let cycles = done.expect("the step is right");
        assert!(cycles > 1000, "{cycles}");
    }
    assert_eq!(board.violations(), []);
    let counts = board.counts();
    assert_eq!((served.reads, served.writes), (counts.register_reads, counts.register_writes));
    assert_eq!(served.raised, 2);
    // 2 steps of 4 + 7 x 8 + 4 beats in, 8 out, in 10 + 1 descriptors a stream.
    assert_eq!((counts.beats_read, counts.beats_written, counts.descriptors), (128, 16, 88));
}

#[test]
fn memory_that_was_not_granted_is_a_violation_and_not_touched() {
    // All four streams lie before the grant.
    let (done, _, board) = with_guest(BUFFERS - 0x4000, |guest| {
        // A strict board is dead after a violation: no interrupt comes.
        let done = one_cube::run(guest, Duration::from_millis(100));
        assert!(matches!(done, Err(StepError::Unexpected { .. })), "{done:?}");
        let mut results = [Beat::default(); 2];
        guest.load(0xC00, &mut results).expect("inside the file");
        results
    });
    assert_eq!(done, [Beat::default(); 2]);
    let violation = board.violations().first().expect("it was seen").kind;
    assert!(matches!(violation, ViolationKind::OutsideGrant { .. }), "{violation}");
}

#[test]
fn a_guest_that_does_not_end_is_left_after_the_limit() {
    let file = tempfile::NamedTempFile::new().expect("a temporary file");
    file.as_file().set_len(GUEST_BYTES).expect("resized");
    let memory = GuestFile::open(file.path()).expect("opened");
    let space = Box::new(memory.clone());
    let board = EmulatedBoard::on_memory(BoardConfig::default(), space, vec![], None)
        .expect("the default board can be built");
    let page = memory.page(MAILBOX).expect("inside");
    let mut server = Server::new(board, page, Wire::default()).expect("a page");
    let error = server.serve(Duration::ZERO).expect_err("it still runs").to_string();
    assert!(error.contains("--limit"), "{error}");
}
