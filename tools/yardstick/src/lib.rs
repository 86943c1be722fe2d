//! The yardstick: a CPU solver for the same step, one collision after the other.
//!
//! It is sequential, in scalar f32, and written from the formulae alone: records in solving order,
//! one array of bodies, no lanes, no threads. It is meant to be as fast as such a loop can be.
//! Values that do not change during a step are computed once: effective masses, biases, the
//! directions and lever arms of friction, and whether spin is damped. Velocities, mass and inertia
//! of a body are adjacent in memory, and so is everything that a pass needs of a collision. Every
//! pass computes the moments again, because loading them takes longer.
//!
//! Its bits are Bullet's: see the tests.
//!
//! Source: `tests/golden/README.md`, the formulae that Bullet's vectors were made with.

#![allow(clippy::float_cmp, reason = "zero is exact: nothing to do, or a body that does not move")]

mod integrate;
mod passes;
mod rows;
mod vector;

use std::time::{Duration, Instant};

use zynq_pgs::{Body, Collision, Pose, Shape, StepParameters, Velocity};

use rows::{ContactRows, FrictionRows};

/// One collision as input: 112 bytes.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[repr(C)]
pub struct Record {
    normal: [f32; 3],
    count: u32,
    position_a: [f32; 3],
    body_a: u32,
    position_b: [f32; 3],
    body_b: u32,
    /// x, y, z and distance.
    points: [[f32; 4]; 4],
}

const _: () = assert!(size_of::<Record>() == 112);

impl Record {
    fn new(bodies: &[Body], collision: &Collision) -> Self {
        let position = |body: u32| bodies[index(body)].pose.position;
        Self {
            normal: collision.normal,
            count: collision.count,
            position_a: position(collision.body_a),
            body_a: collision.body_a,
            position_b: position(collision.body_b),
            body_b: collision.body_b,
            points: collision.contacts.map(|contact| {
                let [x, y, z] = contact.point;
                [x, y, z, contact.distance]
            }),
        }
    }

    /// The used points.
    #[inline]
    fn used(&self) -> &[[f32; 4]] {
        &self.points[..index(self.count).min(4)]
    }
}

/// The part of a body that a collision reads and writes.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[repr(C, align(16))]
struct Moving {
    linear: [f32; 3],
    inverse_mass: f32,
    angular: [f32; 3],
    inverse_inertia: [f32; 3],
}

/// Converts an index for memory.
#[inline]
const fn index(number: u32) -> usize {
    number as usize
}

/// The time of a step by phase.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Stages {
    /// Making constraint rows.
    pub rows: Duration,
    /// The contact passes.
    pub contact: Duration,
    /// The friction passes.
    pub friction: Duration,
    /// Moving the bodies.
    pub integration: Duration,
}

impl Stages {
    /// Both kinds of passes.
    #[must_use]
    pub fn passes(&self) -> Duration {
        self.contact + self.friction
    }

    /// The whole step.
    #[must_use]
    pub fn total(&self) -> Duration {
        self.rows + self.passes() + self.integration
    }
}

/// A solver for one step, which can be solved repeatedly.
#[derive(Debug)]
pub struct Yardstick {
    parameters: StepParameters,
    given: Vec<(Pose, Moving)>,
    shapes: Vec<u32>,
    records: Vec<Record>,
    poses: Vec<Pose>,
    bodies: Vec<Moving>,
    contacts: Vec<ContactRows>,
    frictions: Vec<FrictionRows>,
}

impl Yardstick {
    /// Takes a step whose collisions are solved in the order given.
    ///
    /// # Panics
    ///
    /// A collision names a missing body, or a body a missing shape.
    pub fn new<'a>(
        shapes: &[Shape],
        bodies: &[Body],
        collisions: impl IntoIterator<Item = &'a Collision>,
        parameters: &StepParameters,
    ) -> Self {
        let moving = |body: &Body| {
            let Shape { inverse_mass, inverse_inertia, .. } = shapes[index(body.shape)];
            let Velocity { linear, angular } = body.velocity;
            (body.pose, Moving { linear, inverse_mass, angular, inverse_inertia })
        };
        let records = collisions.into_iter().map(|collision| Record::new(bodies, collision));
        let records: Vec<Record> = records.collect();
        Self {
            parameters: *parameters,
            given: bodies.iter().map(moving).collect(),
            shapes: bodies.iter().map(|body| body.shape).collect(),
            poses: Vec::with_capacity(bodies.len()),
            bodies: Vec::with_capacity(bodies.len()),
            contacts: Vec::with_capacity(records.len()),
            frictions: Vec::with_capacity(records.len()),
            records,
        }
    }

    /// The records, in their order.
    #[must_use]
    pub fn records(&self) -> &[Record] {
        &self.records
    }

    /// Solves the step from its start; the times do not include the return to the start.
    ///
    /// Never inlined: tools that count find it by its name.
    #[inline(never)]
    pub fn solve(&mut self) -> Stages {
        self.poses.clear();
        self.poses.extend(self.given.iter().map(|(pose, _)| *pose));
        self.bodies.clear();
        self.bodies.extend(self.given.iter().map(|(_, body)| *body));
        let mut last = Instant::now();
        let mut lap = || {
            let now = Instant::now();
            now.duration_since(std::mem::replace(&mut last, now))
        };
        self.make_rows();
        let rows = lap();
        for _ in 0..self.parameters.contact_iterations {
            passes::contact(&mut self.contacts, &mut self.bodies);
        }
        let contact = lap();
        passes::limits(self.parameters.friction, &self.contacts, &mut self.frictions);
        for _ in 0..self.parameters.friction_iterations {
            passes::friction(&mut self.frictions, &mut self.bodies);
        }
        let friction = lap();
        if self.parameters.integrate {
            for (pose, body) in self.poses.iter_mut().zip(&mut self.bodies) {
                if body.inverse_mass != 0.0 {
                    integrate::integrate(&self.parameters, pose, body);
                }
            }
        }
        Stages { rows, contact, friction, integration: lap() }
    }

    #[inline(never)]
    fn make_rows(&mut self) {
        let StepParameters { position_drift, position_coefficient, time_step, .. } =
            self.parameters;
        let pair =
            |record: &Record| [record.body_a, record.body_b].map(|body| &self.bodies[index(body)]);
        let per_second = 1.0 / time_step;
        self.contacts.clear();
        self.contacts.extend(self.records.iter().map(|record| {
            let pair = pair(record);
            ContactRows::new(record, pair, position_drift, position_coefficient, per_second)
        }));
        self.frictions.clear();
        self.frictions
            .extend(self.records.iter().map(|record| FrictionRows::new(record, pair(record))));
    }

    /// The bodies after the last [`solve`](Self::solve); none before the first.
    #[must_use]
    pub fn bodies(&self) -> Vec<Body> {
        let states = self.poses.iter().zip(&self.bodies).zip(&self.shapes);
        states
            .map(|((pose, body), shape)| Body {
                pose: *pose,
                velocity: Velocity { linear: body.linear, angular: body.angular },
                shape: *shape,
            })
            .collect()
    }
}
