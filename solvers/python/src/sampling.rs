//! Setpoints for Python.

use std::sync::{Mutex, PoisonError};

use numpy::{PyArray1, PyArray2};
use pyo3::exceptions::{PyIndexError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::PyTuple;

use super::arrays::{to_array2, Column};
use super::axes::with_padded_axes;
use super::native::{with_object, InAxes, Of};
use super::problem::Problem;
use super::profile::Profile;
use super::work::run;
use feedplan_geometry::watch::Watch;
use feedplan_setpoints::sampling::{Chunk, Interpolator, Resume, Sampler};
use feedplan_setpoints::{Sampled, States};

pyo3::import_exception!(feedplan.errors, InputError);

/// t, position, velocity, acceleration, jerk, line, piece, u, the greatest number of iterations, the greatest length error.
fn arrays<const M: usize>(py: Python<'_>, chunk: Chunk<M>, axes: usize) -> PyResult<Bound<'_, PyTuple>> {
    let [position, velocity, acceleration, jerk] =
        [chunk.position, chunk.velocity, chunk.acceleration, chunk.jerk]
            .map(|rows| to_array2(py, rows, axes));
    let (line, piece) = (PyArray1::from_vec(py, chunk.line), PyArray1::from_vec(py, chunk.piece));
    let [t, u] = [chunk.t, chunk.u].map(|column| PyArray1::from_vec(py, column));
    let (rounds, error) = (chunk.effort.iterations, chunk.effort.length_error);
    (t, position, velocity, acceleration, jerk, line, piece, u, rounds, error).into_pyobject(py)
}

/// A profile on its path, prepared for computing setpoints.
#[pyclass(name = "Sampler", module = "feedplan._solvers", frozen)]
pub struct PySampler {
    /// `Sampler`.
    sampler: InAxes,
    resume: Mutex<Option<Resume>>,
}

impl PySampler {
    /// Calls `work` with the sampler, without Python's lock.
    fn states<'py, const M: usize>(
        &self,
        py: Python<'py>,
        work: impl FnOnce(&Sampler<M>, Watch) -> Chunk<M> + Send,
    ) -> PyResult<Bound<'py, PyTuple>> {
        let sampler = self.sampler.get()?;
        arrays(py, run(py, None, |watch| work(sampler, watch))?, self.sampler.axes)
    }
}

#[pymethods]
impl PySampler {
    #[new]
    #[pyo3(signature = (problem, profile, period, progress=None))]
    fn new(
        py: Python<'_>,
        problem: Of<Problem>,
        profile: Of<Profile>,
        period: f64,
        progress: Option<Bound<'_, PyAny>>,
    ) -> PyResult<Self> {
        let (profile, axes) = (&*profile, problem.axes());
        let offset = |&offset: &i64| {
            usize::try_from(offset).map_err(|_| PyValueError::new_err("an offset is negative"))
        };
        let runs = profile.runs.iter().map(offset).collect::<PyResult<Vec<_>>>()?;
        let sampler = with_padded_axes!(axes, M, {
            let path = &problem.rows::<M>()?.path;
            let sampler =
                run(py, progress.as_ref(), |watch| path.sampled(&profile.phases, &runs, period, watch))?;
            sampler.map(|sampler| InAxes::new(axes, sampler)).map_err(InputError::new_err)
        })?;
        Ok(Self { sampler, resume: Mutex::new(None) })
    }

    /// Number of setpoints.
    #[getter]
    fn count(&self) -> usize {
        with_object!(self.sampler, M, sampler: Sampler<M>, sampler.count())
    }

    /// Time of the last setpoint in seconds.
    #[getter]
    fn duration(&self) -> f64 {
        with_object!(self.sampler, M, sampler: Sampler<M>, sampler.duration())
    }

    /// (runs, 3): the start of each run in the plan's own time, its start in the time of the setpoints, and its time in motion
    /// [s].
    #[getter]
    fn runs<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray2<f64>> {
        with_object!(self.sampler, M, sampler: Sampler<M>, to_array2(py, sampler.runs().collect(), 3))
    }

    /// The setpoints from `start` to `stop` − 1.
    fn chunk<'py>(
        &self,
        py: Python<'py>,
        start: usize,
        stop: usize,
        newton: bool,
    ) -> PyResult<Bound<'py, PyTuple>> {
        let count = self.count();
        if !(start < stop && stop <= count) {
            return Err(PyIndexError::new_err(format!("setpoints {start} to {stop} of {count}")));
        }
        let interpolator = if newton { Interpolator::Newton } else { Interpolator::Sarfraz };
        // Locked only by a thread that holds Python's lock, so that a child process forked meanwhile does not find it locked.
        let state = || self.resume.lock().unwrap_or_else(PoisonError::into_inner);
        let mut next = *state();
        let chunk = with_padded_axes!(self.sampler.axes, M, {
            self.states::<M>(py, |sampler, watch| {
                sampler.setpoints(start..stop, interpolator, &mut next, watch)
            })
        })?;
        *state() = next;
        Ok(chunk)
    }

    /// The states at `times` [s] of the plan's own clock.
    fn at<'py>(&self, py: Python<'py>, times: Column<'_>) -> PyResult<Bound<'py, PyTuple>> {
        let times = times.as_slice()?;
        with_padded_axes!(
            self.sampler.axes,
            M,
            self.states::<M>(py, |sampler, watch| sampler.states_at(times, watch))
        )
    }

    /// The states at places of the path.
    fn along<'py>(
        &self,
        py: Python<'py>,
        piece: Column<'_, u32>,
        u: Column<'_>,
    ) -> PyResult<Bound<'py, PyTuple>> {
        let (piece, u) = (piece.as_slice()?, u.as_slice()?);
        if piece.len() != u.len() {
            return Err(PyValueError::new_err(format!("{} pieces and {} parameters", piece.len(), u.len())));
        }
        with_padded_axes!(self.sampler.axes, M, {
            self.states::<M>(py, |sampler, watch| sampler.states_along(piece, u, watch))
        })
    }
}
