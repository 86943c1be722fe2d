//! This file opens a UIO node: maps its regions and waits for its interrupt.
//!
//! The kernel's handler masks the interrupt and counts it; reading four bytes gives the count since
//! the device was registered, writing a 1 lets the next one through. A count that jumps is no
//! error: only that it changed matters.
//!
//! Source: Linux `Documentation/driver-api/uio-howto.rst`, `drivers/uio/uio_pdrv_genirq.c`.

use std::fs::{File, TryLockError};
use std::io::{self, Read as _, Write as _};
use std::os::fd::AsFd as _;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use nix::errno::Errno;
use nix::poll::{PollFd, PollFlags, PollTimeout, poll};

use super::mapped::Mapping;
use super::system::open_device;
use super::uio::node_named;
use super::{PlatformError, RegisterWindow, System, UioMap, UioNode, uio_nodes};

/// An open UIO node.
///
/// The interrupt protocol of a level-triggered device: acknowledge it in the device, then
/// [`unmask`](Self::unmask), then look at the device once more (what came in between raised no
/// interrupt), then [`wait_interrupt`](Self::wait_interrupt).
#[derive(Debug)]
pub struct UioDevice {
    node: UioNode,
    path: PathBuf,
    file: File,
}

impl UioDevice {
    /// Opens the node of that name (`linux,uio-name`) on this system, and drops an interrupt that
    /// came before. No register is touched.
    ///
    /// A node whose registers lie in the programmable logic must be opened only once that is
    /// programmed: see [`require_bitstream`](super::require_bitstream).
    ///
    /// # Errors
    /// No such node, no device file, no right to open it, no right to list the nodes: each its own
    /// variant of [`PlatformError`].
    pub fn open(name: &str) -> Result<Self, PlatformError> {
        Self::open_in(&System::default(), name)
    }

    /// The same on a system whose files lie elsewhere.
    ///
    /// # Errors
    /// As [`Self::open`].
    pub fn open_in(system: &System, name: &str) -> Result<Self, PlatformError> {
        Self::of_node(system, node_named(&uio_nodes(&system.uio)?, name)?)
    }

    /// Opens a node that was found.
    pub(crate) fn of_node(system: &System, node: UioNode) -> Result<Self, PlatformError> {
        let path = system.dev.join(&node.device);
        // Without O_NONBLOCK a wake-up that somebody else took would block for ever.
        let file = open_device(&path, nix::libc::O_NONBLOCK)?;
        Ok(Self { node, path, file })
    }

    /// Keeps other programs that ask for it from using the device; until this is dropped.
    ///
    /// # Errors
    /// [`PlatformError::Busy`] if another one does.
    pub fn lock(&self) -> Result<(), PlatformError> {
        match self.file.try_lock() {
            Ok(()) => Ok(()),
            Err(TryLockError::WouldBlock) => Err(PlatformError::Busy { path: self.path.clone() }),
            Err(TryLockError::Error(source)) => Err(self.error("lock", source)),
        }
    }

    /// What the kernel says of it.
    #[must_use]
    pub fn node(&self) -> &UioNode {
        &self.node
    }

    /// Maps the registers of that name.
    ///
    /// # Errors
    /// [`PlatformError::NoMap`], which lists the names that there are; or the kernel refuses.
    pub fn window(&self, map: &str) -> Result<UioWindow, PlatformError> {
        self.map(self.node.map(map)?)
    }

    /// Maps a region.
    pub(crate) fn map(&self, map: &UioMap) -> Result<UioWindow, PlatformError> {
        let name = format!("{:?} of {}", map.name, self.node.device);
        let empty = || PlatformError::ShortRegion { region: name.clone(), expected: 4, found: 0 };
        // The kernel's length counts from the start of the page.
        let bytes = map.bytes.checked_sub(map.offset).filter(|bytes| *bytes >= 4);
        let bytes = bytes.ok_or_else(empty)?;
        let large = |_| PlatformError::TooLarge { region: name.clone(), bytes };
        let mapping = Mapping::new(
            &self.file,
            &self.path,
            u64::from(map.index) * page_bytes(&self.path)?,
            usize::try_from(map.offset).map_err(large)?,
            usize::try_from(bytes).map_err(large)?,
        )?;
        let address = map.address.checked_add(map.offset);
        let address = address.ok_or(PlatformError::TooLarge { region: name.clone(), bytes })?;
        Ok(UioWindow { mapping, name, address })
    }

    /// Waits until the interrupt comes: its count since the device was registered. `None` if
    /// `timeout` passes first. Afterwards it is masked.
    ///
    /// # Errors
    /// [`PlatformError::NoInterrupt`] if the node has none.
    pub fn wait_interrupt(&self, timeout: Duration) -> Result<Option<u32>, PlatformError> {
        let started = Instant::now();
        loop {
            let remaining = timeout.saturating_sub(started.elapsed());
            let readable = wait_readable(&self.file, remaining)
                .map_err(|errno| self.error("wait for", errno.into()))?;
            let mut count = [0; 4];
            match (&self.file).read(&mut count) {
                Ok(4) => return Ok(Some(u32::from_ne_bytes(count))),
                Ok(found) => {
                    let text = format!("expected 4 bytes, found {found}");
                    let source = io::Error::new(io::ErrorKind::UnexpectedEof, text);
                    return Err(self.error("read", source));
                }
                // Somebody else took it, or a signal came.
                Err(error)
                    if matches!(
                        error.kind(),
                        io::ErrorKind::WouldBlock | io::ErrorKind::Interrupted
                    ) =>
                {
                    if !readable || remaining.is_zero() {
                        return Ok(None);
                    }
                }
                Err(error) => return Err(self.error("read", error)),
            }
        }
    }

    /// Lets the next interrupt through.
    ///
    /// # Errors
    /// [`PlatformError::NoInterrupt`] if the node has none.
    pub fn unmask(&self) -> Result<(), PlatformError> {
        self.control(1)
    }

    /// Keeps the interrupt from coming.
    ///
    /// # Errors
    /// [`PlatformError::NoInterrupt`] if the node has none.
    pub fn mask(&self) -> Result<(), PlatformError> {
        self.control(0)
    }

    fn control(&self, enable: u32) -> Result<(), PlatformError> {
        match (&self.file).write(&enable.to_ne_bytes()) {
            Ok(4) => Ok(()),
            Ok(written) => {
                let text = format!("expected to write 4 bytes, wrote {written}");
                Err(self.error("write", io::Error::new(io::ErrorKind::WriteZero, text)))
            }
            Err(error) => Err(self.error("write", error)),
        }
    }

    fn error(&self, act: &'static str, source: io::Error) -> PlatformError {
        // EIO: no interrupt in the device tree; ENOSYS: a driver that cannot mask.
        match source.raw_os_error().map(Errno::from_raw) {
            Some(Errno::EIO | Errno::ENOSYS) => PlatformError::NoInterrupt {
                node: self.node.name.clone(),
                device: self.node.device.clone(),
            },
            _ => PlatformError::File { act, path: self.path.clone(), source },
        }
    }
}

/// Waits until the file is readable, or in error; false if `timeout` passes first.
fn wait_readable(file: &File, timeout: Duration) -> Result<bool, Errno> {
    let started = Instant::now();
    loop {
        let remaining = timeout.saturating_sub(started.elapsed());
        // Rounded up: less than a millisecond would be no wait at all, over and over.
        let milliseconds = remaining.as_micros().div_ceil(1000);
        let slice = u16::try_from(milliseconds).unwrap_or(u16::MAX);
        let mut files = [PollFd::new(file.as_fd(), PollFlags::POLLIN)];
        match poll(&mut files, PollTimeout::from(slice)) {
            Ok(0) | Err(Errno::EINTR) if started.elapsed() >= timeout => return Ok(false),
            Ok(0) | Err(Errno::EINTR) => {}
            Ok(_) => return Ok(true),
            Err(errno) => return Err(errno),
        }
    }
}

/// A mapped region of registers.
///
/// Each access is one aligned 32-bit load or store, in program order with the others of the region.
#[derive(Debug)]
pub struct UioWindow {
    mapping: Mapping,
    name: String,
    address: u64,
}

impl UioWindow {
    /// Physical address of the region.
    #[must_use]
    pub fn address(&self) -> u64 {
        self.address
    }

    /// Length of the region, bytes. The kernel counts in whole pages.
    #[must_use]
    pub fn bytes(&self) -> u64 {
        self.mapping.bytes() as u64
    }

    /// Reads the register at byte `at`.
    ///
    /// # Errors
    /// [`PlatformError::OutOfRegion`] if `at` is not a multiple of 4 inside the region.
    pub fn read32(&self, at: u32) -> Result<u32, PlatformError> {
        Ok(self.mapping.load_word(self.checked(at)?))
    }

    /// Writes the register at byte `at`.
    ///
    /// Memory that was written before is visible to the device before the register is.
    ///
    /// # Errors
    /// [`PlatformError::OutOfRegion`] if `at` is not a multiple of 4 inside the region.
    pub fn write32(&self, at: u32, value: u32) -> Result<(), PlatformError> {
        let at = self.checked(at)?;
        super::release_to_device();
        self.mapping.store_word(at, value);
        Ok(())
    }

    fn checked(&self, at: u32) -> Result<usize, PlatformError> {
        if at.is_multiple_of(4) && u64::from(at) + 4 <= self.bytes() {
            return Ok(at as usize);
        }
        Err(PlatformError::OutOfRegion {
            region: self.name.clone(),
            at: u64::from(at),
            bytes: 4,
            region_bytes: self.bytes(),
        })
    }

    /// The mapping, for callers that check on their own.
    pub(crate) fn into_mapping(self) -> Mapping {
        self.mapping
    }
}

impl From<UioWindow> for Box<dyn RegisterWindow> {
    fn from(window: UioWindow) -> Self {
        Box::new(window.mapping)
    }
}

/// The system's page size; `path` is what it is wanted for.
pub(super) fn page_bytes(path: &Path) -> Result<u64, PlatformError> {
    let bytes = nix::unistd::sysconf(nix::unistd::SysconfVar::PAGE_SIZE);
    let source = match bytes {
        Ok(Some(bytes)) if bytes > 0 => return Ok(bytes.unsigned_abs()),
        Ok(_) => io::Error::new(io::ErrorKind::Unsupported, "the system gives no page size"),
        Err(errno) => errno.into(),
    };
    Err(PlatformError::File { act: "find the page size for", path: path.to_owned(), source })
}

#[cfg(test)]
mod tests {
    use std::fs;
    use std::os::fd::OwnedFd;
    use std::os::unix::net::UnixStream;

    use super::*;
    use crate::platform::uio_fake::{add_node, regions};

    const SHORT: Duration = Duration::from_millis(5);
    const LONG: Duration = Duration::from_secs(30);

    /// A device whose file is one end of a pair of sockets; the other end plays the kernel.
    fn with_interrupt() -> (UioDevice, UnixStream) {
        let (ours, kernel) = UnixStream::pair().expect("a pair");
        ours.set_nonblocking(true).expect("set");
        let node = UioNode { device: "uio0".to_owned(), name: "pgs".to_owned(), maps: Vec::new() };
        let file = File::from(OwnedFd::from(ours));
        (UioDevice { node, path: "/dev/uio0".into(), file }, kernel)
    }

    #[test]
    fn an_interrupt_is_its_count_and_the_next_one_waits() {
        let (device, mut kernel) = with_interrupt();
        assert_eq!(device.wait_interrupt(Duration::ZERO).expect("none yet"), None);
        assert_eq!(device.wait_interrupt(SHORT).expect("none yet"), None);
        // The count jumps: others came while nobody looked.
        for count in [7_u32, 9, u32::MAX] {
            kernel.write_all(&count.to_ne_bytes()).expect("written");
            assert_eq!(device.wait_interrupt(LONG).expect("there is one"), Some(count));
        }
        kernel.write_all(&1_u32.to_ne_bytes()).expect("written");
        assert_eq!(device.wait_interrupt(Duration::ZERO).expect("there is one"), Some(1));
    }

    #[test]
    fn an_interrupt_wakes_a_wait_that_has_begun() {
        let (device, mut kernel) = with_interrupt();
        std::thread::scope(|scope| {
            let waiting = scope.spawn(|| device.wait_interrupt(LONG).expect("it comes"));
            kernel.write_all(&3_u32.to_ne_bytes()).expect("written");
            assert_eq!(waiting.join().expect("no panic"), Some(3));
        });
    }

    #[test]
    fn a_wait_without_an_interrupt_ends_in_time() {
        let (device, _kernel) = with_interrupt();
        let started = Instant::now();
        assert_eq!(device.wait_interrupt(Duration::from_millis(20)).expect("none"), None);
        assert!(started.elapsed() >= Duration::from_millis(20));
    }

    #[test]
    fn one_lets_the_interrupt_through_and_zero_keeps_it() {
        let (device, mut kernel) = with_interrupt();
        device.unmask().expect("written");
        device.mask().expect("written");
        let mut words = [0; 8];
        kernel.read_exact(&mut words).expect("two words");
        assert_eq!(words[..4], 1_u32.to_ne_bytes());
        assert_eq!(words[4..], 0_u32.to_ne_bytes());
    }

    #[test]
    fn a_file_that_gives_no_whole_count_is_an_error() {
        let (device, kernel) = with_interrupt();
        drop(kernel);
        let error = device.wait_interrupt(LONG).expect_err("end of file");
        assert!(matches!(error, PlatformError::File { act: "read", .. }), "{error}");
        device.unmask().expect_err("nobody reads");
    }

    #[test]
    fn what_the_kernel_says_without_an_interrupt_is_named() {
        let (device, _kernel) = with_interrupt();
        for errno in [Errno::EIO, Errno::ENOSYS] {
            let error = device.error("read", errno.into());
            assert!(matches!(error, PlatformError::NoInterrupt { .. }), "{error}");
        }
        let other = device.error("read", Errno::EINVAL.into());
        assert!(matches!(other, PlatformError::File { .. }), "{other}");
    }

    fn system() -> (tempfile::TempDir, System) {
        let root = tempfile::tempdir().expect("a directory");
        let system = System::under(root.path());
        add_node(&system, 3, "pgs", &regions());
        (root, system)
    }

    #[test]
    fn a_window_is_the_map_at_its_number_of_pages() {
        let (_root, system) = system();
        let page = usize::try_from(page_bytes(&system.dev).expect("a size")).expect("fits");
        let path = system.dev.join("uio3");
        let mut file = fs::read(&path).expect("read");
        file[4 * page..4 * page + 4].copy_from_slice(&[0x31, 0x53, 0x47, 0x50]);
        fs::write(&path, &file).expect("written");
        let device = UioDevice::open_in(&system, "pgs").expect("opened");
        let control = device.window("control").expect("mapped");
        assert_eq!((control.address(), control.bytes()), (0xA004_0000, 0x1000));
        assert_eq!(control.read32(0).expect("inside"), 0x5047_5331);
        control.write32(0xFFC, 0x0403_0201).expect("inside");
        let after = fs::read(&path).expect("read");
        assert_eq!(after[4 * page + 0xFFC..4 * page + 0x1000], [1, 2, 3, 4]);
        for at in [2, 0x1000, 0xFFE, u32::MAX - 3] {
            control.read32(at).expect_err("outside, or not aligned");
            let error = control.write32(at, 0).expect_err("outside, or not aligned").to_string();
            assert!(error.contains("\"control\" of uio3"), "{error}");
        }
    }

    #[test]
    fn a_region_that_begins_inside_its_page_ends_with_the_pages() {
        let (_root, system) = system();
        let map = system.uio.join("uio3/maps/map0");
        fs::write(map.join("offset"), "0x40\n").expect("written");
        let device = UioDevice::open_in(&system, "pgs").expect("opened");
        let window = device.window("dma0").expect("mapped");
        assert_eq!((window.address(), window.bytes()), (0xA000_0040, 0xFFC0));
        window.write32(0, 7).expect("inside");
        assert_eq!(fs::read(system.dev.join("uio3")).expect("read")[0x40], 7);
        fs::write(map.join("size"), "0x40\n").expect("written");
        let empty = UioDevice::open_in(&system, "pgs").expect("opened").window("dma0");
        assert!(matches!(empty, Err(PlatformError::ShortRegion { .. })));
    }

    #[test]
    fn each_obstacle_is_an_error_of_its_own() {
        let (_root, system) = system();
        let error = UioDevice::open_in(&system, "pgs2").expect_err("no such node");
        assert!(matches!(error, PlatformError::NoNode { .. }), "{error}");
        let device = UioDevice::open_in(&system, "pgs").expect("opened");
        let error = device.window("dma4").expect_err("no such map");
        assert!(matches!(error, PlatformError::NoMap { .. }), "{error}");
        fs::remove_file(system.dev.join("uio3")).expect("removed");
        let error = UioDevice::open_in(&system, "pgs").expect_err("no file");
        assert!(matches!(error, PlatformError::NoDevice { .. }), "{error}");
    }
}
