//! `plan_quadratic` and `plan_curves`: the exact planner on quadratic pieces, and on pieces of any degree.

use numpy::{PyArray1, PyReadonlyArray1, PyReadonlyArray2, PyReadonlyArray3, PyUntypedArrayMethods};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

use super::arrays::{quadratics, row, rows};
use super::with_padded_axes;
use crate::bang_bang;
use crate::bang_bang_quadratic::{plan, Fault, Problem, Profile};
use crate::polynomial::MOST;
use crate::spline::MAX_DEGREE;

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

/// The fastest profile along pieces of any degree, polynomial and rational: the same columns.
#[pyfunction]
#[pyo3(signature = (control_points, weights, offsets, width, runs, feed, junction_speed, max_velocity, max_acceleration, chord_tolerance, period, start_speed, end_speed))]
#[allow(clippy::too_many_arguments)]
fn plan_curves<'py>(
    py: Python<'py>,
    control_points: PyReadonlyArray2<'py, f64>,
    weights: PyReadonlyArray1<'py, f64>,
    offsets: PyReadonlyArray1<'py, i64>,
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
    let index = |array: &PyReadonlyArray1<i64>| -> Vec<usize> {
        array.as_array().iter().map(|&value| usize::try_from(value).unwrap_or(usize::MAX)).collect()
    };
    let (runs, offsets) = (index(&runs), index(&offsets));
    let count = control_points.shape()[0];
    if offsets.first() != Some(&0)
        || offsets.last() != Some(&count)
        || offsets.windows(2).any(|pair| pair[1] < pair[0] + 2 || pair[1] > pair[0] + MAX_DEGREE + 1)
    {
        return Err(PyValueError::new_err(format!(
            "the offsets do not divide the control points into pieces of degree 1 to {MAX_DEGREE}"
        )));
    }
    let small = weights.as_slice()?.is_empty() && offsets.windows(2).all(|pair| pair[1] - pair[0] <= 4);
    with_padded_axes!(control_points.shape()[1], M, {
        let control = rows::<M>(&control_points)?;
        let problem = bang_bang::Problem {
            control: &control,
            weight: weights.as_slice()?,
            offset: &offsets,
            width: width.as_slice()?,
            tip_speed: None,
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
        // Polynomials of small degree stay short.
        let profile = py
            .detach(|| {
                if small {
                    bang_bang::plan::<M, 10>(&problem)
                } else {
                    bang_bang::plan::<M, MOST>(&problem)
                }
            })
            .map_err(|fault| to_exception(&fault))?;
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
    module.add_function(wrap_pyfunction!(plan_curves, module)?)?;
    module.add_function(wrap_pyfunction!(plan_quadratic, module)?)
}
