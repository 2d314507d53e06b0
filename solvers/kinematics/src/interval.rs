//! Intervals [lo, hi], rounded outward: every result contains the exact one.
//!
//! Moore, Kearfott and Cloud, Introduction to Interval Analysis (2009); Tucker, Validated Numerics (2011). An operation
//! has an error of at most half a unit in the last place. Outward rounding subtracts |lo| ε and adds |hi| ε, ε = 2⁻⁵²,
//! which is at least one unit; it costs less than a change of the rounding mode. A result that is not defined (a divisor
//! with 0 in it, the angle of a box with the origin in it) is the whole line: the caller sees an unbounded interval and
//! cuts the part smaller.

use std::f64::consts::TAU;
use std::ops::{Add, Div, Mul, Neg, Sub};

use super::number::Number;
use super::tolerance::{ELEMENTARY_ULPS, STRAIGHT, UNDERFLOW};

const EPSILON: f64 = f64::EPSILON;
/// π/180 and 180/π between neighbouring floating-point numbers.
const RADIAN: Interval = Interval { lo: 0.017453292519943295, hi: 0.0174532925199433 };
const DEGREE: Interval = Interval { lo: 57.295779513082316, hi: 57.29577951308232 };

/// All numbers from lo to hi, lo ≤ hi.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Interval {
    pub lo: f64,
    pub hi: f64,
}

impl Interval {
    pub const WHOLE: Interval = Interval { lo: f64::NEG_INFINITY, hi: f64::INFINITY };

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

    /// About the middle, inside; NaN where the interval is unbounded on both sides.
    pub fn middle(self) -> f64 {
        0.5 * self.lo + 0.5 * self.hi
    }

    /// The least interval around both.
    pub fn hull(self, other: Interval) -> Interval {
        Interval { lo: self.lo.min(other.lo), hi: self.hi.max(other.hi) }
    }

    /// The numbers in both intervals, which are known to hold the same number.
    pub fn meet(self, other: Interval) -> Interval {
        Interval { lo: self.lo.max(other.lo), hi: self.hi.min(other.hi) }
    }

    /// Rounded outward by `ulps` units in the last place; the whole line where an end is NaN.
    #[inline]
    fn rounded(lo: f64, hi: f64, ulps: f64, tiny: f64) -> Interval {
        let lo = lo - (lo.abs() * (ulps * EPSILON) + tiny);
        let hi = hi + (hi.abs() * (ulps * EPSILON) + tiny);
        if lo.is_nan() || hi.is_nan() {
            Interval::WHOLE
        } else {
            Interval { lo, hi }
        }
    }

    /// The least and the greatest product of both ends, not yet rounded outward, and the sum of all four, which is NaN
    /// where one is NaN (0 times infinity) or where the result is the whole line.
    #[inline(always)]
    fn products(self, other: Interval) -> (f64, f64, f64) {
        let (a, b) = (self.lo * other.lo, self.lo * other.hi);
        let (c, d) = (self.hi * other.lo, self.hi * other.hi);
        (less(less(a, b), less(c, d)), greater(greater(a, b), greater(c, d)), (a + b) + (c + d))
    }

    /// 1/x; the whole line where x may be 0.
    fn reciprocal(self) -> Interval {
        if self.lo <= 0.0 && self.hi >= 0.0 {
            Interval::WHOLE
        } else {
            Interval::rounded(1.0 / self.hi, 1.0 / self.lo, 1.0, UNDERFLOW)
        }
    }

    /// The range of a sine wave with its crests at `crest` + whole turns, and with these values at both ends.
    fn wave(self, crest: f64, at_lo: f64, at_hi: f64) -> Interval {
        if !self.is_bounded() {
            return Interval { lo: -1.0, hi: 1.0 };
        }
        let found = Interval::rounded(at_lo.min(at_hi), at_lo.max(at_hi), ELEMENTARY_ULPS, UNDERFLOW);
        // The angles in turns, widened by more than their rounding: a crest that is counted by mistake costs only width.
        let [first, last] = [self.lo, self.hi].map(|angle| angle / TAU - crest);
        let slack = 4.0 * EPSILON * (1.0 + first.abs().max(last.abs()));
        let (first, last) = (first - slack, last + slack);
        let has_crest = last.floor() >= first.ceil();
        let has_trough = (last + 0.5).floor() >= (first + 0.5).ceil();
        Interval {
            lo: if has_trough { -1.0 } else { found.lo.max(-1.0) },
            hi: if has_crest { 1.0 } else { found.hi.min(1.0) },
        }
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

impl Number for Interval {
    #[inline]
    fn exactly(value: f64) -> Self {
        Interval { lo: value, hi: value }
    }

    /// Never below 0.
    fn square(self) -> Self {
        let (low, high) = (self.lo.abs(), self.hi.abs());
        let least = if self.lo <= 0.0 && self.hi >= 0.0 { 0.0 } else { low.min(high) };
        let most = low.max(high);
        let found = Interval::rounded(least * least, most * most, 1.0, UNDERFLOW);
        Interval { lo: found.lo.max(0.0), hi: found.hi }
    }

    /// The whole line where x may be negative.
    fn sqrt(self) -> Self {
        Interval::rounded(self.lo.sqrt(), self.hi.sqrt(), 1.0, 0.0)
    }

    fn sin_cos(self) -> (Self, Self) {
        let ((sine_lo, cosine_lo), (sine_hi, cosine_hi)) = (self.lo.sin_cos(), self.hi.sin_cos());
        (self.wave(0.25, sine_lo, sine_hi), self.wave(0.0, cosine_lo, cosine_hi))
    }

    /// The angle at the origin of all points of the box x × y, continuous over the box.
    ///
    /// The angle of the middle of the box is in (−π, π]; the ends may be outside. The angles of a box without the origin
    /// span less than π, from one of its corners to another.
    fn atan2(y: Self, x: Self) -> Self {
        if x.lo <= 0.0 && x.hi >= 0.0 && y.lo <= 0.0 && y.hi >= 0.0 {
            return Interval::WHOLE;
        }
        let centre = y.middle().atan2(x.middle());
        let (mut least, mut most) = (f64::INFINITY, f64::NEG_INFINITY);
        for (a, b) in [(x.lo, y.lo), (x.lo, y.hi), (x.hi, y.lo), (x.hi, y.hi)] {
            let corner = b.atan2(a) - centre;
            let corner = corner - TAU * (corner / TAU).round();
            if corner.is_nan() || corner.abs() > STRAIGHT {
                return Interval::WHOLE;
            }
            (least, most) = (least.min(corner), most.max(corner));
        }
        let slack = ELEMENTARY_ULPS * EPSILON * TAU;
        Interval::rounded(centre + least - slack, centre + most + slack, 1.0, 0.0)
    }

    fn radians(self) -> Self {
        self * RADIAN
    }

    fn degrees(self) -> Self {
        self * DEGREE
    }

    /// With one rounding bound for the whole sum: n products and their sum in any order have an error of at most
    /// n u Σ|products| to first order, u = ε/2 (Higham, Accuracy and Stability of Numerical Algorithms, 2002, section
    /// 3.1); twice that covers the higher orders.
    fn dot(pairs: impl Iterator<Item = (Self, Self)>) -> Self {
        let (mut lo, mut hi, mut size, mut sum, mut terms) = (0.0, 0.0, 0.0, 0.0, 2.0);
        for (a, b) in pairs {
            let (least, most, all) = a.products(b);
            lo += least;
            hi += most;
            size += greater(least.abs(), most.abs());
            sum += all;
            terms += 1.0;
        }
        if sum.is_nan() {
            return Interval::WHOLE;
        }
        let pad = terms * EPSILON * size + terms * UNDERFLOW;
        Interval::rounded(lo - pad, hi + pad, 1.0, 0.0)
    }
}

/// The lesser of two numbers, in one instruction; any of both where one is NaN.
#[inline(always)]
fn less(a: f64, b: f64) -> f64 {
    if a < b {
        a
    } else {
        b
    }
}

/// The greater of two numbers, likewise.
#[inline(always)]
fn greater(a: f64, b: f64) -> f64 {
    if a > b {
        a
    } else {
        b
    }
}
