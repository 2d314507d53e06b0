//! Pace: the speed u̇ at which a curve C(u) is followed, and what its derivatives cost at that speed.
//!
//! Where u̇ changes slowly, the acceleration of axis k is C_k'' u̇² and its jerk C_k''' u̇³. The squares of both, in parts of
//! the limits A_k and J_k, summed over time, are the energy that the fit makes least:
//!
//! ```text
//! Σ_k ∫ (C_k'' u̇²/A_k)² + (C_k''' u̇³/J_k)² dt = Σ_k ∫ u̇³ C_k''²/A_k² + u̇⁵ C_k'''²/J_k² du
//! ```
//!
//! Where the tool is slow the curve may bend sharply, and where it is fast it is smooth.

use super::spline::{energies, Around, Form};

/// The speed counts as at least this part of the greatest: where one plan stops, the next need not.
const LEAST: f64 = 0.2;

#[derive(Clone, Debug)]
pub struct Pace<const D: usize> {
    /// Stations, ascending, with u̇² there; between them it is linear.
    table: Vec<[f64; 2]>,
    /// 1/A² and 1/J² of each axis.
    per_acceleration_sq: [f64; D],
    per_jerk_sq: [f64; D],
    /// It is that of a motion.
    pub fitted: bool,
}

impl<const D: usize> Default for Pace<D> {
    /// The same speed everywhere, limits of jerk that are the same for all axes and none of acceleration.
    fn default() -> Self {
        Self { table: vec![[0.0, 1.0]], per_acceleration_sq: [0.0; D], per_jerk_sq: [1.0; D], fitted: false }
    }
}

impl<const D: usize> Pace<D> {
    /// From stations with u̇², at least one, and the limits of each axis, of which those of jerk may be infinite.
    pub fn new(mut table: Vec<[f64; 2]>, max_acceleration: [f64; D], max_jerk: [f64; D]) -> Self {
        let greatest = table.iter().fold(0.0, |most: f64, [_, square]| most.max(*square));
        for [_, square] in &mut table {
            *square = square.max(LEAST * LEAST * greatest);
        }
        let per_square = |limits: [f64; D]| limits.map(|limit| 1.0 / (limit * limit));
        Self {
            table,
            per_acceleration_sq: per_square(max_acceleration),
            per_jerk_sq: per_square(max_jerk),
            fitted: true,
        }
    }

    /// The pace from a station on, its stations from 0.
    pub fn from(&self, station: f64) -> Self {
        Self { table: self.table.iter().map(|[u, square]| [u - station, *square]).collect(), ..*self }
    }

    fn square(&self, u: f64) -> f64 {
        let after = self.table.partition_point(|[station, _]| *station <= u);
        if after == 0 || after == self.table.len() {
            return self.table[after.max(1) - 1][1];
        }
        let ([u0, square0], [u1, square1]) = (self.table[after - 1], self.table[after]);
        square0 + (square1 - square0) * (u - u0) / (u1 - u0)
    }

    /// The energy of each axis in an interval: the matrix of its form in the coefficients that the interval sees.
    pub fn energy(&self, t: &Around) -> [Form; D] {
        let [second, third] = energies(t, |u| {
            let square = self.square(u);
            let cube = square * square.sqrt();
            [cube, cube * square]
        });
        std::array::from_fn(|k| {
            let (a, j) = (self.per_acceleration_sq[k], self.per_jerk_sq[k]);
            std::array::from_fn(|row| std::array::from_fn(|i| a * second[row][i] + j * third[row][i]))
        })
    }

    /// The energy per length of a curve with C''' = 1 and C'' = h in an interval of length h, for the axis for which it is
    /// greatest.
    pub fn density(&self, u: f64, h: f64) -> f64 {
        let square = self.square(u);
        let cube = square * square.sqrt();
        let of = |k: usize| cube * (self.per_acceleration_sq[k] * h * h + self.per_jerk_sq[k] * square);
        (0..D).map(of).fold(0.0, f64::max)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_energy_of_a_motion_is_that_over_time() {
        // u = t + t²/2 from t = 0 to 1: u̇² = 1 + 2u. An interval far from others, knots on even steps.
        let table = (0..=300).map(|i| 0.005 * f64::from(i)).map(|u| [u, 1.0 + 2.0 * u]).collect();
        let pace = Pace::<2>::new(table, [2.0, 4.0], [3.0, f64::INFINITY]);
        let t: Around = std::array::from_fn(|k| 1.5 * (k as f64 - 4.0));
        let forms = pace.energy(&t);
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
        // A part begins at its own 0, and what is slow counts as 0.2 of the greatest speed.
        assert_eq!(pace.from(0.5).square(0.25), pace.square(0.75));
        assert_eq!(
            Pace::<2>::new(vec![[0.0, 0.0], [1.0, 4.0]], [1.0; 2], [1.0; 2]).square(0.0),
            0.2 * 0.2 * 4.0
        );
    }
}
