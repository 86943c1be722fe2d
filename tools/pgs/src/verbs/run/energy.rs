//! The energy of a step, measured on a real board with sensors.

use std::path::Path;

use serde_json::Value;

use crate::power::{HWMON, PowerMeter, Sensors, at_thesis_power};

/// Samples the idle board, then begins to sample the steps; `None` without sensors.
pub(super) fn start(is_emulated: bool) -> Option<PowerMeter> {
    let sensors = if is_emulated { None } else { Sensors::find(Path::new(HWMON)) };
    match PowerMeter::start(sensors?) {
        Ok(meter) => Some(meter),
        Err(error) => {
            log::warn!("the energy is not measured: {error}");
            None
        }
    }
}

/// The energy of a step for people and for programs: measured, or at the thesis' power for a step that
/// takes `ms` milliseconds.
pub(super) fn end(meter: Option<PowerMeter>, steps: u32, ms: f64) -> (String, Value) {
    match meter.map(|meter| meter.stop(steps)) {
        Some(Ok(Some(energy))) => return (energy.text(), energy.to_json()),
        Some(Ok(None)) => log::warn!("the energy is not measured: the steps ended too early"),
        Some(Err(error)) => log::warn!("the energy is not measured: {error}"),
        None => {}
    }
    at_thesis_power(ms)
}
