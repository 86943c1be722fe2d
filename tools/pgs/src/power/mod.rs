//! The energy of a step on a board whose supply rails have sensors: sampled by a thread while the
//! steps run, with the power of the idle board subtracted.

mod energy;
mod meter;
mod sensors;

pub(crate) use meter::PowerMeter;
pub(crate) use sensors::{HWMON, Sensors};
