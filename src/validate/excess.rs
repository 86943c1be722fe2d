//! The ways in which input exceeds one bitstream, while another may take it.

use std::fmt;

use pgs_interface::number::StreamFormat;

/// The part of the input that exceeds the bitstream.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Excess {
    /// The records of the bitstream do not hold what the step asks for.
    #[error(
        "the step asks for {asked}, which the records of this bitstream do not hold: do without, \
         or load another"
    )]
    NotInRecords {
        /// What was asked for.
        asked: &'static str,
    },

    /// More bodies than the bitstream has room for, whatever the memory.
    #[error(
        "found {found} bodies, the bitstream takes at most {limit}: give fewer, or load another"
    )]
    TooManyBodies {
        /// Bodies given.
        found: usize,
        /// Bodies that the bitstream takes.
        limit: u32,
    },

    /// More collisions than the bitstream has room for, whatever the memory.
    #[error(
        "found {found} collisions, the bitstream takes at most {limit}: give fewer, or load another"
    )]
    TooManyCollisions {
        /// Collisions given.
        found: usize,
        /// Collisions that the bitstream takes.
        limit: u32,
    },

    /// Bodies and collisions together exceed the on-chip memory.
    #[error(
        "{bodies} bodies and {collisions} collisions need {needed} bytes of on-chip memory, there \
         are {available}: with so many bodies at most {fitting} collisions fit; give fewer, or \
         load another bitstream"
    )]
    MemoryExceeded {
        /// Bodies given.
        bodies: usize,
        /// Collisions given.
        collisions: usize,
        /// Memory that they need, bytes.
        needed: u64,
        /// Memory of the bitstream, bytes.
        available: u32,
        /// Collisions that fit beside the bodies; 0 if the bodies alone are too many.
        fitting: u32,
    },

    /// A number is out of the range of the bitstream's streams, arithmetic or arrays.
    #[error("{0}")]
    OutOfRange(OutOfRange),

    /// The inertia of a shape differs between its axes.
    #[error(
        "shape {shape}: its inverse inertia is {found:?}, but this bitstream takes only shapes \
         with three equal components (cube, sphere): give such a shape, or load another"
    )]
    Anisotropic {
        /// The shape.
        shape: usize,
        /// Its inverse inertia, 1/(kg m²).
        found: [f32; 3],
    },

    /// An order without hazards needs more entries, empty ones included, than the bitstream takes.
    #[error(
        "{collisions} collisions without a hazard, at a depth of {depth} issue slots, take more \
         than the {limit} entries that fit beside {bodies} bodies (body {body} alone has {uses} of \
         the collisions): give fewer, ask for another order, or load another bitstream"
    )]
    OrderTooLong {
        /// Collisions given.
        collisions: usize,
        /// Bodies given.
        bodies: usize,
        /// Entries that fit beside the bodies.
        limit: usize,
        /// Hazard window, issue slots.
        depth: u32,
        /// The moving body with the most collisions.
        body: usize,
        /// Its collisions.
        uses: usize,
    },
}

/// A number out of range, and its range.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct OutOfRange {
    /// The item of the input that has the number.
    pub item: InputItem,
    /// Name of the number in the item.
    pub field: &'static str,
    /// Component of the field, 0 for x; 0 for a field of one number.
    pub component: usize,
    /// Its value as it is streamed; of rows its magnitude, with the most that rounding can add.
    pub found: f32,
    /// The narrowest format on its way.
    pub format: StreamFormat,
    /// The smallest magnitude above 0.
    pub smallest: f32,
    /// The largest magnitude.
    pub largest: f32,
}

/// An item of the input, by its index.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum InputItem {
    /// A body.
    Body(usize),
    /// A collision, and the contact point if the number belongs to one.
    Collision(usize, Option<usize>),
    /// The constraint rows of a collision, and the contact point if the number belongs to one.
    Rows(usize, Option<usize>),
    /// A shape.
    Shape(usize),
    /// The step parameters.
    Parameters {
        /// Whether 0 is in range, too.
        zero: bool,
    },
}

impl fmt::Display for OutOfRange {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { item, field, component, found, format, smallest, largest } = *self;
        let format = format.name();
        let of = |collision: usize, contact: Option<usize>| match contact {
            Some(contact) => format!("collision {collision}, contact point {contact}"),
            None => format!("collision {collision}"),
        };
        match item {
            InputItem::Body(body) => write!(
                f,
                "body {body}: {field}[{component}] is {found}, but this bitstream holds bodies in \
                 {format}, which ends at {largest}: bring it into range, or load another"
            ),
            InputItem::Collision(collision, contact) => write!(
                f,
                "{}: {field}[{component}] is {found}, but this bitstream holds collisions in \
                 {format}, which ends at {largest}: bring it into range, or load another",
                of(collision, contact)
            ),
            InputItem::Rows(collision, contact) => write!(
                f,
                "{}: {field}[{component}] is {found}, but this bitstream computes constraint rows \
                 in {format}, which takes {smallest:e} to {largest}: bring it into range, or load \
                 another",
                of(collision, contact)
            ),
            InputItem::Shape(shape) => write!(
                f,
                "shape {shape}: its {field}[{component}] is {found:e}, but this bitstream holds it \
                 in {format}, from {smallest:e} to {largest}: give another shape, or load another \
                 bitstream"
            ),
            InputItem::Parameters { zero } => write!(
                f,
                "the {field} is {found:e}, but this bitstream computes in {format}, which takes \
                 {}{smallest:e} to {largest}: correct the step parameters, or load another",
                if zero { "0, or " } else { "" }
            ),
        }
    }
}
