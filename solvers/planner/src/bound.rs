//! A proven lower bound on the time of any profile that keeps the limits.
//!
//! The path is divided into cells; any division gives a bound. From the limits alone, with nothing of any profile:
//!
//! * At a node, x = (dt/dτ)²/ω⁴ is at most what feed, axis velocities and the chord error allow, and no greater than
//!   the limit curve: two axes' accelerations without their common term.
//! * Over a cell, v_k² of axis k changes by at most 2 A_k times its way to and fro, so that x at one node limits x at
//!   the next, backward and forward. On an arc on which axis k governs this is met exactly, which is why the arcs of
//!   a profile are the cells to start with.
//! * Between two nodes no axis is faster than by full acceleration from the greatest speed at one and to that at the
//!   other, and the tool no faster than the feed.
//!
//! One sweep from the end of a run and one from its start leave a greatest x at every node that no admissible profile
//! exceeds; the sum of the cells' least times is the bound. A wrong profile can make it loose, never wrong. Where the
//! bound of an arc misses its duration, its cells are halved, as long as that helps.
//!
//! Rounding: tangents of a piece, on which all else rests, come with a bound on their error that counts every operation
//! twice over (`hodograph`); they enter every quotient from the side that loosens the bound. A formula of at most
//! sixteen operations on positive numbers is then widened by `UP` or `DOWN`. What is not a number or infinite is no
//! limit: `f64::min` and `max` pass it over. Numbers below 1e-150 are not expected.
//!
//! | file | idea |
//! |---|---|
//! | `hodograph` | tangents, slopes and ways of a piece with their errors |
//! | `piece` | the greatest x at a node, its rise over a cell, the least time of a cell |
//! | `time`, `length` | of an axis between two speeds; of the tool's path |
//! | `chord` | the chord-error limit at a node and over a cell |
//! | `cells` | division of a run, refined |
//! | `sweep` | both sweeps over a run |

mod cells;
mod chord;
mod hodograph;
mod length;
mod piece;
mod sweep;
mod time;

use rayon::prelude::*;

use crate::problem::{greater, Both, ChordLimit, Fault, Problem};
use crate::runs::groups;
use cells::Cells;
use feedplan_geometry::quadratic::norm;

/// More and less than the rounding of sixteen operations.
const UP: f64 = 1.0 + 16.0 * f64::EPSILON;
const DOWN: f64 = 1.0 - 16.0 * f64::EPSILON;
/// Joints that stand in for the true ones, and the tool's speed beside them, are off by less than this part of any
/// limit; see `feedplan/constraints/joints.py`.
const STAND_IN: f64 = 1e-8;
/// Refinement stops when the bound is this near the profile's time, relative to it.
const NEAR: f64 = 5e-4;
/// An arc is refined while its bound misses more than this part of its duration.
const POOR: f64 = 2e-4;
/// Where a round closes less than this part of the gap all arcs are refined: what makes one poor may be how fast its
/// neighbour lets it be entered. Refinement stops after so many such rounds on end, and after this many rounds, or
/// cells per arc beside a few.
const LEAST_GAIN: f64 = 0.02;
const PATIENCE: usize = 3;
/// Every bound misses more.
const ALL: f64 = f64::NEG_INFINITY;
/// A place nearer to an end of a cell than this part of it is that end.
const AT_END: f64 = 1e-3;
const MOST_ROUNDS: usize = 14;
const MOST_CELLS: usize = 12;
const FEW_CELLS: usize = 20_000;

/// Computes what all bounds share. A process that is forked while a thread computes it would wait for it for ever.
pub fn prepare() {
    length::prepare();
}

/// The profile beside which the bound is asked for: only where cells begin and what is gained by more of them
/// depends on it.
#[derive(Clone, Copy)]
pub struct Hint<'a> {
    /// Of each arc: its piece, the axis that governs, its end on the piece, its duration in s.
    pub piece: &'a [u32],
    /// That governs, any other number for none.
    pub axis: &'a [u8],
    pub u1: &'a [f64],
    pub duration: &'a [f64],
}

/// The problem as the runs see it.
struct Task<'a, const M: usize> {
    problem: &'a Problem<'a, M>,
    acceleration: Both<M>,
    velocity_sq: Both<M>,
    /// What speeds squared may exceed theirs by, as a factor.
    speed_share: f64,
    chord: Option<ChordLimit>,
}

/// A lower bound in s on the time of every profile that keeps the problem's limits.
pub fn lower_bound<const M: usize>(problem: &Problem<M>, hint: &Hint) -> Result<f64, Fault> {
    problem.check()?;
    let arcs = hint.piece.len();
    if hint.axis.len() != arcs
        || hint.u1.len() != arcs
        || hint.duration.len() != arcs
        || arcs >= u32::MAX as usize
    {
        let what = format!("the columns of the profile differ in length from its {arcs} pieces");
        return Err(Fault::Input { piece: None, what });
    }
    let share = if problem.tip.is_some() { 1.0 + STAND_IN } else { 1.0 };
    let task = Task {
        problem,
        acceleration: problem.max_acceleration.map(|side| side.map(|a| a * share)),
        velocity_sq: problem.max_velocity.map(|side| side.map(|v| (v * share) * (v * share) * UP)),
        speed_share: share * share * UP,
        // The chord error is that of the tool's path: where joints move in another way it is left out.
        chord: match problem.tip {
            None => ChordLimit::new(
                problem.chord_tolerance,
                problem.period,
                norm(&greater(&problem.max_acceleration)),
            ),
            Some(_) => None,
        },
    };
    let last_run = problem.runs.len() - 2;
    let times: Vec<f64> = groups(problem.runs)
        .par_iter()
        .map(|group| {
            let mut space = (Cells::default(), Cells::default());
            let of_run = |run: usize| {
                let start = if run == 0 { problem.start_speed } else { 0.0 };
                let end = if run == last_run { problem.end_speed } else { 0.0 };
                let pieces = (problem.runs[run], problem.runs[run + 1]);
                over_run(&task, pieces, (start * start, end * end), hint, &mut space)
            };
            group.clone().map(of_run).sum()
        })
        .collect();
    let rounding = problem.runs.len() as f64 * f64::EPSILON;
    Ok(times.iter().sum::<f64>() * (1.0 - rounding))
}

/// The bound of one run.
fn over_run<const M: usize>(
    task: &Task<M>,
    pieces: (usize, usize),
    (start_sq, end_sq): (f64, f64),
    hint: &Hint,
    (cells, other): &mut (Cells, Cells),
) -> f64 {
    let turn = |i: usize, axis: usize, part: (f64, f64)| {
        task.problem.watch.check_at(i);
        sweep::turn(task, i, axis, part)
    };
    cells.divide(hint, pieces, task.problem.width, turn);
    // Where an axis turns, else half way; the turn at which a cell ends already is none of it.
    let middle = |i: usize, (from, to): (f64, f64)| {
        let inside = |t: &f64| (t - from).min(to - t) > AT_END * (to - from);
        let mut turns = (0..M).filter_map(|k| turn(pieces.0 + i, k, (from, to)));
        turns.find(inside).unwrap_or(0.5 * (from + to))
    };
    let arcs = hint.piece.partition_point(|&piece| (piece as usize) < pieces.0)
        ..hint.piece.partition_point(|&piece| (piece as usize) < pieces.1);
    let duration: f64 = hint.duration.get(arcs).unwrap_or(&[]).iter().sum();
    let most = MOST_CELLS * cells.end.len() + FEW_CELLS;
    let wanted = |arc: u32| match hint.duration.get(arc as usize) {
        Some(duration) => (hint.axis[arc as usize] as usize, (1.0 - 0.1 * POOR) * duration),
        None => (M, f64::INFINITY),
    };
    let (mut best, mut idle) = (0.0, 0);
    // How many rounds it takes is not known: each counts as half of what is left.
    let mut watch = task.problem.watch.each(task.problem.width.len());
    for _ in 0..MOST_ROUNDS {
        watch = watch.part(0.5);
        sweep::backward(task, pieces, end_sq, cells);
        let bound = sweep::forward(task, pieces, start_sq, wanted, cells);
        watch.advance(pieces.1 - pieces.0);
        let gained = bound - best > LEAST_GAIN * (duration - best);
        idle = if gained { 0 } else { idle + 1 };
        best = bound.max(best);
        let near = best >= (1.0 - NEAR) * duration;
        let part = if idle == 0 { POOR } else { ALL };
        if near || idle == PATIENCE || cells.halve(hint, part, middle, other) == 0 || cells.end.len() > most {
            break;
        }
    }
    watch.advance(pieces.1 - pieces.0);
    best
}
