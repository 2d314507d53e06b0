//! Setpoints as comma-separated text, for Python.

use numpy::{PyReadonlyArray1, PyReadonlyArray2, PyUntypedArrayMethods};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyBytes;

use super::work::run;
use feedplan_setpoints::csv;

/// Rows of comma-separated text: `values` (n, k) and the integers `last` (n,) that close them.
#[pyfunction]
pub fn csv_rows<'py>(
    py: Python<'py>,
    values: PyReadonlyArray2<'py, f64>,
    last: PyReadonlyArray1<'py, i32>,
) -> PyResult<Bound<'py, PyBytes>> {
    let [count, width] = [values.shape()[0], values.shape()[1]];
    if count != last.len() || width == 0 {
        return Err(PyValueError::new_err("every row needs values and one integer"));
    }
    let (values, last) = (values.as_slice()?, last.as_slice()?);
    let text = run(py, None, |_| csv::rows(values, width, last))?;
    Ok(PyBytes::new(py, &text))
}
