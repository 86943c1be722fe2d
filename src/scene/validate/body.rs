//! This file refuses bodies that cannot be solved.

use super::{all_finite, first};
use crate::scene::{Body, InputError, Shape};

const LINEAR: &str = "linear velocity";
const ANGULAR: &str = "angular velocity";

/// What of one body a step refuses.
#[inline]
pub(super) fn check_body(index: usize, body: &Body, shapes: &[Shape]) -> Result<(), InputError> {
    let fields: [(&'static str, &[f32]); 4] = [
        ("position", &body.pose.position),
        ("orientation", &body.pose.orientation),
        (LINEAR, &body.velocity.linear),
        (ANGULAR, &body.velocity.angular),
    ];
    for (field, values) in fields {
        if !all_finite(values) {
            let (component, found) = first(values, |value| !value.is_finite());
            return Err(InputError::BodyNotFinite { body: index, field, component, found });
        }
    }
    let [x, y, z, w] = body.pose.orientation;
    let length = (x * x + y * y + z * z + w * w).sqrt();
    if !(InputError::SHORTEST_ORIENTATION..=f32::MAX).contains(&length) {
        return Err(InputError::Orientation { body: index, length });
    }
    let Some(shape) = shapes.get(shape_of(body)) else {
        let shapes = shapes.len();
        return Err(InputError::ShapeIndex { body: index, found: body.shape, shapes });
    };
    if shape.is_static() {
        for (field, values) in [(LINEAR, body.velocity.linear), (ANGULAR, body.velocity.angular)] {
            if values.iter().any(|value| *value != 0.0) {
                let (component, found) = first(&values, |value| value != 0.0);
                return Err(InputError::StaticBodyMoves { body: index, field, component, found });
            }
        }
    }
    Ok(())
}

/// A body's shape as an index; an index that this machine cannot address is in no table.
pub(super) fn shape_of(body: &Body) -> usize {
    usize::try_from(body.shape).unwrap_or(usize::MAX)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Pose, Velocity};

    const SHAPES: [Shape; 2] = [Shape::STATIC, Shape::isotropic(1.0, 1.5)];
    const MOVING: Body = Body {
        pose: Pose { position: [1.0, 2.0, 3.0], orientation: [0.0, 0.0, 0.0, 1.0] },
        velocity: Velocity { linear: [4.0, 5.0, 6.0], angular: [7.0, 8.0, 9.0] },
        shape: 1,
    };

    fn refused(body: &Body) -> InputError {
        check_body(7, body, &SHAPES).expect_err("a body to be refused")
    }

    #[test]
    fn moving_and_resting_bodies_are_accepted() {
        assert_eq!(check_body(0, &MOVING, &SHAPES), Ok(()));
        let zero = Velocity { linear: [0.0, -0.0, 0.0], angular: [-0.0; 3] };
        assert_eq!(check_body(0, &Body { velocity: zero, shape: 0, ..MOVING }, &SHAPES), Ok(()));
    }

    #[test]
    fn every_number_that_is_not_finite_is_refused() {
        for value in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
            let check = |body: Body, name: &str, index: usize| {
                assert!(
                    matches!(
                        refused(&body),
                        InputError::BodyNotFinite { body: 7, field, component, found }
                            if (field, component) == (name, index)
                                && found.to_bits() == value.to_bits()
                    ),
                    "{name}[{index}] {value}"
                );
            };
            for component in 0..3 {
                let mut body = MOVING;
                body.pose.position[component] = value;
                check(body, "position", component);
                let mut body = MOVING;
                body.velocity.linear[component] = value;
                check(body, "linear velocity", component);
                let mut body = MOVING;
                body.velocity.angular[component] = value;
                check(body, "angular velocity", component);
            }
            for component in 0..4 {
                let mut body = MOVING;
                body.pose.orientation[component] = value;
                check(body, "orientation", component);
            }
        }
    }

    #[test]
    fn an_orientation_that_cannot_be_normalised_is_refused() {
        for (value, expected) in [(0.0, 0.0), (9e-7, 9e-7), (3e38, f32::INFINITY)] {
            let mut body = MOVING;
            body.pose.orientation = [0.0, 0.0, value, 0.0];
            assert!(
                matches!(
                    refused(&body),
                    InputError::Orientation { body: 7, length }
                        if (length - expected).abs() <= 1e-9 || length.is_infinite()
                            && expected.is_infinite()
                ),
                "{value}"
            );
        }
        let mut body = MOVING;
        body.pose.orientation = [0.0, 0.0, 0.0, -2e-6];
        assert_eq!(check_body(7, &body, &SHAPES), Ok(()));
    }

    #[test]
    fn a_static_body_that_moves_is_refused() {
        let moves = |field, component, found| InputError::StaticBodyMoves {
            body: 7,
            field,
            component,
            found,
        };
        let mut body = Body { velocity: Velocity::default(), shape: 0, ..MOVING };
        body.velocity.angular[0] = 1e-40;
        assert_eq!(refused(&body), moves("angular velocity", 0, 1e-40));
        body.velocity.linear[2] = -1.0;
        assert_eq!(refused(&body), moves("linear velocity", 2, -1.0));
    }

    #[test]
    fn a_shape_outside_the_table_is_refused() {
        for found in [2, u32::MAX] {
            assert_eq!(
                refused(&Body { shape: found, ..MOVING }),
                InputError::ShapeIndex { body: 7, found, shapes: 2 }
            );
        }
    }
}
