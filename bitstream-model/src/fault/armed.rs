//! This file keeps the faults that are still to come, and says to each part of the board when it is
//! one's turn.

use super::{Fault, FaultKind, Place, Site, StepPhase, StepShape, When};
use pgs_interface::address_map::DMA_COUNT_MAX;
use pgs_interface::axi_dma::Direction;

/// Where a channel stands in its packet.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Turn {
    pub(crate) core: usize,
    pub(crate) direction: Direction,
    /// Beats of the packet that were moved.
    pub(crate) beats: u64,
    /// Descriptors of the packet that were completed.
    pub(crate) descriptors: u32,
    /// Whether the next beat is its descriptor's first.
    pub(crate) begins: bool,
}

/// What comes up in the next beats of a channel.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Due {
    /// Nothing.
    Nothing,
    /// Something, after so many beats.
    After(u64),
    /// This, with the next beat.
    Now(FaultKind),
}

/// A fault that is still to come.
#[derive(Debug)]
struct Armed {
    fault: Fault,
    /// How often it is still to happen.
    left: u32,
    /// Steps begun, of the accelerator and of each receiver, when it was injected.
    starts: u64,
    received: [u64; DMA_COUNT_MAX],
    /// The step that it happened in last, as the part that met it counts; it comes again in a later
    /// one.
    happened: Option<u64>,
    /// Register accesses, stops, resets or edges since the injection.
    passed: u64,
}

/// All faults that are still to come.
#[derive(Debug, Default)]
pub(crate) struct Faults {
    armed: Vec<Armed>,
    happened: u64,
    /// Starts of the accelerator.
    starts: u64,
    /// How often each receiver was started: once a step, before the accelerator.
    received: [u64; DMA_COUNT_MAX],
    /// Packets that each channel has sent in this step.
    sent: [u32; DMA_COUNT_MAX],
    shape: StepShape,
    /// What concerns the board as a whole and was met by one of its parts.
    for_board: Option<FaultKind>,
}

impl Faults {
    pub(crate) fn inject(&mut self, fault: Fault) {
        let (starts, received) = (self.starts, self.received);
        let left = fault.times;
        self.armed.push(Armed { fault, left, starts, received, happened: None, passed: 0 });
    }

    pub(crate) fn clear(&mut self) {
        self.armed.clear();
        self.for_board = None;
    }

    /// How many have happened.
    pub(crate) fn happened(&self) -> u64 {
        self.happened
    }

    /// Whether there is none: what a board without faults pays for them.
    #[inline]
    pub(crate) fn none(&self) -> bool {
        self.armed.is_empty()
    }

    /// A step begins.
    pub(crate) fn step_begins(&mut self, shape: StepShape) {
        self.starts += 1;
        self.sent = Default::default();
        self.shape = shape;
    }

    /// A packet has ended.
    pub(crate) fn packet_ends(&mut self, core: usize, direction: Direction) {
        if direction == Direction::Mm2s {
            self.sent[core] += 1;
        }
    }

    /// A channel that rested was started.
    pub(crate) fn channel_begins(&mut self, core: usize, direction: Direction) {
        if direction == Direction::S2mm {
            self.received[core] += 1;
        }
    }

    /// The step that a part is in, as it counts: a receiver begins before the accelerator.
    fn now(&self, channel: Option<(usize, Direction)>) -> u64 {
        match channel {
            Some((core, Direction::S2mm)) => self.received[core],
            _ => self.starts,
        }
    }

    /// What the packet carries that a channel is at.
    pub(crate) fn phase(&self, core: usize, direction: Direction) -> Option<StepPhase> {
        match direction {
            Direction::Mm2s => self.shape.phase(core, self.sent[core]),
            Direction::S2mm => Some(StepPhase::Results),
        }
    }

    /// The first that `fits`, which has happened with that, in a channel if it was met by one.
    fn take(
        &mut self,
        channel: Option<(usize, Direction)>,
        fits: impl Fn(&Self, &Armed) -> bool,
    ) -> Option<FaultKind> {
        let place = self.armed.iter().position(|armed| fits(self, armed))?;
        let now = self.now(channel);
        let armed = &mut self.armed[place];
        let kind = armed.fault.kind;
        armed.left = armed.left.saturating_sub(1);
        armed.happened = Some(now);
        if armed.left == 0 {
            self.armed.remove(place);
        }
        self.happened += 1;
        log::debug!("board: the fault {} happens", kind.name());
        Some(kind)
    }

    /// Whether a fault may happen in this step, as a channel counts steps if it would meet it.
    fn in_step(&self, armed: &Armed, channel: Option<(usize, Direction)>) -> bool {
        let now = self.now(channel);
        let then = match channel {
            Some((core, Direction::S2mm)) => armed.received[core],
            _ => armed.starts,
        };
        let again = armed.happened.is_none_or(|last| now > last);
        again && armed.fault.step.is_none_or(|step| now - then == u64::from(step))
    }

    fn fits(&self, armed: &Armed, turn: &Turn) -> bool {
        let Turn { core, direction, .. } = *turn;
        let place = match armed.fault.place {
            None => true,
            Some(place) => place == Place::Channel(core, direction),
        };
        let phase = match (armed.fault.phase, direction) {
            (None, _) | (Some(StepPhase::Results), Direction::S2mm) => true,
            (Some(_), Direction::S2mm) => false,
            (Some(phase), Direction::Mm2s) => {
                self.shape.packet(core, phase) == Some(self.sent[core])
            }
        };
        place && phase && self.in_step(armed, Some((core, direction)))
    }

    /// Whether a fault of the whole board waits for a channel.
    fn awaits_channel(fault: &Fault) -> bool {
        fault.kind.site() == Site::Board
            && (fault.place.is_some()
                || fault.phase.is_some()
                || matches!(fault.when, Some(When::Beat(_) | When::Descriptor(_))))
    }

    /// After how many beats a fault comes up.
    fn beats_until(&self, armed: &Armed, turn: &Turn) -> Option<u64> {
        let board = Self::awaits_channel(&armed.fault);
        if armed.fault.kind.site() != Site::Beat && !board || !self.fits(armed, turn) {
            return None;
        }
        match armed.fault.when {
            None => Some(0),
            Some(When::Beat(beat)) => beat.checked_sub(turn.beats),
            Some(When::Descriptor(number)) => {
                (turn.begins && number == turn.descriptors).then_some(0)
            }
            Some(_) => None,
        }
    }

    /// What comes up in the next `beats` beats of a channel.
    pub(crate) fn at_beats(&mut self, turn: &Turn, beats: u64) -> Due {
        let until = self.armed.iter().filter_map(|armed| self.beats_until(armed, turn)).min();
        match until {
            Some(0) => {}
            Some(beats_until) if beats_until < beats => return Due::After(beats_until),
            _ => return Due::Nothing,
        }
        let channel = Some((turn.core, turn.direction));
        let kind = self.take(channel, |all, armed| all.beats_until(armed, turn) == Some(0));
        match kind {
            Some(kind) if kind.site() == Site::Board => {
                self.for_board = Some(kind);
                Due::Now(kind)
            }
            Some(kind) => Due::Now(kind),
            None => Due::Nothing,
        }
    }

    /// What happens at a descriptor or at the end of a packet.
    fn at(&mut self, turn: &Turn, site: Site) -> Option<FaultKind> {
        self.take(Some((turn.core, turn.direction)), |all, armed| {
            let when = match armed.fault.when {
                Some(When::Descriptor(number)) => number == turn.descriptors,
                _ => true,
            };
            armed.fault.kind.site() == site && when && all.fits(armed, turn)
        })
    }

    /// What happens to the fetch of a descriptor.
    pub(crate) fn at_fetch(&mut self, turn: &Turn) -> Option<FaultKind> {
        self.at(turn, Site::Fetch)
    }

    /// What happens to the write of a descriptor's status.
    pub(crate) fn at_completion(&mut self, turn: &Turn) -> Option<FaultKind> {
        self.at(turn, Site::Completion)
    }

    /// What happens to the end of a packet.
    pub(crate) fn at_packet_end(&mut self, turn: &Turn) -> Option<FaultKind> {
        self.at(turn, Site::PacketEnd)
    }

    /// What happens on one of several like occasions, in a part that `fits` tells.
    fn on_occasion(
        &mut self,
        site: Site,
        fits: impl Fn(Option<Place>) -> bool,
    ) -> Option<FaultKind> {
        if self.none() {
            return None;
        }
        let here = |armed: &Armed| armed.fault.kind.site() == site && fits(armed.fault.place);
        let due = |armed: &Armed| match armed.fault.when {
            Some(When::Occasion(number)) => armed.passed >= u64::from(number),
            _ => true,
        };
        let kind =
            self.take(None, |all, armed| here(armed) && due(armed) && all.in_step(armed, None));
        // Whatever happened on it: it was one.
        for armed in self.armed.iter_mut().filter(|armed| here(armed)) {
            armed.passed += 1;
        }
        kind
    }

    /// What happens as a channel is stopped.
    pub(crate) fn at_halt(&mut self, core: usize, direction: Direction) -> Option<FaultKind> {
        let here = Place::Channel(core, direction);
        self.on_occasion(Site::Halt, |place| place.is_none_or(|place| place == here))
    }

    /// What happens as a core or the accelerator is reset.
    pub(crate) fn at_reset(&mut self, here: Place) -> Option<FaultKind> {
        self.on_occasion(Site::Reset, |place| place.is_none_or(|place| place == here))
    }

    /// What happens as the interrupt line rises.
    pub(crate) fn at_edge(&mut self) -> Option<FaultKind> {
        self.on_occasion(Site::Edge, |_| true)
    }

    /// What happens in the accelerator, if it is in that phase (in any, if none is said) and about to
    /// take its records up to `records`.
    pub(crate) fn in_accelerator(
        &mut self,
        phase: Option<StepPhase>,
        records: u64,
    ) -> Option<FaultKind> {
        if self.none() {
            return None;
        }
        self.take(None, |all, armed| {
            let fault = &armed.fault;
            let when = match fault.when {
                Some(When::Beat(record)) => record < records,
                _ => true,
            };
            // It ends a step once, whatever the phase.
            let at_the_end = fault.kind == FaultKind::NoDone;
            fault.kind.site() == Site::Accelerator
                && !at_the_end
                && when
                && fault.phase.is_none_or(|wanted| phase.is_none_or(|phase| wanted == phase))
                && all.in_step(armed, None)
        })
    }

    /// Whether the accelerator says that it is done.
    pub(crate) fn keeps_done(&mut self) -> bool {
        let kind = FaultKind::NoDone;
        self.take(None, |all, armed| armed.fault.kind == kind && all.in_step(armed, None)).is_some()
    }

    /// What happens to the board as a whole, at a register access if there is one now.
    pub(crate) fn of_board(&mut self, access: bool) -> Option<FaultKind> {
        if let Some(kind) = self.for_board.take() {
            return Some(kind);
        }
        if self.none() {
            return None;
        }
        let counts = |all: &Self, armed: &Armed| {
            let fault = &armed.fault;
            fault.kind.site() == Site::Board
                && !Self::awaits_channel(fault)
                && all.in_step(armed, None)
        };
        let kind = self.take(None, |all, armed| {
            let due = match armed.fault.when {
                Some(When::Access(number)) => access && armed.passed >= number,
                _ => true,
            };
            counts(all, armed) && due
        });
        if access {
            for armed in &mut self.armed {
                armed.passed += u64::from(armed.fault.kind.site() == Site::Board);
            }
        }
        kind
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fault::Streamed;

    fn shape() -> StepShape {
        let streamed = Streamed::PerPass;
        StepShape { segments: [[true; 3]; 4], contact: 4, passes: 8, streamed }
    }

    #[test]
    fn a_fault_comes_up_at_its_beat_once_and_again_in_the_next_step_if_it_says_so() {
        let mut faults = Faults::default();
        let stall = Fault::new(FaultKind::Stall)
            .on(1, Direction::Mm2s)
            .in_phase(StepPhase::Contact(1))
            .when(When::Beat(5));
        faults.inject(Fault { times: 2, ..stall });
        let turn =
            Turn { core: 1, direction: Direction::Mm2s, beats: 3, descriptors: 0, begins: false };
        let at = |beats| Turn { beats, ..turn };
        for _ in 0..2 {
            faults.step_begins(shape());
            assert_eq!(faults.at_beats(&at(5), 9), Due::Nothing, "that is the load");
            faults.packet_ends(1, Direction::Mm2s);
            assert_eq!(faults.at_beats(&at(3), 2), Due::Nothing);
            assert_eq!(faults.at_beats(&at(3), 9), Due::After(2));
            assert_eq!(faults.at_beats(&Turn { core: 2, ..at(5) }, 9), Due::Nothing);
            assert_eq!(faults.at_beats(&at(5), 4), Due::Now(FaultKind::Stall));
            assert_eq!(faults.at_beats(&at(5), 4), Due::Nothing);
        }
        assert!(faults.none());
        assert_eq!(faults.happened(), 2);
    }

    #[test]
    fn a_receiver_counts_the_steps_that_it_was_started_for() {
        let mut faults = Faults::default();
        let fault = Fault::new(FaultKind::Stall).on(3, Direction::S2mm);
        faults.inject(Fault { step: Some(2), ..fault });
        faults.inject(Fault { times: 2, ..Fault::new(FaultKind::ShortPacket) });
        let turn =
            Turn { core: 3, direction: Direction::S2mm, beats: 0, descriptors: 0, begins: true };
        faults.channel_begins(3, Direction::S2mm);
        faults.step_begins(shape());
        assert_eq!(faults.at_beats(&turn, 1), Due::Now(FaultKind::ShortPacket));
        assert_eq!(faults.at_beats(&turn, 1), Due::Nothing, "still the first step");
        // The step failed, and is taken again.
        faults.channel_begins(3, Direction::S2mm);
        assert_eq!(faults.at_beats(&turn, 1), Due::Now(FaultKind::Stall));
        assert_eq!(faults.at_beats(&turn, 1), Due::Now(FaultKind::ShortPacket));
        assert!(faults.none());
    }

    #[test]
    fn occasions_and_accesses_are_counted() {
        let mut faults = Faults::default();
        faults.inject(Fault::new(FaultKind::IrqDrop).when(When::Occasion(1)));
        faults.inject(Fault::new(FaultKind::PowerLost).when(When::Access(2)));
        faults.inject(Fault::new(FaultKind::IrqDelay { ns: 1 }).when(When::Occasion(2)));
        assert_eq!(faults.at_edge(), None);
        assert_eq!(faults.at_edge(), Some(FaultKind::IrqDrop));
        assert_eq!(faults.at_edge(), Some(FaultKind::IrqDelay { ns: 1 }));
        assert_eq!(faults.at_edge(), None);
        assert_eq!(faults.of_board(false), None);
        assert_eq!(
            [(); 3].map(|()| faults.of_board(true)),
            [None, None, Some(FaultKind::PowerLost)]
        );
    }
}
