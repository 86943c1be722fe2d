//! The passes of a step and their kinds, and a pass over one collision.

use crate::accelerator::arithmetic::inertia::{Inertia, Stored};
use crate::accelerator::arithmetic::number::Format;
use crate::accelerator::per_record::fixed_impulse;
use crate::accelerator::records::decode::Collision;
use crate::accelerator::solver::{self, Impulses, Mass, SolverParameters, Velocity};

/// The kind of a pass.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Stage {
    pub(crate) contact: bool,
    /// The last contact pass, which counts its impulses, or the first friction pass, which adds the
    /// impulses of each collision.
    pub(crate) turning: bool,
    /// Given impulses take the place of the computed ones.
    pub(crate) warm: bool,
}

/// The passes of a step, numbered from 0.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Plan<'a> {
    /// How many are contact passes: the first ones.
    pub(crate) contact: u32,
    /// Whether impulses are given to the first pass of each kind.
    pub(crate) warm: bool,
    pub(crate) parameters: &'a SolverParameters,
}

impl Plan<'_> {
    pub(crate) fn stage(&self, pass: u32) -> Stage {
        let contact = pass < self.contact;
        let turning = if contact { pass + 1 == self.contact } else { pass == self.contact };
        Stage { contact, turning, warm: self.warm && (pass == 0 || pass == self.contact) }
    }

    /// Whether a pass damps spins.
    pub(crate) fn damps(&self, pass: u32) -> bool {
        pass >= self.contact && !self.stage(pass).warm
    }
}

impl Stage {
    /// The pass over one collision, which may have brought impulses; returns its share of the impulse
    /// sum.
    pub(crate) fn solve<F: Format, I: Inertia>(
        self,
        collision: &Collision,
        parameters: &SolverParameters,
        masses: &[Mass; 2],
        velocities: &mut [Velocity; 2],
        impulses: &mut Impulses,
    ) -> u64 {
        // Without a warm start this is the same code as if none existed.
        if self.warm {
            return self
                .solve_with::<F, I, true>(collision, parameters, masses, velocities, impulses);
        }
        self.solve_with::<F, I, false>(collision, parameters, masses, velocities, impulses)
    }

    #[inline(always)]
    fn solve_with<F: Format, I: Inertia, const WARM: bool>(
        self,
        collision: &Collision,
        parameters: &SolverParameters,
        masses: &[Mass; 2],
        velocities: &mut [Velocity; 2],
        impulses: &mut Impulses,
    ) -> u64 {
        let given = if WARM { Some(&collision.impulses) } else { None };
        if self.contact {
            solver::contact::<F, F, I>(collision, parameters, masses, velocities, impulses, given);
            return if self.turning { fixed_impulse::<F>(impulses) } else { 0 };
        }
        if self.turning {
            *impulses = [solver::normal_sum::<F>(impulses), 0.0, 0.0, 0.0];
        }
        solver::friction::<F, F, I>(collision, parameters, masses, velocities, impulses, given);
        0
    }
}

/// The shapes, masses and inertias of the bodies of a step.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Properties<'a> {
    pub(crate) shape_of: &'a [u8],
    /// The mass properties of each shape.
    pub(crate) masses: &'a [Mass],
    /// With streamed masses that of each body.
    pub(crate) inverse_masses: &'a [f32],
    /// With world inertia that of each body.
    pub(crate) inertias: &'a [Stored],
}

#[cfg(test)]
impl<'a> Properties<'a> {
    /// Bodies with the mass properties of their shapes.
    pub(crate) const fn of_shapes(shape_of: &'a [u8], masses: &'a [Mass]) -> Self {
        Self { shape_of, masses, inverse_masses: &[], inertias: &[] }
    }
}

impl Properties<'_> {
    /// The mass properties of a body.
    pub(crate) fn mass(&self, body: usize) -> Mass {
        let mut mass = self.masses[usize::from(self.shape_of[body])];
        if let Some(inertia) = self.inertias.get(body) {
            mass.inverse_inertia = *inertia;
        }
        if let Some(inverse_mass) = self.inverse_masses.get(body) {
            mass.inverse_mass = *inverse_mass;
        }
        mass
    }

    /// Whether a body moves.
    pub(crate) fn moves(&self, body: usize) -> bool {
        let of_shape = || self.masses[usize::from(self.shape_of[body])].inverse_mass;
        self.inverse_masses.get(body).copied().unwrap_or_else(of_shape) != 0.0
    }
}
