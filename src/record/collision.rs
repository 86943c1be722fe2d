//! Makes the record of a collision in world coordinates.

use std::mem::offset_of;

use super::body_table::End;
use super::{Counted, NORMAL, Record, bodies, contact_rows, row_of, used};
use crate::scene::Collision;
use crate::simd::{Integer, Lanes};
use pgs_interface::record::{CONTACT_POINTS, WORD_LANE, collision};

/// The collision record: normal and count, positions and indices of both bodies, contact points.
///
/// Contact points from the count on are zeros: the caller may leave anything there (NaN too), and
/// the record must not depend on it.
///
/// Shape: 7 rows. Units: metres, world frame; distance negative = penetrating.
///
/// Source: interface specification, record table.
#[inline(always)]
pub(crate) fn encode(of: Counted<'_>, [a, b]: [&End; 2]) -> Record<{ collision::ROWS }> {
    let from = of.collision;
    let mut rows = [Lanes::all(0); collision::ROWS];
    rows[collision::NORMAL] = row_of::<NORMAL, _>(from);
    rows[collision::BODY_A] = a.with_tag();
    rows[collision::BODY_B] = b.with_tag();
    let contacts = contact_rows(from).into_iter().zip(&mut rows[collision::CONTACTS..]);
    for ((point, row), used) in contacts.zip(used(of.count())) {
        *row = point.and(used);
    }
    let mut integers = [None; collision::ROWS];
    integers[collision::NORMAL] = Some(Integer::new::<WORD_LANE>(rows[collision::NORMAL]));
    [integers[collision::BODY_A], integers[collision::BODY_B]] = bodies(from).map(Some);
    Record { rows, integers }
}

const _: () = assert!(collision::CONTACTS + CONTACT_POINTS == collision::ROWS);
// The count of a collision follows its normal.
const _: () = assert!(offset_of!(Collision, count) == 4 * (NORMAL + WORD_LANE));

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Contact;
    use pgs_interface::record::Beat;

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
        let beats = encode((&collision).into(), ends.each_ref()).whole().map(Beat::from);
        assert_eq!(bytemuck::bytes_of(&beats), bytes);
    }

    #[test]
    fn contact_points_from_count_on_are_sent_as_zeros() {
        let contact = Contact { point: [f32::NAN; 3], distance: f32::NAN };
        for count in 0..=4_u32 {
            let collision = Collision {
                body_a: 0,
                body_b: 1,
                normal: [1.0, 0.0, 0.0],
                count,
                contacts: [contact; 4],
            };
            let beats = encode((&collision).into(), [&End::MISSING; 2]).rows.map(Beat::from);
            for (ordinal, beat) in (0..).zip(&beats[3..]) {
                assert_eq!(*beat == Beat([0; 4]), ordinal >= count, "count {count}: {ordinal}");
            }
        }
    }
}
