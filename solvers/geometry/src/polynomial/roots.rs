//! The sign changes of a polynomial in [0, 1], by Descartes' rule on Bernstein coefficients, bisection and Newton's method.

use super::Polynomial;
use crate::tolerance::LAST_STEP;

/// Greatest number of halvings: intervals are then as short as the spacing of numbers near 1.
const MAX_DEPTH: u32 = 52;

impl<const C: usize> Polynomial<C> {
    /// The first x in [0, 1] after which the polynomial is negative; 0 if it starts negative, None if it is nowhere negative.
    #[inline]
    pub fn first_root(&self) -> Option<f64> {
        let (before, after) =
            self.coefficients().split_at(self.coefficients().iter().position(|&c| c < 0.0)?);
        if before.iter().all(|&c| c == 0.0) {
            Some(0.0)
        } else if after.iter().all(|&c| c <= 0.0) {
            Some(self.single_root())
        } else {
            Interval::whole(self).first_root()
        }
    }

    /// Calls `found` with each x in (0, 1) where the polynomial changes its sign, in order.
    pub fn sign_changes(&self, found: &mut impl FnMut(f64)) {
        let c = self.coefficients();
        if c.iter().any(|&value| value > 0.0) && c.iter().any(|&value| value < 0.0) {
            Interval::whole(self).sign_changes(&mut 0.0, found);
        }
    }

    /// The root of a polynomial with one change of sign, from positive to negative: Newton's method inside a bracket.
    ///
    /// With z = x/(1 − x) the polynomial is Σ c_i z^i over (1 + z)^n. If the root is beyond ½, it is searched from the other end.
    fn single_root(&self) -> f64 {
        // Without the roots at 0 and at 1.
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

/// A polynomial on an interval of [0, 1] that results from bisection.
struct Interval<const C: usize> {
    p: Polynomial<C>,
    /// For each coefficient, the sum of the absolute values of the terms that were added up.
    size: Polynomial<C>,
    /// A coefficient below this fraction of its terms may be rounding, and counts as having no sign.
    ///
    /// Leaving out signs never adds sign changes, so at any depth at most n/2 intervals have several changes, as without
    /// rounding. If the signs of rounding errors counted, such intervals would multiply with the depth.
    noise: f64,
    from: f64,
    to: f64,
    depth: u32,
}

impl<const C: usize> Interval<C> {
    #[inline]
    fn whole(p: &Polynomial<C>) -> Self {
        Self { p: *p, size: p.magnitude(), noise: 0.0, from: 0.0, to: 1.0, depth: 0 }
    }

    fn halves(&self) -> (Self, Self) {
        let (left, right) = self.p.split(0.5);
        let (left_size, right_size) = self.size.split(0.5);
        let middle = 0.5 * (self.from + self.to);
        // n sums, and two conversions between scaled and plain coefficients.
        let noise = self.noise + 0.5 * (self.p.n + 3) as f64 * f64::EPSILON;
        let depth = self.depth + 1;
        (
            Self { p: left, size: left_size, noise, from: self.from, to: middle, depth },
            Self { p: right, size: right_size, noise, from: middle, to: self.to, depth },
        )
    }

    /// Coefficient i, or 0 if it has no sign.
    #[inline(always)]
    fn known(&self, i: usize) -> f64 {
        let value = self.p.c[i];
        if value.abs() <= self.noise * self.size.c[i] {
            0.0
        } else {
            value
        }
    }

    /// The first and the last sign (0 if there is none) and the number of sign changes.
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

    /// The x of the one change of sign; `first` is the sign before it.
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

    /// Calls `found` with each sign change. `before` is the last sign before the interval; it is set to the last sign in it.
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

/// The root of Σ c_i z^i in [0, 1], where the sum changes its sign once; `at_one` is its value at z = 1.
#[inline(always)]
fn root_below_one(c: impl Fn(usize) -> f64, n: usize, at_one: f64) -> f64 {
    let falls = at_one < 0.0;
    let (mut low, mut high) = (0.0, 1.0);
    // Start: the root of the parabola with the same values at both ends and the same slope at z = 0.
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
    }
}
