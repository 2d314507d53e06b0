//! One stretch of the path solved for good: the interior point, the check between its points, and tighter limits
//! where that shows an excess.

use super::between::Between;
use super::exact::Exact;
use super::hermite::duration;
use super::interior_point::{Bound, Effort, InteriorPoint, Outcome, Report};
use super::rows::Rows;
use super::Limits;

/// Uses up to this hold the limits: rounding, and what peaks between the checked places are off.
const HELD: f64 = 1.0 + 5e-7;
/// Limits are tightened by so much more than the excess, in parts of it and at least; more would make kinks where
/// tightened intervals meet others.
const MARGIN: (f64, f64) = (0.1, 1e-6);
/// From time to time that an interval is tightened its margin grows by this factor: a peak may follow slowly.
const RISE: f64 = 4.0;
/// Rounds of tightening.
const ROUNDS: usize = 10;
/// What plans are multiplied with to start from, and the barrier to start with. The valid plans are star-shaped: a
/// smaller multiple is further inside, and further from the optimum. From afar …
const FAR: [(f64, f64); 1] = [(1.0, 1.0)];
/// … from a plan on its limits …
const NEAR: [(f64, f64); 4] = [(0.97, 0.1), (0.8, 1.0), (1.0, 1.0), (1.0, 1e-3)];
/// … and from one that exceeds them a little.
const AGAIN: [(f64, f64); 3] = [(0.97, 0.1), (0.8, 1.0), (0.5, 1.0)];
/// Parts of the way from the former plan to the new one where the new one itself is refused.
const RETREATS: [f64; 7] = [0.999, 0.99, 0.95, 0.85, 0.6, 0.3, 0.1];

/// Limits of some intervals, and those between their points.
#[derive(Clone, Debug)]
pub struct Stretch<const M: usize> {
    pub rows: Rows<M>,
    pub between: Between<M>,
}

/// What became of a stretch.
#[derive(Clone, Copy, Debug, Default)]
pub struct Verdict {
    /// The optimum was reached, to the tolerance.
    pub converged: bool,
    pub iterations: usize,
}

impl<const M: usize> Stretch<M> {
    /// Improves the valid plan x in place; `near` says that it is nearly optimal and on its limits. `tight` is how
    /// much tighter the limits of each interval are than the machine's, before and after.
    #[allow(clippy::too_many_arguments)] // one call
    pub fn improve(
        &mut self,
        limits: &Limits<M>,
        bounds: [Bound; 2],
        tight: &mut [[f64; 3]],
        x: &mut [f64],
        near: bool,
        effort: &Effort,
        space: &mut InteriorPoint<Exact, M>,
    ) -> Verdict {
        for (interval, &tight) in self.rows.intervals.iter_mut().zip(tight.iter()) {
            interval.tighten(tight);
        }
        self.rows.waive(&bounds);
        let mut verdict = Verdict::default();
        let mut best = if near { self.time(&bounds, x) } else { f64::INFINITY };
        let mut attempts = starts(x, if near { &NEAR } else { &FAR }, effort);
        let mut times = vec![0; tight.len()];
        for _ in 0..ROUNDS {
            let Some((y, report)) = self.attempt(bounds, attempts, space, &mut verdict.iterations) else {
                break;
            };
            if self.tighten(limits, &y, tight, &mut times) {
                if report.time < best {
                    x.copy_from_slice(&y);
                }
                verdict.converged = report.outcome != Outcome::Stopped;
                break;
            }
            // Should nothing better come: as far towards this plan as the limits allow.
            if let Some((z, time)) = self.retreat(limits, &bounds, x, &y) {
                if time < best {
                    x.copy_from_slice(&z);
                    best = time;
                }
            }
            if report.outcome == Outcome::Stopped {
                break;
            }
            attempts = starts(&y, &AGAIN, effort);
        }
        verdict
    }

    /// The first of the starts that leads to a plan; its iterations count towards all that are allowed.
    fn attempt(
        &self,
        bounds: [Bound; 2],
        starts: Vec<(Vec<f64>, Effort)>,
        space: &mut InteriorPoint<Exact, M>,
        spent: &mut usize,
    ) -> Option<(Vec<f64>, Report)> {
        for (mut y, mut effort) in starts {
            effort.max_iterations = effort.max_iterations.saturating_sub(*spent);
            let report = space.solve(&self.rows, bounds, &mut y, &effort);
            *spent += report.iterations;
            if !matches!(report.outcome, Outcome::NotInside | Outcome::Missed) {
                return Some((y, report));
            }
        }
        None
    }

    /// The spline nearest to y on the way from x that holds all limits, and its time.
    fn retreat(
        &self,
        limits: &Limits<M>,
        bounds: &[Bound; 2],
        x: &[f64],
        y: &[f64],
    ) -> Option<(Vec<f64>, f64)> {
        if !bounds.iter().zip([0, x.len() - 2]).all(|(bound, at)| bound.is_met(x[at], x[at + 1])) {
            return None;
        }
        for part in RETREATS {
            let z: Vec<f64> = x.iter().zip(y).map(|(x, y)| x + part * (y - x)).collect();
            if self.holds(limits, &z) {
                let time = self.time(bounds, &z);
                return Some((z, time));
            }
        }
        None
    }

    fn holds(&self, limits: &Limits<M>, x: &[f64]) -> bool {
        (0..self.rows.intervals.len()).all(|n| {
            let worst = self.between.utilisation(limits, x, n, self.rows.intervals[n].h);
            worst.iter().all(|&part| part <= HELD)
        })
    }

    /// Tightens the limits where x exceeds them between the points, and counts how often; true if it does nowhere.
    fn tighten(&mut self, limits: &Limits<M>, x: &[f64], tight: &mut [[f64; 3]], times: &mut [i32]) -> bool {
        let mut holds = true;
        for (n, (interval, tight)) in self.rows.intervals.iter_mut().zip(tight).enumerate() {
            let margin = MARGIN.0 * RISE.powi(times[n]);
            let used = self.between.utilisation(limits, x, n, interval.h);
            let factors =
                used.map(|used| if used > HELD { used + (margin * (used - 1.0)).max(MARGIN.1) } else { 1.0 });
            if factors != [1.0; 3] {
                holds = false;
                times[n] += 1;
                interval.tighten(factors);
                for k in 0..3 {
                    tight[k] *= factors[k];
                }
            }
        }
        holds
    }

    /// Time of a spline with its ramps.
    fn time(&self, bounds: &[Bound; 2], x: &[f64]) -> f64 {
        let inside: f64 =
            self.rows.intervals.iter().enumerate().map(|(n, interval)| duration(x, n, interval.h)).sum();
        inside + ramps(bounds, x)
    }
}

/// Time on the ramps at rest ends.
pub fn ramps(bounds: &[Bound; 2], x: &[f64]) -> f64 {
    let time = |end: usize, w: f64| match bounds[end] {
        Bound::Rest { ramp, .. } => 3.0 * ramp / w.sqrt(),
        Bound::Fixed { .. } => 0.0,
    };
    time(0, x[0]) + time(1, x[x.len() - 2])
}

/// Starts from multiples of a plan, with the barrier to begin with.
fn starts(x: &[f64], multiples: &[(f64, f64)], effort: &Effort) -> Vec<(Vec<f64>, Effort)> {
    multiples
        .iter()
        .map(|&(factor, barrier)| (x.iter().map(|x| factor * x).collect(), Effort { barrier, ..*effort }))
        .collect()
}
