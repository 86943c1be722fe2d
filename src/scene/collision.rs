//! A collision and its contact points.

/// Largest number of contact points of a collision.
pub use pgs_interface::record::CONTACT_POINTS;

use bytemuck::{Pod, Zeroable};
use half::f16;
use pgs_interface::record::collision as layout;

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
