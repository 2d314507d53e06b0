//! Few points for charts, for Python.

use numpy::{
    PyArray1, PyArray2, PyArray3, PyArrayMethods, PyReadonlyArray1, PyReadonlyArray2, PyUntypedArrayMethods,
};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

use feedplan_setpoints::reduce;

/// Of each column of `values` (n, k) and each bucket of `width` rows, n being a multiple of it: (k, n/width, 2) the rows of the
/// least and the greatest value, and (k, n/width) the sum of the values times their `weight` (n,).
#[pyfunction]
#[allow(clippy::type_complexity)]
pub fn buckets<'py>(
    py: Python<'py>,
    values: PyReadonlyArray2<'py, f64>,
    weight: PyReadonlyArray1<'py, f64>,
    width: usize,
) -> PyResult<(Bound<'py, PyArray3<i64>>, Bound<'py, PyArray2<f64>>)> {
    let [count, columns] = [values.shape()[0], values.shape()[1]];
    if weight.len() != count || columns == 0 || width == 0 || count % width != 0 {
        return Err(PyValueError::new_err("every row needs values and a weight, and a place in a bucket"));
    }
    let (values, weight) = (values.as_slice()?, weight.as_slice()?);
    let (extremes, sums) = py.detach(|| reduce::buckets(values, columns, weight, width));
    let shape = [columns, count / width];
    let extremes = PyArray1::from_vec(py, extremes.into_flattened()).reshape([shape[0], shape[1], 2])?;
    Ok((extremes, PyArray1::from_vec(py, sums).reshape(shape)?))
}

/// The rows of the `points` (n, 4) of a line that stay, and their part of the tolerance; see the kernel.
#[pyfunction]
#[allow(clippy::type_complexity)]
pub fn thin<'py>(
    py: Python<'py>,
    points: PyReadonlyArray2<'py, f64>,
    cost: PyReadonlyArray1<'py, f64>,
    tolerance: f64,
) -> PyResult<(Bound<'py, PyArray1<i64>>, Bound<'py, PyArray1<f64>>)> {
    if points.shape() != [cost.len(), 4] {
        return Err(PyValueError::new_err("every point has 4 values and a cost"));
    }
    let (points, cost) = (points.as_slice()?.as_chunks().0, cost.as_slice()?);
    let (rows, cost) = py.detach(|| reduce::thin(points, cost, tolerance));
    Ok((PyArray1::from_vec(py, rows), PyArray1::from_vec(py, cost)))
}
