//! This file says what the record of a collision takes from either of its bodies.

use std::hint::cold_path;
use std::ops::Range;

use bytemuck::{Pod, Zeroable};

use super::{POSITION, row_of};
use crate::interface::record::Beat;
use crate::platform::{Lanes, fetch};
use crate::scene::{Body, Shape};

/// A body as a collision's end: sixteen bytes, so that those of a whole scene lie in a cache.
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
#[repr(C, align(16))]
pub(crate) struct End {
    /// Centre of mass, m.
    pub(crate) position: [f32; 3],
    /// The shape's index, and in the top bit whether it is static.
    tag: u32,
}

const STATIC: u32 = 1 << 31;
const NO_SHAPE: u32 = u32::MAX;

impl End {
    /// Stands in for a body that does not exist.
    pub(crate) const MISSING: Self = Self { position: [0.0; 3], tag: NO_SHAPE };

    /// At a position, without a shape.
    #[cfg(test)]
    pub(crate) const fn at(position: [f32; 3]) -> Self {
        Self { position, ..Self::MISSING }
    }

    /// That of a body.
    #[inline(always)]
    fn of(body: &Body, tags: &Tags<'_>) -> Self {
        let tag = tags.of(body.shape);
        bytemuck::cast(Beat::from(row_of::<POSITION, _>(body).beside(tag)))
    }

    /// Its position beside its tag, which is no part of a record.
    #[inline(always)]
    pub(crate) fn with_tag(&self) -> Lanes {
        Lanes::from(bytemuck::cast::<_, Beat>(*self))
    }

    /// Its position beside zero.
    #[inline(always)]
    pub(crate) fn alone(&self) -> Lanes {
        let whole: Beat = bytemuck::cast(*self);
        Lanes::from(whole).and(Lanes::new([u32::MAX, u32::MAX, u32::MAX, 0]))
    }

    /// Whether it never moves.
    #[inline(always)]
    pub(crate) const fn is_static(&self) -> bool {
        self.tag & STATIC != 0
    }

    /// Whether it has a shape.
    #[inline(always)]
    pub(crate) const fn has_shape(&self) -> bool {
        self.tag != NO_SHAPE
    }

    /// Its shape; a static one, if it has none.
    #[inline]
    pub(crate) fn shape<'s>(&self, shapes: &'s [Shape]) -> &'s Shape {
        let shape = usize::try_from(self.tag & !STATIC).ok().and_then(|shape| shapes.get(shape));
        shape.unwrap_or(&Shape::STATIC)
    }
}

/// Shapes whose tags are looked up: all that a profile has room for. A bitstream may have more.
const LOOKED_UP: usize = 64;

/// What is said of bodies of each shape.
#[derive(Debug)]
pub(crate) struct Tags<'a> {
    first: [u32; LOOKED_UP],
    shapes: &'a [Shape],
}

impl<'a> Tags<'a> {
    pub(crate) fn new(shapes: &'a [Shape]) -> Self {
        let mut first = [NO_SHAPE; LOOKED_UP];
        for (shape, tag) in (0..).zip(&mut first) {
            *tag = tag_of(shape, shapes);
        }
        Self { first, shapes }
    }

    #[inline(always)]
    fn of(&self, shape: u32) -> u32 {
        let known = usize::try_from(shape).ok().and_then(|shape| self.first.get(shape));
        known.copied().unwrap_or_else(|| tag_of(shape, self.shapes))
    }

    /// Makes the ends of bodies; whether any of these never moves, as one without a shape does not.
    #[inline(always)]
    pub(crate) fn ends(&self, bodies: &[Body], ends: &mut [End]) -> bool {
        let mut any = 0;
        for (end, body) in ends.iter_mut().zip(bodies) {
            *end = End::of(body, self);
            any |= end.tag;
        }
        any & STATIC != 0
    }
}

/// The tag of bodies of a shape.
#[inline(never)]
fn tag_of(shape: u32, shapes: &[Shape]) -> u32 {
    match usize::try_from(shape).ok().and_then(|shape| shapes.get(shape)) {
        Some(of) => shape | if of.is_static() { STATIC } else { 0 },
        None => NO_SHAPE,
    }
}

/// What is remembered of the bodies of a step while they are packed. Kept, so that a step allocates
/// nothing.
#[derive(Debug)]
pub(crate) struct Survey<'a> {
    /// What the records of collisions take of each.
    pub(crate) ends: &'a mut Vec<End>,
    /// Indices of those that never move, upwards.
    pub(crate) statics: &'a mut Vec<u32>,
}

impl Survey<'_> {
    /// The ends of so many bodies, all of which are written before [`Self::settle`].
    pub(crate) fn ends(&mut self, count: usize) -> &mut [End] {
        self.statics.clear();
        self.ends.resize(count, End::MISSING);
        self.ends
    }

    /// Finds those that never move, which are all among these.
    pub(crate) fn settle(&mut self, among: Range<usize>) {
        let ends = self.ends.get(among.clone()).unwrap_or_default();
        // No bitstream has more bodies than u32 counts.
        let still = among.zip(ends).filter(|(_, end)| end.is_static());
        self.statics.extend(still.filter_map(|(at, _)| u32::try_from(at).ok()));
    }
}

/// The ends of all bodies of a step, to look up.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Ends<'a>(pub(crate) &'a [End]);

impl<'a> Ends<'a> {
    /// Says that those of these bodies are asked for soon.
    #[inline(always)]
    pub(crate) fn soon(self, bodies: [u32; 2]) {
        for body in bodies {
            fetch(self.0.as_ptr().wrapping_add(body as usize));
        }
    }

    /// That of one body.
    #[inline(always)]
    pub(crate) fn get(self, body: u32) -> &'a End {
        match usize::try_from(body).ok().and_then(|body| self.0.get(body)) {
            Some(end) => end,
            None => {
                // A jump that is foreseen costs less than to choose.
                cold_path();
                &End::MISSING
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A bitstream may have more shapes than are looked up.
    #[test]
    fn every_body_has_the_tag_of_its_shape() {
        for count in [0, 1, LOOKED_UP - 1, LOOKED_UP, LOOKED_UP + 1, 3 * LOOKED_UP] {
            let shapes: Vec<Shape> = (0..count)
                .map(|shape| match shape % 3 {
                    0 => Shape::STATIC,
                    _ => Shape::isotropic(1.0, shape as f32),
                })
                .collect();
            let tags = Tags::new(&shapes);
            for shape in (0..200).chain([STATIC, STATIC | 1, u32::MAX]) {
                let body = Body { shape, ..Body::zeroed() };
                let mut ends = [End::MISSING];
                let any_still = tags.ends(&[body], &mut ends);
                let end = ends[0];
                let expected = shapes.get(shape as usize);
                assert_eq!(end.has_shape(), expected.is_some(), "{shape} of {count}");
                let still = expected.is_none_or(Shape::is_static);
                assert_eq!((end.is_static(), any_still), (still, still), "{shape} of {count}");
                assert_eq!(end.shape(&shapes), expected.unwrap_or(&Shape::STATIC));
            }
        }
    }
}
