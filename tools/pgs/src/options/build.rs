//! The options that describe an emulated board, and their names on the command line.

use std::fmt::Display;
use std::str::FromStr;

use bitstream_model::interface::number::{Numbers, Precision, StreamFormat};
use bitstream_model::interface::profile::{FLOAT, Inertia, PROFILES, Profile};
use bitstream_model::{Bandwidth, BoardConfig, Hazards, Subnormals, THREADS_MAX};
use clap::builder::{PossibleValuesParser, TypedValueParser};
use clap::{Args, ValueEnum};

use super::bandwidth::bandwidth;

/// The build of the emulated board; a real board is built as its bitstream is.
///
/// [`build_text`](super::build_text) writes and reads a build as one text.
#[derive(Debug, Clone, Copy, Default, PartialEq, Args)]
#[command(next_help_heading = "Emulated board")]
pub(crate) struct BuildArgs {
    /// Design of the accelerator [default: float]
    #[arg(long, value_name = "PROFILE", value_parser = profile())]
    pub(crate) profile: Option<&'static Profile>,
    /// Numbers on streams of 16 bits [default: binary16]
    #[arg(long, value_enum)]
    pub(crate) format: Option<FormatName>,
    /// Precision of the pipeline's operators; storage keeps the width of the profile [default: the
    /// profile's]
    #[arg(long, value_enum)]
    pub(crate) arithmetic: Option<ArithmeticName>,
    /// Inertia of a body: equal about every axis, or any (boxes, capsules), streamed with every
    /// body [default: isotropic]
    #[arg(long, value_enum)]
    pub(crate) inertia: Option<InertiaName>,
    /// On a hazard, wait for the velocity or read the stale one [default: interlocked]
    #[arg(long, value_enum)]
    pub(crate) hazards: Option<HazardsName>,
    /// Hazard window in issue slots [default: the profile's]
    #[arg(long, value_name = "SLOTS", value_parser = window)]
    pub(crate) window: Option<u32>,
    /// Keep subnormal numbers or flush them to zero [default: keep]
    #[arg(long, value_enum)]
    pub(crate) subnormals: Option<SubnormalsName>,
    /// Memory bandwidth in GB/s, or "unlimited" [default: 12.8]
    #[arg(long, value_name = "GBPS", value_parser = bandwidth)]
    pub(crate) bandwidth: Option<Bandwidth>,
    /// Width of the DMA length registers in bits, 8 to 26 [default: 26]
    #[arg(long, value_name = "BITS", value_parser = length_width)]
    pub(crate) length_width: Option<u32>,
    /// Width of DMA addresses in bits, 32 to 64 [default: 40]
    #[arg(long, value_name = "BITS", value_parser = address_width)]
    pub(crate) address_width: Option<u32>,
    /// Threads of this machine for the emulated board's arithmetic, for collision detection, and
    /// for packing and unpacking a step; no result depends on their number [default: one per
    /// processor, at most 4]
    #[arg(long, value_name = "N", value_parser = threads)]
    pub(crate) threads: Option<usize>,
    /// Compute independent collisions in SIMD lanes; no result depends on it [default: on]
    #[arg(long, value_enum)]
    pub(crate) lanes: Option<LanesName>,
}

/// A choice of a build, with the same names on the command line and in a build's text.
pub(crate) trait Choice: ValueEnum + PartialEq + 'static {
    /// The value that a name stands for.
    type Meaning: PartialEq;

    /// The value of this name.
    fn meaning(&self) -> Self::Meaning;

    /// The name of a value, if it has one.
    fn of(meaning: &Self::Meaning) -> Option<Self> {
        Self::value_variants().iter().find(|name| name.meaning() == *meaning).cloned()
    }

    /// The name as written.
    fn text(&self) -> String {
        self.to_possible_value().map(|value| value.get_name().to_owned()).unwrap_or_default()
    }
}

/// Defines the names of a choice and their values.
macro_rules! choice {
    ($name:ident means $meaning:ty: $($(#[$doc:meta])* $variant:ident is $value:expr),+ $(,)?) => {
        #[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
        pub(crate) enum $name {
            $($(#[$doc])* $variant,)+
        }

        impl Choice for $name {
            type Meaning = $meaning;

            fn meaning(&self) -> $meaning {
                match self {
                    $(Self::$variant => $value,)+
                }
            }
        }
    };
}

choice!(FormatName means StreamFormat:
    /// IEEE 754, rounded to nearest even
    Binary16 is StreamFormat::Binary16,
    /// The thesis' own, rounded by truncation; it has no zero
    Thesis16 is StreamFormat::Thesis16,
);
choice!(ArithmeticName means Precision:
    F32 is Precision::F32,
    Binary16 is Precision::Binary16,
);
choice!(InertiaName means Inertia:
    Isotropic is Inertia::Isotropic,
    World is Inertia::World,
);
choice!(HazardsName means Hazards:
    Interlocked is Hazards::Interlocked,
    Unchecked is Hazards::Unchecked,
);
choice!(LanesName means bool:
    On is true,
    Off is false,
);
choice!(SubnormalsName means Subnormals:
    Keep is Subnormals::Keep,
    Flush is Subnormals::Flush,
);

/// Parses the name of a profile.
pub(crate) fn profile() -> impl TypedValueParser<Value = &'static Profile> {
    PossibleValuesParser::new(PROFILES.iter().map(|profile| profile.name))
        .try_map(|name| Profile::by_name(&name).ok_or("there is no such profile"))
}

/// Parses a number of slots.
pub(crate) fn window(text: &str) -> Result<u32, String> {
    whole(text, 1, u32::MAX)
}

/// Parses a number of threads.
pub(crate) fn threads(text: &str) -> Result<usize, String> {
    whole(text, 1, THREADS_MAX)
}

/// Parses the width of a length register.
pub(crate) fn length_width(text: &str) -> Result<u32, String> {
    whole(text, 8, 26)
}

/// Parses the width of an address.
pub(crate) fn address_width(text: &str) -> Result<u32, String> {
    whole(text, 32, 64)
}

fn whole<T: Copy + FromStr + PartialOrd + Display>(
    text: &str,
    low: T,
    high: T,
) -> Result<T, String> {
    match text.parse() {
        Ok(number) if (low..=high).contains(&number) => Ok(number),
        _ => Err(format!("expected a whole number from {low} to {high}")),
    }
}

impl BuildArgs {
    /// The configuration of the described board.
    pub(crate) fn config(&self) -> BoardConfig {
        let default = BoardConfig::default();
        let profile = self.profile.unwrap_or(&FLOAT);
        let numbers = self.numbers(&profile.numbers);
        BoardConfig {
            profile,
            numbers: (numbers != profile.numbers).then_some(numbers),
            inertia: self.inertia.map_or(default.inertia, |name| name.meaning()),
            hazards: self.hazards.map_or(default.hazards, |name| name.meaning()),
            window_slots: self.window,
            subnormals: self.subnormals.map_or(default.subnormals, |name| name.meaning()),
            bandwidth: self.bandwidth.unwrap_or(default.bandwidth),
            length_width: self.length_width.unwrap_or(default.length_width),
            address_width: self.address_width.unwrap_or(default.address_width),
            threads: self.threads.unwrap_or(default.threads),
            lanes: self.lanes.map_or(default.lanes, |name| name.meaning()),
            ..default
        }
    }

    /// The profile's number formats, with the formats of the options in their place.
    fn numbers(&self, own: &Numbers) -> Numbers {
        let mut numbers = *own;
        if let Some(format) = self.format.map(|name| name.meaning()) {
            let narrow = |stream: StreamFormat| stream.bits() == format.bits();
            // Where no stream has 16 bits, the board's error tells which widths do not fit.
            let none = ![own.collisions, own.bodies, own.poses].into_iter().any(narrow);
            for stream in [&mut numbers.collisions, &mut numbers.bodies, &mut numbers.poses] {
                if none || narrow(*stream) {
                    *stream = format;
                }
            }
        }
        if let Some(arithmetic) = self.arithmetic.map(|name| name.meaning()) {
            (numbers.rows, numbers.updates) = (arithmetic, arithmetic);
        }
        numbers
    }

    /// The options that turn the default board of a profile into this one.
    pub(crate) fn of(config: &BoardConfig) -> Self {
        fn unlike<T: PartialEq + Copy>(value: T, default: T) -> Option<T> {
            (value != default).then_some(value)
        }
        let default = BoardConfig::default();
        let (own, numbers) = (config.profile.numbers, config.variant().numbers);
        let format = unlike(numbers.collisions, own.collisions)
            .or_else(|| unlike(numbers.bodies, own.bodies))
            .or_else(|| unlike(numbers.poses, own.poses));
        let arithmetic =
            unlike(numbers.updates, own.updates).or_else(|| unlike(numbers.rows, own.rows));
        Self {
            profile: Some(config.profile),
            format: format.and_then(|format| FormatName::of(&format)),
            arithmetic: arithmetic.and_then(|precision| ArithmeticName::of(&precision)),
            inertia: unlike(config.inertia, default.inertia).and_then(|i| InertiaName::of(&i)),
            hazards: unlike(config.hazards, default.hazards).and_then(|h| HazardsName::of(&h)),
            window: config.window_slots,
            subnormals: unlike(config.subnormals, default.subnormals)
                .and_then(|s| SubnormalsName::of(&s)),
            bandwidth: unlike(config.bandwidth, default.bandwidth),
            length_width: unlike(config.length_width, default.length_width),
            address_width: unlike(config.address_width, default.address_width),
            threads: unlike(config.threads, default.threads),
            lanes: unlike(config.lanes, default.lanes).and_then(|on| LanesName::of(&on)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_option_is_the_default_board() {
        assert_eq!(BuildArgs::default().config(), BoardConfig::default());
        assert_eq!(BuildArgs::default().board_option(), None);
    }

    #[test]
    fn a_format_goes_where_the_streams_have_its_width() {
        let numbers = |profile, format, arithmetic| {
            let profile = Profile::by_name(profile);
            let config = BuildArgs { profile, format, arithmetic, ..BuildArgs::default() }.config();
            (config.numbers.is_some(), config.variant().numbers)
        };
        let (changed, half) = numbers("half", Some(FormatName::Binary16), None);
        assert_eq!((changed, half), (false, Numbers::BINARY16));
        let thesis = StreamFormat::Thesis16;
        let (_, half) = numbers("half", Some(FormatName::Thesis16), Some(ArithmeticName::F32));
        assert_eq!((half.collisions, half.bodies), (thesis, thesis));
        assert_eq!((half.rows, half.updates), (Precision::F32, Precision::F32));
        assert_eq!(half.velocities, Precision::Binary16, "storage stays");
        let (_, mixed) = numbers("mixed", Some(FormatName::Thesis16), None);
        assert_eq!((mixed.collisions, mixed.bodies), (thesis, StreamFormat::F32));
        // The board refuses it, and names the reason.
        let (_, float) = numbers("float", Some(FormatName::Thesis16), None);
        assert_eq!((float.collisions, float.bodies), (thesis, thesis));
    }
}
