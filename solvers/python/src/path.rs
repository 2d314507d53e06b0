//! `build_path`: the columns of a program to the columns of its path.

use std::ops::Range;

use numpy::{PyArray1, PyArray2, PyArrayMethods, PyReadonlyArray1, PyReadonlyArray2, PyUntypedArrayMethods};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use rayon::prelude::*;

use super::arrays::{indices, row, rows, to_array2};
use super::curve::{Curve, Padded};
use super::native::Of;
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

type Floats<'py> = PyReadonlyArray1<'py, f64>;
type Rows<'py> = PyReadonlyArray2<'py, f64>;
type Numbers<'py> = PyReadonlyArray1<'py, i64>;

/// `feedplan.geometry.moves.Moves`.
#[derive(FromPyObject)]
struct MoveArrays<'py> {
    name: String,
    start: Floats<'py>,
    kind: PyReadonlyArray1<'py, u8>,
    target: Rows<'py>,
    feed: Floats<'py>,
    line: PyReadonlyArray1<'py, i32>,
    tolerance: Floats<'py>,
    fit_tolerance: Floats<'py>,
    halt: PyReadonlyArray1<'py, bool>,
    joints: PyReadonlyArray1<'py, bool>,
    arc_move: Numbers<'py>,
    arc_plane: PyReadonlyArray2<'py, i64>,
    arc_centre: Rows<'py>,
    arc_angle: Floats<'py>,
    spline_move: Numbers<'py>,
    spline_pieces: Numbers<'py>,
    splines: Option<Of<Curve>>,
    change_move: Numbers<'py>,
    change_start: Rows<'py>,
}

/// `feedplan.geometry.moves.Rules`.
#[derive(FromPyObject)]
struct Rules<'py> {
    max_velocity: Floats<'py>,
    max_acceleration: Floats<'py>,
    travel: Rows<'py>,
    jump: bool,
    exact_tolerance: f64,
    max_chord: f64,
    corner_acceleration: f64,
    max_speed: f64,
    corner_angle: f64,
    corners: String,
}

/// The curve; feeds, first and last moves, tolerances and runs of the path.
type Columns<'py> = (
    Curve,
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

impl MoveArrays<'_> {
    fn len(&self) -> usize {
        self.kind.len()
    }

    fn axes(&self) -> usize {
        self.start.len()
    }

    fn require_lengths(&self, travel: &Rows) -> PyResult<()> {
        let (count, axes, arcs, changes) =
            (self.len(), self.axes(), self.arc_move.len(), self.change_move.len());
        let columns = [self.feed.len(), self.tolerance.len(), self.fit_tolerance.len()];
        let others = [self.line.len(), self.halt.len(), self.joints.len()];
        let good = self.target.shape() == [count, axes]
            && columns.iter().chain(&others).all(|&len| len == count)
            && self.arc_plane.shape() == [arcs, 2]
            && self.arc_centre.shape() == [arcs, 2]
            && self.arc_angle.len() == arcs
            && travel.shape() == [axes, 2]
            && self.spline_pieces.len() == self.spline_move.len() + 1
            && (changes == 0 || self.change_start.shape() == [changes, axes])
            && self.splines.as_ref().is_none_or(|splines| splines.axes() == axes);
        good.then_some(()).ok_or_else(|| PyValueError::new_err("the columns of the program differ in length"))
    }

    fn arcs(&self) -> PyResult<Vec<(usize, ArcShape)>> {
        let (planes, centres) = (self.arc_plane.as_slice()?.as_chunks().0, self.arc_centre.as_slice()?);
        let shapes = planes.iter().zip(centres.as_chunks().0).zip(self.arc_angle.as_slice()?);
        indices(&self.arc_move)
            .into_iter()
            .zip(shapes)
            .map(|(index, ((plane, &centre), &sweep))| {
                let plane = plane.map(|axis: i64| usize::try_from(axis).unwrap_or(usize::MAX));
                if plane.iter().any(|&axis| axis >= self.axes()) || index >= self.len() {
                    return Err(PyValueError::new_err(
                        "an arc refers to a move or an axis that does not exist",
                    ));
                }
                Ok((index, ArcShape { plane, centre, sweep }))
            })
            .collect()
    }

    /// Spline moves and the pieces that they take.
    fn spline_ranges(&self) -> PyResult<(Vec<usize>, Vec<Range<usize>>)> {
        let pieces = self.splines.as_ref().map_or(0, |splines| splines.widths().len());
        let moves = indices(&self.spline_move);
        let ranges: Vec<_> = indices(&self.spline_pieces).windows(2).map(|ends| ends[0]..ends[1]).collect();
        let good = moves.iter().all(|&index| index < self.len())
            && ranges.iter().all(|range| range.start <= range.end && range.end <= pieces);
        let pair = good.then_some((moves, ranges));
        pair.ok_or_else(|| PyValueError::new_err("a spline refers to a move or a piece that does not exist"))
    }
}

/// The path of a program.
#[pyfunction]
#[pyo3(signature = (moves, rules, progress=None))]
fn build_path<'py>(
    py: Python<'py>,
    moves: MoveArrays<'py>,
    rules: Rules<'py>,
    progress: Option<Bound<'py, PyAny>>,
) -> PyResult<(Columns<'py>, Summary, Option<Place>, Rough<'py>)> {
    moves.require_lengths(&rules.travel)?;
    let (axes, arcs) = (moves.axes(), moves.arcs()?);
    let (spline_moves, ranges) = moves.spline_ranges()?;
    let corners = rules.corners.as_str();
    let options = FollowOptions {
        exact_tolerance: rules.exact_tolerance,
        max_chord: rules.max_chord,
        corner_acceleration: rules.corner_acceleration,
        max_speed: rules.max_speed,
        corner_angle: rules.corner_angle,
        rounding: if corners == "arcs" { Rounding::Circle } else { Rounding::Parabola },
    };
    with_padded_axes!(axes, M, {
        let target = rows::<M>(&moves.target)?;
        let none = CompositeCurve::default();
        let given = moves.splines.as_ref().map_or(Ok(&none), |splines| splines.padded().map(|own| &**own))?;
        let Regular { curve: splines, ranges, .. } = run(py, None, |watch| regular(given, &ranges, watch))?;
        let spline_moves: Vec<_> = spline_moves.into_iter().zip(ranges).collect();
        let starts = if moves.change_move.len() > 0 { rows::<M>(&moves.change_start)? } else { vec![] };
        let changes: Vec<_> = indices(&moves.change_move).into_iter().zip(starts).collect();
        let followed = Moves {
            start: row::<M>(&moves.start, 0.0)?,
            kind: moves.kind.as_slice()?,
            target: &target,
            feed: moves.feed.as_slice()?,
            tolerance: moves.tolerance.as_slice()?,
            fit_tolerance: moves.fit_tolerance.as_slice()?,
            halt: moves.halt.as_slice()?,
            arcs: &arcs,
            spline_moves: &spline_moves,
            changes: &changes,
            splines: &splines,
            joints: moves.joints.as_slice()?,
        };
        let travel = rows::<2>(&rules.travel)?;
        let limits = Axes {
            max_velocity: row::<M>(&rules.max_velocity, 1.0)?,
            max_acceleration: row::<M>(&rules.max_acceleration, 1.0)?,
            travel: std::array::from_fn(|k| travel.get(k).copied().unwrap_or(ANYWHERE)),
            jump: rules.jump,
        };
        let build = |watch: Watch| match corners {
            "smooth" | "fastest" => followed.smooth_path(&options, &limits, corners == "smooth", watch),
            _ => followed.path(&options, &limits, watch),
        };
        let path = run(py, progress.as_ref(), build)?.map_err(|error| {
            let line = moves.line.as_slice().map_or(0, |lines| lines[error.index]);
            let (name, sentence) = (&moves.name, sentence(error.fault));
            ProgramError::new_err((format!("{name}, line {line}: {sentence}"), line))
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
) -> PyResult<(Columns<'py>, Summary, Option<Place>, Rough<'py>)>
where
    Padded: From<CompositeCurve<M>>,
{
    let parts = &path.parts;
    let points = |part: &Part<M>, followed: &Followed<M>| match &followed.piece {
        Shape::Conic(_) => 3,
        Shape::Spline(spline) => part.spline(spline, splines).control.len(),
    };
    let one = |_: &Part<M>, _: &Followed<M>| 1;
    let (curve, feed, moves, tolerance) = run(py, progress, |watch| {
        // The path is there.
        watch.advance(1);
        let is_rational = |part: &Part<M>, followed: &Followed<M>| match &followed.piece {
            Shape::Conic(conic) => conic.weight != 1.0,
            Shape::Spline(spline) => part.spline(spline, splines).is_rational(),
        };
        let rational =
            parts.par_iter().any(|part| part.pieces.iter().any(|followed| is_rational(part, followed)));
        let mut offsets = vec![0];
        offsets.extend(gather(parts, 0, one, |part, followed, out| out[0] = points(part, followed)));
        for i in 1..offsets.len() {
            offsets[i] += offsets[i - 1];
        }
        let curve = CompositeCurve {
            control: gather(parts, [0.0; M], points, |part, followed, out| {
                out.copy_from_slice(match &followed.piece {
                    Shape::Conic(conic) => &conic.control,
                    Shape::Spline(spline) => part.spline(spline, splines).control,
                });
            }),
            weights: match rational {
                false => vec![],
                true => gather(parts, 0.0, points, |part, followed, out| match &followed.piece {
                    Shape::Conic(conic) => out.copy_from_slice(&[1.0, conic.weight, 1.0]),
                    Shape::Spline(spline) => match part.spline(spline, splines) {
                        Piece { weights: [], .. } => out.fill(1.0),
                        Piece { weights, .. } => out.copy_from_slice(weights),
                    },
                }),
            },
            offsets,
            width: gather(parts, 0.0, one, |_, followed, out| out[0] = followed.piece.width()),
        };
        (
            curve,
            gather(parts, 0.0, one, |_, followed, out| out[0] = followed.feed),
            gather(parts, [0; 2], one, |_, followed, out| {
                out[0] = [i64::from(followed.first), i64::from(followed.last)];
            }),
            gather(parts, 0.0, one, |_, followed, out| out[0] = followed.tolerance),
        )
    })?;
    let columns = (
        Curve::checked(curve, axes)?,
        PyArray1::from_vec(py, feed),
        to_array2(py, moves, 2),
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

/// One column, `stride` values a piece in place of `initial`, written by all parts at once.
fn gather<const M: usize, T: Copy + Send>(
    parts: &[Part<M>],
    initial: T,
    stride: impl Fn(&Part<M>, &Followed<M>) -> usize + Sync,
    write: impl Fn(&Part<M>, &Followed<M>, &mut [T]) + Sync,
) -> Vec<T> {
    let length = |part: &Part<M>| part.pieces.iter().map(|followed| stride(part, followed)).sum();
    let lengths: Vec<usize> = parts.par_iter().map(length).collect();
    let mut column = vec![initial; lengths.iter().sum()];
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
