//! The displacement of one axis along a phase, and the place at a share of it, by Newton's method with bisection.
//!
//! The displacement is measured from the end of the phase where |q'_k| is smaller, as the integral of q'_k in Bernstein form:
//! coefficients of one sign lose no digits where q'_k vanishes; differences of positions would. The sign of axis k is chosen so
//! that q'_k ≥ 0. On rational pieces q'_k = h/ω², and its integral is m/ω.

use super::clock::Even;
use super::part::Part;
use feedplan_geometry::inverse_length::Located;
use feedplan_geometry::polynomial::Polynomial;
use feedplan_geometry::quadratic::norm;
use feedplan_geometry::spline::bezier::derivatives;
use feedplan_geometry::spline::{Piece, MAX_HODOGRAPH};
use feedplan_planner::phase_law::PhaseLaw;
use feedplan_planner::phases::Phase;

/// Greatest number of coefficients of a hodograph, plus one for its integral.
const C: usize = MAX_HODOGRAPH + 1;
/// A relative Newton step this small leaves an error below rounding, since the convergence is quadratic.
const LAST_STEP: f64 = 3e-9;
/// More rounds than Newton's method and bisection can take together.
const MAX_ROUNDS: u32 = 120;
/// The axis turns at an end where q'_k is below this share of its mean.
const TURN: f64 = 1e-4;
/// At an end where the axis turns, its speed counts as rounding below this share of that at the other end and of the mean. If a
/// real speed were neglected, all other axes would be delayed.
const PASSED: f64 = 1e-9;

/// q'_k and its integral along the phase from one of its ends, as functions of x in [0, 1].
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

    /// The displacement from 0 to x.
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

    /// The x at a share of the whole displacement, and the number of rounds.
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
            // Bisection now and then, in case the Newton steps do not converge.
            x = if round % 16 == 0 { middle } else { next };
        }
        (x, MAX_ROUNDS)
    }
}

/// The displacement of axis k along a phase on which the axis has a constant acceleration or velocity.
pub struct AxisWay {
    pub k: usize,
    pub sign: f64,
    /// Measured from the start and from the end of the phase.
    ways: [Way; 2],
    /// Whether |q'_k| is smaller at the start, from which the displacement is then measured.
    pub from_start: bool,
    /// Whether q'_k vanishes at each end: the axis turns there, or the path is at rest.
    pub turns: [bool; 2],
}

impl AxisWay {
    /// Also returns the speeds of the axis at both ends. None where the axis shows no motion: the phase is as short as a rounding
    /// error.
    pub fn new<const M: usize>(piece: &Piece<M>, phase: &Phase) -> Option<(Self, Even)> {
        let k = phase.axis as usize;
        let (h, omega) = numerator(piece, k);
        let (t0, t1) = (phase.u0 / piece.width, (phase.u1 / piece.width).min(1.0));
        let (h, omega) = (h.part(t0, t1).scale(t1 - t0), omega.part(t0, t1));
        let sign = if h.value(0.5) >= 0.0 { 1.0 } else { -1.0 };
        let mut h = h.scale(sign);
        // Where the profile cuts phases at q'_k = 0, the computed value is a rounding error of either sign.
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
        // An axis that moves much slower than others, but faster than rounding explains, does not turn.
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

    /// The place at a share of the displacement.
    pub fn place(&self, phase: &Phase, part: Part) -> Located {
        let (x, iterations) = self.ways[usize::from(!part.from_start)].place(part.share);
        let way = (phase.u1 - phase.u0) * x;
        let u = if part.from_start { phase.u0 + way } else { phase.u1 - way };
        Located { u: u.clamp(phase.u0, phase.u1), iterations, miss: f64::EPSILON }
    }

    /// The share of the displacement at u, counted from the nearer end.
    pub fn part(&self, phase: &Phase, u: f64) -> Part {
        let width = phase.u1 - phase.u0;
        let (before, after) = ((u - phase.u0) / width, (phase.u1 - u) / width);
        let (side, x) = if before <= after { (0, before) } else { (1, after) };
        let share = (self.ways[side].to(x) / self.ways[side].total).clamp(0.0, 1.0);
        Part { from_start: side == 0, share }
    }
}

/// Whether, at each end of a phase, all axes are at rest compared with its middle.
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
    // Relative to the first point, to lose no digits.
    let points = control.iter().zip(weights).map(|(point, w)| (point[k] - control[0][k]) * (w / weights[0]));
    (Polynomial::from_bernstein(points).wronskian(&omega), omega)
}
