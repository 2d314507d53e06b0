//! Python binding of the spline kernel: curves as their columns, control points, weights, offsets and widths.

use numpy::{
    PyArray1, PyArray2, PyArray3, PyArrayMethods, PyReadonlyArray1, PyReadonlyArray2, PyUntypedArrayMethods,
};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use rayon::prelude::*;

use super::arrays::{row, rows, to_array2};
use super::with_padded_axes;
use super::work::run;
use feedplan_geometry::spline::bezier::{derivatives, elevate, reverse, split};
use feedplan_geometry::spline::circle::Turn;
use feedplan_geometry::spline::cusps::cusps;
use feedplan_geometry::spline::error::SplineError;
use feedplan_geometry::spline::extract::extract;
use feedplan_geometry::spline::joints::{joints, JointTolerance};
use feedplan_geometry::spline::knots::{check_points, Spline};
use feedplan_geometry::spline::length::CurveLength as Kernel;
use feedplan_geometry::spline::regular::regular;
use feedplan_geometry::spline::{CompositeCurve, Piece, MAX_DEGREE};

pyo3::import_exception!(feedplan.errors, InputError);

pub fn register(module: &Bound<PyModule>) -> PyResult<()> {
    module.add_class::<CurveLength>()?;
    module.add_function(wrap_pyfunction!(spline_pieces, module)?)?;
    module.add_function(wrap_pyfunction!(spline_insert, module)?)?;
    module.add_function(wrap_pyfunction!(turn_pieces, module)?)?;
    module.add_function(wrap_pyfunction!(check_control_points, module)?)?;
    module.add_function(wrap_pyfunction!(curve_evaluate, module)?)?;
    module.add_function(wrap_pyfunction!(curve_elevate, module)?)?;
    module.add_function(wrap_pyfunction!(curve_split, module)?)?;
    module.add_function(wrap_pyfunction!(curve_reverse, module)?)?;
    module.add_function(wrap_pyfunction!(curve_joints, module)?)?;
    module.add_function(wrap_pyfunction!(curve_regular, module)?)?;
    module.add_function(wrap_pyfunction!(curve_cusps, module)?)
}

/// Places that one thread evaluates at a time.
const BLOCK: usize = 4096;

/// Where the values and the derivatives of some places go; their pieces and parameters.
type Block<'a> = (Vec<&'a mut [f64]>, &'a [u32], &'a [f64]);
type Array1<'py> = PyReadonlyArray1<'py, f64>;
type Array2<'py> = PyReadonlyArray2<'py, f64>;
/// Control points (total, axes), weights (total,) if any piece is rational, offsets (n + 1,), widths (n,).
type Columns<'py> = (
    Bound<'py, PyArray2<f64>>,
    Option<Bound<'py, PyArray1<f64>>>,
    Bound<'py, PyArray1<i64>>,
    Bound<'py, PyArray1<f64>>,
);
/// Piece, kind, gap, turn, and speed before and after.
type JointColumns<'py> = (
    Bound<'py, PyArray1<u32>>,
    Bound<'py, PyArray1<u8>>,
    Bound<'py, PyArray1<f64>>,
    Bound<'py, PyArray1<f64>>,
    Bound<'py, PyArray2<f64>>,
);

fn input_error(error: SplineError) -> PyErr {
    InputError::new_err(error.to_string())
}

fn weights_of(weights: Option<&Array1>) -> PyResult<Vec<f64>> {
    weights.map_or(Ok(vec![]), |weights| Ok(weights.as_slice()?.to_vec()))
}

fn weights_to<'py>(py: Python<'py>, weights: Vec<f64>) -> Option<Bound<'py, PyArray1<f64>>> {
    (!weights.is_empty()).then(|| PyArray1::from_vec(py, weights))
}

/// Columns to a curve in M axes, those beyond the given ones at rest.
pub(super) fn curve<const M: usize>(
    control: &Array2,
    weights: Option<&Array1>,
    offsets: &PyReadonlyArray1<i64>,
    width: &Array1,
) -> PyResult<CompositeCurve<M>> {
    let curve = CompositeCurve {
        control: rows::<M>(control)?,
        weights: weights_of(weights)?,
        offsets: offsets.as_slice()?.iter().map(|&offset| usize::try_from(offset).unwrap_or(0)).collect(),
        width: width.as_slice()?.to_vec(),
    };
    let total = curve.control.len();
    let fits = curve.offsets.first() == Some(&0)
        && curve.offsets.last() == Some(&total)
        && curve.offsets.len() == curve.width.len() + 1
        && (curve.weights.is_empty() || curve.weights.len() == total)
        && curve.offsets.windows(2).all(|ends| (ends[0] + 2..=ends[0] + MAX_DEGREE + 1).contains(&ends[1]));
    fits.then_some(curve).ok_or_else(unfit)
}

fn unfit() -> PyErr {
    PyValueError::new_err("the columns of the curve do not fit together")
}

fn columns<const M: usize>(py: Python<'_>, curve: CompositeCurve<M>, axes: usize) -> Columns<'_> {
    (
        to_array2(py, curve.control, axes),
        weights_to(py, curve.weights),
        PyArray1::from_iter(py, curve.offsets.iter().map(|&offset| offset as i64)),
        PyArray1::from_vec(py, curve.width),
    )
}

fn spline<const M: usize>(
    control: &Array2,
    weights: Option<&Array1>,
    knots: &Array1,
    degree: usize,
    periodic: bool,
) -> PyResult<Spline<M>> {
    let (control, weights) = (rows::<M>(control)?, weights_of(weights)?);
    let make = if periodic { Spline::periodic } else { Spline::new };
    make(degree, knots.as_slice()?.to_vec(), control, weights).map_err(input_error)
}

/// The pieces of a B-spline or NURBS curve.
#[pyfunction]
fn spline_pieces<'py>(
    py: Python<'py>,
    control_points: Array2<'py>,
    weights: Option<Array1<'py>>,
    knots: Array1<'py>,
    degree: usize,
    periodic: bool,
) -> PyResult<Columns<'py>> {
    let axes = control_points.shape()[1];
    with_padded_axes!(axes, M, {
        let spline = spline::<M>(&control_points, weights.as_ref(), &knots, degree, periodic)?;
        let pieces = py.detach(|| extract(&spline)).map_err(input_error)?;
        Ok(columns(py, pieces, axes))
    })
}

/// Control points, weights and knots after inserting a knot.
#[pyfunction]
#[allow(clippy::too_many_arguments, clippy::type_complexity)]
fn spline_insert<'py>(
    py: Python<'py>,
    control_points: Array2<'py>,
    weights: Option<Array1<'py>>,
    knots: Array1<'py>,
    degree: usize,
    value: f64,
    times: usize,
) -> PyResult<(Bound<'py, PyArray2<f64>>, Option<Bound<'py, PyArray1<f64>>>, Bound<'py, PyArray1<f64>>)> {
    let axes = control_points.shape()[1];
    with_padded_axes!(axes, M, {
        let mut spline = spline::<M>(&control_points, weights.as_ref(), &knots, degree, false)?;
        spline.insert(value, times).map_err(input_error)?;
        Ok((
            to_array2(py, spline.control, axes),
            weights_to(py, spline.weights),
            PyArray1::from_vec(py, spline.knots),
        ))
    })
}

/// An arc, or with `travel` a helix and the bound of its error.
#[pyfunction]
#[allow(clippy::too_many_arguments)]
fn turn_pieces<'py>(
    py: Python<'py>,
    start: Array1<'py>,
    plane: [usize; 2],
    centre: [f64; 2],
    sweep: f64,
    travel: Option<Array1<'py>>,
    degree: usize,
    tolerance: f64,
) -> PyResult<(Columns<'py>, f64)> {
    let axes = start.len();
    if plane.iter().any(|&axis| axis >= axes) {
        return Err(PyValueError::new_err("the plane is not one of these axes"));
    }
    with_padded_axes!(axes, M, {
        let turn = Turn { start: row::<M>(&start, 0.0)?, plane, centre, sweep };
        let (pieces, bound) = match travel {
            None => (turn.arc(), 0.0),
            Some(travel) => turn.helix(&row::<M>(&travel, 0.0)?, degree, tolerance).map_err(input_error)?,
        };
        Ok((columns(py, pieces, axes), bound))
    })
}

/// Raises InputError for coordinates and weights that cannot be used.
#[pyfunction]
fn check_control_points(
    control_points: Array2<'_>,
    weights: Option<Array1<'_>>,
    degree: usize,
) -> PyResult<()> {
    with_padded_axes!(control_points.shape()[1], M, {
        check_points(degree, &rows::<M>(&control_points)?, &weights_of(weights.as_ref())?)
            .map_err(input_error)
    })
}

/// Values and derivatives (order + 1, m, axes) at m places.
#[pyfunction]
#[allow(clippy::too_many_arguments)]
fn curve_evaluate<'py>(
    py: Python<'py>,
    control_points: Array2<'py>,
    weights: Option<Array1<'py>>,
    offsets: PyReadonlyArray1<'py, i64>,
    width: Array1<'py>,
    piece: PyReadonlyArray1<'py, u32>,
    u: Array1<'py>,
    order: usize,
) -> PyResult<Bound<'py, PyArray3<f64>>> {
    let axes = control_points.shape()[1];
    with_padded_axes!(axes, M, {
        let (piece, u, width) = (piece.as_slice()?, u.as_slice()?, width.as_slice()?);
        check_places(width, piece, u)?;
        // Only the pieces of these places are read: few places of a long curve take no long time.
        let (control, offsets) = (control_points.as_slice()?, offsets.as_slice()?);
        let weights = weights.as_ref().map_or(Ok(&[][..]), |weights| weights.as_slice())?;
        let total = control.len() / axes;
        let points = |i: u32| offsets[i as usize] as usize..offsets[i as usize + 1] as usize;
        let fits = offsets.len() == width.len() + 1
            && (weights.is_empty() || weights.len() == total)
            && piece
                .iter()
                .all(|&i| points(i).end <= total && (2..=MAX_DEGREE + 1).contains(&points(i).len()));
        if !fits {
            return Err(unfit());
        }
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
            let mut own = [[0.0; M]; MAX_DEGREE + 1];
            for (i, (&piece, &u)) in piece.iter().zip(u).enumerate() {
                let range = points(piece);
                let given = control[range.start * axes..range.end * axes].chunks_exact(axes);
                for (point, row) in own.iter_mut().zip(given) {
                    point[..axes].copy_from_slice(row);
                }
                let weights = if weights.is_empty() { weights } else { &weights[range.clone()] };
                let c = derivatives(&Piece::new(&own[..range.len()], weights, width[piece as usize]), u);
                for (rows, value) in block.iter_mut().zip(&c) {
                    rows[i * axes..(i + 1) * axes].copy_from_slice(&value[..axes]);
                }
            }
        };
        // Few places take less time than to wake other threads.
        if blocks.len() == 1 {
            py.detach(|| blocks.into_iter().for_each(fill));
        } else {
            run(py, None, |watch| {
                blocks.into_par_iter().for_each(|block| {
                    watch.check();
                    fill(block);
                });
            })?;
        }
        PyArray1::from_vec(py, values).reshape([order + 1, u.len(), axes])
    })
}

fn check_places(width: &[f64], piece: &[u32], u: &[f64]) -> PyResult<()> {
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

/// The curve with every piece of a degree below `degree` raised to it.
#[pyfunction]
fn curve_elevate<'py>(
    py: Python<'py>,
    control_points: Array2<'py>,
    weights: Option<Array1<'py>>,
    offsets: PyReadonlyArray1<'py, i64>,
    width: Array1<'py>,
    degree: usize,
) -> PyResult<Columns<'py>> {
    let axes = control_points.shape()[1];
    with_padded_axes!(axes, M, {
        let curve = curve::<M>(&control_points, weights.as_ref(), &offsets, &width)?;
        let mut raised = CompositeCurve::default();
        for piece in curve.pieces() {
            elevate(&piece, degree.min(MAX_DEGREE).saturating_sub(piece.degree()), &mut raised);
        }
        Ok(columns(py, raised, axes))
    })
}

/// The curve with pieces cut at places in order: piece numbers grow, and u within a piece.
#[pyfunction]
fn curve_split<'py>(
    py: Python<'py>,
    control_points: Array2<'py>,
    weights: Option<Array1<'py>>,
    offsets: PyReadonlyArray1<'py, i64>,
    width: Array1<'py>,
    piece: PyReadonlyArray1<'py, u32>,
    u: Array1<'py>,
) -> PyResult<Columns<'py>> {
    let axes = control_points.shape()[1];
    with_padded_axes!(axes, M, {
        let curve = curve::<M>(&control_points, weights.as_ref(), &offsets, &width)?;
        let (piece, u) = (piece.as_slice()?, u.as_slice()?);
        check_places(&curve.width, piece, u)?;
        let mut parts = CompositeCurve::default();
        let mut next = 0;
        for (i, whole) in curve.pieces().enumerate() {
            let first = next;
            while next < piece.len() && piece[next] as usize == i {
                next += 1;
            }
            split(&whole, &u[first..next], &mut parts);
        }
        Ok(columns(py, parts, axes))
    })
}

/// The curve traversed backwards.
#[pyfunction]
fn curve_reverse<'py>(
    py: Python<'py>,
    control_points: Array2<'py>,
    weights: Option<Array1<'py>>,
    offsets: PyReadonlyArray1<'py, i64>,
    width: Array1<'py>,
) -> PyResult<Columns<'py>> {
    let axes = control_points.shape()[1];
    with_padded_axes!(axes, M, {
        let curve = curve::<M>(&control_points, weights.as_ref(), &offsets, &width)?;
        let mut reversed = CompositeCurve::default();
        for i in (0..curve.len()).rev() {
            reverse(&curve.piece(i), &mut reversed);
        }
        Ok(columns(py, reversed, axes))
    })
}

/// The joints of a curve.
#[pyfunction]
#[allow(clippy::too_many_arguments)]
fn curve_joints<'py>(
    py: Python<'py>,
    control_points: Array2<'py>,
    weights: Option<Array1<'py>>,
    offsets: PyReadonlyArray1<'py, i64>,
    width: Array1<'py>,
    closed: bool,
    gap: f64,
    angle: f64,
    derivative: f64,
) -> PyResult<JointColumns<'py>> {
    with_padded_axes!(control_points.shape()[1], M, {
        let curve = curve::<M>(&control_points, weights.as_ref(), &offsets, &width)?;
        let found =
            run(py, None, |watch| joints(&curve, closed, &JointTolerance { gap, angle, derivative }, watch))?;
        Ok((
            PyArray1::from_iter(py, found.iter().map(|joint| joint.piece as u32)),
            PyArray1::from_iter(py, found.iter().map(|joint| joint.kind as u8)),
            PyArray1::from_iter(py, found.iter().map(|joint| joint.gap)),
            PyArray1::from_iter(py, found.iter().map(|joint| joint.turn)),
            to_array2(py, found.iter().map(|joint| joint.speed).collect(), 2),
        ))
    })
}

/// The curve as lines and as curves without a cusp inside; of each piece the first and the last one that it goes along
/// (n, 2), and whether it rests at its start and at its end (n, 2).
#[pyfunction]
#[allow(clippy::type_complexity)]
fn curve_regular<'py>(
    py: Python<'py>,
    control_points: Array2<'py>,
    weights: Option<Array1<'py>>,
    offsets: PyReadonlyArray1<'py, i64>,
    width: Array1<'py>,
) -> PyResult<(Columns<'py>, Bound<'py, PyArray2<i64>>, Bound<'py, PyArray2<bool>>)> {
    let axes = control_points.shape()[1];
    with_padded_axes!(axes, M, {
        let curve = curve::<M>(&control_points, weights.as_ref(), &offsets, &width)?;
        let whole = 0..curve.len();
        let made = run(py, None, |watch| regular(&curve, std::slice::from_ref(&whole), watch))?;
        let source = made.source.iter().flatten().map(|&source| source as i64);
        let shape = [made.source.len(), 2];
        Ok((
            columns(py, made.curve, axes),
            PyArray1::from_iter(py, source).reshape(shape)?,
            PyArray1::from_iter(py, made.rests.iter().flatten().copied()).reshape(shape)?,
        ))
    })
}

/// Pieces and parameters of the cusps.
#[pyfunction]
#[allow(clippy::type_complexity)]
fn curve_cusps<'py>(
    py: Python<'py>,
    control_points: Array2<'py>,
    weights: Option<Array1<'py>>,
    offsets: PyReadonlyArray1<'py, i64>,
    width: Array1<'py>,
    tolerance: f64,
) -> PyResult<(Bound<'py, PyArray1<u32>>, Bound<'py, PyArray1<f64>>)> {
    with_padded_axes!(control_points.shape()[1], M, {
        let curve = curve::<M>(&control_points, weights.as_ref(), &offsets, &width)?;
        let found = run(py, None, |watch| cusps(&curve, tolerance, watch))?;
        Ok((
            PyArray1::from_iter(py, found.iter().map(|cusp| cusp.piece as u32)),
            PyArray1::from_iter(py, found.iter().map(|cusp| cusp.u)),
        ))
    })
}

enum Lengths {
    Three(Kernel<3>),
    Six(Kernel<6>),
}

macro_rules! with_lengths {
    ($lengths:expr, $kernel:ident, $call:expr) => {
        match $lengths {
            Lengths::Three($kernel) => $call,
            Lengths::Six($kernel) => $call,
        }
    };
}

/// The lengths along a curve.
#[pyclass(frozen, module = "feedplan._solvers")]
struct CurveLength {
    lengths: Lengths,
    width: Vec<f64>,
}

#[pymethods]
impl CurveLength {
    #[new]
    #[pyo3(signature = (control_points, weights, offsets, width, accuracy, progress=None))]
    fn new(
        py: Python<'_>,
        control_points: Array2<'_>,
        weights: Option<Array1<'_>>,
        offsets: PyReadonlyArray1<'_, i64>,
        width: Array1<'_>,
        accuracy: f64,
        progress: Option<Bound<'_, PyAny>>,
    ) -> PyResult<Self> {
        let progress = progress.as_ref();
        let lengths = if control_points.shape()[1] <= 3 {
            let curve = curve::<3>(&control_points, weights.as_ref(), &offsets, &width)?;
            Lengths::Three(run(py, progress, |watch| Kernel::new(&curve, accuracy, watch))?)
        } else {
            let curve = curve::<6>(&control_points, weights.as_ref(), &offsets, &width)?;
            Lengths::Six(run(py, progress, |watch| Kernel::new(&curve, accuracy, watch))?)
        };
        Ok(Self { lengths, width: width.as_slice()?.to_vec() })
    }

    /// Length of the curve in mm.
    #[getter]
    fn total(&self) -> f64 {
        with_lengths!(&self.lengths, kernel, kernel.total())
    }

    /// Bound of the error of every length on the curve in mm.
    #[getter]
    fn error(&self) -> f64 {
        with_lengths!(&self.lengths, kernel, kernel.error())
    }

    /// Lengths (m,) from the start of the curve to m places.
    fn lengths<'py>(
        &self,
        py: Python<'py>,
        piece: PyReadonlyArray1<'py, u32>,
        u: Array1<'py>,
    ) -> PyResult<Bound<'py, PyArray1<f64>>> {
        let (piece, u) = (piece.as_slice()?, u.as_slice()?);
        check_places(&self.width, piece, u)?;
        let found = run(py, None, |_| with_lengths!(&self.lengths, kernel, kernel.lengths(piece, u)))?;
        Ok(PyArray1::from_vec(py, found))
    }

    /// Pieces, parameters, iterations and misses at m lengths.
    #[allow(clippy::type_complexity)]
    fn locate<'py>(
        &self,
        py: Python<'py>,
        lengths: Array1<'py>,
        tolerance: f64,
        newton: bool,
    ) -> PyResult<(
        Bound<'py, PyArray1<u32>>,
        Bound<'py, PyArray1<f64>>,
        Bound<'py, PyArray1<u32>>,
        Bound<'py, PyArray1<f64>>,
    )> {
        let wanted = lengths.as_slice()?;
        let found = run(py, None, |_| {
            with_lengths!(
                &self.lengths,
                kernel,
                if newton { kernel.follow(wanted, tolerance) } else { kernel.locate_all(wanted, tolerance) }
            )
        })?;
        Ok((
            PyArray1::from_iter(py, found.iter().map(|place| place.piece as u32)),
            PyArray1::from_iter(py, found.iter().map(|place| place.located.u)),
            PyArray1::from_iter(py, found.iter().map(|place| place.located.iterations)),
            PyArray1::from_iter(py, found.iter().map(|place| place.located.miss)),
        ))
    }
}
