//! Pending faults: each part of the board asks here at its occasions whether a fault is due.

use super::{Fault, FaultKind, Place, Site, StepPhase, StepShape, When};
use pgs_interface::address_map::DMA_COUNT_MAX;
use pgs_interface::axi_dma::Direction;

/// Position of a channel in its packet.
#[derive(Debug, Clone, Copy)]
pub(crate) struct PacketPosition {
    pub(crate) core: usize,
    pub(crate) direction: Direction,
    /// Moved beats of the packet.
    pub(crate) beats: u64,
    /// Completed descriptors of the packet.
    pub(crate) descriptors: u32,
    /// Whether the next beat is the first of a descriptor.
    pub(crate) begins: bool,
}

/// The next fault of a channel within a number of beats.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Due {
    /// No fault.
    Nothing,
    /// A fault after this number of beats.
    After(u64),
    /// This fault, with the next beat.
    Now(FaultKind),
}

/// A fault that is still to come.
#[derive(Debug)]
struct Armed {
    fault: Fault,
    /// Number of times that it is still to happen.
    left: u32,
    /// Steps that the accelerator and each receiver had begun at the injection.
    starts: u64,
    received: [u64; DMA_COUNT_MAX],
    /// The step of its last happening, as the affected part counts steps. It happens again in a
    /// later step.
    happened: Option<u64>,
    /// Occasions since the injection: register accesses, stops, resets or edges.
    occasions: u64,
}

/// All faults that are still to come.
#[derive(Debug, Default)]
pub(crate) struct Faults {
    armed: Vec<Armed>,
    happened: u64,
    /// How many had happened when this step began.
    before: u64,
    /// Whether any has happened since the step before began.
    since: bool,
    /// Starts of the accelerator.
    starts: u64,
    /// Starts of each receiver: one a step, before the accelerator's.
    received: [u64; DMA_COUNT_MAX],
    /// Packets that each channel has sent in this step.
    sent: [u32; DMA_COUNT_MAX],
    shape: StepShape,
    /// A fault of the whole board that is due, found by a channel.
    for_board: Option<FaultKind>,
}

impl Faults {
    pub(crate) fn inject(&mut self, fault: Fault) {
        let (starts, received) = (self.starts, self.received);
        let left = fault.times;
        self.armed.push(Armed { fault, left, starts, received, happened: None, occasions: 0 });
    }

    pub(crate) fn clear(&mut self) {
        self.armed.clear();
        self.for_board = None;
    }

    /// Number of faults that have happened.
    pub(crate) fn happened(&self) -> u64 {
        self.happened
    }

    /// Whether no fault is pending. A board without faults pays for no other check.
    #[inline]
    pub(crate) fn none(&self) -> bool {
        self.armed.is_empty()
    }

    /// Whether no fault can act in this step: none is pending, and none has left its effect in the
    /// streams since the step before began.
    pub(crate) fn spare_this_step(&self) -> bool {
        self.none() && !self.since && self.happened == self.before
    }

    /// A step begins.
    pub(crate) fn step_begins(&mut self, shape: StepShape) {
        self.since = self.happened != self.before;
        self.before = self.happened;
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

    /// A channel without work was started.
    pub(crate) fn channel_begins(&mut self, core: usize, direction: Direction) {
        if direction == Direction::S2mm {
            self.received[core] += 1;
        }
    }

    /// Number of the current step as a part counts it: a receiver begins before the accelerator.
    fn now(&self, channel: Option<(usize, Direction)>) -> u64 {
        match channel {
            Some((core, Direction::S2mm)) => self.received[core],
            _ => self.starts,
        }
    }

    /// The phase whose records the current packet of a channel carries.
    pub(crate) fn phase(&self, core: usize, direction: Direction) -> Option<StepPhase> {
        match direction {
            Direction::Mm2s => self.shape.phase(core, self.sent[core]),
            Direction::S2mm => Some(StepPhase::Results),
        }
    }

    /// Lets the first fault happen that `fits`; `channel` is the affected channel, if any.
    fn fire(
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

    /// Whether a fault may happen in the current step, as the affected part counts steps.
    fn in_step(&self, armed: &Armed, channel: Option<(usize, Direction)>) -> bool {
        let now = self.now(channel);
        let then = match channel {
            Some((core, Direction::S2mm)) => armed.received[core],
            _ => armed.starts,
        };
        let again = armed.happened.is_none_or(|last| now > last);
        again && armed.fault.step.is_none_or(|step| now - then == u64::from(step))
    }

    fn fits(&self, armed: &Armed, position: &PacketPosition) -> bool {
        let PacketPosition { core, direction, .. } = *position;
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

    /// Number of beats before a fault is due in a channel.
    fn beats_until(&self, armed: &Armed, position: &PacketPosition) -> Option<u64> {
        let board = Self::awaits_channel(&armed.fault);
        if armed.fault.kind.site() != Site::Beat && !board || !self.fits(armed, position) {
            return None;
        }
        match armed.fault.when {
            None => Some(0),
            Some(When::Beat(beat)) => beat.checked_sub(position.beats),
            Some(When::Descriptor(number)) => {
                (position.begins && number == position.descriptors).then_some(0)
            }
            Some(_) => None,
        }
    }

    /// The next fault in the next `beats` beats of a channel.
    pub(crate) fn at_beats(&mut self, position: &PacketPosition, beats: u64) -> Due {
        let until = self.armed.iter().filter_map(|armed| self.beats_until(armed, position)).min();
        match until {
            Some(0) => {}
            Some(beats_until) if beats_until < beats => return Due::After(beats_until),
            _ => return Due::Nothing,
        }
        let channel = Some((position.core, position.direction));
        let kind = self.fire(channel, |all, armed| all.beats_until(armed, position) == Some(0));
        match kind {
            Some(kind) if kind.site() == Site::Board => {
                self.for_board = Some(kind);
                Due::Now(kind)
            }
            Some(kind) => Due::Now(kind),
            None => Due::Nothing,
        }
    }

    /// The fault that is due at a descriptor or at the end of a packet.
    fn at_site(&mut self, position: &PacketPosition, site: Site) -> Option<FaultKind> {
        self.fire(Some((position.core, position.direction)), |all, armed| {
            let when = match armed.fault.when {
                Some(When::Descriptor(number)) => number == position.descriptors,
                _ => true,
            };
            armed.fault.kind.site() == site && when && all.fits(armed, position)
        })
    }

    /// The fault of a descriptor's fetch, if one is due.
    pub(crate) fn at_fetch(&mut self, position: &PacketPosition) -> Option<FaultKind> {
        self.at_site(position, Site::Fetch)
    }

    /// The fault of a status write to a descriptor, if one is due.
    pub(crate) fn at_completion(&mut self, position: &PacketPosition) -> Option<FaultKind> {
        self.at_site(position, Site::Completion)
    }

    /// The fault of a packet's end, if one is due.
    pub(crate) fn at_packet_end(&mut self, position: &PacketPosition) -> Option<FaultKind> {
        self.at_site(position, Site::PacketEnd)
    }

    /// The fault that is due at a counted occasion (stop, reset or edge), in a part that `fits`.
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
            Some(When::Occasion(number)) => armed.occasions >= u64::from(number),
            _ => true,
        };
        let kind =
            self.fire(None, |all, armed| here(armed) && due(armed) && all.in_step(armed, None));
        // The occasion counts, with a fault or without.
        for armed in self.armed.iter_mut().filter(|armed| here(armed)) {
            armed.occasions += 1;
        }
        kind
    }

    /// The fault of a channel's stop, if one is due.
    pub(crate) fn at_halt(&mut self, core: usize, direction: Direction) -> Option<FaultKind> {
        let here = Place::Channel(core, direction);
        self.on_occasion(Site::Halt, |place| place.is_none_or(|place| place == here))
    }

    /// The fault of a reset of a core or of the accelerator, if one is due.
    pub(crate) fn at_reset(&mut self, here: Place) -> Option<FaultKind> {
        self.on_occasion(Site::Reset, |place| place.is_none_or(|place| place == here))
    }

    /// The fault of a rising edge of the interrupt line, if one is due.
    pub(crate) fn at_edge(&mut self) -> Option<FaultKind> {
        self.on_occasion(Site::Edge, |_| true)
    }

    /// The fault of the accelerator that is due in `phase` (in any phase for `None`) before record
    /// `records`.
    pub(crate) fn in_accelerator(
        &mut self,
        phase: Option<StepPhase>,
        records: u64,
    ) -> Option<FaultKind> {
        if self.none() {
            return None;
        }
        self.fire(None, |all, armed| {
            let fault = &armed.fault;
            let when = match fault.when {
                Some(When::Beat(record)) => record < records,
                _ => true,
            };
            // This fault comes at the end of a step, in no phase.
            let at_the_end = fault.kind == FaultKind::NoDone;
            fault.kind.site() == Site::Accelerator
                && !at_the_end
                && when
                && fault.phase.is_none_or(|wanted| phase.is_none_or(|phase| wanted == phase))
                && all.in_step(armed, None)
        })
    }

    /// Whether a fault keeps the accelerator from setting `ap_done`.
    pub(crate) fn keeps_done(&mut self) -> bool {
        let kind = FaultKind::NoDone;
        self.fire(None, |all, armed| armed.fault.kind == kind && all.in_step(armed, None)).is_some()
    }

    /// The fault of the whole board that is due; `access` if this is at a register access.
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
        let kind = self.fire(None, |all, armed| {
            let due = match armed.fault.when {
                Some(When::Access(number)) => access && armed.occasions >= number,
                _ => true,
            };
            counts(all, armed) && due
        });
        if access {
            for armed in &mut self.armed {
                armed.occasions += u64::from(armed.fault.kind.site() == Site::Board);
            }
        }
        kind
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn shape() -> StepShape {
        StepShape { segments: [[true; 3]; 4], contact: 4, passes: 8 }
    }

    #[test]
    fn a_fault_happens_once_at_its_beat_and_again_in_the_next_step_if_planned() {
        let mut faults = Faults::default();
        let stall = Fault::new(FaultKind::Stall)
            .on(1, Direction::Mm2s)
            .in_phase(StepPhase::Contact(1))
            .when(When::Beat(5));
        faults.inject(Fault { times: 2, ..stall });
        let position = PacketPosition {
            core: 1,
            direction: Direction::Mm2s,
            beats: 3,
            descriptors: 0,
            begins: false,
        };
        let at = |beats| PacketPosition { beats, ..position };
        for _ in 0..2 {
            faults.step_begins(shape());
            assert_eq!(faults.at_beats(&at(5), 9), Due::Nothing, "the packet of the load");
            faults.packet_ends(1, Direction::Mm2s);
            assert_eq!(faults.at_beats(&at(3), 2), Due::Nothing);
            assert_eq!(faults.at_beats(&at(3), 9), Due::After(2));
            assert_eq!(faults.at_beats(&PacketPosition { core: 2, ..at(5) }, 9), Due::Nothing);
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
        let position = PacketPosition {
            core: 3,
            direction: Direction::S2mm,
            beats: 0,
            descriptors: 0,
            begins: true,
        };
        faults.channel_begins(3, Direction::S2mm);
        faults.step_begins(shape());
        assert_eq!(faults.at_beats(&position, 1), Due::Now(FaultKind::ShortPacket));
        assert_eq!(faults.at_beats(&position, 1), Due::Nothing, "still the first step");
        // The step failed, and the driver repeats it.
        faults.channel_begins(3, Direction::S2mm);
        assert_eq!(faults.at_beats(&position, 1), Due::Now(FaultKind::Stall));
        assert_eq!(faults.at_beats(&position, 1), Due::Now(FaultKind::ShortPacket));
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
