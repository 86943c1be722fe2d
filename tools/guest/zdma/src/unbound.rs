//! Unbinds the kernel's driver from UIO nodes that are open, as the removal of an overlay does.

use std::fs::{self, File};
use std::io::{self, Read as _, Write as _};
use std::os::fd::AsFd as _;
use std::os::unix::fs::FileExt as _;
use std::path::Path;
use std::time::{Duration, Instant};

use nix::poll::{PollFd, PollFlags, PollTimeout, poll};
use zynq_pgs::interface::address_map::{UIO_CONTROL_MAP, UIO_MEMORY_NODE, UIO_NODE};
use zynq_pgs::platform::PlatformError;
use zynq_pgs::platform::{UIO_CLASS, UioDevice};

use crate::Outcome;

const DRIVER: &str = "/sys/bus/platform/drivers/uio_pdrv_genirq";
/// Far more than the kernel needs to end a wait.
const LIMIT: Duration = Duration::from_secs(60);

/// A UIO node whose driver is bound again at the end.
struct Bound {
    /// Its device on the platform bus.
    name: String,
    /// The device file and the name in sysfs, open past the driver's own.
    file: File,
    entry: File,
}

impl Bound {
    fn of(device: &UioDevice) -> io::Result<Self> {
        let node = Path::new(UIO_CLASS).join(&device.node().device);
        let link = fs::read_link(node.join("device"))?;
        let name = link.file_name().unwrap_or_default().to_string_lossy().into_owned();
        let path = Path::new("/dev").join(&device.node().device);
        let file = File::options().read(true).write(true).open(path)?;
        Ok(Self { name, file, entry: File::open(node.join("name"))? })
    }

    fn unbind(&self) -> io::Result<()> {
        fs::write(format!("{DRIVER}/unbind"), &self.name)
    }

    /// The kernel's answers to read, write and poll of the device file, and to a read of the name.
    fn answers(&mut self) -> [String; 4] {
        let text = |result: io::Result<usize>| match result {
            Ok(bytes) => format!("{bytes} bytes"),
            Err(error) => error.raw_os_error().map_or(error.to_string(), |errno| {
                format!("errno {errno} ({})", nix::errno::Errno::from_raw(errno))
            }),
        };
        let mut files = [PollFd::new(self.file.as_fd(), PollFlags::POLLIN)];
        let polled = poll(&mut files, PollTimeout::ZERO);
        let events = format!("{polled:?} {:?}", files[0].revents());
        let written = text(self.file.write(&1_u32.to_ne_bytes()));
        let read = match polled {
            Ok(0) => "would wait".to_owned(),
            _ => text(self.file.read(&mut [0; 4])),
        };
        [read, written, events, text(self.entry.read_at(&mut [0; 64], 0))]
    }
}

impl Drop for Bound {
    fn drop(&mut self) {
        // Bound still, if a check has failed before.
        let _ = fs::write(format!("{DRIVER}/bind"), &self.name);
    }
}

fn told([read, write, poll, name]: [String; 4]) -> String {
    format!("read {read}, write {write}, poll {poll}, name {name}")
}

fn expect_lost(what: &str, found: Result<(), PlatformError>) -> Result<(), String> {
    match found {
        Err(PlatformError::Lost { .. }) => Ok(()),
        other => Err(format!("{what}: expected it to be lost, found {other:?}")),
    }
}

/// A node with an interrupt: a wait ends at once, and every later call says that the node is lost.
pub(crate) fn with_interrupt() -> Outcome {
    let device = UioDevice::open(UIO_NODE)?;
    let window = device.window(UIO_CONTROL_MAP)?;
    let mut bound = Bound::of(&device)?;
    device.wait_interrupt(Duration::ZERO)?;
    device.check()?;
    println!("  bound: {}", told(bound.answers()));
    let (waited, took) = std::thread::scope(|scope| {
        let waiting = scope.spawn(|| {
            let begin = Instant::now();
            (device.wait_interrupt(LIMIT).map(|_| ()), begin.elapsed())
        });
        let unbound = bound.unbind();
        waiting.join().map(|waited| unbound.map(|()| waited)).map_err(|_| "it panicked")
    })??;
    println!("  unbound: {}", told(bound.answers()));
    expect_lost("the wait", waited)?;
    if took >= LIMIT {
        return Err(format!("the wait ended after {took:?} only").into());
    }
    expect_lost("another wait", device.wait_interrupt(LIMIT).map(|_| ()))?;
    expect_lost("unmasking", device.unmask())?;
    expect_lost("the question", device.check())?;
    // The danger: an access would still reach them.
    let bytes = window.bytes();
    Ok(format!("the wait ended after {took:?}; {bytes} bytes of registers are mapped still"))
}

/// A node without an interrupt is lost once its entry in sysfs is gone, also if another one comes
/// in its place.
pub(crate) fn without_interrupt() -> Outcome {
    let device = UioDevice::open(UIO_MEMORY_NODE)?;
    let mut bound = Bound::of(&device)?;
    match device.unmask() {
        Err(PlatformError::NoInterrupt { .. }) => {}
        other => return Err(format!("expected no interrupt, found {other:?}").into()),
    }
    device.check()?;
    println!("  bound: {}", told(bound.answers()));
    bound.unbind()?;
    println!("  unbound: {}", told(bound.answers()));
    expect_lost("the question", device.check())?;
    expect_lost("unmasking", device.unmask())?;
    drop(bound);
    let again = UioDevice::open(UIO_MEMORY_NODE)?;
    again.check()?;
    expect_lost("the question, with a new node", device.check())?;
    let (old, new) = (&device.node().device, &again.node().device);
    Ok(format!("{old} is lost, and {new} of the same name is another node"))
}
