//! The parameters of a step as C has them.

use std::time::Duration;

use zynq_pgs::StepParameters;
use zynq_pgs::order;

use crate::failure::Failure;

/// The order in which the board gets the collisions.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(C)]
pub enum Order {
    /// The cheapest on the board at hand.
    Automatic = 0,
    /// As the caller gives them.
    AsGiven = 1,
    /// No hazards, collisions near to their given places.
    HazardFree = 3,
    /// Far places of the list in turn, for a board with an issue queue.
    Interleaved = 8,
}

impl Order {
    const ALL: [Self; 4] = [Self::Automatic, Self::AsGiven, Self::HazardFree, Self::Interleaved];

    /// Orders that earlier headers had; their numbers are not given again.
    const REMOVED: [(u32, &str); 5] = [
        (2, "ZPGS_ORDER_HAZARD_FREE_NEARBY"),
        (4, "ZPGS_ORDER_COLOURS"),
        (5, "ZPGS_ORDER_BODY_BY_BODY_LOWEST_INDEX"),
        (6, "ZPGS_ORDER_BODY_BY_BODY_OLDEST"),
        (7, "ZPGS_ORDER_BODY_BY_BODY_NEWEST"),
    ];

    /// The order of a number of C.
    fn of(number: u32) -> Result<Self, Failure> {
        let known = Self::ALL.into_iter().find(|order| *order as u32 == number);
        let removed = || Self::REMOVED.into_iter().find(|(removed, _)| *removed == number);
        known.ok_or_else(|| {
            Failure::argument(match removed() {
                Some((2, name)) => format!(
                    "found {number} as the order: {name} is no more, give ZPGS_ORDER_HAZARD_FREE"
                ),
                Some((_, name)) => format!(
                    "found {number} as the order: {name} is no more, give the collisions in this \
                     order and ZPGS_ORDER_AS_GIVEN"
                ),
                None => format!("found {number} as the order: give a value of zpgs_order"),
            })
        })
    }

    /// The driver's order; `None` is the cheapest.
    fn driver(self) -> Option<order::Order> {
        match self {
            Self::Automatic => None,
            Self::AsGiven => Some(order::Order::AsGiven),
            Self::HazardFree => Some(order::Order::HazardFree),
            Self::Interleaved => Some(order::Order::Interleaved),
        }
    }
}

/// The parameters of a step. `zpgs_parameters_default` fills it in; the caller then changes fields.
///
/// A flag is 0 for no and 1 for yes.
#[derive(Debug, Clone, Copy, PartialEq)]
#[repr(C)]
pub struct Parameters {
    /// Size of the structure, as the caller's header has it: `zpgs_parameters_default` sets it.
    pub size: usize,
    /// Time step, s.
    pub time_step: f32,
    /// Penetration that the solver leaves alone, m.
    pub position_drift: f32,
    /// Share of the penetration that a step removes.
    pub position_coefficient: f32,
    /// Friction coefficient of every contact, unless each collision has its own.
    pub friction: f32,
    /// Share of the angular velocity that a step with integration leaves, from 0 to 1.
    pub angular_damping: f32,
    /// Share of the spin about the normal that every friction pass takes, from 0 to 1: 10 % in the
    /// thesis, 0 here.
    pub spin_damping: f32,
    /// Gravity, m/s^2, world frame; only a step with integration uses it.
    pub gravity: [f32; 3],
    /// Passes of the contact solver over all collisions.
    pub contact_iterations: u32,
    /// Passes of the friction solver over all collisions.
    pub friction_iterations: u32,
    /// Flag: each collision has a friction of its own (`zpgs_count_with_friction`).
    pub pair_friction: u32,
    /// Flag: integrate after the solver. Without it the velocities come back as the solver left
    /// them, and the poses stay.
    pub integrate: u32,
    /// Flag: static bodies may move, by the velocity that they come with.
    pub kinematic: u32,
    /// Flag: verify before anything is sent that the order has no hazards. For debugging.
    pub verify_order: u32,
    /// One of `zpgs_order`.
    pub order: u32,
    /// Time limit of a step on the board, ms; 0 derives it from the work.
    pub deadline_ms: u32,
    /// Number of repetitions of a step that failed, each after a reset. `zpgs_submit` ignores it.
    pub retries: u32,
    /// Flag: begin with the impulses of `zpgs_collisions` or `zpgs_push`, in one more pass of each
    /// kind.
    pub warm_start: u32,
    /// Flag: keep the impulses of the step for `zpgs_read_impulses`.
    pub impulses_out: u32,
}

impl Default for Parameters {
    fn default() -> Self {
        let driver = StepParameters::default();
        Self {
            size: size_of::<Self>(),
            time_step: driver.time_step,
            position_drift: driver.position_drift,
            position_coefficient: driver.position_coefficient,
            friction: driver.friction,
            angular_damping: driver.angular_damping,
            spin_damping: driver.spin_damping,
            gravity: driver.gravity,
            contact_iterations: driver.contact_iterations,
            friction_iterations: driver.friction_iterations,
            pair_friction: driver.pair_friction.into(),
            integrate: driver.integrate.into(),
            kinematic: driver.kinematic.into(),
            verify_order: driver.verify_order.into(),
            order: Order::Automatic as u32,
            deadline_ms: 0,
            retries: driver.retries,
            warm_start: driver.warm_start.into(),
            impulses_out: driver.impulses_out.into(),
        }
    }
}

impl Parameters {
    /// The parameters as the driver has them.
    pub(crate) fn driver(&self) -> Result<StepParameters, Failure> {
        let given = self;
        let order = Order::of(given.order)?;
        let deadline = Duration::from_millis(given.deadline_ms.into());
        Ok(StepParameters::default()
            .with_time_step(given.time_step)
            .with_position_drift(given.position_drift)
            .with_position_coefficient(given.position_coefficient)
            .with_friction(given.friction)
            .with_angular_damping(given.angular_damping)
            .with_spin_damping(given.spin_damping)
            .with_gravity(given.gravity)
            .with_contact_iterations(given.contact_iterations)
            .with_friction_iterations(given.friction_iterations)
            .with_pair_friction(flag("pair_friction", given.pair_friction)?)
            .with_integrate(flag("integrate", given.integrate)?)
            .with_kinematic(flag("kinematic", given.kinematic)?)
            .with_verify_order(flag("verify_order", given.verify_order)?)
            .with_order(order.driver())
            .with_deadline((given.deadline_ms > 0).then_some(deadline))
            .with_retries(given.retries)
            .with_warm_start(flag("warm_start", given.warm_start)?)
            .with_impulses_out(flag("impulses_out", given.impulses_out)?))
    }
}

/// The value of a flag.
fn flag(name: &str, value: u32) -> Result<bool, Failure> {
    match value {
        0 => Ok(false),
        1 => Ok(true),
        _ => Err(Failure::argument(format!("found {value} as the flag {name}: give 0 or 1"))),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_default_is_the_drivers() {
        assert_eq!(Parameters::default().driver(), Ok(StepParameters::default()));
    }

    #[test]
    fn every_field_reaches_the_driver() {
        let given = Parameters {
            size: size_of::<Parameters>(),
            time_step: 0.5,
            position_drift: 0.25,
            position_coefficient: 0.125,
            friction: 0.75,
            angular_damping: 0.375,
            spin_damping: 0.0,
            gravity: [1.0, 2.0, 3.0],
            contact_iterations: 5,
            friction_iterations: 6,
            pair_friction: 1,
            integrate: 0,
            kinematic: 1,
            verify_order: 1,
            order: Order::HazardFree as u32,
            deadline_ms: 7,
            retries: 8,
            warm_start: 1,
            impulses_out: 1,
        };
        let expected = StepParameters::default()
            .with_time_step(0.5)
            .with_position_drift(0.25)
            .with_position_coefficient(0.125)
            .with_friction(0.75)
            .with_angular_damping(0.375)
            .with_spin_damping(0.0)
            .with_gravity([1.0, 2.0, 3.0])
            .with_contact_iterations(5)
            .with_friction_iterations(6)
            .with_pair_friction(true)
            .with_integrate(false)
            .with_kinematic(true)
            .with_verify_order(true)
            .with_order(order::Order::HazardFree)
            .with_deadline(Duration::from_millis(7))
            .with_retries(8)
            .with_warm_start(true)
            .with_impulses_out(true);
        assert_eq!(given.driver(), Ok(expected));
    }

    #[test]
    fn an_unknown_order_or_flag_is_refused_by_name() {
        let order = Parameters { order: 9, ..Parameters::default() }.driver().expect_err("refused");
        assert!(order.text.contains("found 9 as the order"), "{}", order.text);
        for (order, name) in Order::REMOVED {
            let refused = Parameters { order, ..Parameters::default() }.driver();
            let said = refused.expect_err("removed").text;
            let instead = if order == 2 { " give ZPGS_ORDER_HAZARD_FREE" } else { "_AS_GIVEN" };
            assert!(said.contains(name) && said.ends_with(instead), "{said}");
        }
        let flag = Parameters { kinematic: 2, ..Parameters::default() }.driver();
        assert!(flag.expect_err("refused").text.contains("the flag kinematic"));
    }
}
