//! Converts the `Moves` that the interpreter has collected to the columns of `feedplan.program.program.Program`.

use super::{Moves, Stop};
use crate::block::AXES;
use crate::coordinates::{CoordinateMode, Direction, Point, UPRIGHT};
use crate::events::Events;

/// The letters of the columns of a tool direction, after those of the axes.
const DIRECTION: [u8; 3] = *b"IJK";

/// The columns have one row per move, except those of arcs, splines, changes of coordinates and events, which give the number of
/// their move.
#[derive(Debug)]
pub struct Columns {
    pub axes: Vec<u8>,
    pub start: Vec<f64>,
    pub kind: Vec<u8>,
    pub target: Vec<f64>,
    pub feed: Vec<f64>,
    pub line: Vec<i32>,
    pub control: Vec<u8>,
    pub blend_tolerance: Vec<f64>,
    pub fit_tolerance: Vec<f64>,
    pub stop: Vec<bool>,
    /// `Stop` of each move.
    pub stop_cause: Vec<u8>,
    pub dwell: Vec<f64>,
    pub arc_move: Vec<i64>,
    /// X, Y, Z of the centre of each arc.
    pub arc_centre: Vec<f64>,
    pub arc_normal: Vec<u8>,
    pub arc_angle: Vec<f64>,
    pub spline_move: Vec<i64>,
    /// The first piece of each spline, and the number of pieces.
    pub spline_pieces: Vec<i64>,
    /// Control points of the pieces in the columns of `axes`, weights (empty where all are polynomials), offsets, widths.
    pub spline_control: Vec<f64>,
    pub spline_weights: Vec<f64>,
    pub spline_offsets: Vec<usize>,
    pub spline_width: Vec<f64>,
    /// `CoordinateMode` and tool length of each move.
    pub coordinate_mode: Vec<u8>,
    pub tool_length: Vec<f64>,
    /// The first move in each coordinate mode, and its start in the coordinates of that mode.
    pub change_move: Vec<i64>,
    pub change_start: Vec<f64>,
    pub start_dwell: f64,
    pub events: Events,
    pub warnings: Vec<String>,
}

impl Moves {
    /// The columns; the last move ends with a stop.
    pub fn finish(mut self, warnings: Vec<String>) -> Columns {
        self.stop(Stop::End);
        let count = self.kind.len();
        let mut stop_cause = vec![Stop::None as u8; count];
        for &(row, cause) in &self.stops {
            stop_cause[row] = cause as u8;
        }
        let mut dwell = vec![0.0; count];
        for &(row, seconds) in &self.dwells {
            dwell[row] += seconds;
        }
        let mut control = Vec::with_capacity(count);
        let mut blend_tolerance = Vec::with_capacity(count);
        let mut fit_tolerance = Vec::with_capacity(count);
        for (i, (_, now)) in self.control.iter().enumerate() {
            let end = self.control.get(i + 1).map_or(count, |next| next.0);
            control.resize(end, now.mode as u8);
            blend_tolerance.resize(end, now.blend);
            fit_tolerance.resize(end, now.fit);
        }
        // A change after the last move has no effect; one before the first move gives its start.
        self.changes.retain(|change| change.row < count);
        let (start, direction) = match self.changes.first() {
            Some(change) if change.row == 0 => (change.start, change.direction),
            _ => (self.start, UPRIGHT),
        };
        let first = self.changes.first().map_or(count, |change| change.row);
        let mut coordinate_mode = vec![CoordinateMode::Joints as u8; first];
        let mut tool_length = vec![f64::NAN; first];
        for (i, change) in self.changes.iter().enumerate() {
            let end = self.changes.get(i + 1).map_or(count, |next| next.row);
            coordinate_mode.resize(end, change.mode as u8);
            tool_length.resize(end, change.tool_length);
        }
        self.kind.shrink_to_fit();
        self.target.shrink_to_fit();
        self.feed.shrink_to_fit();
        self.line.shrink_to_fit();
        Columns {
            axes: self.letters(),
            start: self.row_of(&start, &direction),
            change_move: self.changes.iter().map(|change| change.row as i64).collect(),
            change_start: self
                .changes
                .iter()
                .flat_map(|change| self.row_of(&change.start, &change.direction))
                .collect(),
            spline_move: self.spline_rows.iter().map(|&(row, _)| row as i64).collect(),
            spline_pieces: (self.spline_rows.iter().map(|&(_, piece)| piece))
                .chain([self.splines.len()])
                .map(|piece| piece as i64)
                .collect(),
            // Splines are not read where tool directions are programmed.
            spline_control: self
                .splines
                .control
                .iter()
                .flat_map(|point| self.row_of(point, &UPRIGHT))
                .collect(),
            target: self.directed_target(),
            spline_weights: self.splines.weights,
            spline_offsets: self.splines.offsets,
            spline_width: self.splines.width,
            kind: self.kind,
            feed: self.feed,
            line: self.line,
            control,
            blend_tolerance,
            fit_tolerance,
            stop: stop_cause.iter().map(|&cause| cause != Stop::None as u8).collect(),
            stop_cause,
            dwell,
            coordinate_mode,
            tool_length,
            arc_move: self.arcs.iter().map(|&(row, _)| row as i64).collect(),
            arc_centre: self.arcs.iter().flat_map(|(_, arc)| arc.centre).collect(),
            arc_normal: self.arcs.iter().map(|(_, arc)| arc.normal as u8).collect(),
            arc_angle: self.arcs.iter().map(|(_, arc)| arc.angle).collect(),
            events: self.events,
            start_dwell: self.start_dwell,
            warnings,
        }
    }

    /// True where the tool direction has columns.
    fn points_tool(&self) -> bool {
        self.changes.iter().any(|change| change.mode == CoordinateMode::Vector)
    }

    /// The letters of the columns.
    fn letters(&self) -> Vec<u8> {
        let mut letters: Vec<u8> = self.axes.iter().map(|&axis| AXES[axis]).collect();
        if self.points_tool() {
            letters.extend(DIRECTION);
        }
        letters
    }

    /// A position and a tool direction in these columns.
    fn row_of(&self, point: &Point, direction: &Direction) -> Vec<f64> {
        let mut row: Vec<f64> = self.axes.iter().map(|&axis| point[axis]).collect();
        if self.points_tool() {
            row.extend(direction);
        }
        row
    }

    /// Targets, with the tool directions where these have columns.
    fn directed_target(&mut self) -> Vec<f64> {
        if !self.points_tool() {
            return std::mem::take(&mut self.target);
        }
        let mut wider = Vec::with_capacity(self.target.len() + 3 * self.kind.len());
        for (position, direction) in self.directed_rows(0) {
            wider.extend_from_slice(position);
            wider.extend(direction);
        }
        wider
    }
}
