//! The exact planner: the package's own problem in, the columns of a profile out.

use numpy::{PyArray1, PyReadonlyArray1, PyReadonlyArray2};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

use super::arrays::{indices, quadratics, row, rows};
use super::problem::{ProblemArrays, ProblemRows};
use super::with_padded_axes;
use super::work::run;
use feedplan_geometry::watch::Watch;
use feedplan_jerk::JerkLimited as _;
use feedplan_planner::bang_bang;
use feedplan_planner::bang_bang_quadratic::{self, Fault, Profile};
use feedplan_planner::look_ahead::{Change, Segments};
use feedplan_planner::{Exact as _, ExactQuadratic as _};

pyo3::create_exception!(
    _solvers,
    PlanError,
    pyo3::exceptions::PyException,
    "No profile: (kind, piece or None, reachable speed or None, sentence), kind start, end, input or stuck."
);

/// Columns of `feedplan.profile.SpeedProfile`.
pub type Columns<'py> = (
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
    Bound<'py, PyArray1<u32>>,
);

/// Which planner takes the runs of polynomial quadratics.
#[derive(Clone, Copy)]
enum Quadratics {
    Their,
    General,
}

/// The fastest profile: piece, kind, axis, value, u0, u1, p0, p1, duration, runs, slowed.
#[pyfunction]
#[pyo3(signature = (problem, progress=None))]
fn plan_bang_bang<'py>(
    py: Python<'py>,
    problem: ProblemArrays<'py>,
    progress: Option<Bound<'py, PyAny>>,
) -> PyResult<Columns<'py>> {
    plan(py, &problem, Quadratics::Their, progress.as_ref())
}

/// The same by the planner for pieces of any degree alone.
#[pyfunction]
fn plan_curves<'py>(py: Python<'py>, problem: ProblemArrays<'py>) -> PyResult<Columns<'py>> {
    plan(py, &problem, Quadratics::General, None)
}

fn plan<'py>(
    py: Python<'py>,
    arrays: &ProblemArrays<'py>,
    by: Quadratics,
    progress: Option<&Bound<'py, PyAny>>,
) -> PyResult<Columns<'py>> {
    let curve = &arrays.curve;
    if matches!(by, Quadratics::Their)
        && arrays.tip_speed.is_none()
        && arrays.feed_share.is_none()
        && !arrays.is_sided()
        && curve.is_quadratic()
    {
        return plan_quadratics(py, arrays, progress);
    }
    with_padded_axes!(curve.axes(), M, {
        let rows = ProblemRows::<M>::new(arrays)?;
        let problem = rows.problem()?;
        let plan = |watch: Watch| {
            let problem = bang_bang::Problem { watch, ..problem };
            match by {
                Quadratics::Their => problem.fastest(),
                Quadratics::General => problem.fastest_as_curves(),
            }
        };
        let profile = run(py, progress, plan)?.map_err(|fault| to_exception(&fault))?;
        Ok(to_columns(py, profile))
    })
}

/// A path of polynomial quadratics alone, without a detour.
fn plan_quadratics<'py>(
    py: Python<'py>,
    arrays: &ProblemArrays<'py>,
    progress: Option<&Bound<'py, PyAny>>,
) -> PyResult<Columns<'py>> {
    let curve = &arrays.curve;
    let runs = indices(&arrays.path.runs);
    with_padded_axes!(curve.axes(), M, {
        let pieces = quadratics::<M>(&curve.control_points, &curve.width)?;
        let problem = bang_bang_quadratic::Problem {
            pieces: &pieces,
            runs: &runs,
            feed: arrays.feed.as_slice()?,
            junction_speed: arrays.junction_speed.as_slice()?,
            max_velocity: row(&arrays.max_velocity, 1.0)?,
            max_acceleration: row(&arrays.max_acceleration, 1.0)?,
            chord_tolerance: arrays.chord_tolerance,
            period: arrays.period,
            start_speed: arrays.start_speed,
            end_speed: arrays.end_speed,
            watch: Watch::default(),
        };
        let plan = |watch: Watch| bang_bang_quadratic::Problem { watch, ..problem }.fastest();
        let profile = run(py, progress, plan)?.map_err(|fault| to_exception(&fault))?;
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
        PyArray1::from_vec(py, profile.slowed),
    )
}

pub fn to_exception(fault: &Fault) -> PyErr {
    let text = fault.to_string();
    let (kind, piece, reachable) = match *fault {
        Fault::Start { piece, reachable } => ("start", Some(piece), Some(reachable)),
        Fault::End { piece, reachable } => ("end", Some(piece), Some(reachable)),
        Fault::Input { piece, .. } => ("input", piece, None),
        Fault::Stuck { piece, .. } => ("stuck", Some(piece), None),
    };
    PlanError::new_err((kind, piece, reachable, text))
}

/// The greatest speed along each of these parts of pieces that keeps the feed everywhere on it (n,).
#[pyfunction]
fn feed_between<'py>(
    py: Python<'py>,
    problem: ProblemArrays<'py>,
    piece: PyReadonlyArray1<'py, i64>,
    u0: PyReadonlyArray1<'py, f64>,
    u1: PyReadonlyArray1<'py, f64>,
) -> PyResult<Bound<'py, PyArray1<f64>>> {
    let (piece, u0, u1) = (indices(&piece), u0.as_slice()?, u1.as_slice()?);
    if [u0.len(), u1.len()] != [piece.len(); 2] {
        return Err(PyValueError::new_err("the arrays of the parts differ in length"));
    }
    with_padded_axes!(problem.curve.axes(), M, {
        let rows = ProblemRows::<M>::new(&problem)?;
        let problem = rows.problem()?;
        let speeds = run(py, None, |watch| {
            let part = |i: usize| {
                watch.check_at(i);
                problem.feed_between(piece[i], [u0[i], u1[i]])
            };
            (0..piece.len()).map(part).collect()
        })?;
        Ok(PyArray1::from_vec(py, speeds))
    })
}

/// The greatest speeds at the ends of segments, lowered to those that the segments between lead to; `up` and `down`
/// (n, 3) are gain and holds of speeding up and of slowing down.
#[pyfunction]
fn look_ahead<'py>(
    py: Python<'py>,
    speed: PyReadonlyArray1<'py, f64>,
    up: PyReadonlyArray2<'py, f64>,
    down: PyReadonlyArray2<'py, f64>,
) -> PyResult<Bound<'py, PyArray1<f64>>> {
    let mut speed = speed.as_slice()?.to_vec();
    let change = |[gain, start, end]: [f64; 3]| Change { gain, hold: [start, end] };
    let changes = |of: &PyReadonlyArray2<'py, f64>| -> PyResult<Vec<Change>> {
        Ok(rows::<3>(of)?.into_iter().map(change).collect())
    };
    let (up, down) = (changes(&up)?, changes(&down)?);
    if speed.len() != up.len() + 1 || down.len() != up.len() {
        return Err(PyValueError::new_err("the arrays of the segments differ in length"));
    }
    py.detach(|| Segments { up: &up, down: &down }.lower(&mut speed));
    Ok(PyArray1::from_vec(py, speed))
}

/// Adds the function and its exception to the module.
pub fn register(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add("PlanError", module.py().get_type::<PlanError>())?;
    module.add_function(wrap_pyfunction!(plan_curves, module)?)?;
    module.add_function(wrap_pyfunction!(feed_between, module)?)?;
    module.add_function(wrap_pyfunction!(look_ahead, module)?)?;
    module.add_function(wrap_pyfunction!(plan_bang_bang, module)?)
}
