//! The working space of the interior-point method: slacks, multipliers, steps and the matrix of one window.

use fearless_simd::{Level, Simd};
use feedplan_geometry::elementary::Elementary;
use feedplan_geometry::lanes::{Lanes, LogProduct, Register};

use super::band::Band;
use super::constraints::{Constraints, RowLayout};
use super::hermite::local;
use super::model::Model;
use super::rest_ramp::Ramp;
use super::window_end::WindowEnd;

/// Slacks and multipliers, by the rows of each interval (`RowLayout`).
#[derive(Default)]
pub struct State {
    /// Slacks from `attempt` to `assemble`; after that 1/slack.
    pub slack: Vec<Lanes>,
    pub dual: Vec<Lanes>,
    /// −ds dλ of the predictor, limited in size; after the corrector dλ.
    pub step: Vec<Lanes>,
}

/// Working space, reused from window to window.
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
    /// Pulls on (w, w') of each station: by the centring with λ s = 1, and by the predictor's products.
    pub(super) pulls: Vec<[[f64; 2]; 2]>,
    /// The rows of one interval: small enough for the nearest cache.
    pub(super) scratch: Vec<Lanes>,
    pub(super) ends: [Option<EndRow>; 2],
}

/// The row that limits w at the end of a ramp.
#[derive(Clone, Copy, Debug)]
pub(super) struct EndRow {
    pub station: usize,
    pub ramp: Ramp,
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
    #[inline(always)]
    pub(super) fn resize(&mut self, count: usize) {
        let state = &mut self.state;
        for vector in [&mut state.slack, &mut state.dual, &mut state.step] {
            vector.resize(count * RowLayout::<M>::COUNT, Lanes::ONE);
        }
        state.step.fill(Lanes::ZERO);
        self.scratch.resize(RowLayout::<M>::COUNT, Lanes::ONE);
        self.pulls.resize(count + 1, [[0.0; 2]; 2]);
        for vector in [&mut self.gradient, &mut self.rhs, &mut self.step, &mut self.trial] {
            vector.resize(2 * count + 2, 0.0);
        }
    }

    /// Slacks of x, or of the trial. Returns Σ ln s, or None if a limit is broken.
    #[inline(always)]
    pub(super) fn slacks<S: Simd>(
        &mut self,
        simd: S,
        rows: &Constraints<M>,
        x: &[f64],
        trial: bool,
    ) -> Option<f64> {
        let mut product = LogProduct::default();
        let (mut least, mut sum) = (Register::all(simd, f64::INFINITY), Register::all(simd, 0.0));
        for (n, interval) in rows.intervals.iter().enumerate() {
            let slack = RowLayout::<M>::of_mut(&mut self.state.slack, n);
            self.model.slack(simd, rows, n, &local(x, n, interval.h), trial, slack);
            let mut all = slack[0].load(simd);
            least = all.min(least);
            for slack in &slack[1..] {
                least = slack.load(simd).min(least);
                all = all * *slack;
            }
            sum += all;
            product.take(all.values());
        }
        // A NaN is refused as well.
        if least.least() <= 0.0 || sum.sum().is_nan() {
            return None;
        }
        let mut logarithm = product.ln();
        for row in self.ends.iter_mut().flatten() {
            row.slack = 1.0 - x[2 * row.station] / row.greatest;
            if row.slack <= 0.0 {
                return None;
            }
            logarithm += row.slack.natural_log();
        }
        Some(logarithm)
    }

    /// The time of a spline with its ramps, in s; infinite where w is not positive.
    #[inline(always)]
    pub(super) fn time<S: Simd>(
        &self,
        simd: S,
        rows: &Constraints<M>,
        ends: [WindowEnd; 2],
        x: &[f64],
        trial: bool,
    ) -> f64 {
        let mut time = self.model.time(simd, rows, x, trial);
        for (kind, w) in ends.iter().zip([x[0], x[x.len() - 2]]) {
            if let WindowEnd::Rest { ramp, .. } = kind {
                time += if w > 0.0 { ramp.way() / w.sqrt() } else { f64::INFINITY };
            }
        }
        time
    }
}
