//! A curved sub-piece as a pass travels it: from x = 0 to x = `length`, every axis moving forward.
//!
//! On a sub-piece no axis turns round and one velocity cap is the lowest. Axes are reflected so that q' ≥ 0,
//! and the backward pass sees the path reversed; both passes are then the same computation. Symbols:
//! g = |q'|, c = g' = dg/dx (constant), p = (dx/dt)², s = p'/2, D = |g|², a_k = g_k s + c_k p.

use super::curve::{Curve, Denominator};
use super::piece::Piece;
use feedplan_geometry::quadratic::dot;

/// An axis whose tangent is below this part of the others', each measured by its acceleration limit, is as good as
/// turning round. Between s and p ≤ A_k/|c_k| a part eps/NEAR_TURN of the digits is lost.
pub const NEAR_TURN: f64 = 1e-6;

/// The limits of the axes, with what the passes need of them again and again.
pub struct Axes<const M: usize> {
    /// A, in mm/s²
    pub acceleration: [f64; M],
    /// 1/A
    pub inverse: [f64; M],
    /// The least A
    pub least: f64,
    /// V², in mm²/s²
    pub velocity_sq: [f64; M],
}

impl<const M: usize> Axes<M> {
    /// max g_k/A_k
    #[inline(always)]
    pub fn most_moved(&self, g: &[f64; M]) -> f64 {
        (0..M).fold(0.0, |most: f64, k| most.max(g[k] * self.inverse[k]))
    }

    /// The least A_k/|c_k| of the axes that turn round or nearly so where the tangent is g: the limit of p there.
    #[cold]
    pub fn limit_at_turns(&self, g: &[f64; M], c: &[f64; M]) -> f64 {
        let most = self.most_moved(g);
        (0..M)
            .filter(|&k| g[k] * self.inverse[k] <= NEAR_TURN * most)
            .fold(f64::INFINITY, |limit, k| limit.min(self.acceleration[k] / c[k].abs()))
    }
}

/// The lowest velocity cap of a sub-piece.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Cap {
    /// D p ≤ speed², in mm²/s²
    SpeedSq(f64),
    /// g_k² p ≤ speed², in mm²/s²
    AxisSq(u8, f64),
    /// p ≤ factor · √D: the chord-error limit
    Chord(f64),
}

/// How a sub-piece lies on its piece.
#[derive(Clone, Copy)]
pub struct Orientation<const M: usize> {
    /// −1 for axes that move backward on the piece.
    pub sign: [f64; M],
    /// −1 for the backward pass.
    pub travel: f64,
}

/// A sub-piece in the sense of travel.
pub struct SubPiece<'a, const M: usize> {
    pub length: f64,
    /// g at x = 0 and at x = length; exactly 0 where the axis turns round.
    pub start: [f64; M],
    pub end: [f64; M],
    /// c
    pub bend: [f64; M],
    /// W of the piece.
    minors: &'a [[f64; M]; M],
    orientation: Orientation<M>,
    /// D at the ends and, between them, its middle Bernstein coefficient.
    pub speed: [f64; 3],
    /// |C' × C''|
    pub twist: f64,
    /// min A_k/|c_k|: below it every constant p is feasible.
    pub flat: f64,
    pub cap: Cap,
}

impl<'a, const M: usize> SubPiece<'a, M> {
    /// From the tangents at both ends and the bend, as travelled.
    #[inline(always)]
    pub fn new(
        length: f64,
        [start, end]: [[f64; M]; 2],
        bend: [f64; M],
        piece: &'a Piece<M>,
        orientation: Orientation<M>,
        cap: Cap,
        axes: &Axes<M>,
    ) -> Self {
        let mut steepest = 0.0;
        for k in 0..M {
            steepest = f64::max(steepest, bend[k].abs() * axes.inverse[k]);
        }
        let speed = [dot(&start, &start), dot(&start, &end), dot(&end, &end)];
        let (minors, twist) = (&piece.minors, piece.twist);
        Self { length, start, end, bend, minors, orientation, speed, twist, flat: 1.0 / steepest, cap }
    }

    /// g_k at x, from the nearer end, so that it keeps its digits next to a zero.
    #[inline(always)]
    pub fn axis_tangent(&self, k: usize, x: f64) -> f64 {
        if x == 0.0 {
            self.start[k]
        } else if x == self.length {
            self.end[k]
        } else if x + x <= self.length {
            self.start[k] + self.bend[k] * x
        } else {
            self.end[k] - self.bend[k] * (self.length - x)
        }
    }

    /// g at x.
    #[inline(always)]
    pub fn tangent(&self, x: f64) -> [f64; M] {
        if x == 0.0 {
            self.start
        } else if x == self.length {
            self.end
        } else if x + x <= self.length {
            std::array::from_fn(|k| self.start[k] + self.bend[k] * x)
        } else {
            std::array::from_fn(|k| self.end[k] - self.bend[k] * (self.length - x))
        }
    }

    /// W_jk = c_j g_k − c_k g_j for all k: constant along the piece, antisymmetric, its sign exact.
    #[inline(always)]
    pub fn twists(&self, j: usize) -> [f64; M] {
        let Orientation { sign, travel } = &self.orientation;
        let factor = travel * sign[j];
        std::array::from_fn(|k| factor * sign[k] * self.minors[j][k])
    }

    /// The velocity cap at x.
    #[inline(always)]
    pub fn cap_at(&self, x: f64) -> f64 {
        match self.cap {
            Cap::SpeedSq(speed_sq) => speed_sq / self.speed_sq_at(x),
            Cap::AxisSq(k, speed_sq) => {
                let g = self.axis_tangent(k as usize, x);
                speed_sq / (g * g)
            }
            Cap::Chord(factor) => factor * self.speed_sq_at(x).sqrt(),
        }
    }

    #[inline(always)]
    fn speed_sq_at(&self, x: f64) -> f64 {
        if x == 0.0 {
            self.speed[0]
        } else if x == self.length {
            self.speed[2]
        } else {
            let g = self.tangent(x);
            dot(&g, &g)
        }
    }

    /// D on [a, b].
    #[inline(always)]
    pub fn speed_form(&self, a: f64, b: f64) -> [f64; 3] {
        if a == 0.0 && b == self.length {
            return self.speed;
        }
        let (ga, gb) = (self.tangent(a), self.tangent(b));
        [dot(&ga, &ga), dot(&ga, &gb), dot(&gb, &gb)]
    }

    /// The velocity cap on [a, b].
    #[inline(always)]
    pub fn cap_curve(&self, a: f64, b: f64) -> Curve {
        match self.cap {
            Cap::SpeedSq(speed_sq) => {
                Curve::Quotient { n: [speed_sq; 3], d: self.speed_form(a, b), tag: Denominator::SpeedSq }
            }
            Cap::AxisSq(k, speed_sq) => {
                let (ga, gb) = (self.axis_tangent(k as usize, a), self.axis_tangent(k as usize, b));
                let d = [ga * ga, ga * gb, gb * gb];
                Curve::Quotient { n: [speed_sq; 3], d, tag: Denominator::AxisSq(k) }
            }
            Cap::Chord(factor) => {
                Curve::Root { square: self.speed_form(a, b).map(|value| factor * factor * value) }
            }
        }
    }

    /// A lower bound of the cap on [a, b] from its values there.
    #[inline(always)]
    pub fn lowest_cap(&self, at_a: f64, at_b: f64) -> f64 {
        match self.cap {
            // D and g_k² are convex, so that their reciprocals are lowest at an end.
            Cap::SpeedSq(_) | Cap::AxisSq(..) => at_a.min(at_b),
            Cap::Chord(_) => 0.0,
        }
    }
}
