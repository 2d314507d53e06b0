//! The audit of plans for Python: takes the package's own types, returns findings.

use numpy::PyUntypedArrayMethods;
use pyo3::prelude::*;

use super::arrays::{padded, require, Column, Table};
use super::axes::with_axes_of_audit;
use super::curve::Curve;
use super::memory;
use super::moves::Moves;
use super::native::Of;
use super::profile::Profile;
use super::work::run;

use feedplan_audit::curve::{Followed, Pieces};
use feedplan_audit::kernels::PlanKernels;
use feedplan_audit::moves::Programmed;
use feedplan_audit::phases::Phases;
use feedplan_audit::{Check, Limits, Sided, Tally, FEEDS};

const OF_PATH: &str = "the arrays of the path differ in length";

/// Memory is given back before the audit of a path of at least this many pieces: fit and plan may leave some kilobytes for each.
const LONG: usize = 20_000;

/// The use of one limit: its name, axis (−1: none), worst value, limit, ratio, time, source line.
type Finding = (&'static str, i64, f64, f64, f64, f64, i32);

/// The findings, and the number of samples checked.
pub type Findings = (Vec<Finding>, u64);

pub fn findings<const M: usize>(tally: &Tally<M>, axes: usize) -> Findings {
    let mut found = Vec::new();
    for check in Check::ALL {
        for axis in 0..if check.per_axis() { axes } else { 1 } {
            let worst = tally.get(check, axis);
            if worst.ratio >= 0.0 {
                let axis = if check.per_axis() { axis as i64 } else { -1 };
                let name = check.name();
                found.push((name, axis, worst.value, worst.limit, worst.ratio, worst.time, worst.line));
            }
        }
    }
    (found, tally.samples)
}

fn pieces(curve: &Curve) -> Pieces<'_> {
    let (control, stride) = curve.coordinates();
    Pieces {
        axes: curve.axes(),
        stride,
        control,
        weights: curve.weight_slice(),
        offsets: curve.piece_offsets(),
        width: curve.widths(),
    }
}

/// `feedplan.Path`.
#[derive(FromPyObject)]
struct PathArrays<'py> {
    curve: Of<Curve>,
    line: Column<'py, i32>,
    #[pyo3(attribute("move"))]
    moves: Table<'py, i64>,
    tolerance: Column<'py>,
    runs: Column<'py, i64>,
    new_words: Column<'py, bool>,
    start_dwell: f64,
    dwell: Column<'py>,
}

/// `feedplan.constraints.problem.Problem`; its other limits are in `LimitArrays`.
#[derive(FromPyObject)]
pub struct ProblemArrays<'py> {
    path: PathArrays<'py>,
    feed_share: Option<Table<'py>>,
    junction_speed: Column<'py>,
}

impl ProblemArrays<'_> {
    pub fn axes(&self) -> usize {
        self.path.curve.axes()
    }

    /// The factors of the axes in the feed, one row per piece, or empty.
    fn share(&self) -> PyResult<&[f64]> {
        Ok(self.feed_share.as_ref().map_or(Ok(&[][..]), |share| share.as_slice())?)
    }

    /// The path with its feeds; `feed` contains the `FEEDS` greatest speeds of each piece.
    pub fn followed<'a>(&'a self, feed: &'a Table<'_>) -> PyResult<Followed<'a>> {
        let followed = Followed { feed: feed.as_slice()?, ..self.unlimited()? };
        require(followed.feed.len() == FEEDS * followed.len(), OF_PATH)?;
        Ok(followed)
    }

    pub fn junction_speed(&self) -> PyResult<&[f64]> {
        Ok(self.junction_speed.as_slice()?)
    }

    /// The path without its feeds.
    pub fn unlimited(&self) -> PyResult<Followed<'_>> {
        let path = &self.path;
        let followed = Followed {
            pieces: pieces(&path.curve),
            feed: &[],
            line: path.line.as_slice()?,
            moves: path.moves.as_slice()?,
            tolerance: path.tolerance.as_slice()?,
            runs: path.runs.as_slice()?,
            new_words: path.new_words.as_slice()?,
            start_dwell: path.start_dwell,
            dwell: path.dwell.as_slice()?,
        };
        let pieces = followed.len();
        let runs = followed.runs;
        let ordered = runs.windows(2).all(|pair| pair[0] <= pair[1]);
        let spanned = runs.first() == Some(&0) && runs.last() == Some(&(pieces as i64));
        let good = [followed.line.len(), followed.tolerance.len()] == [pieces; 2]
            && self.share()?.len() % (self.axes() * pieces).max(1) == 0
            && followed.moves.len() == 2 * pieces
            && followed.dwell.len() + 1 == runs.len()
            && self.junction_speed.as_slice()?.len() == pieces + 1
            && ordered
            && spanned;
        require(good, OF_PATH)?;
        Ok(followed)
    }
}

/// The phases of a profile in the form that the audit takes.
pub fn phases<'a>(profile: &'a Profile, problem: &'a ProblemArrays<'_>) -> PyResult<Phases<'a>> {
    Ok(Phases {
        piece: &profile.piece,
        kind: &profile.kind,
        axis: &profile.axis,
        value: &profile.value,
        u0: &profile.u0,
        u1: &profile.u1,
        p0: &profile.p0,
        p1: &profile.p1,
        duration: &profile.duration,
        a0: &profile.a0,
        a1: &profile.a1,
        share: problem.share()?,
        pieces: problem.path.line.len(),
        runs: &profile.runs,
    })
}

/// The moves of a program for a path of `axes` axes.
pub fn programmed(moves: &Moves, axes: usize) -> PyResult<Programmed<'_>> {
    let none = Pieces { axes, stride: axes, control: &[], weights: &[], offsets: &[0], width: &[] };
    require(moves.axes() == axes, "the arrays of the program differ in length")?;
    Ok(Programmed {
        axes,
        start: &moves.start,
        target: &moves.target,
        line: &moves.line,
        arc_move: &moves.arc_move,
        arc_centre: &moves.arc_centre,
        arc_normal: &moves.arc_normal,
        arc_angle: &moves.arc_angle,
        spline_move: &moves.spline_move,
        spline_pieces: &moves.spline_pieces,
        splines: moves.splines.as_ref().map_or(none, |splines| pieces(splines.get())),
        change_move: &moves.change_move,
        change_start: &moves.change_start,
        xyz: moves.xyz,
    })
}

/// `feedplan.audit._Limits`: the limits that hold everywhere, one number per axis.
#[derive(FromPyObject)]
pub struct LimitArrays {
    max_velocity: Vec<f64>,
    max_acceleration: Vec<f64>,
    min_velocity: Vec<f64>,
    min_acceleration: Vec<f64>,
    max_jerk: Vec<f64>,
    judges_jerk: bool,
    max_velocity_jump: Vec<f64>,
    jump_beyond: Vec<f64>,
    travel: Vec<[f64; 2]>,
    feed_axes: Vec<Vec<f64>>,
    chord_tolerance: f64,
    period: f64,
    end_speeds: [f64; 2],
}

impl LimitArrays {
    /// Number of axes.
    pub fn axes(&self) -> usize {
        self.max_velocity.len()
    }

    /// The limits for `axes` of M axes; the others are at rest.
    pub fn limits<const M: usize>(&self, axes: usize) -> PyResult<Limits<M>> {
        let jumps = [&self.max_velocity_jump, &self.jump_beyond];
        let least = [&self.min_velocity, &self.min_acceleration];
        let most = [&self.max_velocity, &self.max_acceleration, &self.max_jerk];
        let good = axes <= M
            && self.feed_axes.len() == FEEDS
            && self.feed_axes.iter().all(|row| row.len() == axes)
            && most.into_iter().chain(least).chain(jumps).all(|row| row.len() == axes)
            && self.travel.len() == axes;
        require(good, "the arrays of the limits differ in length")?;
        fn at_rest<const M: usize>(values: &[f64]) -> [f64; M] {
            padded(values, 0.0)
        }
        fn sided<const M: usize>(most: &[f64], least: &[f64]) -> Sided<M> {
            Sided { positive: at_rest(most), negative: at_rest(least).map(|value: f64| -value) }
        }
        let anywhere = [f64::NEG_INFINITY, f64::INFINITY];
        Ok(Limits {
            axes,
            velocity: sided(&self.max_velocity, &self.min_velocity),
            acceleration: sided(&self.max_acceleration, &self.min_acceleration),
            jerk: at_rest(&self.max_jerk),
            judges_jerk: self.judges_jerk,
            jump: at_rest(&self.max_velocity_jump),
            jump_beyond: at_rest(&self.jump_beyond),
            travel: std::array::from_fn(|k| self.travel.get(k).copied().unwrap_or(anywhere)),
            feed_axes: std::array::from_fn(|feed| at_rest(&self.feed_axes[feed])),
            chord_tolerance: self.chord_tolerance,
            period: self.period,
            end_speeds: self.end_speeds,
        })
    }
}

/// Audits path and profile, and the path against the program.
#[pyfunction]
#[pyo3(signature = (problem, limits, feed, profile=None, program=None, progress=None))]
pub fn audit_plan(
    py: Python<'_>,
    problem: ProblemArrays<'_>,
    limits: LimitArrays,
    feed: Table<'_>,
    profile: Option<Of<Profile>>,
    program: Option<Of<Moves>>,
    progress: Option<Bound<'_, PyAny>>,
) -> PyResult<Findings> {
    let path = problem.followed(&feed)?;
    // After a short plan, giving memory back and allocating it again takes longer than it is worth.
    if path.len() >= LONG {
        py.detach(memory::give_back);
    }
    let junction_speed = problem.junction_speed.as_slice()?;
    let phases = profile.as_ref().map(|profile| phases(profile, &problem)).transpose()?;
    let program = program.as_ref().map(|moves| programmed(moves, problem.axes())).transpose()?;
    with_axes_of_audit!(problem.axes(), M, {
        let limits = limits.limits::<M>(path.axes)?;
        run(py, progress.as_ref(), |watch| {
            let pieces = path.len();
            // The approximate share of each audit in the time.
            let [of_path, of_profile, of_deviation] = [0.05, 0.45, 0.5].map(|share| watch.part(share));
            let seen = |count| of_path.each(pieces).advance(count);
            let mut tally = limits.path(&path, phases.as_ref(), &seen);
            if let Some(phases) = &phases {
                let seen = |count| of_profile.each(phases.len()).advance(count);
                tally = tally.merge(limits.profile(&path, junction_speed, phases, &seen));
            }
            if let Some(program) = &program {
                let seen = |count| of_deviation.each(pieces + program.len()).advance(count);
                tally = tally.merge(limits.deviation(&path, program, phases.as_ref(), &seen));
            }
            findings(&tally, path.axes)
        })
    })
}
