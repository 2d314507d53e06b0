//! `,C` and `,R` of a straight move: a chamfer or a rounding between it and the straight move that follows, as on the
//! controls of Fanuc and Haas.

use super::block::{Block, AXES};
use super::coordinates::Point;
use super::fault::Outcome;
use super::interpreter::{Corner, Interpreter};
use super::moves::{Arc, Kind};
use super::tolerance::ON_ONE_LINE;

impl Interpreter<'_> {
    /// Stores the corner of a block whose move has been added, until the next move.
    pub fn set_corner(&mut self, block: &Block, start: &Point, feed: f64) -> Outcome<()> {
        let Some((letter, value)) = block.corner else { return Ok(()) };
        let size = value * self.state.unit();
        if !(size > 0.0 && size < f64::INFINITY) {
            return fault!("word ,{}{value} is no size of a corner: give a positive one", letter as char);
        }
        self.check_beside(&format!(",{}", letter as char))?;
        match self.moves.len().checked_sub(1).filter(|_| self.moves.position != *start) {
            Some(row) => {
                self.corner = Some(Corner { letter, size, row, line: self.line, start: *start, feed });
                Ok(())
            }
            None => fault!("word ,{}{value} stands behind no move: give its place", letter as char),
        }
    }

    /// Refuses other motion where a corner waits for a straight move.
    pub fn check_corner(&self) -> Outcome<()> {
        match &self.corner {
            None => Ok(()),
            Some(corner) => fault_in!(
                corner.line,
                "the corner ,{} of this line is followed by no straight move G1 in the plane: put it elsewhere",
                corner.letter as char
            ),
        }
    }

    /// Cuts the stored corner before the straight move to `target`: shortens the move before it and adds the chamfer or rounding.
    #[cold]
    pub fn cut_corner(&mut self, kind: Kind, target: &Point) -> Outcome<()> {
        let Some(corner) = self.corner else { return Ok(()) };
        let (u, v) = self.state.plane();
        let middle = self.moves.position;
        let flat = |from: &Point, to: &Point| [to[u] - from[u], to[v] - from[v]];
        let (before, after) = (flat(&corner.start, &middle), flat(&middle, target));
        let lengths = [before, after].map(|way| way[0].hypot(way[1]));
        let in_plane = (0..AXES.len())
            .filter(|&axis| axis != u && axis != v)
            .all(|axis| corner.start[axis] == middle[axis] && middle[axis] == target[axis]);
        if kind != Kind::Line || !in_plane || lengths[0] == 0.0 || lengths[1] == 0.0 {
            return self.check_corner();
        }
        self.corner = None;
        let [before, after] =
            [(before, lengths[0]), (after, lengths[1])].map(|(way, l)| [way[0] / l, way[1] / l]);
        let (sine, cosine) =
            (before[0] * after[1] - before[1] * after[0], before[0] * after[0] + before[1] * after[1]);
        let turn = sine.atan2(cosine);
        if sine.abs() < ON_ONE_LINE && (cosine > 0.0 || corner.letter == b'R') {
            return fault_in!(corner.line, "the moves at this corner lie on one line: remove ,C and ,R");
        }
        let cut = if corner.letter == b'C' { corner.size } else { corner.size * (0.5 * turn).tan().abs() };
        if cut > lengths[0] || cut > lengths[1] {
            return fault_in!(
                corner.line,
                "the corner ,{} takes {cut:.4} mm of moves that are {:.4} and {:.4} mm long: make it smaller",
                corner.letter as char,
                lengths[0],
                lengths[1]
            );
        }
        let (mut first, mut second) = (middle, middle);
        (first[u], first[v]) = (middle[u] - cut * before[0], middle[v] - cut * before[1]);
        (second[u], second[v]) = (middle[u] + cut * after[0], middle[v] + cut * after[1]);
        self.moves.bend(corner.row, (u, v), &first, 0.0);
        let control = self.state.control;
        if corner.letter == b'C' {
            return self.moves.straight(Kind::Line, &second, corner.feed, &control, corner.line);
        }
        let side = corner.size * turn.signum();
        let mut centre = first;
        (centre[u], centre[v]) = (first[u] - side * before[1], first[v] + side * before[0]);
        let arc = Arc { centre: [centre[0], centre[1], centre[2]], normal: self.state.normal, angle: turn };
        self.moves.arc(arc, &second, corner.feed, &control, corner.line)
    }
}
