//! Converts NumPy arrays to and from the types of the kernels, and checks their lengths.

use numpy::{
    PyArray1, PyArray2, PyArrayMethods, PyReadonlyArray1, PyReadonlyArray2, PyReadonlyArray3,
    PyUntypedArrayMethods,
};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

/// Arrays of one, two and three dimensions that Python passes.
pub type Column<'py, T = f64> = PyReadonlyArray1<'py, T>;
pub type Table<'py, T = f64> = PyReadonlyArray2<'py, T>;
pub type Cube<'py, T = f64> = PyReadonlyArray3<'py, T>;

/// Raises ValueError with the sentence if `good` is false.
pub fn require(good: bool, sentence: &'static str) -> PyResult<()> {
    good.then_some(()).ok_or_else(|| PyValueError::new_err(sentence))
}

/// Converts offsets; a negative one becomes the greatest number, which no kernel accepts.
pub fn indices(array: &Column<'_, i64>) -> Vec<usize> {
    array.as_array().iter().map(|&value| usize::try_from(value).unwrap_or(usize::MAX)).collect()
}

/// Rows of an (n, m) array as rows of M ≥ m axes, those beyond m at 0.
pub fn rows<const M: usize>(array: &Table) -> PyResult<Vec<[f64; M]>> {
    rows_with(array, 0.0)
}

/// Rows of an (n, m) array as rows of M ≥ m axes, those beyond m at `rest`.
pub fn rows_with<const M: usize>(array: &Table, rest: f64) -> PyResult<Vec<[f64; M]>> {
    let flat = array.as_slice()?;
    let axes = array.shape()[1];
    Ok(flat.chunks_exact(axes).map(|row| padded(row, rest)).collect())
}

/// Rows of `axes` numbers as rows of M axes, the additional ones at 0.
pub fn padded_rows<const M: usize>(flat: &[f64], axes: usize) -> Vec<[f64; M]> {
    flat.chunks_exact(axes).map(|row| padded(row, 0.0)).collect()
}

/// An (m,) array as one row of M ≥ m axes, those beyond m at `rest`.
pub fn row<const M: usize>(array: &Column, rest: f64) -> PyResult<[f64; M]> {
    let flat = array.as_slice()?;
    if flat.len() > M {
        return Err(PyValueError::new_err(format!("{} values where {M} axes are", flat.len())));
    }
    Ok(padded(flat, rest))
}

pub fn padded<const M: usize>(values: &[f64], rest: f64) -> [f64; M] {
    std::array::from_fn(|k| values.get(k).copied().unwrap_or(rest))
}

/// The first `axes` columns of rows as an (n, axes) array.
pub fn to_array2<'py, T: numpy::Element + Copy, const M: usize>(
    py: Python<'py>,
    rows: Vec<[T; M]>,
    axes: usize,
) -> Bound<'py, PyArray2<T>> {
    let (count, mut flat) = (rows.len(), rows.into_flattened());
    if axes < M {
        // In place: allocating a second array of this size is slow.
        for i in 0..count {
            flat.copy_within(i * M..i * M + axes, i * axes);
        }
        flat.truncate(count * axes);
    }
    PyArray1::from_vec(py, flat).reshape([count, axes]).expect("n × axes values")
}
