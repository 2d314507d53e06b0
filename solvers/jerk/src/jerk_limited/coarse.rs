//! Starts near the optimum of a window, from a solution on a coarse grid.
//!
//! Far from the optimum an interior point needs most of its iterations, and few digits of x. So the window is first solved
//! with a third of its intervals: a spline on the coarse grid is one on the fine grid, too. Each collocation point of a
//! long interval takes the path and its limits from the nearest collocation point of the short intervals. The coarse
//! solution may exceed limits of the fine grid; a part of the way back to a valid plan leads inside them.

use super::constraints::{Constraints, Interval};
use super::hermite;
use super::interior_point::{Effort, Outcome};
use super::model::Model;
use super::window_end::WindowEnd;
use super::working_space::InteriorPoint;

/// Short intervals in a long one, and the fewest in a window that is solved on the coarse grid.
const GROUP: usize = 3;
const FEWEST: usize = 30;
/// Complementarity gap of the coarse solution, as a part of the time.
const GAP: f64 = 0.2;
/// The first μ after it, as in `Effort`.
const BARRIER: f64 = 0.3;
/// Uses of a limit below this part do not count.
const LITTLE: f64 = 0.02;
/// Use of a speed limit by a start that leaves room.
const FULL: f64 = 0.9;
/// Parts of the way back that are tried.
const BACK: [f64; 3] = [0.05, 0.15, 0.4];

/// Splines to start from, each with its effort: the nearest to the coarse solution first, the valid plan `far` last. With the
/// iterations spent, as a number of those on the fine grid.
pub fn starts<'e, X: Model>(
    rows: &Constraints,
    ends: [WindowEnd; 2],
    far: Vec<f64>,
    effort: &Effort<'e>,
    space: &mut InteriorPoint<X>,
) -> (Vec<(Vec<f64>, Effort<'e>)>, usize) {
    let mut starts = vec![];
    let mut iterations = 0;
    if rows.count() >= FEWEST {
        let mut x = restrict(&far);
        let coarse = on_coarse_grid(rows, &far, &x);
        let report = space.solve(&coarse, ends, &mut x, &Effort { tolerance: GAP, ..*effort });
        iterations = report.iterations.div_ceil(GROUP);
        if report.outcome == Outcome::Converged {
            let near = prolong(&x, rows);
            let own = Effort { barrier: BARRIER, ..*effort };
            starts.extend(BACK.map(|part| (hermite::blend(&far, &near, part), own)));
        }
    }
    starts.push((far, *effort));
    (starts, iterations)
}

/// The constraints on the coarse grid, tightened where limits change between its collocation points: by what `far` uses more
/// of them on the fine grid, and to the least of the speed limits if x, which is `far` on the coarse grid, leaves room.
fn on_coarse_grid(rows: &Constraints, far: &[f64], x: &[f64]) -> Constraints {
    let intervals: Vec<Interval> = rows.intervals().collect();
    let mut coarse = rows.clone();
    coarse.replace(intervals.chunks(GROUP).map(joined));
    let (all_used, all_most) = (coarse.utilisation(x), rows.utilisation(far));
    for (n, (short, all_most)) in intervals.chunks(GROUP).zip(all_most.chunks(GROUP)).enumerate() {
        let used = all_used[n];
        let mut factors = [1.0f64; 3];
        for most in all_most {
            for (factor, (most, used)) in factors.iter_mut().zip(most.iter().zip(used)) {
                *factor = factor.max(most / used.max(LITTLE));
            }
        }
        let least = |interval: &Interval| interval.speed.iter().copied().fold(0.0, f64::max);
        let own = least(&coarse.interval(n));
        if own > 0.0 {
            let slower = (short.iter().map(least).fold(own, f64::max) / own).sqrt();
            factors[0] = factors[0].max(slower.min(FULL / used[0].max(LITTLE)));
        }
        coarse.tighten(n, factors);
    }
    coarse
}

/// A long interval in place of short ones.
fn joined(short: &[Interval]) -> Interval {
    let h: f64 = short.iter().map(|interval| interval.h).sum();
    // The short interval and the index of the nearest collocation point.
    let nearest = hermite::POINTS.map(|part| {
        let (mut at, mut s) = (0, part * h);
        while at + 1 < short.len() && s > short[at].h {
            s -= short[at].h;
            at += 1;
        }
        let near = |p: &usize| (hermite::POINTS[*p] * short[at].h - s).abs();
        (at, (0..hermite::COUNT).min_by(|a, b| near(a).total_cmp(&near(b))).unwrap_or(0))
    });
    Interval {
        h,
        q: nearest.map(|(at, p)| short[at].q[p]),
        speed: nearest.map(|(at, p)| short[at].speed[p]),
        acceleration: nearest.map(|(at, p)| short[at].acceleration[p]),
        jerk: short.iter().map(|interval| interval.jerk).fold(1.0, f64::max),
    }
}

/// A spline's values at the stations of the coarse grid.
fn restrict(x: &[f64]) -> Vec<f64> {
    let last = x.len() - 2;
    x[..last].chunks(2 * GROUP).flat_map(|group| [group[0], group[1]]).chain([x[last], x[last + 1]]).collect()
}

/// A spline on the coarse grid at the stations of the fine grid.
fn prolong(x: &[f64], rows: &Constraints) -> Vec<f64> {
    let lengths: Vec<f64> = (0..rows.count()).map(|n| rows.h(n)).collect();
    let mut out = Vec::with_capacity(2 * rows.count() + 2);
    for (n, short) in lengths.chunks(GROUP).enumerate() {
        let h: f64 = short.iter().sum();
        let u = hermite::local(x, n, h);
        let mut s = 0.0;
        for own in short {
            let [value, slope, _] = hermite::at(s / h).map(|basis| hermite::combine(&basis, &u));
            out.extend([value, slope / h]);
            s += own;
        }
    }
    out.extend(&x[x.len() - 2..]);
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::path_problem::{Limits, MOST_AXES};

    /// Intervals of these lengths; q' counts the collocation points, 4 for each interval.
    fn rows(lengths: &[f64]) -> Constraints {
        let limits = Limits { velocity: [[1.0]; 2], acceleration: [[1.0]; 2], jerk: [1.0] };
        let interval = |(n, &h): (usize, &f64)| Interval {
            h,
            q: std::array::from_fn(|p| {
                let mut q = [[0.0; 3]; MOST_AXES];
                q[0] = std::array::from_fn(|order| (100 * order + 4 * n + p) as f64);
                q
            }),
            speed: std::array::from_fn(|p| (4 * n + p) as f64),
            acceleration: [1.0; 4],
            jerk: 1.0 + n as f64,
        };
        let mut rows = Constraints::new(&limits);
        rows.replace(lengths.iter().enumerate().map(interval));
        rows
    }

    #[test]
    fn a_long_interval_takes_the_nearest_collocation_points_by_hand() {
        // Points at 0, 0.47, 0.93, 1.4; those of the first interval are 1/3 apart.
        let short: Vec<_> = rows(&[1.0, 0.4]).intervals().collect();
        let long = joined(&short);
        assert_eq!((long.h, long.jerk), (1.4, 2.0));
        let points = [0.0, 1.0, 3.0, 7.0];
        assert_eq!(long.speed, points);
        for order in 0..3 {
            assert_eq!(long.q.map(|q| q[0][order]), points.map(|point| (100 * order) as f64 + point));
        }
    }

    #[test]
    fn a_cubic_is_the_same_on_both_grids() {
        let rows = rows(&[0.3, 0.2, 0.5, 0.1, 0.4, 0.2, 0.7]);
        let cubic = |s: f64| [2.0 + s * (0.5 - s * (0.3 - 0.2 * s)), 0.5 - s * (0.6 - 0.6 * s)];
        let mut s = 0.0;
        let mut fine = cubic(s).to_vec();
        for interval in rows.intervals() {
            s += interval.h;
            fine.extend(cubic(s));
        }
        let coarse = restrict(&fine);
        assert_eq!(coarse.len(), 2 * 4);
        for (found, known) in prolong(&coarse, &rows).iter().zip(&fine) {
            assert!((found - known).abs() < 1e-14, "{found} and {known}");
        }
    }
}
