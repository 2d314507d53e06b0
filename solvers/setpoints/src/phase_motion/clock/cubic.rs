//! The time along a phase on which v² is a cubic polynomial of the length and nowhere 0: power series of x, the share of the
//! length, in time, from the slower end.
//!
//! d(ẋ²)/dx = 2 ẍ gives ẍ = P(x) with a quadratic P, and the terms of its solution one by one (Taylor's method for differential
//! equations).

use crate::phase_motion::lengths::ERROR;
use crate::phase_motion::pace::{time_of_way, Pace};
use crate::phase_motion::part::Part;
use feedplan_planner::phases::Phase;

/// Greatest number of terms of a series of the length in time. A series ends where two consecutive terms are below `NOTHING`, as
/// a share of the length.
const MOST_TERMS: usize = 18;
const NOTHING: f64 = 1e-18;
/// 1/((k + 1)(k + 2)): the factor from term k of ẍ to term k + 2 of x.
pub const PER_TERM: [f64; MOST_TERMS] = {
    let (mut per, mut k) = ([0.0; MOST_TERMS], 0);
    while k < MOST_TERMS {
        per[k] = 1.0 / ((k + 1) * (k + 2)) as f64;
        k += 1;
    }
    per
};
/// A Newton step below this share of the time of a series is the last one: its error, about the square of it, is below rounding.
pub const LAST_STEP: f64 = 1e-10;
/// A series may go beyond the length by this share of it: the duration of the phase is that of the motion only up to rounding.
pub const OVER: f64 = 1e-3;
/// A series is at least this share of the duration long, and their number is limited: only absurd speeds need more.
const SHORTEST: f64 = 1e-12;
const MOST_PARTS: usize = 10_000;

/// The motion where v² is a cubic polynomial of the length.
pub struct Cubic {
    speed_sq: SpeedSq,
    /// Whether the start is the slower end.
    from_start: bool,
    /// The series in the order of time; most phases have only one.
    first: Series,
    others: Vec<Series>,
    /// The time for the whole length, in the time unit of the series.
    total: f64,
    error: f64,
}

impl Cubic {
    /// Created on the heap: it is too large to be moved for each phase.
    pub fn new(phase: &Phase, speeds: [f64; 2], length: f64) -> Box<Self> {
        let (from_start, speed_sq) = (speeds[0] <= speeds[1], SpeedSq::new(phase, speeds, length));
        // From the end of the phase, time runs backwards.
        let back = || SpeedSq::between([speeds[1], speeds[0]], [-phase.a1, -phase.a0], length);
        let own = if from_start { speed_sq } else { back() };
        let unit = if phase.duration > 0.0 { phase.duration } else { 2.0 * length / (speeds[0] + speeds[1]) };
        let (first, others) = (Series::default(), Vec::new());
        let mut cubic = Box::new(Self { speed_sq, from_start, first, others, total: 0.0, error: 0.0 });
        // Fills a series from here on, halving its duration until its error is small enough or the limit is reached; returns x
        // and dx/ds at its end.
        let fill = |series: &mut Series, time: f64, x: f64, mut width: f64| loop {
            series.fill(&own, [time, x, width], unit / length);
            let [end, slope] = series.at(1.0);
            let fails = series.error > ERROR || slope <= 0.0 || end > 1.0 + OVER;
            if !fails || width <= SHORTEST {
                return [end, slope];
            }
            width *= 0.5;
        };
        let mut end = fill(&mut cubic.first, 0.0, 0.0, 1.0);
        while !(end[0] >= 1.0 - OVER || end[0].is_nan() || cubic.others.len() + 1 == MOST_PARTS) {
            let Series { from, width, .. } = *cubic.last();
            cubic.others.push(Series::default());
            end =
                fill(cubic.others.last_mut().expect("one has been added"), from + width, end[0], 2.0 * width);
        }
        let last = cubic.last();
        cubic.total = last.from + last.width * last.time_of_all(end);
        cubic.error = cubic.first.error + cubic.others.iter().map(|series| series.error).sum::<f64>();
        cubic
    }

    fn last(&self) -> &Series {
        self.others.last().unwrap_or(&self.first)
    }

    /// The last series that `has_begun`; the first series if there is no other.
    fn series(&self, has_begun: impl Fn(&Series) -> bool) -> &Series {
        match self.others.partition_point(has_begun) {
            0 => &self.first,
            number => &self.others[number - 1],
        }
    }

    /// Why the phase cannot be followed; None if it can.
    pub fn flaw(phase: &Phase, speeds: [f64; 2], length: f64) -> Option<&'static str> {
        let moves = SpeedSq::new(phase, speeds, length).is_positive();
        (!moves).then_some("loses all its speed on the way")
    }

    /// The share of the length after the share `done` of the duration, with the share `left` still to go; and its error bound.
    pub fn part(&self, done: f64, left: f64) -> (Part, f64) {
        let time = self.total * if self.from_start { done } else { left };
        let series = self.series(|series| series.from <= time);
        let [share, _] = series.at((time - series.from) / series.width);
        (Part { from_start: self.from_start, share: share.clamp(0.0, 1.0) }, self.error)
    }

    /// The motion at a share of the length, t seconds after the start.
    pub fn pace(&self, part: Part, t: f64) -> Pace {
        let x = if part.from_start { part.share } else { 1.0 - part.share };
        let (length, [w, slope, bend]) = (self.speed_sq.length, self.speed_sq.derivatives(x));
        let v = w.sqrt();
        Pace { t, v, a: 0.5 * slope / length, j: 0.5 * v * bend / (length * length) }
    }

    pub fn at_part(&self, part: Part, duration: f64) -> Pace {
        let x = if part.from_start == self.from_start { part.share } else { 1.0 - part.share };
        let series = self.series(|series| series.x <= x);
        let passed = (series.from + series.width * series.time(x)) / self.total;
        let passed = passed.clamp(0.0, 1.0);
        self.pace(part, duration * if self.from_start { passed } else { 1.0 - passed })
    }
}

/// v² as a polynomial of x, the share of the length.
#[derive(Clone, Copy, Debug)]
struct SpeedSq {
    c: [f64; 4],
    length: f64,
}

impl SpeedSq {
    fn new(phase: &Phase, speeds: [f64; 2], length: f64) -> Self {
        Self::between(speeds, [phase.a0, phase.a1], length)
    }

    /// The cubic with these v and a at both ends.
    fn between(speeds: [f64; 2], a: [f64; 2], length: f64) -> Self {
        let ([w0, w1], [slope0, slope1]) = (speeds.map(|v| v * v), a.map(|a| 2.0 * a * length));
        let rise = w1 - w0;
        Self { c: [w0, slope0, 3.0 * rise - 2.0 * slope0 - slope1, slope0 + slope1 - 2.0 * rise], length }
    }

    fn derivatives(&self, x: f64) -> [f64; 3] {
        let [c0, c1, c2, c3] = self.c;
        [c0 + x * (c1 + x * (c2 + x * c3)), c1 + x * (2.0 * c2 + x * 3.0 * c3), 2.0 * c2 + 6.0 * x * c3]
    }

    /// Whether v² is above 0 on the whole length.
    fn is_positive(&self) -> bool {
        let [_, c1, c2, c3] = self.c;
        // The roots of 3 c3 x² + 2 c2 x + c1, without cancellation.
        let root = (c2 * c2 - 3.0 * c1 * c3).max(0.0).sqrt();
        let q = -(c2 + root.copysign(c2));
        [0.0, 1.0, q / (3.0 * c3), c1 / q]
            .iter()
            .filter(|x| (0.0..=1.0).contains(*x))
            .all(|&x| self.derivatives(x)[0] > 0.0)
    }
}

/// The share of the length as a power series of s, the time as a share of the duration of the series.
#[derive(Default)]
struct Series {
    /// Start and duration, in the time unit of the phase.
    from: f64,
    width: f64,
    /// The share of the length at the start of the series, and the terms that are added to it.
    x: f64,
    terms: [f64; MOST_TERMS],
    count: usize,
    /// Proven bound of the sum of the omitted terms.
    error: f64,
}

impl Series {
    /// Computes the series from a time and a place on, with this duration; `per` is the time unit over the length.
    fn fill(&mut self, speed_sq: &SpeedSq, [from, x, width]: [f64; 3], per: f64) {
        let [w, slope, bend] = speed_sq.derivatives(x);
        let scale = width * per;
        let half = 0.5 * scale * scale;
        // ẍ = p0 + p1 y + p2 y² with y = x minus its value at the start.
        let [p0, p1, p2] = [half * slope, half * bend, half * 3.0 * speed_sq.c[3]];
        let terms = &mut self.terms;
        // The last two terms are also kept in variables: loading two numbers at once just after each was stored would stall the
        // processor.
        let (mut before, mut last, mut count) = (scale * w.sqrt(), 0.5 * p0, 3);
        (terms[1], terms[2]) = (before, last);
        while count < MOST_TERMS && before.abs() + last.abs() > NOTHING {
            let k = count - 2;
            // Each product appears twice, except the middle one.
            let pairs: f64 = (1..k.div_ceil(2)).map(|i| terms[i] * terms[k - i]).sum();
            let middle = if k % 2 == 0 { terms[k / 2] * terms[k / 2] } else { 0.0 };
            let square = 2.0 * pairs + middle;
            (before, last) = (last, (p1 * before + p2 * square) * PER_TERM[k]);
            terms[count] = last;
            count += 1;
        }
        // The residual of the equation consists of the terms of P from the power `count` − 2 on. If |P'| ≤ 1, an error of ẍ
        // causes an error of x of at most cosh(1)/2 times it.
        let mut rest = [0.0; MOST_TERMS + 1];
        for k in (0..count).rev() {
            rest[k] = rest[k + 1] + terms[k].abs();
        }
        let square: f64 = (1..count).map(|i| terms[i].abs() * rest[(count - 2).saturating_sub(i)]).sum();
        let missed = p1.abs() * rest[count - 2] + p2.abs() * square;
        let is_gentle = p1.abs() + 2.0 * p2.abs() * rest[0] <= 1.0;
        (self.from, self.width, self.x, self.count) = (from, width, x, count);
        self.error = if is_gentle { missed } else { f64::INFINITY };
    }

    /// The share of the length at s, and its derivative by s.
    #[inline]
    fn at(&self, s: f64) -> [f64; 2] {
        let (mut way, mut slope) = (0.0, 0.0);
        for term in self.terms[..self.count].iter().rev() {
            slope = slope * s + way;
            way = way * s + term;
        }
        [self.x + way, slope]
    }

    /// The s at which the whole length is done; `end` and `slope` are the share of the length and its derivative at s = 1.
    fn time_of_all(&self, [end, slope]: [f64; 2]) -> f64 {
        // Mostly the first Newton step is the last one.
        let time = 1.0 - (end - 1.0) / slope;
        if (time - 1.0).abs() <= LAST_STEP {
            time
        } else {
            self.time(1.0)
        }
    }

    /// The s at a share of the length.
    fn time(&self, x: f64) -> f64 {
        time_of_way(|s| self.at(s), x, [1.0, 2.0], LAST_STEP)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use feedplan_planner::phase_law::PhaseLaw;

    #[test]
    fn the_part_of_a_cubic_at_a_time_is_where_its_time_is_over() {
        let length = 3.0;
        // Nearly constant speed; from and to a crawl, in many series; with a dip between.
        for (speeds, a, most) in [
            ([10.0, 10.1], [3.0, -2.0], 1),
            ([1e-3, 10.0], [20.0, 10.0], 40),
            ([10.0, 1e-3], [-10.0, -20.0], 40),
            ([10.0, 9.0], [-30.0, 28.0], 8),
        ] {
            let square = SpeedSq::between(speeds, a, length);
            // Integrates over y with x = y³ in the first half and x = 1 − y³ in the second, by Simpson's rule.
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
                let parts = 1 + cubic.others.len();
                assert!(parts <= most + 8 && cubic.error < 1e-12, "{parts}");
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
