//! Profiles within jerk limits for Python: from the jerk-limited planner, from the two-pass profiler of segments, and from
//! sections that Python computes for such segments.

use std::time::{Duration, Instant};

use numpy::{PyArray1, PyArray2};
use pyo3::prelude::*;
use pyo3::types::PyTuple;

use super::arrays::{indices, row, rows, to_array2, Column, Table};
use super::axes::with_padded_axes;
use super::memory;
use super::native::Of;
use super::problem::Problem;
use super::profile::Profile;
use feedplan_jerk::jerk_limited::Effort;
use feedplan_jerk::s_curve::on_path::Cutting;
use feedplan_jerk::s_curve::{Section, SectionKind, Segment};
use feedplan_jerk::JerkLimited as _;

/// The instant at which a planner must stop; None without a time limit.
fn deadline(time_limit: Option<f64>) -> Option<Instant> {
    let limit = Duration::try_from_secs_f64(time_limit?).ok()?;
    Instant::now().checked_add(limit)
}

/// The fastest profile within `jerk` [mm/s³] of every axis. Runs that are not planned when the time limit is reached have no
/// phases. Returns the profile; whether the time limit stopped the planner; for each planned part the estimated difference in s
/// between its time and the least time; and a lower bound in s of the time of each run, NaN without proof.
#[pyfunction]
#[pyo3(signature = (problem, jerk, resolution, tolerance, proves, time_limit=None, progress=None))]
#[allow(clippy::too_many_arguments)]
pub fn plan_jerk_limited<'py>(
    py: Python<'py>,
    problem: Of<Problem>,
    jerk: Column<'py>,
    resolution: f64,
    tolerance: f64,
    proves: bool,
    time_limit: Option<f64>,
    progress: Option<Bound<'py, PyAny>>,
) -> PyResult<Bound<'py, PyTuple>> {
    let effort =
        Effort { resolution, tolerance, proves, deadline: deadline(time_limit), ..Effort::default() };
    with_padded_axes!(problem.axes(), M, {
        let jerk = row::<M>(&jerk, 1.0)?;
        let arcs = problem.solved(py, progress.as_ref(), |problem| problem.jerk_limited(&jerk, &effort))?;
        let [excess, bounds] = [&arcs.excess, &arcs.lower_bound].map(|part| PyArray1::from_slice(py, part));
        let stopped = arcs.stopped;
        py.detach(memory::give_back);
        (Profile::from(arcs), stopped, excess, bounds).into_pyobject(py)
    })
}

/// The two-pass profile within `jerk` [mm/s³] of every axis. Each subrun is cut into segments by that one of `cuttings` (pairs
/// of the fields `lengths` and `alike` of `s_curve::on_path::Cutting`) that gives the least time. The time limit applies to the
/// subruns that are left to the jerk-limited planner, as in `plan_jerk_limited`.
#[pyfunction]
#[pyo3(signature = (problem, jerk, cuttings, look_ahead, time_limit=None, progress=None))]
pub fn plan_s_curve<'py>(
    py: Python<'py>,
    problem: Of<Problem>,
    jerk: Column<'py>,
    cuttings: Vec<(f64, f64)>,
    look_ahead: usize,
    time_limit: Option<f64>,
    progress: Option<Bound<'py, PyAny>>,
) -> PyResult<Profile> {
    let cuttings = to_cuttings(&cuttings);
    let effort = Effort { deadline: deadline(time_limit), ..Effort::default() };
    with_padded_axes!(problem.axes(), M, {
        let jerk = row::<M>(&jerk, 1.0)?;
        let arcs = problem.solved(py, progress.as_ref(), |problem| {
            problem.s_curve(&jerk, &cuttings, look_ahead, &effort)
        })?;
        Ok(arcs.into())
    })
}

/// The segments of each subrun that `plan_s_curve` plans on, (n, 5) rows of length, speed, acceleration, jerk and the speed limit
/// at the junction with the next. A subrun without segments is left to the jerk-limited planner.
#[pyfunction]
pub fn path_segments<'py>(
    py: Python<'py>,
    problem: Of<Problem>,
    jerk: Column<'py>,
    cuttings: Vec<(f64, f64)>,
    look_ahead: usize,
) -> PyResult<Vec<Bound<'py, PyArray2<f64>>>> {
    let cuttings = to_cuttings(&cuttings);
    with_padded_axes!(problem.axes(), M, {
        let jerk = row::<M>(&jerk, 1.0)?;
        let subruns = problem.solved(py, None, |problem| problem.segments(&jerk, &cuttings, look_ahead))?;
        let row =
            |own: &Segment| [own.length, own.speed(), own.limits.acceleration, own.limits.jerk, own.junction];
        Ok(subruns.iter().map(|own| to_array2(py, own.iter().map(row).collect(), 5)).collect())
    })
}

/// The profile of sections of constant jerk, (n, 5) rows of duration, and at the start of the section the position along the
/// subrun, speed, acceleration and jerk. Subrun i has the sections from `offsets[i]` to `offsets[i + 1]`; a subrun without
/// sections is planned by the jerk-limited planner.
#[pyfunction]
pub fn profile_of_sections<'py>(
    py: Python<'py>,
    problem: Of<Problem>,
    jerk: Column<'py>,
    offsets: Column<'py, i64>,
    sections: Table<'py>,
) -> PyResult<Profile> {
    let sections: Vec<Section> = rows::<5>(&sections)?
        .into_iter()
        .map(|[duration, position, speed, acceleration, jerk]| Section {
            kind: SectionKind::ConstantSpeed,
            time: 0.0,
            duration,
            position,
            speed,
            acceleration,
            jerk,
        })
        .collect();
    let offsets = indices(&offsets);
    with_padded_axes!(problem.axes(), M, {
        let jerk = row::<M>(&jerk, 1.0)?;
        let arcs = problem.solved(py, None, |problem| problem.of_sections(&jerk, &offsets, &sections))?;
        Ok(arcs.into())
    })
}

fn to_cuttings(pairs: &[(f64, f64)]) -> Vec<Cutting> {
    pairs.iter().map(|&(lengths, alike)| Cutting { lengths, alike }).collect()
}
