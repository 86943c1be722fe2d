//! A friction pass over one collision.
//!
//! ```text
//! friction pass:  q = -n;  (t_0, t_1) = tangents(q);  c = (x_0 + x_1 + ...) * (1 / count)
//!   limit = mu * stored(((L_0 + L_1) + L_2) + L_3)
//!   for k = 0, 1:  row(t_k, c - pA, c - pB)
//!     l = e * J;  u = min(max(G_k + l, -limit), limit);  l = u - G_k;  G_k = u;  apply
//!   if mA == 0 or mB == 0 or dot(unit(pB - pA), unit(c - pA)) > 0.95:
//!     wA -= q * (dot(q,wA) * s);  wB -= q * (dot(q,wB) * s)      both dots before both updates
//!
//! tangents(n), |n.z| > sqrt(1/2):  s = n.y*n.y + n.z*n.z   k = 1/sqrt(s)
//!                                  t_0 = (0, -n.z*k, n.y*k)   t_1 = (s*k, -n.x*t_0.z, n.x*t_0.y)
//!              otherwise:          s = n.x*n.x + n.y*n.y   k = 1/sqrt(s)
//!                                  t_0 = (-n.y*k, n.x*k, 0)   t_1 = (-n.z*t_0.y, n.z*t_0.x, s*k)
//! ```

use pgs_interface::profile::Inertia;
use pgs_interface::profile::solver::{SPIN_COSINE, TANGENT_Z};
use pgs_interface::record::CONTACT_POINTS;

use super::row::{self, Row, Velocity};
use crate::graph::{Graph, Operand, Source, Vec3};

/// The graph of a friction pass.
///
/// `per_count` is 1 / count, `coefficient_of_friction` the one of the collision, `impulse0` the
/// normal impulse that the last contact pass stored, `impulse1` and `impulse2` the tangents'
/// impulses, and `one_static` tells whether a body of the collision is static.
#[must_use]
pub fn friction(inertia: Inertia) -> Graph {
    let mut graph = Graph::default();
    let g = &mut graph;
    let solves = g.input(Source::Switch, "solves");
    let normal = g.input3(Source::Record, "normal");
    let positions = row::SIDES.map(|side| g.input3(Source::Record, &format!("position_{side}")));
    let masses = row::masses(g, inertia);
    let per_count = g.input(Source::Record, "per_count");
    let one_static = g.input(Source::Flag, "one_static");
    let always = g.input(Source::Flag, "used0");
    let mut velocities = row::velocities(g);
    let points = [0, 1, 2, 3].map(|i| g.input3(Source::Record, &format!("point{i}")));
    let centre = g.within("centre", |g| {
        let mut sum = points[0];
        for (i, point) in points.iter().enumerate().take(CONTACT_POINTS).skip(1) {
            let used = g.input(Source::Flag, &format!("used{i}"));
            sum = g.add3(sum, point.only_if(used));
        }
        g.scale(sum, per_count)
    });
    let total = g.input(Source::Impulse, "impulse0");
    let friction = g.input(Source::Record, "coefficient_of_friction");
    let limit = g.within("limit", |g| g.multiply(friction, total));
    let axis = normal.negated();
    let tangents = g.within("tangents", |g| tangents(g, axis));
    let arms = positions.map(|position| g.within("arm", |g| g.subtract3(centre, position)));

    for (k, tangent) in tangents.into_iter().enumerate() {
        let before = g.input(Source::Impulse, &format!("impulse{}", k + 1));
        g.within(&format!("tangent{k}"), |g| {
            let row = Row::new(g, tangent, arms, masses);
            let acts = g.non_zero(always, row.jacobian);
            let speed = row.speed(g, &velocities);
            let after = g.within("impulse", |g| {
                let wanted = g.multiply(speed, row.jacobian);
                let after = g.add(before, wanted);
                let after = g.maximum(after, limit.negated());
                g.minimum_or(solves, [after, limit], before)
            });
            let change = g.within("impulse", |g| g.subtract(after, before.only_if(solves)));
            row::output_impulse(g, &format!("impulse{}", k + 1), after, acts);
            velocities = row.apply(g, change, acts, velocities, masses);
        });
    }
    let velocities = g.within("spin", |g| {
        let damped = spin_is_damped(g, one_static, positions, arms[0]);
        let damped = g.both(damped, solves);
        let share = g.input(Source::Argument, "spin_damping");
        velocities.map(|velocity| damp_spin(g, axis, velocity, damped, share))
    });
    row::output_velocities(g, velocities);
    graph
}

/// Two unit vectors at right angles to `n` and to each other. Both branches have the same form, so
/// that the operands are selected, and each operation is built once.
fn tangents(g: &mut Graph, n: Vec3) -> [Vec3; 2] {
    let Vec3([x, y, z]) = n;
    let zero = g.constant(0.0);
    let one = g.constant(1.0);
    let threshold = g.constant(TANGENT_Z);
    let magnitude = g.maximum(z, z.negated());
    let steep = g.less(threshold, magnitude);
    let [xx, yy, zz] = [x, y, z].map(|value| g.multiply(value, value));
    let first = g.select(steep, yy, xx);
    let second = g.select(steep, zz, yy);
    let s = g.add(first, second);
    let root = g.square_root(s);
    let k = g.divide(one, root);

    // Steep: p = -n.z*k, r = n.y*k.  Otherwise: p = -n.y*k, r = n.x*k.
    let over = g.select(steep, z, y);
    let along = g.select(steep, y, x);
    let p = g.multiply(over, k).negated();
    let r = g.multiply(along, k);
    let sk = g.multiply(s, k);
    let left = g.select(steep, x, z);
    let left_r = g.multiply(left, r).negated();
    let left_p = g.multiply(left, p);
    let mut choose = |a: Operand, b: Operand| g.select(steep, a, b);
    let t0 = Vec3([choose(zero, p), choose(p, r), choose(r, zero)]);
    let t1 = Vec3([choose(sk, left_r), choose(left_r, left_p), choose(left_p, sk)]);
    [t0, t1]
}

/// Whether this collision damps the spin of its bodies about the normal.
fn spin_is_damped(
    g: &mut Graph,
    one_static: Operand,
    positions: [Vec3; 2],
    arm_a: Vec3,
) -> Operand {
    let between = g.subtract3(positions[1], positions[0]);
    let between = g.unit(between);
    let arm = g.unit(arm_a);
    let cosine = g.dot(between, arm);
    let threshold = g.constant(SPIN_COSINE);
    let far = g.less(threshold, cosine);
    g.either(one_static, far)
}

/// `w -= q * (dot(q,w) * share)`, where `damped` is 1.
fn damp_spin(
    g: &mut Graph,
    axis: Vec3,
    velocity: Velocity,
    damped: Operand,
    share: Operand,
) -> Velocity {
    let spin = g.dot(axis, velocity.angular);
    let spin = g.multiply(spin, share);
    let taken = g.scale(axis, spin).negated().only_if(damped);
    Velocity { angular: g.add3(velocity.angular, taken), ..velocity }
}
