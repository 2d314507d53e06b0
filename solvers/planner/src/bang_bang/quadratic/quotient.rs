//! A curve p(x) = n(x)/d(x) on an interval, and where one such curve rises above another.
//!
//! Numerator and denominator are quadratics at most, so that two curves cross at the roots of a quartic, of a parabola
//! where their denominators are the same.

use crate::bang_bang::tolerance::ZERO;
use feedplan_geometry::polynomial::Polynomial;

/// A polynomial of degree 4 at most.
pub type Quartic = Polynomial<5>;

/// The polynomial with these Bernstein coefficients.
#[inline(always)]
pub fn bernstein<const N: usize>(coefficients: [f64; N]) -> Quartic {
    Polynomial::from_bernstein(coefficients.into_iter())
}

/// What a numerator is divided by; equal denominators on a sub-piece have equal names.
#[derive(Clone, Copy, PartialEq)]
pub enum Denominator {
    One,
    /// |C'|²
    SpeedSq,
    /// q'_k²
    AxisSq(usize),
}

/// p(x) = n/d on an interval of a sub-piece, x running from 0 to 1 there; of Bernstein coefficients.
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

    /// First x in [0, 1] after which the curve is above `limit`, None if it never is.
    ///
    /// `contact` is the number of roots at 0 that are known beforehand and are not meant: 1 where the curve
    /// starts on the limit, 2 where it starts tangent to it.
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

/// The first root of the difference of two polynomials of one degree, without so many roots at 0.
#[inline(always)]
fn first_root(a: &Quartic, b: &Quartic, contact: usize) -> Option<f64> {
    let mut c = [0.0; 5];
    for ((c, a), b) in c.iter_mut().zip(a.coefficients()).zip(b.coefficients()) {
        let difference = a - b;
        // Exactly 0 where it is rounding.
        *c = if difference.abs() > ZERO * (a.abs() + b.abs()) { difference } else { 0.0 };
    }
    let difference = Quartic::from_padded(a.degree(), &c[..Quartic::padded_len(a.degree())]);
    if difference.is_positive() {
        return None;
    }
    difference.deflate(contact).first_root()
}
