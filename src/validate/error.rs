//! The reasons for which a step refuses its input, before anything is sent.

use super::CapableProfiles;
use crate::order::OrderError;
use crate::scene::ShapeError;
use pgs_interface::number::StreamFormat;
use pgs_interface::record::CONTACT_POINTS;

/// Why input was refused. Nothing was sent, and the caller's data is unchanged.
///
/// Indices are positions in the arrays that the caller gave.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum InputError {
    /// There are no bodies.
    #[error("a step needs at least one body, found none: give all bodies, static ones included")]
    NoBodies,

    /// More bodies than the bitstream has room for, whatever the memory.
    #[error(
        "found {found} bodies, the bitstream takes at most {limit}: give fewer, or load another \
         ({carriers})"
    )]
    TooManyBodies {
        /// Bodies given.
        found: usize,
        /// Bodies that the bitstream takes.
        limit: u32,
        /// Profiles that take them.
        carriers: CapableProfiles,
    },

    /// More collisions than the bitstream has room for, whatever the memory.
    #[error(
        "found {found} collisions, the bitstream takes at most {limit}: give fewer, or load another \
         ({carriers})"
    )]
    TooManyCollisions {
        /// Collisions given.
        found: usize,
        /// Collisions that the bitstream takes.
        limit: u32,
        /// Profiles that take them.
        carriers: CapableProfiles,
    },

    /// The number of bodies differs from the number that the step was started with.
    #[error(
        "the step was started with {expected} bodies, {found} wait for its results: give the same \
         bodies; the step was stopped"
    )]
    OtherBodies {
        /// Bodies given now.
        found: usize,
        /// Bodies given before.
        expected: usize,
    },

    /// The records of a prepared step are no longer in its buffers.
    #[error(
        "the prepared step is not in its buffers any more, because another was packed in its \
         place, or it was prepared by another accelerator: prepare it again"
    )]
    NotPrepared,

    /// The input changed during the call: packing refused it, and validation then accepted it.
    #[error(
        "bodies or collisions were wrong when they were packed, and right when they were looked at \
         again: what is given must stay as it is until the call returns"
    )]
    Unsteady,

    /// More collisions were written than were announced.
    #[error("more than the {announced} collisions that were announced were written: announce more")]
    MoreThanAnnounced {
        /// Collisions announced.
        announced: usize,
    },

    /// Collisions that are written one by one cannot be reordered, verified or placed.
    #[error(
        "collisions that are written one by one cannot be put into another order, verified, or \
         placed on a bitstream that keeps live bodies alone: ask for the order as given, \
         unverified, on one that takes it, or give all collisions at once (step, submit, prepare)"
    )]
    WrittenInOrder,

    /// The prepared step was checked and packed with other shapes.
    #[error("the shapes were replaced after the step was prepared: prepare it again")]
    ShapesChanged,

    /// The separate arrays of one kind differ in length.
    #[error("the arrays of the {what} have different lengths: give every array for all {what}")]
    UnequalLengths {
        /// "bodies" or "collisions".
        what: &'static str,
    },

    /// Bodies and collisions together exceed the on-chip memory.
    #[error(
        "{bodies} bodies and {collisions} collisions need {needed} bytes of on-chip memory, there \
         are {available}: with so many bodies at most {fitting} collisions fit; give fewer, or load \
         another bitstream ({carriers})"
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
        /// Profiles with room for both.
        carriers: CapableProfiles,
    },

    /// A number of a body is NaN or infinite.
    #[error("body {body}: {field}[{component}] is {found}, expected a finite number: correct it")]
    BodyNotFinite {
        /// The body.
        body: usize,
        /// Position, orientation, linear or angular velocity.
        field: &'static str,
        /// Component of the field, 0 for x.
        component: usize,
        /// Its value.
        found: f32,
    },

    /// A number of a body is beyond what the bitstream's streams, arithmetic or arrays hold.
    #[error(
        "body {body}: {field}[{component}] is {found}, but this bitstream holds bodies in {}, \
         which ends at {limit}: bring it into range, or load another ({carriers})", format.name()
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
        /// Profiles that hold the body.
        carriers: CapableProfiles,
    },

    /// The quaternion of a body is no rotation.
    #[error(
        "body {body}: the orientation has length {length:e}, which cannot be normalised (at least \
         {limit:e} and finite): give a unit quaternion x, y, z, w",
        limit = InputError::SHORTEST_ORIENTATION
    )]
    Orientation {
        /// The body.
        body: usize,
        /// Length of the quaternion; infinite if its square is beyond f32.
        length: f32,
    },

    /// A static body has a velocity.
    #[error(
        "body {body} is static (its shape has inverse mass 0) but its {field}[{component}] is \
         {found}: set its velocity to 0, or give it a shape with a mass"
    )]
    StaticBodyMoves {
        /// The body.
        body: usize,
        /// Linear or angular velocity.
        field: &'static str,
        /// Component of the field, 0 for x.
        component: usize,
        /// Its value, m/s or rad/s.
        found: f32,
    },

    /// A body refers to a shape that was not set.
    #[error(
        "body {body}: its shape is {found}, but the table has {shapes} shapes, counted from 0: \
         correct the index, or set the shapes first"
    )]
    ShapeIndex {
        /// The body.
        body: usize,
        /// Its shape index.
        found: u32,
        /// Shapes in the table.
        shapes: usize,
    },

    /// A collision refers to a body that does not exist.
    #[error(
        "collision {collision}: body {side} is {found}, but there are {bodies} bodies, counted \
         from 0: correct the index"
    )]
    BodyIndex {
        /// The collision.
        collision: usize,
        /// Which of the two bodies, `A` or `B`.
        side: char,
        /// Its index.
        found: u32,
        /// Bodies given.
        bodies: usize,
    },

    /// A body collides with itself.
    #[error("collision {collision}: bodies A and B are both {body}: remove the collision")]
    SelfCollision {
        /// The collision.
        collision: usize,
        /// The body.
        body: u32,
    },

    /// Both bodies of a collision are static.
    #[error(
        "collision {collision}: bodies {body_a} and {body_b} are both static, nothing can move: \
         remove the collision"
    )]
    BothStatic {
        /// The collision.
        collision: usize,
        /// Body A.
        body_a: u32,
        /// Body B.
        body_b: u32,
    },

    /// The number of contact points is not within 1 to [`CONTACT_POINTS`].
    #[error(
        "collision {collision}: its count is {found}, expected 1 to {CONTACT_POINTS} contact \
         points: remove the collision if there are none, reduce them if there are more"
    )]
    ContactCount {
        /// The collision.
        collision: usize,
        /// Its count.
        found: u32,
    },

    /// A component of a normal is NaN or infinite.
    #[error(
        "collision {collision}: normal[{component}] is {found}, expected a finite number: correct \
         it"
    )]
    NormalNotFinite {
        /// The collision.
        collision: usize,
        /// Component, 0 for x.
        component: usize,
        /// Its value.
        found: f32,
    },

    /// A normal is zero.
    #[error(
        "collision {collision}: the normal is 0, so that the contact has no direction: leave the \
         collision out, or give a unit normal from B to A"
    )]
    NormalZero {
        /// The collision.
        collision: usize,
    },

    /// A normal is not of unit length.
    #[error(
        "collision {collision}: the normal has length {length:?}, expected 1 within {tolerance}: \
         normalise it",
        tolerance = InputError::NORMAL_TOLERANCE
    )]
    NormalLength {
        /// The collision.
        collision: usize,
        /// Length of the normal.
        length: f32,
    },

    /// A number of a used contact point is NaN or infinite.
    #[error(
        "collision {collision}, contact point {contact}: {field}[{component}] is {found}, expected \
         a finite number: correct it, or lower the count if the point is not in use"
    )]
    ContactNotFinite {
        /// The collision.
        collision: usize,
        /// The contact point.
        contact: usize,
        /// Point or distance.
        field: &'static str,
        /// Component of the field, 0 for x; 0 for the distance.
        component: usize,
        /// Its value.
        found: f32,
    },

    /// A number of a collision is beyond what the bitstream's streams or arithmetic hold.
    #[error(
        "collision {collision}{}: {field}[{component}] is {found}, but this bitstream holds \
         collisions in {}, which ends at {limit}: bring it into range, or load another ({carriers})",
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
        /// Profiles that hold the collision.
        carriers: CapableProfiles,
    },

    /// The collisions cannot be ordered, or their order has hazards and was to be verified.
    #[error(
        "the collisions cannot be sent in this order: ask for another, or do not have it verified"
    )]
    Order(#[from] OrderError),

    /// An order without hazards needs more entries, empty ones included, than the bitstream takes.
    #[error(
        "{collisions} collisions without a hazard, at a depth of {depth} issue slots, take more \
         than the {limit} entries that fit beside {bodies} bodies (body {body} alone has {uses} of \
         the collisions): give fewer, ask for another order, or load another bitstream ({carriers})"
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
        /// Profiles that could have room for it.
        carriers: CapableProfiles,
    },

    /// The span from the first to the last use of a body is longer than the delay lines.
    #[error(
        "in this order body {body} is used first in entry {first} and last in entry {last}, and the \
         bitstream's delay lines take spans of less than {lag}: ask for another order (hazard-free \
         keeps spans short unless a body has dozens of collisions), or load another bitstream \
         ({carriers})"
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
        /// Profiles that could take the order.
        carriers: CapableProfiles,
    },

    /// More bodies are alive than the bitstream has places for.
    #[error(
        "in this order {held} moving bodies are on their way through the passes at once ({alive} of \
         them with collisions to come), the bitstream has places for {places}: ask for \
         another order, or load another bitstream ({carriers})"
    )]
    TooManyLive {
        /// Most bodies that need a place at once.
        held: u32,
        /// Most bodies between their first and their last use.
        alive: u32,
        /// Places of the bitstream.
        places: u32,
        /// Profiles that could take the order.
        carriers: CapableProfiles,
    },

    /// The constraint rows of a collision leave what the bitstream's arithmetic holds.
    #[error(
        "collision {collision}{}: {field}[{component}] is {found}, but this bitstream computes \
         constraint rows in binary16, which takes {smallest:e} to {largest}: bring it into range, \
         or load another ({carriers})",
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
        /// Profiles that compute the rows.
        carriers: CapableProfiles,
    },

    /// A parameter is outside its range.
    #[error("the {parameter} is {found}, expected {expected}: correct the step parameters")]
    Parameter {
        /// The parameter; a gravity component with its axis.
        parameter: &'static str,
        /// Its value.
        found: f32,
        /// Its range.
        expected: &'static str,
    },

    /// A parameter is beyond what the bitstream's arithmetic holds.
    #[error(
        "the {parameter} is {found:e}, but this bitstream computes in binary16, which takes \
         {}{smallest:e} to {largest}: correct the step parameters, or load another ({carriers})",
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
        /// Profiles that compute with it.
        carriers: CapableProfiles,
    },

    /// A solver has more iterations than a step takes.
    #[error(
        "{found} {solver} iterations, a step takes at most {limit}: give fewer, or take several \
         steps",
        limit = InputError::MAX_ITERATIONS
    )]
    TooManyIterations {
        /// Contact or friction.
        solver: &'static str,
        /// Iterations asked for.
        found: u32,
    },

    /// The shape table is empty.
    #[error(
        "found no shapes, expected at least one: a step needs a body, and a body a shape; set the \
         shapes that the bodies refer to"
    )]
    NoShapes,

    /// More shapes than the table has entries.
    #[error(
        "found {found} shapes, the bitstream's table takes at most {limit}: give bodies of equal \
         mass and inertia one shape"
    )]
    TooManyShapes {
        /// Shapes given.
        found: usize,
        /// Entries of the table.
        limit: u32,
    },

    /// An inverse mass or inertia is negative, subnormal or not finite.
    #[error(
        "shape {shape}: its {field}[{component}] is {found:e}, expected 0 or a finite number of at \
         least {limit:e}: correct it",
        limit = f32::MIN_POSITIVE
    )]
    ShapeValue {
        /// The shape.
        shape: usize,
        /// Inverse mass or inverse inertia.
        field: &'static str,
        /// Component of the field, 0 for x; 0 for the mass.
        component: usize,
        /// Its value, 1/kg or 1/(kg m²).
        found: f32,
    },

    /// The inertia of a shape differs between its axes.
    #[error(
        "shape {shape}: its inverse inertia is {found:?}, but this bitstream takes only shapes with \
         three equal components (cube, sphere): give such a shape, or load another ({carriers})"
    )]
    Anisotropic {
        /// The shape.
        shape: usize,
        /// Its inverse inertia, 1/(kg m²).
        found: [f32; 3],
        /// Profiles that take the shape.
        carriers: CapableProfiles,
    },

    /// An inverse mass or inertia is beyond what the bitstream's arithmetic or streams hold.
    #[error(
        "shape {shape}: its {field}[{component}] is {found:e}, but this bitstream holds it in {}, \
         from {smallest:e} to {largest}: give another shape, or load another bitstream ({carriers})",
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
        /// Profiles that hold it.
        carriers: CapableProfiles,
    },

    /// The mass or the size of a shape gives no valid mass properties.
    #[error(transparent)]
    Shape(#[from] ShapeError),

    /// A static shape has an inverse inertia.
    #[error(
        "shape {shape} is static (inverse mass 0) but its inverse inertia is {found}: set that to \
         0 too, or give the shape a mass"
    )]
    StaticShapeRotates {
        /// The shape.
        shape: usize,
        /// Its inverse inertia, 1/(kg m²).
        found: f32,
    },
}

impl InputError {
    /// Length of the shortest quaternion that counts as a rotation.
    pub const SHORTEST_ORIENTATION: f32 = 1e-6;
    /// How far from 1 a normal's length may be.
    pub const NORMAL_TOLERANCE: f32 = 1e-3;
    /// The most iterations of each solver.
    pub const MAX_ITERATIONS: u32 = pgs_interface::control::ITERATIONS_MAX;
}
