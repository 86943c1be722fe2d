//! The energy of a step, measured on a real board with sensors.

use std::num::NonZeroU32;
use std::path::Path;

use serde_json::Value;

use crate::power::{HWMON, PowerMeter, Sensors};

/// The sensors of a real board, if it has any.
pub(super) fn sensors(is_emulated: bool) -> Option<Sensors> {
    if is_emulated { None } else { Sensors::find(Path::new(HWMON)) }
}

/// Samples the idle board, then begins to sample the steps. Sensors beside a second scene measure
/// nothing: they would see the steps of both.
pub(super) fn start(sensors: Option<Sensors>, is_alone: bool) -> Option<PowerMeter> {
    let sensors = sensors?;
    if !is_alone {
        log::warn!(
            "the energy is not measured: the sensors also see the steps of the cold scene; leave \
             out --beside-cold"
        );
        return None;
    }
    match PowerMeter::start(sensors) {
        Ok(meter) => Some(meter),
        Err(error) => {
            log::warn!("the energy is not measured: {error}");
            None
        }
    }
}

/// The measured energy of a step, for people and for programs. None without sensors, and without a
/// step.
pub(super) fn end(meter: Option<PowerMeter>, steps: u32) -> Option<(String, Value)> {
    match meter?.stop(NonZeroU32::new(steps)?) {
        Ok(Some(energy)) => return Some((energy.text(), energy.to_json())),
        Ok(None) => log::warn!("the energy is not measured: the steps ended too early"),
        Err(error) => log::warn!("the energy is not measured: {error}"),
    }
    None
}
