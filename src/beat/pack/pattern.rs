//! The stripes of the profiles, and their units, as constants of the compiler.

use pgs_interface::profile::{FLOAT, HALF, NAIVE};

use crate::beat::stripe::Place;

/// A stripe of one of the profiles.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Pattern {
    FloatCollisions,
    HalfCollisions,
    HalfBodies,
    /// A beat for each channel, in order; the name is the number of channels.
    One,
    Four,
}

/// The places of a unit's beats. Channels count from the first channel of the stripe.
pub(crate) trait Places<const BEATS: usize> {
    const PLACES: [Place; BEATS];
}

macro_rules! places {
    ($($pattern:ident: $streams:expr;)*) => {
        impl Pattern {
            /// The pattern of a group, if a profile has it, and the first channel of the group.
            pub(crate) fn of(group: &[u8]) -> Option<(Self, usize)> {
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
            pub(crate) struct $pattern;
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
    Four: FLOAT.stripes.poses.streams;
}

/// The units of a pattern. `HalfBodies: 5 are 10: a 4, b 4, c 2` means that 5 records are 10 beats,
/// 4 on the first channel, 4 on the second and 2 on the third. The macro `each` receives each unit,
/// and returns if the unit fits.
macro_rules! units {
    ($pattern:expr, $each:ident) => {
        match $pattern {
            Pattern::FloatCollisions => $each!(FloatCollisions: 1 are 7: a 2, b 2, c 2, d 1),
            Pattern::HalfCollisions => $each!(HalfCollisions: 2 are 7: a 3, b 3, c 1),
            Pattern::HalfBodies => {
                $each!(HalfBodies: 5 are 5: a 2, b 2, c 1);
                $each!(HalfBodies: 5 are 10: a 4, b 4, c 2);
            }
            Pattern::One => {
                $each!(One: 1 are 7: a 7);
                $each!(One: 1 are 1: a 1);
                $each!(One: 1 are 2: a 2);
                $each!(One: 1 are 4: a 4);
            }
            Pattern::Four => {
                $each!(Four: 2 are 4: a 1, b 1, c 1, d 1);
                $each!(Four: 1 are 4: a 1, b 1, c 1, d 1);
            }
        }
    };
}
pub(crate) use units;

/// The places of beats that are dealt out in groups.
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
