//! The moves of a program, collected as columns while it is read.
//!
//! Path control, stops and dwells change seldom: only their changes are stored, and `columns` expands them to columns.

pub mod columns;

use std::f64::consts::TAU;

use super::block::rotary;
use super::coordinates::{CoordinateMode, Direction, Point, UPRIGHT};
use super::events::Events;
use super::fault::Outcome;
use super::tolerance::{NO_MOTION, WHOLE_TURNS};
use feedplan_geometry::spline::CompositeCurve;

/// The kind of a move.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum Kind {
    Rapid = 0,
    Line = 1,
    Arc = 2,
    Spline = 3,
}

/// The path control: how closely the path is followed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum Mode {
    ExactStop = 0,
    ExactPath = 1,
    Tolerance = 2,
}

/// The path control of a move: G61.1, G61 or G64, with its P and Q in mm, NaN where they are missing.
#[derive(Clone, Copy, Debug)]
pub struct Control {
    pub mode: Mode,
    pub blend: f64,
    pub fit: f64,
}

impl Default for Control {
    fn default() -> Self {
        Self::new(Mode::Tolerance)
    }
}

impl Control {
    pub fn new(mode: Mode) -> Self {
        Self { mode, blend: f64::NAN, fit: f64::NAN }
    }

    /// True where both are equal; NaN equals NaN.
    fn same(&self, other: &Self) -> bool {
        self.mode == other.mode
            && self.blend.to_bits() == other.blend.to_bits()
            && self.fit.to_bits() == other.fit.to_bits()
    }
}

/// A circular or helical move: its centre in X, Y, Z; the axis that it turns about; its signed sweep in radians,
/// counter-clockwise seen from the positive end of that axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Arc {
    pub centre: [f64; 3],
    pub normal: usize,
    pub angle: f64,
}

/// The cause of a full stop after a move; of several causes the greatest is kept.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
#[repr(u8)]
pub enum Stop {
    None = 0,
    /// A change of the coordinate mode or of the tool length in it.
    Change = 1,
    /// A switch of the spindle, the coolant or an output.
    Switch = 2,
    Dwell = 3,
    /// M0, M1, M60.
    Pause = 4,
    /// M6.
    Tool = 5,
    End = 6,
}

/// A change of the coordinate mode: its first row, the mode, the tool's length in mm (NaN for that of the machine file),
/// and the start of the row in coordinates of the mode.
#[derive(Clone, Copy, Debug)]
struct Change {
    row: usize,
    mode: CoordinateMode,
    tool_length: f64,
    start: Point,
    direction: Direction,
}

/// The moves so far.
#[derive(Default)]
pub struct Moves {
    /// The axes that have columns in `target`, as indices into a `Point`.
    axes: Vec<usize>,
    limit: usize,
    /// The start of the first move.
    start: Point,
    /// The end of the last move.
    pub position: Point,
    /// The tool direction there, where I, J, K are programmed.
    pub direction: Direction,
    kind: Vec<u8>,
    target: Vec<f64>,
    feed: Vec<f64>,
    line: Vec<i32>,
    control: Vec<(usize, Control)>,
    stops: Vec<(usize, Stop)>,
    dwells: Vec<(usize, f64)>,
    start_dwell: f64,
    arcs: Vec<(usize, Arc)>,
    splines: CompositeCurve<9>,
    /// The row and the first piece of each spline.
    spline_rows: Vec<(usize, usize)>,
    changes: Vec<Change>,
    /// Changes of the tool direction: the first row of each.
    directions: Vec<(usize, Direction)>,
    events: Events,
}

impl Moves {
    /// Memory for `expected` rows; more rows than `limit` are an error.
    pub fn new(expected: usize, limit: usize, start: Point) -> Self {
        let expected = expected.min(limit);
        Self {
            axes: vec![0, 1, 2],
            limit,
            start,
            position: start,
            direction: UPRIGHT,
            kind: Vec::with_capacity(expected),
            target: Vec::with_capacity(3 * expected),
            feed: Vec::with_capacity(expected),
            line: Vec::with_capacity(expected),
            ..Self::default()
        }
    }

    /// Number of moves.
    pub fn len(&self) -> usize {
        self.kind.len()
    }

    pub fn is_empty(&self) -> bool {
        self.kind.is_empty()
    }

    /// Adds a column for an axis; in the rows so far the axis is at its start.
    #[cold]
    pub fn add_axis(&mut self, axis: usize) {
        let Err(column) = self.axes.binary_search(&axis) else { return };
        let width = self.axes.len();
        let mut wider = Vec::with_capacity((self.target.capacity() / width) * (width + 1));
        for row in self.target.chunks_exact(width) {
            wider.extend_from_slice(&row[..column]);
            wider.push(self.start[axis]);
            wider.extend_from_slice(&row[column..]);
        }
        self.target = wider;
        self.axes.insert(column, axis);
    }

    /// The axes that have a column.
    pub fn axes(&self) -> &[usize] {
        &self.axes
    }

    /// Adds a straight move, unless it moves nothing.
    #[inline(always)]
    pub fn straight(
        &mut self,
        kind: Kind,
        target: &Point,
        feed: f64,
        control: &Control,
        line: u32,
    ) -> Outcome<()> {
        if !apart(target, &self.position) {
            return Ok(());
        }
        self.row(kind, target, feed, control, line)
    }

    /// Adds an arc.
    pub fn arc(&mut self, arc: Arc, target: &Point, feed: f64, control: &Control, line: u32) -> Outcome<()> {
        self.arcs.push((self.kind.len(), arc));
        self.row(Kind::Arc, target, feed, control, line)
    }

    /// Adds a spline by its pieces, from the end of the last move, unless it moves nothing.
    pub fn spline(
        &mut self,
        curve: &CompositeCurve<9>,
        feed: f64,
        control: &Control,
        line: u32,
    ) -> Outcome<()> {
        let Some(target) = curve.control.last() else { return Ok(()) };
        if curve.control.iter().all(|point| !apart(point, &self.position)) {
            return Ok(());
        }
        if self.splines.len() + curve.len() > self.limit {
            return fault!("the splines of the program have more than {} pieces: split it", self.limit);
        }
        self.spline_rows.push((self.kind.len(), self.splines.len()));
        for (i, &width) in curve.width.iter().enumerate() {
            let range = curve.offsets[i]..curve.offsets[i + 1];
            let weights = curve.weights.get(range.clone()).unwrap_or_default();
            self.splines.push(&curve.control[range], weights, width);
        }
        self.row(Kind::Spline, target, feed, control, line)
    }

    /// Adds a straight move that ends in a tool direction, unless it moves nothing.
    pub fn pointed(
        &mut self,
        kind: Kind,
        target: &Point,
        direction: Direction,
        feed: f64,
        control: &Control,
        line: u32,
    ) -> Outcome<()> {
        let turned = direction != self.direction;
        if turned {
            self.direction = direction;
            self.directions.push((self.kind.len(), direction));
        } else if !apart(target, &self.position) {
            return Ok(());
        }
        self.row(kind, target, feed, control, line)
    }

    /// Begins a coordinate mode, in whose coordinates the tool is at `start` in `direction`.
    pub fn change(&mut self, mode: CoordinateMode, tool_length: f64, start: Point, direction: Direction) {
        self.stop(Stop::Change);
        let row = self.kind.len();
        if self.changes.last().is_some_and(|last| last.row == row) {
            self.changes.pop();
        }
        self.changes.push(Change { row, mode, tool_length, start, direction });
        self.position = start;
        if direction != self.direction {
            self.direction = direction;
            self.directions.push((row, direction));
        }
    }

    /// The positions and directions from the start of the last change to the end of the last move.
    pub fn since_change(&self) -> Vec<(Point, Direction)> {
        let Some(change) = self.changes.last() else { return vec![(self.position, self.direction)] };
        let mut positions = vec![(change.start, change.direction)];
        for (target, direction) in self.directed_rows(change.row) {
            let mut position = change.start;
            for (&axis, &value) in self.axes.iter().zip(target) {
                position[axis] = value;
            }
            positions.push((position, direction));
        }
        positions
    }

    /// The targets of the rows from `first` on, with the tool directions there.
    fn directed_rows(&self, first: usize) -> impl Iterator<Item = (&[f64], Direction)> {
        let mut direction = UPRIGHT;
        let mut later = self.directions.iter().peekable();
        self.target.chunks_exact(self.axes.len()).enumerate().skip(first).map(move |(row, target)| {
            while let Some(&(_, next)) = later.next_if(|(first, _)| *first <= row) {
                direction = next;
            }
            (target, direction)
        })
    }

    #[inline(always)]
    fn row(&mut self, kind: Kind, target: &Point, feed: f64, control: &Control, line: u32) -> Outcome<()> {
        if self.kind.len() >= self.limit {
            return fault!("the program has more than {} moves: split it", self.limit);
        }
        if self.control.last().is_none_or(|(_, last)| !last.same(control)) {
            self.control.push((self.kind.len(), *control));
        }
        if self.axes.len() == 3 {
            self.target.extend_from_slice(&target[..3]);
        } else {
            self.target.extend(self.axes.iter().map(|&axis| target[axis]));
        }
        self.kind.push(kind as u8);
        self.feed.push(feed);
        self.line.push(line as i32);
        self.position = *target;
        Ok(())
    }

    /// Moves the end of row `first` in a plane to `end`, and the ends of the rows after it, which do not move in that plane. If
    /// the row is an arc, `turned` in radians is added to its sweep; returns false if nothing of the arc would be left.
    pub fn bend(&mut self, first: usize, plane: (usize, usize), end: &Point, turned: f64) -> bool {
        let width = self.axes.len();
        for row in self.target[first * width..].chunks_exact_mut(width) {
            (row[plane.0], row[plane.1]) = (end[plane.0], end[plane.1]);
        }
        (self.position[plane.0], self.position[plane.1]) = (end[plane.0], end[plane.1]);
        match self.arcs.iter_mut().rev().take_while(|(row, _)| *row >= first).find(|(row, _)| *row == first) {
            Some((_, arc)) => {
                let before = arc.angle;
                arc.angle += turned;
                arc.angle * before > 0.0
            }
            None => true,
        }
    }

    /// Removes one turn from the arc of a row if it has more than `turns`; returns whether it did.
    pub fn drop_turn(&mut self, row: usize, turns: f64) -> bool {
        let found = self.arcs.iter_mut().rev().take(2).find(|(arc, _)| *arc == row);
        match found.filter(|(_, arc)| arc.angle.abs() / TAU > turns + WHOLE_TURNS) {
            Some((_, arc)) => {
                arc.angle -= arc.angle.signum() * TAU;
                true
            }
            None => false,
        }
    }

    /// Adds an event, with its words P and Q, after the moves so far.
    pub fn event(&mut self, line: u32, letter: u8, number: f64, words: [Option<f64>; 2]) {
        self.events.push(self.kind.len(), line, letter, number, words);
    }

    /// Adds a message to the operator, or a comment.
    pub fn remark(&mut self, line: u32, letter: u8, text: String) {
        let index = self.events.index_of(text, line);
        self.event(line, letter, index as f64, [None; 2]);
    }

    /// Adds a full stop after the last move; of several causes the greatest is kept.
    pub fn stop(&mut self, cause: Stop) {
        // Before the first move the machine is at rest.
        let Some(last) = self.kind.len().checked_sub(1) else { return };
        match self.stops.last_mut() {
            Some((row, known)) if *row == last => *known = (*known).max(cause),
            _ => self.stops.push((last, cause)),
        }
    }

    /// Adds a full stop and a pause of `seconds`.
    pub fn dwell(&mut self, seconds: f64) {
        self.stop(Stop::Dwell);
        match self.kind.len().checked_sub(1) {
            Some(last) => self.dwells.push((last, seconds)),
            None => self.start_dwell += seconds,
        }
    }
}

/// True where two positions differ by more than rounding.
#[inline(always)]
fn apart(a: &Point, b: &Point) -> bool {
    a.iter().zip(b).fold(0.0, |step: f64, (a, b)| step.max((a - b).abs())) > NO_MOTION
}

/// The length of a straight move that its feed refers to, as in LinuxCNC: along X, Y, Z if one of these moves, else along
/// U, V, W, else in the degrees of A, B, C.
pub fn straight_length(from: &Point, to: &Point) -> f64 {
    let length = |axes: std::ops::Range<usize>| axes.map(|k| (to[k] - from[k]).powi(2)).sum::<f64>().sqrt();
    [0..3, 6..9, 3..6].into_iter().map(length).find(|&length| length > NO_MOTION).unwrap_or(0.0)
}

/// True where only rotary axes move: the feed is in degrees.
pub fn only_turns(from: &Point, to: &Point) -> bool {
    (0..9).all(|k| rotary(k) || (to[k] - from[k]).abs() <= NO_MOTION)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn point(x: f64, y: f64) -> Point {
        let mut point = [0.0; 9];
        point[0] = x;
        point[1] = y;
        point
    }

    #[test]
    fn a_new_axis_gets_its_column_in_order() {
        let mut moves = Moves::new(4, 10, [0.0; 9]);
        let control = Control::new(Mode::Tolerance);
        moves.straight(Kind::Rapid, &point(1.0, 2.0), f64::INFINITY, &control, 1).unwrap();
        moves.add_axis(8);
        moves.add_axis(3);
        moves.add_axis(3);
        let mut target = point(1.0, 2.0);
        target[3] = 90.0;
        target[8] = 5.0;
        moves.straight(Kind::Line, &target, 10.0, &control, 2).unwrap();
        let columns = moves.finish(Vec::new());
        assert_eq!(columns.axes, b"XYZAW");
        assert_eq!(columns.target, [1.0, 2.0, 0.0, 0.0, 0.0, 1.0, 2.0, 0.0, 90.0, 5.0]);
    }

    #[test]
    fn stops_and_dwells_stay_where_nothing_moves() {
        let mut moves = Moves::new(4, 10, [0.0; 9]);
        let control = Control::new(Mode::ExactPath);
        moves.stop(Stop::Tool);
        moves.dwell(0.5);
        moves.straight(Kind::Line, &point(1.0, 0.0), 1.0, &control, 1).unwrap();
        moves.straight(Kind::Line, &point(1.0, 1e-13), 1.0, &control, 2).unwrap();
        moves.dwell(1.0);
        moves.dwell(0.25);
        moves.stop(Stop::Switch);
        moves.straight(Kind::Line, &point(2.0, 0.0), 1.0, &Control::new(Mode::Tolerance), 3).unwrap();
        moves.straight(Kind::Line, &point(3.0, 0.0), 1.0, &Control::new(Mode::Tolerance), 4).unwrap();
        let columns = moves.finish(Vec::new());
        assert_eq!(columns.line, [1, 3, 4]);
        assert_eq!(columns.stop, [true, false, true]);
        assert_eq!(columns.stop_cause, [Stop::Dwell, Stop::None, Stop::End].map(|cause| cause as u8));
        assert_eq!(columns.dwell, [1.25, 0.0, 0.0]);
        assert_eq!(columns.start_dwell, 0.5);
        assert_eq!(columns.control, [1, 2, 2]);
    }

    #[test]
    fn the_feed_counts_along_the_leading_axes() {
        let from = [0.0; 9];
        assert_eq!(straight_length(&from, &[3.0, 4.0, 0.0, 90.0, 0.0, 0.0, 7.0, 0.0, 0.0]), 5.0);
        assert_eq!(straight_length(&from, &[0.0, 0.0, 0.0, 90.0, 0.0, 0.0, 0.0, 6.0, 8.0]), 10.0);
        assert_eq!(straight_length(&from, &[0.0, 0.0, 0.0, 0.0, 0.0, 30.0, 0.0, 0.0, 0.0]), 30.0);
        assert!(only_turns(&from, &[0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0]));
        assert!(!only_turns(&from, &[0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 1.0, 0.0, 0.0]));
    }
}
