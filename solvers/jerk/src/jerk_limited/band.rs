//! LDLᵀ factor of the Newton matrix, a symmetric banded matrix: two unknowns (w, w') per station, coupled with those of
//! the neighbouring stations.
//!
//! The matrix is scaled to a unit diagonal. The two unknowns of an end are tied to each other (w' = k w, where the path
//! is at rest beyond the ramp), take given steps (where w and w' are given), or are free.

/// How the unknowns of an end may change.
#[derive(Clone, Copy, Debug)]
pub enum EndCondition {
    /// dw' = k dw.
    Slope(f64),
    /// dw and dw' are given with each right-hand side.
    Given,
    Free,
}

/// Added to the unit diagonal, as rounding may take this much from it.
const REGULAR: f64 = 1e-13;

/// The blocks of the matrix and, after `factor`, those of its factor.
#[derive(Default)]
pub struct Band {
    /// (a, b, c) of the symmetric block [a b; b c] of each station.
    pub diagonal: Vec<[f64; 3]>,
    /// Rows of the block that couples station i with station i + 1: [00 01 10 11].
    pub coupling: Vec<[f64; 4]>,
    conditions: Option<[EndCondition; 2]>,
    /// Couplings of the given ends with their neighbours.
    given: [[f64; 4]; 2],
    scale: Vec<[f64; 2]>,
    /// (1/d0, l, 1/d1) of each station, and the rows of L that couple the next station with it: [00 01 10 11].
    factor: Vec<([f64; 3], [f64; 4])>,
    work: Vec<[f64; 2]>,
}

impl Band {
    /// A zero matrix for this many stations.
    #[inline(always)]
    pub fn clear(&mut self, stations: usize) {
        self.diagonal.clear();
        self.diagonal.resize(stations, [0.0; 3]);
        self.coupling.clear();
        self.coupling.resize(stations - 1, [0.0; 4]);
        self.factor.resize(stations, Default::default());
        self.scale.resize(stations, [0.0; 2]);
        self.work.resize(stations, [0.0; 2]);
    }

    /// Adds the matrix of interval n, of length h, in its local coefficients (w, h w') at both ends.
    #[inline(always)]
    pub fn add(&mut self, n: usize, h: f64, m: &[[f64; 4]; 4]) {
        for (station, k) in [(n, 0), (n + 1, 2)] {
            let d = &mut self.diagonal[station];
            d[0] += m[k][k];
            d[1] += m[k][k + 1] * h;
            d[2] += m[k + 1][k + 1] * h * h;
        }
        self.coupling[n] = [m[0][2], m[0][3] * h, m[1][2] * h, m[1][3] * h * h];
    }

    /// Factors the matrix under both end conditions; false if it is not positive definite.
    #[inline(always)]
    pub fn factor(&mut self, conditions: [EndCondition; 2]) -> bool {
        self.conditions = Some(conditions);
        self.apply(conditions);
        let last = self.diagonal.len() - 1;
        for (scale, d) in self.scale.iter_mut().zip(&self.diagonal) {
            *scale = [1.0 / d[0].sqrt(), 1.0 / d[2].sqrt()];
        }
        let mut less = [0.0f64; 3];
        for i in 0..=last {
            let [s0, s1] = self.scale[i];
            let [a, b, c] = self.diagonal[i];
            let d0 = a * s0 * s0 + REGULAR - less[0];
            let b = b * s0 * s1 - less[1];
            if d0.is_nan() || d0 <= 0.0 {
                return false;
            }
            let per_d0 = 1.0 / d0;
            let l = b * per_d0;
            let d1 = c * s1 * s1 + REGULAR - less[2] - b * l;
            if d1.is_nan() || d1 <= 0.0 {
                return false;
            }
            let per_d1 = 1.0 / d1;
            let mut rows = [0.0; 4];
            if i < last {
                let [t0, t1] = self.scale[i + 1];
                let o = self.coupling[i];
                let (y00, y10) = (o[0] * s0 * t0, o[1] * s0 * t1);
                let (y01, y11) = (o[2] * s1 * t0 - l * y00, o[3] * s1 * t1 - l * y10);
                rows = [y00 * per_d0, y01 * per_d1, y10 * per_d0, y11 * per_d1];
                less = [
                    y00 * rows[0] + y01 * rows[1],
                    y00 * rows[2] + y01 * rows[3],
                    y10 * rows[2] + y11 * rows[3],
                ];
            }
            self.factor[i] = ([per_d0, l, per_d1], rows);
        }
        true
    }

    #[inline(always)]
    fn apply(&mut self, conditions: [EndCondition; 2]) {
        let last = self.diagonal.len() - 1;
        for (end, condition) in conditions.into_iter().enumerate() {
            let (station, link) = if end == 0 { (0, 0) } else { (last, last - 1) };
            let o = &mut self.coupling[link];
            match condition {
                EndCondition::Slope(k) => {
                    let [a, b, c] = self.diagonal[station];
                    self.diagonal[station] = [a + 2.0 * k * b + k * k * c, 0.0, 1.0];
                    *o = if end == 0 {
                        [o[0] + k * o[2], o[1] + k * o[3], 0.0, 0.0]
                    } else {
                        [o[0] + k * o[1], 0.0, o[2] + k * o[3], 0.0]
                    };
                }
                EndCondition::Given => {
                    self.given[end] = *o;
                    *o = [0.0; 4];
                    self.diagonal[station] = [1.0, 0.0, 1.0];
                }
                EndCondition::Free => {}
            }
        }
    }

    /// Solves for the step `out` (pairs dw, dw' flat) with right-hand side `rhs`; `ends` holds the given steps.
    #[inline(always)]
    pub fn solve(&mut self, rhs: &[f64], ends: [[f64; 2]; 2], out: &mut [f64]) {
        let conditions = self.conditions.expect("the matrix is factored first");
        let last = self.diagonal.len() - 1;
        for (z, r) in self.work.iter_mut().zip(rhs.chunks_exact(2)) {
            *z = [r[0], r[1]];
        }
        for (end, condition) in conditions.into_iter().enumerate() {
            let (station, next) = if end == 0 { (0, 1) } else { (last, last - 1) };
            match condition {
                EndCondition::Slope(k) => {
                    let [a, b] = self.work[station];
                    self.work[station] = [a + k * b, 0.0];
                }
                EndCondition::Given => {
                    let (o, d) = (self.given[end], ends[end]);
                    let pull = if end == 0 {
                        [o[0] * d[0] + o[2] * d[1], o[1] * d[0] + o[3] * d[1]]
                    } else {
                        [o[0] * d[0] + o[1] * d[1], o[2] * d[0] + o[3] * d[1]]
                    };
                    self.work[next][0] -= pull[0];
                    self.work[next][1] -= pull[1];
                    self.work[station] = d;
                }
                EndCondition::Free => {}
            }
        }
        self.substitute();
        for (i, z) in self.work.iter().enumerate() {
            out[2 * i] = z[0] * self.scale[i][0];
            out[2 * i + 1] = z[1] * self.scale[i][1];
        }
        for (end, condition) in conditions.into_iter().enumerate() {
            let station = if end == 0 { 0 } else { last };
            match condition {
                EndCondition::Slope(k) => out[2 * station + 1] = k * out[2 * station],
                EndCondition::Given => out[2 * station..2 * station + 2].copy_from_slice(&ends[end]),
                EndCondition::Free => {}
            }
        }
    }

    /// Forward and backward substitution in scaled unknowns.
    #[inline(always)]
    fn substitute(&mut self) {
        let (mut p, mut q) = (0.0, 0.0);
        let mut m = [0.0; 4];
        for ((z, [s0, s1]), ([_, l, _], rows)) in self.work.iter_mut().zip(&self.scale).zip(&self.factor) {
            let a = z[0] * s0 - m[0] * p - m[1] * q;
            let b = z[1] * s1 - m[2] * p - m[3] * q - l * a;
            *z = [a, b];
            (p, q, m) = (a, b, *rows);
        }
        (p, q) = (0.0, 0.0);
        for (z, ([per_d0, l, per_d1], m)) in self.work.iter_mut().zip(&self.factor).rev() {
            let b = z[1] * per_d1 - (m[1] * p + m[3] * q);
            let a = z[0] * per_d0 - (m[0] * p + m[2] * q) - l * b;
            *z = [a, b];
            (p, q) = (a, b);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A positive definite matrix of five stations, and its product with a step.
    fn example() -> (Band, impl Fn(&[f64]) -> Vec<f64>) {
        let diagonal: Vec<[f64; 3]> = (0..5).map(|i| [4.0 + i as f64, 0.5, 3.0]).collect();
        let coupling: Vec<[f64; 4]> = (0..4).map(|i| [0.7, -0.2 * i as f64, 0.4, -0.3]).collect();
        let band = Band { diagonal: diagonal.clone(), coupling: coupling.clone(), ..Band::default() };
        let product = move |d: &[f64]| {
            let mut out = vec![0.0; d.len()];
            for (i, [a, b, c]) in diagonal.iter().enumerate() {
                out[2 * i] += a * d[2 * i] + b * d[2 * i + 1];
                out[2 * i + 1] += b * d[2 * i] + c * d[2 * i + 1];
            }
            for (i, o) in coupling.iter().enumerate() {
                for (row, column, value) in [(0, 2, o[0]), (0, 3, o[1]), (1, 2, o[2]), (1, 3, o[3])] {
                    out[2 * i + row] += value * d[2 * i + column];
                    out[2 * i + column] += value * d[2 * i + row];
                }
            }
            out
        };
        (band, product)
    }

    fn solved(conditions: [EndCondition; 2], ends: [[f64; 2]; 2]) -> (Vec<f64>, Vec<f64>) {
        let (mut band, product) = example();
        let (diagonal, coupling) = (band.diagonal.clone(), band.coupling.clone());
        band.clear(5);
        (band.diagonal, band.coupling) = (diagonal, coupling);
        assert!(band.factor(conditions));
        let rhs: Vec<f64> = (0..10).map(|i| (i as f64).sin()).collect();
        let mut d = vec![0.0; 10];
        band.solve(&rhs, ends, &mut d);
        let left = product(&d).iter().zip(&rhs).map(|(a, b)| a - b).collect();
        (d, left)
    }

    #[test]
    fn given_ends_keep_their_steps_and_all_others_solve_their_equations() {
        let ends = [[0.3, -0.1], [0.2, 0.5]];
        let (d, left) = solved([EndCondition::Given, EndCondition::Given], ends);
        assert_eq!((d[0], d[1], d[8], d[9]), (0.3, -0.1, 0.2, 0.5));
        assert!(left[2..8].iter().all(|left| left.abs() < 1e-11), "{left:?}");
    }

    #[test]
    fn tied_ends_keep_their_slope() {
        let (d, left) = solved([EndCondition::Slope(2.0), EndCondition::Slope(-3.0)], [[0.0; 2]; 2]);
        assert_eq!((d[1], d[9]), (2.0 * d[0], -3.0 * d[8]));
        assert!(left[2..8].iter().all(|left| left.abs() < 1e-11), "{left:?}");
        // The two equations of an end add up along its slope.
        assert!((left[0] + 2.0 * left[1]).abs() < 1e-11 && (left[8] - 3.0 * left[9]).abs() < 1e-11);
    }

    #[test]
    fn free_ends_solve_their_equations() {
        let (_, left) = solved([EndCondition::Free; 2], [[0.0; 2]; 2]);
        assert!(left.iter().all(|left| left.abs() < 1e-11), "{left:?}");
    }

    #[test]
    fn an_indefinite_matrix_is_refused() {
        let mut band = Band::default();
        band.clear(2);
        band.diagonal = vec![[1.0, 2.0, 1.0]; 2];
        assert!(!band.factor([EndCondition::Slope(-1.0), EndCondition::Slope(-1.0)]));
    }
}
