//! One piece of degree 2 over t in [0, 1], from its three control points: its tangents, D and W.

use crate::bang_bang::tolerance::{CANCELLED, ZERO};
use feedplan_geometry::quadratic::{dot, sub};

/// The tangent C' is linear in t between the ends.
#[derive(Clone, Copy)]
pub struct Piece<const M: usize> {
    /// C' at t = 0 and t = 1.
    pub left: [f64; M],
    pub right: [f64; M],
    /// Bernstein coefficients of D = |C'|².
    pub speed: [f64; 3],
    /// W_jk.
    pub wronskian: [[f64; M]; M],
    /// |C' × C''|, constant along the piece.
    pub cross: f64,
}

impl<const M: usize> Piece<M> {
    #[inline(always)]
    pub fn new([a, b, c]: &[[f64; M]; 3]) -> Self {
        let (mut left, mut right) = (sub(b, a).map(|x| 2.0 * x), sub(c, b).map(|x| 2.0 * x));
        let speed = [dot(&left, &left), dot(&left, &right), dot(&right, &right)];
        let (left_zero, right_zero) = (ZERO * speed[0].sqrt(), ZERO * speed[2].sqrt());
        for k in 0..M {
            if left[k].abs() <= left_zero && left[k].abs() <= ZERO * right[k].abs() {
                left[k] = 0.0;
            } else if right[k].abs() <= right_zero && right[k].abs() <= ZERO * left[k].abs() {
                right[k] = 0.0;
            }
        }
        let mut wronskian = [[0.0; M]; M];
        let mut cross_sq = 0.0;
        for j in 0..M {
            for k in j + 1..M {
                let w = difference_of_products(right[j], left[k], right[k], left[j]);
                (wronskian[j][k], wronskian[k][j]) = (w, -w);
                cross_sq += w * w;
            }
        }
        Self { left, right, speed, wronskian, cross: cross_sq.sqrt() }
    }

    /// The least D on the piece.
    #[inline(always)]
    pub fn least_speed_sq(&self) -> f64 {
        let [d0, d1, d2] = self.speed;
        if d1 >= d0.min(d2) {
            d0.min(d2)
        } else {
            self.cross * self.cross / (d0 - 2.0 * d1 + d2)
        }
    }

    /// The tangent at t, from the nearer end.
    #[inline(always)]
    pub fn tangent(&self, t: f64) -> [f64; M] {
        if t == 0.0 {
            self.left
        } else if t == 1.0 {
            self.right
        } else if t <= 0.5 {
            std::array::from_fn(|k| self.left[k] + t * (self.right[k] - self.left[k]))
        } else {
            std::array::from_fn(|k| self.right[k] - (1.0 - t) * (self.right[k] - self.left[k]))
        }
    }
}

/// a b − c d without cancellation.
#[inline(always)]
fn difference_of_products(a: f64, b: f64, c: f64, d: f64) -> f64 {
    let (ab, cd) = (a * b, c * d);
    let difference = ab - cd;
    if difference.abs() >= CANCELLED * (ab.abs() + cd.abs()) {
        difference
    } else {
        difference + (rounding_error(a, b, ab) - rounding_error(c, d, cd))
    }
}

/// a b − (its rounded value), exactly (Dekker).
#[inline(never)]
fn rounding_error(a: f64, b: f64, rounded: f64) -> f64 {
    let halves = |x: f64| {
        let big = 134_217_729.0 * x;
        let high = big - (big - x);
        (high, x - high)
    };
    let ((a1, a0), (b1, b0)) = (halves(a), halves(b));
    ((a1 * b1 - rounded) + a1 * b0 + a0 * b1) + a0 * b0
}
