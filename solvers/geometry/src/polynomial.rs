//! Polynomials on [0, 1] whose degree is known at run time, in scaled Bernstein form: p(x) = Σ c_i x^i (1 − x)^(n−i).
//!
//! A scaled coefficient is the Bernstein coefficient times a binomial. So both have the same sign, a product is a convolution,
//! and a root of order r at 0 is divided out by dropping the first r coefficients. `C` is the greatest number of coefficients; no
//! operation allocates memory.

mod integral;
mod parts;
mod roots;

use fearless_simd::{dispatch, Level};

/// The greatest number of coefficients of any polynomial.
pub const MOST: usize = 74;
/// If `C` is at most this, loops run over all `C` coefficients, so that the compiler knows their number.
const FEW: usize = 12;

/// Pascal's triangle.
static BINOMIALS: [[f64; MOST]; MOST] = binomials();

const fn binomials() -> [[f64; MOST]; MOST] {
    let mut table = [[0.0; MOST]; MOST];
    let mut n = 0;
    while n < MOST {
        table[n][0] = 1.0;
        let mut i = 1;
        while i <= n {
            table[n][i] = table[n - 1][i - 1] + if i < n { table[n - 1][i] } else { 0.0 };
            i += 1;
        }
        n += 1;
    }
    table
}

/// n over k, exact for every degree that occurs.
#[inline(always)]
pub fn binomial(n: usize, k: usize) -> f64 {
    BINOMIALS[n][k]
}

/// A polynomial of degree `n` with its scaled Bernstein coefficients `c[0..=n]`; the others are 0.
#[derive(Clone, Copy, Debug)]
pub struct Polynomial<const C: usize> {
    n: usize,
    c: [f64; C],
}

impl<const C: usize> Polynomial<C> {
    /// A constant.
    #[inline(always)]
    pub fn constant(value: f64) -> Self {
        let mut c = [0.0; C];
        c[0] = value;
        Self { n: 0, c }
    }

    /// The polynomial with these Bernstein coefficients.
    #[inline]
    pub fn from_bernstein(coefficients: impl ExactSizeIterator<Item = f64>) -> Self {
        let n = coefficients.len() - 1;
        let mut c = [0.0; C];
        for (i, value) in coefficients.enumerate() {
            c[i] = value * BINOMIALS[n][i];
        }
        Self { n, c }
    }

    #[inline(always)]
    pub fn degree(&self) -> usize {
        self.n
    }

    /// Its scaled coefficients.
    #[inline(always)]
    pub fn coefficients(&self) -> &[f64] {
        &self.c[..=self.n]
    }

    /// Its scaled coefficients, followed by zeros up to `padded_len`.
    #[inline(always)]
    pub fn padded(&self) -> &[f64] {
        &self.c[..self.width()]
    }

    /// The number of coefficients that loops over a polynomial of degree `n` run through: `C` where that is small.
    #[inline(always)]
    pub fn padded_len(n: usize) -> usize {
        if C <= FEW {
            C
        } else {
            n + 1
        }
    }

    /// The polynomial of degree `n` with these `padded_len` scaled coefficients.
    #[inline(always)]
    pub fn from_padded(n: usize, coefficients: &[f64]) -> Self {
        let mut c = [0.0; C];
        c[..Self::padded_len(n)].copy_from_slice(coefficients);
        Self { n, c }
    }

    /// Bernstein coefficient `i`.
    #[inline(always)]
    pub fn bernstein(&self, i: usize) -> f64 {
        self.c[i] / BINOMIALS[self.n][i]
    }

    /// The greatest and the least Bernstein coefficient: the polynomial lies between them.
    #[inline(always)]
    pub fn range(&self) -> (f64, f64) {
        if self.n <= 1 {
            let (first, last) = (self.first(), self.last());
            return (first.min(last), first.max(last));
        }
        (0..=self.n)
            .map(|i| self.bernstein(i))
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), value| (low.min(value), high.max(value)))
    }

    /// The integral over [0, 1].
    #[inline(always)]
    pub fn mean(&self) -> f64 {
        if self.n <= 1 {
            return 0.5 * (self.first() + self.last());
        }
        (0..=self.n).map(|i| self.bernstein(i)).sum::<f64>() / (self.n + 1) as f64
    }

    /// p(0).
    #[inline(always)]
    pub fn first(&self) -> f64 {
        self.c[0]
    }

    /// p(1).
    #[inline(always)]
    pub fn last(&self) -> f64 {
        self.c[self.n]
    }

    pub fn set_first(&mut self, value: f64) {
        self.c[0] = value;
    }

    pub fn set_last(&mut self, value: f64) {
        self.c[self.n] = value;
    }

    /// Sets scaled coefficient `i` to 0.
    pub fn clear(&mut self, i: usize) {
        self.c[i] = 0.0;
    }

    /// p'(0).
    #[inline(always)]
    pub fn first_slope(&self) -> f64 {
        if self.n == 0 {
            0.0
        } else {
            self.c[1] - self.n as f64 * self.c[0]
        }
    }

    /// p''(0).
    #[inline(always)]
    pub fn first_bend(&self) -> f64 {
        if self.n < 2 {
            return 0.0;
        }
        let n = self.n as f64;
        2.0 * self.c[2] - 2.0 * (n - 1.0) * self.c[1] + n * (n - 1.0) * self.c[0]
    }

    /// The polynomial with each scaled coefficient changed; `change` maps 0 to 0.
    #[inline(always)]
    pub fn map(&self, change: impl Fn(f64) -> f64) -> Self {
        let mut c = self.c;
        for c in &mut c[..self.width()] {
            *c = change(*c);
        }
        Self { n: self.n, c }
    }

    #[inline]
    pub fn scale(&self, factor: f64) -> Self {
        self.map(|value| factor * value)
    }

    /// The polynomial with the absolute value of each coefficient.
    #[inline]
    pub fn magnitude(&self) -> Self {
        self.map(f64::abs)
    }

    #[inline]
    pub fn multiply(&self, other: &Self) -> Self {
        let (short, long) = if self.n <= other.n { (self, other) } else { (other, self) };
        if short.n == 0 {
            return long.scale(short.c[0]);
        }
        let mut c = [0.0; C];
        for (i, &p) in short.coefficients().iter().enumerate() {
            for (sum, &q) in c[i..].iter_mut().zip(long.padded()) {
                *sum += p * q;
            }
        }
        Self { n: self.n + other.n, c }
    }

    /// The sum of the squares of polynomials of one degree.
    #[inline]
    pub fn sum_of_squares(polynomials: &[Self]) -> Self {
        let n = polynomials.first().map_or(0, Self::degree);
        let mut c = [0.0; C];
        for p in polynomials {
            let p = p.coefficients();
            for (i, &pi) in p.iter().enumerate() {
                c[2 * i] += pi * pi;
                for (sum, &pk) in c[2 * i + 1..].iter_mut().zip(&p[i + 1..]) {
                    *sum += 2.0 * pi * pk;
                }
            }
        }
        Self { n: 2 * n, c }
    }

    /// The same polynomial as one of degree `n`.
    #[inline]
    pub fn elevate(&self, n: usize) -> Self {
        let mut c = self.c;
        if self.n == 0 {
            let (value, len) = (c[0], Self::padded_len(n));
            for (c, binomial) in c[..len].iter_mut().zip(&BINOMIALS[n]) {
                *c = value * binomial;
            }
            return Self { n, c };
        }
        for degree in self.n + 1..=n {
            let mut before = 0.0;
            for value in &mut c[..if C <= FEW { C } else { degree + 1 }] {
                (before, *value) = (*value, *value + before);
            }
        }
        Self { n: n.max(self.n), c }
    }

    /// a p + b q.
    #[inline]
    pub fn combine(&self, a: f64, other: &Self, b: f64) -> Self {
        if self.n == other.n {
            self.sum(a, other, b)
        } else if self.n < other.n {
            self.elevate(other.n).sum(a, other, b)
        } else {
            self.sum(a, &other.elevate(self.n), b)
        }
    }

    /// a p + b q of one degree.
    #[inline]
    fn sum(&self, a: f64, other: &Self, b: f64) -> Self {
        let mut c = [0.0; C];
        for i in 0..self.width() {
            c[i] = a * self.c[i] + b * other.c[i];
        }
        Self { n: self.n, c }
    }

    #[inline(always)]
    fn width(&self) -> usize {
        Self::padded_len(self.n)
    }

    #[inline]
    pub fn derivative(&self) -> Self {
        let mut c = [0.0; C];
        if self.n == 0 {
            return Self { n: 0, c };
        }
        for i in 0..self.n {
            c[i] = (i + 1) as f64 * self.c[i + 1] - (self.n - i) as f64 * self.c[i];
        }
        Self { n: self.n - 1, c }
    }

    /// p' q − p q' of two polynomials of one degree; its degree is 2 n − 2.
    #[inline]
    pub fn wronskian(&self, other: &Self) -> Self {
        let n = self.n;
        debug_assert_eq!(n, other.n);
        match n {
            0 => return Self::constant(0.0),
            1 => return Self::constant(self.c[1] * other.c[0] - self.c[0] * other.c[1]),
            _ => {}
        }
        let mut c = [0.0; C];
        let (p, q) = (self.coefficients(), other.coefficients());
        for (a, (&pa, &qa)) in p.iter().zip(q).enumerate() {
            let mut apart = 0.0;
            for (sum, (pb, qb)) in c[2 * a..].iter_mut().zip(p[a + 1..].iter().zip(&q[a + 1..])) {
                apart += 1.0;
                *sum += apart * (pb * qa - pa * qb);
            }
        }
        Self { n: 2 * n - 2, c }
    }

    /// The sum of the absolute values of the wronskian's terms, to which its rounding is relative.
    pub fn wronskian_magnitude(&self, other: &Self) -> Self {
        let n = self.n;
        if n == 0 {
            return Self::constant(0.0);
        }
        let mut c = [0.0; C];
        for a in 0..=n {
            for b in a + 1..=n {
                let size = (self.c[b] * other.c[a]).abs() + (self.c[a] * other.c[b]).abs();
                c[a + b - 1] += (b - a) as f64 * size;
            }
        }
        Self { n: 2 * n - 2, c }
    }

    /// The m of degree `degree` with m' w − m w' = p and m(0) = 0, so that (m/w)' = p/w².
    #[inline]
    pub fn antiderivative(&self, weight: &Self, degree: usize) -> Self {
        let mut c = [0.0; C];
        if weight.n == 0 {
            // w = 1: m is the integral of p, of degree n + 1.
            let n = self.n + 1;
            for i in 0..n {
                c[i + 1] = (self.c[i] + (n - i) as f64 * c[i]) / (i + 1) as f64;
            }
            return Self { n, c };
        }
        integral::over_weight(&self.c[..=self.n], &weight.c[..=degree], &mut c);
        Self { n: degree, c }
    }

    /// The polynomial without its known root of order `r` at 0.
    #[inline]
    pub fn deflate(&self, r: usize) -> Self {
        let r = r.min(self.n);
        let mut c = [0.0; C];
        c[..=self.n - r].copy_from_slice(&self.c[r..=self.n]);
        Self { n: self.n - r, c }
    }

    /// p(1 − x).
    #[inline]
    pub fn reverse(&self) -> Self {
        let mut c = self.c;
        match self.n {
            0 => {}
            1 => c.swap(0, 1),
            2 => c.swap(0, 2),
            n => c[..=n].reverse(),
        }
        Self { n: self.n, c }
    }

    /// p(x).
    #[inline(always)]
    pub fn value(&self, x: f64) -> f64 {
        self.values([x])[0]
    }

    /// p at several x, by Horner's rule in x and 1 − x at once, without divisions and without cancellation.
    #[inline(always)]
    pub fn values<const K: usize>(&self, x: [f64; K]) -> [f64; K] {
        let (mut sum, mut power) = ([self.c[0]; K], [1.0; K]);
        for &c in &self.coefficients()[1..] {
            for i in 0..K {
                power[i] *= x[i];
                sum[i] = sum[i] * (1.0 - x[i]) + c * power[i];
            }
        }
        sum
    }

    /// The same values as by `values`, computed with the best SIMD instructions of the processor.
    pub fn values_in_vectors<const K: usize>(&self, x: [f64; K]) -> [f64; K] {
        dispatch!(Level::new(), _simd => self.values(x))
    }

    /// Whether no Bernstein coefficient, and so no value, is below `least`.
    #[inline]
    pub fn is_above(&self, least: f64) -> bool {
        self.coefficients().iter().zip(&BINOMIALS[self.n]).all(|(&value, binomial)| value >= least * binomial)
    }

    /// Whether no coefficient, and so no value, is negative.
    #[inline(always)]
    pub fn is_positive(&self) -> bool {
        self.padded().iter().fold(true, |all, &value| all & (value >= 0.0))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    type Quintic = Polynomial<8>;

    #[test]
    fn sums_products_and_derivatives_by_hand() {
        // p = 1 + 2 x and q = x²: p q = x² + 2 x³, p' q − p q' of equal degrees, p'' = 0.
        let p = Quintic::from_bernstein([1.0, 3.0].into_iter());
        let q = Quintic::from_bernstein([0.0, 0.0, 1.0].into_iter());
        let x: f64 = 0.3;
        assert!((p.multiply(&q).value(x) - (x * x + 2.0 * x.powi(3))).abs() < 1e-16);
        assert!((p.combine(2.0, &q, -3.0).value(x) - (2.0 + 4.0 * x - 3.0 * x * x)).abs() < 1e-15);
        assert_eq!(q.derivative().coefficients(), [0.0, 2.0]);
        let raised = p.elevate(2);
        assert!((raised.wronskian(&q).value(x) - (2.0 * x * x - (1.0 + 2.0 * x) * 2.0 * x)).abs() < 1e-15);
        assert_eq!((raised.first_slope(), raised.first_bend(), q.first_bend()), (2.0, 0.0, 2.0));
    }

    #[test]
    fn a_sum_of_squares_its_values_and_what_it_is_above_by_hand() {
        // x² + (1 − 2 x)² = 1 − 4 x + 5 x², with the Bernstein coefficients 1, −1, 2.
        let lines = [[0.0, 1.0], [1.0, -1.0]].map(|c| Quintic::from_bernstein(c.into_iter()));
        let sum = Quintic::sum_of_squares(&lines);
        assert_eq!(sum.coefficients(), [1.0, -2.0, 2.0]);
        assert_eq!(sum.values([0.0, 0.5, 1.0]), [1.0, 0.25, 2.0]);
        assert!(sum.is_above(-1.0) && !sum.is_above(-0.99));
    }

    #[test]
    fn an_antiderivative_over_a_weight_by_hand() {
        // (m/w)' = p/w² with w = 1 + x and m = 3 x: p = 3 (1 + x) − 3 x = 3, as a form of degree 0.
        let w = Quintic::from_bernstein([1.0, 2.0].into_iter());
        let m = Quintic::constant(3.0).antiderivative(&w, 1);
        assert_eq!(m.coefficients(), [0.0, 3.0]);
    }
}
