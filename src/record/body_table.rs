//! One entry per body: the values of the body that the records of its collisions need.

use std::fmt;
use std::ops::Range;

use bytemuck::{Pod, Zeroable};

use super::{POSITION, alone, row_of};
use crate::scene::{Body, Shape};
use crate::simd::{Lanes, fetch};
use pgs_interface::number::StreamFormat;
use pgs_interface::record::{Beat, WORD_LANE};

/// A body as a collision's end: sixteen bytes, so that those of a whole scene lie in a cache.
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
#[repr(C, align(16))]
pub(crate) struct End {
    /// Centre of mass, m.
    pub(crate) position: [f32; 3],
    /// The shape's index, and above it whether it is static, and whether there is a shape.
    tag: u32,
}

/// The top bit, as [`End::with_tag`] says.
const STATIC: u32 = 1 << 31;
const SHAPELESS: u32 = 1 << 30;
/// One without a shape is static.
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
    fn of(body: &Body, tag: u32) -> Self {
        bytemuck::cast(Beat::from(row_of::<POSITION, _>(body).beside(tag)))
    }

    /// Its position beside its tag, which is no part of a record: the top bit says that it never moves.
    #[inline(always)]
    pub(crate) fn with_tag(&self) -> Lanes {
        Lanes::from(bytemuck::cast::<_, Beat>(*self))
    }

    /// Its position beside zero.
    #[inline(always)]
    pub(crate) fn alone(&self) -> Lanes {
        alone(self.with_tag())
    }

    /// Whether it never moves.
    #[inline(always)]
    pub(crate) const fn is_static(&self) -> bool {
        self.tag & STATIC != 0
    }

    /// Whether it has a shape.
    #[inline(always)]
    pub(crate) const fn has_shape(&self) -> bool {
        self.tag & SHAPELESS == 0
    }

    /// Whether one of some has no shape; in `tags` are the bits of [`Self::with_tag`] that any has.
    #[inline(always)]
    pub(crate) fn any_shapeless(tags: Lanes) -> bool {
        tags.words()[WORD_LANE] & SHAPELESS != 0
    }

    /// All bits if it never moves, else none.
    #[inline(always)]
    pub(crate) fn still(&self) -> Lanes {
        self.with_tag().top_of_last()
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

    /// Makes the ends of bodies; whether any of these never moves, as one without a shape does not.
    #[inline(always)]
    pub(crate) fn ends(&self, bodies: &[Body], ends: &mut [End]) -> bool {
        let (mut tags, mut shapes) = (0, 0);
        for (end, body) in ends.iter_mut().zip(bodies) {
            // Without a jump; a shape that is not looked up is seen behind the loop.
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

    /// The same of any shapes; the bits of all tags.
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

/// The tag of bodies of a shape.
fn tag_of(shape: u32, shapes: &[Shape]) -> u32 {
    match usize::try_from(shape).ok().and_then(|shape| shapes.get(shape)) {
        Some(of) if shape < SHAPELESS => shape | if of.is_static() { STATIC } else { 0 },
        // No bitstream has room for more.
        _ => NO_SHAPE,
    }
}

/// Bodies that an index of sixteen bits may name.
const LOW: usize = 1 << u16::BITS;
const _: () = assert!(StreamFormat::Binary16.largest_index() as usize == LOW - 1);
const _: () = assert!(StreamFormat::Thesis16.largest_index() as usize == LOW - 1);

/// The ends of all bodies of a step. Kept, so that a step allocates nothing.
#[derive(Default, PartialEq)]
pub(crate) struct Table {
    /// At least [`LOW`] of them, a megabyte, from the first step on; [`End::MISSING`] where there is no body.
    ends: Vec<End>,
    /// How many bodies there are.
    count: usize,
}

/// Without the ends, which are many.
impl fmt::Debug for Table {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Table").field("count", &self.count).finish_non_exhaustive()
    }
}

impl Table {
    /// Those of so many bodies, all of which are written now.
    fn anew(&mut self, count: usize) -> &mut [End] {
        if let Some(gone) = self.ends.get_mut(count..self.count) {
            gone.fill(End::MISSING);
        }
        self.ends.resize(count.max(LOW), End::MISSING);
        self.count = count;
        &mut self.ends[..count]
    }

    /// To look up.
    pub(crate) fn ends(&self) -> Ends<'_> {
        Ends { all: &self.ends, count: self.count }
    }

    /// That of each body.
    #[cfg(test)]
    pub(crate) fn of_bodies(&self) -> &[End] {
        &self.ends[..self.count]
    }
}

/// What is remembered of the bodies of a step while they are packed. Kept, so that a step allocates
/// nothing.
#[derive(Debug)]
pub(crate) struct Survey<'a> {
    /// What the records of collisions take of each.
    pub(crate) ends: &'a mut Table,
    /// Indices of those that never move, upwards.
    pub(crate) statics: &'a mut Vec<u32>,
}

impl Survey<'_> {
    /// The ends of so many bodies, all of which are written before [`Self::settle`].
    pub(crate) fn ends(&mut self, count: usize) -> &mut [End] {
        self.statics.clear();
        self.ends.anew(count)
    }

    /// Finds those that never move, which are all among these.
    pub(crate) fn settle(&mut self, among: Range<usize>) {
        let ends = self.ends.ends.get(among.clone()).unwrap_or_default();
        // No bitstream has more bodies than u32 counts.
        let still = among.zip(ends).filter(|(_, end)| end.is_static());
        self.statics.extend(still.filter_map(|(at, _)| u32::try_from(at).ok()));
    }
}

/// Ends to look up by the indices of a collision's bodies.
///
/// All of it is a part of the loop that asks: an `#[inline(always)]` belongs to every implementation.
pub(crate) trait Lookup<'a>: Copy {
    /// Among the ends of all bodies; none if some of these would never be found.
    fn of(all: Ends<'a>) -> Option<Self>;

    /// Whether bodies that have no other bits than these are looked up by all their bits; else what is found
    /// may be another body's.
    fn by_all_bits(self, bodies: [u32; 2]) -> bool;

    /// That of one body.
    fn get(self, body: u32) -> &'a End;

    /// Says that those of these bodies are asked for soon.
    fn soon(self, bodies: [u32; 2]);
}

/// The ends of all bodies of a step.
#[derive(Clone, Copy)]
pub(crate) struct Ends<'a> {
    all: &'a [End],
    /// How many bodies there are.
    count: usize,
}

impl<'a> Lookup<'a> for Ends<'a> {
    #[inline(always)]
    fn of(all: Self) -> Option<Self> {
        Some(all)
    }

    /// Where there is no body, [`End::MISSING`] is.
    #[inline(always)]
    fn by_all_bits(self, _: [u32; 2]) -> bool {
        true
    }

    #[inline(always)]
    fn get(self, body: u32) -> &'a End {
        match usize::try_from(body).ok().and_then(|body| self.all.get(body)) {
            Some(end) => end,
            None => {
                // A jump that is foreseen costs less than to choose.
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

/// Says that the end of a body is asked for soon.
#[inline(always)]
fn soon_in(ends: &[End], body: u32) {
    fetch(ends.as_ptr().wrapping_add(body as usize));
}

/// The ends of all bodies of a step that has no more than indices of sixteen bits may name. Of an index the
/// lower half is taken, as in the records of such indices, so that there is one for each without a look at
/// how many there are.
#[derive(Clone, Copy)]
pub(crate) struct LowEnds<'a>(&'a [End; LOW]);

impl<'a> Lookup<'a> for LowEnds<'a> {
    /// There is none before the first [`Survey`], either.
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

    /// A step whose bodies are at these places.
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
                let tag = end.with_tag();
                assert_eq!(End::any_shapeless(tag), expected.is_none(), "{shape} of {count}");
                assert_eq!(tag.words()[3] >> 31 == 1, still, "{shape} of {count}");
                assert_eq!(end.still().words(), [if still { u32::MAX } else { 0 }; 4]);
            }
        }
    }
}
