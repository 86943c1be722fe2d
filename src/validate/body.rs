//! Refuses bodies that no bitstream can solve, or that this one cannot hold.

use std::ops::RangeInclusive;

use pgs_interface::number::StreamFormat;

use super::range::Held;
use super::{Excess, InputError, InputItem, OutOfRange, Scene, first};
use crate::scene::{Body, Shape};

const LINEAR: &str = "linear velocity";
const ANGULAR: &str = "angular velocity";

/// Checks one body.
pub(crate) fn check_body(index: usize, body: &Body, scene: &Scene<'_>) -> Result<(), InputError> {
    for (field, values, format) in fields(body, &scene.held) {
        if let Some((component, found)) = first(values, |value| !value.is_finite()) {
            return Err(InputError::BodyNotFinite { body: index, field, component, found });
        }
        let largest = format.largest();
        let beyond = |value: f32, limit: f32| value.is_nan() || value.abs() > limit;
        if let Some((component, found)) = first(values, |value| beyond(value, largest)) {
            let (item, smallest) = (InputItem::Body(index), 0.0);
            let number = OutOfRange { item, field, component, found, format, smallest, largest };
            return Err(scene.needs.refuse(Excess::OutOfRange(number), &|variant| {
                let mut fields = fields(body, &Held::by(&variant.numbers)).into_iter();
                fields.all(|(_, values, format)| {
                    first(values, |value| beyond(value, format.largest())).is_none()
                })
            }));
        }
    }
    let length = length(body.pose.orientation);
    if !LENGTHS.contains(&length) {
        return Err(InputError::Orientation { body: index, length });
    }
    let Some(shape) = scene.shape_of(body) else {
        let shapes = scene.shapes.len();
        return Err(InputError::ShapeIndex { body: index, found: body.shape, shapes });
    };
    if shape.is_static() && !scene.kinematic {
        for (field, values) in [(LINEAR, body.velocity.linear), (ANGULAR, body.velocity.angular)] {
            if let Some((component, found)) = first(&values, |value| value != 0.0) {
                return Err(InputError::StaticBodyMoves { body: index, field, component, found });
            }
        }
    }
    Ok(())
}

/// The lengths that an orientation may have.
const LENGTHS: RangeInclusive<f32> = InputError::SHORTEST_ORIENTATION..=f32::MAX;

/// The length of an orientation.
#[inline(always)]
fn length([x, y, z, w]: [f32; 4]) -> f32 {
    (x * x + y * y + z * z + w * w).sqrt()
}

impl Scene<'_> {
    /// Whether [`check_body`] accepts a body of this shape, apart from the limits on its numbers.
    #[inline(always)]
    pub(crate) fn accepts_body(&self, body: &Body, shape: Option<&Shape>) -> bool {
        let Some(shape) = shape else { return false };
        let speeds = [body.velocity.linear, body.velocity.angular];
        let rests = || speeds.as_flattened().iter().all(|speed| *speed == 0.0);
        LENGTHS.contains(&length(body.pose.orientation))
            && (!shape.is_static() || self.kinematic || rests())
    }
}

/// A field of a body: name, values, format.
type Field<'a> = (&'static str, &'a [f32], StreamFormat);

/// The streamed fields of a body.
#[inline]
fn fields<'a>(body: &'a Body, held: &Held) -> [Field<'a>; 4] {
    [
        ("position", &body.pose.position, held.poses),
        ("orientation", &body.pose.orientation, held.poses),
        (LINEAR, &body.velocity.linear, held.velocities),
        (ANGULAR, &body.velocity.angular, held.velocities),
    ]
}

#[cfg(test)]
mod tests {
    use super::super::tests::scene_on;
    use super::*;
    use crate::scene::{Pose, Velocity};
    use pgs_interface::profile::{FLOAT, HALF, Profile};

    const MOVING: Body = Body {
        pose: Pose { position: [1.0, 2.0, 3.0], orientation: [0.0, 0.0, 0.0, 1.0] },
        velocity: Velocity { linear: [4.0, 5.0, 6.0], angular: [7.0, 8.0, 9.0] },
        shape: 1,
    };

    fn check_on(profile: &'static Profile, body: &Body) -> Result<(), InputError> {
        check_body(7, body, &scene_on(&profile.default_variant()))
    }

    fn check(body: &Body) -> Result<(), InputError> {
        check_on(&FLOAT, body)
    }

    fn refused(body: &Body) -> InputError {
        check(body).expect_err("a body to be refused")
    }

    #[test]
    fn numbers_beyond_the_format_are_refused_on_streams_of_sixteen_bits_alone() {
        let edge = [65_504.0, -65_504.0, 0.0];
        let mut body = Body { velocity: Velocity { linear: edge, angular: edge }, ..MOVING };
        body.pose.position = edge;
        assert_eq!(check_on(&HALF, &body), Ok(()));
        body.velocity.angular[1] = -65_504.0_f32.next_up();
        assert_eq!(check_on(&FLOAT, &body), Ok(()), "bodies are f32 there");
        let refused = check_on(&HALF, &body).expect_err("beyond binary16");
        let number = refused.out_of_range().expect("out of range");
        assert_eq!((number.item, number.field), (InputItem::Body(7), "angular velocity"));
        assert_eq!((number.component, number.format), (1, StreamFormat::Binary16));
        assert_eq!(
            refused.to_string(),
            "body 7: angular velocity[1] is -65504.004, but this bitstream holds bodies in \
             binary16, which ends at 65504: bring it into range, or load another (profiles that \
             could: naive, float)"
        );
        body.velocity.angular[1] = f32::NAN;
        let refused = check_on(&HALF, &body).expect_err("no number");
        assert!(matches!(refused, InputError::BodyNotFinite { component: 1, .. }), "{refused}");
    }

    #[test]
    fn moving_and_resting_bodies_are_accepted() {
        assert_eq!(check(&MOVING), Ok(()));
        let zero = Velocity { linear: [0.0, -0.0, 0.0], angular: [-0.0; 3] };
        assert_eq!(check(&Body { velocity: zero, shape: 0, ..MOVING }), Ok(()));
    }

    #[test]
    fn every_number_that_is_not_finite_is_refused() {
        for value in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
            let names = |body: Body, name: &str, index: usize| {
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
                names(body, "position", component);
                let mut body = MOVING;
                body.velocity.linear[component] = value;
                names(body, "linear velocity", component);
                let mut body = MOVING;
                body.velocity.angular[component] = value;
                names(body, "angular velocity", component);
            }
            for component in 0..4 {
                let mut body = MOVING;
                body.pose.orientation[component] = value;
                names(body, "orientation", component);
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
        assert_eq!(check(&body), Ok(()));
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
