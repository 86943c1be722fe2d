//! The passes over the collisions of a block, side by side: the formulae and the order of evaluation of
//! `solver.rs`, SIMD lane by SIMD lane.
//!
//! A contact point that a lane's collision lacks, or the answer of a static body, is computed and
//! discarded.

#![allow(unsafe_code, reason = "rows of velocities are shared by threads")]

use super::block::{Block, Words, kind};
use super::given::Given;
use super::inertia::{Form, SideInertias, Times};
use super::numbers::{Arithmetic, Numbers};
use super::plan::Stage;
use super::vector::{Vector, add, cross, dot, either, neg, sub, times};
use pgs_interface::profile::solver::{SPIN_COSINE, TANGENT_Z};
use pgs_interface::record::CONTACT_POINTS;
use pgs_support::lanes::{F32x16, Instructions, LANES, Mask, Quad};

use crate::accelerator::records::decode::pair_friction;
use crate::accelerator::solver::SolverParameters;

/// A body in memory: the linear velocity and the inverse mass, then the angular velocity
/// and the inverse inertia if that is one number.
pub(crate) type BodyRow = [Quad; 2];

/// The inverse inertia of a body about world axes: xx, yy, zz, then xy, xz, yz.
pub(crate) type InertiaRow = [Quad; 2];

/// The rows of all bodies in memory.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Rows {
    pub(crate) bodies: *mut BodyRow,
    /// With world inertia a row for each row of `bodies`. Without it no code reads them.
    pub(crate) inertias: *const InertiaRow,
}

/// The bodies of one side.
#[derive(Clone, Copy)]
struct Side<A, K> {
    v: Vector<A>,
    m: Numbers<A>,
    w: Vector<A>,
    /// The number beside the angular velocity.
    beside: Numbers<A>,
    k: K,
}

/// One constraint row of each collision.
#[derive(Clone, Copy)]
struct Row<A> {
    direction: Vector<A>,
    moment_a: Vector<A>,
    moment_b: Vector<A>,
    /// Products of the inverse inertias and the moments.
    spin_a: Vector<A>,
    spin_b: Vector<A>,
    jacobian: Numbers<A>,
}

impl<A: Arithmetic> Row<A> {
    #[inline(always)]
    fn new<K: Times<A>>(
        minus_one: Numbers<A>,
        direction: Vector<A>,
        arm_a: Vector<A>,
        arm_b: Vector<A>,
        a: &Side<A, K>,
        b: &Side<A, K>,
    ) -> Self {
        let moment_a = cross(arm_a, direction);
        let moment_b = neg(cross(arm_b, direction));
        let spin_a = a.k.times(moment_a);
        let spin_b = b.k.times(moment_b);
        let denominator = ((a.m + dot(spin_a, moment_a)) + b.m) + dot(spin_b, moment_b);
        let jacobian = minus_one / denominator;
        Self { direction, moment_a, moment_b, spin_a, spin_b, jacobian }
    }

    #[inline(always)]
    fn speed<K>(&self, a: &Side<A, K>, b: &Side<A, K>) -> Numbers<A> {
        ((dot(self.direction, a.v) + dot(self.moment_a, a.w)) + dot(neg(self.direction), b.v))
            + dot(self.moment_b, b.w)
    }

    /// Applies an impulse where `active`; `pushes` are the products of the direction (of its
    /// opposite for B) and the inverse masses.
    #[inline(always)]
    fn apply<K>(
        &self,
        impulse: Numbers<A>,
        active: Option<Mask>,
        [push_a, push_b]: [Vector<A>; 2],
        a: &mut Side<A, K>,
        b: &mut Side<A, K>,
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
fn tangents<A: Arithmetic>(arithmetic: A, n: Vector<A>) -> [Vector<A>; 2] {
    let zero = arithmetic.splat(0.0);
    let [x, y, z] = n;
    let steep = z.abs().above(arithmetic.splat(TANGENT_Z));
    let (p, q, r) = (y.or(steep, x), z.or(steep, y), x.or(steep, z));
    let s = p * p + q * q;
    let k = arithmetic.splat(1.0) / s.sqrt();
    let (u, v, w) = ((-q) * k, p * k, s * k);
    let (g, h) = ((-r) * v, r * u);
    let t0 = either(steep, [zero, u, v], [u, v, zero]);
    let t1 = either(steep, [w, g, h], [g, h, w]);
    [t0, t1]
}

#[inline(always)]
fn unit<A: Arithmetic>(arithmetic: A, a: Vector<A>) -> Vector<A> {
    times(a, arithmetic.splat(1.0) / dot(a, a).sqrt())
}

/// The input of a pass beside the collisions.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Pass<'a> {
    pub(crate) stage: Stage,
    /// Friction: whether this pass finds which spins are damped.
    pub(crate) finds: bool,
    /// With world inertia: whether this pass gathers the inverse inertias, for itself and for later ones.
    pub(crate) gathers: bool,
    pub(crate) parameters: &'a SolverParameters,
    /// The row written in place of a static body's.
    pub(crate) spare: u32,
}

#[inline(always)]
fn vector<A: Arithmetic>(arithmetic: A, words: &[Words; 3]) -> Vector<A> {
    [arithmetic.load(&words[0]), arithmetic.load(&words[1]), arithmetic.load(&words[2])]
}

/// Whether a bit is set in each lane's kind.
#[inline(always)]
fn tested(block: &Block, bit: u32) -> Mask {
    Mask::from_fn(|lane| block.kind[lane] & bit != 0)
}

/// Reads rows, by words.
///
/// # Safety
///
/// Each of `rows` is below the number of rows at `from`, and no other thread writes these rows during the
/// call.
#[inline(always)]
unsafe fn gathered(
    instructions: impl Instructions,
    from: *const [Quad; 2],
    rows: &Words<u32>,
) -> [[F32x16; 4]; 2] {
    let (mut first, mut second) = ([[0.0; 4]; LANES], [[0.0; 4]; LANES]);
    for (lane, row) in rows.iter().enumerate() {
        // SAFETY: the caller promises that the index lies within the rows at `from`.
        let row = unsafe { from.add(*row as usize) };
        // SAFETY: the row exists, and the caller promises that no other thread writes it.
        [first[lane], second[lane]] = unsafe { *row };
    }
    [instructions.columns(first), instructions.columns(second)]
}

/// Reads the bodies of one side. In a form about axes `kept` has their inverse inertias, or receives them
/// if `gathers` is set.
///
/// # Safety
///
/// Each of `indices` is below the number of rows at `rows.bodies`, and if `kept` receives the inverse inertias
/// below the number at `rows.inertias`. No other thread writes these rows during the call.
#[inline(always)]
unsafe fn side<A: Arithmetic, F: Form>(
    arithmetic: A,
    instructions: impl Instructions,
    rows: Rows,
    indices: &Words<u32>,
    (kept, gathers): (Option<&mut SideInertias>, bool),
) -> Side<A, F::Side<A>> {
    let of = |columns: [F32x16; 4]| columns.map(|numbers| arithmetic.of(numbers));
    // SAFETY: the caller promises that `rows.bodies` has a row for each index, and that no other thread
    // writes it.
    let [linear, angular] = unsafe { gathered(instructions, rows.bodies, indices) };
    let ([x, y, z, m], [p, q, r, beside]) = (of(linear), of(angular));
    let k = match kept {
        Some(kept) if F::ABOUT_AXES => {
            if gathers {
                // SAFETY: `gathers` is set and `kept` receives: the caller promises that `rows.inertias` then has
                // a row for each index, and that no thread writes these rows during the call.
                kept.put(unsafe { gathered(instructions, rows.inertias, indices) });
            }
            kept.of::<A, F>(arithmetic)
        }
        _ => F::isotropic(beside),
    };
    Side { v: [x, y, z], m, w: [p, q, r], beside, k }
}

/// Writes the bodies of one side, in the order of the lanes.
///
/// # Safety
///
/// `rows` are indices into the rows at `bodies`, and no other thread accesses these rows at the same
/// time.
#[inline(always)]
unsafe fn put_side<A: Arithmetic, K>(
    instructions: impl Instructions,
    bodies: *mut BodyRow,
    rows: &Words<u32>,
    side: &Side<A, K>,
) {
    let ([x, y, z], [p, q, r]) = (side.v, side.w);
    let linear = instructions.quads([x, y, z, side.m].map(Numbers::lanes));
    let angular = instructions.quads([p, q, r, side.beside].map(Numbers::lanes));
    for (lane, row) in rows.iter().enumerate() {
        // SAFETY: the caller promises that the index lies within the rows at `bodies`.
        let body = unsafe { bodies.add(*row as usize) };
        // SAFETY: the row exists, and the caller promises that no other thread accesses it.
        unsafe { *body = [linear[lane], angular[lane]] };
    }
}

/// One pass over the collisions of a block that is not serial. In a warm pass `given` takes the place of
/// the impulses that the others compute. In a form about axes `kept` has the inverse inertias of both sides,
/// or receives them if the pass gathers.
///
/// # Safety
///
/// The block's rows and the spare one are below the number of rows at `rows.bodies`, and in a form about axes
/// the block's rows are below the number at `rows.inertias`, too. During the call no other thread writes the
/// block's rows in either array, and none reads the rows of its moving bodies or the spare one.
#[inline(always)]
pub(crate) unsafe fn solve<A: Arithmetic, F: Form>(
    arithmetic: A,
    instructions: impl Instructions,
    pass: &Pass<'_>,
    block: &mut Block,
    given: Option<&Given>,
    kept: Option<&mut [SideInertias; 2]>,
    rows: Rows,
) {
    debug_assert!(!F::ABOUT_AXES || kept.is_some(), "the inertias of a block");
    let [kept_a, kept_b] = match kept {
        Some([a, b]) => [Some(a), Some(b)],
        None => [None, None],
    };
    let moves = kind::MOVES.map(|bit| tested(block, bit));
    let counts = F32x16::from_fn(|lane| (block.kind[lane] & kind::COUNT) as f32);
    let counts = arithmetic.of(counts);
    // SAFETY: the caller promises that the rows of side A exist in `rows.bodies`, and in a form about axes in
    // `rows.inertias`, too, and that no other thread writes them during the call.
    let mut a = unsafe {
        side::<A, F>(arithmetic, instructions, rows, &block.rows[0], (kept_a, pass.gathers))
    };
    // SAFETY: the caller promises that the rows of side B exist in `rows.bodies`, and in a form about axes in
    // `rows.inertias`, too, and that no other thread writes them during the call.
    let mut b = unsafe {
        side::<A, F>(arithmetic, instructions, rows, &block.rows[1], (kept_b, pass.gathers))
    };
    if pass.stage.contact {
        contact(arithmetic, pass, block, given, counts, &mut a, &mut b);
    } else {
        friction(arithmetic, pass, block, given, counts, &mut a, &mut b);
    }
    for (each, side) in [a, b].iter().enumerate() {
        let mut written = block.rows[each];
        if !moves[each].all() {
            for (row, kind) in written.iter_mut().zip(&block.kind) {
                *row = if kind & kind::MOVES[each] == 0 { pass.spare } else { *row };
            }
        }
        // SAFETY: the rows are of moving bodies, or the spare one: the caller promises that they exist,
        // and that no other thread accesses them.
        unsafe { put_side(instructions, rows.bodies, &written, side) };
    }
}

/// The active lanes, or `None` if all are.
#[inline(always)]
fn some(active: Mask) -> Option<Mask> {
    (!active.all()).then_some(active)
}

#[inline(always)]
fn contact<A: Arithmetic, K: Times<A>>(
    arithmetic: A,
    pass: &Pass<'_>,
    block: &mut Block,
    given: Option<&Given>,
    counts: Numbers<A>,
    a: &mut Side<A, K>,
    b: &mut Side<A, K>,
) {
    let zero = arithmetic.splat(0.0);
    let minus_one = arithmetic.splat(-1.0);
    let per_second = arithmetic.splat(1.0 / pass.parameters.time_step);
    let drift = arithmetic.splat(pass.parameters.drift);
    let coefficient = arithmetic.splat(pass.parameters.coefficient);
    let n = vector(arithmetic, &block.normal);
    let position_a = vector(arithmetic, &block.position_a);
    let position_b = vector(arithmetic, &block.position_b);
    let pushes = [times(n, a.m), times(neg(n), b.m)];
    for k in 0..CONTACT_POINTS {
        let [x, y, z, distance] = &block.contacts[k];
        let point = [arithmetic.load(x), arithmetic.load(y), arithmetic.load(z)];
        let distance = arithmetic.load(distance);
        let arms = (sub(point, position_a), sub(point, position_b));
        let row = Row::new(minus_one, n, arms.0, arms.1, a, b);
        let reached = counts.above(arithmetic.splat(k as f32));
        let active = some(reached.without(row.jacobian.is_zero()));
        let before = arithmetic.load(&block.impulses[k]);
        let after = if let Some(given) = given {
            arithmetic.load(&given.normal[k])
        } else {
            let bias = ((distance + drift) * coefficient) * per_second;
            let wanted = (row.speed(a, b) + bias) * row.jacobian;
            (before + wanted).larger(zero)
        };
        let stored = match active {
            None => after,
            Some(active) => after.or(active, before),
        };
        stored.store(&mut block.impulses[k]);
        row.apply(after - before, active, pushes, a, b);
    }
}

#[inline(always)]
fn friction<A: Arithmetic, K: Times<A>>(
    arithmetic: A,
    pass: &Pass<'_>,
    block: &mut Block,
    given: Option<&Given>,
    counts: Numbers<A>,
    a: &mut Side<A, K>,
    b: &mut Side<A, K>,
) {
    let one = arithmetic.splat(1.0);
    let minus_one = arithmetic.splat(-1.0);
    let q = neg(vector(arithmetic, &block.normal));
    let position_a = vector(arithmetic, &block.position_a);
    let position_b = vector(arithmetic, &block.position_b);
    let taken = counts.above(arithmetic.splat(0.0));
    let [x, y, z, _] = &block.contacts[0];
    let mut sum = [arithmetic.load(x), arithmetic.load(y), arithmetic.load(z)];
    for k in 1..CONTACT_POINTS {
        let [x, y, z, _] = &block.contacts[k];
        let more = add(sum, [arithmetic.load(x), arithmetic.load(y), arithmetic.load(z)]);
        sum = match some(counts.above(arithmetic.splat(k as f32))) {
            None => more,
            Some(reached) => either(reached, more, sum),
        };
    }
    let centre = times(sum, one / counts);
    let arm_a = sub(centre, position_a);
    let arm_b = sub(centre, position_b);
    if pass.stage.turning {
        let [l0, l1, l2, l3] = &block.impulses;
        let (l0, l1) = (arithmetic.load(l0), arithmetic.load(l1));
        let (l2, l3) = (arithmetic.load(l2), arithmetic.load(l3));
        (((l0 + l1) + l2) + l3).store(&mut block.impulses[0]);
        for k in 1..CONTACT_POINTS {
            arithmetic.splat(0.0).store(&mut block.impulses[k]);
        }
    }
    let friction = if pass.parameters.pair_friction {
        arithmetic.of(F32x16::from_fn(|lane| pair_friction(block.kind[lane])))
    } else {
        arithmetic.splat(pass.parameters.friction)
    };
    let limit = friction * arithmetic.load(&block.impulses[0]);
    let tangents = tangents(arithmetic, q);
    for (k, t) in tangents.into_iter().enumerate() {
        let row = Row::new(minus_one, t, arm_a, arm_b, a, b);
        let active = some(taken.without(row.jacobian.is_zero()));
        let before = arithmetic.load(&block.impulses[1 + k]);
        let after = if let Some(given) = given {
            arithmetic.load(&given.friction[k])
        } else {
            let wanted = row.speed(a, b) * row.jacobian;
            (before + wanted).larger(-limit).smaller(limit)
        };
        let stored = match active {
            None => after,
            Some(active) => after.or(active, before),
        };
        stored.store(&mut block.impulses[1 + k]);
        let pushes = [times(t, a.m), times(neg(t), b.m)];
        row.apply(after - before, active, pushes, a, b);
    }
    if given.is_some() {
        return;
    }
    let spins = if pass.finds {
        let apart = unit(arithmetic, sub(position_b, position_a));
        let cosine = dot(apart, unit(arithmetic, arm_a));
        // By the rounded inverse mass: a small one may be zero in sixteen bits.
        let static_side = taken.and(a.m.is_zero().either(b.m.is_zero()));
        let spins = cosine.above(arithmetic.splat(SPIN_COSINE)).either(static_side);
        let bits = spins.bits();
        for (lane, kind) in block.kind.iter_mut().enumerate() {
            let bit = if bits >> lane & 1 != 0 { kind::SPINS } else { 0 };
            *kind = *kind & !kind::SPINS | bit;
        }
        spins
    } else {
        tested(block, kind::SPINS)
    };
    if spins.any() {
        let share = arithmetic.splat(pass.parameters.spin_damping);
        let spin_a = dot(q, a.w);
        let spin_b = dot(q, b.w);
        a.w = either(spins, sub(a.w, times(q, spin_a * share)), a.w);
        b.w = either(spins, sub(b.w, times(q, spin_b * share)), b.w);
    }
}
