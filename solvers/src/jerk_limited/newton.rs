//! The passes of one Newton iteration over the intervals of a stretch; see `interior_point`.

use super::hermite::local;
use super::interior_point::{Bound, InteriorPoint};
use super::lanes::Lanes;
use super::model::{project, Model};
use super::rows::{Order, Rows};

/// The iterate, row by row of each interval; see `rows::Order`.
#[derive(Default)]
pub struct State {
    pub slack: Vec<Lanes>,
    pub dual: Vec<Lanes>,
    /// 1/slack.
    pub inverse: Vec<Lanes>,
    /// Of the predictor: the relative change of the slack; of the corrector: the aim; then the step of λ.
    pub aim: Vec<Lanes>,
    /// Slacks at the trial.
    pub trial: Vec<Lanes>,
    /// Rows of one interval at a time: they stay in the nearest cache.
    pub scratch: Vec<Lanes>,
}

impl<X: Model<M>, const M: usize> InteriorPoint<X, M> {
    /// Matrix and gradient at x; the sum of λ s. Multipliers take a part of their step and stay above `least_dual`/s.
    pub(super) fn assemble(&mut self, rows: &Rows<M>, x: &[f64], part: f64, least_dual: f64) -> f64 {
        self.band.clear(rows.intervals.len() + 1);
        self.gradient.fill(0.0);
        let state = &mut self.state;
        let mut work = Lanes::ZERO;
        let floor = Lanes::all(least_dual);
        for (n, interval) in rows.intervals.iter().enumerate() {
            let slack = Order::<M>::of(&state.slack, n);
            let dual = Order::<M>::of_mut(&mut state.dual, n);
            let step = Order::<M>::of(&state.aim, n);
            let inverse = Order::<M>::of_mut(&mut state.inverse, n);
            let weight = Order::<M>::of_mut(&mut state.scratch, 0);
            for k in 0..Order::<M>::COUNT {
                inverse[k] = slack[k].inverse();
                dual[k] = (dual[k] + step[k] * part).max(floor * inverse[k]);
                work += dual[k] * slack[k];
                weight[k] = dual[k] * inverse[k];
            }
            let local = self.model.local(rows, n, &local(x, n, interval.h), weight, dual);
            self.band.add(n, interval.h, &local.matrix);
            for (k, scale) in [1.0, interval.h, 1.0, interval.h].into_iter().enumerate() {
                self.gradient[2 * n + k] += local.gradient[k] * scale;
            }
        }
        let mut work = work.sum();
        for row in self.ends.iter_mut().flatten() {
            row.dual = (row.dual + part * row.aim).max(least_dual / row.slack);
            work += row.dual * row.slack;
            let w = x[2 * row.node];
            let fall = row.ramp / (w * w.sqrt());
            self.gradient[2 * row.node] -= 1.5 * fall;
            self.band.diagonal[row.node][0] +=
                2.25 * fall / w + row.dual / row.slack / (row.greatest * row.greatest);
        }
        work
    }

    /// Relative changes of the slacks along the predictor's step; the sum of λ s at the end of its longest step.
    pub(super) fn predict(&mut self, rows: &Rows<M>) -> f64 {
        let state = &mut self.state;
        let (mut least, mut most) = (Lanes::ZERO, Lanes::ZERO);
        // Sums of λ s, λ ds and λ ds²/s: with dλ = −λ (1 + ds/s) they give λ s after any step.
        let mut sums = [Lanes::ZERO; 3];
        for (n, interval) in rows.intervals.iter().enumerate() {
            let change = Order::<M>::of_mut(&mut state.aim, n);
            self.model.slack_step(rows, n, &local(&self.step, n, interval.h), change);
            let slack = Order::<M>::of(&state.slack, n);
            let dual = Order::<M>::of(&state.dual, n);
            let inverse = Order::<M>::of(&state.inverse, n);
            for k in 0..Order::<M>::COUNT {
                change[k] *= inverse[k];
                least = least.min(change[k]);
                most = most.max(change[k]);
                let work = dual[k] * slack[k];
                let changed = work * change[k];
                sums[0] += work;
                sums[1] += changed;
                sums[2] += changed * change[k];
            }
        }
        let mut sums = sums.map(Lanes::sum);
        let (mut primal, mut dual) = (-least.least(), 1.0 + most.greatest());
        for row in self.ends.iter_mut().flatten() {
            let change = -self.step[2 * row.node] / row.greatest / row.slack;
            primal = primal.max(-change);
            dual = dual.max(1.0 + change);
            let work = row.dual * row.slack;
            sums[0] += work;
            sums[1] += work * change;
            sums[2] += work * change * change;
            row.aim = change;
        }
        let (p, d) = ((1.0 / primal).min(1.0), (1.0 / dual).min(1.0));
        sums[0] + p * sums[1] - d * (sums[0] + sums[1]) - p * d * (sums[1] + sums[2])
    }

    /// The right-hand side of the corrector: λ s of every row towards `target`, less `second` times the predictor's
    /// product, itself at most `most`.
    pub(super) fn correct(&mut self, rows: &Rows<M>, target: f64, second: f64, most: f64) {
        for (r, g) in self.rhs.iter_mut().zip(&self.gradient) {
            *r = -g;
        }
        let state = &mut self.state;
        let (goal, high, low) = (Lanes::all(target), Lanes::all(most), Lanes::all(-most));
        for (n, interval) in rows.intervals.iter().enumerate() {
            let slack = Order::<M>::of(&state.slack, n);
            let dual = Order::<M>::of(&state.dual, n);
            let inverse = Order::<M>::of(&state.inverse, n);
            let aim = Order::<M>::of_mut(&mut state.aim, n);
            for k in 0..Order::<M>::COUNT {
                let product = aim[k] * slack[k] * dual[k] * (Lanes::ONE + aim[k]);
                aim[k] = (goal + product.max(low).min(high) * second) * inverse[k];
            }
            let pull = project(interval.h, &self.model.pull(rows, n, aim));
            for (k, scale) in [1.0, interval.h, 1.0, interval.h].into_iter().enumerate() {
                self.rhs[2 * n + k] += pull[k] * scale;
            }
        }
        for row in self.ends.iter_mut().flatten() {
            let product = row.aim * row.slack * row.dual * (1.0 + row.aim);
            row.aim = (target + second * product.clamp(-most, most)) / row.slack;
            self.rhs[2 * row.node] -= row.aim / row.greatest;
        }
    }

    /// The steps of the multipliers; the longest steps that keep slacks and multipliers positive.
    pub(super) fn direction(&mut self, rows: &Rows<M>) -> (f64, f64) {
        let state = &mut self.state;
        let mut least = Lanes::all(-1e-12);
        let mut dual_most = 1e-12;
        for (n, interval) in rows.intervals.iter().enumerate() {
            let change = Order::<M>::of_mut(&mut state.scratch, 0);
            self.model.slack_step(rows, n, &local(&self.step, n, interval.h), change);
            let inverse = Order::<M>::of(&state.inverse, n);
            let dual = Order::<M>::of(&state.dual, n);
            let aim = Order::<M>::of_mut(&mut state.aim, n);
            let known = Lanes::all(dual_most);
            let mut beyond = Lanes::ZERO;
            for k in 0..Order::<M>::COUNT {
                let change = change[k] * inverse[k];
                least = least.min(change);
                aim[k] = aim[k] - dual[k] * (Lanes::ONE + change);
                beyond = beyond.max(-(aim[k] + dual[k] * known));
            }
            // Few intervals ask for a shorter step than all before: only these divide.
            if beyond.greatest() > 0.0 {
                for k in 0..Order::<M>::COUNT {
                    dual_most = (-(aim[k] * dual[k].inverse())).greatest().max(dual_most);
                }
            }
        }
        let (mut primal, mut dual) = (-least.least(), dual_most);
        for row in self.ends.iter_mut().flatten() {
            let change = -self.step[2 * row.node] / row.greatest / row.slack;
            primal = primal.max(-change);
            row.aim -= row.dual * (1.0 + change);
            dual = dual.max(-row.aim / row.dual);
        }
        (1.0 / primal, 1.0 / dual)
    }

    /// Time and gain of Σ ln s a part of the step further; the time is infinite where a limit is broken.
    pub(super) fn attempt(&mut self, rows: &Rows<M>, bounds: [Bound; 2], x: &[f64], part: f64) -> (f64, f64) {
        for ((to, from), step) in self.trial.iter_mut().zip(x).zip(&self.step) {
            *to = from + part * step;
        }
        self.model.attempt(part);
        let state = &mut self.state;
        let mut gain = 0.0;
        for (n, interval) in rows.intervals.iter().enumerate() {
            let slack = Order::<M>::of_mut(&mut state.trial, n);
            self.model.slack(rows, n, &local(&self.trial, n, interval.h), true, slack);
            let inverse = Order::<M>::of(&state.inverse, n);
            let (mut least, mut product) = (Lanes::ONE, Lanes::ONE);
            for k in 0..Order::<M>::COUNT {
                let ratio = slack[k] * inverse[k];
                least = ratio.min(least);
                product *= ratio;
            }
            if least.least() <= 0.0 {
                return (f64::INFINITY, 0.0);
            }
            gain += product.product().ln();
        }
        for row in self.ends.iter().flatten() {
            let slack = 1.0 - self.trial[2 * row.node] / row.greatest;
            if slack <= 0.0 {
                return (f64::INFINITY, 0.0);
            }
            gain += (slack / row.slack).ln();
        }
        (self.time(rows, bounds, &self.trial, true), gain)
    }

    /// Takes the trial; the multipliers follow with the next `assemble`.
    pub(super) fn accept(&mut self, x: &mut [f64]) {
        x.copy_from_slice(&self.trial);
        let state = &mut self.state;
        std::mem::swap(&mut state.slack, &mut state.trial);
        self.model.accept();
        for row in self.ends.iter_mut().flatten() {
            row.slack = 1.0 - x[2 * row.node] / row.greatest;
        }
    }

    /// The multipliers take a part of their last step.
    pub(super) fn finish(&mut self, part: f64) {
        for (dual, step) in self.state.dual.iter_mut().zip(&self.state.aim) {
            *dual += *step * part;
        }
        for row in self.ends.iter_mut().flatten() {
            row.dual += part * row.aim;
        }
    }
}
