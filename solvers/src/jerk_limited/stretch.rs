//! One stretch of the path solved for good: the interior point, the check between its points, and tighter limits
//! where that shows an excess.

use super::between::Between;
use super::hermite::duration;
use super::interior_point::{Bound, Effort, InteriorPoint, Outcome};
use super::lanes::Lanes;
use super::rows::Rows;
use super::Limits;

/// Uses up to this hold the limits: rounding, and what peaks between the checked places are off.
const HELD: f64 = 1.0 + 2e-7;
/// Limits are tightened by so much more than the excess, in parts of it and at least. More would make kinks where
/// tightened intervals meet others.
const MARGIN: (f64, f64) = (0.1, 2e-6);
/// Rounds of tightening.
const ROUNDS: usize = 8;
/// Valid plans scaled by these factors are inside their limits; how near the optimum they are taken for.
const STARTS: [(f64, f64); 3] = [(0.97, 0.1), (0.8, 1.0), (0.5, 1.0)];
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
    /// Improves the valid plan x in place; `near` says that it is nearly optimal and on its limits.
    pub fn improve(
        &mut self,
        limits: &Limits<M>,
        bounds: [Bound; 2],
        x: &mut [f64],
        near: bool,
        effort: &Effort,
        space: &mut InteriorPoint<M>,
    ) -> Verdict {
        let asked = self.waive(&bounds);
        let mut verdict = Verdict::default();
        let mut best = f64::INFINITY;
        if near {
            best = self.time(&bounds, x);
        }
        let mut y = x.to_vec();
        let mut attempts = if near { scaled(x, &STARTS, effort) } else { vec![(x.to_vec(), *effort)] };
        let mut spent = 0;
        for _ in 0..ROUNDS {
            let mut found = None;
            for (start, effort) in &attempts {
                y.copy_from_slice(start);
                let effort =
                    Effort { max_iterations: effort.max_iterations.saturating_sub(spent), ..*effort };
                let report = space.solve(&self.rows, bounds, &mut y, &effort);
                spent += report.iterations;
                if !matches!(report.outcome, Outcome::NotInside | Outcome::Missed) {
                    found = Some(report);
                    break;
                }
            }
            let Some(report) = found else { break };
            verdict.converged = matches!(report.outcome, Outcome::Converged | Outcome::Stalled);
            if self.tighten(limits, &y) {
                if report.time < best {
                    x.copy_from_slice(&y);
                    best = report.time;
                }
                break;
            }
            // The first plan with a small excess serves as a target to approach, should nothing better come.
            if let Some((z, time)) = self.retreat(limits, &bounds, x, &y) {
                if time < best {
                    x.copy_from_slice(&z);
                    best = time;
                }
            }
            verdict.converged = false;
            if report.outcome == Outcome::Stopped {
                break;
            }
            attempts = scaled(&y, &STARTS, effort);
        }
        verdict.iterations = spent;
        self.ask(asked);
        verdict
    }

    /// The spline nearest to y on the way from x that holds all limits, and its time.
    fn retreat(
        &self,
        limits: &Limits<M>,
        bounds: &[Bound; 2],
        x: &[f64],
        y: &[f64],
    ) -> Option<(Vec<f64>, f64)> {
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

    /// Tightens the limits where x exceeds them between the points; true if it does nowhere.
    fn tighten(&mut self, limits: &Limits<M>, x: &[f64]) -> bool {
        let mut holds = true;
        for (n, interval) in self.rows.intervals.iter_mut().enumerate() {
            let [v, a, j] = self.between.utilisation(limits, x, n, interval.h);
            if v > HELD {
                interval.speed = interval.speed * tighter(v).powi(2);
            }
            if a > HELD {
                interval.acceleration = interval.acceleration * tighter(a);
            }
            if j > HELD {
                interval.jerk *= tighter(j);
            }
            holds &= v <= HELD && a <= HELD && j <= HELD;
        }
        holds
    }

    /// Speed and acceleration at given ends are what they are; returns what was asked there.
    fn waive(&mut self, bounds: &[Bound; 2]) -> [(Lanes, Lanes); 2] {
        let last = self.rows.intervals.len() - 1;
        let asked = [0, last].map(|n| (self.rows.intervals[n].speed, self.rows.intervals[n].acceleration));
        for (bound, (n, lane)) in bounds.iter().zip([(0, 0), (last, 3)]) {
            if let Bound::Fixed { .. } = bound {
                self.rows.intervals[n].speed.0[lane] = 0.0;
                self.rows.intervals[n].acceleration.0[lane] = 0.0;
            }
        }
        asked
    }

    /// Undoes `waive`, tightening kept.
    fn ask(&mut self, asked: [(Lanes, Lanes); 2]) {
        let last = self.rows.intervals.len() - 1;
        for (n, lane, (speed, acceleration)) in [(0, 0, asked[0]), (last, 3, asked[1])] {
            let interval = &mut self.rows.intervals[n];
            interval.speed.0[lane] = interval.speed.0[lane].max(speed.0[lane]);
            interval.acceleration.0[lane] = interval.acceleration.0[lane].max(acceleration.0[lane]);
        }
    }

    /// Time of a spline with its ramps.
    fn time(&self, bounds: &[Bound; 2], x: &[f64]) -> f64 {
        let inside: f64 =
            self.rows.intervals.iter().enumerate().map(|(n, interval)| duration(x, n, interval.h)).sum();
        inside + ramps(bounds, x)
    }
}

/// The factor on a limit that was used so far.
fn tighter(used: f64) -> f64 {
    used + (MARGIN.0 * (used - 1.0)).max(MARGIN.1)
}

/// Time on the ramps at rest ends.
pub fn ramps(bounds: &[Bound; 2], x: &[f64]) -> f64 {
    let time = |end: usize, w: f64| match bounds[end] {
        Bound::Rest { ramp, .. } => 3.0 * ramp / w.sqrt(),
        Bound::Fixed { .. } => 0.0,
    };
    time(0, x[0]) + time(1, x[x.len() - 2])
}

/// Starts for a plan that is on its limits.
fn scaled(x: &[f64], starts: &[(f64, f64)], effort: &Effort) -> Vec<(Vec<f64>, Effort)> {
    starts
        .iter()
        .map(|&(factor, barrier)| (x.iter().map(|x| factor * x).collect(), Effort { barrier, ..*effort }))
        .collect()
}
