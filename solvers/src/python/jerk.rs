//! The planners with limits of jerk: the package's own problem in, the columns of a profile out.

use std::time::{Duration, Instant};

use numpy::{PyArray1, PyReadonlyArray1};
use pyo3::prelude::*;

use super::arrays::row;
use super::plan::{to_exception, Columns};
use super::problem::{ProblemArrays, ProblemRows};
use super::with_padded_axes;
use crate::bang_bang_quadratic::NO_AXIS;
use crate::jerk_arcs::Arcs;
use crate::jerk_limited::Effort;
use crate::jerk_limited_path;
use crate::s_curve_path::{self, Cutting};

/// The accelerations at both ends of the arcs, and `kinked`.
type Changes<'py> = (Bound<'py, PyArray1<f64>>, Bound<'py, PyArray1<f64>>, Bound<'py, PyArray1<u32>>);

/// How long a planner may take.
fn deadline(time_limit: Option<f64>) -> Option<Instant> {
    let limit = Duration::try_from_secs_f64(time_limit?).ok()?;
    Instant::now().checked_add(limit)
}

/// The fastest profile within `jerk` [mm/s³] of every axis: the columns of all profiles, and (a0, a1,
/// kinked).
#[pyfunction]
#[pyo3(signature = (problem, jerk, resolution, tolerance, time_limit=None))]
fn plan_jerk_limited<'py>(
    py: Python<'py>,
    problem: ProblemArrays<'py>,
    jerk: PyReadonlyArray1<'py, f64>,
    resolution: f64,
    tolerance: f64,
    time_limit: Option<f64>,
) -> PyResult<(Columns<'py>, Changes<'py>)> {
    let effort = Effort { resolution, tolerance, deadline: deadline(time_limit), ..Effort::default() };
    with_padded_axes!(problem.curve.axes(), M, {
        let rows = ProblemRows::<M>::new(&problem)?;
        let (problem, jerk) = (rows.problem()?, row::<M>(&jerk, 1.0)?);
        let arcs = py
            .detach(|| jerk_limited_path::plan(&problem, &jerk, &effort))
            .map_err(|fault| to_exception(&fault))?;
        Ok(to_columns(py, arcs))
    })
}

/// The two-pass profile within `jerk` of every axis, of segments cut as `s_curve_path::Cutting` says (parts, stretch,
/// alike): the same columns.
#[pyfunction]
fn plan_s_curve<'py>(
    py: Python<'py>,
    problem: ProblemArrays<'py>,
    jerk: PyReadonlyArray1<'py, f64>,
    cutting: (usize, f64, f64),
    look_ahead: usize,
) -> PyResult<(Columns<'py>, Changes<'py>)> {
    let (parts, stretch, alike) = cutting;
    let cutting = Cutting { parts, stretch, alike };
    with_padded_axes!(problem.curve.axes(), M, {
        let rows = ProblemRows::<M>::new(&problem)?;
        let (problem, jerk) = (rows.problem()?, row::<M>(&jerk, 1.0)?);
        let arcs = py
            .detach(|| s_curve_path::plan(&problem, &jerk, &cutting, look_ahead))
            .map_err(|fault| to_exception(&fault))?;
        Ok(to_columns(py, arcs))
    })
}

fn to_columns(py: Python<'_>, arcs: Arcs) -> (Columns<'_>, Changes<'_>) {
    let floats = |column| PyArray1::from_vec(py, column);
    let count = arcs.len();
    let columns = (
        PyArray1::from_vec(py, arcs.piece),
        PyArray1::from_vec(py, arcs.kind),
        PyArray1::from_vec(py, vec![NO_AXIS; count]),
        floats(arcs.value),
        floats(arcs.u0),
        floats(arcs.u1),
        floats(arcs.p0),
        floats(arcs.p1),
        floats(arcs.duration),
        PyArray1::from_vec(py, arcs.runs),
        PyArray1::from_vec(py, vec![]),
    );
    (columns, (floats(arcs.a0), floats(arcs.a1), PyArray1::from_vec(py, arcs.kinks)))
}

/// Adds the functions to the module.
pub fn register(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add_function(wrap_pyfunction!(plan_jerk_limited, module)?)?;
    module.add_function(wrap_pyfunction!(plan_s_curve, module)?)
}
