//! Opens a UIO node, for one user alone, and waits for its interrupt.
//!
//! The kernel's handler masks the interrupt and counts it. A read of four bytes gives the count
//! since the device was registered; a written 1 unmasks the interrupt. A count that jumps is no
//! error: only the change matters.
//!
//! Source: Linux `Documentation/driver-api/uio-howto.rst`, `drivers/uio/uio_pdrv_genirq.c`.

use std::fs::File;
use std::io::{self, Read as _, Write as _};
use std::os::fd::AsFd as _;
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use nix::errno::Errno;
use nix::poll::{PollFd, PollFlags, PollTimeout, poll};

use super::lock::LockedFile;
use super::sysfs::Attribute;
use super::uio_listing::uio_listing;
use super::uio_window::Claims;
use crate::platform::{PlatformError, Result, System, UioMap, UioNode, UioWindow};

/// An open UIO node.
///
/// The interrupt protocol of a level-triggered device: acknowledge the interrupt in the device,
/// then [`unmask`](Self::unmask), then read the device's status once more (an event in between
/// raised no interrupt), then [`wait_interrupt`](Self::wait_interrupt).
///
/// A driver can be unbound from the node while it is open, for example by removing the overlay. The
/// windows stay mapped, and an access to logic that has lost its clock hangs the processor: each
/// call here then ends with [`PlatformError::Lost`], after which no register may be touched.
#[derive(Debug)]
pub struct UioDevice {
    node: UioNode,
    /// The node's folder in the device tree, if it comes from one.
    tree: PathBuf,
    file: Arc<LockedFile>,
    claims: Claims,
    entry: NodeEntry,
    /// Whether the kernel has shown that the node has an interrupt.
    interrupt: AtomicBool,
}

/// The entry of a UIO node in sysfs, which the kernel removes with the node.
#[derive(Debug)]
pub(crate) struct NodeEntry {
    name: Option<Attribute>,
    text: String,
}

impl NodeEntry {
    /// The entry of a node of the listing.
    pub(crate) fn open(system: &System, node: &UioNode) -> Result<Self> {
        let name = Attribute::open(system.uio.join(&node.device).join("name"))?;
        Ok(Self { name, text: format!("UIO node {:?} ({})", node.name, node.device) })
    }

    /// Makes sure that the node is still there: one system call.
    pub(crate) fn check(&self) -> Result<()> {
        let Some(name) = &self.name else { return Err(self.lost()) };
        let there = name.read(|text| text.is_some_and(|text| !text.is_empty()))?;
        if there { Ok(()) } else { Err(self.lost()) }
    }

    fn lost(&self) -> PlatformError {
        PlatformError::Lost { why: format!("{} went away", self.text) }
    }
}

impl UioDevice {
    /// Opens the node of that name (`linux,uio-name`) on this system. No register is touched.
    ///
    /// It is locked (`flock`) until the device and all of its windows are dropped: meanwhile this
    /// library refuses to open it again, in this program or another.
    ///
    /// A node whose registers lie in the programmable logic must be opened only once that is
    /// programmed: see [`require_bitstream`](crate::platform::require_bitstream).
    ///
    /// # Errors
    /// No such node, no device file, no right to open it, no right to list the nodes, another user
    /// ([`PlatformError::Busy`]): each its own variant of [`PlatformError`].
    pub fn open(name: &str) -> Result<Self, PlatformError> {
        Self::open_in(&System::default(), name)
    }

    /// The same on a system whose files lie elsewhere.
    ///
    /// # Errors
    /// As [`Self::open`].
    pub fn open_in(system: &System, name: &str) -> Result<Self, PlatformError> {
        Self::of_node(system, uio_listing(&system.uio)?.node(name)?)
    }

    /// Opens a node of the listing.
    pub(crate) fn of_node(system: &System, node: UioNode) -> Result<Self> {
        // Without O_NONBLOCK the read would block for ever if another reader takes the interrupt
        // after `poll`.
        let file = LockedFile::open(&system.dev.join(&node.device), nix::libc::O_NONBLOCK)?;
        let tree = system.uio.join(&node.device).join("device/of_node");
        let entry = NodeEntry::open(system, &node)?;
        let (file, claims) = (Arc::new(file), Claims::default());
        Ok(Self { node, tree, file, claims, entry, interrupt: AtomicBool::new(false) })
    }

    /// Makes sure that the kernel has not taken the node away. A node that has shown an interrupt
    /// is asked by [`unmask`](Self::unmask), another one by its entry in sysfs.
    ///
    /// # Errors
    /// [`PlatformError::Lost`] if it has.
    pub fn check(&self) -> Result<(), PlatformError> {
        if self.interrupt.load(Ordering::Relaxed) {
            match self.unmask() {
                // Its driver cannot mask.
                Err(PlatformError::NoInterrupt { .. }) => {}
                asked => return asked,
            }
        }
        self.entry.check()
    }

    /// The kernel's description of the node.
    #[must_use]
    pub fn node(&self) -> &UioNode {
        &self.node
    }

    /// Maps the registers of that name.
    ///
    /// # Errors
    /// [`PlatformError::NoMap`], which lists the names of all regions;
    /// [`PlatformError::MappedAlready`] while another window of the map exists; or the kernel
    /// refuses.
    pub fn window(&self, map: &str) -> Result<UioWindow, PlatformError> {
        self.map(self.node.map(map)?)
    }

    /// Maps a region.
    pub(crate) fn map(&self, map: &UioMap) -> Result<UioWindow> {
        UioWindow::new(&self.file, &self.node, map, &self.tree, &self.claims)
    }

    /// Waits for the interrupt and returns its count since the device was registered; `None` if
    /// `timeout` passes first. The interrupt is masked afterwards.
    ///
    /// # Errors
    /// [`PlatformError::NoInterrupt`] if the node has none, [`PlatformError::Lost`] if it went
    /// away.
    pub fn wait_interrupt(&self, timeout: Duration) -> Result<Option<u32>, PlatformError> {
        let started = Instant::now();
        loop {
            let remaining = timeout.saturating_sub(started.elapsed());
            let readable = wait_readable(self.file.file(), remaining)
                .map_err(|errno| self.failed("wait for", errno.into()))?;
            let mut count = [0; 4];
            match self.file.file().read(&mut count) {
                Ok(4) => {
                    self.interrupt.store(true, Ordering::Relaxed);
                    return Ok(Some(u32::from_ne_bytes(count)));
                }
                Ok(found) => {
                    let text = format!("expected 4 bytes, found {found}");
                    let source = io::Error::new(io::ErrorKind::UnexpectedEof, text);
                    return Err(self.failed("read", source));
                }
                // Another reader took the interrupt, or a signal came.
                Err(error)
                    if matches!(
                        error.kind(),
                        io::ErrorKind::WouldBlock | io::ErrorKind::Interrupted
                    ) =>
                {
                    self.interrupt.store(true, Ordering::Relaxed);
                    if !readable || remaining.is_zero() {
                        return Ok(None);
                    }
                }
                Err(error) => return Err(self.refused("read", error)),
            }
        }
    }

    /// Lets the next interrupt through.
    ///
    /// # Errors
    /// As [`wait_interrupt`](Self::wait_interrupt).
    pub fn unmask(&self) -> Result<(), PlatformError> {
        self.control(1)
    }

    /// Keeps the interrupt from coming.
    ///
    /// # Errors
    /// As [`wait_interrupt`](Self::wait_interrupt).
    pub fn mask(&self) -> Result<(), PlatformError> {
        self.control(0)
    }

    fn control(&self, enable: u32) -> Result<()> {
        match self.file.file().write(&enable.to_ne_bytes()) {
            Ok(4) => {
                self.interrupt.store(true, Ordering::Relaxed);
                Ok(())
            }
            Ok(written) => {
                let text = format!("expected to write 4 bytes, wrote {written}");
                Err(self.failed("write", io::Error::new(io::ErrorKind::WriteZero, text)))
            }
            Err(error) => Err(self.refused("write", error)),
        }
    }

    /// The meaning of the kernel's refusal. Without a driver behind the node a read gives EIO and a
    /// write EINVAL; without an interrupt in the device tree both give EIO.
    fn refused(&self, act: &'static str, source: io::Error) -> PlatformError {
        let errno = source.raw_os_error().map(Errno::from_raw);
        let unbound = matches!(errno, Some(Errno::EIO | Errno::EINVAL));
        if unbound && (self.interrupt.load(Ordering::Relaxed) || self.entry.check().is_err()) {
            return self.entry.lost();
        }
        match errno {
            // ENOSYS: a driver that cannot mask.
            Some(Errno::EIO | Errno::ENOSYS) => PlatformError::NoInterrupt {
                node: self.node.name.clone(),
                device: self.node.device.clone(),
            },
            _ => self.failed(act, source),
        }
    }

    fn failed(&self, act: &'static str, source: io::Error) -> PlatformError {
        PlatformError::File { act, path: self.file.path().to_owned(), source }
    }
}

/// Waits until the file is readable, or in error; false if `timeout` passes first.
fn wait_readable(file: &File, timeout: Duration) -> Result<bool, Errno> {
    let started = Instant::now();
    loop {
        let remaining = timeout.saturating_sub(started.elapsed());
        // Rounded up: less than a millisecond would poll without a wait, over and over.
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

#[cfg(test)]
pub(crate) mod fake {
    //! Other files in place of a node's device file.

    use std::os::fd::OwnedFd;
    use std::os::unix::net::UnixStream;

    use super::*;

    /// Reads and writes end with EIO, as of a node without an interrupt, or without a driver.
    pub(crate) const EIO: &str = "/proc/thread-self/mem";
    /// Writes end with EINVAL, as of a node without a driver.
    pub(crate) const EINVAL: &str = "/proc/thread-self/oom_score_adj";

    /// Puts one end of a pair of sockets in its place. The other end plays the kernel.
    pub(crate) fn give_interrupt(device: &mut UioDevice) -> UnixStream {
        let (ours, kernel) = UnixStream::pair().expect("a pair");
        ours.set_nonblocking(true).expect("set");
        let file = File::from(OwnedFd::from(ours));
        device.file =
            Arc::new(LockedFile::of_file(file, "/dev/uio3".as_ref()).expect("nobody else has it"));
        kernel
    }

    /// Puts a file that refuses in its place.
    pub(crate) fn refuse(device: &mut UioDevice, file: &str) {
        let until = Instant::now() + Duration::from_secs(10);
        // Each thread has its own; a program that another test starts may have an earlier lock.
        device.file = loop {
            match LockedFile::open(file.as_ref(), 0) {
                Ok(file) => break Arc::new(file),
                Err(error) => assert!(Instant::now() < until, "{error}"),
            }
            std::thread::yield_now();
        };
    }
}

#[cfg(test)]
mod tests {
    use std::fs;
    use std::os::unix::net::UnixStream;

    use super::fake::{EINVAL, EIO, give_interrupt, refuse};
    use super::*;
    use crate::platform::uio_fake::accelerator;

    const SHORT: Duration = Duration::from_millis(5);
    const LONG: Duration = Duration::from_secs(30);

    /// A node that the kernel keeps, whatever becomes of its files.
    fn device() -> UioDevice {
        let (_root, system) = accelerator();
        UioDevice::open_in(&system, "pgs").expect("opened")
    }

    fn with_interrupt() -> (UioDevice, UnixStream) {
        let mut device = device();
        let kernel = give_interrupt(&mut device);
        (device, kernel)
    }

    #[test]
    fn an_interrupt_is_its_count_and_the_next_one_waits() {
        let (device, mut kernel) = with_interrupt();
        assert_eq!(device.wait_interrupt(Duration::ZERO).expect("none yet"), None);
        assert_eq!(device.wait_interrupt(SHORT).expect("none yet"), None);
        // The count jumps if several interrupts come between two reads.
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
    fn a_node_that_never_had_an_interrupt_goes_on_without() {
        let mut device = device();
        refuse(&mut device, EIO);
        for _ in 0..2 {
            for error in [device.unmask().err(), device.wait_interrupt(SHORT).err()] {
                assert!(matches!(error, Some(PlatformError::NoInterrupt { .. })), "{error:?}");
            }
            device.check().expect("its entry is there");
        }
        // A driver that cannot mask.
        let error = device.refused("write", Errno::ENOSYS.into());
        assert!(matches!(error, PlatformError::NoInterrupt { .. }), "{error}");
        let error = device.refused("write", Errno::EINVAL.into());
        assert!(matches!(error, PlatformError::File { .. }), "{error}");
    }

    #[test]
    fn a_node_that_had_an_interrupt_and_refuses_is_lost() {
        type Act = fn(&UioDevice) -> Option<PlatformError>;
        let acts: [(&str, Act); 4] = [
            (EIO, |device| device.wait_interrupt(LONG).err()),
            (EIO, |device| device.unmask().err()),
            (EINVAL, |device| device.mask().err()),
            (EINVAL, |device| device.check().err()),
        ];
        for (file, act) in acts {
            let (mut device, mut kernel) = with_interrupt();
            device.check().expect("the kernel has not said that it has one");
            assert_eq!(device.wait_interrupt(Duration::ZERO).expect("none yet"), None);
            device.check().expect("it is there");
            kernel.read_exact(&mut [0; 4]).expect("asked by the second check");
            refuse(&mut device, file);
            let error = act(&device).expect("it refuses");
            assert!(matches!(error, PlatformError::Lost { .. }), "{error}");
            assert!(error.to_string().contains("UIO node \"pgs\" (uio3) went away"), "{error}");
        }
    }

    #[test]
    fn a_first_answer_of_a_node_that_is_gone_is_no_lack_of_an_interrupt() {
        let (_root, system) = accelerator();
        let mut device = UioDevice::open_in(&system, "pgs").expect("opened");
        refuse(&mut device, EIO);
        fs::write(system.uio.join("uio3/name"), "").expect("emptied");
        for error in [device.wait_interrupt(LONG).err(), device.check().err()] {
            assert!(matches!(error, Some(PlatformError::Lost { .. })), "{error:?}");
        }
    }

    #[test]
    fn each_obstacle_is_an_error_of_its_own() {
        let (_root, system) = accelerator();
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
