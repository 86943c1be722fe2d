//! The parameters of a step, from keyword arguments.

use pyo3::exceptions::{PyTypeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use zynq_pgs_c::{Order, Parameters};

/// Reads the keyword arguments; a parameter that is not given has its default.
pub(crate) fn parameters(given: Option<&Bound<'_, PyDict>>) -> PyResult<Parameters> {
    let mut all = Parameters::default();
    for (name, value) in given.into_iter().flatten() {
        let name: String = name.extract()?;
        set(&mut all, &name, &value).map_err(|error| {
            let py = value.py();
            PyErr::from_type(error.get_type(py), format!("{name}: {}", error.value(py)))
        })?;
    }
    Ok(all)
}

/// Sets the parameter of that name.
fn set(all: &mut Parameters, name: &str, value: &Bound<'_, PyAny>) -> PyResult<()> {
    let flag = || value.extract::<bool>().map(u32::from);
    match name {
        "time_step" => all.time_step = value.extract()?,
        "position_drift" => all.position_drift = value.extract()?,
        "position_coefficient" => all.position_coefficient = value.extract()?,
        "friction" => all.friction = value.extract()?,
        "angular_damping" => all.angular_damping = value.extract()?,
        "spin_damping" => all.spin_damping = value.extract()?,
        "gravity" => all.gravity = value.extract()?,
        "contact_iterations" => all.contact_iterations = value.extract()?,
        "friction_iterations" => all.friction_iterations = value.extract()?,
        "pair_friction" => all.pair_friction = flag()?,
        "integrate" => all.integrate = flag()?,
        "kinematic" => all.kinematic = flag()?,
        "verify_order" => all.verify_order = flag()?,
        "impulses_out" => all.impulses_out = flag()?,
        "order" => all.order = order(&value.extract::<String>()?)? as u32,
        "deadline" => all.deadline_ms = milliseconds(value.extract()?)?,
        "retries" => all.retries = value.extract()?,
        _ => return Err(PyTypeError::new_err("a step has no such parameter")),
    }
    Ok(())
}

/// The order of that name.
fn order(name: &str) -> PyResult<Order> {
    match name {
        "automatic" => Ok(Order::Automatic),
        "as-given" => Ok(Order::AsGiven),
        "hazard-free" => Ok(Order::HazardFree),
        "interleaved" => Ok(Order::Interleaved),
        _ => Err(PyValueError::new_err(format!(
            "found {name:?} as the order: give automatic, as-given, hazard-free or interleaved"
        ))),
    }
}

/// A time limit in whole milliseconds, at least one.
fn milliseconds(seconds: f64) -> PyResult<u32> {
    let whole = (seconds * 1000.0).ceil();
    if (1.0..=f64::from(u32::MAX)).contains(&whole) {
        return Ok(whole as u32);
    }
    let text = format!("found {seconds} s as the deadline: give a time above 0, up to 49 days");
    Err(PyValueError::new_err(text))
}
