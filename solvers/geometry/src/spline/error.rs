//! The errors of a spline that a user gives, each with one sentence: place, value, limit and remedy.

use std::fmt;

use super::MAX_DEGREE;

/// Greatest coordinate in mm, far beyond any machine: the square of a hodograph must not overflow.
pub const MAX_COORDINATE: f64 = 1e60;
/// Greatest and least weight: fourth powers must not overflow.
pub const MAX_WEIGHT: f64 = 1e30;
pub const MIN_WEIGHT: f64 = 1e-30;

/// Why a spline cannot be used.
#[derive(Clone, Debug, PartialEq)]
pub enum SplineError {
    Degree { degree: usize },
    TooFewPoints { points: usize, degree: usize },
    KnotCount { knots: usize, points: usize, degree: usize },
    PeriodCount { knots: usize, points: usize },
    WeightCount { weights: usize, points: usize },
    Coordinate { point: usize, axis: usize, value: f64 },
    KnotNotFinite { knot: usize, value: f64 },
    Decreasing { knot: usize, before: f64, value: f64 },
    Multiplicity { knot: usize, value: f64, count: usize, degree: usize },
    KnotsTooClose { knot: usize, gap: f64, least: f64 },
    EmptyDomain { first: usize, last: usize, value: f64 },
    Broken { knot: usize, value: f64, gap: f64, degree: usize },
    Weight { index: usize, value: f64 },
}

impl std::error::Error for SplineError {}

impl fmt::Display for SplineError {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match *self {
            Self::Degree { degree } => {
                write!(f, "the degree is {degree}: degrees 1 to {MAX_DEGREE} are supported; convert the curve")
            }
            Self::TooFewPoints { points, degree } => write!(
                f,
                "{points} control points for degree {degree}: at least {} are needed; add points or lower the degree",
                degree + 1
            ),
            Self::KnotCount { knots, points, degree } => {
                let needed = points + degree + 1;
                write!(
                    f,
                    "{knots} knots for {points} control points of degree {degree}: {needed} are needed{}",
                    if knots + 2 == needed {
                        "; repeat the first and the last one, which this notation leaves out"
                    } else {
                        " (points + degree + 1); correct the lists"
                    }
                )
            }
            Self::PeriodCount { knots, points } => write!(
                f,
                "{knots} knots for {points} control points of a periodic curve: {} (points + 1), one period with \
                 both ends, are needed; correct the lists",
                points + 1
            ),
            Self::WeightCount { weights, points } => {
                write!(f, "{weights} weights for {points} control points: give one weight for each")
            }
            Self::Coordinate { point, axis, value } => write!(
                f,
                "control point {point}, axis {axis}, is {value}: coordinates must be finite and below \
                 {MAX_COORDINATE:e} mm; correct it"
            ),
            Self::KnotNotFinite { knot, value } => {
                write!(f, "knot {knot} is {value}: knots must be finite numbers; correct it")
            }
            Self::Decreasing { knot, before, value } => {
                write!(f, "knot {knot} is {value} after {before}: knots must not decrease; correct their order")
            }
            Self::Multiplicity { knot, value, count, degree } => write!(
                f,
                "the knot {value} stands {count} times from knot {knot} on: at most {} (degree + 1) are possible; \
                 remove the others and their control points",
                degree + 1
            ),
            Self::KnotsTooClose { knot, gap, least } => write!(
                f,
                "knots {} and {knot} are {gap:e} apart, where rounding begins at {least:e}: make them equal or \
                 move them apart",
                knot - 1
            ),
            Self::EmptyDomain { first, last, value } => write!(
                f,
                "knots {first} and {last}, where the curve starts and ends, are both {value}: the knots between \
                 them must grow"
            ),
            Self::Broken { knot, value, gap, degree } => write!(
                f,
                "the curve has a gap of {gap} mm at the knot {value} (knot {knot}), which stands {} times: at \
                 most {degree} times keep it together; give it as two curves",
                degree + 1
            ),
            Self::Weight { index, value } => write!(
                f,
                "weight {index} is {value}: weights must be positive, from {MIN_WEIGHT:e} to {MAX_WEIGHT:e}; \
                 correct it or scale all by one factor"
            ),
        }
    }
}
