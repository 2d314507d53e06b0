//! An arc or a helix whose radius is linear in the angle, as tangent-continuous quadratic pieces within a tolerance.
//!
//! The pieces are one uniform quadratic B-spline. With n pieces of half angle α, control point i is at the radius r/cos α in the
//! middle of its piece, and pieces meet half way between control points. On a circle they meet on the circle, where the control
//! polygon touches it. Quantities that are linear in the angle (the axis of a helix, further axes) stay exactly linear in the
//! parameter.
//!
//! With b = sin²α/(2 cos α) and s from −1 to 1 along a piece, a unit circle becomes a curve of
//! - radius √(1 + b²(1 − s²)²), never inside the circle and at most α⁴/8 outside, and
//! - polar angle αs − (α³/6)(s − s³) + …, which matters on a helix: the axis and the angle do not advance in proportion.
//!
//! Errors on both sides of the circle would save a sixth of the pieces, but the end points would not be exact.

use super::polar::{Arc, ArcError, Polar, MAX_PIECES};
use feedplan_geometry::conic::Conic;
use std::f64::consts::PI;

/// Greatest half angle of a piece in rad. The curvature of a piece is between cos²α/r and 1/(r cos α), so a piece is slower than
/// the arc by at most 8 %.
const MAX_HALF_ANGLE: f64 = PI / 8.0;
/// The polar angle of a piece differs from one linear in the parameter by at most this times α³ (0.0704 at MAX_HALF_ANGLE, and
/// 1/(9√3) in the limit of small angles).
const ANGLE_ERROR: f64 = 0.0715;

/// An upper bound of the distance between the arc and pieces of half angle α, both ways, in mm: the radial error, and on a helix
/// the error of the angle, measured at equal angle or at equal height, whichever is smaller.
fn deviation(polar: &Polar, alpha: f64) -> f64 {
    let large = polar.radius.max(polar.radius + polar.growth * polar.sweep.abs());
    let small = polar.radius.min(polar.radius + polar.growth * polar.sweep.abs());
    let (sin, cos) = alpha.sin_cos();
    let b = sin * sin / (2.0 * cos);
    let circle = large * b * b / (1.0 + (1.0 + b * b).sqrt());
    // A changing radius shears the piece: across the arc by less than 0.4 α³ of the growth; along the arc, to a place of another
    // radius, by less than 1.5 α² of it.
    let growth = polar.growth.abs();
    let along = 1.5 * growth * alpha * alpha / small;
    let radial = circle + growth * (0.4 * alpha.powi(3) + along);
    let angle = ANGLE_ERROR * alpha.powi(3) + along;
    radial.hypot(angle * polar.pitch.min(large))
}

/// The least number of pieces within `tolerance`.
fn count(polar: &Polar, tolerance: f64) -> Result<usize, ArcError> {
    let half = 0.5 * polar.sweep.abs();
    let fits = |count: f64| deviation(polar, half / count) <= tolerance;
    let mut enough = (half / MAX_HALF_ANGLE * (1.0 - 1e-12)).ceil().max(1.0);
    let mut short = enough - 1.0;
    while enough <= MAX_PIECES && !fits(enough) {
        short = enough;
        enough *= 2.0;
    }
    while enough - short > 1.0 && short < MAX_PIECES {
        let middle = (0.5 * (short + enough)).floor();
        if fits(middle) {
            enough = middle;
        } else {
            short = middle;
        }
    }
    if enough <= MAX_PIECES {
        Ok(enough as usize)
    } else {
        Err(ArcError::Turns)
    }
}

/// The arc as quadratic pieces of equal width, and an upper bound of the distance between arc and pieces, both ways, in mm, at
/// most `tolerance` > 0. Start and end are met exactly.
pub fn pieces<const M: usize>(
    arc: &Arc<M>,
    polar: &Polar,
    tolerance: f64,
) -> Result<(Vec<Conic<M>>, f64), ArcError> {
    let n = count(polar, tolerance)?;
    let alpha = polar.sweep.abs() / (2.0 * n as f64);
    let Polar { radius, growth, sweep, direction: [e0, e1], .. } = *polar;
    let [x, y] = arc.plane;
    let control = |i: usize| {
        let share = (i as f64 + 0.5) / n as f64;
        let (sin, cos) = (share * sweep).sin_cos();
        let r = (radius + growth * share * sweep.abs()) / alpha.cos();
        let mut point = std::array::from_fn(|k| arc.start[k] + share * (arc.end[k] - arc.start[k]));
        point[x] = arc.centre[0] + r * (cos * e0 - sin * e1);
        point[y] = arc.centre[1] + r * (sin * e0 + cos * e1);
        point
    };
    let mean_radius = radius + 0.5 * growth * sweep.abs();
    let width = 2.0 * alpha * mean_radius.hypot(polar.pitch);

    let mut pieces = Vec::with_capacity(n);
    let (mut joint, mut middle) = (arc.start, control(0));
    for i in 1..=n {
        let (next, end) = if i < n {
            let next = control(i);
            (next, std::array::from_fn(|k| 0.5 * (middle[k] + next[k])))
        } else {
            (middle, arc.end)
        };
        pieces.push(Conic { control: [joint, middle, end], weight: 1.0, width });
        (joint, middle) = (end, next);
    }
    Ok((pieces, deviation(polar, alpha)))
}
