//! The working space of the interior-point method: slacks, multipliers, steps and the matrix of one window.

use fearless_simd::{dispatch, Level, Simd};
use feedplan_geometry::elementary::Elementary;
use feedplan_geometry::lanes::eight::{Lanes, Register};
use feedplan_geometry::lanes::LogProduct;

use super::band::Band;
use super::columns::{Columns, Terms};
use super::constraints::Constraints;
use super::forms::motion;
use super::hermite::COUNT;
use super::model::Model;
use super::rest_ramp::Ramp;
use super::window_end::WindowEnd;

/// Slacks and multipliers, by the rows of each block (`RowLayout`).
#[derive(Default)]
pub struct State {
    /// Slacks after `attempt`; 1/slack after `assemble`.
    pub slack: Vec<Lanes>,
    pub dual: Vec<Lanes>,
    /// −ds dλ of the predictor, limited in size; dλ after the corrector.
    pub step: Vec<Lanes>,
}

/// Working space, reused from window to window.
pub struct InteriorPoint<X> {
    /// The SIMD instruction set of the processor.
    pub(super) level: Level,
    pub(super) model: X,
    pub(super) band: Band,
    pub(super) state: State,
    pub(super) x: Columns,
    pub(super) gradient: Terms,
    pub(super) rhs: Columns,
    pub(super) step: Columns,
    pub(super) trial: Columns,
    /// Right-hand sides of the centring with μ = 1 and of the predictor's products.
    pub(super) pulls: [Terms; 2],
    /// Work array for the rows of one block: small enough for the first-level cache.
    pub(super) scratch: Vec<Lanes>,
    pub(super) ends: [Option<EndRow>; 2],
}

/// The row w ≤ `greatest` at the end of a ramp.
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

impl<X: Model> Default for InteriorPoint<X> {
    fn default() -> Self {
        Self {
            level: Level::new(),
            model: X::default(),
            band: Band::default(),
            state: State::default(),
            x: Columns::default(),
            gradient: Terms::default(),
            rhs: Columns::default(),
            step: Columns::default(),
            trial: Columns::default(),
            pulls: Default::default(),
            scratch: vec![],
            ends: [None; 2],
        }
    }
}

impl<X: Model> InteriorPoint<X> {
    /// Copies the spline x into the working space and sizes all arrays for the window's intervals.
    pub(super) fn take(&mut self, rows: &Constraints, x: &[f64]) {
        let (count, blocks, layout) = (rows.count(), rows.blocks.len(), rows.layout());
        let state = &mut self.state;
        for vector in [&mut state.slack, &mut state.dual, &mut state.step] {
            vector.resize(blocks * layout.all(), Lanes::ONE);
        }
        state.step.fill(Lanes::ZERO);
        self.scratch.resize(layout.all(), Lanes::ONE);
        self.band.resize(count);
        self.gradient.resize(count);
        for pulls in &mut self.pulls {
            pulls.resize(count);
        }
        for columns in [&mut self.x, &mut self.trial] {
            columns.resize(count, 1.0);
        }
        for columns in [&mut self.rhs, &mut self.step] {
            columns.resize(count, 0.0);
        }
        self.x.take(x);
    }

    /// Computes the slacks of x, or of the trial. Returns Σ ln s, or None if a limit is broken.
    pub(super) fn slacks(&mut self, rows: &Constraints, trial: bool) -> Option<f64> {
        dispatch!(self.level, simd => self.slacks_on(simd, rows, trial))
    }

    #[inline(always)]
    fn slacks_on<S: Simd>(&mut self, simd: S, rows: &Constraints, trial: bool) -> Option<f64> {
        let x = if trial { &self.trial } else { &self.x };
        let layout = rows.layout();
        let mut product = LogProduct::default();
        let (mut least, mut sum) = (Register::all(simd, f64::INFINITY), Register::all(simd, 0.0));
        for (b, block) in rows.blocks.iter().enumerate() {
            let h = block.h.load(simd);
            let (u, per_h) = (x.local(b, h, block.live), h.inverse());
            for p in 0..COUNT {
                let slack = layout.of_mut(&mut self.state.slack, b, p);
                self.model.slack(rows, b, p, motion(p, per_h, &u), trial, slack);
                let mut all = slack[0].load(simd);
                least = all.min(least);
                for slack in &slack[1..] {
                    least = slack.load(simd).min(least);
                    all = all * *slack;
                }
                sum += all;
                product.take(all.values());
            }
        }
        // A NaN counts as broken too.
        if least.least() <= 0.0 || sum.sum().is_nan() {
            return None;
        }
        let mut logarithm = product.ln();
        for row in self.ends.iter_mut().flatten() {
            row.slack = 1.0 - x.w[row.station] / row.greatest;
            if row.slack <= 0.0 {
                return None;
            }
            logarithm += row.slack.natural_log();
        }
        Some(logarithm)
    }

    /// The time of x, or of the trial, with its ramps, in s; infinite if w is not positive.
    pub(super) fn time(&self, rows: &Constraints, ends: [WindowEnd; 2], trial: bool) -> f64 {
        let x = if trial { &self.trial } else { &self.x };
        let mut time = dispatch!(self.level, simd => self.model.time(simd, rows, x, trial));
        for (kind, station) in ends.iter().zip([0, rows.count()]) {
            if let WindowEnd::Rest { ramp, .. } = kind {
                let w = x.w[station];
                time += if w > 0.0 { ramp.way() / w.sqrt() } else { f64::INFINITY };
            }
        }
        time
    }
}
