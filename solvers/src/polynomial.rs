//! Polynomials on [0, 1] of a degree known at run time, in scaled Bernstein form: p(x) = Σ c_i x^i (1 − x)^(n−i).
//!
//! The scaled coefficients are the Bernstein coefficients times binomials, so that they have the same signs; a product
//! is a plain convolution, and a root of known order at 0 is divided out by dropping the first coefficients. `C` bounds
//! the number of coefficients; no operation allocates.

/// Most coefficients of any polynomial.
pub const MOST: usize = 74;
/// Sums of polynomials with room for no more coefficients than this go through all of it.
const FEW: usize = 12;
/// Halving stops here: the interval is then as short as the spacing of numbers near 1.
const MAX_DEPTH: u32 = 52;

/// A Newton step this small, quadratically convergent, leaves an error below rounding.
const LAST_STEP: f64 = 3e-9;

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

    /// Its scaled coefficients, and zeros after them where that makes their number a constant.
    #[inline(always)]
    pub fn padded(&self) -> &[f64] {
        &self.c[..self.width()]
    }

    /// So many coefficients are kept of a polynomial of degree `n`, or gone through: all where they are few, for the
    /// number is then a constant.
    #[inline(always)]
    pub fn padded_len(n: usize) -> usize {
        if C <= FEW {
            C
        } else {
            n + 1
        }
    }

    /// The polynomial of degree `n` with these scaled coefficients, padded or not.
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

    /// Puts scaled coefficient `i` to 0.
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

    /// Every coefficient changed; 0 stays 0.
    #[inline(always)]
    pub fn map(&self, change: impl Fn(f64) -> f64) -> Self {
        let mut c = self.c;
        for c in &mut c[..self.width()] {
            *c = change(*c);
        }
        Self { n: self.n, c }
    }

    #[inline(always)]
    pub fn scale(&self, factor: f64) -> Self {
        self.map(|value| factor * value)
    }

    /// Every coefficient by its size.
    #[inline(always)]
    pub fn magnitude(&self) -> Self {
        self.map(f64::abs)
    }

    #[inline(always)]
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
    #[inline(always)]
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
    #[inline(always)]
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
    #[inline(always)]
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

    #[inline(always)]
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
    #[inline(always)]
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

    /// The wronskian's terms by their sizes: how much rounding it can hold.
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
    #[inline(always)]
    pub fn antiderivative(&self, weight: &Self, degree: usize) -> Self {
        let mut c = [0.0; C];
        if weight.n == 0 {
            // w = 1: the plain integral, of degree n + 1.
            let n = self.n + 1;
            for i in 0..n {
                c[i + 1] = (self.c[i] + (n - i) as f64 * c[i]) / (i + 1) as f64;
            }
            return Self { n, c };
        }
        for i in 0..degree {
            let mut rest = self.c[i];
            for a in 1..=i {
                rest -= (2.0 * a as f64 - (i + 1) as f64) * c[a] * weight.c[i + 1 - a];
            }
            c[i + 1] = rest / ((i + 1) as f64 * weight.c[0]);
        }
        Self { n: degree, c }
    }

    /// The polynomial without its known root of order `r` at 0.
    #[inline(always)]
    pub fn deflate(&self, r: usize) -> Self {
        let r = r.min(self.n);
        let mut c = [0.0; C];
        c[..=self.n - r].copy_from_slice(&self.c[r..=self.n]);
        Self { n: self.n - r, c }
    }

    /// p(1 − x).
    #[inline(always)]
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

    /// p at some places, by Horner's rule in x and 1 − x at once: free of divisions and of cancellation.
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

    /// p on [0, t] and on [t, 1], each on [0, 1] again (de Casteljau): both agree at t to the last bit.
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

    /// p on [0, t], on [0, 1] again.
    #[inline(always)]
    pub fn left(&self, t: f64) -> Self {
        // As a polynomial of z = (1 − x)/x: scaled by t, shifted by 1 − t.
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

    /// p on [t, 1], on [0, 1] again.
    #[inline(always)]
    pub fn right(&self, t: f64) -> Self {
        let mut c = self.c;
        if self.n == 1 {
            c[0] = (1.0 - t) * c[0] + t * c[1];
            return Self { n: 1, c };
        }
        // As a polynomial of z = x/(1 − x): scaled by 1 − t, shifted by t.
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

    /// p on [a, b], on [0, 1] again.
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

    /// Whether no Bernstein coefficient is below this, so that the polynomial is not either.
    #[inline(always)]
    pub fn is_above(&self, least: f64) -> bool {
        self.coefficients().iter().zip(&BINOMIALS[self.n]).all(|(&value, binomial)| value >= least * binomial)
    }

    /// Whether no coefficient is negative, so that the polynomial is not either.
    #[inline(always)]
    pub fn is_positive(&self) -> bool {
        self.padded().iter().fold(true, |all, &value| all & (value >= 0.0))
    }

    /// First x in [0, 1] after which the polynomial is negative; one that starts negative answers 0.
    #[inline(always)]
    pub fn first_root(&self) -> Option<f64> {
        let (before, after) =
            self.coefficients().split_at(self.coefficients().iter().position(|&c| c < 0.0)?);
        if before.iter().all(|&c| c == 0.0) {
            Some(0.0)
        } else if after.iter().all(|&c| c <= 0.0) {
            Some(self.single_root())
        } else {
            Stretch::whole(self).first_root()
        }
    }

    /// Every x in (0, 1) where the polynomial changes its sign, in order.
    pub fn sign_changes(&self, found: &mut impl FnMut(f64)) {
        let c = self.coefficients();
        if c.iter().any(|&value| value > 0.0) && c.iter().any(|&value| value < 0.0) {
            Stretch::whole(self).sign_changes(&mut 0.0, found);
        }
    }

    /// The root of a polynomial with one change of sign, from positive to negative: Newton's method inside a bracket.
    ///
    /// With z = x/(1 − x) the polynomial is Σ c_i z^i over (1 + z)^n; roots beyond ½ are sought from the other end.
    fn single_root(&self) -> f64 {
        // Roots at 0 and at 1 are not the one.
        let c = self.coefficients();
        let from = c.iter().position(|&value| value != 0.0).unwrap_or(0);
        let to = c.iter().rposition(|&value| value != 0.0).unwrap_or(0);
        let (c, n) = (&c[from..=to], to - from);
        let middle: f64 = c.iter().sum();
        if middle < 0.0 {
            let z = root_below_one(|i| c[i], n, middle);
            z / (1.0 + z)
        } else {
            let z = root_below_one(|i| c[n - i], n, middle);
            1.0 / (1.0 + z)
        }
    }
}

/// A polynomial on a part of [0, 1] that halving has led to.
struct Stretch<const C: usize> {
    p: Polynomial<C>,
    /// The sizes of the terms that the coefficients are sums of.
    size: Polynomial<C>,
    /// A coefficient below this part of its terms may be rounding alone, and has no sign then.
    ///
    /// Signs left out are never more changes, so that at any depth the stretches with changes are no more than those
    /// of the polynomial without rounding: half its degree at most. Without this, rounding breeds them at every level.
    noise: f64,
    from: f64,
    to: f64,
    depth: u32,
}

impl<const C: usize> Stretch<C> {
    #[inline(always)]
    fn whole(p: &Polynomial<C>) -> Self {
        Self { p: *p, size: p.magnitude(), noise: 0.0, from: 0.0, to: 1.0, depth: 0 }
    }

    fn halves(&self) -> (Self, Self) {
        let (left, right) = self.p.split(0.5);
        let (left_size, right_size) = self.size.split(0.5);
        let middle = 0.5 * (self.from + self.to);
        // n sums and two changes between scaled and plain coefficients.
        let noise = self.noise + 0.5 * (self.p.n + 3) as f64 * f64::EPSILON;
        let depth = self.depth + 1;
        (
            Self { p: left, size: left_size, noise, from: self.from, to: middle, depth },
            Self { p: right, size: right_size, noise, from: middle, to: self.to, depth },
        )
    }

    /// Coefficient i, or 0 where it has no sign.
    #[inline(always)]
    fn known(&self, i: usize) -> f64 {
        let value = self.p.c[i];
        if value.abs() <= self.noise * self.size.c[i] {
            0.0
        } else {
            value
        }
    }

    /// The first and the last sign, 0 for none, and how often it changes.
    #[inline(always)]
    fn signs(&self) -> (f64, f64, usize) {
        let (mut first, mut last, mut changes) = (0.0, 0.0, 0);
        for i in 0..=self.p.n {
            let value = self.known(i);
            if value != 0.0 {
                changes += usize::from(value * last < 0.0);
                last = value.signum();
                first = if first == 0.0 { last } else { first };
            }
        }
        (first, last, changes)
    }

    /// Where the one change of sign is; `first` is the sign before it.
    fn single_root(&self, first: f64) -> f64 {
        let mut p = self.p;
        for i in 0..=p.n {
            p.c[i] = first * self.known(i);
        }
        self.from + (self.to - self.from) * p.single_root()
    }

    #[inline(never)]
    fn first_root(&self) -> Option<f64> {
        match self.signs() {
            (first, ..) if first < 0.0 => Some(self.from),
            (_, _, 0) => None,
            (_, _, 1) => Some(self.single_root(1.0)),
            _ if self.depth == MAX_DEPTH => Some(self.from),
            _ => {
                let (left, right) = self.halves();
                left.first_root().or_else(|| right.first_root())
            }
        }
    }

    /// `before` is the last sign seen.
    fn sign_changes(&self, before: &mut f64, found: &mut impl FnMut(f64)) {
        let (first, last, changes) = self.signs();
        if changes > 1 && self.depth < MAX_DEPTH {
            let (left, right) = self.halves();
            left.sign_changes(before, found);
            right.sign_changes(before, found);
            return;
        }
        if first * *before < 0.0 {
            found(self.from);
        }
        if first * last < 0.0 {
            found(if changes == 1 { self.single_root(first) } else { self.from });
        }
        *before = if last == 0.0 { *before } else { last };
    }
}

/// The root of Σ c_i z^i in [0, 1], where the sum changes its sign once, to that of its value at 1.
#[inline(always)]
fn root_below_one(c: impl Fn(usize) -> f64, n: usize, at_one: f64) -> f64 {
    let falls = at_one < 0.0;
    let (mut low, mut high) = (0.0, 1.0);
    // The root of the parabola with the same ends, and the same slope at 0.
    let (half, bend) = (0.5 * c(1), at_one - c(0) - c(1));
    let q = -(half + (half * half - bend * c(0)).max(0.0).sqrt().copysign(half));
    let mut z = [c(0) / q, q / bend].into_iter().find(|z| (0.0..1.0).contains(z)).unwrap_or(0.5);
    for _ in 0..120 {
        let (mut value, mut slope) = (c(n), 0.0);
        for i in (0..n).rev() {
            slope = slope * z + value;
            value = value * z + c(i);
        }
        if (value >= 0.0) == falls {
            low = z;
        } else {
            high = z;
        }
        let newton = z - value / slope;
        if (newton - z).abs() <= LAST_STEP * z {
            return newton.clamp(low, high);
        }
        if high - low <= f64::EPSILON * high {
            return low;
        }
        z = if newton > low && newton < high { newton } else { 0.5 * (low + high) };
    }
    z
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    type Quintic = Polynomial<8>;

    /// The product of (root − x) over some roots, by Bernstein products.
    fn from_roots(roots: &[f64]) -> Quintic {
        roots.iter().fold(Polynomial::constant(1.0), |product, &root| {
            product.multiply(&Polynomial::from_bernstein([root, root - 1.0].into_iter()))
        })
    }

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

    #[test]
    fn rounding_next_to_a_manifold_root_breeds_no_roots() {
        // (x − r)^6 without a sign change, times x − r with one; rounding changes the signs of both thousands of times.
        for r in [1.0 / 3.0, 0.1, 0.7, 0.12345] {
            for (order, changes) in [(6, 0), (7, 1)] {
                let mut found = vec![];
                from_roots(&vec![r; order]).sign_changes(&mut |x| {
                    found.push(x);
                    assert!(found.len() <= order, "more roots than the degree");
                });
                assert!(
                    found.len() % 2 == changes && found.iter().all(|x| (x - r).abs() < 1e-2),
                    "{found:?}"
                );
            }
        }
    }

    #[test]
    fn roots_at_the_ends_and_between_halves() {
        let quadratic = |c: [f64; 3]| Quintic::from_bernstein(c.into_iter());
        // −x²; x (¼ − x); (½ − x) (1 − x) from 0 on.
        assert_eq!(quadratic([0.0, 0.0, -1.0]).first_root(), Some(0.0));
        assert_eq!(quadratic([0.0, 0.125, -0.75]).first_root(), Some(0.25));
        assert_eq!(quadratic([0.5, -0.25, 0.0]).first_root(), Some(0.5));
        let mut found = vec![];
        from_roots(&[0.25, 0.5, 0.75]).sign_changes(&mut |x| found.push(x));
        assert_eq!(found.len(), 3);
        assert!(found.iter().zip([0.25, 0.5, 0.75]).all(|(x, root)| (x - root).abs() < 1e-15), "{found:?}");
    }

    proptest! {
        #[test]
        fn the_first_root_is_the_smallest_one(mut roots in prop::collection::vec(0.01..2.0_f64, 1..6)) {
            roots.sort_by(f64::total_cmp);
            prop_assume!(roots.windows(2).all(|pair| pair[1] - pair[0] > 1e-3));
            let found = from_roots(&roots).first_root();
            if roots[0] < 1.0 {
                prop_assert!((found.unwrap() - roots[0]).abs() < 1e-9);
            } else {
                prop_assert_eq!(found, None);
            }
        }

        #[test]
        fn a_single_change_of_sign_is_found_wherever_it_is(c in prop::collection::vec(0.0..1.0_f64, 2..7), change in 1_usize..6) {
            let mut c = c;
            let n = c.len() - 1;
            let change = 1 + change % n;
            c[change..].iter_mut().for_each(|value| *value = -*value);
            c[0] += 1e-3;
            c[n] -= 1e-3;
            let p = Quintic::from_bernstein(c.iter().copied());
            let root = p.first_root().unwrap();
            let slope = p.derivative().value(root).abs();
            prop_assert!(p.value(root).abs() <= 1e-14 + 1e-14 * slope, "{root} {}", p.value(root));
            prop_assert!(p.value((root - 1e-6).max(0.0)) > -1e-15 && p.value((root + 1e-6).min(1.0)) < 1e-15);
        }

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
