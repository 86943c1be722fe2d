//! Abilities that interface version 1.2 adds, each with a bit in FEATURES.
//!
//! A bitstream of version 1.1 has none of them, and reads 0 in all of their bits.

use super::control::features;
use super::number::StreamFormat;
use super::profile::{Inertia, Variant};
use super::register::Field;

/// The abilities of a bitstream beyond version 1.1.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Extensions {
    /// The share of the spin that a friction pass takes away is an argument.
    pub spin_damping: bool,
    /// Bodies of inverse mass 0 can move.
    pub kinematic: bool,
    /// Each collision can have a friction of its own.
    pub pair_friction: bool,
    /// Impulses of collisions can come in and go out.
    pub warm_start: bool,
    /// Velocity records with world inertia can bring the inverse mass of their body.
    pub streamed_masses: bool,
    /// A step that integrates nothing can do without poses: none come in, and velocities alone go out.
    pub velocities_only: bool,
    /// Each shape can have a friction; the friction of a collision is the product of two.
    pub shape_friction: bool,
}

impl Extensions {
    /// None: a bitstream of version 1.1.
    pub const NONE: Self = Self {
        spin_damping: false,
        kinematic: false,
        pair_friction: false,
        warm_start: false,
        streamed_masses: false,
        velocities_only: false,
        shape_friction: false,
    };
    /// All of this version.
    pub const ALL: Self = Self {
        spin_damping: true,
        kinematic: true,
        pair_friction: true,
        warm_start: true,
        streamed_masses: true,
        velocities_only: true,
        shape_friction: true,
    };

    /// The extensions that the FEATURES register reports.
    #[must_use]
    pub fn reported(features: u32) -> Self {
        Self {
            spin_damping: features::SPIN_DAMPING.is_set(features),
            kinematic: features::KINEMATIC.is_set(features),
            pair_friction: features::PAIR_FRICTION.is_set(features),
            warm_start: features::WARM_START.is_set(features),
            streamed_masses: features::STREAMED_MASSES.is_set(features),
            velocities_only: features::VELOCITIES_ONLY.is_set(features),
            shape_friction: features::SHAPE_FRICTION.is_set(features),
        }
    }

    /// Their bits of the FEATURES register.
    #[must_use]
    pub fn features(self) -> u32 {
        let bit = |field: Field, on: bool| field.put(0, on.into());
        bit(features::SPIN_DAMPING, self.spin_damping)
            | bit(features::KINEMATIC, self.kinematic)
            | bit(features::PAIR_FRICTION, self.pair_friction)
            | bit(features::WARM_START, self.warm_start)
            | bit(features::STREAMED_MASSES, self.streamed_masses)
            | bit(features::VELOCITIES_ONLY, self.velocities_only)
            | bit(features::SHAPE_FRICTION, self.shape_friction)
    }

    /// The extensions that a bitstream of a variant can have. A static body that moves needs its
    /// record, its own position in the records of collisions (a relative one gives it the other
    /// body's), and a zero for a component at rest. A friction needs a contact count of 32 bits beside it.
    /// Impulses need passes one after the other, a stripe for their records, and a number format with a
    /// zero. A streamed mass needs the rows of a world inertia beside it, and an array of numbers for all
    /// bodies. A step without poses needs all velocities on chip at the end of the passes. A friction for
    /// each shape is for collision records without room for a friction, and needs a record, which names
    /// the shape, for static bodies, too.
    #[must_use]
    pub const fn possible(variant: &Variant) -> Self {
        let Variant { profile, numbers, inertia } = variant;
        let pair_friction = matches!(numbers.collisions, StreamFormat::F32);
        Self {
            spin_damping: true,
            kinematic: numbers.bodies.has_zero_and_infinity(),
            pair_friction,
            warm_start: profile.stripes.warm_collisions.is_some()
                && numbers.collisions.has_zero_and_infinity(),
            streamed_masses: matches!(inertia, Inertia::World)
                && matches!(numbers.bodies, StreamFormat::F32),
            velocities_only: true,
            shape_friction: !pair_friction,
        }
    }

    /// The extensions that are in both.
    #[must_use]
    pub const fn and(self, other: Self) -> Self {
        Self {
            spin_damping: self.spin_damping && other.spin_damping,
            kinematic: self.kinematic && other.kinematic,
            pair_friction: self.pair_friction && other.pair_friction,
            warm_start: self.warm_start && other.warm_start,
            streamed_masses: self.streamed_masses && other.streamed_masses,
            velocities_only: self.velocities_only && other.velocities_only,
            shape_friction: self.shape_friction && other.shape_friction,
        }
    }
}
