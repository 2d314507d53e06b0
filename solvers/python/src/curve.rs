//! `Curve`: the pieces of a composite curve, checked once and stored in the form that the kernels take.

use std::sync::Arc;

use numpy::ndarray::{s, ArrayView2};
use numpy::{PyArray1, PyArray3, PyArrayMethods, PyUntypedArrayMethods};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyTuple};

use super::arrays::{rows, Column, Table};
use super::axes::with_padded_axes;
use super::native::{with_object, InAxes};
use super::views::view;
use super::work::run;
use feedplan_geometry::parallel::consume;
use feedplan_geometry::spline::bezier::{derivatives, elevate, reverse, split};
use feedplan_geometry::spline::extract::extract;
use feedplan_geometry::spline::knots::{check_points, Spline};
use feedplan_geometry::spline::regular::regular;
use feedplan_geometry::spline::{CompositeCurve, MAX_DEGREE};

pyo3::import_exception!(feedplan.errors, InputError);

/// Number of places that one thread evaluates at a time.
const BLOCK: usize = 4096;
/// Least width of a piece; the greatest width is its inverse.
const LEAST_WIDTH: f64 = 1e-60;

/// Memory for the values and derivatives at some places, and the pieces and parameters of these places.
type Block<'a> = (Vec<&'a mut [f64]>, &'a [u32], &'a [f64]);

/// Bézier pieces joined end to end.
#[pyclass(frozen, module = "feedplan._solvers")]
pub struct Curve {
    /// `Arc<CompositeCurve>`.
    pieces: InAxes,
}

/// Calls a generic kernel with the pieces of a curve in M axes.
macro_rules! with_pieces {
    ($curve:expr, $m:ident, $pieces:ident, $call:expr) => {
        with_object!($curve.pieces, $m, $pieces: Arc<CompositeCurve<$m>>, $call)
    };
}

pub fn weights_of(weights: Option<&Column>) -> PyResult<Vec<f64>> {
    weights.map_or(Ok(vec![]), |weights| Ok(weights.as_slice()?.to_vec()))
}

/// The offsets of `widths` pieces in `points` control points. Raises InputError if they do not fit these numbers.
fn checked_offsets(given: &[i64], widths: usize, points: usize) -> PyResult<Vec<usize>> {
    let error = |sentence: String| Err(InputError::new_err(sentence));
    if given.len() != widths + 1 {
        let offsets = given.len();
        return error(format!(
            "{offsets} offsets for {widths} widths: give one width for each piece, and one offset more"
        ));
    }
    let (first, last) = (given[0], given[widths]);
    if first != 0 || usize::try_from(last) != Ok(points) {
        return error(format!(
            "the offsets go from {first} to {last}: they must go from 0 to {points}, the number of control points"
        ));
    }
    for (i, ends) in given.windows(2).enumerate() {
        let degree = ends[1].wrapping_sub(ends[0]).wrapping_sub(1);
        if !(1..=MAX_DEGREE as i64).contains(&degree) {
            return error(format!(
                "piece {i} has degree {degree}: degrees 1 to {MAX_DEGREE} are supported; correct offsets"
            ));
        }
    }
    Ok(given.iter().map(|&offset| offset as usize).collect())
}

impl Curve {
    /// The curve of these pieces. Raises InputError for coordinates, weights or widths out of range.
    pub fn checked<const M: usize>(pieces: CompositeCurve<M>, axes: usize) -> PyResult<Self> {
        if !pieces.control.is_empty() {
            check_points(1, &pieces.control, &pieces.weights).map_err(InputError::new_err)?;
        }
        let usable = |width: &f64| *width > LEAST_WIDTH && *width < 1.0 / LEAST_WIDTH;
        if let Some(i) = pieces.width.iter().position(|width| !usable(width)) {
            return Err(InputError::new_err(format!(
                "piece {i} has the width {:?}: widths must be positive and finite; correct it",
                pieces.width[i]
            )));
        }
        Ok(Self { pieces: InAxes::new(axes, Arc::new(pieces)) })
    }

    pub fn axes(&self) -> usize {
        self.pieces.axes
    }

    /// The pieces in M axes; raises ValueError if `with_padded_axes` gives another M for this curve.
    pub fn padded<const M: usize>(&self) -> PyResult<&Arc<CompositeCurve<M>>> {
        self.pieces.get().map_err(|_| {
            PyValueError::new_err(format!("a curve in {} axes where {M} are meant", self.axes()))
        })
    }

    pub fn piece_offsets(&self) -> &[usize] {
        with_pieces!(self, M, pieces, &pieces.offsets)
    }

    /// The weights; empty where all pieces are polynomial.
    pub fn weight_slice(&self) -> &[f64] {
        with_pieces!(self, M, pieces, &pieces.weights)
    }

    pub fn widths(&self) -> &[f64] {
        with_pieces!(self, M, pieces, &pieces.width)
    }

    /// The coordinates of all control points, and the number of coordinates of each.
    pub fn coordinates(&self) -> (&[f64], usize) {
        with_pieces!(self, M, pieces, (pieces.control.as_flattened(), M))
    }

    fn table(&self) -> ArrayView2<'_, f64> {
        let (flat, stride) = self.coordinates();
        let rows = ArrayView2::from_shape((flat.len() / stride, stride), flat).expect("whole rows");
        rows.slice_move(s![.., ..self.axes()])
    }
}

fn spline<const M: usize>(
    control: &Table,
    weights: Option<&Column>,
    knots: &Column,
    degree: usize,
    periodic: bool,
) -> PyResult<Spline<M>> {
    let (control, weights) = (rows::<M>(control)?, weights_of(weights)?);
    let make = if periodic { Spline::periodic } else { Spline::new };
    make(degree, knots.as_slice()?.to_vec(), control, weights).map_err(InputError::new_err)
}

#[pymethods]
impl Curve {
    /// From the arrays of `feedplan.curves.composite.CompositeCurve`.
    #[new]
    fn new(
        control_points: Table<'_>,
        weights: Option<Column<'_>>,
        offsets: Column<'_, i64>,
        width: Column<'_>,
    ) -> PyResult<Self> {
        let axes = control_points.shape()[1];
        let weights = weights_of(weights.as_ref())?;
        let width = width.as_slice()?.to_vec();
        let offsets = checked_offsets(offsets.as_slice()?, width.len(), control_points.shape()[0])?;
        with_padded_axes!(axes, M, {
            let control = rows::<M>(&control_points)?;
            Self::checked(CompositeCurve { control, weights, offsets, width }, axes)
        })
    }

    /// The pieces of a B-spline or NURBS curve.
    #[staticmethod]
    fn of_spline(
        py: Python<'_>,
        control_points: Table<'_>,
        weights: Option<Column<'_>>,
        knots: Column<'_>,
        degree: usize,
        periodic: bool,
    ) -> PyResult<Self> {
        let axes = control_points.shape()[1];
        with_padded_axes!(axes, M, {
            let spline = spline::<M>(&control_points, weights.as_ref(), &knots, degree, periodic)?;
            Self::checked(py.detach(|| extract(&spline)).map_err(InputError::new_err)?, axes)
        })
    }

    /// Views of `control_points` (total, axes), `weights` (total,), None where all pieces are polynomial, `offsets`
    /// (n + 1,) and `width` (n,).
    fn fields<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyDict>> {
        let rational = !slf.get().weight_slice().is_empty();
        let weights = rational.then(|| view(slf, |curve| curve.weight_slice().into())).transpose()?;
        let offsets = view(slf, |curve| curve.piece_offsets().into())?;
        let fields = PyDict::new(slf.py());
        fields.set_item("control_points", view(slf, Self::table)?)?;
        fields.set_item("weights", weights)?;
        // The same memory as signed numbers, since differences of unsigned numbers are never negative.
        fields.set_item("offsets", offsets.call_method1("view", ("i8",))?)?;
        fields.set_item("width", view(slf, |curve| curve.widths().into())?)?;
        Ok(fields)
    }

    /// Values and derivatives (order + 1, m, axes) at m places.
    fn evaluate<'py>(
        &self,
        py: Python<'py>,
        piece: Column<'py, u32>,
        u: Column<'py>,
        order: usize,
    ) -> PyResult<Bound<'py, PyArray3<f64>>> {
        let (axes, piece, u) = (self.axes(), piece.as_slice()?, u.as_slice()?);
        check_places(self.widths(), piece, u)?;
        let order = order.min(3);
        let mut values = vec![0.0; (order + 1) * u.len() * axes];
        let mut orders: Vec<_> = values
            .chunks_mut((u.len() * axes).max(1))
            .map(|of_order| of_order.chunks_mut(BLOCK * axes))
            .collect();
        let blocks: Vec<Block> = piece
            .chunks(BLOCK)
            .zip(u.chunks(BLOCK))
            .map(|(piece, u)| (orders.iter_mut().filter_map(Iterator::next).collect(), piece, u))
            .collect();
        let fill = |(mut block, piece, u): Block| {
            with_pieces!(self, M, pieces, {
                for (i, (&piece, &u)) in piece.iter().zip(u).enumerate() {
                    let c = derivatives(&pieces.piece(piece as usize), u);
                    for (rows, value) in block.iter_mut().zip(&c) {
                        rows[i * axes..(i + 1) * axes].copy_from_slice(&value[..axes]);
                    }
                }
            });
        };
        // Waking other threads takes longer than evaluating a few places.
        if blocks.len() == 1 {
            py.detach(|| blocks.into_iter().for_each(fill));
        } else {
            run(py, None, |watch| {
                consume(blocks, |_, block| {
                    watch.check();
                    fill(block);
                });
            })?;
        }
        PyArray1::from_vec(py, values).reshape([order + 1, u.len(), axes])
    }

    /// The curve with every piece of a lower degree raised to `degree`.
    fn elevated(&self, degree: usize) -> PyResult<Self> {
        with_pieces!(self, M, pieces, {
            let mut raised = CompositeCurve::<M>::default();
            for piece in pieces.pieces() {
                elevate(&piece, degree.min(MAX_DEGREE).saturating_sub(piece.degree()), &mut raised);
            }
            Self::checked(raised, self.axes())
        })
    }

    /// The curve with its pieces cut at places, which must be in the order of the curve.
    fn split(&self, piece: Column<'_, u32>, u: Column<'_>) -> PyResult<Self> {
        let (piece, u) = (piece.as_slice()?, u.as_slice()?);
        check_places(self.widths(), piece, u)?;
        with_pieces!(self, M, pieces, {
            let mut parts = CompositeCurve::<M>::default();
            let mut next = 0;
            for (i, whole) in pieces.pieces().enumerate() {
                let first = next;
                while next < piece.len() && piece[next] as usize == i {
                    next += 1;
                }
                split(&whole, &u[first..next], &mut parts);
            }
            Self::checked(parts, self.axes())
        })
    }

    /// The curve traversed backwards.
    fn reversed(&self) -> PyResult<Self> {
        with_pieces!(self, M, pieces, {
            let mut reversed = CompositeCurve::<M>::default();
            for i in (0..pieces.len()).rev() {
                reverse(&pieces.piece(i), &mut reversed);
            }
            Self::checked(reversed, self.axes())
        })
    }

    /// The curve as n lines and curved pieces without a cusp inside; for each the first and the last piece of the old curve that
    /// it replaces (n, 2), and whether it rests at its start and at its end (n, 2).
    fn regular<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyTuple>> {
        with_pieces!(self, M, pieces, {
            let whole = 0..pieces.len();
            let made = run(py, None, |watch| regular(pieces, std::slice::from_ref(&whole), watch))?;
            let source = made.source.iter().flatten().map(|&source| source as i64);
            let shape = [made.source.len(), 2];
            let rests = made.rests.iter().flatten().copied();
            (
                Self::checked(made.curve, self.axes())?,
                PyArray1::from_iter(py, source).reshape(shape)?,
                PyArray1::from_iter(py, rests).reshape(shape)?,
            )
                .into_pyobject(py)
        })
    }
}

pub fn check_places(width: &[f64], piece: &[u32], u: &[f64]) -> PyResult<()> {
    if piece.len() != u.len() {
        return Err(PyValueError::new_err(format!("{} pieces for {} parameters", piece.len(), u.len())));
    }
    for (place, (&piece, &u)) in piece.iter().zip(u).enumerate() {
        let Some(&width) = width.get(piece as usize) else {
            return Err(InputError::new_err(format!(
                "place {place} is on piece {piece}: the curve has {} pieces, counted from 0; choose one of them",
                width.len()
            )));
        };
        if !(0.0..=width).contains(&u) {
            return Err(InputError::new_err(format!(
                "place {place} is at u = {u} of piece {piece}: its parameter goes from 0 to {width}; stay within"
            )));
        }
    }
    Ok(())
}
