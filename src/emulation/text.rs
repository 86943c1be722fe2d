//! Writes the build of an emulated board as one text, and parses it.

use std::fmt;
use std::str::FromStr;

use pgs_interface::profile::{FLOAT, Profile};
use thiserror::Error;

use super::build::Build;
use super::options::{OPTIONS, of_key, of_name};

/// A text that describes no build.
#[derive(Debug, Clone, Error, PartialEq, Eq)]
#[non_exhaustive]
pub enum BuildError {
    /// It does not begin with a profile.
    #[error(
        "expected a build to begin with a profile ({}), found {found:?}: put the profile first",
        Build::names("profile").join(", ")
    )]
    Profile {
        /// The first word.
        found: String,
    },
    /// A word of no option.
    #[error("{found:?} is no option of a build: give one of {}", Build::words())]
    Word {
        /// The word, or the key.
        found: String,
    },
    /// An option is given twice.
    #[error("{key} is given twice: give it once")]
    Twice {
        /// The key of the option.
        key: &'static str,
    },
    /// A value that the option cannot take.
    #[error("{key}={found}: expected {expected}")]
    Value {
        /// The key of the option.
        key: &'static str,
        /// The value.
        found: String,
        /// The values that it can take, in words.
        expected: String,
    },
}

impl Build {
    /// Sets the option of this key from its value as a text has it, in place of an earlier value.
    ///
    /// # Errors
    /// [`BuildError::Word`]: there is no such option; [`BuildError::Value`]: it cannot take the
    /// value.
    pub fn set(&mut self, key: &str, value: &str) -> Result<(), BuildError> {
        let option = of_key(key).ok_or_else(|| BuildError::Word { found: key.to_owned() })?;
        (option.set)(self, value).map_err(|expected| BuildError::Value {
            key: option.key,
            found: value.to_owned(),
            expected,
        })
    }
}

impl FromStr for Build {
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
            let (option, value) = match word.split_once('=') {
                Some((key, value)) => (of_key(key), value),
                None => (of_name(word), word),
            };
            let option = option.ok_or_else(|| BuildError::Word { found: word.to_owned() })?;
            if (option.get)(&build).is_some() {
                return Err(BuildError::Twice { key: option.key });
            }
            build.set(option.key, value)?;
        }
        Ok(build)
    }
}

impl fmt::Display for Build {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.profile.unwrap_or(&FLOAT).name)?;
        for option in &OPTIONS[1..] {
            let Some(value) = (option.get)(self) else { continue };
            match of_name(&value) {
                Some(first) if first.key == option.key => write!(f, ",{value}")?,
                _ => write!(f, ",{}={value}", option.key)?,
            }
        }
        Ok(())
    }
}
