//! The options of a build, and the configuration that they make.

use bitstream_model::{Bandwidth, BoardConfig, Hazards};
use pgs_interface::fence::Fence;
use pgs_interface::number::{Numbers, Precision};
use pgs_interface::profile::{FLOAT, Inertia, Profile};

/// The build of an emulated board, option by option; `None` is the default of the board or of its
/// profile.
///
/// [`parse`](str::parse) reads a text, and [`Display`](std::fmt::Display) writes it: the [module's
/// page](crate::emulation) has its options.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Build {
    /// Design of the accelerator.
    pub profile: Option<&'static Profile>,
    /// Precision of the pipeline's operators; storage keeps the width of the profile.
    pub arithmetic: Option<Precision>,
    /// Form in which the board gets the inertia of its bodies.
    pub inertia: Option<Inertia>,
    /// Behaviour on read-after-write hazards.
    pub hazards: Option<Hazards>,
    /// Depth of the issue queue, collisions; 0: none.
    pub queue: Option<u32>,
    /// Hazard window, issue slots.
    pub window: Option<u32>,
    /// Memory bandwidth.
    pub bandwidth: Option<Bandwidth>,
    /// Width of the DMA length registers, bits.
    pub length_width: Option<u32>,
    /// Width of DMA addresses, bits.
    pub address_width: Option<u32>,
    /// The one address segment that the DMA masters reach.
    pub fence: Option<Fence>,
    /// Threads of this machine for the board's arithmetic; no result depends on their number.
    /// [`OpenOptions::pack_threads`](crate::OpenOptions::pack_threads) has the driver's own.
    pub threads: Option<usize>,
    /// Whether the board takes a step at once where its host waits for the whole of it; no result
    /// depends on it.
    pub fast: Option<bool>,
}

impl Build {
    /// The configuration of the described board.
    /// [`EmulatedBoard::new`](bitstream_model::EmulatedBoard::new) refuses options that contradict
    /// each other.
    #[must_use]
    pub fn config(&self) -> BoardConfig {
        let default = BoardConfig::default();
        let profile = self.profile.unwrap_or(&FLOAT);
        let numbers = self.numbers(&profile.numbers);
        BoardConfig {
            profile,
            numbers: (numbers != profile.numbers).then_some(numbers),
            inertia: self.inertia.unwrap_or(default.inertia),
            hazards: self.hazards.unwrap_or(default.hazards),
            queue: self.queue,
            window_slots: self.window,
            bandwidth: self.bandwidth.unwrap_or(default.bandwidth),
            length_width: self.length_width.unwrap_or(default.length_width),
            address_width: self.address_width.unwrap_or(default.address_width),
            fence: self.fence,
            threads: self.threads.unwrap_or(default.threads),
            fast: self.fast.unwrap_or(default.fast),
            ..default
        }
    }

    /// The profile's number formats, with the arithmetic of the options in its place.
    fn numbers(&self, own: &Numbers) -> Numbers {
        let mut numbers = *own;
        if let Some(arithmetic) = self.arithmetic {
            (numbers.rows, numbers.updates) = (arithmetic, arithmetic);
        }
        numbers
    }

    /// The options that turn the default board of a profile into this one. They hold no mistake in
    /// the build ([`BoardConfig::quirks`]), no delay, and of the number formats only what the
    /// options can say.
    #[must_use]
    pub fn of(config: &BoardConfig) -> Self {
        fn unlike<T: PartialEq + Copy>(value: T, default: T) -> Option<T> {
            (value != default).then_some(value)
        }
        let default = BoardConfig::default();
        let (own, numbers) = (config.profile.numbers, config.variant().numbers);
        let arithmetic =
            unlike(numbers.updates, own.updates).or_else(|| unlike(numbers.rows, own.rows));
        Self {
            profile: Some(config.profile),
            arithmetic,
            inertia: unlike(config.inertia, default.inertia),
            hazards: unlike(config.hazards, default.hazards),
            queue: config.queue,
            window: config.window_slots,
            bandwidth: unlike(config.bandwidth, default.bandwidth),
            length_width: unlike(config.length_width, default.length_width),
            address_width: unlike(config.address_width, default.address_width),
            fence: config.fence,
            threads: unlike(config.threads, default.threads),
            fast: unlike(config.fast, default.fast),
        }
    }
}

#[cfg(test)]
mod tests {
    use pgs_interface::profile::HALF;

    use super::*;

    #[test]
    fn no_option_is_the_default_board() {
        assert_eq!(Build::default().config(), BoardConfig::default());
    }

    #[test]
    fn the_arithmetic_changes_the_operators_alone() {
        let build = Build { profile: Some(&HALF), ..Build::default() };
        assert_eq!(build.config().numbers, None);
        let build = Build { arithmetic: Some(Precision::F32), ..build };
        let half = build.config().variant().numbers;
        let (rows, updates) = (Precision::F32, Precision::F32);
        assert_eq!(half, Numbers { rows, updates, ..Numbers::BINARY16 });
    }
}
