//! Refuses shape tables that the accelerator cannot hold.

use pgs_interface::number::{Precision, StreamFormat};
use pgs_interface::profile::{Inertia, Variant};

use super::range::{SMALLEST_SHORT, computes_short};
use super::{Excess, InputError, InputItem, Limits, OutOfRange, SceneNeeds, exceeds};
use crate::scene::Shape;

const MASS: &str = "inverse mass";
const INERTIA: &str = "inverse inertia";

/// Checks a shape table before any scene uses it.
pub(crate) fn validate_shapes(shapes: &[Shape], limits: &Limits) -> Result<(), InputError> {
    let needs = SceneNeeds { bodies: 0, collisions: 0, inertia: needed(shapes) };
    check_shapes(shapes, &needs, limits)
}

/// Checks the shape table of a scene.
///
/// A moving shape of inverse inertia 0 is legal: it does not rotate.
pub(crate) fn check_shapes(
    shapes: &[Shape],
    needs: &SceneNeeds,
    limits: &Limits,
) -> Result<(), InputError> {
    if shapes.is_empty() {
        return Err(InputError::NoShapes);
    }
    if exceeds(shapes.len(), limits.shape_capacity) && !limits.variant.has_streamed_masses() {
        return Err(InputError::TooManyShapes {
            found: shapes.len(),
            limit: limits.shape_capacity,
        });
    }
    // `float` flushes subnormal numbers and takes a subnormal inverse mass for 0: the body
    // would be static there, and moving in the driver.
    let usable = |value: f32| value == 0.0 || (value > 0.0 && value.is_normal());
    for (index, shape) in shapes.iter().enumerate() {
        let [x, y, z] = shape.inverse_inertia;
        let fields =
            [(MASS, 0, shape.inverse_mass), (INERTIA, 0, x), (INERTIA, 1, y), (INERTIA, 2, z)];
        for (field, component, found) in fields {
            if !usable(found) {
                return Err(InputError::ShapeValue { shape: index, field, component, found });
            }
        }
        if let (true, Some(found)) = (shape.is_static(), [x, y, z].into_iter().find(|k| *k != 0.0))
        {
            return Err(InputError::StaticShapeRotates { shape: index, found });
        }
        if limits.variant.inertia == Inertia::Isotropic && !shape.is_isotropic() {
            let excess = Excess::Anisotropic { shape: index, found: shape.inverse_inertia };
            return Err(needs.refuse(excess, &|_| true));
        }
        let smallest = SMALLEST_SHORT;
        let beyond = |field: &'static str, found: f32, variant: &Variant| {
            let format = held(field, variant);
            let fits = match format {
                StreamFormat::F32 => true,
                short => found == 0.0 || (smallest..=short.largest()).contains(&found),
            };
            (!fits).then_some(format)
        };
        for (field, component, found) in fields {
            if let Some(format) = beyond(field, found, &limits.variant) {
                let (item, largest) = (InputItem::Shape(index), format.largest());
                let number =
                    OutOfRange { item, field, component, found, format, smallest, largest };
                let holds = |variant: &Variant| beyond(field, found, variant).is_none();
                return Err(needs.refuse(Excess::OutOfRange(number), &holds));
            }
        }
    }
    Ok(())
}

/// The narrowest format of an inverse mass or inertia on its way. The shape table holds f32; the
/// inertia about world axes is streamed and stored with the velocities.
fn held(field: &'static str, variant: &Variant) -> StreamFormat {
    let numbers = &variant.numbers;
    let streamed = field == INERTIA && variant.inertia == Inertia::World;
    match numbers.bodies {
        short if streamed && short.bits() == 16 => short,
        _ if computes_short(numbers) => StreamFormat::Binary16,
        _ if streamed && numbers.velocities == Precision::Binary16 => StreamFormat::Binary16,
        _ => StreamFormat::F32,
    }
}

/// The least inertia that a bitstream must be built with for these shapes.
pub(crate) fn needed(shapes: &[Shape]) -> Inertia {
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
        let streams = on(FLOAT.variant.profile, Inertia::World);
        assert_eq!(validate_shapes(&[CUBE; 65], &streams), Ok(()));
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
                matches!(error.excess(), Some(Excess::Anisotropic { shape: 1, found: of })
                    if of.map(f32::to_bits) == found.map(f32::to_bits)),
                "{error}"
            );
            assert!(
                error
                    .to_string()
                    .ends_with("(profiles that could, built with world inertia: float)"),
                "{error}"
            );
            let world = on(FLOAT.variant.profile, Inertia::World);
            assert_eq!(validate_shapes(&[Shape::STATIC, shape], &world), Ok(()));
        }
    }

    fn out_of_range(shape: Shape, limits: &Limits) -> String {
        let error = validate_shapes(&[Shape::STATIC, shape], limits).expect_err("out of range");
        let item = error.out_of_range().map(|number| number.item);
        assert_eq!(item, Some(InputItem::Shape(1)), "{error}");
        error.to_string()
    }

    #[test]
    fn what_binary16_does_not_hold_is_refused_where_it_computes() {
        assert_eq!(
            out_of_range(Shape::isotropic(1.0, 7e4), &HALF),
            "shape 1: its inverse inertia[0] is 7e4, but this bitstream holds it in binary16, from \
             5.9604645e-8 to 65504: give another shape, or load another bitstream (profiles that \
             could: naive, float)"
        );
        // 20 t: binary16 holds it as a subnormal number.
        let heavy = Shape::isotropic(5e-5, 0.1);
        assert_eq!(validate_shapes(&[heavy], &HALF), Ok(()));
        assert!(
            out_of_range(Shape::isotropic(1e-8, 0.1), &HALF).contains("inverse mass[0] is 1e-8")
        );
        assert_eq!(validate_shapes(&[heavy, Shape::isotropic(1e-30, 1e30)], &FLOAT), Ok(()));
    }

    #[test]
    fn an_inertia_that_is_streamed_must_fit_stream_and_array() {
        let shape = Shape { inverse_inertia: [1.0, 7e4, 1.0], ..Shape::isotropic(1.0, 1.0) };
        let mut world = on(FLOAT.variant.profile, Inertia::World);
        assert_eq!(validate_shapes(&[shape], &world), Ok(()));
        world.variant.numbers.velocities = Precision::Binary16;
        let text = out_of_range(shape, &world);
        assert!(text.contains("inverse inertia[1] is 7e4") && text.contains("65504"), "{text}");
        assert!(text.ends_with("could, built with world inertia: float)"), "{text}");
        // In the shape table it stays f32.
        let mut table = FLOAT;
        table.variant.numbers.velocities = Precision::Binary16;
        assert_eq!(validate_shapes(&[Shape::isotropic(1.0, 7e4)], &table), Ok(()));
    }

    #[test]
    fn a_static_shape_with_inertia_is_refused() {
        assert_eq!(
            refused(Shape::isotropic(0.0, 1.5)),
            InputError::StaticShapeRotates { shape: 1, found: 1.5 }
        );
    }
}
