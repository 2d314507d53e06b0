//! The passes of a Newton iteration of `interior_point` over the intervals: matrix, predictor, corrector, step lengths.

use fearless_simd::{dispatch, Simd};

use super::band::EndCondition;
use super::constraints::Constraints;
use super::forms::{motion, project};
use super::hermite::COUNT;
use super::model::Model;
use super::window_end::WindowEnd;
use super::working_space::InteriorPoint;
use feedplan_geometry::lanes::eight::{Lanes, Register};

impl<X: Model> InteriorPoint<X> {
    /// Adds `part` of the multipliers' step, with λ ≥ `least_dual`/s, then assembles matrix and gradient at x. Returns Σ λ s.
    pub(super) fn assemble(&mut self, rows: &Constraints, part: f64, least_dual: f64) -> f64 {
        dispatch!(self.level, simd => self.assemble_on(simd, rows, part, least_dual))
    }

    #[inline(always)]
    fn assemble_on<S: Simd>(&mut self, simd: S, rows: &Constraints, part: f64, least_dual: f64) -> f64 {
        let layout = rows.layout();
        let state = &mut self.state;
        let mut work = Register::all(simd, 0.0);
        let floor = Register::all(simd, least_dual);
        let weight = &mut self.scratch[..layout.all()];
        for (b, block) in rows.blocks.iter().enumerate() {
            let all = b * layout.all()..(b + 1) * layout.all();
            let slack = &mut state.slack[all.clone()];
            let dual = &mut state.dual[all.clone()];
            let step = &state.step[all];
            let mut own = Register::all(simd, 0.0);
            // Rows are pairs: one division gives the inverses of both.
            for k in (0..layout.all()).step_by(2) {
                let both = [slack[k].load(simd), slack[k + 1].load(simd)];
                let per_product = (both[0] * both[1]).inverse();
                for (k, slack_here, other) in [(k, both[0], both[1]), (k + 1, both[1], both[0])] {
                    let inverse = per_product * other;
                    let multiplier = (dual[k] + step[k].load(simd) * part).max(floor * inverse);
                    own += multiplier * slack_here;
                    weight[k] = (multiplier * inverse).into();
                    (dual[k], slack[k]) = (multiplier.into(), inverse.into());
                }
            }
            work += own * block.live;
            let h = block.h.load(simd);
            let local = self.model.local(rows, b, &self.x.local(b, h, block.live), weight, dual);
            self.band.set(b, h, &local);
            self.gradient.set(b, h, local.gradient);
        }
        self.band.close();
        self.gradient.close(rows.count());
        let mut work = work.sum();
        for row in self.ends.iter_mut().flatten() {
            row.dual = (row.dual + part * row.step).max(least_dual / row.slack);
            work += row.dual * row.slack;
            let w = self.x.w[row.station];
            let fall = row.ramp.way() / (w * w.sqrt());
            self.gradient.start.w[row.station] -= 0.5 * fall;
            self.band
                .add(row.station, 0.75 * fall / w + row.dual / row.slack / (row.greatest * row.greatest));
        }
        work
    }

    /// Returns Σ λ s after the predictor's longest step; `work` is Σ λ s before it. Stores the predictor's products −ds dλ,
    /// limited to ±`most`, and the right-hand sides of these products and of the centring at each station.
    pub(super) fn predict(&mut self, rows: &Constraints, work: f64, most: f64) -> f64 {
        dispatch!(self.level, simd => self.predict_on(simd, rows, work, most))
    }

    #[inline(always)]
    fn predict_on<S: Simd>(&mut self, simd: S, rows: &Constraints, work: f64, most: f64) -> f64 {
        let layout = rows.layout();
        let state = &mut self.state;
        let change = &mut self.scratch[..layout.count()];
        let zero = Register::all(simd, 0.0);
        let (high, low) = (Register::all(simd, most), Register::all(simd, -most));
        let (mut least, mut greatest) = (zero, zero);
        // Sums of λ ds and λ ds²/s: with dλ = −λ (1 + ds/s) they give λ s after any step.
        let mut sums = [zero; 2];
        for (b, block) in rows.blocks.iter().enumerate() {
            let h = block.h.load(simd);
            let (d, per_h) = (self.step.local(b, h, block.live), h.inverse());
            let mut pulls = [[zero; 4]; 2];
            for p in 0..COUNT {
                self.model.slack_step(rows, b, p, motion(p, per_h, &d), change);
                let inverse = layout.of(&state.slack, b, p);
                let dual = layout.of(&state.dual, b, p);
                let product = layout.of_mut(&mut state.step, b, p);
                for k in 0..layout.count() {
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
                let centre = self.model.pull(simd, rows, b, p, inverse, 0);
                project(p, per_h, &centre, &mut pulls[0]);
                let second = self.model.pull(simd, rows, b, p, change, 1);
                project(p, per_h, &second, &mut pulls[1]);
            }
            for (terms, own) in self.pulls.iter_mut().zip(pulls) {
                terms.set(b, h, own);
            }
        }
        for terms in &mut self.pulls {
            terms.close(rows.count());
        }
        let mut sums = [sums[0].sum(), sums[1].sum()];
        let (mut primal, mut dual) = (-least.least(), 1.0 + greatest.greatest());
        for row in self.ends.iter_mut().flatten() {
            let change = -self.step.w[row.station] / row.greatest;
            let part = change / row.slack;
            primal = primal.max(-part);
            dual = dual.max(1.0 + part);
            let (first, second) = (row.dual * change, row.dual * change * part);
            sums[0] += first;
            sums[1] += second;
            row.step = (first + second).clamp(-most, most);
            let pull = -1.0 / (row.slack * row.greatest);
            self.pulls[0].start.w[row.station] += pull;
            self.pulls[1].start.w[row.station] += pull * row.step;
        }
        let (p, d) = ((1.0 / primal).min(1.0), (1.0 / dual).min(1.0));
        work + p * sums[0] - d * (work + sums[0]) - p * d * (sums[0] + sums[1])
    }

    /// The predictor's right-hand side.
    pub(super) fn descend(&mut self) {
        self.gradient.give(&mut self.rhs, -1.0);
    }

    /// The corrector's right-hand side: it moves λ s of every row to `target` and includes `second` times the predictor's
    /// products.
    pub(super) fn correct(&mut self, target: f64, second: f64) {
        self.descend();
        for (terms, part) in self.pulls.iter().zip([target, second]) {
            terms.add_to(&mut self.rhs, part);
        }
    }

    /// Computes the steps of the multipliers; returns the longest steps that keep slacks and multipliers positive.
    pub(super) fn direction(&mut self, rows: &Constraints, target: f64, second: f64) -> (f64, f64) {
        dispatch!(self.level, simd => self.direction_on(simd, rows, target, second))
    }

    #[inline(always)]
    fn direction_on<S: Simd>(&mut self, simd: S, rows: &Constraints, target: f64, second: f64) -> (f64, f64) {
        let layout = rows.layout();
        let goal = Register::all(simd, target);
        let change = &mut self.scratch[..layout.count()];
        let state = &mut self.state;
        let mut least = Register::all(simd, -1e-12);
        let mut dual_most = 1e-12;
        for (b, block) in rows.blocks.iter().enumerate() {
            let h = block.h.load(simd);
            let (d, per_h) = (self.step.local(b, h, block.live), h.inverse());
            let known = Register::all(simd, dual_most);
            let mut beyond = Register::all(simd, 0.0);
            for p in 0..COUNT {
                self.model.slack_step(rows, b, p, motion(p, per_h, &d), change);
                let inverse = layout.of(&state.slack, b, p);
                let dual = layout.of(&state.dual, b, p);
                let step = layout.of_mut(&mut state.step, b, p);
                for k in 0..layout.count() {
                    let part = change[k].load(simd) * inverse[k];
                    least = least.min(part);
                    let aim = (goal + step[k].load(simd) * second) * inverse[k];
                    let next = aim - dual[k] * (Lanes::ONE + part);
                    beyond = beyond.min(next + dual[k] * known);
                    step[k] = next.into();
                }
            }
            // Few blocks need a shorter step than all blocks before; only for these the quotients are computed. No lane of
            // `beyond` is above 0, so that the sum is below 0 if any lane is.
            if beyond.sum() < 0.0 {
                let all = b * layout.all()..(b + 1) * layout.all();
                let mut most = known;
                for (step, dual) in state.step[all.clone()].iter().zip(&state.dual[all]) {
                    most = (-(step.load(simd) * dual.load(simd).inverse())).max(most);
                }
                dual_most = most.greatest();
            }
        }
        let (mut primal, mut dual) = (-least.least(), dual_most);
        for row in self.ends.iter_mut().flatten() {
            let change = -self.step.w[row.station] / row.greatest / row.slack;
            primal = primal.max(-change);
            row.step = (target + row.step * second) / row.slack - row.dual * (1.0 + change);
            dual = dual.max(-row.step / row.dual);
        }
        (1.0 / primal, 1.0 / dual)
    }

    /// Moves x and the multipliers by a Newton step that keeps each product λ s. After the step the gradient of the Lagrangian is
    /// 0 to first order. The multipliers stay at 0 or above and w stays above 0, but x may break the limits. Returns false, with
    /// x unchanged, if x is not strictly inside the limits, if the matrix is not positive definite, or if the step leads to w ≤
    /// 0.
    pub(super) fn balance(&mut self, rows: &Constraints, conditions: [EndCondition; 2]) -> bool {
        if self.slacks(rows, false).is_none() {
            return false;
        }
        self.state.step.fill(Lanes::ZERO);
        self.assemble(rows, 0.0, 0.0);
        if !self.factor(conditions) {
            return false;
        }
        dispatch!(self.level, simd => self.pull_on(simd, rows));
        self.correct(1.0, 0.0);
        self.step_to(rows, [[0.0; 2]; 2], [1.0, 0.0]);
        self.try_step(1.0);
        if self.trial.w.iter().any(|&w| w.is_nan() || w <= 0.0) {
            return false;
        }
        std::mem::swap(&mut self.x, &mut self.trial);
        dispatch!(self.level, simd => self.keep_products(simd, rows));
        true
    }

    /// Sets `pulls[0]` to Σ λ ∇s over all rows, at each station.
    #[inline(always)]
    fn pull_on<S: Simd>(&mut self, simd: S, rows: &Constraints) {
        let layout = rows.layout();
        let zero = Register::all(simd, 0.0);
        for (b, block) in rows.blocks.iter().enumerate() {
            let h = block.h.load(simd);
            let per_h = h.inverse();
            let mut own = [zero; 4];
            for p in 0..COUNT {
                let dual = layout.of(&self.state.dual, b, p);
                let pull = self.model.pull(simd, rows, b, p, dual, 0);
                project(p, per_h, &pull, &mut own);
            }
            self.pulls[0].set(b, h, own);
        }
        self.pulls[0].close(rows.count());
        for row in self.ends.iter().flatten() {
            self.pulls[0].start.w[row.station] -= row.dual / row.greatest;
        }
    }

    /// Changes the multipliers so that to first order λ s stays as it was before the step, and accepts the step.
    #[inline(always)]
    fn keep_products<S: Simd>(&mut self, simd: S, rows: &Constraints) {
        let layout = rows.layout();
        let change = &mut self.scratch[..layout.count()];
        let zero = Register::all(simd, 0.0);
        for (b, block) in rows.blocks.iter().enumerate() {
            let h = block.h.load(simd);
            let (d, per_h) = (self.step.local(b, h, block.live), h.inverse());
            for p in 0..COUNT {
                self.model.slack_step(rows, b, p, motion(p, per_h, &d), change);
                let inverse = layout.of(&self.state.slack, b, p);
                let dual = layout.of_mut(&mut self.state.dual, b, p);
                for k in 0..layout.count() {
                    let part = change[k].load(simd) * inverse[k];
                    dual[k] = (dual[k] * (Lanes::ONE - part)).max(zero).into();
                }
            }
        }
        for row in self.ends.iter_mut().flatten() {
            let part = -self.step.w[row.station] / row.greatest / row.slack;
            row.dual = (row.dual * (1.0 - part)).max(0.0);
        }
        self.model.attempt(simd, 1.0);
        self.model.accept();
    }

    /// Factors the matrix; false if it is not positive definite.
    pub(super) fn factor(&mut self, conditions: [EndCondition; 2]) -> bool {
        dispatch!(self.level, _simd => self.band.factor(conditions))
    }

    /// Solves for the step with the present right-hand side. `missing` are the steps at given ends, `pulls` the factors of the
    /// centring and of the predictor's products in the right-hand side.
    pub(super) fn step_to(&mut self, rows: &Constraints, missing: [[f64; 2]; 2], pulls: [f64; 2]) {
        self.band.solve(&self.rhs, missing, &mut self.step);
        dispatch!(self.level, simd => self.model.solved(simd, rows, &self.step, pulls));
    }

    /// Time and Σ ln s after a part of the step; the time is infinite where a limit is broken.
    pub(super) fn attempt(&mut self, rows: &Constraints, ends: [WindowEnd; 2], part: f64) -> (f64, f64) {
        self.try_step(part);
        dispatch!(self.level, simd => self.model.attempt(simd, part));
        match self.slacks(rows, true) {
            Some(logarithm) => (self.time(rows, ends, true), logarithm),
            None => (f64::INFINITY, 0.0),
        }
    }

    /// Sets the trial to x plus `part` of the step.
    fn try_step(&mut self, part: f64) {
        let Self { trial, x, step, .. } = self;
        let columns = [(&mut trial.w, &x.w, &step.w), (&mut trial.slope, &x.slope, &step.slope)];
        for (to, from, step) in columns {
            for ((to, from), step) in to.iter_mut().zip(from).zip(step) {
                *to = from + part * step;
            }
        }
    }

    /// Adds `part` of the multipliers' last step.
    pub(super) fn finish(&mut self, part: f64) {
        for (dual, step) in self.state.dual.iter_mut().zip(&self.state.step) {
            for (dual, step) in dual.values_mut().iter_mut().zip(step.values()) {
                *dual += step * part;
            }
        }
        for row in self.ends.iter_mut().flatten() {
            row.dual += part * row.step;
        }
    }
}
