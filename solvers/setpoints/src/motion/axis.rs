//! One axis at constant acceleration on a general piece: its way is a known quadratic of time, and the place is
//! found from the way by Newton's method in a bracket.
//!
//! The way is measured from the end of the arc where |q'_k| is smaller, as the integral of q'_k in Bernstein
//! form: coefficients of one sign lose no digits, not even where q'_k vanishes, as no difference of positions
//! would. Axis k is reflected so that q'_k ≥ 0. On rational pieces q'_k = h/ω² and its integral is m/ω.

use super::{ProfileArc, State};
use feedplan_geometry::polynomial::Polynomial;
use feedplan_geometry::quadratic::norm;
use feedplan_geometry::spline::bezier::derivatives;
use feedplan_geometry::spline::{Piece, MAX_HODOGRAPH};

/// Coefficients of a hodograph, and one more for its integral.
const C: usize = MAX_HODOGRAPH + 1;
/// Quadratically convergent, a relative step this small leaves an error below rounding.
const LAST_STEP: f64 = 3e-9;
/// More rounds than Newton's method and bisection together take.
const MAX_ROUNDS: u32 = 120;
/// An end is one where the axis turns round when q'_k is below this part of its mean there.
const TURN: f64 = 1e-4;
/// The speed of the axis at such an end is rounding below this part of that at the other one. A speed that is left out
/// is a delay of all other axes.
const PASSED: f64 = 1e-9;
/// A speed at a cusp below this part of that at the other end is a standstill but for rounding.
const STANDSTILL: f64 = 1e-12;

/// q'_k and its integral along the arc from one of its ends, over x in [0, 1].
struct Way {
    h: Polynomial<C>,
    omega: Polynomial<C>,
    m: Polynomial<C>,
    total: f64,
}

impl Way {
    fn new(h: Polynomial<C>, omega: Polynomial<C>, degree: usize) -> Self {
        let mut way = Self { h, omega, m: h.antiderivative(&omega, degree), total: 1.0 };
        way.total = way.to(1.0);
        way
    }

    /// The way to x.
    #[inline(always)]
    fn to(&self, x: f64) -> f64 {
        let m = self.m.value(x);
        if self.omega.degree() == 0 {
            m
        } else {
            m / self.omega.value(x)
        }
    }

    /// dq_k/dx.
    #[inline(always)]
    fn slope(&self, x: f64) -> f64 {
        let h = self.h.value(x);
        if self.omega.degree() == 0 {
            h
        } else {
            let omega = self.omega.value(x);
            h / (omega * omega)
        }
    }

    /// The x where a part of the whole way is done, and the rounds.
    fn place(&self, part: f64) -> (f64, u32) {
        let target = part * self.total;
        let (low, high) = (self.slope(0.0).max(0.0), self.slope(1.0).max(0.0));
        // Exact where q'_k is linear.
        let g = (low * low + part * (high - low) * (high + low)).sqrt();
        let mut x = if low + g > 0.0 { part * (low + high) / (low + g) } else { part };
        let (mut from, mut to) = (0.0, 1.0);
        for round in 1..=MAX_ROUNDS {
            if !(from < x && x < to) {
                x = 0.5 * (from + to);
            }
            let miss = self.to(x) - target;
            if miss > 0.0 {
                to = x;
            } else {
                from = x;
            }
            let step = miss / self.slope(x);
            let last = step.abs() <= LAST_STEP * x.min(1.0 - x) || step.abs() <= f64::EPSILON * x;
            let next = x - step;
            let middle = 0.5 * (from + to);
            if miss.abs() <= 2.0 * f64::EPSILON * target || !(from < middle && middle < to) {
                return (x, round);
            }
            if last {
                return (next.clamp(0.0, 1.0), round);
            }
            // Where the steps do not settle the bracket is halved.
            x = if round % 16 == 0 { middle } else { next };
        }
        (x, MAX_ROUNDS)
    }
}

/// What q'_k does at an end of the arc.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum End {
    Regular,
    /// It vanishes, where p is finite: the axis turns round, or stands still in a cusp.
    Turn,
    /// It vanishes in a cusp that is passed, where p is infinite.
    Cusp,
}

/// The law of an arc on which axis k has a constant acceleration, which may be 0.
pub(super) struct AxisLaw {
    pub k: usize,
    pub sign: f64,
    pub acceleration: f64,
    v: [f64; 2],
    /// From the start and from the end.
    ways: [Way; 2],
    /// The way is measured from the start.
    from_start: bool,
    pub ends: [End; 2],
}

impl AxisLaw {
    /// None where the axis shows no motion: the arc is as short as a rounding error. `speed` is the axis's own
    /// where it is constant.
    pub fn new<const M: usize>(
        piece: &Piece<M>,
        arc: &ProfileArc,
        k: usize,
        acceleration: f64,
        speed: Option<f64>,
    ) -> Option<Self> {
        let (h, omega) = numerator(piece, k);
        let (t0, t1) = (arc.u0 / piece.width, (arc.u1 / piece.width).min(1.0));
        let (h, omega) = (h.part(t0, t1).scale(t1 - t0), omega.part(t0, t1));
        let sign = if h.value(0.5) >= 0.0 { 1.0 } else { -1.0 };
        let mut h = h.scale(sign);
        // A q'_k that the profile's cuts put to 0 comes out as a rounding error of either sign.
        if arc.p0 == f64::INFINITY || h.first() < 0.0 {
            h.set_first(0.0);
        }
        if arc.p1 == f64::INFINITY || h.last() < 0.0 {
            h.set_last(0.0);
        }
        let ways =
            [Way::new(h, omega, piece.degree()), Way::new(h.reverse(), omega.reverse(), piece.degree())];
        let way = ways[0].total;
        let slopes = [ways[0].slope(0.0), ways[1].slope(0.0)];
        let mean = way / arc.duration;
        let width = arc.u1 - arc.u0;
        let p = [arc.p0, arc.p1];
        let given = [0, 1].map(|i| slopes[i] / width * p[i].sqrt());
        let fast = [0, 1].map(|i| given[i] > PASSED * given[1 - i].min(mean));
        let stands = standstills(piece, arc);
        // An axis that hardly moves while others do, and yet more than rounding says, does not turn round.
        let turns = [0, 1].map(|i| slopes[i] <= TURN * way && (stands[i] || !fast[i]));
        // At a cusp p is infinite, or so great that q'_k√p is a rounding error times a great number: the duration
        // tells the speed.
        let passed = [0, 1].map(|i| turns[i] && (p[i] == f64::INFINITY || fast[i]));
        let from_other = |v: f64| {
            let speed = 2.0 * mean - v;
            if speed > STANDSTILL * v {
                speed
            } else {
                0.0
            }
        };
        let given = [0, 1].map(|i| if turns[i] && !passed[i] { 0.0 } else { given[i] });
        let v = match (speed, passed) {
            (Some(speed), _) => [speed; 2],
            (None, [false, false]) => given,
            (None, [true, false]) => [from_other(given[1]), given[1]],
            (None, [false, true]) => [given[0], from_other(given[0])],
            (None, [true, true]) => {
                let gain = 0.5 * sign * acceleration * arc.duration;
                [(mean - gain).max(0.0), (mean + gain).max(0.0)]
            }
        };
        let moves = way > 0.0 && v[0] + v[1] > 0.0 && (v[0] + v[1]).is_finite();
        moves.then_some(Self {
            k,
            sign,
            acceleration,
            v,
            ways,
            from_start: slopes[0] <= slopes[1],
            ends: [0, 1].map(|i| match (turns[i], passed[i]) {
                (false, _) => End::Regular,
                (true, false) => End::Turn,
                (true, true) => End::Cusp,
            }),
        })
    }

    pub fn at_time(&self, arc: &ProfileArc, done: f64, left: f64) -> State {
        let [v0, v1] = self.v;
        let v = v0 * left + v1 * done;
        let (side, part) =
            if self.from_start { (0, done * (v0 + v) / (v0 + v1)) } else { (1, left * (v1 + v) / (v0 + v1)) };
        let (x, iterations) = self.ways[side].place(part.clamp(0.0, 1.0));
        let width = arc.u1 - arc.u0;
        let u = if side == 0 { arc.u0 + width * x } else { arc.u1 - width * x };
        let g = (self.ways[side].slope(x) / width).max(0.0);
        State { u: u.clamp(arc.u0, arc.u1), v, g, iterations, error: f64::EPSILON, ..State::default() }
    }

    /// The nearer end, how far away it is, and the part of the way from there.
    fn nearer_end(&self, arc: &ProfileArc, u: f64) -> (usize, f64, f64) {
        let width = arc.u1 - arc.u0;
        let (before, after) = ((u - arc.u0) / width, (arc.u1 - u) / width);
        let (side, x) = if before <= after { (0, before) } else { (1, after) };
        (side, x, (self.ways[side].to(x) / self.ways[side].total).clamp(0.0, 1.0))
    }

    pub fn at(&self, arc: &ProfileArc, u: f64) -> State {
        let (side, x, part) = self.nearer_end(arc, u);
        let (near, far) = (self.v[side], self.v[1 - side]);
        // v² is linear in the way.
        let v = (near * near + part * (far - near) * (far + near)).max(0.0).sqrt();
        let g = (self.ways[side].slope(x) / (arc.u1 - arc.u0)).max(0.0);
        State { u, v, g, ..State::default() }
    }

    /// The part of the duration that has passed at a place.
    pub fn done(&self, arc: &ProfileArc, state: &State) -> f64 {
        let (side, _, part) = self.nearer_end(arc, state.u);
        let passed = part * (self.v[0] + self.v[1]) / (self.v[side] + state.v);
        // 0/0 at a standstill: only the end at rest has one.
        let passed = if passed.is_nan() { 0.0 } else { passed.clamp(0.0, 1.0) };
        if side == 0 {
            passed
        } else {
            1.0 - passed
        }
    }
}

/// Whether no axis moves at the ends of an arc, beside what they do in its middle.
fn standstills<const M: usize>(piece: &Piece<M>, arc: &ProfileArc) -> [bool; 2] {
    let speed = |u: f64| norm(&derivatives(piece, u)[1]);
    let middle = speed(0.5 * (arc.u0 + arc.u1));
    [arc.u0, arc.u1].map(|u| speed(u) <= TURN * middle)
}

/// q'_k ω² width and ω over the whole piece.
fn numerator<const M: usize>(piece: &Piece<M>, k: usize) -> (Polynomial<C>, Polynomial<C>) {
    let (control, weights) = (piece.control, piece.weights);
    if !piece.is_rational() {
        let degree = piece.degree() as f64;
        let steps = control.windows(2).map(|pair| degree * (pair[1][k] - pair[0][k]));
        return (Polynomial::from_bernstein(steps), Polynomial::constant(1.0));
    }
    let omega = Polynomial::from_bernstein(weights.iter().map(|&weight| weight / weights[0]));
    // About the first point, for the digits.
    let points = control.iter().zip(weights).map(|(point, w)| (point[k] - control[0][k]) * (w / weights[0]));
    (Polynomial::from_bernstein(points).wronskian(&omega), omega)
}
