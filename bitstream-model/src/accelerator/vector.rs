//! This file is three-component arithmetic with its order of evaluation written out.
//!
//! Source: Bullet's host solver; sums associate to the left.

use std::ops::{Add, Mul, Neg, Sub};

use super::number::Number;

/// A vector x, y, z.
#[derive(Debug, Clone, Copy)]
pub(super) struct Vec3<N>(pub(super) N, pub(super) N, pub(super) N);

impl<N: Number> Vec3<N> {
    #[inline]
    pub(super) fn new(v: [f32; 3]) -> Self {
        Self(N::new(v[0]), N::new(v[1]), N::new(v[2]))
    }

    #[inline]
    pub(super) fn values(self) -> [f32; 3] {
        [self.0.value(), self.1.value(), self.2.value()]
    }

    #[inline]
    pub(super) fn dot(self, b: Self) -> N {
        (self.0 * b.0 + self.1 * b.1) + self.2 * b.2
    }

    #[inline]
    pub(super) fn cross(self, b: Self) -> Self {
        Self(self.1 * b.2 - self.2 * b.1, self.2 * b.0 - self.0 * b.2, self.0 * b.1 - self.1 * b.0)
    }

    /// One reciprocal of the length, three products.
    #[inline]
    pub(super) fn unit(self) -> Self {
        self * (N::new(1.0) / self.dot(self).sqrt())
    }
}

impl<N: Number> Add for Vec3<N> {
    type Output = Self;

    #[inline]
    fn add(self, b: Self) -> Self {
        Self(self.0 + b.0, self.1 + b.1, self.2 + b.2)
    }
}

impl<N: Number> Sub for Vec3<N> {
    type Output = Self;

    #[inline]
    fn sub(self, b: Self) -> Self {
        Self(self.0 - b.0, self.1 - b.1, self.2 - b.2)
    }
}

impl<N: Number> Neg for Vec3<N> {
    type Output = Self;

    #[inline]
    fn neg(self) -> Self {
        Self(-self.0, -self.1, -self.2)
    }
}

impl<N: Number> Mul<N> for Vec3<N> {
    type Output = Self;

    #[inline]
    fn mul(self, s: N) -> Self {
        Self(self.0 * s, self.1 * s, self.2 * s)
    }
}
