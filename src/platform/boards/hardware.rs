//! Drives a real board: finds and maps its registers and memory, and waits for its interrupt.

use std::ops::Range;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, OnceLock};
use std::thread;
use std::time::{Duration, Instant};

use pgs_interface::address_map::{
    U_DMA_BUF, UIO_CONTROL_MAP, UIO_DMA_MAPS, UIO_GUARD_NODE, UIO_MEMORY_NODE,
};

use crate::platform::linux::dev_mem::{DevMem, DevMemWindows};
use crate::platform::linux::fpga::LogicState;
use crate::platform::linux::uio_listing::part_name;
use crate::platform::linux::uio_listing::uio_listing;
use crate::platform::memory::Caching;
use crate::platform::memory::pool::{Pool, Region};
use crate::platform::memory::u_dma_buf::UDmaBuf;
use crate::platform::{
    DmaMemorySource, ManagerChoice, Platform, PlatformError, RegisterMap, RegisterWindow,
    ReservedMemory, Result, System, UioDevice,
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
    system: System,
    started: Instant,
    /// Whether the node turned out to carry no interrupt.
    no_interrupt: AtomicBool,
    logic: LogicState,
    lost: Lost,
}

/// Why no register may be touched any more, once the logic went away. All windows share it.
type Lost = Arc<OnceLock<String>>;

/// A register region that is not touched once the board is lost: an access to logic without a clock
/// hangs the processor.
#[derive(Debug)]
struct UnlessLost {
    registers: Box<dyn RegisterWindow>,
    lost: Lost,
}

impl RegisterWindow for UnlessLost {
    fn bytes(&self) -> u64 {
        self.registers.bytes()
    }

    fn read32(&self, at: u32) -> u32 {
        if self.lost.get().is_some() { u32::MAX } else { self.registers.read32(at) }
    }

    fn write32(&self, at: u32, value: u32) {
        if self.lost.get().is_none() {
            self.registers.write32(at, value);
        }
    }
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
    ) -> Result<Self> {
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
        let logic = LogicState::open(system, manager)?;
        let region: Box<dyn Region> = match (&registers, window) {
            (Registers::DevMem(mem, _), Some(window)) => Box::new(mem.memory(&window)?),
            (_, Some(window)) => {
                Box::new(DevMem::open(system, vec![window.clone()])?.memory(&window)?)
            }
            (_, None) => open_memory(system, memory)?,
        };
        log::info!("memory for DMA: {} bytes at {:#x}", region.bytes(), region.address());
        Ok(Self::assemble(system, registers, region, logic))
    }

    fn assemble(
        system: &System,
        registers: Registers,
        region: Box<dyn Region>,
        logic: LogicState,
    ) -> Self {
        Self {
            registers,
            pool: Pool::new(region),
            system: system.clone(),
            started: Instant::now(),
            no_interrupt: AtomicBool::new(false),
            logic,
            lost: Lost::default(),
        }
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
    fn with_interrupt<T>(&self, act: impl FnOnce(&UioDevice) -> Result<T>) -> Result<Option<T>> {
        self.lost().map_or(Ok(()), Err)?;
        let Some(device) = self.interrupt() else { return Ok(None) };
        match act(device) {
            Err(error @ PlatformError::NoInterrupt { .. }) => {
                if !self.no_interrupt.swap(true, Ordering::Relaxed) {
                    log::warn!("polling: {error}");
                }
                Ok(None)
            }
            result => result.map(Some).map_err(|error| self.noted(error)),
        }
    }

    /// The registers of a region, mapped.
    fn registers_of(&self, map: RegisterMap) -> Result<Box<dyn RegisterWindow>> {
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

    /// Asks the kernel for everything that it can take away: the logic's state, and each node.
    fn ask(&self) -> Result<()> {
        self.logic.check()?;
        match &self.registers {
            Registers::OneNode(device) => device.check(),
            Registers::Nodes { control, dma, .. } => {
                control.check()?;
                dma.iter().try_for_each(|(_, device)| device.check())
            }
            Registers::DevMem(mem, _) => mem.check(),
        }
    }

    /// Keeps the first loss: from then on no register is touched.
    fn noted(&self, error: PlatformError) -> PlatformError {
        if let PlatformError::Lost { why } = &error {
            self.lost.get_or_init(|| why.clone());
        }
        error
    }
}

/// Opens the node of that name, or the nodes `<name>-control`, `<name>-dma0` and so on.
fn open_uio(system: &System, name: &str) -> Result<Registers> {
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
fn open_memory(system: &System, choice: &MemoryChoice) -> Result<Box<dyn Region>> {
    let u_dma_buf = |name: &str, caching| -> Result<Box<dyn Region>> {
        Ok(Box::new(UDmaBuf::open(system, name, caching)?))
    };
    let uio = |node: &str| -> Result<Box<dyn Region>> {
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
    fn window(&self, map: RegisterMap) -> Result<Box<dyn RegisterWindow>> {
        let registers = self.registers_of(map)?;
        Ok(Box::new(UnlessLost { registers, lost: Arc::clone(&self.lost) }))
    }

    fn memory(&self) -> &dyn DmaMemorySource {
        &self.pool
    }

    fn guard(&self) -> Result<Option<Box<dyn DmaMemorySource>>> {
        if !uio_listing(&self.system.uio)?.has(UIO_GUARD_NODE) {
            return Ok(None);
        }
        let guard = ReservedMemory::open_in(&self.system, UIO_GUARD_NODE)?;
        Ok(Some(Box::new(Pool::new(Box::new(guard)))))
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

    fn wait_interrupt(&self, timeout: Duration) -> Result<Option<u32>> {
        if let Some(came) = self.with_interrupt(|device| device.wait_interrupt(timeout))? {
            return Ok(came);
        }
        self.pause(timeout.min(WITHOUT_INTERRUPT));
        // Without an interrupt nothing else tells, while the caller looks at the registers.
        self.check_present().map(|()| None)
    }

    fn unmask_interrupt(&self) -> Result<()> {
        self.with_interrupt(UioDevice::unmask).map(|_| ())
    }

    fn lost(&self) -> Option<PlatformError> {
        self.lost.get().map(|why| PlatformError::Lost { why: why.clone() })
    }

    /// Two system calls for one node, one for each further node.
    fn check_present(&self) -> Result<()> {
        self.lost().map_or(Ok(()), Err)?;
        self.ask().map_err(|error| self.noted(error))
    }
}

#[cfg(test)]
mod tests {
    use std::fs;
    use std::io::{Read as _, Write as _};
    use std::os::unix::net::UnixStream;

    use super::*;
    use crate::platform::ZYNQMP_MANAGER;
    use crate::platform::fpga_fake::add_manager;
    use crate::platform::linux::uio_device::fake::{EINVAL, EIO, give_interrupt, refuse};
    use crate::platform::memory::reserved::fake::reserved;
    use crate::platform::uio_fake::{add_node, empty_system, regions, write};

    const LONG: Duration = Duration::from_secs(30);

    /// The ways to a board's registers.
    const ONE_NODE: &str = "pgs";
    const NODES: &str = "parts";
    const DEV_MEM: &str = "devmem";

    /// A board with one node, a board with a node for each region, a `/dev/mem`, and a manager.
    fn system() -> (tempfile::TempDir, System) {
        let (root, system) = empty_system();
        add_node(&system, 3, ONE_NODE, &regions());
        for (number, region) in (4..).zip(regions()) {
            let name = part_name(NODES, region.0);
            add_node(&system, number, &name, &[(region.0, region.1 + (1 << 24), region.2)]);
        }
        write(system.dev.join("mem"), "");
        let mem = fs::File::options().write(true).open(system.dev.join("mem")).expect("there");
        mem.set_len(0xA005_0000).expect("a sparse file");
        add_manager(&system, 0, ZYNQMP_MANAGER, "operating");
        (root, system)
    }

    fn board(system: &System, way: &str, manager: &ManagerChoice) -> HardwarePlatform {
        let registers = match way {
            DEV_MEM => {
                let windows = DevMemWindows::default();
                let mem = DevMem::open(system, windows.registers()).expect("opened");
                Registers::DevMem(mem, windows)
            }
            node => open_uio(system, node).expect("opened"),
        };
        let (_, memory) = reserved(0x6000_0000, 1 << 16);
        let logic = LogicState::open(system, manager).expect("it runs");
        HardwarePlatform::assemble(system, registers, Box::new(memory), logic)
    }

    /// The device with the interrupt.
    fn control(platform: &mut HardwarePlatform) -> &mut UioDevice {
        match &mut platform.registers {
            Registers::OneNode(device) | Registers::Nodes { control: device, .. } => device,
            Registers::DevMem(..) => panic!("it has no interrupt"),
        }
    }

    /// A board whose node has an interrupt; the other end plays the kernel.
    fn with_interrupt(system: &System, way: &str) -> (HardwarePlatform, UnixStream) {
        let mut platform = board(system, way, &ManagerChoice::Automatic);
        let kernel = give_interrupt(control(&mut platform));
        (platform, kernel)
    }

    #[test]
    fn the_interrupt_is_waited_for_and_let_through_at_the_node() {
        for way in [ONE_NODE, NODES] {
            let (_root, system) = system();
            let (platform, mut kernel) = with_interrupt(&system, way);
            assert_eq!(platform.wait_interrupt(Duration::ZERO).expect("none yet"), None, "{way}");
            let started = platform.now();
            let some = Duration::from_millis(20);
            assert_eq!(platform.wait_interrupt(some).expect("none yet"), None, "{way}");
            assert!(platform.now() - started >= some, "{way}: it has an interrupt to wait for");
            kernel.write_all(&7_u32.to_ne_bytes()).expect("written");
            assert_eq!(platform.wait_interrupt(LONG).expect("there is one"), Some(7), "{way}");
            platform.unmask_interrupt().expect("written");
            platform.check_present().expect("written");
            let mut words = [0; 8];
            kernel.read_exact(&mut words).expect("the unmasking, and the question before a step");
            assert_eq!(words, [1_u32.to_ne_bytes(); 2].concat()[..], "{way}");
        }
    }

    #[test]
    fn a_board_without_an_interrupt_is_polled() {
        let (_root, system) = system();
        for way in [ONE_NODE, NODES, DEV_MEM] {
            let mut platform = board(&system, way, &ManagerChoice::Automatic);
            if way != DEV_MEM {
                refuse(control(&mut platform), EIO);
            }
            for _ in 0..3 {
                assert_eq!(platform.wait_interrupt(LONG).expect("polling"), None, "{way}");
                platform.unmask_interrupt().expect("nothing to do");
                platform.check_present().expect("it is there");
            }
            assert!(platform.now() < LONG, "{way}: a wait is the pause of a poll");
        }
    }

    /// Checks that the board is lost, for good, and that its registers are left alone.
    #[track_caller]
    fn assert_lost(platform: &HardwarePlatform, (device, at): (&std::path::Path, u64), why: &str) {
        use std::os::unix::fs::FileExt as _;
        let word = || {
            let mut word = [0; 4];
            fs::File::open(device)
                .and_then(|file| file.read_exact_at(&mut word, at))
                .expect("read");
            word
        };
        let window = platform.window(RegisterMap::Control).expect("mapped before");
        let before = word();
        let error = platform.check_present().expect_err(why);
        assert!(matches!(error, PlatformError::Lost { .. }), "{error}");
        assert!(error.to_string().contains(why), "{error}");
        assert_eq!(window.read32(0), u32::MAX);
        window.write32(0, 0x0403_0201);
        assert_eq!(word(), before);
        platform.wait_interrupt(LONG).expect_err("lost");
        platform.unmask_interrupt().expect_err("lost");
        let kept = platform.lost().expect("lost").to_string();
        assert!(kept.contains(why), "{kept}");
    }

    /// Where the control block begins in the device file of its node.
    fn control_file(system: &System, way: &str) -> (std::path::PathBuf, u64) {
        let page = crate::platform::linux::system::page_bytes("".as_ref()).expect("a size");
        match way {
            ONE_NODE => (system.dev.join("uio3"), 4 * page),
            NODES => (system.dev.join("uio8"), 0),
            _ => (system.dev.join("mem"), pgs_interface::address_map::CONTROL_BASE),
        }
    }

    #[test]
    fn registers_that_may_be_touched_are() {
        for way in [ONE_NODE, NODES, DEV_MEM] {
            let (_root, system) = system();
            let platform = board(&system, way, &ManagerChoice::Automatic);
            let window = platform.window(RegisterMap::Control).expect("mapped");
            window.write32(8, 5);
            assert_eq!((window.read32(8), window.read32(0)), (5, 0), "{way}");
        }
    }

    #[test]
    fn a_node_that_went_away_is_lost_with_its_interrupt() {
        for file in [EIO, EINVAL] {
            for way in [ONE_NODE, NODES] {
                let (_root, system) = system();
                let mut platform = board(&system, way, &ManagerChoice::Automatic);
                // Mapped while the device file is the node's own.
                let registers = platform.window(RegisterMap::Control).expect("mapped");
                let _kernel = give_interrupt(control(&mut platform));
                assert_eq!(platform.wait_interrupt(Duration::ZERO).expect("none yet"), None);
                refuse(control(&mut platform), file);
                let error = platform.unmask_interrupt().expect_err("unbound");
                assert!(matches!(error, PlatformError::Lost { .. }), "{error}");
                assert_eq!(registers.read32(0), u32::MAX, "{way}");
                registers.write32(0, 0x0403_0201);
                let (device, at) = control_file(&system, way);
                let at = usize::try_from(at).expect("a small file");
                assert_eq!(fs::read(device).expect("read")[at..at + 4], [0; 4], "{way}");
                platform.check_present().expect_err("for good");
            }
        }
    }

    #[test]
    fn a_node_without_an_interrupt_is_asked_by_its_entry() {
        // Of the control block, or of a core.
        for (way, node, text) in [
            (ONE_NODE, 3, "\"pgs\" (uio3) went away"),
            (NODES, 8, "\"parts-control\" (uio8) went away"),
            (NODES, 6, "\"parts-dma2\" (uio6) went away"),
            (DEV_MEM, 3, "\"pgs\" (uio3) went away"),
        ] {
            let (_root, system) = system();
            let platform = board(&system, way, &ManagerChoice::Automatic);
            platform.check_present().expect("it is there");
            fs::write(system.uio.join(format!("uio{node}/name")), "").expect("emptied");
            let (device, at) = control_file(&system, way);
            assert_lost(&platform, (&device, at), text);
        }
    }

    #[test]
    fn a_poll_without_an_interrupt_asks_too() {
        let (_root, system) = system();
        let platform = board(&system, DEV_MEM, &ManagerChoice::Automatic);
        assert_eq!(platform.wait_interrupt(LONG).expect("polling"), None);
        add_manager(&system, 0, ZYNQMP_MANAGER, "write");
        let error = platform.wait_interrupt(LONG).expect_err("another bitstream is on its way");
        assert!(matches!(error, PlatformError::Lost { .. }), "{error}");
    }

    #[test]
    fn the_state_of_the_logic_is_asked_unless_the_caller_knows_it() {
        for way in [ONE_NODE, NODES, DEV_MEM] {
            for state in ["write init", "write error", "unknown"] {
                for manager in [ManagerChoice::Unasked, ManagerChoice::Automatic] {
                    let (_root, system) = system();
                    let platform = board(&system, way, &manager);
                    platform.check_present().expect("it runs");
                    add_manager(&system, 0, ZYNQMP_MANAGER, state);
                    if manager == ManagerChoice::Unasked {
                        platform.check_present().expect("not asked");
                    } else {
                        let (device, at) = control_file(&system, way);
                        assert_lost(&platform, (&device, at), &format!("to {state:?}"));
                    }
                }
            }
        }
    }
}
