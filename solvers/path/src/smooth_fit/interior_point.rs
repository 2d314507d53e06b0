//! Solves the convex problem of a window, the curve of least energy in the tolerance tube, by a primal-dual interior-point method
//! (Mehrotra 1992).
//!
//! ```text
//! minimise ½ xᵀQx − pᵀx   subject to   s₁ = e − (Ax − b) ≥ 0,   s₂ = e + (Ax − b) ≥ 0
//! ```
//!
//! x are the coefficients, of which some are fixed; p is the linear part of the energy, which pulls the curve to its aims
//! (`pace`); λ₁, λ₂ are the multipliers of the slacks s₁, s₂. The start need not be feasible. Newton's matrix
//! Q + Aᵀ diag(λ₁/s₁ + λ₂/s₂) A is banded.
//!
//! The energy of an interval of length h grows as h⁻⁵, so that one value of s λ for all rows would be far too great for some
//! intervals and far too small for others. The rows of each interval therefore aim at s λ = μ d ε²/h⁵, where d is the density of
//! the energy (`pace`) and d ε²/h⁵ is called the unit of the interval. All intervals then converge together, which takes about
//! half as many iterations.
//!
//! The effect of a change at one place of the curve fades along it. Each group of four intervals, a quad, therefore has its own μ
//! and its own step length. With one step length for the whole window, the shortest one, a single corner would stop all other
//! places. The step lengths of neighbouring quads differ little. Where they differ, slacks do not fit their rows exactly; the
//! next steps correct that.

use fearless_simd::Simd;
use feedplan_geometry::dispatch_four;
use feedplan_geometry::lanes::four::{Lanes, Register, LANES};

use super::band::Band;
use super::problem::Problem;
use super::quads::{Columns, Quads, Share, BEYOND};
use super::spline::{DEGREE, ORDER};

/// The iteration ends when the sum of all s λ is below this part of the energy,
const GAP: f64 = 1e-3;
/// and when the slacks are wrong by less than this part of their limits, and the gradient is below this part of its scale.
const OFF: f64 = 1e-3;
/// The gradient at a coefficient that vertices pull must be less than their pull if they are off by this part of their limits.
const OFF_VERTEX: f64 = 1e-2;
/// For that comparison, the force of a vertex on each coefficient of its interval is at least this part of its pull.
const LEAST_FORCE: f64 = 1e-3;
/// The least μ to aim at, because the pulls of vertices are some thousandths of a unit or more. It is lower where Σ s λ would
/// otherwise exceed a tenth of the value at which the iteration ends.
const LEAST_MU: f64 = 1e-6;
/// If the mean μ is below this, only rounding errors are left, and the iteration ends.
const ROUNDING: f64 = 1e-9;
/// μ at the start.
const START_MU: f64 = 50.0;
/// The greatest ratio between the aimed μ of neighbouring quads,
const MU_RATIO: f64 = 10.0;
/// and between their step lengths.
const LENGTH_RATIO: f64 = 1.5;
/// Before each iteration a slack moves towards the value that x gives for its row, by at most this part of itself.
const SLACK_CHANGE: f64 = 0.04;
/// The weight of the targets of all rows in the start (`approximate`), in units over the square of the row's limit.
const START_WEIGHT: f64 = 200.0;
/// The slacks at the start are at least this part of the limits.
const START_SLACK: f64 = 0.1;
const MOST_ITERATIONS: usize = 40;
/// A step goes this part of the way to the first place where a slack or multiplier is 0.
const STEP: f64 = 0.99;
/// Energies below this, in units, are treated as zero: straight lines have no energy.
const NO_ENERGY: f64 = 1e-8;

impl<const D: usize> Problem<D> {
    /// Solves the problem in place; returns the number of iterations.
    pub fn solve(&mut self, band: &mut Band<D>) -> usize {
        let mut newton = Newton::new(self, band);
        newton.approximate();
        dispatch_four!(simd => newton.begin(simd));
        let mut iteration = 0;
        while iteration < MOST_ITERATIONS {
            let residuals = dispatch_four!(simd => newton.linearise(simd));
            if newton.is_solved(&residuals) {
                break;
            }
            newton.band.factor(&newton.problem.fixed);
            newton.downhill(true);
            dispatch_four!(simd => newton.predict(simd, newton.least_mu(&residuals)));
            dispatch_four!(simd => newton.centre(simd));
            newton.downhill(false);
            dispatch_four!(simd => newton.correct(simd));
            if !newton.length.iter().all(|length| length.is_finite()) {
                break;
            }
            newton.advance();
            iteration += 1;
        }
        let found = |i: usize| if self.fixed[i] { self.x[i] } else { newton.x.point(i) };
        self.x = (0..self.x.len()).map(found).collect();
        iteration
    }

    /// For vertices that are off by OFF_VERTEX of their limits: the force of their pull on each coefficient, and pull times limit
    /// summed in each interval.
    fn pulls(&self) -> (Vec<f64>, Vec<f64>) {
        let mut force = vec![0.0; self.x.len()];
        let mut work = vec![0.0; self.start.len() - 1];
        for (j, pair) in self.start.windows(2).enumerate() {
            for row in &self.rows[pair[0]..pair[1]] {
                let pull = row.pull * OFF_VERTEX * row.half[0];
                work[j] += pull * row.half[0];
                for a in 0..ORDER {
                    force[j + a] += row.basis[a].max(LEAST_FORCE) * pull;
                }
            }
        }
        (force, work)
    }
}

/// A row's Ax − b in each direction; for both of its sides the slacks, multipliers, 1/s, and the steps of slack and multiplier.
#[derive(Clone, Copy)]
struct Pairs<const D: usize> {
    off: [Lanes; D],
    s: [[Lanes; D]; 2],
    l: [[Lanes; D]; 2],
    inverse: [[Lanes; D]; 2],
    ds: [[Lanes; D]; 2],
    /// The step of the multiplier; between predictor and corrector the product of the predictor's steps of s and λ.
    dl: [[Lanes; D]; 2],
}

const SIGN: [f64; 2] = [1.0, -1.0];
/// The index of the coefficient in the middle of the first quad: coefficient i moves the intervals i − DEGREE to i.
const MIDDLE: f64 = 0.5 * (LANES + DEGREE - 1) as f64;

impl<const D: usize> Pairs<D> {
    /// For one side of direction r: slack, multiplier, 1/s, the error of the slack, and Newton's step of the slack if x moves the
    /// row's place by `moved` in that direction.
    #[inline(always)]
    fn newton<S: Simd>(
        &self,
        r: usize,
        side: usize,
        half: Register<S>,
        moved: Register<S>,
    ) -> [Register<S>; 5] {
        let simd = half.simd();
        let [off, s, l, inverse] =
            [self.off[r], self.s[side][r], self.l[side][r], self.inverse[side][r]].map(|x| x.load(simd));
        let lack = off * SIGN[side] + s - half;
        [s, l, inverse, lack, -lack - moved * SIGN[side]]
    }
}

/// The residuals of an iterate.
struct Residuals {
    energy: f64,
    /// Σ s λ.
    work: f64,
    /// The greatest error of a slack, in parts of its limit.
    worst: f64,
}

/// Replaces each value by `change` of itself and its neighbour: forwards from the first to the last, then backwards.
fn between_neighbours(values: &mut [f64], change: impl Fn(f64, f64) -> f64) {
    for i in 1..values.len() {
        values[i] = change(values[i], values[i - 1]);
    }
    for i in (1..values.len()).rev() {
        values[i - 1] = change(values[i - 1], values[i]);
    }
}

/// Newton's iteration for a problem.
struct Newton<'a, const D: usize> {
    problem: &'a Problem<D>,
    quads: Quads<D>,
    band: &'a mut Band<D>,
    x: Columns<D>,
    step: Columns<D>,
    state: Vec<Pairs<D>>,
    /// What each row of one quad adds to matrix and gradients.
    shares: Vec<Share<D>>,
    /// The gradient of the Lagrangian. `size`, its scale, has the sum of both multipliers of a row in place of their difference.
    gradient: Columns<D>,
    size: Columns<D>,
    /// The terms that the predictor step adds to the gradient.
    predictor: Columns<D>,
    /// Σ s λ of each interval.
    work: Vec<Lanes>,
    pull: (Vec<f64>, Vec<f64>),
    /// For each quad: the mean of s λ in units; after `predict` the value to aim at.
    mu: Vec<f64>,
    /// The step length of each quad.
    length: Vec<f64>,
    /// The number of pairs of slack and multiplier in each quad.
    pairs: Vec<f64>,
    /// Σ s λ if μ = 1 everywhere.
    whole: f64,
    least_energy: f64,
    unknowns: Vec<Lanes>,
}

impl<'a, const D: usize> Newton<'a, D> {
    fn new(problem: &'a Problem<D>, band: &'a mut Band<D>) -> Self {
        let quads = Quads::new(problem);
        let pairs = |quad: usize| {
            let [first, end] = [quad, quad + 1].map(|i| problem.start[(i * LANES).min(problem.unit.len())]);
            (2 * D * (end - first)) as f64
        };
        let zeros = Columns::zeros(quads.count());
        let mut x = zeros.clone();
        for (i, point) in problem.x.iter().enumerate() {
            for k in 0..D {
                x.set(i, k, point[k]);
            }
        }
        let none = [[Lanes::ZERO; D]; 2];
        let one = [[Lanes::ONE; D]; 2];
        let state = Pairs { off: none[0], s: one, l: none, inverse: one, ds: none, dl: none };
        Self {
            problem,
            band,
            x,
            step: zeros.clone(),
            state: vec![state; quads.rows.len()],
            shares: quads.shares(),
            gradient: zeros.clone(),
            size: zeros.clone(),
            predictor: zeros,
            work: vec![Lanes::ZERO; quads.count()],
            pull: problem.pulls(),
            mu: vec![0.0; quads.count()],
            length: vec![0.0; quads.count()],
            pairs: (0..quads.count()).map(pairs).collect(),
            whole: problem
                .unit
                .iter()
                .zip(problem.start.windows(2))
                .map(|(unit, pair)| unit * (2 * D * (pair[1] - pair[0])) as f64)
                .sum(),
            least_energy: NO_ENERGY * problem.unit.iter().sum::<f64>(),
            unknowns: vec![],
            quads,
        }
    }

    /// Moves x to the weighted least-squares approximation of all targets, with the energy as a slight smoothing. If the
    /// intervals at a corner are too long, so that the problem has no solution, the bends of the same window are then close to
    /// their targets.
    fn approximate(&mut self) {
        dispatch_four!(simd => self.weigh(simd));
        self.band.factor(&self.problem.fixed);
        self.downhill(false);
        self.x.add_parts(&self.step, |_| 1.0);
    }

    /// The matrix and the gradient of that approximation.
    #[inline(always)]
    fn weigh<S: Simd>(&mut self, simd: S) {
        self.band.clear(self.quads.count() + BEYOND);
        self.quads.energy_gradient(simd, &self.x, &mut self.gradient);
        for quad in 0..self.quads.count() {
            let x = self.x.around(simd, quad);
            for (row, share) in self.quads.rows[self.quads.range(quad)].iter().zip(&mut self.shares) {
                let mut weight = row.place(simd, &x);
                let mut force = weight;
                for r in 0..D {
                    let per_half = row.half[r].load(simd).inverse();
                    weight[r] = row.unit.load(simd) * START_WEIGHT * (per_half * per_half) + row.pull;
                    force[r] = weight[r] * (force[r] - row.target[r]);
                }
                share.form = row.form(simd, &weight);
                share.forces[0] = row.along_axes(simd, &force);
            }
            self.quads.add_forms(simd, quad, &self.shares, self.band);
            self.quads.add_forces(simd, quad, &self.shares, 0, &mut self.gradient);
        }
    }

    /// Sets the slacks of x, at least START_SLACK of their limits, and multipliers with s λ = START_MU units.
    #[inline(always)]
    fn begin<S: Simd>(&mut self, simd: S) {
        for quad in 0..self.quads.count() {
            let x = self.x.around(simd, quad);
            for i in self.quads.range(quad) {
                let (row, pairs) = (&self.quads.rows[i], &mut self.state[i]);
                let place = row.place(simd, &x);
                for r in 0..D {
                    let half = row.half[r].load(simd);
                    for side in 0..2 {
                        let slack = half - (place[r] - row.target[r]) * SIGN[side];
                        let s = slack.max(half * START_SLACK);
                        pairs.s[side][r] = s.into();
                        pairs.l[side][r] = (s.inverse() * row.unit * START_MU).into();
                    }
                }
            }
        }
    }

    /// Applies the last step to slacks and multipliers, each quad with its own length; then computes Newton's matrix, the
    /// gradients and the residuals at x.
    #[inline(always)]
    fn linearise<S: Simd>(&mut self, simd: S) -> Residuals {
        let zero = Register::all(simd, 0.0);
        self.band.clear(self.quads.count() + BEYOND);
        let mut energy = self.quads.energy_gradient(simd, &self.x, &mut self.gradient);
        self.size.fill(0.0);
        self.predictor.fill(0.0);
        let (mut pulled, mut worst) = (zero, zero);
        for quad in 0..self.quads.count() {
            let x = self.x.around(simd, quad);
            let length = self.length[quad];
            let (mut work, mut mu) = (zero, zero);
            for (i, share) in self.quads.range(quad).zip(&mut self.shares) {
                let (row, pairs) = (&self.quads.rows[i], &mut self.state[i]);
                let place = row.place(simd, &x);
                let pull = row.pull.load(simd);
                let mut weight = [pull; D];
                // Gradient, its scale, and what the predictor adds to the gradient.
                let mut forces = [[zero; D]; 3];
                let mut product = zero;
                for r in 0..D {
                    let off = place[r] - row.target[r];
                    pairs.off[r] = off.into();
                    pulled += pull * off * off;
                    forces[0][r] = pull * off;
                    let half = row.half[r].load(simd);
                    let per_half = half.inverse();
                    for side in 0..2 {
                        let s = pairs.ds[side][r].load(simd) * length + pairs.s[side][r];
                        let slack = half - off * SIGN[side];
                        let s = slack.max(s * (1.0 - SLACK_CHANGE)).min(s * (1.0 + SLACK_CHANGE));
                        let l = pairs.dl[side][r].load(simd) * length + pairs.l[side][r];
                        let inverse = s.inverse();
                        let lack = off * SIGN[side] + s - half;
                        let stiffness = l * inverse;
                        weight[r] += stiffness;
                        product += s * l;
                        worst = worst.max(lack.abs() * per_half);
                        forces[0][r] += l * SIGN[side];
                        forces[1][r] += l;
                        forces[2][r] += (stiffness * lack - l) * SIGN[side];
                        pairs.s[side][r] = s.into();
                        pairs.l[side][r] = l.into();
                        pairs.inverse[side][r] = inverse.into();
                    }
                }
                mu += product * row.per_unit;
                work += product;
                share.form = row.form(simd, &weight);
                for (along, force) in share.forces.iter_mut().zip(&forces) {
                    *along = row.along_axes(simd, force);
                }
            }
            self.work[quad] = work.into();
            self.mu[quad] = mu.sum() / self.pairs[quad];
            self.quads.add_forms(simd, quad, &self.shares, self.band);
            for (number, column) in
                [&mut self.gradient, &mut self.size, &mut self.predictor].into_iter().enumerate()
            {
                self.quads.add_forces(simd, quad, &self.shares, number, column);
            }
        }
        energy += 0.5 * pulled.sum();
        let sum = self.work.iter().map(|work| work.values().iter().sum::<f64>()).sum();
        Residuals { energy, work: sum, worst: worst.greatest() }
    }

    /// Whether the residuals are small everywhere. The gradient is compared with the multipliers; where vertices pull, the
    /// gradient and s λ are compared with their pull, because a corner has much greater multipliers than an arc next to it, so
    /// that a sum over the window says little about the arc.
    fn is_solved(&self, residuals: &Residuals) -> bool {
        let Residuals { energy, work, worst } = *residuals;
        if !(work < GAP * energy.max(self.least_energy) && worst < OFF) {
            return false;
        }
        let fixed = &self.problem.fixed;
        let greatest = |point: [f64; D]| point.iter().fold(0.0, |a: f64, x| a.max(x.abs()));
        let free = || (0..fixed.len()).filter(|&i| !fixed[i]);
        let size = free().map(|i| greatest(self.size.point(i))).fold(0.0, f64::max);
        let pulls = self.pull.1.iter().enumerate();
        let still = free().all(|i| {
            let most = if self.pull.0[i] > 0.0 { self.pull.0[i] } else { OFF * size };
            greatest(self.gradient.point(i)) <= most
        });
        let settled = || {
            pulls.clone().all(|(j, &pull)| pull == 0.0 || self.work[j / LANES].values()[j % LANES] <= pull)
        };
        work < ROUNDING * self.whole || still && settled()
    }

    /// The least μ to aim at.
    fn least_mu(&self, residuals: &Residuals) -> f64 {
        LEAST_MU.min(0.1 * GAP * residuals.energy.max(self.least_energy) / self.whole)
    }

    /// After the predictor, the pure Newton step: its length gives the μ to aim at; the products of its steps of s and λ are
    /// stored for the corrector.
    #[inline(always)]
    fn predict<S: Simd>(&mut self, simd: S, least_mu: f64) {
        let zero = Register::all(simd, 0.0);
        for quad in 0..self.quads.count() {
            let step = self.step.around(simd, quad);
            // The greatest −ds/s or −dλ/λ, and the coefficients of a and a² in Σ s λ (in units) after a step of length a.
            let (mut most, mut first, mut second) = (Register::all(simd, 1e-300), zero, zero);
            for i in self.quads.range(quad) {
                let (row, pairs) = (&self.quads.rows[i], &mut self.state[i]);
                let moved = row.place(simd, &step);
                let (mut linear, mut square) = (zero, zero);
                for r in 0..D {
                    let half = row.half[r].load(simd);
                    for side in 0..2 {
                        let [s, l, inverse, _, ds] = pairs.newton(r, side, half, moved[r]);
                        // dλ/λ is −1 − ds/s.
                        let ratio = ds * inverse;
                        let dl = -l - l * ratio;
                        let product = ds * dl;
                        most = most.max(-ratio).max(ratio + Lanes::ONE);
                        linear += s * dl + l * ds;
                        square += product;
                        pairs.dl[side][r] = product.into();
                    }
                }
                first += linear * row.per_unit;
                second += square * row.per_unit;
            }
            let (mu, length) = (self.mu[quad], (1.0 / most.greatest()).min(1.0));
            let after = mu + (length * first.sum() + length * length * second.sum()) / self.pairs[quad];
            self.mu[quad] = (mu * (after / mu).powi(3).clamp(1e-3, 0.8)).max(least_mu);
        }
        between_neighbours(&mut self.mu, |mu, beside| mu.max(beside / MU_RATIO));
    }

    /// Adds to the gradient what leads the corrector to s λ = μ in units, with the second-order term of the predictor.
    #[inline(always)]
    fn centre<S: Simd>(&mut self, simd: S) {
        let zero = Register::all(simd, 0.0);
        for quad in 0..self.quads.count() {
            for (i, share) in self.quads.range(quad).zip(&mut self.shares) {
                let (row, pairs) = (&self.quads.rows[i], &self.state[i]);
                let aim = row.unit.load(simd) * self.mu[quad];
                let mut force = [zero; D];
                for r in 0..D {
                    let half = row.half[r].load(simd);
                    for side in 0..2 {
                        let [s, l, inverse, lack, _] = pairs.newton(r, side, half, zero);
                        let product = pairs.dl[side][r];
                        force[r] += (aim + l * lack - s * l - product.load(simd)) * inverse * SIGN[side];
                    }
                }
                share.forces[0] = row.along_axes(simd, &force);
            }
            self.quads.add_forces(simd, quad, &self.shares, 0, &mut self.gradient);
        }
    }

    /// After the corrector: its steps of slacks and multipliers, and the step lengths.
    #[inline(always)]
    fn correct<S: Simd>(&mut self, simd: S) {
        for quad in 0..self.quads.count() {
            let step = self.step.around(simd, quad);
            let mut most = Register::all(simd, 1e-300);
            for i in self.quads.range(quad) {
                let (row, pairs) = (&self.quads.rows[i], &mut self.state[i]);
                let moved = row.place(simd, &step);
                let aim = row.unit.load(simd) * self.mu[quad];
                for r in 0..D {
                    let half = row.half[r].load(simd);
                    for side in 0..2 {
                        let [s, l, inverse, _, ds] = pairs.newton(r, side, half, moved[r]);
                        let dl = (aim - s * l - l * ds - pairs.dl[side][r].load(simd)) * inverse;
                        // A padding row has the multiplier 0.
                        let per_l = l.max(Register::all(simd, f64::MIN_POSITIVE)).inverse();
                        most = most.max(-ds * inverse).max(-dl * per_l);
                        pairs.ds[side][r] = ds.into();
                        pairs.dl[side][r] = dl.into();
                    }
                }
            }
            self.length[quad] = (STEP / most.greatest()).min(1.0);
        }
        between_neighbours(&mut self.length, |length, beside| length.min(LENGTH_RATIO * beside));
    }

    /// Moves x by the step. The step length of a coefficient is interpolated between the middles of the two nearest quads.
    fn advance(&mut self) {
        let last = self.length.len() - 1;
        let part = |i: usize| {
            let place = ((i as f64 - MIDDLE) / LANES as f64).clamp(0.0, last as f64);
            let before = place as usize;
            let (a, b) = (self.length[before], self.length[(before + 1).min(last)]);
            a + (b - a) * (place - before as f64)
        };
        self.x.add_parts(&self.step, part);
    }

    /// Solves for the step: minus the inverse of Newton's matrix times the gradient, or times gradient plus predictor terms.
    fn downhill(&mut self, predictor: bool) {
        let fixed = &self.problem.fixed;
        let mut unknowns = std::mem::take(&mut self.unknowns);
        unknowns.clear();
        unknowns.resize((fixed.len() * D).div_ceil(LANES), Lanes::ZERO);
        for i in 0..fixed.len() {
            if fixed[i] {
                continue;
            }
            for k in 0..D {
                let mut sum = self.gradient.at(i, k);
                if predictor {
                    sum += self.predictor.at(i, k);
                }
                let place = i * D + k;
                unknowns[place / LANES].values_mut()[place % LANES] = -sum;
            }
        }
        self.band.solve(&mut unknowns);
        for i in 0..fixed.len() {
            for k in 0..D {
                let place = i * D + k;
                self.step.set(i, k, unknowns[place / LANES].values()[place % LANES]);
            }
        }
        self.unknowns = unknowns;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::smooth_fit::polyline::Polyline;
    use crate::smooth_fit::rows::rows;
    use crate::smooth_fit::spline::{around, greville};
    use feedplan_geometry::quadratic::{dot, sub};

    #[test]
    fn the_optimum_meets_its_conditions_and_its_rows() {
        let line = Polyline::new(vec![[0.0, 0.0], [10.0, 0.0], [10.0, 10.0]], vec![0.5; 2]);
        let knots: Vec<f64> = (0..=40).map(|i| 0.5 * i as f64).collect();
        let (rows, start) = rows(&line, &knots, 0, &[1.0; 40], &[0.0; 2]);
        let x: Vec<[f64; 2]> = (0..45)
            .map(|i| {
                let u = greville(&knots, i);
                line.point(line.chord_at(u), u)
            })
            .collect();
        let mut fixed = vec![false; 45];
        (fixed[0], fixed[44]) = (true, true);
        let (energy, pull) = (0..40).map(|j| line.pace.energy(&around(&knots, j))).unzip();
        let mut problem =
            Problem { energy, pull, rows, start, x, fixed, unit: vec![0.25 / 0.5f64.powi(5); 40] };
        let energy_of = |problem: &Problem<2>| {
            let mut sum = 0.0;
            for (j, forms) in problem.energy.iter().enumerate() {
                for a in 0..ORDER {
                    for b in 0..ORDER {
                        sum += 0.5 * forms[0][a][b] * dot(&problem.x[j + a], &problem.x[j + b]);
                    }
                }
            }
            sum
        };
        let before = energy_of(&problem);
        let iterations = problem.solve(&mut Band::default());
        assert!(iterations < 25, "{iterations}");
        assert!(energy_of(&problem) < 0.1 * before);
        assert_eq!((problem.x[0], problem.x[44]), ([0.0, 0.0], [10.0, 10.0]));
        for (j, pair) in problem.start.windows(2).enumerate() {
            for row in &problem.rows[pair[0]..pair[1]] {
                let point: [f64; 2] =
                    std::array::from_fn(|k| (0..ORDER).map(|a| row.basis[a] * problem.x[j + a][k]).sum());
                let away = sub(&point, &row.target);
                assert!((0..2).all(|r| dot(&row.direction[r], &away).abs() <= row.half[r] * (1.0 + 1e-3)));
            }
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
