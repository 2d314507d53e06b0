//! `plan_quadratic`: the exact planner on quadratic pieces.

use numpy::{PyArray1, PyReadonlyArray1, PyReadonlyArray3, PyUntypedArrayMethods};
use pyo3::prelude::*;

use super::arrays::{quadratics, row};
use super::with_padded_axes;
use crate::bang_bang_quadratic::{plan, Fault, Problem, Profile};

pyo3::create_exception!(
    _solvers,
    PlanError,
    pyo3::exceptions::PyException,
    "No profile: (kind, piece or None, reachable speed or None, sentence), kind start, end, input or stuck."
);

/// Columns of `feedplan.profile.SpeedProfile`.
type Columns<'py> = (
    Bound<'py, PyArray1<u32>>,
    Bound<'py, PyArray1<u8>>,
    Bound<'py, PyArray1<u8>>,
    Bound<'py, PyArray1<f64>>,
    Bound<'py, PyArray1<f64>>,
    Bound<'py, PyArray1<f64>>,
    Bound<'py, PyArray1<f64>>,
    Bound<'py, PyArray1<f64>>,
    Bound<'py, PyArray1<f64>>,
    Bound<'py, PyArray1<i64>>,
);

/// The fastest profile along quadratic pieces: piece, kind, axis, value, u0, u1, p0, p1, duration, runs.
#[pyfunction]
#[pyo3(signature = (control_points, width, runs, feed, junction_speed, max_velocity, max_acceleration, chord_tolerance, period, start_speed, end_speed))]
#[allow(clippy::too_many_arguments)]
fn plan_quadratic<'py>(
    py: Python<'py>,
    control_points: PyReadonlyArray3<'py, f64>,
    width: PyReadonlyArray1<'py, f64>,
    runs: PyReadonlyArray1<'py, i64>,
    feed: PyReadonlyArray1<'py, f64>,
    junction_speed: PyReadonlyArray1<'py, f64>,
    max_velocity: PyReadonlyArray1<'py, f64>,
    max_acceleration: PyReadonlyArray1<'py, f64>,
    chord_tolerance: f64,
    period: f64,
    start_speed: f64,
    end_speed: f64,
) -> PyResult<Columns<'py>> {
    let runs: Vec<usize> =
        runs.as_array().iter().map(|&run| usize::try_from(run).unwrap_or(usize::MAX)).collect();
    with_padded_axes!(control_points.shape()[2], M, {
        let pieces = quadratics::<M>(&control_points, &width)?;
        let problem = Problem {
            pieces: &pieces,
            runs: &runs,
            feed: feed.as_slice()?,
            junction_speed: junction_speed.as_slice()?,
            max_velocity: row(&max_velocity, 1.0)?,
            max_acceleration: row(&max_acceleration, 1.0)?,
            chord_tolerance,
            period,
            start_speed,
            end_speed,
        };
        let profile = py.detach(|| plan(&problem)).map_err(|fault| to_exception(&fault))?;
        Ok(to_columns(py, profile))
    })
}

fn to_columns(py: Python<'_>, profile: Profile) -> Columns<'_> {
    let floats = |column| PyArray1::from_vec(py, column);
    (
        PyArray1::from_vec(py, profile.piece),
        PyArray1::from_vec(py, profile.kind),
        PyArray1::from_vec(py, profile.axis),
        floats(profile.value),
        floats(profile.u0),
        floats(profile.u1),
        floats(profile.p0),
        floats(profile.p1),
        floats(profile.duration),
        PyArray1::from_vec(py, profile.runs),
    )
}

fn to_exception(fault: &Fault) -> PyErr {
    let text = fault.to_string();
    let (kind, piece, reachable) = match *fault {
        Fault::Start { piece, reachable } => ("start", Some(piece), Some(reachable)),
        Fault::End { piece, reachable } => ("end", Some(piece), Some(reachable)),
        Fault::Input { piece, .. } => ("input", piece, None),
        Fault::Stuck { piece, .. } => ("stuck", Some(piece), None),
    };
    PlanError::new_err((kind, piece, reachable, text))
}

/// Adds the function and its exception to the module.
pub fn register(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add("PlanError", module.py().get_type::<PlanError>())?;
    module.add_function(wrap_pyfunction!(plan_quadratic, module)?)
}
