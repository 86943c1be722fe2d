//! The driver `zynq-pgs` as a module of Python: arrays of numpy in, the same arrays out.
//!
//! It calls the C interface, so that both languages check and refuse the same. The package around
//! it is `python/zynq_pgs`, whose stubs document each call.

mod accelerator;
mod arrays;
mod driver;
mod failure;
mod parameters;
mod report;

use numpy::{AllowTypeChange, PyArray1, PyArrayLike1, PyReadonlyArray1};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use zynq_pgs_c::zpgs_count_with_friction;

/// The module `zynq_pgs._driver`.
#[pymodule]
fn _driver(module: &Bound<'_, PyModule>) -> PyResult<()> {
    let py = module.py();
    module.add("BODY", arrays::body(py)?)?;
    module.add("COLLISION", arrays::collision(py)?)?;
    module.add("Error", py.get_type::<failure::Error>())?;
    module.add_class::<accelerator::Accelerator>()?;
    module.add_class::<report::Report>()?;
    module.add_function(wrap_pyfunction!(with_friction, module)?)
}

/// The counts of collisions that have a friction of their own.
#[pyfunction]
fn with_friction<'py>(
    py: Python<'py>,
    count: &Bound<'py, PyAny>,
    friction: PyArrayLike1<'py, f32, AllowTypeChange>,
) -> PyResult<Bound<'py, PyArray1<u32>>> {
    // Numbers of another type one by one, each in its range: a conversion by numpy would wrap.
    let count = match count.extract::<PyReadonlyArray1<'py, u32>>() {
        Ok(array) => array.as_array().to_vec(),
        Err(_) => count.extract::<Vec<u32>>()?,
    };
    let friction = friction.as_array();
    if count.len() != friction.len() {
        return Err(PyValueError::new_err(format!(
            "found {} counts and {} frictions: give as many of one as of the other",
            count.len(),
            friction.len()
        )));
    }
    let both = count.iter().zip(friction.iter());
    let all = both.map(|(count, friction)| zpgs_count_with_friction(*count, *friction));
    Ok(PyArray1::from_iter(py, all))
}
