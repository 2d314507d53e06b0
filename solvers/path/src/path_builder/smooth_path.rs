//! Builds the path of a program as one C4 curve within the tolerance between any two stops (`smooth_fit`).
//!
//! The tool stops where
//!
//! * the program halts,
//! * moves that ask for the exact path meet others that do not,
//! * a rapid meets a feed so low that it counts as rest, and
//! * the path turns back. If it goes back along the line on which it came and nothing else asks for a stop, it rests there within
//!   a run.
//!
//! Lines that ask for the exact path stay lines, with stops at their corners. Arcs and splines that ask for it, and the lines
//! that touch them, are followed within the exact tolerance.

use std::f64::consts::PI;
use std::ops::Range;

use super::built_path::{Axes, BuiltPath, NotSmooth};
use super::chords::{Chord, Chords};
use super::chunk::Chunk;
use crate::moves::{of_move, MoveError, Moves, PathOptions, RAPID};
use crate::path_piece::{PathPiece, Shape};
use crate::program_pieces::FitCounts;
use crate::smooth_fit::pace::{Moment, Pace};
use crate::smooth_fit::polyline::{angle, Polyline};
use crate::smooth_fit::{smooth_fit, Offsets, SmoothOptions};
use crate::tolerance;
use feedplan_geometry::conic::Conic;
use feedplan_geometry::parallel::{map, try_map};
use feedplan_geometry::quadratic::{norm, sub};
use feedplan_geometry::watch::Watch;

/// The runs of a section are fitted in parallel, in parts of at least this many chords.
const LEAST_PART: usize = 1000;

/// A part of the path between two stops of the program.
#[derive(Default)]
struct Section<const M: usize> {
    chunk: Chunk<M>,
    /// The first piece of each run.
    runs: Vec<usize>,
    not_smooth: NotSmooth,
    fit: FitCounts,
    offsets: Offsets,
}

/// A motion along an earlier path of the same program, to which a smooth path is fitted.
pub struct Motion<const M: usize> {
    /// First and last move of each run of that path.
    pub runs: Vec<[usize; 2]>,
    /// The number of places before each run; the last entry is the number of all places.
    pub start: Vec<usize>,
    /// Places as fractions of their run, ascending, and the square of the speed there, in mm²/s².
    pub place: Vec<f64>,
    pub speed_sq: Vec<f64>,
    /// The second and third derivatives that the path should have at each place.
    pub aim: Vec<[[f64; M]; 2]>,
    /// The jerk limit of each axis in mm/s³; infinite where there is none.
    pub max_jerk: [f64; M],
}

impl<const M: usize> Motion<M> {
    /// The moments along a run of chords; `moving` has the numbers of the axes that move.
    fn along<const D: usize>(&self, chords: &[Chord], station: &[f64], moving: &[usize]) -> Vec<Moment<D>> {
        let (first, last) = (chords[0].first as usize, chords[chords.len() - 1].last as usize);
        let begin = self.runs.partition_point(|run| run[1] < first);
        let mut moments = Vec::new();
        for (run, places) in self.runs.iter().zip(self.start.windows(2)).skip(begin) {
            if run[0] > last {
                break;
            }
            let from = station[chords.partition_point(|chord| (chord.last as usize) < run[0])];
            let to = station[chords.partition_point(|chord| chord.first as usize <= run[1])];
            moments.extend((places[0]..places[1]).map(|i| Moment {
                station: from + self.place[i] * (to - from),
                speed_sq: self.speed_sq[i],
                aim: self.aim[i].each_ref().map(|aim| narrow(aim, moving, 0.0)),
            }));
        }
        moments
    }
}

/// The smooth path of a program. Without a motion it depends on the program only, and bends keep their size. With one it is
/// fitted to the speed of the motion, and bends are cut as far as the tolerance allows.
pub fn build_smooth_path<const M: usize>(
    moves: &Moves<M>,
    options: &PathOptions,
    axes: &Axes<M>,
    motion: Option<&Motion<M>>,
    watch: Watch,
) -> Result<BuiltPath<M>, MoveError> {
    let each = watch.each(moves.kind.len());
    let ranges = sections(moves, tolerance::CRAWL * options.max_speed);
    let sections: Vec<Vec<Section<M>>> = try_map(ranges.len(), 1, |i| {
        let watch = each.part(ranges[i].len() as f64);
        Section::parts(moves, options, axes, ranges[i].clone(), motion, watch)
    })?;
    let (mut chunks, mut runs, mut total) = (vec![], vec![], 0);
    let (mut fit, mut offsets, mut not_smooth) =
        (FitCounts::default(), Offsets::default(), NotSmooth::default());
    for section in sections.into_iter().flatten() {
        runs.extend(section.runs.iter().map(|start| start + total));
        total += section.chunk.pieces.len();
        chunks.push(section.chunk);
        fit += section.fit;
        offsets.merge(&section.offsets);
        not_smooth.reversals.extend(section.not_smooth.reversals);
        not_smooth.corners.extend(section.not_smooth.corners);
    }
    let pieces: Vec<&PathPiece<M>> = chunks.iter().flat_map(|chunk| &chunk.pieces).collect();
    let rests = |first: usize| first > 0 && goes_back(moves, pieces[first - 1], pieces[first]);
    let back: Vec<u32> =
        runs.iter().filter(|&&first| rests(first)).map(|&first| pieces[first - 1].last).collect();
    runs.retain(|&first| !rests(first));
    not_smooth.reversals.retain(|last| back.binary_search(last).is_err());
    runs.push(total);
    let path = BuiltPath::new(chunks, runs, fit, moves, &axes.travel);
    Ok(BuiltPath { offsets: Some(offsets), not_smooth, ..path })
}

/// Ranges of moves between the places where any smooth path stops, also where a rapid meets a feed below `crawl` (mm/s).
fn sections<const M: usize>(moves: &Moves<M>, crawl: f64) -> Vec<Range<usize>> {
    let is_rapid = |i: usize| moves.kind[i] == RAPID;
    let crawls = |i: usize| !is_rapid(i) && moves.feed[i] < crawl;
    let mut sections = Vec::new();
    let mut first = 0;
    for i in 1..=moves.kind.len() {
        let goes_on = i < moves.kind.len()
            && !moves.halt[i - 1]
            && (moves.tolerance[i - 1] > 0.0) == (moves.tolerance[i] > 0.0)
            && !(is_rapid(i - 1) && crawls(i) || crawls(i - 1) && is_rapid(i))
            && of_move(moves.changes, i).is_none();
        if !goes_on {
            sections.push(first..i);
            first = i;
        }
    }
    sections
}

/// Whether the path goes back along its own line after a piece, and nothing else asks for a stop.
fn goes_back<const M: usize>(moves: &Moves<M>, before: &PathPiece<M>, after: &PathPiece<M>) -> bool {
    let (last, first) = (before.last as usize, after.first as usize);
    let halts = (last..first).any(|i| moves.halt[i]);
    let next = moves.changes.partition_point(|change| change.0 <= last);
    let changes = moves.changes.get(next).is_some_and(|change| change.0 <= first);
    let turn = angle(&before.shape.end_edge(), &after.shape.start_edge());
    turn > PI - tolerance::OPPOSITE && !halts && !changes
}

/// How the runs of a section are fitted.
struct Rules<'a, const M: usize> {
    exact: bool,
    travel: [[f64; 2]; M],
    /// Chords longer than this, in mm, are straight in the middle.
    long: f64,
    max_acceleration: [f64; M],
    motion: Option<&'a Motion<M>>,
}

impl<const M: usize> Section<M> {
    /// The path of a section of moves, in parts of one or more runs.
    fn parts(
        moves: &Moves<M>,
        options: &PathOptions,
        axes: &Axes<M>,
        range: Range<usize>,
        motion: Option<&Motion<M>>,
        watch: Watch,
    ) -> Result<Vec<Self>, MoveError> {
        let exact = moves.tolerance[range.start] <= 0.0;
        let has_travel = range.clone().all(|i| moves.joints[i]);
        let travel = if has_travel { axes.travel } else { [[f64::NEG_INFINITY, f64::INFINITY]; M] };
        let max_acceleration = axes.max_acceleration;
        let rules = Rules { exact, travel, long: options.max_chord, max_acceleration, motion };
        let reversal = if motion.is_some() { tolerance::FITTED_REVERSAL } else { tolerance::REVERSAL };
        let chords = moves.chords(options, range)?;
        let count = chords.chords.len();
        let stops = |end: usize| end == count || chords.turn(end) > reversal || exact && !chords.meet(end);
        let ends = map(count, LEAST_PART, |i| stops(i + 1).then_some(i + 1));
        let ends: Vec<usize> = ends.into_iter().flatten().collect();
        let mut parts = vec![];
        let (mut first, mut left) = (0, &ends[..]);
        while !left.is_empty() {
            let short = left.partition_point(|&end| end < first + LEAST_PART);
            let (own, others) = left.split_at((short + 1).min(left.len()));
            parts.push((first, own));
            (first, left) = (own[own.len() - 1], others);
        }
        let each = watch.each(count);
        let part = |(mut first, ends): (usize, &[usize])| {
            let mut part = Self::default();
            for &end in ends {
                // At this end the path turns back; exact moves are not reported.
                if end < count && !exact {
                    part.not_smooth.reversals.push(chords.chords[end - 1].last);
                }
                part.append(&chords, first..end, &rules, each.part((end - first) as f64));
                first = end;
            }
            part
        };
        Ok(map(parts.len(), 1, |i| part(parts[i])))
    }

    /// Appends a run.
    fn append(&mut self, chords: &Chords<M>, run: Range<usize>, rules: &Rules<'_, M>, watch: Watch) {
        self.runs.push(self.chunk.pieces.len());
        let own = &chords.chords[run.clone()];
        if rules.exact && own.iter().all(Chord::is_line) {
            for i in run {
                let line = [chords.points[i], chords.points[i + 1]];
                let like = piece_along(&chords.chords[i..=i], 0.0, true);
                self.chunk.push(&line, 0.0, like);
            }
            return;
        }
        let moving: Vec<usize> = (0..M)
            .filter(|&k| {
                chords.points[run.start..=run.end].iter().any(|p| p[k] != chords.points[run.start][k])
            })
            .collect();
        match moving.len() {
            0..=2 => self.append_curve::<2>(chords, run, &moving, rules, watch),
            3 => self.append_curve::<3>(chords, run, &moving, rules, watch),
            4..=6 => self.append_curve::<6>(chords, run, &moving, rules, watch),
            _ => self.append_curve::<9>(chords, run, &moving, rules, watch),
        }
    }

    /// Appends a run in which at most D axes move; the fit does not see the other axes.
    fn append_curve<const D: usize>(
        &mut self,
        chords: &Chords<M>,
        run: Range<usize>,
        moving: &[usize],
        rules: &Rules<'_, M>,
        watch: Watch,
    ) {
        let Rules { exact, travel, long, max_acceleration, motion } = rules;
        let own = &chords.chords[run.clone()];
        let points = chords.points[run.start..=run.end].iter().map(|p| narrow(p, moving, 0.0)).collect();
        let mut line = Polyline::<D>::new(points, own.iter().map(Chord::rest).collect());
        line.sized = motion.is_none();
        if let Some(motion) = motion {
            let moments = motion.along(own, &line.station, moving);
            if !moments.is_empty() {
                let of = |limits: &[f64; M]| narrow(limits, moving, 1.0);
                line.pace = Pace::new(moments, of(max_acceleration), of(&motion.max_jerk));
            }
        }
        line.hold_bends(*long, |i| !own[i].is_line(), watch);
        let differ = |a: &Chord, b: &Chord| a.feed != b.feed || a.tolerance != b.tolerance;
        let cut: Vec<bool> =
            (0..=own.len()).map(|i| i > 0 && i < own.len() && differ(&own[i - 1], &own[i])).collect();
        // The check of the path against the travel allows twice this slack.
        let slack = 0.5 * tolerance::TRAVEL;
        let bounds = |k: usize| match moving.get(k) {
            Some(&axis) => [travel[axis][0] - slack, travel[axis][1] + slack],
            None => [f64::NEG_INFINITY, f64::INFINITY],
        };
        let options = SmoothOptions { long: *long, bounds: std::array::from_fn(bounds) };
        let smooth = smooth_fit(&line, &cut, &options, watch);
        let rest = chords.points[run.start];
        let mut control = Vec::new();
        for (piece, along) in smooth.curve.pieces().zip(&smooth.covered) {
            control.clear();
            control.extend(piece.control.iter().map(|point| {
                let mut wide = rest;
                for (k, &axis) in moving.iter().enumerate() {
                    wide[axis] = point[k];
                }
                wide
            }));
            if along.stop {
                self.runs.push(self.chunk.pieces.len());
            }
            let like = piece_along(&own[along.first..=along.last], along.deviation, *exact);
            self.chunk.push(&control, piece.width, like);
        }
        let moves = (own[own.len() - 1].last - own[0].first) as usize + 1;
        self.fit += FitCounts { chords: moves, splines: smooth.splines, polynomials: smooth.polynomials };
        self.offsets.merge(&smooth.offsets);
        let corners = smooth.corners.iter().map(|zone| [own[zone.start].first, own[zone.end - 1].last]);
        self.not_smooth.corners.extend(corners);
    }
}

/// The values of the axes that move, at most D; further components are `rest`.
fn narrow<const M: usize, const D: usize>(values: &[f64; M], moving: &[usize], rest: f64) -> [f64; D] {
    std::array::from_fn(|k| moving.get(k).map_or(rest, |&axis| values[axis]))
}

/// A piece along some chords, at most `deviation` from them, in mm; its shape is still to be set.
fn piece_along<const M: usize>(chords: &[Chord], deviation: f64, exact: bool) -> PathPiece<M> {
    let (first, last) = (&chords[0], &chords[chords.len() - 1]);
    let used = chords.iter().map(|chord| chord.used).fold(0.0, f64::max);
    PathPiece {
        shape: Shape::Conic(Conic::line([0.0; M], [0.0; M])),
        first: first.first,
        last: last.last,
        feed: chords.iter().map(|chord| chord.feed).fold(f64::INFINITY, f64::min),
        deviation: if deviation > 0.0 { deviation + used } else { 0.0 },
        tolerance: chords.iter().map(|chord| chord.tolerance).fold(f64::INFINITY, f64::min),
        exact,
        arc: false,
    }
}

impl<const M: usize> Chords<M> {
    fn vector(&self, i: usize) -> [f64; M] {
        sub(&self.points[i + 1], &self.points[i])
    }

    /// The angle by which the polygon of the chords turns at point `i`, in rad.
    fn turn(&self, i: usize) -> f64 {
        angle(&self.vector(i - 1), &self.vector(i))
    }

    /// Whether exact moves continue at point `i` without a stop: two chords lie on one line, or a curve touches its neighbour.
    fn meet(&self, i: usize) -> bool {
        let (before, after) = (&self.chords[i - 1], &self.chords[i]);
        if before.is_line() && after.is_line() {
            let coordinate = self.points[i].iter().fold(0.0, |a: f64, b| a.max(b.abs()));
            let length = norm(&self.vector(i - 1)).min(norm(&self.vector(i)));
            return self.turn(i) <= tolerance::SAME_DIRECTION + tolerance::COORDINATE * coordinate / length;
        }
        let angles = before.end_angle.unwrap_or(0.0) + after.end_angle.unwrap_or(0.0);
        let same_move = before.last == after.first && before.first == after.last;
        same_move || self.turn(i) <= tolerance::ROUNDED_TANGENT + angles
    }
}
