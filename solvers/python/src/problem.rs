//! `Problem`: a path with its limits, made once for all kernels.

use std::sync::Arc;

use pyo3::prelude::*;

use super::arrays::{indices, row, rows_with, Column, Table};
use super::axes::with_padded_axes;
use super::curve::Curve;
use super::native::{InAxes, Of};
use super::work::run;
use feedplan_geometry::spline::CompositeCurve;
use feedplan_geometry::watch::Watch;
use feedplan_planner::problem::{self, Both, Fault, SpeedSquare, Tip, TIP_AXES};
use feedplan_setpoints::sampling::PathData;

pyo3::create_exception!(
    _solvers,
    PlanError,
    pyo3::exceptions::PyException,
    "No profile: (kind, piece or None, reachable speed or None, sentence), kind start, end, input or stuck."
);

/// `feedplan.curves.speed_polynomial.SpeedPolynomial`.
#[derive(FromPyObject)]
struct SpeedArrays<'py> {
    coefficients: Column<'py>,
    offsets: Column<'py, i64>,
}

/// `feedplan.geometry.path.Path`.
#[derive(FromPyObject)]
struct PathArrays<'py> {
    runs: Column<'py, i64>,
    line: Column<'py, i32>,
    start_dwell: f64,
    dwell: Column<'py>,
}

/// `feedplan.constraints.problem.Problem`.
#[derive(FromPyObject)]
struct Arrays<'py> {
    path: PathArrays<'py>,
    curve: Of<Curve>,
    tip_speed: Option<SpeedArrays<'py>>,
    way_speed: Option<SpeedArrays<'py>>,
    tip_curve: Option<Of<Curve>>,
    feed_share: Option<Table<'py>>,
    feed: Column<'py>,
    junction_speed: Column<'py>,
    max_velocity: Column<'py>,
    max_acceleration: Column<'py>,
    min_velocity: Column<'py>,
    min_acceleration: Column<'py>,
    chord_tolerance: f64,
    period: f64,
    start_speed: f64,
    end_speed: f64,
}

/// A path with its limits.
#[pyclass(frozen, module = "feedplan._solvers")]
pub struct Problem {
    /// `Rows`.
    rows: InAxes,
}

/// The path and its limits in M axes; those beyond its own are at rest.
pub struct Rows<const M: usize> {
    pub path: Arc<PathData<M>>,
    tip: Option<Arc<CompositeCurve<TIP_AXES>>>,
    feed: Vec<f64>,
    junction_speed: Vec<f64>,
    max_velocity: Both<M>,
    max_acceleration: Both<M>,
    chord_tolerance: f64,
    period: f64,
    start_speed: f64,
    end_speed: f64,
}

/// Limits of the axes for positive and for negative values, both as absolute values; 1 for axes at rest.
fn both<const M: usize>(most: &Column, least: &Column) -> PyResult<Both<M>> {
    Ok([row(most, 1.0)?, row::<M>(least, -1.0)?.map(|value| -value)])
}

fn speed(arrays: &Option<SpeedArrays>) -> PyResult<Option<(Vec<f64>, Vec<usize>)>> {
    let speed = arrays.as_ref();
    speed.map(|speed| Ok((speed.coefficients.as_slice()?.to_vec(), indices(&speed.offsets)))).transpose()
}

fn square(speed: &Option<(Vec<f64>, Vec<usize>)>) -> Option<SpeedSquare<'_>> {
    speed.as_ref().map(|(coefficients, offset)| SpeedSquare { coefficients, offset })
}

impl<const M: usize> Rows<M> {
    fn new(arrays: &Arrays) -> PyResult<Self> {
        let path = &arrays.path;
        Ok(Self {
            path: Arc::new(PathData {
                curve: arrays.curve.padded()?.clone(),
                axes: arrays.curve.axes(),
                tip_speed: speed(&arrays.tip_speed)?,
                way_speed: speed(&arrays.way_speed)?,
                feed_share: match &arrays.feed_share {
                    Some(share) => rows_with(share, 1.0)?,
                    None => vec![],
                },
                lines: path.line.as_slice()?.to_vec(),
                runs: indices(&path.runs),
                start_dwell: path.start_dwell,
                dwell: path.dwell.as_slice()?.to_vec(),
            }),
            tip: arrays.tip_curve.as_ref().map(|tip| tip.padded().cloned()).transpose()?,
            feed: arrays.feed.as_slice()?.to_vec(),
            junction_speed: arrays.junction_speed.as_slice()?.to_vec(),
            max_velocity: both(&arrays.max_velocity, &arrays.min_velocity)?,
            max_acceleration: both(&arrays.max_acceleration, &arrays.min_acceleration)?,
            chord_tolerance: arrays.chord_tolerance,
            period: arrays.period,
            start_speed: arrays.start_speed,
            end_speed: arrays.end_speed,
        })
    }

    /// The problem for planners.
    pub fn problem(&self) -> problem::Problem<'_, M> {
        let (path, curve) = (&*self.path, &*self.path.curve);
        problem::Problem {
            control: &curve.control,
            weight: &curve.weights,
            offset: &curve.offsets,
            width: &curve.width,
            tip: self.tip.as_deref().zip(square(&path.tip_speed)).map(|(tip, speed)| Tip {
                speed,
                control: &tip.control,
                weight: &tip.weights,
                offset: &tip.offsets,
            }),
            way: square(&path.way_speed),
            feed_share: &path.feed_share,
            runs: &path.runs,
            feed: &self.feed,
            junction_speed: &self.junction_speed,
            max_velocity: self.max_velocity,
            max_acceleration: self.max_acceleration,
            chord_tolerance: self.chord_tolerance,
            period: self.period,
            start_speed: self.start_speed,
            end_speed: self.end_speed,
            watch: Watch::default(),
        }
    }
}

fn exception_of(fault: &Fault) -> PyErr {
    let text = fault.to_string();
    let (kind, piece, reachable) = match *fault {
        Fault::Start { piece, reachable } => ("start", Some(piece), Some(reachable)),
        Fault::End { piece, reachable } => ("end", Some(piece), Some(reachable)),
        Fault::Input { piece, .. } => ("input", piece, None),
        Fault::Stuck { piece, .. } => ("stuck", Some(piece), None),
    };
    PlanError::new_err((kind, piece, reachable, text))
}

impl Problem {
    pub fn axes(&self) -> usize {
        self.rows.axes
    }

    /// The rows in M axes, where M is the number that `with_padded_axes` gives.
    pub fn rows<const M: usize>(&self) -> PyResult<&Rows<M>> {
        self.rows.get()
    }

    /// The result of `kernel` for the problem in M axes; its fault is raised as PlanError.
    pub fn solved<const M: usize, T: Send>(
        &self,
        py: Python<'_>,
        progress: Option<&Bound<'_, PyAny>>,
        kernel: impl FnOnce(problem::Problem<'_, M>) -> Result<T, Fault> + Send,
    ) -> PyResult<T> {
        let problem = self.rows()?.problem();
        let found = run(py, progress, |watch| kernel(problem::Problem { watch, ..problem }))?;
        found.map_err(|fault| exception_of(&fault))
    }
}

#[pymethods]
impl Problem {
    /// From a `feedplan.constraints.problem.Problem`, or a part of one.
    #[new]
    fn new(problem: Arrays<'_>) -> PyResult<Self> {
        let axes = problem.curve.axes();
        with_padded_axes!(axes, M, Ok(Self { rows: InAxes::new(axes, Rows::<M>::new(&problem)?) }))
    }
}
