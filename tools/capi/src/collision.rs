//! Collisions as C has them: the driver's layout, word by word.

use std::mem::offset_of;

/// Largest number of contact points of a collision.
pub const ZPGS_CONTACT_POINTS: usize = 4;

/// One point at which two bodies touch.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[repr(C)]
pub struct Contact {
    /// The point on the surface of body B, world frame, m.
    pub point: [f32; 3],
    /// Signed distance along the normal, m. The surface of body A is at `point + distance *
    /// normal`; negative is penetration.
    pub distance: f32,
}

/// Two bodies in contact at one to four points. A collision of count 0 is empty: it has no effect
/// and keeps its index.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[repr(C)]
pub struct Collision {
    /// Index of body A.
    pub body_a: u32,
    /// Index of body B.
    pub body_b: u32,
    /// Unit normal from body B to body A, world frame.
    pub normal: [f32; 3],
    /// Number of contact points, 0 to `ZPGS_CONTACT_POINTS`. `zpgs_count_with_friction` adds a
    /// friction of the pair.
    pub count: u32,
    /// The contact points. The elements from `count` on are ignored, but must be initialised.
    pub contacts: [Contact; ZPGS_CONTACT_POINTS],
}

/// The impulses of a collision, accumulated over the passes of a step, N s.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[repr(C)]
pub struct Impulses {
    /// Along the normal, at each contact point; positive pushes body A along the normal. The
    /// elements behind the number of points come out as 0 and are ignored where they go in.
    pub normal: [f32; ZPGS_CONTACT_POINTS],
    /// Along the two tangents of the collision, at the centre of its points.
    pub friction: [f32; 2],
}

/// `collision` of a `zpgs_place` that the last step did not have.
pub const ZPGS_NEW_COLLISION: u32 = u32::MAX;

/// A point of a `zpgs_place` that the collision did not have.
pub const ZPGS_NEW_POINT: u8 = u8::MAX;

/// Where a collision was in the last step of its world.
///
/// The points of that collision had equal shares of its friction. One that is not named takes its
/// share along; two collisions that name points of one each begin with the shares of theirs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(C)]
pub struct Place {
    /// Its index among the collisions of that step, or `ZPGS_NEW_COLLISION`.
    pub collision: u32,
    /// For each contact point its index among the points of that collision, or `ZPGS_NEW_POINT`.
    /// The elements from the number of points on count for nothing, but must be valid.
    pub points: [u8; ZPGS_CONTACT_POINTS],
}

/// The driver reads the collisions, impulses and places of C where they lie.
const _: () = {
    use zynq_pgs::scene::CONTACT_POINTS;
    use zynq_pgs::{Collision as Driver, Contact as Point, Impulses as Sums, Place as Driven};
    assert!(size_of::<Place>() == size_of::<Driven>());
    assert!(align_of::<Place>() == align_of::<Driven>());
    assert!(offset_of!(Place, collision) == offset_of!(Driven, collision));
    assert!(offset_of!(Place, points) == offset_of!(Driven, points));
    assert!(Driven::NEW.collision == ZPGS_NEW_COLLISION && Driven::NEW.points[0] == ZPGS_NEW_POINT);
    assert!(size_of::<Impulses>() == size_of::<Sums>());
    assert!(align_of::<Impulses>() == align_of::<Sums>());
    assert!(offset_of!(Impulses, normal) == offset_of!(Sums, normal));
    assert!(offset_of!(Impulses, friction) == offset_of!(Sums, friction));
    assert!(ZPGS_CONTACT_POINTS == CONTACT_POINTS);
    assert!(size_of::<Collision>() == size_of::<Driver>());
    assert!(align_of::<Collision>() == align_of::<Driver>());
    assert!(offset_of!(Collision, body_a) == offset_of!(Driver, body_a));
    assert!(offset_of!(Collision, body_b) == offset_of!(Driver, body_b));
    assert!(offset_of!(Collision, normal) == offset_of!(Driver, normal));
    assert!(offset_of!(Collision, count) == offset_of!(Driver, count));
    assert!(offset_of!(Collision, contacts) == offset_of!(Driver, contacts));
    assert!(size_of::<Contact>() == size_of::<Point>());
    assert!(offset_of!(Contact, point) == offset_of!(Point, point));
    assert!(offset_of!(Contact, distance) == offset_of!(Point, distance));
};

/// The count word of a collision with a friction of its own.
pub(crate) fn count_with_friction(count: u32, friction: f32) -> u32 {
    let contacts = [zynq_pgs::Contact::default(); ZPGS_CONTACT_POINTS];
    let collision = zynq_pgs::Collision { body_a: 0, body_b: 0, normal: [0.0; 3], count, contacts };
    collision.with_friction(friction).count
}
