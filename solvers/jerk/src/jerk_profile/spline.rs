//! Appends the spline w(s) = v² of the jerk-limited planner to a profile as phases: one for each interval between two stations,
//! and one for each ramp from or to rest.

use feedplan_geometry::arc_length::{W, X};
use feedplan_planner::phase_law::PhaseLaw;

use super::{JerkProfile, Movement, State};
use crate::arc_length_path::ArcLengthPath;
use crate::jerk_limited::profile::Profile;
use crate::jerk_limited::rest_ramp::Ramp;
use crate::path_problem::Geometry;

/// Each phase absorbs an error of this fraction of its length, which is too little to show in the phase; the rest moves the
/// states.
const ABSORBED: f64 = 1e-10;
/// The time of a phase has this relative accuracy, unless its parts have been halved `DEPTH` times, which happens next to rest.
const QUADRATURE: f64 = 1e-12;
const DEPTH: u32 = 12;
/// A cubic becomes a phase of constant jerk if the rounding of v² would change its jerk by more than this fraction of the limit,
/// and if its jerk changes along the phase by no more than `NOISE` times this rounding.
const SHOWN: f64 = 1e-7;
const NOISE: f64 = 8.0;

impl JerkProfile {
    /// Appends a profile of the jerk-limited planner on a part of a subrun.
    ///
    /// Arc lengths far along a path, and parameters next to rest, have too great rounding errors for short phases: an error of a
    /// phase's length shows some hundred times as much in w''. The lengths of phases are therefore measured between the rounded
    /// parameters, and each state is moved along the profile to the end of its phase. These moves add up from both ends of the
    /// profile; the longest phase, in which they show least, absorbs their difference.
    pub fn push_profile<const M: usize>(
        &mut self,
        path: &ArcLengthPath<M>,
        jerk_limits: &[f64; M],
        profile: &Profile,
    ) {
        let ways = ways_between(path, &profile.s);
        let ramp_ways = [0, 1].map(|end| Way::of_ramp(path, profile, end));
        let (mut states, meeting, off) = moved_states(profile, &ways, &ramp_ways);
        let ramps = [0, 1].map(|end| {
            movement_on_ramp(profile, end, ramp_ways[end].as_ref(), &mut states[[0, ways.len()][end]])
        });
        self.push_ramp(path, &ramp_ways[0], &ramps[0]);
        for (n, way) in ways.iter().enumerate() {
            path.problem.watch.check_at(n);
            let off = if n == meeting { off } else { 0.0 };
            let ends = [states[n], states[n + 1]];
            let movement = movement_between(path, jerk_limits, way.part, (way.length, off), ends);
            self.push(path, way.part, way.u, &movement);
        }
        self.push_ramp(path, &ramp_ways[1], &ramps[1]);
    }

    fn push_ramp<const M: usize>(
        &mut self,
        path: &ArcLengthPath<M>,
        way: &Option<Way>,
        ramp: &Option<Movement>,
    ) {
        match (ramp, way) {
            (Some(ramp), Some(way)) => self.push(path, way.part, way.u, ramp),
            (Some(ramp), None) => self.push_jerk(path, ramp.ends, ramp.value, ramp.duration),
            (None, _) => {}
        }
    }
}

/// A range of one part: its parameters, and the length between them in mm.
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

    /// The range of the ramp at an end of a profile, if there is a ramp and it lies within one part.
    fn of_ramp<const M: usize>(path: &ArcLengthPath<M>, profile: &Profile, end: usize) -> Option<Self> {
        let (s, ends) = (&profile.s, profile.ends);
        let ways = [[ends[0], s[0]], [s[s.len() - 1], ends[1]]];
        let (way, part) = (ways[end], [0, path.parts.len() - 1][end]);
        (way[0] < way[1] && path.part(way[1 - end]) == part).then(|| Self::new(path, part, way))
    }
}

/// The ranges between neighbouring stations; all knots between them are stations.
fn ways_between<const M: usize>(path: &ArcLengthPath<M>, s: &[f64]) -> Vec<Way> {
    let (knots, mut part) = (path.knots(), path.part(s[0]));
    let mut ways: Vec<Way> = Vec::with_capacity(s.len() - 1);
    for ends in s.windows(2) {
        path.problem.watch.check_at(ways.len());
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

/// The motion on the ramp at an end of a profile, if it has one: from rest to the state there, or from the state to rest.
///
/// The acceleration of the state is set to that of the ramp. It differs by rounding from that of the profile, which belongs to
/// the length before rounding.
fn movement_on_ramp(profile: &Profile, end: usize, way: Option<&Way>, state: &mut State) -> Option<Movement> {
    let ramp = profile.ramp(end);
    if ramp.length <= 0.0 {
        return None;
    }
    // At constant jerk, s = J t³/6 and v = J t²/2, so that t = 3 s/v; at constant acceleration t = 2 s/v.
    let ramp = Ramp { length: way.map_or(ramp.length, |way| way.length), ..ramp };
    let (v, duration) = (state.v, ramp.way() / state.v);
    let (jerk, [from_rest, to_speed]) = if ramp.power == Ramp::ACCELERATION {
        (0.0, [v / duration; 2])
    } else {
        let jerk = 2.0 * v / (duration * duration);
        (jerk, [0.0, jerk * duration])
    };
    let sign = [1.0, -1.0][end];
    state.a = sign * to_speed;
    let rest = State { s: profile.ends[end], v: 0.0, a: sign * from_rest };
    let ends = if end == 0 { [rest, *state] } else { [*state, rest] };
    Some(Movement { law: PhaseLaw::PathJerk, value: jerk, ends, duration })
}

/// Returns the states at the stations, moved to the positions that follow from the lengths of `ways`, from both ends of the
/// profile; the index of the longest range, within which the moves from both ends meet; and the error of its length, in mm.
fn moved_states(profile: &Profile, ways: &[Way], ramp_ways: &[Option<Way>; 2]) -> (Vec<State>, usize, f64) {
    let (s, last) = (&profile.s, ways.len());
    let meeting = (0..last).fold(0, |most, n| if ways[n].length > ways[most].length { n } else { most });
    // The quadrature error of long phases must not move the states in turns that are shorter than this error.
    let added = |miss: f64, way: &Way, length: f64| {
        let miss = miss + (way.length - length);
        miss - miss.clamp(-ABSORBED * way.length, ABSORBED * way.length)
    };
    let mut moved = vec![0.0; last + 1];
    let at_end =
        |end: usize| ramp_ways[end].as_ref().map_or(0.0, |way| added(0.0, way, profile.ramp(end).length));
    moved[0] = at_end(0);
    for n in 0..meeting {
        moved[n + 1] = added(moved[n], &ways[n], s[n + 1] - s[n]);
    }
    moved[last] = -at_end(1);
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

/// The movement between two states at the distance h on a part, where h has the error `off`, both in mm.
///
/// The cubic v² is given by its values at both ends. Their rounding ε v² and the error e of h change the jerk by 3 v (ε v² + 2
/// |a| e)/h²: more than the limit on a phase of a nanometre. Such a phase gets a constant jerk from the accelerations at both
/// ends: over so short a length the jerk changes only by rounding.
/// |a| e)/h², which is more than the limit on a phase of a nanometre. Such a phase gets a constant jerk from the accelerations at
/// both ends: over so short a length the jerk changes only by rounding.
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

/// The integral by Gauss's rule of eight points, with halved ranges until both halves together equal the whole to `QUADRATURE`.
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
