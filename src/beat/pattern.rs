//! This file knows the stripes of the profiles when it is compiled.

use bitstream_model::interface::profile::{FLOAT, HALF, MIXED, NAIVE, WINDOWED};

use super::stripe::Place;

/// A stripe of one of the profiles.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Pattern {
    FloatCollisions,
    HalfCollisions,
    HalfBodies,
    /// A beat for each of so many channels, in their order.
    One,
    Two,
    Three,
    Four,
}

/// Where the beats of a unit go, by channels from the first of the stripe on.
pub(super) trait Places<const BEATS: usize> {
    const PLACES: [Place; BEATS];
}

macro_rules! places {
    ($($pattern:ident: $streams:expr;)*) => {
        impl Pattern {
            /// That of a group, if it is one of these, and its first channel.
            pub(super) fn of(group: &[u8]) -> Option<(Self, usize)> {
                let first = *group.iter().min()?;
                let is = |streams: &[u8]| {
                    streams.len() == group.len()
                        && streams.iter().zip(group).all(|(to, stream)| *to + first == *stream)
                };
                let found = None
                    $(.or_else(|| is($streams).then_some(Self::$pattern)))*;
                found.map(|pattern| (pattern, usize::from(first)))
            }
        }
        $(
            pub(super) struct $pattern;
            impl<const BEATS: usize> Places<BEATS> for $pattern {
                const PLACES: [Place; BEATS] = dealt($streams);
            }
        )*
    };
}
places! {
    FloatCollisions: FLOAT.stripes.collisions.streams;
    HalfCollisions: HALF.stripes.collisions.streams;
    HalfBodies: HALF.stripes.poses.streams;
    One: NAIVE.stripes.collisions.streams;
    Two: WINDOWED.stripes.collisions.streams;
    Three: MIXED.stripes.collisions.streams;
    Four: FLOAT.stripes.poses.streams;
}

/// Where beats go that are dealt out in groups.
const fn dealt<const BEATS: usize>(streams: &[u8]) -> [Place; BEATS] {
    let mut places = [Place { channel: 0, slot: 0 }; BEATS];
    let mut at = 0;
    while at < BEATS {
        places[at].channel = streams[at % streams.len()] as usize;
        let mut before = 0;
        while before < at {
            if places[before].channel == places[at].channel {
                places[at].slot += 1;
            }
            before += 1;
        }
        at += 1;
    }
    places
}
