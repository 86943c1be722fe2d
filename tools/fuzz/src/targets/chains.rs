//! Runs channels on random descriptors, or on random direct transfers, in memory that checks every
//! access; now and then beside a step that sends results.

use bitstream_model::interface::axi_dma::{
    ADDRESS, ADDRESS_MSB, CURDESC, CURDESC_MSB, DMACR, LENGTH, TAILDESC, TAILDESC_MSB,
};
use bitstream_model::interface::control;
use bitstream_model::interface::descriptor::{
    BUFFER, BUFFER_MSB, BYTES, CONTROL, NXTDESC, NXTDESC_MSB, STATUS,
};
use bitstream_model::{BoardConfig, Direction, EmulatedBoard};

use super::space::Space;
use crate::boards;
use crate::host::ring::{EOF, SOF, halves};
use crate::host::{BOTH, Host};
use crate::input::Input;
use crate::tally::Tally;

/// Base addresses of the memory, below and above 4 GiB.
const BASES: [u64; 2] = [0x4000_0000, 0x8_0000_0000];
/// Bytes of each memory; the middle half is granted.
const STRETCH: u64 = 4096;
const GRANTED: u64 = STRETCH / 2;
/// Most descriptors of a chain.
const CHAIN_MAX: u32 = 6;
/// Usual maximum of a descriptor's beats.
const BEATS_MAX: u32 = 24;

#[derive(Debug)]
struct Scene<'a> {
    input: Input<'a>,
    host: Host,
    space: Space,
    /// Upper halves of the addresses of direct transfers.
    highs: Vec<u64>,
    /// Bytes of the longest direct transfer.
    longest: u32,
}

/// One execution.
pub(super) fn run(bytes: &[u8]) -> Tally {
    let mut input = Input::new(bytes);
    let space = Space::new(&BASES, STRETCH);
    let scatter_gather = !input.one_in(4);
    let config = BoardConfig { scatter_gather, strict: false, ..boards::any(&mut input) };
    let board = EmulatedBoard::on_memory(config, Box::new(space.clone()), space.granted(), None)
        .expect("every choice can be built");
    let host = Host { port: board.cpu_port(), board };
    let mut scene = Scene { input, host, space, highs: vec![0], longest: 0 };
    scene.start_step();
    while !scene.input.is_empty() {
        let (core, direction) = (scene.input.index(scene.host.cores()), scene.input.pick(&BOTH));
        if scatter_gather {
            scene.chain(core, direction);
        } else {
            scene.transfer(core, direction);
        }
        let microseconds = scene.input.below(16);
        scene.host.pause(microseconds.into());
        if scene.input.one_in(8) {
            scene.host.reset_dma(core);
        }
    }
    scene.host.pause(100);
    scene.space.check_canaries();
    let counts = scene.host.board.counts();
    let mut tally = Tally::default();
    tally.add_board(&counts);
    tally
}

impl Scene<'_> {
    /// Starts a step of falling bodies, whatever the streams bring.
    fn start_step(&mut self) {
        let host = &self.host;
        host.reset_all();
        host.set_control(control::BODIES, self.input.below(12));
        host.set_control(control::COLLISIONS, self.input.below(3));
        host.set_control(control::CONTACT_ITERATIONS, self.input.below(2));
        host.set_control(control::AP_CTRL, 1);
    }

    /// An address, mostly in a grant and a multiple of `step`.
    fn address_in_grant(&mut self, step: u64) -> u64 {
        let base = self.input.pick(&BASES);
        let inside = GRANTED / step;
        let offset = u64::from(self.input.short()) % inside * step;
        match self.input.below(32) {
            // Before and behind the grant.
            0 => base + offset / 2,
            1 => base + STRETCH / 4 + GRANTED - step + offset / 64,
            2 => base + STRETCH / 4 + offset + u64::from(self.input.below(64)),
            3 => self.input.long(),
            _ => base + STRETCH / 4 + offset,
        }
    }

    fn length(&mut self) -> u32 {
        match self.input.below(16) {
            0 => self.input.word() >> 6,
            1 => self.input.byte().into(),
            _ => 16 * (1 + self.input.below(BEATS_MAX)),
        }
    }

    /// Writes a chain, runs the channel on it and moves the tail.
    fn chain(&mut self, core: usize, direction: Direction) {
        let first = self.address_in_grant(BYTES as u64);
        let slots = 1 + self.input.below(CHAIN_MAX);
        let (mut at, mut tail) = (first, first);
        for slot in 0..slots {
            let next = match self.input.below(16) {
                0 => self.address_in_grant(BYTES as u64),
                // To itself, and back to the first.
                1 => at,
                2 => first,
                _ => at.wrapping_add(BYTES as u64),
            };
            let flags = match self.input.below(8) {
                0 => self.input.below(64) << 26,
                _ => {
                    let (sof, eof) = (slot == 0, slot + 1 == slots);
                    (if sof { SOF } else { 0 }) | (if eof { EOF } else { 0 })
                }
            };
            let buffer = self.address_in_grant(16);
            let control = self.length() | flags;
            let status = if self.input.one_in(16) { self.input.word() } else { 0 };
            self.write_descriptor(at, next, buffer, control, status);
            tail = at;
            at = next;
        }
        if self.input.one_in(16) {
            tail = self.address_in_grant(BYTES as u64);
        }
        let running = self.input.one_in(3);
        let host = &self.host;
        if !running {
            let [low, high] = halves(first);
            host.write(core, direction, CURDESC, low);
            host.write(core, direction, CURDESC_MSB, high);
            let control = match self.input.below(8) {
                // Keyhole, cyclic.
                0 => 0x0001_7009,
                1 => 0x0001_7011,
                2 => self.input.word() & !4,
                _ => 0x0001_7001,
            };
            host.write(core, direction, DMACR, control);
            host.pause(1);
        }
        let [low, high] = halves(tail);
        host.write(core, direction, TAILDESC, low);
        host.write(core, direction, TAILDESC_MSB, high);
    }

    fn write_descriptor(&self, at: u64, next: u64, buffer: u64, control: u32, status: u32) {
        // The CPU writes its own memory only.
        let inside = |range: std::ops::Range<u64>| {
            range.contains(&at) && range.end - at >= BYTES as u64 && at.is_multiple_of(BYTES as u64)
        };
        if !self.space.granted().into_iter().any(inside) {
            return;
        }
        let ([next, next_high], [data, data_high]) = (halves(next), halves(buffer));
        for (word, value) in [
            (NXTDESC, next),
            (NXTDESC_MSB, next_high),
            (BUFFER, data),
            (BUFFER_MSB, data_high),
            (CONTROL, control),
            (STATUS, status),
        ] {
            self.space.store(at + 4 * word as u64, value);
        }
    }

    /// Starts a direct transfer. A running one goes on from the new address, which is written in
    /// two halves, with its own length.
    fn transfer(&mut self, core: usize, direction: Direction) {
        let (address, length) = (self.address_in_grant(16), self.length());
        let [low, high] = halves(address);
        self.highs.push(address >> 32 << 32);
        self.longest = self.longest.max(length);
        for upper in &self.highs {
            self.space.announce(upper | u64::from(low), self.longest);
        }
        let host = &self.host;
        host.write(core, direction, DMACR, 0x0001_7001);
        host.pause(1);
        host.write(core, direction, ADDRESS, low);
        host.write(core, direction, ADDRESS_MSB, high);
        host.write(core, direction, LENGTH, length);
    }
}
