//! Maps a beat to its channel, and to its slot in that channel's segment.
//!
//! The beats of a segment are numbered through from the first beat of its first record. The
//! profile's [`Stripe`] deals them out in groups:
//!
//! ```text
//! float             0        1        2        3
//! collisions        r0.0     r0.1     r0.2     r0.3       rN.b: beat b of record N
//!                   r0.4     r0.5     r0.6
//!                   r1.0     r1.1     r1.2     r1.3
//!                   r1.4     r1.5     r1.6
//! velocities,       r0.0     r0.1     r1.0     r1.1
//! poses             r2.0     r2.1
//! results           r0.0     r0.1     r0.2     r0.3
//!
//! half              0        1        2
//! collisions        r0.0     r0.3/1.0 r1.3       the fourth beat is half r0, half r1
//!                   r0.1     r1.1
//!                   r0.2     r1.2
//! velocities,       r0       r2       r4         zeros fill the last group
//! poses             r1       r3
//! ```
//!
//! Source: interface specification, streams.

use pgs_interface::number::StreamFormat;
use pgs_interface::profile::Variant;
use pgs_interface::record::{collision, pose, result};
use pgs_interface::stripe::Stripe;

/// Records of a block. The number is divisible by the records of a group of every stripe, so that
/// each block begins with a group. A block, its beats, and the collisions that are prefetched
/// meanwhile fit in the L1 cache.
pub(crate) const BLOCK: usize = 60;

/// The records that a segment carries.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Segment {
    /// Velocity of each body.
    Velocities,
    /// Collisions.
    Collisions,
    /// Collisions of a warm pass, with their impulses.
    WarmCollisions,
    /// Pose of each body.
    Poses,
    /// New state of each body.
    Results,
}

/// Where a beat goes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct Place {
    /// Channel.
    pub(crate) channel: usize,
    /// Beat of that channel's segment.
    pub(crate) slot: usize,
}

/// How the records of a segment become beats, and how the beats spread over the channels.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Layout {
    /// Rows of a record.
    pub(crate) rows: usize,
    /// Format of its numbers.
    pub(crate) format: StreamFormat,
    /// How beats are dealt out.
    pub(crate) stripe: Stripe,
}

impl Segment {
    /// The layout of the segment in this bitstream.
    pub(crate) const fn layout(self, variant: &Variant) -> Layout {
        let (stripes, numbers) = (&variant.profile.stripes, &variant.numbers);
        let (rows, format, stripe) = match self {
            Self::Velocities => (variant.velocity_rows(), numbers.bodies, stripes.velocities),
            Self::Collisions => (collision::ROWS, numbers.collisions, stripes.collisions),
            Self::WarmCollisions => match stripes.warm_collisions {
                Some(stripe) => (collision::WARM_ROWS, numbers.collisions, stripe),
                // No step of this design has such a pass.
                None => (collision::ROWS, numbers.collisions, stripes.collisions),
            },
            Self::Poses => (pose::ROWS, numbers.poses, stripes.poses),
            Self::Results => (result::ROWS, numbers.poses, stripes.results),
        };
        Layout { rows, format, stripe }
    }
}

impl Layout {
    /// Rows that fit in a beat.
    pub(crate) const fn rows_per_beat(&self) -> usize {
        self.format.rows_per_beat()
    }

    /// Beats of `records` records on all channels, padding included.
    pub(crate) const fn beats(&self, records: usize) -> usize {
        let filled = (records * self.rows).div_ceil(self.rows_per_beat());
        if self.stripe.padded { filled.next_multiple_of(self.stripe.streams.len()) } else { filled }
    }

    /// Beats of `records` records on one channel, padding included; 0 means that the segment has no
    /// packet there.
    pub(crate) fn beats_on_channel(&self, records: usize, channel: usize) -> usize {
        let (group, beats) = (self.stripe.streams, self.beats(records));
        let rest = &group[..beats % group.len()];
        beats / group.len() * share(group, channel) + share(rest, channel)
    }

    /// Where a beat of the segment goes.
    ///
    /// This is the definition. The dealer and the joiner work without its divisions, and tests hold
    /// both against it.
    pub(crate) fn place(&self, beat: usize) -> Place {
        let group = self.stripe.streams;
        let at = beat % group.len();
        let channel = usize::from(group[at]);
        let slot = beat / group.len() * share(group, channel) + share(&group[..at], channel);
        Place { channel, slot }
    }

    /// The beat of the segment that goes to a place of one of its channels.
    pub(crate) fn beat_at(&self, Place { channel, slot }: Place) -> usize {
        let group = self.stripe.streams;
        let share = share(group, channel).max(1);
        let mut of_channel = (0..).zip(group).filter(|(_, of)| usize::from(**of) == channel);
        let at = of_channel.nth(slot % share).map_or(0, |(at, _)| at);
        slot / share * group.len() + at
    }
}

/// Beats of a group, or of a part of one, that go to a channel.
fn share(group: &[u8], channel: usize) -> usize {
    group.iter().filter(|stream| usize::from(**stream) == channel).count()
}

#[cfg(test)]
mod tests {
    use super::Segment::{Collisions, Poses, Results, Velocities, WarmCollisions};
    use super::*;
    use pgs_interface::address_map::DMA_COUNT_MAX;
    use pgs_interface::profile::{FLOAT, HALF, Inertia, NAIVE, PROFILES, Profile};
    use proptest::prelude::*;

    const SEGMENTS: [Segment; 5] = [Velocities, Collisions, WarmCollisions, Poses, Results];

    fn counts<const N: usize>(
        profile: &'static Profile,
        segment: Segment,
        records: usize,
    ) -> [usize; N] {
        let layout = segment.layout(&profile.default_variant());
        assert_eq!(profile.mm2s_widths.len(), N);
        std::array::from_fn(|channel| layout.beats_on_channel(records, channel))
    }

    #[test]
    fn the_channels_of_float_carry_what_the_specification_says() {
        assert_eq!(counts(&FLOAT, Velocities, 38_880), [19_440; 4]);
        assert_eq!(counts(&FLOAT, Poses, 38_880), [19_440; 4]);
        assert_eq!(counts(&FLOAT, Results, 38_880), [38_880; 4]);
        assert_eq!(counts(&FLOAT, Collisions, 127_000), [254_000, 254_000, 254_000, 127_000]);
    }

    #[test]
    fn the_channels_of_half_carry_whole_groups() {
        // 38,880 beats are 7,776 groups of five; 77,760 of results 15,552.
        assert_eq!(counts(&HALF, Velocities, 38_880), [15_552, 15_552, 7_776]);
        assert_eq!(counts(&HALF, Results, 38_880), [31_104, 31_104, 15_552]);
        assert_eq!(counts(&HALF, Collisions, 127_000), [190_500, 190_500, 63_500]);
        // One body, one collision: the rest of the group is padding.
        assert_eq!(counts(&HALF, Poses, 1), [2, 2, 1]);
        assert_eq!(counts(&HALF, Results, 3), [4, 4, 2]);
        assert_eq!(counts(&HALF, Collisions, 1), [3, 3, 1]);
        assert_eq!(counts(&HALF, Collisions, 0), [0; 3]);
    }

    #[test]
    fn naive_ends_with_the_array() {
        assert_eq!(counts(&NAIVE, Collisions, 3), [21]);
        assert_eq!(counts(&NAIVE, Poses, 3), [6]);
    }

    /// No other channel has more beats than in the other passes.
    #[test]
    fn impulses_add_a_beat_of_an_issue_to_the_last_channel() {
        assert_eq!(counts(&NAIVE, WarmCollisions, 5), [40]);
        assert_eq!(counts(&FLOAT, WarmCollisions, 5), [10; 4]);
        assert_eq!(counts(&HALF, WarmCollisions, 5), [9, 9, 6]);
    }

    #[test]
    fn world_inertia_doubles_the_velocities_alone() {
        let world = Variant { inertia: Inertia::World, ..FLOAT.default_variant() };
        assert_eq!(Velocities.layout(&world).beats(5), 20);
        assert_eq!(Poses.layout(&world).beats(5), 10);
    }

    #[test]
    fn a_segment_without_beats_on_a_channel_counts_zero_there() {
        assert_eq!(counts(&FLOAT, Velocities, 1), [1, 1, 0, 0]);
        assert_eq!(counts(&FLOAT, Velocities, 3), [2, 2, 1, 1]);
        assert_eq!(counts(&FLOAT, Results, 1), [1; 4]);
        assert_eq!(counts(&FLOAT, Collisions, 0), [0; 4]);
        assert_eq!(counts(&FLOAT, Collisions, 1), [2, 2, 2, 1]);
    }

    #[test]
    fn the_places_of_the_drawing_are_these() {
        let at = |profile: &'static Profile, segment: Segment, beat| {
            let Place { channel, slot } = segment.layout(&profile.default_variant()).place(beat);
            (channel, slot)
        };
        assert_eq!(at(&FLOAT, Collisions, 4), (0, 1));
        assert_eq!(at(&FLOAT, Collisions, 6), (2, 1));
        assert_eq!(at(&FLOAT, Collisions, 7), (0, 2));
        assert_eq!(at(&FLOAT, Collisions, 7 + 3), (3, 1));
        assert_eq!(at(&FLOAT, Collisions, 7 + 6), (2, 3));
        assert_eq!(at(&FLOAT, Velocities, 2), (2, 0));
        assert_eq!(at(&FLOAT, Poses, 3), (3, 0));
        assert_eq!(at(&FLOAT, Results, 4 * 5 + 2), (2, 5));
        assert_eq!([2, 3, 5].map(|beat| at(&HALF, Collisions, beat)), [(0, 2), (1, 0), (1, 2)]);
        assert_eq!([6, 7].map(|beat| at(&HALF, Collisions, beat)), [(2, 0), (0, 3)]);
        assert_eq!(
            [1, 2, 4, 9].map(|beat| at(&HALF, Poses, beat)),
            [(0, 1), (1, 0), (2, 0), (2, 1)]
        );
    }

    /// The packer relies on this for every profile.
    #[test]
    fn zeros_pad_whole_issues_of_every_profile() {
        for profile in PROFILES {
            let variant = profile.default_variant();
            for segment in SEGMENTS {
                let Stripe { streams, .. } = segment.layout(&variant).stripe;
                let channels = profile.mm2s_widths.len();
                assert!(
                    (1..=DMA_COUNT_MAX).contains(&channels)
                        && profile.s2mm_widths.len() == channels
                );
                assert!(streams.iter().all(|stream| usize::from(*stream) < channels));
            }
            for segment in SEGMENTS {
                let layout = segment.layout(&variant);
                let (beats, group) = (layout.beats(BLOCK), layout.stripe.streams.len());
                assert!(beats.is_multiple_of(group), "{} {segment:?}", profile.name);
                assert_eq!(beats * layout.rows_per_beat(), BLOCK * layout.rows);
            }
            let layout = Collisions.layout(&variant);
            let issue = profile.collisions_per_issue as usize;
            for records in 0..=2 * issue {
                let rows = layout.beats(records) * layout.rows_per_beat();
                let whole = records.next_multiple_of(issue) * layout.rows;
                assert!(rows >= whole, "{}: {records} collisions", profile.name);
            }
        }
    }

    proptest! {
        #[test]
        fn striping_is_a_bijection_onto_the_channels(
            segment in prop::sample::select(SEGMENTS.to_vec()),
            records in 0_usize..60,
            profile in prop::sample::select(PROFILES.to_vec()),
            inertia in prop::sample::select(vec![Inertia::Isotropic, Inertia::World]),
        ) {
            let layout = segment.layout(&Variant { inertia, ..profile.default_variant() });
            let beats = layout.beats(records);
            let mut places: Vec<_> = (0..beats).map(|beat| layout.place(beat)).collect();
            for (beat, place) in places.iter().enumerate() {
                prop_assert_eq!(layout.beat_at(*place), beat);
            }
            places.sort_unstable();
            let mut every_slot = Vec::new();
            for channel in 0..profile.mm2s_widths.len() {
                for slot in 0..layout.beats_on_channel(records, channel) {
                    every_slot.push(Place { channel, slot });
                }
            }
            prop_assert_eq!(places, every_slot);
        }
    }
}
