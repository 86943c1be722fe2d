//! A descriptor that is wrong by one beat, planted under the driver: the board's checker finds it.
//!
//! That no step of the driver itself is found at fault is held against random steps elsewhere
//! (`tools/fuzz`, target `confinement`). This is the proof that it would be.

use std::sync::atomic::{AtomicU32, Ordering};
use std::sync::{Arc, Mutex};
use std::time::Duration;

use bitstream_model::interface::axi_dma::{S2MM_OFFSET, TAILDESC};
use bitstream_model::interface::descriptor::{BUFFER, BYTES, CONTROL, WORDS, control};
use bitstream_model::interface::record::BEAT_BYTES;
use bitstream_model::{BoardConfig, Denied, Direction, EmulatedBoard, ViolationKind};

use super::board::{BoardDescription, BoardKind, Found};
use super::tests::scene;
use crate::platform::{
    Access, DmaMemory, EmulatedPlatform, Platform, PlatformError, RegisterWindow, SharedMemory,
};
use crate::{Accelerator, Shape, StepParameters};

/// What is wrong with the last descriptor of one channel, by one beat.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Plant {
    /// Nothing.
    Nothing,
    /// Its length.
    Length(usize, Direction),
    /// Its buffer's address.
    Address(usize, Direction),
}

type Rings = Arc<Mutex<Vec<(u64, Arc<[AtomicU32]>)>>>;

/// The emulated board, and somebody who changes descriptors just before the doorbell.
#[derive(Debug)]
struct Tampered {
    board: EmulatedPlatform,
    rings: Rings,
    plant: Plant,
}

#[derive(Debug)]
struct Doorbells {
    window: Box<dyn RegisterWindow>,
    core: usize,
    rings: Rings,
    plant: Plant,
}

impl RegisterWindow for Doorbells {
    fn bytes(&self) -> u64 {
        self.window.bytes()
    }

    fn read32(&self, at: u32) -> u32 {
        self.window.read32(at)
    }

    fn write32(&self, at: u32, value: u32) {
        let plant = self.plant;
        let beat = u32::try_from(BEAT_BYTES).expect("a few bytes");
        let mine = |core, direction| {
            let half = if direction == Direction::Mm2s { 0 } else { S2MM_OFFSET };
            core == self.core && at == half + TAILDESC.offset
        };
        match plant {
            Plant::Length(core, direction) if mine(core, direction) => {
                assert!(control::LENGTH.of(self.word(value, CONTROL)) > 0, "a descriptor");
                self.add(value, CONTROL, beat);
            }
            Plant::Address(core, direction) if mine(core, direction) => {
                self.add(value, BUFFER, beat);
            }
            _ => {}
        }
        self.window.write32(at, value);
    }
}

impl Doorbells {
    /// A word of the descriptor whose address has those low bits.
    fn with<T>(&self, tail: u32, word: usize, act: impl Fn(&AtomicU32) -> T) -> T {
        let rings = self.rings.lock().expect("unpoisoned");
        let found = rings.iter().find_map(|(address, words)| {
            let offset = u64::from(tail).checked_sub(address & 0xFFFF_FFFF)?;
            let slot = usize::try_from(offset).ok()? / BYTES;
            words.get(slot * WORDS + word)
        });
        act(found.expect("the tail is a descriptor of a ring"))
    }

    fn word(&self, tail: u32, word: usize) -> u32 {
        self.with(tail, word, |word| word.load(Ordering::Relaxed))
    }

    fn add(&self, tail: u32, word: usize, value: u32) {
        self.with(tail, word, |word| word.fetch_add(value, Ordering::Relaxed));
    }
}

impl Platform for Tampered {
    fn dma_window(&self, core: usize) -> Result<Box<dyn RegisterWindow>, PlatformError> {
        let window = self.board.dma_window(core)?;
        let (rings, plant) = (Arc::clone(&self.rings), self.plant);
        Ok(Box::new(Doorbells { window, core, rings, plant }))
    }

    fn control_window(&self) -> Result<Box<dyn RegisterWindow>, PlatformError> {
        self.board.control_window()
    }

    fn allocate(&self, beats: usize) -> Result<(u64, DmaMemory), PlatformError> {
        self.board.allocate(beats)
    }

    fn allocate_shared(&self, words: usize) -> Result<(u64, SharedMemory), PlatformError> {
        let (address, memory) = self.board.allocate_shared(words)?;
        if let SharedMemory::Heap(words) = &memory {
            self.rings.lock().expect("unpoisoned").push((address, Arc::clone(words)));
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
        self.board.hand_over(address, memory, used, access)
    }

    fn take_back(&self, address: u64) -> Result<DmaMemory, PlatformError> {
        self.board.take_back(address)
    }

    fn release(&self, address: u64) -> Result<(), PlatformError> {
        self.board.release(address)
    }

    fn now(&self) -> Duration {
        self.board.now()
    }

    fn pause(&self, duration: Duration) {
        self.board.pause(duration);
    }

    fn wait_interrupt(&self, timeout: Duration) -> Result<Option<u32>, PlatformError> {
        self.board.wait_interrupt(timeout)
    }

    fn unmask_interrupt(&self) -> Result<(), PlatformError> {
        self.board.unmask_interrupt()
    }
}

/// What the board finds in a step with that planted.
fn found(plant: Plant) -> Vec<ViolationKind> {
    // It goes on, so that every violation is seen.
    let config = BoardConfig { strict: false, ..BoardConfig::default() };
    let board = EmulatedBoard::new(config).expect("a board that can be built");
    let platform =
        Tampered { board: EmulatedPlatform::new(board.cpu_port()), rings: Rings::default(), plant };
    let description = BoardDescription {
        kind: BoardKind::Emulated,
        name: "tampered".to_owned(),
        reason: "a test".to_owned(),
    };
    let found = Found { platform: Arc::new(platform), description };
    let mut accelerator = Accelerator::on(found, None).expect("it opens");
    accelerator.set_shapes(&[Shape::STATIC, Shape::isotropic(1.0, 1.5)]).expect("set");
    let (mut bodies, collisions) = scene(20);
    let ended = accelerator.step(&mut bodies, &collisions, &StepParameters::default());
    assert_eq!(ended.is_ok(), plant == Plant::Nothing, "{plant:?}: {ended:?}");
    board.violations().into_iter().map(|violation| violation.kind).collect()
}

#[test]
fn a_length_or_an_address_that_is_off_by_one_beat_is_found_on_every_channel() {
    assert_eq!(found(Plant::Nothing), []);
    for core in 0..4 {
        for plant in [
            Plant::Length(core, Direction::Mm2s),
            Plant::Address(core, Direction::Mm2s),
            Plant::Address(core, Direction::S2mm),
        ] {
            let violations = found(plant);
            let expected = |kind: &ViolationKind| matches!(kind, ViolationKind::OutsideGrant { core: at, denied: Denied::PastEnd, .. } if *at == core);
            assert!(violations.iter().any(expected), "{plant:?}: {violations:?}");
        }
    }
}
