//! Four numbers at a time, in the machine's vectors: values at four places of an interval or of a piece.

use wide::f64x4;

use std::ops::{Add, AddAssign, Mul, MulAssign, Neg, Sub};

#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lanes(f64x4);

impl Lanes {
    pub const ZERO: Self = Self::all(0.0);
    pub const ONE: Self = Self::all(1.0);

    #[inline(always)]
    pub const fn all(value: f64) -> Self {
        Self(f64x4::new([value; 4]))
    }

    #[inline(always)]
    pub const fn new(values: [f64; 4]) -> Self {
        Self(f64x4::new(values))
    }

    #[inline(always)]
    pub const fn values(&self) -> &[f64; 4] {
        self.0.as_array()
    }

    #[inline(always)]
    pub const fn values_mut(&mut self) -> &mut [f64; 4] {
        self.0.as_mut_array()
    }

    /// The greater of each pair; `other` where either is not a number (the rule of the machine's instruction).
    #[inline(always)]
    pub fn max(self, other: Self) -> Self {
        Self(self.0.fast_max(other.0))
    }

    /// The smaller of each pair; `other` where either is not a number.
    #[inline(always)]
    pub fn min(self, other: Self) -> Self {
        Self(self.0.fast_min(other.0))
    }

    #[inline(always)]
    pub fn abs(self) -> Self {
        Self(self.0.abs())
    }

    #[inline(always)]
    pub fn sqrt(self) -> Self {
        Self(self.0.sqrt())
    }

    #[inline(always)]
    pub fn inverse(self) -> Self {
        Self(f64x4::splat(1.0) / self.0)
    }

    #[inline(always)]
    pub fn sum(self) -> f64 {
        let a = self.values();
        (a[0] + a[2]) + (a[1] + a[3])
    }

    #[inline(always)]
    pub fn least(self) -> f64 {
        let a = self.values();
        a[0].min(a[1]).min(a[2].min(a[3]))
    }

    #[inline(always)]
    pub fn greatest(self) -> f64 {
        let a = self.values();
        a[0].max(a[1]).max(a[2].max(a[3]))
    }
}

macro_rules! lanewise {
    ($trait:ident, $method:ident, $op:tt) => {
        impl $trait for Lanes {
            type Output = Self;
            #[inline(always)]
            fn $method(self, other: Self) -> Self {
                Self(self.0 $op other.0)
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
        Self(self.0 * f64x4::splat(factor))
    }
}

impl Neg for Lanes {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Self(-self.0)
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

/// The logarithm of a product of positive numbers, however many: only the last step takes a logarithm.
pub struct LogProduct {
    /// In [1, 2).
    mantissa: [f64; 4],
    exponent: [i64; 4],
}

impl Default for LogProduct {
    fn default() -> Self {
        Self { mantissa: [1.0; 4], exponent: [0; 4] }
    }
}

impl LogProduct {
    #[inline(always)]
    pub fn take(&mut self, factor: Lanes) {
        const FRACTION: u64 = (1 << 52) - 1;
        for lane in 0..4 {
            let bits = (self.mantissa[lane] * factor.values()[lane]).to_bits();
            self.exponent[lane] += (bits >> 52) as i64 - 1023;
            self.mantissa[lane] = f64::from_bits(bits & FRACTION | 1.0f64.to_bits());
        }
    }

    pub fn ln(&self) -> f64 {
        let exponents: i64 = self.exponent.iter().sum();
        let mantissas: f64 = self.mantissa.iter().product();
        exponents as f64 * std::f64::consts::LN_2 + mantissas.ln()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_product_beyond_all_numbers_has_its_logarithm() {
        let mut product = LogProduct::default();
        let mut sum = 0.0;
        for i in 0..1000 {
            let factor = Lanes::new([1e-200, 3.0, 0.5 + i as f64, 1e-30]);
            product.take(factor);
            sum += factor.values().iter().map(|factor| factor.ln()).sum::<f64>();
        }
        assert!((product.ln() / sum - 1.0).abs() < 1e-13, "{} for {sum}", product.ln());
    }
}
