//! This file opens a board: the one place that knows every kind.

use std::fmt;
use std::sync::Arc;

use bitstream_model::interface::address_map::UIO_NODE;

use crate::error::OpenError;
use crate::platform::{
    DevMemWindows, HardwarePlatform, MemoryChoice, Platform, RegisterChoice, System, has_nodes,
    uio_nodes,
};

/// How to open the accelerator. The default takes whatever board is there.
#[derive(Debug, Clone, Default)]
pub struct OpenOptions {
    /// Which board.
    pub board: BoardChoice,
    /// Where a real board's memory for DMA comes from.
    pub memory: MemoryChoice,
    /// Width of the DMA cores' length registers, bits; `None` believes the bitstream. Either is
    /// checked against the cores themselves.
    pub length_width: Option<u32>,
    /// Threads that write the records of a step and read its results, the caller's among them: 1 to 64,
    /// what is beyond is taken for the nearest. `None` takes as many as the machine has processors, at
    /// most four. What is written and read does not depend on it. Up to about 2,000 bodies or collisions
    /// are the caller's alone, and so are results where only live bodies are kept; the others are started
    /// when there is more, and end with the accelerator.
    ///
    /// [`Bodies`](crate::Bodies) and [`Collisions`](crate::Collisions) are asked from these threads
    /// while the caller's waits for them. A container that needs the caller's own thread (what it
    /// keeps per thread, a lock that the caller holds) wants `Some(1)`. How the caller's thread rounds
    /// or flushes is of no account: all threads compute in the standard [floating-point
    /// environment](crate#the-floating-point-environment).
    pub pack_threads: Option<usize>,
}

/// Which board to open.
#[derive(Debug, Clone, Default)]
#[non_exhaustive]
pub enum BoardChoice {
    /// The UIO node `pgs`, or the nodes `pgs-control` and `pgs-dma0` to `pgs-dma3`, if there are
    /// any; else an emulated board, which is said at warn level.
    #[default]
    Automatic,
    /// The UIO node of that name (`linux,uio-name`). `pgs` also means the separate nodes.
    Uio {
        /// The name, as in `/sys/class/uio/uio*/name`.
        node: String,
    },
    /// Registers through `/dev/mem`, inside these windows only. There is no interrupt this way.
    DevMem(DevMemWindows),
    /// An emulated board.
    #[cfg(feature = "emulation")]
    Emulated(bitstream_model::CpuPort),
    /// An emulated board in another process, served at this Unix socket
    /// ([`bitstream_model::remote`]). Its memory is [`MemoryChoice::File`], or the file beside the
    /// socket that `pgs serve` makes.
    #[cfg(feature = "emulation")]
    Served {
        /// The socket.
        socket: std::path::PathBuf,
    },
}

/// What kind of board was opened.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum BoardKind {
    /// A software-emulated board.
    Emulated,
    /// A board behind UIO nodes.
    Uio,
    /// A board behind `/dev/mem`.
    DevMem,
    /// A software-emulated board in another process.
    Served,
}

/// Which board was opened, and why.
#[derive(Debug, Clone, PartialEq, Eq)]
#[non_exhaustive]
pub struct BoardDescription {
    /// What kind.
    pub kind: BoardKind,
    /// Its name: the UIO node, "/dev/mem", "emulated", or the socket.
    pub name: String,
    /// Why this board and no other.
    pub reason: String,
}

impl fmt::Display for BoardDescription {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} ({})", self.name, self.reason)
    }
}

/// A board that was found.
#[derive(Debug)]
pub(crate) struct Found {
    pub(crate) platform: Arc<dyn Platform>,
    pub(crate) description: BoardDescription,
}

/// Finds the board of choice.
pub(super) fn find(
    choice: &BoardChoice,
    memory: &MemoryChoice,
    system: &System,
) -> Result<Found, OpenError> {
    let real = |registers, kind, name: &str, reason: &str| -> Result<Found, OpenError> {
        Ok(Found {
            platform: Arc::new(HardwarePlatform::open(system, registers, memory)?),
            description: BoardDescription {
                kind,
                name: name.to_owned(),
                reason: reason.to_owned(),
            },
        })
    };
    let uio = |node: &str, reason| {
        real(RegisterChoice::Uio(node.to_owned()), BoardKind::Uio, node, reason)
    };
    #[cfg(feature = "emulation")]
    if matches!(memory, MemoryChoice::File { .. }) && !matches!(choice, BoardChoice::Served { .. })
    {
        return Err(OpenError::ServedMemory);
    }
    match choice {
        BoardChoice::Automatic if has_nodes(&uio_nodes(&system.uio)?, UIO_NODE) => {
            uio(UIO_NODE, "its UIO node is there")
        }
        BoardChoice::Automatic => {
            let found = fall_back()?;
            own_memory(memory).map(|()| found)
        }
        BoardChoice::Uio { node } => uio(node, "asked for"),
        BoardChoice::DevMem(windows) => {
            let registers = RegisterChoice::DevMem(windows.clone());
            real(registers, BoardKind::DevMem, "/dev/mem", "asked for")
        }
        #[cfg(feature = "emulation")]
        BoardChoice::Emulated(port) => {
            own_memory(memory).map(|()| emulated(port.clone(), "asked for"))
        }
        #[cfg(feature = "emulation")]
        BoardChoice::Served { socket } => served(socket, memory),
    }
}

/// Refuses a choice of memory for a board that has its own.
fn own_memory(memory: &MemoryChoice) -> Result<(), OpenError> {
    match memory {
        MemoryChoice::Automatic => Ok(()),
        _ => Err(OpenError::EmulatedMemory),
    }
}

#[cfg(feature = "emulation")]
fn fall_back() -> Result<Found, OpenError> {
    log::warn!("no UIO node named \"{UIO_NODE}\": using the software-emulated board");
    let board = bitstream_model::EmulatedBoard::new(bitstream_model::BoardConfig::default())?;
    Ok(emulated(board.cpu_port(), "no UIO node named \"pgs\""))
}

#[cfg(not(feature = "emulation"))]
fn fall_back() -> Result<Found, OpenError> {
    Err(OpenError::NoEmulation { wanted: UIO_NODE.to_owned() })
}

#[cfg(feature = "emulation")]
fn emulated(port: bitstream_model::CpuPort, reason: &str) -> Found {
    Found {
        platform: Arc::new(crate::platform::EmulatedPlatform::new(port)),
        description: BoardDescription {
            kind: BoardKind::Emulated,
            name: "emulated".to_owned(),
            reason: reason.to_owned(),
        },
    }
}

/// The board of another process.
#[cfg(feature = "emulation")]
fn served(socket: &std::path::Path, memory: &MemoryChoice) -> Result<Found, OpenError> {
    let memory = match memory {
        MemoryChoice::Automatic => crate::platform::memory_beside(socket),
        MemoryChoice::File { path } => path.clone(),
        _ => return Err(OpenError::ServedMemory),
    };
    Ok(Found {
        platform: Arc::new(crate::platform::RemotePlatform::open(socket, &memory)?),
        description: BoardDescription {
            kind: BoardKind::Served,
            name: socket.display().to_string(),
            reason: "asked for".to_owned(),
        },
    })
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::*;
    use crate::accelerator::fake as bitstream;
    use crate::axi_dma::DmaError;
    use crate::platform::fake::FakeRegisters;
    use crate::platform::{Caching, PlatformError, uio_fake};
    use crate::{Accelerator, Error};

    fn uio(node: &str) -> BoardChoice {
        BoardChoice::Uio { node: node.to_owned() }
    }

    /// A system with the nodes `fabric` and `pgs`, whose control block says what `describe` makes it.
    fn system_with(describe: impl Fn(&FakeRegisters)) -> (tempfile::TempDir, System) {
        let root = tempfile::tempdir().expect("a directory");
        let system = System::under(root.path());
        uio_fake::add_node(&system, 0, "fabric", &[]);
        uio_fake::add_node(&system, 1, "pgs", &uio_fake::regions());
        let registers = FakeRegisters::default();
        describe(&registers);
        // Pages of up to 64 KiB; the control block is map 4.
        let path = system.dev.join("uio1");
        let mut device = fs::read(&path).expect("read");
        for page in [1 << 12, 1 << 14, 1 << 16] {
            registers.with(|state| {
                for (at, value) in &state.values {
                    let at = 4 * page + *at as usize;
                    device[at..at + 4].copy_from_slice(&value.to_le_bytes());
                }
            });
        }
        fs::write(path, device).expect("written");
        (root, system)
    }

    fn open(choice: &BoardChoice, system: &System) -> Result<Accelerator, Error> {
        let found = find(choice, &MemoryChoice::Automatic, system).map_err(Error::Open)?;
        Accelerator::on(found, None)
    }

    fn error_of(choice: &BoardChoice, system: &System) -> OpenError {
        match open(choice, system).expect_err("no board") {
            Error::Open(error) => error,
            other => panic!("{other}"),
        }
    }

    fn add_memory(system: &System) {
        uio_fake::add_node(system, 7, "pgs-memory", &[("memory", 0x6000_0000, 0x1_0000)]);
    }

    #[test]
    fn a_node_that_is_not_there_is_named_beside_those_that_are() {
        let (_root, system) = system_with(bitstream::describe);
        let text = error_of(&uio("pgs2"), &system).to_string();
        assert!(text.contains("\"pgs2\" (found: fabric, pgs)"), "{text}");
        let text = error_of(&uio("fabric"), &system).to_string();
        assert!(text.contains("\"fabric\" has no map named \"control\""), "{text}");
    }

    #[test]
    fn a_board_without_memory_says_what_it_looked_for() {
        let (_root, system) = system_with(bitstream::describe);
        for choice in [BoardChoice::Automatic, uio("pgs")] {
            let error = error_of(&choice, &system);
            assert!(
                matches!(error, OpenError::Platform(PlatformError::NoMemory { .. })),
                "{error}"
            );
        }
    }

    #[test]
    fn a_real_board_is_identified_and_never_replaced_by_an_emulated_one() {
        let (_root, system) = system_with(bitstream::describe);
        add_memory(&system);
        for choice in [BoardChoice::Automatic, uio("pgs")] {
            // The file of registers identifies itself; its cores do not come out of reset.
            let error = error_of(&choice, &system);
            assert!(
                matches!(&error, OpenError::Core(DmaError::State { channel, .. }) if channel == "dma0 MM2S"),
                "{error}"
            );
        }
    }

    #[test]
    fn another_bitstream_behind_the_node_is_refused_as_such() {
        let (_root, system) = system_with(|_| ());
        add_memory(&system);
        let error = error_of(&uio("pgs"), &system);
        assert!(matches!(error, OpenError::Identity(_)), "{error}");
    }

    #[test]
    fn nothing_is_touched_before_a_bitstream_is_loaded() {
        let (_root, system) = system_with(bitstream::describe);
        add_memory(&system);
        uio_fake::write(system.fpga_manager.join("state"), "unknown");
        let before = fs::read(system.dev.join("uio1")).expect("read");
        let error = error_of(&uio("pgs"), &system);
        assert!(matches!(error, OpenError::Platform(PlatformError::NoBitstream { .. })), "{error}");
        assert!(fs::read(system.dev.join("uio1")).expect("read") == before);
    }

    #[test]
    fn a_board_in_use_is_busy_until_it_is_closed() {
        let (_root, system) = system_with(bitstream::describe);
        add_memory(&system);
        let memory = MemoryChoice::Automatic;
        let first = find(&uio("pgs"), &memory, &system).expect("opened");
        let error = error_of(&uio("pgs"), &system);
        assert!(matches!(error, OpenError::Platform(PlatformError::Busy { .. })), "{error}");
        drop(first);
        find(&uio("pgs"), &memory, &system).expect("opened");
    }

    fn assert_busy(found: Result<Found, OpenError>, file: &str) {
        let error = found.expect_err("in use");
        assert!(
            matches!(&error, OpenError::Platform(PlatformError::Busy { path }) if path.ends_with(file)),
            "{file}: {error}"
        );
    }

    #[test]
    fn two_boards_do_not_share_memory() {
        let (_root, system) = system_with(bitstream::describe);
        add_memory(&system);
        uio_fake::add_node(&system, 2, "pgs2", &uio_fake::regions());
        let memory = MemoryChoice::Automatic;
        let first = find(&uio("pgs"), &memory, &system).expect("opened");
        assert_busy(find(&uio("pgs2"), &memory, &system), "uio7");
        // Through /dev/mem it is the same memory.
        uio_fake::write(system.dev.join("mem"), "");
        let window = MemoryChoice::DevMem { window: 0x6000_0000..0x6000_1000 };
        assert_busy(find(&uio("pgs2"), &window, &system), "uio7");
        drop(first);
        let second = find(&uio("pgs2"), &memory, &system).expect("the first is closed");

        // With a buffer of its own it is another board.
        for (name, text) in [("phys_addr", "0x70000000"), ("size", "4096"), ("sync_mode", "2")] {
            uio_fake::write(system.u_dma_buf.join("own").join(name), text);
        }
        let device = fs::File::create(system.dev.join("own"));
        device.and_then(|file| file.set_len(4096)).expect("resized");
        let own =
            MemoryChoice::UDmaBuf { name: "own".to_owned(), caching: Caching::WriteCombining };
        let first = find(&uio("pgs"), &own, &system).expect("nothing is shared");
        drop(second);
        assert_busy(find(&uio("pgs2"), &own, &system), "own");
        drop(first);
        find(&uio("pgs2"), &own, &system).expect("the first is closed");
    }

    #[test]
    fn each_dma_core_behind_a_node_of_its_own_has_one_user() {
        let root = tempfile::tempdir().expect("a directory");
        let system = System::under(root.path());
        add_memory(&system);
        let regions = uio_fake::regions();
        uio_fake::add_node(&system, 0, "pgs-control", &regions[4..]);
        uio_fake::add_node(&system, 2, "pgs-dma1", &regions[1..2]);
        let core = crate::platform::UioDevice::open_in(&system, "pgs-dma1").expect("opened");
        let find = || find(&BoardChoice::Automatic, &MemoryChoice::Automatic, &system);
        assert_busy(find(), "uio2");
        drop(core);
        find().expect("nobody has it");
    }

    #[test]
    fn dev_mem_carries_registers_and_memory_of_one_board() {
        let root = tempfile::tempdir().expect("a directory");
        let system = System::under(root.path());
        uio_fake::write(system.dev.join("mem"), "");
        let device = fs::File::create(system.dev.join("mem"));
        device.and_then(|file| file.set_len(0x10_0000)).expect("resized");
        let windows = DevMemWindows {
            dma: [0, 0x1_0000, 0x2_0000, 0x3_0000],
            control: 0x4_0000,
            memory: 0x8_0000..0x9_0000,
        };
        let choice = BoardChoice::DevMem(windows);
        for memory in [MemoryChoice::Automatic, MemoryChoice::DevMem { window: 0xA_0000..0xB_0000 }]
        {
            let Found { platform, .. } = find(&choice, &memory, &system).expect("opened once");
            platform.dma_window(3).expect("mapped").write32(4, 0x66);
            assert_eq!(fs::read(system.dev.join("mem")).expect("read")[0x3_0004], 0x66);
            let (address, _) = platform.allocate(4).expect("there is room");
            let expected = if memory == MemoryChoice::Automatic { 0x8_0000 } else { 0xA_0000 };
            assert_eq!(address, expected);
            assert_busy(find(&choice, &memory, &system), "mem");
        }
        find(&choice, &MemoryChoice::Automatic, &system).expect("nobody has it");
    }

    #[test]
    fn separate_nodes_are_a_board_and_an_absent_core_is_named() {
        let root = tempfile::tempdir().expect("a directory");
        let system = System::under(root.path());
        add_memory(&system);
        let regions = uio_fake::regions();
        uio_fake::add_node(&system, 0, "pgs-control", &regions[4..]);
        uio_fake::add_node(&system, 2, "pgs-dma1", &regions[1..2]);
        let found = find(&BoardChoice::Automatic, &MemoryChoice::Automatic, &system);
        let Found { platform, description } = found.expect("a board");
        assert_eq!(description.to_string(), "pgs (its UIO node is there)");
        assert_eq!(platform.control_window().expect("mapped").bytes(), 0x1000);
        platform.dma_window(1).expect("mapped").write32(4, 0x55);
        assert_eq!(fs::read(system.dev.join("uio2")).expect("read")[4], 0x55);
        for core in [0, 2, 3, 4] {
            let error = platform.dma_window(core).expect_err("absent").to_string();
            assert!(error.contains("found: pgs-dma1, pgs-control"), "{error}");
        }
    }

    #[test]
    fn dev_mem_is_opened_on_request_only_and_refused_without_the_file() {
        let root = tempfile::tempdir().expect("a directory");
        let system = System::under(root.path());
        let error = error_of(&BoardChoice::DevMem(DevMemWindows::default()), &system);
        assert!(matches!(error, OpenError::Platform(PlatformError::NoDevice { .. })), "{error}");
    }

    #[test]
    fn memory_is_taken_from_where_it_is_asked_for() {
        let (_root, system) = system_with(bitstream::describe);
        add_memory(&system);
        let open = |memory| find(&uio("pgs"), &memory, &system).map(|_| ());
        open(MemoryChoice::Uio { node: "pgs-memory".to_owned() }).expect("it is there");
        let other = open(MemoryChoice::Uio { node: "other".to_owned() }).expect_err("no such node");
        assert!(other.to_string().contains("\"other\""), "{other}");
        let name = "pgs".to_owned();
        let other = open(MemoryChoice::UDmaBuf { name, caching: Caching::Cached });
        let other = other.expect_err("no such buffer");
        assert!(matches!(other, OpenError::Platform(PlatformError::NoUDmaBuf { .. })), "{other}");
        let other = open(MemoryChoice::DevMem { window: 0..4096 }).expect_err("no such file");
        assert!(matches!(other, OpenError::Platform(PlatformError::NoDevice { .. })), "{other}");
    }

    #[cfg(feature = "emulation")]
    #[test]
    fn an_emulated_board_takes_no_other_memory() {
        let memory = MemoryChoice::Uio { node: "pgs-memory".to_owned() };
        let nothing = System::under(std::path::Path::new("/nonexistent"));
        let refused = find(&BoardChoice::Automatic, &memory, &nothing).expect_err("no board");
        assert!(matches!(refused, OpenError::EmulatedMemory), "{refused}");
    }

    #[test]
    fn without_a_node_the_emulated_board_says_why_it_was_taken() {
        let system = System::under(std::path::Path::new("/nonexistent"));
        let found = find(&BoardChoice::Automatic, &MemoryChoice::Automatic, &system);
        if cfg!(feature = "emulation") {
            let description = found.expect("the emulated board").description;
            assert_eq!(description.kind, BoardKind::Emulated);
            assert_eq!(description.to_string(), "emulated (no UIO node named \"pgs\")");
        } else {
            assert!(matches!(found, Err(OpenError::NoEmulation { .. })));
        }
    }
}
