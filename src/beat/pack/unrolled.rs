//! Writes records to the channels, stripe by stripe, in loops that the compiler unrolls.
//!
//! A *unit* is a number of records that fills whole groups of a stripe. Its rows go from registers
//! to the channels in whole beats, upwards on each channel, without a copy in between.

use std::mem;

use pgs_interface::record::Beat;
use pgs_support::chunks::Chunks;

use super::pattern::{self, Pattern, Places};
use crate::beat::format::{Beats, Join, Records};
use crate::beat::stripe::Place;
use crate::record::{Row, Rows};
use crate::simd::{Lanes, Vectors};

/// Writes the records that fill whole units, adds the words written to `sum`, and returns the
/// number of these records. `rest` is the unwritten part of the channels, from the first channel of
/// the stripe on.
#[inline(always)]
pub(crate) fn write<V: Vectors, F: Join, R: Records<ROWS>, const ROWS: usize>(
    pattern: Pattern,
    vectors: V,
    records: &mut R,
    rest: &mut [&mut [Beat]],
    sum: &mut Lanes,
) -> usize {
    macro_rules! unit {
        ($places:ident: $records:literal are $beats:literal: $($channel:ident $share:literal),*) => {
            if const { $records * ROWS == $beats * F::PER_BEAT } {
                // Inlined together with the loops of all other units, this loop would have hardly a
                // register.
                let begin = (*records, *sum);
                let written;
                (*records, *sum, written) = vectors.apart(move || {
                    let (mut records, mut sum) = begin;
                    let count = records.len() / $records;
                    let mut rest = rest.iter_mut();
                    $(let Some($channel) = part::<$share>(rest.next(), count) else {
                        return (records, sum, 0);
                    };)*
                    const CHANNELS: usize = [$($share),*].len();
                    for at in 0..count {
                        unit::<pattern::$places, V, F, R, ROWS, $records, $beats, CHANNELS>(
                            vectors, &mut records, at, [$(&mut $channel[at]),*], &mut sum,
                        );
                    }
                    (records, sum, count * $records)
                });
                return written;
            }
        };
    }
    pattern::units!(pattern, unit);
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
    part.split_arrays_mut().0.get_mut(..count)
}

/// Writes one unit.
#[inline(always)]
fn unit<
    P: Places<BEATS>,
    V: Vectors,
    F: Join,
    R: Records<ROWS>,
    const ROWS: usize,
    const RECORDS: usize,
    const BEATS: usize,
    const CHANNELS: usize,
>(
    vectors: V,
    records: &mut R,
    unit: usize,
    to: [&mut [Beat]; CHANNELS],
    sum: &mut Lanes,
) {
    let mut made = [Beat::default(); BEATS];
    let beats = Beats::<V, F>::new(vectors);
    let mut into = Made { beats, to: &mut made, at: 0 };
    if records.some::<RECORDS>(unit, &mut into).is_none() {
        return;
    }
    debug_assert_eq!(into.at, BEATS, "a unit is whole beats");
    for (beat, Place { channel, slot }) in made.into_iter().zip(P::PLACES) {
        to[channel][slot] = beat;
        *sum = sum.plus(beat.into());
    }
}

/// The beats of a unit, in registers. No beat is stored before the unit is complete, so the
/// compiler may load the sources of a record where it needs them.
struct Made<'a, V, F> {
    beats: Beats<V, F>,
    to: &'a mut [Beat],
    /// The number of beats so far.
    at: usize,
}

impl<V: Vectors, F: Join> Rows for Made<'_, V, F> {
    #[inline(always)]
    fn row(&mut self, row: Row) {
        let Some(beat) = self.beats.with(row) else { return };
        if let Some(to) = self.to.get_mut(self.at) {
            *to = beat;
            self.at += 1;
        }
    }
}

#[cfg(test)]
mod tests {
    use pgs_interface::profile::{PROFILES, Variant};

    use super::*;
    use crate::beat::format::in_format;
    use crate::beat::stripe::BLOCK;
    use crate::beat::stripe::{Layout, Segment};
    use crate::simd::{Work, in_wide_vectors};

    /// The places of the first `BEATS` beats of a pattern.
    fn places<const BEATS: usize>(pattern: Pattern) -> [Place; BEATS] {
        match pattern {
            Pattern::FloatCollisions => pattern::FloatCollisions::PLACES,
            Pattern::HalfCollisions => pattern::HalfCollisions::PLACES,
            Pattern::HalfBodies => pattern::HalfBodies::PLACES,
            Pattern::One => pattern::One::PLACES,
            Pattern::Four => pattern::Four::PLACES,
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
        assert_eq!(Pattern::of(&[3]), Some((Pattern::One, 3)));
        assert_eq!([&[][..], &[1, 0], &[0, 1], &[0, 0]].map(Pattern::of), [None; 4]);
    }

    /// A block of records of zeros.
    #[derive(Clone, Copy)]
    struct Zeros;

    impl<const ROWS: usize> Records<ROWS> for Zeros {
        #[inline(always)]
        fn len(&self) -> usize {
            BLOCK
        }

        #[inline(always)]
        fn some<const N: usize>(&mut self, _: usize, to: &mut impl Rows) -> Option<()> {
            (0..N * ROWS).for_each(|_| to.row(Row::zero()));
            Some(())
        }
    }

    /// Counts the records that a layout writes by units.
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
            in_format!(layout.format, F => {
                write::<_, F, _, ROWS>(pattern, vectors, &mut Zeros, &mut rest, sum)
            })
        }
    }

    /// Records outside of units would be as right, and slower.
    #[test]
    fn all_records_of_the_profiles_are_written_by_units() {
        for profile in PROFILES {
            for inertia in profile.inertias() {
                let variant = Variant { inertia: *inertia, ..profile.default_variant() };
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
