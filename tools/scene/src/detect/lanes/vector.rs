//! Vectors and rotations in lanes: each lane rounds as glam's scalar arithmetic does.

use super::{Mask, Numbers, Row};

/// A vector in each lane.
#[derive(Debug, Clone, Copy)]
pub(in super::super) struct Vector<N> {
    pub(in super::super) x: N,
    pub(in super::super) y: N,
    pub(in super::super) z: N,
}

impl<N: Numbers> Vector<N> {
    /// The same vector in each lane; `any` serves only as proof of the instructions.
    #[inline(always)]
    pub(in super::super) fn all(any: N, [x, y, z]: [f32; 3]) -> Self {
        Self { x: any.all(x), y: any.all(y), z: any.all(z) }
    }

    /// The lanes of x, y and z.
    #[inline(always)]
    pub(in super::super) fn rows(self) -> [Row; 3] {
        [self.x.row(), self.y.row(), self.z.row()]
    }

    /// The components x, y and z.
    #[inline(always)]
    pub(in super::super) fn parts(self) -> [N; 3] {
        [self.x, self.y, self.z]
    }

    #[inline(always)]
    pub(in super::super) fn plus(self, other: Self) -> Self {
        Self { x: self.x + other.x, y: self.y + other.y, z: self.z + other.z }
    }

    #[inline(always)]
    pub(in super::super) fn minus(self, other: Self) -> Self {
        Self { x: self.x - other.x, y: self.y - other.y, z: self.z - other.z }
    }

    #[inline(always)]
    pub(in super::super) fn times(self, factor: N) -> Self {
        Self { x: self.x * factor, y: self.y * factor, z: self.z * factor }
    }

    /// The negated vector, zeros included.
    #[inline(always)]
    pub(in super::super) fn negated(self) -> Self {
        Self { x: -self.x, y: -self.y, z: -self.z }
    }

    #[inline(always)]
    pub(in super::super) fn dot(self, other: Self) -> N {
        (self.x * other.x + self.y * other.y) + self.z * other.z
    }

    #[inline(always)]
    pub(in super::super) fn cross(self, other: Self) -> Self {
        Self {
            x: self.y * other.z - other.y * self.z,
            y: self.z * other.x - other.z * self.x,
            z: self.x * other.y - other.x * self.y,
        }
    }

    /// These magnitudes with the signs of the other vector.
    #[inline(always)]
    pub(in super::super) fn with_signs(self, other: Self) -> Self {
        Self {
            x: self.x.with_sign(other.x),
            y: self.y.with_sign(other.y),
            z: self.z.with_sign(other.z),
        }
    }

    /// Selects this vector where the mask is set, and the other elsewhere.
    #[inline(always)]
    pub(in super::super) fn or(self, mask: N::Mask, other: Self) -> Self {
        Self {
            x: self.x.or(mask, other.x),
            y: self.y.or(mask, other.y),
            z: self.z.or(mask, other.z),
        }
    }

    /// Whether every component is finite.
    #[inline(always)]
    pub(in super::super) fn is_finite(self) -> N::Mask {
        let infinite = self.x.all(f32::INFINITY);
        let x = infinite.above(self.x.abs());
        x.and(infinite.above(self.y.abs())).and(infinite.above(self.z.abs()))
    }
}

/// A rotation by a unit quaternion in each lane.
#[derive(Debug, Clone, Copy)]
pub(in super::super) struct Rotation<N> {
    axis: Vector<N>,
    /// w² minus the square of the axis, and twice w.
    along: N,
    across: N,
}

impl<N: Numbers> Rotation<N> {
    /// From x, y, z and w.
    #[inline(always)]
    pub(in super::super) fn new(axis: Vector<N>, w: N) -> Self {
        Self { axis, along: w * w - axis.dot(axis), across: w * w.all(2.0) }
    }

    /// The inverse rotation.
    #[inline(always)]
    pub(in super::super) fn inverse(self) -> Self {
        Self { axis: self.axis.negated(), ..self }
    }

    /// Rotates a vector.
    #[inline(always)]
    pub(in super::super) fn turn(self, v: Vector<N>) -> Vector<N> {
        let twice = v.dot(self.axis) * self.along.all(2.0);
        v.times(self.along).plus(self.axis.times(twice)).plus(self.axis.cross(v).times(self.across))
    }
}
