//! `fit_points`: a chain of points to the quadratic pieces that fit it.

use numpy::{PyArray1, PyArray2, PyArray3, PyReadonlyArray2, PyUntypedArrayMethods};
use pyo3::prelude::*;

use super::arrays::{rows, to_array2, to_array3};
use super::with_padded_axes;
use super::work::run;
use feedplan_path::fit::FitOptions;
use feedplan_path::Fitted as _;

type Fitted<'py> = (
    Bound<'py, PyArray3<f64>>,
    Bound<'py, PyArray1<f64>>,
    Bound<'py, PyArray2<i64>>,
    Bound<'py, PyArray1<f64>>,
    Bound<'py, PyArray1<u32>>,
);

/// Control points (n, 3, axes), widths, chords (n, 2), deviations and splines of the fitted pieces.
#[pyfunction(name = "fit_points")]
fn fit<'py>(
    py: Python<'py>,
    points: PyReadonlyArray2<'py, f64>,
    tolerance: f64,
    max_chord: f64,
    max_curvature: f64,
    corner_angle: f64,
) -> PyResult<Fitted<'py>> {
    let options = FitOptions { tolerance, max_chord, max_curvature, corner_angle };
    let axes = points.shape()[1];
    with_padded_axes!(axes, M, {
        let points = rows::<M>(&points)?;
        let pieces = run(py, None, |watch| points.fitted(&options, watch))?;
        let curves: Vec<_> = pieces.iter().map(|piece| piece.piece).collect();
        let chords = pieces.iter().map(|piece| [piece.first as i64, piece.last as i64]).collect();
        Ok((
            to_array3(py, &curves, axes),
            PyArray1::from_iter(py, curves.iter().map(|piece| piece.width)),
            to_array2(py, chords, 2),
            PyArray1::from_iter(py, pieces.iter().map(|piece| piece.deviation)),
            PyArray1::from_iter(py, pieces.iter().map(|piece| piece.spline)),
        ))
    })
}

pub fn register(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add_function(wrap_pyfunction!(fit, module)?)
}
