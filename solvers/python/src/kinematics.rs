//! Joint motion for Python, from a recorded expression of the kinematics and pieces of a tip path.

use numpy::{PyArray1, PyArray2, PyArray3, PyArrayMethods, PyUntypedArrayMethods};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyTuple;

use super::arrays::{require, Column, Cube, Table};
use super::work::run;
use feedplan_geometry::interval::Interval;
use feedplan_kinematics::accuracy::{Accuracy, Motion, SpeedNodes, Square, Tolerance};
use feedplan_kinematics::expression::Expression;
use feedplan_kinematics::joint_interpolants::{interpolants, Nodes};
use feedplan_kinematics::path_derivatives::{self, Machine};
use feedplan_kinematics::series::MOST_ORDER;
use feedplan_kinematics::singularities::{self, Overrun};
use feedplan_kinematics::tip::{Tips, MOST_POINTS};

/// `feedplan.machine.expression.Expression`.
#[derive(FromPyObject)]
pub struct ExpressionArrays<'py> {
    pub inputs: usize,
    pub operations: Table<'py, i32>,
    pub constants: Column<'py>,
    pub outputs: Column<'py, i32>,
    pub turning: Vec<bool>,
}

/// The rows of a flat list of operations.
pub fn operation_rows<'a>(operations: &'a Table<'_, i32>) -> PyResult<&'a [[i32; 3]]> {
    Ok(operations.as_slice()?.as_chunks().0)
}

impl ExpressionArrays<'_> {
    fn expression(&self) -> PyResult<Expression> {
        let rows = operation_rows(&self.operations)?;
        Expression::new(self.inputs, rows, self.constants.as_slice()?, self.outputs.as_slice()?)
            .filter(|expression| expression.outputs() == self.turning.len() && self.inputs > 0)
            .ok_or_else(|| PyValueError::new_err("the operations of the kinematics are not in order"))
    }
}

/// `feedplan.machine.path_derivatives.TipPieces`.
#[derive(FromPyObject)]
pub struct TipArrays<'py> {
    control_points: Cube<'py>,
    width: Column<'py>,
    weights: Option<Table<'py>>,
}

impl TipArrays<'_> {
    fn tips(&self) -> PyResult<Tips<'_>> {
        self.tips_of(&self.control_points)
    }

    /// Pieces with the weights and widths of these ones and other control points.
    fn tips_of<'a>(&'a self, control_points: &'a Cube<'_>) -> PyResult<Tips<'a>> {
        let &[count, points, axes] = control_points.shape() else { unreachable!("three dimensions") };
        let tips = Tips {
            axes,
            points,
            control: control_points.as_slice()?,
            weights: self.weights.as_ref().map_or(Ok(&[][..]), |weights| weights.as_slice())?,
            width: self.width.as_slice()?,
        };
        let weighted = tips.weights.is_empty() || tips.weights.len() == count * points;
        let good = tips.len() == count && weighted && axes > 0 && (1..=MOST_POINTS).contains(&points);
        require(good, "the arrays of the tip's pieces do not belong together")?;
        Ok(tips)
    }
}

fn machine<'a>(
    expression: &'a Expression,
    arrays: &'a ExpressionArrays,
    tips: &Tips,
) -> PyResult<Machine<'a>> {
    if tips.axes != expression.inputs() {
        return Err(PyValueError::new_err(format!(
            "tips of {} coordinates: the kinematics takes {}",
            tips.axes,
            expression.inputs()
        )));
    }
    Ok(Machine { joints: expression, turning: &arrays.turning })
}

fn require_order(order: usize) -> PyResult<()> {
    if order > MOST_ORDER {
        return Err(PyValueError::new_err(format!("order {order}: at most {MOST_ORDER} is supported")));
    }
    Ok(())
}

fn require_length(good: bool) -> PyResult<()> {
    require(good, "the arrays differ in length")
}

fn cube<'py>(py: Python<'py>, flat: Vec<f64>, shape: [usize; 3]) -> PyResult<Bound<'py, PyArray3<f64>>> {
    PyArray1::from_vec(py, flat).reshape(shape)
}

fn table<'py>(py: Python<'py>, flat: Vec<f64>, columns: usize) -> PyResult<Bound<'py, PyArray2<f64>>> {
    let rows = flat.len() / columns.max(1);
    PyArray1::from_vec(py, flat).reshape([rows, columns])
}

fn parts_of<'a>(parts: &'a Option<Table<'_>>, count: usize) -> PyResult<Option<&'a [[f64; 2]]>> {
    let Some(parts) = parts else { return Ok(None) };
    let parts = parts.as_slice()?.as_chunks().0;
    require_length(parts.len() == count)?;
    Ok(Some(parts))
}

/// Joint positions (n, joints) for tips (n, axes).
#[pyfunction]
pub fn joint_positions<'py>(
    py: Python<'py>,
    expression: ExpressionArrays<'py>,
    tips: Table<'py>,
) -> PyResult<Bound<'py, PyArray2<f64>>> {
    let joints = expression.expression()?;
    require_length(tips.shape()[1] == joints.inputs())?;
    let tips = tips.as_slice()?;
    let found = run(py, None, |_| path_derivatives::positions(&joints, tips))?;
    table(py, found, joints.outputs())
}

/// q, q', …, q^(order) (n, order + 1, joints) at fractions (n,) of pieces (n,).
#[pyfunction]
pub fn joint_derivatives<'py>(
    py: Python<'py>,
    expression: ExpressionArrays<'py>,
    tips: TipArrays<'py>,
    fraction: Column<'py>,
    order: usize,
) -> PyResult<Bound<'py, PyArray3<f64>>> {
    let (joints, pieces, fraction) = (expression.expression()?, tips.tips()?, fraction.as_slice()?);
    let machine = machine(&joints, &expression, &pieces)?;
    require_order(order)?;
    require_length(fraction.len() == pieces.len())?;
    let found = run(py, None, |_| path_derivatives::derivatives(machine, pieces, fraction, order))?;
    cube(py, found, [fraction.len(), order + 1, joints.outputs()])
}

/// Least and greatest q^(k)/k! (n, order + 1, joints) over pieces, or parts (n, 2) of them.
#[pyfunction]
#[pyo3(signature = (expression, tips, order, parts=None))]
pub fn joint_enclosures<'py>(
    py: Python<'py>,
    expression: ExpressionArrays<'py>,
    tips: TipArrays<'py>,
    order: usize,
    parts: Option<Table<'py>>,
) -> PyResult<Bound<'py, PyTuple>> {
    let (joints, pieces) = (expression.expression()?, tips.tips()?);
    let machine = machine(&joints, &expression, &pieces)?;
    require_order(order)?;
    let parts = parts_of(&parts, pieces.len())?;
    let found = run(py, None, |_| path_derivatives::enclosures(machine, pieces, parts, order))?;
    let shape = [pieces.len(), order + 1, joints.outputs()];
    let [lo, hi] = ends(&found).map(|end| cube(py, end, shape));
    (lo?, hi?).into_pyobject(py)
}

/// The least values and the greatest values of intervals.
fn ends(of: &[Interval]) -> [Vec<f64>; 2] {
    [of.iter().map(|x| x.lo).collect(), of.iter().map(|x| x.hi).collect()]
}

fn numbers<'py>(py: Python<'py>, values: Vec<usize>) -> Bound<'py, PyArray1<i64>> {
    PyArray1::from_iter(py, values.into_iter().map(|value| value as i64))
}

/// The joints along pieces joined end to end. Parts: pieces (m,), fractions (m, 2), least and greatest positions
/// (m, joints). Singular places: pieces and fractions. Overruns: piece, fraction, joint, value, limit.
#[pyfunction]
#[pyo3(signature = (expression, tips, travel=None, start=None))]
pub fn joint_path<'py>(
    py: Python<'py>,
    expression: ExpressionArrays<'py>,
    tips: TipArrays<'py>,
    travel: Option<Table<'py>>,
    start: Option<Column<'py>>,
) -> PyResult<Bound<'py, PyTuple>> {
    let (joints, pieces) = (expression.expression()?, tips.tips()?);
    let machine = machine(&joints, &expression, &pieces)?;
    let travel = parts_of(&travel, joints.outputs())?;
    let start = start.as_ref().map(|start| start.as_slice()).transpose()?;
    require_length(start.is_none_or(|start| start.len() == joints.outputs()))?;
    let path = run(py, None, |_| singularities::joint_path(machine, pieces, travel, start))?;
    let [lo, hi] = ends(&path.range).map(|end| table(py, end, joints.outputs()));
    let overrun = |o: Overrun| (o.piece, o.fraction, o.joint, o.value, o.limit);
    let overruns: Vec<_> = path.overruns.into_iter().map(overrun).collect();
    let (pieces, parts) = (numbers(py, path.piece), table(py, path.part.into_flattened(), 2)?);
    (pieces, parts, lo?, hi?, path.singular, overruns).into_pyobject(py)
}

/// `feedplan.machine.joint_interpolants.SquareOfSpeed`.
#[derive(FromPyObject)]
pub struct SquareArrays<'py> {
    control_points: Cube<'py>,
    turning: bool,
    pieces: Column<'py, bool>,
}

/// `feedplan.machine.joint_interpolants.Accuracy`.
#[derive(FromPyObject)]
pub struct AccuracyArrays<'py> {
    acceleration: Column<'py>,
    least_velocity: Column<'py>,
    greatest_velocity: Column<'py>,
    feed: Column<'py>,
    linear: Cube<'py>,
    moves: Column<'py, bool>,
    squares: Vec<SquareArrays<'py>>,
    speed_nodes: Column<'py>,
    speed_between: Column<'py>,
    speed_interpolation: Table<'py>,
    speed_share: f64,
}

impl AccuracyArrays<'_> {
    fn accuracy<'a>(&'a self, tips: &'a TipArrays, joints: usize) -> PyResult<Accuracy<'a>> {
        let squares: PyResult<Vec<Square>> = self
            .squares
            .iter()
            .map(|square| {
                let motion = tips.tips_of(&square.control_points)?;
                require_length(motion.axes >= if square.turning { 3 } else { 1 })?;
                let (motion, pieces) = (Motion::new(motion), square.pieces.as_slice()?);
                Ok(Square { motion, turning: square.turning, pieces, greatest: None })
            })
            .collect();
        let accuracy = Accuracy {
            acceleration: self.acceleration.as_slice()?,
            velocity: [self.least_velocity.as_slice()?, self.greatest_velocity.as_slice()?],
            feed: self.feed.as_slice()?,
            linear: Motion::new(tips.tips_of(&self.linear)?),
            moves: self.moves.as_slice()?,
            squares: squares?,
            speed_nodes: SpeedNodes {
                at: self.speed_nodes.as_slice()?,
                between: self.speed_between.as_slice()?,
                interpolation: self.speed_interpolation.as_slice()?,
                share: self.speed_share,
            },
        };
        let count = tips.width.as_slice()?.len();
        let [least, greatest] = accuracy.velocity.map(<[f64]>::len);
        let nodes = accuracy.speed_nodes;
        let good = [accuracy.acceleration.len(), least, greatest] == [joints; 3]
            && [accuracy.feed.len(), accuracy.moves.len()] == [count; 2]
            && accuracy.squares.iter().all(|square| square.pieces.len() == count)
            && nodes.interpolation.len() == nodes.at.len() * nodes.between.len();
        require_length(good)?;
        Ok(accuracy)
    }
}

/// The allowed error of each joint, or the accuracy that the limits of the machine require.
#[derive(FromPyObject)]
pub enum ToleranceArrays<'py> {
    Given(Column<'py>),
    Limited(AccuracyArrays<'py>),
}

/// Polynomials that interpolate q' on parts of pieces. Parts: pieces (m,), fractions (m, 2), Bernstein coefficients
/// (m, nodes + 1, joints) of q', errors (m, joints) of q''.
#[pyfunction]
pub fn joint_interpolants<'py>(
    py: Python<'py>,
    expression: ExpressionArrays<'py>,
    tips: TipArrays<'py>,
    nodes: Column<'py>,
    to_bernstein: Table<'py>,
    tolerance: ToleranceArrays<'py>,
) -> PyResult<Bound<'py, PyTuple>> {
    let (joints, pieces) = (expression.expression()?, tips.tips()?);
    let machine = machine(&joints, &expression, &pieces)?;
    let nodes = Nodes { at: nodes.as_slice()?, to_bernstein: to_bernstein.as_slice()? };
    let (count, outputs) = (nodes.at.len(), joints.outputs());
    require_order(count + 2)?;
    require_length(count > 0 && nodes.to_bernstein.len() == count * count)?;
    let tolerance = match &tolerance {
        ToleranceArrays::Given(given) => {
            require_length(given.len() == outputs)?;
            Tolerance::Given(given.as_slice()?)
        }
        ToleranceArrays::Limited(accuracy) => {
            Tolerance::Limited(Box::new(accuracy.accuracy(&tips, outputs)?))
        }
    };
    let found = run(py, None, |_| interpolants(machine, pieces, nodes, &tolerance))?;
    let parts = found.piece.len();
    (
        numbers(py, found.piece),
        table(py, found.part.into_flattened(), 2)?,
        cube(py, found.slope, [parts, count + 1, outputs])?,
        table(py, found.curvature_error, outputs)?,
    )
        .into_pyobject(py)
}
