//! Chooses how a board is built.

use bitstream_model::interface::profile::{PROFILES, Variant};
use bitstream_model::{Bandwidth, BoardConfig, Delays, Hazards};

use crate::input::Input;

/// Every profile, with every option: formats, inertia, hazards, bandwidth, widths,
/// depths, delays. Every combination is valid.
pub fn any(input: &mut Input<'_>) -> BoardConfig {
    let Variant { profile, numbers, inertia } = variant(input);
    let switches = input.byte();
    let on = |bit: u32| switches >> bit & 1 == 1;
    let small = |input: &mut Input<'_>, most: u32| u64::from(input.below(most));
    BoardConfig {
        profile,
        numbers: Some(numbers),
        inertia,
        hazards: if on(0) { Hazards::Unchecked } else { Hazards::Interlocked },
        queue: profile.queue.filter(|_| !on(0)).map(|_| input.pick(&[0, 1, 3, 64])),
        // In the profiles' own windows, an order without hazards needs hundreds of empty entries.
        window_slots: if on(1) && on(4) { None } else { Some(1 + input.below(24)) },
        bandwidth: input.pick(&[
            Bandwidth::Unlimited,
            Bandwidth::ZCU102_SUSTAINED,
            Bandwidth::BytesPerSecond(400_000_000),
        ]),
        length_width: 8 + input.below(19),
        address_width: 32 + input.below(33),
        delays: if on(3) {
            Delays {
                register_access_ns: 1 + small(input, 250),
                halt: small(input, 200),
                reset: small(input, 250),
                descriptor_fetch: small(input, 100),
                fifo_beats: 16 + input.index(64),
            }
        } else {
            Delays::default()
        },
        ..BoardConfig::default()
    }
}

fn variant(input: &mut Input<'_>) -> Variant {
    let built = PROFILES.iter().flat_map(|profile| {
        let inertias = profile.inertias().iter();
        inertias.map(|inertia| Variant { inertia: *inertia, ..profile.default_variant() })
    });
    input.pick(&built.collect::<Vec<Variant>>())
}

#[cfg(test)]
mod tests {
    use bitstream_model::EmulatedBoard;

    use super::*;

    #[test]
    fn every_choice_is_a_board_that_can_be_built() {
        let mut bytes = Vec::new();
        let mut profiles = std::collections::BTreeSet::new();
        for number in 0..2000 {
            crate::random::fill(&mut bytes, 1, "boards", number, 32);
            let config = any(&mut Input::new(&bytes));
            EmulatedBoard::new(config).expect("it can be built");
            profiles.insert(config.profile.name);
        }
        assert_eq!(profiles.len(), PROFILES.len());
    }
}
