//! Writes the build of an emulated board as one text, and parses it.
//!
//! ```text
//! half,thesis16,f32,unchecked
//! mixed,flush,world
//! float,window=64,bandwidth=unlimited
//! ```
//!
//! A list that begins with the profile. A word stands for itself where only one option has it, and
//! behind the option's name elsewhere: `binary16` is the format of a stream, `arithmetic=binary16`
//! the width of the operators.

use std::fmt;
use std::str::FromStr;

use bitstream_model::interface::number::Numbers;
use bitstream_model::interface::profile::{FLOAT, PROFILES, Profile};
use bitstream_model::{Bandwidth, BoardConfig};
use thiserror::Error;

use super::bandwidth::{bandwidth, bandwidth_gigabytes};
use super::build::{
    ArithmeticName, BuildArgs, Choice, FormatName, HazardsName, InertiaName, SubnormalsName,
    address_width, length_width, window,
};

/// One option of a build.
struct BuildOption {
    /// Its name on the command line; a text has it without the dashes.
    option: &'static str,
    /// The values that need no name before them.
    words: &'static [&'static str],
    /// The form of its other values; empty if there are none.
    values: &'static str,
    /// Its value, if it is given.
    get: fn(&BuildArgs) -> Option<String>,
    set: fn(&mut BuildArgs, &str) -> Result<(), String>,
}

/// Reads and writes a choice by its names.
macro_rules! chosen {
    ($field:ident, $name:ty) => {
        BuildOption {
            get: |build| build.$field.map(|choice| choice.text()),
            set: |build, text| choose::<$name>(text).map(|choice| build.$field = Some(choice)),
            ..NONE
        }
    };
}

/// Reads and writes a number.
macro_rules! number {
    ($field:ident, $parse:ident, $print:expr) => {
        BuildOption {
            get: |build| build.$field.map($print),
            set: |build, text| $parse(text).map(|number| build.$field = Some(number)),
            ..NONE
        }
    };
}

const NONE: BuildOption =
    BuildOption { option: "", words: &[], values: "", get: |_| None, set: |_, _| Ok(()) };

/// Every option but the profile, in the order of a text.
const OPTIONS: [BuildOption; 9] = [
    BuildOption {
        option: "--format",
        words: &["binary16", "thesis16"],
        ..chosen!(format, FormatName)
    },
    BuildOption {
        option: "--arithmetic",
        words: &["f32"],
        values: "f32|binary16",
        ..chosen!(arithmetic, ArithmeticName)
    },
    BuildOption {
        option: "--hazards",
        words: &["interlocked", "unchecked"],
        ..chosen!(hazards, HazardsName)
    },
    BuildOption {
        option: "--window",
        values: "SLOTS",
        ..number!(window, window, |slots| slots.to_string())
    },
    BuildOption {
        option: "--subnormals",
        words: &["keep", "flush"],
        ..chosen!(subnormals, SubnormalsName)
    },
    BuildOption {
        option: "--inertia",
        words: &["isotropic", "world"],
        ..chosen!(inertia, InertiaName)
    },
    BuildOption {
        option: "--bandwidth",
        values: "GBPS|unlimited",
        ..number!(bandwidth, bandwidth, bandwidth_word)
    },
    BuildOption {
        option: "--length-width",
        values: "BITS",
        ..number!(length_width, length_width, |bits| bits.to_string())
    },
    BuildOption {
        option: "--address-width",
        values: "BITS",
        ..number!(address_width, address_width, |bits| bits.to_string())
    },
];

impl BuildOption {
    /// Its name in a text.
    fn key(&self) -> &'static str {
        self.option.trim_start_matches('-')
    }
}

fn choose<T: Choice>(text: &str) -> Result<T, String> {
    T::from_str(text, false).map_err(|_| {
        let known: Vec<String> = T::value_variants().iter().map(Choice::text).collect();
        format!("expected {}", known.join(" or "))
    })
}

fn bandwidth_word(bandwidth: Bandwidth) -> String {
    bandwidth_gigabytes(bandwidth).map_or_else(|| "unlimited".to_owned(), |rate| rate.to_string())
}

/// A text that describes no build.
#[derive(Debug, Error, PartialEq, Eq)]
pub(crate) enum BuildError {
    /// It does not begin with a profile.
    #[error("expected a build to begin with a profile ({}), found {found:?}", profiles())]
    Profile { found: String },
    /// A word of no option.
    #[error("{found:?} is no option of a build; known are {}", known())]
    Word { found: String },
    /// An option is given twice.
    #[error("{key} is given twice")]
    Twice { key: &'static str },
    /// A value that the option cannot take.
    #[error("{key}={found}: {problem}")]
    Value { key: &'static str, found: String, problem: String },
}

fn profiles() -> String {
    let names: Vec<&str> = PROFILES.iter().map(|profile| profile.name).collect();
    names.join(", ")
}

/// Lists everything that may follow the profile.
fn known() -> String {
    let mut words: Vec<String> = Vec::new();
    for part in &OPTIONS {
        words.extend(part.words.iter().map(|word| (*word).to_owned()));
        if !part.values.is_empty() {
            words.push(format!("{}={}", part.key(), part.values));
        }
    }
    words.join(", ")
}

impl BuildArgs {
    /// The first given option that describes a board. `--threads` does not: collision detection and
    /// packing use it with every board.
    pub(crate) fn board_option(&self) -> Option<&'static str> {
        let part =
            || OPTIONS.iter().find(|part| (part.get)(self).is_some()).map(|part| part.option);
        // How a board is computed does not describe it, and is in no text.
        let host = || self.lanes.map(|_| "--lanes");
        self.profile.map(|_| "--profile").or_else(part).or_else(host)
    }
}

/// A board as its text. Where no text tells all number formats, as for a bitstream that this
/// command cannot build, the formats follow in words.
pub(crate) fn described(config: &BoardConfig) -> String {
    let (build, variant) = (BuildArgs::of(config), config.variant());
    if build.config().variant() == variant {
        return build.to_string();
    }
    let Numbers { collisions, bodies, poses, rows, updates, velocities, impulses } =
        variant.numbers;
    format!(
        "{build} (streams: collisions {}, velocities {}, poses {}; arithmetic: rows {}, updates {}; on chip: \
         velocities {}, impulses {})",
        collisions.name(),
        bodies.name(),
        poses.name(),
        rows.name(),
        updates.name(),
        velocities.name(),
        impulses.name(),
    )
}

impl fmt::Display for BuildArgs {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.profile.unwrap_or(&FLOAT).name)?;
        for part in &OPTIONS {
            let Some(value) = (part.get)(self) else { continue };
            if part.words.contains(&value.as_str()) {
                write!(f, ",{value}")?;
            } else {
                write!(f, ",{}={value}", part.key())?;
            }
        }
        Ok(())
    }
}

impl FromStr for BuildArgs {
    type Err = BuildError;

    fn from_str(text: &str) -> Result<Self, BuildError> {
        let mut words = text.split(',');
        let name = words.next().unwrap_or_default();
        let profile = Profile::by_name(name);
        if profile.is_none() {
            return Err(BuildError::Profile { found: name.to_owned() });
        }
        let mut build = Self { profile, ..Self::default() };
        for word in words {
            let (part, value) =
                option_of(word).ok_or_else(|| BuildError::Word { found: word.to_owned() })?;
            if (part.get)(&build).is_some() {
                return Err(BuildError::Twice { key: part.key() });
            }
            (part.set)(&mut build, value).map_err(|problem| BuildError::Value {
                key: part.key(),
                found: value.to_owned(),
                problem,
            })?;
        }
        Ok(build)
    }
}

/// The option of a word in a text, and its value.
fn option_of(word: &str) -> Option<(&'static BuildOption, &str)> {
    match word.split_once('=') {
        Some((key, value)) => {
            OPTIONS.iter().find(|part| part.key() == key).map(|part| (part, value))
        }
        None => OPTIONS.iter().find(|part| part.words.contains(&word)).map(|part| (part, word)),
    }
}

#[cfg(test)]
mod tests {
    use bitstream_model::EmulatedBoard;
    use bitstream_model::interface::number::{Precision, StreamFormat};
    use clap::ValueEnum;
    use proptest::prelude::*;

    use super::super::build::LanesName;
    use super::*;

    fn build(text: &str) -> Result<BuildArgs, BuildError> {
        text.parse()
    }

    #[test]
    fn a_build_is_written_as_it_is_read() {
        for text in [
            "naive",
            "float",
            "half",
            "mixed",
            "float,interlocked",
            "half,thesis16,f32,unchecked",
            "half,f32,unchecked,world",
            "half,binary16,arithmetic=binary16,interlocked,window=64,flush,isotropic",
            "float,bandwidth=unlimited,length-width=14,address-width=32",
            "mixed,bandwidth=17.07",
        ] {
            let build = build(text).expect(text);
            assert_eq!(build.to_string(), text);
            EmulatedBoard::new(build.config()).expect(text);
        }
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
            "half (streams: collisions binary16, velocities binary16, poses binary16; arithmetic: rows binary16, updates \
             binary16; on chip: velocities f32, impulses binary16)"
        );
        assert_eq!(
            of("half", |numbers| numbers.updates = Precision::F32),
            "half,f32 (streams: collisions binary16, velocities binary16, poses binary16; arithmetic: rows binary16, \
             updates f32; on chip: velocities binary16, impulses binary16)"
        );
        assert_eq!(
            of("half", |numbers| numbers.bodies = StreamFormat::Thesis16).find('('),
            Some(14)
        );
        for text in ["float", "mixed,flush,world", "half,thesis16,f32", "half,f32,world"] {
            assert_eq!(described(&build(text).expect(text).config()), text);
        }
    }

    #[test]
    fn words_may_stand_in_any_order() {
        let expected = build("half,thesis16,f32,unchecked,flush");
        assert_eq!(build("half,flush,unchecked,arithmetic=f32,format=thesis16"), expected);
    }

    #[test]
    fn a_word_means_what_the_option_means() {
        let config = build("half,binary16,f32,unchecked,window=9,flush,world").expect("a build");
        let options = BuildArgs {
            profile: Profile::by_name("half"),
            format: Some(FormatName::Binary16),
            arithmetic: Some(ArithmeticName::F32),
            inertia: Some(InertiaName::World),
            hazards: Some(HazardsName::Unchecked),
            window: Some(9),
            subnormals: Some(SubnormalsName::Flush),
            ..BuildArgs::default()
        };
        assert_eq!(config, options);
    }

    #[test]
    fn what_is_no_build_is_refused_with_what_is_known() {
        for text in ["", ",float", "Float", "unchecked", "float half"] {
            let error = build(text).expect_err(text);
            assert!(matches!(error, BuildError::Profile { .. }), "{error}");
            assert!(
                error.to_string().contains("(naive, float, half, mixed, windowed, windowed16)"),
                "{error}"
            );
        }
        for text in ["float,", "float,double", "float,window", "float,colour=red", "float, world"] {
            let error = build(text).expect_err(text);
            assert!(matches!(error, BuildError::Word { .. }), "{error}");
            for word in
                ["thesis16", "arithmetic=f32|binary16", "unchecked", "window=SLOTS", "world"]
            {
                assert!(error.to_string().contains(word), "{error}");
            }
        }
        let error = build("float,keep,flush").expect_err("twice");
        assert_eq!(error.to_string(), "subnormals is given twice");
        for text in ["float,window=0", "float,window=", "half,arithmetic=f64", "half,format=f32"] {
            let error = build(text).expect_err(text);
            assert!(matches!(error, BuildError::Value { .. }), "{error}");
            assert!(error.to_string().contains(": expected "), "{error}");
        }
    }

    #[test]
    fn every_option_is_named_when_it_is_given() {
        for (text, option) in [
            ("float,thesis16", "--format"),
            ("float,f32", "--arithmetic"),
            ("float,unchecked", "--hazards"),
            ("float,address-width=32", "--address-width"),
        ] {
            let given = BuildArgs { profile: None, ..build(text).expect(text) };
            assert_eq!(given.board_option(), Some(option));
        }
        assert_eq!(build("float").expect("a build").board_option(), Some("--profile"));
        let lanes = Some(LanesName::Off);
        assert_eq!(BuildArgs { lanes, ..BuildArgs::default() }.board_option(), Some("--lanes"));
        // Detection and packing use them on a real board, too.
        assert_eq!(BuildArgs { threads: Some(1), ..BuildArgs::default() }.board_option(), None);
    }

    fn any_of<T: ValueEnum + fmt::Debug + 'static>() -> impl Strategy<Value = Option<T>> {
        prop::option::of(prop::sample::select(T::value_variants().to_vec()))
    }

    fn any_build() -> impl Strategy<Value = BuildArgs> {
        let rate = prop_oneof![
            Just(Bandwidth::Unlimited),
            (100_000_000_u64..=1_000_000_000_000).prop_map(Bandwidth::BytesPerSecond),
        ];
        (
            prop::sample::select(PROFILES.to_vec()),
            (any_of::<FormatName>(), any_of::<ArithmeticName>(), any_of::<InertiaName>()),
            (any_of::<HazardsName>(), any_of::<SubnormalsName>()),
            (prop::option::of(1..=u32::MAX), prop::option::of(rate)),
            (prop::option::of(8_u32..=26), prop::option::of(32_u32..=64)),
        )
            .prop_map(
                |(profile, (format, arithmetic, inertia), choices, numbers, widths)| BuildArgs {
                    profile: Some(profile),
                    format,
                    arithmetic,
                    inertia,
                    hazards: choices.0,
                    subnormals: choices.1,
                    window: numbers.0,
                    bandwidth: numbers.1,
                    length_width: widths.0,
                    address_width: widths.1,
                    ..BuildArgs::default()
                },
            )
    }

    proptest! {
        #[test]
        fn every_build_survives_its_text(built in any_build()) {
            prop_assert_eq!(build(&built.to_string()), Ok(built));
        }

        #[test]
        fn a_board_is_what_its_text_says(built in any_build()) {
            let config = built.config();
            let again = BuildArgs::of(&config);
            prop_assert_eq!(again.config(), config);
            // A text holds no option that equals its default.
            prop_assert!(again.to_string().len() <= built.to_string().len());
        }

        #[test]
        fn no_text_makes_the_parser_panic(text in "(half|float|),?[a-z0-9=,.]{0,30}") {
            let _ = build(&text);
        }
    }
}
