//! The trait that makes a caller's own arrays the collisions of a step.

use super::{CONTACT_POINTS, Collision, Contact, Impulses, Structures};
use crate::simd::prefetch;

/// The collisions of a step, in the caller's own layout.
///
/// Slices, arrays and vectors of [`Collision`] implement it, [`CollisionArrays`] implements it over
/// separate arrays, and so does a reference to any of them. The solver takes the collisions in the
/// order of [`StepParameters::order`](crate::StepParameters::order).
///
/// Several threads may call it at the same time, each for collisions of its own
/// ([`OpenOptions::pack_threads`]); a container must therefore be [`Sync`]. Its methods run in the
/// standard [floating-point environment](crate#the-floating-point-environment), and must leave it
/// as it is.
///
/// [`OpenOptions::pack_threads`]: crate::OpenOptions::pack_threads
pub trait Collisions: Sync {
    /// Number of collisions.
    fn len(&self) -> usize;

    /// Collision `index`, which is below [`len`](Self::len).
    fn collision(&self, index: usize) -> Collision;

    /// All collisions as structures in memory, if they lie there: a step reads them without a copy.
    ///
    /// Their number must be [`len`](Self::len), and each must equal [`collision`](Self::collision)
    /// of its index. A view that changes any collision must keep the default. If a structure is
    /// invalid and the value of `collision` is valid, a step refuses the input as
    /// [`InputError::Unsteady`](crate::validate::InputError::Unsteady).
    fn structures(&self) -> Option<Structures<'_>> {
        None
    }

    /// Hints that collision `index`, which is below [`len`](Self::len), will be read soon. It has
    /// no other effect, and a step does not call it for [`structures`](Self::structures). A layout
    /// that can prefetch gains by it, above all where collisions are read in another order than
    /// they lie in memory.
    fn prefetch(&self, index: usize) {
        let _ = index;
    }

    /// Whether there are no collisions.
    fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Whether separate arrays have an element for every index; otherwise a step refuses the
    /// collisions.
    fn lengths_agree(&self) -> bool {
        true
    }

    /// The impulses with which collision `index` begins in a step with
    /// [`StepParameters::warm_start`](crate::StepParameters::warm_start); `index` is below
    /// [`len`](Self::len), and the collision has this normal and number of contact points.
    fn impulses(&self, index: usize, normal: [f32; 3], points: u32) -> Impulses {
        let _ = (index, normal, points);
        Impulses::ZERO
    }
}

impl Collisions for [Collision] {
    fn len(&self) -> usize {
        <[Collision]>::len(self)
    }

    #[inline]
    fn collision(&self, index: usize) -> Collision {
        self[index]
    }

    fn structures(&self) -> Option<Structures<'_>> {
        Some(Structures::Array(self))
    }
}

impl Collisions for Vec<Collision> {
    fn len(&self) -> usize {
        self.as_slice().len()
    }

    #[inline]
    fn collision(&self, index: usize) -> Collision {
        self[index]
    }

    fn structures(&self) -> Option<Structures<'_>> {
        Some(Structures::Array(self))
    }
}

impl<const N: usize> Collisions for [Collision; N] {
    fn len(&self) -> usize {
        N
    }

    #[inline]
    fn collision(&self, index: usize) -> Collision {
        self[index]
    }

    fn structures(&self) -> Option<Structures<'_>> {
        Some(Structures::Array(self))
    }
}

impl<C: Collisions + ?Sized> Collisions for &C {
    fn len(&self) -> usize {
        C::len(self)
    }

    #[inline]
    fn collision(&self, index: usize) -> Collision {
        C::collision(self, index)
    }

    fn structures(&self) -> Option<Structures<'_>> {
        C::structures(self)
    }

    fn prefetch(&self, index: usize) {
        C::prefetch(self, index);
    }

    fn is_empty(&self) -> bool {
        C::is_empty(self)
    }

    fn lengths_agree(&self) -> bool {
        C::lengths_agree(self)
    }

    #[inline]
    fn impulses(&self, index: usize, normal: [f32; 3], points: u32) -> Impulses {
        C::impulses(self, index, normal, points)
    }
}

/// Collisions kept in separate arrays of one length; a step refuses arrays of unequal lengths.
#[derive(Debug, Clone, Copy)]
pub struct CollisionArrays<'a> {
    /// Indices of bodies A and B.
    pub bodies: &'a [[u32; 2]],
    /// Unit normals from B to A.
    pub normals: &'a [[f32; 3]],
    /// Numbers of contact points; 0 for an empty collision. The friction of a pair is above its
    /// number, as in [`Collision::count`].
    pub counts: &'a [u32],
    /// Contact points: x, y, z on B's surface, and signed distance, m.
    pub contacts: &'a [[[f32; 4]; CONTACT_POINTS]],
}

impl Collisions for CollisionArrays<'_> {
    fn len(&self) -> usize {
        self.bodies.len()
    }

    fn lengths_agree(&self) -> bool {
        [self.normals.len(), self.counts.len(), self.contacts.len()]
            .iter()
            .all(|length| *length == self.len())
    }

    fn prefetch(&self, index: usize) {
        self.bodies.get(index).into_iter().for_each(prefetch);
        self.normals.get(index).into_iter().for_each(prefetch);
        self.counts.get(index).into_iter().for_each(prefetch);
        self.contacts.get(index).into_iter().for_each(prefetch);
    }

    fn collision(&self, index: usize) -> Collision {
        let [body_a, body_b] = self.bodies[index];
        Collision {
            body_a,
            body_b,
            normal: self.normals[index],
            count: self.counts[index],
            contacts: self.contacts[index]
                .map(|[x, y, z, distance]| Contact { point: [x, y, z], distance }),
        }
    }
}

/// Collisions with the impulses that a step is to begin with.
#[derive(Debug, Clone, Copy)]
pub struct WarmCollisions<'a, C: ?Sized> {
    /// The collisions.
    pub collisions: &'a C,
    /// The impulses of each collision; a step refuses another number of them.
    pub impulses: &'a [Impulses],
}

impl<C: Collisions + ?Sized> Collisions for WarmCollisions<'_, C> {
    fn len(&self) -> usize {
        self.collisions.len()
    }

    #[inline]
    fn collision(&self, index: usize) -> Collision {
        self.collisions.collision(index)
    }

    fn structures(&self) -> Option<Structures<'_>> {
        self.collisions.structures()
    }

    fn prefetch(&self, index: usize) {
        self.collisions.prefetch(index);
        self.impulses.get(index).into_iter().for_each(prefetch);
    }

    fn lengths_agree(&self) -> bool {
        self.collisions.lengths_agree() && self.impulses.len() == self.collisions.len()
    }

    #[inline]
    fn impulses(&self, index: usize, _: [f32; 3], _: u32) -> Impulses {
        self.impulses[index]
    }
}
