//! The way of one axis along a phase, and the place at a part of it by Newton's method in a bracket.
//!
//! The way is measured from the end of the phase where |q'_k| is smaller, as the integral of q'_k in Bernstein form:
//! coefficients of one sign lose no digits where q'_k vanishes, differences of positions would. Axis k is reflected so that
//! q'_k ≥ 0. On rational pieces q'_k = h/ω² and its integral is m/ω.

use super::clock::Even;
use super::part::Part;
use feedplan_geometry::inverse_length::Located;
use feedplan_geometry::polynomial::Polynomial;
use feedplan_geometry::quadratic::norm;
use feedplan_geometry::spline::bezier::derivatives;
use feedplan_geometry::spline::{Piece, MAX_HODOGRAPH};
use feedplan_planner::phase_law::PhaseLaw;
use feedplan_planner::phases::Phase;

/// Coefficients of a hodograph, and one more for its integral.
const C: usize = MAX_HODOGRAPH + 1;
/// Quadratically convergent, a relative step this small leaves an error below rounding.
const LAST_STEP: f64 = 3e-9;
/// More rounds than Newton's method and bisection together take.
const MAX_ROUNDS: u32 = 120;
/// The axis turns at an end where q'_k is below this part of its mean.
const TURN: f64 = 1e-4;
/// The speed of the axis at such an end is rounding below this part of that at the other one. A speed that is left out
/// is a delay of all other axes.
const PASSED: f64 = 1e-9;

/// q'_k and its integral along the phase from one of its ends, over x in [0, 1].
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
        if self.h.degree() <= 1 && self.omega.degree() == 0 {
            return (x.min(1.0), 0);
        }
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

/// The way of axis k along a phase on which it has a constant acceleration, which may be 0.
pub struct AxisWay {
    pub k: usize,
    pub sign: f64,
    /// From the start and from the end.
    ways: [Way; 2],
    /// The way is measured from the start, where |q'_k| is smaller.
    pub from_start: bool,
    /// Whether q'_k vanishes at each end: the axis turns there, or the path is at rest.
    pub turns: [bool; 2],
}

impl AxisWay {
    /// With the speeds of the axis at both ends. None where the axis shows no motion: the phase is as short as a rounding
    /// error.
    pub fn new<const M: usize>(piece: &Piece<M>, phase: &Phase) -> Option<(Self, Even)> {
        let k = phase.axis as usize;
        let (h, omega) = numerator(piece, k);
        let (t0, t1) = (phase.u0 / piece.width, (phase.u1 / piece.width).min(1.0));
        let (h, omega) = (h.part(t0, t1).scale(t1 - t0), omega.part(t0, t1));
        let sign = if h.value(0.5) >= 0.0 { 1.0 } else { -1.0 };
        let mut h = h.scale(sign);
        // A q'_k that the profile's cuts put to 0 comes out as a rounding error of either sign.
        if h.first() < 0.0 {
            h.set_first(0.0);
        }
        if h.last() < 0.0 {
            h.set_last(0.0);
        }
        let ways =
            [Way::new(h, omega, piece.degree()), Way::new(h.reverse(), omega.reverse(), piece.degree())];
        let way = ways[0].total;
        let slopes = [ways[0].slope(0.0), ways[1].slope(0.0)];
        let mean = way / phase.duration;
        let width = phase.u1 - phase.u0;
        let speeds =
            [(slopes[0], phase.p0), (slopes[1], phase.p1)].map(|(slope, p)| slope / width * p.sqrt());
        let stands = standstills(piece, phase);
        let fast = [0, 1].map(|i| speeds[i] > PASSED * speeds[1 - i].min(mean));
        // An axis that hardly moves while others do, and yet more than rounding says, does not turn.
        let turns = [0, 1].map(|i| slopes[i] <= TURN * way && (stands[i] || !fast[i]));
        let even = if phase.law == PhaseLaw::AxisVelocity {
            Even::constant(phase.value.sqrt())
        } else {
            Even {
                v: [0, 1].map(|i| if turns[i] && !fast[i] { 0.0 } else { speeds[i] }),
                a: sign * phase.value,
            }
        };
        let sum = even.v[0] + even.v[1];
        let moves = way > 0.0 && sum > 0.0 && sum.is_finite();
        moves.then_some((Self { k, sign, ways, from_start: slopes[0] <= slopes[1], turns }, even))
    }

    /// Where a part of the way is done.
    pub fn place(&self, phase: &Phase, part: Part) -> Located {
        let (x, iterations) = self.ways[usize::from(!part.from_start)].place(part.share);
        let way = (phase.u1 - phase.u0) * x;
        let u = if part.from_start { phase.u0 + way } else { phase.u1 - way };
        Located { u: u.clamp(phase.u0, phase.u1), iterations, miss: f64::EPSILON }
    }

    /// The part of the way at u, from the nearer end.
    pub fn part(&self, phase: &Phase, u: f64) -> Part {
        let width = phase.u1 - phase.u0;
        let (before, after) = ((u - phase.u0) / width, (phase.u1 - u) / width);
        let (side, x) = if before <= after { (0, before) } else { (1, after) };
        let share = (self.ways[side].to(x) / self.ways[side].total).clamp(0.0, 1.0);
        Part { from_start: side == 0, share }
    }
}

/// Whether no axis moves at the ends of a phase, beside what they do in its middle.
fn standstills<const M: usize>(piece: &Piece<M>, phase: &Phase) -> [bool; 2] {
    let speed = |u: f64| norm(&derivatives(piece, u)[1]);
    let middle = speed(0.5 * (phase.u0 + phase.u1));
    [phase.u0, phase.u1].map(|u| speed(u) <= TURN * middle)
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
