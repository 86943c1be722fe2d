//! Friction along the two tangents of a collision, and as a vector in the world.
//!
//! The accelerator makes two tangents of a unit normal n. They are the directions of
//! [`Impulses::friction`](crate::Impulses::friction). Where |n.z| is large:
//!
//! ```text
//! first  = k (0, n.z, -n.y)                   s = n.y² + n.z²
//! second = k (s, -n.x n.y, -n.x n.z)          k = 1 / sqrt(s)
//! ```
//!
//! and otherwise the same of x and y:
//!
//! ```text
//! first  = k (n.y, -n.x, 0)                   s = n.x² + n.y²
//! second = k (-n.x n.z, -n.y n.z, s)          k = 1 / sqrt(s)
//! ```
//!
//! Source: interface specification, §7, `tangents(q)` with q = -n.

use std::f32::consts::FRAC_1_SQRT_2;

/// The vector in the world of friction along the tangents of a normal.
#[inline]
pub(crate) fn in_world([x, y, z]: [f32; 3], (first, second): (f32, f32)) -> [f32; 3] {
    let steep = z.abs() > FRAC_1_SQRT_2;
    let s = if steep { y * y + z * z } else { x * x + y * y };
    let k = 1.0 / s.sqrt();
    let (first, second) = (k * first, k * second);
    if steep {
        let back = x * second;
        [s * second, z * first - y * back, -y * first - z * back]
    } else {
        let back = z * second;
        [y * first - x * back, -x * first - y * back, s * second]
    }
}

/// The parts of a vector of the world along the tangents of a normal.
#[inline]
pub(crate) fn along([x, y, z]: [f32; 3], [u, v, w]: [f32; 3]) -> (f32, f32) {
    if z.abs() > FRAC_1_SQRT_2 {
        let s = y * y + z * z;
        let k = 1.0 / s.sqrt();
        (k * (z * v - y * w), k * (s * u - x * (y * v + z * w)))
    } else {
        let s = x * x + y * y;
        let k = 1.0 / s.sqrt();
        (k * (y * u - x * v), k * (s * w - z * (x * u + y * v)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    type Vec3 = [f32; 3];

    /// The tangents as the specification spells them.
    fn tangents(normal: Vec3) -> [Vec3; 2] {
        let q @ [x, y, z] = normal.map(|component| -component);
        let cross =
            |[a, b, c]: Vec3, [d, e, f]: Vec3| [b * f - c * e, c * d - a * f, a * e - b * d];
        let first = if z.abs() > FRAC_1_SQRT_2 {
            let k = 1.0 / (y * y + z * z).sqrt();
            [0.0, -z * k, y * k]
        } else {
            let k = 1.0 / (x * x + y * y).sqrt();
            [-y * k, x * k, 0.0]
        };
        [first, cross(q, first)]
    }

    #[test]
    fn both_ways_are_those_of_the_tangents_of_every_normal() {
        let axes = [-1.0, -0.7, -0.3, 0.0, 0.4, 0.72, 1.0_f32];
        let dot = |a: Vec3, b: Vec3| (a[0] * b[0] + a[1] * b[1]) + a[2] * b[2];
        let all = axes.map(|x| axes.map(|y| axes.map(|z| [x, y, z])));
        for of in all.as_flattened().as_flattened().iter().filter(|of| dot(**of, **of) > 0.0) {
            let normal = of.map(|component| component / dot(*of, *of).sqrt());
            let [first, second] = tangents(normal);
            let expected = [0, 1, 2].map(|axis| first[axis] * 0.5 - second[axis] * 0.25);
            let found = in_world(normal, (0.5, -0.25));
            assert!(found.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-6), "{normal:?}");
            let vector = [0.3, -0.7, 0.2];
            let expected = [first, second].map(|tangent| dot(tangent, vector));
            let found: [f32; 2] = along(normal, vector).into();
            assert!(found.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-6), "{normal:?}");
        }
    }
}
