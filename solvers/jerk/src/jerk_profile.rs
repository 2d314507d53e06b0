//! Profiles of limited jerk as columns: phases along the pieces of a path, in the order of the path, from sections of
//! constant jerk (`s_curve`) or the spline w(s) of the jerk-limited planner.
//!
//! Three laws, of `feedplan.profile.PhaseLaw`: the feed is held, the jerk along the path is constant, or v² is a cubic of
//! the arc length. All stay what they are where a phase is cut at the end of a piece. Lengths in mm, times in s.

use crate::arc_length_path::{speed_sq, ArcLengthPath};
use crate::jerk_limited::profile::Profile;
use crate::jerk_limited::rest_ramp::Ramp;
use crate::path_problem::Geometry;
use crate::s_curve::{Section, SegmentEnd};
use feedplan_geometry::arc_length::{W, X};
use feedplan_planner::phase_law::PhaseLaw;
use feedplan_planner::phases::{Phase, Phases, NO_AXIS};
use feedplan_planner::problem::{greater, lesser, Problem};

/// A section shorter than this part of the time in which an axis reaches its greatest speed is rounding.
const SHORTEST: f64 = 1e-9;
/// The error that moves states falls by this part of each phase's length, which is too little to show in the phase.
const ABSORBED: f64 = 1e-10;
/// The time of a phase is accurate to this part, unless its halves have been halved this often, next to rest.
const QUADRATURE: f64 = 1e-12;
const DEPTH: u32 = 12;
/// A cubic becomes a phase of constant jerk where the rounding of v² would show in its jerk by more than this part of
/// the limit, and its jerk changes by no more than this many roundings.
const SHOWN: f64 = 1e-7;
const NOISE: f64 = 8.0;
/// The ramps of two profiles take up accelerations that differ by this part: some 90 times as much of the jerk.
const TAKEN_UP: f64 = 2e-3;
/// Bisection steps for the time at which a section of constant jerk passes a knot.
const HALVINGS: usize = 200;

#[derive(Clone, Debug, Default, PartialEq)]
pub struct JerkProfile {
    pub phases: Phases,
    /// Offsets of the runs in the phases.
    pub runs: Vec<i64>,
    /// Pieces at whose start a jump of curvature limits the speed.
    pub kinks: Vec<u32>,
    /// The planner's estimate of the time above the least time, in s, of each subrun that it planned, in order.
    pub excess: Vec<f64>,
    /// A lower bound on the time of each run, in s, if the planner was asked for it; NaN without proof.
    pub lower_bound: Vec<f64>,
    /// Whether a deadline stopped the planner.
    pub stopped: bool,
    /// Time of the phases that were left out at the start of a piece, in s.
    left_out: f64,
    /// Piece and parameter where these phases begin.
    left_from: Option<(usize, f64)>,
}

/// Arc length along a subrun, speed and acceleration.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct State {
    pub s: f64,
    pub v: f64,
    pub a: f64,
}

impl State {
    /// At rest with an acceleration, where the path turns back.
    fn turns(&self) -> bool {
        self.v == 0.0 && self.a != 0.0
    }

    /// The state after a time t with a constant jerk.
    pub fn after(&self, t: f64, jerk: f64) -> Self {
        let Self { s, v, a } = *self;
        Self {
            s: s + t * (v + t * (0.5 * a + t * jerk / 6.0)),
            v: (v + t * (a + 0.5 * t * jerk)).max(0.0),
            a: a + t * jerk,
        }
    }
}

/// A section of constant jerk; after `cut` it lies on one part.
struct Span {
    part: usize,
    ends: [State; 2],
    jerk: f64,
    duration: f64,
}

impl Span {
    /// The length by its speed, acceleration, jerk and duration.
    fn length(&self) -> f64 {
        State { s: 0.0, ..self.ends[0] }.after(self.duration, self.jerk).s
    }

    fn cut<const M: usize>(self, path: &ArcLengthPath<M>, out: &mut Vec<Self>) {
        let Self { ends: [from, to], jerk, duration, .. } = self;
        let mut part = path.part(from.s);
        let (mut start, mut left) = (from, duration);
        while part + 1 < path.parts.len() && path.knots()[part + 1] < to.s {
            let knot = path.knots()[part + 1];
            let (mut low, mut high) = (0.0, left);
            for _ in 0..HALVINGS {
                let middle = 0.5 * (low + high);
                if middle <= low || middle >= high {
                    break;
                }
                if start.after(middle, jerk).s < knot {
                    low = middle;
                } else {
                    high = middle;
                }
            }
            let end = State { s: knot, ..start.after(high, jerk) };
            out.push(Self { part, ends: [start, end], jerk, duration: high });
            (start, left) = (end, left - high);
            part += 1;
        }
        out.push(Self { part, ends: [start, to], jerk, duration: left });
    }
}

/// A motion under one law between two states.
struct Movement {
    law: PhaseLaw,
    value: f64,
    ends: [State; 2],
    duration: f64,
}

impl JerkProfile {
    /// The profile of a subrun that a deadline left no time for.
    pub fn unplanned() -> Self {
        Self { stopped: true, lower_bound: vec![f64::NAN], ..Self::default() }
    }

    /// Whether the profile is that of `unplanned`.
    pub fn is_unplanned(&self) -> bool {
        self.stopped && self.phases.is_empty()
    }

    /// The profiles of all parts in this order, without runs.
    pub fn joined(parts: Vec<Self>) -> Self {
        let (mut all, mut phases) = (Self::default(), Vec::with_capacity(parts.len()));
        for part in parts {
            phases.push(part.phases);
            all.kinks.extend(part.kinks);
            all.excess.extend(part.excess);
            all.lower_bound.extend(part.lower_bound);
            all.stopped |= part.stopped;
        }
        Self { phases: Phases::joined(phases), ..all }
    }

    /// The size of the acceleration at the start or at the end, in mm/s².
    pub fn end_acceleration(&self, end: usize) -> f64 {
        let a = if end == 0 { self.phases.a0.first() } else { self.phases.a1.last() };
        a.map_or(0.0, |a| a.abs())
    }

    /// Lowers the acceleration at a rest where the path turns back from that of the ramp there.
    ///
    /// Over thirds of the ramp's time the acceleration is, from the rest on and in parts of the change d, d less, 5/6 d
    /// more, 1/3 d less, and that of the ramp: time, length and speed stay. The jerk is at most 5.5 d over the time.
    pub fn turn_with<const M: usize>(
        &mut self,
        problem: &Problem<M>,
        path: &ArcLengthPath<M>,
        end: usize,
        acceleration: f64,
    ) {
        let change = self.end_acceleration(end) - acceleration;
        let own = &mut self.phases;
        let at = if end == 0 { 0 } else { own.len() - 1 };
        let time = own.duration[at];
        let mut from = State { s: 0.0, v: 0.0, a: acceleration };
        let mut spans = vec![];
        for jerk in [5.5, -3.5, 1.0].map(|part| part * change / time) {
            let duration = time / 3.0;
            let to = from.after(duration, jerk);
            let part = if end == 0 { 0 } else { path.parts.len() - 1 };
            let back = |state: State| State { s: path.total() - state.s, v: state.v, a: -state.a };
            let ends = if end == 0 { [from, to] } else { [back(to), back(from)] };
            spans.push(Span { part, ends, jerk, duration });
            from = to;
        }
        if end == 1 {
            spans.reverse();
        }
        let mut ramp = Self::default();
        ramp.push_spans(problem, path, &spans);
        let mut ramp = ramp.phases;
        let last = ramp.len() - 1;
        (ramp.u0[0], ramp.p0[0], ramp.u1[last], ramp.p1[last]) =
            (own.u0[at], own.p0[at], own.u1[at], own.p1[at]);
        own.remove(at);
        let rest = std::mem::take(own);
        *own = Phases::joined(if end == 0 { vec![ramp, rest] } else { vec![rest, ramp] });
    }

    /// Whether another profile can go on from a turn after this one, where the acceleration may be at most `most`: the
    /// ramps take up what their accelerations differ by.
    pub fn meets(&self, next: &Self, most: f64) -> bool {
        let [own, other] = [self.end_acceleration(1), next.end_acceleration(0)];
        let (change, greater) = ((own - other).abs(), own.max(other));
        let ramp = if own > other { self.has_ramp(1) } else { next.has_ramp(0) };
        self.is_unplanned()
            || next.is_unplanned()
            || change == 0.0
            || ramp && change <= TAKEN_UP * greater && greater + change <= most
    }

    /// Whether one phase is the ramp of constant acceleration from or to rest.
    fn has_ramp(&self, end: usize) -> bool {
        let Phases { kind, value, .. } = &self.phases;
        let is_steady = |at: usize| kind[at] == PhaseLaw::PathJerk as u8 && value[at] == 0.0;
        let (at, next) = if end == 0 { (0, 1) } else { (kind.len() - 1, kind.len().wrapping_sub(2)) };
        next < kind.len() && is_steady(at) && !is_steady(next)
    }

    /// Appends a movement between two parameters of a piece. One too short to show in u is merged into its neighbour.
    fn push<const M: usize>(
        &mut self,
        problem: &Problem<M>,
        piece: usize,
        [u0, u1]: [f64; 2],
        movement: &Movement,
    ) {
        let u0 = self.left_from.take().filter(|from| from.0 == piece).map_or(u0, |from| from.1);
        let phases = &mut self.phases;
        let last = phases.len().wrapping_sub(1);
        let goes_on = last < phases.len() && phases.piece[last] as usize == piece && phases.u1[last] == u0;
        let speed = |u: f64, v: f64| if v == 0.0 { 0.0 } else { v * v / speed_sq(problem, piece, u) };
        let Movement { law, value, ends: [from, to], duration } = *movement;
        let turns = from.turns() || to.turns();
        if u1 <= u0 || !turns && duration <= SHORTEST * rise_time(problem) {
            let u1 = u1.max(u0);
            if goes_on {
                phases.duration[last] += duration;
                phases.u1[last] = u1;
                phases.p1[last] = speed(u1, to.v);
                phases.a1[last] = to.a;
            } else {
                self.left_out += duration;
                self.left_from = Some((piece, u0));
            }
            return;
        }
        phases.push(&Phase {
            piece: piece as u32,
            law,
            axis: NO_AXIS,
            value,
            u0,
            u1,
            p0: speed(u0, from.v),
            p1: speed(u1, to.v),
            duration: duration + std::mem::take(&mut self.left_out),
            a0: from.a,
            a1: to.a,
        });
    }

    /// Appends a section of constant jerk between two states; `duration` in s.
    fn push_jerk<const M: usize>(
        &mut self,
        problem: &Problem<M>,
        path: &ArcLengthPath<M>,
        ends: [State; 2],
        jerk: f64,
        duration: f64,
    ) {
        let mut spans = vec![];
        Span { part: 0, ends, jerk, duration }.cut(path, &mut spans);
        self.push_spans(problem, path, &spans);
    }

    /// Appends sections of constant jerk along a whole subrun, to an end.
    pub fn push_sections<const M: usize>(
        &mut self,
        problem: &Problem<M>,
        path: &ArcLengthPath<M>,
        sections: &[Section],
        end: SegmentEnd,
    ) {
        let mut spans = vec![];
        for (i, section) in sections.iter().enumerate() {
            problem.watch.check_at(i);
            let from = State { s: section.position, v: section.speed, a: section.acceleration };
            let to = match sections.get(i + 1) {
                Some(next) => State { s: next.position, v: next.speed, a: next.acceleration },
                None => State { s: path.total(), v: end.speed, a: -end.acceleration },
            };
            let Section { jerk, duration, .. } = *section;
            Span { part: 0, ends: [from, to], jerk, duration }.cut(path, &mut spans);
        }
        self.push_spans(problem, path, &spans);
    }

    /// Appends the way between two lengths of a subrun at its feed, in mm/s.
    pub fn push_held<const M: usize>(
        &mut self,
        problem: &Problem<M>,
        path: &ArcLengthPath<M>,
        [from, to]: [f64; 2],
        feed: f64,
    ) {
        let state = State { s: 0.0, v: feed, a: 0.0 };
        let mut part = path.part(from);
        while part < path.parts.len() && path.knots()[part] < to {
            problem.watch.check_at(part);
            let u = [from, to].map(|s| path.locate(part, s));
            let duration = path.length_between(part, u[0], u[1]) / feed;
            let movement = Movement { law: PhaseLaw::Feed, value: feed * feed, ends: [state; 2], duration };
            self.push(problem, path.parts[part].piece, u, &movement);
            part += 1;
        }
    }

    /// Appends sections that are cut at the knots. Arc lengths far along a path have too few digits for sections of
    /// some nanometres. So the sections of a part follow one another from both of its ends by their own lengths, and
    /// the longest section takes the rounding. The duration of each is corrected for the length between its parameters.
    fn push_spans<const M: usize>(&mut self, problem: &Problem<M>, path: &ArcLengthPath<M>, spans: &[Span]) {
        for spans in spans.chunk_by(|a, b| a.part == b.part) {
            problem.watch.check_at(spans[0].part);
            let (part, last) = (spans[0].part, spans.len());
            let longest =
                (0..last).fold(0, |most, i| if spans[i].length() > spans[most].length() { i } else { most });
            let mut u = vec![path.locate(part, spans[0].ends[0].s); last + 1];
            u[last] = path.locate(part, spans[last - 1].ends[1].s);
            for i in 0..longest {
                u[i + 1] = path.parameter_beside(part, u[i], spans[i].length(), spans[i].ends[1].s);
            }
            for i in (longest + 1..last).rev() {
                u[i] = path.parameter_beside(part, u[i + 1], -spans[i].length(), spans[i].ends[0].s);
            }
            for (i, span) in spans.iter().enumerate() {
                let (u, length) = ([u[i], u[i + 1]], span.length());
                let moved = path.length_between(part, u[0], u[1]) - length;
                // The faster end moves: next to rest a small part of the length takes much of the time. Where the path turns
                // back, the speed follows from the acceleration and the time.
                let fastest = span.ends[0].v.max(span.ends[1].v);
                let keeps = fastest == 0.0 || span.ends.iter().any(State::turns);
                let duration = span.duration + if keeps { 0.0 } else { moved / fastest };
                let movement =
                    Movement { law: PhaseLaw::PathJerk, value: span.jerk, ends: span.ends, duration };
                self.push(problem, path.parts[part].piece, u, &movement);
            }
        }
    }

    /// Appends a profile of the jerk-limited planner on a part of a subrun.
    ///
    /// Arc lengths far along a path, and parameters next to rest, have too few digits for short phases: what rounding
    /// changes in their lengths shows some hundred times as much in w''. So the lengths of phases are measured between
    /// the rounded parameters, and each state is moved along its profile to the end of its phase. These moves add up
    /// from both ends of the profile; the longest phase, in which they show least, takes their difference.
    pub fn push_profile<const M: usize>(
        &mut self,
        problem: &Problem<M>,
        path: &ArcLengthPath<M>,
        jerk_limits: &[f64; M],
        profile: &Profile,
    ) {
        let (s, ends) = (&profile.s, profile.ends);
        let last = s.len() - 1;
        let ways = ways_between(problem, path, s);
        // A ramp within one part has its own length between rounded parameters.
        let ramp_way = |end: usize, from: f64, to: f64| {
            let part = [0, path.parts.len() - 1][end];
            (from < to && path.part(if end == 0 { to } else { from }) == part)
                .then(|| Way::new(path, part, [from, to]))
        };
        let ramp_ways = [ramp_way(0, ends[0], s[0]), ramp_way(1, s[last], ends[1])];
        let (mut states, meeting, off) = moved_states(profile, &ways, &ramp_ways);
        if s[0] > ends[0] {
            let length = ramp_ways[0].as_ref().map_or(s[0] - ends[0], |way| way.length);
            let OnRamp { jerk, duration, ends: [from, to] } =
                OnRamp::new(Ramp { length, ..profile.ramp(0) }, states[0].v);
            states[0].a = to;
            let ends = [State { s: ends[0], v: 0.0, a: from }, states[0]];
            self.push_ramp(
                problem,
                path,
                ramp_ways[0].as_ref(),
                Movement { law: PhaseLaw::PathJerk, value: jerk, ends, duration },
            );
        }
        let to_rest = (s[last] < ends[1]).then(|| {
            let length = ramp_ways[1].as_ref().map_or(ends[1] - s[last], |way| way.length);
            OnRamp::new(Ramp { length, ..profile.ramp(1) }, states[last].v)
        });
        if let Some(ramp) = &to_rest {
            states[last].a = -ramp.ends[1];
        }
        for (n, way) in ways.iter().enumerate() {
            problem.watch.check_at(n);
            let off = if n == meeting { off } else { 0.0 };
            let ends = [states[n], states[n + 1]];
            let movement = movement_between(path, jerk_limits, way.part, (way.length, off), ends);
            self.push(problem, path.parts[way.part].piece, way.u, &movement);
        }
        if let Some(OnRamp { jerk, duration, ends: [from, _] }) = to_rest {
            let ends = [states[last], State { s: ends[1], v: 0.0, a: -from }];
            self.push_ramp(
                problem,
                path,
                ramp_ways[1].as_ref(),
                Movement { law: PhaseLaw::PathJerk, value: jerk, ends, duration },
            );
        }
    }

    fn push_ramp<const M: usize>(
        &mut self,
        problem: &Problem<M>,
        path: &ArcLengthPath<M>,
        way: Option<&Way>,
        ramp: Movement,
    ) {
        match way {
            Some(way) => self.push(problem, path.parts[way.part].piece, way.u, &ramp),
            None => self.push_jerk(problem, path, ramp.ends, ramp.value, ramp.duration),
        }
    }
}

/// A way on one part: its parameters, and the length between them in mm.
struct Way {
    part: usize,
    u: [f64; 2],
    length: f64,
}

impl Way {
    fn new<const M: usize>(path: &ArcLengthPath<M>, part: usize, ends: [f64; 2]) -> Self {
        let u = ends.map(|s| path.locate(part, s));
        Self { part, u, length: path.length_between(part, u[0], u[1]) }
    }
}

/// The ways between neighbouring stations; the knots between them are stations.
fn ways_between<const M: usize>(problem: &Problem<M>, path: &ArcLengthPath<M>, s: &[f64]) -> Vec<Way> {
    let (knots, mut part) = (path.knots(), path.part(s[0]));
    let mut ways: Vec<Way> = Vec::with_capacity(s.len() - 1);
    for ends in s.windows(2) {
        problem.watch.check_at(ways.len());
        while knots[part + 1] <= ends[0] && part + 1 < path.parts.len() {
            part += 1;
        }
        let from = match ways.last() {
            Some(before) if before.part == part => before.u[1],
            _ => path.locate(part, ends[0]),
        };
        let u = [from, path.locate(part, ends[1])];
        ways.push(Way { part, u, length: path.length_between(part, u[0], u[1]) });
    }
    ways
}

/// The least time in which an axis reaches its greatest speed, in s.
fn rise_time<const M: usize>(problem: &Problem<M>) -> f64 {
    let (velocity, acceleration) = (lesser(&problem.max_velocity), greater(&problem.max_acceleration));
    let of_axis = |k: usize| velocity[k] / acceleration[k];
    (0..M).map(of_axis).fold(f64::INFINITY, f64::min)
}

/// The motion on a ramp from rest to a speed.
struct OnRamp {
    jerk: f64,
    duration: f64,
    /// The accelerations at both ends, up to rounding; those of the profile belong to the length before rounding.
    ends: [f64; 2],
}

impl OnRamp {
    /// At constant jerk, s = J t³/6 and v = J t²/2, so that t = 3 s/v; at constant acceleration t = 2 s/v.
    fn new(ramp: Ramp, v: f64) -> Self {
        let t = ramp.way() / v;
        if ramp.power == Ramp::ACCELERATION {
            Self { jerk: 0.0, duration: t, ends: [v / t; 2] }
        } else {
            let jerk = 2.0 * v / (t * t);
            Self { jerk, duration: t, ends: [0.0, jerk * t] }
        }
    }
}

/// The states at the stations, moved to the positions that the ways between them give, from both ends of the profile;
/// the longest way, between whose ends the moves meet; and the error of its length.
fn moved_states(profile: &Profile, ways: &[Way], ramp_ways: &[Option<Way>; 2]) -> (Vec<State>, usize, f64) {
    let (s, last) = (&profile.s, ways.len());
    let meeting = (0..last).fold(0, |most, n| if ways[n].length > ways[most].length { n } else { most });
    // The quadrature error of long phases must not move the states in turns that are shorter than it.
    let added = |miss: f64, way: &Way, length: f64| {
        let miss = miss + (way.length - length);
        miss - miss.clamp(-ABSORBED * way.length, ABSORBED * way.length)
    };
    let mut moved = vec![0.0; last + 1];
    moved[0] = ramp_ways[0].as_ref().map_or(0.0, |way| added(0.0, way, s[0] - profile.ends[0]));
    for n in 0..meeting {
        moved[n + 1] = added(moved[n], &ways[n], s[n + 1] - s[n]);
    }
    moved[last] = ramp_ways[1].as_ref().map_or(0.0, |way| -added(0.0, way, profile.ends[1] - s[last]));
    for n in (meeting + 1..last).rev() {
        moved[n] = -added(-moved[n + 1], &ways[n], s[n + 1] - s[n]);
    }
    let way = &ways[meeting];
    let off = way.length - (s[meeting + 1] - s[meeting]) - (moved[meeting + 1] - moved[meeting]);
    let state = |n: usize| {
        let d = moved[n];
        // w'' on the side to which the station moves.
        let bend = profile.at(if d < 0.0 { s[n] * (1.0 - f64::EPSILON) } else { s[n] })[2];
        let w = profile.speed_sq[n] + d * (profile.slope[n] + 0.5 * d * bend);
        State { s: s[n], v: w.sqrt(), a: 0.5 * (profile.slope[n] + d * bend) }
    };
    ((0..=last).map(state).collect(), meeting, off.abs())
}

/// The movement between two states at the distance h on a part, where h has the error `off`.
///
/// v² as a cubic is known by its values at both ends. Their rounding ε v² and the error e of h change the jerk by 3 v
/// (ε v² + 2 |a| e)/h². That is more than the limit on a phase of a nanometre. There the accelerations at both ends give
/// a constant jerk: over so short a length it changes only by rounding.
fn movement_between<const M: usize>(
    path: &ArcLengthPath<M>,
    jerk_limits: &[f64; M],
    part: usize,
    (h, off): (f64, f64),
    ends: [State; 2],
) -> Movement {
    let duration = cubic_time(h, &ends);
    let [start, end] = ends;
    let rounding = 3.0 * end.v * (f64::EPSILON * end.v * end.v + 2.0 * end.a.abs() * off) / (h * h);
    let [from, to] = cubic_jerks(h, &ends);
    let change = 0.5 * (to - from).abs();
    if change <= NOISE * rounding {
        let first = path.at(part, start.s).first;
        let limit = (0..M).map(|k| jerk_limits[k] / first[k].abs()).fold(f64::INFINITY, f64::min);
        if rounding > SHOWN * limit {
            let value = (end.a - start.a) / duration;
            return Movement { law: PhaseLaw::PathJerk, value, ends, duration };
        }
    }
    Movement { law: PhaseLaw::SpeedCubic, value: 0.0, ends, duration }
}

/// The jerk v w''/2 at both ends of the cubic w = v² between two states at the distance h.
fn cubic_jerks(h: f64, [from, to]: &[State; 2]) -> [f64; 2] {
    let slope = (to.v - from.v) * (to.v + from.v) / h;
    [
        from.v * (3.0 * slope - 4.0 * from.a - 2.0 * to.a) / h,
        to.v * (2.0 * from.a + 4.0 * to.a - 3.0 * slope) / h,
    ]
}

/// ∫ ds/√w of the cubic w between two states at the distance h, in s.
fn cubic_time(h: f64, [from, to]: &[State; 2]) -> f64 {
    let (w0, w1) = (from.v * from.v, to.v * to.v);
    let (d0, d1) = (2.0 * from.a * h, 2.0 * to.a * h);
    let speed = |t: f64| {
        let r = 1.0 - t;
        (r * r * ((1.0 + 2.0 * t) * w0 + t * d0) + t * t * ((1.0 + 2.0 * r) * w1 - r * d1)).sqrt()
    };
    h * halved_time(&|t| 1.0 / speed(t), [0.0, 1.0], 0)
}

/// The integral by Gauss's rule of eight points, halved until both halves together equal the whole to `QUADRATURE`.
fn halved_time(f: &impl Fn(f64) -> f64, [a, b]: [f64; 2], depth: u32) -> f64 {
    let panel = |a: f64, b: f64| -> f64 {
        let (middle, half) = (0.5 * (a + b), 0.5 * (b - a));
        (0..4).map(|i| half * W[i] * (f(middle - half * X[i]) + f(middle + half * X[i]))).sum()
    };
    let middle = 0.5 * (a + b);
    let (whole, halves) = (panel(a, b), panel(a, middle) + panel(middle, b));
    if (whole - halves).abs() <= QUADRATURE * halves || depth == DEPTH {
        return halves;
    }
    halved_time(f, [a, middle], depth + 1) + halved_time(f, [middle, b], depth + 1)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_cubic_of_constant_acceleration_takes_the_time_of_its_change_of_speed() {
        // 10 to 30 mm/s at 200 mm/s²: 2 mm, 0.1 s.
        let ends = [State { s: 1.0, v: 10.0, a: 200.0 }, State { s: 3.0, v: 30.0, a: 200.0 }];
        assert!((cubic_time(2.0, &ends) - 0.1).abs() < 1e-9, "{}", cubic_time(2.0, &ends));
    }

    #[test]
    fn the_jerk_of_a_cubic_changes_with_its_speed_though_its_second_derivative_is_constant() {
        // w = 4 + 6 s + 16 s² from s = 0 to 1: v = 2 and √26, a = 3 and 19, w'' = 32.
        let ends = [State { s: 5.0, v: 2.0, a: 3.0 }, State { s: 6.0, v: 26f64.sqrt(), a: 19.0 }];
        let [from, to] = cubic_jerks(1.0, &ends);
        assert!((from - 32.0).abs() < 1e-12 && (to - 16.0 * 26f64.sqrt()).abs() < 1e-12, "{from} {to}");
    }

    #[test]
    fn a_phase_that_ends_next_to_rest_has_its_time_to_all_digits() {
        // From 10 mm/s to 0.1 at -50 mm/s².
        let h = (100.0 - 0.01) / 100.0;
        let ends = [State { s: 0.0, v: 10.0, a: -50.0 }, State { s: h, v: 0.1, a: -50.0 }];
        assert!((cubic_time(h, &ends) / 0.198 - 1.0).abs() < 1e-12, "{}", cubic_time(h, &ends));
    }
}
