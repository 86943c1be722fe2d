//! The passes over the collisions of a block, side by side: the formulae and the order of evaluation of
//! `solver.rs`, SIMD lane by SIMD lane.
//!
//! What a lane's collision lacks (a contact point, a static body's answer) is computed and not
//! taken.

#![allow(unsafe_code, reason = "rows of velocities are shared by threads")]

use super::Stage;
use super::block::{Block, LANES, Words, kind};
use super::lanes::{Lanes, Mask, Numbers, Quad};
use pgs_interface::profile::solver::{SPIN_COSINE, SPIN_DAMPING, TANGENT_Z};
use pgs_interface::record::CONTACT_POINTS;

use crate::accelerator::solver::SolverParameters;

type Vector<N> = [N; 3];

#[inline(always)]
fn add<N: Numbers>(a: Vector<N>, b: Vector<N>) -> Vector<N> {
    [a[0] + b[0], a[1] + b[1], a[2] + b[2]]
}

#[inline(always)]
fn sub<N: Numbers>(a: Vector<N>, b: Vector<N>) -> Vector<N> {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

#[inline(always)]
fn neg<N: Numbers>(a: Vector<N>) -> Vector<N> {
    [-a[0], -a[1], -a[2]]
}

#[inline(always)]
fn times<N: Numbers>(a: Vector<N>, s: N) -> Vector<N> {
    [a[0] * s, a[1] * s, a[2] * s]
}

#[inline(always)]
fn dot<N: Numbers>(a: Vector<N>, b: Vector<N>) -> N {
    (a[0] * b[0] + a[1] * b[1]) + a[2] * b[2]
}

#[inline(always)]
fn cross<N: Numbers>(a: Vector<N>, b: Vector<N>) -> Vector<N> {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

/// `a` where the mask says yes, and `b` elsewhere.
#[inline(always)]
fn either<N: Numbers>(mask: N::Mask, a: Vector<N>, b: Vector<N>) -> Vector<N> {
    [a[0].or(mask, b[0]), a[1].or(mask, b[1]), a[2].or(mask, b[2])]
}

/// The bodies of one side.
#[derive(Clone, Copy)]
struct Side<N> {
    v: Vector<N>,
    m: N,
    w: Vector<N>,
    k: N,
}

/// One constraint row of each collision.
#[derive(Clone, Copy)]
struct Row<N> {
    direction: Vector<N>,
    moment_a: Vector<N>,
    moment_b: Vector<N>,
    /// Products of the inverse inertias and the moments.
    spin_a: Vector<N>,
    spin_b: Vector<N>,
    jacobian: N,
}

impl<N: Numbers> Row<N> {
    #[inline(always)]
    fn new(
        minus_one: N,
        direction: Vector<N>,
        arm_a: Vector<N>,
        arm_b: Vector<N>,
        a: &Side<N>,
        b: &Side<N>,
    ) -> Self {
        let moment_a = cross(arm_a, direction);
        let moment_b = neg(cross(arm_b, direction));
        let spin_a = times(moment_a, a.k);
        let spin_b = times(moment_b, b.k);
        let denominator = ((a.m + dot(spin_a, moment_a)) + b.m) + dot(spin_b, moment_b);
        let jacobian = minus_one / denominator;
        Self { direction, moment_a, moment_b, spin_a, spin_b, jacobian }
    }

    #[inline(always)]
    fn speed(&self, a: &Side<N>, b: &Side<N>) -> N {
        ((dot(self.direction, a.v) + dot(self.moment_a, a.w)) + dot(neg(self.direction), b.v))
            + dot(self.moment_b, b.w)
    }

    /// Applies an impulse where `active`; `pushes` are the products of the direction (of its
    /// opposite for B) and the inverse masses.
    #[inline(always)]
    fn apply(
        &self,
        impulse: N,
        active: Option<N::Mask>,
        [push_a, push_b]: [Vector<N>; 2],
        a: &mut Side<N>,
        b: &mut Side<N>,
    ) {
        let before = (a.v, a.w, b.v, b.w);
        a.v = add(a.v, times(push_a, impulse));
        a.w = add(a.w, times(self.spin_a, impulse));
        b.v = add(b.v, times(push_b, impulse));
        b.w = add(b.w, times(self.spin_b, impulse));
        if let Some(active) = active {
            a.v = either(active, a.v, before.0);
            a.w = either(active, a.w, before.1);
            b.v = either(active, b.v, before.2);
            b.w = either(active, b.w, before.3);
        }
    }
}

/// Two unit vectors across each `n`, with one root and one quotient for both branches.
#[inline(always)]
fn tangents<L: Lanes>(lanes: L, n: Vector<L::Numbers>) -> [Vector<L::Numbers>; 2] {
    let zero = lanes.splat(0.0);
    let [x, y, z] = n;
    let steep = z.abs().above(lanes.splat(TANGENT_Z));
    let (p, q, r) = (y.or(steep, x), z.or(steep, y), x.or(steep, z));
    let s = p * p + q * q;
    let k = lanes.splat(1.0) / s.sqrt();
    let (u, v, w) = ((-q) * k, p * k, s * k);
    let (g, h) = ((-r) * v, r * u);
    let t0 = either(steep, [zero, u, v], [u, v, zero]);
    let t1 = either(steep, [w, g, h], [g, h, w]);
    [t0, t1]
}

#[inline(always)]
fn unit<L: Lanes>(lanes: L, a: Vector<L::Numbers>) -> Vector<L::Numbers> {
    times(a, lanes.splat(1.0) / dot(a, a).sqrt())
}

/// What a pass needs beside the collisions.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Pass<'a> {
    pub(crate) stage: Stage,
    /// Friction: whether this pass finds which spins are damped.
    pub(crate) finds: bool,
    pub(crate) parameters: &'a SolverParameters,
    /// The row written in place of a static body's.
    pub(crate) spare: u32,
}

#[inline(always)]
fn vector<L: Lanes>(lanes: L, words: &[Words; 3], at: usize) -> Vector<L::Numbers> {
    [lanes.load(&words[0], at), lanes.load(&words[1], at), lanes.load(&words[2], at)]
}

/// # Safety
///
/// As for [`solve`].
#[inline(always)]
unsafe fn side<L: Lanes>(
    lanes: L,
    quads: *const Quad,
    rows: &Words<u32>,
    at: usize,
) -> Side<L::Numbers> {
    // SAFETY: the caller promises that the rows exist and are nobody else's.
    let [x, y, z, m] = unsafe { lanes.gather(quads, rows, at, 0) };
    // SAFETY: the same.
    let [p, q, r, k] = unsafe { lanes.gather(quads, rows, at, 1) };
    Side { v: [x, y, z], m, w: [p, q, r], k }
}

/// # Safety
///
/// As for [`solve`].
#[inline(always)]
unsafe fn put_side<L: Lanes>(
    lanes: L,
    quads: *mut Quad,
    rows: &Words<u32>,
    at: usize,
    side: &Side<L::Numbers>,
) {
    let ([x, y, z], [p, q, r]) = (side.v, side.w);
    // SAFETY: the caller promises that the rows exist and are nobody else's.
    unsafe { lanes.scatter([x, y, z, side.m], quads, rows, at, 0) };
    // SAFETY: the same.
    unsafe { lanes.scatter([p, q, r, side.k], quads, rows, at, 1) };
}

/// One pass over the collisions of a block that is not serial. `quads` are the rows of velocities,
/// two each: linear and inverse mass, angular and inverse inertia.
///
/// # Safety
///
/// The rows of the block and the spare one exist. Nobody writes those while this runs, nor reads
/// those of moving bodies and the spare one.
#[inline(always)]
pub(crate) unsafe fn solve<L: Lanes>(
    lanes: L,
    pass: &Pass<'_>,
    block: &mut Block,
    quads: *mut Quad,
) {
    let mut at = 0;
    while at < LANES {
        let moves = kind::MOVES.map(|bit| lanes.tested(&block.kind, at, bit));
        let counts = lanes.counts(&block.kind, at, kind::COUNT);
        let taken = counts.above(lanes.splat(0.0));
        if taken.bits() != 0 {
            // SAFETY: the caller promises it.
            let mut a = unsafe { side(lanes, quads, &block.rows[0], at) };
            // SAFETY: the same.
            let mut b = unsafe { side(lanes, quads, &block.rows[1], at) };
            if pass.stage.contact {
                contact(lanes, pass, block, at, counts, &mut a, &mut b);
            } else {
                friction(lanes, pass, block, at, counts, &mut a, &mut b);
            }
            let answers = [a, b];
            for each in 0..2 {
                let mut written = block.rows[each];
                if moves[each].bits() != (1 << L::WIDTH) - 1 {
                    for (row, kind) in written.iter_mut().zip(&block.kind) {
                        *row = if kind & kind::MOVES[each] == 0 { pass.spare } else { *row };
                    }
                }
                // SAFETY: the same; the rows are of moving bodies, or the spare one.
                unsafe { put_side(lanes, quads, &written, at, &answers[each]) };
            }
        }
        at += L::WIDTH;
    }
}

/// Where not all lanes are active, which.
#[inline(always)]
fn some<L: Lanes>(_: L, active: L::Mask) -> Option<L::Mask> {
    (active.bits() != (1 << L::WIDTH) - 1).then_some(active)
}

#[inline(always)]
fn contact<L: Lanes>(
    lanes: L,
    pass: &Pass<'_>,
    block: &mut Block,
    at: usize,
    counts: L::Numbers,
    a: &mut Side<L::Numbers>,
    b: &mut Side<L::Numbers>,
) {
    let zero = lanes.splat(0.0);
    let minus_one = lanes.splat(-1.0);
    let per_second = lanes.splat(1.0 / pass.parameters.time_step);
    let drift = lanes.splat(pass.parameters.drift);
    let coefficient = lanes.splat(pass.parameters.coefficient);
    let n = vector(lanes, &block.normal, at);
    let position_a = vector(lanes, &block.position_a, at);
    let position_b = vector(lanes, &block.position_b, at);
    let pushes = [times(n, a.m), times(neg(n), b.m)];
    for k in 0..CONTACT_POINTS {
        let [x, y, z, distance] = &block.contacts[k];
        let point = [lanes.load(x, at), lanes.load(y, at), lanes.load(z, at)];
        let distance = lanes.load(distance, at);
        let arms = (sub(point, position_a), sub(point, position_b));
        let row = Row::new(minus_one, n, arms.0, arms.1, a, b);
        let reached = counts.above(lanes.splat(k as f32));
        let active = some(lanes, reached.without(row.jacobian.is_zero()));
        let bias = ((distance + drift) * coefficient) * per_second;
        let wanted = (row.speed(a, b) + bias) * row.jacobian;
        let before = lanes.load(&block.impulses[k], at);
        let after = (before + wanted).larger(zero);
        let stored = match active {
            None => after,
            Some(active) => after.or(active, before),
        };
        lanes.store(stored, &mut block.impulses[k], at);
        row.apply(after - before, active, pushes, a, b);
    }
}

#[inline(always)]
fn friction<L: Lanes>(
    lanes: L,
    pass: &Pass<'_>,
    block: &mut Block,
    at: usize,
    counts: L::Numbers,
    a: &mut Side<L::Numbers>,
    b: &mut Side<L::Numbers>,
) {
    let one = lanes.splat(1.0);
    let minus_one = lanes.splat(-1.0);
    let q = neg(vector(lanes, &block.normal, at));
    let position_a = vector(lanes, &block.position_a, at);
    let position_b = vector(lanes, &block.position_b, at);
    let taken = counts.above(lanes.splat(0.0));
    let [x, y, z, _] = &block.contacts[0];
    let mut sum = [lanes.load(x, at), lanes.load(y, at), lanes.load(z, at)];
    for k in 1..CONTACT_POINTS {
        let [x, y, z, _] = &block.contacts[k];
        let more = add(sum, [lanes.load(x, at), lanes.load(y, at), lanes.load(z, at)]);
        sum = match some(lanes, counts.above(lanes.splat(k as f32))) {
            None => more,
            Some(reached) => either(reached, more, sum),
        };
    }
    let centre = times(sum, one / counts);
    let arm_a = sub(centre, position_a);
    let arm_b = sub(centre, position_b);
    if pass.stage.turning {
        let [l0, l1, l2, l3] = &block.impulses;
        let (l0, l1) = (lanes.load(l0, at), lanes.load(l1, at));
        let (l2, l3) = (lanes.load(l2, at), lanes.load(l3, at));
        lanes.store(((l0 + l1) + l2) + l3, &mut block.impulses[0], at);
        for k in 1..CONTACT_POINTS {
            lanes.store(lanes.splat(0.0), &mut block.impulses[k], at);
        }
    }
    let limit = lanes.splat(pass.parameters.friction) * lanes.load(&block.impulses[0], at);
    let tangents = tangents(lanes, q);
    for (k, t) in tangents.into_iter().enumerate() {
        let row = Row::new(minus_one, t, arm_a, arm_b, a, b);
        let active = some(lanes, taken.without(row.jacobian.is_zero()));
        let wanted = row.speed(a, b) * row.jacobian;
        let before = lanes.load(&block.impulses[1 + k], at);
        let after = (before + wanted).larger(-limit).smaller(limit);
        let stored = match active {
            None => after,
            Some(active) => after.or(active, before),
        };
        lanes.store(stored, &mut block.impulses[1 + k], at);
        let pushes = [times(t, a.m), times(neg(t), b.m)];
        row.apply(after - before, active, pushes, a, b);
    }
    let spins = if pass.finds {
        let apart = unit(lanes, sub(position_b, position_a));
        let cosine = dot(apart, unit(lanes, arm_a));
        // By the numbers that it computes with: a small inverse mass may be none in sixteen bits.
        let static_side = taken.and(a.m.is_zero().either(b.m.is_zero()));
        let spins = cosine.above(lanes.splat(SPIN_COSINE)).either(static_side);
        let bits = spins.bits();
        for lane in 0..L::WIDTH {
            let bit = if bits >> lane & 1 != 0 { kind::SPINS } else { 0 };
            block.kind[at + lane] = block.kind[at + lane] & !kind::SPINS | bit;
        }
        spins
    } else {
        lanes.tested(&block.kind, at, kind::SPINS)
    };
    if spins.bits() != 0 {
        let share = lanes.splat(SPIN_DAMPING);
        let spin_a = dot(q, a.w);
        let spin_b = dot(q, b.w);
        a.w = either(spins, sub(a.w, times(q, spin_a * share)), a.w);
        b.w = either(spins, sub(b.w, times(q, spin_b * share)), b.w);
    }
}
