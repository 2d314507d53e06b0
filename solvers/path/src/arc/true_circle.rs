//! An arc as a true circle in conic pieces of at most 90°, a helix on the cylinder of such a circle.
//!
//! Start and end of a programmed arc are rounded, so their distances from the centre c differ a little, and the arc is a
//! spiral S(x) of radius r₀ + xΔ, x in [0, 1]. It is replaced by the circle through both ends whose centre c + d is
//! nearest to c. With ψ the angle from d to S − c, and R the radius of the circle,
//!
//! ```text
//! |S − c − d| − R = g + ε,   g = r₀ + xΔ − |d| cos ψ − R,   0 ≤ ε ≤ |d|²/(2 (r − |d|))
//! ```
//!
//! and the greatest |g| is at an end or where sin ψ = −Δ/(|d| dψ/dx). This bounds the distance both ways, since both
//! curves share their ends and the angle about c + d grows all along.
//!
//! An axis that is linear in the angle is linear in the parameter of the piece instead; `circle::Turn` bounds the
//! difference. The angles about c and about c + d differ by asin(|d|/r) at most, and so do they at the ends.

use std::f64::consts::{PI, TAU};

use super::polar::{sweep_to, Arc, Polar, MAX_PIECES};
use crate::tolerance;
use feedplan_geometry::conic::Conic;
use feedplan_geometry::quadratic::{dot, lerp, norm, sub};
use feedplan_geometry::spline::circle::Turn;

/// The circle with the centre c + d.
struct Circle {
    shift: [f64; 2],
    sweep: f64,
    /// Bound of the distance from the programmed arc in the plane.
    radial: f64,
    /// Bound of the difference of the angles about both centres, each as a fraction of its sweep, in rad.
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
        // The second condition holds if the angle about the new centre grows all along.
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
}

/// The pieces of the circle, and the bound of their distance from the arc; None if that exceeds `tolerance` or takes
/// too many pieces.
pub fn pieces<const M: usize>(arc: &Arc<M>, polar: &Polar, tolerance: f64) -> Option<(Vec<Conic<M>>, f64)> {
    let circle = Circle::new(arc, polar)?;
    let centre = [arc.centre[0] + circle.shift[0], arc.centre[1] + circle.shift[1]];
    let turn = Turn { start: arc.start, plane: arc.plane, centre, sweep: circle.sweep };
    let large = polar.radius.max(polar.radius + polar.growth * polar.sweep.abs());
    // An error of the angle shows along the other axes or along the circle, whichever is less.
    let per_angle = polar.pitch.min(large);
    let least = circle.radial + circle.angular * per_angle;
    let rise = turn.sweep.abs() * per_angle;
    let mut count = turn.quarters();
    let mut error = turn.axial_error(rise, 2, count);
    if least > tolerance {
        return None;
    }
    while least + error > tolerance && count <= MAX_PIECES {
        // The error is proportional to the cube of the sweep of a piece.
        count = (0.99 * count * (error / (tolerance - least)).cbrt()).ceil().max(count + 1.0);
        error = turn.axial_error(rise, 2, count);
    }
    (count <= MAX_PIECES).then(|| (conics(arc, &turn, count), least + error))
}

/// The turn in `count` equal pieces, the other axes in proportion to the angle.
fn conics<const M: usize>(arc: &Arc<M>, turn: &Turn<M>, count: f64) -> Vec<Conic<M>> {
    let [x, y] = arc.plane;
    let curve = turn.pieces(count);
    let theta = turn.sweep / count;
    let (weight, bulge) = ((0.5 * theta).cos(), 0.5 * (0.5 * theta).tan());
    let last = count as usize - 1;
    let mut start = arc.start;
    (0..=last)
        .map(|i| {
            let mut end = arc.end;
            if i < last {
                end = lerp(&arc.start, &arc.end, (i + 1) as f64 / count);
                let joint = &curve.control[3 * i + 2];
                (end[x], end[y]) = (joint[x], joint[y]);
            }
            // The point where the tangents meet, computed from the chord: so a small piece of a great circle is
            // symmetric too.
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
