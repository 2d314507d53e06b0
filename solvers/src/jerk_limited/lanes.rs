//! Four numbers at a time: one for each collocation point of an interval.

use std::ops::{Add, AddAssign, Mul, MulAssign, Neg, Sub};

#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lanes(pub [f64; 4]);

impl Lanes {
    pub const ZERO: Self = Self::all(0.0);
    pub const ONE: Self = Self::all(1.0);

    #[inline(always)]
    pub const fn all(value: f64) -> Self {
        Self([value; 4])
    }

    #[inline(always)]
    fn zip(self, other: Self, f: impl Fn(f64, f64) -> f64) -> Self {
        let (a, b) = (self.0, other.0);
        Self([f(a[0], b[0]), f(a[1], b[1]), f(a[2], b[2]), f(a[3], b[3])])
    }

    #[inline(always)]
    fn map(self, f: impl Fn(f64) -> f64) -> Self {
        let a = self.0;
        Self([f(a[0]), f(a[1]), f(a[2]), f(a[3])])
    }

    /// The greater of each pair; `other` where either is not a number (the rule of the machine's instruction).
    #[inline(always)]
    pub fn max(self, other: Self) -> Self {
        self.zip(other, |a, b| if a > b { a } else { b })
    }

    /// The smaller of each pair; `other` where either is not a number.
    #[inline(always)]
    pub fn min(self, other: Self) -> Self {
        self.zip(other, |a, b| if a < b { a } else { b })
    }

    #[inline(always)]
    pub fn abs(self) -> Self {
        self.map(f64::abs)
    }

    #[inline(always)]
    pub fn sqrt(self) -> Self {
        self.map(f64::sqrt)
    }

    #[inline(always)]
    pub fn inverse(self) -> Self {
        self.map(|a| 1.0 / a)
    }

    #[inline(always)]
    pub fn sum(self) -> f64 {
        let a = self.0;
        (a[0] + a[2]) + (a[1] + a[3])
    }

    #[inline(always)]
    pub fn product(self) -> f64 {
        let a = self.0;
        (a[0] * a[2]) * (a[1] * a[3])
    }

    #[inline(always)]
    pub fn least(self) -> f64 {
        let a = self.0;
        a[0].min(a[1]).min(a[2].min(a[3]))
    }

    #[inline(always)]
    pub fn greatest(self) -> f64 {
        let a = self.0;
        a[0].max(a[1]).max(a[2].max(a[3]))
    }
}

macro_rules! lanewise {
    ($trait:ident, $method:ident, $op:tt) => {
        impl $trait for Lanes {
            type Output = Self;
            #[inline(always)]
            fn $method(self, other: Self) -> Self {
                self.zip(other, |a, b| a $op b)
            }
        }
    };
}

lanewise!(Add, add, +);
lanewise!(Sub, sub, -);
lanewise!(Mul, mul, *);

impl Mul<f64> for Lanes {
    type Output = Self;
    #[inline(always)]
    fn mul(self, factor: f64) -> Self {
        self.map(|a| a * factor)
    }
}

impl Neg for Lanes {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        self.map(|a| -a)
    }
}

impl AddAssign for Lanes {
    #[inline(always)]
    fn add_assign(&mut self, other: Self) {
        *self = *self + other;
    }
}

impl MulAssign for Lanes {
    #[inline(always)]
    fn mul_assign(&mut self, other: Self) {
        *self = *self * other;
    }
}
