//! The lower bound for Python.

use numpy::PyReadonlyArray1;
use pyo3::prelude::*;

use super::plan::to_exception;
use super::problem::{ProblemArrays, ProblemRows};
use super::with_padded_axes;
use super::work::run;
use feedplan_planner::bound::Hint;
use feedplan_planner::problem::Problem;
use feedplan_planner::Exact as _;

/// `feedplan.profile.SpeedProfile`.
#[derive(FromPyObject)]
struct ProfileArrays<'py> {
    piece: PyReadonlyArray1<'py, u32>,
    axis: PyReadonlyArray1<'py, u8>,
    u1: PyReadonlyArray1<'py, f64>,
    duration: PyReadonlyArray1<'py, f64>,
}

/// A lower bound in s on the time of every profile of the problem; of `profile` only its division counts.
#[pyfunction]
#[pyo3(signature = (problem, profile, progress=None))]
fn lower_bound(
    py: Python<'_>,
    problem: ProblemArrays<'_>,
    profile: ProfileArrays<'_>,
    progress: Option<Bound<'_, PyAny>>,
) -> PyResult<f64> {
    let hint = Hint {
        piece: profile.piece.as_slice()?,
        axis: profile.axis.as_slice()?,
        u1: profile.u1.as_slice()?,
        duration: profile.duration.as_slice()?,
    };
    with_padded_axes!(problem.curve.axes(), M, {
        let rows = ProblemRows::<M>::new(&problem)?;
        let problem = rows.problem()?;
        run(py, progress.as_ref(), |watch| Problem { watch, ..problem }.lower_bound(&hint))?
            .map_err(|fault| to_exception(&fault))
    })
}

/// Adds the function to the module.
pub fn register(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add_function(wrap_pyfunction!(lower_bound, module)?)
}
