//! Checks each setpoint, and each step between two setpoints, against the plan: distance from the path and from the program,
//! recorded velocity and acceleration against the profile, speed of the step against the feed, chord error, and corners of the
//! path.

mod at_once;

use at_once::Tool;

use super::columns::Columns;
use super::curve::sagitta;
use super::deviation::{allowed, enough, settled, window};
use super::nearest::Place;
use super::neighbours::Neighbours;
use super::number::inner;
use super::profile_reader::ACCELERATION_SHARE;
use super::rows::Row;
use super::setpoints::at_once::COUNT;
use super::tracking::{is_step, Plan};
use super::vectors::{distance, from_to, length, vector_of, Segment};
use super::{Check, Limits, Tally, FEEDS, PLACE_TOLERANCE};

/// A recorded velocity may differ from the profile's by this share of the velocity change that the acceleration limit allows in a
/// period.
pub const VELOCITY_SHARE: f64 = 1e-3;

/// Checks setpoints one after the other; keeps the pieces and moves near the last place.
pub struct Comparison<'a, const M: usize> {
    plan: &'a Plan<'a>,
    limits: &'a Limits<M>,
    columns: Columns<'a, M>,
    /// The programmed moves near `piece`.
    near: Neighbours<'a, M>,
    piece: Option<usize>,
    /// The tool at the rows that are examined together, where the columns are joints.
    tool: Tool<M>,
}

impl<'a, const M: usize> Comparison<'a, M> {
    pub fn new(plan: &'a Plan<'a>, limits: &'a Limits<M>) -> Self {
        let columns = plan.columns(limits);
        Self { plan, limits, columns, near: Neighbours::default(), piece: None, tool: Tool::default() }
    }

    /// Which rows need no further check except that of their distance from the program; see `at_once`.
    pub fn settled(&mut self, rows: &[Row<M>], unsure: &[f64; COUNT], tally: &Tally<M>) -> [bool; COUNT] {
        let Self { plan, limits, columns, tool: Tool { tip, feed }, .. } = self;
        let has_tool = !columns.are_axes();
        if has_tool {
            tip.clear();
            feed.clear();
            for row in rows {
                let (at, limit) = columns.fed_tip(row.nearest.place);
                tip.push(at);
                feed.push(limit);
            }
        }
        at_once::settled((plan, has_tool.then_some(&self.tool)), limits, rows, unsure, tally)
    }

    /// Checks one setpoint: its distance from the path, its delay along the path, and its recorded velocity and acceleration.
    pub fn nearest(&mut self, row: &Row<M>, rounding: f64, tally: &mut Tally<M>) {
        let (nearest, time, line) = (&row.nearest, row.t, row.line);
        tally.offer(Check::Place, 0, nearest.off, PLACE_TOLERANCE, time, line);
        tally.offer(Check::Place, 0, nearest.late, nearest.allowed, time, line);
        if nearest.is_good() {
            self.recorded(row, rounding, tally);
        }
    }

    /// Checks the distance of one setpoint from the program.
    pub fn deviation(&mut self, row: &Row<M>, rounding: f64, tally: &mut Tally<M>) {
        let Some(program) = &self.plan.program else { return };
        let (path, nearest, known) = (&self.plan.path, &row.nearest, self.plan.deviation);
        let piece = nearest.place.piece;
        let limit = path.tolerance[piece] + PLACE_TOLERANCE;
        // Triangle inequality: the distance of the setpoint from its place on the path plus that of the place from the program.
        let most = known * allowed(path, piece) + nearest.off.max(0.0);
        if nearest.is_good() && most <= known * limit {
            return;
        }
        if self.piece != Some(piece) {
            self.near.replace(program, window(path, piece, program.len()));
            self.piece = Some(piece);
        }
        let away = self.near.distance(&row.q, enough(settled(tally).max(known), limit, rounding));
        tally.offer(Check::Deviation, 0, away - rounding, limit, row.t, row.line);
    }

    /// Checks the recorded velocity and acceleration against those of the profile.
    fn recorded(&mut self, row: &Row<M>, rounding: f64, tally: &mut Tally<M>) {
        let (limits, nearest) = (self.limits, &row.nearest);
        if self.plan.profile.is_none() {
            return;
        }
        if let Some(recorded) = row.velocity {
            let velocity = &nearest.velocity;
            let away = rounding + nearest.off.max(0.0) + nearest.late;
            let rest = self.plan.path.width[nearest.place.piece] - nearest.place.u;
            let at_joint = nearest.place.u.min(rest) <= PLACE_TOLERANCE;
            for k in 0..self.columns.count() {
                let off = (recorded[k] - velocity.value[k]).abs();
                let jump = if at_joint { limits.jump[k] } else { 0.0 };
                let limit = VELOCITY_SHARE * limits.acceleration.least(k) * limits.period + jump;
                // Over a distance of `away`, even with a reversal in it, the velocity of an axis changes by at most the square
                // root of this.
                let unknown_sq = 4.0 * limits.acceleration.greatest(k) * away;
                if off * off <= unknown_sq {
                    tally.offer(Check::RecordedVelocity, k, 0.0, limit, row.t, row.line);
                } else {
                    let unknown = unknown_sq.sqrt() + velocity.rounding[k];
                    tally.offer(Check::RecordedVelocity, k, off - unknown, limit, row.t, row.line);
                }
            }
        }
        if row.acceleration.is_some() {
            for k in 0..self.columns.count() {
                let limit = ACCELERATION_SHARE * limits.acceleration.least(k);
                tally.offer(
                    Check::RecordedAcceleration,
                    k,
                    nearest.acceleration_off[k],
                    limit,
                    row.t,
                    row.line,
                );
            }
        }
    }

    /// Checks the step between two setpoints: its speed, and the distance of the path from the chord. `earlier` is the setpoint
    /// before both.
    pub fn step(
        &mut self,
        earlier: Option<&Row<M>>,
        [before, row]: [&Row<M>; 2],
        step: f64,
        rounding: f64,
        tally: &mut Tally<M>,
    ) {
        let (path, limits) = (&self.plan.path, self.limits);
        if !is_step(before.t, row.t, limits.period) {
            return;
        }
        let (time, line, has_chord) = (row.t, row.line, limits.chord_tolerance.is_finite());
        let (from, to) = (before.nearest.place, row.nearest.place);
        let columns = &mut self.columns;
        let tips = [before, row].map(|row| columns.tip(row.nearest.place.piece, row.nearest.place.u, &row.q));
        let (mut ways, mut least_times, mut error_sq) = ([0.0; FEEDS], [0.0; FEEDS], 0.0_f64);
        // With joints, the tool stops between two runs: the path on each side of the stop is compared with a chord of its own.
        let are_axes = columns.are_axes();
        let stops = |piece: usize| !are_axes && path.runs.binary_search(&(piece as i64)).is_ok();
        let known = tally.get(Check::Feed, 0).ratio;
        let mut chord_start = tips[0];
        let is_flat = !has_chord || self.is_flat([before, row], &tips, tally);
        let columns = &mut self.columns;
        for piece in from.piece..=to.piece {
            let (is_first, is_last) = (piece == from.piece, piece == to.piece);
            let (feeds, axes) = (columns.feeds(piece), columns.chord_axes(piece));
            let start = if is_first { from.u } else { 0.0 };
            let end = if is_last { to.u } else { path.width[piece] };
            let last = if is_first { tips[0] } else { path.start(piece) };
            let next = if is_last { tips[1] } else { path.end(piece) };
            if !is_first && stops(piece) {
                chord_start = last;
            }
            if end > start && !is_flat {
                let curve = columns.curve(piece);
                let chord_end = if !is_last && stops(piece + 1) { next } else { tips[1] };
                let counted = |point: &[f64; M]| -> [f64; M] { vector_of(|k| axes[k] * point[k]) };
                let chord = Segment::new(&counted(&chord_start), &counted(&chord_end));
                for share in [0.25, 0.5, 0.75, 1.0] {
                    let point = curve.at(start + share * (end - start));
                    error_sq = error_sq.max(chord.distance_sq(&counted(&point)));
                }
            }
            for (feed, limit) in feeds.into_iter().enumerate().filter(|(_, limit)| *limit != f64::INFINITY) {
                // Most steps are on one piece and not faster than the worst so far: comparing squares shows that without a root.
                let most = known * limit * step + 2.0 * rounding;
                if are_axes && is_first && is_last && known >= 0.0 {
                    let way = limits.counted(feed, &from_to(&last, &next));
                    if inner(&way, &way) <= most * most {
                        continue;
                    }
                }
                let part = columns.tip_way(piece, feed, &last, &next);
                ways[feed] += part;
                least_times[feed] += part / limit;
            }
        }
        for (way, least_time) in ways.into_iter().zip(least_times) {
            // Most steps do not raise the worst, which products show faster than quotients.
            let certain = way - 2.0 * rounding;
            let known = tally.get(Check::Feed, 0).ratio;
            let is_passed = known >= 0.0 && certain * least_time <= known * way * step;
            if !is_passed {
                let feed = if least_time > 0.0 { way / least_time } else { f64::INFINITY };
                tally.offer(Check::Feed, 0, certain / step, feed, time, line);
            }
        }
        if has_chord {
            let certain = error_sq.sqrt() - rounding - before.nearest.off.max(row.nearest.off).max(0.0);
            let mut limit = limits.chord_tolerance;
            if certain > limit {
                limit += match self.columns.are_axes() {
                    true => self.chord_beyond_circle(before, row, step),
                    false => self.chord_beyond_steady(earlier, before, tips) * limit,
                };
            }
            tally.offer(Check::Chord, 0, certain, limit, time, line);
        }
    }

    /// Whether the path between two setpoints, on one piece or on two consecutive ones, is at most as far from the chord as the
    /// worst so far. On one piece the bound is its sagitta, on two the greater sagitta plus the distance of their junction from
    /// the chord.
    fn is_flat(&self, [before, row]: [&Row<M>; 2], tips: &[[f64; M]; 2], tally: &Tally<M>) -> bool {
        let (path, (from, to)) = (&self.plan.path, (before.nearest.place, row.nearest.place));
        let most = match to.piece.checked_sub(from.piece) {
            Some(0) => sagitta(row.nearest.bend, to.u - from.u),
            Some(1) if self.columns.are_axes() => {
                let ends = [(before, path.width[from.piece] - from.u), (row, to.u)];
                let [first, last] = ends.map(|(row, way)| sagitta(row.nearest.bend, way));
                first.max(last) + Segment::new(&tips[0], &tips[1]).distance_sq(&path.start(to.piece)).sqrt()
            }
            _ => f64::INFINITY,
        };
        tally.is_passed(Check::Chord, 0, most, self.limits.chord_tolerance)
    }

    /// The part of the chord tolerance by which the chord error of the tool of joints may exceed it where the speed changes: the
    /// speed limit by the osculating circle assumes constant speed, and the error is greater on the faster side.
    fn chord_beyond_steady(&mut self, earlier: Option<&Row<M>>, before: &Row<M>, tips: [[f64; M]; 2]) -> f64 {
        let axes = self.columns.chord_axes(before.nearest.place.piece);
        let counted = |a: &[f64; M], b: &[f64; M]| length::<M>(&vector_of(|k| axes[k] * (b[k] - a[k])));
        let own = counted(&tips[0], &tips[1]);
        let last = earlier.map_or(0.0, |row| {
            let Place { piece, u } = row.nearest.place;
            counted(&self.columns.tip(piece, u, &row.q), &tips[0])
        });
        let gain = (own - last).abs() / own;
        if gain.is_nan() {
            0.0
        } else {
            0.5 * gain.min(1.0)
        }
    }

    /// The allowed excess of the chord error over the tolerance, in mm, where the speed is limited by the osculating circle.
    ///
    /// That limit keeps the acceleration across the path at 8 δ/T², so the distance from the chord, T²/8 times the greatest
    /// acceleration across the chord, stays below δ. Where the path is at an angle θ to the chord, the acceleration a along the
    /// path adds T²/8 · a sin θ, and T²/8 · a where the path runs backwards.
    fn chord_beyond_circle(&mut self, before: &Row<M>, row: &Row<M>, step: f64) -> f64 {
        let limits = self.limits;
        let (from, to) = (before.nearest.place, row.nearest.place);
        let way = from_to(&before.q, &row.q);
        let way_length = length(&way);
        let mut most = 0.0_f64;
        for piece in from.piece..=to.piece {
            let curve = self.columns.curve(piece);
            let start = if piece == from.piece { from.u } else { 0.0 };
            let end = if piece == to.piece { to.u } else { curve.width() };
            for share in [0.0, 0.25, 0.5, 0.75, 1.0] {
                let tangent = curve.derivative(start + share * (end - start));
                let size = length(&tangent);
                let cos = inner(&tangent, &way) / (size * way_length);
                let across = if cos > 0.0 { (1.0 - cos * cos).max(0.0).sqrt() } else { 1.0 };
                let along: f64 = (0..M).map(|k| tangent[k].abs() * limits.acceleration.greatest(k)).sum();
                most = most.max(across * along / size);
            }
        }
        0.125 * step * step * most
    }

    /// Number of corners of the path within two steps, including those within `PLACE_TOLERANCE` of their ends; 0 where one of the
    /// steps is no time step.
    pub fn corners(&mut self, rows: [&Row<M>; 3]) -> f64 {
        let period = self.limits.period;
        if rows.windows(2).any(|pair| !is_step(pair[0].t, pair[1].t, period)) {
            return 0.0;
        }
        let mut corners = 0.0;
        for piece in self.begun([rows[0], rows[2]]) {
            let columns = &mut self.columns;
            let into = columns.place(piece - 1, self.plan.path.width[piece - 1]).slope.value;
            let out = columns.place(piece, 0.0).slope.value;
            let (a, b) = (length(&into), length(&out));
            if distance(&into.map(|x| x / a), &out.map(|x| x / b)) > columns.smooth() {
                corners += 1.0;
            }
        }
        corners
    }

    /// The pieces that begin between two rows, including those that begin within `PLACE_TOLERANCE` of them.
    fn begun(&self, [first, last]: [&Row<M>; 2]) -> std::ops::RangeInclusive<usize> {
        let path = &self.plan.path;
        let (from, to) = (first.nearest.place, last.nearest.place);
        let at_start = from.u <= PLACE_TOLERANCE;
        let at_end = path.width[to.piece] - to.u <= PLACE_TOLERANCE;
        let begin = if at_start { from.piece.max(1) } else { from.piece + 1 };
        begin..=(to.piece + usize::from(at_end)).min(path.len() - 1)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::curve::{Followed, Pieces};
    use crate::moves::Programmed;
    use crate::rows::Nearest;

    #[test]
    fn a_setpoint_is_measured_against_the_program_where_the_path_does_not_tell_its_distance() {
        // The path is 0.3 beside the program.
        let (control, offsets, width) = (&[0.0, 0.3, 1.0, 0.3], &[0, 2], &[1.0]);
        let pieces = Pieces { axes: 2, stride: 2, control, weights: &[], offsets, width };
        let path = Followed { tolerance: &[1.0], ..Followed::of_one(pieces) };
        let program = Some(Programmed::of_lines(&[0.0, 0.0], &[1.0, 0.0], &[1]));
        let limits = Limits::none();
        for (known, off, found) in
            [(0.3, 2.9e-7, -1.0), (0.3, 3.1e-7, 0.3), (0.0, 1e-9, 0.3), (0.3, 0.2, 0.5), (9.0, 0.2, 0.5)]
        {
            let plan = Plan { path, profile: None, program, deviation: known, joints: None };
            let row = Row {
                t: 0.0,
                q: [0.5, 0.3 + off],
                velocity: None,
                acceleration: None,
                line: 1,
                nearest: Nearest { place: Place { piece: 0, u: 0.5 }, off, ..Nearest::default() },
            };
            let mut tally = Tally::<2>::default();
            Comparison::new(&plan, &limits).deviation(&row, 0.0, &mut tally);
            let ratio = tally.get(Check::Deviation, 0).ratio;
            assert!((ratio - found).abs() < 1e-5, "{known} {off}: {ratio}");
        }
    }

    #[test]
    fn the_path_around_a_corner_is_as_far_from_the_chord_as_the_corner_and_the_sagittas() {
        let pieces = Pieces {
            axes: 2,
            stride: 2,
            control: &[0.0, 0.0, 1.0, 0.0, 1.0, 0.0, 1.0, 1.0],
            weights: &[],
            offsets: &[0, 2, 4],
            width: &[1.0, 1.0],
        };
        let path = Followed { moves: &[0, 0, 1, 1], ..Followed::of_one(pieces) };
        let limits = Limits { chord_tolerance: 1.0, ..Limits::none() };
        let plan = Plan { path, profile: None, program: None, deviation: 0.0, joints: None };
        let comparison = Comparison::new(&plan, &limits);
        let row = |q: [f64; 2], piece: usize, u: f64, bend: f64| Row {
            t: 0.0,
            q,
            velocity: None,
            acceleration: None,
            line: 1,
            nearest: Nearest { place: Place { piece, u }, bend, ..Nearest::default() },
        };
        // The corner is 0.1/√2 off the chord, and each piece up to 0.00125 off its own where it is bent by 1/mm.
        for (bend, off) in [(0.0, 0.1 / 2.0_f64.sqrt()), (1.0, 0.1 / 2.0_f64.sqrt() + 0.00125)] {
            let (before, after) = (row([0.9, 0.0], 0, 0.9, bend), row([1.0, 0.1], 1, 0.1, bend));
            for (known, is_flat) in [(off - 1e-9, false), (off + 1e-9, true)] {
                let mut tally = Tally::default();
                tally.offer(Check::Chord, 0, known, 1.0, 0.0, 1);
                assert_eq!(comparison.is_flat([&before, &after], &[before.q, after.q], &tally), is_flat);
                assert!(!comparison.is_flat([&after, &before], &[after.q, before.q], &tally));
            }
        }
    }
}
