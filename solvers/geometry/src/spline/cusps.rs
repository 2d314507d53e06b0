//! Finds all cusps of a piece, where C' is 0, by bisection with bounds from Bernstein coefficients; nothing is sampled.
//!
//! The hodograph is C', or on rational pieces its numerator, which has the same zeros. It is halved repeatedly. An interval has
//! no cusp if all Bernstein coefficients of the hodograph's square are above the threshold, because then the square is above it
//! too. The hodograph itself is halved, not its square, so that |C'| is known to ε of its greatest value and not to √ε.

use super::rational::Hodograph;
use super::{Piece, MAX_HODOGRAPH, MAX_SQUARE};
use crate::polynomial::binomial;
use crate::quadratic::dot;
use crate::tolerance::SQUARE_ROUNDING;

/// The greatest number of halvings: intervals are then as short as the spacing of numbers near 1.
const MAX_DEPTH: u32 = 52;

/// The cusps of a piece as t = u / width in [0, 1]: places where |C'| is at most `tolerance` times its greatest value on the
/// piece; in an interval of such places the one with the least |C'|. Ends count; a piece of length zero has one cusp, at its
/// start.
pub fn piece_cusps<const M: usize>(piece: &Piece<M>, tolerance: f64) -> Vec<f64> {
    let hodograph = Hodograph::new(piece);
    let h = hodograph.coefficients();
    let greatest = h.iter().fold(0.0, |most: f64, v| most.max(dot(v, v)));
    if greatest == 0.0 {
        return vec![0.0];
    }
    let threshold = tolerance * tolerance * greatest;
    let mut slow = vec![];
    search(h, 0.0, 1.0, 0, threshold, &mut slow);
    slow.into_iter().map(|part| least(h, part)).collect()
}

/// Whether C' is exactly 0 at the start of a piece and at its end.
pub fn rests_at_ends<const M: usize>(piece: &Piece<M>) -> [bool; 2] {
    let (control, last) = (piece.control, piece.degree());
    [control[0] == control[1], control[last - 1] == control[last]]
}

/// Appends to `slow` the parts of [lo, hi] where |h|² may be at most `threshold`.
fn search<const M: usize>(
    h: &[[f64; M]],
    lo: f64,
    hi: f64,
    depth: u32,
    threshold: f64,
    slow: &mut Vec<[f64; 2]>,
) {
    let (mut square, count) = ([0.0; MAX_SQUARE], 2 * h.len() - 1);
    let n = h.len() - 1;
    for i in 0..=n {
        for j in 0..=n {
            square[i + j] += binomial(n, i) * binomial(n, j) * dot(&h[i], &h[j]);
        }
    }
    let mut bound = f64::INFINITY;
    for k in 0..count {
        bound = bound.min(square[k] / binomial(2 * n, k));
    }
    let greatest = h.iter().fold(0.0, |most: f64, v| most.max(dot(v, v)));
    if bound > threshold + SQUARE_ROUNDING * greatest {
        return;
    }
    if greatest <= threshold || depth == MAX_DEPTH {
        match slow.last_mut() {
            Some(last) if last[1] == lo => last[1] = hi,
            _ => slow.push([lo, hi]),
        }
        return;
    }
    let (mut left, mut right) = ([[0.0; M]; MAX_HODOGRAPH], [[0.0; M]; MAX_HODOGRAPH]);
    right[..=n].copy_from_slice(h);
    for row in 0..=n {
        left[row] = right[0];
        for i in 0..n - row {
            for k in 0..M {
                right[i][k] = 0.5 * (right[i][k] + right[i + 1][k]);
            }
        }
    }
    let middle = 0.5 * (lo + hi);
    search(&left[..=n], lo, middle, depth + 1, threshold, slow);
    search(&right[..=n], middle, hi, depth + 1, threshold, slow);
}

/// The t of the least |h| in [lo, hi], an interval so short that h is nearly linear: the best of its ends, its middle and two
/// Gauss–Newton steps from the middle.
fn least<const M: usize>(h: &[[f64; M]], [lo, hi]: [f64; 2]) -> f64 {
    let mut places = vec![lo, hi, 0.5 * (lo + hi)];
    for _ in 0..2 {
        let t = places[places.len() - 1];
        let (value, slope) = value_and_slope(h, t);
        let step = dot(&value, &slope) / dot(&slope, &slope);
        if step.is_finite() {
            places.push((t - step).clamp(lo, hi));
        }
    }
    let size = |t: f64| {
        let value = value_and_slope(h, t).0;
        dot(&value, &value)
    };
    places.into_iter().min_by(|&a, &b| size(a).total_cmp(&size(b))).expect("three places")
}

fn value_and_slope<const M: usize>(h: &[[f64; M]], t: f64) -> ([f64; M], [f64; M]) {
    let n = h.len() - 1;
    let mut b = [[0.0; M]; MAX_HODOGRAPH];
    b[..=n].copy_from_slice(h);
    let mut slope = [0.0; M];
    for left in (0..n).rev() {
        if left == 0 {
            slope = std::array::from_fn(|k| n as f64 * (b[1][k] - b[0][k]));
        }
        for i in 0..=left {
            for k in 0..M {
                b[i][k] += t * (b[i + 1][k] - b[i][k]);
            }
        }
    }
    (b[0], slope)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tolerance::CUSP;
    use proptest::prelude::*;

    fn of<const M: usize>(control: &[[f64; M]], weights: &[f64]) -> Vec<f64> {
        piece_cusps(&Piece { control, weights, width: 1.0 }, CUSP)
    }

    /// The semicubical parabola (s², s³), s = t − c, of which C' = (2 s, 3 s²).
    fn cusp_at(c: f64) -> [[f64; 2]; 4] {
        // Blossoms of (t − c)² and (t − c)³.
        let square =
            |a: f64, b: f64, e: f64| (a * b + a * e + b * e) / 3.0 - 2.0 * c * (a + b + e) / 3.0 + c * c;
        [[0.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, 1.0, 1.0], [1.0, 1.0, 1.0]]
            .map(|[a, b, e]| [square(a, b, e), (a - c) * (b - c) * (e - c)])
    }

    #[test]
    fn the_cusp_of_the_semicubical_parabola() {
        for c in [0.0, 0.25, 0.3, 0.5, 0.999, 1.0] {
            let found = of(&cusp_at(c), &[]);
            assert_eq!(found.len(), 1, "{c}: {found:?}");
            assert!((found[0] - c).abs() < 1e-15, "{c}: {found:?}");
        }
    }

    #[test]
    fn a_line_that_turns_back_has_a_cusp_where_it_turns() {
        let found = of(&[[0.0], [1.0], [0.0]], &[]);
        assert_eq!(found, [0.5]);
        // C' = 8 (t − ¼)(t − ¾) turns twice.
        let found = of(&[[0.0], [0.5], [-1.0 / 3.0], [1.0 / 6.0]], &[]);
        assert_eq!(found.len(), 2);
        assert!((found[0] - 0.25).abs() < 1e-15 && (found[1] - 0.75).abs() < 1e-15);
    }

    #[test]
    fn weights_move_no_point_of_a_line_backwards() {
        assert!(of(&[[0.0], [1.0], [2.0]], &[1.0, 10.0, 0.1]).is_empty());
        assert_eq!(of(&[[0.0], [1.0], [0.0]], &[1.0, 3.0, 1.0]), [0.5]);
    }

    #[test]
    fn a_near_cusp_is_none() {
        let mut control = cusp_at(0.3);
        for (i, point) in control.iter_mut().enumerate() {
            point[1] += 1e-6 * i as f64;
        }
        assert!(of(&control, &[]).is_empty());
    }

    #[test]
    fn a_double_point_at_the_end_is_a_cusp_there() {
        assert_eq!(of(&[[0.0, 0.0], [0.0, 0.0], [1.0, 1.0], [2.0, 0.0]], &[]), [0.0]);
        assert_eq!(of(&[[2.0, 3.0]; 4], &[]), [0.0]);
    }

    proptest! {
        #[test]
        fn a_cusp_is_found_wherever_it_is(
            c in 0.0..1.0f64,
            weights in prop::collection::vec(0.2..5.0f64, 4),
            rational in any::<bool>(),
        ) {
            // Weights of a projective change of the parameter keep the cusp, moved.
            let ratio = if rational { weights[0] } else { 1.0 };
            let moved = [1.0, ratio, ratio * ratio, ratio * ratio * ratio];
            let found = of(&cusp_at(c), if rational { &moved } else { &[] });
            prop_assert_eq!(found.len(), 1);
            let t = found[0] * ratio / (1.0 - found[0] + found[0] * ratio);
            prop_assert!((t - c).abs() < 1e-14);
        }

        #[test]
        fn no_curve_in_general_position_has_a_cusp(
            control in prop::collection::vec(prop::array::uniform3(-10.0..10.0f64), 2..10),
        ) {
            prop_assert!(of(&control, &[]).is_empty());
        }
    }
}
