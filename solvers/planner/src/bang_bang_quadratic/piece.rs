//! One piece of the path, its parameter t running from 0 to 1: straight or curved.

use super::subpiece::Axes;
use super::turns::difference_of_products;
use feedplan_geometry::quadratic::{dot, norm, Quadratic};

/// Tangents whose cross product is below this part of the square of the longer one are parallel to rounding.
const PARALLEL: f64 = 1e-15;
/// A tangent shorter than this part of the other one is its rounding: it has no direction.
const ROUNDING: f64 = 1e-13;
/// Parallel tangents differ in direction by less, in rad.
const ALIGNED: f64 = 1e-9;
/// A piece is straight if bending it back changes no acceleration by more than this part of the least limit.
const STRAIGHT: f64 = 1e-13;

/// A tangent component this small beside the whole tangent and the component at the other end is zero.
const ZERO: f64 = 1e-14;

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
    #[inline(always)]
    pub fn new(piece: &Quadratic<M>) -> Self {
        let (mut left, mut right) = piece.tangents();
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

    /// Whether the piece is planned as a straight line.
    #[inline(always)]
    pub fn is_straight(&self, feed: f64, least_acceleration: f64) -> bool {
        let [d0, d1, d2] = self.speed;
        let (shorter, longer) = (d0.min(d2), d0.max(d2));
        if self.twist <= PARALLEL * longer {
            // Where the shorter tangent has a direction, it must be that of the longer one.
            return shorter <= ROUNDING * ROUNDING * longer
                || self.twist * self.twist <= ALIGNED * ALIGNED * shorter * longer;
        }
        // The normal acceleration feed²/ρ, ρ = D^1.5/|W|, and the turn of the tangent.
        let least = d0.min(d1).min(d2);
        least > 0.0
            && self.twist <= STRAIGHT * least
            && self.twist * feed * feed <= STRAIGHT * least_acceleration * least * least.sqrt()
    }

    /// The unit tangent at an end, at a cusp there its limit.
    pub fn direction(&self, at_right: bool) -> [f64; M] {
        let other = if at_right { self.speed[2] == 0.0 } else { self.speed[0] == 0.0 };
        let here = if at_right != other { &self.right } else { &self.left };
        let length = norm(here);
        here.map(|value| value / length)
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

/// A straight piece: C' = direction · r(t), r linear; where r changes sign the motion turns back.
pub struct Straight {
    /// |r| at t = 0 and t = 1
    pub rate: [f64; 2],
    /// Where the motion turns back, if it does.
    pub turn: Option<f64>,
    /// Greatest acceleration along the line and the axis that sets it.
    pub acceleration: f64,
    pub axis: usize,
    /// Sign of that axis's tangent before and after the turn.
    pub sign: [f64; 2],
    /// Square of the greatest speed, and the axis that sets it, None for the feed.
    pub speed_sq: f64,
    pub speed_axis: Option<usize>,
    /// Square of that axis's velocity limit.
    pub axis_speed_sq: f64,
}

impl Straight {
    #[inline(always)]
    pub fn new<const M: usize>(piece: &Piece<M>, axes: &Axes<M>, feed_sq: f64) -> Self {
        let turns = piece.speed[1] < 0.0;
        let (left, right) = (&piece.left, &piece.right);
        // The difference of the ends is the direction after the turn, their sum the common direction without one.
        let sum: [f64; M] =
            std::array::from_fn(|k| if turns { right[k] - left[k] } else { right[k] + left[k] });
        let length = norm(&sum);
        let mut slowest = (0.0, 0);
        let (mut speed_sq, mut speed_axis) = (feed_sq, None);
        for k in 0..M {
            let component = sum[k].abs() / length;
            let need = component * axes.inverse[k];
            if need > slowest.0 {
                slowest = (need, k);
            }
            if component * component * speed_sq > axes.velocity_sq[k] {
                speed_sq = axes.velocity_sq[k] / (component * component);
                speed_axis = Some(k);
            }
        }
        let rate = [piece.speed[0].sqrt(), piece.speed[2].sqrt()];
        let sign = if sum[slowest.1] < 0.0 { -1.0 } else { 1.0 };
        Self {
            rate,
            turn: turns.then(|| rate[0] / (rate[0] + rate[1])),
            acceleration: 1.0 / slowest.0,
            axis: slowest.1,
            sign: [if turns { -sign } else { sign }, sign],
            speed_sq,
            speed_axis,
            axis_speed_sq: speed_axis.map_or(0.0, |k| axes.velocity_sq[k]),
        }
    }
}
