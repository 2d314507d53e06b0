//! A curve p(x) on an interval in Bernstein form, and where one curve rises above another.
//!
//! Every curve of the planner but one is a quotient of quadratics, so that two of them cross at the roots of a
//! quartic (a parabola where their denominators agree). The chord-error limit is the root of a quadratic; it is
//! compared by squares, which has the same roots with the same multiplicities, because p is positive.

use crate::bernstein::{difference, divide_by_t, first_root, multiply, product, raise};

/// What a numerator is divided by; equal tags mean equal denominators on a sub-piece.
#[derive(Clone, Copy, PartialEq)]
pub enum Denominator {
    One,
    /// |C'|²
    SpeedSq,
    /// q'_k²
    AxisSq(u8),
}

/// p(x) on an interval of a sub-piece, x running from 0 to 1 there.
#[derive(Clone, Copy)]
pub enum Curve {
    /// n / d
    Quotient { n: [f64; 3], d: [f64; 3], tag: Denominator },
    /// √square
    Root { square: [f64; 3] },
}

impl Curve {
    /// The straight line between two values of p.
    pub fn line(start: f64, end: f64) -> Self {
        Self::Quotient { n: [start, 0.5 * (start + end), end], d: [1.0; 3], tag: Denominator::One }
    }

    /// First x in [0, 1] after which the curve is above `limit`, None if it never is.
    ///
    /// `contact` is the number of roots at 0 that are known beforehand and are not meant: 1 where the curve
    /// starts on the limit, 2 where it starts tangent to it.
    #[inline(always)]
    pub fn rises_above(&self, limit: &Self, contact: u32) -> Option<f64> {
        match (self, limit) {
            (Self::Quotient { n, d, tag }, Self::Quotient { n: limit_n, d: limit_d, tag: limit_tag }) => {
                if tag == limit_tag {
                    match contact {
                        0 => first_root(&difference(limit_n, n)),
                        1 => first_root::<2>(&divide_by_t(&difference(limit_n, n))),
                        _ => first_root::<1>(&divide_by_t::<2, 1>(&divide_by_t(&difference(limit_n, n)))),
                    }
                } else {
                    quartic(&difference(&multiply(limit_n, d), &multiply(n, limit_d)), contact)
                }
            }
            (Self::Quotient { n, d, .. }, Self::Root { square }) => {
                sextic(&difference(&product::<3, 5, 7>(square, &multiply(d, d)), &square_of(n)), contact)
            }
            (Self::Root { square }, Self::Quotient { n, d, .. }) => {
                sextic(&difference(&square_of(n), &product::<3, 5, 7>(square, &multiply(d, d))), contact)
            }
            (Self::Root { square }, Self::Root { square: limit }) => {
                quartic(&difference(&raise(limit), &raise(square)), contact)
            }
        }
    }
}

/// n² as a polynomial of degree 6.
#[cold]
fn square_of(n: &[f64; 3]) -> [f64; 7] {
    product::<5, 3, 7>(&multiply(n, n), &[1.0; 3])
}

#[inline(always)]
fn quartic(b: &[f64; 5], contact: u32) -> Option<f64> {
    match contact {
        0 => first_root(b),
        1 => first_root::<4>(&divide_by_t(b)),
        _ => first_root::<3>(&divide_by_t::<4, 3>(&divide_by_t(b))),
    }
}

#[cold]
fn sextic(b: &[f64; 7], contact: u32) -> Option<f64> {
    match contact {
        0 => first_root(b),
        1 => first_root::<6>(&divide_by_t(b)),
        _ => first_root::<5>(&divide_by_t::<6, 5>(&divide_by_t(b))),
    }
}
