//! One piece of degree 2, its parameter t running from 0 to 1.

use super::turns::difference_of_products;
use crate::bang_bang::tolerance::ZERO;
use feedplan_geometry::quadratic::{dot, sub};

/// Tangents at the ends of a piece; the tangent is linear in t between them.
#[derive(Clone, Copy)]
pub struct Piece<const M: usize> {
    /// C' at t = 0 and t = 1
    pub left: [f64; M],
    pub right: [f64; M],
    /// D = |C'|² at the ends and, between them, its middle Bernstein coefficient
    pub speed: [f64; 3],
    /// W_jk = c_j q'_k − c_k q'_j, c = q'', constant along the piece
    pub minors: [[f64; M]; M],
    /// |C' × C''|, its length
    pub twist: f64,
}

impl<const M: usize> Piece<M> {
    /// The piece with these control points.
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
        let mut minors = [[0.0; M]; M];
        let mut twist_sq = 0.0;
        for j in 0..M {
            for k in j + 1..M {
                let minor = difference_of_products(right[j], left[k], right[k], left[j]);
                (minors[j][k], minors[k][j]) = (minor, -minor);
                twist_sq += minor * minor;
            }
        }
        Self { left, right, speed, minors, twist: twist_sq.sqrt() }
    }

    /// The least D on the piece.
    #[inline(always)]
    pub fn least_speed_sq(&self) -> f64 {
        let [d0, d1, d2] = self.speed;
        if d1 >= d0.min(d2) {
            d0.min(d2)
        } else {
            self.twist * self.twist / (d0 - 2.0 * d1 + d2)
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
