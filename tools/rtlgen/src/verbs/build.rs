//! The options that describe a build of the accelerator.

use clap::{Args, ValueEnum};
use pgs_interface::control::QUEUE_MAX;
use pgs_interface::fence::Fence;
use pgs_interface::profile::{FLOAT, HALF, Inertia};
use rtlgen::design::{BuildError, Design, Parameters};

/// The behaviour of the hardware on a hazard.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Hazards {
    /// Waits for the velocity.
    Interlocked,
    /// Reads the stale velocity, and counts.
    Unchecked,
}

/// The result of a product or a quotient that rounds up to the smallest normal number.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum SmallestNormal {
    /// The smallest normal number, as the specification says.
    Exact,
    /// Sometimes zero: off the specification, for the cost of the rule.
    Dropped,
}

/// The form of the bodies' inertia.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum InertiaForm {
    /// Equal about every axis.
    Isotropic,
    /// Any, streamed with every body, with its mass.
    World,
}

/// The profiles that have Verilog.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum ProfileName {
    /// Four streams of 128 bits, f32.
    Float,
    /// Streams of 128, 128 and 64 bits, binary16, two collisions in three cycles.
    Half,
}

/// A build of the accelerator.
#[derive(Debug, Clone, Args)]
#[command(next_help_heading = "Build")]
pub(crate) struct BuildArgs {
    /// Profile of the build
    #[arg(long, value_enum, default_value_t = ProfileName::Float)]
    profile: ProfileName,
    /// Inertia of a body: equal about every axis, or any (boxes, cylinders and others), streamed
    /// with every body
    #[arg(long, value_enum, default_value_t = InertiaForm::Isotropic)]
    inertia: InertiaForm,
    /// Bodies that the memories hold [default: 40960; with world inertia 16384]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(2..=131_072))]
    bodies: Option<u32>,
    /// Collisions that the memories hold [default: 131072; with world inertia 65536]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(2..=524_288))]
    collisions: Option<u32>,
    /// On a hazard, wait for the velocity or read the stale one
    #[arg(long, value_enum, default_value_t = Hazards::Interlocked)]
    hazards: Hazards,
    /// Collisions that wait in the issue queue; 0: no queue. Only an interlocked build can have one
    /// [default: the profile's, 64 in `float`; unchecked 0]
    #[arg(long, value_name = "N",
          value_parser = clap::value_parser!(u32).range(0..=i64::from(QUEUE_MAX)))]
    queue: Option<u32>,
    /// Registers in front of the velocity and impulse memories
    #[arg(long, value_name = "N", default_value_t = Parameters::default().address_stages,
          value_parser = clap::value_parser!(u32).range(1..=4))]
    address_stages: u32,
    /// Registers behind the velocity and impulse memories
    #[arg(long, value_name = "N", default_value_t = Parameters::default().output_stages,
          value_parser = clap::value_parser!(u32).range(1..=5))]
    output_stages: u32,
    /// Products and quotients that round up to the smallest normal number
    #[arg(long, value_enum, default_value_t = SmallestNormal::Exact)]
    smallest_normal: SmallestNormal,
    /// The only memory that the DMA masters reach, as 0x40000000+512M: a power of two of at least
    /// 64K, at a multiple of it. The device tree must reserve the same
    #[arg(long, value_name = "BASE+BYTES", default_value_t = Fence::default())]
    memory: Fence,
    /// Clock that the capability register reports, kHz [default: the profile's]
    #[arg(long, value_name = "KHZ")]
    clock_khz: Option<u32>,
}

impl BuildArgs {
    /// The design that the options describe.
    pub(crate) fn design(&self) -> Result<Design, BuildError> {
        let inertia = match self.inertia {
            InertiaForm::Isotropic => Inertia::Isotropic,
            InertiaForm::World => Inertia::World,
        };
        let profile = match self.profile {
            ProfileName::Float => &FLOAT,
            ProfileName::Half => &HALF,
        };
        let default = Parameters::of(profile, inertia);
        let interlocked = self.hazards == Hazards::Interlocked;
        let parameters = Parameters {
            profile,
            bodies: self.bodies.unwrap_or(default.bodies),
            collisions: self.collisions.unwrap_or(default.collisions),
            inertia,
            interlocked,
            queue: self.queue.unwrap_or(if interlocked { default.queue } else { 0 }),
            address_stages: self.address_stages,
            output_stages: self.output_stages,
            smallest_normal: self.smallest_normal == SmallestNormal::Exact,
            memory: self.memory,
            clock_khz: self.clock_khz.unwrap_or(default.clock_khz),
        };
        parameters.check()?;
        Ok(Design::new(parameters))
    }
}
