//! `CurveLength`: the lengths along a `Curve`.

use numpy::{PyArray1, PyReadonlyArray1};
use pyo3::prelude::*;

use super::axes::with_padded_axes;
use super::curve::{check_places, Curve};
use super::memory;
use super::native::InAxes;
use super::work::run;
use feedplan_geometry::spline::length::{CurveLength as Kernel, Measured};

/// The lengths along a curve.
#[pyclass(frozen, module = "feedplan._solvers")]
pub struct CurveLength {
    axes: usize,
    /// `Kernel`.
    lengths: InAxes,
    width: Vec<f64>,
}

#[pymethods]
impl CurveLength {
    /// Of a curve, which has at least one piece.
    #[new]
    fn new(py: Python<'_>, curve: &Curve, accuracy: f64) -> PyResult<Self> {
        let (axes, width) = (curve.axes(), curve.widths().to_vec());
        with_padded_axes!(axes, M, {
            let pieces = curve.padded::<M>()?;
            let lengths = InAxes::new(run(py, None, |watch| pieces.lengths(accuracy, watch))?);
            py.detach(memory::give_back);
            Ok(Self { axes, lengths, width })
        })
    }

    /// Length of the curve in mm.
    #[getter]
    fn total(&self) -> PyResult<f64> {
        with_padded_axes!(self.axes, M, Ok(self.lengths.get::<Kernel<M>>()?.total()))
    }

    /// Upper bound of the error of a length on the curve in mm.
    #[getter]
    fn error(&self) -> PyResult<f64> {
        with_padded_axes!(self.axes, M, Ok(self.lengths.get::<Kernel<M>>()?.error()))
    }

    /// Lengths (m,) from the start of the curve to m places.
    fn lengths<'py>(
        &self,
        py: Python<'py>,
        piece: PyReadonlyArray1<'py, u32>,
        u: PyReadonlyArray1<'py, f64>,
    ) -> PyResult<Bound<'py, PyArray1<f64>>> {
        let (piece, u) = (piece.as_slice()?, u.as_slice()?);
        check_places(&self.width, piece, u)?;
        let found = with_padded_axes!(self.axes, M, {
            let kernel = self.lengths.get::<Kernel<M>>()?;
            run(py, None, |_| kernel.lengths(piece, u))
        })?;
        Ok(PyArray1::from_vec(py, found))
    }

    /// Pieces and parameters at m lengths.
    #[allow(clippy::type_complexity)]
    fn locate<'py>(
        &self,
        py: Python<'py>,
        lengths: PyReadonlyArray1<'py, f64>,
        tolerance: f64,
    ) -> PyResult<(Bound<'py, PyArray1<u32>>, Bound<'py, PyArray1<f64>>)> {
        let wanted = lengths.as_slice()?;
        let found = with_padded_axes!(self.axes, M, {
            let kernel = self.lengths.get::<Kernel<M>>()?;
            run(py, None, |_| kernel.locate_all(wanted, tolerance))
        })?;
        Ok((
            PyArray1::from_iter(py, found.iter().map(|&(piece, _)| piece as u32)),
            PyArray1::from_iter(py, found.iter().map(|&(_, u)| u)),
        ))
    }
}
