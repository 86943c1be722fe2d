//! Stripes: the stream on which each beat of an array travels.
//!
//! The beats of an array are numbered through, from the first beat of its first record. They go
//! out in groups; the table names the stream of every beat of a group, and on each stream beats
//! keep their order.
//!
//! ```text
//! float, collisions 0 1 2 3 0 1 2      a group is one record of seven beats
//! float, bodies     0 1 2 3            a group is one beat on each stream
//! float, warm       0 1 2 3            eight beats: the impulses of a record behind it
//! half, collisions  0 0 0 1 1 1 2      a group is two records of three and a half beats
//! half, warm        0 0 0 1 1 1 2 2    behind them a beat with the impulses of both
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
        let warm_collisions = None;
        Self { collisions, warm_collisions, velocities: bodies, poses: bodies, results: bodies }
    }

    /// The stripes with one for collision records of warm passes.
    #[must_use]
    pub const fn with_warm_collisions(self, warm: Stripe) -> Self {
        Self { warm_collisions: Some(warm), ..self }
    }
}

/// The S2MM stream on which impulses go out: a beat for each collision in the packet of the
/// results, in front of them.
pub const IMPULSES_STREAM: usize = 0;

/// The stripes of a profile.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Stripes {
    /// Collision records.
    pub collisions: Stripe,
    /// Collision records of a warm pass, in a design that can have one: the stripe of the other
    /// passes, and the stream of the impulses behind it.
    pub warm_collisions: Option<Stripe>,
    /// Velocity records.
    pub velocities: Stripe,
    /// Pose records.
    pub poses: Stripe,
    /// Result records.
    pub results: Stripe,
}
