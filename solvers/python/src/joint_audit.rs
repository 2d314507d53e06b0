//! The audit of joints for Python: the problem with the recorded formulas of its kinematics in, findings out.

use std::collections::HashMap;

use numpy::{PyReadonlyArray1, PyReadonlyArray2, PyUntypedArrayMethods};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

use super::audit::{
    findings, finished, phases, require, setpoint_chunk, Findings, LimitArrays, ProblemArrays,
};
use super::kinematics::{operation_rows, ExpressionArrays};
use super::native::Of;
use super::profile::Profile;
use super::with_padded_axes;
use super::work::run;
use feedplan_audit::joints::formula::Formula;
use feedplan_audit::joints::path::{JointPath, Words};
use feedplan_audit::joints::plan::JointAudit;
use feedplan_audit::joints::setpoints::JointSetpoints;
use feedplan_audit::kernels::JointKernels;
use feedplan_audit::setpoints::Chunk;
use feedplan_geometry::watch::Watch;

/// `feedplan.machine.words.AxisWords`.
#[derive(FromPyObject)]
struct WordArrays<'py> {
    kinematics: KinematicsArrays<'py>,
    column: Vec<i64>,
    held: Vec<f64>,
    coordinate_mode: i64,
}

/// `feedplan.machine.kinematics.Kinematics`.
#[derive(FromPyObject)]
struct KinematicsArrays<'py> {
    recorded: ExpressionArrays<'py>,
}

/// `feedplan.machine.coordinate_mode.CoordinateMode.VECTOR`.
const VECTOR: i64 = 2;

impl WordArrays<'_> {
    fn words(&self, axes: usize, joints: usize) -> PyResult<Words> {
        let recorded = &self.kinematics.recorded;
        let rows = operation_rows(&recorded.operations)?;
        let (constants, outputs) = (recorded.constants.as_slice()?, recorded.outputs.as_slice()?);
        let formula = Formula::new(recorded.inputs, rows, constants, outputs);
        let column: Vec<Option<usize>> =
            self.column.iter().map(|&column| usize::try_from(column).ok()).collect();
        let good = column.len() == recorded.inputs
            && self.held.len() == recorded.inputs
            && column.iter().flatten().all(|&column| column < axes)
            && outputs.len() == joints
            && recorded.turning.len() == joints;
        require(good, "kinematics")?;
        let formula = formula
            .ok_or_else(|| PyValueError::new_err("the operations of the kinematics are not in order"))?;
        Ok(Words {
            formula,
            turning: recorded.turning.clone(),
            column,
            held: self.held.clone(),
            directed: self.coordinate_mode == VECTOR,
        })
    }
}

/// `feedplan.constraints.problem.Problem` beside what other audits take of it.
#[derive(FromPyObject)]
struct JointArrays<'py> {
    words: Vec<Bound<'py, PyAny>>,
    feed: PyReadonlyArray1<'py, f64>,
    way_scale: Option<PyReadonlyArray1<'py, f64>>,
    path: AxesOfPath,
}

#[derive(FromPyObject)]
struct AxesOfPath {
    axes: Vec<String>,
}

/// What of a problem is kept from call to call.
struct Kept {
    words: Vec<Words>,
    words_of: Vec<usize>,
    xyz: Vec<bool>,
    ijk: Vec<bool>,
    way_scale: Vec<f64>,
    starts: Vec<f64>,
}

impl Kept {
    fn new(problem: &Bound<'_, PyAny>, profile: &Profile, joints: usize) -> PyResult<Self> {
        let own: JointArrays = problem.extract()?;
        let arrays: ProblemArrays = problem.extract()?;
        let axes = &own.path.axes;
        let path = arrays.unlimited()?;
        let way_scale = match &own.way_scale {
            Some(scale) => scale.as_slice()?.to_vec(),
            None => vec![1.0; axes.len()],
        };
        let good = own.words.len() + 1 == path.runs.len()
            && own.feed.len() == path.len()
            && axes.len() == path.axes
            && way_scale.len() == axes.len();
        require(good, "problem")?;
        let (mut words, mut words_of) = (Vec::new(), Vec::new());
        let mut known = HashMap::new();
        for object in &own.words {
            let number = *known.entry(object.as_ptr()).or_insert(words.len());
            if number == words.len() {
                words.push(object.extract::<WordArrays>()?.words(axes.len(), joints)?);
            }
            words_of.push(number);
        }
        let of = |letters: [&str; 3]| axes.iter().map(|axis| letters.contains(&axis.as_str())).collect();
        Ok(Self {
            words,
            words_of,
            xyz: of(["X", "Y", "Z"]),
            ijk: of(["I", "J", "K"]),
            way_scale,
            starts: phases(profile, &arrays)?.starts(&path),
        })
    }

    /// Calls `work` with what the audit knows, free of Python's lock.
    fn with<const M: usize, T: Send>(
        &self,
        problem: &Bound<'_, PyAny>,
        profile: &Profile,
        limits: &LimitArrays,
        progress: Option<&Bound<'_, PyAny>>,
        work: impl FnOnce(&JointAudit<M>, Watch) -> T + Send,
    ) -> PyResult<T> {
        let arrays: ProblemArrays = problem.extract()?;
        let own: JointArrays = problem.extract()?;
        let joints = limits.axes();
        let audit = JointAudit {
            path: JointPath {
                path: arrays.unlimited()?,
                joints,
                words: &self.words,
                words_of: &self.words_of,
                xyz: &self.xyz,
                ijk: &self.ijk,
                way_scale: &self.way_scale,
                feed: own.feed.as_slice()?,
                junction_speed: arrays.junction_speed()?,
            },
            phases: phases(profile, &arrays)?,
            limits: limits.limits::<M>(joints)?,
            starts: &self.starts,
        };
        run(problem.py(), progress, |watch| work(&audit, watch))
    }
}

fn widest(problem: &Bound<'_, PyAny>, limits: &LimitArrays) -> PyResult<usize> {
    let arrays: ProblemArrays = problem.extract()?;
    Ok(arrays.axes().max(limits.axes()))
}

/// Audits a profile whose limits belong to joints that are not the path's axes.
#[pyfunction]
#[pyo3(signature = (problem, limits, profile, progress=None))]
fn audit_joints(
    problem: Bound<'_, PyAny>,
    limits: LimitArrays,
    profile: Of<Profile>,
    progress: Option<Bound<'_, PyAny>>,
) -> PyResult<Findings> {
    let joints = limits.axes();
    let kept = Kept::new(&problem, &profile, joints)?;
    with_padded_axes!(widest(&problem, &limits)?, M, {
        kept.with::<M, _>(&problem, &profile, &limits, progress.as_ref(), |audit, watch| {
            // Phases are measured once, and once more for their jerk.
            let times = if audit.limits.judges_jerk { 2 } else { 1 };
            let each = watch.each(times * audit.phases.len());
            findings(&audit.profile(&|count| each.advance(count)), joints)
        })
    })
}

/// A stream whatever its number of axes.
trait AnyStream: Send + Sync {
    fn push(
        &mut self,
        of: &Compared,
        py: Python<'_>,
        chunk: &Chunk,
        progress: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<()>;
    fn finish(self: Box<Self>, of: &Compared, py: Python<'_>) -> PyResult<Findings>;
}

impl<const M: usize> AnyStream for JointSetpoints<M>
where
    for<'a> JointAudit<'a, M>: JointKernels<M>,
{
    fn push(
        &mut self,
        of: &Compared,
        py: Python<'_>,
        chunk: &Chunk,
        progress: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<()> {
        of.kept.with::<M, _>(of.problem.bind(py), of.profile.get(), &of.limits, progress, |audit, _| {
            audit.take(self, chunk);
        })
    }

    fn finish(self: Box<Self>, of: &Compared, py: Python<'_>) -> PyResult<Findings> {
        of.kept.with::<M, _>(of.problem.bind(py), of.profile.get(), &of.limits, None, |audit, _| {
            findings(&audit.verdict(*self), audit.path.joints)
        })
    }
}

/// What setpoints are compared with, kept as Python holds it.
struct Compared {
    problem: Py<PyAny>,
    profile: Py<Profile>,
    limits: LimitArrays,
    kept: Kept,
}

/// Compares setpoints of joints with a profile along the tool's path, chunk by chunk.
#[pyclass]
struct JointSetpointAudit {
    stream: Option<Box<dyn AnyStream>>,
    compared: Compared,
}

#[pymethods]
impl JointSetpointAudit {
    #[new]
    fn new(problem: Bound<'_, PyAny>, limits: LimitArrays, profile: Of<Profile>) -> PyResult<Self> {
        let kept = Kept::new(&problem, &profile, limits.axes())?;
        let stream: Box<dyn AnyStream> = with_padded_axes!(widest(&problem, &limits)?, M, {
            kept.with::<M, _>(&problem, &profile, &limits, None, |audit, _| {
                Box::new(audit.begin()) as Box<dyn AnyStream>
            })
        })?;
        let profile = profile.native().clone_ref(problem.py());
        let compared = Compared { problem: problem.unbind(), profile, limits, kept };
        Ok(Self { stream: Some(stream), compared })
    }

    /// The next setpoints.
    #[pyo3(signature = (t, position, velocity=None, progress=None))]
    fn push(
        &mut self,
        py: Python<'_>,
        t: PyReadonlyArray1<'_, f64>,
        position: PyReadonlyArray2<'_, f64>,
        velocity: Option<PyReadonlyArray2<'_, f64>>,
        progress: Option<Bound<'_, PyAny>>,
    ) -> PyResult<()> {
        let chunk = setpoint_chunk(self.compared.limits.axes(), &t, &position, &velocity)?;
        // An audit that is interrupted is finished.
        let mut stream = self.stream.take().ok_or_else(finished)?;
        stream.push(&self.compared, py, &chunk, progress.as_ref())?;
        self.stream = Some(stream);
        Ok(())
    }

    /// What was found; nothing can be pushed afterwards.
    fn finish(&mut self, py: Python<'_>) -> PyResult<Findings> {
        self.stream.take().ok_or_else(finished)?.finish(&self.compared, py)
    }
}

pub fn register(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add_function(wrap_pyfunction!(audit_joints, module)?)?;
    module.add_class::<JointSetpointAudit>()
}
