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

#[cfg(test)]
mod tests;

use std::fmt;
use std::str::FromStr;

use bitstream_model::interface::number::Numbers;
use bitstream_model::interface::profile::{FLOAT, PROFILES, Profile};
use bitstream_model::{Bandwidth, BoardConfig};
use thiserror::Error;

use crate::options::bandwidth::{bandwidth, bandwidth_gigabytes};
use crate::options::build::{
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
