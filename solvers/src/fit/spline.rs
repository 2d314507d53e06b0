//! Interpolation of feature points by a C1 quadratic B-spline, one tridiagonal system (Zhang 3.3).
//!
//! Data F_j at parameters t_j with steps h_j = |F_{j+1} − F_j| (so that |C'| is near 1), a knot at the middle of
//! every step. Unknown are the slopes s_j = C'(knot j). C' is linear between knots, so the tangent at the data is
//! m_j = (h_j s_{j−1} + h_{j−1} s_j)/(h_{j−1} + h_j), and integrating C' over step j gives
//!
//!     m_j + 2 s_j + m_{j+1} = 4 (F_{j+1} − F_j)/h_j
//!
//! which is tridiagonal in s with diagonal 2 + (1 − a) + (1 − c) and off-diagonals a, c in [0, 1]: diagonally
//! dominant for any spacing, whereas the same system in control points is not. At a free end the knot next to it is
//! left out, and its slope is that of the chord: three points with two free ends give the Bézier curve of Algorithm 1.

use crate::quadratic::{norm, sub};

/// What the spline must meet at one end besides its point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum End<const M: usize> {
    /// Any tangent.
    Free,
    /// C' is this.
    Tangent([f64; M]),
}

/// C' at the data and at the knots between; `step[j]` is the parameter distance from data j to data j + 1.
pub struct Spline<const M: usize> {
    pub step: Vec<f64>,
    pub slope: Vec<[f64; M]>,
    pub tangent: Vec<[f64; M]>,
}

/// The spline through `features`, at least two.
pub fn interpolate<const M: usize>(features: &[[f64; M]], start: End<M>, finish: End<M>) -> Spline<M> {
    let count = features.len() - 1;
    let h: Vec<f64> = features
        .windows(2)
        // Features that coincide still need a step; the certificate will ask for the points between them.
        .map(|f| norm(&sub(&f[1], &f[0])).max(f64::MIN_POSITIVE * 1e10))
        .collect();
    let chord: Vec<[f64; M]> =
        features.windows(2).zip(&h).map(|(f, h)| std::array::from_fn(|k| (f[1][k] - f[0][k]) / h)).collect();
    let before = |j: usize| h[j] / (h[j - 1] + h[j]);
    let after = |j: usize| h[j] / (h[j] + h[j + 1]);

    // Chasing forward: row j becomes s_j + upper_j s_{j+1} = slope_j.
    let mut upper = vec![0.0; count];
    let mut slope = chord.clone();
    for j in 0..count {
        let free = (j == 0 && start == End::Free) || (j + 1 == count && finish == End::Free);
        if free {
            continue;
        }
        let mut diagonal = 2.0;
        let mut right: [f64; M] = std::array::from_fn(|k| 4.0 * chord[j][k]);
        if j > 0 {
            let lower = before(j);
            diagonal += 1.0 - lower - lower * upper[j - 1];
            right = std::array::from_fn(|k| right[k] - lower * slope[j - 1][k]);
        } else if let End::Tangent(tangent) = start {
            right = std::array::from_fn(|k| right[k] - tangent[k]);
        }
        if j + 1 < count {
            upper[j] = after(j);
            diagonal += 1.0 - upper[j];
        } else if let End::Tangent(tangent) = finish {
            right = std::array::from_fn(|k| right[k] - tangent[k]);
        }
        upper[j] /= diagonal;
        slope[j] = std::array::from_fn(|k| right[k] / diagonal);
    }
    // And back.
    for j in (0..count.saturating_sub(1)).rev() {
        slope[j] = std::array::from_fn(|k| slope[j][k] - upper[j] * slope[j + 1][k]);
    }

    let mut tangent = Vec::with_capacity(count + 1);
    tangent.push(match (start, finish) {
        (End::Tangent(tangent), _) => tangent,
        (End::Free, _) if count > 1 => extrapolate(&slope[0], &slope[1], after(0)),
        (End::Free, End::Tangent(other)) => extrapolate(&slope[0], &other, 1.0),
        (End::Free, End::Free) => slope[0],
    });
    tangent.extend((1..count).map(|j| {
        std::array::from_fn(|k| (h[j] * slope[j - 1][k] + h[j - 1] * slope[j][k]) / (h[j - 1] + h[j]))
    }));
    tangent.push(match (start, finish) {
        (_, End::Tangent(tangent)) => tangent,
        (_, End::Free) if count > 1 => extrapolate(&slope[count - 1], &slope[count - 2], before(count - 1)),
        (End::Tangent(other), End::Free) => extrapolate(&slope[0], &other, 1.0),
        (End::Free, End::Free) => slope[0],
    });
    Spline { step: h, slope, tangent }
}

/// The value beyond `near`, seen from `far`.
fn extrapolate<const M: usize>(near: &[f64; M], far: &[f64; M], by: f64) -> [f64; M] {
    std::array::from_fn(|k| near[k] + by * (near[k] - far[k]))
}
