//! The passes of a step over its collisions.

use super::StepParameters;

/// The passes of a step over its collisions.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(crate) struct Passes {
    /// Contact passes, with the warm one.
    pub(crate) contact: u32,
    /// Friction passes, with the warm one.
    pub(crate) friction: u32,
    /// Whether the first pass of each kind brings the impulses to begin with.
    pub(crate) warm: bool,
    /// Whether the impulses go out.
    pub(crate) impulses_out: bool,
}

impl Passes {
    /// The number of passes of both kinds.
    pub(crate) const fn total(self) -> u64 {
        self.contact as u64 + self.friction as u64
    }

    /// Whether a pass, counted over both kinds from 0, brings impulses.
    pub(crate) const fn is_warm(self, pass: u64) -> bool {
        self.warm && (pass == 0 || pass == self.contact as u64)
    }

    /// The number of kinds whose impulses go out.
    pub(crate) const fn kinds_out(self) -> usize {
        match self.impulses_out {
            true => (self.contact > 0) as usize + (self.friction > 0) as usize,
            false => 0,
        }
    }
}

impl StepParameters {
    /// Passes over the collisions.
    pub(crate) fn passes(&self) -> Passes {
        let Self { warm_start: warm, impulses_out, .. } = *self;
        let of = |iterations: u32| iterations.saturating_add(u32::from(warm && iterations > 0));
        Passes {
            contact: of(self.contact_iterations),
            friction: of(self.friction_iterations),
            warm,
            impulses_out,
        }
    }
}
