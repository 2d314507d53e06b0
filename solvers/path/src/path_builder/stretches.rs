//! The stretches of smooth pieces between the joints of a path, what rounded corners cut away from their ends, and
//! what is left of them.

use rayon::prelude::*;

use super::Axes;
use crate::corner::{Jump, Rounding, Sides};
use crate::follow::{Followed, Shape, Spline};
use feedplan_geometry::conic::Conic;
use feedplan_geometry::spline::{CompositeCurve, Piece};
use feedplan_geometry::watch::Watch;

/// Exact paths are smoothed only where an arc or a spline meets its neighbour with a turn below this (rad): that is
/// what rounded coordinates leave of a tangent joint.
pub const CURVE_JOINT: f64 = 0.0175;
/// No corner is shorter than this times the tolerance because it needs no more: pieces of no size help nobody.
const LEAST_LENGTH: f64 = 0.01;
/// What is left between two corners is dropped below this share of the stretch.
const TOUCHING: f64 = 1e-6;
/// Corners and stretches that one task takes at most.
pub const TASK: usize = 1024;

/// Where one stretch ends and the next begins.
struct Joint<const M: usize> {
    /// The first piece after it.
    at: usize,
    /// None at a halt, in a cusp, at the ends of the path and where there is no tangent.
    jump: Option<Jump<M>>,
}

/// The pieces in stretches, with the stations that cuts refer to.
pub struct Stretches<'a, const M: usize> {
    pieces: &'a [Followed<M>],
    /// The program's.
    splines: &'a CompositeCurve<M>,
    joints: Vec<Joint<M>>,
    /// For each piece, the sum of the widths before it in its stretch.
    station: Vec<f64>,
    pub length: Vec<f64>,
    rounding: Rounding,
}

/// The stations where a rounded corner begins in the stretch before it and ends in the stretch after it.
#[derive(Clone, Copy)]
pub struct Cuts {
    before: f64,
    after: f64,
}

impl<'a, const M: usize> Stretches<'a, M> {
    pub fn new(
        pieces: &'a [Followed<M>],
        splines: &'a CompositeCurve<M>,
        halt: &[bool],
        rounding: Rounding,
    ) -> Self {
        let end = |at| Joint { at, jump: None };
        let inner = (1..pieces.len()).into_par_iter().filter_map(|at| {
            let (before, after) = (&pieces[at - 1], &pieces[at]);
            let halts = after.first > before.last && halt[before.last as usize];
            if halts || before.piece.rests()[1] || after.piece.rests()[0] {
                return Some(end(at));
            }
            let jump = Jump::new(&before.piece, &after.piece);
            match jump {
                Some(jump) if jump.is_smooth(&before.piece, &after.piece) => None,
                _ => Some(Joint { at, jump }),
            }
        });
        let mut joints = vec![end(0)];
        joints.par_extend(inner);
        joints.push(end(pieces.len()));

        let mut station = Vec::with_capacity(pieces.len());
        let mut length = Vec::with_capacity(joints.len());
        for pair in joints.windows(2) {
            let mut sum = 0.0;
            for followed in &pieces[pair[0].at..pair[1].at] {
                station.push(sum);
                sum += followed.piece.width();
            }
            length.push(sum);
        }
        Self { pieces, splines, joints, station, length, rounding }
    }

    /// Number of joints, both ends of the path included.
    pub fn joint_count(&self) -> usize {
        self.joints.len()
    }

    /// The pieces before joint `k`, from the joint backwards, and those after it.
    fn sides(&self, k: usize) -> (impl Iterator<Item = &Followed<M>>, impl Iterator<Item = &Followed<M>>) {
        let at = self.joints[k].at;
        let before = &self.pieces[self.joints[k - 1].at..at];
        let after = &self.pieces[at..self.joints[k + 1].at];
        (before.iter().rev(), after.iter())
    }

    /// The length at which rounding corner `k` is as fast as the feed, or all that the tolerance allows on both
    /// sides; 0 where it is not rounded.
    pub fn need(&self, k: usize, axes: &Axes<M>) -> f64 {
        let Some(jump) = &self.joints[k].jump else { return 0.0 };
        let at = self.joints[k].at;
        let (before, after) = (&self.pieces[at - 1], &self.pieces[at]);
        let exact = before.exact || after.exact;
        let curved = |side: &Followed<M>| side.arc || matches!(side.piece, Shape::Spline(_));
        if jump.reverses() || exact && !((curved(before) || curved(after)) && jump.size <= CURVE_JOINT) {
            return 0.0;
        }
        let mut wanted = jump
            .length_for(
                [&before.piece, &after.piece],
                before.feed.min(after.feed),
                &axes.max_velocity,
                &axes.max_acceleration,
            )
            .max(LEAST_LENGTH * before.tolerance.min(after.tolerance));
        // A circle touches one line on each side; what is curved is bent.
        let lines = [before, after].map(|side| side.piece.conic().filter(|conic| conic.is_line()));
        let mut rounding = Rounding::Parabola;
        if let (Rounding::Circle, [Some(first), Some(second)]) = (self.rounding, lines) {
            (wanted, rounding) = (wanted.min(first.width).min(second.width), Rounding::Circle);
        }
        let (backwards, forwards) = self.sides(k);
        let length = reach(backwards, jump, exact, rounding, wanted);
        reach(forwards, jump, exact, rounding, length)
    }

    /// Where piece `i` of stretch `k` ends.
    fn end_station(&self, k: usize, i: usize) -> f64 {
        if i + 1 < self.joints[k + 1].at {
            self.station[i + 1]
        } else {
            self.length[k]
        }
    }

    /// The piece of stretch `k` at a station.
    fn piece_at(&self, k: usize, station: f64) -> usize {
        let (start, end) = (self.joints[k].at, self.joints[k + 1].at);
        start + self.station[start..end].partition_point(|&other| other <= station).max(1) - 1
    }

    /// A cut at a station of stretch `k`, moved to the end of a piece that is next to it, so that no sliver is
    /// left. Both corners that touch in a cut move it alike, and none loses a side by it.
    fn snapped(&self, k: usize, station: f64) -> f64 {
        const NEXT: f64 = 1e-6;
        const SMALL: f64 = 1e-3;
        let i = self.piece_at(k, station);
        let (from, to) = (self.station[i], self.end_station(k, i));
        let near = (NEXT * (to - from)).min(SMALL * station.min(self.length[k] - station));
        if station - from <= near {
            from
        } else if to - station <= near {
            to
        } else {
            station
        }
    }

    /// Stretch `k` between two stations. Pieces of splines that are cut, or all of them where they are to be
    /// `bent`, are added to `made`.
    fn region(
        &self,
        k: usize,
        [from, to]: [f64; 2],
        bent: bool,
        pieces: &mut Vec<Followed<M>>,
        made: &mut CompositeCurve<M>,
    ) {
        for i in self.piece_at(k, from)..self.joints[k + 1].at {
            let (start, end) = (self.station[i], self.end_station(k, i));
            if start >= to {
                break;
            }
            let whole = &self.pieces[i].piece;
            let low = if from <= start { 0.0 } else { from - start };
            let high = if to >= end { whole.width() } else { to - start };
            if from >= end || low >= high {
                continue;
            }
            let piece = match whole {
                Shape::Conic(conic) => Some(Shape::Conic(conic.part(low, high))),
                Shape::Spline(spline) if low == 0.0 && high == spline.width && !bent => Some(*whole),
                Shape::Spline(spline) => spline.part(self.splines, low, high, made).map(Shape::Spline),
            };
            pieces.extend(piece.map(|piece| Followed { piece, ..self.pieces[i] }));
        }
    }

    /// The sides of corner `k` between its cuts.
    fn cut_sides(&self, k: usize, cuts: Cuts, sides: &mut Sides<M>) {
        let Sides { before, after, made } = sides;
        before.clear();
        after.clear();
        made.clear();
        self.region(k - 1, [cuts.before, f64::INFINITY], true, before, made);
        self.region(k, [0.0, cuts.after], true, after, made);
    }

    /// Where corner `k` begins and ends, None where the tolerance leaves no room for it.
    pub fn settle(&self, k: usize, length: &[f64], sides: &mut Sides<M>) -> Option<Cuts> {
        const TRIALS: usize = 40;
        let jump = self.joints[k].jump.as_ref().filter(|jump| !jump.vanishes(length[k]))?;
        let (mut before, mut after) = (length[k], length[k]);
        for _ in 0..TRIALS {
            let mut cuts = Cuts { before: self.length[k - 1] - before, after };
            // Corners that touch must cut at the same place.
            if cuts.before - length[k - 1] <= TOUCHING * self.length[k - 1] {
                cuts.before = length[k - 1];
            }
            cuts = Cuts { before: self.snapped(k - 1, cuts.before), after: self.snapped(k, cuts.after) };
            self.cut_sides(k, cuts, sides);
            let excess = match sides.between_lines(jump, self.rounding) {
                Some(corner) => corner.deviation / corner.tolerance,
                None => sides.bend(jump)?,
            };
            // The bounds are sums, which may be rounded up.
            if excess <= 1.0 + 1e-9 {
                return Some(cuts);
            }
            // The parameter of a curved side is not its length, so it can allow less than it promised.
            let shorter = (1.0 - 1e-5) / excess;
            (before, after) = (shorter * before, shorter * after);
            if jump.vanishes(after) {
                return None;
            }
        }
        None
    }

    /// Corners and what they leave of the stretches, in order and in parts, and the runs.
    pub fn assemble(&self, corners: &[Option<Cuts>], jump: bool, watch: Watch) -> (Vec<Part<M>>, Vec<usize>) {
        let count = self.length.len();
        let tasks: Vec<(Part<M>, Vec<usize>)> = (0..count.div_ceil(TASK))
            .into_par_iter()
            .map(|task| {
                let stretches = task * TASK..count.min((task + 1) * TASK);
                watch.each(count).advance(stretches.len());
                let inside = self.joints[stretches.end].at - self.joints[stretches.start].at;
                let mut part = Part::default();
                part.pieces.reserve(inside + 2 * stretches.len());
                let (mut runs, mut sides) = (Vec::new(), Sides::default());
                for k in stretches {
                    let start = match (corners[k], &self.joints[k].jump) {
                        (Some(cuts), Some(turn)) => {
                            self.cut_sides(k, cuts, &mut sides);
                            if let Some(corner) = sides.between_lines(turn, self.rounding) {
                                part.pieces.push(corner);
                            } else {
                                sides.bend(turn);
                                part.append(&sides);
                            }
                            cuts.after
                        }
                        (_, turn) => {
                            if !(jump && turn.is_some()) {
                                runs.push(part.pieces.len());
                            }
                            0.0
                        }
                    };
                    let end = corners[k + 1].map_or(f64::INFINITY, |cuts| cuts.before);
                    self.region(k, [start, end], false, &mut part.pieces, &mut part.made);
                }
                (part, runs)
            })
            .collect();
        let (mut parts, mut runs, mut total) = (Vec::with_capacity(tasks.len()), Vec::new(), 0);
        for (part, starts) in tasks {
            runs.extend(starts.iter().map(|start| start + total));
            total += part.pieces.len();
            parts.push(part);
        }
        runs.push(total);
        (parts, runs)
    }
}

/// Consecutive pieces of a path that one task makes, and the pieces of splines that corners made for it.
#[derive(Clone, Debug)]
pub struct Part<const M: usize> {
    pub pieces: Vec<Followed<M>>,
    made: CompositeCurve<M>,
}

impl<const M: usize> Default for Part<M> {
    fn default() -> Self {
        Self { pieces: vec![], made: CompositeCurve::default() }
    }
}

impl<const M: usize> Part<M> {
    /// The piece of a spline of this part, `splines` being the program's; its width is that of the spline.
    pub fn spline<'a>(&'a self, spline: &Spline<M>, splines: &'a CompositeCurve<M>) -> Piece<'a, M> {
        let source = if spline.made { &self.made } else { splines };
        source.piece(spline.index as usize)
    }

    /// Appends a polynomial piece; all but its shape is that of `like`.
    pub fn push(&mut self, control: &[[f64; M]], width: f64, like: Followed<M>) {
        if let [start, end] = *control {
            self.pieces.push(Followed { piece: Shape::Conic(Conic::line(start, end)), ..like });
            return;
        }
        self.made.push(control, &[], width);
        let piece = Spline::last_made(&self.made).map(Shape::Spline);
        self.pieces.extend(piece.map(|piece| Followed { piece, ..like }));
    }

    fn append(&mut self, sides: &Sides<M>) {
        let before = self.made.len() as u32;
        for piece in sides.made.pieces() {
            self.made.push(piece.control, piece.weights, piece.width);
        }
        for &followed in sides.before.iter().chain(&sides.after) {
            let mut own = followed;
            if let Shape::Spline(spline) = &mut own.piece {
                spline.index += before;
            }
            self.pieces.push(own);
        }
    }
}

/// How much of `wanted` a side of a corner allows: what its pieces have left of their tolerance, and its length.
fn reach<'a, const M: usize>(
    side: impl Iterator<Item = &'a Followed<M>>,
    jump: &Jump<M>,
    exact: bool,
    rounding: Rounding,
    wanted: f64,
) -> f64 {
    let (mut length, mut station) = (wanted, 0.0);
    for followed in side {
        if followed.exact && !exact {
            break;
        }
        let room = jump.length_within(followed.tolerance - followed.deviation, rounding);
        length = length.min(room.max(station));
        station += followed.piece.width();
        if station >= length {
            return length;
        }
    }
    length.min(station)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cuts_next_to_the_end_of_a_piece_leave_no_sliver() {
        // A line of 10 mm in two pieces.
        let points = [[0.0, 0.0], [10.0, 0.0], [10.0, 10.0]];
        let line = |a, b| Followed {
            piece: Shape::Conic(Conic::line(a, b)),
            first: 0,
            last: 0,
            feed: 10.0,
            deviation: 0.0,
            tolerance: 1.0,
            exact: false,
            arc: false,
        };
        let lines = [line(points[0], points[1]), line(points[1], points[2])];
        let whole = Conic::line(points[0], points[1]);
        let side = [whole.part(0.0, 4.0), whole.part(4.0, 10.0), Conic::line(points[1], points[2])]
            .map(|piece| Followed { piece: Shape::Conic(piece), ..lines[0] });
        let splines = CompositeCurve::default();
        let stretches = Stretches::new(&side, &splines, &[false; 2], Rounding::Parabola);
        assert_eq!(stretches.length, [10.0, 10.0]);
        for (station, moved) in [(4.0 + 1e-9, 4.0), (4.0 - 1e-9, 4.0), (4.1, 4.1), (1e-9, 1e-9)] {
            assert_eq!(stretches.snapped(0, station), moved);
            let (mut before, mut after, mut made) = (Vec::new(), Vec::new(), CompositeCurve::default());
            stretches.region(0, [0.0, moved], false, &mut before, &mut made);
            stretches.region(0, [moved, f64::INFINITY], false, &mut after, &mut made);
            let end = before.last().unwrap().piece.conic().unwrap().control[2];
            assert_eq!(end, *after[0].piece.start());
            assert_eq!(before.len() + after.len(), if moved == 4.0 { 2 } else { 3 });
        }
    }
}
