//! Stands between the driver and the board, and makes mistakes on the driver's behalf.
//!
//! ```text
//! driver -> [ mistake ] -> events, as the board sees them -> [ trouble ] -> emulated board
//! ```
//!
//! A [`Mistake`] is an error of a worse driver. A [`Trouble`] is an act of the board that makes the
//! mistake show; it happens to every driver.

use std::collections::BTreeMap;
use std::panic::panic_any;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use bitstream_model::{BoardConfig, Direction, EmulatedBoard};
use pgs_interface::axi_dma::{DMASR, S2MM_OFFSET, dmasr};
use pgs_interface::descriptor::{BUFFER_MSB, CONTROL, STATUS, control, status};
use pgs_interface::record::{BEAT_BYTES, Beat};

use super::chain::{Bd, Descriptors, Place};
use super::kinds::{ChannelId, Event, Mistake, Trouble};
use super::region::PlantedRegion;
use crate::platform::{
    Access, DmaMemory, DmaMemorySource, EmulatedPlatform, Platform, PlatformError, RegisterMap,
    RegisterWindow, SharedMemory,
};
use crate::step::tests::tampered::{CONTROL_BLOCK, number};

const BEAT: u32 = 16;

/// Number of waits, each up to a millisecond or to an interrupt, that counts as endless.
const ENDLESS: u32 = 20_000;

/// The panic that ends an endless wait.
#[derive(Debug)]
pub(crate) struct Endless;

/// The planted mistake and trouble, and the events so far.
#[derive(Debug, Default)]
pub(crate) struct State {
    pub(crate) mistake: Option<Mistake>,
    pub(crate) trouble: Option<Trouble>,
    pub(crate) wide: bool,
    /// The board was opened.
    pub(crate) opened: bool,
    pub(crate) events: Vec<Event>,
    descriptors: Descriptors,
    pub(crate) places: BTreeMap<(usize, bool), Place>,
    /// The last value that was read from each register, or written to it.
    pub(crate) last: BTreeMap<(usize, u32), u32>,
    /// Writes that the mistake delays.
    pub(crate) held: Vec<(usize, u32, u32)>,
    /// Length of each buffer, bytes; and its contents when it last went to the device.
    buffers: BTreeMap<u64, u64>,
    sent: BTreeMap<u64, Box<[Beat]>>,
    freed: Vec<u64>,
    /// A buffer that stays with the CPU.
    kept: Option<u64>,
    /// The last status of each descriptor that the device has used, by its address.
    used: Vec<(Bd, u32)>,
    /// Channels whose state the driver only assumes: halted or not.
    pub(crate) believed: BTreeMap<(usize, bool), bool>,
    /// The driver sees every descriptor as complete.
    pub(crate) forged: bool,
    /// Completion is forged at the driver's next look at memory, after its look at the channels. A
    /// descriptor that the board has not fetched yet must not be complete.
    pub(crate) forge_due: bool,
    /// Whether the last wait ended with an interrupt; whether the driver unmasked it since.
    woke: bool,
    pub(crate) unmasked: bool,
    waits: u32,
    /// The moment at which the clock stops.
    stopped_at: Option<Duration>,
    /// Whether the mistake found an occasion.
    planted: bool,
    /// Channels with a chain that ended with its buffer.
    fitted: Vec<ChannelId>,
}

/// The emulated board behind mistakes and troubles.
#[derive(Debug, Clone)]
pub(crate) struct Planted {
    board: EmulatedBoard,
    inner: Arc<EmulatedPlatform>,
    state: Arc<Mutex<State>>,
}

impl Planted {
    pub(crate) fn new(
        config: BoardConfig,
        mistake: Option<Mistake>,
        trouble: Option<Trouble>,
    ) -> Self {
        let board = EmulatedBoard::new(config).expect("a board that can be built");
        let inner = Arc::new(EmulatedPlatform::new(board.cpu_port()));
        let wide = config.address_width > 32;
        let state = State { mistake, trouble, wide, ..State::default() };
        Self { board, inner, state: Arc::new(Mutex::new(state)) }
    }

    pub(crate) fn state(&self) -> MutexGuard<'_, State> {
        // A panic ends an endless wait.
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// The board under test.
    pub(crate) fn board(&self) -> &EmulatedBoard {
        &self.board
    }

    /// Marks the board as open: from now on a reset is part of a recovery.
    pub(crate) fn opened(&self) {
        let mut state = self.state();
        state.opened = true;
        state.events.clear();
        if state.mistake == Some(Mistake::NoDeadline) {
            state.stopped_at = Some(self.inner.now());
        }
    }

    /// Ends the trouble.
    pub(crate) fn end_trouble(&self) {
        self.state().trouble = None;
    }

    /// The events since the last call.
    pub(crate) fn events(&self) -> Vec<Event> {
        std::mem::take(&mut self.state().events)
    }

    /// Whether the mistake found an occasion.
    pub(crate) fn planted(&self) -> bool {
        self.state().planted
    }

    /// Whether a chain of that channel has ended with its buffer.
    pub(crate) fn fitted(&self, channel: ChannelId) -> bool {
        self.state().fitted.contains(&channel)
    }

    /// The board's own time.
    pub(crate) fn time(&self) -> Duration {
        self.inner.now()
    }

    fn status(&self, core: usize, direction: Direction) -> u32 {
        let offset = if direction == Direction::S2mm { S2MM_OFFSET } else { 0 };
        let window = self.inner.window(RegisterMap::Dma(core)).expect("a core");
        window.read32(offset + DMASR.offset)
    }

    /// Whether all channels of a direction are idle, or stopped.
    fn at_rest(&self, direction: Direction) -> bool {
        (0..4).all(|core| {
            let status = self.status(core, direction);
            dmasr::IDLE.is_set(status) || dmasr::HALTED.is_set(status)
        })
    }

    /// Counts a wait, and panics if there is no end.
    fn count_wait(&self) {
        let mut state = self.state();
        state.waits += 1;
        if state.waits > ENDLESS {
            state.waits = 0;
            state.stopped_at = None;
            drop(state);
            panic_any(Endless);
        }
    }

    pub(crate) fn pass_on(&self, state: &mut State, writes: Vec<(usize, u32, u32)>) {
        for (region, at, value) in writes {
            state.events.push(Event::Write(region, at, value));
            let map = match region {
                CONTROL_BLOCK => RegisterMap::Control,
                core => RegisterMap::Dma(core),
            };
            self.inner.window(map).expect("a region").write32(at, value);
        }
    }

    pub(crate) fn preempt(&self, state: &State) {
        if state.trouble == Some(Trouble::Preempted) {
            self.inner.pause(Duration::from_micros(10));
        }
    }

    pub(crate) fn release_held(&self, state: &mut State) {
        let held = std::mem::take(&mut state.held);
        self.pass_on(state, held);
    }

    /// Changes descriptors when their doorbell rings.
    pub(crate) fn ring(&self, state: &mut State, channel: ChannelId) {
        let key = (channel.0, channel.1 == Direction::S2mm);
        let place = state.places.entry(key).or_default();
        place.follow(&state.descriptors);
        let chain = place.chain.clone();
        let Some(last) = chain.last() else { return };
        let bytes = |bd: &Bd| state.buffers.range(..=bd.buffer()).next_back();
        let fits = |bd: &Bd| {
            let end = bd.buffer() + u64::from(bd.length());
            bytes(bd).is_some_and(|(base, bytes)| end == base + bytes)
        };
        // The last one, where a chain sends a buffer's end several times.
        let fitting = chain.iter().rfind(|bd| fits(bd));
        match state.mistake {
            Some(Mistake::AddressCut) => chain.iter().for_each(|bd| bd.set(BUFFER_MSB, 0)),
            Some(Mistake::LengthSpills) if channel.1 == Direction::Mm2s => {
                // The first piece of the first packet that has several pieces.
                if let Some(piece) = chain.iter().find(|bd| !bd.has(control::EOF)) {
                    piece.mark(control::EOF);
                }
            }
            Some(Mistake::StatusNotCleared) => {
                for (bd, left) in &state.used {
                    bd.set(STATUS, *left);
                }
            }
            Some(Mistake::BeatTooLong(wanted)) if wanted == channel => {
                if let Some(last) = fitting {
                    last.set(CONTROL, last.get(CONTROL) + BEAT);
                    state.planted = true;
                }
            }
            Some(Mistake::BeatTooHigh(wanted)) if wanted == channel => {
                if let Some(last) = fitting {
                    last.set_buffer(last.buffer() + u64::from(BEAT));
                    state.planted = true;
                }
            }
            Some(Mistake::FreedBuffer(wanted)) if wanted == channel => {
                if let Some(freed) = state.freed.first().copied() {
                    last.set_buffer(freed);
                    state.planted = true;
                }
            }
            Some(Mistake::CpuBuffer(wanted)) if wanted == channel => {
                last.set_buffer(state.kept.expect("one is kept"));
                state.planted = true;
            }
            _ => {}
        }
        if fitting.is_some() {
            state.fitted.push(channel);
        }
        match (state.trouble, &chain[..]) {
            (Some(Trouble::StaleDescriptor(wanted)), [_, second, ..]) if wanted == channel => {
                second.set(STATUS, status::CMPLTED.mask());
            }
            _ => {}
        }
    }

    /// Changes the memory that the driver finds at the end of a wait.
    fn after_wait(&self, state: &mut State) {
        let State { mistake, trouble, places, .. } = state;
        let done = |bd: &Bd| status::CMPLTED.is_set(bd.status());
        let chain_of = |(core, direction): ChannelId| {
            places.get(&(core, direction == Direction::S2mm)).and_then(|place| place.chain.last())
        };
        match *trouble {
            Some(Trouble::Descriptor(channel, bits)) => {
                if let Some(last) = chain_of(channel).filter(|last| done(last)) {
                    last.set(STATUS, last.status() | bits);
                }
            }
            Some(Trouble::ShortPacket(core)) => {
                let last = chain_of((core, Direction::S2mm)).filter(|last| done(last));
                // Once: a short packet stays short.
                let whole = |bd: &&Bd| status::TRANSFERRED.of(bd.status()) == bd.length();
                if let Some(last) = last.filter(whole) {
                    last.set(STATUS, last.status() - BEAT);
                }
            }
            _ => {}
        }
        for bd in places.values().flat_map(|place| &place.chain) {
            match *mistake {
                Some(Mistake::DescriptorUnseen(bits)) => bd.set(STATUS, bd.status() & !bits),
                Some(Mistake::LengthIgnored) if done(bd) => {
                    bd.set(STATUS, status::TRANSFERRED.put(bd.status(), bd.length()));
                }
                _ => {}
            }
        }
    }

    /// Shows the driver every descriptor as complete.
    pub(crate) fn forge(state: &mut State) {
        for ((_, receives), place) in &state.places {
            for bd in &place.chain {
                let ends = if *receives { status::RXSOF.mask() | status::RXEOF.mask() } else { 0 };
                bd.set(STATUS, status::CMPLTED.mask() | ends | bd.length());
            }
        }
        state.forged = true;
    }
}

impl DmaMemorySource for Planted {
    fn name(&self) -> &str {
        "planted"
    }

    fn allocate(&self, beats: usize) -> Result<(u64, DmaMemory), PlatformError> {
        let (address, memory) = self.inner.allocate(beats)?;
        let bytes = (memory.beats().len() * BEAT_BYTES) as u64;
        let mut state = self.state();
        state.buffers.insert(address, bytes);
        if state.kept.is_none() {
            // This memory does not belong to the driver.
            state.kept = Some(self.inner.allocate(4096)?.0);
        }
        Ok((address, memory))
    }

    fn allocate_shared(&self, words: usize) -> Result<(u64, SharedMemory), PlatformError> {
        let (address, memory) = self.inner.allocate_shared(words)?;
        if let SharedMemory::Heap(words) = &memory {
            self.state().descriptors.add(address, Arc::clone(words));
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
        let mut state = self.state();
        let sent: Box<[Beat]> = memory.beats().into();
        let before = state.sent.insert(address, sent);
        if let (Some(Mistake::NotCleaned), Some(before), Access::Read) =
            (state.mistake, before, access)
        {
            memory.beats_mut().copy_from_slice(&before);
        }
        self.inner.hand_over(address, memory, used, access)
    }

    fn take_back(&self, address: u64) -> Result<DmaMemory, PlatformError> {
        let rests = self.at_rest(Direction::Mm2s) && self.at_rest(Direction::S2mm);
        let mut state = self.state();
        state.events.push(Event::TakeBack(rests));
        let chains: Vec<Bd> = state.places.values().flat_map(|p| p.chain.clone()).collect();
        state.used.extend(chains.into_iter().map(|bd| (bd.clone(), bd.status())));
        let mut memory = self.inner.take_back(address)?;
        if state.mistake == Some(Mistake::NotInvalidated) {
            memory.beats_mut().copy_from_slice(&state.sent[&address]);
        }
        Ok(memory)
    }

    fn release(&self, address: u64) -> Result<(), PlatformError> {
        let mut state = self.state();
        if state.buffers.remove(&address).is_some() {
            state.freed.push(address);
        }
        self.inner.release(address)
    }
}

impl Platform for Planted {
    fn window(&self, map: RegisterMap) -> Result<Box<dyn RegisterWindow>, PlatformError> {
        Ok(Box::new(PlantedRegion::new(self, self.inner.window(map)?, number(map))))
    }

    fn memory(&self) -> &dyn DmaMemorySource {
        self
    }

    fn now(&self) -> Duration {
        self.state().stopped_at.unwrap_or_else(|| self.inner.now())
    }

    fn pause(&self, duration: Duration) {
        self.count_wait();
        self.inner.pause(duration);
    }

    fn wait_interrupt(&self, timeout: Duration) -> Result<Option<u32>, PlatformError> {
        self.count_wait();
        let mut state = self.state();
        self.release_held(&mut state);
        state.events.push(Event::Wait);
        state.unmasked = false;
        let spurious = match &mut state.trouble {
            Some(Trouble::Spurious(left)) if *left > 0 && !timeout.is_zero() => {
                *left -= 1;
                true
            }
            _ => false,
        };
        let woke = if spurious {
            self.inner.pause(Duration::from_micros(1));
            Some(0)
        } else if state.trouble == Some(Trouble::SendersIdle) && !timeout.is_zero() {
            let until = self.inner.now() + timeout;
            while self.inner.now() < until && !self.at_rest(Direction::Mm2s) {
                self.inner.pause(Duration::from_nanos(100));
            }
            // Later waits are undisturbed.
            state.trouble = None;
            None
        } else {
            self.inner.wait_interrupt(timeout)?
        };
        match state.mistake {
            Some(Mistake::InterruptBelieved) if spurious => state.forge_due = true,
            Some(Mistake::IdleBelieved) if !timeout.is_zero() && self.at_rest(Direction::Mm2s) => {
                Self::forge(&mut state);
            }
            _ => {}
        }
        self.after_wait(&mut state);
        state.woke = woke.is_some();
        if state.woke {
            state.events.push(Event::Woke);
        }
        Ok(woke)
    }

    fn unmask_interrupt(&self) -> Result<(), PlatformError> {
        let mut state = self.state();
        state.events.push(Event::Unmask(self.board.interrupt_level()));
        self.inner.unmask_interrupt()?;
        self.release_held(&mut state);
        state.unmasked = state.woke;
        Ok(())
    }
}
