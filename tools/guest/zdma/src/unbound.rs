//! Unbinds the kernel's driver from UIO nodes that are open, as the removal of an overlay does.

use std::path::Path;
use std::time::{Duration, Instant};
use std::{fs, io, thread};

use zynq_pgs::interface::address_map::{UIO_MEMORY_NODE, UIO_NODE};
use zynq_pgs::platform::{PlatformError, UIO_CLASS, UioDevice};

use crate::Outcome;

const DRIVER: &str = "/sys/bus/platform/drivers/uio_pdrv_genirq";
/// Far more than the kernel needs to end a wait.
const LIMIT: Duration = Duration::from_secs(60);

/// A device on the platform bus, whose driver is bound again at the end.
struct Bound(String);

impl Bound {
    fn of(device: &UioDevice) -> io::Result<Self> {
        let link = fs::read_link(Path::new(UIO_CLASS).join(&device.node().device).join("device"))?;
        Ok(Self(link.file_name().unwrap_or_default().to_string_lossy().into_owned()))
    }

    fn unbind(&self) -> io::Result<()> {
        fs::write(format!("{DRIVER}/unbind"), &self.0)
    }
}

impl Drop for Bound {
    fn drop(&mut self) {
        // Bound still, if a check has failed before.
        let _ = fs::write(format!("{DRIVER}/bind"), &self.0);
    }
}

fn expect_lost<T: std::fmt::Debug>(
    what: &str,
    found: Result<T, PlatformError>,
) -> Result<(), String> {
    match found {
        Err(PlatformError::Lost { .. }) => Ok(()),
        other => Err(format!("{what}: expected it to be lost, found {other:?}")),
    }
}

/// A node with an interrupt: a wait ends at once, and every later call says that the node is lost.
pub(crate) fn with_interrupt() -> Outcome {
    let device = UioDevice::open(UIO_NODE)?;
    let bound = Bound::of(&device)?;
    device.wait_interrupt(Duration::ZERO)?;
    device.check()?;
    let begin = Instant::now();
    let waited = thread::scope(|scope| {
        let waiting = scope.spawn(|| device.wait_interrupt(LIMIT));
        let unbound = bound.unbind();
        waiting.join().map(|waited| unbound.map(|()| waited)).map_err(|_| "it panicked")
    })??;
    let took = begin.elapsed();
    expect_lost("the wait", waited)?;
    if took >= LIMIT {
        return Err(format!("the wait ended after {took:?} only").into());
    }
    expect_lost("another wait", device.wait_interrupt(LIMIT))?;
    expect_lost("unmasking", device.unmask())?;
    expect_lost("the question", device.check())?;
    Ok(format!("the wait ended after {took:?}"))
}

/// A node without an interrupt is lost once its entry in sysfs is gone, also if another one comes
/// in its place.
pub(crate) fn without_interrupt() -> Outcome {
    let device = UioDevice::open(UIO_MEMORY_NODE)?;
    let bound = Bound::of(&device)?;
    match device.unmask() {
        Err(PlatformError::NoInterrupt { .. }) => {}
        other => return Err(format!("expected no interrupt, found {other:?}").into()),
    }
    device.check()?;
    bound.unbind()?;
    expect_lost("the question", device.check())?;
    expect_lost("unmasking", device.unmask())?;
    drop(bound);
    let again = UioDevice::open(UIO_MEMORY_NODE)?;
    again.check()?;
    expect_lost("the question, with a new node", device.check())?;
    let (old, new) = (&device.node().device, &again.node().device);
    Ok(format!("{old} is lost, and {new} of the same name is another node"))
}
