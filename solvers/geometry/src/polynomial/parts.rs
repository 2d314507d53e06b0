//! A polynomial on a part of [0, 1], transformed to [0, 1].

use super::{Polynomial, BINOMIALS};

impl<const C: usize> Polynomial<C> {
    /// p on [0, t] and on [t, 1], each transformed to [0, 1] (de Casteljau); both agree at t to the last bit.
    #[inline(always)]
    pub fn split(&self, t: f64) -> (Self, Self) {
        let n = self.n;
        let row = &BINOMIALS[n][..=n];
        let mut right = *self;
        let b = &mut right.c[..=n];
        for (b, binomial) in b.iter_mut().zip(row) {
            *b /= binomial;
        }
        let mut left = [0.0; C];
        for (level, (left, binomial)) in left.iter_mut().zip(row).enumerate() {
            *left = b[0] * binomial;
            let rest = &mut b[..=n - level];
            for i in 1..rest.len() {
                rest[i - 1] = (1.0 - t) * rest[i - 1] + t * rest[i];
            }
        }
        for (b, binomial) in b.iter_mut().zip(row) {
            *b *= binomial;
        }
        (Self { n, c: left }, right)
    }

    /// p on [0, t], transformed to [0, 1].
    #[inline(always)]
    pub fn left(&self, t: f64) -> Self {
        // As a polynomial of z = (1 − x)/x: z is scaled by t and shifted by 1 − t.
        let mut c = self.c;
        let used = &mut c[..=self.n];
        let (mut power, rest) = (1.0, 1.0 - t);
        for c in &mut used[1..] {
            power *= t;
            *c *= power;
        }
        for last in (1..=self.n).rev() {
            for i in 1..=last {
                used[i] += rest * used[i - 1];
            }
        }
        Self { n: self.n, c }
    }

    /// p on [t, 1], transformed to [0, 1].
    #[inline(always)]
    pub fn right(&self, t: f64) -> Self {
        let mut c = self.c;
        if self.n == 1 {
            c[0] = (1.0 - t) * c[0] + t * c[1];
            return Self { n: 1, c };
        }
        // As a polynomial of z = x/(1 − x): z is scaled by 1 − t and shifted by t.
        let used = &mut c[..=self.n];
        let (mut power, rest) = (1.0, 1.0 - t);
        for c in used[..self.n].iter_mut().rev() {
            power *= rest;
            *c *= power;
        }
        for first in 0..self.n {
            for i in (first..self.n).rev() {
                used[i] += t * used[i + 1];
            }
        }
        Self { n: self.n, c }
    }

    /// p on [a, b], transformed to [0, 1].
    #[inline(always)]
    pub fn part(&self, a: f64, b: f64) -> Self {
        if self.n == 0 || (a == 0.0 && b == 1.0) {
            *self
        } else if self.n == 1 {
            Self::from_bernstein([a, b].map(|x| self.value(x)).into_iter())
        } else {
            self.inner_part(a, b)
        }
    }

    #[inline(never)]
    fn inner_part(&self, a: f64, b: f64) -> Self {
        let right = if a > 0.0 { self.right(a) } else { *self };
        if b < 1.0 {
            right.left((b - a) / (1.0 - a))
        } else {
            right
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    type Quintic = Polynomial<8>;

    proptest! {
        #[test]
        fn parts_are_the_same_polynomial(c in prop::collection::vec(-1.0..1.0_f64, 6), a in 0.0..0.5_f64, b in 0.5..1.0_f64, x in 0.0..1.0_f64) {
            let p = Quintic::from_bernstein(c.into_iter());
            let part = p.part(a, b);
            prop_assert!((part.value(x) - p.value(a + x * (b - a))).abs() < 1e-14);
            let (left, right) = p.split(a);
            prop_assert!((left.value(x) - p.value(a * x)).abs() < 1e-14);
            prop_assert!((right.value(x) - p.value(a + (1.0 - a) * x)).abs() < 1e-14);
        }
    }
}
