//! A step as words, as an accelerator takes it; nothing in it need make sense. Numbers are f32: the
//! packets of another format round them.

use pgs_interface::control::NUMBERS_PER_BEAT;
use pgs_interface::profile::{Inertia, Variant};
use pgs_interface::record::CONTACT_POINTS;

/// An entry of the shape table, as bits of f32.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Shape {
    /// Inverse mass.
    pub inverse_mass: u32,
    /// Isotropic inverse inertia.
    pub inverse_inertia: u32,
}

/// A body.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Body {
    /// Linear velocity, as bits of f32.
    pub linear: [u32; 3],
    /// Angular velocity.
    pub angular: [u32; 3],
    /// Position.
    pub position: [u32; 3],
    /// Orientation.
    pub orientation: [u32; 4],
    /// Index of its shape.
    pub shape: u32,
    /// Inverse inertia about world axes: xx, yy, zz, xy, xz, yz. On the streams with world inertia
    /// alone, as the mass.
    pub inverse_inertia: [u32; 6],
    /// The mass that it brings; means nothing in a step without streamed masses.
    pub inverse_mass: u32,
}

/// A collision.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Collision {
    /// Indices of bodies A and B.
    pub bodies: [u32; 2],
    /// Positions of bodies A and B, as bits of f32.
    pub positions: [[u32; 3]; 2],
    /// Normal from B to A.
    pub normal: [u32; 3],
    /// Number of contact points; 0 is padding.
    pub count: u32,
    /// Points and distances; the slots from `count` on mean nothing.
    pub points: [[u32; 4]; CONTACT_POINTS],
    /// The impulses to begin with in a step that starts warm: of contact, and of friction.
    pub impulses: [[u32; 4]; 2],
}

/// The arguments of a step but for the numbers of bodies and collisions.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Arguments {
    /// Contact passes.
    pub contact_iterations: u32,
    /// Friction passes.
    pub friction_iterations: u32,
    /// Whether the bodies are integrated.
    pub integrate: bool,
    /// Whether bodies without a mass move.
    pub kinematic: bool,
    /// Whether a friction is above each contact count.
    pub pair_friction: bool,
    /// Whether each kind of pass begins with given impulses.
    pub warm_start: bool,
    /// Whether the impulses go out.
    pub impulses_out: bool,
    /// Whether each body brings its mass: with world inertia alone.
    pub streamed_masses: bool,
    /// Whether collisions enter in the order of the stream, past the issue queue.
    pub in_order: bool,
    /// Time step, drift, position coefficient, friction, angular damping, spin damping, as bits of
    /// f32.
    pub numbers: [u32; 6],
    /// Gravity.
    pub gravity: [u32; 3],
}

/// A whole step.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Scene {
    /// The accelerator that takes it.
    pub variant: Variant,
    /// The shape table.
    pub shapes: Vec<Shape>,
    /// All bodies.
    pub bodies: Vec<Body>,
    /// All collisions.
    pub collisions: Vec<Collision>,
    /// The rest.
    pub arguments: Arguments,
}

impl Scene {
    /// Bodies in a row, the last one static, with a collision of each of these pairs.
    #[must_use]
    pub fn row(variant: Variant, bodies: u16, pairs: impl IntoIterator<Item = [u32; 2]>) -> Self {
        let one = 1.0_f32.to_bits();
        let moves = Shape { inverse_mass: one, inverse_inertia: one };
        let fixed = Shape { inverse_mass: 0, inverse_inertia: 0 };
        let body = |index: u16| Body {
            linear: [0; 3],
            angular: [0; 3],
            position: [f32::from(index).to_bits(), 0, 0],
            orientation: [0, 0, 0, one],
            shape: u32::from(index + 1 == bodies),
            inverse_inertia: [one, one, one, 0, 0, 0],
            inverse_mass: one,
        };
        let bodies: Vec<Body> = (0..bodies).map(body).collect();
        let collisions = pairs.into_iter().map(|sides| Collision {
            bodies: sides,
            positions: sides.map(|side| bodies[side as usize].position),
            normal: [one, 0, 0],
            count: 1,
            points: [[0; 4]; CONTACT_POINTS],
            impulses: [[one, 0, 0, 0]; 2],
        });
        let arguments = Arguments {
            contact_iterations: 2,
            friction_iterations: 2,
            integrate: true,
            kinematic: false,
            pair_friction: false,
            warm_start: false,
            impulses_out: true,
            streamed_masses: false,
            in_order: false,
            numbers: [1.0_f32 / 60.0, 0.0, 0.2, 0.5, 0.9, 0.1].map(f32::to_bits),
            gravity: [0, (-9.8_f32).to_bits(), 0],
        };
        Self {
            variant,
            shapes: vec![moves, fixed],
            collisions: collisions.collect(),
            bodies,
            arguments,
        }
    }

    /// Whether velocity records bring the inertia of their bodies.
    #[must_use]
    pub fn has_world_inertia(&self) -> bool {
        self.variant.inertia == Inertia::World
    }

    /// Contact passes and friction passes, the warm ones among them.
    #[must_use]
    pub fn passes(&self) -> [u32; 2] {
        let Arguments { contact_iterations, friction_iterations, warm_start, .. } = self.arguments;
        [contact_iterations, friction_iterations].map(|iterations| match iterations {
            0 => 0,
            _ if self.collisions.is_empty() => 0,
            _ => iterations + u32::from(warm_start),
        })
    }

    /// Beats of impulses in front of the results, with the beats of numbers among them if the
    /// accelerator has a queue.
    #[must_use]
    pub fn impulse_beats(&self, has_queue: bool) -> usize {
        let kinds = self.passes().into_iter().filter(|passes| *passes > 0).count();
        let impulses = self.collisions.len();
        let queued = has_queue && !self.arguments.in_order;
        let numbers = if queued { impulses.div_ceil(NUMBERS_PER_BEAT as usize) } else { 0 };
        if self.arguments.impulses_out { kinds * (impulses + numbers) } else { 0 }
    }
}
