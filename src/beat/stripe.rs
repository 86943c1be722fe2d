//! This file says which channel a beat travels on, and where in that channel's segment it lies.
//!
//! Collisions are striped by the beat's place in its record, so that a collision arrives on all
//! channels at once; everything else by the running beat index over the whole array, so that all
//! channels are busy:
//!
//! ```text
//! four channels     0        1        2        3
//! collisions        r0.0     r0.1     r0.2     r0.3       rN.b: beat b of record N
//!                   r0.4     r0.5     r0.6
//!                   r1.0     r1.1     r1.2     r1.3
//!                   r1.4     r1.5     r1.6
//! velocities,       r0.0     r0.1     r1.0     r1.1
//! poses             r2.0     r2.1
//! results           r0.0     r0.1     r0.2     r0.3
//! ```
//!
//! Source: interface specification, channel striping.

use crate::interface::record::{collision, pose, result, velocity};

/// What a segment of beats carries.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Segment {
    /// Velocity of each body.
    Velocities,
    /// Collisions.
    Collisions,
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

impl Segment {
    /// Beats of one record.
    pub(crate) const fn beats_per_record(self) -> usize {
        match self {
            Self::Velocities => velocity::ROWS,
            Self::Collisions => collision::ROWS,
            Self::Poses => pose::ROWS,
            Self::Results => result::ROWS,
        }
    }

    /// Where beat `beat` of record `record` goes.
    ///
    /// This is the definition. What packs and unpacks without its divisions is tested against it.
    pub(crate) const fn place(self, record: usize, beat: usize, channels: usize) -> Place {
        let (index, first_slot) = match self {
            Self::Collisions => (beat, record * share(collision::ROWS, beat % channels, channels)),
            Self::Velocities | Self::Poses | Self::Results => {
                (record * self.beats_per_record() + beat, 0)
            }
        };
        Place { channel: index % channels, slot: first_slot + index / channels }
    }
}

/// Beats that `records` records of a segment put on `channel` of `channels`.
///
/// 0 means that the segment has no packet on this channel.
pub(crate) const fn beats_on_channel(
    segment: Segment,
    records: usize,
    channel: usize,
    channels: usize,
) -> usize {
    match segment {
        Segment::Collisions => records * share(collision::ROWS, channel, channels),
        Segment::Velocities | Segment::Poses | Segment::Results => {
            share(records * segment.beats_per_record(), channel, channels)
        }
    }
}

/// How many of the indices below `count` are `channel` modulo `channels`.
const fn share(count: usize, channel: usize, channels: usize) -> usize {
    count.saturating_sub(channel).div_ceil(channels)
}

#[cfg(test)]
mod tests {
    use super::Segment::{Collisions, Poses, Results, Velocities};
    use super::*;
    use proptest::prelude::*;

    fn counts(segment: Segment, records: usize) -> [usize; 4] {
        [0, 1, 2, 3].map(|channel| beats_on_channel(segment, records, channel, 4))
    }

    #[test]
    fn four_channels_carry_what_the_specification_says() {
        assert_eq!(counts(Velocities, 38_880), [19_440; 4]);
        assert_eq!(counts(Poses, 38_880), [19_440; 4]);
        assert_eq!(counts(Results, 38_880), [38_880; 4]);
        assert_eq!(counts(Collisions, 127_000), [254_000, 254_000, 254_000, 127_000]);
    }

    #[test]
    fn a_segment_without_beats_on_a_channel_counts_zero_there() {
        assert_eq!(counts(Velocities, 1), [1, 1, 0, 0]);
        assert_eq!(counts(Velocities, 3), [2, 2, 1, 1]);
        assert_eq!(counts(Results, 1), [1; 4]);
        assert_eq!(counts(Collisions, 0), [0; 4]);
        assert_eq!(counts(Collisions, 1), [2, 2, 2, 1]);
    }

    #[test]
    fn the_places_of_the_drawing_are_these() {
        let at = |segment: Segment, record, beat| {
            let Place { channel, slot } = segment.place(record, beat, 4);
            (channel, slot)
        };
        assert_eq!(at(Collisions, 0, 4), (0, 1));
        assert_eq!(at(Collisions, 0, 6), (2, 1));
        assert_eq!(at(Collisions, 1, 0), (0, 2));
        assert_eq!(at(Collisions, 1, 3), (3, 1));
        assert_eq!(at(Collisions, 1, 6), (2, 3));
        assert_eq!(at(Velocities, 1, 0), (2, 0));
        assert_eq!(at(Poses, 1, 1), (3, 0));
        assert_eq!(at(Velocities, 2, 1), (1, 1));
        assert_eq!(at(Results, 5, 2), (2, 5));
    }

    proptest! {
        #[test]
        fn striping_is_a_bijection_onto_the_channels(
            segment in prop::sample::select(vec![Velocities, Collisions, Poses, Results]),
            records in 0_usize..60,
            channels in 1_usize..=4,
        ) {
            let mut places = Vec::new();
            for record in 0..records {
                for beat in 0..segment.beats_per_record() {
                    places.push(segment.place(record, beat, channels));
                }
            }
            places.sort_unstable();
            let mut every_slot = Vec::new();
            for channel in 0..channels {
                for slot in 0..beats_on_channel(segment, records, channel, channels) {
                    every_slot.push(Place { channel, slot });
                }
            }
            prop_assert_eq!(places, every_slot);
        }
    }
}
