//! Paths of any length, in windows that are solved in parallel and then again over their seams.
//!
//! What a cut costs decays with the travel time from it, by about 1e-5 in two of the times a stop takes. So windows
//! are solved between places of the first plan, and then each cut anew between places of their optima, four such
//! times away to both sides. Only w and w' need to match where windows meet. A few windows at a time are in memory.

use std::ops::Range;
use std::time::Instant;

use rayon::prelude::*;

use super::exact::Exact;
use super::hermite::duration;
use super::interior_point::{self, Bound, InteriorPoint};
use super::prepare::Prepared;
use super::stretch::{ramps, Verdict};
use super::{Effort, Fault, Geometry, Plan, Problem, Profile};

/// Seams reach so many times of a stop from their cut, and so many intervals.
const SEAM: (f64, usize) = (4.0, 80);
/// Windows of the first plan last so many times of a stop, at least: the optimum takes down to a third of it.
const LONG: f64 = 36.0;
/// Windows solved between two hand-outs, for each thread.
const BATCH: usize = 2;

/// See `jerk_limited::stream`.
pub fn solve<G: Geometry<M>, const M: usize>(
    problem: &Problem<G, M>,
    effort: &Effort,
    mut finished: impl FnMut(&Profile),
) -> Result<Plan, Fault> {
    let prepared = Prepared::new(problem, effort.resolution)?;
    let mut x = prepared.x.clone();
    let cuts = cuts(&prepared, effort.window);
    let run = Run { prepared: &prepared, effort, nodes: &prepared.grid.nodes };
    let mut counts = Counts { converged: true, steps: 0.0 };
    let mut pending: Option<Part> = None;
    let mut done = 0;
    let windows: Vec<Range<usize>> = cuts.windows(2).map(|pair| pair[0]..pair[1]).collect();
    for batch in windows.chunks(BATCH * rayon::current_num_threads()) {
        if effort.deadline.is_some_and(|end| Instant::now() >= end) {
            counts.converged = false;
            break;
        }
        let loose = |range: &Range<usize>| Part { range: range.clone(), tight: vec![[1.0; 3]; range.len()] };
        let mut parts: Vec<Part> = batch.iter().map(loose).collect();
        run.improve(&mut parts, &mut x, false, &mut counts);
        let parts: Vec<Part> = pending.take().into_iter().chain(parts).collect();
        let mut seams: Vec<Part> = parts.windows(2).map(|pair| run.seam(&x, &pair[0], &pair[1])).collect();
        run.improve(&mut seams, &mut x, true, &mut counts);
        pending = parts.into_iter().next_back();
        // The last window is final up to where its next seam may begin.
        let last = &batch[batch.len() - 1];
        let final_node = if last.end == run.nodes.len() - 1 { last.end } else { (last.start + last.end) / 2 };
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
        iterations: counts.steps / count as f64,
        profile: run.profile(&x, 0..count),
    })
}

/// The nodes where windows meet, the ends of the path among them.
fn cuts<G: Geometry<M>, const M: usize>(prepared: &Prepared<G, M>, window: usize) -> Vec<usize> {
    let nodes = &prepared.grid.nodes;
    let count = nodes.len() - 1;
    let long = LONG * prepared.stop_time;
    let mut cuts = vec![0];
    let (mut last, mut time) = (0, 0.0);
    for n in 0..count {
        time += duration(&prepared.x, n, nodes[n + 1] - nodes[n]);
        if n + 1 - last >= window && time >= long {
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

struct Counts {
    converged: bool,
    /// Newton steps times intervals.
    steps: f64,
}

/// Intervals, and how much tighter than the machine's their limits of speed, acceleration and jerk are.
struct Part {
    range: Range<usize>,
    tight: Vec<[f64; 3]>,
}

struct Run<'a, G, const M: usize> {
    prepared: &'a Prepared<'a, G, M>,
    effort: &'a Effort,
    nodes: &'a [f64],
}

impl<G: Geometry<M>, const M: usize> Run<'_, G, M> {
    /// The intervals round the cut between two windows: far enough, but at most half of each. Towards the cut the
    /// limits are tightened anew, for another speed.
    fn seam(&self, x: &[f64], left: &Part, right: &Part) -> Part {
        let far = |count: usize, time: f64| count >= SEAM.1 && time >= SEAM.0 * self.prepared.stop_time;
        let lasts = |n: usize| duration(x, n, self.nodes[n + 1] - self.nodes[n]);
        let cut = right.range.start;
        let (mut start, mut time) = (cut, 0.0);
        while start > (left.range.start + cut).div_ceil(2) && !far(cut - start, time) {
            start -= 1;
            time += lasts(start);
        }
        let (mut end, mut time) = (cut, 0.0);
        while end < (cut + right.range.end) / 2 && !far(end - cut, time) {
            time += lasts(end);
            end += 1;
        }
        let tight = (start..end)
            .map(|n| {
                if n < (start + cut) / 2 {
                    left.tight[n - left.range.start]
                } else if n >= (cut + end) / 2 {
                    right.tight[n - cut]
                } else {
                    [1.0; 3]
                }
            })
            .collect();
        Part { range: start..end, tight }
    }

    /// Solves parts that lie apart, between the places of x at their ends.
    fn improve(&self, parts: &mut [Part], x: &mut [f64], near: bool, counts: &mut Counts) {
        let solved: Vec<_> = parts
            .par_iter_mut()
            .map(|part| {
                let mut y = x[2 * part.range.start..2 * part.range.end + 2].to_vec();
                let verdict = self.solve(part, &mut y, near);
                (y, verdict)
            })
            .collect();
        for (Part { range, .. }, (y, verdict)) in parts.iter().zip(solved) {
            x[2 * range.start..2 * range.end + 2].copy_from_slice(&y);
            counts.converged &= verdict.converged;
            counts.steps += (verdict.iterations * range.len()) as f64;
        }
    }

    fn solve(&self, part: &mut Part, y: &mut [f64], near: bool) -> Verdict {
        let fixed = |at: usize| Bound::Fixed { w: y[at], slope: y[at + 1] };
        let mut bounds = [fixed(0), fixed(y.len() - 2)];
        if part.range.start == 0 {
            bounds[0] = self.prepared.bounds[0];
        }
        if part.range.end + 1 == self.nodes.len() {
            bounds[1] = self.prepared.bounds[1];
        }
        let effort = interior_point::Effort {
            tolerance: self.effort.tolerance,
            max_iterations: self.effort.max_iterations,
            deadline: self.effort.deadline,
            barrier: 1.0,
        };
        let limits = &self.prepared.problem.limits;
        let mut stretch = self.prepared.stretch(part.range.clone());
        let mut space = InteriorPoint::<Exact, M>::default();
        stretch.improve(limits, bounds, &mut part.tight, y, near, &effort, &mut space)
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
