//! A program becomes a path: pieces from `follow`, corners from `corner`, runs between full stops.
//!
//! Joints at which the pieces do not meet smoothly divide the path into stretches. A joint is a stop where the
//! program halts, a rounded corner where the tolerance allows one, and otherwise a corner that is passed with a
//! velocity jump (if the machine allows one) or at rest. Rounding starts in the stretches on both sides and
//! cuts away their ends; what is left of them in the middle stays as it is. All stages run over stretches in
//! parallel and join their results in order, so the path does not depend on the number of threads.

use rayon::prelude::*;

use crate::corner::{bend, between, is_line, rescale, share_lengths, Jump};
use crate::follow::{follow, FollowError, FollowOptions, Followed, FollowedProgram, Moves};
use crate::quadratic::{norm, Quadratic};

/// Exact paths are smoothed only where an arc meets its neighbour with a turn below this (rad): that is what
/// rounded coordinates leave of a tangent joint.
const ARC_JOINT: f64 = 0.0175;
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
    pub pieces: Vec<Followed<M>>,
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

/// A rounded corner: its pieces, and what is cut off the stretches before and after.
struct Rounded<const M: usize> {
    pieces: Vec<Followed<M>>,
    end_cut: f64,
    start_cut: f64,
}

/// The path of a program.
pub fn build_path<const M: usize>(
    moves: &Moves<M>,
    options: &FollowOptions,
    axes: &Axes<M>,
) -> Result<BuiltPath<M>, FollowError> {
    let FollowedProgram { pieces, points, splines, polynomials } = follow(moves, options)?;
    if pieces.is_empty() {
        let (pieces, runs) = (pieces, vec![0]);
        return Ok(BuiltPath { pieces, runs, deviation: 0.0, points, splines, polynomials, outside: None });
    }
    let stretches = Stretches::new(&pieces, moves.halt);
    let joints = 0..stretches.joints.len();
    let need: Vec<f64> = joints.clone().into_par_iter().map(|k| stretches.need(k, axes)).collect();
    let length = share_lengths(&need, &stretches.length);
    let corners: Vec<Option<Rounded<M>>> =
        joints.into_par_iter().with_min_len(TASK).map(|k| stretches.round(k, &length)).collect();
    let (pieces, runs) = stretches.assemble(&corners, axes.jump);
    Ok(BuiltPath {
        deviation: pieces.iter().map(|followed| followed.deviation).fold(0.0, f64::max),
        outside: outside(&pieces, moves, &axes.travel),
        pieces,
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
            if after.first > before.last && halt[before.last] {
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
        let meets_arc = before.bulge > 0.0 || after.bulge > 0.0;
        if jump.reverses() || exact && !(meets_arc && jump.size <= ARC_JOINT) {
            return 0.0;
        }
        // Small turns need little, but no less than what the tolerance calls small.
        let wanted = jump
            .length_for(before.feed.min(after.feed), &axes.max_velocity, &axes.max_acceleration)
            .max(before.tolerance.min(after.tolerance));
        let (backwards, forwards) = self.sides(k);
        reach(forwards, jump, exact, reach(backwards, jump, exact, wanted))
    }

    /// Stretch `k` between two stations.
    fn region(&self, k: usize, from: f64, to: f64, pieces: &mut Vec<Followed<M>>) {
        let (start, end) = (self.joints[k].at, self.joints[k + 1].at);
        let first = start + self.station[start..end].partition_point(|&station| station <= from).max(1) - 1;
        for i in first..end {
            let station = self.station[i];
            if station >= to {
                break;
            }
            if let Some(piece) = between(&self.pieces[i].piece, from - station, to - station) {
                pieces.push(Followed { piece, ..self.pieces[i] });
            }
        }
    }

    /// Rounds corner `k`, None where the tolerance leaves no room for it.
    fn round(&self, k: usize, length: &[f64]) -> Option<Rounded<M>> {
        const TRIALS: usize = 40;
        let jump = self.joints[k].jump.as_ref().filter(|jump| !jump.vanishes(length[k]))?;
        // Corners that touch must cut at the same place.
        let mut end_cut = self.length[k - 1] - length[k];
        if end_cut - length[k - 1] <= TOUCHING * self.length[k - 1] {
            end_cut = length[k - 1];
        }
        let mut start_cut = length[k];
        for _ in 0..TRIALS {
            let (mut before, mut after) = (Vec::new(), Vec::new());
            self.region(k - 1, end_cut, f64::INFINITY, &mut before);
            self.region(k, 0.0, start_cut, &mut after);
            match bent(jump, &before, &after)? {
                Ok(pieces) => return Some(Rounded { pieces, end_cut, start_cut }),
                Err(excess) => {
                    // The tolerance allows less than the lengths promised, because the parameter of a curved
                    // side is not its length.
                    let shorter = (1.0 - 1e-5) / excess;
                    start_cut *= shorter;
                    end_cut = self.length[k - 1] - shorter * (self.length[k - 1] - end_cut);
                    if jump.vanishes(start_cut) {
                        return None;
                    }
                }
            }
        }
        None
    }

    /// Corners and what they leave of the stretches, in order, and the runs.
    fn assemble(&self, corners: &[Option<Rounded<M>>], jump: bool) -> (Vec<Followed<M>>, Vec<usize>) {
        let count = self.length.len();
        let tasks: Vec<(Vec<Followed<M>>, Vec<usize>)> = (0..count.div_ceil(TASK))
            .into_par_iter()
            .map(|task| {
                let (mut pieces, mut runs) = (Vec::new(), Vec::new());
                for k in task * TASK..count.min((task + 1) * TASK) {
                    let start = match &corners[k] {
                        Some(rounded) => {
                            pieces.extend_from_slice(&rounded.pieces);
                            rounded.start_cut
                        }
                        None => {
                            if !(jump && self.joints[k].jump.is_some()) {
                                runs.push(pieces.len());
                            }
                            0.0
                        }
                    };
                    let end = corners[k + 1].as_ref().map_or(f64::INFINITY, |rounded| rounded.end_cut);
                    self.region(k, start, end, &mut pieces);
                }
                (pieces, runs)
            })
            .collect();
        let mut pieces = Vec::with_capacity(tasks.iter().map(|(pieces, _)| pieces.len()).sum());
        let mut runs = Vec::new();
        for (part, starts) in tasks {
            runs.extend(starts.iter().map(|start| start + pieces.len()));
            pieces.extend_from_slice(&part);
        }
        runs.push(pieces.len());
        (pieces, runs)
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

/// The pieces of a rounded corner. None: a side is empty. Err: by what factor a tolerance is exceeded.
fn bent<const M: usize>(
    jump: &Jump<M>,
    before: &[Followed<M>],
    after: &[Followed<M>],
) -> Option<Result<Vec<Followed<M>>, f64>> {
    let mut side_before: Vec<Quadratic<M>> = before.iter().map(|followed| followed.piece).collect();
    let mut side_after: Vec<Quadratic<M>> = after.iter().map(|followed| followed.piece).collect();
    let (last, first) = (before.last()?, after.first()?);
    let (length_before, length_after) = (rescale(&mut side_before, true), rescale(&mut side_after, false));
    let displacement = jump.displacement(length_before, length_after);
    let distance = norm(&displacement);

    let one_parabola = before.len() == 1
        && after.len() == 1
        && is_line(&last.piece)
        && is_line(&first.piece)
        && last.feed == first.feed
        && last.tolerance == first.tolerance;
    let mut pieces: Vec<Followed<M>> = before.iter().chain(after).copied().collect();
    let mut excess: f64 = 0.0;
    let mut deviate = |index: usize, share: f64| {
        let followed = &mut pieces[index];
        let room = followed.tolerance - followed.deviation;
        excess = excess.max(distance * share / room);
        followed.deviation += distance * share;
    };
    bend(&mut side_before, true, &displacement, length_before, &mut deviate);
    bend(&mut side_after, false, &displacement, length_after, |index, share| {
        deviate(before.len() + index, share)
    });
    // The bounds are sums, which may be rounded up.
    if excess > 1.0 + 1e-9 {
        return Some(Err(excess));
    }
    if one_parabola {
        let control = [last.piece.control[0], last.piece.control[2], first.piece.control[2]];
        return Some(Ok(vec![Followed {
            piece: Quadratic { control, width: length_before + length_after },
            first: last.first,
            last: first.last,
            deviation: distance + last.deviation.max(first.deviation),
            ..*last
        }]));
    }
    for (followed, piece) in pieces.iter_mut().zip(side_before.into_iter().chain(side_after)) {
        followed.piece = piece;
    }
    Some(Ok(pieces))
}

/// The first position outside the travel: of arcs as programmed, of everything else as followed.
fn outside<const M: usize>(
    pieces: &[Followed<M>],
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
    let arcs = moves.arcs.par_iter().find_map_first(|&(index, shape)| {
        shape.plane.iter().find_map(|&axis| beyond(index, axis, moves.arc_extent(index, axis)?, 0.0))
    });
    let curves = pieces.par_iter().find_map_first(|followed| {
        (0..M).find_map(|axis| beyond(followed.first, axis, extent(&followed.piece, axis), followed.bulge))
    });
    [arcs, curves].into_iter().flatten().min_by_key(|place| place.index)
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
