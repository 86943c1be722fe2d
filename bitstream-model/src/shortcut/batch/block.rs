//! Lays sixteen collisions out side by side, word by word, as SIMD lanes read them.
//!
//! A block is sixteen collision records: a row of sixteen numbers for each word of
//! the record, then the accumulated impulses. The collisions of a block share no moving body. Only a
//! serial block's may; they are taken one after the other.

use crate::accelerator::hazards::Entry;
use crate::accelerator::records::array::Row;
use crate::accelerator::records::decode::{Collision, pair_friction};
use crate::accelerator::solver::Impulses;
use crate::config::THREADS_MAX;
use pgs_interface::record::{CONTACT_POINTS, WORD_LANE, collision};

/// Collisions of a block.
pub(crate) use pgs_support::lanes::LANES;

/// One word of the collisions of a block.
pub(crate) type Words<T = f32> = [T; LANES];

/// Rows before the bodies' own: the one that empty lanes read, then for each thread one that it
/// writes in place of a static body's. Two rows are a cache line.
pub(crate) const ROWS_APART: u32 = 64;
/// The row that empty lanes read: zeros.
pub(crate) const EMPTY_ROW: u32 = 0;
// One for each thread.
const _: () = assert!(ROWS_APART as usize / 2 > THREADS_MAX);

/// The bits that describe a lane.
pub(crate) mod kind {
    use pgs_interface::record::collision;

    /// The number of contact points; 0 in an empty lane.
    pub(crate) const COUNT: u32 = 7;
    /// Body A moves, body B moves.
    pub(crate) const MOVES: [u32; 2] = [1 << 8, 1 << 9];
    /// The spin about the normal is damped; found by the first friction pass.
    pub(crate) const SPINS: u32 = 1 << 10;
    /// In the first lane: the collisions are taken one after the other.
    pub(crate) const SERIAL: u32 = 1 << 11;

    /// The friction of the pair, as it lies above the contact count; 0 in steps without.
    pub(crate) const FRICTION: u32 = collision::FRICTION_BITS;

    /// The kind of a collision; `head` is its contact count, which is in range, and its friction.
    #[inline(always)]
    pub(crate) fn of(head: u32, moving: [bool; 2], serial: bool) -> u32 {
        let sides = (u32::from(moving[0]) * MOVES[0]) | (u32::from(moving[1]) * MOVES[1]);
        head & (COUNT | FRICTION) | sides | (u32::from(serial) * SERIAL)
    }
}

/// Sixteen collisions.
#[derive(Debug, Clone, Copy)]
#[repr(C, align(64))]
pub(crate) struct Block {
    pub(crate) normal: [Words; 3],
    pub(crate) position_a: [Words; 3],
    pub(crate) position_b: [Words; 3],
    /// x, y, z and distance.
    pub(crate) contacts: [[Words; 4]; CONTACT_POINTS],
    /// Rows of the bodies' velocities.
    pub(crate) rows: [Words<u32>; 2],
    pub(crate) kind: Words<u32>,
    pub(crate) impulses: [Words; CONTACT_POINTS],
}

const _: () = assert!(size_of::<Block>() == 32 * 64);

impl Block {
    pub(crate) const EMPTY: Self = Self {
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
    pub(crate) fn serial(&self) -> bool {
        self.kind[0] & kind::SERIAL != 0
    }

    /// Puts a record of a kind into an empty lane.
    pub(crate) fn put(&mut self, lane: usize, rows: &[Row; collision::ROWS], kind: u32) {
        let [normal, body_a, body_b] =
            [rows[collision::NORMAL], rows[collision::BODY_A], rows[collision::BODY_B]];
        for axis in 0..3 {
            self.normal[axis][lane] = f32::from_bits(normal[axis]);
            self.position_a[axis][lane] = f32::from_bits(body_a[axis]);
            self.position_b[axis][lane] = f32::from_bits(body_b[axis]);
        }
        for (words, row) in self.contacts.iter_mut().zip(&rows[collision::CONTACTS..]) {
            for (words, word) in words.iter_mut().zip(row) {
                words[lane] = f32::from_bits(*word);
            }
        }
        for (rows, row) in self.rows.iter_mut().zip([body_a, body_b]) {
            rows[lane] = row[WORD_LANE].wrapping_add(ROWS_APART);
        }
        self.kind[lane] |= kind & !kind::SERIAL;
        self.kind[0] |= kind & kind::SERIAL;
    }

    /// Sets the kinds of all lanes, and clears the impulses.
    #[inline(always)]
    pub(crate) fn begin(&mut self, kinds: &Words<u32>) {
        self.kind = *kinds;
        self.impulses = [[0.0; LANES]; CONTACT_POINTS];
        // In the first lane alone.
        let serial = kinds.iter().fold(0, |all, kind| all | kind) & kind::SERIAL;
        if serial != 0 {
            self.kind.iter_mut().for_each(|kind| *kind &= !kind::SERIAL);
            self.kind[0] |= serial;
        }
    }

    pub(crate) fn count(&self, lane: usize) -> usize {
        (self.kind[lane] & kind::COUNT) as usize
    }

    /// The bodies of a collision and which of them move.
    pub(crate) fn entry(&self, lane: usize) -> Entry {
        Entry {
            bodies: [self.rows[0][lane] - ROWS_APART, self.rows[1][lane] - ROWS_APART],
            moving: kind::MOVES.map(|moves| self.kind[lane] & moves != 0),
        }
    }

    /// The collision in a lane.
    pub(crate) fn collision(&self, lane: usize) -> Collision {
        let [body_a, body_b] = self.rows.map(|rows| rows[lane].saturating_sub(ROWS_APART));
        Collision {
            body_a,
            body_b,
            count: self.count(lane),
            friction: pair_friction(self.kind[lane]),
            normal: self.normal.each_ref().map(|row| row[lane]),
            position_a: self.position_a.each_ref().map(|row| row[lane]),
            position_b: self.position_b.each_ref().map(|row| row[lane]),
            contacts: self.contacts.each_ref().map(|rows| rows.each_ref().map(|row| row[lane])),
            impulses: [0.0; CONTACT_POINTS],
        }
    }

    /// Begins the passes again.
    pub(crate) fn forget_impulses(&mut self) {
        self.impulses = [[0.0; LANES]; CONTACT_POINTS];
    }

    pub(crate) fn impulses(&self, lane: usize) -> Impulses {
        self.impulses.each_ref().map(|row| row[lane])
    }

    pub(crate) fn put_impulses(&mut self, lane: usize, impulses: Impulses) {
        for (row, impulse) in self.impulses.iter_mut().zip(impulses) {
            row[lane] = impulse;
        }
    }
}
