//! Inverse inertias side by side: a number for each body, or a symmetric matrix about world axes.
//!
//! Each product has the bits of the same one in `arithmetic/inertia.rs`.

use std::fmt::Debug;

use super::block::Words;
use super::numbers::{Arithmetic, Numbers};
use super::vector::{Vector, add, times};
use crate::accelerator::arithmetic::inertia::{Inertia, Isotropic, Stored, World};
use pgs_support::lanes::{F32x16, LANES, Quad};

/// Numbers of a symmetric matrix.
const WORDS: usize = 6;

/// The inverse inertias of the bodies of one side of a block about world axes: xx, yy, zz, xy, xz, yz.
///
/// Bodies keep their inverse inertia for a whole step. So the first pass gathers them, and the others find
/// them beside their block.
#[derive(Debug, Clone, Copy)]
#[repr(C, align(64))]
pub(crate) struct SideInertias([Words; WORDS]);

impl SideInertias {
    pub(crate) const ZERO: Self = Self([[0.0; LANES]; WORDS]);

    /// Keeps the words of rows: xx, yy, zz, 0, then xy, xz, yz, 0.
    #[inline(always)]
    pub(crate) fn put(&mut self, [diagonal, others]: [[F32x16; 4]; 2]) {
        let ([xx, yy, zz, zero], [xy, xz, yz, zero_too]) = (diagonal, others);
        // Whole numbers of 0 change nothing; but where the last column is left unused, the compiler puts the
        // others together word by word instead of row by row.
        let (xx, xy) = (xx.with_words(zero), xy.with_words(zero_too));
        self.0 = [xx, yy, zz, xy, xz, yz].map(F32x16::to_array);
    }

    /// The inverse inertias, in a form about axes.
    #[inline(always)]
    pub(crate) fn of<A: Arithmetic, F: Form>(&self, arithmetic: A) -> F::Side<A> {
        F::about_axes(self.0.each_ref().map(|words| arithmetic.load(words)))
    }
}

/// A form of inertia that the batch computes with.
pub(crate) trait Form: Inertia {
    /// Whether each body has a row for its inverse inertia.
    const ABOUT_AXES: bool;

    /// The inverse inertias of the bodies of one side.
    type Side<A: Arithmetic>: Times<A>;

    /// From the numbers beside the angular velocities; only in a form without rows.
    fn isotropic<A: Arithmetic>(k: Numbers<A>) -> Self::Side<A>;

    /// From the words xx, yy, zz, xy, xz, yz; only in a form with rows.
    fn about_axes<A: Arithmetic>(words: [Numbers<A>; WORDS]) -> Self::Side<A>;

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
    fn about_axes<A: Arithmetic>([k, ..]: [Numbers<A>; WORDS]) -> Numbers<A> {
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
    fn about_axes<A: Arithmetic>([xx, yy, zz, xy, xz, yz]: [Numbers<A>; WORDS]) -> Columns<A> {
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
