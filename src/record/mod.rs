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
    /// The last word of a row in which a body's index belongs means nothing.
    pub(crate) rows: [Lanes; ROWS],
    /// The indices of bodies A and B, and any two words behind them.
    pub(crate) bodies: Lanes,
}

/// What the last words of a record's rows are.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Words<const ROWS: usize> {
    /// Rows whose last word is an unsigned integer.
    pub(crate) integers: [bool; ROWS],
    /// The row whose last word is the index of body A; in the next it is that of body B. `None` in a record
    /// of no collision.
    pub(crate) bodies: Option<usize>,
}

impl<const ROWS: usize> Words<ROWS> {
    /// Those of a collision, which ends in the indices of its bodies in row `at` and the next, and in the
    /// rows `integers` in other integers.
    pub(crate) const fn of_collision(mut integers: [bool; ROWS], at: usize) -> Self {
        assert!(at + 1 < ROWS, "there is a row for each of them");
        integers[at] = true;
        integers[at + 1] = true;
        Self { integers, bodies: Some(at) }
    }
}

impl<const ROWS: usize> From<[Lanes; ROWS]> for Record<ROWS> {
    /// A record of no collision.
    #[inline(always)]
    fn from(rows: [Lanes; ROWS]) -> Self {
        Self { rows, bodies: Lanes::all(0) }
    }
}

impl<const ROWS: usize> Record<ROWS> {
    /// Its rows, each with its last word.
    #[inline(always)]
    pub(crate) fn whole(self, words: &Words<ROWS>) -> [Lanes; ROWS] {
        let Self { mut rows, bodies } = self;
        let [body_a, body_b, ..] = bodies.words();
        if let Some([a, b, ..]) = words.bodies.and_then(|at| rows.get_mut(at..)) {
            (*a, *b) = (a.beside(body_a), b.beside(body_b));
        }
        rows
    }
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

/// The indices of the bodies of a collision, and whatever follows them.
#[inline(always)]
pub(crate) fn bodies(collision: &Collision) -> Lanes {
    row_of::<BODIES, _>(collision)
}

/// The word with which the indices of a collision's bodies begin, B's behind A's.
const BODIES: usize = offset_of!(Collision, body_a) / 4;
const _: () = assert!(offset_of!(Collision, body_b) == 4 * (BODIES + 1));

/// The word with which the normal of a collision begins.
const NORMAL: usize = offset_of!(Collision, normal) / 4;

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
