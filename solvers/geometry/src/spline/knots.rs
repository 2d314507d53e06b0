//! Checks a B-spline or NURBS curve given by users as control points, knots and weights, and unrolls it if it is periodic. Each
//! error is one sentence with place, value, limit and remedy.
//!
//! n control points of degree d have knots t₀ … t_{n+d}; the curve is on [t_d, t_n]. Knots may be clamped or not.

use super::MAX_DEGREE;
use crate::tolerance::KNOT_SPAN;

/// The greatest coordinate in mm, far beyond any machine: the square of a hodograph must not overflow.
const MAX_COORDINATE: f64 = 1e60;
/// The greatest and least weight: fourth powers must not overflow.
const MAX_WEIGHT: f64 = 1e30;
const MIN_WEIGHT: f64 = 1e-30;

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
    ) -> Result<Self, String> {
        check_points(degree, &control, &weights)?;
        let (count, points, needed) = (knots.len(), control.len(), control.len() + degree + 1);
        if count != needed {
            let remedy = if count + 2 == needed {
                "; repeat the first and the last one, which this notation leaves out"
            } else {
                " (points + degree + 1); correct the lists"
            };
            return Err(format!(
                "{count} knots for {points} control points of degree {degree}: {needed} are needed{remedy}"
            ));
        }
        check_knots(degree, &knots)?;
        check_domain(&knots, degree, points)?;
        Ok(Self { degree, knots, control, weights })
    }

    /// A closed curve from n control points and the n + 1 knots of one period. The first span uses the first d + 1 points; each
    /// later span begins one point later, cyclically.
    pub fn periodic(
        degree: usize,
        knots: Vec<f64>,
        mut control: Vec<[f64; M]>,
        mut weights: Vec<f64>,
    ) -> Result<Self, String> {
        let n = control.len();
        check_degree(degree)?;
        check_points(1, &control, &weights)?;
        if knots.len() != n + 1 {
            return Err(format!(
                "{} knots for {n} control points of a periodic curve: {} (points + 1), one period with both ends, are \
                 needed; correct the lists",
                knots.len(),
                n + 1
            ));
        }
        check_knots(degree, &knots)?;
        check_domain(&knots, 0, n)?;
        let period = knots[n] - knots[0];
        let unrolled = (0..n + 2 * degree + 1)
            .map(|i| {
                let place = i as isize - degree as isize;
                let turn = place.div_euclid(n as isize);
                let within = knots[place.rem_euclid(n as isize) as usize];
                // The end of the period is exactly the given number.
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

fn check_degree(degree: usize) -> Result<(), String> {
    if !(1..=MAX_DEGREE).contains(&degree) {
        return Err(format!(
            "the degree is {degree}: degrees 1 to {MAX_DEGREE} are supported; convert the curve"
        ));
    }
    Ok(())
}

/// Checks the degree, the coordinates and the weights of control points.
pub fn check_points<const M: usize>(
    degree: usize,
    control: &[[f64; M]],
    weights: &[f64],
) -> Result<(), String> {
    check_degree(degree)?;
    let (points, least) = (control.len(), degree + 1);
    if points < least {
        return Err(format!(
            "{points} control points for degree {degree}: at least {least} are needed; add points or lower the degree"
        ));
    }
    for (point, coordinates) in control.iter().enumerate() {
        for (axis, &value) in coordinates.iter().enumerate() {
            if value.is_nan() || value.abs() > MAX_COORDINATE {
                return Err(format!(
                    "control point {point}, axis {axis}, is {value}: coordinates must be finite and below \
                     {MAX_COORDINATE:e} mm; correct it"
                ));
            }
        }
    }
    if !weights.is_empty() && weights.len() != points {
        return Err(format!(
            "{} weights for {points} control points: give one weight for each",
            weights.len()
        ));
    }
    match weights.iter().position(|weight| !(MIN_WEIGHT..=MAX_WEIGHT).contains(weight)) {
        Some(index) => Err(format!(
            "weight {index} is {}: weights must be positive, from {MIN_WEIGHT:e} to {MAX_WEIGHT:e}; correct it or scale \
             all by one factor",
            weights[index]
        )),
        None => Ok(()),
    }
}

fn check_knots(degree: usize, knots: &[f64]) -> Result<(), String> {
    if let Some(knot) = knots.iter().position(|knot| !knot.is_finite()) {
        return Err(format!("knot {knot} is {}: knots must be finite numbers; correct it", knots[knot]));
    }
    let least = KNOT_SPAN * knots.iter().fold(0.0, |most: f64, knot| most.max(knot.abs()));
    let mut count = 1;
    for knot in 1..knots.len() {
        let (before, value) = (knots[knot - 1], knots[knot]);
        let gap = value - before;
        if value < before {
            return Err(format!(
                "knot {knot} is {value} after {before}: knots must not decrease; correct their order"
            ));
        }
        if value > before && gap < least {
            return Err(format!(
                "knots {} and {knot} are {gap:e} apart, where rounding begins at {least:e}: make them equal or move them \
                 apart",
                knot - 1
            ));
        }
        count = if value == before { count + 1 } else { 1 };
        if count > degree + 1 {
            return Err(format!(
                "the knot {value} stands {} times from knot {} on: at most {} (degree + 1) are possible; remove the \
                 others and their control points",
                knots.iter().filter(|&&other| other == value).count(),
                knot + 1 - count,
                degree + 1
            ));
        }
    }
    Ok(())
}

/// Refuses an empty domain between the knots `first` and `last`.
fn check_domain(knots: &[f64], first: usize, last: usize) -> Result<(), String> {
    if knots[first] == knots[last] {
        return Err(format!(
            "knots {first} and {last}, where the curve starts and ends, are both {}: the knots between them must grow",
            knots[first]
        ));
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
            Spline::new(degree, knots.to_vec(), control, weights.to_vec()).unwrap_err()
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
