//! The arrays of numpy that a call reads and writes where they lie.
//!
//! The C interface checks strides, alignment and overlap. This module checks dtype, shape and
//! direction, and whether an array may be written, which no type of C tells.

use std::ptr;

use numpy::{PyArrayDescr, PyArrayDescrMethods, PyUntypedArray, PyUntypedArrayMethods, dtype};
use pyo3::exceptions::{PyTypeError, PyValueError};
use pyo3::prelude::*;
use pyo3::sync::PyOnceLock;
use zynq_pgs_c::{
    BodyArrays, CollisionArray, Parameters, Strided, StridedConst, ZPGS_CONTACT_POINTS,
};

use crate::driver::{Call, IMPULSES, data};

/// The dtype of a body: the driver's own, word by word.
pub(crate) fn body(py: Python<'_>) -> PyResult<Bound<'_, PyArrayDescr>> {
    let position = ("position", "<f4", 3);
    let orientation = ("orientation", "<f4", 4);
    let [linear, angular] = ["linear_velocity", "angular_velocity"].map(|name| (name, "<f4", 3));
    let list = (position, orientation, linear, angular, ("shape", "<u4")).into_pyobject(py)?;
    PyArrayDescr::new(py, list.to_list())
}

/// The dtype of a collision, as `zpgs_collision` has it.
pub(crate) fn collision(py: Python<'_>) -> PyResult<&Bound<'_, PyArrayDescr>> {
    static ONCE: PyOnceLock<Py<PyArrayDescr>> = PyOnceLock::new();
    let make = || {
        let contact = (("point", "<f4", 3), ("distance", "<f4")).into_pyobject(py)?.to_list();
        let contacts = ("contacts", contact, ZPGS_CONTACT_POINTS);
        let (body_a, body_b) = (("body_a", "<u4"), ("body_b", "<u4"));
        let list = (body_a, body_b, ("normal", "<f4", 3), ("count", "<u4"), contacts);
        PyArrayDescr::new(py, list.into_pyobject(py)?.to_list()).map(Bound::unbind)
    };
    Ok(ONCE.get_or_try_init(py, make)?.bind(py))
}

/// The arrays of a call, which keep the memory of its structures alive.
pub(crate) struct Arrays<'py> {
    kept: Vec<Bound<'py, PyUntypedArray>>,
    pub(crate) call: Call,
}

impl<'py> Arrays<'py> {
    /// The bodies of a step: a structured array, or a dict of arrays. Their numbers are all f32 or,
    /// as the positions tell, all f64.
    pub(crate) fn of_bodies(given: &Bound<'py, PyAny>) -> PyResult<Self> {
        let (index, double) = (&dtype::<u32>(given.py()), dtype::<f64>(given.py()));
        let position = given.get_item("position").ok();
        let found = position.as_ref().and_then(|of| of.cast::<PyUntypedArray>().ok());
        let is_double = found.is_some_and(|array| array.dtype().is_equiv_to(&double));
        let float = &if is_double { double } else { dtype::<f32>(given.py()) };
        let (mut kept, mut counts) = (Vec::new(), Vec::new());
        let mut of = |field: &str, element, width| {
            let name = format!("bodies[{field:?}]");
            let array = given.get_item(field).map_err(|error| {
                let text = format!("{name} ({error}): give a structured array or a dict of arrays");
                PyTypeError::new_err(text)
            })?;
            let (count, strided) = keep(&mut kept, &array, &name, element, width)?;
            if width.is_some() && !array.getattr("flags")?.getattr("writeable")?.is_truthy()? {
                return Err(PyValueError::new_err(format!("{name}: the array is read-only")));
            }
            counts.push(count);
            Ok(strided)
        };
        let bodies = BodyArrays {
            positions: of("position", float, Some(3))?,
            orientations: of("orientation", float, Some(4))?,
            linear_velocities: of("linear_velocity", float, Some(3))?,
            angular_velocities: of("angular_velocity", float, Some(3))?,
            shapes: read_only(of("shape", index, None)?),
            count: counts[0],
            number_size: float.itemsize(),
            ..BodyArrays::default()
        };
        if counts.iter().any(|count| *count != bodies.count) {
            let text = format!("bodies: found arrays of {counts:?} rows, expected one number");
            return Err(PyValueError::new_err(text));
        }
        let call = Call { bodies, collisions: None, parameters: Parameters::default() };
        Ok(Self { kept, call })
    }

    /// Everything that a step takes. With impulses it is a warm start.
    pub(crate) fn of_step(
        bodies: &Bound<'py, PyAny>,
        collisions: &Bound<'py, PyAny>,
        impulses: Option<&Bound<'py, PyAny>>,
        parameters: Parameters,
    ) -> PyResult<Self> {
        let (py, Self { mut kept, call }) = (bodies.py(), Self::of_bodies(bodies)?);
        let found = collision(py)?;
        let (count, given) = keep(&mut kept, collisions, "collisions", found, None)?;
        let mut all = CollisionArray {
            size: size_of::<CollisionArray>(),
            count,
            collisions: read_only(given),
            impulses: StridedConst { data: ptr::null(), stride: 0 },
            places: ptr::null(),
            factor: 0.0,
            world: 0,
        };
        if let Some(impulses) = impulses {
            let float = &dtype::<f32>(py);
            let (found, given) = keep(&mut kept, impulses, "impulses", float, Some(IMPULSES))?;
            if found != count {
                let text = format!("impulses: found {found} rows for {count} collisions");
                return Err(PyValueError::new_err(text));
            }
            all.impulses = read_only(given);
        }
        let parameters = Parameters { warm_start: impulses.is_some().into(), ..parameters };
        Ok(Self { kept, call: Call { collisions: Some(all), parameters, ..call } })
    }
}

/// Checks and keeps an array: `width` numbers a row, or one element where there is no width. Its
/// number of rows, and where they lie.
fn keep<'py>(
    kept: &mut Vec<Bound<'py, PyUntypedArray>>,
    given: &Bound<'py, PyAny>,
    name: &str,
    element: &Bound<'py, PyArrayDescr>,
    width: Option<usize>,
) -> PyResult<(usize, Strided)> {
    let mistyped = |text| Err(PyTypeError::new_err(format!("{name}: found {text}")));
    let refused = |text| Err(PyValueError::new_err(format!("{name}: {text}")));
    let Ok(array) = given.cast::<PyUntypedArray>() else {
        return mistyped(format!("{}, expected an array of numpy", given.get_type()));
    };
    let found = array.dtype();
    if !found.is_equiv_to(element) {
        return mistyped(format!("the dtype {found}, expected {element}"));
    }
    let (shape, strides) = (array.shape(), array.strides());
    if shape.get(1).copied() != width || shape.is_empty() || shape.len() > 2 {
        let expected = width.map_or("(n,)".to_owned(), |width| format!("(n, {width})"));
        return refused(format!("found the shape {shape:?}, expected {expected}"));
    }
    let (count, step) = (shape[0], element.itemsize());
    if count > 0 && width.is_some() && strides[1] != step.cast_signed() {
        return refused("the numbers of a row lie apart: give a copy in C order".to_owned());
    }
    if count > 1 && strides[0] < 0 {
        return refused("the rows run backwards: give a copy in C order".to_owned());
    }
    // With one row the distance to the next is any number.
    let dense = step * width.unwrap_or(1);
    let stride = if count > 1 { strides[0].unsigned_abs() } else { dense };
    kept.push(array.clone());
    Ok((count, Strided { data: data(array), stride }))
}

/// The same array, only to be read.
fn read_only(Strided { data, stride }: Strided) -> StridedConst {
    StridedConst { data, stride }
}
