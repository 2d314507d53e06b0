//! Computes a lower bound of ∫ √D dx for a polynomial D ≥ 0, by Gauss's quadrature of a polynomial below √D.

use std::sync::OnceLock;

/// Greatest number of nodes of a rule.
const MOST: usize = 24;
/// Error of a rule by the rounding of its nodes and weights, as a fraction of the greatest value; a generous bound.
const ROUNDING: f64 = 1e-12;

/// An interval is halved while 1/√D differs from a straight line by more than this fraction.
const OFF_LINE: f64 = 0.01;
const MOST_HALVINGS: u32 = 8;

/// A lower bound of ∫ √D dx over [from, to], for a polynomial D of degree `degree` whose computed values have errors of at
/// most `noise`.
///
/// √D ≥ (3 D r − D² r³)/2 for every r > 0, since the difference is √D (1 − z)² (2 + z)/2 with z = r √D. With r linear
/// between 1/√D at both ends, the right side is a polynomial, and Gauss's rule integrates it exactly. The error of r
/// is of second order in the interval, so that of the bound is of fourth order.
pub fn root_integral(d: &impl Fn(f64) -> f64, degree: usize, noise: f64, (from, to): (f64, f64)) -> f64 {
    halves(d, degree, noise, (from, to), (d(from), d(to)), 0)
}

fn halves(
    d: &impl Fn(f64) -> f64,
    degree: usize,
    noise: f64,
    (from, to): (f64, f64),
    ends: (f64, f64),
    depth: u32,
) -> f64 {
    let middle = 0.5 * (from + to);
    let (first, last) = (1.0 / ends.0.sqrt(), 1.0 / ends.1.sqrt());
    let half = d(middle);
    let off = (0.5 * (first + last) * half.sqrt() - 1.0).abs();
    if depth < MOST_HALVINGS && (off > OFF_LINE || off.is_nan()) {
        return halves(d, degree, noise, (from, middle), (ends.0, half), depth + 1)
            + halves(d, degree, noise, (middle, to), (half, ends.1), depth + 1);
    }
    if !(first.is_finite() && last.is_finite()) {
        return 0.0;
    }
    let (mut sum, mut greatest) = (0.0, 0.0_f64);
    for &(x, weight) in rule(degree + 2) {
        let (value, r) = (d(from + x * (to - from)), first + x * (last - first));
        let z_sq = value * r * r;
        // Far from 1/√D the bound is loose, and the estimate of its rounding below would not hold.
        if !(0.0..=4.0).contains(&z_sq) {
            return 0.0;
        }
        sum += weight * 0.5 * value * r * (3.0 - z_sq);
        greatest = greatest.max(value * r);
    }
    // The derivative of the polynomial by D is at most 5/2 r.
    (to - from) * (sum - ROUNDING * greatest - 2.5 * first.max(last) * noise).max(0.0)
}

/// See `lower_bound::prepare`.
pub fn prepare() {
    rule(0);
}

/// Gauss's rule on [0, 1] with `count` nodes: exact for polynomials of degree 2 count − 1.
fn rule(count: usize) -> &'static [(f64, f64)] {
    static RULES: OnceLock<Vec<Vec<(f64, f64)>>> = OnceLock::new();
    &RULES.get_or_init(|| (0..=MOST).map(legendre).collect())[count]
}

fn legendre(count: usize) -> Vec<(f64, f64)> {
    let n = count as f64;
    (0..count)
        .map(|i| {
            let mut x = (std::f64::consts::PI * (i as f64 + 0.75) / (n + 0.5)).cos();
            let mut slope = 1.0;
            for _ in 0..100 {
                let (mut last, mut value) = (1.0, x);
                for j in 2..=count {
                    let j = j as f64;
                    (last, value) = (value, ((2.0 * j - 1.0) * x * value - (j - 1.0) * last) / j);
                }
                slope = n * (x * value - last) / (x * x - 1.0);
                let step = value / slope;
                x -= step;
                if step.abs() <= f64::EPSILON {
                    break;
                }
            }
            (0.5 * (1.0 + x), 1.0 / ((1.0 - x * x) * slope * slope))
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_rule_integrates_what_it_should() {
        for count in 1..=MOST {
            let power = 2 * count as i32 - 1;
            let sum: f64 = rule(count).iter().map(|(x, weight)| weight * x.powi(power)).sum();
            assert!((sum * f64::from(power + 1) - 1.0).abs() < 1e-13, "{count}: {sum}");
        }
    }

    #[test]
    fn a_parabola_is_hardly_shorter_than_its_bound() {
        // ∫ √(1 + x²) = (√2 + asinh 1)/2; the error is of fourth order in the interval.
        let exact = 0.5 * (2f64.sqrt() + 1f64.asinh());
        let missed = |parts: u32| {
            let share = |i: u32| f64::from(i) / f64::from(parts);
            let over = |i: u32| root_integral(&|x| 1.0 + x * x, 2, 0.0, (share(i), share(i + 1)));
            exact - (0..parts).map(over).sum::<f64>()
        };
        let (quarters, sixteenths) = (missed(4), missed(16));
        assert!(quarters > 0.0 && quarters < 2e-5, "{quarters}");
        assert!(sixteenths > 0.0 && sixteenths < quarters / 200.0, "{quarters} {sixteenths}");
    }
}
