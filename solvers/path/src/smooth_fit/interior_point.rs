//! Least ½ ∫ |C'''|² du subject to the rows of the band: a primal-dual interior point after Mehrotra.
//!
//! ```text
//! minimise ½ xᵀQx   subject to   s₁ = e − (Ax − b) ≥ 0,   s₂ = e + (Ax − b) ≥ 0
//! ```
//!
//! x are the coefficients, of which some are fixed; λ₁, λ₂ the multipliers, μ their mean complementarity with the
//! slacks, σ the centring. The start need not be feasible. Newton's matrix Q + Aᵀ diag(λ₁/s₁ + λ₂/s₂) A is banded.

use super::band::Band;
use super::rows::Row;
use super::spline::ORDER;
use feedplan_geometry::quadratic::dot;

/// It ends when complementarity is below this part of the energy,
const GAP: f64 = 1e-3;
/// and when rows, and Newton's other residual, are off by less than this part of their size.
const OFF: f64 = 1e-3;
/// Where vertices pull, what is left over must be less than if they were off by this part of their limits.
const OFF_VERTEX: f64 = 1e-2;
/// The weight of all targets where it starts, in parts of the stiffness of their interval.
const START: f64 = 50.0;
const MOST_ITERATIONS: usize = 40;
/// Part of the way to the boundary.
const STEP: f64 = 0.99;
/// An energy that counts for nothing, in parts of that of C''' = ε/h³ in every interval: lines have none at all.
const NO_ENERGY: f64 = 1e-8;

/// A convex problem in the coefficients of a window of intervals.
#[derive(Default)]
pub struct Problem<const D: usize> {
    /// The form of the energy in every interval.
    pub energy: Vec<[[f64; ORDER]; ORDER]>,
    pub rows: Vec<Row<D>>,
    /// The number of rows before each interval, and all of them.
    pub start: Vec<usize>,
    /// The coefficients: as given where fixed, any start elsewhere.
    pub x: Vec<[f64; D]>,
    pub fixed: Vec<bool>,
    /// Σ ε²/h⁵ over the intervals.
    pub unit_energy: f64,
}

/// Slacks and multipliers of both sides of a row, in each direction; or steps of them.
#[derive(Clone, Copy)]
struct Pairs<const D: usize> {
    s: [[f64; D]; 2],
    l: [[f64; D]; 2],
    /// 1/s, which is divided by often.
    inverse: [[f64; D]; 2],
}

const SIGN: [f64; 2] = [1.0, -1.0];

impl<const D: usize> Problem<D> {
    /// Solves the problem in place; returns the number of iterations.
    pub fn solve(&mut self, band: &mut Band) -> usize {
        let count = self.rows.len();
        let total = (2 * D * count) as f64;
        let least_energy = NO_ENERGY * self.unit_energy;
        let mut off = vec![[0.0; D]; count];
        let mut gradient = vec![[0.0; D]; self.x.len()];
        let mut weight = vec![[0.0; D]; count];
        let mut step = vec![[0.0; D]; self.x.len()];
        self.approximate(band, &mut off, &mut weight, &mut step);
        self.residuals(&mut off);
        let mu = self.energy_gradient(&mut gradient).max(least_energy) / total;
        let mut state: Vec<Pairs<D>> = (0..count)
            .map(|i| {
                let e = &self.rows[i].half;
                let s: [[f64; D]; 2] = std::array::from_fn(|side| {
                    std::array::from_fn(|r| (e[r] - SIGN[side] * off[i][r]).max(0.1 * e[r]))
                });
                let inverse = s.map(|side| side.map(|s| 1.0 / s));
                Pairs { s, l: inverse.map(|side| side.map(|i| mu * i)), inverse }
            })
            .collect();
        let mut steps = state.clone();
        let draw = self.draw();

        for iteration in 0..MOST_ITERATIONS {
            self.residuals(&mut off);
            let mut energy = self.energy_gradient(&mut gradient);
            for (weight, (row, off)) in weight.iter_mut().zip(self.rows.iter().zip(&off)) {
                *weight = std::array::from_fn(|r| row.pull * off[r]);
                energy += 0.5 * (0..D).map(|r| weight[r] * off[r]).sum::<f64>();
            }
            self.add_transposed(&weight, &mut gradient);
            let (mut work, mut worst) = (0.0, 0.0f64);
            for (i, pairs) in state.iter().enumerate() {
                let e = &self.rows[i].half;
                for r in 0..D {
                    for side in 0..2 {
                        work += pairs.s[side][r] * pairs.l[side][r];
                        worst = worst.max((SIGN[side] * off[i][r] + pairs.s[side][r] - e[r]).abs() / e[r]);
                    }
                }
            }
            let mu = work / total;
            // The multipliers' part of the gradient, and its size to measure it by.
            for (weight, pairs) in weight.iter_mut().zip(&state) {
                *weight = std::array::from_fn(|r| pairs.l[0][r] + pairs.l[1][r]);
            }
            step.fill([0.0; D]);
            self.add_transposed(&weight, &mut step);
            let size = self.greatest(&step);
            for (weight, pairs) in weight.iter_mut().zip(&state) {
                *weight = std::array::from_fn(|r| pairs.l[0][r] - pairs.l[1][r]);
            }
            self.add_transposed(&weight, &mut gradient);
            let settled = || self.is_settled(&gradient, &state, &draw, OFF * size);
            if work < GAP * energy.max(least_energy) && worst < OFF && settled() {
                return iteration;
            }

            for (weight, (row, pairs)) in weight.iter_mut().zip(self.rows.iter().zip(&state)) {
                let [lower, upper] = &pairs.inverse;
                *weight =
                    std::array::from_fn(|r| pairs.l[0][r] * lower[r] + pairs.l[1][r] * upper[r] + row.pull);
            }
            self.assemble(&weight, band);
            band.factor();

            // Predictor: how far does the pure Newton step get?
            self.direction(band, &gradient, &off, &state, &mut steps, None, &mut weight, &mut step);
            let [primal, dual] = longest(&state, &steps, 1.0);
            let mut after = 0.0;
            for (pairs, d) in state.iter().zip(&steps) {
                for side in 0..2 {
                    for r in 0..D {
                        after += (pairs.s[side][r] + primal * d.s[side][r])
                            * (pairs.l[side][r] + dual * d.l[side][r]);
                    }
                }
            }
            let sigma = (after / work).powi(3).clamp(1e-3, 0.8);

            // Corrector: towards σμ, with the second order of the predictor.
            self.direction(
                band,
                &gradient,
                &off,
                &state,
                &mut steps,
                Some(sigma * mu),
                &mut weight,
                &mut step,
            );
            let [primal, dual] = longest(&state, &steps, STEP);
            if !(primal.is_finite() && dual.is_finite()) {
                return iteration;
            }
            for (x, dx) in self.x.iter_mut().zip(&step) {
                for k in 0..D {
                    x[k] += primal * dx[k];
                }
            }
            for (pairs, d) in state.iter_mut().zip(&steps) {
                for side in 0..2 {
                    for r in 0..D {
                        pairs.s[side][r] += primal * d.s[side][r];
                        pairs.l[side][r] += dual * d.l[side][r];
                        pairs.inverse[side][r] = 1.0 / pairs.s[side][r];
                    }
                }
            }
        }
        MOST_ITERATIONS
    }

    /// Moves x to the best approximation of all targets, smoothed a little. Where a corner leaves the solution no way, as
    /// intervals too long do, bends of the same window are where they belong all the same.
    fn approximate(
        &mut self,
        band: &mut Band,
        off: &mut [[f64; D]],
        weight: &mut [[f64; D]],
        step: &mut [[f64; D]],
    ) {
        for (form, pair) in self.energy.iter().zip(self.start.windows(2)) {
            let stiffness: f64 = (0..ORDER).map(|a| form[a][a]).sum();
            for (weight, row) in weight[pair[0]..pair[1]].iter_mut().zip(&self.rows[pair[0]..pair[1]]) {
                *weight = [START * stiffness + row.pull; D];
            }
        }
        self.assemble(weight, band);
        band.factor();
        self.residuals(off);
        self.energy_gradient(step);
        for (weight, off) in weight.iter_mut().zip(off.iter()) {
            *weight = std::array::from_fn(|r| weight[r] * off[r]);
        }
        self.add_transposed(weight, step);
        self.downhill(band, step);
        for (x, step) in self.x.iter_mut().zip(step.iter()) {
            *x = std::array::from_fn(|k| x[k] + step[k]);
        }
    }

    /// From a gradient to the step of Newton's matrix against it.
    fn downhill(&self, band: &Band, step: &mut [[f64; D]]) {
        for (step, &fixed) in step.iter_mut().zip(&self.fixed) {
            *step = if fixed { [0.0; D] } else { step.map(|x| -x) };
        }
        band.solve(step.as_flattened_mut());
    }

    /// Ax − b of every row.
    fn residuals(&self, out: &mut [[f64; D]]) {
        self.over_rows(&self.x, |i, row, point| {
            out[i] = std::array::from_fn(|r| {
                (0..D).map(|k| row.direction[r][k] * (point[k] - row.target[k])).sum()
            });
        });
    }

    /// Calls with every row and Σ B x there.
    #[inline(always)]
    fn over_rows(&self, x: &[[f64; D]], mut call: impl FnMut(usize, &Row<D>, [f64; D])) {
        for (j, pair) in self.start.windows(2).enumerate() {
            let x = &x[j..j + ORDER];
            for i in pair[0]..pair[1] {
                let row = &self.rows[i];
                let mut point = [0.0; D];
                for a in 0..ORDER {
                    for k in 0..D {
                        point[k] += row.basis[a] * x[a][k];
                    }
                }
                call(i, row, point);
            }
        }
    }

    /// Qx, and the energy ½ xᵀQx.
    fn energy_gradient(&self, out: &mut [[f64; D]]) -> f64 {
        out.fill([0.0; D]);
        for (j, form) in self.energy.iter().enumerate() {
            let (x, out) = (&self.x[j..j + ORDER], &mut out[j..j + ORDER]);
            for a in 0..ORDER {
                for b in 0..ORDER {
                    for k in 0..D {
                        out[a][k] += form[a][b] * x[b][k];
                    }
                }
            }
        }
        0.5 * out.iter().zip(&self.x).map(|(g, x)| (0..D).map(|k| g[k] * x[k]).sum::<f64>()).sum::<f64>()
    }

    /// Adds Aᵀ `weight`.
    fn add_transposed(&self, weight: &[[f64; D]], out: &mut [[f64; D]]) {
        for (j, pair) in self.start.windows(2).enumerate() {
            let out = &mut out[j..j + ORDER];
            for i in pair[0]..pair[1] {
                let row = &self.rows[i];
                let mut pull = [0.0; D];
                for r in 0..D {
                    for k in 0..D {
                        pull[k] += weight[i][r] * row.direction[r][k];
                    }
                }
                for a in 0..ORDER {
                    for k in 0..D {
                        out[a][k] += row.basis[a] * pull[k];
                    }
                }
            }
        }
    }

    /// The greatest component of a gradient that is not fixed.
    fn greatest(&self, gradient: &[[f64; D]]) -> f64 {
        let free = gradient.iter().zip(&self.fixed).filter(|(_, fixed)| !**fixed);
        free.flat_map(|(g, _)| g).fold(0.0, |a: f64, x| a.max(x.abs()))
    }

    /// What vertices draw each coefficient by where they are off by a small part of their limits, and the work of that
    /// in each interval.
    fn draw(&self) -> (Vec<f64>, Vec<f64>) {
        let mut force = vec![0.0; self.x.len()];
        let mut work = vec![0.0; self.start.len() - 1];
        for (j, pair) in self.start.windows(2).enumerate() {
            for row in &self.rows[pair[0]..pair[1]] {
                let draw = row.pull * OFF_VERTEX * row.half[0];
                work[j] += draw * row.half[0];
                for a in 0..ORDER {
                    force[j + a] += row.basis[a] * draw;
                }
            }
        }
        (force, work)
    }

    /// What is left over is small everywhere: of the gradient in parts of the multipliers, and where vertices draw, of
    /// gradient and complementarity in parts of what they draw. A corner has so much of both that those alone say
    /// nothing of an arc beside it.
    fn is_settled(
        &self,
        gradient: &[[f64; D]],
        state: &[Pairs<D>],
        draw: &(Vec<f64>, Vec<f64>),
        most: f64,
    ) -> bool {
        let free = gradient.iter().zip(&draw.0).zip(&self.fixed).filter(|(_, fixed)| !**fixed);
        let still = free.into_iter().all(|((g, &draw), _)| {
            let most = if draw > 0.0 { draw } else { most };
            g.iter().all(|x| x.abs() <= most)
        });
        let work = |pairs: &Pairs<D>| -> f64 { (0..2).map(|side| dot(&pairs.s[side], &pairs.l[side])).sum() };
        still
            && self.start.windows(2).zip(&draw.1).all(|(pair, &draw)| {
                draw == 0.0 || state[pair[0]..pair[1]].iter().map(work).sum::<f64>() <= draw
            })
    }

    /// Newton's matrix.
    fn assemble(&self, weight: &[[f64; D]], band: &mut Band) {
        band.clear(self.x.len() * D, ORDER * D);
        for (j, pair) in self.start.windows(2).enumerate() {
            // Blocks (a, b) of the interval, a ≤ b.
            let mut local = [[[[0.0; D]; D]; ORDER]; ORDER];
            for i in pair[0]..pair[1] {
                let row = &self.rows[i];
                let mut form = [[0.0; D]; D];
                for r in 0..D {
                    let n = &row.direction[r];
                    for k in 0..D {
                        let share = weight[i][r] * n[k];
                        for m in 0..D {
                            form[k][m] += share * n[m];
                        }
                    }
                }
                for a in 0..ORDER {
                    for b in a..ORDER {
                        let product = row.basis[a] * row.basis[b];
                        for k in 0..D {
                            for m in 0..D {
                                local[a][b][k][m] += product * form[k][m];
                            }
                        }
                    }
                }
            }
            for a in 0..ORDER {
                for k in 0..D {
                    let row = band.row((j + a) * D + k);
                    for b in a..ORDER {
                        let first = if a == b { k } else { 0 };
                        for m in first..D {
                            row[(b - a) * D + m - k] += local[a][b][k][m];
                        }
                        row[(b - a) * D] += self.energy[j][a][b];
                    }
                }
            }
        }
        for (i, _) in self.fixed.iter().enumerate().filter(|(_, fixed)| **fixed) {
            for k in 0..D {
                band.fix(i * D + k);
            }
        }
    }

    /// Newton's step towards s λ = `aim` with the second order of the steps before, or towards 0 without it.
    #[allow(clippy::too_many_arguments)]
    fn direction(
        &self,
        band: &Band,
        gradient: &[[f64; D]],
        off: &[[f64; D]],
        state: &[Pairs<D>],
        steps: &mut [Pairs<D>],
        aim: Option<f64>,
        weight: &mut [[f64; D]],
        step: &mut [[f64; D]],
    ) {
        // c: what s dλ + λ ds shall be; it is kept in the place of dλ until ds is known.
        for (i, (pairs, d)) in state.iter().zip(steps.iter_mut()).enumerate() {
            for r in 0..D {
                weight[i][r] = 0.0;
                for side in 0..2 {
                    let (s, l) = (pairs.s[side][r], pairs.l[side][r]);
                    let c = aim.map_or(-s * l, |aim| aim - s * l - d.s[side][r] * d.l[side][r]);
                    let lack = SIGN[side] * off[i][r] + s - self.rows[i].half[r];
                    weight[i][r] += SIGN[side] * (c + l * lack) * pairs.inverse[side][r];
                    d.l[side][r] = c;
                }
            }
        }
        step.copy_from_slice(gradient);
        self.add_transposed(weight, step);
        self.downhill(band, step);
        self.over_rows(step, |i, row, point| {
            for r in 0..D {
                let moved: f64 = (0..D).map(|k| row.direction[r][k] * point[k]).sum();
                for side in 0..2 {
                    let (s, l) = (state[i].s[side][r], state[i].l[side][r]);
                    let lack = SIGN[side] * off[i][r] + s - row.half[r];
                    let ds = -lack - SIGN[side] * moved;
                    steps[i].s[side][r] = ds;
                    steps[i].l[side][r] = (steps[i].l[side][r] - l * ds) * state[i].inverse[side][r];
                }
            }
        });
    }
}

/// The longest steps of slacks and of multipliers, at most 1, that end at this part of the way to the boundary.
fn longest<const D: usize>(state: &[Pairs<D>], steps: &[Pairs<D>], part: f64) -> [f64; 2] {
    // The greatest −dz/z, which vectorises.
    let mut most = [1e-300f64; 2];
    for (pairs, d) in state.iter().zip(steps) {
        for side in 0..2 {
            for r in 0..D {
                most[0] = most[0].max(-d.s[side][r] * pairs.inverse[side][r]);
                most[1] = most[1].max(-d.l[side][r] / pairs.l[side][r]);
            }
        }
    }
    most.map(|most| (part / most).min(1.0))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::smooth_fit::polyline::Polyline;
    use crate::smooth_fit::rows::rows;
    use crate::smooth_fit::spline::{around, energy, greville};

    #[test]
    fn the_optimum_meets_its_conditions_and_its_rows() {
        let line = Polyline::new(vec![[0.0, 0.0], [10.0, 0.0], [10.0, 10.0]], vec![0.5; 2]);
        let knots: Vec<f64> = (0..=40).map(|i| 0.5 * i as f64).collect();
        let (rows, start) = rows(&line, &knots, 0, 40, &[0.0; 2]);
        let x: Vec<[f64; 2]> = (0..45)
            .map(|i| {
                let u = greville(&knots, i);
                line.point(line.chord_at(u), u)
            })
            .collect();
        let mut fixed = vec![false; 45];
        (fixed[0], fixed[44]) = (true, true);
        let energy = (0..40).map(|j| energy(&around(&knots, j))).collect();
        let mut problem =
            Problem { energy, rows, start, x, fixed, unit_energy: 40.0 * 0.25 / 0.5f64.powi(5) };
        let mut gradient = vec![[0.0; 2]; 45];
        let before = problem.energy_gradient(&mut gradient);
        let iterations = problem.solve(&mut Band::default());
        assert!(iterations < 25, "{iterations}");
        assert!(problem.energy_gradient(&mut gradient) < 0.1 * before);
        assert_eq!((problem.x[0], problem.x[44]), ([0.0, 0.0], [10.0, 10.0]));
        let mut off = vec![[0.0; 2]; problem.rows.len()];
        problem.residuals(&mut off);
        for (off, row) in off.iter().zip(&problem.rows) {
            assert!((0..2).all(|r| off[r].abs() <= row.half[r] * (1.0 + 1e-3)));
        }
        // The two sides of the corner are mirror images.
        for i in 0..45 {
            let [x, y] = problem.x[44 - i];
            assert!(
                (problem.x[i][0] - (10.0 - y)).abs() < 1e-3 && (problem.x[i][1] - (10.0 - x)).abs() < 1e-3
            );
        }
    }
}
