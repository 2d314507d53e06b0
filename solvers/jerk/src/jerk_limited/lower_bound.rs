//! A lower bound on the time, by duality, from a profile and the problem that it solves.
//!
//! The relaxation of `relaxed` is convex: for any multipliers λ ≥ 0 the minimum of the Lagrangian is a lower bound on
//! its minimum, and so on the least time. The Lagrangian is convex in w: from its value and slope g at some w₀ it is at
//! least
//!
//!   L(w₀) + Σ g (w − w₀)   with each unknown at the end of its box where the term is least,
//!
//! with boxes from the limits of speed and acceleration at the stations. So the bound holds for all multipliers; those
//! near the optimum, where g vanishes, make it close. They come from overlapping windows: the effect of a window's end
//! decays with the travel time from it.
//!
//! The bound is that of the problem on its grid: splines, limits at collocation points, the time by the 3/8 rule.

use std::ops::Range;

use fearless_simd::{dispatch, Simd};
use rayon::prelude::*;

use super::constraints::{Constraints, RowLayout};
use super::grid::Grid;
use super::hermite::{local, MASS};
use super::interior_point::{self, InteriorPoint, Outcome, WindowEnd};
use super::model::{fall, pace, project};
use super::prepare;
use super::relaxed::Relaxed;
use super::window::ramps;
use super::{Effort, Geometry, Problem, Profile};
use crate::lanes::{Lanes, Register};

/// Windows overlap by this many intervals to both sides, and are at least twice as long.
const HALO: usize = 400;
/// The relaxation starts at this multiple of the plan, strictly inside the limits.
const INSIDE: f64 = 0.97;

/// A lower bound on the time, and the gap of a plan.
#[derive(Clone, Copy, Debug)]
pub struct Certificate {
    /// In s.
    pub least_time: f64,
    /// (time − least_time)/time.
    pub gap: f64,
}

/// The lower bound on the grid of a profile.
pub fn certify<G: Geometry<M>, const M: usize>(
    problem: &Problem<G, M>,
    profile: &Profile,
    effort: &Effort,
) -> Certificate {
    let grid = Grid::of(profile, problem.geometry.knots(), problem.caps, effort.watch);
    let ends = prepare::window_ends(problem);
    let x: Vec<f64> =
        profile.speed_sq.iter().zip(&profile.slope).flat_map(|(w, slope)| [*w, *slope]).collect();
    let count = profile.s.len() - 1;
    let size = effort.window.max(2 * HALO);
    let cores: Vec<Range<usize>> =
        (0..count.div_ceil(size)).map(|i| i * size..((i + 1) * size).min(count)).collect();
    let parts: Vec<Part> = cores
        .par_iter()
        .map(|core| {
            // Cancelled work ends here.
            effort.watch.check();
            let window = core.start.saturating_sub(HALO)..(core.end + HALO).min(count);
            let mut ends = ends;
            let x = &x[2 * window.start..2 * window.end + 2];
            let fixed = |at: usize| WindowEnd::Fixed { w: INSIDE * x[at], slope: INSIDE * x[at + 1] };
            if window.start > 0 {
                ends[0] = fixed(0);
            }
            if window.end < count {
                ends[1] = fixed(x.len() - 2);
            }
            let rows = grid.constraints(problem, window.clone());
            let part = part(&rows, ends, x, core.start - window.start..core.end - window.start, effort);
            effort.watch.each(cores.len()).advance(1);
            part
        })
        .collect();
    let time: f64 = parts.iter().map(|part| part.time).sum::<f64>() + ramps(&ends, &x);
    let least = join(&parts, &cores, &ends, 2 * (count + 1));
    let least_time = (profile.time() * least / time).max(0.0);
    Certificate { least_time, gap: 1.0 - least_time / profile.time() }
}

/// The contribution of a core: the intervals of a window without its overlaps.
struct Part {
    /// The plan's time by the 3/8 rule.
    time: f64,
    /// The Lagrangian at x.
    value: f64,
    /// The point of expansion, the Lagrangian's slope there, and the box of each unknown.
    x: Vec<f64>,
    slope: Vec<f64>,
    boxes: Vec<[f64; 2]>,
    /// How much w can rise and fall on each interval.
    change: Vec<[f64; 2]>,
    /// Multipliers of the limits at the ramps.
    ends: [f64; 2],
}

fn part<const M: usize>(
    rows: &Constraints<M>,
    ends: [WindowEnd; 2],
    plan: &[f64],
    core: Range<usize>,
    effort: &Effort,
) -> Part {
    let mut space = InteriorPoint::<Relaxed, M>::default();
    let mut x: Vec<f64> = plan.iter().map(|x| INSIDE * x).collect();
    let own = interior_point::Effort {
        tolerance: effort.tolerance,
        max_iterations: effort.max_iterations,
        deadline: effort.deadline,
        barrier: 1.0,
        warm: false,
        watch: effort.watch,
    };
    let mut without_ends = rows.clone();
    without_ends.drop_at_ends(&ends);
    let report = space.solve(&without_ends, ends, &mut x, &own);
    let known = report.outcome != Outcome::NotInside;
    let unknowns = 2 * (core.len() + 1);
    let mut out = Part {
        time: 0.0,
        value: 0.0,
        x: x[2 * core.start..2 * core.end + 2].to_vec(),
        slope: vec![0.0; unknowns],
        change: vec![],
        boxes: [[0.0, f64::INFINITY], [f64::NEG_INFINITY, f64::INFINITY]].repeat(core.len() + 1),
        ends: [0, 1].map(|end| space.ends[end].filter(|_| known).map_or(0.0, |row| row.dual)),
    };
    for n in core.clone() {
        let interval = &rows.intervals[n];
        let h = interval.h;
        let mut dual: Vec<Lanes> = RowLayout::<M>::of(&space.state.dual, n).to_vec();
        if !known {
            dual.fill(Lanes::ZERO);
        }
        let (time, value, slope) = dispatch!(
            space.level,
            simd => lagrangian(simd, rows, n, &local(plan, n, h), &local(&x, n, h), &mut dual)
        );
        out.time += time;
        out.value += value;
        for (k, scale) in [1.0, h, 1.0, h].into_iter().enumerate() {
            out.slope[2 * (n - core.start) + k] += slope[k] * scale;
        }
        let mut change = [0.0; 2];
        for lane in 0..4 {
            let [w, rise, fall] = limits_at(rows, n, lane);
            // The 3/8 rule is exact for the quadratic w'.
            change[0] += MASS.values()[lane] * rise * h;
            change[1] += MASS.values()[lane] * fall * h;
            if lane == 0 || lane == 3 {
                let at = 2 * (n - core.start + lane / 3);
                out.boxes[at][1] = out.boxes[at][1].min(w);
                out.boxes[at + 1] = [out.boxes[at + 1][0].max(-fall), out.boxes[at + 1][1].min(rise)];
            }
        }
        out.change.push(change);
    }
    out
}

/// The plan's time on interval n, and value and local slope of the Lagrangian there, its multipliers made admissible.
#[inline(always)]
pub(super) fn lagrangian<S: Simd, const M: usize>(
    simd: S,
    rows: &Constraints<M>,
    n: usize,
    plan: &[f64; 4],
    u: &[f64; 4],
    dual: &mut [Lanes],
) -> (f64, f64, [f64; 4]) {
    let interval = &rows.intervals[n];
    let cost = MASS.load(simd) * interval.h;
    let time = (cost * pace(interval.motion(simd, plan)[0])).sum();
    let mut jerk = Register::all(simd, 0.0);
    for k in 0..M {
        let at = RowLayout::<M>::jerk(k);
        jerk += dual[at].load(simd) + dual[at + 1];
    }
    // The Lagrangian is bounded below in y only if the multipliers of its rows add up to its cost.
    let most = cost * jerk.max(Register::all(simd, f64::MIN_POSITIVE)).inverse();
    let fit = Register::all(simd, 1.0).min(most);
    let mut fixed = -dual[RowLayout::<M>::SPEED].load(simd);
    for k in 0..M {
        let (at, to) = (RowLayout::<M>::acceleration(k), RowLayout::<M>::jerk(k));
        let [up, down] = rows.acceleration.most[k];
        fixed += -(dual[at].load(simd) * up + dual[at + 1].load(simd) * down);
        (dual[to], dual[to + 1]) = ((dual[to] * fit).into(), (dual[to + 1] * fit).into());
    }
    let last = (cost - jerk * fit).max(Register::all(simd, 0.0));
    let [w, w1, w2] = interval.motion(simd, u);
    let (pull, _) = rows.pull(simd, n, dual);
    let pace = pace(w);
    let value = (fixed + last * pace - pull[0] * w - pull[1] * w1 - pull[2] * w2).sum();
    let slope = project(interval.h, &[-pull[0] - last * fall(pace), -pull[1], -pull[2]]);
    (time, value, slope)
}

/// The greatest w, w' and −w' by the limits of speed and acceleration at a lane of interval n.
fn limits_at<const M: usize>(rows: &Constraints<M>, n: usize, lane: usize) -> [f64; 3] {
    let interval = &rows.intervals[n];
    let w = 1.0 / interval.speed.values()[lane];
    let (mut rise, mut fall) = (f64::INFINITY, f64::INFINITY);
    for k in 0..M {
        let [q1, q2, _] = interval.q[k].map(|q| q.values()[lane]);
        let most = rows.acceleration.most[k].map(|most| most / rows.acceleration.per_mean[k]);
        let against = usize::from(q1 < 0.0);
        rise = rise.min(2.0 * (most[against] + q2.abs() * w) / q1.abs());
        fall = fall.min(2.0 * (most[1 - against] + q2.abs() * w) / q1.abs());
    }
    [w, rise, fall]
}

/// The lower bound from all cores.
fn join(parts: &[Part], cores: &[Range<usize>], ends: &[WindowEnd; 2], unknowns: usize) -> f64 {
    let mut x = vec![0.0; unknowns];
    let mut slope = vec![0.0; unknowns];
    let mut boxes = vec![[f64::NEG_INFINITY, f64::INFINITY]; unknowns];
    let mut value = 0.0;
    // Where two windows meet with different x, the slope accounts for the difference.
    for (part, core) in parts.iter().zip(cores) {
        value += part.value;
        for i in 0..part.x.len() {
            let at = 2 * core.start + i;
            slope[at] += part.slope[i];
            boxes[at] = [boxes[at][0].max(part.boxes[i][0]), boxes[at][1].min(part.boxes[i][1])];
            if i < 2 && core.start > 0 {
                value += part.slope[i] * (x[at] - part.x[i]);
            } else {
                x[at] = part.x[i];
            }
        }
    }
    for end in 0..2 {
        let (at, sign) = (end * (unknowns - 2), if end == 0 { 1.0 } else { -1.0 });
        match ends[end] {
            WindowEnd::Rest { ramp, greatest } => {
                let dual = parts[end * (parts.len() - 1)].ends[end];
                let w = x[at];
                value += ramp.way() / w.sqrt() - dual * (1.0 - w / greatest);
                slope[at] += dual / greatest - 0.5 * ramp.way() / (w * w.sqrt());
                slope[at] += sign * ramp.slope() * slope[at + 1];
                slope[at + 1] = 0.0;
                boxes[at][1] = boxes[at][1].min(greatest);
            }
            WindowEnd::Fixed { w, .. } => {
                (slope[at], slope[at + 1]) = (0.0, 0.0);
                boxes[at][1] = w;
            }
        }
    }
    narrow(parts, &mut boxes);
    for i in 0..unknowns {
        let [low, high] = boxes[i];
        value += if slope[i] > 0.0 {
            slope[i] * (low - x[i])
        } else if slope[i] < 0.0 {
            slope[i] * (high - x[i])
        } else {
            0.0
        };
    }
    value
}

/// Narrows the boxes of w to the values that can be reached from station to station, forward and backward.
fn narrow(parts: &[Part], boxes: &mut [[f64; 2]]) {
    let change: Vec<[f64; 2]> = parts.iter().flat_map(|part| part.change.iter().copied()).collect();
    for n in 0..change.len() {
        boxes[2 * n + 2][1] = boxes[2 * n + 2][1].min(boxes[2 * n][1] + change[n][0]);
    }
    for n in (0..change.len()).rev() {
        boxes[2 * n][1] = boxes[2 * n][1].min(boxes[2 * n + 2][1] + change[n][1]);
    }
}
