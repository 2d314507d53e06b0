//! The package's own problem as the kernels take it.

use numpy::{PyReadonlyArray1, PyReadonlyArray2};
use pyo3::prelude::*;

use super::arrays::{indices, row, rows, rows_with, CurveArrays};
use feedplan_geometry::watch::Watch;
use feedplan_planner::problem::{Both, Problem, SpeedSquare, Tip, TIP_AXES};

/// `feedplan.constraints.problem.TipSpeed`.
#[derive(FromPyObject)]
pub struct SpeedSquareArrays<'py> {
    pub coefficients: PyReadonlyArray1<'py, f64>,
    pub offsets: PyReadonlyArray1<'py, i64>,
}

/// `feedplan.geometry.path.Path`.
#[derive(FromPyObject)]
pub struct PathArrays<'py> {
    pub runs: PyReadonlyArray1<'py, i64>,
}

/// `feedplan.constraints.problem.Problem`.
#[derive(FromPyObject)]
pub struct ProblemArrays<'py> {
    pub path: PathArrays<'py>,
    pub curve: CurveArrays<'py>,
    pub tip_speed: Option<SpeedSquareArrays<'py>>,
    pub way_speed: Option<SpeedSquareArrays<'py>>,
    pub tip_curve: Option<CurveArrays<'py>>,
    pub feed_share: Option<PyReadonlyArray2<'py, f64>>,
    pub feed: PyReadonlyArray1<'py, f64>,
    pub junction_speed: PyReadonlyArray1<'py, f64>,
    pub max_velocity: PyReadonlyArray1<'py, f64>,
    pub max_acceleration: PyReadonlyArray1<'py, f64>,
    pub min_velocity: PyReadonlyArray1<'py, f64>,
    pub min_acceleration: PyReadonlyArray1<'py, f64>,
    pub chord_tolerance: f64,
    pub period: f64,
    pub start_speed: f64,
    pub end_speed: f64,
}

/// Limits of the axes as sizes, those at rest 1.
fn both<const M: usize>(most: &PyReadonlyArray1<f64>, least: &PyReadonlyArray1<f64>) -> PyResult<Both<M>> {
    Ok([row(most, 1.0)?, row::<M>(least, -1.0)?.map(|value| -value)])
}

/// Its rows in M axes, those beyond its own at rest.
pub struct ProblemRows<'a, 'py, const M: usize> {
    arrays: &'a ProblemArrays<'py>,
    control: Vec<[f64; M]>,
    offset: Vec<usize>,
    runs: Vec<usize>,
    tip: Option<TipRows>,
    way_offset: Vec<usize>,
    feed_share: Vec<[f64; M]>,
}

/// Control points of the tool's path, their offsets, and those of its speed.
struct TipRows {
    control: Vec<[f64; TIP_AXES]>,
    offset: Vec<usize>,
    speed_offset: Vec<usize>,
}

impl SpeedSquareArrays<'_> {
    fn square<'a>(&'a self, offset: &'a [usize]) -> PyResult<SpeedSquare<'a>> {
        Ok(SpeedSquare { coefficients: self.coefficients.as_slice()?, offset })
    }
}

impl<'a, 'py, const M: usize> ProblemRows<'a, 'py, M> {
    pub fn new(arrays: &'a ProblemArrays<'py>) -> PyResult<Self> {
        let tip = match (&arrays.tip_speed, &arrays.tip_curve) {
            (Some(speed), Some(tip)) => Some(TipRows {
                control: rows::<TIP_AXES>(&tip.control_points)?,
                offset: indices(&tip.offsets),
                speed_offset: indices(&speed.offsets),
            }),
            _ => None,
        };
        Ok(Self {
            arrays,
            control: rows::<M>(&arrays.curve.control_points)?,
            offset: indices(&arrays.curve.offsets),
            runs: indices(&arrays.path.runs),
            tip,
            way_offset: arrays.way_speed.as_ref().map_or(vec![], |way| indices(&way.offsets)),
            feed_share: match &arrays.feed_share {
                Some(share) => rows_with::<M>(share, 1.0)?,
                None => vec![],
            },
        })
    }

    pub fn problem(&self) -> PyResult<Problem<'_, M>> {
        let arrays = self.arrays;
        let tip = match (&self.tip, &arrays.tip_speed, &arrays.tip_curve) {
            (Some(rows), Some(speed), Some(tip)) => Some(Tip {
                speed: speed.square(&rows.speed_offset)?,
                control: &rows.control,
                weight: tip.weights()?,
                offset: &rows.offset,
            }),
            _ => None,
        };
        Ok(Problem {
            control: &self.control,
            weight: arrays.curve.weights()?,
            offset: &self.offset,
            width: arrays.curve.width.as_slice()?,
            tip,
            way: arrays.way_speed.as_ref().map(|way| way.square(&self.way_offset)).transpose()?,
            feed_share: &self.feed_share,
            runs: &self.runs,
            feed: arrays.feed.as_slice()?,
            junction_speed: arrays.junction_speed.as_slice()?,
            max_velocity: both(&arrays.max_velocity, &arrays.min_velocity)?,
            max_acceleration: both(&arrays.max_acceleration, &arrays.min_acceleration)?,
            chord_tolerance: arrays.chord_tolerance,
            period: arrays.period,
            start_speed: arrays.start_speed,
            end_speed: arrays.end_speed,
            watch: Watch::default(),
        })
    }
}
