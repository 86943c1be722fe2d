//! This file lays collisions out sixteen side by side, word by word, as SIMD lanes take them.
//!
//! A block is what one collision record is, times sixteen: a row of sixteen numbers for each word of
//! the record, then the accumulated impulses. The collisions of a block share no moving body, but
//! for those of a serial one, which are taken one after the other.

use super::super::decode::Collision;
use super::super::pipeline::Entry;
use super::super::solver::Impulses;
use crate::cast::register;
use crate::config::THREADS_MAX;
use crate::interface::record::CONTACT_POINTS;

/// Collisions of a block.
pub(super) const LANES: usize = 16;

/// One word of the collisions of a block.
pub(super) type Words<T = f32> = [T; LANES];

/// Rows before the bodies' own: the one that empty lanes read, then for each thread one that it
/// writes in place of a static body's. Two rows are a cache line.
pub(super) const ROWS_APART: u32 = 64;
/// The row that empty lanes read: zeros.
pub(super) const EMPTY_ROW: u32 = 0;
// One for each thread.
const _: () = assert!(ROWS_APART as usize / 2 > THREADS_MAX);

/// What a lane is: bits.
pub(super) mod kind {
    /// The number of contact points; 0 in an empty lane.
    pub(in super::super) const COUNT: u32 = 7;
    /// Body A moves, body B moves.
    pub(in super::super) const MOVES: [u32; 2] = [1 << 8, 1 << 9];
    /// The spin about the normal is damped; found by the first friction pass.
    pub(in super::super) const SPINS: u32 = 1 << 10;
    /// In the first lane: the collisions are taken one after the other.
    pub(in super::super) const SERIAL: u32 = 1 << 11;
}

/// Sixteen collisions.
#[derive(Debug, Clone, Copy)]
#[repr(C, align(64))]
pub(super) struct Block {
    pub(super) normal: [Words; 3],
    pub(super) position_a: [Words; 3],
    pub(super) position_b: [Words; 3],
    /// x, y, z and distance.
    pub(super) contacts: [[Words; 4]; CONTACT_POINTS],
    /// Rows of the bodies' velocities.
    pub(super) rows: [Words<u32>; 2],
    pub(super) kind: Words<u32>,
    pub(super) impulses: [Words; CONTACT_POINTS],
}

const _: () = assert!(size_of::<Block>() == 32 * 64);

impl Block {
    pub(super) const EMPTY: Self = Self {
        normal: [[0.0; LANES]; 3],
        position_a: [[0.0; LANES]; 3],
        position_b: [[0.0; LANES]; 3],
        contacts: [[[0.0; LANES]; 4]; CONTACT_POINTS],
        rows: [[EMPTY_ROW; LANES]; 2],
        kind: [0; LANES],
        impulses: [[0.0; LANES]; CONTACT_POINTS],
    };

    /// Whether its collisions are taken one after the other.
    #[inline]
    pub(super) fn serial(&self) -> bool {
        self.kind[0] & kind::SERIAL != 0
    }

    /// Puts a collision into an empty lane.
    #[inline]
    pub(super) fn put(&mut self, lane: usize, collision: &Collision, moving: [bool; 2]) {
        for axis in 0..3 {
            self.normal[axis][lane] = collision.normal[axis];
            self.position_a[axis][lane] = collision.position_a[axis];
            self.position_b[axis][lane] = collision.position_b[axis];
        }
        for (rows, contact) in self.contacts.iter_mut().zip(&collision.contacts) {
            for (row, word) in rows.iter_mut().zip(contact) {
                row[lane] = *word;
            }
        }
        self.put_kind(lane, [collision.body_a, collision.body_b], collision.count, moving);
    }

    /// The words of a collision that are no numbers.
    #[inline]
    pub(super) fn put_kind(
        &mut self,
        lane: usize,
        bodies: [u32; 2],
        count: usize,
        moving: [bool; 2],
    ) {
        let mut word = register(count) & kind::COUNT;
        for side in 0..2 {
            self.rows[side][lane] = bodies[side] + ROWS_APART;
            word |= if moving[side] { kind::MOVES[side] } else { 0 };
        }
        self.kind[lane] |= word;
    }

    pub(super) fn count(&self, lane: usize) -> usize {
        (self.kind[lane] & kind::COUNT) as usize
    }

    /// The bodies of a collision and which of them move.
    pub(super) fn entry(&self, lane: usize) -> Entry {
        Entry {
            bodies: [self.rows[0][lane] - ROWS_APART, self.rows[1][lane] - ROWS_APART],
            moving: kind::MOVES.map(|moves| self.kind[lane] & moves != 0),
        }
    }

    /// The collision in a lane.
    pub(super) fn collision(&self, lane: usize) -> Collision {
        let [body_a, body_b] = self.rows.map(|rows| rows[lane].saturating_sub(ROWS_APART));
        Collision {
            body_a,
            body_b,
            count: self.count(lane),
            normal: self.normal.each_ref().map(|row| row[lane]),
            position_a: self.position_a.each_ref().map(|row| row[lane]),
            position_b: self.position_b.each_ref().map(|row| row[lane]),
            contacts: self.contacts.each_ref().map(|rows| rows.each_ref().map(|row| row[lane])),
        }
    }

    pub(super) fn impulses(&self, lane: usize) -> Impulses {
        self.impulses.each_ref().map(|row| row[lane])
    }

    pub(super) fn put_impulses(&mut self, lane: usize, impulses: Impulses) {
        for (row, impulse) in self.impulses.iter_mut().zip(impulses) {
            row[lane] = impulse;
        }
    }
}
