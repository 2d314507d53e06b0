//! Weighted means of points, the numerator of the hodograph, and the quotient rule, for rational pieces C = M/ω with
//! M = Σ wᵢ Pᵢ Bᵢ, ω = Σ wᵢ Bᵢ.
//!
//! Weights are positive, so the factors of each mean are positive. Differences of points are taken before products, so errors are
//! relative to the extent of a piece and not to its coordinates.

use super::{Piece, MAX_HODOGRAPH};
use crate::polynomial::binomial;
use crate::quadratic::{lerp, sub};

/// The point at fraction `alpha` between two points, exactly `b` at 1.
#[inline(always)]
fn mean<const M: usize>(a: &[f64; M], b: &[f64; M], alpha: f64) -> [f64; M] {
    if alpha == 1.0 {
        *b
    } else {
        lerp(a, b, alpha)
    }
}

/// Replaces each of the first `count` points by its mean with the next one at `alpha(i)`; empty weights stand for ones. This is
/// one step of de Casteljau's and de Boor's algorithms, and of degree elevation.
#[inline(always)]
pub fn cut_corners<const M: usize>(
    points: &mut [[f64; M]],
    weights: &mut [f64],
    count: usize,
    alpha: impl Fn(usize) -> f64,
) {
    if weights.is_empty() {
        for i in 0..count {
            points[i] = mean(&points[i], &points[i + 1], alpha(i));
        }
    } else {
        for i in 0..count {
            let alpha = alpha(i);
            let (left, right) = ((1.0 - alpha) * weights[i], alpha * weights[i + 1]);
            weights[i] = left + right;
            points[i] = mean(&points[i], &points[i + 1], right / weights[i]);
        }
    }
}

/// Bernstein coefficients in t = u / width: of dC/dt on polynomial pieces, of dC/dt ω² on rational ones.
#[derive(Clone, Copy, Debug)]
pub struct Hodograph<const M: usize> {
    coefficients: [[f64; M]; MAX_HODOGRAPH],
    count: usize,
}

impl<const M: usize> Hodograph<M> {
    /// The numerator is M'ω − Mω' of degree 2d − 2, as the sum over pairs of points
    /// Σ (j−i) (d over i)(d over j) wᵢ wⱼ (Pⱼ − Pᵢ), i + j = k + 1 (Sederberg & Wang 1987).
    pub fn new(piece: &Piece<M>) -> Self {
        let (d, control, w) = (piece.degree(), piece.control, piece.weights);
        let mut coefficients = [[0.0; M]; MAX_HODOGRAPH];
        if !piece.is_rational() {
            for i in 0..d {
                coefficients[i] = sub(&control[i + 1], &control[i]).map(|value| d as f64 * value);
            }
            return Self { coefficients, count: d };
        }
        for k in 0..2 * d - 1 {
            for i in (k + 1).saturating_sub(d)..=k / 2 {
                let j = k + 1 - i;
                let factor = (j - i) as f64 * binomial(d, i) * binomial(d, j) * w[i] * w[j];
                let difference = sub(&control[j], &control[i]);
                for axis in 0..M {
                    coefficients[k][axis] += factor * difference[axis] / binomial(2 * d - 2, k);
                }
            }
        }
        Self { coefficients, count: 2 * d - 1 }
    }

    #[inline(always)]
    pub fn coefficients(&self) -> &[[f64; M]] {
        &self.coefficients[..self.count]
    }
}

/// The first three derivatives of M/ω from those of M and ω; index 0 is the value.
#[inline(always)]
pub fn quotient<const M: usize>(m: &[[f64; M]; 4], w: &[[f64; 1]; 4]) -> [[f64; M]; 4] {
    let inverse = 1.0 / w[0][0];
    let [w1, w2, w3] = [w[1][0] * inverse, w[2][0] * inverse, w[3][0] * inverse];
    let mut c = [[0.0; M]; 4];
    for k in 0..M {
        c[0][k] = m[0][k] * inverse;
        c[1][k] = m[1][k] * inverse - w1 * c[0][k];
        c[2][k] = m[2][k] * inverse - 2.0 * w1 * c[1][k] - w2 * c[0][k];
        c[3][k] = m[3][k] * inverse - 3.0 * (w1 * c[2][k] + w2 * c[1][k]) - w3 * c[0][k];
    }
    c
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::spline::bezier::derivatives;
    use proptest::prelude::*;

    #[test]
    fn the_numerator_of_a_weighted_line_is_one_vector() {
        // C' = w₀ w₁ (P₁ − P₀) / ω².
        let piece = Piece { control: &[[1.0, 0.0], [4.0, 1.0]], weights: &[2.0, 5.0], width: 1.0 };
        assert_eq!(Hodograph::new(&piece).coefficients(), [[30.0, 10.0]]);
    }

    /// The distance of the numerator divided by the denominator from the derivative at t.
    fn error(control: &[[f64; 2]], weights: &[f64], t: f64) -> f64 {
        let piece = Piece { control, weights, width: 1.0 };
        let hodograph = Hodograph::new(&piece);
        let (degree, n) = (control.len() - 1, hodograph.coefficients().len() - 1);
        let bernstein =
            |n: usize, i: usize| binomial(n, i) * t.powi(i as i32) * (1.0 - t).powi((n - i) as i32);
        let w: f64 = (0..=degree).map(|i| bernstein(degree, i) * weights[i]).sum();
        let numerator = |axis: usize| -> f64 {
            (0..=n).map(|i| bernstein(n, i) * hodograph.coefficients()[i][axis]).sum()
        };
        let derivative = derivatives(&piece, t)[1];
        (0..2).map(|axis| (numerator(axis) / (w * w) - derivative[axis]).abs()).fold(0.0, f64::max)
    }

    #[test]
    fn a_piece_of_the_highest_degree_at_rest_has_no_derivative() {
        assert_eq!(error(&[[0.0; 2]; 10], &[0.1; 10], 0.0), 0.0);
    }

    proptest! {
        #[test]
        fn the_numerator_over_the_denominator_is_the_derivative(
            control in prop::collection::vec(prop::array::uniform2(-5.0..5.0f64), 10),
            weights in prop::collection::vec(0.1..10.0f64, 10),
            degree in 1..=9usize,
            t in 0.0..1.0f64,
        ) {
            prop_assert!(error(&control[..=degree], &weights[..=degree], t) < 1e-10);
        }
    }
}
