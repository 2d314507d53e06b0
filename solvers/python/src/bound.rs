//! The lower bound for Python.

use pyo3::prelude::*;

use super::axes::with_padded_axes;
use super::native::Of;
use super::problem::Problem;
use super::profile::Profile;
use feedplan_planner::Exact as _;

/// A lower bound in s on the time of every profile of the problem; of `profile` only its division counts.
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
