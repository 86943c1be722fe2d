//! A step as words, as an accelerator of profile `float` takes it; nothing in it need make sense.

use pgs_interface::profile::Inertia;
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
    /// Time step, drift, position coefficient, friction, angular damping, spin damping, as bits of
    /// f32.
    pub numbers: [u32; 6],
    /// Gravity.
    pub gravity: [u32; 3],
}

/// A whole step.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Scene {
    /// The form of inertia of the accelerator that takes it.
    pub inertia: Inertia,
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

    /// Beats of impulses in front of the results.
    #[must_use]
    pub fn impulse_beats(&self) -> usize {
        let kinds = self.passes().into_iter().filter(|passes| *passes > 0).count();
        if self.arguments.impulses_out { kinds * self.collisions.len() } else { 0 }
    }
}
