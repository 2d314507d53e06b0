//! `build_path`: the moves of a program to the columns of its path.

use numpy::{PyArray1, PyArray2, PyArrayMethods, PyReadonlyArray1, PyReadonlyArray2, PyUntypedArrayMethods};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use rayon::prelude::*;

use super::arrays::{padded, padded_rows, row, rows, to_array2};
use super::curve::{Curve, Padded};
use super::moves::Moves;
use super::native::Of;
use super::with_padded_axes;
use super::work::run;
use feedplan_geometry::spline::regular::{regular, Regular};
use feedplan_geometry::spline::{CompositeCurve, Piece};
use feedplan_geometry::watch::Watch;
use feedplan_path::arc::ArcError;
use feedplan_path::corner::Rounding;
use feedplan_path::follow::{self, ArcShape, Fault, FollowOptions, Followed, Shape};
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

/// `feedplan.geometry.rules.Rules`.
#[derive(FromPyObject)]
struct Rules<'py> {
    name: String,
    feed: Floats<'py>,
    tolerance: Floats<'py>,
    fit_tolerance: Floats<'py>,
    halt: PyReadonlyArray1<'py, bool>,
    joints: PyReadonlyArray1<'py, bool>,
    splines: Option<Of<Curve>>,
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

impl Rules<'_> {
    fn require_lengths(&self, moves: &Moves) -> PyResult<()> {
        let columns = [&self.feed, &self.tolerance, &self.fit_tolerance].map(|column| column.len());
        let good =
            columns.into_iter().chain([self.halt.len(), self.joints.len()]).all(|len| len == moves.len())
                && self.travel.shape() == [moves.axes(), 2]
                && self.splines.as_ref().is_none_or(|splines| splines.axes() == moves.axes());
        good.then_some(()).ok_or_else(|| PyValueError::new_err("the rules do not fit the program"))
    }
}

/// The arcs of a program by their moves, in the columns of its axes.
fn arcs(moves: &Moves) -> PyResult<Vec<(usize, ArcShape)>> {
    let rows = moves.arc_centre.as_chunks::<3>().0.iter().zip(&moves.arc_normal).zip(&moves.arc_angle);
    let arc = |(&index, ((centre, &normal), &sweep)): (&i64, ((&[f64; 3], &u8), &f64))| {
        // An arc turns from the first of these to the second at a positive angle.
        let letters = [(normal + 1) % 3, (normal + 2) % 3].map(usize::from);
        let [Some(first), Some(second)] = letters.map(|letter| moves.xyz[letter]) else {
            return Err(PyValueError::new_err("an arc turns in an axis that the path does not have"));
        };
        let shape = ArcShape { plane: [first, second], centre: letters.map(|letter| centre[letter]), sweep };
        Ok((index as usize, shape))
    };
    moves.arc_move.iter().zip(rows).map(arc).collect()
}

/// The path of a program.
#[pyfunction]
#[pyo3(signature = (program, rules, progress=None))]
fn build_path<'py>(
    py: Python<'py>,
    program: Of<Moves>,
    rules: Rules<'py>,
    progress: Option<Bound<'py, PyAny>>,
) -> PyResult<(Columns<'py>, Summary, Option<Place>, Rough<'py>)> {
    let moves = &*program;
    let (axes, arcs) = (moves.axes(), arcs(moves)?);
    rules.require_lengths(moves)?;
    let spline_moves = moves.spline_move.iter().map(|&index| index as usize);
    let ranges: Vec<_> =
        moves.spline_pieces.windows(2).map(|ends| ends[0] as usize..ends[1] as usize).collect();
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
        let target = padded_rows::<M>(&moves.target, axes);
        let none = CompositeCurve::default();
        let given = rules.splines.as_ref().map_or(Ok(&none), |splines| splines.padded().map(|own| &**own))?;
        let Regular { curve: splines, ranges, .. } = run(py, None, |watch| regular(given, &ranges, watch))?;
        let spline_moves: Vec<_> = spline_moves.zip(ranges).collect();
        let starts = padded_rows::<M>(&moves.change_start, axes);
        let changes: Vec<_> = moves.change_move.iter().map(|&index| index as usize).zip(starts).collect();
        let followed = follow::Moves {
            start: padded(&moves.start, 0.0),
            kind: &moves.kind,
            target: &target,
            feed: rules.feed.as_slice()?,
            tolerance: rules.tolerance.as_slice()?,
            fit_tolerance: rules.fit_tolerance.as_slice()?,
            halt: rules.halt.as_slice()?,
            arcs: &arcs,
            spline_moves: &spline_moves,
            changes: &changes,
            splines: &splines,
            joints: rules.joints.as_slice()?,
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
            let (line, name, sentence) = (moves.line[error.index], &rules.name, sentence(error.fault));
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
