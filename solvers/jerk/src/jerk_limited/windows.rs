//! Paths of any length, in windows that overlap and are solved in parallel.
//!
//! A window is solved between places of the first plan, well inside all limits. What that changes decays with the
//! travel time from its ends: two windows agree to 1e-8 two or three times of a stop inside their overlap, and are
//! blended there. Ends at the optimum of another window would lie on its limits, with next to nothing between those
//! to start from. A few windows at a time are in memory.

use std::ops::Range;

use rayon::prelude::*;

use super::exact::Exact;
use super::hermite::duration;
use super::interior_point::{self, Bound, InteriorPoint};
use super::prepare::{Prepared, PREPARING};
use super::stretch::{ramps, Verdict};
use super::{Effort, Fault, Geometry, Plan, Problem, Profile};

/// Windows reach so many times of a stop of the first plan beyond their cuts, and so many intervals: the optimum takes
/// down to a third of its time.
const REACH: (f64, usize) = (14.0, 80);
/// Windows last so many of them from cut to cut, at least.
const LONG: f64 = 36.0;
/// Windows solved between two hand-outs, for each thread.
const BATCH: usize = 2;
/// Windows are blended over one of so many parts of their overlap, where they agree best; else over one of fewer.
const BLENDS: [usize; 4] = [8, 4, 2, 1];
/// Uses of the limits that a blend may have: a little more than a window.
const BLENDED: f64 = 1.0 + 5e-7;

/// See `jerk_limited::stream`.
pub fn solve<G: Geometry<M>, const M: usize>(
    problem: &Problem<G, M>,
    effort: &Effort,
    mut finished: impl FnMut(&Profile),
) -> Result<Plan, Fault> {
    let prepared = Prepared::new(problem, effort)?;
    let mut x = prepared.x.clone();
    let run = Run { prepared: &prepared, effort, nodes: &prepared.grid.nodes };
    let windows = run.windows();
    let watch = effort.watch.part(1.0 - PREPARING).each(windows.iter().map(Range::len).sum());
    let mut counts = Counts { converged: true, steps: 0.0, excess: 0.0 };
    let mut done = 0;
    for first in (0..windows.len()).step_by(BATCH * rayon::current_num_threads()) {
        if effort.expired() {
            counts.converged = false;
            break;
        }
        let batch = first..windows.len().min(first + BATCH * rayon::current_num_threads());
        let solved: Vec<_> = windows[batch.clone()]
            .par_iter()
            .map_init(InteriorPoint::default, |space, range| {
                let solved = run.solve(range, space);
                watch.advance(range.len());
                solved
            })
            .collect();
        for (at, (y, verdict)) in batch.clone().zip(solved) {
            counts.add(&verdict, windows[at].len());
            let reached = if at == 0 { 0 } else { windows[at - 1].end };
            if !run.join(&mut x, reached, &windows[at], &y) {
                // No blend keeps the limits: this window begins at a place of the first plan, where the last one ends.
                let rest = reached..windows[at].end;
                let (y, verdict) = run.solve(&rest, &mut InteriorPoint::default());
                counts.add(&verdict, rest.len());
                counts.converged = false;
                x[2 * rest.start..2 * rest.end + 2].copy_from_slice(&y);
            }
        }
        // Final is what the next window does not reach.
        let final_node = windows.get(batch.end).map_or(run.nodes.len() - 1, |next| next.start);
        finished(&run.profile(&x, done..final_node));
        done = final_node;
    }
    if done + 1 < run.nodes.len() {
        finished(&run.profile(&x, done..run.nodes.len() - 1));
    }
    for (bound, node) in prepared.bounds.iter().zip([0, run.nodes.len() - 1]) {
        if !bound.is_met(x[2 * node], x[2 * node + 1]) {
            return Err(Fault::NoPlan { s: run.nodes[node] });
        }
    }
    let count = run.nodes.len() - 1;
    let time: f64 = (0..count).map(|n| duration(&x, n, run.nodes[n + 1] - run.nodes[n])).sum();
    Ok(Plan {
        time: time + ramps(&prepared.bounds, &x),
        converged: counts.converged,
        excess: counts.excess,
        iterations: counts.steps / count as f64,
        profile: run.profile(&x, 0..count),
    })
}

struct Counts {
    converged: bool,
    /// Newton steps times intervals.
    steps: f64,
    /// In s; what windows share counts in each of them.
    excess: f64,
}

impl Counts {
    fn add(&mut self, verdict: &Verdict, intervals: usize) {
        self.converged &= verdict.converged;
        self.excess += verdict.excess;
        self.steps += (verdict.iterations * intervals) as f64;
    }
}

struct Run<'a, G, const M: usize> {
    prepared: &'a Prepared<'a, G, M>,
    effort: &'a Effort<'a>,
    nodes: &'a [f64],
}

impl<G: Geometry<M>, const M: usize> Run<'_, G, M> {
    /// The windows, each with what it shares with its neighbours.
    fn windows(&self) -> Vec<Range<usize>> {
        let cuts = self.cuts();
        let reach = |from: usize, to: usize| {
            let step = |n: usize| if to > from { n + 1 } else { n - 1 };
            let (mut n, mut time) = (from, 0.0);
            while n != to && (n.abs_diff(from) < REACH.1 || time < REACH.0 * self.prepared.stop_time) {
                time += self.lasts(n.min(step(n)));
                n = step(n);
            }
            n
        };
        let middle = |i: usize| (cuts[i] + cuts[i + 1]) / 2;
        let last = cuts.len() - 2;
        (0..=last)
            .map(|i| {
                let start = if i == 0 { 0 } else { reach(cuts[i], middle(i - 1)) };
                let end = if i == last { cuts[i + 1] } else { reach(cuts[i + 1], middle(i + 1)) };
                start..end
            })
            .collect()
    }

    /// The nodes between windows, the ends of the path among them.
    fn cuts(&self) -> Vec<usize> {
        let count = self.nodes.len() - 1;
        let long = LONG * self.prepared.stop_time;
        let mut cuts = vec![0];
        let (mut last, mut time) = (0, 0.0);
        for n in 0..count {
            time += self.lasts(n);
            if n + 1 - last >= self.effort.window && time >= long {
                cuts.push(n + 1);
                (last, time) = (n + 1, 0.0);
            }
        }
        // A short rest belongs to the window before it.
        if cuts.len() > 1 && last < count {
            cuts.pop();
        }
        if cuts[cuts.len() - 1] < count {
            cuts.push(count);
        }
        cuts
    }

    /// Time of an interval in the first plan.
    fn lasts(&self, n: usize) -> f64 {
        duration(&self.prepared.x, n, self.nodes[n + 1] - self.nodes[n])
    }

    /// A window between places of the first plan.
    fn solve(&self, range: &Range<usize>, space: &mut InteriorPoint<Exact, M>) -> (Vec<f64>, Verdict) {
        let mut y = self.prepared.x[2 * range.start..2 * range.end + 2].to_vec();
        let fixed = |at: usize| Bound::Fixed { w: y[at], slope: y[at + 1] };
        let mut bounds = [fixed(0), fixed(y.len() - 2)];
        if range.start == 0 {
            bounds[0] = self.prepared.bounds[0];
        }
        if range.end + 1 == self.nodes.len() {
            bounds[1] = self.prepared.bounds[1];
        }
        let effort = interior_point::Effort {
            tolerance: self.effort.tolerance,
            max_iterations: self.effort.max_iterations,
            deadline: self.effort.deadline,
            barrier: 1.0,
            warm: false,
            watch: self.effort.watch,
        };
        let mut stretch = self.prepared.stretch(range.clone());
        let verdict = stretch.improve(bounds, &mut y, &effort, space);
        (y, verdict)
    }

    /// Goes on from x, which is planned up to the node `reached`, with the plan y of a window; false, and x as it
    /// was, if no way keeps the limits.
    fn join(&self, x: &mut [f64], reached: usize, window: &Range<usize>, y: &[f64]) -> bool {
        let shared = reached - window.start;
        let y_from = |node: usize| &y[2 * (node - window.start)..];
        // A plan that has not been improved is still the first one, where the other ends.
        for node in [window.start, reached] {
            if shared == 0 || x[2 * node..2 * node + 2] == y_from(node)[..2] {
                x[2 * node..2 * window.end + 2].copy_from_slice(y_from(node));
                return true;
            }
        }
        let apart = |n: usize| (y_from(n)[0] / x[2 * n] - 1.0).abs();
        for parts in BLENDS.into_iter().filter(|&parts| shared >= parts) {
            // Parts overlap by half of each.
            let size = shared / parts;
            let begins = (0..2 * parts - 1).map(|i| window.start + i * size / 2);
            let worst = |start: usize| (start..=start + size).map(apart).fold(0.0, f64::max);
            let Some(start) = begins.min_by(|&a, &b| worst(a).total_cmp(&worst(b))) else {
                continue;
            };
            let nodes = start..start + size;
            let mut blend = x[2 * nodes.start..2 * nodes.end + 2].to_vec();
            let (from, length) = (self.nodes[nodes.start], self.nodes[nodes.end] - self.nodes[nodes.start]);
            for (n, (z, y)) in blend.chunks_exact_mut(2).zip(y_from(nodes.start).chunks_exact(2)).enumerate()
            {
                let t = (self.nodes[nodes.start + n] - from) / length;
                let (weight, rate) = (t * t * (3.0 - 2.0 * t), 6.0 * t * (1.0 - t) / length);
                let [w, slope] = [y[0] - z[0], y[1] - z[1]];
                z[0] += weight * w;
                z[1] += weight * slope + rate * w;
            }
            let stretch = self.prepared.stretch(nodes.clone());
            if stretch.holds(&blend, BLENDED) {
                x[2 * nodes.start..2 * nodes.end + 2].copy_from_slice(&blend);
                x[2 * nodes.end..2 * window.end + 2].copy_from_slice(y_from(nodes.end));
                return true;
            }
        }
        false
    }

    /// The profile between two nodes, with the ramps at the ends of the path.
    fn profile(&self, x: &[f64], nodes: Range<usize>) -> Profile {
        let knots = self.prepared.problem.geometry.knots();
        let start = if nodes.start == 0 { 0.0 } else { self.nodes[nodes.start] };
        let last = nodes.end + 1 == self.nodes.len();
        let end = if last { knots[knots.len() - 1] } else { self.nodes[nodes.end] };
        let x = &x[2 * nodes.start..2 * nodes.end + 2];
        Profile {
            s: self.nodes[nodes.start..=nodes.end].to_vec(),
            speed_sq: x.iter().step_by(2).copied().collect(),
            slope: x.iter().skip(1).step_by(2).copied().collect(),
            ends: [start, end],
        }
    }
}
