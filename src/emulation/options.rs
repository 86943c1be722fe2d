//! The table of a build's options: how each is named, read and written.

use pgs_interface::profile::{PROFILES, Profile};

use super::build::Build;
use super::values::{
    HAZARDS, INERTIA, PRECISIONS, SWITCH, address_width, bandwidth, bandwidth_text, fence,
    length_width, name_of, named, queue, threads, window,
};

/// One option of a build.
pub(super) struct BuildOption {
    /// Its name in a text.
    pub(super) key: &'static str,
    /// The names of its values; none for numbers.
    pub(super) names: fn() -> Vec<&'static str>,
    /// Whether a name may stand without the key.
    pub(super) bare: bool,
    /// The form of a number.
    pub(super) form: &'static str,
    /// Its value, if it is given.
    pub(super) get: fn(&Build) -> Option<String>,
    /// Reads its value; the error has the expected values, in words.
    pub(super) set: fn(&mut Build, &str) -> Result<(), String>,
}

/// An option whose values have names.
macro_rules! choice {
    ($key:literal, $field:ident, $table:ident, $bare:literal) => {
        BuildOption {
            key: $key,
            names: || $table.iter().map(|(name, _)| *name).collect(),
            bare: $bare,
            form: "",
            get: |build| build.$field.and_then(|value| name_of(&$table, &value)).map(str::to_owned),
            set: |build, text| named(&$table, text).map(|value| build.$field = Some(value)),
        }
    };
}

/// An option whose values are numbers.
macro_rules! number {
    ($key:literal, $field:ident, $form:literal, $read:ident, $write:expr) => {
        BuildOption {
            key: $key,
            names: Vec::new,
            bare: false,
            form: $form,
            get: |build| build.$field.map($write),
            set: |build, text| $read(text).map(|number| build.$field = Some(number)),
        }
    };
}

/// The profile, with which a text begins.
const PROFILE: BuildOption = BuildOption {
    key: "profile",
    names: || PROFILES.iter().map(|profile| profile.name).collect(),
    bare: true,
    form: "",
    get: |build| build.profile.map(|profile| profile.name.to_owned()),
    set: |build, text| {
        let names = || (PROFILE.names)().join(", ");
        Profile::by_name(text).map(|profile| build.profile = Some(profile)).ok_or_else(names)
    },
};

/// Every option, in the order of a text.
pub(super) const OPTIONS: [BuildOption; 12] = [
    PROFILE,
    choice!("arithmetic", arithmetic, PRECISIONS, true),
    choice!("hazards", hazards, HAZARDS, true),
    number!("queue", queue, "DEPTH", queue, |depth| depth.to_string()),
    number!("window", window, "SLOTS", window, |slots| slots.to_string()),
    choice!("inertia", inertia, INERTIA, true),
    number!("bandwidth", bandwidth, "GBPS|unlimited", bandwidth, bandwidth_text),
    number!("length-width", length_width, "BITS", length_width, |bits| bits.to_string()),
    number!("address-width", address_width, "BITS", address_width, |bits| bits.to_string()),
    number!("fence", fence, "BASE+BYTES", fence, |fence| fence.to_string()),
    number!("threads", threads, "N", threads, |threads| threads.to_string()),
    choice!("fast", fast, SWITCH, false),
];

/// The option of this key.
pub(super) fn of_key(key: &str) -> Option<&'static BuildOption> {
    OPTIONS.iter().find(|option| option.key == key)
}

/// The option of a name that stands without its key: the first that has the name.
pub(super) fn of_name(name: &str) -> Option<&'static BuildOption> {
    OPTIONS.iter().find(|option| option.bare && (option.names)().contains(&name))
}

impl Build {
    /// The words that may follow the profile in a text, for people.
    #[must_use]
    pub fn words() -> String {
        let mut known: Vec<String> = Vec::new();
        for option in &OPTIONS[1..] {
            let names = (option.names)();
            let stands = |name: &&str| of_name(name).is_some_and(|first| first.key == option.key);
            known.extend(names.iter().copied().filter(stands).map(str::to_owned));
            if !names.iter().all(stands) {
                known.push(format!("{}={}", option.key, names.join("|")));
            }
            if !option.form.is_empty() {
                known.push(format!("{}={}", option.key, option.form));
            }
        }
        known.join(", ")
    }

    /// The keys of all options, in the order of a text.
    pub fn keys() -> impl Iterator<Item = &'static str> {
        OPTIONS.iter().map(|option| option.key)
    }

    /// The names of an option's values; none where the values are numbers, or the key is unknown.
    #[must_use]
    pub fn names(key: &str) -> Vec<&'static str> {
        of_key(key).map(|option| (option.names)()).unwrap_or_default()
    }

    /// The value of an option as a text has it; `None` if it is not given, or the key is unknown.
    #[must_use]
    pub fn value(&self, key: &str) -> Option<String> {
        of_key(key).and_then(|option| (option.get)(self))
    }
}
