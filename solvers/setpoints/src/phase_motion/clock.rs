//! Speed along the measure of a phase, and the share of the measure that is done, at a time, by the law of the phase: in closed
//! form at constant acceleration, by polynomials of time at constant jerk, by a table of times where v² is linear in u. In
//! `cubic`, v² is a cubic of the length.
//!
//! Shares are counted from the end of the phase that is nearer in time, for the displacement of an axis from the end with the
//! smaller |q'_k|, and in `cubic` from the slower end, so that no digits are lost next to rest.

pub mod cubic;

use super::lengths::{fill, PiecePath, SLOW};
use super::pace::{time_of_way, Pace};
use super::part::Part;
use super::rate::{FromRest, Line, Rate};
pub use cubic::Cubic;
use feedplan_geometry::arc_length::{Integrand, Node, Table};
use feedplan_geometry::inverse_length::{self, Located};
use feedplan_planner::phase_law::PhaseLaw;
use feedplan_planner::phases::Phase;

/// A negative speed counts as rounding down to this share of the speeds and speed changes at the ends.
const BACKWARDS: f64 = 1e-9;

/// v along the measure as a function of time.
pub enum Clock {
    Even(Even),
    Jerk(Jerk),
    Cubic(Box<Cubic>),
    Line(Box<SpeedLine>),
}

/// v linear in time, given by its values at both ends; v² is linear in the measure.
pub struct Even {
    pub v: [f64; 2],
    pub a: f64,
}

impl Even {
    pub fn constant(v: f64) -> Self {
        Self { v: [v; 2], a: 0.0 }
    }

    /// The share of the measure after the share `done` of the duration, with the share `left` still to go, counted from the start
    /// or the end.
    pub fn part(&self, from_start: bool, done: f64, left: f64) -> Part {
        let [v0, v1] = self.v;
        let v = v0 * left + v1 * done;
        let share = if from_start { done * (v0 + v) } else { left * (v1 + v) };
        Part { from_start, share: (share / (v0 + v1)).clamp(0.0, 1.0) }
    }

    pub fn pace(&self, done: f64, left: f64, t: f64) -> Pace {
        Pace { t, v: self.v[0] * left + self.v[1] * done, a: self.a, j: 0.0 }
    }

    pub fn at_part(&self, part: Part, duration: f64) -> Pace {
        let side = usize::from(!part.from_start);
        let (near, far) = (self.v[side], self.v[1 - side]);
        let v = (near * near + part.share * (far - near) * (far + near)).max(0.0).sqrt();
        let passed = part.share * (near + far) / (near + v);
        // 0/0 at rest, which is only at an end.
        let passed = if passed.is_nan() { 0.0 } else { passed.clamp(0.0, 1.0) };
        Pace { t: duration * if side == 0 { passed } else { 1.0 - passed }, v, a: self.a, j: 0.0 }
    }
}

/// v, a and j at one end of a phase, counted away from it: from the end of the phase, time runs backwards.
#[derive(Clone, Copy)]
struct End {
    v: f64,
    a: f64,
    j: f64,
}

impl End {
    fn way(&self, t: f64) -> f64 {
        t * (self.v + t * (0.5 * self.a + t * self.j / 6.0))
    }

    fn speed(&self, t: f64) -> f64 {
        self.v + t * (self.a + t * 0.5 * self.j)
    }

    /// The time in [0, `most`], within which the motion does not turn back, after which the distance `way` is done.
    fn time(&self, way: f64, most: f64) -> f64 {
        // If all terms are positive, this is not before the sought time, and Newton's method converges from above.
        let alone = |term: f64, time: f64| if term > 0.0 { time } else { f64::INFINITY };
        let guess = alone(self.v, way / self.v)
            .min(alone(self.a, (2.0 * way / self.a).sqrt()))
            .min(alone(self.j, (6.0 * way / self.j).cbrt()));
        time_of_way(|t| [self.way(t), self.speed(t)], way, [guess.min(most), most], 0.0)
    }
}

/// Constant jerk along the path: v, a and the distance are polynomials of time.
pub struct Jerk {
    ends: [End; 2],
    duration: f64,
    /// Distances in the first and in the second half of the duration.
    ways: [f64; 2],
}

impl Jerk {
    pub fn new(phase: &Phase, speeds: [f64; 2]) -> Self {
        let (t, j) = (phase.duration, phase.value);
        let ends = [End { v: speeds[0], a: phase.a0, j }, End { v: speeds[1], a: -phase.a1, j }];
        Self { ends, duration: t, ways: ends.map(|end| end.way(0.5 * t)) }
    }

    /// The end that is nearer in time (0 or 1), and the time from it.
    fn nearer(&self, done: f64, left: f64) -> (usize, f64) {
        if done <= 0.5 {
            (0, done * self.duration)
        } else {
            (1, left * self.duration)
        }
    }

    pub fn part(&self, done: f64, left: f64) -> Part {
        let (end, t) = self.nearer(done, left);
        Part { from_start: end == 0, share: self.ends[end].way(t) / (self.ways[0] + self.ways[1]) }
    }

    pub fn pace(&self, done: f64, left: f64) -> Pace {
        let (end, t) = self.nearer(done, left);
        self.counted_from(end, t)
    }

    fn counted_from(&self, end: usize, t: f64) -> Pace {
        let End { a, j, .. } = self.ends[end];
        let v = self.ends[end].speed(t);
        if end == 0 {
            Pace { t, v, a: a + j * t, j }
        } else {
            Pace { t: self.duration - t, v, a: -(a + j * t), j }
        }
    }

    pub fn at_part(&self, part: Part) -> Pace {
        let total = self.ways[0] + self.ways[1];
        let way = total * if part.from_start { part.share } else { 1.0 - part.share };
        if way <= self.ways[0] {
            self.counted_from(0, self.ends[0].time(way, 0.5 * self.duration))
        } else {
            let way = total * if part.from_start { 1.0 - part.share } else { part.share };
            self.counted_from(1, self.ends[1].time(way, 0.5 * self.duration))
        }
    }

    /// Why the phase cannot be followed; None if it can.
    pub fn flaw(&self) -> Option<&'static str> {
        let (t, start) = (self.duration, &self.ends[0]);
        if t <= 0.0 {
            return Some("moves at constant jerk for no time");
        }
        let slowest = (-start.a / start.j).clamp(0.0, t);
        let slowest = if slowest.is_nan() { 0.0 } else { slowest };
        let scale = start.v.abs() + self.ends[1].v.abs() + t * (start.a.abs() + self.ends[1].a.abs());
        let forward =
            [start.speed(slowest), start.v, self.ends[1].v].iter().all(|&v| v >= -BACKWARDS * scale);
        (!(forward && self.ways[0] + self.ways[1] > 0.0)).then_some("moves backwards")
    }
}

/// v² linear in u; the time is a table over u or, from rest, over the square root of the distance in u from there.
pub struct SpeedLine {
    law: PhaseLaw,
    line: Line,
    /// The end at rest, where the path has a direction there (C' is not 0), and the sign of u away from it.
    rest: Option<(f64, f64)>,
    times: Vec<Node>,
    time_error: f64,
}

impl SpeedLine {
    pub fn new<const M: usize>(path: &PiecePath<M>, phase: &Phase, speeds: [f64; 2]) -> Self {
        let [from, to] = speeds.map(|v| v * v);
        let (u0, u1) = (phase.u0, phase.u1);
        let line = Line { start: from, slope: (to - from) / (u1 - u0), u0 };
        let moves = |u: f64| path.square(phase.law, u) > SLOW * path.square(phase.law, 0.5 * (u0 + u1));
        let rest = match (phase.p0 == 0.0, phase.p1 == 0.0) {
            (true, false) if moves(u0) => Some((u0, 1.0)),
            (false, true) if moves(u1) => Some((u1, -1.0)),
            _ => None,
        };
        let mut made = Self { law: phase.law, line, rest, times: vec![], time_error: 0.0 };
        let rate = path.bounded(phase.law, line);
        (made.times, made.time_error) = match made.time_from_rest(&rate) {
            Some(f) => fill(f, (0.0, (u1 - u0).sqrt())),
            None => fill(rate, (u0, u1)),
        };
        made
    }

    fn time_from_rest<'a, const M: usize>(&self, rate: &Rate<'a, M>) -> Option<FromRest<'a, M>> {
        let (source, slope) = (rate.source, self.line.slope.abs());
        self.rest.map(|(place, sign)| FromRest { source, place, sign, slope })
    }

    /// The place after the share `done` of the duration, with the share `left` still to go; `error` is the allowed error as a
    /// share of the duration.
    pub fn place<const M: usize>(&self, path: &PiecePath<M>, done: f64, left: f64, error: f64) -> Located {
        let rate = path.rate(self.law, self.line);
        match self.time_from_rest(&rate) {
            Some(f) => {
                let found = self.invert(f, if f.sign > 0.0 { done } else { left }, error);
                Located { u: f.u(found.u), ..found }
            }
            None => self.invert(rate, done, error),
        }
    }

    fn invert<F: Integrand>(&self, f: F, part: f64, error: f64) -> Located {
        let table = Table { f, nodes: &self.times };
        let total = table.total();
        let tolerance = (error * total).max(table.rounding());
        let found = inverse_length::locate(&table, part * total, tolerance, &[], f64::INFINITY);
        Located { miss: (found.miss + self.time_error) / total, ..found }
    }

    /// The share of the duration that has passed at u.
    pub fn done<const M: usize>(&self, path: &PiecePath<M>, u: f64) -> f64 {
        let rate = path.rate(self.law, self.line);
        match self.time_from_rest(&rate) {
            Some(f) => {
                let table = Table { f, nodes: &self.times };
                let done = table.integral((u - f.place).abs().sqrt()) / table.total();
                if f.sign > 0.0 {
                    done
                } else {
                    1.0 - done
                }
            }
            None => {
                let table = Table { f: rate, nodes: &self.times };
                table.integral(u) / table.total()
            }
        }
    }

    /// The motion at u at time t. a and j are those at the place `at`, where the length per u is g and its derivative is dg.
    pub fn pace(&self, u: f64, at: f64, g: f64, dg: f64, t: f64) -> Pace {
        // a = v dv/ds with ds = g du.
        let a = 0.5 * self.line.slope / g;
        Pace { t, v: self.line.at(u).sqrt(), a, j: -a * dg / g * self.line.at(at).sqrt() / g }
    }
}
