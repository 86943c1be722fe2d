//! This file makes the record of a collision relative to body A.

use super::vec3_and_word;
use crate::interface::record::{Beat, CONTACT_POINTS, relative};
use crate::scene::Collision;

/// Rows whose word is an unsigned integer: the indices.
pub(crate) const INTEGERS: [bool; relative::ROWS] = {
    let mut integers = [false; relative::ROWS];
    integers[relative::NORMAL] = true;
    integers[relative::OFFSET] = true;
    integers
};

/// The distance that marks a contact point which is not there.
const UNUSED: u32 = f32::INFINITY.to_bits();

/// The collision record: normal, offset from body A to body B, contact points from body A.
///
/// Differences are rounded to f32 before anything else happens to them. Contact points from `count`
/// on are zeros at infinite distance, whatever the caller left there.
///
/// Shape: 6 rows. Units: metres, world axes; distance negative = penetrating.
///
/// Source: interface specification, record table.
#[inline]
pub(crate) fn encode(
    from: &Collision,
    position_a: [f32; 3],
    position_b: [f32; 3],
) -> [Beat; relative::ROWS] {
    let mut beats = [Beat::default(); relative::ROWS];
    beats[relative::NORMAL] = vec3_and_word(from.normal, from.body_a);
    beats[relative::OFFSET] = vec3_and_word(difference(position_b, position_a), from.body_b);
    for (ordinal, (contact, beat)) in
        (0_u32..).zip(from.contacts.iter().zip(&mut beats[relative::CONTACTS..]))
    {
        // A mask, not a branch: counts follow no pattern that could be predicted.
        let used = if ordinal < from.count { u32::MAX } else { 0 };
        let arm = difference(contact.point, position_a);
        let Beat([x, y, z, distance]) = vec3_and_word(arm, contact.distance.to_bits());
        *beat = Beat([x & used, y & used, z & used, (distance & used) | (UNUSED & !used)]);
    }
    beats
}

/// The positions of bodies A and B that a record is made from.
///
/// A static body has no lever arm that anything comes of, and its centre may be far away, which
/// sixteen bits pay for with every contact point on it: the other body's position stands in for its.
#[inline]
pub(crate) fn anchors([a, b]: [[f32; 3]; 2], moves: [bool; 2]) -> [[f32; 3]; 2] {
    match moves {
        [false, _] => [b, b],
        [true, false] => [a, a],
        [true, true] => [a, b],
    }
}

/// `to` as seen from `from`.
#[inline]
pub(crate) fn difference(to: [f32; 3], from: [f32; 3]) -> [f32; 3] {
    [to[0] - from[0], to[1] - from[1], to[2] - from[2]]
}

const _: () = assert!(relative::CONTACTS + CONTACT_POINTS == relative::ROWS);

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Contact;

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
        let rows = encode(&collision, [1.0, 1.0, 5.0], [3.0, 0.0, 5.0]);
        let expected = [
            [0x0000_0000, 0xBF80_0000, 0x0000_0000, 0x0102_0304], // n, bodyA
            [0x4000_0000, 0xBF80_0000, 0x0000_0000, 0x0506_0708], // (2, -1, 0), bodyB
            [0x0000_0000, 0x3F80_0000, 0xC000_0000, 0xBF00_0000], // (0, 1, -2), -0.5
            [0x4040_0000, 0x4080_0000, 0x3F80_0000, 0x3E80_0000], // (3, 4, 1), 0.25
            [0x0000_0000, 0x0000_0000, 0x0000_0000, 0x7F80_0000], // not there
            [0x0000_0000, 0x0000_0000, 0x0000_0000, 0x7F80_0000], // not there
        ];
        assert_eq!(rows, expected.map(Beat));
    }
}
