//! The lower bound for Python.

use pyo3::prelude::*;

use super::native::Of;
use super::plan::to_exception;
use super::problem::Problem;
use super::profile::Profile;
use super::with_padded_axes;
use super::work::run;
use feedplan_planner::problem;
use feedplan_planner::Exact as _;

/// A lower bound in s on the time of every profile of the problem; of `profile` only its division counts.
#[pyfunction]
#[pyo3(signature = (problem, profile, progress=None))]
fn lower_bound(
    py: Python<'_>,
    problem: Of<Problem>,
    profile: Of<Profile>,
    progress: Option<Bound<'_, PyAny>>,
) -> PyResult<f64> {
    let hint = &profile.phases;
    with_padded_axes!(problem.axes(), M, {
        let problem = problem.rows::<M>()?.problem();
        run(py, progress.as_ref(), |watch| problem::Problem { watch, ..problem }.lower_bound(hint))?
            .map_err(|fault| to_exception(&fault))
    })
}

/// Adds the function to the module.
pub fn register(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add_function(wrap_pyfunction!(lower_bound, module)?)
}
