//! An arc as a true circle in conic pieces of at most 90°, and a helix on the cylinder of such a circle.
//!
//! Start and end of a programmed arc are rounded, so their distances from the centre c differ a little, and the arc is a
//! spiral S(x) of radius r₀ + xΔ, x in [0, 1]. It is replaced by the circle through both ends whose centre c + d is
//! nearest to c. With ψ the angle from d to S − c, and R the radius of the circle,
//!
//! ```text
//! |S − c − d| − R = g + ε,   g = r₀ + xΔ − |d| cos ψ − R,   0 ≤ ε ≤ |d|²/(2 (r − |d|))
//! ```
//!
//! and the greatest |g| is at an end or where sin ψ = −Δ/(|d| dψ/dx). This bounds the distance both ways, since both curves share
//! their ends and the angle about c + d grows monotonically.
//!
//! The angles about c and about c + d differ by at most asin(|d|/r), also at the ends.
//!
//! An axis that is linear in the angle becomes linear in the parameter of the piece instead. On a piece of sweep θ, with
//! τ = s tan(θ/4), s = 2t − 1, the angle from the middle is 2 atan τ, and the axis is Z/(1 + τ²) with the parabola Z that
//! interpolates f = (1 + τ²) atan τ at τ = 0 and ±T, T = tan(θ/4). With f''' = 4/(1 + τ²)², |Z − f| ≤ max|f'''|/3! · T³/2 ≤ T³/3.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use super::polar::{sweep_to, Arc, Polar, MAX_PIECES};
use crate::tolerance;
use feedplan_geometry::conic::Conic;
use feedplan_geometry::elementary::Elementary;
use feedplan_geometry::quadratic::{dot, lerp, norm, sub};

/// The circle with the centre c + d.
struct Circle {
    shift: [f64; 2],
    sweep: f64,
    /// Bound of the distance from the programmed arc within the plane, in mm.
    radial: f64,
    /// Bound of the difference between the angles about both centres, each as a fraction of its sweep, in rad.
    angular: f64,
}

impl Circle {
    fn new<const M: usize>(arc: &Arc<M>, polar: &Polar) -> Option<Self> {
        let [x, y] = arc.plane;
        let from = [arc.start[x] - arc.centre[0], arc.start[y] - arc.centre[1]];
        let to = [arc.end[x] - arc.centre[0], arc.end[y] - arc.centre[1]];
        let (start, end) = (norm(&from), norm(&to));
        let (change, least) = (end - start, start.min(end));
        let coordinate = arc.centre.iter().fold(start.max(end), |most, value| most.max(value.abs()));
        if change.abs() <= tolerance::COORDINATE * coordinate {
            let radial = 0.5 * change.abs();
            return Some(Self { shift: [0.0; 2], sweep: polar.sweep, radial, angular: 0.0 });
        }
        let chord = sub(&to, &from);
        let along = 0.5 * change * (start + end) / dot(&chord, &chord);
        let shift = chord.map(|value| value * along);
        let distance = norm(&shift);
        // The second condition ensures that the angle about the new centre grows monotonically.
        let near = distance <= tolerance::CENTRE * least
            && distance * change.abs() < polar.sweep.abs() * least * (least - distance);
        if !near {
            return None;
        }
        let spoke = sub(&from, &shift);
        let sweep = sweep_to(&spoke, &sub(&to, &shift), polar.sweep)?;
        let radius = norm(&spoke);
        // ψ at the start and at the end.
        let cross = shift[0] * from[1] - shift[1] * from[0];
        let first = cross.atan2(dot(&shift, &from));
        let last = first + polar.sweep;
        let g =
            |psi: f64| (start - radius + change * (psi - first) / polar.sweep - distance * psi.cos()).abs();
        let mut greatest = g(first).max(g(last));
        let sine = -change / (distance * polar.sweep);
        if sine.abs() < 1.0 {
            for root in [sine.asin(), PI - sine.asin()] {
                let (low, high) = (first.min(last), first.max(last));
                let nearest = root + TAU * ((low - root) / TAU).ceil();
                let farthest = root + TAU * ((high - root) / TAU).floor();
                if nearest <= high {
                    greatest = greatest.max(g(nearest)).max(g(farthest));
                }
            }
        }
        Some(Self {
            shift,
            sweep,
            radial: greatest + distance * distance / (2.0 * (least - distance)),
            angular: 4.0 * (distance / least).asin(),
        })
    }

    /// Bound of the distance along the axis, in mm, between `count` pieces and a helix that rises by `rise`.
    fn axial_error(&self, rise: f64, count: f64) -> f64 {
        let theta = self.sweep.abs() / count;
        rise / count * (2.0 / theta) * (1.0 / 3.0) * (0.25 * theta).tan().power(3.0)
    }
}

/// The pieces of the circle, and the bound of their distance from the arc in mm; None if that exceeds `tolerance` or needs too
/// many pieces.
pub fn pieces<const M: usize>(arc: &Arc<M>, polar: &Polar, tolerance: f64) -> Option<(Vec<Conic<M>>, f64)> {
    let circle = Circle::new(arc, polar)?;
    let large = polar.radius.max(polar.radius + polar.growth * polar.sweep.abs());
    // An error of the angle is an error along the other axes or along the circle, whichever is smaller.
    let per_angle = polar.pitch.min(large);
    let least = circle.radial + circle.angular * per_angle;
    let rise = circle.sweep.abs() * per_angle;
    let mut count = (circle.sweep.abs() / FRAC_PI_2 * (1.0 - tolerance::SAME_ANGLE)).ceil().max(1.0);
    let mut error = circle.axial_error(rise, count);
    if least > tolerance {
        return None;
    }
    while least + error > tolerance && count <= MAX_PIECES {
        // The error is proportional to the cube of the sweep of a piece.
        count = (0.99 * count * (error / (tolerance - least)).cbrt()).ceil().max(count + 1.0);
        error = circle.axial_error(rise, count);
    }
    (count <= MAX_PIECES).then(|| (conics(arc, &circle, count), least + error))
}

/// The circle in `count` equal pieces, the other axes in proportion to the angle.
fn conics<const M: usize>(arc: &Arc<M>, circle: &Circle, count: f64) -> Vec<Conic<M>> {
    let [x, y] = arc.plane;
    let centre = [arc.centre[0] + circle.shift[0], arc.centre[1] + circle.shift[1]];
    let radius = [arc.start[x] - centre[0], arc.start[y] - centre[1]];
    let theta = circle.sweep / count;
    let quarters = (theta.abs() - FRAC_PI_2).abs() <= tolerance::SAME_ANGLE;
    let joint = |i: usize| {
        let (sin, cos) = if quarters {
            let (sin, cos) = [(0.0, 1.0), (1.0, 0.0), (0.0, -1.0), (-1.0, 0.0)][i % 4];
            (sin * theta.signum(), cos)
        } else {
            // The rounding error of the product is added back, so that pieces after many turns have the same size.
            let angle = i as f64 * theta;
            let lost = (i as f64).mul_add(theta, -angle);
            let (sin, cos) = angle.sin_cos();
            (sin + lost * cos, cos - lost * sin)
        };
        let [u, v] = [radius[0] * cos - radius[1] * sin, radius[0] * sin + radius[1] * cos];
        (centre[0] + u, centre[1] + v)
    };
    let (weight, bulge) = ((0.5 * theta).cos(), 0.5 * (0.5 * theta).tan());
    let count = count as usize;
    let mut start = arc.start;
    (1..=count)
        .map(|i| {
            let mut end = arc.end;
            if i < count {
                end = lerp(&arc.start, &arc.end, i as f64 / count as f64);
                (end[x], end[y]) = joint(i);
            }
            // The point where the tangents meet, computed from the chord: a small piece of a large circle is then symmetric too.
            let chord = sub(&end, &start);
            let mut middle = lerp(&start, &end, 0.5);
            middle[x] += bulge * chord[y];
            middle[y] -= bulge * chord[x];
            let mut piece = Conic { control: [start, middle, end], weight, width: 1.0 };
            piece.width = piece.natural_width();
            start = end;
            piece
        })
        .collect()
}
