//! Maps physical memory through `/dev/mem`: only on request, and only inside configured windows.
//!
//! `/dev/mem` is locked, and with it every device file that shows memory of these windows too: a
//! register or a buffer has one user, through `/dev/mem` or through its own device file.
//!
//! `/dev/mem` gives no interrupt. Memory that the kernel does not map (registers, memory reserved
//! with `no-map`) is mapped as Device memory.
//!
//! Source: Linux `Documentation/arch/arm64/memory.rst`, `drivers/char/mem.c`.

use std::io;
use std::ops::Range;
use std::sync::Arc;

use pgs_interface::address_map::{
    CONTROL_BASE, CONTROL_BYTES, DMA_BYTES, DMA_COUNT_MAX, MEMORY_BASE, MEMORY_BYTES, dma_base,
};

use super::lock::LockedFile;
use super::mapped::Mapping;
use super::sysfs::{is_gone, read_if_present, read_number};
use super::system::page_bytes;
use super::uio_device::NodeEntry;
use super::uio_listing::uio_listing;
use crate::platform::memory::u_dma_buf::directory;
use crate::platform::{
    PlatformError, RegisterMap, ReservedMemory, Result, System, u_dma_buf_names,
};

/// The windows that a board may use of `/dev/mem`. The default is the address map of the interface.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct DevMemWindows {
    /// Physical address of each AXI DMA, whose registers take 64 KiB.
    pub dma: [u64; DMA_COUNT_MAX],
    /// Physical address of the control block, which takes 4 KiB.
    pub control: u64,
    /// Memory that is reserved for DMA and that the kernel does not map.
    pub memory: Range<u64>,
}

impl Default for DevMemWindows {
    fn default() -> Self {
        Self {
            dma: std::array::from_fn(dma_base),
            control: CONTROL_BASE,
            memory: MEMORY_BASE..MEMORY_BASE + MEMORY_BYTES,
        }
    }
}

impl DevMemWindows {
    /// The registers of an AXI DMA or of the accelerator.
    pub(crate) fn window(&self, map: RegisterMap) -> Option<Range<u64>> {
        let (start, bytes) = match map {
            RegisterMap::Dma(core) => (*self.dma.get(core)?, DMA_BYTES),
            RegisterMap::Control => (self.control, CONTROL_BYTES),
        };
        Some(start..start.checked_add(u64::from(bytes))?)
    }

    /// All registers.
    pub(crate) fn registers(&self) -> Vec<Range<u64>> {
        let maps = (0..DMA_COUNT_MAX).map(RegisterMap::Dma).chain([RegisterMap::Control]);
        maps.filter_map(|map| self.window(map)).collect()
    }
}

fn overlap(a: &Range<u64>, b: &Range<u64>) -> bool {
    a.start < b.end && b.start < a.end
}

/// `/dev/mem`, open, for one user alone.
#[derive(Debug)]
pub(crate) struct DevMem {
    file: Arc<LockedFile>,
    /// Ranges that may be mapped.
    windows: Vec<Range<u64>>,
    /// The UIO nodes that show memory of the windows.
    nodes: Vec<NodeEntry>,
    /// Ranges that the kernel lists as its own, with its lines for them.
    kernel: Vec<(Range<u64>, String)>,
}

impl DevMem {
    /// Opens `/dev/mem` to map these windows and nothing else.
    pub(crate) fn open(system: &System, windows: Vec<Range<u64>>) -> Result<Self> {
        let first = windows.first().map_or(0, |window| window.start);
        let file = LockedFile::open(&system.dev.join("mem"), nix::libc::O_SYNC)
            .map_err(|error| refused("opened", first, error))?;
        let (others, nodes) = lock_others(system, &windows)?;
        let file = Arc::new(file.with(others));
        let kernel = kernel_memory(&read_if_present(&system.iomem)?.unwrap_or_default());
        Ok(Self { file, windows, nodes, kernel })
    }

    /// Makes sure that the UIO nodes which show memory of the windows are still there: with its
    /// node the logic may lose its clock.
    pub(crate) fn check(&self) -> Result<()> {
        self.nodes.iter().try_for_each(NodeEntry::check)
    }

    /// Maps a range.
    pub(crate) fn map(&self, wanted: &Range<u64>) -> Result<Mapping> {
        let (address, bytes) = (wanted.start, wanted.end.saturating_sub(wanted.start));
        let inside = |window: &Range<u64>| window.start <= wanted.start && wanted.end <= window.end;
        if bytes == 0 || !self.windows.iter().any(inside) {
            return Err(PlatformError::OutOfWindows { address, bytes });
        }
        if let Some((_, ram)) = self.kernel.iter().find(|(ram, _)| overlap(ram, wanted)) {
            return Err(PlatformError::KernelMemory { address, ram: ram.clone() });
        }
        let start = address % page_bytes(self.file.path())?;
        let region = || format!("{address:#x} of /dev/mem");
        let large = |_| PlatformError::TooLarge { region: region(), bytes };
        let mapped = Mapping::new(
            &self.file,
            address - start,
            usize::try_from(start).map_err(large)?,
            usize::try_from(bytes).map_err(large)?,
        );
        mapped.map_err(|error| refused("mapped", address, error))
    }

    /// Maps memory for DMA.
    pub(crate) fn memory(&self, wanted: &Range<u64>) -> Result<ReservedMemory> {
        ReservedMemory::new(self.map(wanted)?, wanted.start, "of /dev/mem".to_owned())
    }
}

/// Locks the device files that show memory of these windows too. A device without a file cannot be
/// opened and needs no lock.
/// Returns the locks, and the UIO nodes among these devices.
fn lock_others(
    system: &System,
    windows: &[Range<u64>],
) -> Result<(Vec<LockedFile>, Vec<NodeEntry>)> {
    let shown = |start: u64, bytes: u64| {
        let shown = start..start.saturating_add(bytes);
        windows.iter().any(|window| overlap(window, &shown))
    };
    let listing = uio_listing(&system.uio)?;
    // A node with an unreadable description may show memory of the windows.
    let mut names: Vec<_> = listing.unreadable.into_iter().map(|node| node.device).collect();
    let mut nodes = Vec::new();
    for node in listing.nodes {
        if node.maps.iter().any(|map| shown(map.address, map.bytes)) {
            nodes.push(NodeEntry::open(system, &node)?);
            names.push(node.device);
        }
    }
    for name in u_dma_buf_names(system) {
        let Ok(buffer) = directory(system, &name) else { continue };
        let number = |attribute| read_number(&buffer.join(attribute));
        match number("phys_addr").and_then(|start| Ok(shown(start, number("size")?))) {
            Ok(false) => {}
            Err(error) if is_gone(&error) => {}
            Ok(true) | Err(_) => names.push(name),
        }
    }
    let mut locked = Vec::new();
    for name in names {
        match LockedFile::open(&system.dev.join(name), nix::libc::O_NONBLOCK) {
            Ok(file) => locked.push(file),
            Err(PlatformError::NoDevice { .. }) => {}
            Err(error) => return Err(error),
        }
    }
    Ok((locked, nodes))
}

/// Tells missing rights and the kernel's restrictions from other failures.
fn refused(act: &'static str, address: u64, error: PlatformError) -> PlatformError {
    match error {
        PlatformError::Permission { path, source } => {
            PlatformError::DevMemRefused { act, address, path, source }
        }
        PlatformError::File { path, source, .. }
            if source.kind() == io::ErrorKind::PermissionDenied =>
        {
            PlatformError::DevMemRefused { act, address, path, source }
        }
        error => error,
    }
}

/// The lines of `/proc/iomem` for the kernel's own memory. A reader without rights sees zeros.
fn kernel_memory(iomem: &str) -> Vec<(Range<u64>, String)> {
    let parse = |line: &str| {
        let (addresses, name) = line.trim().split_once(" : ")?;
        let (first, last) = addresses.split_once('-')?;
        let first = u64::from_str_radix(first, 16).ok()?;
        let last = u64::from_str_radix(last, 16).ok()?;
        (name == "System RAM" && last > first)
            .then(|| (first..last.saturating_add(1), line.trim().to_owned()))
    };
    iomem.lines().filter_map(parse).collect()
}

#[cfg(test)]
mod tests {
    use std::fs::{self, File};
    use std::path::PathBuf;

    use super::*;
    use crate::platform::uio_fake::{add_node, empty_system, write};
    use crate::platform::{RegisterWindow, UioDevice, release_to_device};
    use pgs_interface::record::Beat;

    /// Opens it for registers and memory.
    fn open(system: &System, windows: &DevMemWindows) -> Result<DevMem> {
        let mut wanted = windows.registers();
        wanted.push(windows.memory.clone());
        DevMem::open(system, wanted)
    }

    /// A `/dev/mem` of 1 MiB with registers at its start and memory at 0x40040.
    fn memory() -> (tempfile::TempDir, System, DevMemWindows) {
        let (root, system) = empty_system();
        let path = system.dev.join("mem");
        write(path.clone(), "");
        File::create(path).and_then(|file| file.set_len(1 << 20)).expect("resized");
        let windows = DevMemWindows {
            dma: [0, 0x1_0000, 0x2_0000, 0x3_0000],
            control: 0x8_0040,
            memory: 0x4_0040..0x6_0000,
        };
        (root, system, windows)
    }

    #[test]
    fn the_default_windows_are_those_of_the_interface() {
        let windows = DevMemWindows::default();
        assert_eq!(windows.window(RegisterMap::Dma(3)), Some(0xA003_0000..0xA004_0000));
        assert_eq!(windows.window(RegisterMap::Dma(4)), None);
        assert_eq!(windows.window(RegisterMap::Control), Some(0xA004_0000..0xA004_1000));
        assert_eq!(windows.memory, 0x5000_0000..0x5400_0000);
    }

    #[test]
    fn a_window_is_mapped_where_it_lies_and_need_not_begin_on_a_page() {
        let (_root, system, windows) = memory();
        let control = windows.window(RegisterMap::Control).expect("no overflow");
        let memory_window = windows.memory.clone();
        let mem = open(&system, &windows).expect("opened");
        mem.map(&control).expect("mapped").write32(8, 0x0403_0201);
        let mut memory = mem.memory(&memory_window).expect("mapped");
        assert_eq!((memory.address(), memory.bytes()), (0x4_0040, 0x1_FFC0));
        memory.write(16, &[Beat([5, 6, 7, 8])]).expect("inside");
        release_to_device();
        let file = fs::read(system.dev.join("mem")).expect("read");
        assert_eq!(file[0x8_0048..0x8_004C], [1, 2, 3, 4]);
        assert_eq!(file[0x4_0050..0x4_0054], [5, 0, 0, 0]);
    }

    #[test]
    fn nothing_outside_the_windows_is_mapped() {
        let (_root, system, windows) = memory();
        let mem = open(&system, &windows).expect("opened");
        for (wanted, _) in [
            (0xF_0000..0xF_1000, "nowhere"),
            (0x3_FFF0..0x4_0010, "over an end"),
            (0x5_0000..0x6_0001, "past an end"),
            (0x4_0000..0x4_0080, "before a start"),
            (0x5_0000..0x5_0000, "empty"),
        ] {
            let error = mem.map(&wanted).expect_err("outside");
            assert!(matches!(error, PlatformError::OutOfWindows { .. }), "{error}");
        }
    }

    #[test]
    fn it_has_one_user_who_may_map_registers_and_memory() {
        let (_root, system, windows) = memory();
        let mem = open(&system, &windows).expect("opened");
        let error = open(&system, &windows).expect_err("in use");
        assert!(matches!(&error, PlatformError::Busy { path } if path.ends_with("mem")), "{error}");
        let control =
            mem.map(&windows.window(RegisterMap::Control).expect("no overflow")).expect("mapped");
        let memory = mem.memory(&windows.memory).expect("mapped");
        // Either keeps it.
        drop((mem, control));
        open(&system, &windows).expect_err("the memory is left");
        drop(memory);
        open(&system, &windows).expect("nobody has it");
    }

    #[test]
    fn what_shows_the_same_memory_is_kept_too_and_nothing_else() {
        let (_root, system, windows) = memory();
        add_node(&system, 0, "pgs", &[("dma0", 0, 0x1_0000), ("control", 0x8_0000, 0x1000)]);
        add_node(&system, 1, "pgs-memory", &[("memory", 0x4_0000, 0x1_0000)]);
        add_node(&system, 2, "beside", &[("memory", 0x6_0000, 0x1_0000)]);
        for (name, address) in [("inside", "0x50000"), ("outside", "0x60000")] {
            write(system.u_dma_buf.join(name).join("phys_addr"), address);
            write(system.u_dma_buf.join(name).join("size"), "4096");
            write(system.dev.join(name), "");
        }
        let busy = || {
            let mut busy = Vec::new();
            for name in ["uio0", "uio1", "uio2", "inside", "outside"] {
                match LockedFile::open(&system.dev.join(name), 0) {
                    Ok(_) => {}
                    Err(PlatformError::Busy { .. }) => busy.push(name),
                    Err(error) => panic!("{error}"),
                }
            }
            busy
        };
        let mem = open(&system, &windows).expect("opened");
        assert_eq!(busy(), ["uio0", "uio1", "inside"]);
        drop(mem);
        let mem = DevMem::open(&system, vec![windows.memory.clone()]).expect("opened");
        assert_eq!(busy(), ["uio1", "inside"], "the registers are left to others");
        drop(mem);

        let device = UioDevice::open_in(&system, "pgs-memory").expect("opened");
        let error = open(&system, &windows).expect_err("its memory is in use");
        assert!(
            matches!(&error, PlatformError::Busy { path } if path.ends_with("uio1")),
            "{error}"
        );
        drop(device);
        assert_eq!(busy(), [""; 0], "a refusal keeps nothing");
        fs::remove_file(system.dev.join("uio1")).expect("removed");
        open(&system, &windows).expect("what cannot be opened is in nobody's hands");
    }

    #[test]
    fn a_node_of_which_one_region_lies_in_the_windows_is_kept_and_asked() {
        let (_root, system, windows) = memory();
        let maps = [("other", 0xFD0B_0000, 0x1000), ("dma0", 0, 0x1_0000), ("more", 0xA0_0000, 16)];
        add_node(&system, 0, "foreign", &maps);
        add_node(&system, 1, "outside", &maps[..1]);
        let mem = open(&system, &windows).expect("opened");
        let error = UioDevice::open_in(&system, "foreign").expect_err("its region is in use");
        assert!(matches!(error, PlatformError::Busy { .. }), "{error}");
        UioDevice::open_in(&system, "outside").expect("nobody has it");
        fs::write(system.uio.join("uio1/name"), "").expect("emptied");
        mem.check().expect("no node of these windows");
        fs::write(system.uio.join("uio0/name"), "").expect("emptied");
        let error = mem.check().expect_err("its overlay was removed").to_string();
        assert!(error.contains("\"foreign\" (uio0) went away"), "{error}");
    }

    #[test]
    fn what_cannot_be_read_is_kept_too_unless_it_is_gone() {
        let (_root, system, windows) = memory();
        add_node(&system, 0, "foreign", &[("registers", 0xFD0B_0000, 0x1000)]);
        write(system.uio.join("uio0/maps/map0/size"), "large");
        for name in ["foreign", "leaving"] {
            write(system.u_dma_buf.join(name).join("size"), "many");
            write(system.dev.join(name), "");
        }
        write(system.u_dma_buf.join("foreign/phys_addr"), "0x60000000");
        let mem = open(&system, &windows).expect("opened");
        for (name, kept) in [("uio0", true), ("foreign", true), ("leaving", false)] {
            let file = LockedFile::open(&system.dev.join(name), 0);
            assert_eq!(matches!(file, Err(PlatformError::Busy { .. })), kept, "{name}");
        }
        drop(mem);
    }

    #[test]
    fn memory_of_the_kernel_is_refused() {
        let (_root, system, windows) = memory();
        let iomem = "00000000-0000ffff : reserved\n00040000-0004ffff : System RAM\n  \
                     00041000-00041fff : Kernel code\n00080000-00080fff : a0040000.control\n";
        write(system.iomem.clone(), iomem);
        let memory = windows.memory.clone();
        let control = windows.window(RegisterMap::Control).expect("no overflow");
        let mem = open(&system, &windows).expect("opened");
        let error = mem.memory(&memory).expect_err("overlaps");
        assert!(
            matches!(&error, PlatformError::KernelMemory { ram, .. } if ram.contains("0004ffff")),
            "{error}"
        );
        mem.map(&control).expect("not the kernel's");
        mem.map(&(0x5_0000..0x6_0000)).expect("just behind it");
    }

    #[test]
    fn an_iomem_without_rights_says_nothing() {
        assert_eq!(kernel_memory("00000000-00000000 : System RAM\n"), []);
        assert_eq!(kernel_memory("rubbish\n-- : System RAM\n"), []);
    }

    #[test]
    fn a_system_without_the_file_says_so() {
        let (_root, system, windows) = memory();
        fs::remove_file(system.dev.join("mem")).expect("removed");
        let error = open(&system, &windows).expect_err("no file");
        assert!(matches!(error, PlatformError::NoDevice { .. }), "{error}");
    }

    #[test]
    fn a_kernel_that_refuses_is_told_from_other_failures() {
        let error = |errno: nix::errno::Errno| {
            let path = PathBuf::from("/dev/mem");
            PlatformError::File { act: "map", path, source: errno.into() }
        };
        let text = refused("mapped", 0xA000_0000, error(nix::errno::Errno::EPERM)).to_string();
        assert!(text.contains("STRICT_DEVMEM") && text.contains("mapped at 0xa0000000"), "{text}");
        let other = refused("mapped", 0, error(nix::errno::Errno::EINVAL));
        assert!(matches!(other, PlatformError::File { .. }), "{other}");
    }
}
