//! Impulses of collisions, as a step gives them out and as the next one begins with them.

use bytemuck::{Pod, Zeroable};

use super::CONTACT_POINTS;
use pgs_interface::record::collision::FRICTION_BITS;

/// The impulses of a collision, accumulated over the passes of a step, N s.
///
/// A step gives them out with [`StepParameters::impulses_out`] and begins with them with
/// [`StepParameters::warm_start`]. The words lie in this order, without a gap.
///
/// [`StepParameters::impulses_out`]: crate::StepParameters::impulses_out
/// [`StepParameters::warm_start`]: crate::StepParameters::warm_start
#[derive(Debug, Clone, Copy, PartialEq, Default, Pod, Zeroable)]
#[repr(C)]
pub struct Impulses {
    /// Along the normal, at each contact point. Positive pushes body A along the normal. The
    /// elements behind the number of points are 0 where they come out, and ignored where they go
    /// in.
    pub normal: [f32; CONTACT_POINTS],
    /// Along the two tangents of the collision (specification, §7), at the centre of its points.
    pub friction: [f32; 2],
}

impl Impulses {
    /// No impulse: the cold start of a collision.
    pub const ZERO: Self = Self { normal: [0.0; CONTACT_POINTS], friction: [0.0; 2] };

    /// The impulses times a factor. A pile comes to rest sooner with 0.85 of the last step's.
    #[must_use]
    #[inline]
    pub fn scaled(self, factor: f32) -> Self {
        let [first, second] = self.friction;
        Self {
            normal: self.normal.map(|impulse| impulse * factor),
            friction: [first * factor, second * factor],
        }
    }

    /// The impulses without elements behind the number of points in a collision's `count`, which
    /// count for nothing.
    #[inline]
    pub(crate) fn used(self, count: u32) -> Self {
        let points = (count & !FRICTION_BITS) as usize;
        if points == 0 {
            return Self::ZERO;
        }
        let of = |at: usize| if at < points { self.normal[at] } else { 0.0 };
        Self { normal: std::array::from_fn(of), ..self }
    }

    /// Whether all are numbers.
    #[inline]
    pub(crate) fn are_finite(&self) -> bool {
        self.are_within(f32::MAX)
    }

    /// Whether all are numbers of at most this magnitude.
    #[inline]
    pub(crate) fn are_within(&self, limit: f32) -> bool {
        // Without a branch for each, as nearly all are.
        let of = |all: bool, impulse: &f32| all & (impulse.abs() <= limit);
        self.friction.iter().fold(self.normal.iter().fold(true, of), of)
    }
}
