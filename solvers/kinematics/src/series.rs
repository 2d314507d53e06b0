//! Arithmetic on truncated Taylor series, the coefficients f_k = f^(k)(u)/k! of functions of u.
//!
//! Griewank and Walther, Evaluating Derivatives (2nd ed. 2008), section 13.2: each elementary function satisfies a linear
//! differential equation, so its coefficient k is a sum over the ones before. With h = f g, q = f/g, r = √f,
//! ```text
//! h_k = Σ_{j≤k} f_j g_{k−j}
//! q_k = (f_k − Σ_{j<k} q_j g_{k−j}) / g_0
//! r_k = (f_k − Σ_{0<j<k} r_j r_{k−j}) / (2 r_0)
//! s_k = (1/k) Σ_{0<j≤k} j f_j c_{k−j},   c_k = −(1/k) Σ_{0<j≤k} j f_j s_{k−j}      (sine, cosine of f)
//! a_k = (n_{k−1} − Σ_{0<j<k} j a_j d_{k−j}) / (k d_0),   d = x² + y²,  n = x y' − y x'      (atan2(y, x))
//! ```
//! Over intervals that contain f_k for every u of a piece, each result contains its coefficient for every u of the piece (Moore
//! 1966; Tucker, Validated Numerics, 2011, chapter 6). A slice of length n is a series of order n − 1.

use super::number::Number;

/// The highest order of a series.
pub const MOST_ORDER: usize = 15;

/// Coefficients of the derivative: (k + 1) f_{k+1}.
#[inline]
fn slopes<T: Number>(f: &[T]) -> [T; MOST_ORDER] {
    let mut slopes = [T::exactly(0.0); MOST_ORDER];
    for k in 1..f.len() {
        slopes[k - 1] = f[k] * T::exactly(k as f64);
    }
    slopes
}

/// Coefficient k of f g.
#[inline]
fn product_term<T: Number>(f: &[T], g: &[T], k: usize) -> T {
    T::dot((0..=k).map(|j| (f[j], g[k - j])))
}

pub fn product<T: Number>(f: &[T], g: &[T], out: &mut [T]) {
    for k in 0..out.len() {
        out[k] = product_term(f, g, k);
    }
}

/// Coefficient k of f², from half of the products; the square of an interval is never negative.
#[inline]
fn square_term<T: Number>(f: &[T], k: usize) -> T {
    let half = k.div_ceil(2);
    let twice = |half: usize| T::exactly(2.0) * T::dot((0..half).map(|j| (f[j], f[k - j])));
    match (half, k % 2) {
        (0, _) => f[0].square(),
        (half, 1) => twice(half),
        (half, _) => twice(half) + f[k / 2].square(),
    }
}

pub fn square<T: Number>(f: &[T], out: &mut [T]) {
    for k in 0..out.len() {
        out[k] = square_term(f, k);
    }
}

pub fn quotient<T: Number>(f: &[T], g: &[T], out: &mut [T]) {
    out[0] = f[0] / g[0];
    for k in 1..out.len() {
        out[k] = (f[k] - T::dot((0..k).map(|j| (out[j], g[k - j])))) / g[0];
    }
}

pub fn sqrt<T: Number>(f: &[T], out: &mut [T]) {
    out[0] = f[0].sqrt();
    if out.len() == 1 {
        return;
    }
    let twice = T::exactly(2.0) * out[0];
    out[1] = f[1] / twice;
    for k in 2..out.len() {
        out[k] = (f[k] - T::dot((1..k).map(|j| (out[j], out[k - j])))) / twice;
    }
}

pub fn sin_cos<T: Number>(f: &[T], sine: &mut [T], cosine: &mut [T]) {
    let slope = slopes(f);
    (sine[0], cosine[0]) = f[0].sin_cos();
    for k in 1..sine.len() {
        let order = T::exactly(k as f64);
        sine[k] = T::dot((0..k).map(|j| (slope[j], cosine[k - 1 - j]))) / order;
        cosine[k] = -(T::dot((0..k).map(|j| (slope[j], sine[k - 1 - j]))) / order);
    }
}

/// The angle of the vector (x, y) in radians; over intervals it is continuous on the whole part.
pub fn atan2<T: Number>(y: &[T], x: &[T], out: &mut [T]) {
    let (x_slope, y_slope) = (slopes(x), slopes(y));
    let mut distance = [T::exactly(0.0); MOST_ORDER + 1];
    let mut slope = [T::exactly(0.0); MOST_ORDER];
    out[0] = T::atan2(y[0], x[0]);
    for k in 1..out.len() {
        distance[k - 1] = square_term(x, k - 1) + square_term(y, k - 1);
        let across = |a: &[T], b: &[T]| T::dot((0..k).map(|j| (a[k - 1 - j], b[j])));
        let mut rest = across(x, &y_slope) - across(y, &x_slope);
        if k > 1 {
            rest = rest - T::dot((0..k - 1).map(|j| (slope[j], distance[k - 1 - j])));
        }
        slope[k - 1] = rest / distance[0];
        out[k] = slope[k - 1] / T::exactly(k as f64);
    }
}
