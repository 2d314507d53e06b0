//! Computes a proven lower bound of the time of every profile that keeps the limits, from the path and the limits alone. Our own
//! method, from the energies v_k²/2 of the axes.
//!
//! Each run is divided into intervals between stations; any division gives a bound. The state at a station is x = π =
//! p/ω⁴ (symbols: `bang_bang`):
//!
//! * At a station, feed, axis velocities and chord error limit x, and so does the limit curve: the acceleration
//!   limits of two axes after s is eliminated.
//! * Over an interval, v_k² changes by at most 2 A_k times the distance that axis k travels back and forth. So x at one station
//!   limits x at the next, backward and forward. On a phase of the exact profile this holds with equality for its control axis,
//!   so the phases of a profile are the first intervals.
//! * The least time of an interval: no axis is faster than with full acceleration from the greatest speed at its start and full
//!   braking to the greatest speed at its end, and the tool is not faster than the feed.
//!
//! A sweep from the end of a run and one from its start find, at every station, an x that no feasible profile
//! exceeds. The bound is the sum of the least times of the intervals. A wrong profile can make it loose but never
//! wrong. The intervals of a phase are halved while their bound is loose and halving helps.
//!
//! Rounding: the tangents of a piece come with an error estimate that counts every operation twice (`hodograph`). In every
//! quotient the tangents are increased or reduced by their errors so that the bound becomes looser. A formula of at most sixteen
//! operations on positive numbers is then widened by `UP` or `DOWN`. NaN and infinity mean no limit, since `f64::min` and `max`
//! ignore NaN. Magnitudes below 1e-150 are not expected.
//!
//! | file | content |
//! |---|---|
//! | `hodograph` | tangents, their slopes and the distances of the axes, with their errors |
//! | `piece` | the greatest x at a station, its greatest rise over an interval, the least time of an interval |
//! | `time`, `length` | the least time of an axis between two speeds; the least length of the tool's path |
//! | `chord` | the chord-error limit at a station and over an interval |
//! | `intervals` | the division of a run and its refinement |
//! | `sweep` | both sweeps over a run |

mod chord;
mod hodograph;
mod intervals;
mod length;
mod piece;
mod sweep;
mod time;

use crate::phases::Phases;
use crate::problem::{greater, Both, ChordLimit, Fault, Problem};
use crate::runs::groups;
use feedplan_geometry::parallel::map;
use feedplan_geometry::quadratic::norm;
use intervals::Intervals;

/// Factors that exceed the rounding of sixteen operations.
const UP: f64 = 1.0 + 16.0 * f64::EPSILON;
const DOWN: f64 = 1.0 - 16.0 * f64::EPSILON;
/// The errors of joint polynomials, and of the polynomials of the tip's speed, are less than this fraction of any limit; see
/// `feedplan/constraints/joints.py`.
const STAND_IN: f64 = 1e-8;
/// Refinement stops when the bound is within this fraction of the profile's time.
const NEAR: f64 = 5e-4;
/// A phase is refined while its bound is below its duration by more than this fraction.
const LOOSE: f64 = 2e-4;
/// A round that closes less than `LEAST_GAIN` of the gap is idle, and after it all phases are refined: a loose phase
/// may be due to the speed that its neighbour allows. Refinement stops after `PATIENCE` idle rounds in succession,
/// after `MOST_ROUNDS`, or at `MOST_INTERVALS` per phase and `FEW_INTERVALS` more.
const LEAST_GAIN: f64 = 0.02;
const PATIENCE: usize = 3;
/// As `part` of `Intervals::halve`: all phases are refined.
const ALL: f64 = f64::NEG_INFINITY;
/// A turn closer than this fraction of an interval to its end is that end.
const AT_END: f64 = 1e-3;
const MOST_ROUNDS: usize = 14;
const MOST_INTERVALS: usize = 12;
const FEW_INTERVALS: usize = 20_000;

/// Computes the tables that all bounds share. A process forked while a thread computes them would wait for them for ever.
pub fn prepare() {
    length::prepare();
}

/// The problem, with its limits prepared for the sweeps.
struct Task<'a, const M: usize> {
    problem: &'a Problem<'a, M>,
    acceleration: Both<M>,
    velocity_sq: Both<M>,
    /// Factor by which squares of speeds may exceed their limits.
    speed_share: f64,
    chord: Option<ChordLimit>,
}

/// A lower bound [s] of the time of every profile that keeps the problem's limits. `hint` are the phases of a profile, of which
/// the columns piece, axis, u1 and duration are used: only the first intervals and their refinement depend on them.
pub fn lower_bound<const M: usize>(problem: &Problem<M>, hint: &Phases) -> Result<f64, Fault> {
    problem.check()?;
    if hint.len() >= u32::MAX as usize {
        let what = format!("the profile has {} phases: give fewer than {}", hint.len(), u32::MAX);
        return Err(Fault::Input { piece: None, what });
    }
    let share = if problem.tip.is_some() { 1.0 + STAND_IN } else { 1.0 };
    let task = Task {
        problem,
        acceleration: problem.max_acceleration.map(|side| side.map(|a| a * share)),
        velocity_sq: problem.max_velocity.map(|side| side.map(|v| (v * share) * (v * share) * UP)),
        speed_share: share * share * UP,
        // The chord error is that of the tip's path; with joints it is left out.
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
    let groups = groups(problem.runs);
    let times: Vec<f64> = map(groups.len(), 1, |i| {
        let mut space = (Intervals::default(), Intervals::default());
        let of_run = |run: usize| {
            let start = if run == 0 { problem.start_speed } else { 0.0 };
            let end = if run == last_run { problem.end_speed } else { 0.0 };
            let pieces = (problem.runs[run], problem.runs[run + 1]);
            over_run(&task, pieces, (start * start, end * end), hint, &mut space)
        };
        groups[i].clone().map(of_run).sum()
    });
    let rounding = problem.runs.len() as f64 * f64::EPSILON;
    Ok(times.iter().sum::<f64>() * (1.0 - rounding))
}

/// The lower bound [s] of the time of one run.
fn over_run<const M: usize>(
    task: &Task<M>,
    pieces: (usize, usize),
    (start_sq, end_sq): (f64, f64),
    hint: &Phases,
    (intervals, other): &mut (Intervals, Intervals),
) -> f64 {
    let find_turn = |i: usize, axis: usize, part: (f64, f64)| {
        task.problem.watch.check_at(i);
        sweep::find_turn(task, i, axis, part)
    };
    intervals.divide(hint, pieces, task.problem.width, find_turn);
    // The place to cut an interval: a turn inside it, else its middle.
    let middle = |i: usize, (from, to): (f64, f64)| {
        let inside = |t: &f64| (t - from).min(to - t) > AT_END * (to - from);
        let mut turns = (0..M).filter_map(|k| find_turn(pieces.0 + i, k, (from, to)));
        turns.find(inside).unwrap_or(0.5 * (from + to))
    };
    let phases = hint.piece.partition_point(|&piece| (piece as usize) < pieces.0)
        ..hint.piece.partition_point(|&piece| (piece as usize) < pieces.1);
    let duration: f64 = hint.duration.get(phases).unwrap_or(&[]).iter().sum();
    let most = MOST_INTERVALS * intervals.end.len() + FEW_INTERVALS;
    let wanted = |phase: u32| match hint.duration.get(phase as usize) {
        Some(duration) => (hint.axis[phase as usize] as usize, (1.0 - 0.1 * LOOSE) * duration),
        None => (M, f64::INFINITY),
    };
    let (mut best, mut idle) = (0.0, 0);
    // Progress: the number of rounds is not known, so each round counts as half of what is left.
    let mut watch = task.problem.watch.each(task.problem.width.len());
    for _ in 0..MOST_ROUNDS {
        watch = watch.part(0.5);
        sweep::backward(task, pieces, end_sq, intervals);
        let bound = sweep::forward(task, pieces, start_sq, wanted, intervals);
        watch.advance(pieces.1 - pieces.0);
        let gained = bound - best > LEAST_GAIN * (duration - best);
        idle = if gained { 0 } else { idle + 1 };
        best = bound.max(best);
        let near = best >= (1.0 - NEAR) * duration;
        let part = if idle == 0 { LOOSE } else { ALL };
        if near
            || idle == PATIENCE
            || intervals.halve(hint, part, middle, other) == 0
            || intervals.end.len() > most
        {
            break;
        }
    }
    watch.advance(pieces.1 - pieces.0);
    best
}
