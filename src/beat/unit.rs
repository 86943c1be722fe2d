//! This file writes records to the channels in the stripes of the profiles, which are known when it is
//! compiled.
//!
//! A *unit* is as many records as fill whole groups of a stripe. Its rows go from registers to their
//! places in whole beats, on each channel upwards, with nothing in between.

use std::mem;

use bitstream_model::interface::profile::{FLOAT, HALF, MIXED, NAIVE, WINDOWED};
use bitstream_model::interface::record::Beat;
use bytemuck::{Pod, Zeroable as _};

use super::stripe::Place;
use crate::platform::{Lanes, Vectors, soon_written_behind};
use crate::record::sixteen::{Row, Sixteen};

/// Records on their way, in f32.
///
/// `get` is a part of the loop that asks: an `#[inline(always)]` belongs to every implementation.
pub(super) trait Records<const ROWS: usize> {
    /// Rows whose word is an unsigned integer.
    const INTEGERS: [bool; ROWS];

    /// How many there are.
    fn len(&self) -> usize;

    /// One of them, if there is one. Each is asked for once, in their order.
    fn get(&mut self, at: usize) -> Option<[Lanes; ROWS]>;
}

/// What rows become in a stream.
pub(super) trait Format: Copy {
    /// Rows of a beat.
    const PER_BEAT: usize;

    type Row: Pod;

    /// The beat of the first of these rows, of which there are as many as it takes. An
    /// `#[inline(always)]` belongs to every implementation.
    fn beat(rows: &[Self::Row]) -> Beat;

    /// The rows of a record. Likewise.
    fn rows<V: Vectors, R: Records<ROWS>, const ROWS: usize>(
        self,
        vectors: V,
        record: [Lanes; ROWS],
    ) -> [Self::Row; ROWS];
}

/// Words of f32.
#[derive(Clone, Copy)]
pub(super) struct Whole;

impl Format for Whole {
    const PER_BEAT: usize = 1;

    type Row = Beat;

    #[inline(always)]
    fn beat(rows: &[Beat]) -> Beat {
        rows[0]
    }

    #[inline(always)]
    fn rows<V: Vectors, R: Records<ROWS>, const ROWS: usize>(
        self,
        _: V,
        record: [Lanes; ROWS],
    ) -> [Beat; ROWS] {
        let mut rows = [Beat::default(); ROWS];
        for (to, row) in rows.iter_mut().zip(&record) {
            *to = (*row).into();
        }
        rows
    }
}

/// Words of binary16.
#[derive(Clone, Copy)]
pub(super) struct Binary16;

/// Words of the thesis' sixteen bits.
#[derive(Clone, Copy)]
pub(super) struct Thesis16;

/// A format of two rows a beat.
macro_rules! sixteen {
    ($format:ident) => {
        impl Format for $format {
            const PER_BEAT: usize = 2;

            type Row = Row;

            #[inline(always)]
            fn beat(rows: &[Row]) -> Beat {
                bytemuck::cast([rows[0], rows[1]])
            }

            #[inline(always)]
            fn rows<V: Vectors, R: Records<ROWS>, const ROWS: usize>(
                self,
                vectors: V,
                record: [Lanes; ROWS],
            ) -> [Row; ROWS] {
                Sixteen::$format.narrow(vectors, record, &R::INTEGERS)
            }
        }
    };
}
sixteen!(Binary16);
sixteen!(Thesis16);

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
trait Places<const BEATS: usize> {
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
            struct $pattern;
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

/// Writes as many records as fill whole units, and adds the words written to `sum`; how many records
/// these are. `rest` is what is not written yet of the channels, from the first of the stripe on.
#[inline(always)]
pub(super) fn write<V: Vectors, F: Format, R: Records<ROWS>, const ROWS: usize>(
    pattern: Pattern,
    (vectors, format): (V, F),
    records: &mut R,
    rest: &mut [&mut [Beat]],
    sum: &mut Lanes,
) -> usize {
    // Units of so many records, which are so many beats: on each channel so many of them.
    macro_rules! units {
        ($places:ident: $records:literal are $beats:literal: $($channel:ident $share:literal),*) => {
            if $records * ROWS == $beats * F::PER_BEAT {
                let count = records.len() / $records;
                let mut rest = rest.iter_mut();
                $(let Some($channel) = part::<$share>(rest.next(), count) else { return 0 };)*
                for at in 0..count {
                    unit::<$places, V, F, R, ROWS, $records, $beats, _>(
                        (vectors, format), records, at, [$(&mut $channel[at]),*], sum,
                    );
                }
                return count * $records;
            }
        };
    }
    match pattern {
        Pattern::FloatCollisions => units!(FloatCollisions: 1 are 7: a 2, b 2, c 2, d 1),
        Pattern::HalfCollisions => units!(HalfCollisions: 2 are 7: a 3, b 3, c 1),
        Pattern::HalfBodies => {
            units!(HalfBodies: 5 are 5: a 2, b 2, c 1);
            units!(HalfBodies: 5 are 10: a 4, b 4, c 2);
        }
        Pattern::One => {
            units!(One: 1 are 7: a 7);
            units!(One: 1 are 1: a 1);
            units!(One: 1 are 2: a 2);
            units!(One: 1 are 4: a 4);
        }
        Pattern::Two => {
            units!(Two: 2 are 14: a 7, b 7);
            units!(Two: 1 are 6: a 3, b 3);
            units!(Two: 2 are 6: a 3, b 3);
        }
        Pattern::Three => {
            units!(Three: 1 are 3: a 1, b 1, c 1);
            units!(Three: 3 are 6: a 2, b 2, c 2);
            units!(Three: 3 are 12: a 4, b 4, c 4);
        }
        Pattern::Four => {
            units!(Four: 2 are 4: a 1, b 1, c 1, d 1);
            units!(Four: 1 are 4: a 1, b 1, c 1, d 1);
        }
    }
    0
}

/// The next `count` times `S` beats of a channel.
#[inline(always)]
fn part<'b, const S: usize>(
    rest: Option<&mut &'b mut [Beat]>,
    count: usize,
) -> Option<&'b mut [[Beat; S]]> {
    let rest = rest?;
    let (part, behind) = mem::take(rest).split_at_mut(count * S);
    *rest = behind;
    part.as_chunks_mut().0.get_mut(..count)
}

/// Writes one unit.
#[inline(always)]
fn unit<
    P: Places<BEATS>,
    V: Vectors,
    F: Format,
    R: Records<ROWS>,
    const ROWS: usize,
    const RECORDS: usize,
    const BEATS: usize,
    const CHANNELS: usize,
>(
    (vectors, format): (V, F),
    records: &mut R,
    unit: usize,
    to: [&mut [Beat]; CHANNELS],
    sum: &mut Lanes,
) {
    for channel in &to {
        soon_written_behind(channel);
    }
    let mut rows = [[F::Row::zeroed(); ROWS]; RECORDS];
    for (at, to) in rows.iter_mut().enumerate() {
        let Some(record) = records.get(unit * RECORDS + at) else { return };
        *to = format.rows::<V, R, ROWS>(vectors, record);
    }
    let rows = rows.as_flattened();
    for at in 0..BEATS {
        let Place { channel, slot } = P::PLACES[at];
        let beat = F::beat(&rows[at * F::PER_BEAT..]);
        to[channel][slot] = beat;
        *sum = sum.plus(beat.into());
    }
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

#[cfg(test)]
mod tests {
    use bitstream_model::interface::profile::{Inertia, PROFILES, Variant};
    use bitstream_model::interface::record::LANES;

    use super::super::deal::BLOCK;
    use super::super::stripe::{Layout, Segment};
    use super::*;
    use crate::platform::{Work, in_wide_vectors};

    /// The places that a pattern has for so many beats.
    fn places<const BEATS: usize>(pattern: Pattern) -> [Place; BEATS] {
        match pattern {
            Pattern::FloatCollisions => FloatCollisions::PLACES,
            Pattern::HalfCollisions => HalfCollisions::PLACES,
            Pattern::HalfBodies => HalfBodies::PLACES,
            Pattern::One => One::PLACES,
            Pattern::Two => Two::PLACES,
            Pattern::Three => Three::PLACES,
            Pattern::Four => Four::PLACES,
        }
    }

    #[test]
    fn what_is_sent_in_a_stripe_of_a_profile_goes_where_the_definition_says() {
        for profile in PROFILES {
            for segment in [Segment::Velocities, Segment::Collisions, Segment::Poses] {
                let layout: Layout = segment.layout(&profile.default_variant());
                let (pattern, first) =
                    Pattern::of(layout.stripe.streams).expect("every stripe of a profile is known");
                for (beat, place) in places::<30>(pattern).into_iter().enumerate() {
                    let place = Place { channel: first + place.channel, ..place };
                    assert_eq!(place, layout.place(beat), "{} {segment:?}", profile.name);
                }
            }
        }
        assert_eq!(Pattern::of(&[2, 3]), Some((Pattern::Two, 2)));
        assert_eq!([&[][..], &[1, 0], &[0, 1, 1], &[0, 0]].map(Pattern::of), [None; 4]);
    }

    /// A block of records of zeros.
    struct Zeros;

    impl<const ROWS: usize> Records<ROWS> for Zeros {
        const INTEGERS: [bool; ROWS] = [false; ROWS];

        #[inline(always)]
        fn len(&self) -> usize {
            BLOCK
        }

        #[inline(always)]
        fn get(&mut self, _: usize) -> Option<[Lanes; ROWS]> {
            Some([Lanes::new([0; LANES]); ROWS])
        }
    }

    /// How many of them a layout has written by units.
    struct Written<const ROWS: usize>(Layout);

    impl<const ROWS: usize> Work for Written<ROWS> {
        type Output = usize;

        #[inline(always)]
        fn run<V: Vectors>(self, vectors: V) -> usize {
            let Self(layout) = self;
            let (pattern, _) = Pattern::of(layout.stripe.streams).expect("a known one");
            let mut beats = vec![Beat::default(); 4 * BLOCK * ROWS];
            let mut rest: Vec<&mut [Beat]> = beats.chunks_mut(BLOCK * ROWS).collect();
            let sum = &mut Lanes::all(0);
            match Sixteen::of(layout.format) {
                None => {
                    write::<_, _, _, ROWS>(pattern, (vectors, Whole), &mut Zeros, &mut rest, sum)
                }
                Some(Sixteen::Binary16) => {
                    write::<_, _, _, ROWS>(pattern, (vectors, Binary16), &mut Zeros, &mut rest, sum)
                }
                Some(Sixteen::Thesis16) => {
                    write::<_, _, _, ROWS>(pattern, (vectors, Thesis16), &mut Zeros, &mut rest, sum)
                }
            }
        }
    }

    /// Otherwise they would be as right, and slower.
    #[test]
    fn all_records_of_the_profiles_are_written_by_units() {
        for profile in PROFILES {
            for inertia in [Inertia::Isotropic, Inertia::World] {
                let variant = Variant { inertia, ..profile.default_variant() };
                for segment in [Segment::Velocities, Segment::Collisions, Segment::Poses] {
                    let layout = segment.layout(&variant);
                    let written = match layout.rows {
                        2 => in_wide_vectors(Written::<2>(layout)),
                        4 => in_wide_vectors(Written::<4>(layout)),
                        6 => in_wide_vectors(Written::<6>(layout)),
                        7 => in_wide_vectors(Written::<7>(layout)),
                        rows => panic!("{rows} rows are those of no record"),
                    };
                    assert_eq!(written, BLOCK, "{} {segment:?} {inertia:?}", profile.name);
                }
            }
        }
    }
}
