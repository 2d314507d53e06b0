//! Computes starts near the optimum of a window from a solution on a coarse grid.
//!
//! An interior-point method needs most of its iterations far from the optimum, where few digits of x are enough. The window is
//! therefore first solved with a third of its intervals: a spline on the coarse grid is also one on the fine grid. Each
//! collocation point of a long interval takes the path's derivatives and limits from the nearest collocation point of the short
//! intervals. The coarse solution may exceed limits of the fine grid; a point on the way from it back to a valid plan is inside
//! them.

use super::constraints::Constraints;
use super::hermite::{self, COUNT};
use super::interior_point::{Effort, Outcome};
use super::model::Model;
use super::window_end::WindowEnd;
use super::working_space::InteriorPoint;

/// Short intervals per long interval, and the least number of short intervals of a window that is solved on the coarse grid.
const GROUP: usize = 3;
const FEWEST: usize = 30;
/// Complementarity gap of the coarse solution, as a fraction of the time.
const GAP: f64 = 0.2;
/// Lower uses of a limit are replaced by this one in quotients.
const LITTLE: f64 = 0.02;
/// A speed limit is not tightened so far that the start uses more than this of it.
const FULL: f64 = 0.9;
/// Fractions of the way from the coarse solution back to the valid plan that are tried.
const BACK: [f64; 3] = [0.05, 0.15, 0.4];

/// Splines to start from, each with its effort: the nearest to the coarse solution first, the valid plan `far` last. Also returns
/// the number of iterations spent, converted to iterations on the fine grid.
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
            starts.extend(BACK.map(|part| (hermite::blend(&far, &near, part), *effort)));
        }
    }
    starts.push((far, *effort));
    (starts, iterations)
}

/// The constraints on the coarse grid, tightened where limits change between its collocation points: by the factor by which `far`
/// uses more of them on the fine grid than x, which is `far` on the coarse grid; and the speed also to the least limit of the
/// short intervals, but only as far as x stays inside.
fn on_coarse_grid(rows: &Constraints, far: &[f64], x: &[f64]) -> Constraints {
    let mut coarse = joined(rows);
    let (all_used, all_most) = (coarse.utilisation(x), rows.utilisation(far));
    for (n, (used, all_most)) in all_used.into_iter().zip(all_most.chunks(GROUP)).enumerate() {
        let mut factors = [1.0f64; 3];
        for most in all_most {
            for (factor, (most, used)) in factors.iter_mut().zip(most.iter().zip(used)) {
                *factor = factor.max(most / used.max(LITTLE));
            }
        }
        let least = |rows: &Constraints, n: usize| (0..COUNT).map(|p| rows.speed(n, p)).fold(0.0, f64::max);
        let own = least(&coarse, n);
        if own > 0.0 {
            let short = n * GROUP..n * GROUP + all_most.len();
            let slower = (short.map(|n| least(rows, n)).fold(own, f64::max) / own).sqrt();
            factors[0] = factors[0].max(slower.min(FULL / used[0].max(LITTLE)));
        }
        coarse.tighten(n, factors);
    }
    coarse
}

/// The constraints on long intervals, each in place of `GROUP` short ones.
fn joined(rows: &Constraints) -> Constraints {
    let mut coarse = rows.emptied(rows.count().div_ceil(GROUP));
    for first in (0..rows.count()).step_by(GROUP) {
        let short = first..rows.count().min(first + GROUP);
        let h: f64 = short.clone().map(|n| rows.h(n)).sum();
        // The short interval and the index of its collocation point that is nearest.
        let nearest = hermite::POINTS.map(|part| {
            let (mut n, mut s) = (first, part * h);
            while n + 1 < short.end && s > rows.h(n) {
                s -= rows.h(n);
                n += 1;
            }
            let near = |p: &usize| (hermite::POINTS[*p] * rows.h(n) - s).abs();
            (n, (0..COUNT).min_by(|a, b| near(a).total_cmp(&near(b))).unwrap_or(0))
        });
        coarse.push_from(rows, h, short.map(|n| rows.jerk(n)).fold(1.0, f64::max), nearest);
    }
    coarse
}

/// The values of a spline on the fine grid at the stations of the coarse grid.
fn restrict(x: &[f64]) -> Vec<f64> {
    let last = x.len() - 2;
    x[..last].chunks(2 * GROUP).flat_map(|group| [group[0], group[1]]).chain([x[last], x[last + 1]]).collect()
}

/// The values of a spline on the coarse grid at the stations of the fine grid.
fn prolong(x: &[f64], rows: &Constraints) -> Vec<f64> {
    let lengths: Vec<f64> = (0..rows.count()).map(|n| rows.h(n)).collect();
    hermite::prolong(x, lengths.chunks(GROUP).map(<[f64]>::len), &lengths)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::path_problem::Limits;

    /// Constraints on intervals of these lengths; q' is the index of the collocation point, 4 per interval.
    fn rows(lengths: &[f64]) -> Constraints {
        let limits = Limits { velocity: [[1.0]; 2], acceleration: [[1.0]; 2], jerk: [1.0] };
        let mut rows = Constraints::new(&limits, &[true; 1]);
        for (n, &h) in lengths.iter().enumerate() {
            rows.push(h, 1.0 + n as f64);
            for p in 0..COUNT {
                let count = (4 * n + p) as f64;
                rows.set(p, [count; 2], 1.0, |_| [count, 100.0 + count, 200.0 + count]);
            }
        }
        rows
    }

    #[test]
    fn a_long_interval_takes_the_nearest_collocation_points_by_hand() {
        // Points at 0, 0.47, 0.93, 1.4; those of the first interval are 1/3 apart.
        let long = joined(&rows(&[1.0, 0.4]));
        assert_eq!((long.count(), long.h(0), long.jerk(0)), (1, 1.4, 2.0));
        for (p, point) in [0.0, 1.0, 3.0, 7.0].into_iter().enumerate() {
            assert_eq!(long.speed(0, p), point);
            assert_eq!(long.derivatives(0, p, 0), [point, 100.0 + point, 200.0 + point]);
        }
    }

    #[test]
    fn a_cubic_is_the_same_on_both_grids() {
        let rows = rows(&[0.3, 0.2, 0.5, 0.1, 0.4, 0.2, 0.7]);
        let cubic = |s: f64| [2.0 + s * (0.5 - s * (0.3 - 0.2 * s)), 0.5 - s * (0.6 - 0.6 * s)];
        let mut s = 0.0;
        let mut fine = cubic(s).to_vec();
        for n in 0..rows.count() {
            s += rows.h(n);
            fine.extend(cubic(s));
        }
        let coarse = restrict(&fine);
        assert_eq!(coarse.len(), 2 * 4);
        for (found, known) in prolong(&coarse, &rows).iter().zip(&fine) {
            assert!((found - known).abs() < 1e-14, "{found} and {known}");
        }
    }
}
