//! This file says what a body looks like, and what mass properties follow from it.

use zynq_pgs::Shape;

use crate::CUBE_HALF_EXTENT;

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
    /// All points up to a radius away from a piece of the y axis.
    Capsule {
        /// Half the length of that piece, m.
        half_height: f32,
        /// Radius, m.
        radius: f32,
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
        }
    }

    /// Distance of the farthest point from the centre, m.
    #[must_use]
    pub fn bounding_radius(&self) -> f32 {
        match *self {
            Self::Box { half_extents: [x, y, z] } => ((x * x + y * y) + z * z).sqrt(),
            Self::Sphere { radius } => radius,
            Self::Capsule { half_height, radius } => half_height + radius,
        }
    }

    /// The mass properties of a solid body of `mass` kg, the same everywhere inside: textbook
    /// inertia, computed in f64 and rounded once.
    #[must_use]
    pub fn shape(&self, mass: f32) -> Shape {
        let m = f64::from(mass);
        let inertia = match *self {
            Self::Box { half_extents } => {
                let [x, y, z] = half_extents.map(|half| f64::from(half) * f64::from(half));
                [y + z, x + z, x + y].map(|sum| m / 3.0 * sum)
            }
            Self::Sphere { radius } => [0.4 * m * f64::from(radius) * f64::from(radius); 3],
            Self::Capsule { half_height, radius } => {
                let (h, r) = (f64::from(half_height), f64::from(radius));
                // A cylinder of length 2 h and two half spheres; their common factor pi r² is left
                // out of the volumes.
                let (cylinder, caps) = (2.0 * h, 4.0 / 3.0 * r);
                let (cylinder, caps) =
                    (m * cylinder / (cylinder + caps), m * caps / (cylinder + caps));
                let along = cylinder * r * r / 2.0 + 0.4 * caps * r * r;
                // A half sphere has its centre of mass 3 r / 8 above its flat side.
                let across = cylinder * (r * r / 4.0 + h * h / 3.0)
                    + caps * (0.4 * r * r + h * h + 0.75 * h * r);
                [across, along, across]
            }
        };
        #[allow(clippy::cast_possible_truncation, reason = "rounding to f32 is meant")]
        let inverse_inertia = inertia.map(|inertia| (1.0 / inertia) as f32);
        Shape { inverse_mass: 1.0 / mass, inverse_inertia }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn near(shape: Shape, mass: f32, inertia: [f32; 3]) {
        assert!((shape.inverse_mass * mass - 1.0).abs() < 1e-6, "{shape:?}");
        for (inverse, inertia) in shape.inverse_inertia.iter().zip(inertia) {
            assert!((inverse * inertia - 1.0).abs() < 1e-6, "{shape:?} for {inertia}");
        }
    }

    #[test]
    fn inertias_are_the_textbooks() {
        near(Geometry::CUBE.shape(1.0), 1.0, [2.0 / 3.0; 3]);
        // 3 kg, edges 2, 4 and 6 m: m/12 (b² + c²).
        let block = Geometry::Box { half_extents: [1.0, 2.0, 3.0] };
        near(block.shape(3.0), 3.0, [13.0, 10.0, 5.0]);
        near(Geometry::Sphere { radius: 0.5 }.shape(10.0), 10.0, [1.0; 3]);
    }

    #[test]
    fn a_capsule_lies_between_a_sphere_and_a_rod() {
        let capsule = |half_height, radius| Geometry::Capsule { half_height, radius }.shape(10.0);
        near(capsule(0.0, 0.5), 10.0, [1.0; 3]);
        // A rod of 2 m: m l²/12 across; along it almost nothing.
        let rod = capsule(1.0, 1e-3).inverse_inertia;
        assert!((rod[0] * 10.0 * 4.0 / 12.0 - 1.0).abs() < 1e-2, "{rod:?}");
        assert!(rod[1] > 1e5, "{rod:?}");
        // Half height 1, radius 1, 1 kg: 3/5 of it cylinder, 2/5 caps.
        // Across 0.6 (1/4 + 1/3) + 0.4 (0.4 + 1 + 0.75) = 1.21, along 0.3 + 0.16 = 0.46.
        let same = Geometry::Capsule { half_height: 1.0, radius: 1.0 };
        near(same.shape(1.0), 1.0, [1.21, 0.46, 1.21]);
    }

    #[test]
    fn the_farthest_point_is_found() {
        assert!((Geometry::CUBE.bounding_radius() - 3.0_f32.sqrt()).abs() < 1e-6);
        let capsule = Geometry::Capsule { half_height: 0.6, radius: 0.4 };
        assert!((capsule.bounding_radius() - 1.0).abs() < 1e-6);
    }
}
