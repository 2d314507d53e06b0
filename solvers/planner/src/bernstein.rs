//! Polynomials in Bernstein form on [0, 1]: products, and the first place where one becomes negative.
//!
//! `[f64; C]` holds the C coefficients of a polynomial of degree C − 1. The form is chosen for its signs: with
//! no negative coefficient there is no root, with one change of sign there is exactly one; most searches end
//! there. The values at 0 and 1 are the first and the last coefficient.

use std::array::from_fn;

/// Coefficients are taken for zero below this part of the terms they come from: a few roundings of a product.
pub const NOISE: f64 = 1e-14;
/// Halving stops here: the interval is then as short as the spacing of numbers near 1.
const MAX_DEPTH: u32 = 52;
/// A Newton step this small, quadratically convergent, leaves an error below rounding.
const LAST_STEP: f64 = 3e-9;

/// The product of two quadratics.
#[inline(always)]
pub fn multiply(a: &[f64; 3], b: &[f64; 3]) -> [f64; 5] {
    [
        a[0] * b[0],
        0.5 * (a[0] * b[1] + a[1] * b[0]),
        (a[0] * b[2] + 4.0 * a[1] * b[1] + a[2] * b[0]) * (1.0 / 6.0),
        0.5 * (a[1] * b[2] + a[2] * b[1]),
        a[2] * b[2],
    ]
}

/// The product of polynomials of any degree; `C` must be `A + B − 1`.
pub fn product<const A: usize, const B: usize, const C: usize>(a: &[f64; A], b: &[f64; B]) -> [f64; C] {
    const { assert!(C + 1 == A + B) };
    let mut out = [0.0; C];
    for i in 0..A {
        for j in 0..B {
            out[i + j] += binomial(A - 1, i) * a[i] * binomial(B - 1, j) * b[j];
        }
    }
    from_fn(|i| out[i] / binomial(C - 1, i))
}

/// A quadratic as a polynomial of degree 4.
#[inline(always)]
pub fn raise(a: &[f64; 3]) -> [f64; 5] {
    [a[0], 0.5 * (a[0] + a[1]), (a[0] + 4.0 * a[1] + a[2]) * (1.0 / 6.0), 0.5 * (a[1] + a[2]), a[2]]
}

/// `a − b`, exactly 0 where the difference is rounding noise.
#[inline(always)]
pub fn difference<const C: usize>(a: &[f64; C], b: &[f64; C]) -> [f64; C] {
    from_fn(|i| {
        let value = a[i] - b[i];
        if value.abs() > NOISE * (a[i].abs() + b[i].abs()) {
            value
        } else {
            0.0
        }
    })
}

/// The polynomial without its known root at 0: p(t) / t; `D` must be `C − 1`.
#[inline(always)]
pub fn divide_by_t<const C: usize, const D: usize>(b: &[f64; C]) -> [f64; D] {
    const { assert!(C == D + 1) };
    from_fn(|i| b[i + 1] * ((C - 1) as f64 / (i + 1) as f64))
}

/// Value and derivative at `t`.
#[inline(always)]
pub fn evaluate<const C: usize>(b: &[f64; C], t: f64) -> (f64, f64) {
    let mut w = *b;
    for count in (2..C).rev() {
        for i in 0..count {
            w[i] += t * (w[i + 1] - w[i]);
        }
    }
    let step = w[1] - w[0];
    (w[0] + t * step, (C - 1) as f64 * step)
}

/// First `t` in [0, 1] after which the polynomial is negative, None if there is none. Touching zero without
/// becoming negative does not count. A polynomial that starts negative answers 0.
#[inline(always)]
pub fn first_root<const C: usize>(b: &[f64; C]) -> Option<f64> {
    if b.iter().all(|&value| value >= 0.0) {
        return None;
    }
    search(b, 0.0, 1.0, 0)
}

#[inline(never)]
fn search<const C: usize>(b: &[f64; C], lo: f64, hi: f64, depth: u32) -> Option<f64> {
    // Halving rounds: what is noise beside the largest coefficient has no sign.
    let size = b.iter().fold(0.0, |size: f64, value| size.max(value.abs()));
    let noise = if depth == 0 { 0.0 } else { 4.0 * f64::EPSILON * size };
    let mut signs = b.iter().filter(|value| value.abs() > noise).map(|&value| value > 0.0);
    let mut previous = signs.next()?;
    if !previous || depth == MAX_DEPTH {
        return Some(lo);
    }
    let mut changes = 0;
    for sign in signs {
        changes += u32::from(sign != previous);
        previous = sign;
    }
    match changes {
        0 => None,
        1 => Some(lo + (hi - lo) * bracketed_newton(b)),
        _ => {
            let (left, right) = halve(b);
            let middle = 0.5 * (lo + hi);
            search(&left, lo, middle, depth + 1).or_else(|| search(&right, middle, hi, depth + 1))
        }
    }
}

/// Every place in (0, 1) where the polynomial changes sign, in order.
pub fn sign_changes<const C: usize>(b: &[f64; C], found: &mut impl FnMut(f64)) {
    isolate(b, 0.0, 1.0, 0, found);
}

fn isolate<const C: usize>(b: &[f64; C], lo: f64, hi: f64, depth: u32, found: &mut impl FnMut(f64)) {
    let changes = b.windows(2).filter(|pair| (pair[0] < 0.0) != (pair[1] < 0.0)).count();
    if changes == 0 {
        return;
    }
    if changes == 1 || depth == MAX_DEPTH {
        let sign = if b[0] < 0.0 { -1.0 } else { 1.0 };
        found(lo + (hi - lo) * bracketed_newton(&b.map(|value| sign * value)));
        return;
    }
    let (left, right) = halve(b);
    let middle = 0.5 * (lo + hi);
    isolate(&left, lo, middle, depth + 1, found);
    isolate(&right, middle, hi, depth + 1, found);
}

/// The same for a parabola, in closed form: with z = t/(1 − t) it is b₀ + 2 b₁ z + b₂ z² over (1 + z)².
pub fn parabola_sign_changes(b: &[f64; 3], found: &mut impl FnMut(f64)) {
    let [c, half, a] = *b;
    let discriminant = half * half - a * c;
    if discriminant <= 0.0 || b.iter().all(|&value| value > 0.0) || b.iter().all(|&value| value < 0.0) {
        return;
    }
    let q = -(half + discriminant.sqrt().copysign(half));
    let mut roots = [q / a, c / q].map(|z| if z > 0.0 { z / (1.0 + z) } else { 0.0 });
    roots.sort_by(f64::total_cmp);
    for t in roots {
        if t > 0.0 && t < 1.0 {
            found(t);
        }
    }
}

/// The root of a polynomial that is positive before it and negative after it, by Newton's method kept inside
/// the bracket by bisection.
#[inline(always)]
fn bracketed_newton<const C: usize>(b: &[f64; C]) -> f64 {
    let (mut lo, mut hi) = (0.0, 1.0);
    // Start where the control polygon crosses zero.
    let right = b.iter().position(|&value| value < 0.0).unwrap_or(C - 1).max(1);
    let (above, below) = (b[right - 1], b[right]);
    let mut t = (right as f64 - below / (below - above)) / (C - 1) as f64;
    for _ in 0..100 {
        let (value, slope) = evaluate(b, t);
        if value >= 0.0 {
            lo = t;
        } else {
            hi = t;
        }
        let newton = t - value / slope;
        if (newton - t).abs() <= LAST_STEP * t.min(1.0 - t + 1e-3) {
            return newton.clamp(lo, hi);
        }
        let inside = newton > lo && newton < hi;
        t = if inside { newton } else { 0.5 * (lo + hi) };
        if hi - lo <= f64::EPSILON * hi {
            break;
        }
    }
    t
}

/// The polynomial on [0, ½] and on [½, 1] (de Casteljau).
#[inline(always)]
fn halve<const C: usize>(b: &[f64; C]) -> ([f64; C], [f64; C]) {
    let (mut left, mut right) = (*b, *b);
    for row in 1..C {
        for i in 0..C - row {
            right[i] = 0.5 * (right[i] + right[i + 1]);
        }
        left[row] = right[0];
    }
    (left, right)
}

fn binomial(n: usize, k: usize) -> f64 {
    (0..k).fold(1.0, |value, i| value * (n - i) as f64 / (i + 1) as f64)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// Bernstein coefficients of the product of (root − t) over `roots`.
    fn from_roots<const C: usize>(roots: &[f64]) -> [f64; C] {
        let mut b = vec![1.0];
        for root in roots {
            let n = b.len();
            let mut next = vec![0.0; n + 1];
            for i in 0..n {
                next[i] += root * b[i] * (n - i) as f64 / n as f64;
                next[i + 1] += (root - 1.0) * b[i] * (i + 1) as f64 / n as f64;
            }
            b = next;
        }
        b.try_into().unwrap()
    }

    #[test]
    fn product_of_two_parabolas_by_hand() {
        // (1 − t)² · t² = t² − 2 t³ + t⁴.
        assert_eq!(multiply(&[1.0, 0.0, 0.0], &[0.0, 0.0, 1.0]), [0.0, 0.0, 1.0 / 6.0, 0.0, 0.0]);
        assert_eq!(product::<3, 3, 5>(&[1.0, 0.0, 0.0], &[0.0, 0.0, 1.0]), [0.0, 0.0, 1.0 / 6.0, 0.0, 0.0]);
    }

    #[test]
    fn raising_keeps_the_values() {
        let b = [3.0, -1.0, 2.0];
        for t in [0.0, 0.25, 0.5, 1.0] {
            assert!((evaluate(&raise(&b), t).0 - evaluate(&b, t).0).abs() < 1e-15);
        }
    }

    #[test]
    fn first_root_of_a_parabola_by_hand() {
        // (¼ − t)(¾ − t) is negative from ¼ on.
        let root = first_root(&from_roots::<3>(&[0.25, 0.75])).unwrap();
        assert!((root - 0.25).abs() < 1e-16);
    }

    #[test]
    fn touching_zero_is_no_root() {
        assert_eq!(first_root(&from_roots::<3>(&[0.5, 0.5])), None);
        assert_eq!(first_root(&[0.0, 0.0, 1.0]), None);
        assert_eq!(first_root(&[0.0, 0.0, 0.0, 0.0]), None);
    }

    #[test]
    fn a_negative_start_answers_zero() {
        assert_eq!(first_root(&[-1.0, 2.0, 3.0]), Some(0.0));
        assert_eq!(first_root(&[0.0, -1.0, 3.0]), Some(0.0));
    }

    #[test]
    fn dividing_removes_the_root_at_zero() {
        let b = from_roots::<5>(&[0.0, 0.0, 0.3, 2.0]);
        let rest: [f64; 3] = divide_by_t::<4, 3>(&divide_by_t::<5, 4>(&b));
        for t in [0.1, 0.5, 0.9] {
            assert!((evaluate(&rest, t).0 - evaluate(&b, t).0 / (t * t)).abs() < 1e-14);
        }
        assert!((first_root(&rest).unwrap() - 0.3).abs() < 1e-15);
    }

    proptest! {
        #[test]
        fn the_first_root_is_the_smallest_one(
            mut roots in prop::collection::vec(0.01..2.0f64, 6),
        ) {
            roots.sort_by(f64::total_cmp);
            prop_assume!(roots.windows(2).all(|pair| pair[1] - pair[0] > 1e-3));
            let found = first_root(&from_roots::<7>(&roots));
            if roots[0] < 1.0 {
                prop_assert!((found.unwrap() - roots[0]).abs() < 1e-9);
            } else {
                prop_assert_eq!(found, None);
            }
        }

        #[test]
        fn parabolas_have_the_same_roots_in_closed_form(b in prop::array::uniform3(-1.0..1.0f64)) {
            let (mut general, mut closed) = (vec![], vec![]);
            sign_changes(&b, &mut |t| general.push(t));
            parabola_sign_changes(&b, &mut |t| closed.push(t));
            prop_assert_eq!(general.len(), closed.len());
            for (general, closed) in general.iter().zip(&closed) {
                prop_assert!((general - closed).abs() < 1e-7);
            }
        }

        #[test]
        fn every_change_of_sign_is_found(mut roots in prop::collection::vec(-0.5..1.5f64, 6)) {
            roots.sort_by(f64::total_cmp);
            prop_assume!(roots.windows(2).all(|pair| pair[1] - pair[0] > 1e-2));
            prop_assume!(roots.iter().all(|root| root.abs() > 1e-3 && (root - 1.0).abs() > 1e-3));
            let mut found = vec![];
            sign_changes(&from_roots::<7>(&roots), &mut |t| found.push(t));
            let inside: Vec<f64> = roots.into_iter().filter(|root| (0.0..1.0).contains(root)).collect();
            prop_assert_eq!(found.len(), inside.len());
            for (found, root) in found.iter().zip(&inside) {
                prop_assert!((found - root).abs() < 1e-9);
            }
        }
    }
}
