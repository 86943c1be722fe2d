//! The table of profiles.
//!
//! The thesis gives no pipeline depths. The generated Verilog in `bitstream-model/rtl` gives the
//! depths of `float` and of `half` and the fill of their integration, memories included. `naive` has
//! no Verilog: its depths are assumed, from an earlier pipeline of two cycles a collision, and so is
//! its fill of the integration, from `float`.

use super::{Depth, OnChipMemory, Profile};
use crate::number::Numbers;
use crate::stripe::{Stripe, Stripes};

/// Pipelines of `float`: schedules of the generated Verilog.
const FLOAT_CONTACT: Depth = Depth { fill: 374, window: 324 };
const FLOAT_FRICTION: Depth = Depth { fill: 314, window: 190 };

/// The same with world inertia: a product with a matrix takes 14 cycles more, all of them before
/// the velocities are read.
const FLOAT_WORLD_CONTACT: Depth = Depth { fill: 388, window: 324 };
const FLOAT_WORLD_FRICTION: Depth = Depth { fill: 328, window: 190 };

/// Pipelines of `half`: schedules of the generated Verilog, in whole slots of three cycles.
const HALF_CONTACT: Depth = Depth { fill: 285, window: 255 };
const HALF_FRICTION: Depth = Depth { fill: 222, window: 156 };

/// Fill of the integration in the generated Verilog of `half`: 142 cycles of the pipeline, 8 of the
/// reads before it, and 27 of set-up and control.
const HALF_INTEGRATION_FILL: u32 = 177;

/// Pipelines of `naive`: assumptions.
const CONTACT: Depth = Depth { fill: 364, window: 316 };
const FRICTION: Depth = Depth { fill: 306, window: 182 };

/// Fill of the integration in the generated Verilog of `float`: 237 cycles of the pipeline, 6 of
/// the read before it, and 21 of set-up and control. An assumption for `naive`.
const INTEGRATION_FILL: u32 = 264;

/// Block RAM of the XCZU9EG as the thesis counts it, bytes.
const BLOCK_RAM: u32 = 4 << 20;

/// One copy of the velocities, at the accelerator's clock.
const ONE_COPY: OnChipMemory =
    OnChipMemory { bytes: BLOCK_RAM, velocity_copies: 1, pump: 1, shape_index_bytes: 1 };

/// One 32-bit stream each way, f32, bound by that stream (thesis §5.3).
///
/// The thesis' first design ran conversion, contact solver, friction solver and integration one
/// after the other, with everything between them in DDR; the thesis gives no figures for it. This
/// profile keeps the fused conversion, so that it has the same driver as every other profile. Its
/// cost is a lower bound for the thesis' design.
pub const NAIVE: Profile = Profile {
    id: 2,
    name: "naive",
    numbers: Numbers::F32,
    mm2s_widths: &[32],
    s2mm_widths: &[32],
    stripes: Stripes::new(
        Stripe { streams: &[0], padded: false },
        Stripe { streams: &[0], padded: false },
    )
    .with_warm_collisions(Stripe { streams: &[0], padded: false }),
    queue: None,
    initiation_interval: 28,
    slotted: false,
    collisions_per_issue: 1,
    contact: CONTACT,
    friction: FRICTION,
    world: None,
    integration_fill: INTEGRATION_FILL,
    flushes_subnormals: false,
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
    numbers: Numbers::F32,
    mm2s_widths: &[128; 4],
    s2mm_widths: &[128; 4],
    stripes: Stripes::new(
        Stripe { streams: &[0, 1, 2, 3, 0, 1, 2], padded: false },
        Stripe { streams: &[0, 1, 2, 3], padded: false },
    )
    .with_warm_collisions(Stripe { streams: &[0, 1, 2, 3], padded: false }),
    queue: Some(64),
    initiation_interval: 2,
    slotted: true,
    collisions_per_issue: 1,
    contact: FLOAT_CONTACT,
    friction: FLOAT_FRICTION,
    world: Some([FLOAT_WORLD_CONTACT, FLOAT_WORLD_FRICTION]),
    integration_fill: INTEGRATION_FILL,
    flushes_subnormals: true,
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
    numbers: Numbers::BINARY16,
    mm2s_widths: &[128, 128, 64],
    s2mm_widths: &[128, 128, 64],
    stripes: Stripes::new(
        Stripe { streams: &[0, 0, 0, 1, 1, 1, 2], padded: true },
        Stripe { streams: &[0, 0, 1, 1, 2], padded: true },
    )
    .with_warm_collisions(Stripe { streams: &[0, 0, 0, 1, 1, 1, 2, 2], padded: true }),
    initiation_interval: 3,
    slotted: true,
    collisions_per_issue: 2,
    clock_khz: 250_000,
    memory: OnChipMemory { velocity_copies: 2, ..ONE_COPY },
    source: "thesis §5.5, §4.4.2",
    contact: HALF_CONTACT,
    friction: HALF_FRICTION,
    integration_fill: HALF_INTEGRATION_FILL,
    // No queue, the capacities, and that subnormal numbers count.
    ..NAIVE
};

/// Every profile.
pub const PROFILES: &[&Profile] = &[&NAIVE, &FLOAT, &HALF];
