//! One stretch of the path solved for good: the interior point, the check between its points, and tighter limits
//! where that shows an excess.

use super::between::Between;
use super::exact::Exact;
use super::hermite::duration;
use super::interior_point::{Bound, Effort, InteriorPoint, Outcome, Report};
use super::rows::Rows;

/// Uses up to this hold the limits: rounding, and what peaks between the checked places are off.
pub const HELD: f64 = 1.0 + 4e-7;
/// Limits are tightened by so much more than the excess, in parts of it and at least; more would make kinks where
/// tightened intervals meet others.
const MARGIN: [f64; 2] = [0.1, 1e-6];
/// From time to time that an interval is tightened its margin grows by this factor: a peak may follow slowly.
const RISE: f64 = 4.0;
/// Rounds of tightening.
const ROUNDS: usize = 10;
/// The first round ends at this gap of complementarity: where the points then use more than this part of a limit,
/// the peaks beside them stand out as they will in the end.
const ROUGH: (f64, f64) = (1e-4, 0.97);
/// Peaks that stand out by more, in parts of what the points use, move before the end.
const FIRM: f64 = 1.05;
/// What of the way back to the first plan is tried to be inside tightened limits …
const BACK: [f64; 13] = [3e-7, 1e-6, 3e-6, 1e-5, 3e-5, 1e-4, 3e-4, 1e-3, 3e-3, 1e-2, 3e-2, 0.1, 0.3];
/// … and how many times as far the start is, not to begin on a limit.
const FURTHER: f64 = 2.0;
/// The barrier to begin with there, in parts of the way back.
const BARRIER: f64 = 0.03;
/// What of the way from the former plan to the new one is left where the new one itself is refused.
const RETREATS: [f64; 11] = [1e-6, 3e-6, 1e-5, 1e-4, 1e-3, 0.01, 0.05, 0.15, 0.4, 0.7, 0.9];
/// A retreat that costs no more than this many times the tolerance is as good as the plan.
const CHEAP: f64 = 10.0;

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
    /// How far above the least time on its grid the plan is, in s, by the complementarity that its multipliers leave.
    pub excess: f64,
    pub iterations: usize,
}

impl<const M: usize> Stretch<M> {
    /// Improves the valid plan x in place.
    pub fn improve(
        &mut self,
        bounds: [Bound; 2],
        x: &mut [f64],
        effort: &Effort,
        space: &mut InteriorPoint<Exact, M>,
    ) -> Verdict {
        self.rows.waive(&bounds);
        let mut verdict = Verdict { excess: self.time(&bounds, x), ..Verdict::default() };
        let (mut best, mut improved) = (f64::INFINITY, x.to_vec());
        let rough = Effort { tolerance: effort.tolerance.max(ROUGH.0), ..*effort };
        let mut attempts = vec![(x.to_vec(), rough)];
        let mut times = vec![0; self.rows.intervals.len()];
        for round in 0..ROUNDS {
            let Some((y, report)) = self.attempt(bounds, attempts, space, &mut verdict.iterations) else {
                break;
            };
            let holds = self.tighten(&y, &mut times, round == 0);
            let stopped = report.outcome == Outcome::Stopped;
            if holds && (round > 0 || stopped) {
                if report.time < best {
                    improved = y;
                    verdict.excess = report.excess;
                }
                verdict.converged = !stopped;
                break;
            }
            // Should nothing better come: as far towards this plan as the limits allow.
            if let Some((z, time)) = self.retreat(&bounds, x, &y) {
                if time < best {
                    best = time;
                    improved.copy_from_slice(&z);
                    verdict.excess = report.excess + (time - report.time);
                }
                verdict.converged =
                    !stopped && round > 0 && time <= report.time * (1.0 + CHEAP * effort.tolerance);
            }
            if stopped || verdict.converged {
                break;
            }
            attempts = self.starts(&bounds, x, &y, effort);
        }
        x.copy_from_slice(&improved);
        verdict
    }

    /// The first of the starts that leads to a plan; its iterations count towards all that are allowed.
    fn attempt(
        &self,
        bounds: [Bound; 2],
        starts: Vec<(Vec<f64>, Effort<'_>)>,
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

    /// Starts inside the tightened limits, on the ways back from the last plan y, nearest to it first.
    fn starts<'e>(
        &self,
        bounds: &[Bound; 2],
        x: &[f64],
        y: &[f64],
        effort: &Effort<'e>,
    ) -> Vec<(Vec<f64>, Effort<'e>)> {
        let inside = |z: &[f64]| {
            (0..self.rows.intervals.len()).all(|n| self.rows.utilisation(z, n).iter().all(|&used| used < 1.0))
        };
        let ways = ways_back(bounds, x);
        let is_near = |part: f64| ways.iter().find(|way| inside(&blend(way, y, part)));
        let near = BACK.into_iter().find_map(|part| Some((part, is_near(part)?)));
        let Some((least, way)) = near else { return vec![] };
        BACK.into_iter()
            .filter(|&part| part >= least)
            .map(|part| {
                let start = Effort { barrier: BARRIER * part, warm: true, ..*effort };
                (blend(way, y, FURTHER * part), start)
            })
            .collect()
    }

    /// The spline nearest to y on a way back that holds all limits, and its time.
    fn retreat(&self, bounds: &[Bound; 2], x: &[f64], y: &[f64]) -> Option<(Vec<f64>, f64)> {
        if !bounds.iter().zip([0, x.len() - 2]).all(|(bound, at)| bound.is_met(x[at], x[at + 1])) {
            return None;
        }
        let ways = ways_back(bounds, x);
        let held = |part: f64| ways.iter().map(|way| blend(way, y, part)).find(|z| self.holds(z, HELD));
        let z = RETREATS.into_iter().find_map(held)?;
        let time = self.time(bounds, &z);
        Some((z, time))
    }

    /// Whether x uses no limit of the machine by more than a part.
    pub fn holds(&self, x: &[f64], most: f64) -> bool {
        (0..self.rows.intervals.len()).all(|n| {
            let worst = self.between.utilisation(x, n, self.rows.intervals[n].h);
            worst.iter().all(|&part| part <= most)
        })
    }

    /// Tightens the limits where x exceeds them between the points, and counts how often; false if it does somewhere.
    /// A rough x stays inside its limits: there they are tightened by how far peaks stand out over the points.
    fn tighten(&mut self, x: &[f64], times: &mut [i32], rough: bool) -> bool {
        let mut holds = true;
        for (n, times) in times.iter_mut().enumerate() {
            let margin = MARGIN.map(|least| least * RISE.powi(*times));
            let mut used = self.between.utilisation(x, n, self.rows.intervals[n].h);
            holds &= used.iter().all(|&used| used <= HELD);
            if rough {
                let at = self.rows.utilisation(x, n);
                for (used, at) in used.iter_mut().zip(at) {
                    if at > ROUGH.1 && *used < FIRM * at {
                        *used /= at;
                    }
                }
            }
            let factors =
                used.map(
                    |used| if used > HELD { used + (margin[0] * (used - 1.0)).max(margin[1]) } else { 1.0 },
                );
            if factors != [1.0; 3] {
                *times += 1;
                self.rows.intervals[n].tighten(factors);
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

/// Where ways back from a plan lead: to the first plan x, and where both ends rest to standstill. On the first the jerk
/// may rise, which is the product of two numbers that both change; on the second every limit is used less and less.
fn ways_back(bounds: &[Bound; 2], x: &[f64]) -> Vec<Vec<f64>> {
    let rests = bounds.iter().all(|bound| matches!(bound, Bound::Rest { .. }));
    let standstill = rests.then(|| vec![0.0; x.len()]);
    std::iter::once(x.to_vec()).chain(standstill).collect()
}

/// A part of the way back from y to x.
fn blend(x: &[f64], y: &[f64], part: f64) -> Vec<f64> {
    x.iter().zip(y).map(|(x, y)| y + part * (x - y)).collect()
}
