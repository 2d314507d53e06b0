//! Forms of (w, w', w'') at the collocation points of an interval, in its local coefficients; powers of w.

use fearless_simd::Simd;
use feedplan_geometry::lanes::Register;

use super::hermite::{AT_NODES, BEND, SLOPE, VALUE};

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
