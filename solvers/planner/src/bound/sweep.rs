//! The two sweeps over a run: from its end the greatest speed at every node, then from its start as well, with times.

use super::cells::Cells;
use super::hodograph::{Hodograph, Node};
use super::piece::Piece;
use super::{Task, DOWN, UP};

/// Directions at a cusp that differ by more than this form a corner, which is a stop.
const CORNER: f64 = 1e-9;

/// What one piece tells the next: the greatest speed squared of all axes, which is the same on both sides where the tool's
/// may vanish, the tool's where a limit holds it, and the direction on the near side.
struct Between<const M: usize> {
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
    fn new<const C: usize, const R: usize>(piece: &Piece<M, C, R>, node: &Node<M>) -> Self {
        Self { cusp: node.order > 0, rate: node.rate, noise: piece.curve.noise.iter().sum() }
    }

    /// Whether the path has a corner between two ends at a cusp.
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

/// Calls a function with what the polynomials of a piece need.
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
        let range = self.problem.offset[i]..self.problem.offset[i + 1];
        let degree = range.len() - 1;
        let weights = self.problem.weight.get(range).unwrap_or(&[]);
        (weights.iter().any(|&weight| weight != weights[0]), degree)
    }

    /// The hodograph of piece `i`.
    #[inline(always)]
    pub fn hodograph<const C: usize, const R: usize>(&self, i: usize) -> Hodograph<M, C, R> {
        let range = self.problem.offset[i]..self.problem.offset[i + 1];
        Hodograph::new(&self.problem.control[range.clone()], self.problem.weight.get(range).unwrap_or(&[]))
    }

    /// The greatest speed squared where pieces `i − 1` and `i` meet.
    fn junction_sq(&self, i: usize) -> f64 {
        self.problem.junction_speed[i].powi(2) * self.speed_share
    }
}

/// A place inside [from, to] of piece `i` next to which the axis turns.
pub fn turn<const M: usize>(task: &Task<M>, i: usize, axis: usize, part: (f64, f64)) -> Option<f64> {
    if axis >= M {
        return None;
    }
    with_capacity!(task, i, turn_on(task, i, axis, part))
}

fn turn_on<const M: usize, const C: usize, const R: usize>(
    task: &Task<M>,
    i: usize,
    axis: usize,
    part: (f64, f64),
) -> Option<f64> {
    task.hodograph::<C, R>(i).turn(axis, part)
}

/// Fills the greatest x at the end of each cell, with what lies behind it.
pub fn backward<const M: usize>(
    task: &Task<M>,
    (first, last): (usize, usize),
    end_sq: f64,
    cells: &mut Cells,
) {
    let mut at = Between { axes_sq: f64::INFINITY, tool_sq: end_sq * task.speed_share, end: None };
    for i in (first..last).rev() {
        task.problem.watch.check_at(i);
        if i + 1 < last {
            at.tool_sq = task.junction_sq(i + 1);
        }
        with_capacity!(task, i, backward_over(task, i, i - first, &mut at, cells));
    }
}

fn backward_over<const M: usize, const C: usize, const R: usize>(
    task: &Task<M>,
    i: usize,
    own: usize,
    at: &mut Between<M>,
    cells: &mut Cells,
) {
    let piece = Piece::<M, C, R>::new(task, i);
    let range = cells.of_piece(own);
    let mut node = piece.curve.node(1.0);
    let end = End::new(&piece, &node);
    if at.end.as_ref().is_some_and(|after| after.is_corner(&end)) {
        at.axes_sq = 0.0;
    }
    let (mut speed, _) = piece.speed(&node);
    let mut x = piece.entered(&node, at.axes_sq, at.tool_sq, speed);
    for cell in range.clone().rev() {
        x = x.min(piece.greatest(&node, speed));
        if x.is_nan() {
            x = f64::INFINITY;
        }
        cells.reach[cell] = x;
        let start = piece.curve.node(if cell == range.start { 0.0 } else { cells.end[cell - 1] });
        x = piece.rise(&node, x, &start, &piece.curve.ways(&start, &node));
        node = start;
        (speed, _) = piece.speed(&node);
    }
    x = x.min(piece.greatest(&node, speed));
    at.axes_sq = x * piece.axes_speed(&node).1 * task.speed_share * UP;
    at.end = Some(End::new(&piece, &node));
}

/// A lower bound of the time of the run, each cell's beside it; `wanted` says of an arc which axis governs and what
/// time would do.
pub fn forward<const M: usize>(
    task: &Task<M>,
    (first, last): (usize, usize),
    start_sq: f64,
    wanted: impl Fn(u32) -> (usize, f64),
    cells: &mut Cells,
) -> f64 {
    let (mut axes_sq, mut time) = (f64::INFINITY, 0.0);
    for i in first..last {
        task.problem.watch.check_at(i);
        let tool_sq = if i > first { task.junction_sq(i) } else { start_sq * task.speed_share };
        let entered = (&mut axes_sq, tool_sq);
        with_capacity!(task, i, forward_over(task, i, i - first, entered, &mut time, &wanted, cells));
    }
    time * (1.0 - cells.end.len() as f64 * f64::EPSILON) * DOWN
}

fn forward_over<const M: usize, const C: usize, const R: usize>(
    task: &Task<M>,
    i: usize,
    own: usize,
    (axes_sq, tool_sq): (&mut f64, f64),
    time: &mut f64,
    wanted: &impl Fn(u32) -> (usize, f64),
    cells: &mut Cells,
) {
    let piece = Piece::<M, C, R>::new(task, i);
    let mut node = piece.curve.node(0.0);
    let mut x = piece.entered(&node, *axes_sq, tool_sq, piece.speed(&node).0);
    if x.is_nan() {
        x = f64::INFINITY;
    }
    for cell in cells.of_piece(own) {
        let end = piece.curve.node(cells.end[cell]);
        let ways = piece.curve.ways(&node, &end);
        let reached = cells.reach[cell].min(piece.rise(&node, x, &end, &ways));
        let (axis, wanted) = wanted(cells.arc[cell]);
        cells.time[cell] = piece.time((&node, &end), [x, reached], &ways, axis, wanted);
        *time += cells.time[cell];
        (x, node) = (reached, end);
    }
    *axes_sq = x * piece.axes_speed(&node).1 * task.speed_share * UP;
}
