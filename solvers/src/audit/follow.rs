//! Follows setpoints along the path of their plan: where each lies, when the profile is there, what lies between.
//!
//! The place of a setpoint is searched along the path from the place of the one before, never backwards. Where
//! the speed profile is known, the audit's own integral says when the profile reaches that place; a setpoint
//! that runs ahead or stays behind is as far from its place as the profile gets in that time.

use rayon::prelude::*;

use super::arcs::{Arcs, Motion};
use super::curve::{distance, distance_to_segment, from_to, inner, length, Followed};
use super::deviation::{settled, window};
use super::moves::{nearest_of, Programmed};
use super::place::{Place, Search};
use super::setpoints::Row;
use super::{Check, Limits, Tally, EPS, GAP_TOLERANCE, PASS_EXCESS, PLACE_TOLERANCE, ROUNDINGS};

/// Setpoints a thread takes at a time.
const BLOCK: usize = 4096;

/// After so many setpoints on end that are off the path, the rest of their block counts as off by as much as the
/// last: the verdict is clear, and searching on would take for ever.
const MOST_ASTRAY: u32 = 64;

/// A setpoint may lie this share of its step from its place on the path: what sampling promises.
const STEP_SHARE: f64 = 1e-6;

/// A recorded velocity may differ from the profile's by this share of what one period of acceleration changes.
const VELOCITY_SHARE: f64 = 1e-3;

/// A recorded acceleration may differ from the profile's by this share of its limit.
const ACCELERATION_SHARE: f64 = 1e-2;

/// A switch of the acceleration this share of a period away counts as at the setpoint.
const SWITCH_SHARE: f64 = 1e-4;

/// Pieces that meet at a smaller angle than this, in rad, meet without a corner.
const SMOOTH: f64 = 1e-9;

/// What the setpoints of a plan follow.
#[derive(Clone, Copy)]
pub struct Plan<'a> {
    /// At least one piece.
    pub path: Followed<'a>,
    pub profile: Option<Timed<'a>>,
    pub program: Option<Programmed<'a>>,
}

/// A profile of good numbers on the clock of the setpoints.
#[derive(Clone, Copy)]
pub struct Timed<'a> {
    pub arcs: Arcs<'a>,
    /// When every arc begins and the last one ends, pauses included; see `Arcs::starts`.
    pub starts: &'a [f64],
    /// When every run begins, as far as the setpoints have shown: a stream may wait at a stop for its next period.
    pub clock: &'a [f64],
}

/// Where a setpoint is.
#[derive(Clone, Copy, Debug)]
pub struct Spot {
    pub place: Place,
    /// Greatest coordinate of the piece, in mm.
    pub magnitude: f64,
    /// Distance from the path, and along it from where the profile is at that time, in mm.
    off: f64,
    late: f64,
    /// How much of `late` is allowed, in mm.
    allowed: f64,
}

impl Default for Spot {
    fn default() -> Self {
        Self {
            place: Place { piece: 0, u: 0.0 },
            magnitude: 0.0,
            off: 0.0,
            late: 0.0,
            allowed: PLACE_TOLERANCE,
        }
    }
}

/// A place on the profile.
struct Passage<const M: usize> {
    arc: usize,
    run: usize,
    motion: Motion<M>,
    /// Local parameter, and the same as the arc's integration variable.
    u: f64,
    y: f64,
}

impl Timed<'_> {
    fn arcs_of(&self, run: usize) -> std::ops::Range<usize> {
        self.arcs.runs[run] as usize..self.arcs.runs[run + 1] as usize
    }

    /// Time in motion of a run, in s.
    fn motion_time(&self, run: usize) -> f64 {
        self.arcs_of(run).last().map_or(0.0, |last| {
            self.starts[last] + self.arcs.duration[last] - self.starts[self.arcs_of(run).start]
        })
    }

    /// What has to be added to the profile's times in a run; without a clock for it, the run is never reached.
    fn shift(&self, run: usize) -> f64 {
        self.clock.get(run).map_or(f64::INFINITY, |clock| clock - self.starts[self.arcs_of(run).start])
    }

    /// The start of the arc that `time` falls into.
    fn place_before(&self, path: &Followed, time: f64) -> Place {
        let run = self.clock.partition_point(|&clock| clock <= time).saturating_sub(1);
        let arcs = self.arcs_of(run);
        if arcs.is_empty() {
            return Place { piece: (path.runs[run] as usize).min(path.len() - 1), u: 0.0 };
        }
        let time = time - self.shift(run);
        let passed = self.starts[arcs.clone()].partition_point(|&start| start <= time);
        let arc = arcs.start + passed.saturating_sub(1);
        Place { piece: self.arcs.piece[arc] as usize, u: self.arcs.u0[arc] }
    }

    fn passage<const M: usize>(&self, path: &Followed, place: Place) -> Passage<M> {
        let arcs = &self.arcs;
        let last = arcs.len() - 1;
        let mut arc = arcs.piece.partition_point(|&piece| (piece as usize) < place.piece).min(last);
        while arc < last && arcs.piece[arc + 1] as usize == place.piece && arcs.u1[arc] < place.u {
            arc += 1;
        }
        let run = arcs.runs.partition_point(|&first| first <= arc as i64) - 1;
        let motion = arcs.motion::<M>(arc, &path.curve(arcs.piece[arc] as usize));
        // A place on a motionless piece is the start of what comes next.
        let u = if arcs.piece[arc] as usize == place.piece { place.u } else { arcs.u0[arc] };
        let y = motion.y_at(if motion.anchored_at_end { arcs.u1[arc] - u } else { u - arcs.u0[arc] });
        Passage { arc, run, motion, u, y }
    }

    /// When the profile arrives at a place and when it leaves, in s: at stops it pauses, and the setpoints may wait
    /// for their next period.
    fn times<const M: usize>(&self, path: &Followed, here: &Passage<M>, period: f64) -> [f64; 2] {
        let (arcs, &Passage { arc, run, u, .. }) = (&self.arcs, here);
        let start = self.starts[arc] + self.shift(run);
        let end = start + arcs.duration[arc];
        let from_anchor = here.motion.time_from_anchor(here.y);
        let time = if here.motion.anchored_at_end { end - from_anchor } else { start + from_anchor };
        let (mut from, mut until) = (time, time);
        if u <= arcs.u0[arc] && arc == self.arcs_of(run).start {
            from = match run {
                0 => 0.0,
                _ => self.clock.get(run - 1).map_or(time, |clock| clock + self.motion_time(run - 1)),
            };
        }
        if u >= arcs.u1[arc] && arc + 1 == self.arcs_of(run).end {
            until = self.clock.get(run + 1).copied().unwrap_or(end + path.dwell[run] + period);
        }
        [from, until]
    }

    /// At most how far the profile gets between `time` and being at `place`, in mm, less what may be rounding.
    fn late<const M: usize>(&self, path: &Followed, place: Place, time: f64, limits: &Limits<M>) -> f64 {
        let here = self.passage::<M>(path, place);
        let [from, until] = self.times(path, &here, limits.period);
        let wait = (from - time).max(time - until).max(0.0);
        let speed = length(&here.motion.state(here.y).velocity);
        let reach = |wait: f64| wait * (speed + 0.5 * wait * length(&limits.acceleration));
        // Summing the durations of all arcs before has rounded once for each.
        reach(wait) - reach(EPS * time.abs() * (here.arc as f64 + ROUNDINGS))
    }
}

impl Plan<'_> {
    /// The first point of the path.
    pub fn start<const M: usize>(&self) -> [f64; M] {
        self.path.points(0)[0]
    }

    /// The last point of the path.
    pub fn end<const M: usize>(&self) -> [f64; M] {
        self.path.points(self.path.len() - 1)[2]
    }

    /// The same plan with the clock of the setpoints.
    pub fn with_clock<'b>(&'b self, clock: &'b [f64]) -> Plan<'b> {
        Plan { profile: self.profile.map(|profile| Timed { clock, ..profile }), ..*self }
    }

    /// Adds to the clock the starts of the runs that the rows reach. A run starts when the pause before it is
    /// over or, where the setpoints stand still on the stop for it, at the next of them.
    pub fn extend_clock<const M: usize>(&self, limits: &Limits<M>, rows: &[Row<M>], clock: &mut Vec<f64>) {
        let Some(profile) = &self.profile else { return };
        while clock.len() + 1 < profile.arcs.runs.len() {
            let (due, stop) = match clock.len().checked_sub(1) {
                None => (self.path.start_dwell, self.start::<M>()),
                Some(run) => {
                    let piece = (self.path.runs[run + 1] as usize).max(1) - 1;
                    let due = clock[run] + profile.motion_time(run) + self.path.dwell[run];
                    (due, self.path.points::<M>(piece)[2])
                }
            };
            let slack = PASS_EXCESS * limits.period + ROUNDINGS * EPS * due;
            let next = rows.partition_point(|row| row.t < due - slack);
            let magnitude = stop.iter().fold(0.0_f64, |most, q| most.max(q.abs()));
            let stands =
                |row: &Row<M>| distance(&row.q, &stop) <= GAP_TOLERANCE + ROUNDINGS * EPS * magnitude;
            let on_time = |row: &Row<M>| (row.t - due).abs() <= slack;
            match &rows[next..] {
                [] => break,
                // On the very end of the pause: the next row tells whether the stream goes on or waits.
                [row] if stands(row) && on_time(row) => break,
                [row, later, ..] if stands(row) && on_time(row) && stands(later) => clock.push(later.t),
                [row, ..] if stands(row) => clock.push(row.t),
                _ => clock.push(due),
            }
        }
    }

    /// Finds the places of the rows from `old` on.
    pub fn find_spots<const M: usize>(&self, limits: &Limits<M>, rows: &mut [Row<M>], old: usize) {
        let previous = old.checked_sub(1).map(|n| rows[n]);
        let fresh = &mut rows[old..];
        // Without a profile every search starts from the place before; with one its time says where to start.
        let block = if self.profile.is_some() { BLOCK } else { fresh.len().max(1) };
        fresh.par_chunks_mut(block).enumerate().for_each(|(number, rows)| {
            let mut previous = if number == 0 { previous } else { None };
            let mut astray = 0;
            for row in rows {
                match previous {
                    Some(last) if astray > MOST_ASTRAY => row.spot = last.spot,
                    _ => self.find_spot(limits, previous.as_ref(), row),
                }
                astray = if row.spot.is_good() { 0 } else { astray + 1 };
                row.line = self.path.line[row.spot.place.piece];
                previous = Some(*row);
            }
        });
    }

    fn find_spot<const M: usize>(&self, limits: &Limits<M>, previous: Option<&Row<M>>, row: &mut Row<M>) {
        let by_time = self.profile.map(|profile| profile.place_before(&self.path, row.t - limits.period));
        let known = previous.filter(|row| row.spot.is_good() || by_time.is_none()).map(|row| row.spot.place);
        let from = known.or(by_time).unwrap_or(Place { piece: 0, u: 0.0 });
        let curve = self.path.curve::<M>(from.piece);
        let passed = previous.map_or(limits.period, |before| (row.t - before.t).abs());
        let reach = 2.0 * passed * length(&limits.velocity);
        if !(row.t.is_finite() && row.q.iter().all(|q| q.is_finite()) && reach.is_finite()) {
            row.spot = Spot { place: from, off: f64::INFINITY, ..Spot::default() };
            return;
        }
        let step = previous.map_or(0.0, |before| distance(&before.q, &row.q));
        let magnitude = row.q.iter().fold(curve.magnitude(), |most, q| most.max(q.abs()));
        let rounding = ROUNDINGS * EPS * magnitude * (M as f64).sqrt();
        let allowed = PLACE_TOLERANCE.max(STEP_SHARE * step);
        let judge = |place: Place| {
            let late = self.profile.map_or(0.0, |profile| profile.late(&self.path, place, row.t, limits));
            (late - rounding).max(0.0)
        };
        let close = PLACE_TOLERANCE + rounding;
        let mut search = Search { path: &self.path, reach, close, judge, allowed };
        let found = search.next_place(from, &row.q);
        let late = if found.error.is_finite() { found.error } else { 0.0 };
        row.spot = Spot { place: found.place, magnitude, off: found.distance - rounding, late, allowed };
    }

    /// What one setpoint shows: its distance from path and program, and what it records.
    pub fn spot<const M: usize>(
        &self,
        limits: &Limits<M>,
        row: &Row<M>,
        rounding: f64,
        tally: &mut Tally<M>,
    ) {
        let (spot, time, line) = (&row.spot, row.t, row.line);
        tally.offer(Check::Place, 0, spot.off, PLACE_TOLERANCE, time, line);
        tally.offer(Check::Place, 0, spot.late, spot.allowed, time, line);
        let piece = spot.place.piece;
        if let Some(program) = &self.program {
            let limit = self.path.tolerance[piece] + PLACE_TOLERANCE;
            let moves = window(&self.path, piece, program.len()).map(|m| program.get::<M>(m));
            let away = nearest_of(moves, &row.q, settled(tally) * limit);
            tally.offer(Check::Deviation, 0, away - rounding, limit, time, line);
        }
        if let (Some(profile), true) = (&self.profile, spot.is_good()) {
            self.recorded(profile, limits, row, rounding, tally);
        }
    }

    /// Recorded velocity and acceleration against the profile's.
    fn recorded<const M: usize>(
        &self,
        profile: &Timed,
        limits: &Limits<M>,
        row: &Row<M>,
        rounding: f64,
        tally: &mut Tally<M>,
    ) {
        let here: Passage<M> = profile.passage(&self.path, row.spot.place);
        if let Some(recorded) = row.velocity {
            let state = here.motion.state(here.y);
            let piece = row.spot.place.piece;
            let away = rounding + row.spot.off.max(0.0) + row.spot.late;
            let rest = self.path.width[piece] - row.spot.place.u;
            let at_joint = row.spot.place.u.min(rest) <= PLACE_TOLERANCE;
            for k in 0..M {
                // From rest, a place known to `away` is passed at a speed known to this.
                let unknown = (2.0 * limits.acceleration[k] * away).sqrt();
                let off = (recorded[k] - state.velocity[k]).abs() - unknown;
                let jump = if at_joint { limits.jump[k] } else { 0.0 };
                let limit = VELOCITY_SHARE * limits.acceleration[k] * limits.period + jump;
                tally.offer(Check::RecordedVelocity, k, off, limit, row.t, row.line);
            }
        }
        if let Some(recorded) = row.acceleration {
            let range = self.accelerations(profile, limits, &here, row.t);
            for k in 0..M {
                let off = (range[k][0] - recorded[k]).max(recorded[k] - range[k][1]);
                let limit = ACCELERATION_SHARE * limits.acceleration[k];
                tally.offer(Check::RecordedAcceleration, k, off, limit, row.t, row.line);
            }
        }
    }

    /// Least and greatest acceleration of each axis just before and just after `time`.
    fn accelerations<const M: usize>(
        &self,
        profile: &Timed,
        limits: &Limits<M>,
        here: &Passage<M>,
        time: f64,
    ) -> [[f64; 2]; M] {
        let mut range = [[f64::INFINITY, f64::NEG_INFINITY]; M];
        let mut include = |(value, rounding): ([f64; M], [f64; M])| {
            for k in 0..M {
                range[k] = [range[k][0].min(value[k] - rounding[k]), range[k][1].max(value[k] + rounding[k])];
            }
        };
        include(here.motion.acceleration_near(here.y));
        let switch = SWITCH_SHARE * limits.period;
        let (arcs, starts) = (&profile.arcs, profile.starts);
        let mut neighbour = |arc: usize, at_end: bool| {
            let motion = arcs.motion::<M>(arc, &self.path.curve(arcs.piece[arc] as usize));
            let y = if at_end != motion.anchored_at_end { 1.0 } else { 0.0 };
            include(motion.acceleration_near(y));
        };
        let time = time - profile.shift(here.run);
        let run = profile.arcs_of(here.run);
        let mut first = here.arc;
        while first > run.start && time - starts[first] < switch {
            first -= 1;
            neighbour(first, true);
        }
        let mut last = here.arc;
        while last + 1 < run.end && starts[last + 1] - time < switch {
            last += 1;
            neighbour(last, false);
        }
        let at_rest = time - starts[run.start] < switch
            || starts[run.end - 1] + arcs.duration[run.end - 1] - time < switch;
        if at_rest {
            include(([0.0; M], [0.0; M]));
        }
        range
    }

    /// What the step between two setpoints shows: its speed, and the path between them.
    pub fn step<const M: usize>(
        &self,
        limits: &Limits<M>,
        before: &Row<M>,
        row: &Row<M>,
        step: f64,
        rounding: f64,
        tally: &mut Tally<M>,
    ) {
        let (from, to) = (before.spot.place, row.spot.place);
        let (time, line) = (row.t, row.line);
        let chord = |q: &[f64; M]| distance_to_segment(q, &before.q, &row.q);
        let (mut way, mut least_time, mut error) = (0.0, 0.0, 0.0_f64);
        let mut last = before.q;
        for piece in from.piece..=to.piece {
            let curve = self.path.curve::<M>(piece);
            let start = if piece == from.piece { from.u } else { 0.0 };
            let end = if piece == to.piece { to.u } else { curve.width };
            let next = if piece == to.piece { row.q } else { curve.at(end) };
            let part = distance(&last, &next);
            way += part;
            least_time += part / self.path.feed[piece];
            last = next;
            if limits.chord_tolerance.is_finite() && end > start {
                for share in [0.25, 0.5, 0.75, 1.0] {
                    error = error.max(chord(&curve.at(start + share * (end - start))));
                }
            }
        }
        let feed = if least_time > 0.0 { way / least_time } else { f64::INFINITY };
        tally.offer(Check::Feed, 0, (way - 2.0 * rounding) / step, feed, time, line);
        if limits.chord_tolerance.is_finite() {
            let certain = error - rounding - before.spot.off.max(row.spot.off).max(0.0);
            let mut limit = limits.chord_tolerance;
            if certain > limit {
                limit += self.chord_beyond_circle(limits, before, row, step);
            }
            tally.offer(Check::Chord, 0, certain, limit, time, line);
        }
    }

    /// What the chord error may exceed the tolerance by where the speed limit of the osculating circle holds.
    ///
    /// That limit keeps the acceleration across the path at 8 δ/T², and so the distance from the chord, T²/8 times
    /// the greatest acceleration across the chord, at δ. Where the path turns against the chord by θ, the
    /// acceleration along the path adds T²/8 · a sin θ; all of it where the path runs back.
    fn chord_beyond_circle<const M: usize>(
        &self,
        limits: &Limits<M>,
        before: &Row<M>,
        row: &Row<M>,
        step: f64,
    ) -> f64 {
        let (from, to) = (before.spot.place, row.spot.place);
        let way = from_to(&before.q, &row.q);
        let way_length = length(&way);
        let mut most = 0.0_f64;
        for piece in from.piece..=to.piece {
            let curve = self.path.curve::<M>(piece);
            let start = if piece == from.piece { from.u } else { 0.0 };
            let end = if piece == to.piece { to.u } else { curve.width };
            for share in [0.0, 0.25, 0.5, 0.75, 1.0] {
                let tangent = curve.derivative(start + share * (end - start));
                let size = length(&tangent);
                let cos = inner(&tangent, &way) / (size * way_length);
                let across = if cos > 0.0 { (1.0 - cos * cos).max(0.0).sqrt() } else { 1.0 };
                let along: f64 = (0..M).map(|k| tangent[k].abs() * limits.acceleration[k]).sum();
                most = most.max(across * along / size);
            }
        }
        0.125 * step * step * most
    }

    /// Corners of the path between two places, those included that the places cannot be told from.
    pub fn corners<const M: usize>(&self, from: &Spot, to: &Spot) -> f64 {
        let at_start = from.place.u <= PLACE_TOLERANCE;
        let at_end = self.path.width[to.place.piece] - to.place.u <= PLACE_TOLERANCE;
        let first = if at_start { from.place.piece.max(1) } else { from.place.piece + 1 };
        let last = (to.place.piece + usize::from(at_end)).min(self.path.len() - 1);
        let mut corners = 0.0;
        for piece in first..=last {
            let before = self.path.curve::<M>(piece - 1);
            let after = self.path.curve::<M>(piece);
            let (into, out) = (before.derivative(before.width), after.derivative(0.0));
            let (a, b) = (length(&into), length(&out));
            if distance(&into.map(|x| x / a), &out.map(|x| x / b)) > SMOOTH {
                corners += 1.0;
            }
        }
        corners
    }
}

impl Spot {
    fn is_good(&self) -> bool {
        self.off <= PLACE_TOLERANCE && self.late <= self.allowed
    }
}
