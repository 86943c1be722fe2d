//! This file refuses shape tables that the accelerator cannot hold.

use super::exceeds;
use crate::scene::{InputError, Shape};

/// What the shape table refuses.
///
/// A moving shape of inverse inertia 0 is legal: it does not rotate.
pub(crate) fn validate_shapes(shapes: &[Shape], shape_capacity: u32) -> Result<(), InputError> {
    if shapes.is_empty() {
        return Err(InputError::NoShapes);
    }
    if exceeds(shapes.len(), shape_capacity) {
        return Err(InputError::TooManyShapes { found: shapes.len(), limit: shape_capacity });
    }
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
        if x - y != 0.0 || x - z != 0.0 {
            return Err(InputError::Anisotropic { shape: index, found: shape.inverse_inertia });
        }
        if shape.is_static() && x != 0.0 {
            return Err(InputError::StaticShapeRotates { shape: index, found: x });
        }
    }
    Ok(())
}

impl Shape {
    /// Whether bodies of this shape never move.
    pub(super) fn is_static(&self) -> bool {
        self.inverse_mass == 0.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const CUBE: Shape = Shape::isotropic(1.0, 1.5);

    fn refused(shape: Shape) -> InputError {
        validate_shapes(&[Shape::STATIC, shape], 64).expect_err("a shape to be refused")
    }

    #[test]
    fn static_and_isotropic_shapes_are_accepted() {
        let sphere_that_does_not_turn = Shape::isotropic(2.0, 0.0);
        let shapes = [Shape::STATIC, CUBE, sphere_that_does_not_turn, Shape::isotropic(-0.0, 0.0)];
        assert_eq!(validate_shapes(&shapes, 4), Ok(()));
    }

    #[test]
    fn an_empty_table_is_refused() {
        assert_eq!(validate_shapes(&[], 64), Err(InputError::NoShapes));
    }

    #[test]
    fn more_shapes_than_entries_are_refused() {
        assert_eq!(validate_shapes(&[CUBE; 64], 64), Ok(()));
        assert_eq!(
            validate_shapes(&[CUBE; 65], 64),
            Err(InputError::TooManyShapes { found: 65, limit: 64 })
        );
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
            assert_eq!(refused(shape), InputError::Anisotropic { shape: 1, found });
        }
    }

    #[test]
    fn a_static_shape_with_inertia_is_refused() {
        assert_eq!(
            refused(Shape::isotropic(0.0, 1.5)),
            InputError::StaticShapeRotates { shape: 1, found: 1.5 }
        );
    }
}
