//! Reads the identification and the capabilities of a bitstream, and refuses unknown ones.

use pgs_interface::address_map::CONTROL_BYTES;
use pgs_interface::axi_dma::{LENGTH_WIDTH_MAX, LENGTH_WIDTH_MIN};
use pgs_interface::control::{
    BODY_CAPACITY, CHANNELS, CLOCK_KHZ, COLLISION_CAPACITY, CONTACT_DEPTH, DMA, FEATURES,
    FENCE_BASE, FENCE_SIZE, FRICTION_DEPTH, IDENTIFICATION, IDENTIFICATION_VALUE, ISSUE,
    MEMORY_BYTES, MEMORY_PER_RECORD, MM2S_WIDTHS, NUMBERS, PROFILE, QUEUE, QUEUE_MAX, S2MM_WIDTHS,
    SHAPE_CAPACITY, SHAPE_STRIDE, SHAPE_TABLE, VERSION, VERSION_MAJOR, channels, depth, dma,
    features, issue, memory_per_record, numbers, version,
};
use pgs_interface::fence::Fence;
use pgs_interface::number::{Numbers, Precision, StreamFormat};
use pgs_interface::profile::{Depth, Inertia, Profile, Variant};
use pgs_interface::register::{Field, Register};
use thiserror::Error;

use crate::platform::{Reach, Window};

/// The identity and the capabilities of a bitstream.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub struct Capabilities {
    /// The [profile](pgs_interface::profile::Profile), its formats, its inertia.
    pub variant: Variant,
    /// Interface version, major and minor.
    pub version: (u32, u32),
    /// Whether the pipeline waits on a hazard; without it, it reads stale velocities.
    pub interlocked: bool,
    /// Depth of the issue queue, collisions: the board issues the oldest one that is free of
    /// hazards. 0: none, collisions enter the pipeline in the order sent.
    pub queue: u32,
    /// Streams into the accelerator.
    pub mm2s_channels: usize,
    /// Streams out of the accelerator.
    pub s2mm_channels: usize,
    /// Cycles from one issue to the next.
    pub initiation_interval: u32,
    /// Collisions that enter the pipeline together.
    pub collisions_per_issue: u32,
    /// Depth of the contact pipeline, cycles.
    pub contact: Depth,
    /// Depth of the friction pipeline, cycles.
    pub friction: Depth,
    /// Clock of the accelerator and its streams, kHz.
    pub clock_khz: u32,
    /// Largest number of bodies.
    pub body_capacity: u32,
    /// Largest number of collisions in a scene without bodies.
    pub collision_capacity: u32,
    /// Entries of the shape table.
    pub shape_capacity: u32,
    /// On-chip memory that bodies and collisions share, bytes.
    pub memory_bytes: u32,
    /// Memory of a body, bytes.
    pub bytes_per_body: u32,
    /// Memory of a collision, bytes.
    pub bytes_per_collision: u32,
    /// Width of the DMA cores' length registers, bits.
    pub length_width: u32,
    /// Width of memory addresses, bits.
    pub address_width: u32,
    /// The one address segment that the DMA cores reach; `None` if nothing but the driver confines
    /// them.
    pub fence: Option<Fence>,
}

impl Capabilities {
    /// The memory that the DMA cores reach.
    pub(crate) const fn reach(&self) -> Reach {
        Reach { address_width: self.address_width, fence: self.fence }
    }

    /// Whether the masses of that many shapes are streamed with the bodies: the table has no room
    /// for them.
    pub(crate) const fn streams_masses(&self, shapes: usize) -> bool {
        self.variant.has_streamed_masses() && shapes > self.shape_capacity as usize
    }

    /// The largest number of shapes. Where each body can bring its inverse mass, the table does not
    /// limit it.
    #[must_use]
    pub const fn shapes_max(&self) -> u32 {
        if self.variant.has_streamed_masses() { u32::MAX } else { self.shape_capacity }
    }
}

/// Why a bitstream was refused. Nothing was written to it.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum IdentityError {
    /// All ones: no device answers.
    #[error("the control block reads all ones: is a bitstream loaded and its clock running?")]
    Gone,
    /// Another design.
    #[error(
        "expected the identification {IDENTIFICATION_VALUE:#010x} (\"PGS1\"), found {found:#010x}: \
         load the accelerator's bitstream, or correct the control block's address"
    )]
    Identification {
        /// The register.
        found: u32,
    },
    /// An interface that this driver does not know.
    #[error(
        "expected interface version {VERSION_MAJOR}.x, found {major}.{minor}: use the driver that \
         belongs to the bitstream"
    )]
    Version {
        /// Major version found.
        major: u32,
        /// Minor version found.
        minor: u32,
    },
    /// A profile that this driver does not know.
    #[error("unknown profile {found}: use the driver that belongs to the bitstream")]
    Profile {
        /// Identifier found.
        found: u32,
    },
    /// A capability register is contradictory, or asks for a feature that this driver does not
    /// have.
    #[error(
        "{register} is {found:#010x}, expected {expected}: the bitstream is not one for this driver"
    )]
    Capability {
        /// Which register.
        register: &'static str,
        /// Its value.
        found: u32,
        /// The values that it may have.
        expected: &'static str,
    },
}

/// Reads and checks the identity and the capabilities of a bitstream. Nothing is written.
pub(crate) fn identify(window: &Window) -> Result<Capabilities, IdentityError> {
    let read = |register: &Register| window.read32(register.offset);
    match read(&IDENTIFICATION) {
        IDENTIFICATION_VALUE => {}
        u32::MAX => return Err(IdentityError::Gone),
        found => return Err(IdentityError::Identification { found }),
    }
    let word = read(&VERSION);
    let (major, minor) = (version::MAJOR.of(word), version::MINOR.of(word));
    if major != VERSION_MAJOR {
        return Err(IdentityError::Version { major, minor });
    }
    let profile_id = read(&PROFILE);
    let profile = Profile::by_id(profile_id).ok_or(IdentityError::Profile { found: profile_id })?;

    // The stream of each beat is part of the profile.
    let streams =
        checked(window, &CHANNELS, "as many streams each way as the profile has", |word| {
            channels::MM2S.of(word) as usize == profile.mm2s_widths.len()
                && channels::S2MM.of(word) as usize == profile.s2mm_widths.len()
        })?;
    for (register, widths) in
        [(&MM2S_WIDTHS, profile.mm2s_widths), (&S2MM_WIDTHS, profile.s2mm_widths)]
    {
        checked(window, register, "the stream widths of the profile", |word| {
            (0..).zip(widths).all(|(stream, width)| (word >> (4 * stream)) & 0xF == coded(*width))
        })?;
    }
    let interval = checked(
        window,
        &ISSUE,
        "an interval above 0, and as many collisions an issue as the profile has",
        |word| {
            issue::INTERVAL.of(word) > 0
                && issue::COLLISIONS.of(word) == profile.collisions_per_issue
        },
    )?;
    let able = checked(window, &FEATURES, "isotropic inertia, as the profile has it", |word| {
        profile.world.is_some() || !features::WORLD_INERTIA.is_set(word)
    })?;
    let interlocked = features::INTERLOCKED.is_set(able);
    let longest = if interlocked && profile.has_queue() { QUEUE_MAX } else { 0 };
    let queue = checked(window, &QUEUE, "0 to 256, and 0 where no build has a queue", |depth| {
        depth <= longest
    })?;
    let world = features::WORLD_INERTIA.is_set(able);
    let variant = Variant {
        profile,
        numbers: numbers_of(window, profile)?,
        inertia: if world { Inertia::World } else { Inertia::Isotropic },
    };
    let shape_capacity = checked(
        window,
        &SHAPE_CAPACITY,
        "1 to as many as the control block has room for",
        |word| (1..=(CONTROL_BYTES - SHAPE_TABLE) / SHAPE_STRIDE).contains(&word),
    )?;
    let widths = checked(window, &DMA, "length 8 to 26 bits, addresses 32 to 64 bits", |word| {
        (LENGTH_WIDTH_MIN..=LENGTH_WIDTH_MAX).contains(&dma::LENGTH_WIDTH.of(word))
            && (32..=64).contains(&dma::ADDRESS_WIDTH.of(word))
    })?;
    let fence = fence_of(window)?;
    let clock_khz = checked(window, &CLOCK_KHZ, "a clock above 0", |word| word > 0)?;
    let memory = checked(window, &MEMORY_PER_RECORD, "bytes above 0", |word| {
        memory_per_record::BODY.of(word) > 0 && memory_per_record::COLLISION.of(word) > 0
    })?;
    let depth_of = |register: &Register| {
        let word = read(register);
        Depth { fill: depth::FILL.of(word), window: depth::WINDOW.of(word) }
    };
    Ok(Capabilities {
        variant,
        version: (major, minor),
        interlocked,
        queue,
        mm2s_channels: channels::MM2S.of(streams) as usize,
        s2mm_channels: channels::S2MM.of(streams) as usize,
        initiation_interval: issue::INTERVAL.of(interval),
        collisions_per_issue: issue::COLLISIONS.of(interval),
        contact: depth_of(&CONTACT_DEPTH),
        friction: depth_of(&FRICTION_DEPTH),
        clock_khz,
        body_capacity: read(&BODY_CAPACITY),
        collision_capacity: read(&COLLISION_CAPACITY),
        shape_capacity,
        memory_bytes: read(&MEMORY_BYTES),
        bytes_per_body: memory_per_record::BODY.of(memory),
        bytes_per_collision: memory_per_record::COLLISION.of(memory),
        length_width: dma::LENGTH_WIDTH.of(widths),
        address_width: dma::ADDRESS_WIDTH.of(widths),
        fence,
    })
}

/// Reads the fence. A bitstream without one reads 0 in both registers.
fn fence_of(window: &Window) -> Result<Option<Fence>, IdentityError> {
    let base = window.read32(FENCE_BASE.offset);
    let segment = |size| Fence::from_registers([base, size]);
    let expected = "0, or a segment of the DDR that begins at FENCE_BASE: a power of two of units \
                    of 64 KiB, at a multiple of it";
    let size = checked(window, &FENCE_SIZE, expected, |size| segment(size).is_ok())?;
    Ok(segment(size).unwrap_or_default())
}

/// A stream width as `MM2S_WIDTHS` and `S2MM_WIDTHS` code it: log2 of its bytes.
const fn coded(width: u32) -> u32 {
    (width / u8::BITS).ilog2()
}

/// Reads the number formats. They must be known, as wide as the profile's stripes assume, and
/// sufficient for its records.
fn numbers_of(window: &Window, profile: &Profile) -> Result<Numbers, IdentityError> {
    let found = window.read32(NUMBERS.offset);
    let refused = |expected| IdentityError::Capability { register: NUMBERS.name, found, expected };
    let format = |field: Field| {
        let known = StreamFormat::ALL.into_iter().find(|format| *format as u32 == field.of(found));
        known.ok_or(refused("formats on the streams that this driver knows"))
    };
    let precision = |field: Field| {
        let known = Precision::ALL.into_iter().find(|known| *known as u32 == field.of(found));
        known.ok_or(refused("arithmetic and on-chip formats that this driver knows"))
    };
    let numbers = Numbers {
        collisions: format(numbers::COLLISIONS)?,
        bodies: format(numbers::BODIES)?,
        poses: format(numbers::POSES)?,
        rows: precision(numbers::ROWS)?,
        updates: precision(numbers::UPDATES)?,
        velocities: precision(numbers::VELOCITIES)?,
        impulses: precision(numbers::IMPULSES)?,
    };
    let own = profile.numbers;
    if numbers.collisions.bits() != own.collisions.bits()
        || numbers.bodies.bits() != own.bodies.bits()
        || numbers.poses.bits() != own.poses.bits()
    {
        return Err(refused("words as wide on the streams as the profile has them"));
    }
    if (numbers.rows, numbers.updates) == (Precision::F32, Precision::Binary16) {
        return Err(refused("rows of no more precision than the updates that take them"));
    }
    Ok(numbers)
}

/// Reads a capability register whose value must pass `good`.
fn checked(
    window: &Window,
    register: &Register,
    expected: &'static str,
    good: impl Fn(u32) -> bool,
) -> Result<u32, IdentityError> {
    let found = window.read32(register.offset);
    if !good(found) {
        return Err(IdentityError::Capability { register: register.name, found, expected });
    }
    Ok(found)
}

#[cfg(test)]
pub(crate) mod fake {
    //! The capability registers of a well-formed bitstream.

    use crate::platform::fake::FakeRegisters;

    /// Fills in the registers of the profile `float`, typed out from the specification.
    pub(crate) fn describe(registers: &FakeRegisters) {
        registers.with(|state| {
            state.values.extend([
                (0x100, 0x5047_5331),
                (0x104, 0x0002_0000),
                (0x108, 1),
                (0x10C, 0x1),
                (0x110, 0x0404),
                (0x114, 0x4444),
                (0x118, 0x4444),
                (0x11C, 0x0001_0002),
                (0x120, (324 << 16) | 374),
                (0x124, (190 << 16) | 314),
                (0x128, 275_000),
                (0x12C, 131_072),
                (0x130, 262_144),
                (0x134, 64),
                (0x138, 4 << 20),
                (0x13C, (16 << 16) | 24),
                (0x140, (40 << 8) | 26),
                (0x144, 0),
                (0x148, 0),
            ]);
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::platform::RegisterMap;
    use crate::platform::fake::FakeRegisters;
    use pgs_interface::profile::{FLOAT, HALF, NAIVE};

    fn identify_with(changes: &[(u32, u32)]) -> Result<Capabilities, IdentityError> {
        let registers = FakeRegisters::default();
        fake::describe(&registers);
        registers.with(|state| state.values.extend(changes.iter().copied()));
        let result = identify(&registers.window(RegisterMap::Control));
        assert!(registers.with(|state| state.writes.is_empty()), "identifying only reads");
        result
    }

    #[test]
    fn a_known_bitstream_is_described() {
        let found = identify_with(&[]).expect("well formed");
        assert_eq!((found.variant, found.version), (FLOAT.default_variant(), (2, 0)));
        assert!(found.interlocked);
        assert_eq!((found.mm2s_channels, found.s2mm_channels), (4, 4));
        assert_eq!(found.contact, Depth { fill: 374, window: 324 });
        assert_eq!((found.bytes_per_body, found.bytes_per_collision), (24, 16));
        assert_eq!((found.length_width, found.address_width), (26, 40));
    }

    #[test]
    fn the_fence_is_two_registers_and_a_bitstream_without_them_has_none() {
        assert_eq!(identify_with(&[]).expect("well formed").fence, None);
        let found = identify_with(&[(0x150, 0x5000), (0x154, 0x400)]).expect("well formed");
        assert_eq!(found.fence, Fence::new(0x5000_0000, 64 << 20));
        // The base alone is no fence; a fence at another place than a multiple of its length
        // neither.
        assert_eq!(identify_with(&[(0x150, 0x5000)]).expect("well formed").fence, None);
        let error = identify_with(&[(0x150, 0x5001), (0x154, 0x400)]).expect_err("misplaced");
        assert!(error.to_string().starts_with("FENCE_SIZE is 0x00000400"), "{error}");
    }

    #[test]
    fn a_queue_belongs_to_a_pipeline_that_waits() {
        let depth = |changes: &[(u32, u32)]| identify_with(changes).map(|found| found.queue);
        assert_eq!(depth(&[]).expect("well formed"), 0);
        assert_eq!(depth(&[(0x148, 64)]).expect("well formed"), 64);
        assert_eq!(depth(&[(0x148, 256)]).expect("well formed"), 256);
        assert_eq!(depth(&[(0x10C, 0)]).expect("unchecked"), 0);
        let error = depth(&[(0x10C, 0), (0x148, 1)]).expect_err("unchecked, with a queue");
        assert!(error.to_string().starts_with("QUEUE is 0x00000001"), "{error}");
    }

    #[test]
    fn another_design_and_another_major_version_are_refused() {
        assert!(matches!(
            identify_with(&[(0x100, 0x1234)]),
            Err(IdentityError::Identification { found: 0x1234 })
        ));
        assert!(matches!(identify_with(&[(0x100, u32::MAX)]), Err(IdentityError::Gone)));
        assert!(matches!(
            identify_with(&[(0x104, 0x0001_0003)]),
            Err(IdentityError::Version { major: 1, minor: 3 })
        ));
        assert!(identify_with(&[(0x104, 0x0002_0007)]).is_ok(), "minor versions are compatible");
    }

    #[test]
    fn what_the_driver_cannot_do_is_refused_by_register() {
        let cases = [
            (0x108, 99, "unknown profile 99"),
            (0x110, 0x0505, "CHANNELS"),
            (0x110, 0x0304, "CHANNELS"),
            (0x114, 0x4344, "MM2S_WIDTHS"),
            (0x118, 0x0444, "S2MM_WIDTHS"),
            (0x110, 0x0404 - 0x0001, "CHANNELS"),
            (0x11C, 0x0001_0000, "ISSUE"),
            (0x11C, 0x0002_0002, "ISSUE"),
            (0x144, 0x0000_0003, "NUMBERS"),
            (0x144, 0x0000_0030, "NUMBERS"),
            (0x144, 0x0000_0200, "NUMBERS"),
            (0x144, 0x0000_2000, "NUMBERS"),
            (0x144, 0x0002_0000, "NUMBERS"),
            (0x144, 0x0020_0000, "NUMBERS"),
            // Sixteen bits on streams whose stripes assume thirty-two.
            (0x144, 0x0000_0001, "NUMBERS"),
            (0x144, 0x0000_0020, "NUMBERS"),
            // Rows in f32 for updates in binary16.
            (0x144, 0x0000_1000, "NUMBERS"),
            (0x128, 0, "CLOCK_KHZ"),
            (0x134, 0, "SHAPE_CAPACITY"),
            (0x134, 193, "SHAPE_CAPACITY"),
            (0x13C, 24, "MEMORY_PER_RECORD"),
            (0x140, (40 << 8) | 7, "DMA"),
            (0x140, (31 << 8) | 26, "DMA"),
            (0x148, 257, "QUEUE is 0x00000101, expected 0 to 256"),
            // A size that no address decoder has, and a base beside it.
            (0x154, 3, "FENCE_SIZE"),
            (0x154, 0x8_0001, "FENCE_SIZE"),
        ];
        for (at, value, named) in cases {
            let error = identify_with(&[(at, value)]).expect_err(named).to_string();
            assert!(error.contains(named), "{error}");
        }
    }
    /// Registers in which the profiles differ, typed out from the specification.
    const HALF_REGISTERS: [(u32, u32); 6] = [
        (0x108, 3),
        (0x110, 0x0303),
        (0x114, 0x344),
        (0x118, 0x344),
        (0x11C, 0x0002_0003),
        (0x144, 0x0111_1111),
    ];
    const NAIVE_REGISTERS: [(u32, u32); 5] =
        [(0x108, 2), (0x110, 0x0101), (0x114, 0x2), (0x118, 0x2), (0x11C, 0x0001_001C)];

    #[test]
    fn every_profile_is_known_by_its_registers() {
        for (registers, profile, channels) in
            [(&NAIVE_REGISTERS[..], &NAIVE, 1), (&HALF_REGISTERS[..], &HALF, 3)]
        {
            let found = identify_with(registers).expect(profile.name);
            assert_eq!(found.variant, profile.default_variant());
            assert_eq!((found.mm2s_channels, found.s2mm_channels), (channels, channels));
        }
    }

    #[test]
    fn what_was_chosen_when_it_was_built_is_part_of_it() {
        let with = |registers: &[(u32, u32)], more: &[(u32, u32)]| {
            identify_with(&[registers, more].concat())
        };
        // Arithmetic and arrays of mixed kinds.
        let found = with(&HALF_REGISTERS, &[(0x144, 0x0110_0111)]).expect("known formats");
        let expected = Numbers {
            collisions: StreamFormat::Binary16,
            bodies: StreamFormat::Binary16,
            poses: StreamFormat::Binary16,
            rows: Precision::Binary16,
            updates: Precision::F32,
            velocities: Precision::F32,
            impulses: Precision::Binary16,
        };
        assert_eq!(found.variant.numbers, expected);
        let found = with(&[], &[(0x10C, 0x3)]).expect("with world inertia");
        assert_eq!(found.variant.inertia, Inertia::World);
        let error = with(&HALF_REGISTERS, &[(0x10C, 0x3)]);
        let error = error.expect_err("half has no such build").to_string();
        assert!(error.starts_with("FEATURES is 0x00000003, expected isotropic"), "{error}");
    }

    #[test]
    fn streams_of_another_width_than_the_profile_has_are_refused() {
        for (at, value, named) in
            [(0x114, 0x444, "MM2S_WIDTHS"), (0x118, 0x344 << 4, "S2MM_WIDTHS")]
        {
            let registers = [&HALF_REGISTERS[..], &[(at, value)]].concat();
            let error = identify_with(&registers).expect_err(named).to_string();
            assert!(error.contains(named), "{error}");
        }
    }
}
