//! Computes derivatives by arc length from those by the parameter, for numbers or intervals (Cheatham 2007, 5.13–5.16).
//!
//! Symbols: ' = d/du, S arc length [mm] of the tool's path. A coordinate n/d has the derivative G/d², where G = n'd −
//! nd', so that S' = √Q/d² with Q = Σ G² over the tool's coordinates. For an axis with X in place of G
//!
//!   q_S = X/√Q,   q_SS = d² N/Q²,   q_SSS = d² (2 d d' N − 2 d² N Q'/Q + d² N')/Q^(5/2),   N = X'Q − XQ'/2
//!
//! N is a sum of Wronskians, N = Σ G (X'G − XG'): it vanishes on straight lines with any parametrisation, where the
//! thesis's form q''u_S² + … cancels. The thesis takes S' = |q'|, which is right only where the tool's axes are the
//! joints.

use feedplan_geometry::interval::Interval;
use std::ops::{Add, Mul, Sub};

/// A number, or an interval that contains it.
pub trait Number: Copy + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self> {
    fn scale(self, factor: f64) -> Self;
    fn square(self) -> Self;
    /// 1/x of a positive number; infinite where x may not be positive.
    fn reciprocal(self) -> Self;
    /// √x of a number ≥ 0.
    fn root(self) -> Self;
    fn range(self) -> Interval;
}

impl Number for f64 {
    fn scale(self, factor: f64) -> Self {
        factor * self
    }
    fn square(self) -> Self {
        self * self
    }
    fn reciprocal(self) -> Self {
        if self > 0.0 {
            1.0 / self
        } else {
            f64::INFINITY
        }
    }
    fn root(self) -> Self {
        self.max(0.0).sqrt()
    }
    fn range(self) -> Interval {
        Interval::exactly(self)
    }
}

impl Number for Interval {
    fn scale(self, factor: f64) -> Self {
        self * Interval::exactly(factor)
    }
    fn square(self) -> Self {
        Interval::square(self)
    }
    fn reciprocal(self) -> Self {
        if self.lo > 0.0 {
            Interval::reciprocal(self)
        } else {
            Interval { lo: 0.0, hi: f64::INFINITY }
        }
    }
    fn root(self) -> Self {
        let root = Interval { lo: self.lo.max(0.0), ..self }.sqrt();
        Interval { lo: root.lo.max(0.0), ..root }
    }
    fn range(self) -> Interval {
        self
    }
}

/// The terms of one axis, at a point or over an interval.
#[derive(Clone, Copy, Debug)]
pub struct Terms<N> {
    pub x: N,
    pub n: N,
    pub n_rate: N,
}

/// The terms that all axes share.
#[derive(Clone, Copy, Debug)]
pub struct Shared<N> {
    pub q: N,
    pub q_rate: N,
    /// d and d'; None where d = 1.
    pub weight: Option<[N; 2]>,
}

impl<N: Number> Shared<N> {
    /// q_S, q_SS, q_SSS.
    pub fn by_length(&self, axis: &Terms<N>) -> [N; 3] {
        let over = self.q.reciprocal();
        let root = over.root();
        let bend = over.square() * axis.n;
        let bend_rate = over.square() * axis.n_rate - (self.q_rate * over).scale(2.0) * bend;
        match self.weight {
            None => [axis.x * root, bend, bend_rate * root],
            Some([d, d_rate]) => {
                let square = d.square();
                let third = (d * d_rate).scale(2.0) * bend + square * bend_rate;
                [axis.x * root, square * bend, square * third * root]
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_parabola_by_hand() {
        // (u, u²/2) at 0: S = u + u³/6 + …, so x = S − S³/6, y = S²/2. Q = 1 + u², N = (−u, 1).
        let shared = Shared { q: 1.0, q_rate: 0.0, weight: None };
        assert_eq!(shared.by_length(&Terms { x: 1.0, n: 0.0, n_rate: -1.0 }), [1.0, 0.0, -1.0]);
        assert_eq!(shared.by_length(&Terms { x: 0.0, n: 1.0, n_rate: 0.0 }), [0.0, 1.0, 0.0]);
    }

    #[test]
    fn a_circle_by_hand() {
        // ((1 − u²), 2 u)/(1 + u²) at 0: G = (−4 u, 2 − 2 u²), Q = 4 (1 + u²)², X'Q − XQ'/2 = −16 and 0 and rates 0, −32.
        let shared = Shared { q: 4.0, q_rate: 0.0, weight: Some([1.0, 0.0]) };
        assert_eq!(shared.by_length(&Terms { x: 0.0, n: -16.0, n_rate: 0.0 }), [0.0, -1.0, 0.0]);
        assert_eq!(shared.by_length(&Terms { x: 2.0, n: 0.0, n_rate: -32.0 }), [1.0, 0.0, -1.0]);
    }
    #[test]
    fn a_point_where_the_parameter_slows_by_hand() {
        // The same circle at u = ½, where x = cos 2 atan ½ = 0.6: Q = 6.25, Q' = 10, d = 1.25, d' = 1, and for x
        // X = −4 u = −2, N = −16 (1 − u⁴) = −15, N' = 64 u³ = 8.
        let shared = Shared { q: 6.25, q_rate: 10.0, weight: Some([1.25, 1.0]) };
        let found: [f64; 3] = shared.by_length(&Terms { x: -2.0, n: -15.0, n_rate: 8.0 });
        for (found, expected) in found.iter().zip([-0.8, -0.6, 0.8]) {
            assert!((found - expected).abs() < 1e-15);
        }
    }
}
