//! Breaking points and first feature points, from the discrete curvature of the points (Zhang et al. 2010, section 3.1).
//!
//! The curvature at a point is that of the circle through it and one point on each side, 1, 2, 4, 8 … points away. Of these pairs
//! the nearest one is taken whose chord is farther from the point than the tolerance, so that noise has no effect (after
//! Coeurjolly and Svensson, who use the longest digital segments). The number of points away is the *reach* of the curvature.
//! Without such a pair the curvature is 0.
//!
//! A point is an *extreme* if its curvature is the greatest between two points where it is lower by the factor PROMINENCE, and no
//! sharper one lies within its reach. Plateaus and ripples have no extremes.
//!
//! Breaking points are
//!
//! * both ends of the chain,
//! * both ends of lines, which are long chords and sequences of collinear points,
//! * extremes whose curvature is above the threshold, and
//! * corners whose curvature is above it, extremes or not.

use super::chain::{turn_cosine, Chain};
use crate::tolerance;
use feedplan_geometry::parallel::map;
use feedplan_geometry::quadratic::{dot, norm, sub, Segment};

/// Greatest reach of the curvature, in points to each side.
const WIDEST: usize = 2048;
/// The curvature at an extreme is at least this many times the lowest curvature on both sides.
const PROMINENCE: f64 = 1.2;

/// A point where one group ends and the next begins.
pub struct Break {
    pub at: usize,
    /// The points on either side that determine the tangent: `at` itself at an end of the chain.
    sides: [usize; 2],
    /// Whether the tangent may jump.
    pub corner: bool,
    /// Whether the group that starts here is one line.
    pub line: bool,
}

impl Break {
    /// The unit tangent at the point of the circle through it and its sides.
    pub fn tangent<const M: usize>(&self, chain: &Chain<M>) -> [f64; M] {
        let [a, b] = self.sides;
        let before = sub(&chain.points[self.at], &chain.points[a]);
        let after = sub(&chain.points[b], &chain.points[self.at]);
        let (before_sq, after_sq) = (dot(&before, &before), dot(&after, &after));
        // Inversion about the point maps the circle to a line.
        let tangent: [f64; M] = std::array::from_fn(|k| before[k] * after_sq + after[k] * before_sq);
        let length = norm(&tangent);
        match length > 0.0 {
            true => tangent.map(|value| value / length),
            false => chain.direction(self.at, b),
        }
    }
}

/// All breaking points in order, from the first point of the chain to the last, and all extremes.
pub fn group<const M: usize>(
    chain: &Chain<M>,
    max_chord: f64,
    max_curvature: f64,
) -> (Vec<Break>, Vec<usize>) {
    let last = chain.points.len() - 1;
    let (mut breaks, mut extremes) = (Vec::new(), Vec::new());
    let mut from = 0;
    let mut lines = lines(chain, max_chord);
    lines.push((last, last));
    let mut before = None;
    for (start, end) in lines {
        if from < start {
            breaks.push(end_of_line(chain, before, from, Some((from, start)), false));
            curve(chain, from, start, max_curvature, &mut breaks, &mut extremes);
            before = Some((from, start));
        }
        if start < end {
            breaks.push(end_of_line(chain, before, start, Some((start, end)), true));
            before = Some((start, end));
        }
        from = end;
    }
    breaks.push(end_of_line(chain, before, last, None, false));
    // A curve of one chord is a line as well.
    for i in 1..breaks.len() {
        breaks[i - 1].line |= breaks[i].at - breaks[i - 1].at == 1;
    }
    (breaks, extremes)
}

/// The break between two ranges of points, `before` and `after`.
fn end_of_line<const M: usize>(
    chain: &Chain<M>,
    before: Option<(usize, usize)>,
    at: usize,
    after: Option<(usize, usize)>,
    line: bool,
) -> Break {
    // Far enough away that noise within the tolerance does not decide the direction.
    let apart = |&k: &usize| norm(&sub(&chain.points[k], &chain.points[at])) > 2.0 * chain.tolerance;
    let left = before
        .map_or(at, |(from, _)| (from.max(at.saturating_sub(WIDEST))..at).rev().find(apart).unwrap_or(from));
    let right = after.map_or(at, |(_, to)| (at + 1..to.min(at + WIDEST)).find(apart).unwrap_or(to));
    Break { at, sides: [left, right], corner: is_corner(chain, at, [left, right]), line }
}

/// Whether the path turns both at the point itself and at the scale of the tolerance. Noise turns only at the point, a small
/// smooth bend only at the scale of the tolerance.
fn is_corner<const M: usize>(chain: &Chain<M>, at: usize, [left, right]: [usize; 2]) -> bool {
    chain.is_corner(at)
        && left < at
        && at < right
        && turn_cosine(&chain.points[left], &chain.points[at], &chain.points[right]) < chain.corner_cosine
}

/// Long chords, and sequences of collinear points from whose line the neighbouring path departs, as ranges of points.
fn lines<const M: usize>(chain: &Chain<M>, max_chord: f64) -> Vec<(usize, usize)> {
    let Chain { points, along, tolerance: allowed, .. } = *chain;
    let last = points.len() - 1;
    let largest = points.iter().flatten().fold(0.0_f64, |largest, value| largest.max(value.abs()));
    let off_sq = (tolerance::COLINEAR * allowed + tolerance::COLINEAR_ROUNDING * largest).powi(2);
    let mut lines = Vec::new();
    let mut from = 0;
    while from < last {
        let mut to = from + 1;
        let mut way = sub(&points[to], &points[from]);
        while to < last {
            let step = sub(&points[to + 1], &points[to]);
            let whole = sub(&points[to + 1], &points[from]);
            let share = dot(&way, &whole) / dot(&whole, &whole);
            let off: [f64; M] = std::array::from_fn(|k| way[k] - share * whole[k]);
            if dot(&off, &off) > off_sq || dot(&way, &step) <= 0.0 {
                break;
            }
            (to, way) = (to + 1, whole);
        }
        let long = along[to] - along[from] > max_chord;
        let keep = match to - from {
            1 => long || last == 1,
            _ => (long || departs(chain, from, to)) && is_straight(chain, from, to),
        };
        if keep {
            lines.push((from, to));
        }
        from = to;
    }
    lines
}

/// Whether the path beyond either end of the line through two points is off it by more than the tolerance, within half of their
/// distance: a smooth curve would then bend the line by as much. True if the chain ends at both points.
fn departs<const M: usize>(chain: &Chain<M>, from: usize, to: usize) -> bool {
    let Chain { points, along, tolerance, .. } = *chain;
    let last = points.len() - 1;
    let length = along[to] - along[from];
    if from == 0 && to == last {
        return true;
    }
    let shares = [0.5, 0.25, 0.125, 0.0625];
    let leaves = |near: usize, far: usize, k: usize| {
        let direction = chain.direction(far, near);
        let off = sub(&points[k], &points[near]);
        let ahead = dot(&off, &direction).max(0.0);
        let rest: [f64; M] = std::array::from_fn(|i| off[i] - ahead * direction[i]);
        norm(&rest) > tolerance
    };
    shares.iter().any(|share| {
        let beyond = share * length;
        let after = along.partition_point(|&s| s < along[to] + beyond).min(last);
        let before = along.partition_point(|&s| s <= along[from] - beyond).saturating_sub(1);
        leaves(to, from, after) || leaves(from, to, before)
    })
}

/// Whether all points between are on the line, so that small deviations have not added up.
fn is_straight<const M: usize>(chain: &Chain<M>, from: usize, to: usize) -> bool {
    let segment = Segment::new(&chain.points[from], &chain.points[to]);
    let allowed_sq = (tolerance::STRAIGHT * chain.tolerance).powi(2);
    chain.points[from..to].iter().all(|point| segment.distance_sq(point) <= allowed_sq)
}

/// Appends the extremes strictly between points `a` and `b`, and the breaks found there.
fn curve<const M: usize>(
    chain: &Chain<M>,
    a: usize,
    b: usize,
    max_curvature: f64,
    breaks: &mut Vec<Break>,
    extremes: &mut Vec<usize>,
) {
    let inner = a + 1..b;
    let curvature: Vec<(f64, usize)> = match chain.parallel {
        true => map(inner.len(), 1024, |k| curvature(chain, a, b, inner.start + k)),
        false => inner.map(|k| curvature(chain, a, b, k)).collect(),
    };
    let of = |k: usize| curvature[k - a - 1];
    let first = extremes.len();
    peaks(&curvature, a + 1, extremes);
    if max_curvature == f64::INFINITY {
        return;
    }
    let mut peaks = extremes[first..].iter().copied().peekable();
    for k in a + 1..b {
        let peak = peaks.next_if_eq(&k).is_some();
        let (kappa, reach) = of(k);
        if kappa > max_curvature {
            let sides = [k - reach.min(k - a), k + reach.min(b - k)];
            let corner = is_corner(chain, k, sides);
            if peak || corner {
                breaks.push(Break { at: k, sides, corner, line: false });
            }
        }
    }
}

/// The curvature at point `k` and its reach; the points on its sides are between `a` and `b`.
fn curvature<const M: usize>(chain: &Chain<M>, a: usize, b: usize, k: usize) -> (f64, usize) {
    let points = chain.points;
    let enough_sq = chain.tolerance * chain.tolerance;
    let mut reach = 1;
    chain.watch.check_at(k);
    loop {
        let (left, right) = (k - reach.min(k - a), k + reach.min(b - k));
        let off_sq = Segment::new(&points[left], &points[right]).distance_sq(&points[k]);
        if off_sq > enough_sq {
            let (before, after) = (sub(&points[k], &points[left]), sub(&points[right], &points[k]));
            let kappa = 2.0 * (off_sq / (dot(&before, &before) * dot(&after, &after))).sqrt();
            return (kappa, reach);
        }
        if reach == WIDEST || (left == a && right == b) {
            return (0.0, reach);
        }
        reach *= 2;
    }
}

/// Appends the maxima of the curvature that are `PROMINENCE` times the minima next to them and the greatest within their reach;
/// `first` is the point to which the first curvature belongs.
fn peaks(curvature: &[(f64, usize)], first: usize, extremes: &mut Vec<usize>) {
    let mut peaks = Vec::new();
    let mut rising = false;
    let (mut least, mut most, mut at) = (f64::INFINITY, 0.0, 0);
    for (k, &(kappa, _)) in curvature.iter().enumerate() {
        if rising {
            if kappa > most {
                (most, at) = (kappa, k);
            } else if kappa * PROMINENCE < most {
                peaks.push(at);
                (rising, least) = (false, kappa);
            }
        } else if kappa < least {
            least = kappa;
        } else if kappa > PROMINENCE * least {
            (rising, most, at) = (true, kappa, k);
        }
    }
    for (i, &peak) in peaks.iter().enumerate() {
        let (kappa, reach) = curvature[peak];
        let sharper = |&other: &usize| curvature[other].0 > kappa;
        let before = peaks[..i].iter().rev().take_while(|&&other| peak - other <= reach);
        let after = peaks[i + 1..].iter().take_while(|&&other| other - peak <= reach);
        if !before.chain(after).any(sharper) {
            extremes.push(first + peak);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fit::chain::lengths_along;

    /// Breaks as (point, corner, line) and extremes.
    fn grouped<const M: usize>(
        points: &[[f64; M]],
        max_chord: f64,
        max_curvature: f64,
    ) -> (Vec<(usize, bool, bool)>, Vec<usize>) {
        let along = lengths_along(points);
        let chain = Chain { corner_cosine: 0.5_f64.cos(), ..Chain::of(points, &along, 0.01) };
        let (breaks, extremes) = group(&chain, max_chord, max_curvature);
        (breaks.iter().map(|b| (b.at, b.corner, b.line)).collect(), extremes)
    }

    fn ellipse(count: usize) -> Vec<[f64; 2]> {
        // From the flat top round by the sharp left end, of curvature 1, to the bottom.
        (0..=count)
            .map(|i| {
                let angle = std::f64::consts::PI * (0.5 + i as f64 / count as f64);
                [4.0 * angle.cos(), 2.0 * angle.sin()]
            })
            .collect()
    }

    #[test]
    fn the_curvature_is_that_of_the_circle_through_three_points() {
        let points = [[0.0, 0.0], [1.0, 1.0], [2.0, 0.0], [3.0, 5.0]];
        let along = lengths_along(&points);
        let chain = Chain::of(&points, &along, 0.01);
        let (kappa, look) = curvature(&chain, 0, 3, 1);
        assert!((kappa - 1.0).abs() < 1e-15 && look == 1);
    }

    #[test]
    fn a_square_breaks_into_its_sides() {
        let side = |i: usize| i as f64 * 0.5;
        let mut points: Vec<[f64; 2]> = (0..=10).map(|i| [side(i), 0.0]).collect();
        points.extend((1..=10).map(|i| [5.0, side(i)]));
        points.extend((1..=10).map(|i| [5.0 - side(i), 5.0]));
        let (breaks, _) = grouped(&points, f64::INFINITY, f64::INFINITY);
        assert_eq!(breaks, [(0, false, true), (10, true, true), (20, true, true), (30, false, false)]);
    }

    #[test]
    fn a_long_chord_is_a_line_and_its_ends_are_breaks() {
        let mut points = ellipse(40);
        let [x, y] = points[40];
        points.push([x + 5.0, y]);
        points.extend((1..9).map(|i| [x + 5.0 + 0.3 * i as f64, y + 0.02 * (i * i) as f64]));
        let (breaks, _) = grouped(&points, 4.0, f64::INFINITY);
        assert_eq!(breaks, [(0, false, false), (40, false, true), (41, false, false), (49, false, false)]);
    }

    #[test]
    fn the_vertex_of_an_ellipse_is_an_extreme_and_breaks_above_the_threshold() {
        for count in [20, 80, 2000, 20_000] {
            let points = ellipse(count);
            let (breaks, extremes) = grouped(&points, f64::INFINITY, f64::INFINITY);
            assert_eq!(breaks.len(), 2);
            assert_eq!(extremes.len(), 1, "{count}");
            assert!(extremes[0].abs_diff(count / 2) <= 1 + count / 200, "{count}: {extremes:?}");
            assert_eq!(grouped(&points, f64::INFINITY, 0.9).0.len(), 3, "{count}");
            assert_eq!(grouped(&points, f64::INFINITY, 1.1).0.len(), 2, "{count}");
        }
    }

    #[test]
    fn a_circle_has_no_extremes_on_a_grid_either() {
        for grid in [1e-12, 1e-3] {
            let points: Vec<[f64; 2]> = (0..=720)
                .map(|i| f64::from(i).to_radians() * 0.4)
                .map(|angle| [10.0 * angle.cos(), 10.0 * angle.sin()].map(|v: f64| (v / grid).round() * grid))
                .collect();
            let (breaks, extremes) = grouped(&points, f64::INFINITY, 0.05);
            assert_eq!((breaks.len(), extremes.len()), (2, 0), "{grid}");
        }
    }

    #[test]
    fn noise_on_dense_points_makes_no_breaks() {
        // Neighbours turn by up to 70°, their circles have radii below 0.01 mm.
        let points: Vec<[f64; 2]> =
            (0..20_000).map(|i| [0.01 * f64::from(i), 0.003 * f64::from((i * 7919) % 3 - 1)]).collect();
        let (breaks, extremes) = grouped(&points, f64::INFINITY, 0.4);
        assert_eq!((breaks.len(), extremes.len()), (2, 0));
    }

    #[test]
    fn a_corner_between_dense_points_is_seen_once() {
        let bow = |i: i32| 0.002 * f64::from(i * i) * 1e-2;
        let mut points: Vec<[f64; 2]> = (0..200).map(|i| [0.05 * f64::from(i), bow(i)]).collect();
        let [x, y] = points[199];
        points.extend((1..200).map(|i| [x + bow(i), y + 0.05 * f64::from(i)]));
        let (breaks, extremes) = grouped(&points, f64::INFINITY, 0.4);
        assert_eq!(breaks.iter().filter(|b| b.1).map(|b| b.0).collect::<Vec<_>>(), [199]);
        assert_eq!((breaks.len(), extremes.len()), (3, 1));
    }

    #[test]
    fn a_tangent_is_that_of_the_circle() {
        let points = [[1.0, 0.0], [0.6, 0.8], [-1.0, 0.0]];
        let along = lengths_along(&points);
        let chain = Chain::of(&points, &along, 0.01);
        let [x, y] = Break { at: 1, sides: [0, 2], corner: false, line: false }.tangent(&chain);
        assert!((x + 0.8).abs() < 1e-15 && (y - 0.6).abs() < 1e-15);
    }
}
