//! The interface between the interior-point method and the problems that it solves (`exact`, `relaxed`): slacks, gradient and
//! matrix of a block of intervals. p is the index of a collocation point, `motion` is (w, w', w'') there.

use fearless_simd::Simd;

use super::columns::Columns;
use super::constraints::Constraints;
use super::forms::Local;
use feedplan_geometry::lanes::eight::{Lanes, Register};

/// A problem under the constraints of a window. It may have additional variables of its own at the collocation points.
pub trait Model: Default {
    /// Sets the start values of the own variables for the spline x.
    fn begin<S: Simd>(&mut self, simd: S, rows: &Constraints, x: &Columns);

    /// Writes the slacks of the rows at a collocation point to `out`, with the trial values of the own variables if `trial` is
    /// true, else with their present values.
    fn slack<S: Simd>(
        &mut self,
        rows: &Constraints,
        block: usize,
        p: usize,
        motion: [Register<S>; 3],
        trial: bool,
        out: &mut [Lanes],
    );

    /// Writes the change of the slacks for a step of (w, w', w'') by `motion` to `out`; convex slacks change along their
    /// tangents.
    fn slack_step<S: Simd>(
        &self,
        rows: &Constraints,
        block: usize,
        p: usize,
        motion: [Register<S>; 3],
        out: &mut [Lanes],
    );

    /// Newton matrix and gradient of a block with local coefficients u. `weight` holds λ/s of its rows, `dual` their multipliers
    /// λ.
    fn local<S: Simd>(
        &mut self,
        rows: &Constraints,
        block: usize,
        u: &[Register<S>; 4],
        weight: &[Lanes],
        dual: &[Lanes],
    ) -> Local<S>;

    /// Σ aim ∇s over the rows at a collocation point, as coefficients of (w, w', w''). `which` is 0 for the aims of the centring
    /// and 1 for the aims of the predictor's second-order term.
    fn pull<S: Simd>(
        &mut self,
        simd: S,
        rows: &Constraints,
        block: usize,
        p: usize,
        aim: &[Lanes],
        which: usize,
    ) -> [Register<S>; 3];

    /// Computes the step of the own variables from the step of the spline. `pulls` are the factors of the centring and of the
    /// second-order term in the right-hand side.
    fn solved<S: Simd>(&mut self, simd: S, rows: &Constraints, step: &Columns, pulls: [f64; 2]);

    /// Sets the trial values of the own variables to the present values plus `part` of their step.
    fn attempt<S: Simd>(&mut self, simd: S, part: f64);

    fn accept(&mut self);

    /// The time of x without its ramps, in s; infinite if w is not positive.
    fn time<S: Simd>(&self, simd: S, rows: &Constraints, x: &Columns, trial: bool) -> f64;
}
