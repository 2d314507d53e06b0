//! The path of a program for Python: `build_path` computes its columns from the native moves and the rules.

use numpy::{PyArray1, PyUntypedArrayMethods};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyTuple;

use super::arrays::{indices, padded, padded_rows, require, row, rows, to_array2, Column, Table};
use super::axes::with_padded_axes;
use super::curve::Curve;
use super::memory;
use super::moves::Moves;
use super::native::Of;
use super::work::run;
use feedplan_geometry::parallel::{consume, map};
use feedplan_geometry::spline::regular::{regular, Regular};
use feedplan_geometry::spline::{CompositeCurve, Piece};
use feedplan_geometry::watch::Watch;
use feedplan_path::arc::ArcError;
use feedplan_path::corner::Rounding;
use feedplan_path::moves::{self, ArcShape, MoveFault, PathOptions};
use feedplan_path::path_builder::{Axes, BuiltPath, Chunk, Motion};
use feedplan_path::path_piece::{PathPiece, Shape};
use feedplan_path::PathOfMoves as _;

pyo3::import_exception!(feedplan.errors, ProgramError);

/// The travel of an axis that the path does not have.
const ANYWHERE: [f64; 2] = [f64::NEG_INFINITY, f64::INFINITY];

/// `feedplan.geometry.rules.Rules`.
#[derive(FromPyObject)]
pub struct Rules<'py> {
    name: String,
    feed: Column<'py>,
    tolerance: Column<'py>,
    fit_tolerance: Column<'py>,
    halt: Column<'py, bool>,
    joints: Column<'py, bool>,
    splines: Option<Of<Curve>>,
    max_velocity: Column<'py>,
    max_acceleration: Column<'py>,
    travel: Table<'py>,
    jump: bool,
    exact_tolerance: f64,
    max_chord: f64,
    corner_acceleration: f64,
    max_speed: f64,
    corner_angle: f64,
    corners: String,
}

/// `feedplan.geometry.rules.Motion`.
#[derive(FromPyObject)]
pub struct MotionArrays<'py> {
    run: Table<'py, i64>,
    start: Column<'py, i64>,
    place: Column<'py>,
    speed_sq: Column<'py>,
    second: Table<'py>,
    third: Table<'py>,
    max_jerk: Column<'py>,
}

impl MotionArrays<'_> {
    fn motion<const M: usize>(&self) -> PyResult<Motion<M>> {
        let runs: Vec<[usize; 2]> =
            self.run.as_slice()?.as_chunks().0.iter().map(|run: &[i64; 2]| run.map(|i| i as usize)).collect();
        let (start, place) = (indices(&self.start), self.place.as_slice()?.to_vec());
        let speed_sq = self.speed_sq.as_slice()?.to_vec();
        let aim: Vec<_> =
            rows(&self.second)?.into_iter().zip(rows(&self.third)?).map(<[_; 2]>::from).collect();
        let good = start.len() == runs.len() + 1
            && start.is_sorted()
            && start.last() == Some(&place.len())
            && [speed_sq.len(), aim.len()] == [place.len(); 2];
        let max_jerk = row::<M>(&self.max_jerk, f64::INFINITY)?;
        require(good, "the columns of the motion differ in length")?;
        Ok(Motion { runs, start, place, speed_sq, aim, max_jerk })
    }
}

impl Rules<'_> {
    fn require_lengths(&self, moves: &Moves) -> PyResult<()> {
        let columns = [&self.feed, &self.tolerance, &self.fit_tolerance].map(|column| column.len());
        let good =
            columns.into_iter().chain([self.halt.len(), self.joints.len()]).all(|len| len == moves.len())
                && self.travel.shape() == [moves.axes(), 2]
                && self.splines.as_ref().is_none_or(|splines| splines.axes() == moves.axes());
        require(good, "the rules do not fit the program")
    }
}

/// The arcs of a program: the index of the move of each, and its shape in the columns of the program's axes.
fn arcs(moves: &Moves) -> PyResult<Vec<(usize, ArcShape)>> {
    let rows = moves.arc_centre.as_chunks::<3>().0.iter().zip(&moves.arc_normal).zip(&moves.arc_angle);
    let arc = |(&index, ((centre, &normal), &sweep)): (&i64, ((&[f64; 3], &u8), &f64))| {
        // A positive sweep turns from the first of these axes to the second.
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
#[pyo3(signature = (program, rules, motion=None, progress=None))]
pub fn build_path<'py>(
    py: Python<'py>,
    program: Of<Moves>,
    rules: Rules<'py>,
    motion: Option<MotionArrays<'py>>,
    progress: Option<Bound<'py, PyAny>>,
) -> PyResult<Bound<'py, PyTuple>> {
    let moves = &*program;
    let (axes, arcs) = (moves.axes(), arcs(moves)?);
    rules.require_lengths(moves)?;
    let spline_moves = moves.spline_move.iter().map(|&index| index as usize);
    let ranges: Vec<_> =
        moves.spline_pieces.windows(2).map(|ends| ends[0] as usize..ends[1] as usize).collect();
    let corners = rules.corners.as_str();
    let options = PathOptions {
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
        let followed = moves::Moves {
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
        let motion = motion.as_ref().map(MotionArrays::motion::<M>).transpose()?;
        let build = |watch: Watch| {
            let path = match corners {
                "smooth" => followed.smooth_path(&options, &limits, motion.as_ref(), watch),
                _ => followed.path(&options, &limits, watch),
            };
            path.map(|path| (PieceColumns::of(&path, &splines), path))
        };
        let (pieces, path) = run(py, progress.as_ref(), build)?.map_err(|error| {
            let (line, name, sentence) = (moves.line[error.index], &rules.name, sentence(error.fault));
            ProgramError::new_err((format!("{name}, line {line}: {sentence}"), line))
        })?;
        let columns = columns(py, &path, pieces, axes);
        drop(path);
        py.detach(memory::give_back);
        columns
    })
}

fn sentence(fault: MoveFault) -> &'static str {
    match fault {
        MoveFault::Length => {
            "the move has no length, or a coordinate is not a finite number: correct the block"
        }
        MoveFault::Feed => "the move has no positive feed: give F a value above 0",
        MoveFault::Arc(ArcError::Radius) => {
            "the arc has no radius, or no finite one: correct its centre or its end"
        }
        MoveFault::Arc(ArcError::Sweep) => {
            "the arc does not lead to its end point: correct its centre or its end"
        }
        MoveFault::Spline => "the move has no spline: give its pieces",
        MoveFault::Arc(ArcError::Turns) => "the arc has too many turns to be followed: give fewer",
    }
}

/// The pieces of a path as columns.
struct PieceColumns<const M: usize> {
    curve: CompositeCurve<M>,
    feed: Vec<f64>,
    /// The first and the last move of each piece.
    moves: Vec<[i64; 2]>,
    tolerance: Vec<f64>,
}

impl<const M: usize> PieceColumns<M> {
    fn of(path: &BuiltPath<M>, splines: &CompositeCurve<M>) -> Self {
        let chunks = &path.chunks;
        let points = |chunk: &Chunk<M>, piece: &PathPiece<M>| match &piece.shape {
            Shape::Conic(_) => 3,
            Shape::Spline(spline) => chunk.spline(spline, splines).control.len(),
        };
        let one = |_: &Chunk<M>, _: &PathPiece<M>| 1;
        let is_rational = |chunk: &Chunk<M>, piece: &PathPiece<M>| match &piece.shape {
            Shape::Conic(conic) => conic.weight != 1.0,
            Shape::Spline(spline) => chunk.spline(spline, splines).is_rational(),
        };
        let rational = chunks.iter().any(|chunk| chunk.pieces.iter().any(|piece| is_rational(chunk, piece)));
        let mut offsets = vec![0];
        offsets.extend(gather(chunks, 0, one, |chunk, piece, out| out[0] = points(chunk, piece)));
        for i in 1..offsets.len() {
            offsets[i] += offsets[i - 1];
        }
        let curve = CompositeCurve {
            control: gather(chunks, [0.0; M], points, |chunk, piece, out| {
                out.copy_from_slice(match &piece.shape {
                    Shape::Conic(conic) => &conic.control,
                    Shape::Spline(spline) => chunk.spline(spline, splines).control,
                });
            }),
            weights: match rational {
                false => vec![],
                true => gather(chunks, 0.0, points, |chunk, piece, out| match &piece.shape {
                    Shape::Conic(conic) => out.copy_from_slice(&[1.0, conic.weight, 1.0]),
                    Shape::Spline(spline) => match chunk.spline(spline, splines) {
                        Piece { weights: [], .. } => out.fill(1.0),
                        Piece { weights, .. } => out.copy_from_slice(weights),
                    },
                }),
            },
            offsets,
            width: gather(chunks, 0.0, one, |_, piece, out| out[0] = piece.shape.width()),
        };
        Self {
            curve,
            feed: gather(chunks, 0.0, one, |_, piece, out| out[0] = piece.feed),
            moves: gather(chunks, [0; 2], one, |_, piece, out| {
                out[0] = [i64::from(piece.first), i64::from(piece.last)];
            }),
            tolerance: gather(chunks, 0.0, one, |_, piece, out| out[0] = piece.tolerance),
        }
    }
}

/// 1. The curve; feeds, first and last moves, tolerances and runs of the path.
/// 2. The numbers of chords, splines and polynomials of the fit; the deviation; for a smooth path the mean signed distance of
///    bends and their greatest distances to the inside and to the outside.
/// 3. Move, axis and position of the first place outside the travel.
/// 4. Moves at whose end a smooth path turns back; first and last move (k, 2) of each place where its corners are rounded
///    one by one.
fn columns<'py, const M: usize>(
    py: Python<'py>,
    path: &BuiltPath<M>,
    pieces: PieceColumns<M>,
    axes: usize,
) -> PyResult<Bound<'py, PyTuple>> {
    let columns = (
        Curve::checked(pieces.curve, axes)?,
        PyArray1::from_vec(py, pieces.feed),
        to_array2(py, pieces.moves, 2),
        PyArray1::from_vec(py, pieces.tolerance),
        PyArray1::from_vec(py, path.runs.iter().map(|&start| start as i64).collect()),
    );
    let offsets = path.offsets.map(|offsets| [offsets.mean(), offsets.inside, offsets.outside]);
    let summary = (path.fit.chords, path.fit.splines, path.fit.polynomials, path.deviation, offsets);
    let zones = path.not_smooth.corners.iter().map(|zone| zone.map(i64::from)).collect();
    let reversals = path.not_smooth.reversals.iter().map(|&i| i64::from(i));
    let not_smooth = (PyArray1::from_iter(py, reversals), to_array2(py, zones, 2));
    let outside = path.outside.map(|place| (place.index, place.axis, place.position));
    (columns, summary, outside, not_smooth).into_pyobject(py)
}

/// Makes one column with `stride` values per piece, which `write` sets; chunks are written in parallel.
fn gather<const M: usize, T: Copy + Send>(
    chunks: &[Chunk<M>],
    initial: T,
    stride: impl Fn(&Chunk<M>, &PathPiece<M>) -> usize + Sync,
    write: impl Fn(&Chunk<M>, &PathPiece<M>, &mut [T]) + Sync,
) -> Vec<T> {
    let length = |chunk: &Chunk<M>| chunk.pieces.iter().map(|piece| stride(chunk, piece)).sum();
    let lengths: Vec<usize> = map(chunks.len(), 1, |i| length(&chunks[i]));
    let mut column = vec![initial; lengths.iter().sum()];
    let mut rest = &mut column[..];
    let mut slices = Vec::with_capacity(chunks.len());
    for length in lengths {
        let (slice, tail) = rest.split_at_mut(length);
        slices.push(slice);
        rest = tail;
    }
    consume(slices, |i, mut slice| {
        for piece in &chunks[i].pieces {
            let (out, tail) = slice.split_at_mut(stride(&chunks[i], piece));
            write(&chunks[i], piece, out);
            slice = tail;
        }
    });
    column
}
