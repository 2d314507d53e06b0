//! Setpoints and lengths of a path for Python.

use std::ops::Range;
use std::sync::{Mutex, PoisonError};

use numpy::{PyArray1, PyArray2, PyReadonlyArray1, PyReadonlyArray3, PyUntypedArrayMethods};
use pyo3::exceptions::{PyIndexError, PyValueError};
use pyo3::prelude::*;

use super::arrays::{quadratics, to_array2};
use super::with_padded_axes;
use crate::arc_length::{PathLength, Place};
use crate::motion::{ArcKind, ProfileArc};
use crate::newton;
use crate::sampling::{Interpolator, PathData, Resume, Sampler};

pyo3::import_exception!(feedplan.errors, InputError);

/// t, position, velocity, acceleration, jerk, line, piece, u, worst rounds, worst length error.
type ChunkArrays<'py> = (
    Bound<'py, PyArray1<f64>>,
    Bound<'py, PyArray2<f64>>,
    Bound<'py, PyArray2<f64>>,
    Bound<'py, PyArray2<f64>>,
    Bound<'py, PyArray2<f64>>,
    Bound<'py, PyArray1<i32>>,
    Bound<'py, PyArray1<u32>>,
    Bound<'py, PyArray1<f64>>,
    u32,
    f64,
);

/// A sampler whatever its number of axes.
trait Stream: Send + Sync {
    fn count(&self) -> usize;
    fn duration(&self) -> f64;
    fn chunk<'py>(
        &self,
        py: Python<'py>,
        range: Range<usize>,
        resume: &Mutex<Option<Resume>>,
        axes: usize,
    ) -> ChunkArrays<'py>;
}

impl<const M: usize> Stream for Sampler<M> {
    fn count(&self) -> usize {
        self.count()
    }

    fn duration(&self) -> f64 {
        self.duration()
    }

    fn chunk<'py>(
        &self,
        py: Python<'py>,
        range: Range<usize>,
        resume: &Mutex<Option<Resume>>,
        axes: usize,
    ) -> ChunkArrays<'py> {
        let chunk = py.detach(|| {
            let mut state = *resume.lock().unwrap_or_else(PoisonError::into_inner);
            let chunk = self.chunk(range, &mut state);
            *resume.lock().unwrap_or_else(PoisonError::into_inner) = state;
            chunk
        });
        (
            PyArray1::from_vec(py, chunk.t),
            to_array2(py, chunk.position, axes),
            to_array2(py, chunk.velocity, axes),
            to_array2(py, chunk.acceleration, axes),
            to_array2(py, chunk.jerk, axes),
            PyArray1::from_vec(py, chunk.line),
            PyArray1::from_vec(py, chunk.piece),
            PyArray1::from_vec(py, chunk.u),
            chunk.effort.iterations,
            chunk.effort.length_error,
        )
    }
}

/// A profile on its path, ready to be read at any setpoint.
#[pyclass(name = "Sampler", module = "feedplan._solvers", frozen)]
struct PySampler {
    stream: Box<dyn Stream>,
    axes: usize,
    resume: Mutex<Option<Resume>>,
}

#[pymethods]
impl PySampler {
    #[new]
    #[allow(clippy::too_many_arguments)]
    fn new(
        py: Python<'_>,
        control_points: PyReadonlyArray3<'_, f64>,
        width: PyReadonlyArray1<'_, f64>,
        line: PyReadonlyArray1<'_, i32>,
        runs: PyReadonlyArray1<'_, i64>,
        start_dwell: f64,
        dwell: PyReadonlyArray1<'_, f64>,
        piece: PyReadonlyArray1<'_, u32>,
        kind: PyReadonlyArray1<'_, u8>,
        axis: PyReadonlyArray1<'_, u8>,
        value: PyReadonlyArray1<'_, f64>,
        u0: PyReadonlyArray1<'_, f64>,
        u1: PyReadonlyArray1<'_, f64>,
        p0: PyReadonlyArray1<'_, f64>,
        p1: PyReadonlyArray1<'_, f64>,
        duration: PyReadonlyArray1<'_, f64>,
        arc_runs: PyReadonlyArray1<'_, i64>,
        period: f64,
        newton: bool,
    ) -> PyResult<Self> {
        let (piece, kind, axis) = (slice(&piece)?, slice(&kind)?, slice(&axis)?);
        let (value, duration) = (slice(&value)?, slice(&duration)?);
        let (u0, u1, p0, p1) = (slice(&u0)?, slice(&u1)?, slice(&p0)?, slice(&p1)?);
        let count = piece.len();
        if [kind.len(), axis.len()].iter().any(|&length| length != count)
            || [value, u0, u1, p0, p1, duration].iter().any(|array| array.len() != count)
        {
            return Err(PyValueError::new_err("the arrays of the profile differ in length"));
        }
        let arcs = (0..count)
            .map(|i| {
                let kind = ArcKind::from_number(kind[i]).ok_or_else(|| {
                    PyValueError::new_err(format!("arc {i} has the unknown kind {}", kind[i]))
                })?;
                Ok(ProfileArc {
                    piece: piece[i],
                    kind,
                    axis: axis[i],
                    value: value[i],
                    u0: u0[i],
                    u1: u1[i],
                    p0: p0[i],
                    p1: p1[i],
                    duration: duration[i],
                })
            })
            .collect::<PyResult<Vec<_>>>()?;
        let arc_runs = offsets(&arc_runs)?;
        let interpolator = if newton { Interpolator::Newton } else { Interpolator::Sarfraz };
        let axes = control_points.shape()[2];
        let of_axis = |kind| matches!(kind, ArcKind::AxisAcceleration | ArcKind::AxisVelocity);
        if let Some(i) = arcs.iter().position(|arc| of_axis(arc.kind) && arc.axis as usize >= axes) {
            return Err(InputError::new_err(format!(
                "arc {i} of the profile is governed by axis {}, but the path has {axes}: plan this path again",
                arcs[i].axis
            )));
        }
        let stream = with_padded_axes!(axes, M, {
            let path = PathData::<M> {
                pieces: quadratics(&control_points, &width)?,
                lines: slice(&line)?.to_vec(),
                runs: offsets(&runs)?,
                start_dwell,
                dwell: slice(&dwell)?.to_vec(),
            };
            let sampler = py.detach(|| Sampler::new(path, arcs, &arc_runs, period, interpolator));
            sampler.map(|sampler| Box::new(sampler) as Box<dyn Stream>).map_err(InputError::new_err)
        })?;
        Ok(Self { stream, axes, resume: Mutex::new(None) })
    }

    /// Number of setpoints.
    #[getter]
    fn count(&self) -> usize {
        self.stream.count()
    }

    /// Time of the last setpoint in seconds.
    #[getter]
    fn duration(&self) -> f64 {
        self.stream.duration()
    }

    /// The setpoints from `start` up to `stop`.
    fn chunk<'py>(&self, py: Python<'py>, start: usize, stop: usize) -> PyResult<ChunkArrays<'py>> {
        if !(start < stop && stop <= self.stream.count()) {
            return Err(PyIndexError::new_err(format!(
                "setpoints {start} to {stop} of {}",
                self.stream.count()
            )));
        }
        Ok(self.stream.chunk(py, start..stop, &self.resume, self.axes))
    }
}

/// Lengths along a path of quadratic pieces.
#[pyclass(name = "PathLength", module = "feedplan._solvers", frozen)]
struct PyPathLength(PathLength);

#[pymethods]
impl PyPathLength {
    #[new]
    fn new(
        py: Python<'_>,
        control_points: PyReadonlyArray3<'_, f64>,
        width: PyReadonlyArray1<'_, f64>,
    ) -> PyResult<Self> {
        if control_points.shape()[0] == 0 {
            return Err(PyValueError::new_err("the path is empty"));
        }
        with_padded_axes!(control_points.shape()[2], M, {
            let pieces = quadratics::<M>(&control_points, &width)?;
            Ok(Self(py.detach(|| PathLength::new(&pieces))))
        })
    }

    /// Length of the path in mm.
    #[getter]
    fn total(&self) -> f64 {
        self.0.total()
    }

    /// The greatest proven error of one piece's length in mm.
    #[getter]
    fn error(&self) -> f64 {
        self.0.error()
    }

    /// Length from the start of the path to the places (piece, u).
    fn lengths<'py>(
        &self,
        py: Python<'py>,
        piece: PyReadonlyArray1<'py, u32>,
        u: PyReadonlyArray1<'py, f64>,
    ) -> PyResult<Bound<'py, PyArray1<f64>>> {
        let (piece, u) = (slice(&piece)?, slice(&u)?);
        if piece.len() != u.len() || piece.iter().any(|&piece| piece as usize >= self.0.pieces()) {
            return Err(PyIndexError::new_err("pieces and parameters do not suit the path"));
        }
        let lengths =
            py.detach(|| piece.iter().zip(u).map(|(&piece, &u)| self.0.length(piece as usize, u)).collect());
        Ok(PyArray1::from_vec(py, lengths))
    }

    /// The places at lengths within `tolerance` mm: piece, u, rounds, remaining miss.
    #[allow(clippy::type_complexity)]
    fn locate<'py>(
        &self,
        py: Python<'py>,
        lengths: PyReadonlyArray1<'py, f64>,
        tolerance: f64,
        newton: bool,
    ) -> PyResult<(
        Bound<'py, PyArray1<u32>>,
        Bound<'py, PyArray1<f64>>,
        Bound<'py, PyArray1<u32>>,
        Bound<'py, PyArray1<f64>>,
    )> {
        let lengths = slice(&lengths)?;
        let places: Vec<Place> = py.detach(|| match newton {
            true => newton::follow(&self.0, lengths, tolerance),
            false => self.0.locate_all(lengths, tolerance),
        });
        Ok((
            PyArray1::from_iter(py, places.iter().map(|place| place.piece as u32)),
            PyArray1::from_iter(py, places.iter().map(|place| place.located.u)),
            PyArray1::from_iter(py, places.iter().map(|place| place.located.iterations)),
            PyArray1::from_iter(py, places.iter().map(|place| place.located.miss)),
        ))
    }
}

fn slice<'a, T: numpy::Element>(array: &'a PyReadonlyArray1<'_, T>) -> PyResult<&'a [T]> {
    array.as_slice().map_err(|_| PyValueError::new_err("arrays must be C-contiguous"))
}

fn offsets(array: &PyReadonlyArray1<'_, i64>) -> PyResult<Vec<usize>> {
    slice(array)?
        .iter()
        .map(|&offset| usize::try_from(offset).map_err(|_| PyValueError::new_err("an offset is negative")))
        .collect()
}

pub fn register(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add_class::<PySampler>()?;
    module.add_class::<PyPathLength>()
}
