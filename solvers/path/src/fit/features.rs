//! The feature points of a group, which the spline interpolates (Zhang et al. 2010, section 3.2, Algorithm 1).
//!
//! A quadratic Bézier curve through three features Q1, Q2, Q3 replaces all points between them. If points are too far from it,
//! the farthest one becomes a feature and the triple shrinks; otherwise the triple moves on by one feature. Two additions keep
//! the cost linear:
//!
//! * The third feature is ahead of the second one by at most four times the step from the first to the second, so that a failed
//!   attempt costs no more than what was accepted before.
//! * A long triple that fails again and again is halved at every fourth attempt.

use super::chain::Chain;
use feedplan_geometry::quadratic::{dot, Segment};

/// The third feature is at most this many steps from Q1 to Q2 ahead of Q2; the first step of a group has at most FIRST points.
const REACH: usize = 4;
const FIRST: usize = 32;
/// Triples of fewer points are never halved: they shrink as in the paper.
const SMALL: usize = 32;

/// The feature points of the group from point `a` to point `b`, both included. The points in `extremes`, strictly between them
/// and ascending, are tried first.
pub fn select<const M: usize>(chain: &Chain<M>, a: usize, b: usize, mut extremes: &[usize]) -> Vec<usize> {
    let next_extreme =
        |extremes: &[usize], after: usize| extremes.iter().copied().find(|&next| next > after).unwrap_or(b);
    let mut features = vec![a];
    let mut q1 = a;
    let mut q2 = next_extreme(extremes, a).min(a + FIRST);
    if q2 == b {
        match farthest_from_chord(chain, a, b) {
            Some(farthest) => q2 = farthest,
            None => return vec![a, b],
        }
    }
    // Features from q2 on that earlier triples have accepted, the nearest last. There are several of them after a triple has
    // shrunk to before its q2.
    let mut accepted: Vec<usize> = Vec::new();
    while q2 < b {
        let mut q3 = match accepted.iter().rev().find(|&&next| next > q2) {
            Some(&next) => next,
            None => next_extreme(extremes, q2).min(q2 + REACH * (q2 - q1)),
        };
        let mut attempts = 0;
        while let Some(worst) = worst_point(chain, q1, q2, q3) {
            attempts += 1;
            if attempts % 4 == 0 && q3 - q1 > SMALL {
                q3 = q1 + (q3 - q1) / 2;
                q2 = q2.min(q1 + (q3 - q1) / 2);
            } else if worst < q2 {
                (q3, q2) = (q2, worst);
            } else {
                q3 = worst;
            }
        }
        features.push(q2);
        (q1, q2) = (q2, q3);
        accepted.retain(|&next| next > q2);
        accepted.push(q2);
        extremes = &extremes[extremes.partition_point(|&next| next <= q1)..];
    }
    features.push(b);
    features
}

/// The point between `a` and `b` that is farthest from their segment; None if all are within the tolerance.
fn farthest_from_chord<const M: usize>(chain: &Chain<M>, a: usize, b: usize) -> Option<usize> {
    let segment = Segment::new(&chain.points[a], &chain.points[b]);
    let (mut worst_sq, mut farthest) = (chain.tolerance * chain.tolerance, None);
    for k in a + 1..b {
        let off_sq = segment.distance_sq(&chain.points[k]);
        if off_sq > worst_sq {
            (worst_sq, farthest) = (off_sq, Some(k));
        }
    }
    farthest
}

/// The point farthest from the Bézier curve through the three features; None if all between are within the tolerance.
fn worst_point<const M: usize>(chain: &Chain<M>, q1: usize, q2: usize, q3: usize) -> Option<usize> {
    let Chain { points, along, tolerance, .. } = *chain;
    if q3 - q1 == 2 {
        return None;
    }
    // B(u) = c0 + u c1 + u² c2 passes Q2 at the u that is the fraction of the length before Q2.
    let length = along[q3] - along[q1];
    let u1 = (along[q2] - along[q1]) / length;
    let (start, end) = (&points[q1], &points[q3]);
    let c2: [f64; M] = std::array::from_fn(|k| {
        let on_chord = start[k] + u1 * (end[k] - start[k]);
        (on_chord - points[q2][k]) / (u1 * (1.0 - u1))
    });
    let c1: [f64; M] = std::array::from_fn(|k| end[k] - start[k] - c2[k]);
    let off = |u: f64, p: &[f64; M]| -> [f64; M] {
        std::array::from_fn(|k| p[k] - (start[k] + u * (c1[k] + u * c2[k])))
    };

    let mut worst_sq = tolerance * tolerance;
    let mut worst = None;
    for k in q1 + 1..q3 {
        let mut u = (along[k] - along[q1]) / length;
        let mut rest = off(u, &points[k]);
        let mut rest_sq = dot(&rest, &rest);
        for _ in 0..3 {
            if rest_sq <= worst_sq {
                break;
            }
            let tangent: [f64; M] = std::array::from_fn(|k| c1[k] + 2.0 * u * c2[k]);
            u = (u + dot(&rest, &tangent) / dot(&tangent, &tangent)).clamp(0.0, 1.0);
            rest = off(u, &points[k]);
            rest_sq = dot(&rest, &rest);
        }
        if rest_sq > worst_sq && k != q2 {
            (worst_sq, worst) = (rest_sq, Some(k));
        }
    }
    worst
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fit::chain::lengths_along;
    use feedplan_geometry::quadratic::Quadratic;

    fn features(points: &[[f64; 2]], extremes: &[usize], tolerance: f64) -> Vec<usize> {
        let along = lengths_along(points);
        let chain = Chain::of(points, &along, tolerance);
        let features = select(&chain, 0, points.len() - 1, extremes);
        assert!(features.windows(2).all(|pair| pair[0] < pair[1]));
        assert_eq!((features[0], features[features.len() - 1]), (0, points.len() - 1));
        // The result of Algorithm 1: the Bézier curve through a triple is near all points between.
        for triple in features.windows(3) {
            let [q1, q2, q3] = [triple[0], triple[1], triple[2]];
            let u = (along[q2] - along[q1]) / (along[q3] - along[q1]);
            let middle: [f64; 2] = std::array::from_fn(|k| {
                (points[q2][k] - (1.0 - u) * (1.0 - u) * points[q1][k] - u * u * points[q3][k])
                    / (2.0 * u * (1.0 - u))
            });
            let bezier = Quadratic { control: [points[q1], middle, points[q3]], width: 1.0 };
            let curve: Vec<[f64; 2]> = (0..=1000).map(|i| bezier.point(f64::from(i) / 1000.0)).collect();
            for point in &points[q1..q3] {
                let off_sq = curve.windows(2).map(|c| Segment::new(&c[0], &c[1]).distance_sq(point));
                assert!(off_sq.fold(f64::INFINITY, f64::min).sqrt() <= 1.001 * tolerance);
            }
        }
        features
    }

    #[test]
    fn points_near_a_chord_need_no_feature() {
        let points: Vec<[f64; 2]> = (0..=20).map(|i| [i as f64, 0.009 * (i % 2) as f64]).collect();
        assert_eq!(features(&points, &[], 0.01), [0, 20]);
    }

    #[test]
    fn a_shallow_parabola_needs_one_feature_between_its_ends() {
        let points: Vec<[f64; 2]> = (-15..=15).map(|i| [i as f64, 0.002 * (i * i) as f64]).collect();
        assert_eq!(features(&points, &[], 0.01), [0, 15, 30]);
    }

    #[test]
    fn extremes_become_features() {
        let points: Vec<[f64; 2]> = (0..=20).map(|i| [i as f64, 0.0]).collect();
        assert_eq!(features(&points, &[7, 13], 0.01), [0, 7, 13, 20]);
    }

    #[test]
    fn the_tighter_the_tolerance_the_more_features() {
        let points: Vec<[f64; 2]> = (0..2000).map(|i| [0.01 * i as f64, (0.01 * i as f64).sin()]).collect();
        let counts = [1e-1, 1e-2, 1e-3, 1e-4].map(|tolerance| features(&points, &[], tolerance).len());
        assert!(counts.windows(2).all(|pair| pair[0] < pair[1]), "{counts:?}");
        // The error of a triple is of third order in its length: a tenth of the tolerance takes 2.15 times as many features.
        assert!(counts[3] < 3 * counts[2] && counts[0] < 30, "{counts:?}");
    }

    #[test]
    fn rough_points_all_become_features() {
        let points: Vec<[f64; 2]> = (0..500).map(|i| [0.01 * i as f64, ((i * i) % 7) as f64]).collect();
        assert!(features(&points, &[], 0.01).len() > 300);
    }
}
