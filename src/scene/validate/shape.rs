//! This file refuses shape tables that the accelerator cannot hold.

use bitstream_model::interface::profile::Inertia;

use super::{Limits, exceeds};
use crate::scene::{Demand, InputError, Shape};

/// What the shape table refuses.
///
/// A moving shape of inverse inertia 0 is legal: it does not rotate.
pub(crate) fn validate_shapes(shapes: &[Shape], limits: &Limits) -> Result<(), InputError> {
    if shapes.is_empty() {
        return Err(InputError::NoShapes);
    }
    if exceeds(shapes.len(), limits.shape_capacity) {
        return Err(InputError::TooManyShapes {
            found: shapes.len(),
            limit: limits.shape_capacity,
        });
    }
    let demand = Demand { bodies: 0, collisions: 0, inertia: needed(shapes) };
    let format = limits.variant.numbers.bodies;
    // A subnormal would be 0 to a bitstream that flushes them: static there, moving here.
    let usable = |value: f32| value == 0.0 || (value > 0.0 && value.is_normal());
    for (index, shape) in shapes.iter().enumerate() {
        let [x, y, z] = shape.inverse_inertia;
        let fields = [
            ("inverse mass", 0, shape.inverse_mass),
            ("inverse inertia", 0, x),
            ("inverse inertia", 1, y),
            ("inverse inertia", 2, z),
        ];
        for (field, component, found) in fields {
            if !usable(found) {
                return Err(InputError::ShapeValue { shape: index, field, component, found });
            }
        }
        if let (true, Some(found)) = (shape.is_static(), [x, y, z].into_iter().find(|k| *k != 0.0))
        {
            return Err(InputError::StaticShapeRotates { shape: index, found });
        }
        match limits.variant.inertia {
            Inertia::Isotropic if !shape.is_isotropic() => {
                let carriers = demand.carriers(|_| true);
                let found = shape.inverse_inertia;
                return Err(InputError::Anisotropic { shape: index, found, carriers });
            }
            // It stays in the shape table, in f32.
            Inertia::Isotropic => {}
            Inertia::World => {
                let limit = format.largest();
                let beyond = (0..).zip([x, y, z]).find(|(_, found)| *found > limit);
                if let Some((component, found)) = beyond {
                    let carriers = demand.carriers(|variant| {
                        let streamed = variant.inertia == Inertia::World;
                        !streamed || found <= variant.numbers.bodies.largest()
                    });
                    return Err(InputError::InertiaOutOfRange {
                        shape: index,
                        component,
                        found,
                        format,
                        limit,
                        carriers,
                    });
                }
            }
        }
    }
    Ok(())
}

/// The least that shapes need to be told of their bodies' inertia.
pub(super) fn needed(shapes: &[Shape]) -> Inertia {
    let isotropic = shapes.iter().all(Shape::is_isotropic);
    if isotropic { Inertia::Isotropic } else { Inertia::World }
}

#[cfg(test)]
mod tests {
    use super::super::tests::{FLOAT, HALF, on};
    use super::*;

    const CUBE: Shape = Shape::isotropic(1.0, 1.5);

    fn validated(shapes: &[Shape]) -> Result<(), InputError> {
        validate_shapes(shapes, &FLOAT)
    }

    fn refused(shape: Shape) -> InputError {
        validated(&[Shape::STATIC, shape]).expect_err("a shape to be refused")
    }

    #[test]
    fn static_and_isotropic_shapes_are_accepted() {
        let sphere_that_does_not_turn = Shape::isotropic(2.0, 0.0);
        let shapes = [Shape::STATIC, CUBE, sphere_that_does_not_turn, Shape::isotropic(-0.0, 0.0)];
        assert_eq!(validated(&shapes), Ok(()));
    }

    #[test]
    fn an_empty_table_is_refused() {
        assert_eq!(validated(&[]), Err(InputError::NoShapes));
    }

    #[test]
    fn more_shapes_than_entries_are_refused() {
        assert_eq!(validated(&[CUBE; 64]), Ok(()));
        assert_eq!(validated(&[CUBE; 65]), Err(InputError::TooManyShapes { found: 65, limit: 64 }));
    }

    #[test]
    fn an_inverse_mass_that_is_none_is_refused() {
        for value in [-1.0, f32::NAN, f32::INFINITY, f32::NEG_INFINITY, 1e-40, -1e-40] {
            assert!(
                matches!(
                    refused(Shape::isotropic(value, 1.0)),
                    InputError::ShapeValue { shape: 1, field: "inverse mass", component: 0, found }
                        if found.to_bits() == value.to_bits()
                ),
                "{value}"
            );
        }
    }

    #[test]
    fn an_inverse_inertia_that_is_none_is_refused() {
        for value in [-1.0, f32::NAN, f32::INFINITY, 1e-40] {
            for axis in 0..3 {
                let mut shape = CUBE;
                shape.inverse_inertia[axis] = value;
                assert!(
                    matches!(
                        refused(shape),
                        InputError::ShapeValue { shape: 1, field: "inverse inertia", component, .. }
                            if component == axis
                    ),
                    "{value} {axis}"
                );
            }
        }
    }

    #[test]
    fn an_anisotropic_shape_is_refused() {
        for axis in 0..3 {
            let mut shape = CUBE;
            shape.inverse_inertia[axis] = 1.500_000_1;
            let found = shape.inverse_inertia;
            let error = refused(shape);
            assert!(
                matches!(error, InputError::Anisotropic { shape: 1, found: of, .. }
                    if of.map(f32::to_bits) == found.map(f32::to_bits)),
                "{error}"
            );
            assert!(
                error.to_string().ends_with(
                    "(profiles that could, built with world inertia: naive, float, half, mixed)"
                ),
                "{error}"
            );
            let world = on(FLOAT.variant.profile, Inertia::World);
            assert_eq!(validate_shapes(&[Shape::STATIC, shape], &world), Ok(()));
        }
    }

    #[test]
    fn an_inertia_that_is_streamed_must_fit_the_stream() {
        let shape = Shape { inverse_mass: 1.0, inverse_inertia: [1.0, 7e4, 1.0] };
        let error = validate_shapes(&[shape], &on(HALF.variant.profile, Inertia::World));
        let error = error.expect_err("beyond binary16");
        assert!(
            matches!(error, InputError::InertiaOutOfRange { shape: 0, component: 1, .. }),
            "{error}"
        );
        let text = error.to_string();
        assert!(text.contains("70000") && text.contains("65504"), "{text}");
        assert!(text.ends_with("could, built with world inertia: naive, float, mixed)"), "{text}");
        // In the shape table it stays f32.
        assert_eq!(validate_shapes(&[Shape::isotropic(1.0, 7e4)], &HALF), Ok(()));
    }

    #[test]
    fn a_static_shape_with_inertia_is_refused() {
        assert_eq!(
            refused(Shape::isotropic(0.0, 1.5)),
            InputError::StaticShapeRotates { shape: 1, found: 1.5 }
        );
    }
}
