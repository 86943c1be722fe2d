//! Inverse inertias side by side: a number for each body, or a symmetric matrix about world axes.
//!
//! Each product has the bits of the same one in `arithmetic/inertia.rs`.

use std::fmt::Debug;

use super::numbers::{Arithmetic, Numbers};
use super::vector::{Vector, add, times};
use crate::accelerator::arithmetic::inertia::{Inertia, Isotropic, Stored, World};
use pgs_support::lanes::Quad;

/// A form of inertia that the batch computes with.
pub(crate) trait Form: Inertia {
    /// Whether each body has a row for its inverse inertia.
    const ABOUT_AXES: bool;

    /// The inverse inertias of the bodies of one side.
    type Side<A: Arithmetic>: Times<A>;

    /// From the numbers beside the angular velocities; only in a form without rows.
    fn isotropic<A: Arithmetic>(k: Numbers<A>) -> Self::Side<A>;

    /// From the words of the rows: xx, yy, zz, then xy, xz, yz; only in a form with rows.
    fn about_axes<A: Arithmetic>(
        diagonal: [Numbers<A>; 4],
        others: [Numbers<A>; 4],
    ) -> Self::Side<A>;

    /// The inverse inertia of one body, by the number beside its angular velocity and by its row.
    fn stored(k: f32, row: impl FnOnce() -> [Quad; 2]) -> Stored;
}

/// The inverse inertias of the bodies of one side.
pub(crate) trait Times<A: Arithmetic>: Copy + Debug {
    /// The products with moments.
    fn times(self, moment: Vector<A>) -> Vector<A>;
}

impl Form for Isotropic {
    const ABOUT_AXES: bool = false;

    type Side<A: Arithmetic> = Numbers<A>;

    #[inline(always)]
    fn isotropic<A: Arithmetic>(k: Numbers<A>) -> Numbers<A> {
        k
    }

    #[inline(always)]
    fn about_axes<A: Arithmetic>([k, ..]: [Numbers<A>; 4], _: [Numbers<A>; 4]) -> Numbers<A> {
        k
    }

    #[inline(always)]
    fn stored(k: f32, _: impl FnOnce() -> [Quad; 2]) -> Stored {
        [k, 0.0, 0.0, 0.0, 0.0, 0.0]
    }
}

impl Form for World {
    const ABOUT_AXES: bool = true;

    type Side<A: Arithmetic> = Columns<A>;

    #[inline(always)]
    fn isotropic<A: Arithmetic>(k: Numbers<A>) -> Columns<A> {
        Columns([[k; 3]; 3])
    }

    #[inline(always)]
    fn about_axes<A: Arithmetic>(
        [xx, yy, zz, zero]: [Numbers<A>; 4],
        [xy, xz, yz, zero_too]: [Numbers<A>; 4],
    ) -> Columns<A> {
        // Whole numbers of 0 change nothing; but where the last column is left unused, the compiler puts the
        // others together word by word instead of row by row.
        let (xx, xy) = (xx.with_words(zero), xy.with_words(zero_too));
        Columns([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    }

    #[inline(always)]
    fn stored(_: f32, row: impl FnOnce() -> [Quad; 2]) -> Stored {
        let [[xx, yy, zz, _], [xy, xz, yz, _]] = row();
        [xx, yy, zz, xy, xz, yz]
    }
}

impl<A: Arithmetic> Times<A> for Numbers<A> {
    #[inline(always)]
    fn times(self, moment: Vector<A>) -> Vector<A> {
        times(moment, self)
    }
}

/// The columns of symmetric matrices.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Columns<A>([Vector<A>; 3]);

impl<A: Arithmetic> Times<A> for Columns<A> {
    #[inline(always)]
    fn times(self, [x, y, z]: Vector<A>) -> Vector<A> {
        let [of_x, of_y, of_z] = self.0;
        add(add(times(of_x, x), times(of_y, y)), times(of_z, z))
    }
}

/// The row of an inverse inertia.
pub(crate) fn row([xx, yy, zz, xy, xz, yz]: Stored) -> [Quad; 2] {
    [[xx, yy, zz, 0.0], [xy, xz, yz, 0.0]]
}
