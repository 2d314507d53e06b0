//! The interface of the interior-point method to its problems (`exact`, `relaxed`): slacks, gradient and matrix.

use fearless_simd::Simd;

use super::constraints::Constraints;
use super::hermite::{AT_NODES, BEND, SLOPE, VALUE};
use crate::lanes::{Lanes, Register};

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

/// The symmetric form of (w, w', w'') at each collocation point: 00 01 02 11 12 22.
pub type Form<S> = [Register<S>; 6];

/// The upper half of a matrix, and a gradient, in the local coefficients (w, h w') at both ends.
pub struct Local {
    pub matrix: [[f64; 4]; 4],
    pub gradient: [f64; 4],
}

/// The upper half of a form of (w, w', w'') and of a form of w at the quadrature nodes, in local coefficients.
#[inline(always)]
pub fn expand<S: Simd>(h: f64, form: &Form<S>, at_nodes: Register<S>) -> [[f64; 4]; 4] {
    let per_h = 1.0 / h;
    let per_h2 = per_h * per_h;
    let m = [
        form[0],
        form[1] * per_h,
        form[2] * per_h2,
        form[3] * per_h2,
        form[4] * (per_h * per_h2),
        form[5] * (per_h2 * per_h2),
    ];
    let mut matrix = [[0.0; 4]; 4];
    for j in 0..4 {
        let (v, s, b, node) = (VALUE[j], SLOPE[j], BEND[j], AT_NODES[j] * at_nodes);
        let p0 = m[0] * v + m[1] * s + m[2] * b;
        let p1 = m[1] * v + m[3] * s + m[4] * b;
        let p2 = m[2] * v + m[4] * s + m[5] * b;
        for i in 0..=j {
            matrix[i][j] = (VALUE[i] * p0 + SLOPE[i] * p1 + BEND[i] * p2 + AT_NODES[i] * node).sum();
        }
    }
    matrix
}

/// A linear form of (w, w', w'') in local coefficients.
#[inline(always)]
pub fn project<S: Simd>(h: f64, linear: &[Register<S>; 3]) -> [f64; 4] {
    let per_h = 1.0 / h;
    let [g0, g1, g2] = [linear[0], linear[1] * per_h, linear[2] * (per_h * per_h)];
    let mut out = [0.0; 4];
    for k in 0..4 {
        out[k] = (g0 * VALUE[k] + g1 * SLOPE[k] + g2 * BEND[k]).sum();
    }
    out
}

/// w^(−1/2).
#[inline(always)]
pub fn pace<S: Simd>(w: Register<S>) -> Register<S> {
    w.max(Register::all(w.simd(), f64::MIN_POSITIVE)).sqrt().inverse()
}

/// w^(−3/2)/2.
#[inline(always)]
pub fn fall<S: Simd>(pace: Register<S>) -> Register<S> {
    pace * pace * pace * 0.5
}
