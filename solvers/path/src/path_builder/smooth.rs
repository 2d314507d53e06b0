//! A program becomes a smooth path: all moves between two stops as one C4 curve within the tolerance.
//!
//! The tool stops where the program halts, where rapids begin or end, where exact moves meet others, and where the
//! path turns back. Moves that ask for the exact path stay lines, which stop at their corners; arcs and splines among
//! them, with the lines that they touch, are followed within the exact tolerance.

use std::ops::Range;

use rayon::prelude::*;

use super::stretches::CURVE_JOINT;
use super::travel::outside;
use super::{deviation, Axes, BuiltPath, Part};
use crate::follow::{Chord, Chords, FollowError, FollowOptions, Followed, Moves, Shape, RAPID};
use crate::smooth_fit::polyline::{angle, Polyline};
use crate::smooth_fit::{smooth_fit, Offsets, SmoothOptions};
use feedplan_geometry::conic::Conic;
use feedplan_geometry::watch::Watch;

/// A path that turns by more, in rad, stops: no curve is near both sides of the corner at any speed.
const TURNS_BACK: f64 = 2.356;
/// Lines of an exact path that turn by less, in rad, are one,
const SMOOTH: f64 = 1e-9;
/// and by so many roundings of their coordinates.
const ROUNDING: f64 = 16.0;

/// A nanometre beyond the travel is no fault, in mm.
const TRAVEL_SLACK: f64 = 5e-7;

/// Places of a smooth path where it is not smooth.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Rough {
    /// Moves at whose end the path turns back, and stops.
    pub reversals: Vec<u32>,
    /// First and last moves of the places where no smooth curve is within the tolerance: corners one by one, and a
    /// stop before and after.
    pub corners: Vec<[u32; 2]>,
}

/// The pieces of some moves between stops, and the first of each run.
#[derive(Default)]
struct Group<const M: usize> {
    part: Part<M>,
    runs: Vec<usize>,
    rough: Rough,
    /// Chords that were fitted, splines and polynomials.
    fit: [usize; 3],
    offsets: Offsets,
}

/// The path of a program. Bends keep their size where `sized`; else they are cut as far as the tolerance allows, which
/// is faster.
pub fn build_smooth_path<const M: usize>(
    moves: &Moves<M>,
    options: &FollowOptions,
    axes: &Axes<M>,
    sized: bool,
    watch: Watch,
) -> Result<BuiltPath<M>, FollowError> {
    let each = watch.each(moves.kind.len());
    let groups: Vec<Group<M>> = groups(moves)
        .into_par_iter()
        .map(|range| Group::new(moves, options, axes, range.clone(), sized, each.part(range.len() as f64)))
        .collect::<Result<_, _>>()?;
    let mut path = BuiltPath { runs: vec![], ..BuiltPath::default() };
    let (mut total, mut offsets) = (0, Offsets::default());
    for group in groups {
        path.runs.extend(group.runs.iter().map(|start| start + total));
        total += group.part.pieces.len();
        path.parts.push(group.part);
        path.points += group.fit[0];
        path.splines += group.fit[1];
        path.polynomials += group.fit[2];
        offsets.merge(&group.offsets);
        path.rough.reversals.extend(group.rough.reversals);
        path.rough.corners.extend(group.rough.corners);
    }
    path.runs.push(total);
    path.deviation = deviation(&path.parts);
    path.offsets = Some(offsets);
    path.outside = outside(&path.parts, moves, &axes.travel);
    Ok(path)
}

/// The moves between places where the path stops whatever its shape.
fn groups<const M: usize>(moves: &Moves<M>) -> Vec<Range<usize>> {
    let mut groups = Vec::new();
    let mut first = 0;
    for i in 1..=moves.kind.len() {
        let goes_on = i < moves.kind.len() && {
            let alike = |f: &dyn Fn(usize) -> bool| f(i - 1) == f(i);
            !moves.halt[i - 1]
                && alike(&|k| moves.kind[k] == RAPID)
                && alike(&|k| moves.tolerance[k] > 0.0)
                && moves.changes.binary_search_by_key(&i, |change| change.0).is_err()
        };
        if !goes_on {
            groups.push(first..i);
            first = i;
        }
    }
    groups
}

/// How the runs of a group follow their chords.
struct Rules<const M: usize> {
    exact: bool,
    travel: [[f64; 2]; M],
    /// Longer chords are lines, in mm.
    long: f64,
    /// Bends keep their size.
    sized: bool,
}

impl<const M: usize> Group<M> {
    fn new(
        moves: &Moves<M>,
        options: &FollowOptions,
        axes: &Axes<M>,
        range: Range<usize>,
        sized: bool,
        watch: Watch,
    ) -> Result<Self, FollowError> {
        let exact = moves.tolerance[range.start] <= 0.0;
        let judged = range.clone().all(|i| moves.joints[i]);
        let travel = if judged { axes.travel } else { [[f64::NEG_INFINITY, f64::INFINITY]; M] };
        let rules = Rules { exact, travel, long: options.max_chord, sized };
        let chords = moves.chords(options, range)?;
        let mut group = Self::default();
        let count = chords.chords.len();
        let each = watch.each(count);
        let mut first = 0;
        for end in 1..=count {
            let stops = end == count || {
                let turn = chords.turn(end);
                // An exact path stops in every corner.
                if turn > TURNS_BACK && !exact {
                    group.rough.reversals.push(chords.chords[end - 1].last);
                }
                turn > TURNS_BACK || exact && !chords.meet(end)
            };
            if stops {
                let watch = each.part((end - first) as f64);
                group.append(&chords, first..end, &rules, watch);
                first = end;
            }
        }
        Ok(group)
    }

    /// Appends a run.
    fn append(&mut self, chords: &Chords<M>, run: Range<usize>, rules: &Rules<M>, watch: Watch) {
        self.runs.push(self.part.pieces.len());
        let own = &chords.chords[run.clone()];
        if rules.exact && own.iter().all(|chord| chord.bow.is_none()) {
            for i in run {
                let line = [chords.points[i], chords.points[i + 1]];
                let like = followed(&chords.chords[i..=i], 0.0, true);
                self.part.push(&line, 0.0, like);
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
            4 => self.append_curve::<4>(chords, run, &moving, rules, watch),
            5 => self.append_curve::<5>(chords, run, &moving, rules, watch),
            6 => self.append_curve::<6>(chords, run, &moving, rules, watch),
            _ => self.append_curve::<9>(chords, run, &moving, rules, watch),
        }
    }

    /// Appends a run in which at most D axes move; an axis that rests changes nothing.
    fn append_curve<const D: usize>(
        &mut self,
        chords: &Chords<M>,
        run: Range<usize>,
        moving: &[usize],
        rules: &Rules<M>,
        watch: Watch,
    ) {
        let Rules { exact, travel, long, sized } = rules;
        let own = &chords.chords[run.clone()];
        let narrow = |p: &[f64; M]| std::array::from_fn(|k| moving.get(k).map_or(0.0, |&axis| p[axis]));
        let points: Vec<[f64; D]> = chords.points[run.start..=run.end].iter().map(narrow).collect();
        let mut line = Polyline::new(points, own.iter().map(Chord::left).collect());
        line.sized = *sized;
        line.hold_bends(*long, |i| own[i].bow.is_some(), watch);
        let apart = |a: &Chord, b: &Chord| a.feed != b.feed || a.allowed != b.allowed;
        let cut: Vec<bool> =
            (0..=own.len()).map(|i| i > 0 && i < own.len() && apart(&own[i - 1], &own[i])).collect();
        let bounds = |k: usize| match moving.get(k) {
            Some(&axis) => [travel[axis][0] - TRAVEL_SLACK, travel[axis][1] + TRAVEL_SLACK],
            None => [f64::NEG_INFINITY, f64::INFINITY],
        };
        let options = SmoothOptions { long: *long, bounds: std::array::from_fn(bounds) };
        let smooth = smooth_fit(&line, &cut, &options, watch);
        let rest = chords.points[run.start];
        for (piece, stretch) in smooth.curve.pieces().zip(&smooth.stretches) {
            let control: Vec<[f64; M]> = piece
                .control
                .iter()
                .map(|point| {
                    let mut wide = rest;
                    for (k, &axis) in moving.iter().enumerate() {
                        wide[axis] = point[k];
                    }
                    wide
                })
                .collect();
            if stretch.stop {
                self.runs.push(self.part.pieces.len());
            }
            let followed = followed(&own[stretch.first..=stretch.last], stretch.deviation, *exact);
            self.part.push(&control, piece.width, followed);
        }
        self.fit[0] += (own[own.len() - 1].last - own[0].first) as usize + 1;
        self.fit[1] += smooth.splines;
        self.fit[2] += smooth.polynomials;
        self.offsets.merge(&smooth.offsets);
        let rough = smooth.corners.iter().map(|zone| [own[zone.start].first, own[zone.end - 1].last]);
        self.rough.corners.extend(rough);
    }
}

/// All of a piece but its shape: it follows some chords, no farther than `deviation` from them.
fn followed<const M: usize>(chords: &[Chord], deviation: f64, exact: bool) -> Followed<M> {
    let (first, last) = (&chords[0], &chords[chords.len() - 1]);
    let charge = chords.iter().map(|chord| chord.charge).fold(0.0, f64::max);
    Followed {
        piece: Shape::Conic(Conic::line([0.0; M], [0.0; M])),
        first: first.first,
        last: last.last,
        feed: chords.iter().map(|chord| chord.feed).fold(f64::INFINITY, f64::min),
        deviation: if deviation > 0.0 { deviation + charge } else { 0.0 },
        tolerance: chords.iter().map(|chord| chord.allowed).fold(f64::INFINITY, f64::min),
        exact,
        arc: false,
    }
}

impl<const M: usize> Chords<M> {
    /// The angle by which the chords turn at a point, in rad.
    fn turn(&self, i: usize) -> f64 {
        let chord = |k: usize| std::array::from_fn(|axis| self.points[k + 1][axis] - self.points[k][axis]);
        angle::<M>(&chord(i - 1), &chord(i))
    }

    /// Exact moves go on at a point without a stop: two lines that are one, or a curve that touches its neighbour.
    fn meet(&self, i: usize) -> bool {
        let (before, after) = (&self.chords[i - 1], &self.chords[i]);
        if before.bow.is_none() && after.bow.is_none() {
            let length = |k: usize| {
                let square = |axis: usize| (self.points[k + 1][axis] - self.points[k][axis]).powi(2);
                (0..M).map(square).sum::<f64>().sqrt()
            };
            let coordinate = self.points[i].iter().fold(0.0, |a: f64, b| a.max(b.abs()));
            let rounding = ROUNDING * f64::EPSILON * coordinate / length(i - 1).min(length(i));
            return self.turn(i) <= SMOOTH + rounding;
        }
        let bows = before.bow.unwrap_or(0.0) + after.bow.unwrap_or(0.0);
        let inside = before.last == after.first && before.first == after.last;
        inside || self.turn(i) <= CURVE_JOINT + bows
    }
}
