//! numpy arrays to and from the types of the kernels, each length checked once here.

use numpy::{PyArray2, PyArray3, PyArrayMethods, PyReadonlyArray1, PyReadonlyArray2, PyReadonlyArray3};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

use crate::quadratic::Quadratic;

/// (n, M) array to rows.
pub fn rows<const M: usize>(array: &PyReadonlyArray2<f64>) -> PyResult<Vec<[f64; M]>> {
    let flat = array.as_slice().map_err(|_| contiguous())?;
    Ok(flat.chunks_exact(M).map(|row| std::array::from_fn(|k| row[k])).collect())
}

/// (M,) array to one row.
pub fn row<const M: usize>(array: &PyReadonlyArray1<f64>) -> PyResult<[f64; M]> {
    let flat = array.as_slice().map_err(|_| contiguous())?;
    flat.try_into().map_err(|_| PyValueError::new_err(format!("{} values where {M} axes are", flat.len())))
}

/// (n, 3, M) control points and (n,) widths to pieces.
pub fn quadratics<const M: usize>(
    control: &PyReadonlyArray3<f64>,
    width: &PyReadonlyArray1<f64>,
) -> PyResult<Vec<Quadratic<M>>> {
    let flat = control.as_slice().map_err(|_| contiguous())?;
    let width = width.as_slice().map_err(|_| contiguous())?;
    if flat.len() != 3 * M * width.len() {
        return Err(PyValueError::new_err("control points and widths differ in number"));
    }
    Ok(flat
        .chunks_exact(3 * M)
        .zip(width)
        .map(|(c, &width)| Quadratic {
            control: std::array::from_fn(|i| std::array::from_fn(|k| c[i * M + k])),
            width,
        })
        .collect())
}

/// Rows to an (n, M) array.
pub fn to_array2<'py, T: numpy::Element, const M: usize>(
    py: Python<'py>,
    rows: Vec<[T; M]>,
) -> Bound<'py, PyArray2<T>> {
    let count = rows.len();
    let flat = numpy::PyArray1::from_vec(py, rows.into_flattened());
    flat.reshape([count, M]).expect("n × M values")
}

/// Control points of pieces to an (n, 3, M) array.
pub fn to_array3<'py, const M: usize>(py: Python<'py>, pieces: &[Quadratic<M>]) -> Bound<'py, PyArray3<f64>> {
    let flat: Vec<f64> = pieces.iter().flat_map(|piece| piece.control).flatten().collect();
    numpy::PyArray1::from_vec(py, flat).reshape([pieces.len(), 3, M]).expect("n × 3 × M values")
}

fn contiguous() -> PyErr {
    PyValueError::new_err("arrays must be C-contiguous float64")
}
