//! A curve p(x) = n(x)/d(x) on an interval, and the first x where one such curve rises above another.
//!
//! Numerator and denominator have degree 2 at most, so two curves cross at the roots of a quartic, or of a parabola
//! if their denominators are equal.

use crate::bang_bang::tolerance::ZERO;
use feedplan_geometry::polynomial::Polynomial;

/// Degree 4 at most.
pub type Quartic = Polynomial<5>;

/// The polynomial with these Bernstein coefficients.
#[inline(always)]
pub fn bernstein<const N: usize>(coefficients: [f64; N]) -> Quartic {
    Polynomial::from_bernstein(coefficients.into_iter())
}

/// The name of a denominator; on one sub-piece, equal names mean equal denominators.
#[derive(Clone, Copy, PartialEq)]
pub enum Denominator {
    One,
    /// |C'|².
    SpeedSq,
    /// g_k².
    AxisSq(usize),
}

/// p = n/d over x in [0, 1] of an interval, as Bernstein coefficients.
#[derive(Clone, Copy)]
pub struct Quotient {
    pub n: [f64; 3],
    pub d: [f64; 3],
    pub denominator: Denominator,
}

impl Quotient {
    /// The straight line between two values of p.
    pub fn line(start: f64, end: f64) -> Self {
        Self { n: [start, 0.5 * (start + end), end], d: [1.0; 3], denominator: Denominator::One }
    }

    /// The first x in [0, 1] after which the curve is above `limit`.
    ///
    /// `contact` is the number of known roots at 0 that do not count: 1 where the curve starts on the limit, 2 where
    /// it starts tangent to it.
    #[inline(always)]
    pub fn rises_above(&self, limit: &Self, contact: usize) -> Option<f64> {
        if self.denominator == limit.denominator {
            first_root(&bernstein(limit.n), &bernstein(self.n), contact)
        } else {
            let product = |n: [f64; 3], d: [f64; 3]| bernstein(n).multiply(&bernstein(d));
            first_root(&product(limit.n, self.d), &product(self.n, limit.d), contact)
        }
    }
}

/// The first root of a − b, of equal degree, without `contact` roots at 0.
#[inline(always)]
fn first_root(a: &Quartic, b: &Quartic, contact: usize) -> Option<f64> {
    let mut c = [0.0; 5];
    for ((c, a), b) in c.iter_mut().zip(a.coefficients()).zip(b.coefficients()) {
        let difference = a - b;
        // Differences within rounding are exactly 0.
        *c = if difference.abs() > ZERO * (a.abs() + b.abs()) { difference } else { 0.0 };
    }
    let difference = Quartic::from_padded(a.degree(), &c[..Quartic::padded_len(a.degree())]);
    if difference.is_positive() {
        return None;
    }
    difference.deflate(contact).first_root()
}
