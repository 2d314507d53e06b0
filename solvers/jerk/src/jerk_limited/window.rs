//! One window solved to its optimum within all limits: the interior-point method at the collocation points, the check
//! between them, and tighter limits on the intervals where the check shows an excess.

use super::coarse;
use super::constraints::Constraints;
use super::exact::Exact;
use super::hermite::{blend, duration};
use super::interior_point::{Effort, Outcome, Report};
use super::intersample_check::IntersampleCheck;
use super::refinement::RoughPlan;
use super::window_end::WindowEnd;
use super::working_space::InteriorPoint;
use crate::path_problem::Limits;

/// A limit counts as kept up to this use: it allows for rounding and for the error of the peaks estimated between samples.
pub const HELD: f64 = 1.0 + 2e-7;
/// Limits are tightened by the excess plus a margin: this fraction of the excess, and at least this fraction of the limit.
/// Greater margins would make kinks beside intervals that are not tightened.
const MARGIN: [f64; 2] = [0.1, 1e-6];
/// The margin of an interval grows by this factor each time it is tightened again, because a peak may react slowly.
const RISE: f64 = 4.0;
/// Greatest number of rounds of solving and tightening.
const ROUNDS: usize = 10;
/// The iterations start from this multiple of the first plan's w, because the first plan may be on a limit.
const INSIDE: f64 = 0.8;
/// Fractions of the way from the last plan back to the first plan or to standstill. The least one that leads inside the tightened
/// limits, and all greater ones, give starts.
const BACK: [f64; 13] = [3e-7, 1e-6, 3e-6, 1e-5, 3e-5, 1e-4, 3e-4, 1e-3, 3e-3, 1e-2, 3e-2, 0.1, 0.3];
/// A start is farther back by this factor, so that it is not on a limit.
const FURTHER: f64 = 1.5;
/// The first barrier of such a start, as a multiple of its fraction of the way back.
const BARRIER: f64 = 0.1;
/// Fractions of the way from a rough plan to the first plan that are tried as starts, and the first barrier there.
const NEAR: [f64; 3] = [0.05, 0.15, 0.4];
const NEAR_BARRIER: f64 = 0.1;
/// Fractions of the way from a new plan that breaks a limit back to the first plan or to standstill, tried in this order.
const RETREATS: [f64; 11] = [1e-6, 3e-6, 1e-5, 1e-4, 1e-3, 0.01, 0.05, 0.15, 0.4, 0.7, 0.9];
/// A retreat counts as converged if it costs at most this multiple of the tolerance, as a fraction of the time.
const CHEAP: f64 = 10.0;

/// The constraints on a range of intervals, and the check between their collocation points.
#[derive(Clone, Debug)]
pub struct Window {
    pub rows: Constraints,
    pub check: IntersampleCheck,
}

#[derive(Clone, Copy, Debug, Default)]
pub struct WindowReport {
    /// Whether the optimum was reached, to the tolerance.
    pub converged: bool,
    /// Estimate of the time above the least time on the grid, in s, from the complementarity gap.
    pub excess: f64,
    pub iterations: usize,
}

impl Window {
    /// A window without intervals, for the limits of the axes that move.
    pub fn new<const M: usize>(limits: &Limits<M>, moves: &[bool; M]) -> Self {
        Self { rows: Constraints::new(limits, moves), check: IntersampleCheck::new(limits, moves) }
    }

    /// Improves the valid plan x in place, with starts near the rough plan if there is one. The caller has dropped the limits at
    /// given ends.
    pub fn improve(
        &mut self,
        ends: [WindowEnd; 2],
        x: &mut [f64],
        rough: Option<&RoughPlan>,
        effort: &Effort,
        space: &mut InteriorPoint<Exact>,
    ) -> WindowReport {
        let mut verdict = WindowReport { excess: self.time(&ends, x), ..WindowReport::default() };
        let (mut best, mut improved) = (f64::INFINITY, x.to_vec());
        self.rows.accelerates = rough.is_none_or(|rough| rough.accelerates);
        let far = inside(x);
        let mut attempts = vec![];
        if let Some(RoughPlan { x: near, peaks, .. }) = rough {
            for (n, &peaks) in peaks.iter().enumerate().filter(|(_, peaks)| **peaks != [1.0; 3]) {
                self.rows.tighten(n, peaks.map(f64::from));
            }
            let own = Effort { barrier: NEAR_BARRIER, ..*effort };
            attempts.extend(NEAR.map(|part| (blend(&far, near, part), own)));
        }
        attempts.push((far.clone(), *effort));
        let mut times = vec![0; self.rows.count()];
        for round in 1..=ROUNDS {
            let Some((y, report)) = self.attempt(ends, attempts, space, &mut verdict.iterations) else {
                break;
            };
            let used = self.check.utilisation(&self.rows, &y);
            let stopped = report.outcome == Outcome::Stopped;
            let accelerates = used.iter().any(|used| used[1] > HELD);
            if accelerates && !self.rows.accelerates && !stopped && round < ROUNDS {
                self.rows.accelerates = true;
                attempts = vec![(far.clone(), *effort)];
                continue;
            }
            let holds = self.tighten(&used, &mut times);
            if holds {
                if report.time < best {
                    improved = y;
                    verdict.excess = report.excess;
                }
                verdict.converged = !stopped;
                break;
            }
            // A fallback: the spline between the first plan x and this plan that is nearest to this plan and keeps the limits.
            if let Some((z, time)) = self.retreat(&ends, x, &y) {
                if time < best {
                    best = time;
                    improved.copy_from_slice(&z);
                    verdict.excess = report.excess + (time - report.time);
                }
                verdict.converged = !stopped && time <= report.time * (1.0 + CHEAP * effort.tolerance);
            }
            if stopped || verdict.converged || round == ROUNDS {
                break;
            }
            attempts = self.starts(&ends, x, &y, effort);
        }
        x.copy_from_slice(&improved);
        verdict
    }

    /// A rough optimum under the limits at the collocation points, from the valid plan x; None if it is not found. The
    /// acceleration gets rows only if the plan without these rows comes near to a limit of acceleration.
    pub fn rough(
        &mut self,
        ends: [WindowEnd; 2],
        x: &[f64],
        effort: &Effort,
        space: &mut InteriorPoint<Exact>,
    ) -> Option<RoughPlan> {
        self.rows.accelerates = false;
        loop {
            let (starts, mut spent) = coarse::starts(&self.rows, ends, inside(x), effort, space);
            if !self.rows.accelerates && self.rows.utilisation(&starts[0].0).iter().any(|used| used[1] > 1.0)
            {
                self.rows.accelerates = true;
                continue;
            }
            let (y, report) = self.attempt(ends, starts, space, &mut spent)?;
            if report.outcome == Outcome::Stopped {
                return None;
            }
            let plan = RoughPlan::new(&self.rows, &self.check, y, &space.state.dual);
            if self.rows.accelerates || !plan.accelerates {
                return Some(plan);
            }
            self.rows.accelerates = true;
        }
    }

    /// Solves from each start in turn until one leads to a plan, and returns that plan. Adds the iterations of all starts to
    /// `spent`.
    fn attempt(
        &self,
        ends: [WindowEnd; 2],
        starts: Vec<(Vec<f64>, Effort<'_>)>,
        space: &mut InteriorPoint<Exact>,
        spent: &mut usize,
    ) -> Option<(Vec<f64>, Report)> {
        for (mut y, mut effort) in starts {
            effort.max_iterations = effort.max_iterations.saturating_sub(*spent);
            let report = space.solve(&self.rows, ends, &mut y, &effort);
            *spent += report.iterations;
            if !matches!(report.outcome, Outcome::NotInside | Outcome::Missed) {
                return Some((y, report));
            }
        }
        None
    }

    /// Starts inside the tightened limits, between the last plan y and the targets of `ways_back`, the nearest to y first. The
    /// last one is the start of the first round, far from y.
    fn starts<'e>(
        &self,
        ends: &[WindowEnd; 2],
        x: &[f64],
        y: &[f64],
        effort: &Effort<'e>,
    ) -> Vec<(Vec<f64>, Effort<'e>)> {
        let is_inside = |z: &[f64]| self.rows.utilisation(z).as_flattened().iter().all(|&used| used < 1.0);
        let far = inside(x);
        let ways = ways_back(ends, far.clone());
        let is_near = |part: f64| ways.iter().find(|way| is_inside(&blend(way, y, part)));
        let mut starts = vec![];
        if let Some((least, way)) = BACK.into_iter().find_map(|part| Some((part, is_near(part)?))) {
            starts.extend(BACK.into_iter().filter(|&part| part >= least).map(|part| {
                let start = Effort { barrier: BARRIER * part, warm: true, ..*effort };
                (blend(way, y, FURTHER * part), start)
            }));
        }
        starts.push((far, *effort));
        starts
    }

    /// The spline nearest to y, among the `RETREATS` from y, that keeps all limits, and its time in s. None if there is none or
    /// if y misses a given end.
    fn retreat(&self, ends: &[WindowEnd; 2], x: &[f64], y: &[f64]) -> Option<(Vec<f64>, f64)> {
        if !ends.iter().zip([0, x.len() - 2]).all(|(kind, at)| kind.is_met(x[at], x[at + 1])) {
            return None;
        }
        let ways = ways_back(ends, x.to_vec());
        let held = |part: f64| ways.iter().map(|way| blend(way, y, part)).find(|z| self.holds(z, HELD));
        let z = RETREATS.into_iter().find_map(held)?;
        let time = self.time(ends, &z);
        Some((z, time))
    }

    /// Whether the use of each machine limit by x, also between the collocation points, is at most `most`.
    pub fn holds(&self, x: &[f64], most: f64) -> bool {
        self.check.utilisation(&self.rows, x).as_flattened().iter().all(|&used| used <= most)
    }

    /// Tightens the limits on each interval where their use (`all`) exceeds them, and counts in `times` how often. Returns
    /// whether no interval exceeds them.
    fn tighten(&mut self, all: &[[f64; 3]], times: &mut [i32]) -> bool {
        let mut holds = true;
        for (n, (times, used)) in times.iter_mut().zip(all).enumerate() {
            if used.iter().all(|&used| used <= HELD) {
                continue;
            }
            holds = false;
            let margin = MARGIN.map(|least| least * RISE.powi(*times));
            let factor =
                |used: f64| if used > HELD { used + (margin[0] * (used - 1.0)).max(margin[1]) } else { 1.0 };
            *times += 1;
            self.rows.tighten(n, used.map(factor));
        }
        holds
    }

    fn time(&self, ends: &[WindowEnd; 2], x: &[f64]) -> f64 {
        let inside: f64 = (0..self.rows.count()).map(|n| duration(x, n, self.rows.h(n))).sum();
        inside + ramps(ends, x)
    }
}

/// The time on the ramps of ends at rest, in s.
pub fn ramps(ends: &[WindowEnd; 2], x: &[f64]) -> f64 {
    let time = |end: usize, w: f64| match ends[end] {
        WindowEnd::Rest { ramp, .. } => ramp.way() / w.sqrt(),
        WindowEnd::Fixed { .. } | WindowEnd::Free => 0.0,
    };
    time(0, x[0]) + time(1, x[x.len() - 2])
}

/// The splines towards which a plan is moved back: the first plan x, and standstill (w = 0) if both ends rest. On the way to x
/// the jerk may rise, because it is a product of two factors that both change; on the way to standstill every use falls.
fn ways_back(ends: &[WindowEnd; 2], x: Vec<f64>) -> Vec<Vec<f64>> {
    let rests = ends.iter().all(|kind| matches!(kind, WindowEnd::Rest { .. }));
    let standstill = rests.then(|| vec![0.0; x.len()]);
    std::iter::once(x).chain(standstill).collect()
}

/// A plan strictly inside all limits, from a plan that keeps them.
fn inside(x: &[f64]) -> Vec<f64> {
    x.iter().map(|x| INSIDE * x).collect()
}

#[cfg(test)]
mod tests {
    use super::super::prepare::Prepared;
    use super::super::profiles::{problem, Winding};
    use super::*;
    use crate::path_problem;
    use feedplan_geometry::watch::Watch;

    /// Plans a winding path with this acceleration limit in mm/s². Returns its time in s, and whether the acceleration has rows
    /// at the end. `says` replaces the `accelerates` of the rough plan.
    fn planned(acceleration: f64, says: Option<bool>) -> (f64, bool) {
        let limits =
            Limits { velocity: [[250.0; 2]; 2], acceleration: [[acceleration; 2]; 2], jerk: [50_000.0; 2] };
        let path = Winding::new(1.0);
        let problem = problem(&path, limits);
        let prepared = Prepared::new(&problem, &path_problem::Effort::default()).expect("a first plan");
        let mut window = Window::new(&limits, &[true; 2]);
        prepared.fill(0..prepared.grid.pieces.len(), &mut window);
        window.rows.drop_at_ends(&prepared.ends);
        let (barrier, watch) = (1.0, Watch::default());
        let effort =
            Effort { tolerance: 1e-7, max_iterations: 400, deadline: None, barrier, warm: false, watch };
        let mut space = InteriorPoint::default();
        let mut rough = window.rough(prepared.ends, &prepared.x, &effort, &mut space).expect("a rough plan");
        assert_eq!(rough.accelerates, window.rows.accelerates);
        rough.accelerates = says.unwrap_or(rough.accelerates);
        let mut x = prepared.x.clone();
        let report = window.improve(prepared.ends, &mut x, Some(&rough), &effort, &mut space);
        assert!(report.converged && window.holds(&x, HELD));
        (window.time(&prepared.ends, &x), window.rows.accelerates)
    }

    #[test]
    fn the_acceleration_has_rows_where_it_needs_them() {
        for (acceleration, needs) in [(20_000.0, false), (1000.0, true)] {
            let (time, rows) = planned(acceleration, None);
            assert_eq!(rows, needs, "{acceleration} mm/s²");
            for says in [false, true] {
                let (other, rows) = planned(acceleration, Some(says));
                assert!((other / time - 1.0).abs() < 1e-6, "{other} and {time} s for {acceleration} mm/s²");
                assert_eq!(rows, needs || says);
            }
        }
    }
}
