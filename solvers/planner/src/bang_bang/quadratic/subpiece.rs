//! A sub-piece of a quadratic piece: a part as a pass travels it, from x = 0 to x = `length`.
//!
//! Axes are reflected so that g ≥ 0, and the backward pass sees the path reversed; so both passes are the same
//! computation. Here g = |q'|, c = g' (constant), and a_k = g_k s + c_k p. Symbols: `bang_bang`.

use super::piece::Piece;
use super::quotient::{Denominator, Quotient};
use crate::bang_bang::tolerance::NEAR_TURN;
use feedplan_geometry::elementary::Elementary;
use feedplan_geometry::quadratic::dot;

/// The limits of the axes, and values computed from them.
pub struct Axes<const M: usize> {
    /// A_k [mm/s²].
    pub acceleration: [f64; M],
    /// 1/A_k.
    pub inverse: [f64; M],
    /// The least A_k.
    pub least: f64,
    /// V_k² [mm²/s²].
    pub velocity_sq: [f64; M],
}

impl<const M: usize> Axes<M> {
    /// From the limits of acceleration and velocity, the same in both directions.
    pub fn new(acceleration: [f64; M], velocity: [f64; M]) -> Self {
        Self {
            acceleration,
            inverse: acceleration.map(|a| 1.0 / a),
            least: acceleration.iter().fold(f64::INFINITY, |least, &a| least.min(a)),
            velocity_sq: velocity.map(|v| v * v),
        }
    }

    /// max g_k/A_k.
    #[inline(always)]
    pub fn greatest_scaled_tangent(&self, g: &[f64; M]) -> f64 {
        (0..M).fold(0.0, |most: f64, k| most.max(g[k] * self.inverse[k]))
    }

    /// The least A_k/|c_k| of the axes that turn, or nearly turn, where the tangent is g: the limit of p there.
    #[cold]
    pub fn limit_at_turns(&self, g: &[f64; M], c: &[f64; M]) -> f64 {
        let most = self.greatest_scaled_tangent(g);
        (0..M)
            .filter(|&k| g[k] * self.inverse[k] <= NEAR_TURN * most)
            .fold(f64::INFINITY, |limit, k| limit.min(self.acceleration[k] / c[k].abs()))
    }
}

/// The lowest cap of a sub-piece.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Cap {
    /// D p is at most this v² [mm²/s²], linear in x between the ends: the feed, or a line of the chord-error limit.
    Speed([f64; 2]),
    /// g_k² p is at most this square of a velocity limit [mm²/s²].
    Axis(usize, f64),
}

impl Cap {
    /// Whether this cap is the given cap of an axis; None stands for any cap of the tool's speed.
    pub fn goes_on(&self, axis: Option<Self>) -> bool {
        axis.map_or(matches!(self, Self::Speed(_)), |cap| *self == cap)
    }

    /// The cap in the direction of the opposite pass.
    #[inline(always)]
    pub fn reversed(self) -> Self {
        match self {
            Self::Speed([f0, f1]) => Self::Speed([f1, f0]),
            cap => cap,
        }
    }
}

/// The reflections between a piece and a sub-piece.
#[derive(Clone, Copy)]
pub struct Orientation<const M: usize> {
    /// −1 for axes that move backward on the piece.
    pub sign: [f64; M],
    /// −1 for the backward pass.
    pub travel: f64,
}

pub struct SubPiece<'a, const M: usize> {
    pub length: f64,
    /// g at x = 0 and at x = length; exactly 0 where the axis turns.
    pub start: [f64; M],
    pub end: [f64; M],
    pub c: [f64; M],
    /// W_jk of the piece.
    wronskian: &'a [[f64; M]; M],
    orientation: Orientation<M>,
    /// Bernstein coefficients of D.
    pub speed: [f64; 3],
    /// |C' × C''|.
    pub cross: f64,
    /// min A_k/|c_k|: below it every constant p is feasible.
    pub flat: f64,
    pub cap: Cap,
}

impl<'a, const M: usize> SubPiece<'a, M> {
    /// From the tangents at both ends and c, in the direction of travel.
    #[inline(always)]
    pub fn new(
        length: f64,
        [start, end]: [[f64; M]; 2],
        c: [f64; M],
        piece: &'a Piece<M>,
        orientation: Orientation<M>,
        cap: Cap,
        axes: &Axes<M>,
    ) -> Self {
        let mut steepest = 0.0;
        for k in 0..M {
            steepest = f64::max(steepest, c[k].abs() * axes.inverse[k]);
        }
        let speed = [dot(&start, &start), dot(&start, &end), dot(&end, &end)];
        let (wronskian, cross) = (&piece.wronskian, piece.cross);
        Self { length, start, end, c, wronskian, orientation, speed, cross, flat: 1.0 / steepest, cap }
    }

    /// g_k at x, computed from the nearer end to keep its digits next to a zero.
    #[inline(always)]
    pub fn axis_tangent(&self, k: usize, x: f64) -> f64 {
        if x == 0.0 {
            self.start[k]
        } else if x == self.length {
            self.end[k]
        } else if x + x <= self.length {
            self.start[k] + self.c[k] * x
        } else {
            self.end[k] - self.c[k] * (self.length - x)
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
            std::array::from_fn(|k| self.start[k] + self.c[k] * x)
        } else {
            std::array::from_fn(|k| self.end[k] - self.c[k] * (self.length - x))
        }
    }

    /// W_jk for all k; antisymmetric, with exact signs.
    #[inline(always)]
    pub fn wronskians(&self, j: usize) -> [f64; M] {
        let Orientation { sign, travel } = &self.orientation;
        let factor = travel * sign[j];
        std::array::from_fn(|k| factor * sign[k] * self.wronskian[j][k])
    }

    /// p of the cap at x.
    #[inline(always)]
    pub fn cap_at(&self, x: f64) -> f64 {
        match self.cap {
            Cap::Speed(_) => self.speed_sq_of_cap(x) / self.speed_sq_at(x),
            Cap::Axis(k, speed_sq) => {
                let g = self.axis_tangent(k, x);
                speed_sq / (g * g)
            }
        }
    }

    /// v² of the cap at x if it is one of the tool's speed, else infinity.
    #[inline(always)]
    pub fn speed_sq_of_cap(&self, x: f64) -> f64 {
        match self.cap {
            Cap::Speed([f0, f1]) if f0 == f1 || x == 0.0 => f0,
            Cap::Speed([_, f1]) if x == self.length => f1,
            Cap::Speed([f0, f1]) => f0 + (f1 - f0) * (x / self.length),
            Cap::Axis(..) => f64::INFINITY,
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

    /// Bernstein coefficients of D on [a, b].
    #[inline(always)]
    pub fn speed_form(&self, a: f64, b: f64) -> [f64; 3] {
        if a == 0.0 && b == self.length {
            return self.speed;
        }
        let (ga, gb) = (self.tangent(a), self.tangent(b));
        [dot(&ga, &ga), dot(&ga, &gb), dot(&gb, &gb)]
    }

    /// The cap on [a, b].
    #[inline(always)]
    pub fn cap_quotient(&self, a: f64, b: f64) -> Quotient {
        match self.cap {
            Cap::Speed(_) => {
                let (fa, fb) = (self.speed_sq_of_cap(a), self.speed_sq_of_cap(b));
                let n = [fa, 0.5 * (fa + fb), fb];
                Quotient { n, d: self.speed_form(a, b), denominator: Denominator::SpeedSq }
            }
            Cap::Axis(k, speed_sq) => {
                let (ga, gb) = (self.axis_tangent(k, a), self.axis_tangent(k, b));
                let d = [ga * ga, ga * gb, gb * gb];
                Quotient { n: [speed_sq; 3], d, denominator: Denominator::AxisSq(k) }
            }
        }
    }

    /// A lower bound of p of the cap on [a, b] from its values at the ends.
    #[inline(always)]
    pub fn lowest_cap(&self, at_a: f64, at_b: f64) -> f64 {
        match self.cap {
            Cap::Speed([f0, f1]) if f0 != f1 => 0.0,
            // D and g_k² are convex, so their reciprocals are least at an end.
            _ => at_a.min(at_b),
        }
    }

    /// Length [mm] of the path on [a, b].
    ///
    /// With r = |C'| at both ends, R = r₀ + r₁, E = |C''|, t = C'·C''/E, d² = r² − t², x = E h/R: (h/R) [(R² + (t₀ +
    /// t₁)²)/4 + d² atanh(x)/x].
    #[inline(always)]
    pub fn arc_length(&self, a: f64, b: f64) -> f64 {
        let (ga, gb) = (self.tangent(a), self.tangent(b));
        let [da, _, db] = self.speed_form(a, b);
        // x = |gb − ga|/R, with E h for the difference.
        let h = b - a;
        let c_sq = dot(&self.c, &self.c);
        let r = da.sqrt() + db.sqrt();
        let x_sq = c_sq * h * h / (r * r);
        let (ta, tb) = (dot(&ga, &self.c), dot(&gb, &self.c));
        let t_sq = (ta + tb) * (ta + tb) / c_sq;
        let distance_sq = (0.5 * ((da - ta * ta / c_sq) + (db - tb * tb / c_sq))).max(0.0);
        h / r * (0.25 * (r * r + t_sq) + distance_sq * atanh_over(x_sq))
    }
}

/// atanh(x)/x as a function of x².
#[inline(always)]
fn atanh_over(x_sq: f64) -> f64 {
    if x_sq < 0.01 {
        let odd = [1.0, 3.0, 5.0, 7.0, 9.0, 11.0, 13.0, 15.0];
        odd.iter().rev().fold(0.0, |sum, n| sum * x_sq + 1.0 / n)
    } else if x_sq < 1.0 {
        let x = x_sq.sqrt();
        0.5 * ((1.0 + x) / (1.0 - x)).natural_log() / x
    } else {
        // The tangent reverses, so d² is 0.
        0.0
    }
}
