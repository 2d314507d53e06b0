//! Audits a speed profile: every phase sampled in time, and the joints between the phases.
//!
//! On each phase the axis velocities C'√p are taken at some ten places, closer together where p changes fast and
//! very close at both ends, where accelerations have their extremes. Between two places the acceleration is the
//! difference of the velocities over the time that the audit integrates itself. A velocity is known to `EPS`
//! times its magnitude; that over the time is what rounding may add to an acceleration, and it is subtracted.
//! A profile cannot hide in it: over all phases together it allows `EPS` of the velocity per phase.

mod by_length;

use rayon::prelude::*;

use super::chord::chord_error;
use super::curve::Followed;
use super::phase_jerk::Jerks;
use super::phase_motion::{PhaseMotion, State};
use super::phase_order::PhaseOrder;
use super::phases::Phases;
use super::station::Stations;
use super::vectors::length;
use super::{tell, Check, Limits, Seen, Tally, EPS, FEEDS, GAP_TOLERANCE, PASS_EXCESS, ROUNDINGS};
use by_length::{Look, Looker};

/// Even intervals of a phase.
const INTERVALS: usize = 8;

/// Intervals of a slide on which some acceleration comes near its limit.
const SLIDE_INTERVALS: usize = 64;

/// Share of an acceleration limit from which a slide is looked at more closely.
const NEAR: f64 = 0.9;

/// The end intervals are as short as lets rounding hide this share of the acceleration limit, but no shorter than this part
/// of the phase: their time would have no digits.
const HIDDEN: f64 = 1e-7;
const SHORTEST: f64 = 1e-8;

/// Pieces that meet at a smaller angle than this, in rad, meet without a corner.
const SMOOTH: f64 = 1e-9;

/// Phases a thread takes at a time.
const BLOCK: usize = 4096;

/// The whole profile: phases, joints, ends of runs. `junction_speed` has one more entry than the path has pieces.
pub(crate) fn audit_profile<const M: usize>(
    path: &Followed,
    junction_speed: &[f64],
    phases: &Phases,
    limits: &Limits<M>,
    seen: Seen,
) -> Tally<M> {
    let starts = phases.starts(path);
    let auditor = Auditor { path, junction_speed, phases, limits, starts: &starts };
    let blocks = phases.len().div_ceil(BLOCK);
    let inside = (0..blocks)
        .into_par_iter()
        .map(|block| {
            let (mut tally, mut stations) = (Tally::default(), Stations::new(path.pieces));
            for i in block * BLOCK..((block + 1) * BLOCK).min(phases.len()) {
                tell(seen, i);
                auditor.phase(i, &mut stations, &mut tally);
                if i > 0 && phases.runs.binary_search(&(i as i64)).is_err() {
                    auditor.joint(i - 1, i, &mut stations, &mut tally);
                }
            }
            tally
        })
        .reduce(Tally::default, Tally::merge);
    let mut order = Tally::default();
    auditor.order(&mut order);
    inside.merge(order)
}

struct Auditor<'a, const M: usize> {
    path: &'a Followed<'a>,
    junction_speed: &'a [f64],
    phases: &'a Phases<'a>,
    limits: &'a Limits<M>,
    starts: &'a [f64],
}

impl<const M: usize> Auditor<'_, M> {
    fn phase(&self, i: usize, stations: &mut Stations<M>, tally: &mut Tally<M>) {
        let (phases, time) = (self.phases, self.starts[i]);
        let piece = phases.piece[i] as usize;
        let line = self.path.line.get(piece).copied().unwrap_or(0);
        if !phases.has_good_numbers(i, self.path.axes) {
            tally.offer(Check::Numbers, 0, f64::INFINITY, 0.0, time, line);
            return;
        }
        let width = self.path.width[piece];
        let (u0, u1) = (phases.u0[i], phases.u1[i]);
        let slack = ROUNDINGS * EPS * width;
        if u1 <= u0 || u0 < 0.0 || u1 > width + slack {
            tally.offer(Check::Order, 0, f64::INFINITY, GAP_TOLERANCE, time, line);
            return;
        }
        let (curve, share) = (stations.curves.get(piece).clone(), (u1 - u0) / width);
        let width_rounding = EPS * width / (u1 - u0);
        let slope =
            |u: f64| stations.get(piece, u).map_or_else(|| length(&curve.derivative(u)), |at| at.slope);
        let by_length = phases.by_length(i, &curve, &[1.0; M], slope);
        if self.limits.judges_jerk {
            self.jerks().alone(i, width_rounding, by_length.is_some(), line, tally);
        }
        if let Some(motion) = by_length {
            let looker = Looker {
                motion: &motion,
                limits: self.limits,
                feeds: self.path.feeds(piece),
                covered: curve.turns() as f64 * share,
                start: time,
                line,
            };
            let from = stations.get(piece, u0).map(|station| looker.look_at(station, tally));
            let to = stations.get(piece, u1).map(|station| looker.look_at(station, tally));
            let ends = [from.as_ref(), to.as_ref()];
            looker.phase([u0, u1], ends, tally);
            self.ends_by_length(i, ends, line, tally);
            self.duration(i, motion.time(), width_rounding, line, tally);
            return;
        }
        let motion = phases.by_parameter(i, &curve);
        let mut probe = Probe::new(self, &motion, tally, i, line);
        probe.run();
        let (elapsed, near) = (probe.elapsed, probe.nearest_limit >= NEAR);
        if near && motion.is_slide() {
            let mut probe = Probe::new(self, &motion, tally, i, line);
            probe.run_evenly(SLIDE_INTERVALS);
        }
        self.recorded_ends(i, &motion, line, tally);
        self.duration(i, elapsed, width_rounding, line, tally);
    }

    /// The recorded duration against the audit's own. A rounding of u0 or u1 changes the width by the share
    /// `width_rounding`, and the time by at least this share; at a slow end by the time in which the motion covers the
    /// rounding there.
    fn duration(&self, i: usize, elapsed: f64, width_rounding: f64, line: i32, tally: &mut Tally<M>) {
        let phases = self.phases;
        let slowest = phases.p0[i].min(phases.p1[i]).sqrt();
        let rounding = width_rounding * (phases.u1[i] - phases.u0[i]);
        let at_end = if slowest > 0.0 { rounding / (slowest * elapsed) } else { 0.0 };
        let error = (phases.duration[i] - elapsed).abs() / elapsed - ROUNDINGS * width_rounding.max(at_end);
        tally.offer(Check::Duration, 0, error, PASS_EXCESS, self.starts[i], line);
    }

    /// The recorded p at both ends against the speed by the length, as a jump of axis velocity. A place is known to its
    /// rounding: over that way the axis may accelerate.
    fn ends_by_length(&self, i: usize, ends: [Option<&Look<M>>; 2], line: i32, tally: &mut Tally<M>) {
        let phases = self.phases;
        let known = [(phases.p0[i], 0.0), (phases.p1[i], phases.duration[i])];
        for (look, (p, since)) in ends.into_iter().zip(known) {
            let Some(Look { place, station, velocity, .. }) = look else { continue };
            let recorded = station.slope * p.sqrt();
            let way = ROUNDINGS * EPS * self.path.width[phases.piece[i] as usize] * station.slope;
            for k in 0..self.limits.axes {
                let cosine = station.first.value[k].abs();
                let [slow, fast] =
                    [place.pace.v.min(recorded), place.pace.v.max(recorded)].map(|speed| cosine * speed);
                let gained = 2.0 * self.limits.acceleration.greatest(k) * way * cosine;
                let reached = (slow * slow + gained).sqrt().max(slow);
                let jump = fast - reached - velocity.rounding[k];
                tally.offer(
                    Check::Jump,
                    k,
                    jump,
                    self.limits.negligible_jump(k),
                    self.starts[i] + since,
                    line,
                );
            }
        }
    }

    fn jerks(&self) -> Jerks<'_, M> {
        let Self { phases, limits, starts, .. } = *self;
        Jerks { phases, limits, starts, smooth: SMOOTH }
    }

    /// The recorded p at both ends against what the phase's definition gives there, as a jump of axis velocity. A place is
    /// known to its rounding: over that way the axis may accelerate.
    fn recorded_ends(&self, i: usize, motion: &PhaseMotion<M>, line: i32, tally: &mut Tally<M>) {
        let way = ROUNDINGS * motion.width_rounding() * motion.width;
        for (y, recorded) in [(0.0, motion.root_anchor), (1.0, motion.root_far)] {
            let state = motion.state(y);
            let at_end = (y == 1.0) != motion.anchored_at_end;
            let time = self.starts[i] + if at_end { self.phases.duration[i] } else { 0.0 };
            for k in 0..M {
                let size = state.tangent[k].abs();
                let [slow, fast] = [state.root_p.min(recorded), state.root_p.max(recorded)].map(|p| size * p);
                let gained = 2.0 * self.limits.acceleration.greatest(k) * way * size;
                let reached = (slow * slow + gained).sqrt().max(slow);
                let jump = fast - reached - ROUNDINGS * EPS * state.magnitude[k];
                tally.offer(Check::Jump, k, jump, self.limits.negligible_jump(k), time, line);
            }
        }
    }

    /// Phases must follow each other without gap over every piece, and runs begin and end at rest.
    fn order(&self, tally: &mut Tally<M>) {
        let Self { path, phases, starts, .. } = *self;
        if !(PhaseOrder { path, phases, starts, axes: path.axes }).audit(tally) {
            return;
        }
        let [start_speed, end_speed] = self.limits.end_speeds;
        let runs = phases.runs.windows(2).enumerate();
        for (run, ends) in runs.filter(|(_, ends)| ends[0] < ends[1]) {
            let (first, last) = (ends[0] as usize, ends[1] as usize - 1);
            let wanted = if run == 0 { start_speed } else { 0.0 };
            self.run_end(first, phases.u0[first], phases.p0[first], wanted, starts[first], tally);
            let wanted = if run + 2 == phases.runs.len() { end_speed } else { 0.0 };
            let time = starts[last] + phases.duration[last];
            self.run_end(last, phases.u1[last], phases.p1[last], wanted, time, tally);
        }
    }

    /// The change from one phase to the next: no jump of the speed, and of the axis velocities only at corners.
    fn joint(&self, i: usize, j: usize, stations: &mut Stations<M>, tally: &mut Tally<M>) {
        let phases = self.phases;
        if [i, j].iter().any(|&phase| !phases.has_good_numbers(phase, self.path.axes)) {
            return; // reported with the phase itself
        }
        let (before, after) = (phases.piece[i] as usize, phases.piece[j] as usize);
        let ends = [(before, phases.u1[i], phases.p1[i]), (after, phases.u0[j], phases.p0[j])];
        let mut velocity = [[0.0; M]; 2];
        let mut rounding = [0.0; M];
        for (side, (piece, u, p)) in ends.into_iter().enumerate() {
            let curve = stations.curves.get(piece);
            let (tangent, root_p) = (curve.derivative(u), p.sqrt());
            let scale = ROUNDINGS * EPS * root_p;
            let size = curve.derivative_size();
            // Between two pieces the control points' own rounding turns the tangent.
            let turned =
                if before == after { 0.0 } else { 2.0 * curve.magnitude() * curve.derivative_scale() };
            for k in 0..M {
                velocity[side][k] = tangent[k] * root_p;
                rounding[k] += scale * (size[k] + turned);
            }
        }
        let (time, line) = (self.starts[j], self.line(after));
        if self.limits.judges_jerk {
            let station = |piece: usize, u: f64| stations.get(piece, u).copied();
            self.jerks().joint([i, j], station, line, tally);
        }
        let at_corner = if before == after { 0.0 } else { 1.0 };
        for k in 0..M {
            let jump = (velocity[1][k] - velocity[0][k]).abs() - rounding[k];
            let limit = at_corner * self.limits.jump[k] + self.limits.negligible_jump(k);
            tally.offer(Check::Jump, k, jump, limit, time, line);
        }
        if before != after {
            let speeds = velocity.map(|v| length(&v));
            let jump = (speeds[1] - speeds[0]).abs() - length(&rounding);
            tally.offer(Check::Continuity, 0, jump, self.negligible_speed(), time, line);
            // Motionless pieces in between have junctions of their own.
            for junction in before + 1..=after {
                let allowed = self.junction_speed[junction] + self.negligible_speed();
                tally.offer(Check::Junction, 0, speeds[0].max(speeds[1]), allowed, time, line);
                if !self.path.is_motionless(junction) {
                    break;
                }
            }
        }
    }

    /// The speed at the start or the end of a run.
    fn run_end(&self, i: usize, u: f64, p: f64, wanted: f64, time: f64, tally: &mut Tally<M>) {
        let piece = self.phases.piece[i] as usize;
        let speed = length(&self.path.curve::<M>(piece).derivative(u)) * p.sqrt();
        let rounding = ROUNDINGS * EPS * (speed + wanted);
        let limit = self.negligible_speed();
        tally.offer(Check::Junction, 0, (speed - wanted).abs() - rounding, limit, time, self.line(piece));
        if self.limits.judges_jerk && wanted == 0.0 {
            self.jerks().rest(i, u > self.phases.u0[i], self.line(piece), tally);
        }
    }

    /// A jump of the speed that means nothing to any axis.
    fn negligible_speed(&self) -> f64 {
        (0..self.path.axes).map(|k| self.limits.negligible_jump(k)).fold(f64::INFINITY, f64::min)
    }

    fn line(&self, piece: usize) -> i32 {
        self.path.line.get(piece).copied().unwrap_or(0)
    }
}

/// Walks one phase and offers what it meets.
struct Probe<'a, const M: usize> {
    motion: &'a PhaseMotion<M>,
    limits: &'a Limits<M>,
    tally: &'a mut Tally<M>,
    feeds: [f64; FEEDS],
    start: f64,
    duration: f64,
    line: i32,
    /// Time from the anchor.
    elapsed: f64,
    /// Greatest share of an acceleration limit met so far.
    nearest_limit: f64,
}

impl<'a, const M: usize> Probe<'a, M> {
    fn new(
        auditor: &'a Auditor<'a, M>,
        motion: &'a PhaseMotion<M>,
        tally: &'a mut Tally<M>,
        i: usize,
        line: i32,
    ) -> Self {
        Self {
            motion,
            limits: auditor.limits,
            tally,
            feeds: auditor.path.feeds(auditor.phases.piece[i] as usize),
            start: auditor.starts[i],
            duration: auditor.phases.duration[i],
            line,
            elapsed: 0.0,
            nearest_limit: 0.0,
        }
    }

    /// Even intervals with a short one at each end.
    fn run(&mut self) {
        let mut state = self.motion.state(0.0);
        let last = self.motion.state(1.0);
        self.place(&state);
        let step = 1.0 / INTERVALS as f64;
        let [head, tail] =
            [&state, &last].map(|end| Some(self.short_interval(end)).filter(|y| *y > 0.0 && *y < step));
        let inner = (1..INTERVALS).map(|i| i as f64 * step);
        for y in head.into_iter().chain(inner).chain(tail.map(|y| 1.0 - y)) {
            let next = self.motion.state(y);
            self.advance(&state, &next);
            state = next;
        }
        self.advance(&state, &last);
    }

    fn run_evenly(&mut self, intervals: usize) {
        let mut state = self.motion.state(0.0);
        for i in 1..=intervals {
            let next = self.motion.state(i as f64 / intervals as f64);
            self.advance(&state, &next);
            state = next;
        }
    }

    /// The length in y of an end interval that lets rounding hide no more than `HIDDEN` of any limit.
    fn short_interval(&self, end: &State<M>) -> f64 {
        let mut time = 0.0_f64;
        for k in 0..M {
            let rounding = 2.0 * ROUNDINGS * EPS * end.magnitude[k];
            time = time.max(rounding / (HIDDEN * self.limits.acceleration.least(k)));
        }
        (time / self.duration).max(SHORTEST)
    }

    fn advance(&mut self, from: &State<M>, to: &State<M>) {
        let motion = self.motion;
        motion.walk(from, to, &mut |from, to, time| self.interval(from, to, time));
    }

    fn interval(&mut self, from: &State<M>, to: &State<M>, time: f64) {
        let middle = self.clock(self.elapsed + 0.5 * time);
        self.elapsed += time;
        let held = self.motion.held_axis();
        // The time is known as well as the width of the phase.
        let in_time = ROUNDINGS * self.motion.width_rounding();
        for k in 0..M {
            let rounding = ROUNDINGS * EPS * (from.magnitude[k] + to.magnitude[k]) / time;
            // A phase that is anchored at its end is walked against the time.
            let [early, late] = if self.motion.anchored_at_end { [to, from] } else { [from, to] };
            let change = late.velocity[k] - early.velocity[k];
            let acceleration = change.abs() / time * (1.0 - in_time) - rounding;
            let limit = self.limits.acceleration.of(k, change);
            self.tally.offer(Check::Acceleration, k, acceleration, limit, middle, self.line);
            if held != Some(k) {
                self.nearest_limit = self.nearest_limit.max(acceleration / limit);
            }
        }
        self.place(to);
    }

    /// The velocities at one place.
    fn place(&mut self, state: &State<M>) {
        let time = self.clock(self.elapsed);
        self.tally.samples += 1;
        for k in 0..M {
            let velocity = state.velocity[k].abs() - ROUNDINGS * EPS * state.magnitude[k];
            let limit = self.limits.velocity.of(k, state.velocity[k]);
            self.tally.offer(Check::Velocity, k, velocity, limit, time, self.line);
        }
        for (feed, limit) in self.feeds.into_iter().enumerate().filter(|(_, limit)| *limit != f64::INFINITY) {
            let speed = length(&self.limits.counted(feed, &state.velocity));
            let rounding = ROUNDINGS * EPS * length(&self.limits.counted(feed, &state.magnitude));
            self.tally.offer(Check::Feed, 0, speed - rounding, limit, time, self.line);
        }
        if self.limits.chord_tolerance.is_finite() {
            let speed = length(&state.velocity);
            let rounding = ROUNDINGS * EPS * length(&state.magnitude);
            let error = chord_error((speed - rounding) * self.limits.period, self.motion.curvature(state));
            self.tally.offer(Check::Chord, 0, error, self.limits.chord_tolerance, time, self.line);
        }
    }

    /// The program's time at a time from the anchor.
    fn clock(&self, elapsed: f64) -> f64 {
        self.start + if self.motion.anchored_at_end { self.duration - elapsed } else { elapsed }
    }
}
