//! On-chip memory, by array and copy, in bytes and in block RAMs.
//!
//! Source: thesis §4.4.2 (24 bytes a body and 16 a collision; 4.0 MiB on the XCZU9EG).

use super::arrays::OnChipArray;
use super::blocks::{BLOCK_BITS, ShapedBlocks};
use super::ports::{PortAccount, PortUse};
use pgs_interface::profile::Variant;

/// Numbers of a velocity, and of a world inverse inertia.
const SIX: u32 = 6;
/// Numbers of the accumulated impulses of a collision.
const FOUR: u32 = 4;
/// Numbers of a position.
const THREE: u32 = 3;
const BITS_PER_BYTE: u32 = 8;

/// On-chip memory of one array.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ArrayUse {
    /// The array.
    pub array: OnChipArray,
    /// Rows: bodies or collisions.
    pub rows: u64,
    /// Bytes of a row.
    pub row_bytes: u32,
    /// Copies of the array.
    pub copies: u32,
    /// Whether one read port and one write port are enough for every issue.
    pub simple: bool,
}

impl ArrayUse {
    /// Bytes of all copies.
    #[must_use]
    pub const fn bytes(&self) -> u64 {
        self.rows * (self.row_bytes * self.copies) as u64
    }

    /// Blocks of all copies if no bit of a block were lost.
    #[must_use]
    pub const fn ideal_blocks(&self) -> u64 {
        (self.bytes() * BITS_PER_BYTE as u64).div_ceil(BLOCK_BITS)
    }

    /// Blocks of all copies by the shapes of the block.
    #[must_use]
    pub fn shaped_blocks(&self) -> ShapedBlocks {
        let bits = u64::from(self.row_bytes * BITS_PER_BYTE);
        let one = ShapedBlocks::fewest(self.rows, bits, self.simple);
        let blocks = one.blocks * u64::from(self.copies);
        ShapedBlocks { blocks, ..one }
    }
}

/// On-chip memory of a step.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct MemoryUse {
    /// Each array.
    pub arrays: Vec<ArrayUse>,
    /// Block RAM of the device for these arrays, bytes.
    pub capacity: u64,
    /// Bytes that the positions of all bodies would take in addition, with one copy for each copy
    /// of the velocities.
    pub positions: u64,
}

impl MemoryUse {
    /// On-chip memory of `bodies` bodies and `collisions` collisions in a variant of a profile.
    #[must_use]
    pub fn new(variant: &Variant, bodies: u64, collisions: u64) -> Self {
        let memory = variant.profile.memory;
        let number = variant.numbers.velocities.bytes();
        let impulses = FOUR * variant.numbers.impulses.bytes();
        let of_array = |ports: PortUse| {
            let row_bytes = match ports.array {
                OnChipArray::Velocities | OnChipArray::Inertia => SIX * number,
                OnChipArray::Impulses => impulses,
                OnChipArray::ShapeIndices => memory.shape_index_bytes,
            };
            let rows = if ports.array.is_of_bodies() { bodies } else { collisions };
            let (array, copies, simple) = (ports.array, ports.copies, ports.simple());
            ArrayUse { array, rows, row_bytes, copies, simple }
        };
        let arrays = PortAccount::new(variant).arrays.into_iter().map(of_array).collect();
        let position = THREE * number * memory.velocity_copies;
        let (capacity, positions) = (memory.bytes.into(), bodies * u64::from(position));
        Self { arrays, capacity, positions }
    }

    /// Bytes of one array; 0 if it is not on chip.
    #[must_use]
    pub fn bytes_of(&self, array: OnChipArray) -> u64 {
        self.arrays.iter().filter(|a| a.array == array).map(ArrayUse::bytes).sum()
    }

    fn sum(&self, of: impl Fn(&ArrayUse) -> u64) -> u64 {
        self.arrays.iter().map(of).sum()
    }

    /// Bytes used of the block RAM that bodies and collisions share. The shape indices have a
    /// block RAM of their own.
    #[must_use]
    pub fn block_ram(&self) -> u64 {
        self.sum(ArrayUse::bytes).saturating_sub(self.bytes_of(OnChipArray::ShapeIndices))
    }

    /// Block RAM used if the positions were on chip too, bytes (thesis §4.4.2).
    #[must_use]
    pub fn with_positions(&self) -> u64 {
        self.block_ram() + self.positions
    }

    /// Blocks used, shape indices included, if no bit of a block were lost.
    #[must_use]
    pub fn ideal_blocks(&self) -> u64 {
        (self.sum(ArrayUse::bytes) * u64::from(BITS_PER_BYTE)).div_ceil(BLOCK_BITS)
    }

    /// Blocks used, shape indices included, by the shapes that a block can take.
    #[must_use]
    pub fn shaped_blocks(&self) -> u64 {
        self.sum(|array| array.shaped_blocks().blocks)
    }

    /// Whether the arrays fit by bytes, as the capacity registers count.
    #[must_use]
    pub fn fits(&self) -> bool {
        self.block_ram() <= self.capacity
    }

    /// Collisions that fit beside `bodies` bodies.
    #[must_use]
    pub fn collisions_beside(variant: &Variant, bodies: u64) -> u64 {
        let taken = bodies * u64::from(variant.bytes_per_body());
        let free = u64::from(variant.profile.memory.bytes).saturating_sub(taken);
        free / u64::from(variant.bytes_per_collision().max(1))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use pgs_interface::profile::{FLOAT, HALF, Inertia, NAIVE, PROFILES, Profile};

    fn thesis_step(profile: &'static Profile) -> MemoryUse {
        MemoryUse::new(&profile.default_variant(), 38_880, 127_000)
    }

    fn hundredths_of_mib(bytes: u64) -> u64 {
        (bytes * 100 + (1 << 19)) >> 20
    }

    /// Thesis §4.4.2: 2.83 and 1.86, with positions 3.27 and 2.30; the positions alone 0.44 in
    /// float, and 0.22 in each of half's two copies.
    #[test]
    fn float_and_half_take_what_the_thesis_says() {
        let float = thesis_step(&FLOAT);
        assert_eq!(float.block_ram(), 2_965_120);
        assert_eq!(hundredths_of_mib(float.block_ram()), 283);
        assert_eq!(hundredths_of_mib(float.with_positions()), 327);
        assert_eq!(hundredths_of_mib(float.positions), 44);
        let half = thesis_step(&HALF);
        assert_eq!(half.block_ram(), 1_949_120);
        assert_eq!(hundredths_of_mib(half.block_ram()), 186);
        assert_eq!(hundredths_of_mib(half.with_positions()), 230);
        assert_eq!(hundredths_of_mib(half.positions / 2), 22);
        assert_eq!(hundredths_of_mib(half.block_ram() - half.arrays[0].bytes() / 2), 141);
        assert_eq!(thesis_step(&NAIVE).block_ram(), float.block_ram());
    }

    /// By hand: float 38 x 11 + 63 x 15, half 2 x 19 x 11 + 125 x 4, and 19 of shape indices: two
    /// collisions an issue read and write two rows of impulses, so that the wide shape of one port
    /// each way does not do.
    #[test]
    fn shaped_blocks_are_a_little_more_than_the_bits() {
        let blocks = |profile| {
            let memory = thesis_step(profile);
            (memory.ideal_blocks(), memory.shaped_blocks())
        };
        assert_eq!(blocks(&FLOAT), (1_304, 418 + 945 + 19));
        assert_eq!(blocks(&HALF), (863, 418 + 500 + 19));
    }

    #[test]
    fn the_arrays_are_what_the_interface_counts_for_each_record() {
        for profile in PROFILES {
            for inertia in [Inertia::Isotropic, Inertia::World] {
                let variant = Variant { inertia, ..profile.default_variant() };
                let memory = MemoryUse::new(&variant, 7, 5);
                let by_record = 7 * variant.bytes_per_body() + 5 * variant.bytes_per_collision();
                assert_eq!(memory.block_ram(), u64::from(by_record), "{}", profile.name);
            }
        }
    }

    #[test]
    fn the_shape_indices_of_40_960_bodies_take_ten_blocks_of_36_kib() {
        let memory = MemoryUse::new(&FLOAT.default_variant(), 40_960, 0);
        let shapes = memory.arrays.iter().find(|array| array.array == OnChipArray::ShapeIndices);
        assert_eq!(shapes.expect("they are on chip").shaped_blocks().blocks, 2 * 10);
    }

    #[test]
    fn the_full_scene_has_room_for_203_822_collisions() {
        let most = MemoryUse::collisions_beside(&FLOAT.default_variant(), 38_881);
        assert_eq!(most, 203_822);
        assert!(MemoryUse::new(&FLOAT.default_variant(), 38_881, most).fits());
        assert!(!MemoryUse::new(&FLOAT.default_variant(), 38_881, most + 1).fits());
    }
}
