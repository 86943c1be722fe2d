//! Vectors side by side: one of a format in each lane.

use super::numbers::{Arithmetic, Numbers};
use pgs_support::lanes::Mask;

/// A vector in each lane.
pub(crate) type Vector<A> = [Numbers<A>; 3];

#[inline(always)]
pub(crate) fn add<A: Arithmetic>(a: Vector<A>, b: Vector<A>) -> Vector<A> {
    [a[0] + b[0], a[1] + b[1], a[2] + b[2]]
}

#[inline(always)]
pub(crate) fn sub<A: Arithmetic>(a: Vector<A>, b: Vector<A>) -> Vector<A> {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

#[inline(always)]
pub(crate) fn neg<A: Arithmetic>(a: Vector<A>) -> Vector<A> {
    [-a[0], -a[1], -a[2]]
}

#[inline(always)]
pub(crate) fn times<A: Arithmetic>(a: Vector<A>, s: Numbers<A>) -> Vector<A> {
    [a[0] * s, a[1] * s, a[2] * s]
}

#[inline(always)]
pub(crate) fn dot<A: Arithmetic>(a: Vector<A>, b: Vector<A>) -> Numbers<A> {
    (a[0] * b[0] + a[1] * b[1]) + a[2] * b[2]
}

#[inline(always)]
pub(crate) fn cross<A: Arithmetic>(a: Vector<A>, b: Vector<A>) -> Vector<A> {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

/// `a` where the mask says yes, and `b` elsewhere.
#[inline(always)]
pub(crate) fn either<A: Arithmetic>(mask: Mask, a: Vector<A>, b: Vector<A>) -> Vector<A> {
    [a[0].or(mask, b[0]), a[1].or(mask, b[1]), a[2].or(mask, b[2])]
}
