//! A proof that curve and polyline are within the tolerance of each other, both ways, and that the curve never stops.
//!
//! The curve is cut at ascending places u*_i near the vertices V_i (foot points). From the curve to the polyline: a convex hull
//! bounds the distance of the part between u*_i and u*_(i+1) from chord i. From the polyline to the curve: a point of chord i is
//! either the projection of a point of that part, or it lies between a vertex and the projection of C(u*_i), and is then nearer
//! to C(u*_i) than the vertex is. So no distance is above the greatest of these bounds and of |C(u*_i) − V_i|. The proof holds
//! for any ascending places u*_i.

use super::bezier::{distance_bound, is_inside, point_and_slope, speed_bound, split, Control, DEPTH};
use super::polyline::Polyline;
use super::spline::ORDER;
use feedplan_geometry::parallel::map;
use feedplan_geometry::quadratic::{dot, norm, sub};
use feedplan_geometry::watch::Watch;

/// A curve with |C'| of at least this never stops. At a vertex that turns by 135° |C'| is about 0.38, at 177° 0.026.
const LEAST_SPEED: f64 = 0.02;
/// The greatest distance between a foot point and the station of its vertex, in tolerances,
const SLIP: f64 = 4.0;
/// and the same for a curve that is fitted to a motion.
const FITTED_SLIP: f64 = 15.0;
const NEWTON_STEPS: usize = 5;
/// The least number of intervals or vertices that a thread takes at a time.
const TASK: usize = 256;

/// What is proven of a curve.
pub struct Certificate {
    /// Foot points of all vertices, ascending.
    pub foot: Vec<f64>,
    /// For each interval an upper bound of the distances between curve and polyline in it, in mm.
    pub deviation: Vec<f64>,
    /// Whether the interval is within the tolerance and the bounds of the axes, and never stops.
    pub good: Vec<bool>,
}

impl Certificate {
    /// Checks a curve, which must also stay within `bounds` of the axes.
    pub fn new<const D: usize>(
        line: &Polyline<D>,
        knots: &[f64],
        pieces: &[Control<D>],
        bounds: &[[f64; 2]; D],
        watch: Watch,
    ) -> Self {
        let last = line.chords();
        let free = map(last - 1, TASK, |i| {
            watch.check_at(i + 1);
            foot_point(line, knots, pieces, i + 1)
        });
        let mut foot = Vec::with_capacity(last + 1);
        foot.push(0.0);
        for u in free {
            foot.push(u.max(foot[foot.len() - 1]));
        }
        foot.push(line.length());
        let checked = map(pieces.len(), TASK, |j| {
            watch.check_at(j);
            let (deviation, good) = interval(line, knots, pieces, &foot, j);
            (deviation, good && is_inside(&pieces[j], bounds, DEPTH))
        });
        let (deviation, good) = checked.into_iter().unzip();
        Self { foot, deviation, good }
    }
}

/// The interval that contains a parameter.
fn interval_at(knots: &[f64], u: f64) -> usize {
    knots[1..knots.len() - 1].partition_point(|&knot| knot <= u)
}

/// A parameter near which the curve is closest to vertex i, by Gauss–Newton steps from the station of the vertex.
fn foot_point<const D: usize>(line: &Polyline<D>, knots: &[f64], pieces: &[Control<D>], i: usize) -> f64 {
    let slip = if line.pace.fitted { FITTED_SLIP } else { SLIP } * line.tolerance_at(i);
    let low = (line.station[i] - slip).max(0.0);
    let high = (line.station[i] + slip).min(line.length());
    let mut u = line.station[i];
    let mut best = (f64::INFINITY, u);
    for _ in 0..NEWTON_STEPS {
        let j = interval_at(knots, u);
        let width = knots[j + 1] - knots[j];
        let (point, slope) = point_and_slope(&pieces[j], ((u - knots[j]) / width).clamp(0.0, 1.0));
        let away = sub(&point, &line.vertex[i]);
        let distance = norm(&away);
        if distance < best.0 {
            best = (distance, u);
        }
        let step = -width * dot(&away, &slope) / dot(&slope, &slope);
        let next = (u + step).clamp(low, high);
        // Where C' is 0 the step is NaN.
        if next.is_nan() || (next - u).abs() <= 1e-4 * slip {
            break;
        }
        u = next;
    }
    best.1
}

/// The bound of the distances in interval j, in mm, and whether the tolerance and the least speed are kept.
fn interval<const D: usize>(
    line: &Polyline<D>,
    knots: &[f64],
    pieces: &[Control<D>],
    foot: &[f64],
    j: usize,
) -> (f64, bool) {
    let (end, width) = (knots[j + 1], knots[j + 1] - knots[j]);
    let mut good = speed_bound(&pieces[j], width, LEAST_SPEED, DEPTH) >= LEAST_SPEED;
    let mut deviation = 0.0f64;
    let mut offer = |bound: f64, tolerance: f64| {
        deviation = deviation.max(bound);
        // A NaN fails the test.
        good &= bound <= tolerance;
    };
    let last = line.chords();
    let (mut start, mut rest) = (knots[j], pieces[j]);
    let mut chord = foot[1..last].partition_point(|&u| u < start);
    while chord + 1 < last && foot[chord + 1] <= end {
        let u = foot[chord + 1];
        let part = if u > start {
            let (part, after) = split(&rest, ((u - start) / (end - start)).min(1.0));
            rest = after;
            part
        } else {
            [rest[0]; ORDER]
        };
        offer(distance_bound(&part, line, chord, line.tolerance[chord], DEPTH), line.tolerance[chord]);
        offer(norm(&sub(&rest[0], &line.vertex[chord + 1])), line.tolerance_at(chord + 1));
        (start, chord) = (u, chord + 1);
    }
    if end > start {
        offer(distance_bound(&rest, line, chord, line.tolerance[chord], DEPTH), line.tolerance[chord]);
    }
    (deviation, good)
}

#[cfg(test)]
mod tests {
    use super::*;

    const ANYWHERE: [[f64; 2]; 2] = [[f64::NEG_INFINITY, f64::INFINITY]; 2];

    #[test]
    fn a_straight_curve_beside_an_elbow_is_as_far_as_the_elbow() {
        // Two chords to a height of 0.3 and back; the curve is the line between their ends.
        let line = Polyline::new(vec![[0.0, 0.0], [2.0, 0.3], [4.0, 0.0]], vec![0.31; 2]);
        let length = line.length();
        let knots = [0.0, 0.5 * length, length];
        let piece = |a: f64, b: f64| std::array::from_fn(|k| [a + (b - a) * k as f64 / 5.0, 0.0]);
        let certificate =
            Certificate::new(&line, &knots, &[piece(0.0, 2.0), piece(2.0, 4.0)], &ANYWHERE, Watch::default());
        assert!((certificate.foot[1] - 0.5 * length).abs() < 1e-12);
        assert!(certificate.deviation.iter().all(|deviation| (deviation - 0.3).abs() < 1e-12));
        assert!(certificate.good.iter().all(|&good| good));
        let tight = Polyline { tolerance: vec![0.29; 2], ..line };
        let certificate = Certificate::new(
            &tight,
            &knots,
            &[piece(0.0, 2.0), piece(2.0, 4.0)],
            &ANYWHERE,
            Watch::default(),
        );
        assert!(certificate.good.iter().any(|&good| !good));
        // A curve that stops on its way.
        let stops = [[0.0, 0.0], [0.4, 0.0], [2.0, 0.0], [0.0, 0.0], [1.6, 0.0], [2.0, 0.0]];
        assert!(
            !Certificate::new(&tight, &knots, &[stops, piece(2.0, 4.0)], &ANYWHERE, Watch::default()).good[0]
        );
    }
}
