//! The ways in which input exceeds one bitstream, while another may take it.

use pgs_interface::number::StreamFormat;

/// The part of the input that exceeds the bitstream.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Excess {
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
         are {available}: with so many bodies at most {fitting} collisions fit; give fewer, or load \
         another bitstream"
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

    /// A number of a body is beyond what the bitstream's streams, arithmetic or arrays hold.
    #[error(
        "body {body}: {field}[{component}] is {found}, but this bitstream holds bodies in {}, \
         which ends at {limit}: bring it into range, or load another", format.name()
    )]
    BodyOutOfRange {
        /// The body.
        body: usize,
        /// Position, orientation, linear or angular velocity.
        field: &'static str,
        /// Component of the field, 0 for x.
        component: usize,
        /// Its value.
        found: f32,
        /// The narrowest format on its way.
        format: StreamFormat,
        /// Its largest number.
        limit: f32,
    },

    /// A number of a collision is beyond what the bitstream's streams or arithmetic hold.
    #[error(
        "collision {collision}{}: {field}[{component}] is {found}, but this bitstream holds \
         collisions in {}, which ends at {limit}: bring it into range, or load another",
        contact.map_or_else(String::new, |contact| format!(", contact point {contact}")),
        format.name()
    )]
    CollisionOutOfRange {
        /// The collision.
        collision: usize,
        /// The contact point, if it is a number of one.
        contact: Option<usize>,
        /// The streamed field: position of a body, offset from body A, normal, point or distance.
        field: &'static str,
        /// Component of the field, 0 for x; 0 for the distance.
        component: usize,
        /// Its value as it would be streamed.
        found: f32,
        /// The narrowest format on its way.
        format: StreamFormat,
        /// Its largest number.
        limit: f32,
    },

    /// The constraint rows of a collision leave what the bitstream's arithmetic holds.
    #[error(
        "collision {collision}{}: {field}[{component}] is {found}, but this bitstream computes \
         constraint rows in binary16, which takes {smallest:e} to {largest}: bring it into range, \
         or load another",
        contact.map_or_else(String::new, |contact| format!(", contact point {contact}"))
    )]
    RowOutOfRange {
        /// The collision.
        collision: usize,
        /// The contact point, if it is a number of one.
        contact: Option<usize>,
        /// Lever arm about a body, inverse effective mass, sum of the inverse masses or of the
        /// contact points.
        field: &'static str,
        /// Component of the field, 0 for x; 0 for a mass.
        component: usize,
        /// Its magnitude, with the most that rounding can add; m or 1/kg.
        found: f32,
        /// The smallest magnitude.
        smallest: f32,
        /// The largest magnitude that leaves room for the roundings.
        largest: f32,
    },

    /// A parameter is beyond what the bitstream's arithmetic holds.
    #[error(
        "the {parameter} is {found:e}, but this bitstream computes in binary16, which takes \
         {}{smallest:e} to {largest}: correct the step parameters, or load another",
        if *zero { "0, or " } else { "" }
    )]
    ParameterOutOfRange {
        /// The parameter; a gravity component with its axis.
        parameter: &'static str,
        /// Its value.
        found: f32,
        /// Whether 0 is taken as well.
        zero: bool,
        /// The smallest magnitude, 0 aside.
        smallest: f32,
        /// The largest magnitude.
        largest: f32,
    },

    /// The inertia of a shape differs between its axes.
    #[error(
        "shape {shape}: its inverse inertia is {found:?}, but this bitstream takes only shapes with \
         three equal components (cube, sphere): give such a shape, or load another"
    )]
    Anisotropic {
        /// The shape.
        shape: usize,
        /// Its inverse inertia, 1/(kg m²).
        found: [f32; 3],
    },

    /// An inverse mass or inertia is beyond what the bitstream's arithmetic or streams hold.
    #[error(
        "shape {shape}: its {field}[{component}] is {found:e}, but this bitstream holds it in {}, \
         from {smallest:e} to {largest}: give another shape, or load another bitstream",
        format.name()
    )]
    ShapeOutOfRange {
        /// The shape.
        shape: usize,
        /// Inverse mass or inverse inertia.
        field: &'static str,
        /// Component of the field, 0 for x; 0 for the mass.
        component: usize,
        /// Its value, 1/kg or 1/(kg m²).
        found: f32,
        /// The narrowest format on its way.
        format: StreamFormat,
        /// The smallest number above 0 that does not become 0.
        smallest: f32,
        /// The largest number.
        largest: f32,
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

    /// The span from the first to the last use of a body is longer than the delay lines.
    #[error(
        "in this order body {body} is used first in entry {first} and last in entry {last}, and the \
         bitstream's delay lines take spans of less than {lag}: ask for another order (hazard-free \
         keeps spans short unless a body has dozens of collisions), or load another bitstream"
    )]
    SpanTooLong {
        /// The body with the longest span.
        body: usize,
        /// Entry of its first use.
        first: usize,
        /// Entry of its last use.
        last: usize,
        /// Length of the delay lines.
        lag: u32,
    },

    /// More bodies are alive than the bitstream has places for.
    #[error(
        "in this order {held} moving bodies are on their way through the passes at once ({alive} of \
         them with collisions to come), the bitstream has places for {places}: ask for \
         another order, or load another bitstream"
    )]
    TooManyLive {
        /// Most bodies that need a place at once.
        held: u32,
        /// Most bodies between their first and their last use.
        alive: u32,
        /// Places of the bitstream.
        places: u32,
    },
}
