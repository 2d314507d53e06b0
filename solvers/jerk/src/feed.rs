//! Computes the greatest speed [mm/s] along the axes' path by a feed that counts each axis with a share: |(share_k q_k')| u̇ ≤
//! feed.
//!
//! The squares of both speeds are polynomials over one denominator; Bernstein coefficients bound their quotient.

use crate::arc_length_path::{piece, MAX_RATE};
use feedplan_geometry::polynomial::Polynomial;
use feedplan_geometry::spline::bezier::split;
use feedplan_geometry::spline::rational::Hodograph;
use feedplan_geometry::spline::{CompositeCurve, Piece};
use feedplan_planner::problem::Problem;

/// The bound on the quotient exceeds the greatest sampled quotient by at most this fraction …
const ACCURACY: f64 = 1e-3;
/// … unless the part of the piece has been halved this often.
const MAX_DEPTH: u32 = 16;

type Square = Polynomial<MAX_RATE>;

/// The greatest speed along piece `i`, in mm/s, at which the feed is kept everywhere between two parameters.
pub fn between<const M: usize>(problem: &Problem<M>, i: usize, [from, to]: [f64; 2]) -> f64 {
    let mut parts = CompositeCurve::default();
    split(&piece(problem, i), &[from, to], &mut parts);
    on(problem, i, &parts.piece(1))
}

/// `between` for a part of piece `i`.
pub fn on<const M: usize>(problem: &Problem<M>, i: usize, part: &Piece<M>) -> f64 {
    let Some(share) = problem.share(i) else { return problem.feed[i] };
    let hodograph = Hodograph::new(part);
    let rows = hodograph.coefficients();
    let square = |share: &[f64; M]| {
        let axis = |k: usize| Square::from_bernstein(rows.iter().map(|row| share[k] * row[k]));
        (0..M).map(axis).fold(Square::constant(0.0), |sum, g| sum.combine(1.0, &g.multiply(&g), 1.0))
    };
    let most = share.iter().fold(0.0_f64, |most, share| most.max(share * share));
    let mut seen = 0.0;
    problem.feed[i] / greatest_quotient(&square(share), &square(&[1.0; M]), most, &mut seen, 0).sqrt()
}

/// An upper bound on n/d on [0, 1], at most `most`, by the quotients of Bernstein coefficients of one degree.
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
