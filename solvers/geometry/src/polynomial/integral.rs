//! The integral of a quotient p/w² of Bernstein forms, as m/w, by linear least squares.
//!
//! m' w − m w' = p gives one equation for each of the 2 d − 1 coefficients of p, with d unknowns. If d of them are solved one
//! after the other, errors grow tenfold or more at each step, and no digits are left at degree 9. The least-squares solution of
//! all equations loses none. With m_i = q_i w_i equation r is
//!
//! ```text
//! Σ (b − a) w_a w_b (q_b − q_a) = p_r,   a < b, a + b = r + 1,
//! ```
//!
//! Divided by the sum of the factors (b − a) w_a w_b its left side is a weighted mean of differences. The rounding of p_r is
//! relative to that sum too, so each equation has the weight that suits its accuracy.

/// Rows and columns of the greatest system: degree 9.
const ROWS: usize = 17;
const COLUMNS: usize = 9;
/// The unknowns of the leading zeros of p, and this many more, are solved exactly from their own equations, so that small values
/// near 0 keep their digits.
const EXACT: usize = 2;

/// Writes the scaled coefficients of m, m(0) = 0, with (m/w)' = p/w²; `p` has 2 d − 1 coefficients, `w` d + 1.
#[inline(never)]
pub fn over_weight(p: &[f64], w: &[f64], m: &mut [f64]) {
    let d = w.len() - 1;
    let rows = 2 * d - 1;
    let (mut sum, mut rest) = ([0.0; ROWS], [0.0; ROWS]);
    for a in 0..d {
        for b in a + 1..=d {
            sum[a + b - 1] += (b - a) as f64 * w[a] * w[b];
        }
    }
    for r in 0..rows {
        rest[r] = p[r] / sum[r];
    }
    let factor = |a: usize, b: usize| (b - a) as f64 * w[a] * w[b] / sum[a + b - 1];
    let mut q = [0.0; COLUMNS + 1];
    let zeros = p.iter().take_while(|&&value| value == 0.0).count();
    let exact = (zeros + EXACT).min(d);
    for b in 1..=exact {
        let before: f64 = (1..b).filter(|a| 2 * a < b).map(|a| factor(a, b - a) * (q[b - a] - q[a])).sum();
        q[b] = (rest[b - 1] - before) / factor(0, b);
    }
    if exact < d {
        let mut columns = [[0.0; ROWS]; COLUMNS];
        for a in 0..d {
            for b in (a + 1).max(exact + 1 - a.min(exact))..=d {
                let (r, factor) = (a + b - 1, factor(a, b));
                for (i, signed) in [(a, -factor), (b, factor)] {
                    if i > exact {
                        columns[i - exact - 1][r] += signed;
                    } else {
                        rest[r] -= signed * q[i];
                    }
                }
            }
        }
        least_squares(&mut columns[..d - exact], &mut rest, exact..rows, &mut q[exact + 1..=d]);
    }
    for i in 0..=d {
        m[i] = q[i] * w[i];
    }
}

/// The least-squares solution by Householder reflections.
fn least_squares(
    columns: &mut [[f64; ROWS]],
    right: &mut [f64; ROWS],
    rows: std::ops::Range<usize>,
    solution: &mut [f64],
) {
    let count = columns.len();
    for n in 0..count {
        let top = rows.start + n;
        let (own, others) = columns[n..].split_first_mut().expect("a column");
        let size = own[top..rows.end].iter().map(|x| x * x).sum::<f64>().sqrt();
        let diagonal = if own[top] > 0.0 { -size } else { size };
        let half = size * size - own[top] * diagonal;
        own[top] -= diagonal;
        if half > 0.0 {
            for other in others.iter_mut().chain(std::iter::once(&mut *right)) {
                let product: f64 = (top..rows.end).map(|r| own[r] * other[r]).sum();
                for r in top..rows.end {
                    other[r] -= product / half * own[r];
                }
            }
        }
        // The diagonal of the triangle; the reflection vector is not needed any more.
        own[top] = diagonal;
    }
    for n in (0..count).rev() {
        let later: f64 = (n + 1..count).map(|i| columns[i][rows.start + n] * solution[i]).sum();
        solution[n] = (right[rows.start + n] - later) / columns[n][rows.start + n];
    }
}

#[cfg(test)]
mod tests {
    use crate::polynomial::Polynomial;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn ways_on_rational_pieces_keep_their_digits_at_every_degree(
            places in prop::collection::vec(0.0..1.0_f64, 9),
            weights in prop::collection::vec(-4.6..4.6_f64, 10),
            degree in 2..10_usize,
        ) {
            // Weights over four decades; the path goes back and forth.
            type Any = Polynomial<20>;
            let weights: Vec<f64> = weights[..=degree].iter().map(|w| w.exp()).collect();
            let weight = Any::from_bernstein(weights.iter().map(|w| w / weights[0]));
            let place = |i: usize| if i == 0 { 0.0 } else { places[i - 1] };
            let numerator = Any::from_bernstein((0..degree + 1).map(|i| place(i) * weights[i] / weights[0]));
            let found = numerator.wronskian(&weight).antiderivative(&weight, degree);
            for i in 0..=degree {
                let miss = found.bernstein(i) * weights[0] / weights[i] - place(i);
                prop_assert!(miss.abs() < 3e-12, "{i}: {miss:e}");
            }
            let last = found.last() / weight.last() - place(degree);
            prop_assert!(last.abs() < 3e-12);
        }
    }
}
