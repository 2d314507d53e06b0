//! Formulas that are evaluated for one number as well as for eight at once, in SIMD vectors.

use std::ops::{Add, Div, Mul, Sub};

use fearless_simd::{f64x8, Select, Simd, SimdBase, SimdFloat};

/// Eight numbers in memory.
pub type Lanes = [f64; 8];

/// One number or eight. No product is fused with a sum, so that results are the same on every processor.
pub trait Number:
    Copy
    + Add<Output = Self>
    + Add<f64, Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Mul<f64, Output = Self>
    + Div<Output = Self>
{
    /// The type that holds it in memory.
    type Kept: Copy;
    fn kept(self) -> Self::Kept;
    /// Reads it from memory. In this and the next function `self` only gives the type.
    fn taken(self, kept: &Self::Kept) -> Self;
    /// The value in all lanes.
    fn filled(self, value: f64) -> Self;
    fn smaller(self, other: Self) -> Self;
    fn greater(self, other: Self) -> Self;
    fn size(self) -> Self;
    fn root(self) -> Self;
    /// The nearest integer.
    fn rounded(self) -> Self;
    /// `self` where `of` is finite, else `other`.
    fn where_finite(self, of: Self, other: f64) -> Self;
}

impl Number for f64 {
    type Kept = f64;

    #[inline(always)]
    fn kept(self) -> f64 {
        self
    }

    #[inline(always)]
    fn taken(self, kept: &f64) -> f64 {
        *kept
    }

    #[inline(always)]
    fn filled(self, value: f64) -> Self {
        value
    }

    #[inline(always)]
    fn smaller(self, other: Self) -> Self {
        self.min(other)
    }

    #[inline(always)]
    fn greater(self, other: Self) -> Self {
        self.max(other)
    }

    #[inline(always)]
    fn size(self) -> Self {
        self.abs()
    }

    #[inline(always)]
    fn root(self) -> Self {
        self.sqrt()
    }

    #[inline(always)]
    fn rounded(self) -> Self {
        self.round()
    }

    #[inline(always)]
    fn where_finite(self, of: Self, other: f64) -> Self {
        if of.is_finite() {
            self
        } else {
            other
        }
    }
}

impl<S: Simd> Number for f64x8<S> {
    type Kept = Lanes;

    #[inline(always)]
    fn kept(self) -> Lanes {
        self.into()
    }

    #[inline(always)]
    fn taken(self, kept: &Lanes) -> Self {
        Self::from_slice(self.simd, kept)
    }

    #[inline(always)]
    fn filled(self, value: f64) -> Self {
        Self::splat(self.simd, value)
    }

    #[inline(always)]
    fn smaller(self, other: Self) -> Self {
        self.min(other)
    }

    #[inline(always)]
    fn greater(self, other: Self) -> Self {
        self.max(other)
    }

    #[inline(always)]
    fn size(self) -> Self {
        self.abs()
    }

    #[inline(always)]
    fn root(self) -> Self {
        self.sqrt()
    }

    #[inline(always)]
    fn rounded(self) -> Self {
        self.round()
    }

    #[inline(always)]
    fn where_finite(self, of: Self, other: f64) -> Self {
        // 0 × x is NaN if x is not finite.
        (of * 0.0).simd_eq(of.filled(0.0)).select(self, of.filled(other))
    }
}

/// Whether eight places are computed at once. With vectors of two numbers, which every x86-64 processor has, that is no faster
/// than one place after the other, so it is compiled for wider ones only.
pub fn are_vectors_wide() -> bool {
    #[cfg(target_arch = "x86_64")]
    let are_wide = fearless_simd::Level::new().as_avx2().is_some();
    #[cfg(not(target_arch = "x86_64"))]
    let are_wide = true;
    are_wide
}

/// Evaluates an expression in SIMD vectors; only on a processor where `are_vectors_wide`.
macro_rules! in_wide_vectors {
    ($simd:ident => $of:expr) => {
        match fearless_simd::Level::new() {
            #[cfg(target_arch = "x86_64")]
            fearless_simd::Level::Avx512(simd) => in_wide_vectors!(@at simd, $simd => $of),
            #[cfg(target_arch = "x86_64")]
            fearless_simd::Level::Avx2(simd) => in_wide_vectors!(@at simd, $simd => $of),
            #[cfg(target_arch = "x86_64")]
            level => unreachable!("vectors of {level:?} are narrow"),
            #[cfg(not(target_arch = "x86_64"))]
            level => fearless_simd::dispatch!(level, $simd => $of),
        }
    };
    (@at $level:expr, $simd:ident => $of:expr) => {{
        let $simd = $level;
        fearless_simd::Simd::vectorize($simd, #[inline(always)] || $of)
    }};
}
pub(crate) use in_wide_vectors;

/// The numbers of a vector in the type that holds them in memory.
#[inline(always)]
pub fn kept<const M: usize, T: Number>(a: [T; M]) -> [T::Kept; M] {
    let mut kept = [a[0].kept(); M];
    for k in 1..M {
        kept[k] = a[k].kept();
    }
    kept
}

/// Inner product of two vectors of numbers.
#[inline(always)]
pub fn inner<const M: usize, T: Number>(a: &[T; M], b: &[T; M]) -> T {
    let mut sum = a[0] * b[0];
    for k in 1..M {
        sum = sum + a[k] * b[k];
    }
    sum
}

/// The vector times a factor.
#[inline(always)]
pub fn scaled<const M: usize, T: Number + Mul<S, Output = T>, S: Copy>(mut a: [T; M], factor: S) -> [T; M] {
    for k in 0..M {
        a[k] = a[k] * factor;
    }
    a
}
