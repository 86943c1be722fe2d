//! Turns a caller's values into the rows of a record, and a result record back.
//!
//! One file per record kind makes rows of 32-bit words; a row is one beat of an f32 stream.
//! `sixteen` narrows rows for streams of sixteen bits and widens results. The layout is that of
//! [`interface::record`](pgs_interface::record). `beat` decides which channel a beat travels on.

pub(crate) mod body_table;
pub(crate) mod collision;
pub(crate) mod finite;
pub(crate) mod inertia;
pub(crate) mod largest;
pub(crate) mod pose;
pub(crate) mod result;
pub(crate) mod sixteen;
pub(crate) mod source;
pub(crate) mod velocity;

use std::mem::offset_of;
use std::slice;

use bytemuck::Pod;

use crate::scene::{Body, Collision, Contact};
use crate::simd::{Integer, Lanes};
use pgs_interface::record::{Beat, CONTACT_POINTS, LANES, WORD_LANE};

/// A record in f32, before it is streamed.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Record<const ROWS: usize> {
    /// In a row with an integer, the last word has no meaning.
    pub(crate) rows: [Lanes; ROWS],
    /// The unsigned integers at the ends of rows. An integer stays in its source vector until its
    /// beat is written: a way through the row of numbers and out of the narrowed row would move it
    /// twice.
    pub(crate) integers: [Option<Integer>; ROWS],
}

/// A row of a record.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Row {
    /// The last word is a number only in a row without an integer.
    pub(crate) numbers: Lanes,
    pub(crate) integer: Option<Integer>,
}

impl Row {
    /// Four zeros.
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
        // Written out: a loop is unrolled only in part, which sends its rows through memory.
        macro_rules! each {
            ($($at:literal)*) => {
                const { assert!(ROWS <= [$($at),*].len(), "all of them are written out") };
                // A row that the record does not have is not compiled.
                $(if const { $at < ROWS } {
                    to.row(Row { numbers: self.rows[$at], integer: self.integers[$at] });
                })*
            };
        }
        each!(0 1 2 3 4 5 6);
    }

    /// The rows with their integers in place.
    #[cfg(test)]
    pub(crate) fn whole(self) -> [Lanes; ROWS] {
        std::array::from_fn(|at| Row { numbers: self.rows[at], integer: self.integers[at] }.whole())
    }
}

/// The destination of a record's rows.
///
/// Every implementation carries `#[inline(always)]`: it becomes a part of the loop that gives the
/// rows.
pub(crate) trait Rows {
    /// Takes the next row.
    fn row(&mut self, row: Row);
}

/// A vec3 and the word beside it.
#[inline(always)]
fn vec3_and_word([x, y, z]: [f32; 3], word: u32) -> Lanes {
    Lanes::new([x.to_bits(), y.to_bits(), z.to_bits(), word])
}

/// Four words of a structure, from its word `AT` on: a vec4, or a vec3 and the word after it.
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

/// The indices of the bodies of a collision, as the first two of four words.
#[inline(always)]
pub(crate) fn body_words(collision: &Collision) -> Lanes {
    row_of::<BODIES, _>(collision)
}

/// The normal of a collision beside its count.
#[inline(always)]
pub(crate) fn normal_and_count(collision: &Collision) -> Lanes {
    row_of::<NORMAL, _>(collision)
}

/// The first of the two words with the indices of a collision's bodies: A, then B.
const BODIES: usize = offset_of!(Collision, body_a) / 4;
const _: () = assert!(offset_of!(Collision, body_b) == 4 * (BODIES + 1));

/// The first word of a collision's normal.
const NORMAL: usize = offset_of!(Collision, normal) / 4;

/// The lane of the shape index in the row that begins with a body's angular velocity.
const SHAPE: usize = offset_of!(Body, shape) / 4 - ANGULAR;

/// The first words of the vectors of a body.
const POSITION: usize = offset_of!(Body, pose.position) / 4;
const ORIENTATION: usize = offset_of!(Body, pose.orientation) / 4;
const LINEAR: usize = offset_of!(Body, velocity.linear) / 4;
const ANGULAR: usize = offset_of!(Body, velocity.angular) / 4;

/// Four numbers, one per lane.
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

/// A collision, and whether it is known to use all four contact points. If so, no point needs a
/// mask.
#[derive(Clone, Copy)]
pub(crate) struct Counted<'a> {
    pub(crate) collision: &'a Collision,
    full: bool,
}

impl<'a> Counted<'a> {
    /// A collision that is known to use all contact points.
    #[inline(always)]
    pub(crate) fn full(collision: &'a Collision) -> Self {
        debug_assert_eq!(collision.count, FULL, "it has all");
        Self { collision, full: true }
    }

    /// The number of contact points in use.
    #[inline(always)]
    pub(crate) const fn count(self) -> u32 {
        // A constant after inlining where `full` is known: the code that depends on it folds, too.
        if self.full { FULL } else { self.collision.points() }
    }
}

impl<'a> From<&'a Collision> for Counted<'a> {
    /// A collision with any number of contact points. [`Collision::NOTHING`] replaces a collision
    /// with none, whose other values may be anything.
    #[inline(always)]
    fn from(collision: &'a Collision) -> Self {
        if collision.is_empty() {
            // Most scenes have none, so the processor predicts this branch.
            pgs_support::cold_path();
            return Self { collision: &Collision::NOTHING, full: false };
        }
        Self { collision, full: false }
    }
}

/// The largest number of contact points of a collision.
#[expect(clippy::cast_possible_truncation, reason = "four")]
pub(crate) const FULL: u32 = CONTACT_POINTS as u32;

/// One mask per contact point: all bits if the point is in use, else none. A count beyond `i32`,
/// which validation refuses, gives no bits.
///
/// The code has no branch: unless a collision is known to use all points ([`Counted`]), counts
/// follow no pattern that a processor can predict.
#[inline(always)]
pub(crate) fn used(count: u32) -> [Lanes; CONTACT_POINTS] {
    let mut used = [Lanes::all(count); CONTACT_POINTS];
    for (ordinal, used) in (0..).zip(&mut used) {
        *used = used.above(Lanes::all(ordinal));
    }
    used
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
    fn a_record_does_not_depend_on_the_other_values_of_an_empty_collision() {
        let nan = Contact { point: [f32::NAN; 3], distance: f32::NAN };
        let (normal, contacts) = ([f32::INFINITY; 3], [nan; CONTACT_POINTS]);
        let empty = Collision { body_a: 7, body_b: u32::MAX, normal, count: 0, contacts };
        let of = Counted::from(&empty);
        assert_eq!((*of.collision, of.count()), (Collision::NOTHING, 0));
        let one = Collision { count: 1, ..empty };
        assert_eq!(Counted::from(&one).collision.body_a, 7);
    }
}
