//! A rational quadratic Bézier piece in standard form: both end weights are 1, and the middle weight determines the conic.
//!
//! With weight 1 it is a polynomial. On a circle the weight is the cosine of half the angle, and |C'| is equal at both
//! ends: 1 if the width is `natural_width`, so that arcs, their parts and the lines next to them meet C1. A part of a conic
//! is a conic in standard form again.

use crate::quadratic::{lerp, norm, sub, Quadratic};

/// C(u) on u in [0, width], by its three control points in mm and its middle weight.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Conic<const M: usize> {
    pub control: [[f64; M]; 3],
    pub weight: f64,
    pub width: f64,
}

impl<const M: usize> From<Quadratic<M>> for Conic<M> {
    fn from(Quadratic { control, width }: Quadratic<M>) -> Self {
        Self { control, weight: 1.0, width }
    }
}

impl<const M: usize> Conic<M> {
    /// The straight piece from `a` to `b`, parametrised by its length.
    pub fn line(a: [f64; M], b: [f64; M]) -> Self {
        Quadratic::line(a, b).into()
    }

    /// Whether the piece is a line with constant C', as `line` makes it.
    pub fn is_line(&self) -> bool {
        self.weight == 1.0 && self.control[1] == lerp(&self.control[0], &self.control[2], 0.5)
    }

    /// |C'| times the width at both ends, in mm.
    pub fn end_speeds(&self) -> (f64, f64) {
        let ([a, b, c], factor) = (&self.control, 2.0 * self.weight);
        (factor * norm(&sub(b, a)), factor * norm(&sub(c, b)))
    }

    /// The width that makes the mean of |C'| at both ends 1.
    pub fn natural_width(&self) -> f64 {
        let (start, end) = self.end_speeds();
        0.5 * (start + end)
    }

    /// The part on [u0, u1]. A part of a line is again exactly a line, whatever the rounding of its middle point.
    pub fn part(&self, u0: f64, u1: f64) -> Self {
        if u0 == 0.0 && u1 == self.width {
            return *self;
        }
        if self.weight == 1.0 {
            let part = Quadratic { control: self.control, width: self.width }.part(u0, u1);
            return if self.is_line() { Self::line(part.control[0], part.control[2]) } else { part.into() };
        }
        // Blossoms in homogeneous coordinates, relative to the first point so that no digits are lost.
        let [a, b, c] = &self.control;
        let blossom = |s: f64, t: f64| {
            let (s, t) = (s / self.width, t / self.width);
            let (middle, last) = (self.weight * ((1.0 - s) * t + s * (1.0 - t)), s * t);
            let weight = (1.0 - s) * (1.0 - t) + middle + last;
            let point: [f64; M] =
                std::array::from_fn(|k| a[k] + (middle * (b[k] - a[k]) + last * (c[k] - a[k])) / weight);
            (point, weight)
        };
        let (first, first_weight) = if u0 == 0.0 { (*a, 1.0) } else { blossom(u0, u0) };
        let (last, last_weight) = if u1 == self.width { (*c, 1.0) } else { blossom(u1, u1) };
        let (middle, weight) = blossom(u0, u1);
        let mut part = Self {
            control: [first, middle, last],
            weight: weight / (first_weight * last_weight).sqrt(),
            width: 1.0,
        };
        part.width = part.natural_width();
        part
    }

    /// Least and greatest value of an axis.
    pub fn extent(&self, axis: usize) -> (f64, f64) {
        let [a, b, c] = self.control.map(|point| point[axis]);
        let (mut least, mut greatest) = (a.min(c), a.max(c));
        if b < least || b > greatest {
            // The numerator of the derivative has the Bernstein coefficients w (b − a), (c − a)/2, w (c − b); the outer two
            // differ in sign.
            let (p, q, r) = (self.weight * (b - a), 0.5 * (c - a), self.weight * (c - b));
            let root = (q * q - p * r).sqrt();
            let t = p / (p - q + root.copysign(p));
            let s = 1.0 - t;
            let weight = s * s + 2.0 * self.weight * s * t + t * t;
            let turn = a + (2.0 * self.weight * s * t * (b - a) + t * t * (c - a)) / weight;
            least = least.min(turn);
            greatest = greatest.max(turn);
        }
        (least, greatest)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::spline::bezier::derivatives;
    use crate::spline::Piece;
    use proptest::prelude::*;

    fn derivatives_of<const M: usize>(conic: &Conic<M>, u: f64) -> [[f64; M]; 4] {
        let weights = [1.0, conic.weight, 1.0];
        derivatives(&Piece { control: &conic.control, weights: &weights, width: conic.width }, u)
    }

    fn quarter() -> Conic<2> {
        let mut conic = Conic {
            control: [[3.0, 0.0], [3.0, 3.0], [0.0, 3.0]],
            weight: std::f64::consts::FRAC_1_SQRT_2,
            width: 1.0,
        };
        conic.width = conic.natural_width();
        conic
    }

    #[test]
    fn parts_of_a_circle_are_on_it_in_standard_form_with_speed_1_at_their_ends() {
        let whole = quarter();
        assert!((whole.width - 3.0 * 2f64.sqrt()).abs() < 1e-15, "the chord");
        for (from, to) in [(0.0, 0.5), (0.3, 0.7), (0.9, 1.0), (0.5, 0.5 + 1e-6), (0.0, 1.0)] {
            let part = whole.part(from * whole.width, to * whole.width);
            for i in 0..=10 {
                let [point, ..] = derivatives_of(&part, 0.1 * i as f64 * part.width);
                assert!((norm(&point) - 3.0).abs() < 2e-15, "{from} {to}: {}", norm(&point) - 3.0);
            }
            let angle = |point: &[f64; 2]| point[1].atan2(point[0]);
            let half = 0.5 * (angle(&part.control[2]) - angle(&part.control[0]));
            assert!((part.weight - half.cos()).abs() < 4e-16);
            for u in [0.0, part.width] {
                assert!((norm(&derivatives_of(&part, u)[1]) - 1.0).abs() < 1e-9);
            }
        }
    }

    #[test]
    fn parts_of_a_line_are_lines_that_meet() {
        let line = Conic::line([0.0, 0.0], [3.0, 4.0]);
        assert_eq!(line.part(0.0, 5.0), line);
        let (a, b) = (line.part(0.0, 1.3), line.part(1.3, 5.0));
        assert_eq!(a.control[2], b.control[0]);
        assert!(a.is_line() && b.is_line() && (a.width + b.width - 5.0).abs() < 1e-15);
    }

    proptest! {
        #[test]
        fn a_part_draws_the_same_curve_and_keeps_to_its_extent(
            control in prop::array::uniform3(prop::array::uniform2(-5.0..5.0f64)),
            weight in 0.1..4.0f64,
            from in 0.0..0.5f64,
            to in 0.5..1.0f64,
        ) {
            let whole = Conic { control, weight, width: 1.0 };
            let part = whole.part(from, to);
            let at = |conic: &Conic<2>, t: f64| derivatives_of(conic, t * conic.width)[0];
            prop_assert!(norm(&sub(&part.control[0], &at(&whole, from))) < 1e-12);
            prop_assert!(norm(&sub(&part.control[2], &at(&whole, to))) < 1e-12);
            // The parameter of the part is a ratio of linear functions of the whole's; its middle is where both weights balance.
            let weights = |t: f64| (1.0 - t).powi(2) + 2.0 * weight * t * (1.0 - t) + t * t;
            let (w0, w1) = (weights(from).sqrt(), weights(to).sqrt());
            let middle = (from * w1 + to * w0) / (w0 + w1);
            prop_assert!(norm(&sub(&at(&part, 0.5), &at(&whole, middle))) < 1e-11);
            for axis in 0..2 {
                let (least, greatest) = whole.extent(axis);
                let values: Vec<f64> = (0..=1000).map(|i| at(&whole, 0.001 * i as f64)[axis]).collect();
                let low = values.iter().fold(f64::INFINITY, |a, &b| a.min(b));
                let high = values.iter().fold(f64::NEG_INFINITY, |a, &b| a.max(b));
                prop_assert!(least <= low + 1e-12 && low < least + 1e-3);
                prop_assert!(greatest >= high - 1e-12 && high > greatest - 1e-3);
            }
        }
    }
}
