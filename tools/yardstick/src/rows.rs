//! Makes constraint rows of records: once a step, because positions, masses and normals do not
//! change during it.

use super::vector::{Vec3, add, cross, dot, negate, scale, subtract, tangents, times, unit};
use super::{Moving, Record};

/// Cosine above which one body lies upon the other, so that their spin about the normal is damped.
const SPIN_COSINE: f32 = 0.95;

/// The contact passes' data of a collision.
#[derive(Debug, Clone, Copy, Default)]
#[repr(C)]
pub(super) struct ContactRows {
    pub(super) normal: Vec3,
    pub(super) body_a: u32,
    pub(super) position_a: Vec3,
    pub(super) body_b: u32,
    pub(super) position_b: Vec3,
    pub(super) count: u32,
    pub(super) points: [Vec3; 4],
    /// Effective masses, negative.
    pub(super) jacobians: [f32; 4],
    /// Speeds that remove the penetration, m/s.
    pub(super) biases: [f32; 4],
    /// Accumulated impulses, N s.
    pub(super) impulses: [f32; 4],
}

/// The friction passes' data of a collision.
#[derive(Debug, Clone, Copy, Default)]
#[repr(C)]
pub(super) struct FrictionRows {
    /// The normal from A to B.
    pub(super) normal: Vec3,
    pub(super) body_a: u32,
    /// From the body's centre to the centre of the points.
    pub(super) arm_a: Vec3,
    pub(super) body_b: u32,
    pub(super) arm_b: Vec3,
    /// Largest impulse, N s; set after the contact passes.
    pub(super) limit: f32,
    pub(super) directions: [Vec3; 2],
    pub(super) jacobians: [f32; 2],
    pub(super) impulses: [f32; 2],
    pub(super) damps_spin: bool,
}

/// Effective mass of a row whose lever arms have these moments, negative.
#[inline]
fn jacobian(a: &Moving, b: &Moving, moment_a: Vec3, moment_b: Vec3) -> f32 {
    let of_a = a.inverse_mass + dot(times(a.inverse_inertia, moment_a), moment_a);
    -1.0 / ((of_a + b.inverse_mass) + dot(times(b.inverse_inertia, moment_b), moment_b))
}

impl ContactRows {
    /// From a record; `drift` in m, `coefficient` the share of penetration to remove, `per_second`
    /// 1 / time step.
    pub(super) fn new(
        record: &Record,
        [a, b]: [&Moving; 2],
        drift: f32,
        coefficient: f32,
        per_second: f32,
    ) -> Self {
        let mut rows = Self {
            normal: record.normal,
            body_a: record.body_a,
            position_a: record.position_a,
            body_b: record.body_b,
            position_b: record.position_b,
            count: record.count,
            ..Self::default()
        };
        for (i, [x, y, z, distance]) in record.used().iter().copied().enumerate() {
            let point = [x, y, z];
            let moment_a = cross(subtract(point, record.position_a), record.normal);
            let moment_b = negate(cross(subtract(point, record.position_b), record.normal));
            rows.points[i] = point;
            rows.jacobians[i] = jacobian(a, b, moment_a, moment_b);
            rows.biases[i] = ((distance + drift) * coefficient) * per_second;
        }
        rows
    }
}

impl FrictionRows {
    pub(super) fn new(record: &Record, [a, b]: [&Moving; 2]) -> Self {
        let point = |[x, y, z, _]: [f32; 4]| [x, y, z];
        let used = record.used();
        let [first, others @ ..] = used else { return Self::default() };
        let sum = others.iter().fold(point(*first), |sum, next| add(sum, point(*next)));
        // At most four points: exact.
        let centre = scale(sum, 1.0 / used.len() as f32);
        let (arm_a, arm_b) =
            (subtract(centre, record.position_a), subtract(centre, record.position_b));
        let normal = negate(record.normal);
        let directions = tangents(normal);
        let jacobians =
            directions.map(|t| jacobian(a, b, cross(arm_a, t), negate(cross(arm_b, t))));
        let upon = || dot(unit(subtract(record.position_b, record.position_a)), unit(arm_a));
        let damps_spin = a.inverse_mass == 0.0 || b.inverse_mass == 0.0 || upon() > SPIN_COSINE;
        Self {
            normal,
            body_a: record.body_a,
            arm_a,
            body_b: record.body_b,
            arm_b,
            limit: 0.0,
            directions,
            jacobians,
            impulses: [0.0; 2],
            damps_spin,
        }
    }
}
