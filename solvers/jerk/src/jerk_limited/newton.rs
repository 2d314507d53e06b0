//! The passes of a Newton iteration of `interior_point` over the intervals: matrix, predictor, corrector, step lengths.

use fearless_simd::Simd;

use super::band::EndCondition;
use super::constraints::{Constraints, RowLayout};
use super::forms::project;
use super::hermite::local;
use super::model::Model;
use super::window_end::WindowEnd;
use super::working_space::InteriorPoint;
use feedplan_geometry::lanes::{Lanes, Register};

impl<X: Model<M>, const M: usize> InteriorPoint<X, M> {
    /// Assembles matrix and gradient at x, after `part` of the multipliers' step with λ ≥ `least_dual`/s; returns Σ λ
    /// s.
    #[inline(always)]
    pub(super) fn assemble<S: Simd>(
        &mut self,
        simd: S,
        rows: &Constraints<M>,
        x: &[f64],
        part: f64,
        least_dual: f64,
    ) -> f64 {
        self.band.clear(rows.intervals.len() + 1);
        self.gradient.fill(0.0);
        let state = &mut self.state;
        let mut work = Register::all(simd, 0.0);
        let floor = Register::all(simd, least_dual);
        let weight = &mut self.scratch[..];
        for (n, interval) in rows.intervals.iter().enumerate() {
            let slack = RowLayout::<M>::of_mut(&mut state.slack, n);
            let dual = RowLayout::<M>::of_mut(&mut state.dual, n);
            let step = RowLayout::<M>::of(&state.step, n);
            for k in 0..RowLayout::<M>::COUNT {
                let inverse = slack[k].load(simd).inverse();
                let multiplier = (dual[k] + step[k].load(simd) * part).max(floor * inverse);
                work += multiplier * slack[k];
                weight[k] = (multiplier * inverse).into();
                (dual[k], slack[k]) = (multiplier.into(), inverse.into());
            }
            let local = self.model.local(simd, rows, n, &local(x, n, interval.h), weight, dual);
            self.band.add(n, interval.h, &local.matrix);
            for (k, scale) in [1.0, interval.h, 1.0, interval.h].into_iter().enumerate() {
                self.gradient[2 * n + k] += local.gradient[k] * scale;
            }
        }
        let mut work = work.sum();
        for row in self.ends.iter_mut().flatten() {
            row.dual = (row.dual + part * row.step).max(least_dual / row.slack);
            work += row.dual * row.slack;
            let w = x[2 * row.station];
            let fall = row.ramp.way() / (w * w.sqrt());
            self.gradient[2 * row.station] -= 0.5 * fall;
            self.band.diagonal[row.station][0] +=
                0.75 * fall / w + row.dual / row.slack / (row.greatest * row.greatest);
        }
        work
    }

    /// Returns Σ λ s, now `work`, after the predictor's longest step. Keeps the predictor's products −ds dλ, each at
    /// most `most` in size, and the pulls of these products and of the centring on each station.
    #[inline(always)]
    pub(super) fn predict<S: Simd>(&mut self, simd: S, rows: &Constraints<M>, work: f64, most: f64) -> f64 {
        self.pulls.fill([[0.0; 2]; 2]);
        let state = &mut self.state;
        let change = &mut self.scratch[..RowLayout::<M>::COUNT];
        let zero = Register::all(simd, 0.0);
        let (high, low) = (Register::all(simd, most), Register::all(simd, -most));
        let (mut least, mut greatest) = (zero, zero);
        // Sums of λ ds and λ ds²/s: with dλ = −λ (1 + ds/s) they give λ s after any step.
        let mut sums = [zero; 2];
        for (n, interval) in rows.intervals.iter().enumerate() {
            self.model.slack_step(simd, rows, n, &local(&self.step, n, interval.h), change);
            let inverse = RowLayout::<M>::of(&state.slack, n);
            let dual = RowLayout::<M>::of(&state.dual, n);
            let product = RowLayout::<M>::of_mut(&mut state.step, n);
            for k in 0..RowLayout::<M>::COUNT {
                let step = change[k].load(simd);
                let part = step * inverse[k];
                least = least.min(part);
                greatest = greatest.max(part);
                let first = dual[k] * step;
                let second = first * part;
                sums[0] += first;
                sums[1] += second;
                let both = (first + second).max(low).min(high);
                (product[k], change[k]) = (both.into(), (both * inverse[k]).into());
            }
            let pulls =
                [self.model.pull(simd, rows, n, inverse, 0), self.model.pull(simd, rows, n, change, 1)];
            for (which, pull) in pulls.iter().enumerate() {
                let [w0, d0, w1, d1] = project(interval.h, pull);
                add(&mut self.pulls[n][which], [w0, d0 * interval.h]);
                add(&mut self.pulls[n + 1][which], [w1, d1 * interval.h]);
            }
        }
        let mut sums = [sums[0].sum(), sums[1].sum()];
        let (mut primal, mut dual) = (-least.least(), 1.0 + greatest.greatest());
        for row in self.ends.iter_mut().flatten() {
            let change = -self.step[2 * row.station] / row.greatest;
            let part = change / row.slack;
            primal = primal.max(-part);
            dual = dual.max(1.0 + part);
            let (first, second) = (row.dual * change, row.dual * change * part);
            sums[0] += first;
            sums[1] += second;
            row.step = (first + second).clamp(-most, most);
            let pull = -1.0 / (row.slack * row.greatest);
            self.pulls[row.station][0][0] += pull;
            self.pulls[row.station][1][0] += pull * row.step;
        }
        let (p, d) = ((1.0 / primal).min(1.0), (1.0 / dual).min(1.0));
        work + p * sums[0] - d * (work + sums[0]) - p * d * (sums[0] + sums[1])
    }

    /// The corrector's right-hand side: λ s of every row to `target`, and `second` times the predictor's products.
    #[inline(always)]
    pub(super) fn correct(&mut self, target: f64, second: f64) {
        for ((rhs, gradient), pulls) in
            self.rhs.chunks_exact_mut(2).zip(self.gradient.chunks_exact(2)).zip(&self.pulls)
        {
            for i in 0..2 {
                rhs[i] = target * pulls[0][i] + second * pulls[1][i] - gradient[i];
            }
        }
    }

    /// Computes the steps of the multipliers; returns the longest steps that keep slacks and multipliers positive.
    #[inline(always)]
    pub(super) fn direction<S: Simd>(
        &mut self,
        simd: S,
        rows: &Constraints<M>,
        target: f64,
        second: f64,
    ) -> (f64, f64) {
        let goal = Register::all(simd, target);
        let change = &mut self.scratch[..RowLayout::<M>::COUNT];
        let state = &mut self.state;
        let mut least = Register::all(simd, -1e-12);
        let mut dual_most = 1e-12;
        for (n, interval) in rows.intervals.iter().enumerate() {
            self.model.slack_step(simd, rows, n, &local(&self.step, n, interval.h), change);
            let inverse = RowLayout::<M>::of(&state.slack, n);
            let dual = RowLayout::<M>::of(&state.dual, n);
            let step = RowLayout::<M>::of_mut(&mut state.step, n);
            let known = Register::all(simd, dual_most);
            let mut beyond = Register::all(simd, 0.0);
            for k in 0..RowLayout::<M>::COUNT {
                let part = change[k].load(simd) * inverse[k];
                least = least.min(part);
                let aim = (goal + step[k].load(simd) * second) * inverse[k];
                let next = aim - dual[k] * (Lanes::ONE + part);
                beyond = beyond.min(next + dual[k] * known);
                step[k] = next.into();
            }
            // Few intervals need a shorter step than all before; only these divide. No lane is above 0.
            if beyond.sum() < 0.0 {
                for k in 0..RowLayout::<M>::COUNT {
                    let part = step[k] * dual[k].load(simd).inverse();
                    dual_most = (-part).greatest().max(dual_most);
                }
            }
        }
        let (mut primal, mut dual) = (-least.least(), dual_most);
        for row in self.ends.iter_mut().flatten() {
            let change = -self.step[2 * row.station] / row.greatest / row.slack;
            primal = primal.max(-change);
            row.step = (target + row.step * second) / row.slack - row.dual * (1.0 + change);
            dual = dual.max(-row.step / row.dual);
        }
        (1.0 / primal, 1.0 / dual)
    }

    /// Moves x and the multipliers by a Newton step that keeps λ s: to first order the gradient of the Lagrangian
    /// vanishes there. The multipliers stay at 0 or above, and w above 0, but x may leave the limits. False where there
    /// is no such step.
    #[inline(always)]
    pub(super) fn balance<S: Simd>(
        &mut self,
        simd: S,
        rows: &Constraints<M>,
        conditions: [EndCondition; 2],
        x: &mut [f64],
    ) -> bool {
        if self.slacks(simd, rows, x, false).is_none() {
            return false;
        }
        self.state.step.fill(Lanes::ZERO);
        self.assemble(simd, rows, x, 0.0, 0.0);
        if !self.band.factor(conditions) {
            return false;
        }
        self.pulls.fill([[0.0; 2]; 2]);
        for (n, interval) in rows.intervals.iter().enumerate() {
            let pull = self.model.pull(simd, rows, n, RowLayout::<M>::of(&self.state.dual, n), 0);
            let [w0, d0, w1, d1] = project(interval.h, &pull);
            add(&mut self.pulls[n][0], [w0, d0 * interval.h]);
            add(&mut self.pulls[n + 1][0], [w1, d1 * interval.h]);
        }
        for row in self.ends.iter().flatten() {
            self.pulls[row.station][0][0] -= row.dual / row.greatest;
        }
        self.correct(1.0, 0.0);
        self.band.solve(&self.rhs, [[0.0; 2]; 2], &mut self.step);
        for ((to, from), step) in self.trial.iter_mut().zip(x.iter()).zip(&self.step) {
            *to = from + step;
        }
        if self.trial.iter().step_by(2).any(|&w| w.is_nan() || w <= 0.0) {
            return false;
        }
        x.copy_from_slice(&self.trial);
        self.model.solved(simd, rows, &self.step, [1.0, 0.0]);
        let change = &mut self.scratch[..RowLayout::<M>::COUNT];
        let zero = Register::all(simd, 0.0);
        for (n, interval) in rows.intervals.iter().enumerate() {
            self.model.slack_step(simd, rows, n, &local(&self.step, n, interval.h), change);
            let inverse = RowLayout::<M>::of(&self.state.slack, n);
            let dual = RowLayout::<M>::of_mut(&mut self.state.dual, n);
            for k in 0..RowLayout::<M>::COUNT {
                let part = change[k].load(simd) * inverse[k];
                dual[k] = (dual[k] * (Lanes::ONE - part)).max(zero).into();
            }
        }
        for row in self.ends.iter_mut().flatten() {
            let part = -self.step[2 * row.station] / row.greatest / row.slack;
            row.dual = (row.dual * (1.0 - part)).max(0.0);
        }
        self.model.attempt(simd, 1.0);
        self.model.accept();
        true
    }

    /// Time and Σ ln s after a part of the step; the time is infinite where a limit is broken.
    #[inline(always)]
    pub(super) fn attempt<S: Simd>(
        &mut self,
        simd: S,
        rows: &Constraints<M>,
        ends: [WindowEnd; 2],
        x: &[f64],
        part: f64,
    ) -> (f64, f64) {
        let mut trial = std::mem::take(&mut self.trial);
        for ((to, from), step) in trial.iter_mut().zip(x).zip(&self.step) {
            *to = from + part * step;
        }
        self.model.attempt(simd, part);
        let logarithm = self.slacks(simd, rows, &trial, true);
        self.trial = trial;
        match logarithm {
            Some(logarithm) => (self.time(simd, rows, ends, &self.trial, true), logarithm),
            None => (f64::INFINITY, 0.0),
        }
    }

    /// Adds a part of the multipliers' last step.
    #[inline(always)]
    pub(super) fn finish<S: Simd>(&mut self, simd: S, part: f64) {
        for (dual, step) in self.state.dual.iter_mut().zip(&self.state.step) {
            *dual = (*dual + step.load(simd) * part).into();
        }
        for row in self.ends.iter_mut().flatten() {
            row.dual += part * row.step;
        }
    }
}

#[inline(always)]
fn add(to: &mut [f64; 2], more: [f64; 2]) {
    to[0] += more[0];
    to[1] += more[1];
}
