//! The options that describe an emulated board. The library knows their values and their texts.

use bitstream_model::interface::fence::Fence;
use bitstream_model::interface::number::{Numbers, Precision};
use bitstream_model::interface::profile::{Inertia, Profile};
use bitstream_model::{Bandwidth, BoardConfig, Hazards};
use clap::Args;
use clap::builder::{PossibleValuesParser, TypedValueParser};
use zynq_pgs::emulation::{Build, BuildError};

/// The build of the emulated board; a real board is built as its bitstream is.
#[derive(Debug, Clone, Copy, Default, PartialEq, Args)]
#[command(next_help_heading = "Emulated board")]
pub struct BuildArgs {
    /// Design of the accelerator [default: float]
    #[arg(long, value_name = "PROFILE", value_parser = profile())]
    profile: Option<&'static Profile>,
    /// Precision of the pipeline's operators; storage keeps the width of the profile [default: the
    /// profile's]
    #[arg(long, value_parser = choice("arithmetic", |build| build.arithmetic))]
    arithmetic: Option<Precision>,
    /// Inertia of a body: equal about every axis, or any (boxes, cylinders and others), streamed
    /// with every body [default: isotropic]
    #[arg(long, value_parser = choice("inertia", |build| build.inertia))]
    inertia: Option<Inertia>,
    /// On a hazard, wait for the velocity or read the stale one [default: interlocked]
    #[arg(long, value_parser = choice("hazards", |build| build.hazards))]
    hazards: Option<Hazards>,
    /// Collisions that wait in the issue queue, 0 for no queue; only an interlocked float has one
    /// [default: the profile's]
    #[arg(long, value_name = "DEPTH", value_parser = number("queue", |build| build.queue))]
    queue: Option<u32>,
    /// Hazard window in issue slots [default: the profile's]
    #[arg(long, value_name = "SLOTS", value_parser = number("window", |build| build.window))]
    window: Option<u32>,
    /// Memory bandwidth in GB/s, or "unlimited" [default: 12.8]
    #[arg(long, value_name = "GBPS", value_parser = number("bandwidth", |build| build.bandwidth))]
    bandwidth: Option<Bandwidth>,
    /// Width of the DMA length registers in bits, 8 to 26 [default: 26]
    #[arg(
        long,
        value_name = "BITS",
        value_parser = number("length-width", |build| build.length_width)
    )]
    length_width: Option<u32>,
    /// Width of DMA addresses in bits, 32 to 64 [default: 40]
    #[arg(
        long,
        value_name = "BITS",
        value_parser = number("address-width", |build| build.address_width)
    )]
    address_width: Option<u32>,
    /// The only memory that the DMA cores reach, as 0x50000000+64M: a power of two of at least 64K,
    /// at a multiple of it [default: no fence]
    #[arg(long, value_name = "BASE+BYTES", value_parser = number("fence", |build| build.fence))]
    fence: Option<Fence>,
    /// Threads of this machine
    ///
    /// For the emulated board's arithmetic, for collision detection, and for packing and unpacking
    /// a step; no result depends on their number [default: one per processor, at most 4]
    #[arg(long, value_name = "N", value_parser = number("threads", |build| build.threads))]
    threads: Option<usize>,
    /// Take whole steps of the emulated board at once; no result depends on it, but modelled waits
    /// [default: on]
    #[arg(long, value_parser = choice("fast", |build| build.fast))]
    fast: Option<bool>,
}

impl BuildArgs {
    /// The build that the options describe.
    pub fn build(&self) -> Build {
        Build {
            profile: self.profile,
            arithmetic: self.arithmetic,
            inertia: self.inertia,
            hazards: self.hazards,
            queue: self.queue,
            window: self.window,
            bandwidth: self.bandwidth,
            length_width: self.length_width,
            address_width: self.address_width,
            fence: self.fence,
            threads: self.threads,
            fast: self.fast,
        }
    }
}

/// Parses the name of a profile.
pub fn profile() -> impl TypedValueParser<Value = &'static Profile> {
    choice("profile", |build| build.profile)
}

/// Parses an option whose values have names.
fn choice<T: Clone + Send + Sync + 'static>(
    key: &'static str,
    get: fn(&Build) -> Option<T>,
) -> impl TypedValueParser<Value = T> {
    let value = number(key, get);
    PossibleValuesParser::new(Build::names(key)).try_map(move |name| value(&name))
}

/// Parses an option whose values are numbers.
pub fn number<T>(
    key: &'static str,
    get: fn(&Build) -> Option<T>,
) -> impl Fn(&str) -> Result<T, String> + Clone {
    move |text| {
        let mut build = Build::default();
        let set = build.set(key, text).map_err(|error| match error {
            BuildError::Value { expected, .. } => format!("expected {expected}"),
            error => error.to_string(),
        });
        set.and_then(|()| get(&build).ok_or_else(|| format!("{key} has no such value")))
    }
}

/// The first given option that describes a board. `--threads` does not: collision detection and
/// packing use it with every board.
pub fn board_option(build: &Build) -> Option<String> {
    let given = |key: &&str| *key != "threads" && build.value(key).is_some();
    Build::keys().find(given).map(|key| format!("--{key}"))
}

/// A board as its text, without what changes no result. Where no text tells all number formats, as
/// for a bitstream that this command cannot build, the formats follow in words.
pub fn described(config: &BoardConfig) -> String {
    let build = Build { threads: None, fast: None, ..Build::of(config) };
    let variant = config.variant();
    if build.config().variant() == variant {
        return build.to_string();
    }
    let Numbers { collisions, bodies, poses, rows, updates, velocities, impulses } =
        variant.numbers;
    format!(
        "{build} (streams: collisions {}, velocities {}, poses {}; arithmetic: rows {}, updates \
         {}; on chip: velocities {}, impulses {})",
        collisions.name(),
        bodies.name(),
        poses.name(),
        rows.name(),
        updates.name(),
        velocities.name(),
        impulses.name(),
    )
}

#[cfg(test)]
mod tests {
    use clap::Parser;

    use super::*;

    #[derive(Debug, Parser)]
    struct Options {
        #[command(flatten)]
        build: BuildArgs,
    }

    #[test]
    fn each_option_of_the_command_line_is_that_of_a_text() {
        let text = "half,f32,unchecked,queue=0,window=9,world,bandwidth=unlimited,\
                    length-width=14,address-width=32,fence=0x50000000+64M,threads=3,fast=off";
        let expected: Build = text.parse().expect("a build");
        let options = Build::keys()
            .map(|key| format!("--{key}={}", expected.value(key).expect("given in the text")));
        let parsed = Options::try_parse_from([String::new()].into_iter().chain(options));
        assert_eq!(parsed.expect("options").build.build(), expected);
        Options::try_parse_from(["", "--arithmetic", "f64"]).expect_err("no choice");
        let error = Options::try_parse_from(["", "--window", "0"]).expect_err("no window");
        assert!(error.to_string().contains(": expected a whole number from 1 to "), "{error}");
    }

    #[test]
    fn every_option_is_named_when_it_is_given() {
        assert_eq!(board_option(&Build::default()), None);
        for (key, value) in
            [("arithmetic", "f32"), ("hazards", "unchecked"), ("fast", "off"), ("profile", "half")]
        {
            let mut build = Build::default();
            build.set(key, value).expect(key);
            assert_eq!(board_option(&build), Some(format!("--{key}")));
        }
        // Detection and packing use them on a real board, too.
        assert_eq!(board_option(&Build { threads: Some(1), ..Build::default() }), None);
    }

    #[test]
    fn formats_that_no_text_says_are_said_in_words() {
        let of = |name: &str, change: fn(&mut Numbers)| {
            let profile = Profile::by_name(name).expect(name);
            let mut numbers = profile.numbers;
            change(&mut numbers);
            described(&BoardConfig { profile, numbers: Some(numbers), ..BoardConfig::default() })
        };
        assert_eq!(
            of("half", |numbers| numbers.velocities = Precision::F32),
            "half (streams: collisions binary16, velocities binary16, poses binary16; arithmetic: \
             rows binary16, updates binary16; on chip: velocities f32, impulses binary16)"
        );
        assert_eq!(
            of("half", |numbers| numbers.updates = Precision::F32),
            "half,f32 (streams: collisions binary16, velocities binary16, poses binary16; \
             arithmetic: rows binary16, \
             updates f32; on chip: velocities binary16, impulses binary16)"
        );
        for text in ["float", "naive,unchecked", "float,world", "half,f32"] {
            assert_eq!(described(&text.parse::<Build>().expect(text).config()), text);
        }
        let of_this_machine: Build = "float,threads=1,fast=off".parse().expect("a build");
        assert_eq!(described(&of_this_machine.config()), "float");
    }
}
