//! This file says what the record of a collision takes from either of its bodies.

use crate::scene::{Body, Shape};

/// A body as a collision's end: sixteen bytes, so that those of a whole scene lie in a cache.
#[derive(Debug, Clone, Copy, PartialEq)]
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

    /// That of a body. Without a shape it is static.
    #[inline]
    pub(crate) fn of(body: &Body, shapes: &[Shape]) -> Self {
        let shape = usize::try_from(body.shape).ok().and_then(|shape| shapes.get(shape));
        let tag = match shape {
            Some(shape) => body.shape | if shape.is_static() { STATIC } else { 0 },
            None => NO_SHAPE,
        };
        Self { position: body.pose.position, tag }
    }

    /// Whether it never moves.
    #[inline]
    pub(crate) const fn is_static(self) -> bool {
        self.tag & STATIC != 0
    }

    /// Whether it has a shape.
    #[inline]
    pub(crate) const fn has_shape(self) -> bool {
        self.tag != NO_SHAPE
    }

    /// Its shape; a static one, if it has none.
    #[inline]
    pub(crate) fn shape(self, shapes: &[Shape]) -> &Shape {
        let shape = usize::try_from(self.tag & !STATIC).ok().and_then(|shape| shapes.get(shape));
        shape.unwrap_or(&Shape::STATIC)
    }
}

/// The ends of all bodies of a step, to look up.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Ends<'a>(pub(crate) &'a [End]);

impl Ends<'_> {
    /// That of one body.
    #[inline]
    pub(crate) fn get(self, body: u32) -> End {
        let end = usize::try_from(body).ok().and_then(|body| self.0.get(body));
        end.copied().unwrap_or(End::MISSING)
    }
}
