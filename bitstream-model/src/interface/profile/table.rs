//! This file is the table of profiles.
//!
//! The depths of every profile are those of a pipeline generated for this purpose at two cycles a
//! collision and bit-exact with the vectors, until a better source exists; the thesis gives none.

use super::{Depth, Geometry, OnChipMemory, Profile};
use crate::interface::number::{Numbers, StreamFormat};
use crate::interface::stripe::{Stripe, Stripes};

const CONTACT: Depth = Depth { fill: 364, window: 316 };
const FRICTION: Depth = Depth { fill: 306, window: 182 };

/// Block RAM of the XCZU9EG as the thesis counts it, bytes.
const BLOCK_RAM: u32 = 4 << 20;

/// One copy of the velocities, at the accelerator's clock.
const ONE_COPY: OnChipMemory =
    OnChipMemory { bytes: BLOCK_RAM, velocity_copies: 1, pump: 1, shape_index_bytes: 1 };

/// One 32-bit stream each way, f32, bound by it (thesis §5.3).
///
/// The thesis' first design ran conversion, contact solver, friction solver and integration one
/// after the other, with everything between them in DDR, and gives no figures for it. This one
/// keeps the fused conversion, so that its driver is that of every profile: what it costs is a lower
/// bound for the thesis' design.
pub const NAIVE: Profile = Profile {
    id: 2,
    name: "naive",
    geometry: Geometry::Absolute,
    numbers: Numbers::F32,
    mm2s_widths: &[32],
    s2mm_widths: &[32],
    stripes: Stripes {
        collisions: Stripe { streams: &[0], padded: false },
        bodies: Stripe { streams: &[0], padded: false },
    },
    initiation_interval: 28,
    collisions_per_issue: 1,
    contact: CONTACT,
    friction: FRICTION,
    clock_khz: 275_000,
    memory: ONE_COPY,
    body_capacity: 131_072,
    shape_capacity: 64,
    source: "thesis §5.3",
};

/// Four 128-bit streams, f32, one collision every two cycles at 275 MHz (thesis §5.4).
pub const FLOAT: Profile = Profile {
    id: 1,
    name: "float",
    geometry: Geometry::Absolute,
    numbers: Numbers::F32,
    mm2s_widths: &[128; 4],
    s2mm_widths: &[128; 4],
    stripes: Stripes {
        collisions: Stripe { streams: &[0, 1, 2, 3, 0, 1, 2], padded: false },
        bodies: Stripe { streams: &[0, 1, 2, 3], padded: false },
    },
    initiation_interval: 2,
    collisions_per_issue: 1,
    contact: CONTACT,
    friction: FRICTION,
    clock_khz: 275_000,
    memory: ONE_COPY,
    body_capacity: 131_072,
    shape_capacity: 64,
    source: "thesis §5.4, §4.4.2",
};

/// Two 128-bit streams and one of 64 bits, sixteen bits throughout, two collisions every three
/// cycles at 250 MHz, two copies of the velocities (thesis §5.5).
pub const HALF: Profile = Profile {
    id: 3,
    name: "half",
    geometry: Geometry::Absolute,
    numbers: Numbers::BINARY16,
    mm2s_widths: &[128, 128, 64],
    s2mm_widths: &[128, 128, 64],
    stripes: Stripes {
        collisions: Stripe { streams: &[0, 0, 0, 1, 1, 1, 2], padded: true },
        bodies: Stripe { streams: &[0, 0, 1, 1, 2], padded: true },
    },
    initiation_interval: 3,
    collisions_per_issue: 2,
    contact: CONTACT,
    friction: FRICTION,
    clock_khz: 250_000,
    memory: OnChipMemory { velocity_copies: 2, ..ONE_COPY },
    body_capacity: 131_072,
    shape_capacity: 64,
    source: "thesis §5.5, §4.4.2",
};

/// Three 128-bit streams, collisions relative to body A in binary16, everything else in f32, one
/// collision a cycle at 250 MHz with block RAM at twice that clock. This project's.
pub const MIXED: Profile = Profile {
    id: 4,
    name: "mixed",
    geometry: Geometry::Relative,
    numbers: Numbers { collisions: StreamFormat::Binary16, ..Numbers::F32 },
    mm2s_widths: &[128; 3],
    s2mm_widths: &[128; 3],
    stripes: Stripes {
        collisions: Stripe { streams: &[0, 1, 2], padded: false },
        bodies: Stripe { streams: &[0, 1, 2], padded: false },
    },
    initiation_interval: 1,
    collisions_per_issue: 1,
    contact: CONTACT,
    friction: FRICTION,
    clock_khz: 250_000,
    memory: OnChipMemory { pump: 2, ..ONE_COPY },
    body_capacity: 131_072,
    shape_capacity: 64,
    source: "this project",
};

/// Every profile.
pub const PROFILES: &[&Profile] = &[&NAIVE, &FLOAT, &HALF, &MIXED];
