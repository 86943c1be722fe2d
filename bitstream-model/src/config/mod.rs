//! Configures an emulated board: the choices that a bitstream, a block design and a device tree fix
//! on a real one.

pub(crate) mod quirks;

use std::num::NonZero;
use std::sync::OnceLock;

use self::quirks::Quirks;
use pgs_interface::address_map::CONTROL_BYTES;
use pgs_interface::address_map::DMA_COUNT_MAX;
use pgs_interface::axi_dma::{LENGTH_WIDTH_MAX, LENGTH_WIDTH_MIN};
use pgs_interface::control::{QUEUE_MAX, SHAPE_STRIDE, SHAPE_TABLE};
use pgs_interface::fence::Fence;
use pgs_interface::number::{Numbers, Precision};
use pgs_interface::profile::{Depth, FLOAT, Inertia, Profile, Variant};
use pgs_interface::record::{BEAT_BYTES, collision};
use pgs_interface::stripe::Stripe;

/// Upper limit of the beats in a group of a stripe.
pub(crate) const GROUP_MAX: usize = 8;

/// Clock cycles that a beat takes on a stream of `width` bits.
pub(crate) const fn beat_cycles(width: u32) -> u64 {
    8 * BEAT_BYTES as u64 / width as u64
}

/// The pipeline's behaviour when a collision needs a velocity that is still being computed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Hazards {
    /// It waits: correct, and slow on an unfavourable order.
    Interlocked,
    /// It reads the stale velocity, and the later write-back overwrites the earlier one, as in the
    /// thesis (§5.4.4).
    Unchecked,
}

/// Bandwidth of the memory, shared by all streams.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Bandwidth {
    /// Every stream always has data, as the thesis assumes.
    Unlimited,
    /// Bytes per second, reads and writes together.
    BytesPerSecond(u64),
}

impl Bandwidth {
    /// Peak of the ZCU102 preset, DDR4-2133 at 64 bit: 17.07 GB/s.
    pub const ZCU102_PEAK: Self = Self::BytesPerSecond(17_070_000_000);
    /// Sustained bandwidth of a published measurement on the ZCU102, about 75 % of the peak:
    /// 12.8 GB/s.
    pub const ZCU102_SUSTAINED: Self = Self::BytesPerSecond(12_800_000_000);
}

/// Delays and depths of the emulated parts, in clock cycles unless noted.
///
/// The defaults are not measured on a real board: they make a driver meet every intermediate state.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Delays {
    /// A register access by the CPU, ns (AXI-Lite through the HPM port: 100 to 200 ns).
    pub register_access_ns: u64,
    /// RS written to Halted following it.
    pub halt: u64,
    /// Reset of a DMA core, or of the accelerator, to its end.
    pub reset: u64,
    /// First fetch of a descriptor after a doorbell; later ones are fetched ahead.
    pub descriptor_fetch: u64,
    /// Depth of the FIFO between a DMA channel and the accelerator, beats.
    pub fifo_beats: usize,
}

impl Default for Delays {
    fn default() -> Self {
        Self {
            register_access_ns: 150,
            halt: 100,
            reset: 200,
            descriptor_fetch: 60,
            fifo_beats: 512,
        }
    }
}

/// Cycles of a clock of `clock_khz` in `ns` nanoseconds.
pub(crate) fn cycles_of(ns: u64, clock_khz: u32) -> u64 {
    let cycles = u128::from(ns) * u128::from(clock_khz) / 1_000_000;
    u64::try_from(cycles).unwrap_or(u64::MAX)
}

/// Upper limit of a profile's velocity copies, block RAM clocks and collisions of an issue.
const SIZE_MAX: u32 = 16;
/// Shapes that fit into the control block.
pub(crate) const SHAPES_MAX: u32 = (CONTROL_BYTES - SHAPE_TABLE) / SHAPE_STRIDE;
/// 32-bit words of a beat.
const BEAT_WORDS: u32 = 4;

/// Upper limit of [`BoardConfig::threads`]; more than a few threads have no work.
pub const THREADS_MAX: usize = 31;
const THREADS_DEFAULT_MAX: usize = 4;

/// How to build an emulated board.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct BoardConfig {
    /// The design.
    pub profile: &'static Profile,
    /// Its formats, instead of the profile's own; of the same widths on the streams.
    pub numbers: Option<Numbers>,
    /// Form in which it gets the inertia of its bodies.
    pub inertia: Inertia,
    /// Behaviour on read-after-write hazards.
    pub hazards: Hazards,
    /// Depth of the issue queue in collisions, 0 for none, instead of the profile's. Only an
    /// interlocked design whose profile [has a queue](Profile::has_queue) can have one.
    pub queue: Option<u32>,
    /// Hazard window of both solvers in issue slots, instead of the profile's cycles.
    pub window_slots: Option<u32>,
    /// Memory bandwidth.
    pub bandwidth: Bandwidth,
    /// Width of the DMA length registers, 8 to 26 bits.
    pub length_width: u32,
    /// Width of the DMA's memory addresses, 32 to 64 bits.
    pub address_width: u32,
    /// The one address segment that the DMA masters reach. A board with memory of its own then
    /// allocates there alone. Without one they reach all of the DDR.
    pub fence: Option<Fence>,
    /// Whether the DMAs have the scatter-gather engine.
    pub scatter_gather: bool,
    /// Whether the board goes dead after the first violation, so that a test cannot miss it.
    pub strict: bool,
    /// Delays and depths.
    pub delays: Delays,
    /// Mistakes in the build.
    pub quirks: Quirks,
    /// Threads of the host for the fast way's arithmetic, with the caller's thread. They change no
    /// result and no counter.
    pub threads: usize,
    /// Whether the board takes a step at once where its host waits for the whole step. This changes
    /// no result. It changes the count of waits, and the count of stalls where collisions wait for
    /// beats (`fast/README.md`).
    pub fast: bool,
}

impl Default for BoardConfig {
    /// The `float` profile, interlocked, sustained bandwidth of the ZCU102, 26-bit lengths, 40-bit
    /// addresses, no fence (so that memory lies on both sides of 4 GiB), strict, nothing built
    /// wrongly.
    fn default() -> Self {
        Self {
            profile: &FLOAT,
            numbers: None,
            inertia: Inertia::Isotropic,
            hazards: Hazards::Interlocked,
            queue: None,
            window_slots: None,
            bandwidth: Bandwidth::ZCU102_SUSTAINED,
            length_width: LENGTH_WIDTH_MAX,
            address_width: 40,
            fence: None,
            scatter_gather: true,
            strict: true,
            delays: Delays::default(),
            quirks: Quirks::default(),
            threads: threads_of_host(),
            fast: true,
        }
    }
}

/// The host's processors, up to the default limit.
fn threads_of_host() -> usize {
    static THREADS: OnceLock<usize> = OnceLock::new();
    *THREADS.get_or_init(|| {
        std::thread::available_parallelism().map_or(1, NonZero::get).min(THREADS_DEFAULT_MAX)
    })
}

/// A board that cannot be built.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum ConfigError {
    /// Formats that do not fit the streams of the profile.
    #[error(
        "{stream} records of {found} bits a number, expected {expected} as the profile has them"
    )]
    StreamFormat {
        /// Which records.
        stream: &'static str,
        /// Bits of the requested format.
        found: u32,
        /// Bits of the profile's format.
        expected: u32,
    },
    /// World inertia on a profile that is built without it.
    #[error("expected isotropic inertia on {profile}, found world inertia: take float")]
    NoWorldInertia {
        /// Name of the profile.
        profile: &'static str,
    },
    /// Constraint rows of higher precision than the updates that use them.
    #[error(
        "constraint rows in f32 and updates in binary16, which cannot take them; expected updates \
         in f32, or both in binary16"
    )]
    RowsBeyondUpdates,
    /// An issue queue in a design that has none.
    #[error(
        "expected no issue queue in {hazards} {profile}, found one of {found} collisions: take an \
         interlocked float, or queue=0"
    )]
    NoQueue {
        /// The treatment of hazards.
        hazards: &'static str,
        /// Name of the profile.
        profile: &'static str,
        /// The requested depth.
        found: u32,
    },
    /// A profile of the caller's own that contradicts itself.
    #[error("profile {name:?}: {what}")]
    Profile {
        /// Its name.
        name: &'static str,
        /// The expected state.
        what: &'static str,
    },
    /// A number outside its range.
    #[error("{what} is {found}, expected {low} to {high}")]
    OutOfRange {
        /// Which number.
        what: &'static str,
        /// The requested value.
        found: u64,
        /// Smallest value.
        low: u64,
        /// Largest value.
        high: u64,
    },
}

impl BoardConfig {
    /// The profile with the chosen formats and inertia.
    #[must_use]
    pub fn variant(&self) -> Variant {
        Variant {
            profile: self.profile,
            numbers: self.numbers.unwrap_or(self.profile.numbers),
            inertia: self.inertia,
        }
    }

    /// Depth of the issue queue, collisions; 0: there is none.
    #[must_use]
    pub fn queue_depth(&self) -> u32 {
        let of_profile = match self.hazards {
            Hazards::Interlocked => self.profile.queue,
            Hazards::Unchecked => None,
        };
        self.queue.or(of_profile).unwrap_or(0)
    }

    /// Depth of one kind of pass on this board: a pass ends no sooner than its last write-back.
    pub(crate) fn depth(&self, design: Depth) -> Depth {
        let window = match self.window_slots {
            Some(slots) => slots.saturating_mul(self.profile.initiation_interval),
            None => design.window,
        };
        Depth { fill: design.fill.max(window), window }
    }

    /// Clock cycles in `ns` nanoseconds.
    pub(crate) fn cycles(&self, ns: u64) -> u64 {
        cycles_of(ns, self.profile.clock_khz)
    }

    pub(crate) fn check(&self) -> Result<(), ConfigError> {
        let range = |what, found: u64, low: u64, high: u64| {
            if (low..=high).contains(&found) {
                Ok(())
            } else {
                Err(ConfigError::OutOfRange { what, found, low, high })
            }
        };
        range(
            "length register width",
            self.length_width.into(),
            LENGTH_WIDTH_MIN.into(),
            LENGTH_WIDTH_MAX.into(),
        )?;
        range("threads of the host", self.threads as u64, 1, THREADS_MAX as u64)?;
        range("FIFO depth in beats", self.delays.fifo_beats as u64, 16, 1 << 20)?;
        check_profile(self.profile)?;
        self.check_numbers()?;
        self.check_sizes(range)?;
        let queue = self.queue_depth();
        range("depth of the issue queue in collisions", queue.into(), 0, QUEUE_MAX.into())?;
        let (has, hazards) = match self.hazards {
            Hazards::Interlocked => (self.profile.has_queue(), "an interlocked"),
            Hazards::Unchecked => (false, "an unchecked"),
        };
        if queue > 0 && !has {
            let profile = self.profile.name;
            return Err(ConfigError::NoQueue { hazards, profile, found: queue });
        }
        range("address width", self.address_width.into(), 32, 64)?;
        // The capability register carries the window in cycles in 16 bits.
        let slots_max = u64::from(u16::MAX) / u64::from(self.profile.initiation_interval);
        range("hazard window in slots", self.window_slots.unwrap_or(1).into(), 1, slots_max)?;
        for (what, cycles) in [
            ("halt delay in cycles", self.delays.halt),
            ("reset delay in cycles", self.delays.reset),
            ("descriptor fetch in cycles", self.delays.descriptor_fetch),
        ] {
            range(what, cycles, 0, 1 << 32)?;
        }
        range("register access time in ns", self.delays.register_access_ns, 1, 1_000_000)?;
        for (what, found, low, high) in self.quirks.ranges() {
            range(what, found, low, high)?;
        }
        if let Bandwidth::BytesPerSecond(bytes) = self.bandwidth {
            range("memory bandwidth in bytes per second", bytes, 1_000_000, 1_000_000_000_000)?;
        }
        Ok(())
    }

    /// Checks the sizes that registers, tables and FIFOs limit.
    fn check_sizes(
        &self,
        range: impl Fn(&'static str, u64, u64, u64) -> Result<(), ConfigError>,
    ) -> Result<(), ConfigError> {
        let (profile, memory) = (self.profile, self.profile.memory);
        for (what, found, high) in [
            ("copies of the velocities", memory.velocity_copies, SIZE_MAX),
            ("clock of the block RAM in clocks of the accelerator", memory.pump, SIZE_MAX),
            ("collisions of an issue", profile.collisions_per_issue, SIZE_MAX),
            ("shape table in entries", profile.shape_capacity, SHAPES_MAX),
        ] {
            range(what, found.into(), 1, high.into())?;
        }
        // An issue enters the pipeline once all of its beats have arrived.
        let words = self.variant().words().collision * profile.collisions_per_issue;
        let beats = words.div_ceil(BEAT_WORDS);
        range("beats of an issue", beats.into(), 1, self.delays.fifo_beats as u64)
    }

    fn check_numbers(&self) -> Result<(), ConfigError> {
        let (asked, own) = (self.variant().numbers, self.profile.numbers);
        for (stream, asked, own) in [
            ("collision", asked.collisions, own.collisions),
            ("velocity", asked.bodies, own.bodies),
            ("pose", asked.poses, own.poses),
        ] {
            let (found, expected) = (asked.bits(), own.bits());
            if found != expected {
                return Err(ConfigError::StreamFormat { stream, found, expected });
            }
        }
        if !self.profile.inertias().contains(&self.inertia) {
            return Err(ConfigError::NoWorldInertia { profile: self.profile.name });
        }
        if (asked.rows, asked.updates) == (Precision::F32, Precision::Binary16) {
            return Err(ConfigError::RowsBeyondUpdates);
        }
        Ok(())
    }
}

/// Checks the profile, which may be the caller's own.
fn check_profile(profile: &'static Profile) -> Result<(), ConfigError> {
    let streams = [profile.mm2s_widths, profile.s2mm_widths];
    let stripe = |stripe: &Stripe, widths: &[u32]| {
        (1..=GROUP_MAX).contains(&stripe.streams.len())
            && stripe.streams.iter().all(|stream| usize::from(*stream) < widths.len())
    };
    let stripes = &profile.stripes;
    let rows = collision::ROWS * profile.collisions_per_issue as usize;
    let issue_beats = rows / profile.numbers.collisions.rows_per_beat();
    let wrong = [
        (
            streams.iter().any(|widths| !(1..=DMA_COUNT_MAX).contains(&widths.len())),
            "1 to 4 streams each way are expected",
        ),
        (
            streams.into_iter().flatten().any(|width| ![32, 64, 128].contains(width)),
            "streams of 32, 64 or 128 bits are expected",
        ),
        (
            ![stripes.collisions, stripes.velocities, stripes.poses]
                .iter()
                .all(|of| stripe(of, profile.mm2s_widths))
                || !stripe(&stripes.results, profile.s2mm_widths),
            "stripes of 1 to 8 beats on streams that exist are expected",
        ),
        (
            stripes.warm_collisions.is_some_and(|warm| {
                // Both stripes repeat themselves after this number of beats.
                let beats = issue_beats.min(GROUP_MAX * GROUP_MAX);
                let begin = |of: Stripe| of.streams.iter().cycle().take(beats);
                !stripe(&warm, profile.mm2s_widths) || !begin(warm).eq(begin(stripes.collisions))
            }),
            "a warm stripe that begins as the stripe of the collisions is expected",
        ),
        (profile.initiation_interval == 0, "an issue of at least one cycle is expected"),
        (profile.clock_khz == 0, "a clock of at least 1 kHz is expected"),
    ];
    match wrong.into_iter().find(|(wrong, _)| *wrong) {
        Some((_, what)) => Err(ConfigError::Profile { name: profile.name, what }),
        None => Ok(()),
    }
}
