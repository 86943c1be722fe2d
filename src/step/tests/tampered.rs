//! Places a fault injector between the driver and the emulated board. Tests change register values,
//! descriptor words, beats and interrupts, and read the driver's register writes.

use std::collections::BTreeMap;
use std::fmt;
use std::sync::atomic::{AtomicU32, Ordering};
use std::sync::{Arc, Mutex, MutexGuard};
use std::time::Duration;

use bitstream_model::{BoardConfig, EmulatedBoard};
use pgs_interface::descriptor::{STATUS, WORDS};
use pgs_interface::record::Beat;

use super::open_on;
use crate::platform::{
    Access, DmaMemory, DmaMemorySource, EmulatedPlatform, Platform, PlatformError, RegisterMap,
    RegisterWindow, SharedMemory,
};
use crate::{Accelerator, Cancellation};

/// The number of the control block among the regions.
pub(crate) const CONTROL_BLOCK: usize = 4;
/// The number that stands for memory among the regions.
pub(crate) const MEMORY: usize = 5;

/// The number of a region.
pub(crate) fn number(map: RegisterMap) -> usize {
    match map {
        RegisterMap::Dma(core) => core,
        RegisterMap::Control => CONTROL_BLOCK,
    }
}

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
    /// The number of the wait for an interrupt in which the caller cancels; 0 for no wait.
    pub(crate) cancel_at: u32,
    pub(crate) cancellation: Cancellation,
    /// Changes the beats of the next buffer that the device reads, or has written.
    pub(crate) spoil: Option<(Access, Spoil)>,
    /// Every register write: region and offset. An allocation of memory, or its hand-over, counts
    /// as a write to [`MEMORY`].
    pub(crate) writes: Vec<(usize, u32)>,
    /// Whether the kernel has taken the logic away.
    pub(crate) unplugged: bool,
    /// The number of the wait for an interrupt at whose end the kernel does so; 0 for no wait.
    pub(crate) unplug_after: u32,
}

/// Changes the beats of a buffer.
type Spoil = fn(&mut [Beat]);

impl Wires {
    fn spoil(&mut self, memory: &mut DmaMemory, access: Access) {
        if let Some((_, spoil)) = self.spoil.take_if(|(wanted, _)| *wanted == access) {
            spoil(memory.beats_mut());
        }
    }
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
        let (tampered, accelerator) = Self::on(&board);
        (board, tampered, accelerator)
    }

    /// Opens this board.
    pub(crate) fn on(board: &EmulatedBoard) -> (Arc<Self>, Accelerator) {
        let inner = EmulatedPlatform::new(board.cpu_port());
        let tampered = Arc::new(Self { inner, wires: Arc::default() });
        let accelerator = open_on(Arc::clone(&tampered) as _);
        (tampered, accelerator)
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
        lock(&self.wires).writes.push((self.region, at));
        self.inner.write32(at, value);
    }
}

impl DmaMemorySource for Tampered {
    fn name(&self) -> &str {
        "tampered"
    }

    fn allocate(&self, beats: usize) -> Result<(u64, DmaMemory), PlatformError> {
        self.wires().writes.push((MEMORY, 0));
        self.inner.allocate(beats)
    }

    fn allocate_shared(&self, words: usize) -> Result<(u64, SharedMemory), PlatformError> {
        let (address, memory) = self.inner.allocate_shared(words)?;
        let mut wires = self.wires();
        wires.writes.push((MEMORY, 0));
        if let SharedMemory::Heap(words) = &memory {
            wires.shared.push(Arc::clone(words));
        }
        Ok((address, memory))
    }

    fn hand_over(
        &self,
        address: u64,
        mut memory: DmaMemory,
        used: usize,
        access: Access,
    ) -> Result<(), PlatformError> {
        if access == Access::Read {
            self.wires().spoil(&mut memory, access);
        }
        self.wires().writes.push((MEMORY, 0));
        self.inner.hand_over(address, memory, used, access)
    }

    fn take_back(&self, address: u64) -> Result<DmaMemory, PlatformError> {
        let mut memory = self.inner.take_back(address)?;
        self.wires().spoil(&mut memory, Access::Write);
        Ok(memory)
    }

    fn release(&self, address: u64) -> Result<(), PlatformError> {
        self.wires().released.push(address);
        self.inner.release(address)
    }
}

impl Platform for Tampered {
    fn window(&self, map: RegisterMap) -> Result<Box<dyn RegisterWindow>, PlatformError> {
        let (inner, wires) = (self.inner.window(map)?, Arc::clone(&self.wires));
        Ok(Box::new(Wired { inner, region: number(map), wires }))
    }

    fn memory(&self) -> &dyn DmaMemorySource {
        self
    }

    fn now(&self) -> Duration {
        self.inner.pause(self.wires().clock_read);
        self.inner.now()
    }

    fn pause(&self, duration: Duration) {
        self.inner.pause(duration);
    }

    fn wait_interrupt(&self, timeout: Duration) -> Result<Option<u32>, PlatformError> {
        self.check_present()?;
        let wait_limit = {
            let mut wires = self.wires();
            if wires.cancel_at == 1 {
                wires.cancellation.cancel();
            }
            wires.cancel_at = wires.cancel_at.saturating_sub(1);
            wires.wait_limit
        };
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
        wires.unplugged |= wires.unplug_after == 1;
        wires.unplug_after = wires.unplug_after.saturating_sub(1);
        if let Some(mut hook) = wires.after_wait.take() {
            hook(&Descriptors(&wires.shared));
            wires.after_wait = Some(hook);
        }
        woke
    }

    fn unmask_interrupt(&self) -> Result<(), PlatformError> {
        self.check_present()?;
        self.wires().masked = false;
        self.inner.unmask_interrupt()
    }

    fn lost(&self) -> Option<PlatformError> {
        let why = "the logic went away".to_owned();
        self.wires().unplugged.then_some(PlatformError::Lost { why })
    }
}
