//! Cuts a fitted piece at the points where the feed changes, so that each part has one feed.
//!
//! The feed of a part is the least feed of the chords that it covers. A part covers a chord if the nearest place of the curve to
//! some point of the chord is in the part. In a zigzag below the tolerance a chord can be covered by several parts, in any order.

use crate::fit::FittedPiece;
use crate::tolerance::SLIVER;
use feedplan_geometry::quadratic::{dot, norm, sub, Quadratic};

/// Calls `emit` for each part of a piece in order, with its first and last chord and its feed; `feed[i]` is the feed of
/// chord i.
pub fn cut_at_feeds<const M: usize>(
    fit: &FittedPiece<M>,
    points: &[[f64; M]],
    feed: &[f64],
    mut emit: impl FnMut(Quadratic<M>, (usize, usize), f64),
) {
    let FittedPiece { piece, first, last, .. } = *fit;
    let slowest = |a: usize, b: usize| feed[a..=b].iter().fold(f64::INFINITY, |a: f64, &b| a.min(b));
    if feed[first..=last].iter().all(|&other| other == feed[first]) {
        return emit(piece, (first, last), feed[first]);
    }
    let width = piece.width;
    let inner: Vec<f64> = (first + 1..=last).map(|k| nearest(&piece, &points[k])).collect();
    // For each chord: the greatest parameter nearest to a point of it or of an earlier chord, and the least parameter nearest to
    // a point of it or of a later chord.
    let (mut reached, mut left) = (inner.clone(), inner.clone());
    reached.push(width);
    left.insert(0, 0.0);
    for i in 1..reached.len() {
        reached[i] = reached[i].max(reached[i - 1]);
    }
    for i in (1..left.len()).rev() {
        left[i - 1] = left[i - 1].min(left[i]);
    }
    // Every chord is covered by some part, even if all its points are nearest to a cut or an end.
    let mut next = first;
    let mut part = |begin: f64, end: f64| {
        let from = next.min(first + reached.partition_point(|&u| u <= begin));
        let to = if end == width { last } else { first + left.partition_point(|&u| u < end) - 1 };
        next = to + 1;
        let curve = if end - begin == width { piece } else { piece.part(begin, end) };
        emit(curve, (from, to), slowest(from, to));
    };
    let mut begin = 0.0;
    for k in first + 1..=last {
        let u = inner[k - first - 1];
        if feed[k] != feed[k - 1] && u - begin > SLIVER * width && width - u > SLIVER * width {
            part(begin, u);
            begin = u;
        }
    }
    part(begin, width);
}

/// The parameter at which a piece is nearest to a point: around the best of a few samples, by bisection of the derivative of the
/// distance.
fn nearest<const M: usize>(piece: &Quadratic<M>, point: &[f64; M]) -> f64 {
    const SAMPLES: usize = 8;
    let (start, end) = piece.end_tangents();
    let away = |u: f64| {
        let t = u / piece.width;
        let tangent: [f64; M] = std::array::from_fn(|k| start[k] + t * (end[k] - start[k]));
        dot(&tangent, &sub(&piece.point(u), point))
    };
    let step = piece.width / SAMPLES as f64;
    let distance = |i: usize| norm(&sub(&piece.point(i as f64 * step), point));
    let best = (0..=SAMPLES).min_by(|&a, &b| distance(a).total_cmp(&distance(b))).unwrap_or(0);
    let mut low = step * best.saturating_sub(1) as f64;
    let mut high = (step * (best + 1) as f64).min(piece.width);
    if away(low) >= 0.0 {
        return low;
    }
    if away(high) <= 0.0 {
        return high;
    }
    for _ in 0..50 {
        let middle = 0.5 * (low + high);
        if away(middle) > 0.0 {
            high = middle;
        } else {
            low = middle;
        }
    }
    0.5 * (low + high)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Parts of the line from 0 to 10 that stands for the chords between `points`.
    fn parts(points: &[[f64; 2]], feed: &[f64]) -> Vec<(f64, f64, usize, usize, f64)> {
        let piece = Quadratic::line([0.0, 0.0], [10.0, 0.0]);
        let fit = FittedPiece { piece, first: 0, last: feed.len() - 1, deviation: 0.1, spline: 0 };
        let mut parts = Vec::new();
        cut_at_feeds(&fit, points, feed, |part, (a, b), feed| {
            let ends = part.control.map(|point| (1e6 * point[0]).round() / 1e6);
            parts.push((ends[0], ends[2], a, b, feed));
        });
        parts
    }

    #[test]
    fn a_line_is_cut_beside_the_points_where_the_feed_changes() {
        let points = [[0.0, 0.0], [2.0, 0.1], [5.0, -0.1], [7.0, 0.1], [10.0, 0.0]];
        assert_eq!(parts(&points, &[3.0; 4]), [(0.0, 10.0, 0, 3, 3.0)]);
        assert_eq!(parts(&points, &[3.0, 3.0, 8.0, 8.0]), [(0.0, 5.0, 0, 1, 3.0), (5.0, 10.0, 2, 3, 8.0)]);
    }

    #[test]
    fn a_chord_that_turns_back_over_a_cut_counts_on_both_sides_of_it() {
        let points = [[0.0, 0.0], [6.0, 0.1], [5.0, 0.2], [5.5, 0.1], [10.0, 0.0]];
        let feed = [3.0, 3.0, 8.0, 8.0];
        assert_eq!(parts(&points, &feed), [(0.0, 5.0, 0, 0, 3.0), (5.0, 10.0, 0, 3, 3.0)]);
        // The cut at 5.5 lies within the first chord, from 0 to 6, and within the second one, which comes back from 6 to 5.
        let feed = [3.0, 3.0, 3.0, 8.0];
        assert_eq!(parts(&points, &feed), [(0.0, 5.5, 0, 2, 3.0), (5.5, 10.0, 0, 3, 3.0)]);
    }

    #[test]
    fn the_nearest_place_is_found_on_either_half_of_a_hairpin() {
        let piece = Quadratic { control: [[0.0, 0.0], [10.0, 1.0], [0.0, 2.0]], width: 12.0 };
        for u in [0.0, 0.1, 2.0, 5.9, 6.1, 11.0, 12.0] {
            assert!((nearest(&piece, &piece.point(u)) - u).abs() < 1e-9);
        }
    }
}
