//! A feasible primal-dual interior point on one stretch: least ∫ ds/√w over C¹ cubic splines w under `Rows`.
//!
//! Newton's method on the perturbed optimality conditions, predictor and corrector after Mehrotra. The curvature of
//! the jerk slack is left out of the matrix, which so stays positive definite; the slack is convex, so a step to
//! the boundary of its tangent stays valid, and every iterate is a plan.
//!
//! λ multipliers, μ their mean complementarity, σ the centring, T the time.

use std::time::Instant;

use fearless_simd::{dispatch, Level, Simd};

use super::band::{Band, Tie};
use super::hermite::local;
use super::model::Model;
use super::newton::State;
use super::rows::{Order, Rows};
use crate::lanes::{Lanes, LogProduct};
use feedplan_geometry::watch::Watch;

/// What is known at an end of a stretch.
#[derive(Clone, Copy, Debug)]
pub enum Bound {
    /// The path begins or ends at rest: w ∝ s^(4/3) on a ramp of this length, with w at most `greatest` at its end.
    Rest { ramp: f64, greatest: f64 },
    /// w and w' are given.
    Fixed { w: f64, slope: f64 },
}

impl Bound {
    /// Whether a spline with this end is one for it.
    pub fn is_met(&self, end_w: f64, end_slope: f64) -> bool {
        match *self {
            Self::Rest { .. } => true,
            Self::Fixed { w, slope } => (end_w, end_slope) == (w, slope),
        }
    }
}

/// When to stop.
#[derive(Clone, Copy, Debug)]
pub struct Effort<'a> {
    /// The gap of complementarity, in parts of the time.
    pub tolerance: f64,
    pub max_iterations: usize,
    pub deadline: Option<Instant>,
    /// The first μ in parts of the mean time per row: 1 from afar, less from a plan that is nearly optimal.
    pub barrier: f64,
    /// Multipliers begin as the last solution, of these intervals, left them; with those of μ where they are greater.
    pub warm: bool,
    pub watch: Watch<'a>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Outcome {
    Converged,
    /// The limit of iterations or time came first; the iterate is valid.
    Stopped,
    /// No step leads further; the iterate is valid.
    Stalled,
    /// The start is not inside the limits.
    NotInside,
    /// The given ends were not reached: the iterate is no plan.
    Missed,
}

#[derive(Clone, Copy, Debug)]
pub struct Report {
    pub outcome: Outcome,
    pub iterations: usize,
    /// Time of the stretch with its ramps, in s.
    pub time: f64,
    /// What the multipliers leave between it and the least one, in s.
    pub excess: f64,
}

/// Part of the way to the boundary.
const STEP: f64 = 0.995;
/// Ends are met to this part of themselves.
const MET: f64 = 1e-9;
/// Steps below this part of Newton's are no progress.
const LEAST_STEP: f64 = 1e-6;
/// λ s keeps at least this part of the complementarity aimed at.
pub(super) const LEAST_DUAL: f64 = 1e-4;

/// Working space, reused from stretch to stretch.
pub struct InteriorPoint<X, const M: usize> {
    /// What instructions the processor has.
    pub(super) level: Level,
    pub(super) model: X,
    pub(super) band: Band,
    pub(super) state: State,
    pub(super) gradient: Vec<f64>,
    pub(super) rhs: Vec<f64>,
    pub(super) step: Vec<f64>,
    pub(super) trial: Vec<f64>,
    /// On (w, w') of each node: the pull of the centre, for λ s of 1, and of the predictor's products.
    pub(super) pulls: Vec<[[f64; 2]; 2]>,
    /// Rows of one interval at a time: they stay in the nearest cache.
    pub(super) scratch: Vec<Lanes>,
    pub(super) ends: [Option<EndRow>; 2],
}

/// The limit of w at the end of a ramp.
#[derive(Clone, Copy, Debug)]
pub(super) struct EndRow {
    pub node: usize,
    pub ramp: f64,
    pub greatest: f64,
    pub slack: f64,
    pub dual: f64,
    /// As in `State`.
    pub step: f64,
}

impl<X: Model<M>, const M: usize> Default for InteriorPoint<X, M> {
    fn default() -> Self {
        Self {
            level: Level::new(),
            model: X::default(),
            band: Band::default(),
            state: State::default(),
            gradient: vec![],
            rhs: vec![],
            step: vec![],
            trial: vec![],
            pulls: vec![],
            scratch: vec![],
            ends: [None; 2],
        }
    }
}

impl<X: Model<M>, const M: usize> InteriorPoint<X, M> {
    /// Improves the valid plan x = (w_0, w'_0, w_1, …) in place. Ends given as fixed may be missed by the start.
    pub fn solve(&mut self, rows: &Rows<M>, bounds: [Bound; 2], x: &mut [f64], effort: &Effort) -> Report {
        dispatch!(self.level, simd => self.improve(simd, rows, bounds, x, effort))
    }

    #[inline(always)]
    fn improve<S: Simd>(
        &mut self,
        simd: S,
        rows: &Rows<M>,
        bounds: [Bound; 2],
        x: &mut [f64],
        effort: &Effort,
    ) -> Report {
        let count = rows.intervals.len();
        let total = (count * 4 * Order::<M>::COUNT + 2) as f64;
        self.resize(count);
        self.model.begin(simd, rows, x);
        let mut time = self.time(simd, rows, bounds, x, false);
        let Some(mut logarithm) =
            self.enter(simd, rows, bounds, x, effort.barrier * time / total, effort.warm)
        else {
            return Report { outcome: Outcome::NotInside, iterations: 0, time, excess: time };
        };
        let ties = [tie(&bounds[0], 1.0), tie(&bounds[1], -1.0)];
        let mut floor = 0.3 * effort.barrier;
        // The part of the multipliers' step that is still to be taken, and their least complementarity then.
        let (mut dual, mut least_dual) = (0.0, 0.0);
        let mut gain = f64::INFINITY;
        let mut excess = time;
        let mut outcome = Outcome::Stopped;
        let mut iterations = 0;
        while iterations < effort.max_iterations && effort.deadline.is_none_or(|end| Instant::now() < end) {
            effort.watch.check();
            let work = self.assemble(simd, rows, x, dual, least_dual);
            dual = 0.0;
            let mu = work / total;
            let gap = work / time;
            excess = work;
            let missing = missing(&bounds, x);
            let met = miss(&bounds, x, &rows.intervals) < MET;
            if met && gap < effort.tolerance && gain.abs() < effort.tolerance.max(1e-6) * time {
                outcome = Outcome::Converged;
                break;
            }
            iterations += 1;
            if !self.band.factor(ties) {
                outcome = Outcome::Stalled;
                break;
            }

            // Predictor: how far does the pure Newton step get?
            for (r, g) in self.rhs.iter_mut().zip(&self.gradient) {
                *r = -g;
            }
            self.band.solve(&self.rhs, missing, &mut self.step);
            self.model.solved(simd, rows, &self.step, [0.0; 2]);
            let after = self.predict(simd, rows, work, 3.0 * mu) / total;
            let sigma = (after.max(0.0) / mu).powi(3).clamp(if met { 1e-3 } else { 0.3 }, 0.5);
            let least = floor * time / total;
            let target = least.max(sigma * mu);

            // Corrector: towards the target, with the second order of the predictor where it is of use.
            let second = if least > sigma * mu { 0.0 } else { 1.0 };
            self.correct(target, second);
            self.band.solve(&self.rhs, missing, &mut self.step);
            self.model.solved(simd, rows, &self.step, [target, second]);
            let longest = self.direction(simd, rows, target, second);
            let mut part = (STEP * longest.0).min(1.0);
            let mut next = self.attempt(simd, rows, bounds, x, part);
            for _ in 0..20 {
                let valid = next.0.is_finite();
                if valid && (!met || next.0 - target * (next.1 - logarithm) <= time * (1.0 + 1e-9)) {
                    break;
                }
                part *= 0.6;
                next = self.attempt(simd, rows, bounds, x, part);
            }
            if !next.0.is_finite() {
                outcome = Outcome::Stalled;
                break;
            }
            x.copy_from_slice(&self.trial);
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
        self.finish(simd, dual);
        if miss(&bounds, x, &rows.intervals) < MET {
            settle(&bounds, x);
        } else {
            outcome = Outcome::Missed;
        }
        Report { outcome, iterations, time: self.time(simd, rows, bounds, x, false), excess }
    }

    #[inline(always)]
    fn resize(&mut self, count: usize) {
        let state = &mut self.state;
        for vector in [&mut state.slack, &mut state.dual, &mut state.step] {
            vector.resize(count * Order::<M>::COUNT, Lanes::ONE);
        }
        state.step.fill(Lanes::ZERO);
        self.scratch.resize(Order::<M>::COUNT, Lanes::ONE);
        self.pulls.resize(count + 1, [[0.0; 2]; 2]);
        for vector in [&mut self.gradient, &mut self.rhs, &mut self.step, &mut self.trial] {
            vector.resize(2 * count + 2, 0.0);
        }
    }

    /// Slacks and multipliers of the start; Σ ln s, unless it is not inside.
    #[inline(always)]
    fn enter<S: Simd>(
        &mut self,
        simd: S,
        rows: &Rows<M>,
        bounds: [Bound; 2],
        x: &[f64],
        mu: f64,
        warm: bool,
    ) -> Option<f64> {
        let last = self.ends;
        self.ends = std::array::from_fn(|end| match bounds[end] {
            Bound::Fixed { .. } => None,
            Bound::Rest { ramp, greatest } => {
                let node = end * rows.intervals.len();
                Some(EndRow { node, ramp, greatest, slack: 1.0, dual: 0.0, step: 0.0 })
            }
        });
        let logarithm = self.slacks(simd, rows, x, false)?;
        for (dual, slack) in self.state.dual.iter_mut().zip(&self.state.slack) {
            let centred = slack.load(simd).inverse() * mu;
            *dual = if warm { dual.load(simd).max(centred) } else { centred }.into();
        }
        for (row, last) in self.ends.iter_mut().zip(last) {
            if let Some(row) = row {
                let known = last.filter(|_| warm).map_or(0.0, |last| last.dual);
                row.dual = known.max(mu / row.slack);
            }
        }
        Some(logarithm)
    }

    /// Slacks of x, or of the trial; Σ ln s, unless a limit is broken.
    #[inline(always)]
    pub(super) fn slacks<S: Simd>(&mut self, simd: S, rows: &Rows<M>, x: &[f64], trial: bool) -> Option<f64> {
        let mut product = LogProduct::default();
        for (n, interval) in rows.intervals.iter().enumerate() {
            let slack = Order::<M>::of_mut(&mut self.state.slack, n);
            self.model.slack(simd, rows, n, &local(x, n, interval.h), trial, slack);
            let (mut least, mut all) = (slack[0].load(simd), slack[0].load(simd));
            for slack in &slack[1..] {
                least = slack.load(simd).min(least);
                all = all * *slack;
            }
            // Also a product that is not a number.
            if least.least() <= 0.0 || all.sum().is_nan() {
                return None;
            }
            product.take(all.values());
        }
        let mut logarithm = product.ln();
        for row in self.ends.iter_mut().flatten() {
            row.slack = 1.0 - x[2 * row.node] / row.greatest;
            if row.slack <= 0.0 {
                return None;
            }
            logarithm += row.slack.ln();
        }
        Some(logarithm)
    }

    /// The time of a spline with its ramps, infinite where it is not positive.
    #[inline(always)]
    pub(super) fn time<S: Simd>(
        &self,
        simd: S,
        rows: &Rows<M>,
        bounds: [Bound; 2],
        x: &[f64],
        trial: bool,
    ) -> f64 {
        let mut time = self.model.time(simd, rows, x, trial);
        for (bound, w) in bounds.iter().zip([x[0], x[x.len() - 2]]) {
            if let Bound::Rest { ramp, .. } = bound {
                time += if w > 0.0 { 3.0 * ramp / w.sqrt() } else { f64::INFINITY };
            }
        }
        time
    }
}

/// How the unknowns of an end are tied; `sign` is −1 at the end of the path.
fn tie(bound: &Bound, sign: f64) -> Tie {
    match bound {
        Bound::Rest { ramp, .. } => Tie::Slope(sign * 4.0 / (3.0 * ramp)),
        Bound::Fixed { .. } => Tie::Given,
    }
}

/// What the ends lack.
fn missing(bounds: &[Bound; 2], x: &[f64]) -> [[f64; 2]; 2] {
    std::array::from_fn(|end| match bounds[end] {
        Bound::Rest { .. } => [0.0; 2],
        Bound::Fixed { w, slope } => {
            let at = end * (x.len() - 2);
            [w - x[at], slope - x[at + 1]]
        }
    })
}

/// The greatest part of its end by which the spline misses it.
fn miss<const M: usize>(bounds: &[Bound; 2], x: &[f64], intervals: &[super::rows::Interval<M>]) -> f64 {
    let lacks = missing(bounds, x);
    let h = [intervals[0].h, intervals[intervals.len() - 1].h];
    let mut worst: f64 = 0.0;
    for end in 0..2 {
        if let Bound::Fixed { w, .. } = bounds[end] {
            worst = worst.max(lacks[end][0].abs() / w).max(lacks[end][1].abs() * h[end] / w);
        }
    }
    worst
}

/// Ends that are met but for rounding are met exactly.
fn settle(bounds: &[Bound; 2], x: &mut [f64]) {
    for (end, bound) in bounds.iter().enumerate() {
        if let Bound::Fixed { w, slope } = *bound {
            let at = end * (x.len() - 2);
            (x[at], x[at + 1]) = (w, slope);
        }
    }
}
