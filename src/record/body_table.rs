//! One entry per body: the values of the body that the records of its collisions need.

use std::fmt;
use std::ops::Range;

use bytemuck::{Pod, Zeroable};

use super::{POSITION, row_of};
use crate::scene::{Body, Shape};
use crate::simd::{Lanes, fetch};
use pgs_interface::number::StreamFormat;
use pgs_interface::record::{Beat, WORD_LANE};

/// A body as one end of a collision: sixteen bytes, so that the ends of a whole scene fit in a
/// cache.
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
#[repr(C, align(16))]
pub(crate) struct End {
    /// Centre of mass, m.
    pub(crate) position: [f32; 3],
    /// The index of the body's shape, below the bits [`STATIC`] and [`SHAPELESS`].
    tag: u32,
}

/// The top bit marks the tag of a static body, as [`End::with_tag`] promises.
const STATIC: u32 = 1 << 31;
const SHAPELESS: u32 = 1 << 30;
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

    /// The end of a body with this tag.
    #[inline(always)]
    fn of(body: &Body, tag: u32) -> Self {
        bytemuck::cast(Beat::from(row_of::<POSITION, _>(body).beside(tag)))
    }

    /// The position beside the tag, which is no part of a record. The top bit of the tag marks a
    /// static body.
    #[inline(always)]
    pub(crate) fn with_tag(&self) -> Lanes {
        Lanes::from(bytemuck::cast::<_, Beat>(*self))
    }

    /// Whether the body is static.
    #[inline(always)]
    pub(crate) const fn is_static(&self) -> bool {
        self.tag & STATIC != 0
    }

    /// Whether the body has a shape.
    #[inline(always)]
    pub(crate) const fn has_shape(&self) -> bool {
        self.tag & SHAPELESS == 0
    }

    /// Whether any of several ends has no shape. `tags` is the bitwise OR of their
    /// [`Self::with_tag`].
    #[inline(always)]
    pub(crate) fn any_shapeless(tags: Lanes) -> bool {
        tags.words()[WORD_LANE] & SHAPELESS != 0
    }

    /// All bits if the body is static, else none.
    #[inline(always)]
    pub(crate) fn still(&self) -> Lanes {
        self.with_tag().top_of_last()
    }

    /// The shape of the body; [`Shape::STATIC`] if it has none.
    #[inline]
    pub(crate) fn shape<'s>(&self, shapes: &'s [Shape]) -> &'s Shape {
        let shape = usize::try_from(self.tag & !STATIC).ok().and_then(|shape| shapes.get(shape));
        shape.unwrap_or(&Shape::STATIC)
    }
}

/// Size of the table of tags: no profile has room for more shapes. A bitstream may have more.
const LOOKED_UP: usize = 64;

/// The tag of the bodies of each shape.
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

    /// Makes the ends of bodies. Returns whether any body is static; a body without a shape is
    /// static.
    #[inline(always)]
    pub(crate) fn ends(&self, bodies: &[Body], ends: &mut [End]) -> bool {
        let (mut tags, mut shapes) = (0, 0);
        for (end, body) in ends.iter_mut().zip(bodies) {
            // No branch: a shape beyond the table is found after the loop.
            let tag = self.first[body.shape as usize % LOOKED_UP];
            *end = End::of(body, tag);
            tags |= tag;
            shapes |= body.shape;
        }
        if shapes as usize >= LOOKED_UP {
            tags = self.each(bodies, ends);
        }
        tags & STATIC != 0
    }

    /// Makes the ends of bodies with any shape indices. Returns the bitwise OR of all tags.
    #[cold]
    #[inline(never)]
    fn each(&self, bodies: &[Body], ends: &mut [End]) -> u32 {
        let mut tags = 0;
        for (end, body) in ends.iter_mut().zip(bodies) {
            let tag = tag_of(body.shape, self.shapes);
            *end = End::of(body, tag);
            tags |= tag;
        }
        tags
    }
}

/// The tag of the bodies of a shape.
fn tag_of(shape: u32, shapes: &[Shape]) -> u32 {
    match usize::try_from(shape).ok().and_then(|shape| shapes.get(shape)) {
        Some(of) if shape < SHAPELESS => shape | if of.is_static() { STATIC } else { 0 },
        // The shape is missing, or its index collides with the flag bits: no bitstream has room for
        // it.
        _ => NO_SHAPE,
    }
}

/// Number of bodies that an index of sixteen bits can name.
const LOW: usize = 1 << u16::BITS;
const _: () = assert!(StreamFormat::Binary16.largest_index() as usize == LOW - 1);

/// The ends of all bodies of a step. The table is kept, so that a step allocates nothing.
#[derive(Default, PartialEq)]
pub(crate) struct Table {
    /// From the first step on at least [`LOW`] ends, a megabyte. [`End::MISSING`] fills the rest.
    ends: Vec<End>,
    /// The number of bodies.
    count: usize,
}

/// Leaves out the ends, which are many.
impl fmt::Debug for Table {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Table").field("count", &self.count).finish_non_exhaustive()
    }
}

impl Table {
    /// The ends of `count` bodies. The caller writes all of them.
    fn anew(&mut self, count: usize) -> &mut [End] {
        if let Some(gone) = self.ends.get_mut(count..self.count) {
            gone.fill(End::MISSING);
        }
        self.ends.resize(count.max(LOW), End::MISSING);
        self.count = count;
        &mut self.ends[..count]
    }

    /// The ends, for a look-up.
    pub(crate) fn ends(&self) -> Ends<'_> {
        Ends { all: &self.ends, count: self.count }
    }

    /// The end of each body.
    #[cfg(test)]
    pub(crate) fn of_bodies(&self) -> &[End] {
        &self.ends[..self.count]
    }
}

/// Data on the bodies of a step that packing collects. It is kept, so that a step allocates
/// nothing.
#[derive(Debug)]
pub(crate) struct Survey<'a> {
    /// The ends that collision records are made from.
    pub(crate) ends: &'a mut Table,
    /// The indices of static bodies, in ascending order.
    pub(crate) statics: &'a mut Vec<u32>,
}

impl Survey<'_> {
    /// The ends of `count` bodies. The caller writes all of them before [`Self::settle`].
    pub(crate) fn ends(&mut self, count: usize) -> &mut [End] {
        self.statics.clear();
        self.ends.anew(count)
    }

    /// Collects the indices of static bodies, which are all in the range `among`.
    pub(crate) fn settle(&mut self, among: Range<usize>) {
        let ends = self.ends.ends.get(among.clone()).unwrap_or_default();
        // A `u32` counts the bodies of every bitstream.
        let still = among.zip(ends).filter(|(_, end)| end.is_static());
        self.statics.extend(still.filter_map(|(at, _)| u32::try_from(at).ok()));
    }
}

/// Looks up ends by the indices of a collision's bodies.
///
/// Every implementation carries `#[inline(always)]`: it becomes a part of the packing loop.
pub(crate) trait Lookup<'a>: Copy {
    /// A look-up among the ends of all bodies; `None` if it cannot reach every body.
    fn of(all: Ends<'a>) -> Option<Self>;

    /// Whether an index with no other bits than these is looked up by all its bits. Otherwise the
    /// look-up may return the end of another body.
    fn by_all_bits(self, bodies: [u32; 2]) -> bool;

    /// The end of one body.
    fn get(self, body: u32) -> &'a End;

    /// Prefetches the ends of these bodies.
    fn soon(self, bodies: [u32; 2]);
}

/// The ends of all bodies of a step.
#[derive(Clone, Copy)]
pub(crate) struct Ends<'a> {
    all: &'a [End],
    /// The number of bodies.
    count: usize,
}

impl<'a> Lookup<'a> for Ends<'a> {
    #[inline(always)]
    fn of(all: Self) -> Option<Self> {
        Some(all)
    }

    /// An index without a body finds [`End::MISSING`].
    #[inline(always)]
    fn by_all_bits(self, _: [u32; 2]) -> bool {
        true
    }

    #[inline(always)]
    fn get(self, body: u32) -> &'a End {
        match usize::try_from(body).ok().and_then(|body| self.all.get(body)) {
            Some(end) => end,
            None => {
                // A predicted branch costs less than a selection.
                pgs_support::cold_path();
                &End::MISSING
            }
        }
    }

    #[inline(always)]
    fn soon(self, bodies: [u32; 2]) {
        for body in bodies {
            soon_in(self.all, body);
        }
    }
}

/// Prefetches the end of a body.
#[inline(always)]
fn soon_in(ends: &[End], body: u32) {
    fetch(ends.as_ptr().wrapping_add(body as usize));
}

/// The ends of all bodies of a step, if indices of sixteen bits can name every body. A look-up
/// takes the lower half of an index, as records with such indices do. So every index has an end,
/// and no look-up compares it with the number of bodies.
#[derive(Clone, Copy)]
pub(crate) struct LowEnds<'a>(&'a [End; LOW]);

impl<'a> Lookup<'a> for LowEnds<'a> {
    /// `None` also before the first [`Survey`].
    #[inline(always)]
    fn of(Ends { all, count }: Ends<'a>) -> Option<Self> {
        all.first_chunk().filter(|_| count <= LOW).map(Self)
    }

    #[inline(always)]
    fn by_all_bits(self, [a, b]: [u32; 2]) -> bool {
        ((a | b) as usize) < LOW
    }

    #[inline(always)]
    fn get(self, body: u32) -> &'a End {
        &self.0[body as usize % LOW]
    }

    #[inline(always)]
    fn soon(self, bodies: [u32; 2]) {
        for body in bodies {
            soon_in(self.0, body);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Writes the table of a step whose bodies are at these places.
    fn surveyed(table: &mut Table, places: impl ExactSizeIterator<Item = f32>) {
        let mut statics = Vec::new();
        let mut survey = Survey { ends: table, statics: &mut statics };
        let ends = survey.ends(places.len());
        ends.iter_mut().zip(places).for_each(|(end, x)| *end = End::at([x; 3]));
    }

    #[test]
    fn bodies_are_found_and_those_of_an_earlier_step_are_not() {
        let mut table = Table::default();
        for count in [3, LOW - 1, LOW, LOW + 1, 2 * LOW, 5, 0, 7] {
            surveyed(&mut table, (0..count).map(|at| at as f32));
            assert_eq!(table.of_bodies().len(), count);
            assert!(format!("{table:?}").len() < 50, "it is printed without the ends");
            let ends = table.ends();
            let low = LowEnds::of(ends);
            assert_eq!(low.is_some(), count <= LOW, "{count}");
            for at in [0, 1, count.wrapping_sub(1), count, count + 1, LOW - 1, LOW, 3 * LOW] {
                let Ok(body) = u32::try_from(at) else { continue };
                let end =
                    |at: usize| if at < count { End::at([at as f32; 3]) } else { End::MISSING };
                assert_eq!(*ends.get(body), end(at), "{at} of {count}");
                assert!(ends.by_all_bits([body, 0]) && ends.by_all_bits([0, body]));
                let Some(low) = low else { continue };
                assert_eq!(*low.get(body), end(at % LOW), "{at} of {count}");
                assert_eq!([low.by_all_bits([body, 0]), low.by_all_bits([0, body])], [at < LOW; 2]);
            }
        }
        assert!(LowEnds::of(Table::default().ends()).is_none());
    }

    /// A bitstream may have more shapes than the table of tags.
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
                let tag = end.with_tag();
                assert_eq!(End::any_shapeless(tag), expected.is_none(), "{shape} of {count}");
                assert_eq!(tag.words()[3] >> 31 == 1, still, "{shape} of {count}");
                assert_eq!(end.still().words(), [if still { u32::MAX } else { 0 }; 4]);
            }
        }
    }
}
