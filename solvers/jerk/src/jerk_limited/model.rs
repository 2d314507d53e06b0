//! The interface of the interior-point method to its problems (`exact`, `relaxed`): slacks, gradient and matrix of a block of
//! intervals, at each collocation point p.

use fearless_simd::Simd;

use super::columns::Columns;
use super::constraints::Constraints;
use super::forms::Local;
use feedplan_geometry::lanes::eight::{Lanes, Register};

/// A problem over the constraints of a window. It may have own variables at the collocation points.
pub trait Model: Default {
    /// Starts the own variables for the spline x.
    fn begin<S: Simd>(&mut self, simd: S, rows: &Constraints, x: &Columns);

    /// The slacks for a spline with this motion, with the present or the trial values of the own variables.
    fn slack<S: Simd>(
        &mut self,
        rows: &Constraints,
        block: usize,
        p: usize,
        motion: [Register<S>; 3],
        trial: bool,
        out: &mut [Lanes],
    );

    /// The change of the slacks for a step with this motion; convex slacks change along their tangents.
    fn slack_step<S: Simd>(
        &self,
        rows: &Constraints,
        block: usize,
        p: usize,
        motion: [Register<S>; 3],
        out: &mut [Lanes],
    );

    /// Matrix and gradient of a block with local coefficients u, for the weights λ/s and the multipliers λ of its rows.
    fn local<S: Simd>(
        &mut self,
        rows: &Constraints,
        block: usize,
        u: &[Register<S>; 4],
        weight: &[Lanes],
        dual: &[Lanes],
    ) -> Local<S>;

    /// Σ aim ∇s over the rows, as a linear form of (w, w', w''). `which` is 0 for the aims of the centring and 1 for those of
    /// the predictor's second order.
    fn pull<S: Simd>(
        &mut self,
        simd: S,
        rows: &Constraints,
        block: usize,
        p: usize,
        aim: &[Lanes],
        which: usize,
    ) -> [Register<S>; 3];

    /// Computes the step of the own variables from that of the spline; `pulls` are the factors of both aims.
    fn solved<S: Simd>(&mut self, simd: S, rows: &Constraints, step: &Columns, pulls: [f64; 2]);

    /// Sets the trial values of the own variables, a part of their step away.
    fn attempt<S: Simd>(&mut self, simd: S, part: f64);

    fn accept(&mut self);

    /// The time of x without its ramps; infinite where w is not positive.
    fn time<S: Simd>(&self, simd: S, rows: &Constraints, x: &Columns, trial: bool) -> f64;
}
