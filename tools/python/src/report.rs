//! The report of a step as Python has it.

use pyo3::prelude::*;

/// Counts and times of one step.
#[pyclass(frozen, get_all, module = "zynq_pgs")]
#[derive(Debug)]
pub(crate) struct Report {
    bodies: u64,
    collisions: u64,
    cycles: u64,
    stalls: u64,
    waits: u64,
    hazards: u64,
    seconds: f64,
    impulse_sum: Option<f64>,
    retries: u64,
}

impl From<zynq_pgs_c::Report> for Report {
    fn from(of: zynq_pgs_c::Report) -> Self {
        let zynq_pgs_c::Report { bodies, collisions, cycles, stalls, waits, hazards, .. } = of;
        let zynq_pgs_c::Report { seconds, impulse_sum, retries, .. } = of;
        let impulse_sum = Some(impulse_sum).filter(|sum| !sum.is_nan());
        Self { bodies, collisions, cycles, stalls, waits, hazards, seconds, impulse_sum, retries }
    }
}

#[pymethods]
impl Report {
    fn __repr__(&self) -> String {
        format!("{self:?}")
    }
}
