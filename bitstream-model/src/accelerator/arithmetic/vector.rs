//! Three-component arithmetic with its order of evaluation written out.
//!
//! Source: Bullet's host solver; sums associate to the left.

use std::ops::{Add, Mul, Neg, Sub};

use super::number::{Format, Number};

/// A vector x, y, z.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Vec3<F>(pub(crate) Number<F>, pub(crate) Number<F>, pub(crate) Number<F>);

impl<F: Format> Vec3<F> {
    #[inline]
    pub(crate) fn new(v: [f32; 3]) -> Self {
        Self(Number::new(v[0]), Number::new(v[1]), Number::new(v[2]))
    }

    #[inline]
    pub(crate) fn values(self) -> [f32; 3] {
        [self.0.value(), self.1.value(), self.2.value()]
    }

    /// The same vector in a format that holds every number of this format.
    #[inline]
    pub(crate) fn widened<W: Format>(self) -> Vec3<W> {
        Vec3(self.0.widened(), self.1.widened(), self.2.widened())
    }

    #[inline]
    pub(crate) fn dot(self, b: Self) -> Number<F> {
        (self.0 * b.0 + self.1 * b.1) + self.2 * b.2
    }

    #[inline]
    pub(crate) fn cross(self, b: Self) -> Self {
        Self(self.1 * b.2 - self.2 * b.1, self.2 * b.0 - self.0 * b.2, self.0 * b.1 - self.1 * b.0)
    }

    /// The unit vector: one reciprocal of the length, three products.
    #[inline]
    pub(crate) fn unit(self) -> Self {
        self * (Number::new(1.0) / self.dot(self).sqrt())
    }
}

impl<F: Format> Add for Vec3<F> {
    type Output = Self;

    #[inline]
    fn add(self, b: Self) -> Self {
        Self(self.0 + b.0, self.1 + b.1, self.2 + b.2)
    }
}

impl<F: Format> Sub for Vec3<F> {
    type Output = Self;

    #[inline]
    fn sub(self, b: Self) -> Self {
        Self(self.0 - b.0, self.1 - b.1, self.2 - b.2)
    }
}

impl<F: Format> Neg for Vec3<F> {
    type Output = Self;

    #[inline]
    fn neg(self) -> Self {
        Self(-self.0, -self.1, -self.2)
    }
}

impl<F: Format> Mul<Number<F>> for Vec3<F> {
    type Output = Self;

    #[inline]
    fn mul(self, s: Number<F>) -> Self {
        Self(self.0 * s, self.1 * s, self.2 * s)
    }
}
