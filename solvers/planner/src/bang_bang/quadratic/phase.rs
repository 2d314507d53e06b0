//! A phase p(x) on a sub-piece: its law, its values, and p as a quotient of polynomials.

use super::quotient::{Denominator, Quotient};
use super::subpiece::{Axes, SubPiece};

/// What is constant on a phase; accelerations are in the direction of travel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Law {
    /// This axis is at +A; p is computed from the start of the phase.
    Accelerating(u8),
    /// This axis is at −A, a phase of the backward pass seen forward; p is computed from the end of the phase.
    Braking(u8),
    /// p is constant; this axis is at its acceleration limit.
    Flat(u8),
    /// The speed of the cap.
    Cap,
    /// The limit curve, a straight line in p.
    LimitCurve,
}

/// p(x) on [x0, x1].
#[derive(Clone, Copy, Debug)]
pub struct Phase {
    pub x0: f64,
    pub x1: f64,
    pub p0: f64,
    pub p1: f64,
    pub law: Law,
}

impl Phase {
    /// The phase in the direction of the opposite pass.
    #[inline(always)]
    pub fn reversed(&self, length: f64) -> Self {
        let law = match self.law {
            Law::Accelerating(axis) => Law::Braking(axis),
            Law::Braking(axis) => Law::Accelerating(axis),
            law => law,
        };
        // Exact at the ends of the sub-piece.
        let mirror = |x: f64| if x == 0.0 { length } else { length - x };
        Self { x0: mirror(self.x1), x1: mirror(self.x0), p0: self.p1, p1: self.p0, law }
    }

    #[inline(always)]
    pub fn at<const M: usize>(&self, sub: &SubPiece<M>, axes: &Axes<M>, x: f64) -> f64 {
        if x == self.x0 {
            return self.p0;
        }
        if x == self.x1 {
            return self.p1;
        }
        match self.law {
            Law::Accelerating(k) => {
                along(sub, k as usize, axes.acceleration[k as usize], self.x0, self.p0, x)
            }
            Law::Braking(k) => along(sub, k as usize, -axes.acceleration[k as usize], self.x1, self.p1, x),
            Law::Flat(_) => self.p0,
            Law::Cap => sub.cap_at(x),
            Law::LimitCurve => self.p0 + (self.p1 - self.p0) * ((x - self.x0) / (self.x1 - self.x0)),
        }
    }

    /// p on [a, b], with its values at both ends.
    #[inline(always)]
    pub fn quotient<const M: usize>(
        &self,
        sub: &SubPiece<M>,
        axes: &Axes<M>,
        (a, at_a): (f64, f64),
        (b, at_b): (f64, f64),
    ) -> Quotient {
        match self.law {
            Law::Accelerating(k) | Law::Braking(k) => {
                let k = k as usize;
                let (ga, gb) = (sub.axis_tangent(k, a), sub.axis_tangent(k, b));
                let gain = axes.acceleration[k] * (b - a);
                // n = v_k² and n' = 2 a_k g_k, from the end where the phase is slower: p may be infinite at the other.
                let n = if let Law::Accelerating(_) = self.law {
                    let n = ga * ga * at_a;
                    [n, n + gain * ga, n + gain * (ga + gb)]
                } else {
                    let n = gb * gb * at_b;
                    [n + gain * (ga + gb), n + gain * gb, n]
                };
                Quotient { n, d: [ga * ga, ga * gb, gb * gb], denominator: Denominator::AxisSq(k) }
            }
            Law::Flat(_) | Law::LimitCurve => Quotient::line(at_a, at_b),
            Law::Cap => sub.cap_quotient(a, b),
        }
    }
}

/// p at x on the phase through (x0, p0) on which axis k has the acceleration `a`.
#[inline(always)]
pub fn along<const M: usize>(sub: &SubPiece<M>, k: usize, a: f64, x0: f64, p0: f64, x: f64) -> f64 {
    let (g0, g) = (sub.axis_tangent(k, x0), sub.axis_tangent(k, x));
    p0 + (x - x0) * (g + g0) * (a - sub.c[k] * p0) / (g * g)
}
