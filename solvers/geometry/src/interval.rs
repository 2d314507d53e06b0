//! Interval arithmetic with intervals [lo, hi] rounded outward: every result contains the exact one.
//!
//! Moore, Kearfott and Cloud, Introduction to Interval Analysis (2009); Tucker, Validated Numerics (2011). An operation has an
//! error of at most half a unit in the last place. Outward rounding subtracts |lo| ε and adds |hi| ε, ε = 2⁻⁵², which is at least
//! one unit; this costs less than a change of the rounding mode. An undefined result (division by an interval that contains 0,
//! the root of a negative number) is the whole line: the caller sees an unbounded interval and subdivides.

use std::ops::{Add, Div, Mul, Neg, Sub};

use super::tolerance::UNDERFLOW;

/// All numbers from lo to hi, lo ≤ hi.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Interval {
    pub lo: f64,
    pub hi: f64,
}

impl Interval {
    pub const WHOLE: Interval = Interval { lo: f64::NEG_INFINITY, hi: f64::INFINITY };

    #[inline]
    pub fn exactly(value: f64) -> Interval {
        Interval { lo: value, hi: value }
    }

    /// True where both ends are finite.
    pub fn is_bounded(self) -> bool {
        self.lo.is_finite() && self.hi.is_finite()
    }

    /// hi − lo; infinite where an end is infinite.
    pub fn width(self) -> f64 {
        let width = self.hi - self.lo;
        if width.is_nan() {
            f64::INFINITY
        } else {
            width
        }
    }

    /// The greatest absolute value inside.
    pub fn magnitude(self) -> f64 {
        self.lo.abs().max(self.hi.abs())
    }

    /// A number near the middle, inside the interval; NaN if the interval is unbounded on both sides.
    pub fn middle(self) -> f64 {
        0.5 * self.lo + 0.5 * self.hi
    }

    /// The smallest interval that contains both.
    pub fn hull(self, other: Interval) -> Interval {
        Interval { lo: self.lo.min(other.lo), hi: self.hi.max(other.hi) }
    }

    /// The intersection of two intervals that are known to contain the same number.
    pub fn meet(self, other: Interval) -> Interval {
        Interval { lo: self.lo.max(other.lo), hi: self.hi.min(other.hi) }
    }

    /// The interval rounded outward by `ulps` units in the last place and by `tiny`; the whole line if an end is NaN.
    #[inline]
    pub fn rounded(lo: f64, hi: f64, ulps: f64, tiny: f64) -> Interval {
        let lo = lo - (lo.abs() * (ulps * f64::EPSILON) + tiny);
        let hi = hi + (hi.abs() * (ulps * f64::EPSILON) + tiny);
        if lo.is_nan() || hi.is_nan() {
            Interval::WHOLE
        } else {
            Interval { lo, hi }
        }
    }

    /// The least and the greatest product of the ends, not yet rounded outward, and the sum of all four products. The sum is NaN
    /// if a product is NaN (0 times infinity); the result is then the whole line.
    #[inline(always)]
    pub fn products(self, other: Interval) -> (f64, f64, f64) {
        let (a, b) = (self.lo * other.lo, self.lo * other.hi);
        let (c, d) = (self.hi * other.lo, self.hi * other.hi);
        (less(less(a, b), less(c, d)), greater(greater(a, b), greater(c, d)), (a + b) + (c + d))
    }

    /// 1/x; the whole line if x may be 0.
    #[inline]
    pub fn reciprocal(self) -> Interval {
        if self.lo <= 0.0 && self.hi >= 0.0 {
            Interval::WHOLE
        } else {
            Interval::rounded(1.0 / self.hi, 1.0 / self.lo, 1.0, UNDERFLOW)
        }
    }

    /// x², never below 0.
    #[inline]
    pub fn square(self) -> Interval {
        let (low, high) = (self.lo.abs(), self.hi.abs());
        let least = if self.lo <= 0.0 && self.hi >= 0.0 { 0.0 } else { low.min(high) };
        let most = low.max(high);
        let found = Interval::rounded(least * least, most * most, 1.0, UNDERFLOW);
        Interval { lo: found.lo.max(0.0), hi: found.hi }
    }

    /// √x; the whole line if x may be negative.
    #[inline]
    pub fn sqrt(self) -> Interval {
        Interval::rounded(self.lo.sqrt(), self.hi.sqrt(), 1.0, 0.0)
    }
}

impl Neg for Interval {
    type Output = Interval;

    #[inline]
    fn neg(self) -> Interval {
        Interval { lo: -self.hi, hi: -self.lo }
    }
}

impl Add for Interval {
    type Output = Interval;

    #[inline]
    fn add(self, other: Interval) -> Interval {
        Interval::rounded(self.lo + other.lo, self.hi + other.hi, 1.0, 0.0)
    }
}

impl Sub for Interval {
    type Output = Interval;

    #[inline]
    fn sub(self, other: Interval) -> Interval {
        self + -other
    }
}

impl Mul for Interval {
    type Output = Interval;

    #[inline]
    fn mul(self, other: Interval) -> Interval {
        let (lo, hi, sum) = self.products(other);
        if sum.is_nan() {
            return Interval::WHOLE;
        }
        Interval::rounded(lo, hi, 1.0, UNDERFLOW)
    }
}

impl Div for Interval {
    type Output = Interval;

    // A quotient is a product with the reciprocal.
    #[allow(clippy::suspicious_arithmetic_impl)]
    #[inline]
    fn div(self, other: Interval) -> Interval {
        self * other.reciprocal()
    }
}

/// The lesser of two numbers, in one instruction; either of them if one is NaN.
#[inline(always)]
pub fn less(a: f64, b: f64) -> f64 {
    if a < b {
        a
    } else {
        b
    }
}

/// The greater of two numbers, in one instruction; either of them if one is NaN.
#[inline(always)]
pub fn greater(a: f64, b: f64) -> f64 {
    if a > b {
        a
    } else {
        b
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn interval(lo: f64, hi: f64) -> Interval {
        Interval { lo, hi }
    }

    fn close(found: Interval, lo: f64, hi: f64) {
        assert!(found.lo <= lo && found.lo > lo - 1e-12, "{found:?}");
        assert!(found.hi >= hi && found.hi < hi + 1e-12, "{found:?}");
    }

    #[test]
    fn operations_by_hand() {
        let (a, b) = (interval(-1.0, 2.0), interval(3.0, 4.0));
        close(a + b, 2.0, 6.0);
        close(a - b, -5.0, -1.0);
        close(a * b, -4.0, 8.0);
        close(a / b, -1.0 / 3.0, 2.0 / 3.0);
        close(a.square(), 0.0, 4.0);
        close(b.square(), 9.0, 16.0);
        close(b.reciprocal(), 0.25, 1.0 / 3.0);
        close(interval(4.0, 9.0).sqrt(), 2.0, 3.0);
        assert_eq!(a.magnitude(), 2.0);
    }

    #[test]
    fn what_is_not_defined_is_the_whole_line() {
        assert_eq!(interval(0.0, 1.0).reciprocal(), Interval::WHOLE);
        assert_eq!(interval(-1.0, 1.0).sqrt(), Interval::WHOLE);
        assert_eq!(Interval::WHOLE * interval(0.0, 0.0), Interval::WHOLE);
    }

    proptest! {
        #[test]
        fn results_lie_within_the_results_of_intervals(
            ends in prop::array::uniform4(-1e3..1e3f64),
            parts in prop::array::uniform2(0.0..=1.0f64),
        ) {
            let [a, b, c, d] = ends;
            let (first, second) = (interval(a.min(b), a.max(b)), interval(c.min(d), c.max(d)));
            let x = (a + parts[0] * (b - a)).clamp(first.lo, first.hi);
            let y = (c + parts[1] * (d - c)).clamp(second.lo, second.hi);
            let holds = |interval: Interval, value: f64| interval.lo <= value && value <= interval.hi;
            prop_assert!(holds(first + second, x + y) && holds(first - second, x - y) && holds(first * second, x * y));
            prop_assert!(holds(first.square(), x * x) && holds(first / second, x / y));
            if first.lo > 0.0 {
                prop_assert!(holds(first.reciprocal(), 1.0 / x) && holds(first.sqrt(), x.sqrt()));
            }
        }
    }
}
