//! Random fault plans from a seed.

use super::{Fault, FaultKind, FaultPlan, Place, Site, StepPhase, When};
use crate::cast::{index, register};
use crate::config::BoardConfig;
use pgs_interface::axi_dma::Direction;
use pgs_support::random::SplitMix64;

/// Numbers from a seed.
#[derive(Debug)]
struct Numbers(SplitMix64);

impl Numbers {
    fn below(&mut self, end: usize) -> usize {
        // The slight preference for low numbers does not matter here.
        index(self.0.next() % end.max(1) as u64)
    }

    fn of<T: Copy>(&mut self, all: &[T]) -> Option<T> {
        all.get(self.below(all.len())).copied()
    }
}

impl FaultPlan {
    /// One to three faults of a board, in steps of `contact` and `friction` passes. The same seed
    /// gives the same plan.
    #[must_use]
    pub fn random(seed: u64, config: &BoardConfig, contact: u32, friction: u32) -> Self {
        let mut numbers = Numbers(SplitMix64::new(seed));
        let kinds: Vec<FaultKind> = FaultKind::all().collect();
        let count = 1 + numbers.below(8).saturating_sub(5);
        let mut faults = Vec::new();
        for _ in 0..count {
            if let Some(kind) = numbers.of(&kinds) {
                faults.push(fault(kind, &mut numbers, config, contact, friction));
            }
        }
        Self { faults }
    }
}

fn fault(
    kind: FaultKind,
    numbers: &mut Numbers,
    config: &BoardConfig,
    contact: u32,
    friction: u32,
) -> Fault {
    let site = kind.site();
    let mut fault = Fault::new(kind);
    let (inputs, outputs) = (config.profile.mm2s_widths.len(), config.profile.s2mm_widths.len());
    let channel = |numbers: &mut Numbers| match numbers.below(inputs + outputs) {
        channel if channel < inputs => Place::Channel(channel, Direction::Mm2s),
        channel => Place::Channel(channel - inputs, Direction::S2mm),
    };
    let phase = |numbers: &mut Numbers| {
        let passes = [StepPhase::Contact(1), StepPhase::Friction(1)];
        match numbers.below(5) {
            0 => Some(StepPhase::Load),
            1 => numbers.of(&passes),
            2 => Some(StepPhase::Contact(1 + register(numbers.below(contact as usize)))),
            3 => Some(StepPhase::Friction(1 + register(numbers.below(friction as usize)))),
            _ => Some(StepPhase::Poses),
        }
    };
    let small = [0, 0, 1, 2, 3, 7, 20, 100];
    match site {
        Site::Beat | Site::PacketEnd | Site::Fetch | Site::Completion => {
            let place = channel(numbers);
            fault.place = Some(place);
            if matches!(place, Place::Channel(_, Direction::Mm2s)) {
                fault.phase = phase(numbers);
            }
            let number = numbers.of(&small).unwrap_or(0);
            fault.when = match site {
                Site::Beat => Some(When::Beat(number)),
                Site::PacketEnd => None,
                _ => Some(When::Descriptor(register(numbers.below(2)))),
            };
        }
        Site::Halt => fault.place = Some(channel(numbers)),
        Site::Reset => {
            let core = numbers.below(inputs.max(outputs) + 1);
            let is_core = core < inputs.max(outputs);
            fault.place = Some(if is_core { Place::Core(core) } else { Place::Accelerator });
        }
        Site::Edge => fault.when = Some(When::Occasion(register(numbers.below(2)))),
        Site::Accelerator if kind == FaultKind::NoDone => {}
        Site::Accelerator => {
            fault.phase = phase(numbers);
            fault.when = Some(When::Beat(numbers.of(&small).unwrap_or(0)));
        }
        Site::Board => fault.when = Some(When::Access(numbers.below(80) as u64)),
    }
    fault
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_seed_gives_the_same_plan_and_every_plan_can_be_printed_and_parsed() {
        let config = BoardConfig::default();
        for seed in 0..2000 {
            let plan = FaultPlan::random(seed, &config, 4, 4);
            assert_eq!(plan, FaultPlan::random(seed, &config, 4, 4));
            assert!((1..=3).contains(&plan.faults.len()), "{plan}");
            assert_eq!(plan.to_string().parse(), Ok(plan));
        }
    }
}
