//! Four or eight numbers at a time in SIMD vectors, one number for each of some neighbouring intervals.
//!
//! The SIMD instructions depend on the processor. `dispatch!` of fearless_simd compiles the call in its argument once for each
//! level of instructions (on x86-64: v2, AVX2, AVX-512) and chooses one at run time. Code that is to be compiled in this way
//! takes `simd`, the proof of the level, and must be inlined into that call: functions that take it are `#[inline(always)]`.
//!
//! Every operation rounds as IEEE 754 requires, and no product is fused with a sum, so results are the same on every level, bit
//! for bit.

use crate::elementary::Elementary;

/// `dispatch!` for vectors of four numbers. It has no instance for AVX-512, whose vectors hold eight numbers: there it uses the
/// instance for AVX2.
#[macro_export]
macro_rules! dispatch_four {
    ($simd:ident => $of:expr) => {{
        let level = fearless_simd::Level::new();
        #[cfg(target_arch = "x86_64")]
        if let Some(simd) = level.as_avx2() {
            $crate::dispatch_four!(@at simd, $simd => $of)
        } else if let Some(simd) = level.as_sse4_2() {
            $crate::dispatch_four!(@at simd, $simd => $of)
        } else {
            unreachable!("programs for x86-64-v2 run only on processors with SSE4.2")
        }
        #[cfg(not(target_arch = "x86_64"))]
        fearless_simd::dispatch!(level, $simd => $of)
    }};
    (@at $level:expr, $simd:ident => $of:expr) => {{
        let $simd = $level;
        fearless_simd::Simd::vectorize($simd, #[inline(always)] || $of)
    }};
}

/// Joins numbers by halves, in an order that does not depend on the processor.
#[inline(always)]
fn fold<const N: usize>(mut values: [f64; N], join: impl Fn(f64, f64) -> f64) -> f64 {
    let mut count = N;
    while count > 1 {
        count /= 2;
        for i in 0..count {
            values[i] = join(values[i], values[i + count]);
        }
    }
    values[0]
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

macro_rules! lanes {
    ($vector:ident, $count:literal, $align:literal) => {
        use fearless_simd::{$vector, ExtractToken, Simd, SimdBase, SimdFloat, SimdInto};

        use std::ops::{Add, AddAssign, Div, Mul, Neg, Sub};

        use super::fold;

        pub const LANES: usize = $count;

        /// Numbers in memory.
        #[derive(Clone, Copy, Debug, PartialEq)]
        #[repr(align($align))]
        pub struct Lanes([f64; LANES]);

        impl Lanes {
            pub const ZERO: Self = Self::all(0.0);
            pub const ONE: Self = Self::all(1.0);

            pub const fn all(value: f64) -> Self {
                Self([value; LANES])
            }

            pub const fn new(values: [f64; LANES]) -> Self {
                Self(values)
            }

            #[inline(always)]
            pub const fn values(&self) -> &[f64; LANES] {
                &self.0
            }

            #[inline(always)]
            pub const fn values_mut(&mut self) -> &mut [f64; LANES] {
                &mut self.0
            }

            /// The result of a function for each number.
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

        /// Numbers in a register of the level S.
        #[derive(Clone, Copy)]
        pub struct Register<S: Simd>($vector<S>);

        impl<S: Simd> Register<S> {
            /// The proof of the register's level.
            #[inline(always)]
            pub fn simd(self) -> S {
                self.0.token()
            }

            #[inline(always)]
            pub fn all(simd: S, value: f64) -> Self {
                Self($vector::splat(simd, value))
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

            /// The numbers of this register from index `FROM` on, followed by the first ones of `next`.
            #[inline(always)]
            pub fn slide<const FROM: usize>(self, next: Self) -> Self {
                Self(self.0.slide::<FROM>(next.0))
            }

            #[inline(always)]
            pub fn values(self) -> [f64; LANES] {
                self.0.into()
            }

            #[inline(always)]
            pub fn sum(self) -> f64 {
                fold(self.values(), |a, b| a + b)
            }

            #[inline(always)]
            pub fn least(self) -> f64 {
                fold(self.values(), f64::min)
            }

            #[inline(always)]
            pub fn greatest(self) -> f64 {
                fold(self.values(), f64::max)
            }
        }

        lanewise!(Add, add, +);
        lanewise!(Sub, sub, -);
        lanewise!(Mul, mul, *);
        lanewise!(Div, div, /);

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
    };
}

/// Four numbers at a time.
pub mod four {
    lanes!(f64x4, 4, 32);
}

/// Eight numbers at a time.
pub mod eight {
    lanes!(f64x8, 8, 64);
}

/// The logarithm of a product of any number of positive factors; only the last step computes a logarithm.
pub struct LogProduct {
    /// In [1, 2).
    mantissa: [f64; eight::LANES],
    exponent: [i64; eight::LANES],
}

impl Default for LogProduct {
    fn default() -> Self {
        Self { mantissa: [1.0; eight::LANES], exponent: [0; eight::LANES] }
    }
}

impl LogProduct {
    #[inline(always)]
    pub fn take(&mut self, factor: [f64; eight::LANES]) {
        const FRACTION: u64 = (1 << 52) - 1;
        for lane in 0..eight::LANES {
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
            let factor = [1e-200, 3.0, 0.5 + i as f64, 1e-30, 1.0, 7e90, 1e-300, 2.0];
            product.take(factor);
            sum += factor.iter().map(|factor| factor.ln()).sum::<f64>();
        }
        assert!((product.ln() / sum - 1.0).abs() < 1e-13, "{} for {sum}", product.ln());
    }
}
