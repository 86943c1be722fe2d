//! Solves a step directly, from the formulae of the specification alone: one collision after the
//! other, in f32, every operation rounded on its own. It shares no code with the driver or the
//! board.
//!
//! Sources: `bitstream-model/README.md`, arithmetic; Bullet's `b3Matrix3x3::setRotation` for the
//! rotation matrix.

use zynq_pgs::{Body, Collision, Impulses, Shape, StepParameters, Velocity};

pub(crate) type Vec3 = [f32; 3];

pub(crate) fn dot(a: Vec3, b: Vec3) -> f32 {
    (a[0] * b[0] + a[1] * b[1]) + a[2] * b[2]
}

fn cross(a: Vec3, b: Vec3) -> Vec3 {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

pub(crate) fn add(a: Vec3, b: Vec3) -> Vec3 {
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

pub(crate) fn unit(a: Vec3) -> Vec3 {
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

/// A pass over one collision. With the impulses that a step begins with, these take the place of
/// the computed ones.
type Pass =
    fn(&Collision, &mut Moving, &mut Moving, &mut Impulses, Option<&Impulses>, &StepParameters);

fn contact_pass(
    collision: &Collision,
    a: &mut Moving,
    b: &mut Moving,
    impulses: &mut Impulses,
    given: Option<&Impulses>,
    parameters: &StepParameters,
) {
    let count = collision.points() as usize;
    let points = collision.contacts[..count].iter().zip(&mut impulses.normal);
    for (i, (contact, sum)) in points.enumerate() {
        let row = Row::new(collision.normal, contact.point, a, b);
        if row.j == 0.0 {
            continue;
        }
        let depth = contact.distance + parameters.position_drift;
        let bias = (depth * parameters.position_coefficient) * (1.0 / parameters.time_step);
        let l = (row.speed(a, b) + bias) * row.j;
        let u = given.map_or_else(|| max(*sum + l, 0.0), |given| given.normal[i]);
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
    given: Option<&Impulses>,
    parameters: &StepParameters,
) {
    let points = &collision.contacts[..collision.points() as usize];
    let sum = points[1..].iter().fold(points[0].point, |sum, contact| add(sum, contact.point));
    #[expect(clippy::cast_precision_loss, reason = "1 to 4")]
    let centre = scale(sum, 1.0 / collision.points() as f32);
    let q = neg(collision.normal);
    let [l0, l1, l2, l3] = impulses.normal;
    let own = collision.friction();
    let mu = if parameters.pair_friction { own } else { parameters.friction };
    let limit = mu * (((l0 + l1) + l2) + l3);
    for (k, (t, sum)) in tangents(q).into_iter().zip(&mut impulses.friction).enumerate() {
        let row = Row::new(t, centre, a, b);
        let l = row.speed(a, b) * row.j;
        let clamped = min(max(*sum + l, -limit), limit);
        let u = given.map_or(clamped, |given| given.friction[k]);
        let l = u - *sum;
        *sum = u;
        row.apply(a, b, l);
    }
    if given.is_some() {
        return;
    }
    let fixed = a.m == 0.0 || b.m == 0.0;
    if fixed || dot(unit(sub(b.p, a.p)), unit(sub(centre, a.p))) > 0.95 {
        let (spin_a, spin_b) = (dot(q, a.w), dot(q, b.w));
        a.w = sub(a.w, scale(q, spin_a * parameters.spin_damping));
        b.w = sub(b.w, scale(q, spin_b * parameters.spin_damping));
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
pub(crate) fn direct_step(
    bodies: &mut [Body],
    collisions: &[Collision],
    shapes: &[Shape],
    parameters: &StepParameters,
) {
    direct_step_from(None, bodies, collisions, shapes, parameters);
}

/// A step that begins with impulses, one record a collision; returns the impulses at its end.
pub(crate) fn direct_step_from(
    given: Option<&[Impulses]>,
    bodies: &mut [Body],
    collisions: &[Collision],
    shapes: &[Shape],
    parameters: &StepParameters,
) -> Vec<Impulses> {
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
        (parameters.contact_iterations, contact_pass as Pass),
        (parameters.friction_iterations, friction_pass),
    ];
    for (count, pass) in passes {
        let warm = u32::from(given.is_some() && count > 0);
        for number in 0..count + warm {
            for (at, (collision, impulses)) in collisions.iter().zip(&mut impulses).enumerate() {
                if collision.is_empty() {
                    continue;
                }
                let given = given.filter(|_| number < warm).map(|given| &given[at]);
                let [at_a, at_b] = [collision.body_a, collision.body_b].map(|at| at as usize);
                let (mut a, mut b) = (moving[at_a], moving[at_b]);
                pass(collision, &mut a, &mut b, impulses, given, parameters);
                for (at, body) in [(at_a, a), (at_b, b)] {
                    // Nothing changes the velocity of a body without a mass.
                    if body.m != 0.0 {
                        moving[at] = body;
                    }
                }
            }
        }
    }
    if !parameters.integrate {
        for (body, moving) in bodies.iter_mut().zip(&moving) {
            body.velocity = Velocity { linear: moving.v, angular: moving.w };
        }
        return impulses;
    }
    let mut undamped = *parameters;
    undamped.angular_damping = 1.0;
    for (body, moving) in bodies.iter_mut().zip(&moving) {
        let given = body.velocity;
        if moving.m != 0.0 {
            integrate(body, moving, parameters);
        } else if given != Velocity::default() {
            integrate(body, moving, &undamped);
            body.velocity = given;
        }
    }
    impulses
}
