//! The speed that a feed limits where axes count in it by shares, |(share_k q_k')| u̇: beside that of all axes.

use crate::by_length::{piece, MAX_RATE};
use feedplan_geometry::polynomial::Polynomial;
use feedplan_geometry::spline::bezier::split;
use feedplan_geometry::spline::rational::Hodograph;
use feedplan_geometry::spline::{CompositeCurve, Piece};
use feedplan_planner::problem::Problem;

/// A bound of the share is above the greatest one that is seen by this part at most …
const ACCURACY: f64 = 1e-3;
/// … unless the part of the piece has been halved so often.
const MAX_DEPTH: u32 = 16;

type Square = Polynomial<MAX_RATE>;

/// The greatest speed along piece `i` that keeps the feed everywhere between two parameters.
pub fn between<const M: usize>(problem: &Problem<M>, i: usize, [from, to]: [f64; 2]) -> f64 {
    let mut parts = CompositeCurve::default();
    split(&piece(problem, i), &[from, to], &mut parts);
    on(problem, i, &parts.piece(1))
}

/// The same on a part of piece `i`.
pub fn on<const M: usize>(problem: &Problem<M>, i: usize, part: &Piece<M>) -> f64 {
    let Some(share) = problem.share(i) else { return problem.feed[i] };
    let hodograph = Hodograph::new(part);
    // The denominators of rational pieces are those of both speeds.
    let rows = hodograph.coefficients();
    let square = |share: &[f64; M]| {
        let axis = |k: usize| Square::from_bernstein(rows.iter().map(|row| share[k] * row[k]));
        (0..M).map(axis).fold(Square::constant(0.0), |sum, g| sum.combine(1.0, &g.multiply(&g), 1.0))
    };
    let most = share.iter().fold(0.0_f64, |most, share| most.max(share * share));
    let mut seen = 0.0;
    problem.feed[i] / greatest_quotient(&square(share), &square(&[1.0; M]), most, &mut seen, 0).sqrt()
}

/// Not below the greatest n/d on [0, 1], which is at most `most`: between Bernstein coefficients of one degree lie
/// their quotients.
fn greatest_quotient(n: &Square, d: &Square, most: f64, seen: &mut f64, depth: u32) -> f64 {
    let quotient = |n: f64, d: f64| if d > 0.0 { (n / d).min(most) } else { most };
    let bound = (0..=n.degree()).map(|i| quotient(n.bernstein(i), d.bernstein(i))).fold(0.0, f64::max);
    *seen = seen.max(quotient(n.first(), d.first())).max(quotient(n.last(), d.last()));
    if bound <= (1.0 + ACCURACY) * *seen || depth == MAX_DEPTH {
        return bound;
    }
    let ((n0, n1), (d0, d1)) = (n.split(0.5), d.split(0.5));
    let left = greatest_quotient(&n0, &d0, most, seen, depth + 1);
    left.max(greatest_quotient(&n1, &d1, most, seen, depth + 1))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_quotient_is_bounded_closely() {
        // t² / (t² + (1 − t)²) is 1 at the end, and at most 0.2 up to t = 1/3.
        let n = Square::from_bernstein([0.0, 0.0, 1.0].into_iter());
        let d = Square::from_bernstein([1.0, 0.0, 1.0].into_iter());
        assert_eq!(greatest_quotient(&n, &d, 1.0, &mut 0.0, 0), 1.0);
        let (n, d) = (n.split(1.0 / 3.0).0, d.split(1.0 / 3.0).0);
        let bound = greatest_quotient(&n, &d, 1.0, &mut 0.0, 0);
        assert!((0.2 - 1e-12..=0.2 * (1.0 + ACCURACY)).contains(&bound), "{bound}");
    }
}
