//! Tests whole steps whose buffers lie in the memory of a real board, as far as files can stand for
//! one.
//!
//! The emulated board supplies the registers, the descriptors and the engines. Between it and the
//! driver lie the pool, the region and the mapping of a real board: the emulated engines read from
//! the file behind the mapping, and write to it.

use std::collections::BTreeMap;
use std::fs::File;
use std::os::unix::fs::FileExt as _;
use std::sync::{Arc, Mutex};
use std::time::Duration;

use bitstream_model::{BoardConfig, EmulatedBoard};
use pgs_interface::record::Beat;

use super::{bits, found, open_on, scene, undisturbed};

use crate::check::check_found;
use crate::check::{CheckLine, Outcome};
use crate::error::Aftermath;
use crate::platform::{
    Access, Caching, DmaMemory, DmaMemorySource, EmulatedPlatform, HardwarePlatform, ManagerChoice,
    MemoryChoice, Platform, PlatformError, RegisterChoice, RegisterMap, RegisterWindow,
    SharedMemory, uio_fake,
};
use crate::{Accelerator, Error, Fault, InputError, StepParameters};

const BASE: u64 = 0x6000_0000;
const BYTES: u64 = 1 << 20;

/// A buffer: its address in the real board's memory, its length, and the device's access to it.
#[derive(Debug, Clone, Copy)]
struct Piece {
    real: u64,
    beats: usize,
    access: Access,
}

/// An emulated board with the memory of a real one.
#[derive(Debug)]
struct Composed {
    engines: EmulatedPlatform,
    real: HardwarePlatform,
    /// The device's view of the real memory.
    physical: File,
    pieces: Mutex<BTreeMap<u64, Piece>>,
    /// The emulated board's own buffers while the CPU has the real ones.
    twins: Mutex<BTreeMap<u64, DmaMemory>>,
    _root: tempfile::TempDir,
}

impl Composed {
    fn new(board: &EmulatedBoard, choice: &MemoryChoice) -> Self {
        let (root, system) = uio_fake::empty_system();
        uio_fake::add_node(&system, 0, "pgs", &uio_fake::regions());
        let file = match choice {
            MemoryChoice::UDmaBuf { name, .. } => {
                let attribute = |file: &str, text: &str| {
                    uio_fake::write(system.u_dma_buf.join(name).join(file), text);
                };
                attribute("phys_addr", &format!("{BASE:#x}"));
                attribute("size", &BYTES.to_string());
                attribute("sync_mode", "2");
                attribute("sync_for_device", "");
                attribute("sync_for_cpu", "");
                uio_fake::write(system.dev.join(name), "");
                system.dev.join(name)
            }
            _ => {
                uio_fake::add_node(&system, 1, "pgs-memory", &[("memory", BASE, BYTES)]);
                system.dev.join("uio1")
            }
        };
        let physical = File::options().read(true).write(true).open(&file).expect("opened");
        physical.set_len(BYTES).expect("resized");
        let registers = RegisterChoice::Uio("pgs".to_owned());
        let real = HardwarePlatform::open(&system, registers, choice, &ManagerChoice::Automatic)
            .expect("opened");
        let engines = EmulatedPlatform::new(board.cpu_port());
        let (pieces, twins) = Default::default();
        Self { engines, real, physical, pieces, twins, _root: root }
    }

    fn piece(&self, address: u64) -> Piece {
        self.pieces.lock().expect("unpoisoned")[&address]
    }

    fn twin(&self, address: u64) -> DmaMemory {
        self.twins.lock().expect("unpoisoned").remove(&address).expect("with the CPU")
    }
}

impl DmaMemorySource for Composed {
    fn name(&self) -> &str {
        "composed"
    }

    fn allocate(&self, beats: usize) -> Result<(u64, DmaMemory), PlatformError> {
        let (real, memory) = self.real.memory().allocate(beats)?;
        let (address, twin) = self.engines.allocate(beats)?;
        let piece = Piece { real, beats, access: Access::Read };
        self.pieces.lock().expect("unpoisoned").insert(address, piece);
        self.twins.lock().expect("unpoisoned").insert(address, twin);
        Ok((address, memory))
    }

    fn allocate_shared(&self, words: usize) -> Result<(u64, SharedMemory), PlatformError> {
        self.engines.allocate_shared(words)
    }

    fn hand_over(
        &self,
        address: u64,
        memory: DmaMemory,
        used: usize,
        access: Access,
    ) -> Result<(), PlatformError> {
        let piece = self.piece(address);
        self.real.memory().hand_over(piece.real, memory, used, access)?;
        let mut twin = self.twin(address);
        for (index, beat) in twin.beats_mut()[..piece.beats].iter_mut().enumerate() {
            let mut bytes = [0; 16];
            let at = piece.real - BASE + 16 * index as u64;
            self.physical.read_exact_at(&mut bytes, at).expect("inside");
            *beat = bytemuck::cast(bytes);
        }
        let piece = Piece { access, ..piece };
        self.pieces.lock().expect("unpoisoned").insert(address, piece);
        self.engines.hand_over(address, twin, used, access)
    }

    fn take_back(&self, address: u64) -> Result<DmaMemory, PlatformError> {
        let piece = self.piece(address);
        let twin = self.engines.take_back(address)?;
        if piece.access == Access::Write {
            for (index, beat) in twin.beats().iter().enumerate() {
                let bytes: [u8; 16] = bytemuck::cast::<Beat, _>(*beat);
                let at = piece.real - BASE + 16 * index as u64;
                self.physical.write_all_at(&bytes, at).expect("inside");
            }
        }
        self.twins.lock().expect("unpoisoned").insert(address, twin);
        self.real.memory().take_back(piece.real)
    }

    fn release(&self, address: u64) -> Result<(), PlatformError> {
        let piece = self.pieces.lock().expect("unpoisoned").remove(&address);
        if let Some(piece) = piece {
            drop(self.twin(address));
            self.real.memory().release(piece.real)?;
        }
        self.engines.release(address)
    }
}

impl Platform for Composed {
    fn window(&self, map: RegisterMap) -> Result<Box<dyn RegisterWindow>, PlatformError> {
        self.engines.window(map)
    }

    fn memory(&self) -> &dyn DmaMemorySource {
        self
    }

    fn now(&self) -> Duration {
        self.engines.now()
    }

    fn pause(&self, duration: Duration) {
        self.engines.pause(duration);
    }

    fn wait_interrupt(&self, timeout: Duration) -> Result<Option<u32>, PlatformError> {
        self.engines.wait_interrupt(timeout)
    }

    fn unmask_interrupt(&self) -> Result<(), PlatformError> {
        self.engines.unmask_interrupt()
    }
}

#[test]
fn steps_through_the_memory_of_a_real_board_give_the_same_bits() {
    for choice in choices() {
        let board = EmulatedBoard::new(BoardConfig::default()).expect("a board that can be built");
        let platform = Arc::new(Composed::new(&board, &choice));
        let mut accelerator = open_on(Arc::clone(&platform) as _);
        // Buffers grow, are used in part, and are replaced.
        for cubes in [3, 40, 2, 90, 7] {
            let (mut bodies, collisions) = scene(cubes);
            accelerator
                .step(&mut bodies, &collisions, &StepParameters::default())
                .unwrap_or_else(|error| panic!("{choice:?}: {error}"));
            assert_eq!(bits(&bodies), undisturbed(cubes), "{choice:?}, {cubes} cubes");
        }
        drop(accelerator);
        assert_eq!(board.violations(), []);
        // The pool has all its memory back, in one piece.
        let whole = usize::try_from(BYTES / 16).expect("fits");
        platform.real.memory().allocate(whole).expect("all of it is free");
    }
}

fn u_dma_buf(caching: Caching) -> MemoryChoice {
    MemoryChoice::UDmaBuf { name: "pgs".to_owned(), caching }
}

fn choices() -> [MemoryChoice; 3] {
    let uio = MemoryChoice::Uio { node: "pgs-memory".to_owned() };
    [uio, u_dma_buf(Caching::Cached), u_dma_buf(Caching::WriteCombining)]
}

#[test]
fn the_self_test_passes_through_the_memory_of_a_real_board_and_says_when_it_is_too_small() {
    for choice in choices() {
        let board = EmulatedBoard::new(BoardConfig::default()).expect("a board that can be built");
        let platform = Arc::new(Composed::new(&board, &choice));
        let report = check_found(found(Arc::clone(&platform) as _), None).expect("reachable");
        // A board without a fence has none to prove.
        let passed = |line: &CheckLine| matches!(line.outcome, Outcome::Ok { .. });
        let all = report.lines.iter().all(|line| passed(line) || line.name == "fence");
        assert!(all, "{choice:?}: {report:#?}");
        assert_eq!(board.violations(), []);
        let whole = usize::try_from(BYTES / 16).expect("fits");
        platform.real.memory().allocate(whole).expect("all of it came back");
        // The pool is empty now.
        let report = check_found(found(Arc::clone(&platform) as _), None).expect("reachable");
        let echo = report.lines.iter().find(|line| line.name == "echo").expect("it");
        assert!(
            matches!(&echo.outcome, Outcome::Failed { found, next, .. }
                if found.contains("no room for a DMA buffer") && next.contains("memory for DMA")),
            "{echo:?}"
        );
    }
}

#[test]
fn memory_that_is_too_small_is_an_error_and_a_smaller_step_still_works() {
    let board = EmulatedBoard::new(BoardConfig::default()).expect("a board that can be built");
    let choice = MemoryChoice::Uio { node: "pgs-memory".to_owned() };
    let platform = Arc::new(Composed::new(&board, &choice));
    // The rest of the memory takes three cubes.
    platform
        .real
        .memory()
        .allocate(usize::try_from((BYTES - 8192) / 16).expect("fits"))
        .expect("room");
    let mut accelerator = open_on(Arc::clone(&platform) as _);
    let mut step = |cubes| {
        let (mut bodies, collisions) = scene(cubes);
        let result = accelerator.step(&mut bodies, &collisions, &StepParameters::default());
        (result.map(drop), bits(&bodies))
    };
    let (result, after) = step(500);
    let error = result.expect_err("no room");
    let Error::Step { fault, aftermath: Aftermath::Untouched, .. } = &error else {
        panic!("{error}")
    };
    assert!(
        matches!(**fault, Fault::NoMemory(PlatformError::Exhausted { total: BYTES, .. })),
        "{fault}"
    );
    assert_eq!(after, bits(&scene(500).0));
    let (result, after) = step(3);
    result.expect("there is room");
    assert_eq!(after, undisturbed(3));
}

#[test]
fn steps_prepared_through_the_memory_of_a_real_board_give_the_same_bits() {
    for choice in [
        MemoryChoice::Uio { node: "pgs-memory".to_owned() },
        u_dma_buf(Caching::Cached),
        u_dma_buf(Caching::WriteCombining),
    ] {
        let (board, platform, mut accelerator) = composed(&choice, 0);
        let sizes = [3, 40, 2, 90, 7, 7];
        let (bodies, collisions) = scene(sizes[0]);
        let parameters = StepParameters::default();
        let mut flight = accelerator.submit(&bodies, &collisions, &parameters).expect("starts");
        for (place, now) in sizes.into_iter().enumerate() {
            let next = sizes.get(place + 1).copied().unwrap_or(11);
            let (bodies, collisions) = scene(next);
            let prepared =
                flight.prepare(&bodies, &collisions, &parameters).expect("there is room");
            let (mut bodies, _) = scene(now);
            let (ended, started) = flight.wait_and_start(&mut bodies, &prepared);
            ended.unwrap_or_else(|error| panic!("{choice:?}: {error}"));
            assert_eq!(bits(&bodies), undisturbed(now), "{choice:?}, {now} cubes before {next}");
            flight = started.expect("starts");
        }
        // One step in flight, and one in the other bank.
        drop(flight.prepare(&bodies, &collisions, &parameters).expect("there is room"));
        drop(flight);
        drop(accelerator);
        assert_eq!(board.violations(), []);
        let whole = usize::try_from(BYTES / 16).expect("fits");
        platform.real.memory().allocate(whole).expect("all of it came back");
    }
}

#[test]
fn memory_for_one_bank_takes_steps_that_are_not_prepared() {
    // The memory takes one step of 40 cubes, and not two.
    let choice = MemoryChoice::Uio { node: "pgs-memory".to_owned() };
    let (board, _platform, mut accelerator) = composed(&choice, BYTES - 16_384);
    let parameters = StepParameters::default();
    let (mut bodies, collisions) = scene(40);
    for _ in 0..2 {
        let mut flight = accelerator.submit(&bodies, &collisions, &parameters).expect("starts");
        let error = flight.prepare(&bodies, &collisions, &parameters).expect_err("no room");
        let Error::Step { fault, aftermath: Aftermath::Untouched, diagnosis: None } = &error else {
            panic!("{error}")
        };
        assert!(matches!(**fault, Fault::NoMemory(_)), "{fault}");
        flight.wait(&mut bodies).expect("a good step");
        assert_eq!(bits(&bodies), undisturbed(40));
        bodies = scene(40).0;
    }
    assert_eq!(board.violations(), []);
}

#[test]
fn memory_of_a_prepared_step_goes_to_one_that_cannot_do_without() {
    let choice = MemoryChoice::Uio { node: "pgs-memory".to_owned() };
    let (board, _platform, mut accelerator) = composed(&choice, BYTES - 16_384);
    let parameters = StepParameters::default();
    let (mut few, touching) = scene(3);
    let (mut bodies, collisions) = scene(40);
    let mut flight = accelerator.submit(&few, &touching, &parameters).expect("starts");
    let prepared = flight.prepare(&bodies, &collisions, &parameters).expect("there is room");
    flight.wait(&mut few).expect("a good step");
    accelerator.step(&mut bodies, &collisions, &parameters).expect("there is room for one");
    assert_eq!(bits(&bodies), undisturbed(40));
    let error = accelerator.start(&prepared).map(drop).expect_err("its records are gone");
    assert!(matches!(error, Error::Input(InputError::NotPrepared)), "{error}");
    assert_eq!(board.violations(), []);
}

/// An open board with the memory of a real one, with `in_use` bytes taken.
fn composed(choice: &MemoryChoice, in_use: u64) -> (EmulatedBoard, Arc<Composed>, Accelerator) {
    let board = EmulatedBoard::new(BoardConfig::default()).expect("a board that can be built");
    let platform = Arc::new(Composed::new(&board, choice));
    if in_use > 0 {
        let beats = usize::try_from(in_use / 16).expect("fits");
        platform.real.memory().allocate(beats).expect("there is room");
    }
    let accelerator = open_on(Arc::clone(&platform) as _);
    (board, platform, accelerator)
}
