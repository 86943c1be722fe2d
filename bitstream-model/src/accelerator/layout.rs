//! This file says which designs can be replayed, and how their collisions and bodies lie on the streams.

use super::batch;
use super::striping::{PerStream, Striping, Turns, beat_cycles};
use crate::config::{BoardConfig, Hazards, Subnormals};
use crate::interface::number::{Numbers, StreamFormat};
use crate::interface::profile::{Flow, Geometry, Inertia};
use crate::interface::record::collision;
use crate::interface::stripe::{Stripe, Stripes};

/// Beats of a collision, at most.
pub(super) const BEATS_MAX: usize = collision::ROWS;

/// Where the beats of each collision are, the same for all of them.
#[derive(Debug, Clone, Copy)]
pub(super) struct Layout {
    pub(super) format: StreamFormat,
    /// Beats of a collision on each stream; every stream of the design has some.
    pub(super) share: PerStream,
    /// The stream of each beat, and its number among the collision's there.
    pub(super) places: [(usize, usize); BEATS_MAX],
    /// Whether a batch takes the beats as they are.
    pub(super) in_place: bool,
    /// How velocities, poses and results lie on the streams, if all of them in turn.
    pub(super) bodies: Option<Turns>,
}

impl Layout {
    /// That of a design that can be replayed.
    pub(super) fn of(config: &BoardConfig) -> Option<Self> {
        let variant = config.variant();
        let (profile, numbers) = (variant.profile, variant.numbers);
        let computed = numbers == Numbers { collisions: numbers.collisions, ..Numbers::F32 }
            && variant.inertia == Inertia::Isotropic
            && profile.collisions_per_issue == 1
            && matches!(profile.flow, Flow::Passes)
            && config.subnormals == Subnormals::Keep
            && config.hazards == Hazards::Interlocked;
        let widths = profile.mm2s_widths;
        let wide = widths.iter().chain(profile.s2mm_widths).all(|width| beat_cycles(*width) == 1);
        let (format, rows) = (numbers.collisions, variant.collision_rows());
        let rows_per_beat = (u32::BITS / format.bits()) as usize;
        let beats = rows / rows_per_beat;
        let group = profile.stripes.collisions.streams.len();
        // Every collision begins with a beat and with a group.
        let alike = rows.is_multiple_of(rows_per_beat) && beats.is_multiple_of(group);
        if !(computed && wide && alike) {
            return None;
        }
        let striping = Striping::new(&profile.stripes.collisions, widths);
        let share = striping.counts(beats);
        if share[..widths.len()].contains(&0) {
            return None;
        }
        let mut places = [(0, 0); BEATS_MAX];
        let mut walk = striping.places(0);
        places[..beats].fill_with(|| walk.take());
        let absolute = profile.geometry == Geometry::Absolute;
        let in_place = absolute && format == StreamFormat::F32 && places == batch::PLACES;
        if absolute && !in_place {
            return None;
        }
        let Stripes { velocities, poses, results, .. } = profile.stripes;
        let of = |stripe: &Stripe, widths: &[u32]| Turns::of(stripe, widths.len());
        let bodies = of(&velocities, widths)
            .filter(|turns| of(&poses, widths) == Some(*turns))
            .filter(|turns| of(&results, profile.s2mm_widths) == Some(*turns));
        Some(Self { format, share, places, in_place, bodies })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::interface::profile::{FLOAT, HALF, MIXED, NAIVE, Profile, WINDOWED, WINDOWED16};

    fn layout(profile: &'static Profile) -> Option<Layout> {
        Layout::of(&BoardConfig { profile, ..BoardConfig::default() })
    }

    #[test]
    fn collisions_of_float_are_taken_as_they_are_and_those_of_mixed_are_translated() {
        let float = layout(&FLOAT).expect("it can be replayed");
        assert!(float.in_place);
        assert_eq!(float.bodies, Some(Turns { streams: 4 }));
        assert_eq!(float.share, [2, 2, 2, 1]);
        let mixed = layout(&MIXED).expect("it can be replayed");
        assert!(!mixed.in_place);
        assert_eq!(mixed.bodies, Some(Turns { streams: 3 }));
        assert_eq!(mixed.share, [1, 1, 1, 0]);
        assert_eq!(mixed.places[..3], [(0, 0), (1, 0), (2, 0)]);
    }

    #[test]
    fn bodies_that_lie_otherwise_go_the_long_way_alone() {
        static APART: Profile = Profile {
            stripes: Stripes {
                velocities: Stripe { streams: &[2], padded: false },
                ..MIXED.stripes
            },
            ..MIXED
        };
        static PADDED: Profile = Profile {
            stripes: Stripes {
                results: Stripe { streams: &[0, 1, 2], padded: true },
                ..MIXED.stripes
            },
            ..MIXED
        };
        static FEWER_OUT: Profile = Profile { s2mm_widths: &[128; 2], ..MIXED };
        for profile in [&APART, &PADDED, &FEWER_OUT] {
            let layout = layout(profile).expect("its collisions can be replayed");
            assert_eq!(layout.bodies, None, "{:?}", profile.stripes);
        }
    }

    /// What a design must have, one by one.
    #[test]
    fn others_go_the_long_way() {
        for profile in [&NAIVE, &HALF, &WINDOWED, &WINDOWED16] {
            assert!(layout(profile).is_none(), "{}", profile.name);
        }
        let usual = BoardConfig { profile: &MIXED, ..BoardConfig::default() };
        for config in [
            BoardConfig { inertia: Inertia::World, ..usual },
            BoardConfig { hazards: Hazards::Unchecked, ..usual },
            BoardConfig { subnormals: Subnormals::Flush, ..usual },
        ] {
            assert!(Layout::of(&config).is_none(), "{config:?}");
        }
        // Groups across collisions, a stream without any, a narrow stream, collisions on other streams.
        const fn striped(streams: &'static [u8], of: Profile) -> Profile {
            let collisions = Stripe { streams, padded: false };
            Profile { stripes: Stripes { collisions, ..of.stripes }, ..of }
        }
        static ACROSS: Profile = striped(&[0, 1], MIXED);
        static WITHOUT: Profile = striped(&[0, 1, 0], MIXED);
        static NARROW: Profile = Profile { mm2s_widths: &[128, 128, 64], ..MIXED };
        static OTHER: Profile = striped(&[0, 1, 2, 3, 2, 1, 0], FLOAT);
        for profile in [&ACROSS, &WITHOUT, &NARROW, &OTHER] {
            assert!(layout(profile).is_none(), "{:?}", profile.stripes.collisions);
        }
    }
}
