//! The cubic Hermite basis of an interval at its four collocation points and quadrature nodes; the time of an interval.
//!
//! On an interval of length h with t in [0, 1], w = Σ u_k B_k(t) with u = (w, h w') at its start and at its end.

use std::ops::{Add, Mul};

/// The number of collocation points of an interval. The limits are enforced at these points.
pub const COUNT: usize = 4;
pub const LAST: usize = COUNT - 1;
/// The positions of the collocation points, as fractions of the interval's length.
pub const POINTS: [f64; COUNT] = [0.0, 1.0 / 3.0, 2.0 / 3.0, 1.0];
/// Gauss–Legendre nodes and weights on [0, 1], for the time of an interval.
const NODES: [f64; 4] =
    [0.069_431_844_202_973_71, 0.330_009_478_207_571_87, 0.669_990_521_792_428_1, 0.930_568_155_797_026_3];
pub const WEIGHTS: [f64; 4] =
    [0.173_927_422_568_726_93, 0.326_072_577_431_273_1, 0.326_072_577_431_273_1, 0.173_927_422_568_726_93];

/// Weights of the 3/8 rule at the collocation points.
pub const MASS: [f64; COUNT] = [0.125, 0.375, 0.375, 0.125];

/// B_0 to B_3.
pub type Basis = [f64; 4];

/// B_k at each collocation point.
pub const VALUE: [Basis; COUNT] = basis(POINTS, 0);
/// dB_k/dt there.
pub const SLOPE: [Basis; COUNT] = basis(POINTS, 1);
/// d²B_k/dt² there.
pub const BEND: [Basis; COUNT] = basis(POINTS, 2);
/// B_k at the nodes of the quadrature.
pub const AT_NODES: [Basis; 4] = basis(NODES, 0);

const fn basis(points: [f64; 4], derivative: usize) -> [Basis; 4] {
    let mut out = [[0.0; 4]; 4];
    let mut i = 0;
    while i < 4 {
        out[i] = at(points[i])[derivative];
        i += 1;
    }
    out
}

/// The basis and its first two derivatives at t.
pub const fn at(t: f64) -> [[f64; 4]; 3] {
    let (q, c) = (t * t, t * t * t);
    [
        [1.0 - 3.0 * q + 2.0 * c, t - 2.0 * q + c, 3.0 * q - 2.0 * c, c - q],
        [6.0 * (q - t), 1.0 - 4.0 * t + 3.0 * q, 6.0 * (t - q), 3.0 * q - 2.0 * t],
        [12.0 * t - 6.0, 6.0 * t - 4.0, 6.0 - 12.0 * t, 6.0 * t - 2.0],
    ]
}

/// Σ u_k B_k.
#[inline(always)]
pub fn combine<T: Copy + Add<Output = T> + Mul<f64, Output = T>>(basis: &Basis, u: &[T; 4]) -> T {
    u[0] * basis[0] + u[1] * basis[1] + u[2] * basis[2] + u[3] * basis[3]
}

/// The local coefficients of interval `n` of the spline x = (w_0, w'_0, w_1, w'_1, …).
#[inline(always)]
pub fn local(x: &[f64], n: usize, h: f64) -> [f64; 4] {
    let x = &x[2 * n..2 * n + 4];
    [x[0], x[1] * h, x[2], x[3] * h]
}

/// Linear interpolation from y to x: y + part (x − y).
pub fn blend(x: &[f64], y: &[f64], part: f64) -> Vec<f64> {
    x.iter().zip(y).map(|(x, y)| y + part * (x - y)).collect()
}

/// The spline x at the stations of a finer grid. `counts` is the number of parts of each interval, `lengths` are the lengths of
/// all parts, in mm.
pub fn prolong(x: &[f64], counts: impl Iterator<Item = usize>, mut lengths: &[f64]) -> Vec<f64> {
    let mut out = Vec::with_capacity(2 * lengths.len() + 2);
    for (n, count) in counts.enumerate() {
        let (parts, rest) = lengths.split_at(count);
        lengths = rest;
        let h: f64 = parts.iter().sum();
        let u = local(x, n, h);
        let mut s = 0.0;
        for part in parts {
            let [value, slope, _] = at(s / h).map(|basis| combine(&basis, &u));
            out.extend([value, slope / h]);
            s += part;
        }
    }
    out.extend(&x[x.len() - 2..]);
    out
}

/// ∫ ds/√w over interval n, in s; infinite if w is not positive.
pub fn duration(x: &[f64], n: usize, h: f64) -> f64 {
    let u = local(x, n, h);
    let at = |i: usize| match combine(&AT_NODES[i], &u) {
        w if w > 0.0 => WEIGHTS[i] / w.sqrt(),
        _ => f64::INFINITY,
    };
    (at(0) + at(1) + at(2) + at(3)) * h
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_cubic_is_reproduced_with_its_derivatives() {
        // w = 2 + t − 3 t² + 4 t³
        let u = [2.0, 1.0, 4.0, 7.0];
        for t in [0.0, 0.2, 1.0] {
            let of = |d: usize| (0..4).map(|k| u[k] * at(t)[d][k]).sum::<f64>();
            assert!((of(0) - (2.0 + t - 3.0 * t * t + 4.0 * t * t * t)).abs() < 1e-14);
            assert!((of(1) - (1.0 - 6.0 * t + 12.0 * t * t)).abs() < 1e-14);
            assert!((of(2) - (24.0 * t - 6.0)).abs() < 1e-13);
        }
    }

    #[test]
    fn a_constant_speed_takes_its_length() {
        let x = [4.0, 0.0, 4.0, 0.0];
        assert!((duration(&x, 0, 3.0) - 1.5).abs() < 1e-14);
        assert_eq!(duration(&[-1.0, 0.0, 4.0, 0.0], 0, 3.0), f64::INFINITY);
    }
}
