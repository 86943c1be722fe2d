//! Makes scenes of bodies of several shapes that collide at random.

use super::at_rest;
use super::direct::{Vec3, add, dot, unit};
use pgs_support::random::SplitMix64;
use zynq_pgs::{Body, Collision, Contact, Pose, Shape, Velocity};

/// Numbers that follow no pattern.
struct Random(SplitMix64);

impl Random {
    fn word(&mut self) -> u32 {
        self.0.word() >> 8
    }

    fn below(&mut self, limit: u32) -> u32 {
        self.word() % limit
    }

    #[expect(clippy::cast_precision_loss, reason = "24 bits")]
    fn within(&mut self, low: f32, high: f32) -> f32 {
        low + (high - low) * (self.word() as f32 / 16_777_216.0)
    }

    fn vector(&mut self, size: f32) -> Vec3 {
        [(); 3].map(|()| self.within(-size, size))
    }

    /// A vector that is long enough to be normalised.
    fn direction(&mut self) -> Vec3 {
        loop {
            let vector = self.vector(1.0);
            if dot(vector, vector) > 0.1 {
                return unit(vector);
            }
        }
    }
}

pub(crate) const BODIES: u32 = 60;
const COLLISIONS: usize = 220;

/// A cube, a box, a ball, a capsule.
pub(crate) fn shapes() -> [Shape; 5] {
    let made = |shape: Result<Shape, _>| shape.expect("sizes above 0");
    [
        Shape::STATIC,
        made(Shape::cuboid(1.0, [1.0; 3])),
        made(Shape::cuboid(2.0, [1.5, 0.5, 0.75])),
        made(Shape::sphere(0.5, 0.8)),
        made(Shape::capsule(1.5, 1.0, 0.4)),
    ]
}

/// The shapes with the same inertia about every axis.
pub(crate) fn round_shapes() -> [Shape; 5] {
    shapes().map(|shape| Shape::isotropic(shape.inverse_mass, shape.inverse_inertia[0]))
}

pub(crate) fn scene(seed: u64) -> (Vec<Body>, Vec<Collision>) {
    let mut random = Random(SplitMix64::new(seed));
    let mut bodies = vec![at_rest([0.0, -50.0, 0.0], 0)];
    for index in 1..BODIES {
        let [x, y, z] = random.direction();
        let w = random.within(-1.0, 1.0);
        let length = (x * x + y * y + z * z + w * w).sqrt();
        bodies.push(Body {
            pose: Pose {
                position: random.vector(6.0),
                orientation: [x, y, z, w].map(|q| q / length),
            },
            velocity: Velocity { linear: random.vector(3.0), angular: random.vector(4.0) },
            shape: 1 + index % 4,
        });
    }
    let collisions = (0..COLLISIONS)
        .map(|_| {
            let body_a = random.below(BODIES);
            let mut body_b = random.below(BODIES - 1);
            body_b += u32::from(body_b >= body_a);
            let at = |index: u32| bodies[index as usize].pose.position;
            // Near the body that moves.
            let near = if body_a == 0 { at(body_b) } else { at(body_a) };
            let contacts = [(); 4].map(|()| Contact {
                point: add(near, random.vector(1.0)),
                distance: random.within(-0.05, 0.02),
            });
            let (normal, count) = (random.direction(), 1 + random.below(4));
            Collision { body_a, body_b, normal, count, contacts }
        })
        .collect();
    (bodies, collisions)
}
