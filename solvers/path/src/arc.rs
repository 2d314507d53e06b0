//! An arc or a helix of a program as conic pieces, with a bound of their distance from the arc.
//!
//! | file | computes |
//! |---|---|
//! | `polar` | an arc about its centre |
//! | `true_circle` | the circle through both ends, and helices on the cylinder of such a circle |
//! | `spiral` | an arc whose radius changes too much for one circle, within a tolerance |

mod polar;
mod spiral;
mod true_circle;

use feedplan_geometry::conic::Conic;
use polar::Polar;
pub use polar::{Arc, ArcError};
use std::f64::consts::{PI, TAU};

/// The arc as pieces in standard form, and an upper bound of the distance between arc and pieces, both ways, in mm.
///
/// Start and end are met exactly. Where the circle through both ends whose centre is nearest to the programmed one is within
/// `tolerance` > 0, the pieces lie on it; otherwise they are a spiral. The bound is at most `tolerance`.
pub fn arc_pieces<const M: usize>(arc: &Arc<M>, tolerance: f64) -> Result<(Vec<Conic<M>>, f64), ArcError> {
    let polar = Polar::new(arc)?;
    match true_circle::pieces(arc, &polar, tolerance) {
        Some(circle) => Ok(circle),
        None => spiral::pieces(arc, &polar, tolerance),
    }
}

/// Least and greatest value of axis `k` of the plane (0 or 1) on the arc. Where the radius changes, the values are taken at the
/// angles of the extremes of a circle.
pub fn arc_extent<const M: usize>(arc: &Arc<M>, k: usize) -> Result<(f64, f64), ArcError> {
    let polar = Polar::new(arc)?;
    let (a, b) = (arc.start[arc.plane[k]], arc.end[arc.plane[k]]);
    let (mut least, mut greatest) = (a.min(b), a.max(b));
    let sign = polar.sweep.signum();
    // The angles from the start, in the direction of travel, at which the axis has its extremes.
    let start = polar.direction[1].atan2(polar.direction[0]);
    for (side, opposite) in [(1.0, 0.0), (-1.0, PI)] {
        let extreme = 0.5 * PI * k as f64 + opposite;
        let first = (sign * (extreme - start)).rem_euclid(TAU);
        let turns = ((polar.sweep.abs() - first) / TAU).floor();
        if turns < 0.0 {
            continue;
        }
        // With a changing radius the extreme is in the first or in the last turn.
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
    use feedplan_geometry::quadratic::{dot, norm, sub};
    use feedplan_geometry::spline::bezier::derivatives;
    use feedplan_geometry::spline::Piece;

    /// C and C' at a share of the width.
    fn at<const M: usize>(conic: &Conic<M>, share: f64) -> [[f64; M]; 2] {
        let weights = [1.0, conic.weight, 1.0];
        let piece = Piece { control: &conic.control, weights: &weights, width: conic.width };
        let [point, tangent, ..] = derivatives(&piece, share * conic.width);
        [point, tangent]
    }

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
    fn sampled_deviation<const M: usize>(arc: &Arc<M>, pieces: &[Conic<M>]) -> f64 {
        let curve = |x: f64| {
            let x = x * pieces.len() as f64;
            let i = (x as usize).min(pieces.len() - 1);
            at(&pieces[i], x - i as f64)[0]
        };
        let nearest = |point: &[f64; M], other: &dyn Fn(f64) -> [f64; M], near: f64, reach: f64| {
            let distance = |x: f64| norm(&sub(&other(x), point));
            let (mut low, mut high) = ((near - reach).max(0.0), (near + reach).min(1.0));
            for _ in 0..80 {
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

    fn assert_smooth<const M: usize>(pieces: &[Conic<M>], slack: f64) {
        for pair in pieces.windows(2) {
            assert_eq!(pair[0].control[2], pair[1].control[0]);
            let (out, into) = (at(&pair[0], 1.0)[1], at(&pair[1], 0.0)[1]);
            assert!(norm(&sub(&out, &into)) < slack, "{out:?} {into:?}");
        }
    }

    #[test]
    fn a_quarter_circle_is_one_piece_with_the_corner_of_its_square() {
        let (pieces, deviation) = arc_pieces(&planar(2.0, 0.5 * PI), 1e-9).unwrap();
        assert_eq!((pieces.len(), deviation), (1, 0.0));
        assert!(norm(&sub(&pieces[0].control[1], &[2.0, 2.0, 0.0])) < 1e-15);
        assert!((pieces[0].weight - 0.5f64.sqrt()).abs() < 1e-15);
        assert!((pieces[0].width - 8f64.sqrt()).abs() < 1e-15);
    }

    #[test]
    fn circles_are_true_whatever_the_tolerance_and_run_at_speed_1_through_their_joints() {
        for (radius, sweep) in [(25.0, 1.9 * PI), (1e-3, -TAU), (1e4, 0.01), (3.0, 5.0 * TAU), (1.0, 1e-5)] {
            let (pieces, deviation) = arc_pieces(&planar(radius, sweep), 1e-6).unwrap();
            assert_eq!(pieces.len() as f64, (sweep.abs() / (0.5 * PI) * (1.0 - 1e-12)).ceil());
            assert!(deviation <= 1e-15 * radius);
            for piece in &pieces {
                for i in 0..=16 {
                    let [point, _] = at(piece, i as f64 / 16.0);
                    assert!((point[0].hypot(point[1]) / radius - 1.0).abs() < 1e-14);
                }
                for share in [0.0, 1.0] {
                    assert!((norm(&at(piece, share)[1]) - 1.0).abs() < 1e-12);
                }
            }
            assert_smooth(&pieces, 1e-12);
        }
    }

    /// The arc with an end that is off by rounding to a grid, and a sweep as a reader finds it.
    fn rounded(radius: f64, from: f64, sweep: f64, grid: f64) -> Arc<3> {
        let round = |value: f64| (value / grid).round() * grid;
        let at = |angle: f64| [round(radius * angle.cos()), round(radius * angle.sin()), 0.0];
        let (start, end) = (at(from), at(from + sweep));
        let between = end[1].atan2(end[0]) - start[1].atan2(start[0]);
        let sweep = between + TAU * ((sweep - between) / TAU).round();
        Arc { start, end, centre: [0.0, 0.0], plane: [0, 1], sweep }
    }

    #[test]
    fn rounded_ends_give_a_circle_through_both_and_its_bound_is_met() {
        let mut state = 11u64;
        let mut random = || {
            state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            (state >> 40) as f64 / (1u64 << 24) as f64
        };
        let mut greatest = 0.0f64;
        for _ in 0..300 {
            let sign = if random() < 0.5 { -1.0 } else { 1.0 };
            let sweep = sign * (0.2 + 5.0 * random());
            let arc = rounded(2.0 + 30.0 * random(), TAU * random(), sweep, 1e-3);
            let (pieces, deviation) = arc_pieces(&arc, 0.05).unwrap();
            let found = sampled_deviation(&arc, &pieces);
            assert!(found <= deviation + 1e-12, "{found} {deviation} {arc:?}");
            // Besides |g| the bound contains d²/2r, at most 3e-6 here.
            assert!(found >= 0.9 * deviation - 4e-6, "{found} of {deviation} {arc:?}");
            greatest = greatest.max(deviation);
            assert_eq!(pieces[pieces.len() - 1].control[2], arc.end);
            assert_smooth(&pieces, 1e-10);
            // The centre by Pythagoras from three points: the pieces share one circle.
            let middle = at(&pieces[0], 0.5)[0];
            let (a, b) = (sub(&middle, &arc.start), sub(&pieces[0].control[2], &arc.start));
            let twice = 2.0 * (a[0] * b[1] - a[1] * b[0]);
            let centre = [
                arc.start[0] + (b[1] * dot(&a, &a) - a[1] * dot(&b, &b)) / twice,
                arc.start[1] + (a[0] * dot(&b, &b) - b[0] * dot(&a, &a)) / twice,
            ];
            let radius = (arc.start[0] - centre[0]).hypot(arc.start[1] - centre[1]);
            for piece in &pieces {
                let [point, _] = at(piece, 0.3);
                let off = (point[0] - centre[0]).hypot(point[1] - centre[1]) - radius;
                assert!(off.abs() < 1e-11 * radius, "{off}");
            }
        }
        assert!(greatest > 2e-4, "{greatest}");
    }

    #[test]
    fn a_spiral_is_no_circle() {
        let mut arc = planar(10.0, 0.5 * PI);
        arc.end[1] += 0.5;
        let (pieces, deviation) = arc_pieces(&arc, 1e-3).unwrap();
        assert!(pieces.iter().all(|piece| piece.weight == 1.0) && deviation <= 1e-3);
        assert!(sampled_deviation(&arc, &pieces) <= deviation);
        assert_smooth(&pieces, 1e-12);
        // A full turn whose end is a rounding beside its start stays a circle.
        let mut turn = planar(10.0, TAU);
        turn.end = [10.0 + 2e-15, 1e-15, 0.0];
        assert_eq!(arc_pieces(&turn, 1e-3).unwrap().0.len(), 4);
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
                        let rounding = 1e-15 * radius.max(1.0) * sweep.abs().max(1.0);
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
        let (pieces, deviation) = arc_pieces(&arc, 1e-3).unwrap();
        assert!(deviation <= 1e-3);
        for (i, piece) in pieces.iter().enumerate() {
            for j in 0..=8 {
                let [point, tangent] = at(piece, j as f64 / 8.0);
                assert!((point[0].hypot(point[1]) - 2.0).abs() < 1e-14);
                assert!(tangent[2] < 0.0 && tangent[3] > 0.0);
                // Both other axes move in proportion, and are linear in the angle up to the bound.
                let share = (point[3] - 10.0) / 130.0;
                assert!((point[2] + 3.25 * share).abs() < 1e-14);
                let angle = 6.5 * PI * share;
                let off = (angle.sin() * point[0] - angle.cos() * point[1]).hypot(0.0);
                assert!(off <= deviation + 1e-13, "{i} {off} {deviation}");
            }
            for share in [0.0, 1.0] {
                assert!((norm(&at(piece, share)[1]) - 1.0).abs() < 1e-12);
            }
        }
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
