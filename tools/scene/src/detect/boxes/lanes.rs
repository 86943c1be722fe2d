//! This file is the arithmetic of four vectors at once: each lane rounds as a vector alone would.

use wide::f32x4;

/// One vector.
pub(super) type Vec3 = [f32; 3];

pub(super) fn dot(a: Vec3, b: Vec3) -> f32 {
    (a[0] * b[0] + a[1] * b[1]) + a[2] * b[2]
}

pub(super) fn cross(a: Vec3, b: Vec3) -> Vec3 {
    [a[1] * b[2] - b[1] * a[2], a[2] * b[0] - b[2] * a[0], a[0] * b[1] - b[0] * a[1]]
}

pub(super) fn subtract(a: Vec3, b: Vec3) -> Vec3 {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

pub(super) fn negate(a: Vec3) -> Vec3 {
    [-a[0], -a[1], -a[2]]
}

/// The magnitudes of one, the signs of the other, those of zeros too.
#[inline]
pub(super) fn with_sign(magnitude: f32x4, sign: f32x4) -> f32x4 {
    let bit = f32x4::splat(-0.0);
    (sign & bit) | (magnitude & !bit)
}

/// Four vectors.
#[derive(Debug, Clone, Copy)]
pub(super) struct Four {
    pub(super) x: f32x4,
    pub(super) y: f32x4,
    pub(super) z: f32x4,
}

impl Four {
    /// The same one four times.
    #[inline]
    pub(super) fn splat([x, y, z]: Vec3) -> Self {
        Self { x: f32x4::splat(x), y: f32x4::splat(y), z: f32x4::splat(z) }
    }

    #[inline]
    pub(super) fn new(vectors: [Vec3; 4]) -> Self {
        let [a, b, c, d] = vectors;
        let lanes = |k: usize| f32x4::new([a[k], b[k], c[k], d[k]]);
        Self { x: lanes(0), y: lanes(1), z: lanes(2) }
    }

    /// One vector each.
    #[inline]
    pub(super) fn vectors(self) -> [Vec3; 4] {
        let (x, y, z) = (self.x.to_array(), self.y.to_array(), self.z.to_array());
        [0, 1, 2, 3].map(|lane| [x[lane], y[lane], z[lane]])
    }

    #[inline]
    pub(super) fn plus(self, other: Self) -> Self {
        Self { x: self.x + other.x, y: self.y + other.y, z: self.z + other.z }
    }

    #[inline]
    pub(super) fn minus(self, other: Self) -> Self {
        Self { x: self.x - other.x, y: self.y - other.y, z: self.z - other.z }
    }

    #[inline]
    pub(super) fn times(self, factor: f32x4) -> Self {
        Self { x: self.x * factor, y: self.y * factor, z: self.z * factor }
    }

    #[inline]
    pub(super) fn dot(self, other: Self) -> f32x4 {
        (self.x * other.x + self.y * other.y) + self.z * other.z
    }

    /// The opposite signs, those of zeros too.
    #[inline]
    pub(super) fn negated(self) -> Self {
        let bit = f32x4::splat(-0.0);
        Self { x: self.x ^ bit, y: self.y ^ bit, z: self.z ^ bit }
    }

    /// The corners of a box that lie farthest in these directions.
    #[inline]
    pub(super) fn corners_of(half_extents: Vec3, directions: Self) -> Self {
        let half = Self::splat(half_extents);
        Self {
            x: with_sign(half.x, directions.x),
            y: with_sign(half.y, directions.y),
            z: with_sign(half.z, directions.z),
        }
    }
}

/// A rotation by a unit quaternion.
#[derive(Debug, Clone, Copy)]
pub(super) struct Rotation {
    axis: Vec3,
    /// w² less the square of the axis, and twice w.
    along: f32,
    across: f32,
}

impl Rotation {
    /// By x, y, z, w.
    #[inline]
    pub(super) fn new([x, y, z, w]: [f32; 4]) -> Self {
        let axis = [x, y, z];
        Self { axis, along: w * w - dot(axis, axis), across: w * 2.0 }
    }

    /// The other way round.
    #[inline]
    pub(super) fn inverse(self) -> Self {
        Self { axis: negate(self.axis), ..self }
    }

    /// A vector, turned.
    #[inline]
    pub(super) fn turn(self, v: Vec3) -> Vec3 {
        let (twice, aside) = (dot(v, self.axis) * 2.0, cross(self.axis, v));
        [0, 1, 2].map(|k| (v[k] * self.along + self.axis[k] * twice) + aside[k] * self.across)
    }

    /// Four vectors, turned.
    #[inline]
    pub(super) fn turn_four(self, v: Four) -> Four {
        let b = Four::splat(self.axis);
        let aside =
            Four { x: b.y * v.z - v.y * b.z, y: b.z * v.x - v.z * b.x, z: b.x * v.y - v.x * b.y };
        let twice = v.dot(b) * f32x4::splat(2.0);
        v.times(f32x4::splat(self.along))
            .plus(b.times(twice))
            .plus(aside.times(f32x4::splat(self.across)))
    }
}
