//! A program becomes a path: pieces from `follow`, corners from `corner`, runs between full stops.
//!
//! Joints at which the pieces do not meet smoothly divide the path into stretches. A joint is a stop where the
//! program halts, a rounded corner where the tolerance allows one, and otherwise a corner that is passed with a
//! velocity jump (if the machine allows one) or at rest. Rounding starts in the stretches on both sides and
//! cuts away their ends; what is left of them in the middle stays as it is. All stages run over stretches in
//! parallel and join their results in order, so the path does not depend on the number of threads.

use rayon::prelude::*;

use crate::corner::{cut, share_lengths, Jump, Sides};
use crate::follow::{follow, FollowError, FollowOptions, Followed, FollowedProgram, Moves};
use crate::quadratic::Quadratic;

/// Exact paths are smoothed only where an arc meets its neighbour with a turn below this (rad): that is what
/// rounded coordinates leave of a tangent joint.
const ARC_JOINT: f64 = 0.0175;
/// No corner is shorter than this times the tolerance because it needs no more: pieces of no size help nobody.
const LEAST_LENGTH: f64 = 0.01;
/// What is left between two corners is dropped below this share of the stretch.
const TOUCHING: f64 = 1e-9;
/// Corners and stretches that one task takes at most.
const TASK: usize = 1024;

/// What the axes allow.
pub struct Axes<const M: usize> {
    /// In mm/s and mm/s².
    pub max_velocity: [f64; M],
    pub max_acceleration: [f64; M],
    /// Least and greatest position in mm.
    pub travel: [[f64; 2]; M],
    /// Corners may be passed with a velocity jump.
    pub jump: bool,
}

/// The path of a program.
pub struct BuiltPath<const M: usize> {
    /// The pieces in order, in the parts that were made in parallel.
    pub parts: Vec<Vec<Followed<M>>>,
    /// Index of the first piece of each run, and the number of pieces.
    pub runs: Vec<usize>,
    /// Upper bound of the distance between path and program, both ways.
    pub deviation: f64,
    /// Chords that were fitted, splines and polynomials that came of it.
    pub points: usize,
    pub splines: usize,
    pub polynomials: usize,
    /// The first place outside the travel of an axis.
    pub outside: Option<Outside>,
}

/// A position that an axis cannot reach.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Outside {
    pub index: usize,
    pub axis: usize,
    pub position: f64,
}

/// Where one stretch ends and the next begins.
struct Joint<const M: usize> {
    /// The first piece after it.
    at: usize,
    /// None at a halt, at the ends of the path and where there is no tangent.
    jump: Option<Jump<M>>,
}

/// The pieces in stretches, with the stations that cuts refer to.
struct Stretches<'a, const M: usize> {
    pieces: &'a [Followed<M>],
    joints: Vec<Joint<M>>,
    /// For each piece, the sum of the widths before it in its stretch.
    station: Vec<f64>,
    length: Vec<f64>,
}

/// The stations where a rounded corner begins in the stretch before it and ends in the stretch after it.
#[derive(Clone, Copy)]
struct Cuts {
    before: f64,
    after: f64,
}

/// The path of a program.
pub fn build_path<const M: usize>(
    moves: &Moves<M>,
    options: &FollowOptions,
    axes: &Axes<M>,
) -> Result<BuiltPath<M>, FollowError> {
    let FollowedProgram { pieces, points, splines, polynomials } = follow(moves, options)?;
    let (mut parts, mut runs) = (Vec::new(), vec![0]);
    if !pieces.is_empty() {
        let stretches = Stretches::new(&pieces, moves.halt);
        let joints = 0..stretches.joints.len();
        let need: Vec<f64> = joints.clone().into_par_iter().map(|k| stretches.need(k, axes)).collect();
        let length = share_lengths(&need, &stretches.length);
        let corners: Vec<Option<Cuts>> = joints
            .into_par_iter()
            .with_min_len(TASK)
            .map_init(Sides::default, |sides, k| stretches.settle(k, &length, sides))
            .collect();
        (parts, runs) = stretches.assemble(&corners, axes.jump);
    }
    let deviation = |part: &Vec<Followed<M>>| part.iter().map(|piece| piece.deviation).fold(0.0, f64::max);
    Ok(BuiltPath {
        deviation: parts.iter().map(deviation).fold(0.0, f64::max),
        outside: outside(&parts, moves, &axes.travel),
        parts,
        runs,
        points,
        splines,
        polynomials,
    })
}

impl<'a, const M: usize> Stretches<'a, M> {
    fn new(pieces: &'a [Followed<M>], halt: &[bool]) -> Self {
        let end = |at| Joint { at, jump: None };
        let inner = (1..pieces.len()).into_par_iter().filter_map(|at| {
            let (before, after) = (&pieces[at - 1], &pieces[at]);
            if after.first > before.last && halt[before.last as usize] {
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
                sum += followed.piece.width;
            }
            length.push(sum);
        }
        Self { pieces, joints, station, length }
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
    fn need(&self, k: usize, axes: &Axes<M>) -> f64 {
        let Some(jump) = &self.joints[k].jump else { return 0.0 };
        let at = self.joints[k].at;
        let (before, after) = (&self.pieces[at - 1], &self.pieces[at]);
        let exact = before.exact || after.exact;
        let meets_arc = before.arc || after.arc;
        if jump.reverses() || exact && !(meets_arc && jump.size <= ARC_JOINT) {
            return 0.0;
        }
        let wanted = jump
            .length_for(
                [&before.piece, &after.piece],
                before.feed.min(after.feed),
                &axes.max_velocity,
                &axes.max_acceleration,
            )
            .max(LEAST_LENGTH * before.tolerance.min(after.tolerance));
        let (backwards, forwards) = self.sides(k);
        reach(forwards, jump, exact, reach(backwards, jump, exact, wanted))
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

    /// Stretch `k` between two stations.
    fn region(&self, k: usize, from: f64, to: f64, pieces: &mut Vec<Followed<M>>) {
        for i in self.piece_at(k, from)..self.joints[k + 1].at {
            let (start, end) = (self.station[i], self.end_station(k, i));
            if start >= to {
                break;
            }
            let piece = &self.pieces[i].piece;
            let low = if from <= start { 0.0 } else { from - start };
            let high = if to >= end { piece.width } else { to - start };
            if from < end && low < high {
                pieces.push(Followed { piece: cut(piece, low, high), ..self.pieces[i] });
            }
        }
    }

    /// The sides of corner `k` between its cuts.
    fn cut_sides(&self, k: usize, cuts: Cuts, sides: &mut Sides<M>) {
        sides.before.clear();
        sides.after.clear();
        self.region(k - 1, cuts.before, f64::INFINITY, &mut sides.before);
        self.region(k, 0.0, cuts.after, &mut sides.after);
    }

    /// Where corner `k` begins and ends, None where the tolerance leaves no room for it.
    fn settle(&self, k: usize, length: &[f64], sides: &mut Sides<M>) -> Option<Cuts> {
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
            let excess = match sides.parabola(jump) {
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
    fn assemble(&self, corners: &[Option<Cuts>], jump: bool) -> (Vec<Vec<Followed<M>>>, Vec<usize>) {
        let count = self.length.len();
        let tasks: Vec<(Vec<Followed<M>>, Vec<usize>)> = (0..count.div_ceil(TASK))
            .into_par_iter()
            .map(|task| {
                let stretches = task * TASK..count.min((task + 1) * TASK);
                let inside = self.joints[stretches.end].at - self.joints[stretches.start].at;
                let mut pieces = Vec::with_capacity(inside + 2 * stretches.len());
                let (mut runs, mut sides) = (Vec::new(), Sides::default());
                for k in stretches {
                    let start = match (corners[k], &self.joints[k].jump) {
                        (Some(cuts), Some(turn)) => {
                            self.cut_sides(k, cuts, &mut sides);
                            if let Some(corner) = sides.parabola(turn) {
                                pieces.push(corner);
                            } else {
                                sides.bend(turn);
                                pieces.extend_from_slice(&sides.before);
                                pieces.extend_from_slice(&sides.after);
                            }
                            cuts.after
                        }
                        (_, turn) => {
                            if !(jump && turn.is_some()) {
                                runs.push(pieces.len());
                            }
                            0.0
                        }
                    };
                    let end = corners[k + 1].map_or(f64::INFINITY, |cuts| cuts.before);
                    self.region(k, start, end, &mut pieces);
                }
                (pieces, runs)
            })
            .collect();
        let (mut parts, mut runs, mut total) = (Vec::with_capacity(tasks.len()), Vec::new(), 0);
        for (part, starts) in tasks {
            runs.extend(starts.iter().map(|start| start + total));
            total += part.len();
            parts.push(part);
        }
        runs.push(total);
        (parts, runs)
    }
}

/// How much of `wanted` a side of a corner allows: what its pieces have left of their tolerance, and its length.
fn reach<'a, const M: usize>(
    side: impl Iterator<Item = &'a Followed<M>>,
    jump: &Jump<M>,
    exact: bool,
    wanted: f64,
) -> f64 {
    let (mut length, mut station) = (wanted, 0.0);
    for followed in side {
        if followed.exact && !exact {
            break;
        }
        let room = jump.length_within(followed.tolerance - followed.deviation);
        length = length.min(room.max(station));
        station += followed.piece.width;
        if station >= length {
            return length;
        }
    }
    length.min(station)
}

/// The first position outside the travel: of the moves as programmed, and of the path, whose arcs may be as far
/// beyond as they deviate.
fn outside<const M: usize>(
    parts: &[Vec<Followed<M>>],
    moves: &Moves<M>,
    travel: &[[f64; 2]; M],
) -> Option<Outside> {
    // Positions come from sums of offsets; a nanometre more is no fault.
    const SLACK: f64 = 1e-6;
    if travel.iter().flatten().all(|limit| limit.is_infinite()) {
        return None;
    }
    let beyond = |index: usize, axis: usize, (least, greatest): (f64, f64), bulge: f64| {
        let [low, high] = travel[axis];
        let slack = SLACK + bulge;
        if least < low - slack {
            Some(Outside { index, axis, position: least })
        } else if greatest > high + slack {
            Some(Outside { index, axis, position: greatest })
        } else {
            None
        }
    };
    let targets = moves.target.par_iter().enumerate().find_map_first(|(index, target)| {
        (0..M).find_map(|axis| beyond(index, axis, (target[axis], target[axis]), 0.0))
    });
    let arcs = moves.arcs.par_iter().find_map_first(|&(index, shape)| {
        shape.plane.iter().find_map(|&axis| beyond(index, axis, moves.arc_extent(index, axis)?, 0.0))
    });
    let curves = parts.par_iter().find_map_first(|part| {
        part.iter().find_map(|followed| {
            let bulge = if followed.arc { followed.deviation } else { 0.0 };
            let index = followed.first as usize;
            (0..M).find_map(|axis| beyond(index, axis, extent(&followed.piece, axis), bulge))
        })
    });
    [targets, arcs, curves].into_iter().flatten().min_by_key(|place| place.index)
}

/// Least and greatest value of an axis on a piece.
fn extent<const M: usize>(piece: &Quadratic<M>, axis: usize) -> (f64, f64) {
    let [a, b, c] = piece.control.map(|point| point[axis]);
    let (mut least, mut greatest) = (a.min(c), a.max(c));
    if b < least || b > greatest {
        let t = (a - b) / (a - 2.0 * b + c);
        let turn = a + t * (b - a);
        least = least.min(turn);
        greatest = greatest.max(turn);
    }
    (least, greatest)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::follow::LINE;
    use crate::quadratic::{norm, sub};
    use proptest::prelude::*;

    const OPTIONS: FollowOptions = FollowOptions {
        exact_tolerance: 1e-3,
        max_chord: 5.0,
        corner_acceleration: 4e3,
        max_speed: 1e3,
        corner_angle: 0.48,
    };

    fn axes<const M: usize>(jump: bool) -> Axes<M> {
        Axes {
            max_velocity: [500.0; M],
            max_acceleration: [1000.0; M],
            travel: [[f64::NEG_INFINITY, f64::INFINITY]; M],
            jump,
        }
    }

    fn polyline(
        points: &[[f64; 2]],
        tolerance: &[f64],
        fit: bool,
        jump: bool,
    ) -> (Vec<Followed<2>>, Vec<usize>) {
        let count = points.len() - 1;
        let fit: Vec<f64> =
            tolerance.iter().map(|tolerance| if fit { 0.5 * tolerance } else { 0.0 }).collect();
        let moves = Moves {
            start: points[0],
            kind: &vec![LINE; count],
            target: &points[1..],
            feed: &vec![100.0; count],
            tolerance,
            fit_tolerance: &fit,
            halt: &vec![false; count],
            arcs: &[],
        };
        let path = build_path(&moves, &OPTIONS, &axes(jump)).unwrap();
        (path.parts.concat(), path.runs)
    }

    #[test]
    fn a_square_is_rounded_at_its_corners_and_nowhere_else() {
        let square = [[0.0, 0.0], [10.0, 0.0], [10.0, 10.0], [0.0, 10.0], [0.0, 0.0]];
        let (pieces, runs) = polyline(&square, &[0.01; 4], false, false);
        let edge = 10.0 - 0.02 * 2f64.sqrt();
        assert_eq!((pieces.len(), &runs[..]), (7, &[0, 7][..]));
        assert!(norm(&sub(&pieces[0].piece.control[2], &[edge, 0.0])) < 1e-12);
        assert_eq!(pieces[1].piece.control[1], [10.0, 0.0]);
        assert_eq!((pieces[1].first, pieces[1].last), (0, 1));
        let (exact, stops) = polyline(&square, &[0.0; 4], false, false);
        assert_eq!((exact.len(), &stops[..]), (4, &[0, 1, 2, 3, 4][..]));
        let (passed, none) = polyline(&square, &[0.0; 4], false, true);
        assert_eq!((passed.len(), &none[..]), (4, &[0, 4][..]));
    }

    #[test]
    fn a_zig_zag_of_short_edges_is_all_corners_that_touch() {
        let points: Vec<[f64; 2]> =
            (0..41).map(|i| [0.02 * i as f64, if i % 2 == 0 { 0.0 } else { 0.02 }]).collect();
        let (pieces, runs) = polyline(&points, &[0.1; 40], false, false);
        // 39 corners; of the first and the last edge half is left.
        assert_eq!((pieces.len(), runs.len()), (41, 2));
        for pair in pieces.windows(2) {
            assert_eq!(pair[0].piece.control[2], pair[1].piece.control[0]);
            assert!(Jump::new(&pair[0].piece, &pair[1].piece).unwrap().size < 1e-9);
        }
    }

    #[test]
    fn a_corner_far_shorter_than_its_sides_is_rounded_all_the_same() {
        for (turn, tolerance) in [(1e-4, 1e-3), (1.5, 1e-5), (1.5, 1e-6)] {
            let end = [100.0 + 100.0 * f64::cos(turn), 100.0 * f64::sin(turn)];
            let (pieces, runs) = polyline(&[[0.0, 0.0], [100.0, 0.0], end], &[tolerance; 2], false, false);
            assert_eq!((pieces.len(), &runs[..]), (3, &[0, 3][..]), "{turn} {tolerance}");
            assert!(pieces[1].deviation <= tolerance * (1.0 + 1e-9));
        }
    }

    #[test]
    fn cuts_next_to_the_end_of_a_piece_leave_no_sliver() {
        // A line of 10 mm in two pieces.
        let points = [[0.0, 0.0], [10.0, 0.0], [10.0, 10.0]];
        let (lines, _) = polyline(&points, &[0.0; 2], false, false);
        let side = [cut(&lines[0].piece, 0.0, 4.0), cut(&lines[0].piece, 4.0, 10.0), lines[1].piece]
            .map(|piece| Followed { piece, ..lines[0] });
        let stretches = Stretches::new(&side, &[false; 2]);
        assert_eq!(stretches.length, [10.0, 10.0]);
        for (station, moved) in [(4.0 + 1e-9, 4.0), (4.0 - 1e-9, 4.0), (4.1, 4.1), (1e-9, 1e-9)] {
            assert_eq!(stretches.snapped(0, station), moved);
            let (mut before, mut after) = (Vec::new(), Vec::new());
            stretches.region(0, 0.0, moved, &mut before);
            stretches.region(0, moved, f64::INFINITY, &mut after);
            assert_eq!(before.last().unwrap().piece.control[2], after[0].piece.control[0]);
            assert_eq!(before.len() + after.len(), if moved == 4.0 { 2 } else { 3 });
        }
    }

    proptest! {
        #[test]
        fn random_polylines_are_joined_smoothly_within_tolerance(
            steps in prop::collection::vec((-1.0..1.0f64, -1.0..1.0f64, -3..2i32), 2..60),
            tolerance in prop::sample::select(vec![1e-4, 1e-2, 1.0]),
            fit: bool,
            exact_from in 0..60usize,
        ) {
            let mut points = vec![[0.0, 0.0]];
            for (x, y, exponent) in steps {
                let scale = 10f64.powi(exponent);
                let [a, b] = points[points.len() - 1];
                points.push([a + scale * x + 1e-4, b + scale * y]);
            }
            let count = points.len() - 1;
            let limits: Vec<f64> = (0..count).map(|i| if i < exact_from { tolerance } else { 0.0 }).collect();
            let (pieces, runs) = polyline(&points, &limits, fit, false);
            prop_assert_eq!(pieces[0].piece.control[0], points[0]);
            prop_assert_eq!(pieces[pieces.len() - 1].piece.control[2], points[count]);
            prop_assert!(pieces[0].first == 0 && pieces[pieces.len() - 1].last as usize == count - 1);
            for (i, pair) in pieces.windows(2).enumerate() {
                prop_assert_eq!(pair[0].piece.control[2], pair[1].piece.control[0]);
                prop_assert!(pair[1].first >= pair[0].first && pair[1].first <= pair[0].last + 1);
                prop_assert!(pair[1].last >= pair[0].last);
                if runs.binary_search(&(i + 1)).is_err() {
                    let jump = Jump::new(&pair[0].piece, &pair[1].piece).unwrap();
                    prop_assert!(jump.is_smooth(&pair[0].piece, &pair[1].piece), "{}", jump.size);
                }
            }
            for piece in &pieces {
                prop_assert!(piece.deviation <= piece.tolerance * (1.0 + 1e-9));
                prop_assert!(!piece.exact || piece.deviation == 0.0);
                prop_assert!(piece.piece.width > 0.0);
            }
        }
    }
}
