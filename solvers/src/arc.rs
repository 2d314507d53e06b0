//! Circular arcs, helices and spirals as tangent-continuous quadratic pieces within a tolerance.
//!
//! The pieces are one uniform quadratic B-spline: with n pieces of half angle α, control point i stands at
//! radius r/cos α in the middle of its piece, and pieces join half way between control points. On a circle
//! those joints lie on it and the control polygon touches it there. Everything that is linear in the angle
//! (the axis of a helix, further axes) stays exactly linear in the parameter.
//!
//! With b = sin²α/(2 cos α) and s from −1 to 1 along a piece, a unit circle becomes a curve of
//! - radius √(1 + b²(1 − s²)²), never inside the circle and at most α⁴/8 outside, and
//! - polar angle αs − (α³/6)(s − s³) + …, which matters on a helix: the axis runs ahead of the angle.
//!
//! Splitting the error to both sides of the circle would save a sixth of the pieces and cost the exact end
//! points, so it is not done.

use crate::quadratic::{norm, sub, Quadratic};
use std::f64::consts::{PI, TAU};

/// Greatest half angle of a piece. The curvature of a piece runs from cos²α/r to 1/(r cos α), so even where
/// the tolerance would allow a quarter circle a piece slows the tool by no more than 8 %.
const MAX_HALF_ANGLE: f64 = PI / 8.0;
/// The polar angle of a piece differs from the linear one by at most this times α³ (the supremum is 0.0704
/// at MAX_HALF_ANGLE and 1/(9√3) in the limit).
const ANGLE_ERROR: f64 = 0.0715;
/// A programmed sweep is corrected to the end point that the program gives; more than this is no rounding.
const SWEEP_SLACK: f64 = 0.1;

/// Nobody means an arc of more pieces than this; it would fill the memory.
const MAX_PIECES: f64 = 1e7;
/// An arc whose radius changes by more than this times itself per rad is no arc but a line along a radius.
const STEEPEST: f64 = 1e6;

/// An arc in the plane of two axes; all other axes run linearly with the angle.
///
/// Where start and end differ in their distance from the centre, the radius changes linearly with the angle.
#[derive(Clone, Copy, Debug)]
pub struct Arc<const M: usize> {
    pub start: [f64; M],
    pub end: [f64; M],
    /// Centre in the coordinates of `plane`.
    pub centre: [f64; 2],
    /// The two axes of the plane, turning from the first to the second at a positive sweep.
    pub plane: [usize; 2],
    /// Signed sweep in rad, with all its turns.
    pub sweep: f64,
}

/// Why an arc cannot be followed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ArcError {
    /// Start or end lies in the centre, the arc runs along a radius, or a number is not finite.
    Radius,
    /// The sweep is zero or does not lead from the start to the end.
    Sweep,
    /// The turns take more than MAX_PIECES pieces.
    Turns,
}

/// The polar form of an arc about its centre.
struct Polar {
    /// From the centre to the start, of length 1.
    direction: [f64; 2],
    radius: f64,
    /// Change of the radius per rad of |sweep|.
    growth: f64,
    /// Travel of all other axes per rad of |sweep|.
    pitch: f64,
    sweep: f64,
}

impl Polar {
    fn new<const M: usize>(arc: &Arc<M>) -> Result<Self, ArcError> {
        let [x, y] = arc.plane;
        let from = [arc.start[x] - arc.centre[0], arc.start[y] - arc.centre[1]];
        let to = [arc.end[x] - arc.centre[0], arc.end[y] - arc.centre[1]];
        let (radius, end_radius) = (norm(&from), norm(&to));
        let finite = arc.start.iter().chain(&arc.end).all(|value| value.is_finite());
        if !(finite && radius > 0.0 && end_radius > 0.0 && end_radius.is_finite() && radius.is_finite()) {
            return Err(ArcError::Radius);
        }
        // The end point decides, the programmed sweep only says how many turns there are.
        let turn = (from[0] * to[1] - from[1] * to[0]).atan2(from[0] * to[0] + from[1] * to[1]);
        let correction = (turn - arc.sweep + PI).rem_euclid(TAU) - PI;
        let sweep = arc.sweep + correction;
        if !(correction.abs() <= SWEEP_SLACK && sweep * arc.sweep > 0.0) {
            return Err(ArcError::Sweep);
        }
        let mut other = sub(&arc.end, &arc.start);
        other[x] = 0.0;
        other[y] = 0.0;
        let growth = (end_radius - radius) / sweep.abs();
        let pitch = norm(&other) / sweep.abs();
        if !(growth.abs() <= STEEPEST * radius.min(end_radius) && pitch.is_finite()) {
            return Err(ArcError::Radius);
        }
        Ok(Self { direction: [from[0] / radius, from[1] / radius], radius, growth, pitch, sweep })
    }

    /// An upper bound of the distance between arc and pieces of half angle α, both ways: radial error and,
    /// on a helix, the smaller of the ways to make up for the angle (at equal angle, or at equal height).
    fn deviation(&self, alpha: f64) -> f64 {
        let large = self.radius.max(self.radius + self.growth * self.sweep.abs());
        let small = self.radius.min(self.radius + self.growth * self.sweep.abs());
        let (sin, cos) = alpha.sin_cos();
        let b = sin * sin / (2.0 * cos);
        let circle = large * b * b / (1.0 + (1.0 + b * b).sqrt());
        // A changing radius shears the piece: by less than 0.4 α³ of the growth across the arc, and by less
        // than 1.5 α² of it along the arc, where the radius is then another.
        let growth = self.growth.abs();
        let along = 1.5 * growth * alpha * alpha / small;
        let radial = circle + growth * (0.4 * alpha.powi(3) + along);
        let angle = ANGLE_ERROR * alpha.powi(3) + along;
        radial.hypot(angle * self.pitch.min(large))
    }

    /// The least number of pieces within `tolerance`.
    fn count(&self, tolerance: f64) -> Result<usize, ArcError> {
        let half = 0.5 * self.sweep.abs();
        let fits = |count: f64| self.deviation(half / count) <= tolerance;
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
}

/// The arc as quadratic pieces of equal width, and an upper bound of its distance from them, both ways.
///
/// Start and end are met exactly. The bound is at most `tolerance` > 0.
pub fn arc_pieces<const M: usize>(
    arc: &Arc<M>,
    tolerance: f64,
) -> Result<(Vec<Quadratic<M>>, f64), ArcError> {
    let polar = Polar::new(arc)?;
    let n = polar.count(tolerance)?;
    let alpha = polar.sweep.abs() / (2.0 * n as f64);
    let Polar { radius, growth, sweep, direction: [e0, e1], .. } = polar;
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
        pieces.push(Quadratic { control: [joint, middle, end], width });
        (joint, middle) = (end, next);
    }
    Ok((pieces, polar.deviation(alpha)))
}

/// Least and greatest value of axis `k` of the plane (0 or 1) on the arc itself (where the radius changes,
/// at the angles at which a circle has them).
pub fn arc_extent<const M: usize>(arc: &Arc<M>, k: usize) -> Result<(f64, f64), ArcError> {
    let polar = Polar::new(arc)?;
    let (a, b) = (arc.start[arc.plane[k]], arc.end[arc.plane[k]]);
    let (mut least, mut greatest) = (a.min(b), a.max(b));
    let sign = polar.sweep.signum();
    // Angles, in the direction of travel, at which the axis has its extremes.
    let start = polar.direction[1].atan2(polar.direction[0]);
    for (side, opposite) in [(1.0, 0.0), (-1.0, PI)] {
        let extreme = 0.5 * PI * k as f64 + opposite;
        let first = (sign * (extreme - start)).rem_euclid(TAU);
        let turns = ((polar.sweep.abs() - first) / TAU).floor();
        if turns < 0.0 {
            continue;
        }
        // With a changing radius the first or the last turn reaches farthest.
        for angle in [first, first + TAU * turns] {
            let value = arc.centre[k] + side * (polar.radius + polar.growth * angle);
            least = least.min(value);
            greatest = greatest.max(value);
        }
    }
    Ok((least, greatest))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::quadratic::dot;

    fn planar(radius: f64, sweep: f64) -> Arc<3> {
        let (sin, cos) = sweep.sin_cos();
        Arc {
            start: [radius, 0.0, 0.0],
            end: [radius * cos, radius * sin, 0.0],
            centre: [0.0, 0.0],
            plane: [0, 1],
            sweep,
        }
    }

    /// The programmed arc at a share of its sweep.
    fn programmed<const M: usize>(arc: &Arc<M>, share: f64) -> [f64; M] {
        let [x, y] = arc.plane;
        let from = [arc.start[x] - arc.centre[0], arc.start[y] - arc.centre[1]];
        let to = [arc.end[x] - arc.centre[0], arc.end[y] - arc.centre[1]];
        let r = norm(&from) + share * (norm(&to) - norm(&from));
        let angle = from[1].atan2(from[0]) + share * arc.sweep;
        let mut point = std::array::from_fn(|k| arc.start[k] + share * (arc.end[k] - arc.start[k]));
        point[x] = arc.centre[0] + r * angle.cos();
        point[y] = arc.centre[1] + r * angle.sin();
        point
    }

    /// Greatest distance between arc and pieces found on a dense grid, both ways.
    fn sampled_deviation<const M: usize>(arc: &Arc<M>, pieces: &[Quadratic<M>]) -> f64 {
        let curve = |x: f64| {
            let x = x * pieces.len() as f64;
            let i = (x as usize).min(pieces.len() - 1);
            pieces[i].point((x - i as f64) * pieces[i].width)
        };
        let nearest = |point: &[f64; M], other: &dyn Fn(f64) -> [f64; M], near: f64, reach: f64| {
            let distance = |x: f64| norm(&sub(&other(x), point));
            let (mut low, mut high) = ((near - reach).max(0.0), (near + reach).min(1.0));
            for _ in 0..60 {
                let (a, b) = (low + (high - low) * 0.382, low + (high - low) * 0.618);
                if distance(a) < distance(b) {
                    high = b;
                } else {
                    low = a;
                }
            }
            distance(0.5 * (low + high))
        };
        let reach = 0.5 / pieces.len() as f64;
        let count = 16 * pieces.len().min(60) + 1;
        (0..=count)
            .map(|i| {
                let x = i as f64 / count as f64;
                let there = nearest(&curve(x), &|x| programmed(arc, x), x, reach);
                there.max(nearest(&programmed(arc, x), &curve, x, reach))
            })
            .fold(0.0, f64::max)
    }

    fn assert_smooth<const M: usize>(pieces: &[Quadratic<M>], slack: f64) {
        for pair in pieces.windows(2) {
            assert_eq!(pair[0].control[2], pair[1].control[0]);
            let (out, into) = (pair[0].end_tangents().1, pair[1].end_tangents().0);
            assert!(norm(&sub(&out, &into)) < slack, "{out:?} {into:?}");
        }
    }

    #[test]
    fn a_quarter_circle_has_the_tangent_intersections_as_control_points() {
        let (pieces, deviation) = arc_pieces(&planar(1.0, 0.5 * PI), 1.0).unwrap();
        assert_eq!(pieces.len(), 2);
        let t = (PI / 8.0).tan();
        assert!(norm(&sub(&pieces[0].control[1], &[1.0, t, 0.0])) < 1e-15);
        assert!(norm(&sub(&pieces[1].control[1], &[t, 1.0, 0.0])) < 1e-15);
        let apex = norm(&pieces[0].point(0.5 * pieces[0].width)) - 1.0;
        assert!((apex - deviation).abs() < 1e-15, "the bound is met half way: {apex} {deviation}");
    }

    #[test]
    fn the_bound_is_the_quartic_and_holds_for_every_tolerance() {
        let arc = planar(25.0, 1.9 * PI);
        for exponent in 0..10 {
            let tolerance = 10.0 * 0.1f64.powi(exponent);
            let (pieces, deviation) = arc_pieces(&arc, tolerance).unwrap();
            let found = sampled_deviation(&arc, &pieces);
            assert!(found <= deviation + 1e-13 && deviation <= tolerance, "{found} {deviation} {tolerance}");
            assert!(found >= 0.99 * deviation - 1e-13, "{found} of {deviation}");
            let alpha = 1.9 * PI / (2.0 * pieces.len() as f64);
            assert!((deviation / (25.0 * alpha.powi(4) / 8.0) - 1.0).abs() < alpha * alpha);
        }
    }

    #[test]
    fn full_circles_helices_and_spirals_stay_within_tolerance_in_every_plane() {
        for plane in [[0, 1], [1, 2], [2, 0]] {
            let normal = 3 - plane[0] - plane[1];
            for sweep in [TAU, -TAU, 0.5 * PI, 6.5 * PI, -6.5 * PI, 1e-3] {
                for (radius, end_radius) in [(1e-3, 1e-3), (5.0, 5.0), (5.0, 5.02), (5.0, 8.0), (1e5, 1e5)] {
                    for rise in [0.0, 0.5 * radius, 20.0 * radius] {
                        let mut arc = planar(radius, sweep);
                        arc.plane = plane;
                        arc.centre = [3.0, -2.0];
                        let at = |r: f64, angle: f64, height: f64| {
                            let mut point = [0.0; 3];
                            point[plane[0]] = 3.0 + r * angle.cos();
                            point[plane[1]] = -2.0 + r * angle.sin();
                            point[normal] = height;
                            point
                        };
                        arc.start = at(radius, 0.3, 1.0);
                        arc.end = at(end_radius, 0.3 + sweep, 1.0 + rise);
                        let tolerance = 1e-3;
                        let (pieces, deviation) = arc_pieces(&arc, tolerance).unwrap();
                        assert_eq!(pieces[0].control[0], arc.start);
                        assert_eq!(pieces[pieces.len() - 1].control[2], arc.end);
                        let found = sampled_deviation(&arc, &pieces);
                        let rounding = 1e-15 * radius.max(1.0);
                        assert!(found <= deviation + 8.0 * rounding, "{found} {deviation} {arc:?}");
                        assert!(deviation <= tolerance);
                        let edge = norm(&sub(&pieces[0].control[1], &pieces[0].control[0]));
                        assert_smooth(&pieces, 1e-10 + 100.0 * rounding / edge);
                    }
                }
            }
        }
    }

    #[test]
    fn the_helix_rises_linearly_and_further_axes_follow() {
        let arc = Arc {
            start: [2.0, 0.0, 0.0, 10.0],
            end: [0.0, 2.0, -3.25, 140.0],
            centre: [0.0, 0.0],
            plane: [0, 1],
            sweep: 6.5 * PI,
        };
        let (pieces, _) = arc_pieces(&arc, 1e-3).unwrap();
        let speed = 1.0 / (pieces.len() as f64 * pieces[0].width);
        for piece in &pieces {
            for tangent in [piece.end_tangents().0, piece.end_tangents().1] {
                assert!(
                    (tangent[2] + 3.25 * speed).abs() < 1e-12 && (tangent[3] - 130.0 * speed).abs() < 1e-10
                );
            }
        }
        let length: f64 = pieces.iter().map(|piece| piece.width).sum();
        let exact = (2.0 * 6.5 * PI).hypot((3.25f64 * 3.25 + 130.0 * 130.0).sqrt());
        assert!((length / exact - 1.0).abs() < 1e-12);
        let (first, _) = pieces[0].end_tangents();
        assert!((dot(&first, &first) - 1.0).abs() < 1e-2);
    }

    #[test]
    fn the_rounded_end_point_of_a_program_is_met_and_joined_smoothly() {
        let mut arc = planar(10.0, 0.5 * PI);
        arc.end = [0.004, 9.997, 0.0];
        let (pieces, deviation) = arc_pieces(&arc, 1e-4).unwrap();
        assert_eq!(pieces[pieces.len() - 1].control[2], arc.end);
        assert_smooth(&pieces, 1e-12);
        arc.sweep = (9.997f64).atan2(0.004);
        assert!(sampled_deviation(&arc, &pieces) <= deviation);
    }

    #[test]
    fn arcs_without_radius_or_with_another_sweep_are_refused() {
        let mut arc = planar(1.0, 1.0);
        arc.start = [0.0; 3];
        assert_eq!(arc_pieces(&arc, 1e-3).unwrap_err(), ArcError::Radius);
        arc = planar(1.0, 1e-8);
        arc.end[0] = 2.0;
        assert_eq!(arc_pieces(&arc, 1e-3).unwrap_err(), ArcError::Radius);
        arc = planar(1.0, 1.0);
        arc.sweep = 2.0;
        assert_eq!(arc_pieces(&arc, 1e-3).unwrap_err(), ArcError::Sweep);
        arc.sweep = f64::NAN;
        assert_eq!(arc_pieces(&arc, 1e-3).unwrap_err(), ArcError::Sweep);
        arc.sweep = 1.0 + 1e9 * TAU;
        assert_eq!(arc_pieces(&arc, 1e-3).unwrap_err(), ArcError::Turns);
        arc.centre[1] = f64::INFINITY;
        assert_eq!(arc_pieces(&arc, 1e-3).unwrap_err(), ArcError::Radius);
    }

    #[test]
    fn extents_count_the_quadrants_that_are_passed() {
        let quarter = planar(2.0, 0.5 * PI);
        let (least, greatest) = arc_extent(&quarter, 0).unwrap();
        assert!(least.abs() < 1e-15 && greatest == 2.0);
        let clockwise = planar(2.0, -1.0);
        assert_eq!(arc_extent(&clockwise, 1).unwrap().1, 0.0);
        let most = planar(2.0, 1.5 * PI);
        assert_eq!(arc_extent(&most, 0).unwrap(), (-2.0, 2.0));
        assert_eq!(arc_extent(&most, 1).unwrap(), (-2.0, 2.0));
    }
}
