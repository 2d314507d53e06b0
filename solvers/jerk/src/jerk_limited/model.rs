//! The interface of the interior-point method to its problems (`exact`, `relaxed`): slacks, gradient and matrix.

use fearless_simd::Simd;

use super::constraints::Constraints;
use super::forms::Local;
use feedplan_geometry::lanes::{Lanes, Register};

/// A problem over the constraints of a window. It may have own variables at the collocation points.
pub trait Model<const M: usize>: Default {
    /// Starts the own variables for the spline x.
    fn begin<S: Simd>(&mut self, simd: S, rows: &Constraints<M>, x: &[f64]);

    /// The slacks on interval n for local coefficients u, with the present or the trial values of the own variables.
    fn slack<S: Simd>(
        &mut self,
        simd: S,
        rows: &Constraints<M>,
        n: usize,
        u: &[f64; 4],
        trial: bool,
        out: &mut [Lanes],
    );

    /// The change of the slacks for the step d; convex slacks change along their tangents.
    fn slack_step<S: Simd>(&self, simd: S, rows: &Constraints<M>, n: usize, d: &[f64; 4], out: &mut [Lanes]);

    /// Matrix and gradient of interval n, for the weights λ/s and the multipliers λ of its rows.
    fn local<S: Simd>(
        &mut self,
        simd: S,
        rows: &Constraints<M>,
        n: usize,
        u: &[f64; 4],
        weight: &[Lanes],
        dual: &[Lanes],
    ) -> Local;

    /// Σ aim ∇s over the rows of interval n, as a linear form of (w, w', w'') at the collocation points. `which` is 0
    /// for the aims of the centring and 1 for those of the predictor's second order.
    fn pull<S: Simd>(
        &mut self,
        simd: S,
        rows: &Constraints<M>,
        n: usize,
        aim: &[Lanes],
        which: usize,
    ) -> [Register<S>; 3];

    /// Computes the step of the own variables from that of the spline; `pulls` are the factors of both aims.
    fn solved<S: Simd>(&mut self, simd: S, rows: &Constraints<M>, step: &[f64], pulls: [f64; 2]);

    /// Sets the trial values of the own variables, a part of their step away.
    fn attempt<S: Simd>(&mut self, simd: S, part: f64);

    fn accept(&mut self);

    /// The time of x without its ramps; infinite where w is not positive.
    fn time<S: Simd>(&self, simd: S, rows: &Constraints<M>, x: &[f64], trial: bool) -> f64;
}
