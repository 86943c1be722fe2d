//! Drives a real board: finds and maps its registers and memory, and waits for its interrupt.

use std::ops::Range;
#[cfg(feature = "emulation")]
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;
use std::time::{Duration, Instant};

use pgs_interface::address_map::{U_DMA_BUF, UIO_CONTROL_MAP, UIO_DMA_MAPS, UIO_MEMORY_NODE};

use crate::platform::linux::dev_mem::{DevMem, DevMemWindows};
use crate::platform::linux::uio_listing::part_name;
use crate::platform::linux::uio_listing::uio_listing;
use crate::platform::memory::pool::{Pool, Region};
use crate::platform::memory::u_dma_buf::{Caching, UDmaBuf};
use crate::platform::{
    DmaMemorySource, ManagerChoice, Platform, PlatformError, RegisterMap, RegisterWindow,
    ReservedMemory, System, UioDevice, require_bitstream,
};

/// Where a real board's memory for DMA comes from.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
#[non_exhaustive]
pub enum MemoryChoice {
    /// The u-dma-buf `pgs` if there is one, else the UIO node `pgs-memory`. A board opened through
    /// `/dev/mem` has its memory there too.
    #[default]
    Automatic,
    /// A buffer of the kernel module u-dma-buf.
    UDmaBuf {
        /// Its name, as in `/sys/class/u-dma-buf`.
        name: String,
        /// How the CPU sees it.
        caching: Caching,
    },
    /// Reserved memory behind a UIO node.
    Uio {
        /// The node's name (`linux,uio-name`).
        node: String,
    },
    /// Reserved memory through `/dev/mem`.
    DevMem {
        /// Its physical addresses.
        window: Range<u64>,
    },
}

/// Time to sleep between two polls of a board without an interrupt.
const WITHOUT_INTERRUPT: Duration = Duration::from_millis(1);
/// Shorter pauses spin: the kernel cannot sleep for less.
const SPIN: Duration = Duration::from_micros(20);

/// How the registers are reached.
#[derive(Debug)]
enum Registers {
    /// One UIO node carries all regions.
    OneNode(UioDevice),
    /// Each region has a node of its own; absent DMAs have none.
    Nodes { board: String, control: UioDevice, dma: Vec<(usize, UioDevice)> },
    /// Through `/dev/mem`, at these addresses.
    DevMem(DevMem, DevMemWindows),
}

/// A real board.
#[derive(Debug)]
pub(crate) struct HardwarePlatform {
    registers: Registers,
    pool: Pool,
    started: Instant,
    /// Whether the node turned out to carry no interrupt.
    no_interrupt: AtomicBool,
}

/// How to reach a real board's registers.
#[derive(Debug, Clone)]
pub(crate) enum RegisterChoice {
    /// The node of that name; without one, the nodes of the single regions.
    Uio(String),
    /// These windows of `/dev/mem`.
    DevMem(DevMemWindows),
}

impl HardwarePlatform {
    /// Opens registers and memory, once the kernel knows that the logic is programmed. No register
    /// is touched.
    pub(crate) fn open(
        system: &System,
        registers: RegisterChoice,
        memory: &MemoryChoice,
        manager: &ManagerChoice,
    ) -> Result<Self, PlatformError> {
        let window = match (memory, &registers) {
            (MemoryChoice::DevMem { window }, _) => Some(window.clone()),
            (MemoryChoice::Automatic, RegisterChoice::DevMem(windows)) => {
                Some(windows.memory.clone())
            }
            _ => None,
        };
        let registers = match registers {
            RegisterChoice::Uio(node) => open_uio(system, &node)?,
            RegisterChoice::DevMem(windows) => {
                // One opening serves registers and memory: the file has one user at a time.
                let wanted = windows.registers().into_iter().chain(window.clone()).collect();
                Registers::DevMem(DevMem::open(system, wanted)?, windows)
            }
        };
        require_bitstream(system, manager)?;
        let region: Box<dyn Region> = match (&registers, window) {
            (Registers::DevMem(mem, _), Some(window)) => Box::new(mem.memory(&window)?),
            (_, Some(window)) => {
                Box::new(DevMem::open(system, vec![window.clone()])?.memory(&window)?)
            }
            (_, None) => open_memory(system, memory)?,
        };
        log::info!("memory for DMA: {} bytes at {:#x}", region.bytes(), region.address());
        Ok(Self {
            registers,
            pool: Pool::new(region),
            started: Instant::now(),
            no_interrupt: AtomicBool::new(false),
        })
    }

    /// The node with the interrupt.
    fn interrupt(&self) -> Option<&UioDevice> {
        match &self.registers {
            Registers::OneNode(device) | Registers::Nodes { control: device, .. } => Some(device),
            Registers::DevMem(..) => None,
        }
        .filter(|_| !self.no_interrupt.load(Ordering::Relaxed))
    }

    /// Goes on without the interrupt if the node has none.
    fn with_interrupt<T>(
        &self,
        act: impl FnOnce(&UioDevice) -> Result<T, PlatformError>,
    ) -> Result<Option<T>, PlatformError> {
        let Some(device) = self.interrupt() else { return Ok(None) };
        match act(device) {
            Err(error @ PlatformError::NoInterrupt { .. }) => {
                if !self.no_interrupt.swap(true, Ordering::Relaxed) {
                    log::warn!("polling: {error}");
                }
                Ok(None)
            }
            result => result.map(Some),
        }
    }
}

/// Opens the node of that name, or the nodes `<name>-control`, `<name>-dma0` and so on.
fn open_uio(system: &System, name: &str) -> Result<Registers, PlatformError> {
    let mut listing = uio_listing(&system.uio)?;
    let control = part_name(name, UIO_CONTROL_MAP);
    if listing.has(name) || !listing.has(&control) {
        let node = listing.node(name)?;
        // A node without a control block is another device.
        node.map(UIO_CONTROL_MAP)?;
        return Ok(Registers::OneNode(UioDevice::of_node(system, node)?));
    }
    let control = UioDevice::of_node(system, listing.node(&control)?)?;
    let mut dma = Vec::new();
    for (core, region) in UIO_DMA_MAPS.into_iter().enumerate() {
        let name = part_name(name, region);
        if listing.has(&name) {
            dma.push((core, UioDevice::of_node(system, listing.node(&name)?)?));
        }
    }
    Ok(Registers::Nodes { board: name.to_owned(), control, dma })
}

/// Opens a u-dma-buf or the memory of a UIO node. Its device file is locked as long as the region,
/// or a piece of it, exists.
fn open_memory(system: &System, choice: &MemoryChoice) -> Result<Box<dyn Region>, PlatformError> {
    let u_dma_buf = |name: &str, caching| -> Result<Box<dyn Region>, PlatformError> {
        Ok(Box::new(UDmaBuf::open(system, name, caching)?))
    };
    let uio = |node: &str| -> Result<Box<dyn Region>, PlatformError> {
        Ok(Box::new(ReservedMemory::open_in(system, node)?))
    };
    match choice {
        MemoryChoice::UDmaBuf { name, caching } => u_dma_buf(name, *caching),
        MemoryChoice::Uio { node } => uio(node),
        _ if UDmaBuf::exists(system, U_DMA_BUF) => u_dma_buf(U_DMA_BUF, Caching::default()),
        _ if uio_listing(&system.uio)?.has(UIO_MEMORY_NODE) => uio(UIO_MEMORY_NODE),
        _ => Err(PlatformError::NoMemory { u_dma_buf: U_DMA_BUF, node: UIO_MEMORY_NODE }),
    }
}

impl Platform for HardwarePlatform {
    fn window(&self, map: RegisterMap) -> Result<Box<dyn RegisterWindow>, PlatformError> {
        let region = match map {
            RegisterMap::Dma(core) => UIO_DMA_MAPS.get(core).copied().unwrap_or_default(),
            RegisterMap::Control => UIO_CONTROL_MAP,
        };
        match &self.registers {
            Registers::OneNode(device) => Ok(device.window(region)?.into()),
            Registers::Nodes { board, control, dma } => {
                let device = match map {
                    RegisterMap::Control => Some(control),
                    RegisterMap::Dma(core) => {
                        dma.iter().find(|(number, _)| *number == core).map(|(_, device)| device)
                    }
                };
                let device = device.ok_or_else(|| {
                    let devices = dma.iter().map(|(_, device)| device).chain([control]);
                    let names: Vec<_> = devices.map(|device| device.node().name.as_str()).collect();
                    PlatformError::NoNode {
                        wanted: part_name(board, &map.to_string()),
                        found: names.join(", "),
                    }
                })?;
                Ok(device.map(device.node().map_or_only(region)?)?.into())
            }
            Registers::DevMem(mem, windows) => {
                let window = windows.window(map);
                let missing = PlatformError::OutOfWindows { address: u64::MAX, bytes: 0 };
                Ok(Box::new(mem.map(&window.ok_or(missing)?)?))
            }
        }
    }

    fn memory(&self) -> &dyn DmaMemorySource {
        &self.pool
    }

    fn now(&self) -> Duration {
        self.started.elapsed()
    }

    fn pause(&self, duration: Duration) {
        if duration > SPIN {
            return thread::sleep(duration);
        }
        let started = Instant::now();
        while started.elapsed() < duration {
            std::hint::spin_loop();
        }
    }

    fn wait_interrupt(&self, timeout: Duration) -> Result<Option<u32>, PlatformError> {
        if let Some(came) = self.with_interrupt(|device| device.wait_interrupt(timeout))? {
            return Ok(came);
        }
        self.pause(timeout.min(WITHOUT_INTERRUPT));
        Ok(None)
    }

    fn unmask_interrupt(&self) -> Result<(), PlatformError> {
        self.with_interrupt(UioDevice::unmask).map(|_| ())
    }
}
