//! The type of the coefficients of a series: numbers, or intervals that contain them.

use std::ops::{Add, Div, Mul, Neg, Sub};

/// A coefficient.
pub trait Number:
    Copy
    + Send
    + Sync
    + Neg<Output = Self>
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
{
    fn exactly(value: f64) -> Self;
    /// x².
    fn square(self) -> Self;
    /// √x.
    fn sqrt(self) -> Self;
    /// Sine and cosine of an angle in radians.
    fn sin_cos(self) -> (Self, Self);
    /// The angle in radians of the vector (x, y).
    fn atan2(y: Self, x: Self) -> Self;
    /// Converts degrees to radians.
    fn radians(self) -> Self;
    /// Converts radians to degrees.
    fn degrees(self) -> Self;
    /// Σ a b.
    fn dot(pairs: impl Iterator<Item = (Self, Self)>) -> Self;
}

impl Number for f64 {
    #[inline]
    fn exactly(value: f64) -> Self {
        value
    }

    #[inline]
    fn square(self) -> Self {
        self * self
    }

    #[inline]
    fn sqrt(self) -> Self {
        f64::sqrt(self)
    }

    #[inline]
    fn sin_cos(self) -> (Self, Self) {
        f64::sin_cos(self)
    }

    #[inline]
    fn atan2(y: Self, x: Self) -> Self {
        f64::atan2(y, x)
    }

    #[inline]
    fn radians(self) -> Self {
        self.to_radians()
    }

    #[inline]
    fn degrees(self) -> Self {
        self.to_degrees()
    }

    #[inline]
    fn dot(pairs: impl Iterator<Item = (Self, Self)>) -> Self {
        pairs.fold(0.0, |sum, (a, b)| sum + a * b)
    }
}
