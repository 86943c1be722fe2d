//! This file says on which stream each beat of an array travels.
//!
//! The beats of an array are numbered through, from the first beat of its first record. They go
//! out in groups; the table names the stream of every beat of a group, and on each stream beats
//! keep their order.
//!
//! ```text
//! float, collisions 0 1 2 3 0 1 2      a group is one record of seven beats
//! float, bodies     0 1 2 3            a group is as many beats as there are streams
//! half, collisions  0 0 0 1 1 1 2      a group is two records of three and a half beats
//! half, bodies      0 0 1 1 2          two beats on a 128-bit stream take as long as one on 64 bits
//! ```

/// How the beats of an array are dealt out to the streams.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Stripe {
    /// Stream of each beat of a group.
    pub streams: &'static [u8],
    /// Whether the last group is always whole: what is missing is filled with zeros that nobody
    /// decodes. Without it the last group ends with the array.
    pub padded: bool,
}

impl Stripes {
    /// One stripe for collisions and one for all records of bodies.
    #[must_use]
    pub const fn new(collisions: Stripe, bodies: Stripe) -> Self {
        Self { collisions, velocities: bodies, poses: bodies, results: bodies }
    }
}

/// The stripes of a profile.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Stripes {
    /// Collision records.
    pub collisions: Stripe,
    /// Velocity records.
    pub velocities: Stripe,
    /// Pose records.
    pub poses: Stripe,
    /// Result records.
    pub results: Stripe,
}
