//! Makes small scenes and parameters for the driver: mostly valid, sometimes invalid ones.

use zynq_pgs::interface::profile::Variant;
use zynq_pgs::order::Order;
use zynq_pgs::scene::CONTACT_POINTS;
use zynq_pgs::{
    Body, Collision, Contact, Impulses, Pose, Shape, StepParameters, Velocity, WarmCollisions,
};

use crate::input::Input;

/// The input of a step.
#[derive(Debug, Clone, Default)]
pub(super) struct Scene {
    pub(super) shapes: Vec<Shape>,
    pub(super) bodies: Vec<Body>,
    pub(super) collisions: Vec<Collision>,
    /// One for each collision.
    pub(super) impulses: Vec<Impulses>,
}

/// Whether a scene may hold invalid values.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum InvalidValues {
    Never,
    /// Sometimes.
    Sometimes,
}

/// No turn, a third of a turn, and a quarter.
const ORIENTATIONS: [[f32; 4]; 3] =
    [[0.0, 0.0, 0.0, 1.0], [0.5, 0.5, 0.5, 0.5], [0.0, 0.6, 0.0, 0.8]];
const NORMALS: [[f32; 3]; 4] =
    [[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.6, -0.8], [0.0, 0.0, 1.0]];

impl Scene {
    /// A scene of at most `bodies` bodies and `collisions` collisions.
    pub(super) fn any(
        input: &mut Input<'_>,
        bodies: u32,
        collisions: u32,
        invalid: InvalidValues,
    ) -> Self {
        let mut shapes = vec![Shape::STATIC];
        for _ in 0..=input.below(3) {
            let inertia = input.pick(&[1.5, 0.5, 3.0]);
            let mut shape = Shape::isotropic(input.pick(&[1.0, 0.5, 4.0]), inertia);
            if invalid == InvalidValues::Sometimes && input.one_in(16) {
                shape.inverse_inertia[1] *= 2.0;
            }
            shapes.push(shape);
        }
        let wild = |input: &mut Input<'_>| invalid == InvalidValues::Sometimes && input.one_in(200);
        let bodies: Vec<Body> =
            (0..input.below(bodies + 1)).map(|k| body(input, k, &shapes, wild)).collect();
        let count = u32::try_from(bodies.len()).expect("a few");
        let moves = |body: u32| bodies[body as usize].shape != 0;
        let mut pairs = Vec::new();
        if count > 1 {
            for _ in 0..input.below(collisions + 1) {
                let a = input.below(count);
                let b = (a + 1 + input.below(count - 1)) % count;
                if moves(a) || moves(b) || wild(input) {
                    pairs.push([a, b]);
                }
            }
        }
        let collisions: Vec<Collision> =
            pairs.into_iter().map(|pair| collision(input, pair, &bodies, wild)).collect();
        let impulses = vec![Impulses::ZERO; collisions.len()];
        Self { shapes, bodies, collisions, impulses }
    }

    /// Sometimes has more shapes than the table of a board that can stream masses, and bodies of
    /// the last ones.
    pub(super) fn outgrow(&mut self, input: &mut Input<'_>, variant: &Variant) {
        if !variant.has_streamed_masses() || !input.one_in(4) {
            return;
        }
        let own = u32::try_from(self.shapes.len()).expect("a few");
        self.shapes.extend((own..70).map(|number| Shape::isotropic(1.0 + number as f32, 1.5)));
        for body in self.bodies.iter_mut().filter(|body| (1..own).contains(&body.shape)) {
            if input.one_in(2) {
                body.shape = 64 + input.below(6);
            }
        }
    }

    /// The collisions, with the impulses that they begin with.
    pub(super) fn given(&self) -> WarmCollisions<'_, [Collision]> {
        WarmCollisions { collisions: &self.collisions, impulses: &self.impulses }
    }

    /// Gives the scene what only a step with these parameters takes: velocities of static bodies,
    /// frictions of pairs, impulses to begin with.
    pub(super) fn suit(
        &mut self,
        input: &mut Input<'_>,
        parameters: &StepParameters,
        invalid: InvalidValues,
    ) {
        for body in self.bodies.iter_mut().filter(|body| body.shape == 0) {
            body.velocity = Velocity::default();
            if parameters.kinematic && input.one_in(2) {
                body.velocity =
                    Velocity { linear: vector(input, 2.0), angular: vector(input, 1.0) };
            }
        }
        for collision in self.collisions.iter_mut().filter(|of| (1..=4).contains(&of.points())) {
            collision.count = collision.points();
            if parameters.pair_friction {
                let wild = invalid == InvalidValues::Sometimes && input.one_in(200);
                let friction = if wild { f32::from_bits(input.word()) } else { 0.25 };
                *collision = collision.with_friction(friction * f32::from(input.byte() % 8));
            }
        }
        self.impulses.resize(self.collisions.len(), Impulses::ZERO);
        if parameters.warm_start {
            for impulses in &mut self.impulses {
                let [x, y, z] = vector(input, 0.25);
                *impulses = Impulses { normal: [x.abs(), y.abs(), z, 0.0], friction: [y, z] };
                if invalid == InvalidValues::Sometimes && input.one_in(200) {
                    impulses.normal[input.index(CONTACT_POINTS)] = f32::from_bits(input.word());
                }
            }
        }
    }
}

fn vector(input: &mut Input<'_>, scale: f32) -> [f32; 3] {
    // Exact in sixteen bits, if `scale` is a power of two.
    [(); 3].map(|()| f32::from(input.byte().cast_signed()) / 128.0 * scale)
}

fn body(
    input: &mut Input<'_>,
    index: u32,
    shapes: &[Shape],
    wild: impl Fn(&mut Input<'_>) -> bool,
) -> Body {
    // The first body is mostly the ground.
    let shape = match index {
        0 if !input.one_in(4) => 0,
        _ => 1 + input.below(u32::try_from(shapes.len()).expect("a few") - 1),
    };
    let pose = Pose { position: vector(input, 4.0), orientation: input.pick(&ORIENTATIONS) };
    let velocity = match shape {
        0 => Velocity::default(),
        _ => Velocity { linear: vector(input, 2.0), angular: vector(input, 1.0) },
    };
    let mut body = Body { pose, velocity, shape };
    if wild(input) {
        let value = f32::from_bits(input.word());
        match input.below(5) {
            0 => body.pose.position[1] = value,
            1 => body.pose.orientation[3] = value,
            2 => body.velocity.linear[0] = value,
            3 => body.velocity.angular[2] = value,
            _ => body.shape = input.word(),
        }
    }
    body
}

fn collision(
    input: &mut Input<'_>,
    [body_a, body_b]: [u32; 2],
    bodies: &[Body],
    wild: impl Fn(&mut Input<'_>) -> bool,
) -> Collision {
    let at = bodies[body_b as usize].pose.position;
    let [x, y, z] = vector(input, 1.0);
    let distance = f32::from(input.byte().cast_signed()) / 2048.0;
    let contact = |k: u8| Contact {
        point: [at[0] + x, at[1] + y + f32::from(k) / 16.0, at[2] + z],
        distance,
    };
    let mut collision = Collision {
        body_a,
        body_b,
        normal: input.pick(&NORMALS),
        count: 1 + input.below(4),
        contacts: [0, 1, 2, 3].map(contact),
    };
    if input.one_in(16) {
        // Nothing else of an empty collision matters.
        let normal = [(); 3].map(|()| f32::from_bits(input.word()));
        let [body_a, body_b] =
            [body_a, body_b].map(|body| if input.one_in(2) { body } else { input.telling_word() });
        return Collision { body_a, body_b, normal, count: 0, ..collision };
    }
    if wild(input) {
        match input.below(5) {
            0 => collision.body_a = input.telling_word(),
            1 => collision.body_b = body_a,
            2 => collision.count = input.telling_word(),
            3 => collision.normal[0] = f32::from_bits(input.word()),
            _ => {
                collision.contacts[input.index(CONTACT_POINTS)].distance =
                    f32::from_bits(input.word());
            }
        }
    }
    collision
}

/// Parameters; at most `passes` iterations of each solver. They ask for what the records of the
/// board hold; where values may be invalid, also for the rest.
pub(super) fn parameters(
    input: &mut Input<'_>,
    passes: u32,
    invalid: InvalidValues,
    variant: &Variant,
) -> StepParameters {
    let mut parameters = StepParameters::default();
    parameters.time_step = input.pick(&[1.0 / 60.0, 1.0 / 240.0, 0.125]);
    parameters.contact_iterations = input.below(passes + 1);
    parameters.friction_iterations = input.below(passes + 1);
    let switches = input.byte();
    if switches & 1 == 1 {
        parameters.integrate = false;
    }
    if switches & 2 == 2 {
        parameters.friction = input.pick(&[0.0, 0.25, 1.0]);
        parameters.position_coefficient = input.pick(&[0.0, 0.5, 1.0]);
        parameters.gravity = vector(input, 8.0);
    }
    if switches & 16 == 16 {
        parameters.spin_damping = input.pick(&[0.0, 0.5, 1.0]);
    }
    let all = invalid == InvalidValues::Sometimes && input.one_in(64);
    if switches & 96 == 96 {
        let wanted = input.byte();
        parameters.kinematic = wanted & 1 == 1;
        parameters.pair_friction = (all || variant.has_pair_friction()) && wanted & 2 == 2;
        parameters.warm_start = wanted & 4 == 4;
        parameters.impulses_out = wanted & 8 == 8;
    }
    if switches & 12 == 12 {
        let orders = [Order::AsGiven, Order::HazardFree, Order::Interleaved];
        parameters.order = Some(input.pick(&orders));
    }
    if invalid == InvalidValues::Sometimes && input.one_in(100) {
        let value = f32::from_bits(input.word());
        match input.below(5) {
            0 => parameters.time_step = value,
            1 => parameters.friction = value,
            2 => parameters.angular_damping = value,
            3 => parameters.gravity[2] = value,
            _ => parameters.verify_order = true,
        }
    }
    parameters
}

/// The bits of all numbers of the bodies.
pub(super) fn bits(bodies: &[Body]) -> Vec<u32> {
    let mut bits = Vec::with_capacity(14 * bodies.len());
    for Body { pose, velocity, shape } in bodies {
        let numbers = pose.position.iter().chain(&pose.orientation);
        let numbers = numbers.chain(&velocity.linear).chain(&velocity.angular);
        bits.extend(numbers.map(|number| number.to_bits()));
        bits.push(*shape);
    }
    bits
}
