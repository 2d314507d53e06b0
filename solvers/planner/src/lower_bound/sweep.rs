//! The two sweeps over a run: the backward sweep computes the greatest x at every station from the limits ahead, the forward
//! sweep lowers it by the limits behind and computes the least times of the intervals.

use super::hodograph::{Hodograph, Station};
use super::intervals::Intervals;
use super::piece::Piece;
use super::{Task, DOWN, UP};

/// At a cusp, directions that differ by more than this [rad] form a corner, which is a stop.
const CORNER: f64 = 1e-9;

/// The state between two pieces: the greatest sum of the squared axis velocities, which is continuous even where the tip rests;
/// the greatest v² of the tool; and the direction at the start of the piece after.
struct Junction<const M: usize> {
    axes_sq: f64,
    tool_sq: f64,
    end: Option<End<M>>,
}

/// An end of a piece.
struct End<const M: usize> {
    cusp: bool,
    rate: [f64; M],
    noise: f64,
}

impl<const M: usize> End<M> {
    fn new<const C: usize, const R: usize>(piece: &Piece<M, C, R>, station: &Station<M>) -> Self {
        Self { cusp: station.order > 0, rate: station.rate, noise: piece.curve.noise.iter().sum() }
    }

    /// Whether the path has a corner between two ends, one of them a cusp.
    fn is_corner(&self, other: &Self) -> bool {
        if !(self.cusp || other.cusp) {
            return false;
        }
        let size = |rate: &[f64; M]| rate.iter().map(|value| value * value).sum::<f64>().sqrt();
        let (own, others) = (size(&self.rate), size(&other.rate));
        let turn = (0..M).map(|k| (self.rate[k] / own - other.rate[k] / others).powi(2)).sum::<f64>().sqrt();
        turn > CORNER + 4.0 * (self.noise / own + other.noise / others)
    }
}

/// Calls a function with the capacities that the polynomials of piece `$i` need.
macro_rules! with_capacity {
    ($task:expr, $i:expr, $function:ident($($argument:expr),*)) => {
        match $task.kind($i) {
            (false, ..=2) => $function::<M, 2, 0>($($argument),*),
            (false, ..=4) => $function::<M, 4, 0>($($argument),*),
            (false, _) => $function::<M, 9, 0>($($argument),*),
            (true, ..=3) => $function::<M, 5, 4>($($argument),*),
            (true, _) => $function::<M, 17, 10>($($argument),*),
        }
    };
}

impl<const M: usize> Task<'_, M> {
    /// Whether piece `i` is rational, and its degree.
    fn kind(&self, i: usize) -> (bool, usize) {
        let weights = self.problem.weights(i);
        (weights.iter().any(|&weight| weight != weights[0]), self.problem.points(i).len() - 1)
    }

    /// The greatest v² between the pieces `i − 1` and `i`.
    fn junction_sq(&self, i: usize) -> f64 {
        self.problem.junction_speed[i].powi(2) * self.speed_share
    }
}

/// A t inside [from, to] of piece `i` next to which the axis turns; None if it does not turn.
pub fn find_turn<const M: usize>(task: &Task<M>, i: usize, axis: usize, part: (f64, f64)) -> Option<f64> {
    if axis >= M {
        return None;
    }
    with_capacity!(task, i, find_turn_on(task, i, axis, part))
}

fn find_turn_on<const M: usize, const C: usize, const R: usize>(
    task: &Task<M>,
    i: usize,
    axis: usize,
    part: (f64, f64),
) -> Option<f64> {
    Hodograph::<M, C, R>::new(task.problem.points(i), task.problem.weights(i)).find_turn(axis, part)
}

/// Backward sweep: fills in the greatest x at the end of each interval.
pub fn backward<const M: usize>(
    task: &Task<M>,
    (first, last): (usize, usize),
    end_sq: f64,
    intervals: &mut Intervals,
) {
    let mut at = Junction { axes_sq: f64::INFINITY, tool_sq: end_sq * task.speed_share, end: None };
    for i in (first..last).rev() {
        task.problem.watch.check_at(i);
        if i + 1 < last {
            at.tool_sq = task.junction_sq(i + 1);
        }
        with_capacity!(task, i, backward_over(task, i, i - first, &mut at, intervals));
    }
}

fn backward_over<const M: usize, const C: usize, const R: usize>(
    task: &Task<M>,
    i: usize,
    own: usize,
    at: &mut Junction<M>,
    intervals: &mut Intervals,
) {
    let piece = Piece::<M, C, R>::new(task, i);
    let range = intervals.of_piece(own);
    let mut station = piece.curve.station(1.0);
    let end = End::new(&piece, &station);
    if at.end.as_ref().is_some_and(|after| after.is_corner(&end)) {
        at.axes_sq = 0.0;
    }
    let (mut speed, _) = piece.speed(&station);
    let mut x = piece.x_on_entry(&station, at.axes_sq, at.tool_sq, speed);
    for interval in range.clone().rev() {
        x = x.min(piece.greatest_x(&station, speed));
        if x.is_nan() {
            x = f64::INFINITY;
        }
        intervals.reach[interval] = x;
        let start =
            piece.curve.station(if interval == range.start { 0.0 } else { intervals.end[interval - 1] });
        x = piece.rise(&station, x, &start, &piece.curve.distances(&start, &station));
        station = start;
        (speed, _) = piece.speed(&station);
    }
    x = x.min(piece.greatest_x(&station, speed));
    at.axes_sq = x * piece.axes_speed(&station).1 * task.speed_share * UP;
    at.end = Some(End::new(&piece, &station));
}

/// Forward sweep: fills in the least time of each interval and returns a lower bound of the time [s] of the run. `wanted` gives
/// the control axis of a phase, and the time [s] from which on a bound is good enough.
pub fn forward<const M: usize>(
    task: &Task<M>,
    (first, last): (usize, usize),
    start_sq: f64,
    wanted: impl Fn(u32) -> (usize, f64),
    intervals: &mut Intervals,
) -> f64 {
    let (mut axes_sq, mut time) = (f64::INFINITY, 0.0);
    for i in first..last {
        task.problem.watch.check_at(i);
        let tool_sq = if i > first { task.junction_sq(i) } else { start_sq * task.speed_share };
        let entered = (&mut axes_sq, tool_sq);
        with_capacity!(task, i, forward_over(task, i, i - first, entered, &mut time, &wanted, intervals));
    }
    time * (1.0 - intervals.end.len() as f64 * f64::EPSILON) * DOWN
}

fn forward_over<const M: usize, const C: usize, const R: usize>(
    task: &Task<M>,
    i: usize,
    own: usize,
    (axes_sq, tool_sq): (&mut f64, f64),
    time: &mut f64,
    wanted: &impl Fn(u32) -> (usize, f64),
    intervals: &mut Intervals,
) {
    let piece = Piece::<M, C, R>::new(task, i);
    let mut station = piece.curve.station(0.0);
    let mut x = piece.x_on_entry(&station, *axes_sq, tool_sq, piece.speed(&station).0);
    if x.is_nan() {
        x = f64::INFINITY;
    }
    for interval in intervals.of_piece(own) {
        let end = piece.curve.station(intervals.end[interval]);
        let distances = piece.curve.distances(&station, &end);
        let reached = intervals.reach[interval].min(piece.rise(&station, x, &end, &distances));
        let (axis, wanted) = wanted(intervals.phase[interval]);
        intervals.time[interval] = piece.time((&station, &end), [x, reached], &distances, axis, wanted);
        *time += intervals.time[interval];
        (x, station) = (reached, end);
    }
    *axes_sq = x * piece.axes_speed(&station).1 * task.speed_share * UP;
}
