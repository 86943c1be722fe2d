//! Makes every register access a checked, counted and logged access of 32 bits.

use std::fmt;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use super::access_log::{AccessKind, AccessLog, RegisterAccess};
use super::map::{Decoded, RegisterMap};
use crate::platform::{Platform, PlatformError, Result};

/// One register region of a board: aligned 32-bit accesses inside `bytes`.
pub(crate) trait RegisterWindow: fmt::Debug + Send + Sync {
    /// Length of the region, bytes.
    fn bytes(&self) -> u64;
    /// One read; `at` is a multiple of 4 inside the region.
    fn read32(&self, at: u32) -> u32;
    /// One write; `at` is a multiple of 4 inside the region.
    fn write32(&self, at: u32, value: u32);
}

/// Register accesses of a board, all regions together: their number, and the last ones.
#[derive(Debug, Default)]
pub(crate) struct AccessCounts {
    reads: AtomicU64,
    writes: AtomicU64,
    last: AccessLog,
}

impl AccessCounts {
    /// Reads so far.
    pub(crate) fn reads(&self) -> u64 {
        self.reads.load(Ordering::Relaxed)
    }

    /// Writes so far.
    pub(crate) fn writes(&self) -> u64 {
        self.writes.load(Ordering::Relaxed)
    }

    /// The last accesses, oldest first.
    pub(crate) fn recent(&self) -> Vec<RegisterAccess> {
        self.last.recent()
    }
}

/// A register region with its checks, its counts and its log.
#[derive(Debug)]
pub(crate) struct Window {
    registers: Box<dyn RegisterWindow>,
    map: RegisterMap,
    counts: Arc<AccessCounts>,
}

impl Window {
    /// Refuses a region that is shorter than the registers in it.
    fn new(
        registers: Box<dyn RegisterWindow>,
        map: RegisterMap,
        counts: Arc<AccessCounts>,
    ) -> Result<Self> {
        if registers.bytes() < u64::from(map.bytes()) {
            return Err(PlatformError::ShortRegion {
                region: map.to_string(),
                expected: map.bytes(),
                found: registers.bytes(),
            });
        }
        Ok(Self { registers, map, counts })
    }

    /// Opens a region of a board.
    pub(crate) fn open(
        platform: &dyn Platform,
        map: RegisterMap,
        counts: &Arc<AccessCounts>,
    ) -> Result<Self> {
        Self::new(platform.window(map)?, map, Arc::clone(counts))
    }

    fn check(&self, at: u32) {
        assert!(
            at.is_multiple_of(4) && at < self.map.bytes(),
            "offsets come from the register rows, and new() made sure that they lie inside"
        );
    }

    /// One register read.
    pub(crate) fn read32(&self, at: u32) -> u32 {
        self.check(at);
        let value = self.registers.read32(at);
        self.counts.reads.fetch_add(1, Ordering::Relaxed);
        self.counts.last.note(self.map, AccessKind::Read, at, value);
        log::trace!("{}", Decoded { map: self.map, at, arrow: "->", value });
        value
    }

    /// One register write.
    pub(crate) fn write32(&self, at: u32, value: u32) {
        self.check(at);
        log::trace!("{}", Decoded { map: self.map, at, arrow: "<-", value });
        self.counts.writes.fetch_add(1, Ordering::Relaxed);
        self.counts.last.note(self.map, AccessKind::Write, at, value);
        self.registers.write32(at, value);
    }
}

#[cfg(test)]
pub(crate) mod fake {
    //! A board of plain memory, for tests of the code above the platform.

    use std::collections::BTreeMap;
    use std::sync::{Arc, Mutex, PoisonError};
    use std::time::Duration;

    use super::*;
    use crate::platform::{Access, DmaMemory, DmaMemorySource, SharedMemory};
    use std::sync::atomic::AtomicU32;

    /// Registers that keep what is written, with a script for reads: a queue of values per offset.
    #[derive(Debug, Default, Clone)]
    pub(crate) struct FakeRegisters(pub(crate) Arc<Mutex<FakeState>>);

    #[derive(Debug, Default)]
    pub(crate) struct FakeState {
        pub(crate) values: BTreeMap<u32, u32>,
        pub(crate) scripted: BTreeMap<u32, Vec<u32>>,
        pub(crate) writes: Vec<(u32, u32)>,
        /// The bits that a write changes, for offsets where it does not change all.
        pub(crate) kept_bits: BTreeMap<u32, u32>,
    }

    impl FakeRegisters {
        pub(crate) fn with<T>(&self, act: impl FnOnce(&mut FakeState) -> T) -> T {
            act(&mut self.0.lock().unwrap_or_else(PoisonError::into_inner))
        }

        pub(crate) fn window(&self, map: RegisterMap) -> Window {
            Window::new(Box::new(self.clone()), map, Arc::default()).expect("long enough")
        }
    }

    impl RegisterWindow for FakeRegisters {
        fn bytes(&self) -> u64 {
            0x1_0000
        }

        fn read32(&self, at: u32) -> u32 {
            self.with(|state| {
                if let Some(queue) = state.scripted.get_mut(&at).filter(|queue| !queue.is_empty()) {
                    return queue.remove(0);
                }
                state.values.get(&at).copied().unwrap_or(0)
            })
        }

        fn write32(&self, at: u32, value: u32) {
            self.with(|state| {
                state.writes.push((at, value));
                let kept = value & state.kept_bits.get(&at).copied().unwrap_or(u32::MAX);
                state.values.insert(at, kept);
            });
        }
    }

    /// A platform with a clock that only `pause` moves, and memory that goes nowhere.
    #[derive(Debug, Default)]
    pub(crate) struct FakePlatform {
        pub(crate) time: Mutex<Duration>,
        pub(crate) device: Mutex<BTreeMap<u64, DmaMemory>>,
        pub(crate) next: AtomicU64,
        pub(crate) released: Mutex<Vec<u64>>,
    }

    impl FakePlatform {
        fn address(&self, bytes: usize) -> u64 {
            0x8_0000_0000
                + self.next.fetch_add(bytes.next_multiple_of(64) as u64, Ordering::Relaxed)
        }
    }

    impl DmaMemorySource for FakePlatform {
        fn name(&self) -> &str {
            "fake"
        }

        fn allocate(&self, beats: usize) -> Result<(u64, DmaMemory)> {
            let memory = DmaMemory::Heap(vec![Default::default(); beats].into());
            Ok((self.address(beats * 16), memory))
        }

        fn allocate_shared(&self, words: usize) -> Result<(u64, SharedMemory)> {
            let memory = (0..words).map(|_| AtomicU32::new(0)).collect();
            Ok((self.address(words * 4), SharedMemory::Heap(memory)))
        }

        fn hand_over(&self, at: u64, memory: DmaMemory, _: usize, _: Access) -> Result<()> {
            self.device.lock().expect("no test panics with the lock").insert(at, memory);
            Ok(())
        }

        fn take_back(&self, address: u64) -> Result<DmaMemory> {
            let mut device = self.device.lock().expect("no test panics with the lock");
            Ok(device.remove(&address).expect("handed over before"))
        }

        fn release(&self, address: u64) -> Result<()> {
            self.released.lock().expect("no test panics with the lock").push(address);
            Ok(())
        }
    }

    impl Platform for FakePlatform {
        fn window(&self, _: RegisterMap) -> Result<Box<dyn RegisterWindow>> {
            Ok(Box::new(FakeRegisters::default()))
        }

        fn memory(&self) -> &dyn DmaMemorySource {
            self
        }

        fn now(&self) -> Duration {
            *self.time.lock().expect("no test panics with the lock")
        }

        fn pause(&self, duration: Duration) {
            *self.time.lock().expect("no test panics with the lock") += duration;
        }

        fn wait_interrupt(&self, timeout: Duration) -> Result<Option<u32>> {
            self.pause(timeout);
            Ok(None)
        }

        fn unmask_interrupt(&self) -> Result<()> {
            Ok(())
        }
    }
}

#[cfg(test)]
mod tests {
    use super::fake::FakeRegisters;
    use super::*;

    fn shown(map: RegisterMap, at: u32, value: u32) -> String {
        Decoded { map, at, arrow: "->", value }.to_string()
    }

    #[test]
    fn an_access_is_logged_with_register_and_set_fields() {
        assert_eq!(
            shown(RegisterMap::Dma(2), 0x34, 0x0001_1002),
            "dma2 S2MM DMASR -> 0x00011002 Idle IOC_Irq IRQThresholdSts=1"
        );
        assert_eq!(shown(RegisterMap::Dma(0), 0x10, 0x40), "dma0 MM2S TAILDESC -> 0x00000040");
        assert_eq!(
            shown(RegisterMap::Control, 0, 6),
            "control AP_CTRL -> 0x00000006 ap_done ap_idle"
        );
        assert_eq!(shown(RegisterMap::Control, 0x404, 1), "control 0x404 -> 0x00000001");
    }

    #[test]
    fn every_access_is_counted_across_windows() {
        let counts = Arc::<AccessCounts>::default();
        let window = |map| {
            Window::new(Box::new(FakeRegisters::default()), map, Arc::clone(&counts))
                .expect("long enough")
        };
        let (dma, control) = (window(RegisterMap::Dma(0)), window(RegisterMap::Control));
        dma.write32(0x10, 5);
        assert_eq!(dma.read32(0x10), 5);
        control.read32(0);
        assert_eq!((counts.reads(), counts.writes()), (2, 1));
    }

    #[test]
    fn a_region_shorter_than_its_registers_is_refused() {
        #[derive(Debug)]
        struct Short;
        impl RegisterWindow for Short {
            fn bytes(&self) -> u64 {
                0x800
            }
            fn read32(&self, _: u32) -> u32 {
                0
            }
            fn write32(&self, _: u32, _: u32) {}
        }
        let refused = Window::new(Box::new(Short), RegisterMap::Control, Arc::default());
        assert!(matches!(refused, Err(PlatformError::ShortRegion { found: 0x800, .. })));
        assert!(Window::new(Box::new(Short), RegisterMap::Dma(1), Arc::default()).is_ok());
    }

    #[test]
    #[should_panic(expected = "offsets come from the register rows")]
    fn an_unaligned_access_is_a_broken_invariant() {
        FakeRegisters::default().window(RegisterMap::Control).read32(2);
    }
}
