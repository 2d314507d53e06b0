//! `CurveLength`: the lengths along a `Curve`.

use numpy::PyArray1;
use pyo3::prelude::*;
use pyo3::types::PyTuple;

use super::arrays::Column;
use super::axes::with_padded_axes;
use super::curve::{check_places, Curve};
use super::memory;
use super::native::{with_object, InAxes};
use super::work::run;
use feedplan_geometry::spline::length::{CurveLength as Kernel, Measured};

/// The lengths along a curve.
#[pyclass(frozen, module = "feedplan._solvers")]
pub struct CurveLength {
    /// `Kernel`.
    lengths: InAxes,
    width: Vec<f64>,
}

#[pymethods]
impl CurveLength {
    /// The lengths along a curve, which must have at least one piece.
    #[new]
    fn new(py: Python<'_>, curve: &Curve, accuracy: f64) -> PyResult<Self> {
        let (axes, width) = (curve.axes(), curve.widths().to_vec());
        with_padded_axes!(axes, M, {
            let pieces = curve.padded::<M>()?;
            let lengths = run(py, None, |watch| pieces.lengths(accuracy, watch))?;
            py.detach(memory::give_back);
            Ok(Self { lengths: InAxes::new(axes, lengths), width })
        })
    }

    /// Length of the curve in mm.
    #[getter]
    fn total(&self) -> f64 {
        with_object!(self.lengths, M, kernel: Kernel<M>, kernel.total())
    }

    /// Upper bound of the error of a length on the curve in mm.
    #[getter]
    fn error(&self) -> f64 {
        with_object!(self.lengths, M, kernel: Kernel<M>, kernel.error())
    }

    /// Lengths (m,) in mm from the start of the curve to m places.
    fn lengths<'py>(
        &self,
        py: Python<'py>,
        piece: Column<'py, u32>,
        u: Column<'py>,
    ) -> PyResult<Bound<'py, PyArray1<f64>>> {
        let (piece, u) = (piece.as_slice()?, u.as_slice()?);
        check_places(&self.width, piece, u)?;
        let found =
            with_object!(self.lengths, M, kernel: Kernel<M>, run(py, None, |_| kernel.lengths(piece, u)));
        Ok(PyArray1::from_vec(py, found?))
    }

    /// Pieces (m,) and parameters (m,) at m lengths from the start of the curve in mm.
    fn locate<'py>(
        &self,
        py: Python<'py>,
        lengths: Column<'py>,
        tolerance: f64,
    ) -> PyResult<Bound<'py, PyTuple>> {
        let wanted = lengths.as_slice()?;
        let found = with_object!(self.lengths, M, kernel: Kernel<M>, {
            run(py, None, |_| kernel.locate_all(wanted, tolerance))
        })?;
        let (pieces, places): (Vec<_>, Vec<_>) =
            found.into_iter().map(|(piece, u)| (piece as u32, u)).unzip();
        (PyArray1::from_vec(py, pieces), PyArray1::from_vec(py, places)).into_pyobject(py)
    }
}
