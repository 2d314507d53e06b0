//! Pace: the speed u̇ at which a curve C(u) is followed, and the energy of the curve's derivatives at that speed.
//!
//! Where u̇ changes slowly, the acceleration of axis k is C_k'' u̇² and its jerk C_k''' u̇³. The fit minimises the squares of
//! their differences from an aim, in parts of the limits A_k and J_k, integrated over time:
//!
//! ```text
//! Σ_k ∫ u̇³ (C_k'' − aim₂)²/A_k² + u̇⁵ (C_k''' − aim₃)²/J_k² du
//! ```
//!
//! So the curve may bend sharply where the tool is slow, and is smooth where it is fast.

use super::spline::{derivative_rows, gauss, Around, Form, Pull, ORDER};

/// Speed and aimed derivatives at a station.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Moment<const D: usize> {
    pub station: f64,
    /// u̇², in mm²/s².
    pub speed_sq: f64,
    /// The second and the third derivative that the curve should have, in 1/mm and 1/mm².
    pub aim: [[f64; D]; 2],
}

#[derive(Clone, Debug)]
pub struct Pace<const D: usize> {
    /// By ascending stations, with linear interpolation between them.
    moments: Vec<Moment<D>>,
    /// 1/A² and 1/J² of each axis.
    per_acceleration_sq: [f64; D],
    per_jerk_sq: [f64; D],
    /// Whether it is the pace of a given motion, not the default.
    pub fitted: bool,
}

impl<const D: usize> Default for Pace<D> {
    /// Constant speed, the same jerk limit for all axes, no acceleration limit.
    fn default() -> Self {
        let even = Moment { station: 0.0, speed_sq: 1.0, aim: [[0.0; D]; 2] };
        Self { moments: vec![even], per_acceleration_sq: [0.0; D], per_jerk_sq: [1.0; D], fitted: false }
    }
}

impl<const D: usize> Pace<D> {
    /// The pace through one moment or more, with the limits of each axis; limits of jerk may be infinite.
    pub fn new(moments: Vec<Moment<D>>, max_acceleration: [f64; D], max_jerk: [f64; D]) -> Self {
        let per_square = |limits: [f64; D]| limits.map(|limit| 1.0 / (limit * limit));
        Self {
            moments,
            per_acceleration_sq: per_square(max_acceleration),
            per_jerk_sq: per_square(max_jerk),
            fitted: true,
        }
    }

    /// The same pace with stations counted from `station`.
    pub fn from(&self, station: f64) -> Self {
        let shifted = |at: &Moment<D>| Moment { station: at.station - station, ..*at };
        Self { moments: self.moments.iter().map(shifted).collect(), ..*self }
    }

    fn at(&self, u: f64) -> Moment<D> {
        let after = self.moments.partition_point(|at| at.station <= u);
        if after == 0 || after == self.moments.len() {
            return self.moments[after.max(1) - 1];
        }
        let (a, b) = (&self.moments[after - 1], &self.moments[after]);
        let part = (u - a.station) / (b.station - a.station);
        let between = |a: &[f64; D], b: &[f64; D]| std::array::from_fn(|k| a[k] + (b[k] - a[k]) * part);
        Moment {
            station: u,
            speed_sq: a.speed_sq + (b.speed_sq - a.speed_sq) * part,
            aim: [0, 1].map(|order| between(&a.aim[order], &b.aim[order])),
        }
    }

    /// The weights of the squares of the second and the third derivative of axis k.
    fn weights(&self, at: &Moment<D>, k: usize) -> [f64; 2] {
        let cube = at.speed_sq * at.speed_sq.sqrt();
        [self.per_acceleration_sq[k] * cube, self.per_jerk_sq[k] * cube * at.speed_sq]
    }

    /// The energy of each axis in an interval: its matrix in the six coefficients of the interval, and the pull of its aims on
    /// them (the linear part).
    pub fn energy(&self, t: &Around) -> ([Form; D], [Pull; D]) {
        let derivatives = derivative_rows(t);
        let (mut forms, mut pulls) = ([[[0.0; ORDER]; ORDER]; D], [[0.0; ORDER]; D]);
        for (u, part) in gauss(t) {
            let (at, rows) = (self.at(u), derivatives(u));
            for k in 0..D {
                let weights = self.weights(&at, k).into_iter().zip(rows).zip(at.aim);
                for ((weight, row), aim) in weights.filter(|((weight, _), _)| *weight > 0.0) {
                    for a in 0..ORDER {
                        let share = weight * part * row[a];
                        pulls[k][a] += share * aim[k];
                        for b in 0..ORDER {
                            forms[k][a][b] += share * row[b];
                        }
                    }
                }
            }
        }
        (forms, pulls)
    }

    /// The energy per length of a curve with C''' = 1 and C'' = h in an interval of length h, for the axis for which it is
    /// greatest.
    pub fn density(&self, u: f64, h: f64) -> f64 {
        let at = self.at(u);
        let of = |k: usize| {
            let [second, third] = self.weights(&at, k);
            second * h * h + third
        };
        (0..D).map(of).fold(0.0, f64::max)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_energy_of_a_motion_is_that_over_time() {
        // u = t + t²/2 from t = 0 to 1: u̇² = 1 + 2u. An interval far from others, knots on even steps.
        let at = |station: f64, speed_sq: f64| Moment { station, speed_sq, aim: [[0.0; 2]; 2] };
        let moments = (0..=300).map(|i| 0.005 * f64::from(i)).map(|u| at(u, 1.0 + 2.0 * u)).collect();
        let pace = Pace::<2>::new(moments, [2.0, 4.0], [3.0, f64::INFINITY]);
        let t: Around = std::array::from_fn(|k| 1.5 * (k as f64 - 4.0));
        let (forms, pull) = pace.energy(&t);
        assert_eq!(pull, [[0.0; 6]; 2]);
        // C = u³ as coefficients: the blossom at five knots.
        let coefficient: [f64; 6] = std::array::from_fn(|i| {
            let knots: [f64; 5] = std::array::from_fn(|k| 1.5 * (i as f64 + k as f64 - 4.0));
            let mut sum = 0.0;
            for a in 0..5 {
                for b in a + 1..5 {
                    for c in b + 1..5 {
                        sum += knots[a] * knots[b] * knots[c];
                    }
                }
            }
            sum / 10.0
        });
        let of = |form: &Form| -> f64 {
            (0..6).map(|a| (0..6).map(|b| coefficient[a] * form[a][b] * coefficient[b]).sum::<f64>()).sum()
        };
        let integral = |f: &dyn Fn(f64) -> f64| {
            (0..30000).map(|i| (i as f64 + 0.5) / 20000.0).map(f).sum::<f64>() / 20000.0
        };
        let second = integral(&|u| (1.0 + 2.0 * u).powf(1.5) * (6.0 * u).powi(2));
        let third = integral(&|u| (1.0 + 2.0 * u).powf(2.5) * 36.0);
        assert!((of(&forms[0]) / (second / 4.0 + third / 9.0) - 1.0).abs() < 1e-4);
        assert!((of(&forms[1]) / (second / 16.0) - 1.0).abs() < 1e-4);
        // At u = 0.5 with h = 2: u̇² = 2.
        let density = pace.density(0.5, 2.0);
        assert!((density - 2f64.powf(1.5) * (1.0 + 2.0 / 9.0)).abs() < 1e-9, "{density}");
        // A part begins at its own 0.
        assert_eq!(pace.from(0.5).at(0.25).speed_sq, pace.at(0.75).speed_sq);
        // A curve with the derivatives that are aimed at is pulled back as its energy pushes it.
        let aimed = |u: f64| Moment { aim: [[6.0 * u; 2], [6.0; 2]], ..at(u, 1.0 + 2.0 * u) };
        let (forms, pull) =
            Pace::new((0..=300).map(|i| aimed(0.005 * f64::from(i))).collect(), [2.0, 4.0], [3.0; 2])
                .energy(&t);
        for k in 0..2 {
            for a in 0..6 {
                let push: f64 = (0..6).map(|b| forms[k][a][b] * coefficient[b]).sum();
                assert!((push - pull[k][a]).abs() < 1e-9 * forms[k][a][a] * 10.0, "{push} {}", pull[k][a]);
            }
        }
    }
}
