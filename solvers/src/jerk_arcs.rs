//! Profiles of limited jerk as columns: arcs along the pieces of a path, in the order of the path.
//!
//! Two kinds, of `feedplan.profile.ArcKind`: the jerk along the path is constant, or v² is a cubic of the length. What
//! goes over several pieces is cut where they meet: both kinds stay what they are.

use crate::bang_bang::Problem;
use crate::by_length::{speed_sq, ByLength};
use crate::jerk_limited::{Geometry, Profile};
use crate::s_curve::Section;

const PATH_JERK: u8 = 6;
const SPEED_CUBIC: u8 = 7;
/// Gauss–Legendre nodes and weights on [−1, 1] for times.
const X: [f64; 4] =
    [0.183_434_642_495_649_8, 0.525_532_409_916_329, 0.796_666_477_413_626_7, 0.960_289_856_497_536_3];
const W: [f64; 4] =
    [0.362_683_783_378_362, 0.313_706_645_877_887_3, 0.222_381_034_453_374_5, 0.101_228_536_290_376_3];
/// Halvings for the time at which a section of constant jerk passes a place.
const HALVINGS: usize = 200;

/// Columns of arcs; see `feedplan.profile.SpeedProfile`.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Arcs {
    pub piece: Vec<u32>,
    pub kind: Vec<u8>,
    pub value: Vec<f64>,
    pub u0: Vec<f64>,
    pub u1: Vec<f64>,
    pub p0: Vec<f64>,
    pub p1: Vec<f64>,
    pub duration: Vec<f64>,
    pub a0: Vec<f64>,
    pub a1: Vec<f64>,
    /// Offsets of the runs in the arcs.
    pub runs: Vec<i64>,
    /// Pieces at whose start a jump of curvature holds the speed.
    pub kinks: Vec<u32>,
    left_out: f64,
}

/// Length along a stretch, speed and acceleration.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct State {
    pub s: f64,
    pub v: f64,
    pub a: f64,
}

impl State {
    /// After a time with a jerk.
    pub fn after(&self, t: f64, jerk: f64) -> Self {
        let Self { s, v, a } = *self;
        Self {
            s: s + t * (v + t * (0.5 * a + t * jerk / 6.0)),
            v: (v + t * (a + 0.5 * t * jerk)).max(0.0),
            a: a + t * jerk,
        }
    }
}

/// One arc on a part of a stretch.
struct Arc {
    kind: u8,
    value: f64,
    ends: [State; 2],
    duration: f64,
}

impl Arcs {
    /// Number of arcs.
    pub fn len(&self) -> usize {
        self.piece.len()
    }

    pub fn is_empty(&self) -> bool {
        self.piece.is_empty()
    }

    /// The time of all arcs, in seconds.
    pub fn time(&self) -> f64 {
        self.duration.iter().sum()
    }

    /// Appends the arcs of another profile; `runs` stays as it is.
    pub fn append(&mut self, mut other: Self) {
        self.piece.append(&mut other.piece);
        self.kind.append(&mut other.kind);
        self.value.append(&mut other.value);
        self.u0.append(&mut other.u0);
        self.u1.append(&mut other.u1);
        self.p0.append(&mut other.p0);
        self.p1.append(&mut other.p1);
        self.duration.append(&mut other.duration);
        self.a0.append(&mut other.a0);
        self.a1.append(&mut other.a1);
        self.kinks.append(&mut other.kinks);
    }

    /// An arc too short for u to show it is left out, its time goes to its neighbour.
    fn push<const M: usize>(&mut self, problem: &Problem<M>, path: &ByLength<M>, part: usize, arc: &Arc) {
        let at = path.parts[part];
        let last = self.len().wrapping_sub(1);
        let knots = path.knots();
        let goes_on = last < self.len() && arc.ends[0].s > knots[part];
        let u0 = if goes_on { self.u1[last] } else { at.u[0] };
        let u1 = path.locate(part, arc.ends[1].s);
        let speed = |u: f64, v: f64| if v == 0.0 { 0.0 } else { v * v / speed_sq(problem, at.piece, u) };
        if u1 <= u0 {
            if goes_on {
                self.duration[last] += arc.duration;
                self.p1[last] = speed(u0, arc.ends[1].v);
                self.a1[last] = arc.ends[1].a;
            } else {
                self.left_out += arc.duration;
            }
            return;
        }
        self.piece.push(at.piece as u32);
        self.kind.push(arc.kind);
        self.value.push(arc.value);
        self.u0.push(u0);
        self.u1.push(u1);
        self.p0.push(speed(u0, arc.ends[0].v));
        self.p1.push(speed(u1, arc.ends[1].v));
        self.duration.push(arc.duration + std::mem::take(&mut self.left_out));
        self.a0.push(arc.ends[0].a);
        self.a1.push(arc.ends[1].a);
    }

    /// Appends a section of constant jerk that ends as given; `duration` in s.
    pub fn push_jerk<const M: usize>(
        &mut self,
        problem: &Problem<M>,
        path: &ByLength<M>,
        [from, to]: [State; 2],
        jerk: f64,
        duration: f64,
    ) {
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
            self.push(problem, path, part, &Arc { kind: PATH_JERK, value: jerk, ends: [start, end], duration: high });
            (start, left) = (end, left - high);
            part += 1;
        }
        let arc = Arc { kind: PATH_JERK, value: jerk, ends: [start, to], duration: left };
        self.push(problem, path, part, &arc);
    }

    /// Appends sections of constant jerk from rest to rest along a whole stretch.
    pub fn push_sections<const M: usize>(
        &mut self,
        problem: &Problem<M>,
        path: &ByLength<M>,
        sections: &[Section],
    ) {
        for (i, section) in sections.iter().enumerate() {
            let from = State { s: section.position, v: section.speed, a: section.acceleration };
            let to = match sections.get(i + 1) {
                Some(next) => State { s: next.position, v: next.speed, a: next.acceleration },
                None => State { s: path.total(), v: 0.0, a: 0.0 },
            };
            self.push_jerk(problem, path, [from, to], section.jerk, section.duration);
        }
    }

    /// Appends a profile of the jerk-limited planner along a whole stretch.
    pub fn push_profile<const M: usize>(&mut self, problem: &Problem<M>, path: &ByLength<M>, profile: &Profile) {
        let state =
            |n: usize| State { s: profile.s[n], v: profile.speed_sq[n].sqrt(), a: 0.5 * profile.slope[n] };
        let last = profile.s.len() - 1;
        let (first, end) = (state(0), state(last));
        // On a ramp s = J t³/6 and v = J t²/2, so that t = 3 s/v.
        let rest = |s: f64| State { s, v: 0.0, a: 0.0 };
        let ramp = |length: f64, v: f64| {
            let t = 3.0 * length / v;
            (2.0 * v / (t * t), t)
        };
        if first.s > profile.ends[0] {
            let (jerk, t) = ramp(first.s - profile.ends[0], first.v);
            self.push_jerk(problem, path, [rest(profile.ends[0]), first], jerk, t);
        }
        let mut part = path.part(first.s);
        for n in 0..last {
            let ends = [state(n), state(n + 1)];
            while path.knots()[part + 1] <= ends[0].s && part + 1 < path.parts.len() {
                part += 1;
            }
            let duration = cubic_time(&ends);
            self.push(problem, path, part, &Arc { kind: SPEED_CUBIC, value: 0.0, ends, duration });
        }
        if end.s < profile.ends[1] {
            let (jerk, t) = ramp(profile.ends[1] - end.s, end.v);
            self.push_jerk(problem, path, [end, rest(profile.ends[1])], jerk, t);
        }
    }
}

/// ∫ ds/√w of the cubic w between two states.
pub fn cubic_time([from, to]: &[State; 2]) -> f64 {
    let h = to.s - from.s;
    let (w0, w1) = (from.v * from.v, to.v * to.v);
    let (d0, d1) = (2.0 * from.a * h, 2.0 * to.a * h);
    let speed = |t: f64| {
        let r = 1.0 - t;
        (r * r * ((1.0 + 2.0 * t) * w0 + t * d0) + t * t * ((1.0 + 2.0 * r) * w1 - r * d1)).sqrt()
    };
    let half = |middle: f64| -> f64 {
        (0..4)
            .map(|i| W[i] * (1.0 / speed(middle - 0.25 * X[i]) + 1.0 / speed(middle + 0.25 * X[i])))
            .sum()
    };
    0.25 * h * (half(0.25) + half(0.75))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_cubic_of_constant_acceleration_takes_its_change_of_speed() {
        // 10 to 30 mm/s at 200 mm/s²: 2 mm, 0.1 s.
        let ends = [State { s: 1.0, v: 10.0, a: 200.0 }, State { s: 3.0, v: 30.0, a: 200.0 }];
        assert!((cubic_time(&ends) - 0.1).abs() < 1e-9, "{}", cubic_time(&ends));
    }
}
