//! Turns a caller's values into the rows of a record, and a result record back.
//!
//! A row is four words of 32 bits, which is one beat of an f32 stream. The layout is that of
//! [`interface::record`](pgs_interface::record). `beat` makes the words of other streams, and
//! decides which channel a beat travels on.

pub(crate) mod body;
pub(crate) mod body_table;
pub(crate) mod collision;
pub(crate) mod inertia;
pub(crate) mod result;

use pgs_interface::record::{Beat, CONTACT_POINTS, LANES, WORD_LANE};

/// The largest number of contact points of a collision.
#[expect(clippy::cast_possible_truncation, reason = "four")]
pub(crate) const FULL: u32 = CONTACT_POINTS as u32;

/// An f32 without its sign.
pub(crate) const MAGNITUDE: u32 = u32::MAX >> 1;

/// The largest magnitudes of some rows, lane by lane, as bits. The bits of magnitudes are in the
/// order of the magnitudes, and infinity and NaN are above all numbers.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Magnitudes([u32; LANES]);

impl Magnitudes {
    /// Takes one more row.
    #[inline(always)]
    pub(crate) fn see(&mut self, row: Beat) {
        for (largest, word) in self.0.iter_mut().zip(row.0) {
            *largest = (*largest).max(word & MAGNITUDE);
        }
    }

    /// The largest magnitudes of the vec3 of each row.
    pub(crate) fn vec3(self) -> [f32; 3] {
        to_vec3(Beat(self.0))
    }

    /// Whether all numbers of all rows are within a limit.
    #[inline(always)]
    pub(crate) fn are_within(&self, limit: f32) -> bool {
        self.0.iter().fold(true, |within, largest| within & (*largest <= limit.to_bits()))
    }

    /// The same without the word beside the vec3 of each row.
    #[inline(always)]
    pub(crate) fn of_vec3_are_within(mut self, limit: f32) -> bool {
        self.0[WORD_LANE] = 0;
        self.are_within(limit)
    }
}

/// A vec3 and the word beside it.
#[inline(always)]
fn vec3_and_word([x, y, z]: [f32; 3], word: u32) -> Beat {
    Beat([x.to_bits(), y.to_bits(), z.to_bits(), word])
}

/// Four numbers, one per lane.
#[inline(always)]
fn vec4(value: [f32; 4]) -> Beat {
    Beat(value.map(f32::to_bits))
}

/// The vec3 of a beat. The word beside it is ignored.
#[inline]
fn to_vec3(Beat([x, y, z, _]): Beat) -> [f32; 3] {
    [f32::from_bits(x), f32::from_bits(y), f32::from_bits(z)]
}

/// The four numbers of a beat.
#[inline]
fn to_vec4(beat: Beat) -> [f32; 4] {
    beat.0.map(f32::from_bits)
}

// `vec3_and_word` and `to_vec3` spell the lanes out.
const _: () = assert!(WORD_LANE == 3);

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_number_is_held_against_the_limit() {
        for (row, all, vec3) in [
            ([2.0, -2.0, 0.0, -2.0], true, true),
            ([0.0, 0.0, 2.0_f32.next_up(), 0.0], false, false),
            ([0.0, f32::NEG_INFINITY, 0.0, 0.0], false, false),
            ([-f32::NAN, 0.0, 0.0, 0.0], false, false),
            ([0.0, 0.0, 0.0, 3.0], false, true),
        ] {
            let mut largest = Magnitudes::default();
            [[0.0; 4], row, [1.0; 4]].into_iter().for_each(|row| largest.see(vec4(row)));
            let found = (largest.are_within(2.0), largest.of_vec3_are_within(2.0));
            assert_eq!(found, (all, vec3), "{row:?}");
        }
    }
}
