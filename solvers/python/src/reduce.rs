//! Reduces data to few points for charts, for Python.

use numpy::{PyArray1, PyArrayMethods, PyUntypedArrayMethods};
use pyo3::prelude::*;
use pyo3::types::PyTuple;

use super::arrays::{require, Column, Table};
use feedplan_setpoints::reduce;

/// For each column of `values` (n, k) and each bucket of `width` rows, where n is a multiple of `width`: (k, n/width, 2) the rows
/// of the least and of the greatest value, in order, and (k, n/width) the sum of the values times their `weight` (n,).
#[pyfunction]
pub fn buckets<'py>(
    py: Python<'py>,
    values: Table<'py>,
    weight: Column<'py>,
    width: usize,
) -> PyResult<Bound<'py, PyTuple>> {
    let [count, columns] = [values.shape()[0], values.shape()[1]];
    let good = weight.len() == count && columns > 0 && width > 0 && count % width == 0;
    require(good, "every row needs values and a weight, and a place in a bucket")?;
    let (values, weight) = (values.as_slice()?, weight.as_slice()?);
    let (extremes, sums) = py.detach(|| reduce::buckets(values, columns, weight, width));
    let shape = [columns, count / width];
    let extremes = PyArray1::from_vec(py, extremes.into_flattened()).reshape([shape[0], shape[1], 2])?;
    (extremes, PyArray1::from_vec(py, sums).reshape(shape)?).into_pyobject(py)
}

/// Leaves out `points` (n, 4) of a line that are within `tolerance` of the segment between their neighbours. `cost` (n,) is the
/// part of the tolerance that is used between each point and the next. Returns the rows of the points that stay, and their costs.
#[pyfunction]
pub fn thin<'py>(
    py: Python<'py>,
    points: Table<'py>,
    cost: Column<'py>,
    tolerance: f64,
) -> PyResult<Bound<'py, PyTuple>> {
    require(points.shape() == [cost.len(), 4], "every point has 4 values and a cost")?;
    let (points, cost) = (points.as_slice()?.as_chunks().0, cost.as_slice()?);
    let (rows, cost) = py.detach(|| reduce::thin(points, cost, tolerance));
    (PyArray1::from_vec(py, rows), PyArray1::from_vec(py, cost)).into_pyobject(py)
}
