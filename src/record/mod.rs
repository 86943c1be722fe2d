//! Turns a caller's values into the rows of a record, and a result record back.
//!
//! One file a record kind makes rows of 32-bit words, each of which is a beat of an f32 stream;
//! `sixteen` narrows rows for the streams of sixteen bits and widens what comes back. The layout is
//! that of [`interface::record`](pgs_interface::record); which channel a beat travels on is
//! decided elsewhere (`beat`).

pub(crate) mod body_table;
pub(crate) mod collision;
pub(crate) mod finite;
pub(crate) mod inertia;
pub(crate) mod largest;
pub(crate) mod pose;
pub(crate) mod relative;
pub(crate) mod result;
pub(crate) mod sixteen;
pub(crate) mod source;
mod thesis16;
pub(crate) mod velocity;

use std::mem::offset_of;
use std::slice;

use bytemuck::Pod;

use crate::scene::{Body, Collision, Contact};
use crate::simd::{Integer, Lanes};
use pgs_interface::record::{Beat, CONTACT_POINTS, LANES, WORD_LANE};

use self::largest::MAGNITUDE;

/// A record on its way, in f32.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Record<const ROWS: usize> {
    /// The last word of a row in which an integer belongs means nothing.
    pub(crate) rows: [Lanes; ROWS],
    /// The unsigned integers in which rows end. They stay where they were found until they stand in their
    /// beat: into a row of numbers and out of a narrowed one they would go twice.
    pub(crate) integers: [Option<Integer>; ROWS],
}

/// A row of a record.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Row {
    /// The last is a number only where there is no integer.
    pub(crate) numbers: Lanes,
    pub(crate) integer: Option<Integer>,
}

impl Row {
    /// Four times zero.
    #[inline(always)]
    pub(crate) fn zero() -> Self {
        Self { numbers: Lanes::all(0), integer: None }
    }

    /// All four words.
    #[inline(always)]
    pub(crate) fn whole(self) -> Lanes {
        match self.integer {
            None => self.numbers,
            Some(integer) => self.numbers.beside(integer.into()),
        }
    }
}

impl<const ROWS: usize> From<[Lanes; ROWS]> for Record<ROWS> {
    /// A record of numbers alone.
    #[inline(always)]
    fn from(rows: [Lanes; ROWS]) -> Self {
        Self { rows, integers: [None; ROWS] }
    }
}

impl<const ROWS: usize> Record<ROWS> {
    /// Gives all rows to `to`, one after the other.
    #[inline(always)]
    pub(crate) fn give(&self, to: &mut impl Rows) {
        // Not all of a loop would be unrolled, and then its rows would go through memory.
        macro_rules! each {
            ($($at:literal)*) => {
                const { assert!(ROWS <= [$($at),*].len(), "all of them are written out") };
                // What there is not is not compiled.
                $(if const { $at < ROWS } {
                    to.row(Row { numbers: self.rows[$at], integer: self.integers[$at] });
                })*
            };
        }
        each!(0 1 2 3 4 5 6);
    }

    /// Its rows, all of each.
    #[cfg(test)]
    pub(crate) fn whole(self) -> [Lanes; ROWS] {
        std::array::from_fn(|at| Row { numbers: self.rows[at], integer: self.integers[at] }.whole())
    }
}

/// Where the rows of records go.
///
/// It is a part of the loop that gives: an `#[inline(always)]` belongs to every implementation.
pub(crate) trait Rows {
    /// Takes the next.
    fn row(&mut self, row: Row);
}

/// A vec3 and the word beside it.
#[inline(always)]
fn vec3_and_word([x, y, z]: [f32; 3], word: u32) -> Lanes {
    Lanes::new([x.to_bits(), y.to_bits(), z.to_bits(), word])
}

/// Four words of a structure, from its word `AT` on: a vec4, or a vec3 and whatever follows it.
#[inline(always)]
fn row_of<const AT: usize, T: Pod>(structure: &T) -> Lanes {
    const { assert!(4 * (AT + LANES) <= size_of::<T>(), "they are its words") };
    let words: &[u32] = bytemuck::cast_slice(slice::from_ref(structure));
    words[AT..].first_chunk().map_or(Lanes::all(0), |row| Lanes::new(*row))
}

/// A vec3 beside zero.
#[inline(always)]
pub(crate) fn alone(row: Lanes) -> Lanes {
    row.and(Lanes::new([u32::MAX, u32::MAX, u32::MAX, 0]))
}

/// The indices of the bodies of a collision.
#[inline(always)]
pub(crate) fn bodies(collision: &Collision) -> [Integer; 2] {
    let words = body_words(collision);
    [Integer::new::<0>(words), Integer::new::<1>(words)]
}

/// The same, as the first two of four words.
#[inline(always)]
pub(crate) fn body_words(collision: &Collision) -> Lanes {
    row_of::<BODIES, _>(collision)
}

/// The normal of a collision beside its count.
#[inline(always)]
pub(crate) fn normal_and_count(collision: &Collision) -> Lanes {
    row_of::<NORMAL, _>(collision)
}

/// The word with which the indices of a collision's bodies begin, B's behind A's.
const BODIES: usize = offset_of!(Collision, body_a) / 4;
const _: () = assert!(offset_of!(Collision, body_b) == 4 * (BODIES + 1));

/// The word with which the normal of a collision begins.
const NORMAL: usize = offset_of!(Collision, normal) / 4;

/// Where a row with the angular velocity of a body has its shape.
const SHAPE: usize = offset_of!(Body, shape) / 4 - ANGULAR;

/// The words with which the vectors of a body begin.
const POSITION: usize = offset_of!(Body, pose.position) / 4;
const ORIENTATION: usize = offset_of!(Body, pose.orientation) / 4;
const LINEAR: usize = offset_of!(Body, velocity.linear) / 4;
const ANGULAR: usize = offset_of!(Body, velocity.angular) / 4;

/// Four numbers, one a lane.
#[inline(always)]
fn vec4(value: [f32; 4]) -> Lanes {
    Lanes::new(value.map(f32::to_bits))
}

/// All four contact points of a collision beside their distances.
#[inline(always)]
pub(crate) fn contact_rows(collision: &Collision) -> [Lanes; CONTACT_POINTS] {
    let row = |contact: &Contact| vec3_and_word(contact.point, contact.distance.to_bits());
    collision.contacts.each_ref().map(row)
}

/// A collision, and whether it is known to have all contact points: nothing is masked of it then.
#[derive(Clone, Copy)]
pub(crate) struct Counted<'a> {
    pub(crate) collision: &'a Collision,
    full: bool,
}

impl<'a> Counted<'a> {
    /// One that is known to have all.
    #[inline(always)]
    pub(crate) fn full(collision: &'a Collision) -> Self {
        debug_assert_eq!(collision.count, FULL, "it has all");
        Self { collision, full: true }
    }

    /// How many it has.
    #[inline(always)]
    pub(crate) const fn count(self) -> u32 {
        // Where it is known, all that depends on it is known when it is compiled.
        if self.full { FULL } else { self.collision.count }
    }
}

impl<'a> From<&'a Collision> for Counted<'a> {
    /// One of any count.
    #[inline(always)]
    fn from(collision: &'a Collision) -> Self {
        Self { collision, full: false }
    }
}

/// As many contact points as a collision may have.
#[expect(clippy::cast_possible_truncation, reason = "four")]
pub(crate) const FULL: u32 = CONTACT_POINTS as u32;

/// The bits of the contact points of a collision that are used: all of each, or none. Of a count beyond
/// `i32`, which validation refuses, none are.
///
/// Without a branch: where it is not known that a collision has all ([`Counted`]), counts follow no pattern that
/// could be predicted.
#[inline(always)]
pub(crate) fn used(count: u32) -> [Lanes; CONTACT_POINTS] {
    let mut used = [Lanes::all(count); CONTACT_POINTS];
    for (ordinal, used) in (0..).zip(&mut used) {
        *used = used.above(Lanes::all(ordinal));
    }
    used
}

/// The bits of the magnitudes of the contact points that are used, as [`used`]. These are looked up: it takes
/// fewer instructions than to compare, and to take the sign off. Of a count beyond four, which validation
/// refuses, it is not said which.
#[inline(always)]
pub(crate) fn used_magnitudes(count: u32) -> [Lanes; CONTACT_POINTS] {
    USED_MAGNITUDES[count as usize % USED_MAGNITUDES.len()].map(Lanes::from)
}

static USED_MAGNITUDES: [[Beat; CONTACT_POINTS]; (CONTACT_POINTS + 1).next_power_of_two()] = {
    let mut table = [[Beat([0; LANES]); CONTACT_POINTS]; (CONTACT_POINTS + 1).next_power_of_two()];
    let mut count = 0;
    while count <= CONTACT_POINTS {
        let mut ordinal = 0;
        while ordinal < count {
            table[count][ordinal] = Beat([MAGNITUDE; LANES]);
            ordinal += 1;
        }
        count += 1;
    }
    table
};

/// The vec3 of a beat, whatever the word beside it.
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
    fn magnitudes_that_are_used_are_those_of_what_is_used() {
        for count in 0..=4 {
            let magnitudes = used_magnitudes(count).map(Lanes::words);
            assert_eq!(magnitudes, used(count).map(|used| used.and(Lanes::all(MAGNITUDE)).words()));
        }
        // Whatever they are of others, they are all of a row, or none.
        for count in [5, 7, 8, u32::MAX] {
            for row in used_magnitudes(count).map(Lanes::words) {
                assert!([[0; LANES], [MAGNITUDE; LANES]].contains(&row), "{count}: {row:x?}");
            }
        }
    }
}
