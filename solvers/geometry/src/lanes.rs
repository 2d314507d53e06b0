//! Four numbers at a time, in the vectors of the processor: values at four places of an interval.
//!
//! The instructions for vectors depend on the processor. `dispatch!` of fearless_simd compiles the call that it is given once
//! for each level of them (on x86-64: v2, AVX2, AVX-512) and chooses when it runs. What is to be compiled so takes `simd`, the
//! proof of the level, and is inlined into that call: functions that take it are `#[inline(always)]`.
//!
//! Every operation on numbers rounds as IEEE 754 says, and no product is fused with a sum: results are the same on every
//! level, bit for bit.

use crate::elementary::Elementary;
use fearless_simd::{f64x4, ExtractToken, Simd, SimdBase, SimdFloat, SimdInto};

use std::ops::{Add, AddAssign, Mul, Neg, Sub};

/// Four numbers in memory.
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(align(32))]
pub struct Lanes([f64; 4]);

impl Lanes {
    pub const ZERO: Self = Self::all(0.0);
    pub const ONE: Self = Self::all(1.0);

    pub const fn all(value: f64) -> Self {
        Self([value; 4])
    }

    pub const fn new(values: [f64; 4]) -> Self {
        Self(values)
    }

    #[inline(always)]
    pub const fn values(&self) -> &[f64; 4] {
        &self.0
    }

    #[inline(always)]
    pub const fn values_mut(&mut self) -> &mut [f64; 4] {
        &mut self.0
    }

    /// Each of them by a function.
    pub fn map(self, f: impl FnMut(f64) -> f64) -> Self {
        Self(self.0.map(f))
    }

    #[inline(always)]
    pub fn load<S: Simd>(self, simd: S) -> Register<S> {
        Register(self.0.simd_into(simd))
    }
}

impl<S: Simd> From<Register<S>> for Lanes {
    #[inline(always)]
    fn from(register: Register<S>) -> Self {
        Self(register.0.into())
    }
}

/// Four numbers in a register of the level S.
#[derive(Clone, Copy)]
pub struct Register<S: Simd>(f64x4<S>);

impl<S: Simd> Register<S> {
    /// The proof of its level.
    #[inline(always)]
    pub fn simd(self) -> S {
        self.0.token()
    }

    #[inline(always)]
    pub fn all(simd: S, value: f64) -> Self {
        Self(f64x4::splat(simd, value))
    }

    /// The greater of each pair of numbers.
    #[inline(always)]
    pub fn max(self, other: Self) -> Self {
        Self(self.0.max(other.0))
    }

    /// The smaller of each pair of numbers.
    #[inline(always)]
    pub fn min(self, other: Self) -> Self {
        Self(self.0.min(other.0))
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
        Self(1.0 / self.0)
    }

    #[inline(always)]
    pub fn values(self) -> [f64; 4] {
        self.0.into()
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
        impl<S: Simd> $trait for Register<S> {
            type Output = Self;
            #[inline(always)]
            fn $method(self, other: Self) -> Self {
                Self(self.0 $op other.0)
            }
        }

        impl<S: Simd> $trait<Lanes> for Register<S> {
            type Output = Self;
            #[inline(always)]
            fn $method(self, other: Lanes) -> Self {
                self $op other.load(self.simd())
            }
        }

        impl<S: Simd> $trait<Register<S>> for Lanes {
            type Output = Register<S>;
            #[inline(always)]
            fn $method(self, other: Register<S>) -> Register<S> {
                self.load(other.simd()) $op other
            }
        }
    };
}

lanewise!(Add, add, +);
lanewise!(Sub, sub, -);
lanewise!(Mul, mul, *);

impl<S: Simd> Mul<f64> for Register<S> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, factor: f64) -> Self {
        Self(self.0 * factor)
    }
}

impl<S: Simd> Neg for Register<S> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Self(-self.0)
    }
}

impl<S: Simd, T> AddAssign<T> for Register<S>
where
    Self: Add<T, Output = Self>,
{
    #[inline(always)]
    fn add_assign(&mut self, other: T) {
        *self = *self + other;
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
    pub fn take(&mut self, factor: [f64; 4]) {
        const FRACTION: u64 = (1 << 52) - 1;
        for lane in 0..4 {
            let bits = (self.mantissa[lane] * factor[lane]).to_bits();
            self.exponent[lane] += (bits >> 52) as i64 - 1023;
            self.mantissa[lane] = f64::from_bits(bits & FRACTION | 1.0f64.to_bits());
        }
    }

    pub fn ln(&self) -> f64 {
        let exponents: i64 = self.exponent.iter().sum();
        let mantissas: f64 = self.mantissa.iter().product();
        exponents as f64 * std::f64::consts::LN_2 + mantissas.natural_log()
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
            let factor = [1e-200, 3.0, 0.5 + i as f64, 1e-30];
            product.take(factor);
            sum += factor.iter().map(|factor| factor.ln()).sum::<f64>();
        }
        assert!((product.ln() / sum - 1.0).abs() < 1e-13, "{} for {sum}", product.ln());
    }
}
