//! The reasons for which a step refuses its input, before anything is sent.

use pgs_interface::profile::Variant;
use pgs_interface::record::CONTACT_POINTS;

use super::{CapableProfiles, Excess, OutOfRange, SceneNeeds};
use crate::order::OrderError;
use crate::scene::ShapeError;

/// Why input was refused. Nothing was sent, and the caller's data is unchanged.
///
/// Indices are positions in the arrays that the caller gave.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum InputError {
    /// The input exceeds this bitstream; another may take it.
    #[error("{excess} ({capable})")]
    BeyondBitstream {
        /// The part of the input that exceeds it.
        excess: Excess,
        /// Profiles that take the step.
        capable: CapableProfiles,
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

    /// A detached step is no longer on the board.
    #[error(
        "the detached step is not in flight any more, because another call of the accelerator has \
         stopped it, or it was started by another accelerator: submit it again"
    )]
    NotInFlight,

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

    /// Collisions that are written one by one cannot be reordered or verified.
    #[error(
        "collisions that are written one by one cannot be put into another order or verified: ask \
         for the order as given, unverified, or give all collisions at once (step, submit, prepare)"
    )]
    WrittenInOrder,

    /// Collisions that are written one by one have no impulses.
    #[error(
        "collisions that are written one by one come without impulses: leave \
         `StepParameters::warm_start` out, or give all collisions at once (step, submit, prepare)"
    )]
    WrittenWarm,

    /// The prepared step was checked and packed with other shapes.
    #[error("the shapes were replaced after the step was prepared: prepare it again")]
    ShapesChanged,

    /// The separate arrays of one kind differ in length.
    #[error("the arrays of the {what} have different lengths: give every array for all {what}")]
    UnequalLengths {
        /// "bodies" or "collisions".
        what: &'static str,
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
         {found}: set its velocity to 0, give it a shape with a mass, or let static bodies move \
         (`StepParameters::kinematic`)"
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

    /// A collision has a friction of its own, and the step does not ask for it.
    #[error(
        "collision {collision} has a friction of its own: set `StepParameters::pair_friction`, or \
         leave it out"
    )]
    OwnFriction {
        /// The collision.
        collision: usize,
    },

    /// The friction of a collision is negative, no number, or beyond binary16.
    #[error("collision {collision}: its friction is {found}, expected 0 to 65504: correct it")]
    FrictionNotFinite {
        /// The collision.
        collision: usize,
        /// Its friction.
        found: f32,
    },

    /// An impulse that a collision begins with is NaN or infinite.
    #[error("collision {collision}: an impulse of its warm start is not finite: correct it")]
    ImpulseNotFinite {
        /// The collision.
        collision: usize,
    },

    /// A collision names a place that the last step did not have.
    #[error(
        "collision {collision}: its place in the last step is {found}, but that step had {limit} \
         collisions, counted from 0: correct it, or give the place of a new one, {new}",
        new = u32::MAX
    )]
    CollisionPlace {
        /// The collision.
        collision: usize,
        /// The index that its place has.
        found: u32,
        /// Collisions of the last step that was committed.
        limit: u32,
    },

    /// A contact point names a place that no collision has.
    #[error(
        "collision {collision}, contact point {contact}: its place in the last step is {found}, \
         expected a point below {CONTACT_POINTS}, or {new} for a new one: correct it",
        new = u8::MAX
    )]
    PointPlace {
        /// The collision.
        collision: usize,
        /// The contact point.
        contact: usize,
        /// The index that its place has.
        found: u8,
    },

    /// The impulses to keep are not the ones of these collisions.
    #[error(
        "found {found} impulses of {expected} collisions: commit a step that gave its impulses out \
         (`StepParameters::impulses_out`), with the collisions that it was given"
    )]
    OtherImpulses {
        /// Impulses given.
        found: usize,
        /// Collisions given.
        expected: usize,
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

    /// The number of contact points is above [`CONTACT_POINTS`].
    #[error(
        "collision {collision}: its count is {found}, expected at most {CONTACT_POINTS} contact \
         points: reduce them"
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

    /// The collisions cannot be ordered, or their order has hazards and was to be verified.
    #[error(
        "the collisions cannot be sent in this order: ask for another, or do not have it verified"
    )]
    Order(#[from] OrderError),

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
        "found no shapes, expected at least one: a body needs a shape; set the shapes that the \
         bodies refer to"
    )]
    NoShapes,

    /// More shapes than the table has entries.
    #[error(
        "found {found} shapes, the bitstream's table takes at most {limit}: give bodies of equal \
         mass and inertia one shape, or load a bitstream of world inertia, which takes any number \
         of them"
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
    /// The part of the input that exceeds the bitstream, if that is the reason.
    #[must_use]
    pub fn excess(&self) -> Option<Excess> {
        match self {
            Self::BeyondBitstream { excess, .. } => Some(*excess),
            _ => None,
        }
    }

    /// The number that is out of the bitstream's range, if that is the reason.
    #[must_use]
    pub fn out_of_range(&self) -> Option<OutOfRange> {
        match self.excess() {
            Some(Excess::OutOfRange(number)) => Some(number),
            _ => None,
        }
    }

    /// Length of the shortest quaternion that counts as a rotation.
    pub const SHORTEST_ORIENTATION: f32 = 1e-6;
    /// How far from 1 a normal's length may be.
    pub const NORMAL_TOLERANCE: f32 = 1e-3;
    /// The most iterations of each solver.
    pub const MAX_ITERATIONS: u32 = pgs_interface::control::ITERATIONS_MAX;
}

impl SceneNeeds {
    /// The error of a scene that exceeds a bitstream; `can` tells whether another would take the
    /// excess.
    #[cold]
    pub(crate) fn refuse(&self, excess: Excess, can: &dyn Fn(&Variant) -> bool) -> InputError {
        InputError::BeyondBitstream { excess, capable: self.capable(can) }
    }
}
