//! This folder turns a caller's values into the rows of a record, and a result record back.
//!
//! One file a record kind makes rows of 32-bit words, each of which is a beat of an f32 stream;
//! `sixteen` narrows rows for the streams of sixteen bits and widens what comes back. The layout is
//! that of [`interface::record`](crate::interface::record); which channel a beat travels on is
//! decided elsewhere (`beat`).

pub(crate) mod collision;
pub(crate) mod end;
pub(crate) mod finite;
pub(crate) mod inertia;
pub(crate) mod largest;
pub(crate) mod pose;
pub(crate) mod relative;
pub(crate) mod result;
pub(crate) mod sixteen;
mod thesis16;
pub(crate) mod velocity;

use std::mem::offset_of;
use std::slice;

use bytemuck::Pod;

use crate::interface::record::{Beat, CONTACT_POINTS, LANES, WORD_LANE};
use crate::platform::Lanes;
use crate::scene::{Body, Collision, Contact};

/// A record on its way, in f32.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Record<const ROWS: usize> {
    /// The last word of a row in which an integer belongs means nothing.
    pub(crate) rows: [Lanes; ROWS],
    /// The unsigned integers in which rows end. They stay where they were found until they stand in their
    /// beat: into a row of numbers and out of a narrowed one they would go twice.
    pub(crate) integers: [Option<Integer>; ROWS],
}

/// One of four words.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Integer {
    words: Lanes,
    at: usize,
}

impl Integer {
    /// Word `AT` of these.
    #[inline(always)]
    pub(crate) const fn new<const AT: usize>(words: Lanes) -> Self {
        const { assert!(AT < LANES, "it is one of four") };
        Self { words, at: AT }
    }

    /// Four words, and which of them it is.
    #[inline(always)]
    pub(crate) const fn parts(self) -> (Lanes, usize) {
        (self.words, self.at)
    }
}

impl From<Integer> for u32 {
    #[inline(always)]
    fn from(Integer { words, at }: Integer) -> Self {
        words.words()[at]
    }
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

/// The indices of the bodies of a collision.
#[inline(always)]
pub(crate) fn bodies(collision: &Collision) -> [Integer; 2] {
    let words = row_of::<BODIES, _>(collision);
    [Integer::new::<0>(words), Integer::new::<1>(words)]
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

/// A contact point beside its distance.
#[inline(always)]
fn contact_row(contact: &Contact) -> Lanes {
    vec3_and_word(contact.point, contact.distance.to_bits())
}

/// The bits of the contact points of a collision that are used: all of each, or none. Of a count beyond
/// `i32`, which validation refuses, none are.
///
/// No branch: counts follow no pattern that could be predicted.
#[inline(always)]
pub(crate) fn used(count: u32) -> [Lanes; CONTACT_POINTS] {
    let mut used = [Lanes::all(count); CONTACT_POINTS];
    for (ordinal, used) in (0..).zip(&mut used) {
        *used = used.above(Lanes::all(ordinal));
    }
    used
}

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
