//! Finds the places of an arc or helix nearest to a point: the zeros of the slope of the squared distance along the arc. Each
//! zero is bracketed by an interval on which the slope is monotone, found from the zeros of its first and second rates.

use std::f64::consts::{PI, TAU};

/// The geometry of an arc or helix: it turns in the plane of the axes `a` and `b`; all other axes move linearly.
#[derive(Clone, Copy, Debug)]
pub struct Arc {
    pub a: usize,
    pub b: usize,
    pub centre: [f64; 2],
    pub start_angle: f64,
    pub sweep: f64,
    /// Radius at the start, and its change up to the end: the ends are rounded numbers of the program.
    pub radius: f64,
    pub widening: f64,
}

/// A Newton step below this angle, in rad, is the last one: the error after it is about its square.
const CLOSE: f64 = 1e-8;

/// Limit of the steps towards a root; bisection alone needs some 55.
const MOST_STEPS: usize = 100;

/// The slope (P(t) − q)·P'(t) on an arc or helix P, t in [0, 1]: the distance has a local minimum where the slope changes from
/// negative to positive.
pub struct ArcSlope {
    arc: Arc,
    /// Vector from the centre to `q` in the plane, and the angle from it to the start point, counted along the arc.
    arm: [f64; 2],
    behind: f64,
    /// In the axes off the plane: the squared displacement of the arc, and its inner product with the vector from its start to
    /// `q`.
    rise_sq: f64,
    risen: f64,
}

/// The slope and its first three rates at `t`.
#[derive(Clone, Copy)]
pub struct Rates {
    pub t: f64,
    pub rates: [f64; 4],
}

impl ArcSlope {
    /// For an arc from `start` to `end` and the point `q`.
    pub fn new<const M: usize>([start, end]: [&[f64; M]; 2], arc: &Arc, q: &[f64; M]) -> Self {
        let arm = [q[arc.a] - arc.centre[0], q[arc.b] - arc.centre[1]];
        let behind = (arc.start_angle - arm[1].atan2(arm[0])) * arc.sweep.signum();
        let (mut rise_sq, mut risen) = (0.0, 0.0);
        for k in (0..M).filter(|&k| k != arc.a && k != arc.b) {
            let rise = end[k] - start[k];
            rise_sq += rise * rise;
            risen += rise * (q[k] - start[k]);
        }
        Self { arc: *arc, arm, behind, rise_sq, risen }
    }

    /// The t at the angle of `q`, on the turn whose height is nearest to that of `q`.
    pub fn beside(&self) -> f64 {
        let level = if self.rise_sq > 0.0 { self.risen / self.rise_sq } else { 0.0 };
        let sweep = self.arc.sweep.abs();
        let turn = ((self.behind + level.clamp(0.0, 1.0) * sweep) / TAU).round();
        ((turn * TAU - self.behind) / sweep).clamp(0.0, 1.0)
    }

    /// Lower bound of the distance of `q` from the arc between two t, from the axes off the plane alone.
    pub fn off_height(&self, from: f64, to: f64) -> f64 {
        let outside = (from * self.rise_sq - self.risen).max(self.risen - to * self.rise_sq);
        if outside > 0.0 {
            outside / self.rise_sq.sqrt()
        } else {
            0.0
        }
    }

    /// Cuts the arc at the angles square to that of `q`, and calls `each` with the ends of every part.
    ///
    /// The second rate is 0 where tan φ = 3 widening / (|sweep| radius), φ the angle from `q` counted along the arc. In each part
    /// tan φ rises from −∞ to ∞, and the right side falls or stays 0, so the second rate has at most one zero there.
    pub fn each_half_turn(&self, mut each: impl FnMut(&Rates, &Rates)) {
        let mut half_turn = (self.behind / PI - 0.5).floor() + 0.5;
        let mut from = self.at(0.0);
        while from.t < 1.0 {
            half_turn += 1.0;
            let to = self.at(((half_turn * PI - self.behind) / self.arc.sweep.abs()).min(1.0));
            each(&from, &to);
            from = to;
        }
    }

    fn at(&self, t: f64) -> Rates {
        let Arc { sweep, widening, .. } = self.arc;
        let radius = self.arc.radius + t * widening;
        let (sin, cos) = (self.arc.start_angle + t * sweep).sin_cos();
        // `q` seen from the centre: along the radius and across it.
        let along = self.arm[0] * cos + self.arm[1] * sin;
        let across = self.arm[1] * cos - self.arm[0] * sin;
        let way_sq = widening * widening + self.rise_sq;
        let slope = widening * (radius - along) - sweep * radius * across + (t * self.rise_sq - self.risen);
        let first = way_sq + sweep * (sweep * radius * along - 2.0 * widening * across);
        let second = sweep * sweep * (3.0 * widening * along + sweep * radius * across);
        let third = sweep.powi(3) * (4.0 * widening * across - sweep * radius * along);
        Rates { t, rates: [slope, first, second, third] }
    }

    /// The zero of rate `K`, which is monotone between two places: Newton's method, with bisection where a step leaves the
    /// bracket. Returns `to` where the rate does not change its sign.
    pub fn root<const K: usize>(&self, from: &Rates, to: &Rates) -> Rates {
        let falls = from.rates[K] > 0.0;
        if from.rates[K] * to.rates[K] >= 0.0 {
            return *to;
        }
        let (mut a, mut b) = (from.t, to.t);
        let close = CLOSE / self.arc.sweep.abs().max(1.0);
        let mut here = self.at(a + (b - a) * (from.rates[K] / (from.rates[K] - to.rates[K])));
        for _ in 0..MOST_STEPS {
            if (here.rates[K] > 0.0) == falls {
                a = here.t;
            } else {
                b = here.t;
            }
            let step = here.rates[K] / here.rates[K + 1];
            let newton = here.t - step;
            let strays = !(newton >= a && newton <= b);
            here = self.at(if strays { 0.5 * (a + b) } else { newton });
            if (!strays && step.abs() <= close) || here.t <= a || here.t >= b {
                break;
            }
        }
        here
    }
}
