//! Solver of one collision in one pass: contact or friction, as Bullet's host code does.
//!
//! The conversion from the raw contact to the constraint row (effective mass, bias) is part of
//! both, so that a pass needs nothing but the collision, the velocities and the accumulated
//! impulses. The row is computed in the format `R`, the changing values (relative speed, impulse,
//! velocities) in `U`, which holds every number of `R`.
//!
//! Source: Bullet (b3ContactSolver of the OpenCL pipeline's host reference), in the golden vectors'
//! order of evaluation.

use super::arithmetic::inertia::{Inertia, Stored, Times};
use super::arithmetic::number::{Format, Number};
use super::arithmetic::vector::Vec3;
use super::records::decode::Collision;
use super::state::Velocity;
use pgs_interface::profile::solver::{SPIN_COSINE, TANGENT_Z};
use pgs_interface::record::CONTACT_POINTS;

/// Mass properties of a body.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Mass {
    pub(crate) inverse_mass: f32,
    pub(crate) inverse_inertia: Stored,
}

/// Accumulated impulses of a collision, as they lie in block RAM: four normal impulses during the
/// contact passes; during the friction passes their sum, then the two friction impulses.
pub(crate) type Impulses = [f32; CONTACT_POINTS];

/// Parameters that both solvers need.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct SolverParameters {
    pub(crate) time_step: f32,
    pub(crate) drift: f32,
    pub(crate) coefficient: f32,
    pub(crate) friction: f32,
    /// Share of the spin that a friction pass takes away.
    pub(crate) spin_damping: f32,
    /// Whether each collision has a friction of its own, in place of `friction`.
    pub(crate) pair_friction: bool,
}

/// Inverse mass and inertia in numbers of a format.
#[derive(Clone, Copy)]
struct Inverse<F: Format, I: Inertia> {
    m: Number<F>,
    k: I::In<F>,
}

impl<F: Format, I: Inertia> Inverse<F, I> {
    #[inline]
    fn new(mass: &Mass) -> Self {
        Self { m: Number::new(mass.inverse_mass), k: Times::new(&mass.inverse_inertia) }
    }
}

/// One body while a collision is being solved.
#[derive(Clone, Copy)]
struct Moving<U: Format, I: Inertia> {
    v: Vec3<U>,
    w: Vec3<U>,
    inverse: Inverse<U, I>,
}

impl<U: Format, I: Inertia> Moving<U, I> {
    #[inline]
    fn new(velocity: &Velocity, mass: &Mass) -> Self {
        Self {
            v: Vec3::new(velocity.linear),
            w: Vec3::new(velocity.angular),
            inverse: Inverse::new(mass),
        }
    }

    #[inline]
    fn velocity(&self) -> Velocity {
        Velocity { linear: self.v.values(), angular: self.w.values() }
    }
}

/// One constraint row: a direction, and the lever arms' moments about it.
#[derive(Debug, Clone, Copy)]
struct Row<F> {
    direction: Vec3<F>,
    moment_a: Vec3<F>,
    moment_b: Vec3<F>,
    /// Effective mass, negative.
    jacobian: Number<F>,
}

impl<R: Format> Row<R> {
    #[inline]
    fn new<I: Inertia>(
        direction: Vec3<R>,
        arm_a: Vec3<R>,
        arm_b: Vec3<R>,
        [a, b]: &[Inverse<R, I>; 2],
    ) -> Self {
        let moment_a = arm_a.cross(direction);
        let moment_b = -arm_b.cross(direction);
        let denominator =
            ((a.m + a.k.times(moment_a).dot(moment_a)) + b.m) + b.k.times(moment_b).dot(moment_b);
        Self { direction, moment_a, moment_b, jacobian: Number::new(-1.0) / denominator }
    }

    /// The row in the format of the changing values.
    #[inline]
    fn widened<U: Format>(&self) -> Row<U> {
        Row {
            direction: self.direction.widened(),
            moment_a: self.moment_a.widened(),
            moment_b: self.moment_b.widened(),
            jacobian: self.jacobian.widened(),
        }
    }
}

impl<U: Format> Row<U> {
    /// Relative velocity along the row.
    #[inline]
    fn speed<I: Inertia>(&self, a: &Moving<U, I>, b: &Moving<U, I>) -> Number<U> {
        ((self.direction.dot(a.v) + self.moment_a.dot(a.w)) + (-self.direction).dot(b.v))
            + self.moment_b.dot(b.w)
    }

    #[inline]
    fn apply<I: Inertia>(&self, impulse: Number<U>, a: &mut Moving<U, I>, b: &mut Moving<U, I>) {
        a.v = a.v + (self.direction * a.inverse.m) * impulse;
        a.w = a.w + a.inverse.k.times(self.moment_a) * impulse;
        b.v = b.v + ((-self.direction) * b.inverse.m) * impulse;
        b.w = b.w + b.inverse.k.times(self.moment_b) * impulse;
    }
}

/// Two unit vectors at right angles to `n` and to each other.
#[inline]
fn tangents<R: Format>(n: Vec3<R>) -> [Vec3<R>; 2] {
    let zero = Number::new(0.0);
    let one = Number::new(1.0);
    let Vec3(x, y, z) = n;
    let absolute_z = if zero.above(z) { -z } else { z };
    if absolute_z.above(Number::new(TANGENT_Z)) {
        let s = y * y + z * z;
        let k = one / s.sqrt();
        let t0 = Vec3(zero, -z * k, y * k);
        let t1 = Vec3(s * k, -x * t0.2, x * t0.1);
        [t0, t1]
    } else {
        let s = x * x + y * y;
        let k = one / s.sqrt();
        let t0 = Vec3(-y * k, x * k, zero);
        let t1 = Vec3(-z * t0.1, z * t0.0, s * k);
        [t0, t1]
    }
}

/// One contact pass over one collision. In a warm pass `given` takes the place of the impulses that
/// the others compute.
#[inline]
pub(crate) fn contact<R: Format, U: Format, I: Inertia>(
    collision: &Collision,
    parameters: &SolverParameters,
    masses: &[Mass; 2],
    velocities: &mut [Velocity; 2],
    impulses: &mut Impulses,
    given: Option<&Impulses>,
) {
    let inverses = [Inverse::<R, I>::new(&masses[0]), Inverse::new(&masses[1])];
    let mut a = Moving::<U, I>::new(&velocities[0], &masses[0]);
    let mut b = Moving::<U, I>::new(&velocities[1], &masses[1]);
    let n = Vec3::<R>::new(collision.normal);
    let position_a = Vec3::<R>::new(collision.position_a);
    let position_b = Vec3::<R>::new(collision.position_b);
    let per_second = Number::<R>::new(1.0) / Number::new(parameters.time_step);
    let drift = Number::<R>::new(parameters.drift);
    let coefficient = Number::<R>::new(parameters.coefficient);
    let contacts = &collision.contacts[..collision.count];
    for (i, ([x, y, z, distance], impulse)) in contacts.iter().copied().zip(impulses).enumerate() {
        let point = Vec3::<R>::new([x, y, z]);
        let row = Row::new(n, point - position_a, point - position_b, &inverses);
        if row.jacobian.is_zero() {
            continue;
        }
        let bias = ((Number::new(distance) + drift) * coefficient) * per_second;
        let row = row.widened::<U>();
        let wanted = (row.speed(&a, &b) + bias.widened()) * row.jacobian;
        let before = Number::new(*impulse);
        let after = match given {
            Some(given) => Number::new(given[i]),
            None => (before + wanted).larger(Number::new(0.0)),
        };
        *impulse = after.value();
        row.apply(after - before, &mut a, &mut b);
    }
    *velocities = [a.velocity(), b.velocity()];
}

/// Sum of the four normal impulses, as the friction passes use it.
#[inline]
pub(crate) fn normal_sum<U: Format>(impulses: &Impulses) -> f32 {
    let [l0, l1, l2, l3] = impulses.map(Number::<U>::new);
    (((l0 + l1) + l2) + l3).value()
}

/// One friction pass over one collision; `impulses` holds the normal sum and the two friction
/// impulses. In a warm pass the first two of `given` take the place of the impulses that the others
/// compute, and the spin stays.
#[inline]
pub(crate) fn friction<R: Format, U: Format, I: Inertia>(
    collision: &Collision,
    parameters: &SolverParameters,
    masses: &[Mass; 2],
    velocities: &mut [Velocity; 2],
    impulses: &mut Impulses,
    given: Option<&Impulses>,
) {
    let inverses = [Inverse::<R, I>::new(&masses[0]), Inverse::new(&masses[1])];
    let mut a = Moving::<U, I>::new(&velocities[0], &masses[0]);
    let mut b = Moving::<U, I>::new(&velocities[1], &masses[1]);
    let q = -Vec3::<R>::new(collision.normal);
    let position_a = Vec3::<R>::new(collision.position_a);
    let position_b = Vec3::<R>::new(collision.position_b);
    let point = |i: usize| {
        let [x, y, z, _] = collision.contacts[i];
        Vec3::<R>::new([x, y, z])
    };
    let mut sum = point(0);
    for i in 1..collision.count {
        sum = sum + point(i);
    }
    // At most four points: exact.
    let centre = sum * (Number::new(1.0) / Number::new(collision.count as f32));
    let arm_a = centre - position_a;
    let arm_b = centre - position_b;
    let mu = match parameters.pair_friction {
        true => Number::<U>::new(collision.friction),
        false => Number::new(parameters.friction),
    };
    let limit = mu * Number::new(impulses[0]);
    for (k, (t, accumulated)) in tangents(q).into_iter().zip(&mut impulses[1..3]).enumerate() {
        let row = Row::new(t, arm_a, arm_b, &inverses);
        if row.jacobian.is_zero() {
            continue;
        }
        let row = row.widened::<U>();
        let wanted = row.speed(&a, &b) * row.jacobian;
        let before = Number::new(*accumulated);
        let after = match given {
            Some(given) => Number::new(given[k]),
            None => (before + wanted).larger(-limit).smaller(limit),
        };
        *accumulated = after.value();
        row.apply(after - before, &mut a, &mut b);
    }
    let cosine = || (position_b - position_a).unit().dot(arm_a.unit());
    let one_static = a.inverse.m.is_zero() || b.inverse.m.is_zero();
    let damps = one_static || cosine().above(Number::new(SPIN_COSINE));
    if given.is_none() && damps {
        let share = Number::new(parameters.spin_damping);
        let q = q.widened::<U>();
        let spin_a = q.dot(a.w);
        let spin_b = q.dot(b.w);
        a.w = a.w - q * (spin_a * share);
        b.w = b.w - q * (spin_b * share);
    }
    *velocities = [a.velocity(), b.velocity()];
}

#[cfg(test)]
#[expect(clippy::float_cmp, reason = "the expected values are exact")]
mod tests {
    use super::*;
    use crate::accelerator::arithmetic::inertia::Isotropic;
    use crate::accelerator::arithmetic::number::Single;

    const UNIT: Mass = Mass { inverse_mass: 1.0, inverse_inertia: [0.0; 6] };
    const GROUND: Mass = Mass { inverse_mass: 0.0, ..UNIT };
    const PARAMETERS: SolverParameters = SolverParameters {
        time_step: 0.5,
        drift: 0.0,
        coefficient: 0.0,
        friction: 0.5,
        spin_damping: 0.1,
        pair_friction: false,
    };

    /// A point mass above the ground, normal from B (the mass) down to A (the ground).
    fn on_the_ground() -> Collision {
        Collision {
            body_a: 0,
            body_b: 1,
            count: 1,
            friction: 0.0,
            normal: [0.0, -1.0, 0.0],
            position_a: [0.0, -1.0, 0.0],
            position_b: [0.0, 1.0, 0.0],
            contacts: [[0.0; 4]; CONTACT_POINTS],
            impulses: [0.0; CONTACT_POINTS],
        }
    }

    fn falling(linear: [f32; 3]) -> [Velocity; 2] {
        [Velocity::default(), Velocity { linear, angular: [0.0; 3] }]
    }

    #[test]
    fn a_contact_takes_the_approaching_velocity_away() {
        let mut velocities = falling([0.0, -3.0, 0.0]);
        let mut impulses = [0.0; 4];
        let masses = [GROUND, UNIT];
        contact::<Single, Single, Isotropic>(
            &on_the_ground(),
            &PARAMETERS,
            &masses,
            &mut velocities,
            &mut impulses,
            None,
        );
        assert_eq!(velocities[1].linear, [0.0, 0.0, 0.0]);
        assert_eq!(impulses, [3.0, 0.0, 0.0, 0.0]);
        assert_eq!(velocities[0], Velocity::default());
    }

    #[test]
    fn a_contact_does_not_pull() {
        let mut velocities = falling([0.0, 3.0, 0.0]);
        let mut impulses = [0.0; 4];
        let masses = [GROUND, UNIT];
        contact::<Single, Single, Isotropic>(
            &on_the_ground(),
            &PARAMETERS,
            &masses,
            &mut velocities,
            &mut impulses,
            None,
        );
        assert_eq!(velocities[1].linear, [0.0, 3.0, 0.0]);
        assert_eq!(impulses, [0.0; 4]);
    }

    #[test]
    fn friction_stops_at_its_share_of_the_normal_impulse() {
        let mut velocities = falling([5.0, 0.0, 0.0]);
        let mut impulses = [3.0, 0.0, 0.0, 0.0];
        let masses = [GROUND, UNIT];
        friction::<Single, Single, Isotropic>(
            &on_the_ground(),
            &PARAMETERS,
            &masses,
            &mut velocities,
            &mut impulses,
            None,
        );
        assert_eq!(velocities[1].linear, [3.5, 0.0, 0.0]);
        let before = velocities;
        friction::<Single, Single, Isotropic>(
            &on_the_ground(),
            &PARAMETERS,
            &masses,
            &mut velocities,
            &mut impulses,
            None,
        );
        assert_eq!(velocities, before, "the limit is used up");
    }

    #[test]
    fn tangents_are_unit_and_across_the_normal_in_both_branches() {
        for n in [[0.0, -1.0, 0.0], [0.6, 0.0, 0.8], [0.0, 0.0, -1.0], [0.48, 0.6, 0.64]] {
            let normal = Vec3::<Single>::new(n);
            let [t0, t1] = tangents(normal);
            for t in [t0, t1] {
                assert!((t.dot(t).value() - 1.0).abs() < 1e-6, "{n:?}");
                assert!(t.dot(normal).value().abs() < 1e-6, "{n:?}");
            }
            assert!(t0.dot(t1).value().abs() < 1e-6, "{n:?}");
        }
    }
}
