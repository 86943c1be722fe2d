//! The parameters of a step.

use std::time::Duration;

use pgs_interface::profile::solver;

use super::Order;

/// Parameters of a step. The default is Bullet's at 60 steps a second, without damping of spin.
///
/// They hold for all bodies and collisions of the step.
///
/// # A distance as a velocity
///
/// At a contact point that is `distance` apart, the solver lets A and B approach along the normal
/// at
///
/// ```text
/// (distance + position_drift) * position_coefficient / time_step        m/s
/// ```
///
/// and not faster. If this velocity is negative, the solver pushes them apart at least that fast.
/// The defaults remove a fifth of the penetration beyond 5 mm in each step.
///
/// With a drift of 0 and a coefficient equal to the time step this is `distance` itself, to
/// rounding. The caller can then give a velocity in place of every distance:
///
/// - restitution: minus the speed with which the bodies are to part;
/// - Baumgarte stabilisation or ERP, with slop: minus a share of the penetration beyond the slop,
///   divided by the time step;
/// - a speculative margin: the gap divided by the time step, which lets the bodies touch and not
///   penetrate.
///
/// A ball dropped from 5 m, with a bounce that leaves 0.8 of its speed:
///
/// ```
/// use zynq_pgs::{Accelerator, Body, Collision, Contact, OpenOptions, Pose, Shape};
/// use zynq_pgs::{StepParameters, Velocity};
///
/// # fn main() -> Result<(), zynq_pgs::Error> {
/// const RADIUS: f32 = 0.5;
/// const RESTITUTION: f32 = 0.8;
///
/// let mut accelerator = Accelerator::open(OpenOptions::default())?;
/// accelerator.set_shapes(&[Shape::STATIC, Shape::sphere(1.0, RADIUS)?])?;
/// let at = |y, shape| Body {
///     pose: Pose { position: [0.0, y, 0.0], orientation: [0.0, 0.0, 0.0, 1.0] },
///     velocity: Velocity::default(),
///     shape,
/// };
/// let mut bodies = [at(-1.0, 0), at(5.0 + RADIUS, 1)];
///
/// let mut parameters = StepParameters::default();
/// parameters.position_drift = 0.0;
/// parameters.position_coefficient = parameters.time_step;
/// // Gravity and motion are the caller's.
/// parameters.integrate = false;
///
/// let (mut apexes, mut highest) = (Vec::new(), 0.0_f32);
/// for _ in 0..300 {
///     let height = bodies[1].pose.position[1] - RADIUS;
///     let before = bodies[1].velocity.linear[1];
///     bodies[1].velocity.linear[1] -= 9.8 * parameters.time_step;
///
///     // The ground is A and the ball B: the normal points down, and the point is the ball's
///     // lowest. A ball that comes down is to go up with 0.8 of its speed.
///     let point = [0.0, height, 0.0];
///     let contact = Contact { point, distance: RESTITUTION * before.min(0.0) };
///     let touch = Collision {
///         body_a: 0,
///         body_b: 1,
///         normal: [0.0, -1.0, 0.0],
///         count: 1,
///         contacts: [contact; 4],
///     };
///     let collisions = if height <= 0.0 { vec![touch] } else { vec![] };
///     accelerator.step(&mut bodies[..], &collisions, &parameters)?;
///
///     let speed = bodies[1].velocity.linear[1];
///     bodies[1].pose.position[1] += speed * parameters.time_step;
///     if speed > 0.0 {
///         highest = highest.max(bodies[1].pose.position[1] - RADIUS);
///     } else if before > 0.0 {
///         apexes.push(std::mem::take(&mut highest));
///     }
/// }
///
/// // Each bounce leaves 0.64 of the height; steps of a 60th of a second are a little off.
/// assert!(apexes.len() >= 3, "{apexes:?}");
/// for (apex, exact) in apexes.iter().zip([3.20, 2.05, 1.31]) {
///     assert!((apex / exact - 1.0).abs() < 0.04, "{apexes:?}");
/// }
/// # Ok(())
/// # }
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct StepParameters {
    /// Time step, s.
    pub time_step: f32,
    /// Penetration that the solver leaves alone, m (Bullet: position drift).
    pub position_drift: f32,
    /// Share of the penetration that a step removes (Bullet: position coefficient).
    pub position_coefficient: f32,
    /// Friction coefficient of every contact, unless collisions have their own.
    pub friction: f32,
    /// Whether each collision has a friction of its own
    /// ([`Collision::with_friction`](crate::Collision::with_friction)). A collision without one
    /// then has a friction of 0.
    pub pair_friction: bool,
    /// Share of the angular velocity that a step with integration leaves, from 0 to 1.
    pub angular_damping: f32,
    /// Share of the spin about the normal that every friction pass takes from both bodies of a
    /// collision, from 0 to 1, where one of them is static or lies on the other. 0 is off; 0.1 is
    /// [the thesis'](Self::thesis).
    pub spin_damping: f32,
    /// Gravity, m/s², world frame; only a step with integration uses it.
    pub gravity: [f32; 3],
    /// Passes of the contact solver over all collisions.
    pub contact_iterations: u32,
    /// Passes of the friction solver over all collisions.
    pub friction_iterations: u32,
    /// Whether to integrate after the solver: damp, turn and move each body, then add gravity to
    /// its velocity.
    ///
    /// Without it the velocities come back as the solver left them, undamped and without gravity.
    /// The poses stay the caller's own to the bit on every profile, also where the streams have
    /// sixteen bits. An engine that keeps its own integration then keeps every other part of it:
    /// forces and gravity (added to the velocities before the step), gyroscopic terms, damping,
    /// continuous collision detection, sleeping.
    pub integrate: bool,
    /// Whether static bodies may move: bodies of inverse mass 0 then have the velocity that they
    /// come with. It counts in the contacts, nothing changes it, and a step with integration moves
    /// the pose by it, without damping and gravity: platforms, doors, conveyors. Collisions of such
    /// a body are no hazard, whatever their number. Without it a static body must be at rest.
    pub kinematic: bool,
    /// Whether the step begins with the [impulses](crate::Collisions::impulses) that come with the
    /// collisions, in place of none: piles and towers then need fewer passes. Each kind of pass
    /// with iterations takes one more pass in front of the others, which applies the impulses.
    pub warm_start: bool,
    /// Whether the impulses of the step come out
    /// ([`Accelerator::impulses`](crate::Accelerator::impulses)), for the next step's warm start,
    /// for sounds or for damage. They cost no pass.
    pub impulses_out: bool,
    /// Order in which the collisions are sent; `None` is the cheapest order on the board at hand:
    ///
    /// | the pipeline | order |
    /// |---|---|
    /// | has an issue queue | [`Order::Interleaved`] |
    /// | waits on hazards | [`Order::HazardFree`] without its empty entries, unless [`Order::AsGiven`] takes fewer cycles |
    /// | does not wait | [`Order::HazardFree`] |
    ///
    /// [`StepReport::order_choice`](crate::StepReport::order_choice) has the figures of the
    /// comparison.
    ///
    /// A pipeline that waits solves the collisions one after the other in the order sent; a hazard
    /// costs it cycles. An issue queue lets a collision that is free go first. Another order is
    /// another valid solution: to compare with a sequential solver choose [`Order::AsGiven`], which
    /// passes by the queue.
    ///
    /// A pipeline that does not wait reads stale velocities at every hazard and loses impulses:
    /// with any order that has hazards piles gain energy.
    pub order: Option<Order>,
    /// Whether to verify, before anything is sent, that no moving body recurs within the hazard
    /// window; a step with a hazard is refused. Without a choice of order, a pipeline that waits
    /// then receives [`Order::HazardFree`] with its empty entries, which can be verified. For
    /// debugging: it takes host time, and memory anew in every step.
    pub verify_order: bool,
    /// Time limit of a step on the accelerator. `None` derives it from the work, as the sum of
    /// three terms: four times the time in which every collision waits for the one before it, the
    /// time of its bytes at 100 MB/s, and 10 ms.
    pub deadline: Option<Duration>,
    /// Number of repetitions of a step that failed, each after a reset that made the board ready.
    /// The deadline holds for each attempt. The driver repeats no step whose failure is not the
    /// board's: refused input, results that are not finite, too little memory; and no step that was
    /// [cancelled](crate::Cancellation).
    pub retries: u32,
}

impl Default for StepParameters {
    fn default() -> Self {
        Self {
            time_step: const { 1.0 / 60.0 },
            position_drift: 0.005,
            position_coefficient: 0.2,
            friction: 0.7,
            pair_friction: false,
            angular_damping: 0.99,
            spin_damping: 0.0,
            gravity: [0.0, -9.8, 0.0],
            contact_iterations: 4,
            friction_iterations: 4,
            integrate: true,
            kinematic: false,
            warm_start: false,
            impulses_out: false,
            order: None,
            verify_order: false,
            deadline: None,
            retries: 0,
        }
    }
}

/// Setters that can be chained, for a value without a name:
///
/// ```
/// use zynq_pgs::StepParameters;
///
/// let parameters = StepParameters::default().with_time_step(1.0 / 120.0).with_friction(0.5);
/// assert_eq!(parameters.contact_iterations, 4, "the others stay");
/// ```
impl StepParameters {
    /// The parameters of the thesis, which has them from Bullet's pipeline for graphics cards: the
    /// default, with a spin damping of 10 %.
    #[must_use]
    pub fn thesis() -> Self {
        Self { spin_damping: solver::SPIN_DAMPING, ..Self::default() }
    }

    /// Sets the [time step](Self::time_step), s.
    #[must_use]
    pub const fn with_time_step(self, time_step: f32) -> Self {
        Self { time_step, ..self }
    }

    /// Sets the penetration that the solver leaves alone ([`Self::position_drift`]), m.
    #[must_use]
    pub const fn with_position_drift(self, position_drift: f32) -> Self {
        Self { position_drift, ..self }
    }

    /// Sets the share of the penetration that a step removes ([`Self::position_coefficient`]), from
    /// 0 to 1; the time step in seconds, where distances are
    /// [velocities](Self#a-distance-as-a-velocity).
    #[must_use]
    pub const fn with_position_coefficient(self, position_coefficient: f32) -> Self {
        Self { position_coefficient, ..self }
    }

    /// Sets the [friction coefficient](Self::friction) of every contact; it has no unit.
    #[must_use]
    pub const fn with_friction(self, friction: f32) -> Self {
        Self { friction, ..self }
    }

    /// Sets whether each collision has a friction of its own ([`Self::pair_friction`]).
    #[must_use]
    pub const fn with_pair_friction(self, pair_friction: bool) -> Self {
        Self { pair_friction, ..self }
    }

    /// Sets the share of the angular velocity that a step leaves ([`Self::angular_damping`]), from
    /// 0 to 1.
    #[must_use]
    pub const fn with_angular_damping(self, angular_damping: f32) -> Self {
        Self { angular_damping, ..self }
    }

    /// Sets the share of the spin that a friction pass takes away ([`Self::spin_damping`]), from 0
    /// to 1.
    #[must_use]
    pub const fn with_spin_damping(self, spin_damping: f32) -> Self {
        Self { spin_damping, ..self }
    }

    /// Sets the [gravity](Self::gravity), m/s², world frame.
    #[must_use]
    pub const fn with_gravity(self, gravity: [f32; 3]) -> Self {
        Self { gravity, ..self }
    }

    /// Sets the number of passes of the [contact solver](Self::contact_iterations).
    #[must_use]
    pub const fn with_contact_iterations(self, contact_iterations: u32) -> Self {
        Self { contact_iterations, ..self }
    }

    /// Sets the number of passes of the [friction solver](Self::friction_iterations).
    #[must_use]
    pub const fn with_friction_iterations(self, friction_iterations: u32) -> Self {
        Self { friction_iterations, ..self }
    }

    /// Sets whether the step [integrates](Self::integrate) after the solver.
    #[must_use]
    pub const fn with_integrate(self, integrate: bool) -> Self {
        Self { integrate, ..self }
    }

    /// Sets whether static bodies [may move](Self::kinematic).
    #[must_use]
    pub const fn with_kinematic(self, kinematic: bool) -> Self {
        Self { kinematic, ..self }
    }

    /// Sets whether the step begins with [impulses](Self::warm_start).
    #[must_use]
    pub const fn with_warm_start(self, warm_start: bool) -> Self {
        Self { warm_start, ..self }
    }

    /// Sets whether the [impulses come out](Self::impulses_out).
    #[must_use]
    pub const fn with_impulses_out(self, impulses_out: bool) -> Self {
        Self { impulses_out, ..self }
    }

    /// Sets the [order](Self::order) of the collisions; `None` is the cheapest on the board at
    /// hand.
    #[must_use]
    pub fn with_order(self, order: impl Into<Option<Order>>) -> Self {
        Self { order: order.into(), ..self }
    }

    /// Sets whether the driver [verifies the order](Self::verify_order) before it sends anything.
    #[must_use]
    pub const fn with_verify_order(self, verify_order: bool) -> Self {
        Self { verify_order, ..self }
    }

    /// Sets the [time limit](Self::deadline) of the step on the accelerator; `None` derives it from
    /// the work.
    #[must_use]
    pub fn with_deadline(self, deadline: impl Into<Option<Duration>>) -> Self {
        Self { deadline: deadline.into(), ..self }
    }

    /// Sets the number of [repetitions](Self::retries) of a step that failed.
    #[must_use]
    pub const fn with_retries(self, retries: u32) -> Self {
        Self { retries, ..self }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_setter_sets_its_own_field_and_no_other() {
        let set = StepParameters::default()
            .with_time_step(0.5)
            .with_position_drift(0.25)
            .with_position_coefficient(0.125)
            .with_friction(0.75)
            .with_pair_friction(true)
            .with_spin_damping(0.0)
            .with_kinematic(true)
            .with_warm_start(true)
            .with_impulses_out(true)
            .with_angular_damping(0.5)
            .with_gravity([1.0, 2.0, 3.0])
            .with_contact_iterations(5)
            .with_friction_iterations(6)
            .with_integrate(false)
            .with_order(Order::AsGiven)
            .with_verify_order(true)
            .with_deadline(Duration::from_secs(7))
            .with_retries(8);
        let fields = StepParameters {
            time_step: 0.5,
            position_drift: 0.25,
            position_coefficient: 0.125,
            friction: 0.75,
            pair_friction: true,
            angular_damping: 0.5,
            spin_damping: 0.0,
            kinematic: true,
            warm_start: true,
            impulses_out: true,
            gravity: [1.0, 2.0, 3.0],
            contact_iterations: 5,
            friction_iterations: 6,
            integrate: false,
            order: Some(Order::AsGiven),
            verify_order: true,
            deadline: Some(Duration::from_secs(7)),
            retries: 8,
        };
        assert_eq!(set, fields);
        let unset = set.with_order(None).with_deadline(None);
        assert_eq!(unset, StepParameters { order: None, deadline: None, ..fields });
    }
}
