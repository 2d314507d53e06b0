//! Arcs and circles as exact rational quadratic pieces, and helices within a proven tolerance.
//!
//! An arc of θ ≤ 90° has the weights 1, cos(θ/2), 1. With τ = s tan(θ/4), s = 2t − 1, its angle from the middle is 2 atan τ,
//! and ω = (1 + τ²)/(1 + tan²(θ/4)). A helix is not rational: an axis that is linear in the angle is linear in atan τ. So
//! its pieces are the exact circle, raised to degree d, and the axis is Z/ω with a polynomial Z of degree d near
//! (1 + τ²) atan τ. The tool is exactly on the cylinder; the error along the axis has the bound below. All pieces are
//! congruent, so the derivative is continuous.
//!
//! Z interpolates f = (1 + τ²) atan τ at τ = −T cos(jπ/d), T = tan(θ/4), and at 0 too if d is odd, for then both are odd.
//! With n points in all |Z − f| ≤ max|f⁽ⁿ⁾|/n! · Tⁿ/2ᵈ⁻¹. From f''' = 4/(1 + τ²)², whose poles ±i are at least 1 away from
//! any real τ, |f⁽ⁿ⁾|/n! ≤ 2/(n(n − 2)), n ≥ 3. At d = 2 the axis is (Z₀ + Z₂)/2 in the middle.

use crate::elementary::Elementary;
use std::f64::consts::{FRAC_PI_2, TAU};

use super::bezier::elevate;
use super::error::SplineError;
use super::{CompositeCurve, MAX_DEGREE};
use crate::tolerance::SAME_ANGLE;

/// More pieces than this are refused.
const MAX_PIECES: f64 = 1e7;

/// A turn of `sweep` rad about `centre` in the plane of two axes, from the first towards the second.
#[derive(Clone, Copy, Debug)]
pub struct Turn<const M: usize> {
    pub start: [f64; M],
    pub plane: [usize; 2],
    pub centre: [f64; 2],
    pub sweep: f64,
}

impl<const M: usize> Turn<M> {
    /// The turn in equal quadratic pieces of at most 90°, the width of each its length.
    pub fn arc(&self) -> CompositeCurve<M> {
        self.pieces(self.quarters())
    }

    /// The least number of equal pieces of at most 90°.
    pub fn quarters(&self) -> f64 {
        (self.sweep.abs() / FRAC_PI_2 * (1.0 - SAME_ANGLE)).ceil().max(1.0)
    }

    /// The turn while every other axis goes by `travel`, in proportion to the angle: pieces of degree `degree`
    /// (3 to 10), and the bound of their distance from the true helix in mm, at most `tolerance`.
    pub fn helix(
        &self,
        travel: &[f64; M],
        degree: usize,
        tolerance: f64,
    ) -> Result<(CompositeCurve<M>, f64), SplineError> {
        if !(3..=MAX_DEGREE).contains(&degree) {
            return Err(SplineError::Degree { degree });
        }
        let rise = travel.iter().map(|value| value * value).sum::<f64>().sqrt();
        let mut count = self.quarters();
        let mut bound = self.axial_error(rise, degree, count);
        while bound > tolerance {
            count = (count * 0.99 * (bound / tolerance).power(1.0 / (degree + 1 + degree % 2) as f64))
                .ceil()
                .max(count + 1.0);
            if count.is_nan() || count > MAX_PIECES {
                return Err(SplineError::Helix { tolerance, pieces: count });
            }
            bound = self.axial_error(rise, degree, count);
        }
        let (quadratic, fractions) = (self.pieces(count), axial_fractions(self.sweep.abs() / count, degree));
        let mut curve = CompositeCurve::default();
        for (i, piece) in quadratic.pieces().enumerate() {
            let first = curve.control.len();
            elevate(&piece, degree - 2, &mut curve);
            let slope = (rise / count).hypot(piece.width);
            *curve.width.last_mut().expect("the piece just made") = slope;
            for (j, point) in curve.control[first..].iter_mut().enumerate() {
                // Neighbours have the same numbers where they meet.
                let fraction = match j {
                    0 => i as f64 / count,
                    _ if j == degree => (i + 1) as f64 / count,
                    _ => (i as f64 + fractions[j]) / count,
                };
                for k in 0..M {
                    if !self.plane.contains(&k) {
                        point[k] = self.start[k] + travel[k] * fraction;
                    }
                }
            }
        }
        Ok((curve, bound))
    }

    /// The bound of the distance along the axis from a helix that rises by `rise`, in `count` pieces.
    pub fn axial_error(&self, rise: f64, degree: usize, count: f64) -> f64 {
        let theta = self.sweep.abs() / count;
        let (t, n) = ((0.25 * theta).tan(), (degree + 1 + degree % 2) as f64);
        let derivative = 2.0 / (n * (n - 2.0));
        rise / count * (2.0 / theta) * derivative * t.power(n) / (degree as f64 - 1.0).exp2()
    }

    /// The turn in `count` equal quadratic pieces.
    pub fn pieces(&self, count: f64) -> CompositeCurve<M> {
        let [x, y] = self.plane;
        let mut curve = CompositeCurve::default();
        let theta = self.sweep / count;
        let radius = [self.start[x] - self.centre[0], self.start[y] - self.centre[1]];
        let quarters = (theta.abs() - FRAC_PI_2).abs() <= SAME_ANGLE;
        let turns = self.sweep.abs() / TAU;
        let closed = turns >= 0.5 && (turns - turns.round()).abs() <= SAME_ANGLE * turns;
        let at = |i: f64| {
            if closed && i == count {
                return radius;
            }
            let (sin, cos) = match (quarters, i as i64 % 4) {
                (true, 0) => (0.0, 1.0),
                (true, 1) => (1.0, 0.0),
                (true, 2) => (0.0, -1.0),
                (true, _) => (-1.0, 0.0),
                _ => {
                    // With the rounding of the product, so that pieces after many turns are of equal size.
                    let angle = i * theta;
                    let lost = i.mul_add(theta, -angle);
                    let (sin, cos) = angle.sin_cos();
                    (sin + lost * cos, cos - lost * sin)
                }
            };
            let sin = if quarters { sin * theta.signum() } else { sin };
            [radius[0] * cos - radius[1] * sin, radius[0] * sin + radius[1] * cos]
        };
        let tangent = if quarters { theta.signum() } else { (0.5 * theta).tan() };
        let width = radius[0].hypot(radius[1]) * theta.abs();
        for i in 0..count as usize {
            let (a, c) = (at(i as f64), at((i + 1) as f64));
            // The point where the tangents of both ends meet.
            let b = [a[0] - tangent * a[1], a[1] + tangent * a[0]];
            let control = [a, b, c].map(|[u, v]| {
                let mut point = self.start;
                (point[x], point[y]) = (self.centre[0] + u, self.centre[1] + v);
                point
            });
            curve.push(&control, &[1.0, (0.5 * theta).cos(), 1.0], width);
        }
        let last = curve.control.len() - 1;
        curve.control[0] = self.start;
        if closed {
            curve.control[last] = self.start;
        }
        curve
    }
}

/// The control points of the axis of one piece that goes from 0 to 1.
fn axial_fractions(theta: f64, degree: usize) -> [f64; MAX_DEGREE + 1] {
    let (n, top) = (degree + 1, (0.25 * theta).tan());
    // (1 + τ²) atan τ − τ = Σ 2 (−1)^(j+1) τ^(2j+1)/((2j − 1)(2j + 1)).
    let rest = |tau: f64| {
        let (mut sum, mut power) = (0.0, tau);
        for j in 1..40 {
            power *= -tau * tau;
            sum -= 2.0 * power / ((2 * j - 1) * (2 * j + 1)) as f64;
        }
        sum
    };
    let mut matrix = [[0.0; MAX_DEGREE + 2]; MAX_DEGREE + 1];
    for (row, j) in matrix.iter_mut().zip(0..n) {
        let s = -(j as f64 * std::f64::consts::PI / degree as f64).cos();
        let t = 0.5 * (1.0 + s);
        for i in 0..n {
            row[i] = crate::polynomial::binomial(degree, i)
                * t.powi(i as i32)
                * (1.0 - t).powi((degree - i) as i32);
        }
        row[n] = rest(top * s);
    }
    let rest = solve(&mut matrix, n);
    // `weight` is a Bernstein coefficient of ω, a parabola raised to the degree.
    let (cosine, d) = ((0.5 * theta).cos(), degree as f64);
    std::array::from_fn(|i| {
        if i > degree {
            return 0.0;
        }
        let i_ = i as f64;
        let both = d * (d - 1.0);
        let weight = ((d - i_) * (d - i_ - 1.0) + 2.0 * cosine * i_ * (d - i_) + i_ * (i_ - 1.0)) / both;
        let line = top * (2.0 * i_ / d - 1.0);
        0.5 + 2.0 / theta * (line + rest[i]) / ((1.0 + top * top) * weight)
    })
}

/// Gaussian elimination with row exchanges; the right side is column n.
fn solve(matrix: &mut [[f64; MAX_DEGREE + 2]], n: usize) -> [f64; MAX_DEGREE + 1] {
    for column in 0..n {
        let size = |row: &usize| matrix[*row][column].abs();
        let pivot = (column..n).max_by(|a, b| size(a).total_cmp(&size(b))).expect("a row");
        matrix.swap(column, pivot);
        for row in column + 1..n {
            let factor = matrix[row][column] / matrix[column][column];
            for k in column..=n {
                matrix[row][k] -= factor * matrix[column][k];
            }
        }
    }
    let mut x = [0.0; MAX_DEGREE + 1];
    for row in (0..n).rev() {
        let known: f64 = (row + 1..n).map(|k| matrix[row][k] * x[k]).sum();
        x[row] = (matrix[row][n] - known) / matrix[row][row];
    }
    x
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::quadratic::{norm, sub};
    use crate::spline::bezier::derivatives;
    use crate::spline::length::CurveLength;
    use crate::watch::Watch;

    /// The greatest jump of C' from one piece to the next, as a part of |C'|; infinite where their ends are apart.
    fn worst_jump<const M: usize>(curve: &CompositeCurve<M>) -> f64 {
        let jump = |i: usize| {
            let before = curve.piece(i);
            let [end, from, ..] = derivatives(&before, before.width);
            let [start, to, ..] = derivatives(&curve.piece(i + 1), 0.0);
            if end == start {
                norm(&sub(&from, &to)) / norm(&from)
            } else {
                f64::INFINITY
            }
        };
        (1..curve.len()).map(|i| jump(i - 1)).fold(0.0, f64::max)
    }

    #[test]
    fn a_full_circle_is_four_quarters_with_exact_corners() {
        let turn = Turn { start: [3.0, 1.0], plane: [0, 1], centre: [1.0, 1.0], sweep: TAU };
        let curve = turn.arc();
        assert_eq!(curve.len(), 4);
        let square = [[3.0, 1.0], [3.0, 3.0], [1.0, 3.0], [1.0, 3.0], [-1.0, 3.0], [-1.0, 1.0]];
        assert_eq!(curve.control[..6], square);
        assert_eq!(curve.control[11], [3.0, 1.0]);
        let length = CurveLength::new(&curve, 1e-14, Watch::default());
        assert!((length.total() - 2.0 * TAU).abs() < 4e-15);
    }

    #[test]
    fn every_arc_keeps_its_radius_its_end_and_its_smoothness() {
        for sweep in [1e-6, 0.3, 1.0, FRAC_PI_2, 2.0, 3.0, -0.5, -4.0, -TAU, 11.0] {
            let turn = Turn { start: [3.0, 7.0, 5.0], plane: [2, 0], centre: [2.0, -1.0], sweep };
            let curve = turn.arc();
            assert!(curve.width.iter().all(|width| *width <= 5.0 * (FRAC_PI_2 + 1e-12)));
            for (i, piece) in curve.pieces().enumerate() {
                for j in 0..=8 {
                    let share = j as f64 / 8.0;
                    let [c, v, ..] = derivatives(&piece, share * piece.width);
                    assert!(((c[2] - 2.0).hypot(c[0] + 1.0) - 5.0).abs() < 4e-15 && c[1] == 7.0);
                    assert!(((c[2] - 2.0) * v[0] - (c[0] + 1.0) * v[2]) * sweep > 0.0, "{sweep} {i}");
                }
            }
            assert!(worst_jump(&curve) < 1e-14);
            let end = curve.control[curve.control.len() - 1];
            let angle = 4f64.atan2(3.0) + sweep;
            assert!((end[2] - 2.0 - 5.0 * angle.cos()).abs() < 1e-14);
            assert!((end[0] + 1.0 - 5.0 * angle.sin()).abs() < 1e-14);
        }
    }

    #[test]
    fn a_helix_is_on_its_cylinder_and_within_its_bound() {
        for (degree, sweep, rise, tolerance) in [
            (3, 7.0, 5.0, 1e-3),
            (5, TAU, 10.0, 1e-9),
            (7, -9.0, 10.0, 1e-9),
            (9, 20.0, 40.0, 1e-9),
            (9, 0.4, 1.0, 1e-6),
        ] {
            let turn = Turn { start: [5.0, 0.0, 1.0], plane: [0, 1], centre: [0.0, 0.0], sweep };
            let (curve, bound) = turn.helix(&[0.0, 0.0, rise], degree, tolerance).unwrap();
            assert!(bound <= tolerance);
            let (mut worst, mut angle, mut before): (f64, f64, f64) = (0.0, 0.0, 0.0);
            for piece in curve.pieces() {
                for j in 0..=50 {
                    let [x, y, z] = derivatives(&piece, j as f64 / 50.0 * piece.width)[0];
                    assert!((x.hypot(y) - 5.0).abs() < 4e-15);
                    let now = y.atan2(x);
                    angle += (now - before + TAU / 2.0).rem_euclid(TAU) - TAU / 2.0;
                    before = now;
                    worst = worst.max((z - 1.0 - rise * angle / sweep).abs());
                }
            }
            let rounding = 1e-13;
            assert!(worst <= bound + rounding, "degree {degree}: {worst:e}, bound {bound:e}");
            // The bound is not idle: the true error is within a small factor of it.
            assert!(worst + rounding > 0.2 * bound, "degree {degree}: {worst:e}, bound {bound:e}");
            assert!(worst_jump(&curve) < 1e-12);
            let length = CurveLength::new(&curve, 1e-13, Watch::default()).total();
            assert!((length - (5.0 * sweep).hypot(rise)).abs() < 1e-9 + tolerance);
        }
    }

    #[test]
    fn a_helix_that_no_number_of_pieces_meets_is_refused() {
        let turn = Turn { start: [5.0, 0.0, 1.0], plane: [0, 1], centre: [0.0, 0.0], sweep: 1e3 };
        let error = turn.helix(&[0.0, 0.0, 1e3], 3, 1e-30).unwrap_err();
        assert!(error.to_string().starts_with("a helix within"));
    }
}
