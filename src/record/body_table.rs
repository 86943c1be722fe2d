//! One entry per body: the values of the body that the records of its collisions need.

use std::fmt;

use bytemuck::{Pod, Zeroable};

use crate::scene::{Body, Shape};
use crate::simd::prefetch_at;

/// A body as one end of a collision: sixteen bytes, so that the ends of a whole scene fit in a
/// cache.
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
#[repr(C, align(16))]
pub(crate) struct End {
    /// Centre of mass, m.
    pub(crate) position: [f32; 3],
    /// The index of the body's shape, below the bits [`STATIC`] and [`UNUSABLE`].
    tag: u32,
}

/// Marks a static body.
const STATIC: u32 = 1 << 31;
/// Marks a body that no collision may have: it does not exist, has no shape, or is out of the range
/// of collisions.
const UNUSABLE: u32 = 1 << 30;
/// The tag of a body without a shape, which counts as static.
const NO_SHAPE: u32 = u32::MAX;

impl End {
    /// Stands in for a body that does not exist.
    pub(crate) const MISSING: Self = Self { position: [0.0; 3], tag: NO_SHAPE };

    /// A body at a position, without a shape.
    #[cfg(test)]
    pub(crate) const fn at(position: [f32; 3]) -> Self {
        Self { position, ..Self::MISSING }
    }

    /// The end of a body, which has this shape if it has any. Collisions hold numbers up to
    /// `limit`.
    #[inline(always)]
    pub(crate) fn of(body: &Body, shape: Option<&Shape>, limit: f32) -> Self {
        let position = body.pose.position;
        let holds = position.iter().fold(true, |holds, x| holds & (x.abs() <= limit));
        let marks = |shape: &Shape| {
            (if shape.is_static() { STATIC } else { 0 }) | (if holds { 0 } else { UNUSABLE })
        };
        // No bitstream has room for a shape whose index collides with the marks.
        let shape = shape.filter(|_| body.shape < UNUSABLE);
        Self { position, tag: shape.map_or(NO_SHAPE, |shape| body.shape | marks(shape)) }
    }

    /// Whether the body is static.
    #[inline(always)]
    pub(crate) const fn is_static(&self) -> bool {
        self.tag & STATIC != 0
    }

    /// Whether a collision may have these two bodies, if they are not the same.
    #[inline(always)]
    pub(crate) const fn may_touch(&self, other: &Self) -> bool {
        ((self.tag | other.tag) & UNUSABLE == 0) & (self.tag & other.tag & STATIC == 0)
    }

    /// The shape of the body; [`Shape::STATIC`] if it has none.
    #[inline]
    pub(crate) fn shape<'s>(&self, shapes: &'s [Shape]) -> &'s Shape {
        let shape = usize::try_from(self.tag & !(STATIC | UNUSABLE)).ok();
        shape.and_then(|shape| shapes.get(shape)).unwrap_or(&Shape::STATIC)
    }
}

/// The ends of all bodies of a step. The table is kept, so that a step allocates nothing.
#[derive(Default, PartialEq)]
pub(crate) struct Table(Vec<End>);

/// Leaves out the ends, which are many.
impl fmt::Debug for Table {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Table").field("count", &self.0.len()).finish_non_exhaustive()
    }
}

impl Table {
    /// The ends of `count` bodies. The caller writes all of them.
    pub(crate) fn anew(&mut self, count: usize) -> &mut [End] {
        self.0.resize(count, End::MISSING);
        &mut self.0
    }

    /// The ends, for a look-up.
    pub(crate) fn ends(&self) -> Ends<'_> {
        Ends(&self.0)
    }

    /// The indices of static bodies, in ascending order.
    pub(crate) fn statics(&self) -> impl Iterator<Item = u32> + '_ {
        // A `u32` counts the bodies of every bitstream.
        (0..).zip(&self.0).filter(|(_, end)| end.is_static()).map(|(index, _)| index)
    }
}

/// The ends of all bodies of a step.
#[derive(Clone, Copy)]
pub(crate) struct Ends<'a>(&'a [End]);

impl<'a> Ends<'a> {
    /// The number of bodies.
    pub(crate) const fn len(self) -> usize {
        self.0.len()
    }

    /// The end of one body. An index without a body finds [`End::MISSING`].
    #[inline(always)]
    pub(crate) fn get(self, body: u32) -> &'a End {
        self.0.get(body as usize).unwrap_or(&End::MISSING)
    }

    /// Prefetches the end of one body.
    #[inline(always)]
    pub(crate) fn prefetch(self, body: u32) {
        prefetch_at(self.0, body as usize);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bodies_are_found_and_those_of_an_earlier_step_are_not() {
        let mut table = Table::default();
        for count in [3, 1 << 16, 5, 0, 7] {
            let ends = table.anew(count);
            (0_u32..).zip(ends).for_each(|(at, end)| *end = End::at([at as f32; 3]));
            assert!(format!("{table:?}").len() < 50, "it is printed without the ends");
            assert_eq!(table.ends().len(), count);
            for at in [0, 1, 2, 4, 5, 7, u16::MAX] {
                let there = usize::from(at) < count;
                let end = if there { End::at([f32::from(at); 3]) } else { End::MISSING };
                assert_eq!(*table.ends().get(at.into()), end, "{at} of {count}");
            }
            assert_eq!(*table.ends().get(1 << 16), End::MISSING);
        }
    }

    #[test]
    fn every_body_has_the_marks_of_its_shape_and_its_position() {
        let moving = Shape::isotropic(1.0, 2.0);
        let shapes = [Shape::STATIC, moving];
        let of = |shape: u32, x: f32| {
            let mut body = Body { shape, ..Body::zeroed() };
            body.pose.position[2] = x;
            End::of(&body, shapes.get(shape as usize), 100.0)
        };
        let partner = of(1, 0.0);
        for (shape, x, still, usable) in [
            (0, 0.0, true, true),
            (1, -100.0, false, true),
            (1, 100.5, false, false),
            (0, f32::NAN, true, false),
            (2, 0.0, true, false),
            (UNUSABLE, 0.0, true, false),
            (u32::MAX, 0.0, true, false),
        ] {
            let end = of(shape, x);
            let found = (end.is_static(), end.may_touch(&partner), partner.may_touch(&end));
            assert_eq!(found, (still, usable, usable), "{shape} {x}");
            assert_eq!(end.shape(&shapes), if still { &shapes[0] } else { &moving });
        }
        assert!(!of(0, 0.0).may_touch(&of(0, 1.0)), "both are static");
    }

    #[test]
    fn static_bodies_are_listed() {
        let mut table = Table::default();
        for (index, end) in (0..).zip(table.anew(5)) {
            let shape = if index % 2 == 1 { Shape::STATIC } else { Shape::isotropic(1.0, 1.0) };
            *end = End::of(&Body::zeroed(), Some(&shape), 1.0);
        }
        assert_eq!(table.statics().collect::<Vec<_>>(), [1, 3]);
    }
}
