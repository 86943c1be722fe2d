//! Register rows of the accelerator's control block.
//!
//! The first 16 bytes and the spacing of the arguments follow the `s_axilite` convention of
//! Vivado HLS; everything from [`IDENTIFICATION`] on is this project's.
//!
//! ```text
//! 0x000 AP_CTRL, GIE, IER, ISR      0x180 error, counters, sums
//! 0x010 arguments, 8 bytes apart    0x1C0 reset
//! 0x100 identity and capabilities   0x400 shape table, 16 bytes an entry
//! ```
//!
//! Numbers called f32 are IEEE 754 binary32 bit patterns.

use super::register::{Access, Field, Register};

/// Fields of AP_CTRL.
pub mod ap_ctrl {
    use super::{Access, Field};

    /// Starts a step; reads 1 while it runs.
    pub const START: Field = Field::bit("ap_start", 0, Access::SelfClearing);
    /// A step has ended, well or with an error; reading clears it.
    pub const DONE: Field = Field::bit("ap_done", 1, Access::ClearOnRead);
    /// No step is running.
    pub const IDLE: Field = Field::bit("ap_idle", 2, Access::ReadOnly);
    /// The accelerator can take a new start; reading clears it.
    pub const READY: Field = Field::bit("ap_ready", 3, Access::ClearOnRead);
    /// Restart by itself, which this accelerator cannot; reads 0.
    pub const AUTO_RESTART: Field = Field::bit("auto_restart", 7, Access::ReadOnly);
}

/// Fields of IER and ISR.
pub mod irq {
    use super::{Access, Field};

    /// A step has ended.
    pub const DONE: Field = Field::bit("ap_done", 0, Access::ToggleOnWrite);
    /// The accelerator is ready for a new start.
    pub const READY: Field = Field::bit("ap_ready", 1, Access::ToggleOnWrite);
    /// The sticky error was set.
    pub const ERROR: Field = Field::bit("error", 2, Access::ToggleOnWrite);
}

/// Fields of FLAGS.
pub mod flags {
    use super::{Access, Field};

    /// Integrate after the solver. Without it poses come back unchanged, and velocities undamped
    /// and without gravity.
    pub const INTEGRATE: Field = Field::bit("integrate", 0, Access::ReadWrite);
    /// Bodies of inverse mass 0 have the velocity of their record. Without it they are at rest,
    /// whatever the record holds.
    pub const KINEMATIC: Field = Field::bit("kinematic", 1, Access::ReadWrite);
    /// The friction of a collision is above its contact count, and FRICTION is not used. Only where
    /// a record has room for it
    /// ([`Variant::has_pair_friction`](super::super::profile::Variant::has_pair_friction)).
    pub const PAIR_FRICTION: Field = Field::bit("pair_friction", 2, Access::ReadWrite);
    /// Impulses come in with the collisions, in a pass of their own in front of the passes of each
    /// kind.
    pub const WARM_START: Field = Field::bit("warm_start", 3, Access::ReadWrite);
    /// The impulses go out in front of the results.
    pub const IMPULSES_OUT: Field = Field::bit("impulses_out", 4, Access::ReadWrite);
    /// Each velocity record brings the inverse mass of its body, and the shape table is not used.
    /// Only in a bitstream with [`features::WORLD_INERTIA`](super::features::WORLD_INERTIA).
    pub const STREAMED_MASSES: Field = Field::bit("streamed_masses", 5, Access::ReadWrite);
    /// Collisions enter the pipeline in the order of the stream, past the queue. It changes nothing
    /// where [`QUEUE`](super::QUEUE) is 0.
    pub const IN_ORDER: Field = Field::bit("in_order", 6, Access::ReadWrite);
}

/// Fields of VERSION.
pub mod version {
    use super::{Access, Field};

    /// Compatible additions.
    pub const MINOR: Field = Field::bits("minor", 0, 16, Access::ReadOnly);
    /// Incompatible changes.
    pub const MAJOR: Field = Field::bits("major", 16, 16, Access::ReadOnly);
}

/// Fields of FEATURES.
pub mod features {
    use super::{Access, Field};

    /// The pipeline waits on a hazard; without it, it reads stale velocities.
    pub const INTERLOCKED: Field = Field::bit("interlocked", 0, Access::ReadOnly);
    /// Velocity records carry the world inverse inertia of their body.
    pub const WORLD_INERTIA: Field = Field::bit("world_inertia", 1, Access::ReadOnly);
}

/// Fields of NUMBERS: a [`StreamFormat`](super::number::StreamFormat) each for the streams, a
/// [`Precision`](super::number::Precision) each for the rest.
pub mod numbers {
    use super::{Access, Field};

    /// Collision records.
    pub const COLLISIONS: Field = Field::bits("collisions", 0, 4, Access::ReadOnly);
    /// Velocity records.
    pub const BODIES: Field = Field::bits("bodies", 4, 4, Access::ReadOnly);
    /// Arithmetic of constraint rows.
    pub const ROWS: Field = Field::bits("rows", 8, 4, Access::ReadOnly);
    /// Arithmetic of speeds, impulses, velocities and the integration.
    pub const UPDATES: Field = Field::bits("updates", 12, 4, Access::ReadOnly);
    /// Velocities on chip.
    pub const VELOCITIES: Field = Field::bits("velocities", 16, 4, Access::ReadOnly);
    /// Accumulated impulses on chip.
    pub const IMPULSES: Field = Field::bits("impulses", 20, 4, Access::ReadOnly);
    /// Pose and result records.
    pub const POSES: Field = Field::bits("poses", 24, 4, Access::ReadOnly);
}

/// Fields of CHANNELS.
pub mod channels {
    use super::{Access, Field};

    /// Streams into the accelerator.
    pub const MM2S: Field = Field::bits("mm2s", 0, 8, Access::ReadOnly);
    /// Streams out of the accelerator.
    pub const S2MM: Field = Field::bits("s2mm", 8, 8, Access::ReadOnly);
}

/// Fields of ISSUE.
pub mod issue {
    use super::{Access, Field};

    /// Initiation interval: cycles from one issue to the next.
    pub const INTERVAL: Field = Field::bits("interval", 0, 16, Access::ReadOnly);
    /// Collisions that enter the pipeline together.
    pub const COLLISIONS: Field = Field::bits("collisions", 16, 16, Access::ReadOnly);
}

/// Fields of CONTACT_DEPTH and FRICTION_DEPTH.
pub mod depth {
    use super::{Access, Field};

    /// Cycles from the first collision in to the last write-back.
    pub const FILL: Field = Field::bits("fill", 0, 16, Access::ReadOnly);
    /// Cycles from the read of a body's velocity to its write-back.
    pub const WINDOW: Field = Field::bits("window", 16, 16, Access::ReadOnly);
}

/// Fields of MEMORY_PER_RECORD.
pub mod memory_per_record {
    use super::{Access, Field};

    /// On-chip bytes that a body takes.
    pub const BODY: Field = Field::bits("body", 0, 16, Access::ReadOnly);
    /// On-chip bytes that a collision takes.
    pub const COLLISION: Field = Field::bits("collision", 16, 16, Access::ReadOnly);
}

/// Fields of DMA.
pub mod dma {
    use super::{Access, Field};

    /// Width of the length registers, bits.
    pub const LENGTH_WIDTH: Field = Field::bits("length_width", 0, 8, Access::ReadOnly);
    /// Width of memory addresses, bits.
    pub const ADDRESS_WIDTH: Field = Field::bits("address_width", 8, 8, Access::ReadOnly);
}

/// Fields of ERROR.
pub mod error {
    use super::{Access, Field};

    /// An [`ErrorCode`](super::ErrorCode); 0 is none.
    pub const CODE: Field = Field::bits("code", 0, 8, Access::ReadOnly);
    /// The stream of the error, for the codes that concern one stream.
    pub const CHANNEL: Field = Field::bits("channel", 8, 8, Access::ReadOnly);
}

/// Fields of RESET.
pub mod reset {
    use super::{Access, Field};

    /// Abandons the step, drops half-received packets, clears the sticky error, the arguments, the
    /// interrupt enables and the shape table; reads 1 until done.
    pub const RESET: Field = Field::bit("reset", 0, Access::SelfClearing);
}

const HLS: &str = "Vivado HLS s_axilite convention";
const OURS: &str = "this project";

const fn row(
    name: &'static str,
    offset: u32,
    access: Access,
    reset: u32,
    fields: &'static [Field],
    source: &'static str,
) -> Register {
    Register { name, offset, access, reset, fields, source }
}

const fn argument(name: &'static str, offset: u32) -> Register {
    row(name, offset, Access::ReadWrite, 0, &[], OURS)
}

const fn read_only(name: &'static str, offset: u32, fields: &'static [Field]) -> Register {
    row(name, offset, Access::ReadOnly, 0, fields, OURS)
}

/// Start, done, idle, ready.
pub const AP_CTRL: Register = row(
    "AP_CTRL",
    0x00,
    Access::ReadWrite,
    0x4,
    &[ap_ctrl::START, ap_ctrl::DONE, ap_ctrl::IDLE, ap_ctrl::READY, ap_ctrl::AUTO_RESTART],
    HLS,
);
/// Global interrupt enable, bit 0.
pub const GIE: Register =
    row("GIE", 0x04, Access::ReadWrite, 0, &[Field::bit("enable", 0, Access::ReadWrite)], HLS);
/// Interrupt enables.
pub const IER: Register =
    row("IER", 0x08, Access::ReadWrite, 0, &[irq::DONE, irq::READY, irq::ERROR], HLS);
/// Interrupt status: a bit is set only while its enable is set; writing 1 toggles.
pub const ISR: Register =
    row("ISR", 0x0C, Access::ToggleOnWrite, 0, &[irq::DONE, irq::READY, irq::ERROR], HLS);

/// Number of bodies B, at least 1.
pub const BODIES: Register = argument("BODIES", 0x10);
/// Number of collisions C; 0 leaves out the passes and their packets.
pub const COLLISIONS: Register = argument("COLLISIONS", 0x18);
/// Number of contact passes.
pub const CONTACT_ITERATIONS: Register = argument("CONTACT_ITERATIONS", 0x20);
/// Number of friction passes.
pub const FRICTION_ITERATIONS: Register = argument("FRICTION_ITERATIONS", 0x28);
/// Switches.
pub const FLAGS: Register = row(
    "FLAGS",
    0x30,
    Access::ReadWrite,
    0,
    &[
        flags::INTEGRATE,
        flags::KINEMATIC,
        flags::PAIR_FRICTION,
        flags::WARM_START,
        flags::IMPULSES_OUT,
        flags::STREAMED_MASSES,
        flags::IN_ORDER,
    ],
    OURS,
);
/// Time step, s, f32.
pub const TIME_STEP: Register = argument("TIME_STEP", 0x38);
/// Position drift, m, f32.
pub const POSITION_DRIFT: Register = argument("POSITION_DRIFT", 0x40);
/// Position coefficient, f32.
pub const POSITION_COEFFICIENT: Register = argument("POSITION_COEFFICIENT", 0x48);
/// Friction coefficient, f32.
pub const FRICTION: Register = argument("FRICTION", 0x50);
/// Angular damping: the share of the angular velocity that is left after a step, f32.
pub const ANGULAR_DAMPING: Register = argument("ANGULAR_DAMPING", 0x58);
/// Gravity along x, m/s², f32.
pub const GRAVITY_X: Register = argument("GRAVITY_X", 0x60);
/// Gravity along y, m/s², f32.
pub const GRAVITY_Y: Register = argument("GRAVITY_Y", 0x68);
/// Gravity along z, m/s², f32.
pub const GRAVITY_Z: Register = argument("GRAVITY_Z", 0x70);
/// Share of the spin about the normal that one friction pass takes away, f32.
pub const SPIN_DAMPING: Register = row(
    "SPIN_DAMPING",
    0x78,
    Access::ReadWrite,
    super::profile::solver::SPIN_DAMPING.to_bits(),
    &[],
    OURS,
);

/// "PGS1" as text, first letter in the most significant byte.
pub const IDENTIFICATION_VALUE: u32 = 0x5047_5331;
/// Major interface version of this module.
pub const VERSION_MAJOR: u32 = 2;
/// Minor interface version of this module.
pub const VERSION_MINOR: u32 = 0;

/// Always [`IDENTIFICATION_VALUE`].
pub const IDENTIFICATION: Register =
    row("IDENTIFICATION", 0x100, Access::ReadOnly, IDENTIFICATION_VALUE, &[], OURS);
/// Interface version.
pub const VERSION: Register = row(
    "VERSION",
    0x104,
    Access::ReadOnly,
    (VERSION_MAJOR << 16) | VERSION_MINOR,
    &[version::MINOR, version::MAJOR],
    OURS,
);
/// Identifier of the [`Profile`](super::profile::Profile).
pub const PROFILE: Register = read_only("PROFILE", 0x108, &[]);
/// Optional abilities.
pub const FEATURES: Register =
    read_only("FEATURES", 0x10C, &[features::INTERLOCKED, features::WORLD_INERTIA]);
/// Numbers of streams.
pub const CHANNELS: Register = read_only("CHANNELS", 0x110, &[channels::MM2S, channels::S2MM]);
/// Widths of the MM2S streams: for stream k bits 4k+3:4k hold log2(width / 8 bits).
pub const MM2S_WIDTHS: Register = read_only("MM2S_WIDTHS", 0x114, &[]);
/// Widths of the S2MM streams, coded likewise.
pub const S2MM_WIDTHS: Register = read_only("S2MM_WIDTHS", 0x118, &[]);
/// Initiation interval and collisions per issue.
pub const ISSUE: Register = read_only("ISSUE", 0x11C, &[issue::INTERVAL, issue::COLLISIONS]);
/// Depth of the contact pipeline, cycles.
pub const CONTACT_DEPTH: Register =
    read_only("CONTACT_DEPTH", 0x120, &[depth::FILL, depth::WINDOW]);
/// Depth of the friction pipeline, cycles.
pub const FRICTION_DEPTH: Register =
    read_only("FRICTION_DEPTH", 0x124, &[depth::FILL, depth::WINDOW]);
/// Clock of the accelerator and its streams, kHz.
pub const CLOCK_KHZ: Register = read_only("CLOCK_KHZ", 0x128, &[]);
/// Largest number of bodies.
pub const BODY_CAPACITY: Register = read_only("BODY_CAPACITY", 0x12C, &[]);
/// Largest number of collisions beside no bodies: see [`MEMORY_BYTES`].
pub const COLLISION_CAPACITY: Register = read_only("COLLISION_CAPACITY", 0x130, &[]);
/// Entries of the shape table.
pub const SHAPE_CAPACITY: Register = read_only("SHAPE_CAPACITY", 0x134, &[]);
/// On-chip memory of bodies and collisions, bytes: shared by them, or the sum of an array for each,
/// whose capacities are then the limits.
pub const MEMORY_BYTES: Register = read_only("MEMORY_BYTES", 0x138, &[]);
/// Bytes of [`MEMORY_BYTES`] that a body takes, and that a collision takes.
pub const MEMORY_PER_RECORD: Register =
    read_only("MEMORY_PER_RECORD", 0x13C, &[memory_per_record::BODY, memory_per_record::COLLISION]);
/// How the AXI DMAs were built.
pub const DMA: Register = read_only("DMA", 0x140, &[dma::LENGTH_WIDTH, dma::ADDRESS_WIDTH]);

/// Formats on the streams, in the arithmetic and on chip; all 0 is f32 throughout.
pub const NUMBERS: Register = read_only(
    "NUMBERS",
    0x144,
    &[
        numbers::COLLISIONS,
        numbers::BODIES,
        numbers::ROWS,
        numbers::UPDATES,
        numbers::VELOCITIES,
        numbers::IMPULSES,
        numbers::POSES,
    ],
);
/// Collisions that wait in the issue queue when it is full; 0: there is none, and collisions enter
/// in the order of the stream. At most [`QUEUE_MAX`].
pub const QUEUE: Register = read_only("QUEUE", 0x148, &[]);
/// First byte of the [`Fence`](super::fence::Fence), in units of
/// [`FENCE_UNIT`](super::fence::FENCE_UNIT).
pub const FENCE_BASE: Register = read_only("FENCE_BASE", 0x150, &[]);
/// Length of the fence, in the same units; 0: there is none.
pub const FENCE_SIZE: Register = read_only("FENCE_SIZE", 0x154, &[]);

/// Sticky error; cleared by a reset only.
pub const ERROR: Register = read_only("ERROR", 0x180, &[error::CODE, error::CHANNEL]);
/// Detail of the sticky error: the index of the record, or the offending value.
pub const ERROR_DETAIL: Register = read_only("ERROR_DETAIL", 0x184, &[]);
/// Clock cycles of the last step from start to done, bits 31:0.
pub const CYCLES_LO: Register = read_only("CYCLES_LO", 0x188, &[]);
/// Clock cycles of the last step, bits 63:32.
pub const CYCLES_HI: Register = read_only("CYCLES_HI", 0x18C, &[]);
/// Cycles of the last step by the formula: without the waits for a velocity that is not written
/// back yet, and without the waits for a stream. It stops at [`COUNTER_MAX`]. [`CYCLES_LO`] less
/// this and [`WAIT_CYCLES`] are the interlock stalls, which may take more than 32 bits.
pub const WORK_CYCLES: Register = read_only("WORK_CYCLES", 0x190, &[]);
/// Cycles of the last step in which the accelerator waited for a stream; stops at [`COUNTER_MAX`].
pub const WAIT_CYCLES: Register = read_only("WAIT_CYCLES", 0x194, &[]);
/// Collisions that met a hazard, over all passes: they waited (interlocked; in an issue queue as
/// the oldest one) or read a stale velocity (unchecked). It stops at [`COUNTER_MAX`].
pub const HAZARDS: Register = read_only("HAZARDS", 0x198, &[]);
/// Sum modulo 2^32 of all 32-bit words received in the last step.
pub const SUM_RECEIVED: Register = read_only("SUM_RECEIVED", 0x19C, &[]);
/// Sum modulo 2^32 of all 32-bit words sent in the last step.
pub const SUM_SENT: Register = read_only("SUM_SENT", 0x1A0, &[]);
/// Sum of the accumulated normal impulses as the last contact pass leaves them, in units of
/// 2^-[`IMPULSE_SUM_FRACTION_BITS`] N s (each collision's sum rounded down), bits 31:0. It stops at
/// [`IMPULSE_SUM_MAX`].
pub const IMPULSE_SUM_LO: Register = read_only("IMPULSE_SUM_LO", 0x1A4, &[]);
/// Sum of the accumulated normal impulses, bits 63:32.
pub const IMPULSE_SUM_HI: Register = read_only("IMPULSE_SUM_HI", 0x1A8, &[]);
/// Soft reset of the accelerator.
pub const RESET: Register = row("RESET", 0x1C0, Access::SelfClearing, 0, &[reset::RESET], OURS);

/// Most passes of each kind that the pass counters hold.
pub const ITERATIONS_MAX: u32 = 255;

/// Longest issue queue that a bitstream may have, collisions.
pub const QUEUE_MAX: u32 = 256;
/// Hazard windows for which younger collisions may pass the oldest one in the issue queue. After
/// them none may take its bodies.
pub const QUEUE_PATIENCE: u32 = 4;
/// Collisions of the issue queue whose numbers share a beat, behind their impulses.
pub const NUMBERS_PER_BEAT: u32 = 4;

/// The value at which the counters of 32 bits stop: it stands for this count and any larger one.
pub const COUNTER_MAX: u32 = u32::MAX;

/// Fraction bits of the impulse sum.
pub const IMPULSE_SUM_FRACTION_BITS: u32 = 20;
/// The value at which the impulse sum stops, 2^44 N s: it stands for this sum, any larger one, and
/// an infinite one.
pub const IMPULSE_SUM_MAX: u64 = u64::MAX;

/// First byte of the shape table.
pub const SHAPE_TABLE: u32 = 0x400;
/// Distance between shape table entries, bytes.
pub const SHAPE_STRIDE: u32 = 16;
/// Offset in an entry of the inverse mass, 1/kg, f32; 0 is static.
pub const SHAPE_INVERSE_MASS: u32 = 0x0;
/// Offset in an entry of the isotropic inverse inertia, 1/(kg m²), f32; without meaning to a
/// bitstream with world inertia. The last two words of the entry are reserved and written 0.
pub const SHAPE_INVERSE_INERTIA: u32 = 0x4;
/// Every register outside the shape table, by offset.
pub const REGISTERS: &[Register] = &[
    AP_CTRL,
    GIE,
    IER,
    ISR,
    BODIES,
    COLLISIONS,
    CONTACT_ITERATIONS,
    FRICTION_ITERATIONS,
    FLAGS,
    TIME_STEP,
    POSITION_DRIFT,
    POSITION_COEFFICIENT,
    FRICTION,
    ANGULAR_DAMPING,
    GRAVITY_X,
    GRAVITY_Y,
    GRAVITY_Z,
    SPIN_DAMPING,
    IDENTIFICATION,
    VERSION,
    PROFILE,
    FEATURES,
    CHANNELS,
    MM2S_WIDTHS,
    S2MM_WIDTHS,
    ISSUE,
    CONTACT_DEPTH,
    FRICTION_DEPTH,
    CLOCK_KHZ,
    BODY_CAPACITY,
    COLLISION_CAPACITY,
    SHAPE_CAPACITY,
    MEMORY_BYTES,
    MEMORY_PER_RECORD,
    DMA,
    NUMBERS,
    QUEUE,
    FENCE_BASE,
    FENCE_SIZE,
    ERROR,
    ERROR_DETAIL,
    CYCLES_LO,
    CYCLES_HI,
    WORK_CYCLES,
    WAIT_CYCLES,
    HAZARDS,
    SUM_RECEIVED,
    SUM_SENT,
    IMPULSE_SUM_LO,
    IMPULSE_SUM_HI,
    RESET,
];

/// Codes of the sticky error.
///
/// After an error the accelerator takes and sends no more beats, sets `ap_done` and waits for a
/// [`RESET`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[non_exhaustive]
#[repr(u8)]
pub enum ErrorCode {
    /// A collision's body index is not below B; detail: the collision.
    BodyIndex = 1,
    /// A collision's contact count is above 4; detail: the collision.
    ContactCount = 2,
    /// TLAST before the last beat of a segment; detail: the beat within the channel's packet.
    TlastEarly = 3,
    /// No TLAST with the last beat of a segment; detail: the beat within the channel's packet.
    TlastMissing = 4,
    /// A velocity's shape index is not below the shape table's length; detail: the body.
    ShapeIndex = 5,
    /// B and C do not fit the on-chip memory; detail: bytes that they need.
    Capacity = 6,
    /// A collision of two static bodies; detail: the collision.
    StaticPair = 7,
    /// A collision of a body with itself; detail: the collision.
    SelfCollision = 8,
    /// An argument outside its range (B = 0); detail: its offset.
    Argument = 9,
    /// A beat with invalid bytes (TKEEP); detail: the beat within the packet.
    PartialBeat = 10,
}

impl ErrorCode {
    /// All codes.
    pub const ALL: [Self; 10] = [
        Self::BodyIndex,
        Self::ContactCount,
        Self::TlastEarly,
        Self::TlastMissing,
        Self::ShapeIndex,
        Self::Capacity,
        Self::StaticPair,
        Self::SelfCollision,
        Self::Argument,
        Self::PartialBeat,
    ];

    /// The code in the register's field; `None` for 0 and for unknown codes.
    #[must_use]
    pub fn from_register(error: u32) -> Option<Self> {
        let code = self::error::CODE.of(error);
        Self::ALL.into_iter().find(|known| *known as u32 == code)
    }

    /// A description of the error for error messages.
    #[must_use]
    pub const fn describe(self) -> &'static str {
        match self {
            Self::BodyIndex => "body index out of range",
            Self::ContactCount => "contact count out of range",
            Self::TlastEarly => "TLAST before the end of the packet",
            Self::TlastMissing => "no TLAST at the end of the packet",
            Self::ShapeIndex => "shape index out of range",
            Self::Capacity => "more bodies and collisions than the on-chip memory holds",
            Self::StaticPair => "collision of two static bodies",
            Self::SelfCollision => "collision of a body with itself",
            Self::Argument => "argument out of range",
            Self::PartialBeat => "beat with invalid bytes",
        }
    }
}
