//! The exact planner, its lower bound, and look-ahead over segments, for Python.

use numpy::PyArray1;
use pyo3::prelude::*;

use super::arrays::{indices, require, rows, Column, Table};
use super::axes::with_padded_axes;
use super::native::Of;
use super::problem::Problem;
use super::profile::Profile;
use super::work::run;
use feedplan_jerk::JerkLimited as _;
use feedplan_planner::trapezoid::{Change, Segments};
use feedplan_planner::Exact as _;

/// The fastest profile.
#[pyfunction]
#[pyo3(signature = (problem, progress=None))]
pub fn plan_bang_bang<'py>(
    py: Python<'py>,
    problem: Of<Problem>,
    progress: Option<Bound<'py, PyAny>>,
) -> PyResult<Profile> {
    with_padded_axes!(problem.axes(), M, {
        let profile = problem.solved::<M, _>(py, progress.as_ref(), |problem| problem.fastest())?;
        Ok(profile.into())
    })
}

/// A lower bound in s on the time of every profile of the problem; of `profile` only the division of the path into phases, with
/// their axes and durations, is used, as a hint.
#[pyfunction]
#[pyo3(signature = (problem, profile, progress=None))]
pub fn lower_bound(
    py: Python<'_>,
    problem: Of<Problem>,
    profile: Of<Profile>,
    progress: Option<Bound<'_, PyAny>>,
) -> PyResult<f64> {
    let hint = &profile.phases;
    with_padded_axes!(problem.axes(), M, {
        problem.solved::<M, _>(py, progress.as_ref(), |problem| problem.lower_bound(hint))
    })
}

/// The greatest speeds along the path of the axes, one per part of a piece (n,), at which the feed is kept everywhere on the
/// part.
#[pyfunction]
pub fn feed_between<'py>(
    py: Python<'py>,
    problem: Of<Problem>,
    piece: Column<'py, i64>,
    u0: Column<'py>,
    u1: Column<'py>,
) -> PyResult<Bound<'py, PyArray1<f64>>> {
    let (piece, u0, u1) = (indices(&piece), u0.as_slice()?, u1.as_slice()?);
    require([u0.len(), u1.len()] == [piece.len(); 2], "the arrays of the parts differ in length")?;
    with_padded_axes!(problem.axes(), M, {
        let problem = problem.rows::<M>()?.problem();
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

/// The greatest speeds at the ends of n segments, at most `speed` (n + 1,), that the segments allow. `up` and `down` (n, 3) are
/// the gain and the two holds of `Change` for speeding up and for slowing down.
#[pyfunction]
pub fn look_ahead<'py>(
    py: Python<'py>,
    speed: Column<'py>,
    up: Table<'py>,
    down: Table<'py>,
) -> PyResult<Bound<'py, PyArray1<f64>>> {
    let mut speed = speed.as_slice()?.to_vec();
    let change = |[gain, start, end]: [f64; 3]| Change { gain, hold: [start, end] };
    let changes =
        |of: &Table<'py>| -> PyResult<Vec<Change>> { Ok(rows::<3>(of)?.into_iter().map(change).collect()) };
    let (up, down) = (changes(&up)?, changes(&down)?);
    let good = speed.len() == up.len() + 1 && down.len() == up.len();
    require(good, "the arrays of the segments differ in length")?;
    py.detach(|| Segments { up: &up, down: &down }.lower(&mut speed));
    Ok(PyArray1::from_vec(py, speed))
}
