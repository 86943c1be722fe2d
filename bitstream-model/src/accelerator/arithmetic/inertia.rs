//! The inverse inertia of a body as a factor in the solver: one number, or a symmetric matrix
//! about world axes.

use super::number::{Format, Number};
use super::vector::Vec3;

/// Inverse inertia as it is stored: xx, yy, zz, xy, xz, yz. An isotropic one uses the first alone.
pub(crate) type Stored = [f32; 6];

/// The form of inertia that a bitstream was built with.
pub(crate) trait Inertia: Copy {
    /// The inverse inertia in numbers of a format.
    type In<F: Format>: Times<F>;
}

/// An inverse inertia in numbers of the format `F`.
pub(crate) trait Times<F: Format>: Copy {
    fn new(stored: &Stored) -> Self;

    /// The product with a moment.
    fn times(self, moment: Vec3<F>) -> Vec3<F>;
}

/// The same about every axis.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Isotropic;

/// About world axes.
#[derive(Debug, Clone, Copy)]
pub(crate) struct World;

impl Inertia for Isotropic {
    type In<F: Format> = Number<F>;
}

impl Inertia for World {
    type In<F: Format> = Matrix<F>;
}

impl<F: Format> Times<F> for Number<F> {
    #[inline]
    fn new(stored: &Stored) -> Self {
        Self::new(stored[0])
    }

    #[inline]
    fn times(self, moment: Vec3<F>) -> Vec3<F> {
        moment * self
    }
}

/// Columns of a symmetric matrix.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Matrix<F>([Vec3<F>; 3]);

impl<F: Format> Times<F> for Matrix<F> {
    #[inline]
    fn new(stored: &Stored) -> Self {
        let [xx, yy, zz, xy, xz, yz] = stored.map(Number::new);
        Self([Vec3(xx, xy, xz), Vec3(xy, yy, yz), Vec3(xz, yz, zz)])
    }

    /// Each component `(K.x * m.x + K.y * m.y) + K.z * m.z`.
    #[inline]
    fn times(self, moment: Vec3<F>) -> Vec3<F> {
        let [x, y, z] = self.0;
        (x * moment.0 + y * moment.1) + z * moment.2
    }
}

#[cfg(test)]
#[expect(clippy::float_cmp, reason = "the expected values are exact")]
mod tests {
    use super::super::number::Single;
    use super::*;

    #[test]
    fn a_matrix_multiplies_by_its_rows() {
        let matrix = Matrix::<Single>::new(&[1.0, 2.0, 3.0, 10.0, 20.0, 30.0]);
        let product = matrix.times(Vec3::new([1.0, 100.0, 10_000.0]));
        assert_eq!(product.values(), [201_001.0, 300_210.0, 33_020.0]);
    }

    #[test]
    fn equal_moments_are_a_number() {
        let moment = Vec3::<Single>::new([0.1, -0.7, 3.3]);
        let matrix = Matrix::new(&[0.3, 0.3, 0.3, 0.0, 0.0, 0.0]);
        let number = Number::<Single>::new(0.3);
        assert_eq!(matrix.times(moment).values(), number.times(moment).values());
    }
}
