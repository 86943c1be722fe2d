//! Lists the cells of the fault table: each kind of fault at each possible place.

use bitstream_model::{
    Direction, Fault, FaultKind, FaultPlan, PacketCount, Place, StepPhase, When,
};
use serde_json::{Value, json};

use super::expected::{Expected, expected};
use super::trial::Bench;

/// One fault at one place.
#[derive(Debug, Clone)]
pub(super) struct Cell {
    pub(super) kind: FaultKind,
    /// The phase of the fault; none if the kind does not depend on a phase.
    pub(super) phase: Option<StepPhase>,
    pub(super) plan: FaultPlan,
    pub(super) expected: Expected,
    /// Whether the fault belongs to the step of the larger scene, in which channels must be
    /// stopped.
    pub(super) larger: bool,
}

impl Cell {
    pub(super) fn phase_text(&self) -> String {
        self.phase.map_or_else(|| "any".to_owned(), |phase| phase.to_string())
    }

    /// The fault for programs.
    pub(super) fn to_json(&self) -> Value {
        let (kind, phase) = (self.kind.name(), self.phase_text());
        json!({ "fault": self.plan.to_string(), "kind": kind, "phase": phase })
    }

    /// The channel of the fault.
    pub(super) fn channel(&self) -> Option<(usize, Direction)> {
        match self.plan.faults.last()?.place {
            Some(Place::Channel(core, direction)) => Some((core, direction)),
            _ => None,
        }
    }

    fn new(fault: Fault, larger: bool) -> Self {
        let channel = match fault.place {
            Some(Place::Channel(core, direction)) => Some((core, direction)),
            _ => None,
        };
        Self {
            kind: fault.kind,
            phase: fault.phase,
            plan: fault.into(),
            expected: expected(fault.kind, channel),
            larger,
        }
    }
}

/// Impossible combinations of a kind and a phase, and the number of cells that they would be.
#[derive(Debug, Clone, Copy)]
pub(super) struct Impossible {
    pub(super) what: &'static str,
    pub(super) cells: usize,
}

/// The first, the middle and the last of `count` positions, each once.
fn positions(count: u64) -> Vec<u64> {
    let last = count.saturating_sub(1);
    let mut all = vec![0, last / 2, last];
    all.dedup();
    all
}

/// Phases that represent all others of their kind: the first, the middle and the last contact pass,
/// and the first and the last friction pass.
fn is_tried(phase: StepPhase, [contact, friction]: [u32; 2]) -> bool {
    match phase {
        StepPhase::Load | StepPhase::Poses | StepPhase::Results => true,
        StepPhase::Contact(pass) => [1, contact.div_ceil(2), contact].contains(&pass),
        StepPhase::Friction(pass) => [1, friction].contains(&pass),
    }
}

/// The kind, with a delay so long that the step cannot end before the delay shows.
fn with_long_delay(kind: FaultKind) -> FaultKind {
    match kind {
        FaultKind::Slow { .. } => FaultKind::Slow { clocks: 10_000 },
        FaultKind::LateCmplted { .. } => FaultKind::LateCmplted { ns: 3_000_000 },
        other => other,
    }
}

/// The places where a kind of fault can happen.
enum Site {
    /// At each beat of a packet.
    Beats,
    /// At each descriptor of a packet.
    Descriptors,
    /// At the end of a packet.
    Ends,
    /// When a channel is stopped.
    Stops,
    /// When a core, or the accelerator, is reset after a fault.
    Resets,
    /// In each phase of the accelerator.
    Accelerator,
    /// Once a step.
    Once,
}

fn site_of(kind: FaultKind) -> Site {
    use FaultKind as K;
    match kind {
        K::DmaIntErr
        | K::DmaSlvErr
        | K::DmaDecErr
        | K::Stall
        | K::Slow { .. }
        | K::ShortPacket
        | K::Corrupt { .. }
        | K::OtherBitstream { .. }
        | K::Reloaded
        | K::PowerLost
        | K::IrqSpurious
        | K::IrqStorm { .. } => Site::Beats,
        K::SgIntErr
        | K::SgSlvErr
        | K::SgDecErr
        | K::SgDecErrWrite
        | K::BdIntErr
        | K::BdSlvErr
        | K::BdDecErr
        | K::LateCmplted { .. } => Site::Descriptors,
        K::LongPacket | K::NoTlast => Site::Ends,
        K::HaltDelay { .. } | K::HaltNever => Site::Stops,
        K::ResetSlow { .. } | K::ResetNever => Site::Resets,
        K::AcceleratorError { .. } | K::AcceleratorHang => Site::Accelerator,
        _ => Site::Once,
    }
}

/// The cells that a simulator of the hardware tries: faults of the streams that the hardware can
/// see, in the middle of each packet, and one error of a DMA, which resets it in the middle of a
/// packet. All others happen outside of it, and each takes a simulator seconds.
pub(super) fn for_simulator(bench: &Bench) -> Vec<Cell> {
    use FaultKind as K;
    let (cells, _) = of(bench);
    let middle = |cell: &Cell| {
        let fault = cell.plan.faults.last()?;
        let packet = bench.packets.iter().find(|packet| {
            Some((packet.core, packet.direction)) == cell.channel() && packet.phase == fault.phase
        })?;
        match fault.when {
            Some(When::Beat(beat)) => Some(beat == packet.beats.saturating_sub(1) / 2),
            _ => Some(true),
        }
    };
    let seen = |kind| {
        matches!(
            kind,
            K::ShortPacket
                | K::LongPacket
                | K::NoTlast
                | K::Corrupt { .. }
                | K::Stall
                | K::DmaDecErr
        )
    };
    cells.into_iter().filter(|cell| seen(cell.kind) && middle(cell) == Some(true)).collect()
}

/// All cells of a board, and the impossible combinations.
pub(super) fn of(bench: &Bench) -> (Vec<Cell>, Vec<Impossible>) {
    let packets: Vec<_> = bench
        .packets
        .iter()
        .filter(|packet| packet.phase.is_some_and(|phase| is_tried(phase, bench.passes())))
        .collect();
    let mut cells = Vec::new();
    let mut at_last = 0;
    let mut kinds = 0;
    for kind in FaultKind::all().map(with_long_delay) {
        match site_of(kind) {
            Site::Beats => {
                kinds += 3;
                for packet in &packets {
                    let mut beats = positions(packet.beats);
                    if matches!(kind, FaultKind::ShortPacket | FaultKind::Slow { .. }) {
                        at_last += 1;
                        beats.retain(|beat| beat + 1 < packet.beats);
                    }
                    cells.extend(beats.into_iter().map(|beat| at(kind, packet, When::Beat(beat))));
                }
            }
            Site::Descriptors => {
                kinds += 3;
                for packet in &packets {
                    let numbers = positions(packet.descriptors.into());
                    let number = |number: u64| u32::try_from(number).unwrap_or(u32::MAX);
                    cells.extend(
                        numbers.into_iter().map(|n| at(kind, packet, When::Descriptor(number(n)))),
                    );
                }
            }
            Site::Ends => {
                kinds += 1;
                cells.extend(packets.iter().map(|packet| Cell::new(on(kind, packet), false)));
            }
            Site::Stops => {
                for (core, direction) in channels(&bench.packets) {
                    cells.push(Cell::new(Fault::new(kind).on(core, direction), true));
                }
            }
            Site::Resets => cells.extend(resets(kind, bench)),
            Site::Accelerator => cells.extend(in_accelerator(kind, bench)),
            Site::Once => cells.push(Cell::new(Fault::new(kind), false)),
        }
    }
    let senders = channels(&bench.packets).filter(|(_, way)| *way == Direction::Mm2s).count();
    let receivers = channels(&bench.packets).count() - senders;
    let of_sending = packets.iter().filter_map(|p| p.phase).filter(|p| *p != StepPhase::Results);
    let mut phases: Vec<_> = of_sending.collect();
    phases.sort_by_key(|phase| format!("{phase}"));
    phases.dedup();
    let impossible = vec![
        Impossible {
            what: "S2MM outside its one packet: impulses and results",
            cells: kinds * phases.len() * receivers,
        },
        Impossible {
            what: "MM2S in the results: all of its packets have ended",
            cells: kinds * senders,
        },
        Impossible {
            what: "a packet cut short, or slow, from its last beat on: nothing follows",
            cells: at_last,
        },
    ];
    (cells, impossible)
}

fn on(kind: FaultKind, packet: &PacketCount) -> Fault {
    let fault = Fault::new(kind).on(packet.core, packet.direction);
    packet.phase.map_or(fault, |phase| fault.in_phase(phase))
}

fn at(kind: FaultKind, packet: &PacketCount, when: When) -> Cell {
    Cell::new(on(kind, packet).when(when), false)
}

/// Every channel with packets, once.
fn channels(packets: &[PacketCount]) -> impl Iterator<Item = (usize, Direction)> {
    let mut all: Vec<_> = packets.iter().map(|packet| (packet.core, packet.direction)).collect();
    all.sort_by_key(|(core, direction)| (*core, *direction == Direction::S2mm));
    all.dedup();
    all.into_iter()
}

/// A reset needs a fault before it: here a stall.
fn resets(kind: FaultKind, bench: &Bench) -> Vec<Cell> {
    let stall = Fault::new(FaultKind::Stall).on(0, Direction::S2mm);
    let cores = (0..bench.config.profile.mm2s_widths.len()).map(Place::Core);
    cores
        .chain([Place::Accelerator])
        .map(|place| {
            let cell = Cell::new(Fault::new(kind).at(place), false);
            let plan = FaultPlan { faults: vec![stall, Fault::new(kind).at(place)] };
            Cell { plan, ..cell }
        })
        .collect()
}

fn in_accelerator(kind: FaultKind, bench: &Bench) -> Vec<Cell> {
    let mut phases: Vec<StepPhase> = Vec::new();
    for phase in bench.packets.iter().filter_map(|packet| packet.phase) {
        let tried = phase != StepPhase::Results && is_tried(phase, bench.passes());
        if tried && !phases.contains(&phase) {
            phases.push(phase);
        }
    }
    phases
        .into_iter()
        .map(|phase| {
            let fault = Fault::new(kind).at(Place::Accelerator).in_phase(phase);
            Cell::new(fault, false)
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn first_middle_and_last_are_told_apart_where_they_are() {
        assert_eq!(positions(9), [0, 4, 8]);
        assert_eq!(positions(2), [0, 1]);
        assert_eq!(positions(1), [0]);
    }

    #[test]
    fn passes_stand_for_those_between_them() {
        let tried = |phase| is_tried(phase, [4, 4]);
        assert_eq!(
            [1, 2, 3, 4].map(|pass| tried(StepPhase::Contact(pass))),
            [true, true, false, true]
        );
        assert_eq!(
            [1, 2, 3, 4].map(|pass| tried(StepPhase::Friction(pass))),
            [true, false, false, true]
        );
    }
}
