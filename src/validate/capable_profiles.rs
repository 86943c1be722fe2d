//! Finds the profiles that take a scene which this bitstream refuses.

use std::fmt;

use pgs_interface::profile::{Inertia, PROFILES, Profile, Variant};

/// The profiles, built with their default formats, that take a refused scene: its refused value and
/// its number of bodies and collisions.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct CapableProfiles {
    /// Bit k is profile k of the table.
    profiles: u32,
    inertia: Inertia,
}

const _: () = assert!(PROFILES.len() <= u32::BITS as usize);

impl CapableProfiles {
    /// These profiles, in the order of the table.
    pub fn profiles(&self) -> impl Iterator<Item = &'static Profile> {
        let bits = self.profiles;
        (0..).zip(PROFILES).filter(move |(at, _)| bits >> at & 1 != 0).map(|(_, profile)| *profile)
    }

    /// The inertia with which they must be built for the shapes of the scene.
    #[must_use]
    pub const fn inertia(&self) -> Inertia {
        self.inertia
    }
}

impl fmt::Display for CapableProfiles {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let built = match self.inertia {
            Inertia::Isotropic => "",
            Inertia::World => ", built with world inertia",
        };
        if self.profiles == 0 {
            return write!(f, "no profile could{built}");
        }
        write!(f, "profiles that could{built}")?;
        for (place, profile) in self.profiles().enumerate() {
            let separator = if place == 0 { ": " } else { ", " };
            write!(f, "{separator}{}", profile.name)?;
        }
        Ok(())
    }
}

/// The demands of a scene on any bitstream.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct SceneNeeds {
    /// Number of bodies.
    pub(crate) bodies: usize,
    /// Number of collisions.
    pub(crate) collisions: usize,
    /// The least inertia that its shapes need.
    pub(crate) inertia: Inertia,
}

impl SceneNeeds {
    /// The profiles that have room for the scene and satisfy `can`.
    pub(crate) fn capable(&self, can: &dyn Fn(&Variant) -> bool) -> CapableProfiles {
        let mut profiles = 0;
        for (at, profile) in PROFILES.iter().enumerate() {
            let variant = Variant { inertia: self.inertia, ..profile.default_variant() };
            let built = profile.inertias().contains(&self.inertia);
            profiles |= u32::from(built && self.has_room(&variant) && can(&variant)) << at;
        }
        CapableProfiles { profiles, inertia: self.inertia }
    }

    /// On-chip memory of the scene, bytes; saturates.
    pub(crate) fn memory(&self, bytes_per_body: u32, bytes_per_collision: u32) -> u64 {
        let bytes = |records: usize, each: u32| (records as u64).saturating_mul(u64::from(each));
        bytes(self.bodies, bytes_per_body)
            .saturating_add(bytes(self.collisions, bytes_per_collision))
    }

    /// Whether the on-chip memory of a bitstream takes the scene.
    pub(crate) fn has_room(&self, variant: &Variant) -> bool {
        let needed = self.memory(variant.bytes_per_body(), variant.bytes_per_collision());
        self.bodies as u64 <= u64::from(variant.body_capacity())
            && needed <= u64::from(variant.profile.memory.bytes)
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::NEEDS as SMALL;
    use super::*;

    fn names(needs: SceneNeeds, can: &dyn Fn(&Variant) -> bool) -> Vec<&'static str> {
        needs.capable(can).profiles().map(|profile| profile.name).collect()
    }

    #[test]
    fn profiles_are_named_in_the_order_of_the_table() {
        let all = ["naive", "float", "half"];
        assert_eq!(names(SMALL, &|_| true), all);
        let text = SMALL.capable(&|variant| variant.profile.name != "half").to_string();
        assert_eq!(text, "profiles that could: naive, float");
        assert_eq!(SMALL.capable(&|_| false).to_string(), "no profile could");
        let world = SceneNeeds { inertia: Inertia::World, ..SMALL };
        let text = world.capable(&|variant| variant.profile.id == 1).to_string();
        assert_eq!(text, "profiles that could, built with world inertia: float");
        assert_eq!(
            world.capable(&|_| false).to_string(),
            "no profile could, built with world inertia"
        );
    }

    #[test]
    fn a_profile_without_room_for_the_scene_is_left_out() {
        // 16-bit indices end at 65,535.
        let bodies = |bodies| SceneNeeds { bodies, ..SMALL };
        assert_eq!(names(bodies(65_536), &|_| true).len(), 3);
        assert_eq!(names(bodies(65_537), &|_| true), ["naive", "float"]);
        assert_eq!(names(bodies(131_073), &|_| true), [""; 0]);
        // 4 MiB: 16 bytes a collision in f32, 8 in half.
        let collisions = |collisions| SceneNeeds { collisions, ..SMALL };
        assert_eq!(names(collisions(300_000), &|_| true), ["half"]);
        // 48 bytes a body with world inertia, which half and naive are not built with.
        let world = |bodies| SceneNeeds { bodies, collisions: 100_000, inertia: Inertia::World };
        assert_eq!(names(world(50_000), &|_| true), ["float"]);
        assert_eq!(names(world(60_000), &|_| true), [""; 0]);
    }
}
