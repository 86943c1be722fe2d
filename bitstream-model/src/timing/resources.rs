//! This file is the account of on-chip memory.
//!
//! Source: thesis §4.4.2 (24 bytes a body and 16 a collision; 4.0 MiB on the XCZU9EG).

use crate::interface::profile::Variant;

/// On-chip memory of a step, bytes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct MemoryUse {
    /// Velocities.
    pub velocities: u64,
    /// Accumulated impulses.
    pub impulses: u64,
    /// Shape indices, in distributed RAM; the thesis has none.
    pub shape_indices: u64,
    /// Block RAM that there is.
    pub capacity: u64,
}

impl MemoryUse {
    /// What that many bodies and collisions take in a variant of a profile.
    #[must_use]
    pub fn new(variant: &Variant, bodies: u64, collisions: u64) -> Self {
        let memory = variant.profile.memory;
        Self {
            velocities: bodies * u64::from(variant.bytes_per_body()),
            impulses: collisions * u64::from(variant.bytes_per_collision()),
            shape_indices: bodies * u64::from(memory.shape_index_bytes),
            capacity: memory.bytes.into(),
        }
    }

    /// Block RAM used.
    #[must_use]
    pub const fn block_ram(&self) -> u64 {
        self.velocities + self.impulses
    }

    /// Whether it fits.
    #[must_use]
    pub const fn fits(&self) -> bool {
        self.block_ram() <= self.capacity
    }

    /// Collisions that fit beside that many bodies.
    #[must_use]
    pub fn collisions_beside(variant: &Variant, bodies: u64) -> u64 {
        let memory = variant.profile.memory;
        let left =
            u64::from(memory.bytes).saturating_sub(bodies * u64::from(variant.bytes_per_body()));
        left / u64::from(variant.bytes_per_collision())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::interface::profile::FLOAT;

    #[test]
    fn float_takes_the_thesis_2_83_of_4_0_mib() {
        let memory = MemoryUse::new(&FLOAT.default_variant(), 38_880, 127_000);
        assert_eq!(memory.block_ram(), 2_965_120);
        let mib = memory.block_ram() as f64 / f64::from(1 << 20);
        assert!((mib - 2.83).abs() < 0.005, "{mib}");
        assert!((memory.capacity as f64 / f64::from(1 << 20) - 4.0).abs() < 1e-9);
        assert!(memory.fits());
    }

    #[test]
    fn the_full_scene_has_room_for_203_822_collisions() {
        let most = MemoryUse::collisions_beside(&FLOAT.default_variant(), 38_881);
        assert_eq!(most, 203_822);
        assert!(MemoryUse::new(&FLOAT.default_variant(), 38_881, most).fits());
        assert!(!MemoryUse::new(&FLOAT.default_variant(), 38_881, most + 1).fits());
    }
}
