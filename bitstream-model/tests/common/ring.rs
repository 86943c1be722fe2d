//! A ring of scatter-gather descriptors, written word by word from the descriptor's layout.

use std::sync::Arc;
use std::sync::atomic::{AtomicU32, Ordering};

use bitstream_model::Direction;
use pgs_interface::axi_dma::{CURDESC, CURDESC_MSB, TAILDESC, TAILDESC_MSB};
use pgs_interface::descriptor::{
    BUFFER, BUFFER_MSB, BYTES, CONTROL, NXTDESC, NXTDESC_MSB, STATUS, WORDS, control,
};

use super::Host;

pub(crate) const SOF: u32 = control::SOF.mask();
pub(crate) const EOF: u32 = control::EOF.mask();
/// A packet of one descriptor.
pub(crate) const WHOLE: u32 = SOF | EOF;

/// Bits 31:0 and 63:32 of an address.
pub(crate) fn halves(address: u64) -> [u32; 2] {
    let half = |value: u64| u32::try_from(value & 0xFFFF_FFFF).expect("masked to 32 bits");
    [half(address), half(address >> 32)]
}

/// Descriptors of one channel, linked in a ring.
#[derive(Debug)]
pub(crate) struct Ring {
    pub(crate) core: usize,
    pub(crate) direction: Direction,
    pub(crate) address: u64,
    words: Arc<[AtomicU32]>,
    slots: usize,
    next: usize,
}

impl Ring {
    pub(crate) fn new(host: &Host, core: usize, direction: Direction, slots: usize) -> Self {
        let memory = host.port.allocate_shared(slots * WORDS).expect("there is room");
        Self::on(memory, core, direction)
    }

    /// A ring on these words.
    pub(crate) fn on(
        (address, words): (u64, Arc<[AtomicU32]>),
        core: usize,
        direction: Direction,
    ) -> Self {
        let slots = words.len() / WORDS;
        let ring = Self { core, direction, address, words, slots, next: 0 };
        for slot in 0..slots {
            ring.link(slot, ring.at((slot + 1) % slots));
        }
        ring
    }

    pub(crate) fn at(&self, slot: usize) -> u64 {
        self.address + (slot * BYTES) as u64
    }

    pub(crate) fn set(&self, slot: usize, word: usize, value: u32) {
        self.words[slot * WORDS + word].store(value, Ordering::Release);
    }

    pub(crate) fn get(&self, slot: usize, word: usize) -> u32 {
        self.words[slot * WORDS + word].load(Ordering::Acquire)
    }

    pub(crate) fn status(&self, slot: usize) -> u32 {
        self.get(slot, STATUS)
    }

    pub(crate) fn link(&self, slot: usize, next: u64) {
        let [low, high] = halves(next);
        self.set(slot, NXTDESC, low);
        self.set(slot, NXTDESC_MSB, high);
    }

    /// Writes a descriptor and clears its status.
    pub(crate) fn fill(&self, slot: usize, buffer: u64, control: u32) {
        let [low, high] = halves(buffer);
        self.set(slot, BUFFER, low);
        self.set(slot, BUFFER_MSB, high);
        self.set(slot, CONTROL, control);
        self.set(slot, STATUS, 0);
    }

    /// Writes the next descriptor of the ring; returns its slot.
    pub(crate) fn push(&mut self, buffer: u64, control: u32) -> usize {
        let slot = self.next;
        self.next = (slot + 1) % self.slots;
        self.fill(slot, buffer, control);
        slot
    }

    /// Begins again at the first slot.
    pub(crate) fn restart(&mut self) {
        self.next = 0;
    }

    /// Points the channel at the first slot and lets it run.
    pub(crate) fn run(&self, host: &Host, control: u32) {
        self.point(host, self.address);
        host.run_channel(self.core, self.direction, control);
    }

    /// Writes CURDESC.
    pub(crate) fn point(&self, host: &Host, address: u64) {
        let [low, high] = halves(address);
        host.write(self.core, self.direction, CURDESC, low);
        host.write(self.core, self.direction, CURDESC_MSB, high);
    }

    /// Moves the tail to a slot.
    pub(crate) fn doorbell(&self, host: &Host, slot: usize) {
        self.doorbell_at(host, self.at(slot));
    }

    pub(crate) fn doorbell_at(&self, host: &Host, address: u64) {
        let [low, high] = halves(address);
        host.write(self.core, self.direction, TAILDESC, low);
        if host.board.config().address_width > 32 {
            host.write(self.core, self.direction, TAILDESC_MSB, high);
        }
    }
}
