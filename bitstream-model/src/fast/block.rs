//! Collisions side by side: their rows, made once a step, and a pass over them. It has the formulae
//! and the order of evaluation of [`solver`](crate::accelerator::solver), lane by lane.
//!
//! The collisions of a block share no moving body. A contact point that a lane's collision lacks,
//! or the answer of a static body, is computed and discarded.

#![allow(unsafe_code, reason = "rows of velocities are shared by threads")]

use std::mem::offset_of;

use pgs_interface::profile::solver::{SPIN_COSINE, TANGENT_Z};
use pgs_interface::record::{CONTACT_POINTS, collision};
use pgs_support::lanes::{ALL, F32s, Instructions, LANES, Quad, prefetch};

use super::Stage;
use crate::accelerator::records::decode::pair_friction;
use crate::accelerator::solver::SolverParameters;

/// One word of the collisions of a block.
pub(super) type Words<T = f32> = [T; LANES];
/// A vector in each lane.
type Vector<I> = [F32s<I>; 3];

/// A body: the linear velocity and the inverse mass, then the angular velocity and the inverse
/// inertia if that is one number.
pub(super) type BodyRow = [Quad; 2];
/// The inverse inertia of a body about world axes: xx, yy, zz, 0, then xy, xz, yz, 0.
pub(super) type InertiaRow = [Quad; 2];

/// Rows before the bodies' own: the one that empty lanes read, then for each thread one that it
/// writes in place of a static body's.
pub(super) const ROWS_APART: u32 = 32;
const _: () = assert!(ROWS_APART as usize > crate::config::THREADS_MAX);
/// No collision in a lane.
pub(super) const NONE: u32 = u32::MAX;
/// Rows of friction of a collision.
const FRICTION: usize = 2;

/// A constraint row of each collision, without its direction.
#[derive(Debug, Clone, Copy)]
#[repr(C)]
struct Row {
    moments: [[Words; 3]; 2],
    /// Effective mass, negative.
    jacobian: Words,
}

/// The products of the inverse inertias about world axes and the moments of each row, contacts
/// first.
pub(super) type Spins = [[[Words; 3]; 2]; CONTACT_POINTS + FRICTION];

/// The impulses that come in with the collisions of a block: normal ones and friction.
pub(super) type Given = [[Words; CONTACT_POINTS]; 2];

/// The records of a step's collisions, row by row.
pub(super) trait Records {
    /// A row of a collision.
    fn row(&self, collision: usize, row: usize) -> Quad;

    /// The impulses that come in with a collision: normal ones and friction.
    fn given(&self, collision: usize) -> [Quad; 2];
}

/// The bodies and parameters that rows depend on.
#[derive(Debug, Clone, Copy)]
pub(super) struct Scene<'a> {
    pub(super) bodies: &'a [BodyRow],
    /// With world inertia a row for each row of `bodies`.
    pub(super) inertias: &'a [InertiaRow],
    pub(super) parameters: &'a SolverParameters,
}

/// The parts of a block that not every step has.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Beside<S, G> {
    /// The products with inertias about world axes.
    pub(super) spins: Option<S>,
    pub(super) given: Option<G>,
}

/// The collisions of a block that rows and bodies of lanes act on, one bit per lane.
#[derive(Debug, Clone, Copy, Default)]
#[repr(C, align(64))]
struct Bits {
    /// Each row acts.
    acts: [u32; CONTACT_POINTS + FRICTION],
    /// Side A moves, side B moves.
    moves: [u32; 2],
    /// The spin is damped.
    damped: u32,
}

/// Collisions that share no moving body: what friction needs, what all passes need, what contacts
/// need.
#[derive(Debug, Clone, Copy)]
#[repr(C, align(64))]
pub(super) struct Block {
    tangents: [[Words; 3]; FRICTION],
    frictions: [Row; FRICTION],
    friction: Words,
    normal: [Words; 3],
    impulses: [Words; CONTACT_POINTS],
    /// Rows of the bodies.
    rows: [Words<u32>; 2],
    bits: Bits,
    bias: [Words; CONTACT_POINTS],
    contacts: [Row; CONTACT_POINTS],
}

impl Block {
    pub(super) const EMPTY: Self = {
        let zero = [0.0; LANES];
        let row = Row { moments: [[zero; 3]; 2], jacobian: zero };
        Self {
            tangents: [[zero; 3]; FRICTION],
            frictions: [row; FRICTION],
            friction: zero,
            normal: [zero; 3],
            impulses: [zero; CONTACT_POINTS],
            rows: [[0; LANES]; 2],
            bits: Bits { acts: [0; CONTACT_POINTS + FRICTION], moves: [0; 2], damped: 0 },
            bias: [zero; CONTACT_POINTS],
            contacts: [row; CONTACT_POINTS],
        }
    };

    /// Prefetches what a pass needs of a block, which need not exist.
    #[inline(always)]
    pub(super) fn prefetch(block: *const Self, contact: bool) {
        let (from, to) = match contact {
            true => (offset_of!(Self, normal), size_of::<Self>()),
            false => (0, offset_of!(Self, bias)),
        };
        for line in (from..to).step_by(64) {
            prefetch(block.cast::<u8>().wrapping_add(line));
        }
    }

    /// Makes the rows of some collisions, by their numbers.
    #[inline(always)]
    pub(super) fn prepare<I: Instructions>(
        &mut self,
        instructions: I,
        records: &impl Records,
        members: &Words<u32>,
        scene: Scene<'_>,
        beside: Beside<&mut Spins, &mut Given>,
    ) {
        let parameters = scene.parameters;
        let splat = |number| F32s::splat(instructions, number);
        let columns = |row: usize| {
            F32s::columns(instructions, |lane| match members[lane] {
                NONE => Quad::default(),
                member => records.row(member as usize, row),
            })
        };
        let [nx, ny, nz, head] = columns(collision::NORMAL);
        let [ax, ay, az, body_a] = columns(collision::BODY_A);
        let [bx, by, bz, body_b] = columns(collision::BODY_B);
        let (n, position_a, position_b) = ([nx, ny, nz], [ax, ay, az], [bx, by, bz]);
        self.friction = splat(parameters.friction).to_array();
        let mut counts = [0.0; LANES];
        let (heads, bodies) = (head.to_array(), [body_a.to_array(), body_b.to_array()]);
        for lane in 0..LANES {
            let head = heads[lane].to_bits();
            let friction = if parameters.pair_friction { collision::FRICTION_BITS } else { 0 };
            counts[lane] = (head & !friction) as f32;
            if parameters.pair_friction {
                self.friction[lane] = pair_friction(head);
            }
            for (rows, bodies) in self.rows.iter_mut().zip(&bodies) {
                let body = bodies[lane].to_bits();
                rows[lane] = if members[lane] == NONE { 0 } else { ROWS_APART + body };
            }
        }
        let counts = F32s::from_array(instructions, &counts);
        let sides = [
            Inverse::of(instructions, &self.rows[0], scene),
            Inverse::of(instructions, &self.rows[1], scene),
        ];
        let zero = splat(0.0);
        let statics = [sides[0].m.is(zero), sides[1].m.is(zero)];
        self.bits.moves = [!statics[0] & ALL, !statics[1] & ALL];
        let per_second = splat(1.0) / splat(parameters.time_step);
        let (drift, coefficient) = (splat(parameters.drift), splat(parameters.coefficient));
        let Beside { mut spins, given } = beside;
        let mut sum = [zero; 3];
        for k in 0..CONTACT_POINTS {
            let [x, y, z, distance] = columns(collision::CONTACTS + k);
            let point = [x, y, z];
            let reached = counts.above(splat(k as f32));
            let arms = [sub(point, position_a), sub(point, position_b)];
            let spins = spins.as_mut().map(|spins| &mut spins[k]);
            self.bits.acts[k] = reached & self.contacts[k].make(n, arms, &sides, spins);
            self.bias[k] = (((distance + drift) * coefficient) * per_second).to_array();
            sum = match k {
                0 => point,
                _ => either(reached, add(sum, point), sum),
            };
        }
        // At most four points: exact.
        let centre = times(sum, splat(1.0) / counts);
        let arms = [sub(centre, position_a), sub(centre, position_b)];
        let used = counts.above(zero);
        for (k, tangent) in tangents(instructions, neg(n)).into_iter().enumerate() {
            let place = CONTACT_POINTS + k;
            let spins = spins.as_mut().map(|spins| &mut spins[place]);
            self.bits.acts[place] = used & self.frictions[k].make(tangent, arms, &sides, spins);
            self.tangents[k] = words(tangent);
        }
        let cosine = dot(unit(sub(position_b, position_a)), unit(arms[0]));
        let one_static = used & (statics[0] | statics[1]);
        self.bits.damped = cosine.above(splat(SPIN_COSINE)) | one_static;
        self.normal = words(n);
        self.impulses = [[0.0; LANES]; CONTACT_POINTS];
        let Some(given) = given else { return };
        for (lane, member) in members.iter().enumerate().filter(|(_, member)| **member != NONE) {
            let came = records.given(*member as usize);
            for (words, word) in given.as_flattened_mut().iter_mut().zip(came.as_flattened()) {
                words[lane] = *word;
            }
        }
    }

    /// The impulses of a lane.
    pub(super) fn impulses_of(&self, lane: usize) -> [f32; CONTACT_POINTS] {
        self.impulses.each_ref().map(|words| words[lane])
    }

    /// One pass over the collisions; in a warm one the given impulses take the place of the
    /// computed ones.
    ///
    /// # Safety
    ///
    /// The block's rows and the spare one are below the number of rows at `bodies`. During the call
    /// no other thread writes the block's rows, and none reads the rows of its moving bodies or the
    /// spare one.
    #[inline(always)]
    pub(super) unsafe fn pass<I: Instructions>(
        &mut self,
        instructions: I,
        stage: Stage,
        damping: f32,
        beside: Beside<&Spins, &Given>,
        bodies: *mut BodyRow,
        spare: u32,
    ) {
        // SAFETY: the caller promises that the rows of side A exist, and that no other thread
        // writes them.
        let a = unsafe { F32s::gather(instructions, bodies, &self.rows[0]) };
        // SAFETY: the caller promises that the rows of side B exist, and that no other thread
        // writes them.
        let b = unsafe { F32s::gather(instructions, bodies, &self.rows[1]) };
        let mut sides = [a, b].map(Side::of);
        if stage.contact {
            self.contact(instructions, beside, &mut sides);
        } else {
            self.friction(instructions, stage, damping, beside, &mut sides);
        }
        for ((side, rows), moves) in sides.iter().zip(&self.rows).zip(self.bits.moves) {
            let mut rows = *rows;
            if moves != ALL {
                for (lane, row) in rows.iter_mut().enumerate() {
                    *row = if moves >> lane & 1 != 0 { *row } else { spare };
                }
            }
            // SAFETY: the rows are of moving bodies, or the spare one: the caller promises that
            // they exist, and that no other thread accesses them.
            unsafe { F32s::scatter(side.columns(), bodies, &rows) };
        }
    }

    #[inline(always)]
    fn contact<I: Instructions>(
        &mut self,
        instructions: I,
        Beside { spins, given }: Beside<&Spins, &Given>,
        sides: &mut [Side<I>; 2],
    ) {
        let n = vector(instructions, &self.normal);
        let pushes = [times(n, sides[0].m), times(neg(n), sides[1].m)];
        for k in 0..CONTACT_POINTS {
            let acts = self.bits.acts[k];
            if acts == 0 {
                continue;
            }
            let row = Moments::of(instructions, &self.contacts[k], spins.map(|s| &s[k]), sides);
            let before = load(instructions, &self.impulses[k]);
            let after = match given {
                Some(given) => load(instructions, &given[0][k]),
                None => {
                    let bias = load(instructions, &self.bias[k]);
                    let wanted = (row.speed(n, sides) + bias) * row.jacobian;
                    (before + wanted).larger(F32s::splat(instructions, 0.0))
                }
            };
            self.impulses[k] = after.or(acts, before).to_array();
            row.apply(acts, after - before, pushes, sides);
        }
    }

    #[inline(always)]
    fn friction<I: Instructions>(
        &mut self,
        instructions: I,
        stage: Stage,
        damping: f32,
        Beside { spins, given }: Beside<&Spins, &Given>,
        sides: &mut [Side<I>; 2],
    ) {
        if stage.turning {
            let [l0, l1, l2, l3] = self.impulses.each_ref().map(|words| load(instructions, words));
            self.impulses = [[0.0; LANES]; CONTACT_POINTS];
            self.impulses[0] = (((l0 + l1) + l2) + l3).to_array();
        }
        let limit = load(instructions, &self.friction) * load(instructions, &self.impulses[0]);
        for k in 0..FRICTION {
            let place = CONTACT_POINTS + k;
            let acts = self.bits.acts[place];
            if acts == 0 {
                continue;
            }
            let t = vector(instructions, &self.tangents[k]);
            let spins = spins.map(|spins| &spins[place]);
            let row = Moments::of(instructions, &self.frictions[k], spins, sides);
            let before = load(instructions, &self.impulses[1 + k]);
            let after = match given {
                Some(given) => load(instructions, &given[1][k]),
                None => {
                    let wanted = row.speed(t, sides) * row.jacobian;
                    (before + wanted).larger(-limit).smaller(limit)
                }
            };
            self.impulses[1 + k] = after.or(acts, before).to_array();
            let pushes = [times(t, sides[0].m), times(neg(t), sides[1].m)];
            row.apply(acts, after - before, pushes, sides);
        }
        if given.is_none() && self.bits.damped != 0 {
            let q = neg(vector(instructions, &self.normal));
            let share = F32s::splat(instructions, damping);
            for side in sides {
                let slower = sub(side.w, times(q, dot(q, side.w) * share));
                side.w = either(self.bits.damped, slower, side.w);
            }
        }
    }
}

/// The inverse masses and inertias of the bodies of one side.
struct Inverse<I: Instructions> {
    m: F32s<I>,
    k: F32s<I>,
    about_axes: Option<[[F32s<I>; 4]; 2]>,
}

impl<I: Instructions> Inverse<I> {
    #[inline(always)]
    fn of(instructions: I, rows: &Words<u32>, scene: Scene<'_>) -> Self {
        let columns = |from: &[[Quad; 2]], half: usize| {
            F32s::columns(instructions, |lane| from[rows[lane] as usize][half])
        };
        let ([.., m], [.., k]) = (columns(scene.bodies, 0), columns(scene.bodies, 1));
        let about_axes = match scene.inertias {
            [] => None,
            inertias => Some([columns(inertias, 0), columns(inertias, 1)]),
        };
        Self { m, k, about_axes }
    }

    #[inline(always)]
    fn times(&self, moment: Vector<I>) -> Vector<I> {
        let Some([[xx, yy, zz, _], [xy, xz, yz, _]]) = self.about_axes else {
            return times(moment, self.k);
        };
        let [of_x, of_y, of_z] = [[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]];
        add(add(times(of_x, moment[0]), times(of_y, moment[1])), times(of_z, moment[2]))
    }
}

/// The bodies of one side.
#[derive(Clone, Copy)]
struct Side<I: Instructions> {
    v: Vector<I>,
    m: F32s<I>,
    w: Vector<I>,
    k: F32s<I>,
}

impl<I: Instructions> Side<I> {
    /// The bodies whose rows have these columns.
    #[inline(always)]
    fn of([x, y, z, m, p, q, r, k]: [F32s<I>; 8]) -> Self {
        Self { v: [x, y, z], m, w: [p, q, r], k }
    }

    #[inline(always)]
    fn columns(&self) -> [F32s<I>; 8] {
        let Self { v: [x, y, z], m, w: [p, q, r], k } = *self;
        [x, y, z, m, p, q, r, k]
    }
}

impl Row {
    /// Makes the row of a direction; `spins` receives the products with inertias about world axes.
    /// Returns the lanes in which it can act.
    #[inline(always)]
    fn make<I: Instructions>(
        &mut self,
        direction: Vector<I>,
        arms: [Vector<I>; 2],
        [a, b]: &[Inverse<I>; 2],
        spins: Option<&mut [[Words; 3]; 2]>,
    ) -> u32 {
        let moment_a = cross(arms[0], direction);
        let moment_b = neg(cross(arms[1], direction));
        let (spin_a, spin_b) = (a.times(moment_a), b.times(moment_b));
        let denominator = ((a.m + dot(spin_a, moment_a)) + b.m) + dot(spin_b, moment_b);
        // The mass of side A has the instructions.
        let jacobian = a.m.like(-1.0) / denominator;
        self.moments = [words(moment_a), words(moment_b)];
        self.jacobian = jacobian.to_array();
        if let Some(spins) = spins {
            *spins = [words(spin_a), words(spin_b)];
        }
        !jacobian.is(jacobian.like(0.0))
    }
}

/// A row while a pass takes it.
struct Moments<I: Instructions> {
    moments: [Vector<I>; 2],
    /// The products of the inverse inertias and the moments.
    spins: [Vector<I>; 2],
    jacobian: F32s<I>,
}

impl<I: Instructions> Moments<I> {
    #[inline(always)]
    fn of(
        instructions: I,
        row: &Row,
        spins: Option<&[[Words; 3]; 2]>,
        sides: &[Side<I>; 2],
    ) -> Self {
        let moments =
            [vector(instructions, &row.moments[0]), vector(instructions, &row.moments[1])];
        let spins = match spins {
            Some([a, b]) => [vector(instructions, a), vector(instructions, b)],
            None => [times(moments[0], sides[0].k), times(moments[1], sides[1].k)],
        };
        Self { moments, spins, jacobian: load(instructions, &row.jacobian) }
    }

    #[inline(always)]
    fn speed(&self, direction: Vector<I>, [a, b]: &[Side<I>; 2]) -> F32s<I> {
        let [moment_a, moment_b] = self.moments;
        ((dot(direction, a.v) + dot(moment_a, a.w)) + dot(neg(direction), b.v)) + dot(moment_b, b.w)
    }

    /// Applies an impulse where the row acts; `pushes` are the products of the direction (of its
    /// opposite for B) and the inverse masses.
    #[inline(always)]
    fn apply(&self, acts: u32, impulse: F32s<I>, pushes: [Vector<I>; 2], sides: &mut [Side<I>; 2]) {
        for (at, side) in sides.iter_mut().enumerate() {
            let v = add(side.v, times(pushes[at], impulse));
            let w = add(side.w, times(self.spins[at], impulse));
            (side.v, side.w) = (either(acts, v, side.v), either(acts, w, side.w));
        }
    }
}

/// Two unit vectors across each `n`, with one root and one quotient for both branches.
#[inline(always)]
fn tangents<I: Instructions>(instructions: I, [x, y, z]: Vector<I>) -> [Vector<I>; 2] {
    let (zero, one) = (F32s::splat(instructions, 0.0), F32s::splat(instructions, 1.0));
    let steep = z.abs().above(F32s::splat(instructions, TANGENT_Z));
    let (p, q, r) = (y.or(steep, x), z.or(steep, y), x.or(steep, z));
    let s = p * p + q * q;
    let k = one / s.sqrt();
    let (u, v, w) = ((-q) * k, p * k, s * k);
    let (g, h) = ((-r) * v, r * u);
    [either(steep, [zero, u, v], [u, v, zero]), either(steep, [w, g, h], [g, h, w])]
}

#[inline(always)]
fn unit<I: Instructions>(a: Vector<I>) -> Vector<I> {
    let square = dot(a, a);
    times(a, square.like(1.0) / square.sqrt())
}

#[inline(always)]
fn load<I: Instructions>(instructions: I, words: &Words) -> F32s<I> {
    F32s::from_array(instructions, words)
}

#[inline(always)]
fn vector<I: Instructions>(instructions: I, [x, y, z]: &[Words; 3]) -> Vector<I> {
    [load(instructions, x), load(instructions, y), load(instructions, z)]
}

#[inline(always)]
fn words<I: Instructions>([x, y, z]: Vector<I>) -> [Words; 3] {
    [x.to_array(), y.to_array(), z.to_array()]
}

#[inline(always)]
fn add<I: Instructions>(a: Vector<I>, b: Vector<I>) -> Vector<I> {
    [a[0] + b[0], a[1] + b[1], a[2] + b[2]]
}

#[inline(always)]
fn sub<I: Instructions>(a: Vector<I>, b: Vector<I>) -> Vector<I> {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

#[inline(always)]
fn neg<I: Instructions>(a: Vector<I>) -> Vector<I> {
    [-a[0], -a[1], -a[2]]
}

#[inline(always)]
fn times<I: Instructions>(a: Vector<I>, s: F32s<I>) -> Vector<I> {
    [a[0] * s, a[1] * s, a[2] * s]
}

#[inline(always)]
fn dot<I: Instructions>(a: Vector<I>, b: Vector<I>) -> F32s<I> {
    (a[0] * b[0] + a[1] * b[1]) + a[2] * b[2]
}

#[inline(always)]
fn cross<I: Instructions>(a: Vector<I>, b: Vector<I>) -> Vector<I> {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

/// `a` in the lanes whose bits are set, and `b` elsewhere.
#[inline(always)]
fn either<I: Instructions>(bits: u32, a: Vector<I>, b: Vector<I>) -> Vector<I> {
    [a[0].or(bits, b[0]), a[1].or(bits, b[1]), a[2].or(bits, b[2])]
}
