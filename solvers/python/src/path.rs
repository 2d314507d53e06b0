//! `build_path`: the columns of a program to the columns of its path.

use std::ops::Range;

use numpy::{PyArray1, PyArray2, PyArrayMethods, PyReadonlyArray1, PyReadonlyArray2, PyUntypedArrayMethods};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use rayon::prelude::*;

use super::arrays::{row, rows};
use super::spline::curve;
use super::with_padded_axes;
use super::work::run;
use feedplan_geometry::spline::regular::{regular, Regular};
use feedplan_geometry::spline::{CompositeCurve, Piece};
use feedplan_geometry::watch::Watch;
use feedplan_path::arc::ArcError;
use feedplan_path::corner::Rounding;
use feedplan_path::follow::{ArcShape, Fault, FollowOptions, Followed, Moves, Shape};
use feedplan_path::path_builder::{Axes, BuiltPath, Part};
use feedplan_path::Followed as _;

pyo3::import_exception!(feedplan.errors, ProgramError);

pub fn register(module: &Bound<PyModule>) -> PyResult<()> {
    module.add_function(wrap_pyfunction!(build_path, module)?)
}

/// The travel of an axis that is not there.
const ANYWHERE: [f64; 2] = [f64::NEG_INFINITY, f64::INFINITY];

/// Control points, weights (if any piece is rational), offsets and widths of the curve; feeds, first and last moves,
/// tolerances and runs of the path.
type Columns<'py> = (
    (
        Bound<'py, PyArray2<f64>>,
        Option<Bound<'py, PyArray1<f64>>>,
        Bound<'py, PyArray1<i64>>,
        Bound<'py, PyArray1<f64>>,
    ),
    Bound<'py, PyArray1<f64>>,
    Bound<'py, PyArray2<i64>>,
    Bound<'py, PyArray1<f64>>,
    Bound<'py, PyArray1<i64>>,
);
/// Points, splines and polynomials of the fit, the deviation; of a smooth path the mean distance of bends with its sign,
/// and the greatest distances inside and outside.
type Summary = (usize, usize, usize, f64, Option<[f64; 3]>);
/// Move, axis and position of the first place outside the travel.
type Place = (usize, usize, f64);
/// Moves at whose end a smooth path turns back, first and last moves (k, 2) of the places where it keeps its corners.
type Rough<'py> = (Bound<'py, PyArray1<i64>>, Bound<'py, PyArray2<i64>>);
/// Control points, weights, offsets and widths of the splines of a program.
type Splines<'py> = (
    PyReadonlyArray2<'py, f64>,
    Option<PyReadonlyArray1<'py, f64>>,
    PyReadonlyArray1<'py, i64>,
    PyReadonlyArray1<'py, f64>,
);

/// The path of a program. `line` and `name` are for messages.
#[pyfunction]
#[pyo3(signature = (
    name, start, kind, target, feed, line, tolerance, fit_tolerance, halt, arc_move, arc_plane, arc_centre,
    arc_sweep, spline_move, spline_pieces, splines, change_move, change_start, joints, max_velocity, max_acceleration, travel, jump, exact_tolerance, max_chord, corner_acceleration,
    max_speed, corner_angle, corners, progress=None
))]
#[allow(clippy::too_many_arguments)]
fn build_path<'py>(
    py: Python<'py>,
    name: &str,
    start: PyReadonlyArray1<'py, f64>,
    kind: PyReadonlyArray1<'py, u8>,
    target: PyReadonlyArray2<'py, f64>,
    feed: PyReadonlyArray1<'py, f64>,
    line: PyReadonlyArray1<'py, i32>,
    tolerance: PyReadonlyArray1<'py, f64>,
    fit_tolerance: PyReadonlyArray1<'py, f64>,
    halt: PyReadonlyArray1<'py, bool>,
    arc_move: PyReadonlyArray1<'py, i64>,
    arc_plane: PyReadonlyArray2<'py, i64>,
    arc_centre: PyReadonlyArray2<'py, f64>,
    arc_sweep: PyReadonlyArray1<'py, f64>,
    spline_move: PyReadonlyArray1<'py, i64>,
    spline_pieces: PyReadonlyArray1<'py, i64>,
    splines: Option<Splines<'py>>,
    change_move: PyReadonlyArray1<'py, i64>,
    change_start: PyReadonlyArray2<'py, f64>,
    joints: PyReadonlyArray1<'py, bool>,
    max_velocity: PyReadonlyArray1<'py, f64>,
    max_acceleration: PyReadonlyArray1<'py, f64>,
    travel: PyReadonlyArray2<'py, f64>,
    jump: bool,
    exact_tolerance: f64,
    max_chord: f64,
    corner_acceleration: f64,
    max_speed: f64,
    corner_angle: f64,
    corners: &str,
    progress: Option<Bound<'py, PyAny>>,
) -> PyResult<(Columns<'py>, Summary, Option<Place>, Rough<'py>)> {
    let axes = start.len();
    let count = kind.len();
    let same = [feed.len(), line.len(), tolerance.len(), fit_tolerance.len(), halt.len(), joints.len()];
    let arcs = arc_move.len();
    if target.shape() != [count, axes]
        || same.iter().any(|&len| len != count)
        || arc_plane.shape() != [arcs, 2]
        || arc_centre.shape() != [arcs, 2]
        || arc_sweep.len() != arcs
        || travel.shape() != [axes, 2]
        || spline_pieces.len() != spline_move.len() + 1
        || (change_move.len() > 0 && change_start.shape() != [change_move.len(), axes])
        || splines.as_ref().is_some_and(|splines| splines.0.shape()[1] != axes)
    {
        return Err(PyValueError::new_err("the columns of the program differ in length"));
    }
    let shapes: Vec<(usize, ArcShape)> = (0..arcs)
        .map(|i| -> PyResult<_> {
            let index = usize::try_from(arc_move.as_slice()?[i])?;
            let plane = [arc_plane.as_slice()?[2 * i], arc_plane.as_slice()?[2 * i + 1]];
            let plane = [usize::try_from(plane[0])?, usize::try_from(plane[1])?];
            if plane[0] >= axes || plane[1] >= axes || index >= count {
                return Err(PyValueError::new_err("an arc refers to a move or an axis that does not exist"));
            }
            let centre = [arc_centre.as_slice()?[2 * i], arc_centre.as_slice()?[2 * i + 1]];
            Ok((index, ArcShape { plane, centre, sweep: arc_sweep.as_slice()?[i] }))
        })
        .collect::<PyResult<_>>()?;
    let ends = spline_pieces.as_slice()?;
    let pieces = splines.as_ref().map_or(0, |splines| splines.3.len());
    let spline_moves: Vec<(usize, Range<usize>)> = spline_move
        .as_slice()?
        .iter()
        .zip(ends.windows(2))
        .map(|(&index, ends)| -> PyResult<_> {
            let (index, range) =
                (usize::try_from(index)?, usize::try_from(ends[0])?..usize::try_from(ends[1])?);
            if range.start > range.end || range.end > pieces || index >= count {
                return Err(PyValueError::new_err(
                    "a spline refers to a move or a piece that does not exist",
                ));
            }
            Ok((index, range))
        })
        .collect::<PyResult<_>>()?;
    let rounding = if corners == "arcs" { Rounding::Circle } else { Rounding::Parabola };
    let smooth = ["smooth", "fastest"].contains(&corners);
    let options =
        FollowOptions { exact_tolerance, max_chord, corner_acceleration, max_speed, corner_angle, rounding };
    with_padded_axes!(axes, M, {
        let target = rows::<M>(&target)?;
        let given = match &splines {
            Some((control, weights, offsets, width)) => {
                curve::<M>(control, weights.as_ref(), offsets, width)?
            }
            None => CompositeCurve::default(),
        };
        let ranges: Vec<Range<usize>> = spline_moves.iter().map(|(_, range)| range.clone()).collect();
        let Regular { curve: splines, ranges, .. } = run(py, None, |watch| regular(&given, &ranges, watch))?;
        let spline_moves: Vec<(usize, Range<usize>)> =
            spline_moves.iter().zip(ranges).map(|((index, _), range)| (*index, range)).collect();
        let starts = if change_move.len() > 0 { rows::<M>(&change_start)? } else { vec![] };
        let changes: Vec<(usize, [f64; M])> = change_move
            .as_slice()?
            .iter()
            .zip(starts)
            .map(|(&index, start)| Ok((usize::try_from(index)?, start)))
            .collect::<PyResult<_>>()?;
        let moves = Moves {
            start: row::<M>(&start, 0.0)?,
            kind: kind.as_slice()?,
            target: &target,
            feed: feed.as_slice()?,
            tolerance: tolerance.as_slice()?,
            fit_tolerance: fit_tolerance.as_slice()?,
            halt: halt.as_slice()?,
            arcs: &shapes,
            spline_moves: &spline_moves,
            changes: &changes,
            splines: &splines,
            joints: joints.as_slice()?,
        };
        let travel = rows::<2>(&travel)?;
        let limits = Axes {
            max_velocity: row::<M>(&max_velocity, 1.0)?,
            max_acceleration: row::<M>(&max_acceleration, 1.0)?,
            travel: std::array::from_fn(|k| travel.get(k).copied().unwrap_or(ANYWHERE)),
            jump,
        };
        let build = |watch: Watch| match smooth {
            true => moves.smooth_path(&options, &limits, corners == "smooth", watch),
            false => moves.path(&options, &limits, watch),
        };
        let path = run(py, progress.as_ref(), build)?.map_err(|error| {
            let line = line.as_slice().map_or(0, |lines| lines[error.index]);
            ProgramError::new_err((format!("{name}, line {line}: {}", sentence(error.fault)), line))
        })?;
        columns(py, &path, &splines, axes, progress.as_ref())
    })
}

fn sentence(fault: Fault) -> &'static str {
    match fault {
        Fault::Length => "the move has no length, or a coordinate is not a finite number: correct the block",
        Fault::Feed => "the move has no positive feed: give F a value above 0",
        Fault::Arc(ArcError::Radius) => {
            "the arc has no radius, or no finite one: correct its centre or its end"
        }
        Fault::Arc(ArcError::Sweep) => {
            "the arc does not lead to its end point: correct its centre or its end"
        }
        Fault::Spline => "the move has no spline: give its pieces",
        Fault::Arc(ArcError::Turns) => "the arc has too many turns to be followed: give fewer",
    }
}

fn columns<'py, const M: usize>(
    py: Python<'py>,
    path: &BuiltPath<M>,
    splines: &CompositeCurve<M>,
    axes: usize,
    progress: Option<&Bound<'_, PyAny>>,
) -> PyResult<(Columns<'py>, Summary, Option<Place>, Rough<'py>)> {
    let parts = &path.parts;
    let points = |part: &Part<M>, followed: &Followed<M>| match &followed.piece {
        Shape::Conic(_) => 3,
        Shape::Spline(spline) => part.spline(spline, splines).control.len(),
    };
    let one = |_: &Part<M>, _: &Followed<M>| 1;
    let (control, weights, offsets, width, feed, moves, tolerance) = run(py, progress, |watch| {
        // The path is there.
        watch.advance(1);
        let is_rational = |part: &Part<M>, followed: &Followed<M>| match &followed.piece {
            Shape::Conic(conic) => conic.weight != 1.0,
            Shape::Spline(spline) => part.spline(spline, splines).is_rational(),
        };
        let rational =
            parts.par_iter().any(|part| part.pieces.iter().any(|followed| is_rational(part, followed)));
        let counts = gather(parts, one, |part, followed, out| out[0] = points(part, followed) as i64);
        let mut offsets = vec![0; counts.len() + 1];
        for (i, count) in counts.iter().enumerate() {
            offsets[i + 1] = offsets[i] + count;
        }
        (
            gather(
                parts,
                |part, followed| axes * points(part, followed),
                |part, followed, out: &mut [f64]| {
                    let control = match &followed.piece {
                        Shape::Conic(conic) => &conic.control[..],
                        Shape::Spline(spline) => part.spline(spline, splines).control,
                    };
                    for (row, point) in out.chunks_exact_mut(axes).zip(control) {
                        row.copy_from_slice(&point[..axes]);
                    }
                },
            ),
            rational.then(|| {
                gather(parts, points, |part, followed, out: &mut [f64]| match &followed.piece {
                    Shape::Conic(conic) => out.copy_from_slice(&[1.0, conic.weight, 1.0]),
                    Shape::Spline(spline) => match part.spline(spline, splines) {
                        Piece { weights: [], .. } => out.fill(1.0),
                        Piece { weights, .. } => out.copy_from_slice(weights),
                    },
                })
            }),
            offsets,
            gather(parts, one, |_, followed, out| out[0] = followed.piece.width()),
            gather(parts, one, |_, followed, out| out[0] = followed.feed),
            gather(
                parts,
                |_, _| 2,
                |_, followed, out: &mut [i64]| {
                    out.copy_from_slice(&[i64::from(followed.first), i64::from(followed.last)]);
                },
            ),
            gather(parts, one, |_, followed, out| out[0] = followed.tolerance),
        )
    })?;
    let (rows, count) = (control.len() / axes, width.len());
    let columns = (
        (
            PyArray1::from_vec(py, control).reshape([rows, axes]).expect("rows of axes values"),
            weights.map(|weights| PyArray1::from_vec(py, weights)),
            PyArray1::from_vec(py, offsets),
            PyArray1::from_vec(py, width),
        ),
        PyArray1::from_vec(py, feed),
        PyArray1::from_vec(py, moves).reshape([count, 2]).expect("n × 2 values"),
        PyArray1::from_vec(py, tolerance),
        PyArray1::from_vec(py, path.runs.iter().map(|&start| start as i64).collect()),
    );
    let offsets = path.offsets.map(|offsets| [offsets.mean(), offsets.inside, offsets.outside]);
    let summary = (path.points, path.splines, path.polynomials, path.deviation, offsets);
    let zones: Vec<i64> = path.rough.corners.iter().flatten().map(|&i| i64::from(i)).collect();
    let rough = (
        PyArray1::from_iter(py, path.rough.reversals.iter().map(|&i| i64::from(i))),
        PyArray1::from_vec(py, zones).reshape([path.rough.corners.len(), 2]).expect("k × 2 values"),
    );
    Ok((columns, summary, path.outside.map(|place| (place.index, place.axis, place.position)), rough))
}

/// One column, `stride` values a piece, written by all parts at once.
fn gather<const M: usize, T: Default + Clone + Send>(
    parts: &[Part<M>],
    stride: impl Fn(&Part<M>, &Followed<M>) -> usize + Sync,
    write: impl Fn(&Part<M>, &Followed<M>, &mut [T]) + Sync,
) -> Vec<T> {
    let length = |part: &Part<M>| part.pieces.iter().map(|followed| stride(part, followed)).sum();
    let lengths: Vec<usize> = parts.par_iter().map(length).collect();
    let mut column = vec![T::default(); lengths.iter().sum()];
    let mut rest = &mut column[..];
    let mut slices = Vec::with_capacity(parts.len());
    for length in lengths {
        let (slice, tail) = rest.split_at_mut(length);
        slices.push(slice);
        rest = tail;
    }
    parts.par_iter().zip(slices).for_each(|(part, mut slice)| {
        for followed in &part.pieces {
            let (out, tail) = slice.split_at_mut(stride(part, followed));
            write(part, followed, out);
            slice = tail;
        }
    });
    column
}
