//! Collisions, and the trait that makes a caller's own arrays collisions.

/// Largest number of contact points of a collision.
pub use pgs_interface::record::CONTACT_POINTS;

use bytemuck::{Pod, Zeroable};
use half::f16;
use pgs_interface::record::collision as layout;

use super::{Impulses, Structures};
use crate::simd::prefetch;

/// One point at which two bodies touch.
#[derive(Debug, Clone, Copy, PartialEq, Default, Pod, Zeroable)]
#[repr(C)]
pub struct Contact {
    /// The point on body B's surface, world frame, m.
    pub point: [f32; 3],
    /// Signed distance along the normal, m: A's surface is at `point + distance * normal`, so that
    /// negative is penetration.
    ///
    /// [`StepParameters`](crate::StepParameters#a-distance-as-a-velocity) describes its use in a
    /// step, where it can also stand for a velocity.
    pub distance: f32,
}

/// Two bodies in contact at one to four points, or a place without contacts.
///
/// A collision of count 0 is empty: it affects no body, whatever the order and the bitstream, and
/// keeps its index, so that the collisions behind it keep theirs. Nothing of it is looked at but the
/// count: its bodies need not exist or differ, its numbers need not be finite. It counts like any
/// other against the number of collisions that a bitstream takes.
///
/// Either body may be A, as long as the normal points from B to A and the contact points lie on B.
/// One of them may be static. All points share the normal: a manifold with several normals, such as
/// that of a mesh, is several collisions.
///
/// The words lie in this order, without a gap.
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct Collision {
    /// Index of body A.
    pub body_a: u32,
    /// Index of body B.
    pub body_b: u32,
    /// Unit normal, world frame, pointing from B to A: the direction in which A is pushed.
    pub normal: [f32; 3],
    /// Number of contact points, 0 to [`CONTACT_POINTS`], and the friction of the pair, if it has one
    /// of its own: [`with_friction`](Self::with_friction) puts it above the number.
    pub count: u32,
    /// The contact points; the elements behind their number are ignored.
    pub contacts: [Contact; CONTACT_POINTS],
}

impl Collision {
    /// The collision with a friction coefficient of its own, rounded to binary16 (three digits, at
    /// most 65504). A step uses it with
    /// [`StepParameters::pair_friction`](crate::StepParameters::pair_friction), and refuses it
    /// without; it also refuses one that is negative or not finite. An empty collision stays empty.
    #[must_use]
    pub fn with_friction(self, friction: f32) -> Self {
        if self.is_empty() {
            return self;
        }
        let friction = if friction >= 0.0 { friction } else { f32::NAN };
        let bits = u32::from(f16::from_f32(friction).to_bits()) << layout::FRICTION_SHIFT;
        let count = (self.count & !layout::FRICTION_BITS) | (bits & layout::FRICTION_BITS);
        Self { count, ..self }
    }

    /// Its own friction coefficient; 0 if it has none.
    #[must_use]
    pub fn friction(&self) -> f32 {
        let bits = (self.count & layout::FRICTION_BITS) >> layout::FRICTION_SHIFT;
        f16::from_bits(bits as u16).to_f32()
    }

    /// Whether its friction is a number: binary16 has all exponent bits set where it is none.
    #[inline(always)]
    pub(crate) const fn has_finite_friction(&self) -> bool {
        const EXPONENT: u32 = 0x7C00 << layout::FRICTION_SHIFT;
        self.count & EXPONENT != EXPONENT
    }

    /// Whether it has no contact points, and so no effect, whatever its other words are.
    #[inline(always)]
    #[must_use]
    pub const fn is_empty(&self) -> bool {
        self.count == 0
    }

    /// The number of contact points, without the friction.
    #[inline(always)]
    #[must_use]
    pub const fn points(&self) -> u32 {
        self.count & !layout::FRICTION_BITS
    }

    /// An entry without contact points, which has no effect.
    pub(crate) const NOTHING: Self = Self {
        body_a: 0,
        body_b: 0,
        normal: [0.0; 3],
        count: 0,
        contacts: [Contact { point: [0.0; 3], distance: 0.0 }; CONTACT_POINTS],
    };
}

/// The collisions of a step, in the caller's own layout.
///
/// Slices, arrays and vectors of [`Collision`] implement it, [`CollisionArrays`] implements it over
/// separate arrays, and so does a reference to any of them. The solver takes the collisions in the order of
/// [`StepParameters::order`](crate::StepParameters::order).
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
    /// [`len`](Self::len).
    fn impulses(&self, index: usize) -> Impulses {
        let _ = index;
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

    fn impulses(&self, index: usize) -> Impulses {
        C::impulses(self, index)
    }
}

/// Collisions kept in separate arrays of one length; a step refuses arrays of unequal lengths.
#[derive(Debug, Clone, Copy)]
pub struct CollisionArrays<'a> {
    /// Indices of bodies A and B.
    pub bodies: &'a [[u32; 2]],
    /// Unit normals from B to A.
    pub normals: &'a [[f32; 3]],
    /// Numbers of contact points; 0 for an empty collision. The friction of a pair is above its number,
    /// as in [`Collision::count`].
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
