//! The reference solver on plain data: a step of the specification (§7) without streams, registers
//! or a clock, in the arithmetic of either precision.

use crate::accelerator::arithmetic::inertia::Isotropic;
use crate::accelerator::arithmetic::number::{Format, Half, Number, Single};
use crate::accelerator::integrate::{Integration, integrate};
use crate::accelerator::records::decode;
use crate::accelerator::solver::{self, Impulses, Mass, SolverParameters};
use crate::accelerator::state::{Pose, Velocity};
use pgs_interface::number::Precision;
use pgs_interface::record::CONTACT_POINTS;

/// A body with one moment of inertia about every axis.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Body {
    /// Inverse mass, 1/kg; 0 is static.
    pub inverse_mass: f32,
    /// Inverse moment of inertia, 1/(kg m²).
    pub inverse_inertia: f32,
    /// Position, m.
    pub position: [f32; 3],
    /// Orientation: x, y, z, w.
    pub orientation: [f32; 4],
    /// Linear velocity, m/s.
    pub linear: [f32; 3],
    /// Angular velocity, rad/s.
    pub angular: [f32; 3],
}

/// A collision of two bodies. At least one body moves.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Collision {
    /// Indices of bodies A and B.
    pub bodies: [usize; 2],
    /// Unit normal from B to A.
    pub normal: [f32; 3],
    /// x, y, z of each contact point, and its distance, m.
    pub contacts: [[f32; 4]; CONTACT_POINTS],
    /// Number of contact points.
    pub count: usize,
}

/// The arguments of a step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Parameters {
    /// Contact passes.
    pub contact_iterations: u32,
    /// Friction passes.
    pub friction_iterations: u32,
    /// Time step, s.
    pub time_step: f32,
    /// Position drift, m.
    pub position_drift: f32,
    /// Position coefficient.
    pub position_coefficient: f32,
    /// Friction coefficient.
    pub friction: f32,
    /// Share of the spin that a friction pass takes away.
    pub spin_damping: f32,
    /// Share of the angular velocity that is left after the step.
    pub angular_damping: f32,
    /// Gravity, m/s².
    pub gravity: [f32; 3],
}

/// Takes a step; the collisions are solved in their order.
///
/// # Panics
/// A collision names a body that is not there, or more than four contact points.
pub fn step(
    precision: Precision,
    bodies: &mut [Body],
    collisions: &[Collision],
    parameters: &Parameters,
) {
    match precision {
        Precision::F32 => step_in::<Single>(bodies, collisions, parameters),
        Precision::Binary16 => step_in::<Half>(bodies, collisions, parameters),
    }
}

fn rounded<F: Format, const N: usize>(numbers: [f32; N]) -> [f32; N] {
    numbers.map(|number| Number::<F>::new(number).value())
}

fn stored<F: Format>(Velocity { linear, angular }: Velocity) -> Velocity {
    Velocity { linear: rounded::<F, 3>(linear), angular: rounded::<F, 3>(angular) }
}

fn step_in<F: Format>(bodies: &mut [Body], collisions: &[Collision], parameters: &Parameters) {
    let solver = SolverParameters {
        time_step: parameters.time_step,
        drift: parameters.position_drift,
        coefficient: parameters.position_coefficient,
        friction: parameters.friction,
        spin_damping: parameters.spin_damping,
        pair_friction: false,
    };
    let integration = Integration {
        time_step: parameters.time_step,
        angular_damping: parameters.angular_damping,
        gravity: parameters.gravity,
    };
    let mass = |body: &Body| Mass {
        inverse_mass: body.inverse_mass,
        inverse_inertia: [body.inverse_inertia, 0.0, 0.0, 0.0, 0.0, 0.0],
    };
    let velocity = |body: &Body| match body.inverse_mass {
        0.0 => Velocity::default(),
        _ => stored::<F>(Velocity { linear: body.linear, angular: body.angular }),
    };
    let mut velocities: Vec<Velocity> = bodies.iter().map(velocity).collect();
    let mut impulses: Vec<Impulses> = vec![[0.0; CONTACT_POINTS]; collisions.len()];
    let contacts = parameters.contact_iterations;
    for pass in 0..contacts + parameters.friction_iterations {
        for (collision, impulses) in collisions.iter().zip(&mut impulses) {
            if collision.count == 0 {
                continue;
            }
            let sides = collision.bodies;
            let [a, b] = sides.map(|side| &bodies[side]);
            let record = decode::Collision {
                body_a: 0,
                body_b: 1,
                count: collision.count,
                friction: 0.0,
                normal: collision.normal,
                position_a: a.position,
                position_b: b.position,
                contacts: collision.contacts,
                impulses: [0.0; CONTACT_POINTS],
            };
            let masses = [mass(a), mass(b)];
            let mut pair = sides.map(|side| velocities[side]);
            if pass == contacts {
                let sum = solver::normal_sum::<F>(impulses);
                *impulses = rounded::<F, CONTACT_POINTS>([sum, 0.0, 0.0, 0.0]);
            }
            let solve = match pass < contacts {
                true => solver::contact::<F, F, Isotropic>,
                false => solver::friction::<F, F, Isotropic>,
            };
            solve(&record, &solver, &masses, &mut pair, impulses, None);
            *impulses = rounded::<F, CONTACT_POINTS>(*impulses);
            for (side, (mass, velocity)) in sides.into_iter().zip(masses.iter().zip(pair)) {
                if mass.inverse_mass != 0.0 {
                    velocities[side] = stored::<F>(velocity);
                }
            }
        }
    }
    for (body, velocity) in bodies.iter_mut().zip(&velocities) {
        if body.inverse_mass == 0.0 {
            continue;
        }
        let pose = Pose { position: body.position, orientation: body.orientation };
        let (pose, velocity) = integrate::<F>(&integration, &pose, velocity);
        (body.position, body.orientation) = (pose.position, pose.orientation);
        (body.linear, body.angular) = (velocity.linear, velocity.angular);
    }
}
