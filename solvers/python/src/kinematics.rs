//! Joint motion from a recorded expression and pieces of a tip path.

use numpy::{
    PyArray1, PyArray2, PyArray3, PyArrayMethods, PyReadonlyArray1, PyReadonlyArray2, PyReadonlyArray3,
    PyUntypedArrayMethods,
};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

use super::work::run;
use feedplan_kinematics::accuracy::{Accuracy, Motion, SpeedNodes, Square, Tolerance};
use feedplan_kinematics::expression::Expression;
use feedplan_kinematics::interval::Interval;
use feedplan_kinematics::joint_interpolants::{interpolants, Nodes};
use feedplan_kinematics::path_derivatives::{self, Machine};
use feedplan_kinematics::series::MOST_ORDER;
use feedplan_kinematics::singularities::{self, Overrun};
use feedplan_kinematics::tip::{Tips, MOST_POINTS};

/// `feedplan.machine.expression.Expression`.
#[derive(FromPyObject)]
pub struct ExpressionArrays<'py> {
    pub inputs: usize,
    pub operations: PyReadonlyArray2<'py, i32>,
    pub constants: PyReadonlyArray1<'py, f64>,
    pub outputs: PyReadonlyArray1<'py, i32>,
    pub turning: Vec<bool>,
}

/// The rows of a flat list of operations.
pub fn operation_rows<'a>(operations: &'a PyReadonlyArray2<'_, i32>) -> PyResult<&'a [[i32; 3]]> {
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
    control_points: PyReadonlyArray3<'py, f64>,
    width: PyReadonlyArray1<'py, f64>,
    weights: Option<PyReadonlyArray2<'py, f64>>,
}

impl TipArrays<'_> {
    fn tips(&self) -> PyResult<Tips<'_>> {
        self.tips_of(&self.control_points)
    }

    /// The same pieces with other coordinates.
    fn tips_of<'a>(&'a self, control_points: &'a PyReadonlyArray3<'_, f64>) -> PyResult<Tips<'a>> {
        let &[count, points, axes] = control_points.shape() else { unreachable!("three dimensions") };
        let tips = Tips {
            axes,
            points,
            control: control_points.as_slice()?,
            weights: self.weights.as_ref().map_or(Ok(&[][..]), |weights| weights.as_slice())?,
            width: self.width.as_slice()?,
        };
        let weighted = tips.weights.is_empty() || tips.weights.len() == count * points;
        if tips.len() != count || !weighted || axes == 0 || !(1..=MOST_POINTS).contains(&points) {
            return Err(PyValueError::new_err("the arrays of the tip's pieces do not belong together"));
        }
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
    if good {
        Ok(())
    } else {
        Err(PyValueError::new_err("the arrays differ in length"))
    }
}

fn cube<'py>(py: Python<'py>, flat: Vec<f64>, shape: [usize; 3]) -> PyResult<Bound<'py, PyArray3<f64>>> {
    PyArray1::from_vec(py, flat).reshape(shape)
}

fn table<'py>(py: Python<'py>, flat: Vec<f64>, columns: usize) -> PyResult<Bound<'py, PyArray2<f64>>> {
    let rows = flat.len() / columns.max(1);
    PyArray1::from_vec(py, flat).reshape([rows, columns])
}

fn parts_of<'a>(
    parts: &'a Option<PyReadonlyArray2<'_, f64>>,
    count: usize,
) -> PyResult<Option<&'a [[f64; 2]]>> {
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
    tips: PyReadonlyArray2<'py, f64>,
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
    fraction: PyReadonlyArray1<'py, f64>,
    order: usize,
) -> PyResult<Bound<'py, PyArray3<f64>>> {
    let (joints, pieces, fraction) = (expression.expression()?, tips.tips()?, fraction.as_slice()?);
    let machine = machine(&joints, &expression, &pieces)?;
    require_order(order)?;
    require_length(fraction.len() == pieces.len())?;
    let found = run(py, None, |_| path_derivatives::derivatives(machine, pieces, fraction, order))?;
    cube(py, found, [fraction.len(), order + 1, joints.outputs()])
}

type Bounds<'py> = (Bound<'py, PyArray3<f64>>, Bound<'py, PyArray3<f64>>);

/// Least and greatest q^(k)/k! (n, order + 1, joints) over pieces, or parts (n, 2) of them.
#[pyfunction]
#[pyo3(signature = (expression, tips, order, parts=None))]
pub fn joint_enclosures<'py>(
    py: Python<'py>,
    expression: ExpressionArrays<'py>,
    tips: TipArrays<'py>,
    order: usize,
    parts: Option<PyReadonlyArray2<'py, f64>>,
) -> PyResult<Bounds<'py>> {
    let (joints, pieces) = (expression.expression()?, tips.tips()?);
    let machine = machine(&joints, &expression, &pieces)?;
    require_order(order)?;
    let parts = parts_of(&parts, pieces.len())?;
    let found = run(py, None, |_| path_derivatives::enclosures(machine, pieces, parts, order))?;
    let shape = [pieces.len(), order + 1, joints.outputs()];
    let ends: [fn(&Interval) -> f64; 2] = [|x| x.lo, |x| x.hi];
    let [lo, hi] = ends.map(|end| cube(py, found.iter().map(end).collect(), shape));
    Ok((lo?, hi?))
}

/// Parts: pieces (m,), fractions (m, 2), least and greatest positions (m, joints). Singular places: pieces and fractions.
/// Overruns: piece, fraction, joint, value, limit.
type JointPathArrays<'py> = (
    Bound<'py, PyArray1<i64>>,
    Bound<'py, PyArray2<f64>>,
    Bound<'py, PyArray2<f64>>,
    Bound<'py, PyArray2<f64>>,
    Vec<(usize, f64)>,
    Vec<(usize, f64, usize, f64, f64)>,
);

fn numbers<'py>(py: Python<'py>, values: Vec<usize>) -> Bound<'py, PyArray1<i64>> {
    PyArray1::from_iter(py, values.into_iter().map(|value| value as i64))
}

/// The joints along pieces joined end to end.
#[pyfunction]
#[pyo3(signature = (expression, tips, travel=None, start=None))]
pub fn joint_path<'py>(
    py: Python<'py>,
    expression: ExpressionArrays<'py>,
    tips: TipArrays<'py>,
    travel: Option<PyReadonlyArray2<'py, f64>>,
    start: Option<PyReadonlyArray1<'py, f64>>,
) -> PyResult<JointPathArrays<'py>> {
    let (joints, pieces) = (expression.expression()?, tips.tips()?);
    let machine = machine(&joints, &expression, &pieces)?;
    let travel = parts_of(&travel, joints.outputs())?;
    let start = start.as_ref().map(|start| start.as_slice()).transpose()?;
    require_length(start.is_none_or(|start| start.len() == joints.outputs()))?;
    let path = run(py, None, |_| singularities::joint_path(machine, pieces, travel, start))?;
    let ends: [fn(&Interval) -> f64; 2] = [|x| x.lo, |x| x.hi];
    let [lo, hi] = ends.map(|end| table(py, path.range.iter().map(end).collect(), joints.outputs()));
    let overrun = |o: Overrun| (o.piece, o.fraction, o.joint, o.value, o.limit);
    Ok((
        numbers(py, path.piece),
        table(py, path.part.into_flattened(), 2)?,
        lo?,
        hi?,
        path.singular,
        path.overruns.into_iter().map(overrun).collect(),
    ))
}

/// `feedplan.machine.joint_interpolants.SquareOfSpeed`.
#[derive(FromPyObject)]
pub struct SquareArrays<'py> {
    control_points: PyReadonlyArray3<'py, f64>,
    turning: bool,
    pieces: PyReadonlyArray1<'py, bool>,
}

/// `feedplan.machine.joint_interpolants.Accuracy`.
#[derive(FromPyObject)]
pub struct AccuracyArrays<'py> {
    acceleration: PyReadonlyArray1<'py, f64>,
    least_velocity: PyReadonlyArray1<'py, f64>,
    greatest_velocity: PyReadonlyArray1<'py, f64>,
    feed: PyReadonlyArray1<'py, f64>,
    linear: PyReadonlyArray3<'py, f64>,
    moves: PyReadonlyArray1<'py, bool>,
    squares: Vec<SquareArrays<'py>>,
    speed_nodes: PyReadonlyArray1<'py, f64>,
    speed_between: PyReadonlyArray1<'py, f64>,
    speed_interpolation: PyReadonlyArray2<'py, f64>,
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
    Given(PyReadonlyArray1<'py, f64>),
    Limited(AccuracyArrays<'py>),
}

/// Parts: pieces (m,), fractions (m, 2), Bernstein coefficients (m, nodes + 1, joints) of q', errors (m, joints) of q''.
type InterpolantArrays<'py> = (
    Bound<'py, PyArray1<i64>>,
    Bound<'py, PyArray2<f64>>,
    Bound<'py, PyArray3<f64>>,
    Bound<'py, PyArray2<f64>>,
);

/// Polynomials that interpolate q' on parts of pieces.
#[pyfunction]
pub fn joint_interpolants<'py>(
    py: Python<'py>,
    expression: ExpressionArrays<'py>,
    tips: TipArrays<'py>,
    nodes: PyReadonlyArray1<'py, f64>,
    to_bernstein: PyReadonlyArray2<'py, f64>,
    tolerance: ToleranceArrays<'py>,
) -> PyResult<InterpolantArrays<'py>> {
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
    Ok((
        numbers(py, found.piece),
        table(py, found.part.into_flattened(), 2)?,
        cube(py, found.slope, [parts, count + 1, outputs])?,
        table(py, found.curvature_error, outputs)?,
    ))
}
