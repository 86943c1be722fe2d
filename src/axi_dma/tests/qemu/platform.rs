//! The platform over QEMU's machine: its registers, memory, interrupt and cable.
//!
//! Memory that both sides may touch is coherent at every register access: before one, what the
//! driver stored is put into the machine's memory; after one, what the engine stored is taken from
//! there.
//!
//! One difference between QEMU's model and PG021 is levelled here instead of in the driver: a reset
//! of one direction resets the other, too.

use std::collections::{BTreeMap, BTreeSet};
use std::net::UdpSocket;
use std::sync::atomic::{AtomicU32, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use pgs_interface::axi_dma::{DMACR, S2MM_OFFSET, dmacr};
use pgs_interface::record::{BEAT_BYTES, Beat};

use super::machine::Machine;
use crate::platform::{
    Access, DmaMemory, DmaMemorySource, Platform, PlatformError, RegisterMap, RegisterWindow,
    SharedMemory,
};

/// Where the machine's parts lie.
const RAM: u64 = 0x5000_0000;
const RAM_BYTES: u64 = 256 << 20;
const DMA: u64 = 0x8460_0000;
const ETHERNET: u64 = 0x8278_0000;
const INTERRUPTS: u64 = 0x8180_0000;
/// The processor, behind the interrupt controller.
const PROCESSOR: &str = "/machine/unattached/device[0]";

/// Registers of the AXI interrupt controller (PG099): enabled inputs, acknowledge, master enable.
const IER: u64 = 0x08;
const IAR: u64 = 0x0C;
const MER: u64 = 0x1C;
/// The inputs of the DMA's two directions.
const DMA_INPUTS: u32 = 0b11;

/// Registers of the AXI Ethernet (PG138), each with its bit: receiver on, transmitter on, every
/// destination accepted.
const ETHERNET_ON: [(u64, u32); 3] = [(0x404, 1 << 28), (0x408, 1 << 28), (0x708, 1 << 31)];

/// QEMU's machine as a board.
#[derive(Debug)]
pub(crate) struct QtestPlatform {
    board: Arc<Mutex<Board>>,
    cable: UdpSocket,
    started: Instant,
}

#[derive(Debug)]
struct Board {
    machine: Machine,
    next: u64,
    allocated: BTreeSet<u64>,
    with_device: BTreeMap<u64, (DmaMemory, Access)>,
    shared: BTreeMap<u64, Shared>,
    interrupts: u32,
}

/// Words that both sides may touch, and what the machine's memory held at the last access.
#[derive(Debug)]
struct Shared {
    words: Arc<[AtomicU32]>,
    there: Vec<u32>,
}

impl QtestPlatform {
    /// A machine with its Ethernet on; `None` if QEMU is not installed.
    pub(crate) fn start() -> Option<Self> {
        let (mut machine, cable) = Machine::start()?;
        machine.watch_interrupt(PROCESSOR);
        machine.write32(INTERRUPTS + IER, DMA_INPUTS);
        machine.write32(INTERRUPTS + MER, 0b11);
        for (register, bit) in ETHERNET_ON {
            machine.write32(ETHERNET + register, bit);
        }
        let board = Board {
            machine,
            // Not the first byte of the memory: an address that was lost would be found there.
            next: RAM + 0x1000,
            allocated: BTreeSet::new(),
            with_device: BTreeMap::new(),
            shared: BTreeMap::new(),
            interrupts: 0,
        };
        Some(Self { board: Arc::new(Mutex::new(board)), cable, started: Instant::now() })
    }

    fn board(&self) -> MutexGuard<'_, Board> {
        lock(&self.board)
    }

    /// The next frame that the machine sends.
    pub(crate) fn receive_frame(&self) -> Vec<u8> {
        let mut frame = vec![0; 0x1_0000];
        let bytes = self.cable.recv(&mut frame).expect("a frame in time");
        frame.truncate(bytes);
        frame
    }

    /// Sends the machine a frame.
    pub(crate) fn send_frame(&self, frame: &[u8]) {
        assert_eq!(self.cable.send(frame).expect("the machine listens"), frame.len());
    }

    /// Whether the interrupt line is raised.
    pub(crate) fn interrupt(&self) -> bool {
        self.board().machine.interrupt()
    }

    /// A word of the machine's memory.
    pub(crate) fn word(&self, address: u64) -> u32 {
        self.board().machine.read32(address)
    }
}

/// A test that failed while it held the lock has said what matters.
fn lock(board: &Mutex<Board>) -> MutexGuard<'_, Board> {
    board.lock().unwrap_or_else(PoisonError::into_inner)
}

impl Board {
    fn allocate(&mut self, bytes: u64) -> u64 {
        let address = self.next;
        self.next += bytes.max(1).next_multiple_of(64);
        assert!(self.next <= RAM + RAM_BYTES, "the machine's memory is enough for a test");
        self.allocated.insert(address);
        address
    }

    /// Puts what the driver stored into the machine's memory.
    fn publish(&mut self) {
        for (address, shared) in &mut self.shared {
            for (index, (word, there)) in shared.words.iter().zip(&mut shared.there).enumerate() {
                let value = word.load(Ordering::Relaxed);
                if value != *there {
                    self.machine.write32(address + 4 * index as u64, value);
                    *there = value;
                }
            }
        }
    }

    /// Takes what the engine stored from the machine's memory.
    fn fetch(&mut self) {
        for (address, shared) in &mut self.shared {
            let bytes = self.machine.read(*address, 4 * shared.there.len());
            let (words, _) = bytes.as_chunks::<4>();
            for ((here, there), now) in shared.words.iter().zip(&mut shared.there).zip(words) {
                let now = u32::from_le_bytes(*now);
                if now != *there {
                    here.store(now, Ordering::Relaxed);
                    *there = now;
                }
            }
        }
    }
}

/// The registers of the DMA.
#[derive(Debug)]
struct DmaWindow(Arc<Mutex<Board>>);

impl RegisterWindow for DmaWindow {
    fn bytes(&self) -> u64 {
        u64::from(2 * S2MM_OFFSET)
    }

    fn read32(&self, at: u32) -> u32 {
        let mut board = lock(&self.0);
        board.publish();
        let value = board.machine.read32(DMA + u64::from(at));
        board.fetch();
        value
    }

    fn write32(&self, at: u32, value: u32) {
        let mut board = lock(&self.0);
        board.publish();
        board.machine.write32(DMA + u64::from(at), value);
        if at % S2MM_OFFSET == DMACR.offset && dmacr::RESET.is_set(value) {
            let other = S2MM_OFFSET - at;
            board.machine.write32(DMA + u64::from(other), value);
        }
        board.fetch();
    }
}

impl DmaMemorySource for QtestPlatform {
    fn name(&self) -> &str {
        "qtestplatform"
    }

    fn allocate(&self, beats: usize) -> Result<(u64, DmaMemory), PlatformError> {
        let address = self.board().allocate((beats * BEAT_BYTES) as u64);
        Ok((address, DmaMemory::Heap(vec![Beat::default(); beats].into())))
    }

    fn allocate_shared(&self, words: usize) -> Result<(u64, SharedMemory), PlatformError> {
        let mut board = self.board();
        let address = board.allocate(4 * words as u64);
        let here: Arc<[AtomicU32]> = (0..words).map(|_| AtomicU32::new(0)).collect();
        // The machine's memory is all zero at first, and no part of it is given twice.
        let shared = Shared { words: Arc::clone(&here), there: vec![0; words] };
        board.shared.insert(address, shared);
        Ok((address, SharedMemory::Heap(here)))
    }

    fn hand_over(
        &self,
        address: u64,
        memory: DmaMemory,
        used: usize,
        access: Access,
    ) -> Result<(), PlatformError> {
        let mut board = self.board();
        assert!(board.allocated.contains(&address), "{address:#x} was allocated");
        if access == Access::Read {
            let words = memory.beats()[..used].iter().flat_map(|beat| beat.0);
            let bytes: Vec<u8> = words.flat_map(u32::to_le_bytes).collect();
            board.machine.write(address, &bytes);
        }
        board.with_device.insert(address, (memory, access));
        Ok(())
    }

    fn take_back(&self, address: u64) -> Result<DmaMemory, PlatformError> {
        let mut board = self.board();
        let (mut memory, access) = board.with_device.remove(&address).expect("handed over before");
        if access == Access::Write {
            let bytes = board.machine.read(address, memory.beats().len() * BEAT_BYTES);
            let (words, _) = bytes.as_chunks::<4>();
            let here = memory.beats_mut().iter_mut().flat_map(|beat| &mut beat.0);
            for (word, now) in here.zip(words) {
                *word = u32::from_le_bytes(*now);
            }
        }
        Ok(memory)
    }

    fn release(&self, address: u64) -> Result<(), PlatformError> {
        let mut board = self.board();
        board.shared.remove(&address);
        assert!(board.allocated.remove(&address), "{address:#x} was allocated");
        Ok(())
    }
}

impl Platform for QtestPlatform {
    fn window(&self, map: RegisterMap) -> Result<Box<dyn RegisterWindow>, PlatformError> {
        assert_eq!(map, RegisterMap::Dma(0), "the machine has one AXI DMA");
        Ok(Box::new(DmaWindow(Arc::clone(&self.board))))
    }

    fn memory(&self) -> &dyn DmaMemorySource {
        self
    }

    fn now(&self) -> Duration {
        self.started.elapsed()
    }

    fn pause(&self, duration: Duration) {
        std::thread::sleep(duration);
    }

    fn wait_interrupt(&self, timeout: Duration) -> Result<Option<u32>, PlatformError> {
        let mut board = self.board();
        if !board.machine.wait_interrupt(timeout) {
            return Ok(None);
        }
        board.machine.write32(INTERRUPTS + IER, 0);
        board.interrupts += 1;
        Ok(Some(board.interrupts))
    }

    fn unmask_interrupt(&self) -> Result<(), PlatformError> {
        let mut board = self.board();
        // The pending input is acknowledged first; an input that is still high is raised again at
        // once.
        board.machine.write32(INTERRUPTS + IAR, DMA_INPUTS);
        board.machine.write32(INTERRUPTS + IER, DMA_INPUTS);
        Ok(())
    }
}
