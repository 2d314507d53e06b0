//! The audit of joints for Python: takes the problem with the recorded formulas of its kinematics, returns findings.

use std::collections::HashMap;

use numpy::PyUntypedArrayMethods;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

use super::arrays::{require, Column};
use super::audit::{findings, phases, Findings, LimitArrays, ProblemArrays};
use super::axes::with_axes_of_audit;
use super::kinematics::{operation_rows, ExpressionArrays};
use super::native::Of;
use super::profile::Profile;
use super::work::run;
use feedplan_audit::joints::formula::Formula;
use feedplan_audit::joints::path::{JointPath, Words};
use feedplan_audit::kernels::PlanKernels;

/// `feedplan.machine.axis_words.AxisWords`.
#[derive(FromPyObject)]
struct WordArrays<'py> {
    kinematics: KinematicsArrays<'py>,
    column: Vec<i64>,
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
            && column.iter().flatten().all(|&column| column < axes)
            && outputs.len() == joints
            && recorded.turning.len() == joints;
        require(good, "the arrays of the kinematics differ in length")?;
        let formula = formula
            .ok_or_else(|| PyValueError::new_err("the operations of the kinematics are not in order"))?;
        let (turning, directed) = (recorded.turning.clone(), self.coordinate_mode == VECTOR);
        Ok(Words { formula, turning, column, directed })
    }
}

/// `feedplan.constraints.problem.Problem`: the fields that only this audit takes.
#[derive(FromPyObject)]
struct JointArrays<'py> {
    words: Vec<Bound<'py, PyAny>>,
    feed: Column<'py>,
    way_scale: Option<Column<'py>>,
    path: AxesOfPath,
}

#[derive(FromPyObject)]
struct AxesOfPath {
    axes: Vec<String>,
}

/// The meaning of the axis words of a problem, kept from call to call.
pub struct JointWords {
    words: Vec<Words>,
    words_of: Vec<usize>,
    xyz: Vec<bool>,
    ijk: Vec<bool>,
    way_scale: Vec<f64>,
}

impl JointWords {
    pub fn new(problem: &Bound<'_, PyAny>, joints: usize) -> PyResult<Self> {
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
        require(good, "the arrays of the problem differ in length")?;
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
        Ok(Self { words, words_of, xyz: of(["X", "Y", "Z"]), ijk: of(["I", "J", "K"]), way_scale })
    }

    /// Calls `work` with the path of `count` joints.
    pub fn with<T>(
        &self,
        problem: &Bound<'_, PyAny>,
        count: usize,
        work: impl FnOnce(&JointPath) -> PyResult<T>,
    ) -> PyResult<T> {
        let (arrays, own): (ProblemArrays, JointArrays) = (problem.extract()?, problem.extract()?);
        work(&JointPath {
            path: arrays.unlimited()?,
            joints: count,
            words: &self.words,
            words_of: &self.words_of,
            xyz: &self.xyz,
            ijk: &self.ijk,
            way_scale: &self.way_scale,
            feed: own.feed.as_slice()?,
        })
    }
}

/// Audits a profile whose limits belong to joints that are not the path's axes.
#[pyfunction]
#[pyo3(signature = (problem, limits, profile, progress=None))]
pub fn audit_joints(
    problem: Bound<'_, PyAny>,
    limits: LimitArrays,
    profile: Of<Profile>,
    progress: Option<Bound<'_, PyAny>>,
) -> PyResult<Findings> {
    let joints = limits.axes();
    let arrays: ProblemArrays = problem.extract()?;
    let (junction_speed, phases) = (arrays.junction_speed()?, phases(&profile, &arrays)?);
    with_axes_of_audit!(arrays.axes().max(joints), M, {
        let limits = limits.limits::<M>(joints)?;
        JointWords::new(&problem, joints)?.with(&problem, joints, |path| {
            run(problem.py(), progress.as_ref(), |watch| {
                let each = watch.each(phases.len());
                let seen = |count| each.advance(count);
                findings(&limits.joint_profile(path, junction_speed, &phases, &seen), joints)
            })
        })
    })
}
