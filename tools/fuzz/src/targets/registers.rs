//! Runs a program of random accesses against the registers and the memory of a board.

use std::sync::Arc;
use std::sync::atomic::{AtomicU32, Ordering};

use bitstream_model::interface::address_map::{CONTROL_BASE, CONTROL_BYTES, dma_base};
use bitstream_model::interface::axi_dma::{CHANNEL_REGISTERS, DMACR, S2MM_OFFSET};
use bitstream_model::interface::control;
use bitstream_model::interface::descriptor::{BYTES, WORDS};
use bitstream_model::interface::record::Beat;
use bitstream_model::interface::register::Register;
use bitstream_model::{BoardConfig, DeviceAccess, Direction, MemoryError};

use crate::boards;
use crate::host::ring::halves;
use crate::host::{BOTH, Host, microseconds};
use crate::input::Input;
use crate::tally::Tally;

/// Most buffers of a program at a time.
const BUFFERS_MAX: usize = 16;
/// Longest pause, µs.
const PAUSE_MAX: u32 = 60;

/// The owner of a buffer.
#[derive(Debug)]
enum Owner {
    Cpu(Box<[Beat]>),
    /// The device, with the content of a buffer that the device may only read.
    Device(DeviceAccess, Box<[Beat]>),
}

#[derive(Debug)]
struct Buffer {
    address: u64,
    owner: Owner,
}

#[derive(Debug)]
struct Program<'a> {
    input: Input<'a>,
    host: Host,
    buffers: Vec<Buffer>,
    rings: Vec<(u64, Arc<[AtomicU32]>)>,
}

/// One execution.
pub(super) fn run(bytes: &[u8]) -> Tally {
    let mut input = Input::new(bytes);
    let config = boards::any(&mut input);
    let scatter_gather = !input.one_in(3);
    let host = Host::new(BoardConfig { scatter_gather, strict: false, ..config });
    let mut program = Program { input, host, buffers: Vec::new(), rings: Vec::new() };
    program.prepare_work();
    while !program.input.is_empty() {
        program.act();
    }
    program.end()
}

impl Program<'_> {
    /// Prepares work for the channels, to read and to write from the start.
    fn prepare_work(&mut self) {
        self.allocate_ring();
        self.allocate_ring();
        for access in [DeviceAccess::Read, DeviceAccess::Write] {
            self.allocate();
            self.hand_over(self.buffers.len() - 1, access);
        }
    }

    fn act(&mut self) {
        match self.input.below(23) {
            0..=2 => {
                let address = self.address();
                let _ = self.host.port.read32(address);
            }
            3..=5 => {
                let (address, value) = (self.address(), self.value());
                self.host.port.write32(address, value);
            }
            6..=9 => self.write_channel(),
            10 | 11 => self.start_channel(),
            12 => {
                let register = self.argument();
                let value = self.value();
                self.host.set_control(register, value);
            }
            13 => self.host.set_control(control::AP_CTRL, 1),
            14 => {
                let core = self.core();
                self.host.write(core, Direction::Mm2s, DMACR, 4);
                self.host.pause(1);
            }
            15 | 16 => {
                let microseconds = self.input.below(PAUSE_MAX);
                self.host.pause(microseconds.into());
            }
            17 => {
                let time = microseconds(self.input.below(PAUSE_MAX).into());
                if self.host.port.wait_interrupt(time).is_some() && self.input.one_in(2) {
                    self.host.port.unmask_interrupt();
                }
            }
            18 => self.allocate(),
            19 => self.allocate_ring(),
            20 => {
                let Some(which) = self.buffer() else { return };
                let access = self.input.pick(&[DeviceAccess::Read, DeviceAccess::Write]);
                self.hand_over(which, access);
            }
            21 => self.take_back(),
            _ => self.release(),
        }
    }

    fn core(&mut self) -> usize {
        self.input.index(self.host.cores() + 1)
    }

    fn channel(&mut self) -> (usize, Direction) {
        (self.core(), self.input.pick(&BOTH))
    }

    /// An address, mostly of a register.
    fn address(&mut self) -> u64 {
        match self.input.below(8) {
            0..=3 => {
                let half = self.input.pick(&[0, S2MM_OFFSET]);
                dma_base(self.core()) + u64::from(half + 4 * self.input.below(13))
            }
            4 | 5 => CONTROL_BASE + 4 * u64::from(self.input.below(0x80)),
            6 => CONTROL_BASE + u64::from(self.input.word() % CONTROL_BYTES),
            _ => match self.input.below(4) {
                0 => self.input.long(),
                _ => dma_base(0) + u64::from(self.input.word() % 0x6_0000),
            },
        }
    }

    /// A value, often an address in a buffer or a ring.
    fn value(&mut self) -> u32 {
        if self.input.one_in(3) {
            let [low, high] = halves(self.address_near_buffer());
            self.input.pick(&[low, high])
        } else {
            self.input.telling_word()
        }
    }

    /// An address in or near an allocation.
    fn address_near_buffer(&mut self) -> u64 {
        let known: Vec<u64> = self
            .buffers
            .iter()
            .map(|buffer| buffer.address)
            .chain(self.rings.iter().map(|(address, _)| *address))
            .collect();
        let Some(last) = known.len().checked_sub(1) else { return self.input.long() };
        let base = known[self.input.index(last + 1)];
        let offset = u64::from(self.input.byte()) * self.input.pick(&[0, 0, 0, 16]);
        // Sometimes unaligned, and before the buffer.
        match self.input.below(16) {
            0 => base.wrapping_sub(offset),
            1 => base.wrapping_add(offset / 16),
            _ => base.wrapping_add(offset),
        }
    }

    fn write_channel(&mut self) {
        let (core, direction) = self.channel();
        let register = self.input.pick(&CHANNEL_REGISTERS);
        let value = self.value();
        self.host.write(core, direction, register, value);
    }

    /// Starts a channel on a ring, if the ring's descriptors allow it.
    fn start_channel(&mut self) {
        let (core, direction) = self.channel();
        let Some(last) = self.rings.len().checked_sub(1) else { return };
        let ring = self.input.index(last + 1);
        let (base, words) = &self.rings[ring];
        let (base, words) = (*base, Arc::clone(words));
        for slot in 0..words.len() / WORDS {
            let [low, high] = halves(base + ((slot + 1) * BYTES) as u64);
            let buffer = halves(self.address_near_buffer());
            let length = 16 * (1 + self.input.below(40));
            let flags = match self.input.below(4) {
                0 => self.input.below(64) << 26,
                // A packet of one descriptor.
                _ => 0b11 << 26,
            };
            for (word, value) in
                [(0, low), (1, high), (2, buffer[0]), (3, buffer[1]), (6, length | flags), (7, 0)]
            {
                words[slot * WORDS + word].store(value, Ordering::Release);
            }
        }
        let [low, high] = halves(base);
        let [current, current_high, tail, tail_high] = [2, 3, 4, 5].map(|k| CHANNEL_REGISTERS[k]);
        self.host.write(core, direction, current, low);
        self.host.write(core, direction, current_high, high);
        self.host.write(core, direction, DMACR, 0x0001_7001);
        self.host.pause(1);
        let at = base + (self.input.index(words.len() / WORDS + 1) * BYTES) as u64;
        let [low, high] = halves(at);
        self.host.write(core, direction, tail, low);
        self.host.write(core, direction, tail_high, high);
    }

    fn argument(&mut self) -> Register {
        self.input.pick(&[
            control::BODIES,
            control::COLLISIONS,
            control::CONTACT_ITERATIONS,
            control::FRICTION_ITERATIONS,
            control::FLAGS,
            control::RESET,
            control::IER,
            control::GIE,
            control::TIME_STEP,
        ])
    }

    fn allocate(&mut self) {
        if self.buffers.len() == BUFFERS_MAX {
            return;
        }
        let beats = 1 + self.input.index(64);
        if let Ok((address, beats)) = self.host.port.allocate(beats) {
            self.buffers.push(Buffer { address, owner: Owner::Cpu(beats) });
        }
    }

    fn allocate_ring(&mut self) {
        if self.rings.len() == 4 {
            return;
        }
        let slots = 1 + self.input.index(4);
        if let Ok(ring) = self.host.port.allocate_shared(slots * WORDS) {
            self.rings.push(ring);
        }
    }

    /// A buffer, if there is one.
    fn buffer(&mut self) -> Option<usize> {
        let last = self.buffers.len().checked_sub(1)?;
        Some(self.input.index(last + 1))
    }

    fn hand_over(&mut self, which: usize, access: DeviceAccess) {
        let words = [(); 4].map(|()| self.input.word());
        let (wrong_length, port) = (self.input.one_in(16), &self.host.port);
        let buffer = &mut self.buffers[which];
        match &mut buffer.owner {
            Owner::Device(..) => {
                let refused = port.hand_over(buffer.address, Box::default(), access);
                assert!(matches!(refused, Err(MemoryError::State { .. })), "{refused:?}");
            }
            Owner::Cpu(beats) if wrong_length => {
                let more: Box<[Beat]> = vec![Beat::default(); beats.len() + 1].into();
                let refused = port.hand_over(buffer.address, more, access);
                assert!(matches!(refused, Err(MemoryError::State { .. })), "{refused:?}");
            }
            Owner::Cpu(beats) => {
                beats[0] = Beat(words);
                let copy = beats.clone();
                let beats = std::mem::take(beats);
                port.hand_over(buffer.address, beats, access).expect("the CPU owns it");
                buffer.owner = Owner::Device(access, copy);
            }
        }
    }

    fn take_back(&mut self) {
        let Some(which) = self.buffer() else { return };
        self.reclaim(which);
    }

    /// Takes a buffer back; if the device must not have written it, checks its content.
    fn reclaim(&mut self, which: usize) {
        let buffer = &mut self.buffers[which];
        let taken = self.host.port.take_back(buffer.address);
        match &buffer.owner {
            Owner::Cpu(_) => assert!(matches!(taken, Err(MemoryError::State { .. })), "{taken:?}"),
            Owner::Device(access, copy) => {
                let beats = taken.expect("the device owns it");
                assert_eq!(beats.len(), copy.len());
                if *access == DeviceAccess::Read {
                    assert_eq!(&beats, copy, "the device wrote what it may only read");
                }
                buffer.owner = Owner::Cpu(beats);
            }
        }
    }

    fn release(&mut self) {
        let Some(which) = self.buffer() else { return };
        let buffer = self.buffers.swap_remove(which);
        let port = &self.host.port;
        port.release(buffer.address).expect("it was allocated");
        assert!(matches!(port.take_back(buffer.address), Err(MemoryError::Unknown { .. })));
    }

    /// Checks the invariants after any program.
    fn end(mut self) -> Tally {
        for which in 0..self.buffers.len() {
            self.reclaim(which);
        }
        let host = &self.host;
        let before = host.port.now();
        host.pause(100);
        assert!(host.port.now() >= before + microseconds(100), "time stands still");
        let counts = host.board.counts();
        let mut tally = Tally::default();
        tally.add_board(&counts);
        tally
    }
}
