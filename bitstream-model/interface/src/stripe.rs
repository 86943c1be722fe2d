//! Stripes: the stream on which each beat of an array travels.
//!
//! The beats of an array are numbered through, from the first beat of its first record. They go
//! out in groups; the table names the stream of every beat of a group, and on each stream beats
//! keep their order.
//!
//! ```text
//! float, collisions 0 1 2 3 0 1 2      a group is one record of seven beats
//! float, bodies     0 1 2 3            a group is one beat on each stream
//! half, collisions  0 0 0 1 1 1 2      a group is two records of three and a half beats
//! half, bodies      0 0 1 1 2          two beats of a 128-bit stream last as long as one of 64
//! ```

/// How the beats of an array are dealt out to the streams.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Stripe {
    /// Stream of each beat of a group.
    pub streams: &'static [u8],
    /// Whether the last group is always whole: beats of zeros, which are never decoded, fill it up.
    /// Without padding the last group ends with the array.
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
