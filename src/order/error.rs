//! The errors of an order and of its input.

/// An error in the input of an order, or in a schedule.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum OrderError {
    /// A window that no pipeline has.
    #[error(
        "expected a depth of 1 to {most} issue slots, found {found}: it is the hazard window in \
         cycles by the initiation interval, rounded up"
    )]
    Depth {
        /// Depth asked for, issue slots.
        found: u32,
        /// Largest depth, issue slots.
        most: u32,
    },

    /// A number of collisions an issue that no pipeline has.
    #[error("expected 1 to {most} collisions an issue, found {found}")]
    PerIssue {
        /// Collisions an issue asked for.
        found: u32,
        /// Most collisions an issue.
        most: u32,
    },

    /// More bodies or collisions than an order can count.
    #[error("found {found} {what}, at most {most} can be ordered")]
    TooMany {
        /// "bodies" or "collisions".
        what: &'static str,
        /// Number found.
        found: usize,
        /// Largest number.
        most: usize,
    },

    /// A collision with a body that does not exist.
    #[error("collision {collision} names body {body}, there are {bodies} bodies")]
    NoSuchBody {
        /// Index of the collision.
        collision: usize,
        /// Index of the body.
        body: u32,
        /// Bodies given.
        bodies: usize,
    },

    /// A collision of a body with itself.
    #[error("collision {collision} is of body {body} with itself")]
    SelfCollision {
        /// Index of the collision.
        collision: usize,
        /// Index of the body.
        body: u32,
    },

    /// Some bodies have too many collisions: the distance between them takes too many empty slots.
    #[error(
        "an order without hazards at a depth of {depth} issue slots needs more than {limit} \
         entries for {collisions} collisions: a moving body has too many of them"
    )]
    TooLong {
        /// Depth, issue slots.
        depth: u32,
        /// Largest number of entries.
        limit: usize,
        /// Collisions given.
        collisions: usize,
    },

    /// An entry names a collision that does not exist.
    #[error("entry {entry} of the schedule names collision {found}, of {collisions} collisions")]
    NoSuchCollision {
        /// Index of the entry.
        entry: usize,
        /// The collision it names.
        found: u32,
        /// Collisions given.
        collisions: usize,
    },

    /// A collision is in the schedule twice.
    #[error("collision {collision} is in the schedule again at entry {entry}")]
    Repeated {
        /// Index of the collision.
        collision: u32,
        /// Index of the later entry.
        entry: usize,
    },

    /// A collision is not in the schedule.
    #[error("collision {collision} is not in the schedule")]
    Missing {
        /// Index of the first such collision.
        collision: usize,
    },

    /// A moving body is used twice within the window.
    #[error(
        "hazard: body {body} is used in issue slots {earlier} and {slot}, less than {depth} apart"
    )]
    Hazard {
        /// Index of the body.
        body: u32,
        /// Issue slot of the earlier use.
        earlier: usize,
        /// Issue slot of the later use.
        slot: usize,
        /// Depth, issue slots.
        depth: u32,
    },
}
