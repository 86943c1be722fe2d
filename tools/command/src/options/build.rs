//! The emulated board of a verb that builds it itself, and the values and the text of a build.

use bitstream_model::BoardConfig;
use bitstream_model::interface::number::Numbers;
use clap::Args;
use zynq_pgs::BoardChoice;
use zynq_pgs::emulation::{Build, BuildError};

/// Threads of this machine.
#[derive(Debug, Clone, Copy, Default, Args)]
pub struct ThreadsArgs {
    /// Threads of this machine
    ///
    /// For the emulated board's arithmetic, for collision detection, and for packing and unpacking
    /// a step; no result depends on their number [default: one per processor, at most 4]
    #[arg(long, value_name = "N", value_parser = number("threads", |build| build.threads))]
    pub threads: Option<usize>,
}

/// The board of a verb that builds emulated ones itself.
#[derive(Debug, Clone, Copy, Default, Args)]
#[command(next_help_heading = "Emulated board")]
pub struct BuiltArgs {
    /// Emulated board, `emulated[:BUILD]`, as for `pgs run`
    #[arg(long, value_name = "BOARD", value_parser = built)]
    pub board: Option<Build>,
}

/// Reads the text of an emulated board.
fn built(text: &str) -> Result<Build, String> {
    match text.parse() {
        Ok(BoardChoice::Built(build)) => Ok(build),
        Ok(_) => Err("this command builds its board itself: give emulated[:BUILD]".to_owned()),
        Err(error) => Err(error.to_string()),
    }
}

/// Parses a number of a build.
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
    use bitstream_model::interface::number::Precision;
    use bitstream_model::interface::profile::Profile;

    use super::*;

    #[test]
    fn a_number_out_of_range_is_refused_with_the_range() {
        let threads = number("threads", |build| build.threads);
        assert_eq!(threads("3"), Ok(3));
        assert_eq!(threads("0"), Err("expected a whole number from 1 to 31".to_owned()));
    }

    #[test]
    fn a_verb_that_builds_its_board_takes_an_emulated_one_alone() {
        assert_eq!(built("emulated"), Ok(Build::default()));
        assert_eq!(built("emulated:half,f32"), Ok("half,f32".parse().expect("a build")));
        for (text, part) in [("uio", "emulated[:BUILD]"), ("emulated:fast", "naive, float, half")] {
            let refused = built(text).expect_err(text);
            assert!(refused.contains(part), "{refused}");
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
