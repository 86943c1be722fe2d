//! Abilities that interface version 1.2 adds, each with a bit in FEATURES.
//!
//! A bitstream of version 1.1 has none of them, and reads 0 in all of their bits.

use super::control::features;
use super::profile::Variant;
use super::register::Field;

/// The abilities of a bitstream beyond version 1.1.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Extensions {
    /// The share of the spin that a friction pass takes away is an argument.
    pub spin_damping: bool,
}

impl Extensions {
    /// None: a bitstream of version 1.1.
    pub const NONE: Self = Self { spin_damping: false };
    /// All of this version.
    pub const ALL: Self = Self { spin_damping: true };

    /// The extensions that the FEATURES register reports.
    #[must_use]
    pub fn reported(features: u32) -> Self {
        Self { spin_damping: features::SPIN_DAMPING.is_set(features) }
    }

    /// Their bits of the FEATURES register.
    #[must_use]
    pub fn features(self) -> u32 {
        let bit = |field: Field, on: bool| field.put(0, on.into());
        bit(features::SPIN_DAMPING, self.spin_damping)
    }

    /// The extensions that a bitstream of a variant can have.
    #[must_use]
    pub const fn possible(_variant: &Variant) -> Self {
        Self { spin_damping: true }
    }

    /// The extensions that are in both.
    #[must_use]
    pub const fn and(self, other: Self) -> Self {
        Self { spin_damping: self.spin_damping && other.spin_damping }
    }
}
