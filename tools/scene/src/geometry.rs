//! The geometry of a body, and the mass properties that follow from it.

use zynq_pgs::Shape;
use zynq_pgs::scene::ShapeError;

use crate::{CUBE_HALF_EXTENT, hull};

/// The outline of a body, its centre of mass at the origin.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Geometry {
    /// A box, its faces across the axes.
    Box {
        /// Half its edges, m.
        half_extents: [f32; 3],
    },
    /// A sphere.
    Sphere {
        /// Radius, m.
        radius: f32,
    },
    /// All points within a radius of a segment on the y axis.
    Capsule {
        /// Half the length of that segment, m.
        half_height: f32,
        /// Radius, m.
        radius: f32,
    },
    /// A cylinder, its axis along y.
    Cylinder {
        /// Half its length, m.
        half_height: f32,
        /// Radius, m.
        radius: f32,
    },
    /// A convex hull. The body's axes must be its principal axes, and its faces have at most four
    /// corners.
    Hull {
        /// Corners, m.
        points: &'static [[f32; 3]],
    },
}

impl Geometry {
    /// The cube of the box-on-plane scene.
    pub const CUBE: Self = Self::Box { half_extents: [CUBE_HALF_EXTENT; 3] };

    /// A name for people.
    #[must_use]
    #[allow(
        clippy::float_cmp,
        reason = "a cube is a box of equal numbers, not of nearly equal ones"
    )]
    pub const fn name(&self) -> &'static str {
        match self {
            Self::Box { half_extents: [x, y, z] } if *x == *y && *x == *z => "cube",
            Self::Box { .. } => "box",
            Self::Sphere { .. } => "sphere",
            Self::Capsule { .. } => "capsule",
            Self::Cylinder { .. } => "cylinder",
            Self::Hull { .. } => "hull",
        }
    }

    /// Distance of the farthest point from the centre, m.
    #[must_use]
    pub fn bounding_radius(&self) -> f32 {
        match *self {
            Self::Box { half_extents: [x, y, z] } => ((x * x + y * y) + z * z).sqrt(),
            Self::Sphere { radius } => radius,
            Self::Capsule { half_height, radius } => half_height + radius,
            Self::Cylinder { half_height, radius } => {
                (half_height * half_height + radius * radius).sqrt()
            }
            Self::Hull { points } => {
                let length = |[x, y, z]: &[f32; 3]| ((x * x + y * y) + z * z).sqrt();
                points.iter().map(length).fold(0.0, f32::max)
            }
        }
    }

    /// The mass properties of a solid, homogeneous body of `mass` kg.
    ///
    /// # Errors
    /// [`ShapeError`]: a size or the mass is not above 0, or so large or small that
    /// the inertia leaves f32; a hull has no volume, or other principal axes than the body's.
    pub fn shape(&self, mass: f32) -> Result<Shape, ShapeError> {
        match *self {
            Self::Box { half_extents } => Shape::cuboid(mass, half_extents),
            Self::Sphere { radius } => Shape::sphere(mass, radius),
            Self::Capsule { half_height, radius } => Shape::capsule(mass, half_height, radius),
            Self::Cylinder { half_height, radius } => Shape::cylinder(mass, half_height, radius),
            Self::Hull { points } => {
                let per_mass = hull::inertia_per_mass(points).unwrap_or([f64::NAN; 3]);
                #[allow(clippy::cast_possible_truncation, reason = "rounding to f32 is meant")]
                let inertia = per_mass.map(|value| (f64::from(mass) * value) as f32);
                Shape::with_inertia(mass, inertia)
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A cuboctahedron with the corners (2, 1, 0), (2, 0, 3), (0, 1, 3), and all signs.
    const STRETCHED: [[f32; 3]; 12] = hull::cuboctahedron([2.0, 1.0, 3.0]);

    #[test]
    fn an_outline_has_the_mass_properties_of_its_solid() {
        let near = |geometry: Geometry, mass: f32, inertia: [f32; 3]| {
            let shape = geometry.shape(mass).expect("a shape");
            assert!((shape.inverse_mass * mass - 1.0).abs() < 1e-6, "{shape:?}");
            for (inverse, inertia) in shape.inverse_inertia.iter().zip(inertia) {
                assert!((inverse * inertia - 1.0).abs() < 1e-6, "{shape:?} for {inertia}");
            }
        };
        near(Geometry::CUBE, 1.0, [2.0 / 3.0; 3]);
        // 3 kg, edges 2, 4 and 6 m: m/12 (b² + c²).
        near(Geometry::Box { half_extents: [1.0, 2.0, 3.0] }, 3.0, [13.0, 10.0, 5.0]);
        near(Geometry::Sphere { radius: 0.5 }, 10.0, [1.0; 3]);
        // Half height 1, radius 2, 7 kg: 3/7 of it cylinder, 4/7 caps; along y 3 x 4/2 + 4 x 1.6,
        // across 3 (4/4 + 1/3) + 4 (1.6 + 1 + 3/2). Half height and radius must not change places.
        let capsule = Geometry::Capsule { half_height: 1.0, radius: 2.0 };
        near(capsule, 7.0, [20.4, 12.4, 20.4]);
        let cylinder = Geometry::Cylinder { half_height: 3.0, radius: 2.0 };
        near(cylinder, 5.0, [20.0, 10.0, 20.0]);
        // A cuboctahedron, stretched by 2, 1 and 3: the means of x², y² and z² are 0.28 times 4, 1
        // and 9, so that the moments of 10 kg are 2.8 times 1 + 9, 4 + 9 and 4 + 1.
        near(Geometry::Hull { points: &STRETCHED }, 10.0, [28.0, 36.4, 14.0]);
    }

    #[test]
    fn what_has_no_inertia_is_refused() {
        for (geometry, mass) in [
            (Geometry::CUBE, 0.0),
            (Geometry::Sphere { radius: f32::NAN }, 1.0),
            (Geometry::Capsule { half_height: -1.0, radius: 1.0 }, 1.0),
            (Geometry::Cylinder { half_height: 1.0, radius: 0.0 }, 1.0),
            (Geometry::Hull { points: &[] }, 1.0),
            // A corner of a cube, whose centre of mass is not the origin.
            (
                Geometry::Hull {
                    points: &[[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
                },
                1.0,
            ),
        ] {
            let refused = geometry.shape(mass);
            assert!(matches!(refused, Err(ShapeError { .. })), "{refused:?}");
        }
    }

    #[test]
    fn the_farthest_point_is_found() {
        assert!((Geometry::CUBE.bounding_radius() - 3.0_f32.sqrt()).abs() < 1e-6);
        let capsule = Geometry::Capsule { half_height: 0.6, radius: 0.4 };
        assert!((capsule.bounding_radius() - 1.0).abs() < 1e-6);
        let cylinder = Geometry::Cylinder { half_height: 0.6, radius: 0.8 };
        assert!((cylinder.bounding_radius() - 1.0).abs() < 1e-6);
        let hull = Geometry::Hull { points: &STRETCHED };
        assert!((hull.bounding_radius() - 13.0_f32.sqrt()).abs() < 1e-6);
    }
}
