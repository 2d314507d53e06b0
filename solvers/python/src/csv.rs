//! Setpoints as comma-separated text, for Python.

use numpy::PyUntypedArrayMethods;
use pyo3::prelude::*;
use pyo3::types::PyBytes;

use super::arrays::{require, Column, Table};
use super::work::run;
use feedplan_setpoints::csv;

/// Rows of comma-separated text: `values` (n, k) and the integers `last` (n,) that close them.
#[pyfunction]
pub fn csv_rows<'py>(
    py: Python<'py>,
    values: Table<'py>,
    last: Column<'py, i32>,
) -> PyResult<Bound<'py, PyBytes>> {
    let [count, width] = [values.shape()[0], values.shape()[1]];
    require(count == last.len() && width > 0, "every row needs values and one integer")?;
    let (values, last) = (values.as_slice()?, last.as_slice()?);
    let text = run(py, None, |_| csv::rows(values, width, last))?;
    Ok(PyBytes::new(py, &text))
}
