//! The work on one record: a body as it comes in, a collision in one pass, a body as it leaves.

use super::Accelerator;
use super::arithmetic::inertia;
use super::arithmetic::number::{Format, Half, HalfFlushed, Number, Single, SingleFlushed};
use super::integrate::integrate;
use super::records::array::Row;
use super::records::decode::{self, Collision};
use super::records::segment::{Beats, PacketError, Reader};
use super::solver::{self, Impulses, Mass};
use super::state::{Pose, Velocity};
use crate::cast::register;
use crate::config::Subnormals;
use pgs_interface::control::{ErrorCode, IMPULSE_SUM_FRACTION_BITS};
use pgs_interface::number::{Precision, StreamFormat};
use pgs_interface::profile::Inertia;
use pgs_interface::record::{result, velocity};

/// Rounds toward zero and saturates, as the accumulator does.
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "saturates")]
fn to_fixed(value: f64) -> u64 {
    value as u64
}

/// The sum of a collision's normal impulses after the last contact pass, as the accumulator adds
/// it.
#[inline]
pub(crate) fn fixed_impulse<U: Format>(impulses: &Impulses) -> u64 {
    let sum = f64::from(solver::normal_sum::<U>(impulses));
    to_fixed(sum * f64::from(1_u32 << IMPULSE_SUM_FRACTION_BITS))
}

/// A body as it is loaded.
#[derive(Debug, Clone, Copy)]
pub(super) struct Arrival {
    pub(super) velocity: Velocity,
    pub(super) shape: u8,
    pub(super) inverse_mass: f32,
    /// With world inertia.
    pub(super) inertia: inertia::Stored,
}

impl Accelerator {
    /// Numbers as an on-chip array of that precision holds them.
    #[inline]
    fn stored<const N: usize>(&self, precision: Precision, numbers: [f32; N]) -> [f32; N] {
        fn rounded<F: Format, const N: usize>(numbers: [f32; N]) -> [f32; N] {
            numbers.map(|number| Number::<F>::new(number).value())
        }
        match (precision, self.config.subnormals) {
            // The array holds the arithmetic's results unchanged.
            (Precision::F32, _) => numbers,
            (Precision::Binary16, Subnormals::Keep) => rounded::<Half, N>(numbers),
            (Precision::Binary16, Subnormals::Flush) => rounded::<HalfFlushed, N>(numbers),
        }
    }

    #[inline]
    pub(super) fn stored_velocity(&self, velocity: Velocity) -> Velocity {
        let precision = self.variant.numbers.velocities;
        Velocity {
            linear: self.stored(precision, velocity.linear),
            angular: self.stored(precision, velocity.angular),
        }
    }

    /// Reads the velocity record of body `body`, which is next, as the on-chip arrays hold it.
    pub(super) fn arrival(
        &self,
        body: usize,
        reader: &mut Reader<'_, impl Beats>,
    ) -> Result<Arrival, PacketError> {
        let format = self.variant.numbers.bodies;
        let ((velocity, shape), inertia, streamed) = match self.variant.inertia {
            Inertia::Isotropic => {
                let rows = reader.record::<{ velocity::ROWS }>();
                (decode::velocity(format, &rows), [0.0; 6], None)
            }
            Inertia::World => {
                let rows = reader.record::<{ velocity::WORLD_ROWS }>();
                let inertia = decode::world_inertia(format, &rows);
                let streamed = decode::inverse_mass(format, &rows);
                let streamed = self.arguments.streamed_masses.then_some(streamed);
                let rows = [rows[velocity::LINEAR], rows[velocity::ANGULAR]];
                let inertia = self.stored(self.variant.numbers.velocities, inertia);
                (decode::velocity(format, &rows), inertia, streamed)
            }
        };
        // A body that brings its mass needs no shape.
        let shape = if streamed.is_some() { 0 } else { shape };
        let known = (shape as usize) < self.registers.shapes().len();
        let Some(shape) = u8::try_from(shape).ok().filter(|_| known) else {
            return Err(PacketError {
                code: ErrorCode::ShapeIndex,
                channel: 0,
                beat: register(body),
            });
        };
        // The words of a static body are ignored.
        let of_shape = || self.registers.shapes()[usize::from(shape)].inverse_mass;
        let inverse_mass = streamed.unwrap_or_else(of_shape);
        let moves = inverse_mass != 0.0;
        let velocity =
            if moves || self.arguments.kinematic { velocity } else { Velocity::default() };
        let velocity = self.stored_velocity(velocity);
        Ok(Arrival { velocity, shape, inverse_mass, inertia })
    }

    /// Mass properties of a loaded body.
    #[inline]
    pub(crate) fn mass_of(&self, body: usize) -> Mass {
        let inertia = self.inertias.get(body).copied().unwrap_or_default();
        let mass = self.mass(self.shape_of[body], inertia);
        match self.inverse_masses.get(body) {
            Some(inverse_mass) => Mass { inverse_mass: *inverse_mass, ..mass },
            None => mass,
        }
    }

    /// Whether a body moves.
    #[inline]
    pub(super) fn moves(&self, body: usize) -> bool {
        let of_shape = || self.registers.shapes()[usize::from(self.shape_of[body])].inverse_mass;
        self.inverse_masses.get(body).copied().unwrap_or_else(of_shape) != 0.0
    }

    /// The record that a body leaves with; its pose is next.
    #[inline]
    pub(crate) fn result(
        &self,
        body: usize,
        reader: &mut Reader<'_, impl Beats>,
    ) -> [Row; result::ROWS] {
        let format = self.variant.numbers.poses;
        let pose = decode::pose(format, &reader.record());
        let (pose, velocity) = self.integrated(self.moves(body), pose, self.velocities[body]);
        decode::result(format, &pose, &velocity)
    }

    /// Mass properties of a body: its shape's, with world inertia its own inertia.
    #[inline]
    pub(super) fn mass(&self, shape: u8, inertia: inertia::Stored) -> Mass {
        let shape = self.registers.shapes()[usize::from(shape)];
        let inverse_inertia = match self.variant.inertia {
            Inertia::Isotropic => [shape.inverse_inertia, 0.0, 0.0, 0.0, 0.0, 0.0],
            Inertia::World => inertia,
        };
        Mass { inverse_mass: shape.inverse_mass, inverse_inertia }
    }

    /// Computes a pass over one collision: velocities and impulses become the ones written back.
    #[inline]
    pub(super) fn compute<R: Format, U: Format, I: inertia::Inertia>(
        &mut self,
        pass: u32,
        collision: &Collision,
        masses: &[Mass; 2],
        velocities: &mut [Velocity; 2],
        impulses: &mut Impulses,
    ) {
        let parameters = &self.arguments.solver;
        let contacts = self.arguments.contact_passes();
        let given = self.arguments.is_warm(pass).then_some(&collision.impulses);
        let precision = self.variant.numbers.impulses;
        if pass < contacts {
            solver::contact::<R, U, I>(collision, parameters, masses, velocities, impulses, given);
            *impulses = self.stored(precision, *impulses);
            if pass + 1 == contacts {
                self.counters.impulse_sum =
                    self.counters.impulse_sum.saturating_add(fixed_impulse::<U>(impulses));
            }
        } else {
            if pass == contacts {
                let sum = solver::normal_sum::<U>(impulses);
                *impulses = self.stored(precision, [sum, 0.0, 0.0, 0.0]);
            }
            solver::friction::<R, U, I>(collision, parameters, masses, velocities, impulses, given);
            *impulses = self.stored(precision, *impulses);
        }
        *velocities = velocities.map(|velocity| self.stored_velocity(velocity));
    }

    /// The pose and velocity that a body leaves with. `free` tells whether its inverse mass is not
    /// 0.
    pub(super) fn integrated(
        &self,
        free: bool,
        pose: Pose,
        velocity: Velocity,
    ) -> (Pose, Velocity) {
        if !self.arguments.integrate || !(free || self.is_under_way(&velocity)) {
            return (pose, velocity);
        }
        let numbers = self.variant.numbers;
        let precision = match numbers.poses {
            // A position in f32 moves by less than a binary16 step.
            StreamFormat::F32 => Precision::F32,
            StreamFormat::Binary16 => numbers.updates,
        };
        let step = match (precision, self.config.subnormals) {
            (Precision::F32, Subnormals::Keep) => integrate::<Single>,
            (Precision::F32, Subnormals::Flush) => integrate::<SingleFlushed>,
            (Precision::Binary16, Subnormals::Keep) => integrate::<Half>,
            (Precision::Binary16, Subnormals::Flush) => integrate::<HalfFlushed>,
        };
        if free {
            step(&self.arguments.integration, &pose, &velocity)
        } else {
            let (pose, _) = step(&self.arguments.integration.undamped(), &pose, &velocity);
            (pose, velocity)
        }
    }

    /// Whether a velocity is not 0.
    fn is_under_way(&self, velocity: &Velocity) -> bool {
        let numbers = [velocity.linear, velocity.angular];
        let zero = match self.config.subnormals {
            Subnormals::Keep => |number: f32| number == 0.0,
            Subnormals::Flush => |number: f32| number.abs() < f32::MIN_POSITIVE,
        };
        !numbers.as_flattened().iter().all(|number| zero(*number))
    }
}
