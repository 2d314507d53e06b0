//! Speed along the measure of a phase, and the part of the measure that is done, at a time.
//!
//! Parts are counted from the end of the phase that is nearer in time, so that nothing is lost next to rest.

use super::lengths::{fill, PiecePath, ERROR, SLOW};
use super::part::Part;
use super::rate::{FromRest, Line};
use feedplan_geometry::arc_length::{Integrand, Node, Table};
use feedplan_geometry::inverse_length::{self, Located};
use feedplan_planner::phase_law::PhaseLaw;
use feedplan_planner::phases::Phase;

/// A speed below 0 is rounding where it is this part of what speed and acceleration at the ends make of it.
const BACKWARDS: f64 = 1e-9;
/// Halvings of the bracket and steps of Newton's method end before this.
const MAX_ROUNDS: u32 = 200;
/// Terms of a series of the length by time; it ends where two of them are no more than this part of the length.
const MOST_TERMS: usize = 18;
const NOTHING: f64 = 1e-18;
/// 1/((k + 1)(k + 2)): what the term k of ẍ is in that of x.
const PER_TERM: [f64; MOST_TERMS] = {
    let (mut per, mut k) = ([0.0; MOST_TERMS], 0);
    while k < MOST_TERMS {
        per[k] = 1.0 / ((k + 1) * (k + 2)) as f64;
        k += 1;
    }
    per
};
/// A series may end so far beyond the length, in parts of it: where the duration is that of the motion but for rounding.
const OVER: f64 = 1e-3;
/// Series are no shorter than this part of the duration, and no more than so many: speeds that are absurd have more.
const SHORTEST: f64 = 1e-12;
const MOST_PARTS: usize = 10_000;

/// Time from the start of the phase, and speed, acceleration and jerk along its measure.
#[derive(Clone, Copy, Debug, Default)]
pub struct Pace {
    pub t: f64,
    pub v: f64,
    pub a: f64,
    pub j: f64,
}

/// v along the measure by time.
pub enum Clock {
    Even(Even),
    Jerk(Jerk),
    Cubic(Box<Cubic>),
    Line(Box<SpeedLine>),
}

/// v linear in time, from one end to the other: v² is linear in the measure.
pub struct Even {
    pub v: [f64; 2],
    pub a: f64,
}

impl Even {
    pub fn constant(v: f64) -> Self {
        Self { v: [v; 2], a: 0.0 }
    }

    /// The part of the measure when these parts of the duration are done and left, counted from an end.
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

/// v, a and j at one end, counted away from it: time runs back from the end of a phase.
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

    /// The time up to `most` after which a way is done, on which the motion does not turn back.
    fn time(&self, way: f64, most: f64) -> f64 {
        // Where all terms are positive this is beyond the time, and Newton's method comes down to it.
        let alone = |term: f64, time: f64| if term > 0.0 { time } else { f64::INFINITY };
        let guess = alone(self.v, way / self.v)
            .min(alone(self.a, (2.0 * way / self.a).sqrt()))
            .min(alone(self.j, (6.0 * way / self.j).cbrt()));
        let (mut low, mut high, mut t) = (0.0, most, guess.min(most));
        for _ in 0..MAX_ROUNDS {
            let miss = self.way(t) - way;
            if miss > 0.0 {
                high = t;
            } else {
                low = t;
            }
            let next = t - miss / self.speed(t);
            let next = if low <= next && next <= high { next } else { 0.5 * (low + high) };
            if next == t || low >= high {
                break;
            }
            t = next;
        }
        t
    }
}

/// Constant jerk along the path: v, a and the way are polynomials of time.
pub struct Jerk {
    ends: [End; 2],
    duration: f64,
    /// Ways of the two halves of the duration.
    ways: [f64; 2],
}

impl Jerk {
    pub fn new(phase: &Phase, speeds: [f64; 2]) -> Self {
        let (t, j) = (phase.duration, phase.value);
        let ends = [End { v: speeds[0], a: phase.a0, j }, End { v: speeds[1], a: -phase.a1, j }];
        Self { ends, duration: t, ways: ends.map(|end| end.way(0.5 * t)) }
    }

    /// The end that is nearer in time, and the time from there.
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

    /// Why nothing can follow it.
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

/// v² a cubic polynomial of the length, never 0: the part x of the length, from the slower end, as power series of the time.
///
/// From (v²)' = 2 ẍ follows ẍ = P(x) with a quadratic P, whose series come term by term (Taylor's method for differential equations).
pub struct Cubic {
    speed_sq: SpeedSq,
    /// The slower end is the start.
    from_start: bool,
    parts: Vec<Series>,
    /// The time of all the length, in the unit of the series.
    total: f64,
    error: f64,
}

impl Cubic {
    pub fn new(phase: &Phase, speeds: [f64; 2], length: f64) -> Self {
        let (from_start, speed_sq) = (speeds[0] <= speeds[1], SpeedSq::new(phase, speeds, length));
        // Time runs back from the end.
        let back = || SpeedSq::between([speeds[1], speeds[0]], [-phase.a1, -phase.a0], length);
        let own = if from_start { speed_sq } else { back() };
        let unit = if phase.duration > 0.0 { phase.duration } else { 2.0 * length / (speeds[0] + speeds[1]) };
        let (mut parts, mut x, mut time, mut width, mut error) = (Vec::new(), 0.0, 0.0, 1.0, 0.0);
        loop {
            let series = Series::new(&own, time, x, width, unit / length);
            let [end, slope] = series.at(1.0);
            let fails = series.error > ERROR || slope <= 0.0 || end > 1.0 + OVER;
            if fails && width > SHORTEST {
                width *= 0.5;
                continue;
            }
            error += series.error;
            parts.push(series);
            if end >= 1.0 - OVER || end.is_nan() || parts.len() == MOST_PARTS {
                break;
            }
            (time, x, width) = (time + width, end, 2.0 * width);
        }
        let last = &parts[parts.len() - 1];
        let total = last.from + last.width * last.time(1.0);
        Self { speed_sq, from_start, parts, total, error }
    }

    /// Why nothing can follow a phase.
    pub fn flaw(phase: &Phase, speeds: [f64; 2], length: f64) -> Option<&'static str> {
        let moves = SpeedSq::new(phase, speeds, length).is_positive();
        (!moves).then_some("loses all its speed on the way")
    }

    /// The part of the length when these parts of the duration are done and left, and its error.
    pub fn part(&self, done: f64, left: f64) -> (Part, f64) {
        let time = self.total * if self.from_start { done } else { left };
        let number = self.parts[1..].partition_point(|part| part.from <= time);
        let series = &self.parts[number];
        let [share, _] = series.at((time - series.from) / series.width);
        (Part { from_start: self.from_start, share: share.clamp(0.0, 1.0) }, self.error)
    }

    /// The motion at a part of the length, t seconds after the start.
    pub fn pace(&self, part: Part, t: f64) -> Pace {
        let x = if part.from_start { part.share } else { 1.0 - part.share };
        let (length, [w, slope, bend]) = (self.speed_sq.length, self.speed_sq.derivatives(x));
        let v = w.sqrt();
        Pace { t, v, a: 0.5 * slope / length, j: 0.5 * v * bend / (length * length) }
    }

    pub fn at_part(&self, part: Part, duration: f64) -> Pace {
        let x = if part.from_start == self.from_start { part.share } else { 1.0 - part.share };
        let number = self.parts[1..].partition_point(|part| part.x <= x);
        let series = &self.parts[number];
        let passed = (series.from + series.width * series.time(x)) / self.total;
        let passed = passed.clamp(0.0, 1.0);
        self.pace(part, duration * if self.from_start { passed } else { 1.0 - passed })
    }
}

/// v² over the part x of the way in powers of x.
#[derive(Clone, Copy, Debug)]
struct SpeedSq {
    c: [f64; 4],
    length: f64,
}

impl SpeedSq {
    fn new(phase: &Phase, speeds: [f64; 2], length: f64) -> Self {
        Self::between(speeds, [phase.a0, phase.a1], length)
    }

    /// From v and a at both ends.
    fn between(speeds: [f64; 2], a: [f64; 2], length: f64) -> Self {
        let ([w0, w1], [slope0, slope1]) = (speeds.map(|v| v * v), a.map(|a| 2.0 * a * length));
        let rise = w1 - w0;
        Self { c: [w0, slope0, 3.0 * rise - 2.0 * slope0 - slope1, slope0 + slope1 - 2.0 * rise], length }
    }

    fn derivatives(&self, x: f64) -> [f64; 3] {
        let [c0, c1, c2, c3] = self.c;
        [c0 + x * (c1 + x * (c2 + x * c3)), c1 + x * (2.0 * c2 + x * 3.0 * c3), 2.0 * c2 + 6.0 * x * c3]
    }

    /// Whether v² is above 0 all the way.
    fn is_positive(&self) -> bool {
        let [_, c1, c2, c3] = self.c;
        // Where 3 c3 x² + 2 c2 x + c1 vanishes, without cancellation.
        let root = (c2 * c2 - 3.0 * c1 * c3).max(0.0).sqrt();
        let q = -(c2 + root.copysign(c2));
        [0.0, 1.0, q / (3.0 * c3), c1 / q]
            .iter()
            .filter(|x| (0.0..=1.0).contains(*x))
            .all(|&x| self.derivatives(x)[0] > 0.0)
    }
}

/// The part of the length over a time, in powers of the part of that.
struct Series {
    /// When it begins and how long it lasts, in parts of some unit.
    from: f64,
    width: f64,
    /// The part of the length at its start, and what is added to that.
    x: f64,
    terms: [f64; MOST_TERMS],
    count: usize,
    /// Proven bound of what the terms left out add.
    error: f64,
}

impl Series {
    /// `per` is the unit of time over the length.
    fn new(speed_sq: &SpeedSq, from: f64, x: f64, width: f64, per: f64) -> Self {
        let [w, slope, bend] = speed_sq.derivatives(x);
        let scale = width * per;
        let half = 0.5 * scale * scale;
        // ẍ = p0 + p1 x + p2 x² about the start.
        let [p0, p1, p2] = [half * slope, half * bend, half * 3.0 * speed_sq.c[3]];
        let mut terms = [0.0; MOST_TERMS];
        (terms[1], terms[2]) = (scale * w.sqrt(), 0.5 * p0);
        let mut count = 3;
        while count < MOST_TERMS && terms[count - 1].abs() + terms[count - 2].abs() > NOTHING {
            let k = count - 2;
            let square: f64 = (1..k).map(|i| terms[i] * terms[k - i]).sum();
            terms[count] = (p1 * terms[k] + p2 * square) * PER_TERM[k];
            count += 1;
        }
        // The series misses the equation by the terms of P from the power `count` − 2 on. With a slope of P of no more than 1 an error
        // of ẍ grows to cosh(1)/2 of itself at most.
        let mut rest = [0.0; MOST_TERMS + 1];
        for k in (0..count).rev() {
            rest[k] = rest[k + 1] + terms[k].abs();
        }
        let square: f64 = (1..count).map(|i| terms[i].abs() * rest[(count - 2).saturating_sub(i)]).sum();
        let missed = p1.abs() * rest[count - 2] + p2.abs() * square;
        let is_gentle = p1.abs() + 2.0 * p2.abs() * rest[0] <= 1.0;
        Self { from, width, x, terms, count, error: if is_gentle { missed } else { f64::INFINITY } }
    }

    /// The part of the length at a part of the time, and its derivative.
    #[inline]
    fn at(&self, s: f64) -> [f64; 2] {
        let (mut way, mut slope) = (0.0, 0.0);
        for term in self.terms[..self.count].iter().rev() {
            slope = slope * s + way;
            way = way * s + term;
        }
        [self.x + way, slope]
    }

    /// The part of the time at a part of the length, at the end or before.
    fn time(&self, x: f64) -> f64 {
        let (mut low, mut high, mut s) = (0.0, 2.0, 1.0);
        for _ in 0..MAX_ROUNDS {
            let [here, slope] = self.at(s);
            if here > x {
                high = s;
            } else {
                low = s;
            }
            let next = s - (here - x) / slope;
            let next = if low <= next && next <= high { next } else { 0.5 * (low + high) };
            let last = (next - s).abs() <= f64::EPSILON * 4.0 || low >= high;
            s = next;
            if last {
                break;
            }
        }
        s
    }
}

/// v² linear in u; the time is a table over u, or over the root of the way of u from rest.
pub struct SpeedLine {
    law: PhaseLaw,
    line: Line,
    /// The end at rest on a path with a direction there, and the sign of u away from it.
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
        let mut times = vec![];
        made.time_error = match made.time_from_rest(path) {
            Some(f) => fill(f, (0.0, (u1 - u0).sqrt()), &mut times),
            None => fill(path.rate(phase.law, line), (u0, u1), &mut times),
        };
        Self { times, ..made }
    }

    fn time_from_rest<'a, const M: usize>(&self, path: &'a PiecePath<M>) -> Option<FromRest<'a, M>> {
        self.rest.map(|(place, sign)| FromRest {
            source: path.rate(self.law, self.line).source,
            place,
            sign,
            slope: self.line.slope.abs(),
        })
    }

    /// The place when these parts of the duration are done and left, within an error in parts of the duration.
    pub fn place<const M: usize>(&self, path: &PiecePath<M>, done: f64, left: f64, error: f64) -> Located {
        match self.time_from_rest(path) {
            Some(f) => {
                let found = self.invert(f, if f.sign > 0.0 { done } else { left }, error);
                Located { u: f.u(found.u), ..found }
            }
            None => self.invert(path.rate(self.law, self.line), done, error),
        }
    }

    fn invert<F: Integrand>(&self, f: F, part: f64, error: f64) -> Located {
        let table = Table { f, nodes: &self.times };
        let total = table.total();
        let found = inverse_length::locate(&table, part * total, (error * total).max(table.rounding()));
        Located { miss: (found.miss + self.time_error) / total, ..found }
    }

    /// The part of the duration that has passed at u.
    pub fn done<const M: usize>(&self, path: &PiecePath<M>, u: f64) -> f64 {
        match self.time_from_rest(path) {
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
                let table = Table { f: path.rate(self.law, self.line), nodes: &self.times };
                table.integral(u) / table.total()
            }
        }
    }

    /// The motion at u; a and j at the place `at`, whose length per u is g, with the slope dg.
    pub fn pace(&self, u: f64, at: f64, g: f64, dg: f64, t: f64) -> Pace {
        // a = v dv/ds with ds = g du.
        let a = 0.5 * self.line.slope / g;
        Pace { t, v: self.line.at(u).sqrt(), a, j: -a * dg / g * self.line.at(at).sqrt() / g }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_part_of_a_cubic_at_a_time_is_where_its_time_is_over() {
        let length = 3.0;
        // Nearly even; from and to a crawl, in many parts; with a dip between.
        for (speeds, a, most) in [
            ([10.0, 10.1], [3.0, -2.0], 1),
            ([1e-3, 10.0], [20.0, 10.0], 40),
            ([10.0, 1e-3], [-10.0, -20.0], 40),
            ([10.0, 9.0], [-30.0, 28.0], 8),
        ] {
            let square = SpeedSq::between(speeds, a, length);
            // Over x = y³, for the start, and 1 − y³, for the end, from the middle: Simpson's rule.
            let n = 20_000;
            let half = |end: f64, to: f64| {
                let f = |y: f64| {
                    let x = if end == 0.0 { y.powi(3) } else { 1.0 - y.powi(3) };
                    3.0 * y * y * length / square.derivatives(x)[0].sqrt()
                };
                let h = to / f64::from(2 * n);
                let inner: f64 =
                    (0..n).map(|i| 4.0 * f(h * f64::from(2 * i + 1)) + 2.0 * f(h * f64::from(2 * i))).sum();
                (inner + f(to) - f(0.0)) * h / 3.0
            };
            let root = 0.5_f64.cbrt();
            let [first, last] = [half(0.0, root), half(1.0, root)];
            for times in [1.0, 0.3, 40.0] {
                let (law, duration, [a0, a1]) = (PhaseLaw::SpeedCubic, times * (first + last), a);
                let (piece, axis, value, [u0, u1], [p0, p1]) = (0, 255, 0.0, [0.0, 1.0], speeds);
                let phase = Phase { piece, law, axis, value, u0, u1, p0, p1, duration, a0, a1 };
                let cubic = Cubic::new(&phase, speeds, length);
                assert!(cubic.parts.len() <= most + 8 && cubic.error < 1e-12, "{}", cubic.parts.len());
                for x in [0.001_f64, 0.2, 0.5, 0.9, 0.9999] {
                    let passed = if x <= 0.5 {
                        half(0.0, x.cbrt())
                    } else {
                        first + last - half(1.0, (1.0 - x).cbrt())
                    };
                    let done = passed / (first + last);
                    let (Part { from_start, share }, _) = cubic.part(done, 1.0 - done);
                    let found = if from_start { share } else { 1.0 - share };
                    assert!((found - x).abs() < 1e-10, "{speeds:?} {duration}: {found} for {x}");
                    let pace = cubic.at_part(Part { from_start: true, share: x }, 1.0);
                    assert!((pace.t - done).abs() < 1e-9, "{speeds:?} {duration}: {} for {done}", pace.t);
                }
            }
        }
    }
}
