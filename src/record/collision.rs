//! Makes the record of a collision in world coordinates.

use std::mem::offset_of;

use super::FULL;
use super::body_table::End;
use crate::scene::{Collision, Contact};
use pgs_interface::record::{Beat, CONTACT_POINTS, LANES, WORD_LANE, collision};

/// Masks of the contact points in use, by the low bits of their number: in the lanes of one row, and
/// in rows of their own. Validation refuses numbers above [`FULL`], whatever their masks.
///
/// A look-up instead of branches: counts follow no pattern that a processor can predict.
const USED_LANES: [Beat; NUMBERS] = {
    let mut used = [Beat([0; LANES]); NUMBERS];
    let mut at = 0;
    while at < NUMBERS * LANES {
        let (count, lane) = (at / LANES, at % LANES);
        used[count].0[lane] = if lane < count { u32::MAX } else { 0 };
        at += 1;
    }
    used
};
const USED: [[Beat; CONTACT_POINTS]; NUMBERS] = {
    let mut used = [[Beat([0; LANES]); CONTACT_POINTS]; NUMBERS];
    let mut at = 0;
    while at < NUMBERS * CONTACT_POINTS {
        let (count, point) = (at / CONTACT_POINTS, at % CONTACT_POINTS);
        used[count][point] = Beat([USED_LANES[count].0[point]; LANES]);
        at += 1;
    }
    used
};
/// A power of two above all numbers of points that are right: a look-up needs no other check.
const NUMBERS: usize = 2 * CONTACT_POINTS;
const _: () = assert!(NUMBERS.is_power_of_two() && (FULL as usize) < NUMBERS);

/// The masks of the first `points` contact points.
#[inline(always)]
pub(crate) fn used(points: u32) -> &'static [Beat; CONTACT_POINTS] {
    &USED[points as usize % NUMBERS]
}

/// [`used`] in the lanes of one row.
#[inline(always)]
pub(crate) fn used_lanes(points: u32) -> &'static Beat {
    &USED_LANES[points as usize % NUMBERS]
}

/// The bits that both have.
#[inline(always)]
pub(crate) fn and(one: Beat, other: &Beat) -> Beat {
    Beat(std::array::from_fn(|lane| one.0[lane] & other.0[lane]))
}

/// The collision record: normal and count, positions and indices of both bodies, contact points.
///
/// Contact points from `points` on are zeros: the caller may leave anything there (NaN too), and
/// the record must not depend on it.
///
/// Shape: 7 rows. Units: metres, world frame; distance negative = penetrating.
///
/// Source: interface specification, record table.
#[inline(always)]
pub(crate) fn encode(
    from: &Collision,
    points: u32,
    ends: [&End; 2],
    to: &mut [Beat; collision::ROWS],
) {
    let words: &[u32; size_of::<Collision>() / 4] = bytemuck::cast_ref(from);
    let row = |at: usize| Beat(std::array::from_fn(|lane| words[at + lane]));
    to[collision::NORMAL] = row(NORMAL);
    let bodies = [(collision::BODY_A, from.body_a), (collision::BODY_B, from.body_b)];
    for ((at, body), end) in bodies.into_iter().zip(ends) {
        to[at] = bytemuck::cast(*end);
        to[at].0[WORD_LANE] = body;
    }
    for (point, used) in used(points).iter().enumerate() {
        to[collision::CONTACTS + point] = and(row(CONTACTS + LANES * point), used);
    }
}

/// The first words of a collision's normal, and of its contact points.
const NORMAL: usize = offset_of!(Collision, normal) / 4;
const CONTACTS: usize = offset_of!(Collision, contacts) / 4;
const _: () = assert!(collision::CONTACTS + CONTACT_POINTS == collision::ROWS);
// Each row lies in a collision as in its record.
const _: () = assert!(offset_of!(Collision, count) == 4 * (NORMAL + WORD_LANE));
const _: () = assert!(size_of::<Contact>() == 4 * LANES);
const _: () = assert!(offset_of!(Contact, distance) == 4 * WORD_LANE);

#[cfg(test)]
mod tests {
    use super::*;

    fn encoded(of: &Collision, ends: [End; 2]) -> [Beat; collision::ROWS] {
        let mut rows = [Beat([7; LANES]); collision::ROWS];
        encode(of, of.count, ends.each_ref(), &mut rows);
        rows
    }

    #[test]
    fn a_collision_record_is_these_bytes() {
        let collision = Collision {
            body_a: 0x0102_0304,
            body_b: 0x0506_0708,
            normal: [0.0, -1.0, 0.0],
            count: 3,
            contacts: [
                Contact { point: [1.0, 2.0, 3.0], distance: -0.5 },
                Contact { point: [4.0, 5.0, 6.0], distance: 0.25 },
                Contact { point: [-7.0, 8.0, -0.0], distance: -1.0 },
                Contact { point: [f32::NAN, 9.0, f32::INFINITY], distance: 9.0 },
            ],
        };
        let bytes: [u8; 112] = [
            0x00, 0x00, 0x00, 0x00, // n.x 0.0
            0x00, 0x00, 0x80, 0xBF, // n.y -1.0
            0x00, 0x00, 0x00, 0x00, // n.z 0.0
            0x03, 0x00, 0x00, 0x00, // count
            0x00, 0x00, 0x20, 0x41, // pA.x 10.0
            0x00, 0x00, 0x30, 0x41, // pA.y 11.0
            0x00, 0x00, 0x40, 0x41, // pA.z 12.0
            0x04, 0x03, 0x02, 0x01, // bodyA
            0x00, 0x00, 0x50, 0x41, // pB.x 13.0
            0x00, 0x00, 0x60, 0x41, // pB.y 14.0
            0x00, 0x00, 0x70, 0x41, // pB.z 15.0
            0x08, 0x07, 0x06, 0x05, // bodyB
            0x00, 0x00, 0x80, 0x3F, // c0.x 1.0
            0x00, 0x00, 0x00, 0x40, // c0.y 2.0
            0x00, 0x00, 0x40, 0x40, // c0.z 3.0
            0x00, 0x00, 0x00, 0xBF, // distance0 -0.5
            0x00, 0x00, 0x80, 0x40, // c1.x 4.0
            0x00, 0x00, 0xA0, 0x40, // c1.y 5.0
            0x00, 0x00, 0xC0, 0x40, // c1.z 6.0
            0x00, 0x00, 0x80, 0x3E, // distance1 0.25
            0x00, 0x00, 0xE0, 0xC0, // c2.x -7.0
            0x00, 0x00, 0x00, 0x41, // c2.y 8.0
            0x00, 0x00, 0x00, 0x80, // c2.z -0.0
            0x00, 0x00, 0x80, 0xBF, // distance2 -1.0
            0x00, 0x00, 0x00, 0x00, // unused
            0x00, 0x00, 0x00, 0x00, // unused
            0x00, 0x00, 0x00, 0x00, // unused
            0x00, 0x00, 0x00, 0x00, // unused
        ];
        let ends = [[10.0, 11.0, 12.0], [13.0, 14.0, 15.0]].map(End::at);
        assert_eq!(bytemuck::bytes_of(&encoded(&collision, ends)), bytes);
    }

    #[test]
    fn contact_points_from_count_on_are_sent_as_zeros() {
        let contact = Contact { point: [f32::NAN; 3], distance: f32::NAN };
        for count in [0, 1, 2, 3, 4, 5, u32::MAX] {
            let collision = Collision {
                body_a: 0,
                body_b: 1,
                normal: [1.0, 0.0, 0.0],
                count,
                contacts: [contact; 4],
            };
            let beats = encoded(&collision, [End::MISSING; 2]);
            for (ordinal, beat) in (0..).zip(&beats[3..]) {
                assert_eq!(*beat == Beat([0; 4]), ordinal >= count, "count {count}: {ordinal}");
            }
        }
    }
}
