//! Compares a scene of several shapes, two of them anisotropic, with a direct solver that is
//! written here from the formulae alone: one collision after the other, in f32, every operation
//! rounded on its own. It shares no code with the driver or the board, and the comparison is bit
//! for bit.
//!
//! Sources: `bitstream-model/README.md`, arithmetic; Bullet's `b3Matrix3x3::setRotation` for the
//! rotation matrix.
#![cfg(feature = "emulation")]

use crate::common::{self, at_rest};
use bitstream_model::interface::profile::Inertia;
use bitstream_model::{BoardConfig, EmulatedBoard};
use zynq_pgs::order::Order;
use zynq_pgs::{Accelerator, Body, Collision, Contact, Pose, Shape, StepParameters, Velocity};

type Vec3 = [f32; 3];

fn dot(a: Vec3, b: Vec3) -> f32 {
    (a[0] * b[0] + a[1] * b[1]) + a[2] * b[2]
}

fn cross(a: Vec3, b: Vec3) -> Vec3 {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

fn add(a: Vec3, b: Vec3) -> Vec3 {
    [a[0] + b[0], a[1] + b[1], a[2] + b[2]]
}

fn sub(a: Vec3, b: Vec3) -> Vec3 {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

fn scale(a: Vec3, s: f32) -> Vec3 {
    a.map(|x| x * s)
}

fn neg(a: Vec3) -> Vec3 {
    a.map(|x| -x)
}

fn unit(a: Vec3) -> Vec3 {
    scale(a, 1.0 / dot(a, a).sqrt())
}

fn max(a: f32, b: f32) -> f32 {
    if a > b { a } else { b }
}

fn min(a: f32, b: f32) -> f32 {
    if a < b { a } else { b }
}

/// Inverse inertia about world axes: xx yy zz, xy xz yz.
#[derive(Debug, Clone, Copy)]
struct Tensor([f32; 6]);

impl Tensor {
    fn of(shape: &Shape, [x, y, z, w]: [f32; 4]) -> Self {
        let k = shape.inverse_inertia;
        if k[0].to_bits() == k[1].to_bits() && k[0].to_bits() == k[2].to_bits() {
            return Self([k[0], k[0], k[0], 0.0, 0.0, 0.0]);
        }
        let d = ((x * x + y * y) + z * z) + w * w;
        let s = 2.0 / d;
        let (xs, ys, zs) = (x * s, y * s, z * s);
        let (wx, wy, wz) = (w * xs, w * ys, w * zs);
        let (xx, xy, xz) = (x * xs, x * ys, x * zs);
        let (yy, yz, zz) = (y * ys, y * zs, z * zs);
        let m = [
            [1.0 - (yy + zz), xy - wz, xz + wy],
            [xy + wz, 1.0 - (xx + zz), yz - wx],
            [xz - wy, yz + wx, 1.0 - (xx + yy)],
        ];
        let at = |i: usize, j: usize| {
            ((m[i][0] * k[0]) * m[j][0] + (m[i][1] * k[1]) * m[j][1]) + (m[i][2] * k[2]) * m[j][2]
        };
        Self([at(0, 0), at(1, 1), at(2, 2), at(0, 1), at(0, 2), at(1, 2)])
    }

    fn times(&self, m: Vec3) -> Vec3 {
        let [xx, yy, zz, xy, xz, yz] = self.0;
        [
            (xx * m[0] + xy * m[1]) + xz * m[2],
            (xy * m[0] + yy * m[1]) + yz * m[2],
            (xz * m[0] + yz * m[1]) + zz * m[2],
        ]
    }
}

/// A body during the solve.
#[derive(Debug, Clone, Copy)]
struct Moving {
    p: Vec3,
    v: Vec3,
    w: Vec3,
    m: f32,
    k: Tensor,
}

/// A constraint row between bodies A and B along t.
struct Row {
    t: Vec3,
    arm_a: Vec3,
    arm_b: Vec3,
    j: f32,
}

impl Row {
    fn new(t: Vec3, point: Vec3, a: &Moving, b: &Moving) -> Self {
        let arm_a = cross(sub(point, a.p), t);
        let arm_b = neg(cross(sub(point, b.p), t));
        let effective = ((a.m + dot(a.k.times(arm_a), arm_a)) + b.m) + dot(b.k.times(arm_b), arm_b);
        Self { t, arm_a, arm_b, j: -1.0 / effective }
    }

    fn speed(&self, a: &Moving, b: &Moving) -> f32 {
        ((dot(self.t, a.v) + dot(self.arm_a, a.w)) + dot(neg(self.t), b.v)) + dot(self.arm_b, b.w)
    }

    fn apply(&self, a: &mut Moving, b: &mut Moving, l: f32) {
        a.v = add(a.v, scale(scale(self.t, a.m), l));
        a.w = add(a.w, scale(a.k.times(self.arm_a), l));
        b.v = add(b.v, scale(scale(neg(self.t), b.m), l));
        b.w = add(b.w, scale(b.k.times(self.arm_b), l));
    }
}

fn tangents(n: Vec3) -> [Vec3; 2] {
    let [x, y, z] = n;
    if z.abs() > std::f32::consts::FRAC_1_SQRT_2 {
        let s = y * y + z * z;
        let k = 1.0 / s.sqrt();
        let first = [0.0, -z * k, y * k];
        [first, [s * k, -x * first[2], x * first[1]]]
    } else {
        let s = x * x + y * y;
        let k = 1.0 / s.sqrt();
        let first = [-y * k, x * k, 0.0];
        [first, [-z * first[1], z * first[0], s * k]]
    }
}

/// Impulses of a collision.
#[derive(Debug, Clone, Copy, Default)]
struct Impulses {
    normal: [f32; 4],
    tangential: [f32; 2],
}

fn contact_pass(
    collision: &Collision,
    a: &mut Moving,
    b: &mut Moving,
    impulses: &mut Impulses,
    parameters: &StepParameters,
) {
    let count = collision.count as usize;
    for (contact, sum) in collision.contacts[..count].iter().zip(&mut impulses.normal) {
        let row = Row::new(collision.normal, contact.point, a, b);
        if row.j == 0.0 {
            continue;
        }
        let depth = contact.distance + parameters.position_drift;
        let bias = (depth * parameters.position_coefficient) * (1.0 / parameters.time_step);
        let l = (row.speed(a, b) + bias) * row.j;
        let u = max(*sum + l, 0.0);
        let l = u - *sum;
        *sum = u;
        row.apply(a, b, l);
    }
}

fn friction_pass(
    collision: &Collision,
    a: &mut Moving,
    b: &mut Moving,
    impulses: &mut Impulses,
    parameters: &StepParameters,
) {
    let points = &collision.contacts[..collision.count as usize];
    let sum = points[1..].iter().fold(points[0].point, |sum, contact| add(sum, contact.point));
    #[expect(clippy::cast_precision_loss, reason = "1 to 4")]
    let centre = scale(sum, 1.0 / collision.count as f32);
    let q = neg(collision.normal);
    let [l0, l1, l2, l3] = impulses.normal;
    let limit = parameters.friction * (((l0 + l1) + l2) + l3);
    for (t, sum) in tangents(q).into_iter().zip(&mut impulses.tangential) {
        let row = Row::new(t, centre, a, b);
        let l = row.speed(a, b) * row.j;
        let u = min(max(*sum + l, -limit), limit);
        let l = u - *sum;
        *sum = u;
        row.apply(a, b, l);
    }
    let fixed = a.m == 0.0 || b.m == 0.0;
    if fixed || dot(unit(sub(b.p, a.p)), unit(sub(centre, a.p))) > 0.95 {
        let (spin_a, spin_b) = (dot(q, a.w), dot(q, b.w));
        a.w = sub(a.w, scale(q, spin_a * 0.1));
        b.w = sub(b.w, scale(q, spin_b * 0.1));
    }
}

fn integrate(body: &mut Body, moving: &Moving, parameters: &StepParameters) {
    let dt = parameters.time_step;
    let w = scale(moving.w, parameters.angular_damping);
    let mut a = dot(w, w).sqrt();
    let limit = 0.25_f32 * 3.141_592_5;
    if a * dt > limit {
        a = limit / dt;
    }
    let h = if a < 0.001 {
        scale(w, 0.5 * dt - ((((dt * dt) * dt) * 0.020_833_334) * a) * a)
    } else {
        scale(w, libm::sinf((0.5 * a) * dt) / a)
    };
    let c = libm::cosf((a * dt) * 0.5);
    let [x, y, z, qw] = body.pose.orientation;
    let r = [
        ((c * x + h[0] * qw) + h[1] * z) - h[2] * y,
        ((c * y + h[1] * qw) + h[2] * x) - h[0] * z,
        ((c * z + h[2] * qw) + h[0] * y) - h[1] * x,
        ((c * qw - h[0] * x) - h[1] * y) - h[2] * z,
    ];
    let k = 1.0 / (((r[0] * r[0] + r[1] * r[1]) + r[2] * r[2]) + r[3] * r[3]).sqrt();
    body.pose.orientation = r.map(|r| r * k);
    body.pose.position = add(body.pose.position, scale(moving.v, dt));
    body.velocity.linear = add(moving.v, scale(parameters.gravity, dt));
    body.velocity.angular = w;
}

/// A step of the direct solver.
fn direct_step(
    bodies: &mut [Body],
    collisions: &[Collision],
    shapes: &[Shape],
    parameters: &StepParameters,
) {
    let mut moving: Vec<_> = bodies
        .iter()
        .map(|body| {
            let shape = &shapes[body.shape as usize];
            Moving {
                p: body.pose.position,
                v: body.velocity.linear,
                w: body.velocity.angular,
                m: shape.inverse_mass,
                k: Tensor::of(shape, body.pose.orientation),
            }
        })
        .collect();
    let mut impulses = vec![Impulses::default(); collisions.len()];
    let passes = [
        (parameters.contact_iterations, contact_pass as fn(&_, &mut _, &mut _, &mut _, &_)),
        (parameters.friction_iterations, friction_pass),
    ];
    for (count, pass) in passes {
        for _ in 0..count {
            for (collision, impulses) in collisions.iter().zip(&mut impulses) {
                let [at_a, at_b] = [collision.body_a, collision.body_b].map(|at| at as usize);
                let (mut a, mut b) = (moving[at_a], moving[at_b]);
                pass(collision, &mut a, &mut b, impulses, parameters);
                (moving[at_a], moving[at_b]) = (a, b);
            }
        }
    }
    for (body, moving) in bodies.iter_mut().zip(&moving).filter(|(_, moving)| moving.m != 0.0) {
        integrate(body, moving, parameters);
    }
}

/// Numbers that follow no pattern (the finalizer of splitmix64).
struct Random(u64);

impl Random {
    fn word(&mut self) -> u32 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut word = self.0;
        word = (word ^ (word >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        word = (word ^ (word >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        u32::try_from((word ^ (word >> 31)) >> 40).expect("24 bits")
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

const BODIES: u32 = 60;
const COLLISIONS: usize = 220;

/// A cube, a box, a ball, a capsule.
fn shapes() -> [Shape; 5] {
    let made = |shape: Result<Shape, _>| shape.expect("sizes above 0");
    [
        Shape::STATIC,
        made(Shape::cuboid(1.0, [1.0; 3])),
        made(Shape::cuboid(2.0, [1.5, 0.5, 0.75])),
        made(Shape::sphere(0.5, 0.8)),
        made(Shape::capsule(1.5, 1.0, 0.4)),
    ]
}

fn scene(seed: u64) -> (Vec<Body>, Vec<Collision>) {
    let mut random = Random(seed);
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

fn bits(bodies: &[Body]) -> Vec<[u32; 13]> {
    let of = |body: &Body| {
        let Pose { position, orientation } = body.pose;
        let Velocity { linear, angular } = body.velocity;
        let numbers = [&position[..], &orientation, &linear, &angular].concat();
        let bits: Vec<_> = numbers.into_iter().map(f32::to_bits).collect();
        <[u32; 13]>::try_from(bits).expect("thirteen numbers")
    };
    bodies.iter().map(of).collect()
}

fn open(inertia: Inertia) -> (EmulatedBoard, Accelerator) {
    common::open(BoardConfig { inertia, ..BoardConfig::default() })
}

#[test]
fn shapes_of_any_inertia_are_solved_as_the_formulae_say() {
    let shapes = shapes();
    assert_eq!(shapes.iter().filter(|shape| !shape.is_isotropic()).count(), 2);
    for seed in 1..=5 {
        let (board, mut accelerator) = open(Inertia::World);
        accelerator.set_shapes(&shapes).expect("with world inertia");
        let (mut found, collisions) = scene(seed);
        // The reference takes the collisions in the given order.
        let parameters = StepParameters::default().with_order(Order::AsGiven);
        let mut expected = found.clone();
        let before = bits(&found);
        // The second step starts from other orientations.
        for step in 1..=2 {
            accelerator
                .step(&mut found, &collisions, &parameters)
                .unwrap_or_else(|error| panic!("{error}: {:?}", board.violations()));
            direct_step(&mut expected, &collisions, &shapes, &parameters);
            for (index, (found, expected)) in bits(&found).iter().zip(bits(&expected)).enumerate() {
                assert_eq!(*found, expected, "seed {seed}, step {step}, body {index}");
            }
        }
        let moved = before.iter().zip(bits(&found)).filter(|(before, after)| *before != after);
        assert_eq!(moved.count(), bodies_that_move(), "all but the ground");
        assert_eq!(board.violations(), []);
    }
}

fn bodies_that_move() -> usize {
    BODIES as usize - 1
}

/// The reference can fail: a body with the inertia of another orientation ends up elsewhere.
#[test]
fn the_orientation_of_an_anisotropic_body_matters() {
    let (shapes, parameters) = (shapes(), StepParameters::default());
    let (mut turned, collisions) = scene(1);
    let mut straight = turned.clone();
    for body in &mut straight {
        body.pose.orientation = [0.0, 0.0, 0.0, 1.0];
    }
    direct_step(&mut turned, &collisions, &shapes, &parameters);
    direct_step(&mut straight, &collisions, &shapes, &parameters);
    let differ = turned
        .iter()
        .zip(&straight)
        .any(|(a, b)| a.velocity.linear.map(f32::to_bits) != b.velocity.linear.map(f32::to_bits));
    assert!(differ);
}

#[test]
fn a_bitstream_without_world_inertia_refuses_such_shapes_before_anything_is_sent() {
    let (board, mut accelerator) = open(Inertia::Isotropic);
    let before = (board.counts().register_reads, board.counts().register_writes);
    let error = accelerator.set_shapes(&shapes()).expect_err("a box");
    assert!(error.is_input());
    let text = error.to_string();
    assert!(text.starts_with("shape 2: its inverse inertia is ["), "{text}");
    assert!(
        text.ends_with(
            "(profiles that could, built with world inertia: naive, float, half, mixed, windowed, \
             windowed16)"
        ),
        "{text}"
    );
    assert_eq!((board.counts().register_reads, board.counts().register_writes), before);
}
