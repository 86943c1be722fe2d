//! The emulated board with a fault injector between it and the driver. Tests change register
//! values, register writes, descriptor words and interrupts.

use std::collections::BTreeMap;
use std::fmt;
use std::sync::atomic::{AtomicU32, Ordering};
use std::sync::{Arc, Mutex, MutexGuard};
use std::time::Duration;

use bitstream_model::{BoardConfig, EmulatedBoard};
use pgs_interface::descriptor::{STATUS, WORDS};

use crate::Accelerator;
use crate::board::open::{BoardDescription, BoardKind, Found};
use crate::platform::{
    Access, DmaMemory, EmulatedPlatform, Platform, PlatformError, RegisterWindow, SharedMemory,
};

/// The number of the control block among the regions.
pub(crate) const CONTROL: usize = 4;

/// The change to a register's value when it is read.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Tamper {
    /// These bits read 1.
    Set(u32),
    /// These bits read 0.
    Clear(u32),
    /// The register reads this value.
    Value(u32),
    /// These bits read 0 the next time.
    ClearOnce(u32),
}

/// Changes the descriptors at the end of each wait for the interrupt.
type Hook = Box<dyn FnMut(&Descriptors<'_>) + Send>;

/// The state of the fault injector.
#[derive(Default)]
pub(crate) struct Wires {
    pub(crate) reads: BTreeMap<(usize, u32), Tamper>,
    pub(crate) after_wait: Option<Hook>,
    shared: Vec<Arc<[AtomicU32]>>,
    /// Addresses of memory that was freed.
    pub(crate) released: Vec<u64>,
    /// Interrupts without a source that are still to come, each after the driver unmasks the one
    /// before.
    pub(crate) storm: u32,
    masked: bool,
    /// The time that a read of the clock takes.
    pub(crate) clock_read: Duration,
    /// The longest wait for the interrupt; it then ends without one.
    pub(crate) wait_limit: Option<Duration>,
}

/// The rings of descriptors, in the order in which the driver makes them: MM2S and S2MM of each
/// core.
pub(crate) struct Descriptors<'a>(&'a [Arc<[AtomicU32]>]);

impl Descriptors<'_> {
    /// Changes the status word of a descriptor of one ring.
    pub(crate) fn change(&self, ring: usize, index: usize, change: impl Fn(u32) -> u32) {
        let word = &self.0[ring][index * WORDS + STATUS];
        word.store(change(word.load(Ordering::Relaxed)), Ordering::Relaxed);
    }
}

/// The emulated board behind the fault injector.
pub(crate) struct Tampered {
    inner: EmulatedPlatform,
    wires: Arc<Mutex<Wires>>,
}

impl fmt::Debug for Tampered {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Tampered").finish_non_exhaustive()
    }
}

fn lock(wires: &Mutex<Wires>) -> MutexGuard<'_, Wires> {
    wires.lock().expect("no test panics with the lock")
}

impl Tampered {
    /// Opens a default board.
    pub(crate) fn open() -> (EmulatedBoard, Arc<Self>, Accelerator) {
        let board = EmulatedBoard::new(BoardConfig::default()).expect("a board that can be built");
        let inner = EmulatedPlatform::new(board.cpu_port());
        let tampered = Arc::new(Self { inner, wires: Arc::default() });
        let description = BoardDescription {
            kind: BoardKind::Emulated,
            name: "tampered".to_owned(),
            reason: "a test".to_owned(),
        };
        let platform: Arc<dyn Platform> = Arc::clone(&tampered) as _;
        let mut accelerator =
            Accelerator::on(Found { platform, description }, None).expect("a board that opens");
        accelerator
            .set_shapes(&[crate::Shape::STATIC, crate::Shape::isotropic(1.0, 0.4)])
            .expect("shapes that fit");
        (board, tampered, accelerator)
    }

    pub(crate) fn wires(&self) -> MutexGuard<'_, Wires> {
        lock(&self.wires)
    }

    /// Changes a register of a region from now on.
    pub(crate) fn tamper(&self, region: usize, at: u32, with: Tamper) {
        self.wires().reads.insert((region, at), with);
    }

    /// Runs `hook` on the descriptors after every wait.
    pub(crate) fn after_wait(&self, hook: impl FnMut(&Descriptors<'_>) + Send + 'static) {
        self.wires().after_wait = Some(Box::new(hook));
    }

    /// Ends all changes.
    pub(crate) fn restore(&self) {
        let mut wires = self.wires();
        wires.reads.clear();
        wires.after_wait = None;
    }

    fn window(&self, inner: Box<dyn RegisterWindow>, region: usize) -> Box<dyn RegisterWindow> {
        Box::new(Wired { inner, region, wires: Arc::clone(&self.wires) })
    }
}

/// A register region behind the fault injector.
struct Wired {
    inner: Box<dyn RegisterWindow>,
    region: usize,
    wires: Arc<Mutex<Wires>>,
}

impl fmt::Debug for Wired {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Wired").field("region", &self.region).finish_non_exhaustive()
    }
}

impl RegisterWindow for Wired {
    fn bytes(&self) -> u64 {
        self.inner.bytes()
    }

    fn read32(&self, at: u32) -> u32 {
        let value = self.inner.read32(at);
        let mut wires = lock(&self.wires);
        match wires.reads.get(&(self.region, at)).copied() {
            None => value,
            Some(Tamper::Set(bits)) => value | bits,
            Some(Tamper::Clear(bits)) => value & !bits,
            Some(Tamper::Value(other)) => other,
            Some(Tamper::ClearOnce(bits)) => {
                wires.reads.remove(&(self.region, at));
                value & !bits
            }
        }
    }

    fn write32(&self, at: u32, value: u32) {
        self.inner.write32(at, value);
    }
}

impl Platform for Tampered {
    fn dma_window(&self, core: usize) -> Result<Box<dyn RegisterWindow>, PlatformError> {
        Ok(self.window(self.inner.dma_window(core)?, core))
    }

    fn control_window(&self) -> Result<Box<dyn RegisterWindow>, PlatformError> {
        Ok(self.window(self.inner.control_window()?, CONTROL))
    }

    fn allocate(&self, beats: usize) -> Result<(u64, DmaMemory), PlatformError> {
        self.inner.allocate(beats)
    }

    fn allocate_shared(&self, words: usize) -> Result<(u64, SharedMemory), PlatformError> {
        let (address, memory) = self.inner.allocate_shared(words)?;
        if let SharedMemory::Heap(words) = &memory {
            self.wires().shared.push(Arc::clone(words));
        }
        Ok((address, memory))
    }

    fn hand_over(
        &self,
        address: u64,
        memory: DmaMemory,
        used: usize,
        access: Access,
    ) -> Result<(), PlatformError> {
        self.inner.hand_over(address, memory, used, access)
    }

    fn take_back(&self, address: u64) -> Result<DmaMemory, PlatformError> {
        self.inner.take_back(address)
    }

    fn release(&self, address: u64) -> Result<(), PlatformError> {
        self.wires().released.push(address);
        self.inner.release(address)
    }

    fn now(&self) -> Duration {
        self.inner.pause(self.wires().clock_read);
        self.inner.now()
    }

    fn pause(&self, duration: Duration) {
        self.inner.pause(duration);
    }

    fn wait_interrupt(&self, timeout: Duration) -> Result<Option<u32>, PlatformError> {
        let wait_limit = self.wires().wait_limit;
        if let Some(wait_limit) = wait_limit {
            self.inner.pause(wait_limit.min(timeout));
            return Ok(None);
        }
        let (masked, stormy) = {
            let mut wires = self.wires();
            let (masked, stormy) = (wires.masked, wires.storm > 0);
            if stormy && !masked {
                wires.storm -= 1;
                wires.masked = true;
            }
            (masked, stormy)
        };
        let woke = match (masked, stormy) {
            (true, _) => {
                self.inner.pause(timeout);
                Ok(None)
            }
            (false, true) => Ok(Some(1)),
            (false, false) => self.inner.wait_interrupt(timeout),
        };
        let mut wires = self.wires();
        if let Some(mut hook) = wires.after_wait.take() {
            hook(&Descriptors(&wires.shared));
            wires.after_wait = Some(hook);
        }
        woke
    }

    fn unmask_interrupt(&self) -> Result<(), PlatformError> {
        self.wires().masked = false;
        self.inner.unmask_interrupt()
    }
}
