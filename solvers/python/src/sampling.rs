//! Setpoints for Python.

use std::ops::Range;
use std::sync::{Mutex, PoisonError};

use numpy::{PyArray1, PyArray2, PyReadonlyArray1, PyReadonlyArray2, PyUntypedArrayMethods};
use pyo3::exceptions::{PyIndexError, PyValueError};
use pyo3::prelude::*;

use super::arrays::{rows_with, to_array2};
use super::spline::curve;
use super::with_padded_axes;
use super::work::run;
use feedplan_planner::arc_kind::ArcKind;
use feedplan_setpoints::motion::ProfileArc;
use feedplan_setpoints::sampling::{Chunk, Interpolator, PathData, Resume, Sampler};

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

/// Bernstein coefficients and their offsets.
type SpeedArrays<'py> = (PyReadonlyArray1<'py, f64>, PyReadonlyArray1<'py, i64>);

fn speed(arrays: &Option<SpeedArrays>) -> PyResult<Option<(Vec<f64>, Vec<usize>)>> {
    let speed = arrays.as_ref().map(|(coefficients, offsets)| -> PyResult<_> {
        Ok((slice(coefficients)?.to_vec(), indices(offsets)?))
    });
    speed.transpose()
}

/// A sampler whatever its number of axes.
trait Stream: Send + Sync {
    fn count(&self) -> usize;
    fn duration(&self) -> f64;
    fn runs(&self) -> Vec<[f64; 3]>;
    fn chunk<'py>(
        &self,
        py: Python<'py>,
        range: Range<usize>,
        resume: &Mutex<Option<Resume>>,
        axes: usize,
    ) -> PyResult<ChunkArrays<'py>>;
    fn at<'py>(&self, py: Python<'py>, times: &[f64], axes: usize) -> PyResult<ChunkArrays<'py>>;
    fn along<'py>(
        &self,
        py: Python<'py>,
        piece: &[u32],
        u: &[f64],
        axes: usize,
    ) -> PyResult<ChunkArrays<'py>>;
}

impl<const M: usize> Stream for Sampler<M> {
    fn count(&self) -> usize {
        self.count()
    }

    fn duration(&self) -> f64 {
        self.duration()
    }

    fn runs(&self) -> Vec<[f64; 3]> {
        self.runs().collect()
    }

    fn chunk<'py>(
        &self,
        py: Python<'py>,
        range: Range<usize>,
        resume: &Mutex<Option<Resume>>,
        axes: usize,
    ) -> PyResult<ChunkArrays<'py>> {
        // Locked with Python's lock alone: a child that is forked meanwhile does not find it locked.
        let state = || resume.lock().unwrap_or_else(PoisonError::into_inner);
        let mut next = *state();
        let chunk = run(py, None, |watch| self.chunk(range, &mut next, watch))?;
        *state() = next;
        Ok(arrays(py, chunk, axes))
    }

    fn at<'py>(&self, py: Python<'py>, times: &[f64], axes: usize) -> PyResult<ChunkArrays<'py>> {
        let chunk = run(py, None, |watch| self.at(times, watch))?;
        Ok(arrays(py, chunk, axes))
    }

    fn along<'py>(
        &self,
        py: Python<'py>,
        piece: &[u32],
        u: &[f64],
        axes: usize,
    ) -> PyResult<ChunkArrays<'py>> {
        let chunk = run(py, None, |watch| self.along(piece, u, watch))?;
        Ok(arrays(py, chunk, axes))
    }
}

fn arrays<const M: usize>(py: Python<'_>, chunk: Chunk<M>, axes: usize) -> ChunkArrays<'_> {
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
    #[pyo3(signature = (
        control_points, weights, offsets, width, tip_speed, way_speed, feed_share, line, runs, start_dwell, dwell,
        piece, kind, axis, value, u0, u1, p0, p1, duration, a0, a1, arc_runs, period, newton, progress=None
    ))]
    fn new(
        py: Python<'_>,
        control_points: PyReadonlyArray2<'_, f64>,
        weights: Option<PyReadonlyArray1<'_, f64>>,
        offsets: PyReadonlyArray1<'_, i64>,
        width: PyReadonlyArray1<'_, f64>,
        tip_speed: Option<SpeedArrays<'_>>,
        way_speed: Option<SpeedArrays<'_>>,
        feed_share: Option<PyReadonlyArray2<'_, f64>>,
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
        a0: PyReadonlyArray1<'_, f64>,
        a1: PyReadonlyArray1<'_, f64>,
        arc_runs: PyReadonlyArray1<'_, i64>,
        period: f64,
        newton: bool,
        progress: Option<Bound<'_, PyAny>>,
    ) -> PyResult<Self> {
        let (piece, kind, axis) = (slice(&piece)?, slice(&kind)?, slice(&axis)?);
        let (value, duration) = (slice(&value)?, slice(&duration)?);
        let (u0, u1, p0, p1) = (slice(&u0)?, slice(&u1)?, slice(&p0)?, slice(&p1)?);
        let (a0, a1) = (slice(&a0)?, slice(&a1)?);
        let count = piece.len();
        if [kind.len(), axis.len()].iter().any(|&length| length != count)
            || [value, u0, u1, p0, p1, duration, a0, a1].iter().any(|array| array.len() != count)
        {
            return Err(PyValueError::new_err("the arrays of the profile differ in length"));
        }
        let arc_runs = indices(&arc_runs)?;
        let interpolator = if newton { Interpolator::Newton } else { Interpolator::Sarfraz };
        let axes = control_points.shape()[1];
        let of_axis = |kind| matches!(kind, ArcKind::AxisAcceleration | ArcKind::AxisVelocity);
        let arc = |i: usize| {
            let kind = ArcKind::from_number(kind[i])
                .ok_or_else(|| format!("arc {i} of the profile has the unknown kind {}", kind[i]))?;
            if of_axis(kind) && axis[i] as usize >= axes {
                return Err(format!(
                    "arc {i} of the profile is governed by axis {}, but the path has {axes}: plan this path again",
                    axis[i]
                ));
            }
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
                a0: a0[i],
                a1: a1[i],
            })
        };
        let stream = with_padded_axes!(axes, M, {
            let path = PathData::<M> {
                curve: curve(&control_points, weights.as_ref(), &offsets, &width)?,
                tip_speed: speed(&tip_speed)?,
                way_speed: speed(&way_speed)?,
                feed_share: match &feed_share {
                    None => vec![],
                    Some(share) => rows_with(share, 1.0)?,
                },
                lines: slice(&line)?.to_vec(),
                runs: indices(&runs)?,
                start_dwell,
                dwell: slice(&dwell)?.to_vec(),
            };
            let sampler = run(py, progress.as_ref(), |watch| {
                let each = watch.part(0.5).each(count);
                let counted = |i: usize| {
                    each.count(i);
                    arc(i)
                };
                let arcs = (0..count).map(counted).collect::<Result<Vec<_>, String>>()?;
                Sampler::new(path, arcs, &arc_runs, period, interpolator, watch.part(0.5))
            })?;
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

    /// (runs, 3) when each starts on the plan's own clock, when on that of the setpoints, and its time in motion.
    #[getter]
    fn runs<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray2<f64>> {
        to_array2(py, self.stream.runs(), 3)
    }

    /// The setpoints from `start` up to `stop`.
    fn chunk<'py>(&self, py: Python<'py>, start: usize, stop: usize) -> PyResult<ChunkArrays<'py>> {
        if !(start < stop && stop <= self.stream.count()) {
            return Err(PyIndexError::new_err(format!(
                "setpoints {start} to {stop} of {}",
                self.stream.count()
            )));
        }
        self.stream.chunk(py, start..stop, &self.resume, self.axes)
    }

    /// The states at times of the plan's own clock.
    fn at<'py>(&self, py: Python<'py>, times: PyReadonlyArray1<'_, f64>) -> PyResult<ChunkArrays<'py>> {
        self.stream.at(py, slice(&times)?, self.axes)
    }

    /// The states at places of the path.
    fn along<'py>(
        &self,
        py: Python<'py>,
        piece: PyReadonlyArray1<'_, u32>,
        u: PyReadonlyArray1<'_, f64>,
    ) -> PyResult<ChunkArrays<'py>> {
        let (piece, u) = (slice(&piece)?, slice(&u)?);
        if piece.len() != u.len() {
            return Err(PyValueError::new_err(format!("{} pieces and {} parameters", piece.len(), u.len())));
        }
        self.stream.along(py, piece, u, self.axes)
    }
}

fn slice<'a, T: numpy::Element>(array: &'a PyReadonlyArray1<'_, T>) -> PyResult<&'a [T]> {
    array.as_slice().map_err(|_| PyValueError::new_err("arrays must be C-contiguous"))
}

fn indices(array: &PyReadonlyArray1<'_, i64>) -> PyResult<Vec<usize>> {
    slice(array)?
        .iter()
        .map(|&offset| usize::try_from(offset).map_err(|_| PyValueError::new_err("an offset is negative")))
        .collect()
}

pub fn register(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add_class::<PySampler>()
}
