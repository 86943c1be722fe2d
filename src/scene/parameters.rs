//! This file holds the parameters of a step.

use std::time::Duration;

use crate::order::Order;

/// Parameters of a step. The default is Bullet's.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct StepParameters {
    /// Time step, s.
    pub time_step: f32,
    /// Penetration that is left alone, m (Bullet: position drift).
    pub position_drift: f32,
    /// Share of the penetration that a step takes away (Bullet: position coefficient).
    pub position_coefficient: f32,
    /// Friction coefficient of every contact.
    pub friction: f32,
    /// What is left of the angular velocity after a step.
    pub angular_damping: f32,
    /// Gravity, m/s².
    pub gravity: [f32; 3],
    /// Passes of the contact solver over all collisions.
    pub contact_iterations: u32,
    /// Passes of the friction solver over all collisions.
    pub friction_iterations: u32,
    /// Whether to integrate after the solver. Without it the poses come back unchanged, with the
    /// velocities that the solver left (undamped, without gravity).
    pub integrate: bool,
    /// Order in which the collisions are sent. `None` is [`Order::HazardFreeNearby`] on a pipeline that
    /// does not wait for velocities, [`Order::HazardFree`] on a design that keeps only live bodies, and
    /// [`Order::AsGiven`] on one that waits.
    ///
    /// A pipeline that waits gives what solving the collisions one after the other in this order
    /// gives; orders with hazards cost it cycles. One that does not wait reads stale velocities at
    /// every hazard and loses impulses: with any other order than the hazard-free ones piles gain
    /// energy. One that keeps only live bodies also refuses an order in which a body lives too long,
    /// or too many live at once, as they do where collisions are sorted by body.
    pub order: Option<Order>,
    /// Whether to prove, before anything is sent, that no moving body recurs within the hazard
    /// window; the step is refused otherwise. For debugging: it takes host time, and memory anew in
    /// every step.
    pub verify_order: bool,
    /// How long a step may take on the accelerator; `None` follows from the work: four times what
    /// it takes if every collision waits for the one before it, what its bytes take at 100 MB/s,
    /// and 10 ms.
    pub deadline: Option<Duration>,
    /// How often a step that failed is taken again, after a reset that made the board ready. Each
    /// attempt may take as long as the deadline says. What the board cannot be blamed for is not
    /// tried again: refused input, results that are not finite, too little memory; nor is what was
    /// [cancelled](crate::Cancellation).
    pub retries: u32,
}

impl StepParameters {
    /// Passes over the collisions, of both kinds.
    pub(crate) const fn passes(&self) -> u64 {
        self.contact_iterations as u64 + self.friction_iterations as u64
    }
}

impl Default for StepParameters {
    fn default() -> Self {
        Self {
            time_step: const { 1.0 / 60.0 },
            position_drift: 0.005,
            position_coefficient: 0.2,
            friction: 0.7,
            angular_damping: 0.99,
            gravity: [0.0, -9.8, 0.0],
            contact_iterations: 4,
            friction_iterations: 4,
            integrate: true,
            order: None,
            verify_order: false,
            deadline: None,
            retries: 0,
        }
    }
}
