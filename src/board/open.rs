//! Opens a board. No other module knows every kind of board.

use std::fmt;
use std::sync::Arc;

use pgs_interface::address_map::UIO_NODE;

#[cfg(feature = "emulation")]
use crate::error::BoardTextError;
use crate::error::OpenError;
use crate::platform::linux::uio_listing::uio_listing;
use crate::platform::{
    DevMemWindows, HardwarePlatform, ManagerChoice, MemoryChoice, Platform, RegisterChoice, System,
};

/// How to open the accelerator. The default takes a real board, or else an emulated one.
#[derive(Debug, Clone, Default)]
pub struct OpenOptions {
    /// Which board.
    pub board: BoardChoice,
    /// Where a real board's memory for DMA comes from.
    pub memory: MemoryChoice,
    /// Which FPGA manager tells whether a real board's logic is programmed, before any access to
    /// it.
    pub manager: ManagerChoice,
    /// Width of the DMA cores' length registers, bits; `None` takes the bitstream's own figure.
    /// Both are checked against the cores.
    pub length_width: Option<u32>,
    /// Threads that write the records of a step and read its results, including the caller's: 1 to
    /// 64; a number outside is clamped. `None` takes one per processor, at most four. Records and
    /// results do not depend on the number. The caller's thread works alone on up to about 2,000
    /// bodies or collisions. The other threads start with the first larger step, and end with the
    /// accelerator.
    ///
    /// These threads call [`Bodies`](crate::Bodies) and [`Collisions`](crate::Collisions) while the
    /// caller's thread waits. A container that depends on the caller's thread (thread-local data, a
    /// lock that the caller holds) needs `Some(1)`. The rounding and flushing modes of the caller's
    /// thread do not matter: all threads compute in the standard [floating-point
    /// environment](crate#the-floating-point-environment).
    pub pack_threads: Option<usize>,
}

impl OpenOptions {
    /// Opens a new emulated board that is built as the text describes:
    /// `"float,world,threads=1"`, for example. The page of [`emulation`](crate::emulation) has all
    /// options.
    ///
    /// ```
    /// use zynq_pgs::{Accelerator, OpenOptions};
    ///
    /// # fn main() -> Result<(), zynq_pgs::Error> {
    /// let accelerator = Accelerator::open(OpenOptions::emulated("half,unchecked")?)?;
    /// assert_eq!(accelerator.capabilities().variant.profile.name, "half");
    /// # Ok(())
    /// # }
    /// ```
    ///
    /// # Errors
    /// [`BoardTextError::Build`]: the text describes no build.
    #[cfg(feature = "emulation")]
    pub fn emulated(build: &str) -> Result<Self, BoardTextError> {
        Ok(Self { board: BoardChoice::Built(build.parse()?), ..Self::default() })
    }
}

/// Which board to open. [`parse`](str::parse) reads it from a text: `auto`, `uio[:NODE]`, `devmem`,
/// `emulated[:BUILD]` or `socket:PATH`.
#[derive(Debug, Clone, Default)]
#[non_exhaustive]
pub enum BoardChoice {
    /// The UIO node `pgs`, or the nodes `pgs-control` and `pgs-dma0` to `pgs-dma3`, if they exist;
    /// else an emulated board, with a log message at warn level.
    #[default]
    Automatic,
    /// The UIO node of this name (`linux,uio-name`), or a node for each region: `<node>-control`,
    /// and `<node>-dma0` to `<node>-dma3`, one per DMA core.
    Uio {
        /// The name, as in `/sys/class/uio/uio*/name`.
        node: String,
    },
    /// Registers through `/dev/mem`, inside these windows only. This way has no interrupt.
    DevMem(DevMemWindows),
    /// A new emulated board, built like this. To watch it or to make it fail, build it by hand and
    /// open its port ([`Self::Emulated`]).
    #[cfg(feature = "emulation")]
    Built(crate::emulation::Build),
    /// An emulated board that was built before.
    #[cfg(feature = "emulation")]
    Emulated(bitstream_model::CpuPort),
    /// An emulated board in another process, served at this Unix socket
    /// ([`bitstream_model::remote`]), which brings its memory.
    #[cfg(feature = "emulation")]
    Served {
        /// The socket.
        socket: std::path::PathBuf,
    },
}

/// The kind of a board.
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
    /// Its kind.
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
pub(crate) fn find(
    choice: &BoardChoice,
    memory: &MemoryChoice,
    manager: &ManagerChoice,
    system: &System,
) -> Result<Found, OpenError> {
    let real = |registers, kind, name: &str, reason: &str| -> Result<Found, OpenError> {
        Ok(Found {
            platform: Arc::new(HardwarePlatform::open(system, registers, memory, manager)?),
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
    match choice {
        BoardChoice::Automatic => {
            let mut listing = uio_listing(&system.uio)?;
            if listing.has_board(UIO_NODE)? {
                return uio(UIO_NODE, "its UIO node is there");
            }
            let found = fall_back(&listing.without_board(UIO_NODE))?;
            own_memory(memory).map(|()| found)
        }
        BoardChoice::Uio { node } => uio(node, "asked for"),
        BoardChoice::DevMem(windows) => {
            let registers = RegisterChoice::DevMem(windows.clone());
            real(registers, BoardKind::DevMem, "/dev/mem", "asked for")
        }
        #[cfg(feature = "emulation")]
        BoardChoice::Built(build) => {
            own_memory(memory).and_then(|()| built(build.config(), "asked for"))
        }
        #[cfg(feature = "emulation")]
        BoardChoice::Emulated(port) => {
            own_memory(memory).map(|()| emulated(port.clone(), "asked for"))
        }
        #[cfg(feature = "emulation")]
        BoardChoice::Served { socket } => own_memory(memory).and_then(|()| served(socket)),
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
fn fall_back(reason: &str) -> Result<Found, OpenError> {
    log::warn!("{reason}: using the software-emulated board");
    built(bitstream_model::BoardConfig::default(), reason)
}

/// Builds an emulated board.
#[cfg(feature = "emulation")]
fn built(config: bitstream_model::BoardConfig, reason: &str) -> Result<Found, OpenError> {
    let board = bitstream_model::EmulatedBoard::new(config)?;
    Ok(emulated(board.cpu_port(), reason))
}

#[cfg(not(feature = "emulation"))]
fn fall_back(reason: &str) -> Result<Found, OpenError> {
    Err(OpenError::NoEmulation { reason: reason.to_owned() })
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
fn served(socket: &std::path::Path) -> Result<Found, OpenError> {
    Ok(Found {
        platform: Arc::new(crate::platform::RemotePlatform::open(socket)?),
        description: BoardDescription {
            kind: BoardKind::Served,
            name: socket.display().to_string(),
            reason: "asked for".to_owned(),
        },
    })
}
