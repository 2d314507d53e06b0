//! A B-spline or NURBS curve from control points, knots and weights as users give them: checked, and unrolled
//! if it is periodic.
//!
//! n control points of degree d have knots t₀ … t_{n+d}; the curve is on [t_d, t_n]. Knots may be clamped or not.

use super::error::{SplineError, MAX_COORDINATE, MAX_WEIGHT, MIN_WEIGHT};
use super::MAX_DEGREE;
use crate::tolerance::KNOT_SPAN;

/// A checked spline curve; `weights` is empty if it is polynomial.
#[derive(Clone, Debug, PartialEq)]
pub struct Spline<const M: usize> {
    pub degree: usize,
    pub knots: Vec<f64>,
    pub control: Vec<[f64; M]>,
    pub weights: Vec<f64>,
}

impl<const M: usize> Spline<M> {
    pub fn new(
        degree: usize,
        knots: Vec<f64>,
        control: Vec<[f64; M]>,
        weights: Vec<f64>,
    ) -> Result<Self, SplineError> {
        check_points(degree, &control, &weights)?;
        if knots.len() != control.len() + degree + 1 {
            return Err(SplineError::KnotCount { knots: knots.len(), points: control.len(), degree });
        }
        check_knots(degree, &knots)?;
        let (first, last) = (degree, control.len());
        if knots[first] == knots[last] {
            return Err(SplineError::EmptyDomain { first, last, value: knots[first] });
        }
        Ok(Self { degree, knots, control, weights })
    }

    /// A closed curve by n control points and the n + 1 knots of one period. The first span has the first d + 1 points, each
    /// later span those that begin one later, cyclically.
    pub fn periodic(
        degree: usize,
        knots: Vec<f64>,
        mut control: Vec<[f64; M]>,
        mut weights: Vec<f64>,
    ) -> Result<Self, SplineError> {
        let n = control.len();
        if !(1..=MAX_DEGREE).contains(&degree) {
            return Err(SplineError::Degree { degree });
        }
        if n < 2 {
            return Err(SplineError::TooFewPoints { points: n, degree: 1 });
        }
        if !weights.is_empty() && weights.len() != n {
            return Err(SplineError::WeightCount { weights: weights.len(), points: n });
        }
        if knots.len() != n + 1 {
            return Err(SplineError::PeriodCount { knots: knots.len(), points: n });
        }
        check_knots(degree, &knots)?;
        let period = knots[n] - knots[0];
        if period == 0.0 {
            return Err(SplineError::EmptyDomain { first: 0, last: n, value: knots[0] });
        }
        let unrolled = (0..n + 2 * degree + 1)
            .map(|i| {
                let place = i as isize - degree as isize;
                let turn = place.div_euclid(n as isize);
                let within = knots[place.rem_euclid(n as isize) as usize];
                // The end of the period is the given number exactly.
                if place == n as isize {
                    knots[n]
                } else {
                    within + turn as f64 * period
                }
            })
            .collect();
        for i in 0..degree {
            control.push(control[i % n]);
            if !weights.is_empty() {
                weights.push(weights[i % n]);
            }
        }
        Self::new(degree, unrolled, control, weights)
    }
}

/// Degree, coordinates and weights of control points.
pub fn check_points<const M: usize>(
    degree: usize,
    control: &[[f64; M]],
    weights: &[f64],
) -> Result<(), SplineError> {
    if !(1..=MAX_DEGREE).contains(&degree) {
        return Err(SplineError::Degree { degree });
    }
    if control.len() <= degree {
        return Err(SplineError::TooFewPoints { points: control.len(), degree });
    }
    for (point, coordinates) in control.iter().enumerate() {
        for (axis, &value) in coordinates.iter().enumerate() {
            if value.is_nan() || value.abs() > MAX_COORDINATE {
                return Err(SplineError::Coordinate { point, axis, value });
            }
        }
    }
    if !weights.is_empty() && weights.len() != control.len() {
        return Err(SplineError::WeightCount { weights: weights.len(), points: control.len() });
    }
    match weights.iter().position(|weight| !(MIN_WEIGHT..=MAX_WEIGHT).contains(weight)) {
        Some(index) => Err(SplineError::Weight { index, value: weights[index] }),
        None => Ok(()),
    }
}

fn check_knots(degree: usize, knots: &[f64]) -> Result<(), SplineError> {
    if let Some(knot) = knots.iter().position(|knot| !knot.is_finite()) {
        return Err(SplineError::KnotNotFinite { knot, value: knots[knot] });
    }
    let least = KNOT_SPAN * knots.iter().fold(0.0, |most: f64, knot| most.max(knot.abs()));
    let mut count = 1;
    for knot in 1..knots.len() {
        let (before, value) = (knots[knot - 1], knots[knot]);
        if value < before {
            return Err(SplineError::Decreasing { knot, before, value });
        }
        if value > before && value - before < least {
            return Err(SplineError::KnotsTooClose { knot, gap: value - before, least });
        }
        count = if value == before { count + 1 } else { 1 };
        if count > degree + 1 {
            let first = knot + 1 - count;
            let count = knots.iter().filter(|&&other| other == value).count();
            return Err(SplineError::Multiplicity { knot: first, value, count, degree });
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_periodic_curve_is_unrolled_by_its_degree() {
        let square = vec![[0.0], [1.0], [2.0], [1.0]];
        let spline = Spline::periodic(2, vec![0.0, 1.0, 2.0, 3.0, 5.0], square, vec![]).unwrap();
        assert_eq!(spline.knots, [-3.0, -2.0, 0.0, 1.0, 2.0, 3.0, 5.0, 6.0, 7.0]);
        assert_eq!(spline.control, [[0.0], [1.0], [2.0], [1.0], [0.0], [1.0]]);
    }

    #[test]
    fn what_is_wrong_is_said_with_its_place() {
        let new = |degree, knots: &[f64], points: usize, weights: &[f64]| {
            let control = (0..points).map(|i| [i as f64]).collect();
            Spline::new(degree, knots.to_vec(), control, weights.to_vec()).unwrap_err().to_string()
        };
        assert_eq!(
            new(2, &[0.0, 0.0, 0.0, 2.0, 1.0, 3.0, 3.0], 4, &[]),
            "knot 4 is 1 after 2: knots must not decrease; correct their order"
        );
        assert_eq!(
            new(2, &[0.0, 0.0, 1.0, 1.0], 3, &[]),
            "4 knots for 3 control points of degree 2: 6 are needed; repeat the first and the last one, which \
             this notation leaves out"
        );
        assert!(new(1, &[0.0, 1.0, 1.0, 1.0, 2.0], 3, &[])
            .starts_with("the knot 1 stands 3 times from knot 1 on"));
        assert!(new(1, &[0.0, 0.0, 1.0, 1.0], 2, &[1.0, -1.0]).starts_with("weight 1 is -1:"));
        assert!(new(1, &[0.0, f64::NAN, 1.0, 1.0], 2, &[]).starts_with("knot 1 is NaN:"));
        assert!(new(12, &[], 20, &[]).starts_with("the degree is 12: degrees 1 to 9"));
        assert!(new(1, &[0.0, 1.0, 1.0 + 1e-15, 2.0], 2, &[]).starts_with("knots 1 and 2 are 1.1"));
        assert!(new(2, &[0.0, 1.0, 1.0, 1.0, 2.0, 3.0], 3, &[]).starts_with("knots 2 and 3,"));
    }
}
