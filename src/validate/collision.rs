//! Refuses collisions that no bitstream can solve.

use super::{InputError, Scene, first};
use crate::record::FULL;
use crate::record::body_table::End;
use crate::scene::{CONTACT_POINTS, Collision, Contact};

/// Checks a collision with contact points, without its bodies; returns their indices. `points` is
/// its number of [points](Scene::points).
pub(crate) fn check_collision(
    index: usize,
    collision: &Collision,
    bodies: usize,
    points: u32,
) -> Result<(usize, usize), InputError> {
    let body = |side: char, found: u32| match usize::try_from(found) {
        Ok(body) if body < bodies => Ok(body),
        _ => Err(InputError::BodyIndex { collision: index, side, found, bodies }),
    };
    let pair = (body('A', collision.body_a)?, body('B', collision.body_b)?);
    if pair.0 == pair.1 {
        return Err(InputError::SelfCollision { collision: index, body: collision.body_a });
    }
    if points != collision.points() && (1..=FULL).contains(&collision.points()) {
        return Err(InputError::OwnFriction { collision: index });
    }
    let count = match usize::try_from(points) {
        Ok(count @ ..=CONTACT_POINTS) => count,
        _ => {
            return Err(InputError::ContactCount { collision: index, found: collision.count });
        }
    };
    if !collision.has_finite_friction() {
        let found = collision.friction();
        return Err(InputError::FrictionNotFinite { collision: index, found });
    }
    if let Some((component, found)) = first(&collision.normal, |value| !value.is_finite()) {
        return Err(InputError::NormalNotFinite { collision: index, component, found });
    }
    if !is_unit(collision.normal) {
        return Err(normal_length(index, collision.normal));
    }
    let mut numbers = collision.contacts[..count].iter().enumerate().flat_map(numbers_of);
    let wrong = numbers.find(|(.., found)| !found.is_finite());
    wrong.map_or(Ok(pair), |(contact, field, component, found)| {
        Err(InputError::ContactNotFinite { collision: index, contact, field, component, found })
    })
}

/// The numbers of a contact point: its place, name, component, value.
pub(super) fn numbers_of(
    (at, Contact { point: [x, y, z], distance }): (usize, &Contact),
) -> [(usize, &'static str, usize, f32); 4] {
    [("point", 0, *x), ("point", 1, *y), ("point", 2, *z), ("distance", 0, *distance)]
        .map(|(field, component, found)| (at, field, component, found))
}

/// Whether a normal has the length 1; not if a number of it is not finite.
#[inline(always)]
fn is_unit([x, y, z]: [f32; 3]) -> bool {
    ((x * x + y * y + z * z).sqrt() - 1.0).abs() <= InputError::NORMAL_TOLERANCE
}

impl Scene<'_> {
    /// The number of contact points; unless each collision has its own friction, a friction counts
    /// as a part of it. A record masks the points from this number on.
    #[inline(always)]
    pub(crate) const fn points(&self, collision: &Collision) -> u32 {
        collision.count & self.points
    }

    /// Whether validation accepts a collision with contact points, apart from the limits on the
    /// numbers of its points, and from its [rows](Self::rows_fit). It has this number of
    /// [points](Self::points), and its bodies A and B have these ends.
    #[inline(always)]
    pub(crate) fn accepts(&self, collision: &Collision, points: u32, [a, b]: [&End; 2]) -> bool {
        is_unit(collision.normal)
            & (points <= FULL)
            & collision.has_finite_friction()
            & (collision.body_a != collision.body_b)
            & a.may_touch(b)
    }
}

/// The error for a normal that is not of unit length.
#[cold]
fn normal_length(collision: usize, normal: [f32; 3]) -> InputError {
    // In f32 the square of a small number is 0, and the square of a large number is infinite.
    let [x, y, z] = normal.map(f64::from);
    let length = (x * x + y * y + z * z).sqrt();
    if length == 0.0 {
        return InputError::NormalZero { collision };
    }
    #[allow(clippy::cast_possible_truncation, reason = "it is rounded, to infinity if need be")]
    let length = length as f32;
    InputError::NormalLength { collision, length }
}

#[cfg(test)]
mod tests {
    use super::super::tests::{UNUSED, USED};
    use super::*;

    const COLLISION: Collision = Collision {
        body_a: 2,
        body_b: 0,
        normal: [0.0, -1.0, 0.0],
        count: 3,
        contacts: [USED, USED, USED, UNUSED],
    };

    #[test]
    fn a_friction_of_its_own_is_taken_where_it_is_asked_for() {
        let own = COLLISION.with_friction(0.3);
        assert_eq!((own.points(), own.count), (3, 0x34CD_0003));
        assert!((own.friction() - 0.3).abs() < 1e-4);
        assert_eq!(own.with_friction(0.0).count, COLLISION.count);
        let empty = Collision { count: 0, ..COLLISION };
        assert_eq!(empty.with_friction(0.5).count, 0);
        let negative = COLLISION.with_friction(-0.5);
        assert!(matches!(
            check_collision(5, &negative, 3, negative.points()),
            Err(InputError::FrictionNotFinite { collision: 5, .. })
        ));
        assert_eq!(check_collision(5, &own, 3, own.points()), Ok((2, 0)));
        let refused = InputError::OwnFriction { collision: 5 };
        assert_eq!(check_collision(5, &own, 3, own.count), Err(refused));
        let found = f32::INFINITY;
        let infinite = COLLISION.with_friction(7e4);
        assert_eq!(
            check_collision(5, &infinite, 3, infinite.points()),
            Err(InputError::FrictionNotFinite { collision: 5, found })
        );
        // The sign bit is none of the friction's.
        let negative = Collision { count: own.count | 1 << 31, ..own };
        let refused = InputError::ContactCount { collision: 5, found: negative.count };
        assert_eq!(check_collision(5, &negative, 3, negative.points()), Err(refused));
    }

    fn refused(collision: &Collision) -> InputError {
        check_collision(5, collision, 3, collision.count).expect_err("a collision to be refused")
    }

    #[test]
    fn what_an_unused_contact_point_holds_does_not_matter() {
        assert_eq!(check_collision(0, &COLLISION, 3, COLLISION.count), Ok((2, 0)));
    }

    #[test]
    fn a_body_that_does_not_exist_is_refused() {
        for found in [3, u32::MAX] {
            assert_eq!(
                refused(&Collision { body_a: found, ..COLLISION }),
                InputError::BodyIndex { collision: 5, side: 'A', found, bodies: 3 }
            );
            assert_eq!(
                refused(&Collision { body_b: found, ..COLLISION }),
                InputError::BodyIndex { collision: 5, side: 'B', found, bodies: 3 }
            );
        }
    }

    #[test]
    fn a_body_against_itself_is_refused() {
        assert_eq!(
            refused(&Collision { body_b: 2, ..COLLISION }),
            InputError::SelfCollision { collision: 5, body: 2 }
        );
    }

    #[test]
    fn counts_above_four_are_refused() {
        let contacts = [USED; 4];
        for count in 1..=4 {
            let collision = Collision { count, contacts, ..COLLISION };
            assert_eq!(check_collision(5, &collision, 3, collision.count), Ok((2, 0)));
        }
        for found in [5, 0x1_0000, 0x7FFF_0000, u32::MAX] {
            assert_eq!(
                refused(&Collision { count: found, contacts, ..COLLISION }),
                InputError::ContactCount { collision: 5, found }
            );
        }
    }

    #[test]
    fn a_normal_that_is_not_finite_is_refused() {
        for value in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
            for axis in 0..3 {
                let mut collision = COLLISION;
                collision.normal[axis] = value;
                assert!(matches!(
                    refused(&collision),
                    InputError::NormalNotFinite { collision: 5, component, found }
                        if component == axis && found.to_bits() == value.to_bits()
                ));
            }
        }
    }

    #[test]
    fn a_normal_off_unit_length_is_refused() {
        for length in [1e-30, 0.998_9, 1.001_1, 2.0, 2e20] {
            assert_eq!(
                refused(&Collision { normal: [0.0, -length, 0.0], ..COLLISION }),
                InputError::NormalLength { collision: 5, length }
            );
        }
        let zero = Collision { normal: [0.0, -0.0, 0.0], ..COLLISION };
        assert_eq!(refused(&zero), InputError::NormalZero { collision: 5 });
        let overflows = Collision { normal: [3e38; 3], ..COLLISION };
        assert_eq!(
            refused(&overflows),
            InputError::NormalLength { collision: 5, length: f32::INFINITY }
        );
        for length in [0.999_1, 1.000_9] {
            let collision = Collision { normal: [0.0, 0.0, length], ..COLLISION };
            assert_eq!(check_collision(5, &collision, 3, collision.count), Ok((2, 0)));
        }
    }

    #[test]
    fn every_number_of_a_used_contact_point_that_is_not_finite_is_refused() {
        for value in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
            for slot in 0..3 {
                let check = |collision: Collision, name: &str, index: usize| {
                    assert!(
                        matches!(
                            refused(&collision),
                            InputError::ContactNotFinite {
                                collision: 5, contact, field, component, found,
                            } if (contact, field, component) == (slot, name, index)
                                && found.to_bits() == value.to_bits()
                        ),
                        "{slot} {name}[{index}] {value}"
                    );
                };
                for axis in 0..3 {
                    let mut collision = COLLISION;
                    collision.contacts[slot].point[axis] = value;
                    check(collision, "point", axis);
                }
                let mut collision = COLLISION;
                collision.contacts[slot].distance = value;
                check(collision, "distance", 0);
            }
        }
    }
}
