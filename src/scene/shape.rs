//! Shapes: the mass properties that bodies refer to by index.

use pgs_support::float_env::standard;
use thiserror::Error;

/// The error of a shape that has no mass properties.
#[derive(Debug, Clone, Copy, PartialEq, Error)]
#[error(
    "the {parameter} of a shape is {found:e}, expected a number above 0 with which mass and \
     inertia stay in the range of f32: correct it"
)]
#[non_exhaustive]
pub struct ShapeError {
    /// Mass, half extent, half height or radius.
    pub parameter: &'static str,
    /// Its value, kg or m.
    pub found: f32,
}

/// Mass properties and friction shared by bodies.
///
/// The axes of the inertia are the body's axes: its orientation turns them into the world.
///
/// ```
/// use zynq_pgs::Shape;
///
/// # fn main() -> Result<(), zynq_pgs::scene::ShapeError> {
/// // A cube of 1 kg with edges of 2 m: inertia 2/3 kg m².
/// assert_eq!(Shape::cuboid(1.0, [1.0; 3])?, Shape::isotropic(1.0, 1.5));
/// assert!(!Shape::cuboid(1.0, [2.0, 1.0, 0.5])?.is_isotropic());
/// # Ok(())
/// # }
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Shape {
    /// Inverse mass, 1/kg; 0 is static.
    pub inverse_mass: f32,
    /// Diagonal of the inverse inertia about the body's axes, 1/(kg m²). Unless the three are equal
    /// the shape needs a bitstream with world inertia.
    pub inverse_inertia: [f32; 3],
}

impl Shape {
    /// A shape that never moves.
    pub const STATIC: Self = Self::isotropic(0.0, 0.0);

    /// A shape whose inertia is the same about every axis (cube, sphere).
    #[must_use]
    pub const fn isotropic(inverse_mass: f32, inverse_inertia: f32) -> Self {
        Self { inverse_mass, inverse_inertia: [inverse_inertia; 3] }
    }

    /// A solid box of uniform density: I.x = m (h.y² + h.z²) / 3, and likewise for y and z.
    ///
    /// Units: kg; half lengths of the edges along the body's x, y and z, m.
    ///
    /// # Errors
    /// [`ShapeError`]: an argument is not above 0, or it is so large or so small that the inertia
    /// leaves f32.
    pub fn cuboid(mass: f32, half_extents: [f32; 3]) -> Result<Self, ShapeError> {
        let [hx, hy, hz] = half_extents;
        Self::solid(
            mass,
            &[("half extent x", hx), ("half extent y", hy), ("half extent z", hz)],
            |[x, y, z]| {
                let about = |a: f64, b: f64| (a * a + b * b) / 3.0;
                [about(y, z), about(x, z), about(x, y)]
            },
        )
    }

    /// A solid sphere of uniform density: I = 2/5 m r².
    ///
    /// Units: kg, m.
    ///
    /// # Errors
    /// As for [`cuboid`](Self::cuboid).
    pub fn sphere(mass: f32, radius: f32) -> Result<Self, ShapeError> {
        Self::solid(mass, &[("radius", radius)], |[r]| [0.4 * r * r; 3])
    }

    /// A solid capsule of uniform density, its axis along the body's y: a cylinder of length 2 h
    /// with a half sphere at either end.
    ///
    /// ```text
    /// mc / m = 2 h r² / (2 h r² + 4/3 r³)                 the cylinder's share of the mass
    /// ms = m - mc                                         the half spheres'
    /// I.y = mc r² / 2 + ms 2/5 r²
    /// I.x = I.z = mc (r² / 4 + h² / 3) + ms (2/5 r² + h² + 3/4 h r)
    /// ```
    ///
    /// Units: kg; half length of the cylinder and radius, m.
    ///
    /// # Errors
    /// As for [`cuboid`](Self::cuboid).
    pub fn capsule(mass: f32, half_height: f32, radius: f32) -> Result<Self, ShapeError> {
        Self::solid(mass, &[("half height", half_height), ("radius", radius)], |[h, r]| {
            let cylinder = 2.0 * h / (2.0 * h + 4.0 / 3.0 * r);
            let caps = 1.0 - cylinder;
            let ball = 0.4 * r * r;
            let along = cylinder * r * r / 2.0 + caps * ball;
            let across =
                cylinder * (r * r / 4.0 + h * h / 3.0) + caps * (ball + h * h + 0.75 * h * r);
            [across, along, across]
        })
    }

    /// A solid cylinder of uniform density, its axis along the body's y: I.y = m r² / 2, and
    /// I.x = I.z = m (r² / 4 + h² / 3).
    ///
    /// Units: kg; half its length and its radius, m.
    ///
    /// # Errors
    /// As for [`cuboid`](Self::cuboid).
    pub fn cylinder(mass: f32, half_height: f32, radius: f32) -> Result<Self, ShapeError> {
        Self::solid(mass, &[("half height", half_height), ("radius", radius)], |[h, r]| {
            let across = r * r / 4.0 + h * h / 3.0;
            [across, r * r / 2.0, across]
        })
    }

    /// A body of any form, by its moments of inertia about the body's axes, which must be its
    /// principal axes.
    ///
    /// Units: kg, kg m².
    ///
    /// # Errors
    /// As for [`cuboid`](Self::cuboid).
    pub fn with_inertia(mass: f32, inertia: [f32; 3]) -> Result<Self, ShapeError> {
        let [x, y, z] = inertia;
        Self::solid(
            mass,
            &[("inertia about x", x), ("inertia about y", y), ("inertia about z", z)],
            |inertia| inertia.map(|value| value / f64::from(mass)),
        )
    }

    /// A shape whose inertia per kg follows from its size.
    fn solid<const N: usize>(
        mass: f32,
        sizes: &[(&'static str, f32); N],
        inertia: impl Fn([f64; N]) -> [f64; 3],
    ) -> Result<Self, ShapeError> {
        standard(|| Self::computed(mass, sizes, inertia))
    }

    fn computed<const N: usize>(
        mass: f32,
        sizes: &[(&'static str, f32); N],
        inertia: impl Fn([f64; N]) -> [f64; 3],
    ) -> Result<Self, ShapeError> {
        for (parameter, found) in [("mass", mass)].into_iter().chain(*sizes) {
            if !(found > 0.0 && found.is_finite()) {
                return Err(ShapeError { parameter, found });
            }
        }
        // In f64 nothing here leaves the range of numbers, and f32 rounds once.
        #[expect(clippy::cast_possible_truncation, reason = "rounded to f32, and checked below")]
        let inverse = |value: f64| (1.0 / value) as f32;
        let inverse_mass = inverse(mass.into());
        let inverse_inertia = inertia(sizes.map(|(_, size)| size.into()))
            .map(|per_mass| inverse(f64::from(mass) * per_mass));
        if !inverse_mass.is_normal() {
            return Err(ShapeError { parameter: "mass", found: mass });
        }
        if !inverse_inertia.iter().all(|value| value.is_normal()) {
            let (parameter, found) = sizes[0];
            return Err(ShapeError { parameter, found });
        }
        Ok(Self { inverse_inertia, ..Self::isotropic(inverse_mass, 0.0) })
    }

    /// Whether the inertia is the same about every axis.
    #[must_use]
    #[inline(always)]
    pub fn is_isotropic(&self) -> bool {
        let [x, y, z] = self.inverse_inertia;
        x - y == 0.0 && x - z == 0.0
    }

    /// Whether bodies of this shape never move.
    #[must_use]
    #[inline(always)]
    pub fn is_static(&self) -> bool {
        self.inverse_mass == 0.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn close(found: f32, expected: f64) {
        assert!((f64::from(found) / expected - 1.0).abs() < 1e-6, "{found} is not {expected}");
    }

    #[test]
    fn a_box_has_its_inertia_about_its_own_axes() {
        // 12 kg, 1 x 2 x 4 m: 12/12 (2² + 4²) = 20, (1² + 4²) = 17, (1² + 2²) = 5 kg m².
        let shape = Shape::cuboid(12.0, [0.5, 1.0, 2.0]).expect("a box");
        close(shape.inverse_mass, 1.0 / 12.0);
        for (found, inertia) in shape.inverse_inertia.into_iter().zip([20.0, 17.0, 5.0]) {
            close(found, 1.0 / inertia);
        }
        assert!(!shape.is_isotropic());
    }

    #[test]
    fn cubes_and_spheres_are_isotropic_to_the_bit() {
        for size in [0.1, 0.3, 1.0, 7.7] {
            for shape in [Shape::cuboid(0.7, [size; 3]), Shape::sphere(0.7, size)] {
                let [x, y, z] = shape.expect("a shape").inverse_inertia.map(f32::to_bits);
                assert_eq!((x, x), (y, z));
            }
        }
        // 5 kg, 2 m: 2/5 x 5 x 4 = 8 kg m².
        close(Shape::sphere(5.0, 2.0).expect("a sphere").inverse_inertia[0], 0.125);
    }

    #[test]
    fn a_capsule_lies_between_its_cylinder_and_its_sphere() {
        // h = 1, r = 1, 10 kg: volumes 2 pi and 4/3 pi, which are 6 kg and 4 kg.
        // I.y = 6/2 + 4 x 2/5 = 4.6; I.x = 6 (1/4 + 1/3) + 4 (2/5 + 1 + 3/4) = 3.5 + 8.6 = 12.1.
        let [x, y, z] = Shape::capsule(10.0, 1.0, 1.0).expect("a capsule").inverse_inertia;
        close(x, 1.0 / 12.1);
        close(y, 1.0 / 4.6);
        assert_eq!(x.to_bits(), z.to_bits());
        // Almost a sphere.
        let flat = Shape::capsule(5.0, 1e-9, 2.0).expect("a capsule");
        flat.inverse_inertia.into_iter().for_each(|found| close(found, 0.125));
        // Almost a rod of length 2 h: m (2h)² / 12.
        close(Shape::capsule(3.0, 1000.0, 1e-4).expect("a rod").inverse_inertia[0], 1e-6);
    }

    #[test]
    fn a_cylinder_lies_between_a_disc_and_a_rod() {
        // 12 kg, 2 m long, radius 1 m: I.y = 12 / 2, I.x = 12 (1/4 + 1/3).
        let [x, y, z] = Shape::cylinder(12.0, 1.0, 1.0).expect("a cylinder").inverse_inertia;
        close(x, 1.0 / 7.0);
        close(y, 1.0 / 6.0);
        assert_eq!(x.to_bits(), z.to_bits());
        close(Shape::cylinder(3.0, 1000.0, 1e-4).expect("a rod").inverse_inertia[0], 1e-6);
        close(Shape::cylinder(1.0, 1e-9, 2.0).expect("a disc").inverse_inertia[0], 1.0);
    }

    #[test]
    fn moments_of_inertia_are_inverted() {
        let shape = Shape::with_inertia(3.0, [0.5, 2.0, 8.0]).expect("a shape");
        close(shape.inverse_mass, 1.0 / 3.0);
        for (found, expected) in shape.inverse_inertia.into_iter().zip([2.0, 0.5, 0.125]) {
            close(found, expected);
        }
    }

    #[test]
    fn parameters_that_are_not_above_zero_are_refused_by_name() {
        for bad in [0.0, -1.0, f32::NAN, f32::INFINITY] {
            let refused = |shape: Result<Shape, ShapeError>, name: &str| {
                assert!(
                    matches!(
                        shape,
                        Err(ShapeError { parameter, found })
                            if parameter == name && found.to_bits() == bad.to_bits()
                    ),
                    "{name} {bad}: {shape:?}"
                );
            };
            refused(Shape::cuboid(bad, [1.0; 3]), "mass");
            refused(Shape::cuboid(1.0, [1.0, bad, 1.0]), "half extent y");
            refused(Shape::sphere(1.0, bad), "radius");
            refused(Shape::capsule(1.0, bad, 1.0), "half height");
            refused(Shape::capsule(1.0, 1.0, bad), "radius");
            refused(Shape::cylinder(1.0, bad, 1.0), "half height");
            refused(Shape::cylinder(1.0, 1.0, bad), "radius");
            refused(Shape::with_inertia(bad, [1.0; 3]), "mass");
            refused(Shape::with_inertia(1.0, [1.0, bad, 1.0]), "inertia about y");
        }
    }

    #[test]
    fn an_inertia_beyond_f32_is_refused() {
        assert!(Shape::sphere(1e-39, 1.0).is_err(), "the inverse of a subnormal mass is infinite");
        assert!(Shape::sphere(1.0, 1e-20).is_err());
        assert!(Shape::sphere(1e20, 1e20).is_err());
        assert!(Shape::cuboid(f32::MAX, [1.0; 3]).is_err(), "its inverse is subnormal");
    }
}
