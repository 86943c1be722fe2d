//! Which designs have short cuts, and how their collisions and bodies lie on the streams.

use crate::accelerator::records::striping::{PerStream, Striping, Turns};
use crate::config::{BoardConfig, Hazards, Subnormals, beat_cycles};
use crate::shortcut::batch;
use pgs_interface::number::{Numbers, Precision, StreamFormat};
use pgs_interface::profile::Inertia;
use pgs_interface::record::collision;
use pgs_interface::stripe::{Stripe, Stripes};

/// Beats of an issue, at most.
pub(crate) const BEATS_MAX: usize = collision::ROWS;

/// How issues and bodies lie on the streams of a design that has short cuts.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Layout {
    pub(crate) format: StreamFormat,
    /// The precision of all arithmetic.
    pub(crate) precision: Precision,
    pub(crate) inertia: Inertia,
    /// Collisions of an issue; padding completes the last issue. Where it is two, records are in
    /// sixteen bits.
    pub(crate) together: usize,
    /// Beats of an issue on each stream: some on every stream of the design.
    pub(crate) share: PerStream,
    /// The stream of each beat of an issue, and the beat's number among the issue's beats there.
    pub(crate) places: [(usize, usize); BEATS_MAX],
    /// Whether a batch takes the beats as they are, without conversion.
    pub(crate) in_place: bool,
    /// Beats of a collision on each stream in a pass that brings impulses, if these can be taken.
    pub(crate) warm_share: Option<PerStream>,
    /// How velocities, poses and results lie on the streams, if all three take turns on them.
    pub(crate) bodies: Option<Turns>,
    /// Rows of a body's velocity.
    pub(crate) velocity_rows: usize,
}

impl Layout {
    /// The layout of a design, if it has short cuts.
    pub(crate) fn of(config: &BoardConfig) -> Option<Self> {
        let variant = config.variant();
        let (profile, numbers) = (variant.profile, variant.numbers);
        let precision = if numbers == (Numbers { collisions: numbers.collisions, ..Numbers::F32 }) {
            Precision::F32
        } else if numbers == Numbers::BINARY16 {
            Precision::Binary16
        } else {
            return None;
        };
        let computed = (variant.inertia == Inertia::Isotropic || precision == Precision::F32)
            && config.subnormals == Subnormals::Keep
            && config.hazards == Hazards::Interlocked;
        let widths = profile.mm2s_widths;
        let format = numbers.collisions;
        let together = profile.collisions_per_issue as usize;
        let rows = together * collision::ROWS;
        let rows_per_beat = format.rows_per_beat();
        let beats = rows / rows_per_beat;
        let group = profile.stripes.collisions.streams.len();
        // Every issue begins at a beat and at a group.
        let alike = rows.is_multiple_of(rows_per_beat) && beats.is_multiple_of(group);
        let as_it_is = format == StreamFormat::F32;
        let known = match together {
            1 => as_it_is,
            2 => format == StreamFormat::Binary16,
            _ => false,
        };
        if !(computed && alike && known) {
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
        let in_place = as_it_is && places == batch::PLACES;
        if as_it_is && !in_place {
            return None;
        }
        let Stripes { warm_collisions, velocities, poses, results, .. } = profile.stripes;
        let warm_share = warm_collisions
            .filter(|_| in_place)
            .and_then(|stripe| warm_share(&stripe, widths, profile.initiation_interval.into()));
        let of = |stripe: &Stripe, widths: &[u32]| Turns::of(stripe, widths.len());
        let wide = widths.iter().chain(profile.s2mm_widths).all(|width| beat_cycles(*width) == 1);
        let bodies = of(&velocities, widths)
            .filter(|_| wide && precision == Precision::F32)
            .filter(|turns| of(&poses, widths) == Some(*turns))
            .filter(|turns| of(&results, profile.s2mm_widths) == Some(*turns));
        let (inertia, velocity_rows) = (variant.inertia, variant.velocity_rows());
        Some(Self {
            format,
            precision,
            inertia,
            together,
            share,
            places,
            in_place,
            warm_share,
            bodies,
            velocity_rows,
        })
    }
}

/// Beats on each stream of a collision with its impulses, if the collision lies on the streams as in the
/// other passes, the impulses lie behind it, and it comes in an interval.
fn warm_share(stripe: &Stripe, widths: &[u32], interval: u64) -> Option<PerStream> {
    const BEATS: usize = collision::WARM_ROWS;
    let striping = Striping::new(stripe, widths);
    let mut walk = striping.places(0);
    let mut places = [(0, 0); BEATS];
    places.fill_with(|| walk.take());
    let [record @ .., impulses] = places;
    let known = record == batch::PLACES && impulses == batch::IMPULSES;
    let whole = BEATS.is_multiple_of(stripe.streams.len());
    (known && whole && striping.cycles(BEATS) <= interval).then(|| striping.counts(BEATS))
}

#[cfg(test)]
mod tests {
    use super::*;
    use pgs_interface::profile::{FLOAT, HALF, NAIVE, Profile};

    fn layout(profile: &'static Profile) -> Option<Layout> {
        Layout::of(&BoardConfig { profile, ..BoardConfig::default() })
    }

    #[test]
    fn collisions_of_float_are_taken_as_they_are() {
        let float = layout(&FLOAT).expect("it has short cuts");
        assert!(float.in_place);
        assert_eq!(float.bodies, Some(Turns { streams: 4 }));
        assert_eq!((float.share, float.warm_share), ([2, 2, 2, 1], Some([2; 4])));
    }

    #[test]
    fn world_inertia_takes_the_same_way_where_numbers_have_thirty_two_bits() {
        let inertia = Inertia::World;
        let config = BoardConfig { inertia, ..BoardConfig::default() };
        let layout = Layout::of(&config).expect("it has short cuts");
        assert_eq!((layout.inertia, layout.velocity_rows), (inertia, 4));
        assert!(layout.bodies.is_some());
    }

    #[test]
    fn issues_of_half_are_translated_and_its_bodies_go_the_long_way() {
        let half = layout(&HALF).expect("it has short cuts");
        assert_eq!((half.in_place, half.together, half.precision), (false, 2, Precision::Binary16));
        assert_eq!((half.share, half.bodies), ([3, 3, 1, 0], None));
        let on = |stream| [(stream, 0), (stream, 1), (stream, 2)];
        assert_eq!(half.places[..3], on(0));
        assert_eq!(half.places[3..6], on(1));
        assert_eq!(half.places[6], (2, 0));
    }

    #[test]
    fn bodies_that_lie_otherwise_go_the_long_way_alone() {
        static APART: Profile = Profile {
            stripes: Stripes {
                velocities: Stripe { streams: &[2], padded: false },
                ..FLOAT.stripes
            },
            ..FLOAT
        };
        static PADDED: Profile = Profile {
            stripes: Stripes {
                results: Stripe { streams: &[0, 1, 2], padded: true },
                ..FLOAT.stripes
            },
            ..FLOAT
        };
        static FEWER_OUT: Profile = Profile { s2mm_widths: &[128; 2], ..FLOAT };
        for profile in [&APART, &PADDED, &FEWER_OUT] {
            let layout = layout(profile).expect("its collisions have short cuts");
            assert_eq!(layout.bodies, None, "{:?}", profile.stripes);
        }
    }

    /// Each condition on a design, one by one.
    #[test]
    fn others_go_the_long_way() {
        assert!(layout(&NAIVE).is_none());
        let usual = BoardConfig::default();
        for config in [
            BoardConfig { inertia: Inertia::World, profile: &HALF, ..usual },
            BoardConfig { hazards: Hazards::Unchecked, ..usual },
            BoardConfig { subnormals: Subnormals::Flush, ..usual },
        ] {
            assert!(Layout::of(&config).is_none(), "{config:?}");
        }
        // Groups across collisions, a stream without any, collisions on other streams.
        const fn striped(streams: &'static [u8], of: Profile) -> Profile {
            let collisions = Stripe { streams, padded: false };
            Profile { stripes: Stripes { collisions, ..of.stripes }, ..of }
        }
        static ACROSS: Profile = striped(&[0, 1], FLOAT);
        static WITHOUT: Profile = striped(&[0, 1, 0, 1, 0, 1, 0], FLOAT);
        // A step with impulses alone does, where these lie elsewhere or make a record too long.
        const fn warm(streams: &'static [u8], interval: u32) -> Profile {
            let stripe = Stripe { streams, padded: false };
            let stripes = FLOAT.stripes.with_warm_collisions(stripe);
            Profile { stripes, initiation_interval: interval, ..FLOAT }
        }
        static BEFORE: Profile = warm(&[3, 0, 1, 2], 2);
        static LONG: Profile = warm(&[0, 1, 2, 3], 1);
        for profile in [&BEFORE, &LONG] {
            let layout = layout(profile).expect("its collisions have short cuts");
            assert_eq!(layout.warm_share, None);
        }
        static OTHER: Profile = striped(&[0, 1, 2, 3, 2, 1, 0], FLOAT);
        for profile in [&ACROSS, &WITHOUT, &OTHER] {
            assert!(layout(profile).is_none(), "{:?}", profile.stripes.collisions);
        }
    }
}
