//! Makes the record of a collision relative to body A.

use super::body_table::End;
use super::{Counted, NORMAL, Record, contact_rows, row_of, used};
use crate::scene::Collision;
use crate::simd::{Integer, Lanes};
use pgs_interface::record::{CONTACT_POINTS, LANES, relative};

/// The row of an unused contact point.
const FAR: [u32; LANES] = [0, 0, 0, f32::INFINITY.to_bits()];

/// The collision record: normal, offset from body A to body B, contact points from body A.
///
/// Differences are rounded to f32 first. Contact points from the count on are zeros at infinite
/// distance: the record does not depend on the caller's values there. `bodies` are the indices in
/// the record, which differ from the caller's where only live bodies are kept.
///
/// Shape: 6 rows. Units: metres, world axes; distance negative = penetrating.
///
/// Source: interface specification, record table.
#[inline(always)]
pub(crate) fn encode(
    of: Counted<'_>,
    [a, b]: [&End; 2],
    bodies: [Integer; 2],
) -> Record<{ relative::ROWS }> {
    let from = of.collision;
    let mut rows = [Lanes::all(0); relative::ROWS];
    let (offset, points) = seen(from, [a, b]);
    rows[relative::NORMAL] = row_of::<NORMAL, _>(from);
    rows[relative::OFFSET] = offset;
    let contacts = points.into_iter().zip(&mut rows[relative::CONTACTS..]);
    for ((point, row), used) in contacts.zip(used(of.count())) {
        *row = point.and(used).or(Lanes::new(FAR).without(used));
    }
    let mut integers = [None; relative::ROWS];
    [integers[relative::NORMAL], integers[relative::OFFSET]] = bodies.map(Some);
    Record { rows, integers }
}

/// The offset from body A to body B, and all four contact points from body A beside their
/// distances.
#[inline(always)]
pub(crate) fn seen(from: &Collision, [a, b]: [&End; 2]) -> (Lanes, [Lanes; CONTACT_POINTS]) {
    let [a, b] = [a, b].map(End::alone);
    // The word beside a position is zero, so the distance stays as it is.
    (b.minus_f32(a), contact_rows(from).map(|point| point.minus_f32(a)))
}

/// The positions of bodies A and B that a record is made from.
///
/// The lever arm of a static body has no effect, and its centre may be far away. In sixteen bits, a
/// far centre costs every contact point precision. So the other body's position replaces it.
#[inline(always)]
pub(crate) fn anchors<T: Copy>([a, b]: [T; 2], [a_moves, b_moves]: [bool; 2]) -> [T; 2] {
    let from = if a_moves { a } else { b };
    [from, if b_moves { b } else { from }]
}

/// `to` as seen from `from`.
#[inline]
pub(crate) fn difference(to: [f32; 3], from: [f32; 3]) -> [f32; 3] {
    [to[0] - from[0], to[1] - from[1], to[2] - from[2]]
}

const _: () = assert!(relative::CONTACTS + CONTACT_POINTS == relative::ROWS);

#[cfg(test)]
mod tests {
    use super::super::bodies;
    use super::*;
    use crate::scene::Contact;
    use pgs_interface::record::Beat;

    #[test]
    fn a_static_body_stands_where_the_other_one_is() {
        let (a, b) = ([0.0, -400.0, 0.0], [60.0, 1.0, 50.0]);
        assert_eq!(anchors([a, b], [true, true]), [a, b]);
        assert_eq!(anchors([a, b], [false, true]), [b, b]);
        assert_eq!(anchors([a, b], [true, false]), [a, a]);
    }

    #[test]
    fn a_relative_collision_record_is_these_words() {
        let collision = Collision {
            body_a: 0x0102_0304,
            body_b: 0x0506_0708,
            normal: [0.0, -1.0, 0.0],
            count: 2,
            contacts: [
                Contact { point: [1.0, 2.0, 3.0], distance: -0.5 },
                Contact { point: [4.0, 5.0, 6.0], distance: 0.25 },
                Contact { point: [f32::NAN; 3], distance: f32::NAN },
                Contact { point: [7.0, 8.0, 9.0], distance: -1.0 },
            ],
        };
        let rows = encode(
            (&collision).into(),
            [[1.0, 1.0, 5.0], [3.0, 0.0, 5.0]].map(End::at).each_ref(),
            bodies(&collision),
        );
        let expected = [
            [0x0000_0000, 0xBF80_0000, 0x0000_0000, 0x0102_0304], // n, bodyA
            [0x4000_0000, 0xBF80_0000, 0x0000_0000, 0x0506_0708], // (2, -1, 0), bodyB
            [0x0000_0000, 0x3F80_0000, 0xC000_0000, 0xBF00_0000], // (0, 1, -2), -0.5
            [0x4040_0000, 0x4080_0000, 0x3F80_0000, 0x3E80_0000], // (3, 4, 1), 0.25
            [0x0000_0000, 0x0000_0000, 0x0000_0000, 0x7F80_0000], // not there
            [0x0000_0000, 0x0000_0000, 0x0000_0000, 0x7F80_0000], // not there
        ];
        assert_eq!(rows.whole().map(Beat::from), expected.map(Beat));
    }
}
