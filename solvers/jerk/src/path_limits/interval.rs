//! Interval arithmetic with outward rounding, and the operations that let a formula be evaluated on numbers and on
//! intervals: an interval result contains the formula's value for all numbers in its arguments.

use std::ops::{Add, Mul, Sub};

/// A number, or an interval that contains it.
pub trait Number: Copy + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self> {
    fn scale(self, factor: f64) -> Self;
    fn square(self) -> Self;
    /// 1/x of a positive number; infinite where x may not be positive.
    fn reciprocal(self) -> Self;
    /// √x of a number ≥ 0.
    fn root(self) -> Self;
    /// Least and greatest value.
    fn ends(self) -> [f64; 2];
    fn most(self) -> f64 {
        let [least, greatest] = self.ends();
        least.abs().max(greatest.abs())
    }
}

impl Number for f64 {
    fn scale(self, factor: f64) -> Self {
        factor * self
    }
    fn square(self) -> Self {
        self * self
    }
    fn reciprocal(self) -> Self {
        if self > 0.0 {
            1.0 / self
        } else {
            f64::INFINITY
        }
    }
    fn root(self) -> Self {
        self.max(0.0).sqrt()
    }
    fn ends(self) -> [f64; 2] {
        [self, self]
    }
}

/// All numbers from `low` to `high`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Interval {
    pub low: f64,
    pub high: f64,
}

impl Interval {
    /// The interval between two numbers that have a few roundings of numbers of this size.
    pub fn around(low: f64, high: f64, size: f64) -> Self {
        let margin = 4.0 * f64::EPSILON * size + f64::MIN_POSITIVE;
        Self { low: low - margin, high: high + margin }
    }

    /// The interval between two numbers that have one rounding each; all numbers where one of them is NaN.
    fn outward(low: f64, high: f64) -> Self {
        if low.is_nan() || high.is_nan() {
            return Self { low: f64::NEG_INFINITY, high: f64::INFINITY };
        }
        let margin =
            |value: f64| if value.is_finite() { f64::EPSILON * value.abs() + f64::MIN_POSITIVE } else { 0.0 };
        Self { low: low - margin(low), high: high + margin(high) }
    }
}

impl Add for Interval {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        Self::outward(self.low + other.low, self.high + other.high)
    }
}

impl Sub for Interval {
    type Output = Self;
    fn sub(self, other: Self) -> Self {
        Self::outward(self.low - other.high, self.high - other.low)
    }
}

impl Mul for Interval {
    type Output = Self;
    fn mul(self, other: Self) -> Self {
        let corners =
            [self.low * other.low, self.low * other.high, self.high * other.low, self.high * other.high];
        // An infinite end times 0 is NaN, which min and max would pass over.
        if corners.iter().any(|corner| corner.is_nan()) {
            return Self::outward(f64::NAN, f64::NAN);
        }
        let low = corners.into_iter().fold(f64::INFINITY, f64::min);
        Self::outward(low, corners.into_iter().fold(f64::NEG_INFINITY, f64::max))
    }
}

impl Number for Interval {
    fn scale(self, factor: f64) -> Self {
        let (a, b) = (factor * self.low, factor * self.high);
        Self::outward(a.min(b), a.max(b))
    }
    fn square(self) -> Self {
        let most = self.most();
        let least = if self.low > 0.0 || self.high < 0.0 { self.low.abs().min(self.high.abs()) } else { 0.0 };
        let square = Self::outward(least * least, most * most);
        Self { low: square.low.max(0.0), ..square }
    }
    fn reciprocal(self) -> Self {
        if self.low > 0.0 {
            Self::outward(1.0 / self.high, 1.0 / self.low)
        } else {
            Self { low: 0.0, high: f64::INFINITY }
        }
    }
    fn root(self) -> Self {
        let root = Self::outward(self.low.max(0.0).sqrt(), self.high.max(0.0).sqrt());
        Self { low: root.low.max(0.0), ..root }
    }
    fn ends(self) -> [f64; 2] {
        [self.low, self.high]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn interval(low: f64, high: f64) -> Interval {
        Interval { low, high }
    }

    fn close(found: Interval, low: f64, high: f64) {
        assert!(found.low <= low && found.low > low - 1e-12, "{found:?}");
        assert!(found.high >= high && found.high < high + 1e-12, "{found:?}");
    }

    #[test]
    fn operations_by_hand() {
        let (a, b) = (interval(-1.0, 2.0), interval(3.0, 4.0));
        close(a + b, 2.0, 6.0);
        close(a - b, -5.0, -1.0);
        close(a * b, -4.0, 8.0);
        close(a.square(), 0.0, 4.0);
        close(b.square(), 9.0, 16.0);
        close(b.reciprocal(), 0.25, 1.0 / 3.0);
        close(interval(4.0, 9.0).root(), 2.0, 3.0);
        close(a.scale(-2.0), -4.0, 2.0);
        assert_eq!(a.most(), 2.0);
    }

    #[test]
    fn a_divisor_that_may_vanish_gives_all_numbers() {
        let unknown = interval(0.0, 1.0).reciprocal() * interval(-1.0, 1.0);
        assert_eq!((unknown.low, unknown.high), (f64::NEG_INFINITY, f64::INFINITY));
        let nothing = interval(0.0, 1.0).reciprocal() * interval(0.0, 0.0);
        assert_eq!(nothing.most(), f64::INFINITY);
    }

    proptest! {
        #[test]
        fn results_lie_within_the_results_of_intervals(
            ends in prop::array::uniform4(-1e3..1e3f64),
            parts in prop::array::uniform2(0.0..=1.0f64),
        ) {
            let [a, b, c, d] = ends;
            let (first, second) = (interval(a.min(b), a.max(b)), interval(c.min(d), c.max(d)));
            let x = (a + parts[0] * (b - a)).clamp(first.low, first.high);
            let y = (c + parts[1] * (d - c)).clamp(second.low, second.high);
            let holds = |interval: Interval, value: f64| interval.low <= value && value <= interval.high;
            prop_assert!(holds(first + second, x + y) && holds(first - second, x - y) && holds(first * second, x * y));
            prop_assert!(holds(first.square(), x * x) && holds(first.scale(y), x * y) || c != d);
            if first.low > 0.0 {
                prop_assert!(holds(first.reciprocal(), 1.0 / x) && holds(first.root(), x.sqrt()));
            }
        }
    }
}
