//! The energy of a step, measured on a real board with sensors.

use std::num::NonZeroU32;
use std::path::Path;

use serde_json::Value;

use crate::power::{HWMON, PowerMeter, Sensors, at_thesis_power};

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

/// The energy of a step for people and for programs: measured, or at the thesis' power for a step
/// that takes `ms` milliseconds. None without a step.
pub(super) fn end(meter: Option<PowerMeter>, steps: u32, ms: f64) -> Option<(String, Value)> {
    let steps = NonZeroU32::new(steps)?;
    match meter.map(|meter| meter.stop(steps)) {
        Some(Ok(Some(energy))) => return Some((energy.text(), energy.to_json())),
        Some(Ok(None)) => log::warn!("the energy is not measured: the steps ended too early"),
        Some(Err(error)) => log::warn!("the energy is not measured: {error}"),
        None => {}
    }
    Some(at_thesis_power(ms))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_step_has_no_energy() {
        assert!(end(None, 0, 0.0).is_none());
        assert!(end(None, 1, 2.0).is_some());
    }
}
