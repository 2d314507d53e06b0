//! Motion whose law is about the way along the path or of the tool tip: constant jerk along it, or v² a cubic
//! polynomial of the length.
//!
//! At constant jerk v, a and the way are polynomials of time. They are taken from the end of the arc that is nearer in
//! time, so that nothing is lost next to a standstill. The cubic has no standstill; its time is a table.

use super::{ProfileArc, JERK_STEP_ERROR};
use feedplan_geometry::arc_length::{quadrature, Disc, Integrand, Node, Table};
use feedplan_geometry::inverse_length::{self, Located};
use feedplan_geometry::spline::speed::greatest_ratio;

/// A speed below 0 is rounding where it is this part of what speed and acceleration at the ends make of it.
const BACKWARDS: f64 = 1e-9;
/// Halvings of the bracket and steps of Newton's method end before this.
const MAX_ROUNDS: u32 = 200;

/// Time from the start of the arc, and speed, acceleration and jerk along the path.
#[derive(Clone, Copy, Debug, Default)]
pub struct Along {
    pub t: f64,
    pub v: f64,
    pub a: f64,
    pub j: f64,
}

/// v, a and j at one end, counted away from it: time runs back from the end of an arc.
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

/// Constant jerk along the path.
pub struct JerkLaw {
    ends: [End; 2],
    duration: f64,
    /// Ways of the two halves of the duration.
    ways: [f64; 2],
}

impl JerkLaw {
    /// `speeds` at both ends follow from the rest where p is infinite.
    pub fn new(arc: &ProfileArc, speeds: [f64; 2], length: f64) -> Self {
        let (t, j) = (arc.duration, arc.value);
        let [v0, v1] = match speeds.map(f64::is_finite) {
            [true, true] => speeds,
            [false, true] => [speeds[1] - t * (arc.a1 - 0.5 * j * t), speeds[1]],
            [true, false] => [speeds[0], speeds[0] + t * (arc.a0 + 0.5 * j * t)],
            [false, false] => {
                let v0 = length / t - t * (0.5 * arc.a0 + j * t / 6.0);
                [v0, v0 + t * (arc.a0 + 0.5 * j * t)]
            }
        };
        let ends = [End { v: v0, a: arc.a0, j }, End { v: v1, a: -arc.a1, j }];
        Self { ends, duration: t, ways: ends.map(|end| end.way(0.5 * t)) }
    }

    fn total(&self) -> f64 {
        self.ways[0] + self.ways[1]
    }

    /// A time counted from one of the ends, as part of the way and with the motion there.
    fn counted_from(&self, end: usize, t: f64) -> (f64, Along) {
        let End { a, j, .. } = self.ends[end];
        let (part, v) = (self.ends[end].way(t) / self.total(), self.ends[end].speed(t));
        if end == 0 {
            (part, Along { t, v, a: a + j * t, j })
        } else {
            (1.0 - part, Along { t: self.duration - t, v, a: -(a + j * t), j })
        }
    }

    /// The part of the way, and the motion there, when these parts of the duration are done and left.
    pub fn at_time(&self, done: f64, left: f64) -> (f64, Along) {
        if done <= 0.5 {
            self.counted_from(0, done * self.duration)
        } else {
            self.counted_from(1, left * self.duration)
        }
    }

    /// The motion where a part of the way is done.
    pub fn at_part(&self, part: f64) -> Along {
        let way = part * self.total();
        if way <= self.ways[0] {
            self.counted_from(0, self.ends[0].time(way, 0.5 * self.duration)).1
        } else {
            let way = (1.0 - part) * self.total();
            self.counted_from(1, self.ends[1].time(way, 0.5 * self.duration)).1
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
        (!(forward && self.total() > 0.0)).then_some("moves backwards")
    }
}

/// v² a cubic polynomial of the length.
pub struct CubicLaw {
    speed_sq: CubicTime,
    duration: f64,
    times: Vec<Node>,
    time_error: f64,
}

impl CubicLaw {
    pub fn new(arc: &ProfileArc, speeds: [f64; 2], length: f64) -> Self {
        let mut law = Self::bare(arc, speeds, length);
        law.time_error = super::fill(law.speed_sq, (0.0, 1.0), &mut law.times);
        law
    }

    /// Without its table.
    fn bare(arc: &ProfileArc, speeds: [f64; 2], length: f64) -> Self {
        let [w0, w1] = speeds.map(|v| v * v);
        let (slope0, slope1) = (2.0 * arc.a0 * length, 2.0 * arc.a1 * length);
        let rise = w1 - w0;
        let c = [w0, slope0, 3.0 * rise - 2.0 * slope0 - slope1, slope0 + slope1 - 2.0 * rise];
        let speed_sq = CubicTime { c, length };
        Self { speed_sq, duration: arc.duration, times: vec![], time_error: 0.0 }
    }

    /// Why nothing can follow an arc.
    pub fn flaw(arc: &ProfileArc, speeds: [f64; 2], length: f64) -> Option<&'static str> {
        let moves = Self::bare(arc, speeds, length).speed_sq.is_positive();
        (!moves).then_some("loses all its speed on the way")
    }

    fn table(&self) -> Table<'_, CubicTime> {
        Table { f: self.speed_sq, nodes: &self.times }
    }

    fn motion(&self, x: f64, t: f64) -> Along {
        let CubicTime { length, .. } = self.speed_sq;
        let [w, slope, bend] = self.speed_sq.derivatives(x);
        let v = w.sqrt();
        Along { t, v, a: 0.5 * slope / length, j: 0.5 * v * bend / (length * length) }
    }

    /// The part of the way when a part of the duration is done, with the motion there.
    pub fn at_time(&self, done: f64, period: f64) -> (Located, Along) {
        let table = self.table();
        let total = table.total();
        let tolerance = (JERK_STEP_ERROR * total * period / self.duration).max(table.rounding());
        let mut located = inverse_length::locate(&table, done * total, tolerance);
        located.miss = (located.miss + self.time_error) / total;
        (located, self.motion(located.u, done * self.duration))
    }

    /// The motion where a part of the way is done.
    pub fn at_part(&self, part: f64) -> Along {
        let table = self.table();
        self.motion(part, self.duration * (table.integral(part) / table.total()))
    }
}

/// v² over the part x of the way in powers of x; the time is the integral of length/v.
#[derive(Clone, Copy, Debug)]
struct CubicTime {
    c: [f64; 4],
    length: f64,
}

impl CubicTime {
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

impl Integrand for CubicTime {
    #[inline(always)]
    fn at(&self, x: f64) -> f64 {
        self.length / self.derivatives(x)[0].sqrt()
    }

    // v² loses at most half of its value in the middle within the disc.
    fn disc(&self, a: f64, b: f64) -> Disc {
        let half = 0.5 * (b - a);
        let [w, slope, bend] = self.derivatives(0.5 * (a + b));
        let tail = [half * slope, 0.5 * half * half * bend, half.powi(3) * self.c[3]].map(f64::abs);
        let ratio = greatest_ratio(|rho| rho * (tail[0] + rho * (tail[1] + rho * tail[2])) <= 0.5 * w);
        Disc { radius: (ratio - 1.0) * half, bound: self.length * (2.0 / w).sqrt() }
    }

    fn foot(&self) -> f64 {
        f64::NAN
    }

    // Asked for only where x runs out of digits.
    fn foot_error(&self, width: f64) -> f64 {
        quadrature(self, 0.0, 1.0) * width
    }
}
