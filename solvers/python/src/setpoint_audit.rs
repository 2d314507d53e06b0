//! The audit of setpoints for Python, chunk by chunk: setpoints of the path's axes or of joints, with a plan or without.

use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

use super::arrays::{require, Column, Table};
use super::audit::{findings, phases, programmed, Findings, LimitArrays, ProblemArrays};
use super::axes::with_axes_of_audit;
use super::joint_audit::JointWords;
use super::moves::Moves;
use super::native::Of;
use super::profile::Profile;
use super::work::run;
use feedplan_audit::joints::path::JointPath;
use feedplan_audit::kernels::SetpointKernels;
use feedplan_audit::profile_clock::ProfileClock;
use feedplan_audit::setpoints::{Chunk, Stream};
use feedplan_audit::tracking::Plan;
use feedplan_geometry::watch::Watch;

/// A stream with any number of axes.
trait AnyStream: Send + Sync {
    fn push(&mut self, plan: Option<&Plan>, chunk: &Chunk, watch: Watch);
    fn finish(self: Box<Self>, plan: Option<&Plan>) -> Findings;
}

impl<const M: usize> AnyStream for Stream<M>
where
    Stream<M>: SetpointKernels<M>,
{
    fn push(&mut self, plan: Option<&Plan>, chunk: &Chunk, watch: Watch) {
        // Each setpoint counts twice: its place is found, then checked.
        let each = watch.each(2 * chunk.t.len());
        self.take(plan, chunk, &|count| each.advance(count));
    }

    fn finish(self: Box<Self>, plan: Option<&Plan>) -> Findings {
        let axes = self.axes();
        findings(&self.verdict(plan), axes)
    }
}

/// The plan with which a stream of setpoints is compared, as Python objects.
struct Compared {
    problem: Py<PyAny>,
    feed: Py<PyAny>,
    profile: Option<Py<Profile>>,
    program: Option<Py<Moves>>,
    /// The greatest deviation of the path from the program that the audit of the plan has found, as a share of the tolerance.
    deviation: f64,
    /// The time at which each phase of the profile begins [s].
    starts: Vec<f64>,
    /// The meaning of the axis words, if the setpoints are those of joints that are not the path's axes.
    joints: Option<JointWords>,
    axes: usize,
}

impl Compared {
    /// Calls `work` with the plan, without Python's lock.
    fn with_plan<T: Send>(
        &self,
        py: Python<'_>,
        progress: Option<&Bound<'_, PyAny>>,
        work: impl FnOnce(&Plan, Watch) -> T + Send,
    ) -> PyResult<T> {
        let problem: ProblemArrays = self.problem.bind(py).extract()?;
        let feed: Table = self.feed.bind(py).extract()?;
        let path = problem.followed(&feed)?;
        let phases = self.profile.as_ref().map(|profile| phases(profile.get(), &problem)).transpose()?;
        let program =
            self.program.as_ref().map(|moves| programmed(moves.get(), problem.axes())).transpose()?;
        let profile = phases.map(|phases| ProfileClock { phases, starts: &self.starts, run_starts: &[] });
        let work = |joints: Option<&JointPath>| {
            let plan = Plan { path, profile, program, deviation: self.deviation, joints };
            run(py, progress, |watch| work(&plan, watch))
        };
        match &self.joints {
            Some(words) => words.with(self.problem.bind(py), self.axes, |joints| work(Some(joints))),
            None => work(None),
        }
    }
}

/// Audits setpoints chunk by chunk; with a problem, it also checks their places on its path.
#[pyclass]
pub struct SetpointAudit {
    axes: usize,
    stream: Option<Box<dyn AnyStream>>,
    compared: Option<Compared>,
}

#[pymethods]
impl SetpointAudit {
    #[new]
    #[pyo3(signature = (limits, resolution=0.0, problem=None, feed=None, profile=None, program=None, deviation=0.0))]
    fn new(
        limits: LimitArrays,
        resolution: f64,
        problem: Option<Bound<'_, PyAny>>,
        feed: Option<Bound<'_, PyAny>>,
        profile: Option<Of<Profile>>,
        program: Option<Of<Moves>>,
        deviation: f64,
    ) -> PyResult<Self> {
        let axes = limits.axes();
        let compared = problem
            .zip(feed)
            .map(|(problem, feed)| compare(axes, problem, feed, profile, (program, deviation)))
            .transpose()?
            .flatten();
        let of_path = compared.as_ref().map_or(0, |(_, axes)| *axes);
        let stream: Box<dyn AnyStream> = with_axes_of_audit!(
            axes.max(of_path),
            M,
            Ok(Box::new(Stream::new(limits.limits::<M>(axes)?, resolution)) as _)
        )?;
        let compared = compared.map(|(compared, _)| compared);
        Ok(Self { axes, stream: Some(stream), compared })
    }

    /// Audits the next setpoints.
    #[pyo3(signature = (t, position, velocity=None, acceleration=None, line=None, progress=None))]
    #[allow(clippy::too_many_arguments)]
    fn push(
        &mut self,
        py: Python<'_>,
        t: Column<'_>,
        position: Table<'_>,
        velocity: Option<Table<'_>>,
        acceleration: Option<Table<'_>>,
        line: Option<Column<'_, i32>>,
        progress: Option<Bound<'_, PyAny>>,
    ) -> PyResult<()> {
        let chunk = Chunk {
            axes: self.axes,
            t: t.as_slice()?,
            position: position.as_slice()?,
            velocity: velocity.as_ref().map(|array| array.as_slice()).transpose()?,
            acceleration: acceleration.as_ref().map(|array| array.as_slice()).transpose()?,
            line: line.as_ref().map(|array| array.as_slice()).transpose()?,
        };
        let rows = self.axes * chunk.t.len();
        let good = chunk.position.len() == rows
            && [chunk.velocity, chunk.acceleration].iter().flatten().all(|flat| flat.len() == rows)
            && chunk.line.is_none_or(|line| line.len() == chunk.t.len());
        require(good, "the arrays of the setpoints differ in length")?;
        // If the audit is interrupted, the stream is not stored again: the audit is finished.
        let mut stream = self.stream.take().ok_or_else(finished)?;
        let (pushed, progress) = (&mut stream, progress.as_ref());
        match &self.compared {
            Some(compared) => {
                compared.with_plan(py, progress, |plan, watch| pushed.push(Some(plan), &chunk, watch))?;
            }
            None => run(py, progress, |watch| pushed.push(None, &chunk, watch))?,
        }
        self.stream = Some(stream);
        Ok(())
    }

    /// The findings; no setpoints can be pushed afterwards.
    fn finish(&mut self, py: Python<'_>) -> PyResult<Findings> {
        let stream = self.stream.take().ok_or_else(finished)?;
        match &self.compared {
            Some(compared) => compared.with_plan(py, None, |plan, _| stream.finish(Some(plan))),
            None => Ok(stream.finish(None)),
        }
    }
}

/// The plan with which setpoints are compared, and its number of axes; None if the path has no pieces. A profile that does not
/// fit the path is left out.
fn compare(
    axes: usize,
    problem: Bound<'_, PyAny>,
    feed: Bound<'_, PyAny>,
    profile: Option<Of<Profile>>,
    (program, deviation): (Option<Of<Moves>>, f64),
) -> PyResult<Option<(Compared, usize)>> {
    let arrays: ProblemArrays = problem.extract()?;
    let feeds: Table = feed.extract()?;
    let path = arrays.followed(&feeds)?;
    let joints = match problem.getattr("joints")?.is_none() {
        true => None,
        false => Some(JointWords::new(&problem, axes)?),
    };
    let good = joints.is_some() || arrays.axes() == axes;
    require(good, "the arrays of the limits and the path differ in length")?;
    if path.is_empty() {
        return Ok(None);
    }
    let mut starts = Vec::new();
    let mut usable = None;
    if let Some(profile) = profile {
        let phases = phases(&profile, &arrays)?;
        if phases.fits(&path, axes) {
            starts = phases.starts(&path);
            usable = Some(profile.native().clone_ref(problem.py()));
        }
    }
    let (program, of_path) = (program.map(Of::into_native), path.axes);
    let (problem, feed) = (problem.unbind(), feed.unbind());
    Ok(Some((Compared { problem, feed, profile: usable, program, deviation, starts, joints, axes }, of_path)))
}

fn finished() -> PyErr {
    PyValueError::new_err("this audit is finished")
}
