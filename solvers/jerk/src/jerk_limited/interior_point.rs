//! A feasible primal-dual interior-point method on one window: least ∫ ds/√w over C¹ cubic splines w under
//! `Constraints`.
//!
//! Newton's method on the perturbed optimality conditions, with the predictor and corrector of Mehrotra (SIAM J. Optim.
//! 2, 1992). The matrix leaves out the curvature of the jerk's slack, so that it stays positive definite. The slack is
//! convex: a step up to the boundary of its tangent stays valid, and every iterate is a valid plan.
//!
//! Symbols: λ multipliers, μ mean complementarity λ s per row, σ centring, T time.

use std::time::Instant;

use fearless_simd::dispatch;

use super::band::EndCondition;
use super::constraints::Constraints;
use super::model::Model;
use super::window_end::WindowEnd;
use super::working_space::{EndRow, InteriorPoint};
use feedplan_geometry::watch::Watch;

/// When to stop, and how to start.
#[derive(Clone, Copy, Debug)]
pub struct Effort<'a> {
    /// Complementarity gap, as a fraction of the time.
    pub tolerance: f64,
    pub max_iterations: usize,
    pub deadline: Option<Instant>,
    /// First μ, as a fraction of the time per row: 1 for a start far from the optimum, less for a nearly optimal plan.
    pub barrier: f64,
    /// Whether the multipliers start from those of the last solution on the same intervals (raised to μ/s where they are less).
    pub warm: bool,
    pub watch: Watch<'a>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Outcome {
    Converged,
    /// The limit of iterations or time stopped it; the iterate is valid.
    Stopped,
    /// No step improves the iterate, which is valid.
    Stalled,
    /// The start is not strictly inside the limits.
    NotInside,
    /// The given ends were not reached: the iterate is not a plan.
    Missed,
}

#[derive(Clone, Copy, Debug)]
pub struct Report {
    pub outcome: Outcome,
    pub iterations: usize,
    /// Time of the window with its ramps, in s.
    pub time: f64,
    /// Σ λ s: an estimate of the time above the minimum, in s.
    pub excess: f64,
}

/// Steps go this fraction of the distance to the boundary of the feasible set.
const STEP: f64 = 0.995;
/// Given ends count as met within this relative error.
const MET: f64 = 1e-9;
/// Lower limit of the target μ in the first steps for `barrier` = 1, as a fraction of the time per row. It is scaled by
/// `barrier`².
const FLOOR: f64 = 0.3;
/// Steps shorter than this fraction of Newton's step count as no progress.
const LEAST_STEP: f64 = 1e-6;
/// λ s stays above this fraction of the target μ.
pub(super) const LEAST_DUAL: f64 = 1e-4;

impl<X: Model> InteriorPoint<X> {
    /// Improves the valid plan x = (w_0, w'_0, w_1, …) in place. The start need not meet given ends.
    pub fn solve(
        &mut self,
        rows: &Constraints,
        ends: [WindowEnd; 2],
        x: &mut [f64],
        effort: &Effort,
    ) -> Report {
        self.take(rows, x);
        let report = self.improve(rows, ends, effort);
        self.x.give(x);
        report
    }

    /// One Newton step that balances the multipliers of a solution; see `balance`. The step may break the limits. Returns false,
    /// with x unchanged, if there is no such step.
    pub fn settle(&mut self, rows: &Constraints, ends: &[WindowEnd; 2], x: &mut [f64]) -> bool {
        let conditions = [end_condition(&ends[0], 1.0), end_condition(&ends[1], -1.0)];
        self.x.take(x);
        let settled = self.balance(rows, conditions);
        self.x.give(x);
        settled
    }

    fn improve(&mut self, rows: &Constraints, ends: [WindowEnd; 2], effort: &Effort) -> Report {
        let total = (rows.count() * rows.layout().all() + 2) as f64;
        dispatch!(self.level, simd => self.model.begin(simd, rows, &self.x));
        let mut time = self.time(rows, ends, false);
        let Some(mut logarithm) = self.enter(rows, ends, effort.barrier * time / total, effort.warm) else {
            return Report { outcome: Outcome::NotInside, iterations: 0, time, excess: time };
        };
        let conditions = [end_condition(&ends[0], 1.0), end_condition(&ends[1], -1.0)];
        // Far from the optimum the target μ has a lower limit, which falls after each long step that gains little time.
        let mut floor = FLOOR * effort.barrier * effort.barrier;
        // The fraction of the multipliers' last step that is still to be added, and the lower limit of λ s after it.
        let (mut dual, mut least_dual) = (0.0, 0.0);
        let mut gain = f64::INFINITY;
        let mut excess = time;
        let mut outcome = Outcome::Stopped;
        let mut iterations = 0;
        while iterations < effort.max_iterations && effort.deadline.is_none_or(|end| Instant::now() < end) {
            effort.watch.check();
            let work = self.assemble(rows, dual, least_dual);
            dual = 0.0;
            let mu = work / total;
            let gap = work / time;
            excess = work;
            let missing = self.missing(&ends);
            let met = self.miss(&ends, rows) < MET;
            if met && gap < effort.tolerance && gain.abs() < effort.tolerance.max(1e-6) * time {
                outcome = Outcome::Converged;
                break;
            }
            iterations += 1;
            if !self.factor(conditions) {
                outcome = Outcome::Stalled;
                break;
            }

            // Predictor: the longest pure Newton step gives the centring σ.
            self.descend();
            self.step_to(rows, missing, [0.0; 2]);
            let after = self.predict(rows, work, 3.0 * mu) / total;
            let sigma = (after.max(0.0) / mu).powi(3).clamp(if met { 1e-3 } else { 0.3 }, 0.5);
            let least = floor * time / total;
            let target = least.max(sigma * mu);

            // Corrector: towards the target, with the predictor's second order unless the floor sets the target.
            let second = if least > sigma * mu { 0.0 } else { 1.0 };
            self.correct(target, second);
            self.step_to(rows, missing, [target, second]);
            let longest = self.direction(rows, target, second);
            let mut part = (STEP * longest.0).min(1.0);
            let mut next = self.attempt(rows, ends, part);
            for _ in 0..20 {
                let valid = next.0.is_finite();
                if valid && (!met || next.0 - target * (next.1 - logarithm) <= time * (1.0 + 1e-9)) {
                    break;
                }
                part *= 0.6;
                next = self.attempt(rows, ends, part);
            }
            if !next.0.is_finite() {
                outcome = Outcome::Stalled;
                break;
            }
            std::mem::swap(&mut self.x, &mut self.trial);
            self.model.accept();
            logarithm = next.1;
            (dual, least_dual) = ((STEP * longest.1).min(1.0), LEAST_DUAL * target);
            gain = time - next.0;
            time = next.0;
            if part > 0.6 && gain < 0.08 * time {
                floor *= 0.1;
            }
            if part < LEAST_STEP {
                outcome = Outcome::Stalled;
                break;
            }
        }
        self.finish(dual);
        if self.miss(&ends, rows) < MET {
            self.snap_ends(&ends);
        } else {
            outcome = Outcome::Missed;
        }
        Report { outcome, iterations, time: self.time(rows, ends, false), excess }
    }

    /// Computes slacks and multipliers of the start. Returns Σ ln s, or None unless the start is strictly inside the limits.
    fn enter(&mut self, rows: &Constraints, ends: [WindowEnd; 2], mu: f64, warm: bool) -> Option<f64> {
        let last = self.ends;
        self.ends = std::array::from_fn(|end| match ends[end] {
            WindowEnd::Fixed { .. } | WindowEnd::Free => None,
            WindowEnd::Rest { ramp, greatest } => {
                let station = end * rows.count();
                Some(EndRow { station, ramp, greatest, slack: 1.0, dual: 0.0, step: 0.0 })
            }
        });
        let logarithm = self.slacks(rows, false)?;
        for (dual, slack) in self.state.dual.iter_mut().zip(&self.state.slack) {
            for (dual, slack) in dual.values_mut().iter_mut().zip(slack.values()) {
                let centred = mu / slack;
                *dual = if warm { dual.max(centred) } else { centred };
            }
        }
        for (row, last) in self.ends.iter_mut().zip(last) {
            if let Some(row) = row {
                let known = last.filter(|_| warm).map_or(0.0, |last| last.dual);
                row.dual = known.max(mu / row.slack);
            }
        }
        Some(logarithm)
    }

    /// The index of the station at an end: 0 at the first end, the number of intervals at the second.
    fn station(&self, end: usize) -> usize {
        end * self.band.intervals()
    }

    /// The steps of (w, w') that lead from x to the given values; 0 at ends that are not given.
    fn missing(&self, ends: &[WindowEnd; 2]) -> [[f64; 2]; 2] {
        std::array::from_fn(|end| match ends[end] {
            WindowEnd::Rest { .. } | WindowEnd::Free => [0.0; 2],
            WindowEnd::Fixed { w, slope } => {
                let own = self.x.at(self.station(end));
                [w - own[0], slope - own[1]]
            }
        })
    }

    /// The greatest error of x at given ends, relative to the given w.
    fn miss(&self, ends: &[WindowEnd; 2], rows: &Constraints) -> f64 {
        let lacks = self.missing(ends);
        let h = [rows.h(0), rows.h(rows.count() - 1)];
        let mut worst: f64 = 0.0;
        for end in 0..2 {
            if let WindowEnd::Fixed { w, .. } = ends[end] {
                worst = worst.max(lacks[end][0].abs() / w).max(lacks[end][1].abs() * h[end] / w);
            }
        }
        worst
    }

    /// Sets (w, w') at given ends to exactly the given values, to remove rounding errors.
    fn snap_ends(&mut self, ends: &[WindowEnd; 2]) {
        for (end, kind) in ends.iter().enumerate() {
            if let WindowEnd::Fixed { w, slope } = *kind {
                let station = self.station(end);
                (self.x.w[station], self.x.slope[station]) = (w, slope);
            }
        }
    }
}

/// The condition on the unknowns of an end; `sign` is 1 at the first end and −1 at the last.
fn end_condition(kind: &WindowEnd, sign: f64) -> EndCondition {
    match kind {
        WindowEnd::Rest { ramp, .. } => EndCondition::Slope(sign * ramp.slope()),
        WindowEnd::Fixed { .. } => EndCondition::Given,
        WindowEnd::Free => EndCondition::Free,
    }
}
