//! Computes a lower bound on the time by duality, from the multipliers of the interior-point method on each window.
//!
//! The true problem and its relaxation (`relaxed`, y eliminated) have the same Lagrangian: with weights c of the time and
//! multipliers λ ≥ 0 of the rows
//!
//!   Λ(w) = Σ (c − Σ λ_jerk) w^(−1/2) + terms that are linear in w.
//!
//! If the multipliers of jerk add up to at most c at each collocation point, Λ is convex in w and nowhere below its tangent at
//! any w₀ > 0. For every w within the limits
//!
//!   time ≥ Λ(w) ≥ Λ(w₀) + Σ g (w − w₀) ≥ Λ(w₀) + Σ (least g (w − w₀) in the box of w),   g the gradient at w₀,
//!
//! with boxes of w and w' at the stations that follow from the limits of speed and acceleration. The bound therefore holds for
//! all such multipliers and for every w₀, within the limits or not; it is close if g is nearly 0. The multipliers of the plan are
//! used to solve the relaxation from a start beside the plan. If those of jerk add up to more than c, the relaxation has another
//! solution: it is then solved with the lower speeds of `speed_limit` from starts farther inside the limits.
//!
//! The sums are divided into one `Part` for each window without its overlaps. At a station where two parts meet, g has a term
//! from each of them; `join` adds both before it uses the box.
//!
//! If this leaves a wide gap, a bound by cases is closer (`cases`).
//!
//! The bound applies to the problem on its grid: splines, limits at collocation points, the time by the 3/8 rule.

use std::ops::Range;

use fearless_simd::{dispatch, Level, Simd};

use super::columns::Columns;
use super::constraints::{Constraints, RowLayout};
use super::exact::Exact;
use super::forms::{fall, motion, pace, project};
use super::hermite::{COUNT, LAST, MASS};
use super::interior_point::{Effort, Outcome};
use super::relaxed::Relaxed;
use super::speed_limit;
use super::window_end::WindowEnd;
use super::working_space::{EndRow, InteriorPoint};
use feedplan_geometry::lanes::eight::{Lanes, Register, LANES};

/// Start and accuracy of a solution of the relaxation.
struct Start {
    /// w starts below the plan by this fraction.
    below: f64,
    /// y starts above its least possible value by this fraction.
    above: f64,
    /// The first barrier, as a fraction of the time per row. With `warm`, multipliers start from their present values, but at
    /// least at those of the barrier.
    barrier: f64,
    warm: bool,
    /// Complementarity gap at the end, as a fraction of the time.
    tolerance: f64,
}

/// A start beside the plan, with its multipliers, if these are nearly those of the relaxation.
const BESIDE: Start = Start { below: 1e-3, above: 1e-3, barrier: 1e-3, warm: true, tolerance: 1e-5 };
/// A start near the plan if they are not. If the multipliers of jerk exceed c by a great fraction, y and the barrier start
/// higher, at that fraction times `SPREAD`.
const NEAR: Start = Start { below: 1e-2, above: 0.1, barrier: 0.03, warm: true, tolerance: 3e-5 };
const SPREAD: f64 = 2.5;
/// A start far inside the limits, if no solution is found from the first start.
const FAR: Start = Start { below: 0.03, above: 0.1, barrier: 1.0, warm: false, tolerance: 3e-5 };
/// The solution starts beside the plan if its multipliers of jerk exceed c by at most this fraction.
const TIGHT: f64 = 2e-5;
const MAX_ITERATIONS: usize = 60;
/// The multipliers are balanced until the boxes cost less than this fraction of the time, at most `BALANCES` times.
const LOSS: f64 = 1e-6;
const BALANCES: usize = 8;
/// A bound that exceeds the time of the plan by up to this fraction is due to rounding; a higher one is an error and is rejected.
const ROUNDING: f64 = 1e-9;

/// The bound on the intervals of a window without its overlaps: their time is at least `least` + Σ price · (w, w') at both ends.
#[derive(Clone, Debug, Default)]
pub struct Part {
    /// The time of the plan, and the time at the greatest speeds, both by the 3/8 rule, in s.
    pub time: f64,
    pub fastest: f64,
    /// The constant term of the bound, in s.
    pub least: f64,
    /// Prices of (w, w') at both ends; 0 at the ends of the path.
    pub price: [[f64; 2]; 2],
    /// Least and greatest w and w' at both ends.
    pub boxes: [[[f64; 2]; 2]; 2],
}

impl Part {
    /// The bound in s for the intervals `core` if the states at both their ends are those of the spline x.
    pub fn at(&self, x: &[f64], core: &Range<usize>) -> f64 {
        let cost = |end: usize, n: usize| self.price[end][0] * x[2 * n] + self.price[end][1] * x[2 * n + 1];
        self.least + cost(0, core.start) + cost(1, core.end)
    }
}

/// The lower bound from all parts along a path, as a fraction of the plan's time; NaN if they prove no bound above 0 or if the
/// bound exceeds the plan's time.
pub fn join(parts: &[Part]) -> f64 {
    let whole = joined(parts);
    // At very low feeds rounding spoils the multipliers; the time at the greatest speeds does not depend on them.
    let part = whole.least.max(whole.fastest) / whole.time;
    if part > 0.0 && part < 1.0 + ROUNDING {
        part.min(1.0)
    } else {
        f64::NAN
    }
}

/// Combines neighbouring parts to one part.
pub(super) fn joined(parts: &[Part]) -> Part {
    let mut least: f64 = parts.iter().map(|part| part.least).sum();
    for pair in parts.windows(2) {
        for i in 0..2 {
            let [before, after] = [pair[0].boxes[1][i], pair[1].boxes[0][i]];
            let both = [before[0].max(after[0]), before[1].min(after[1])];
            least += lowest(pair[0].price[1][i] + pair[1].price[0][i], both);
        }
    }
    let [first, last] = [&parts[0], &parts[parts.len() - 1]];
    Part {
        time: parts.iter().map(|part| part.time).sum(),
        fastest: parts.iter().map(|part| part.fastest).sum(),
        least,
        price: [first.price[0], last.price[1]],
        boxes: [first.boxes[0], last.boxes[1]],
    }
}

/// The least value of slope · z for z in a box, whose ends may be infinite.
fn lowest(slope: f64, [low, high]: [f64; 2]) -> f64 {
    match slope {
        0.0 => 0.0,
        slope if slope > 0.0 => slope * low,
        slope => slope * high,
    }
}

/// A planned window, as the input of its lower bound.
pub struct Planned<'a> {
    /// The limits before any tightening, and the limits as tightened for the plan.
    pub rows: &'a Constraints,
    pub tight: &'a Constraints,
    pub ends: [WindowEnd; 2],
    /// Whether each end is an end of the path.
    pub at_ends: [bool; 2],
    pub x: &'a [f64],
    /// The solver, with the multipliers under the tightened limits.
    pub solved: &'a InteriorPoint<Exact>,
}

/// A solution x of the relaxation that is not beside the plan, and the limits under which it was found: with the speeds of
/// `speed_limit`.
pub struct Solution {
    pub rows: Constraints,
    pub x: Vec<f64>,
}

/// The start near the plan if the multipliers of jerk exceed c by this fraction of it.
fn near(excess: f64) -> Start {
    let far = SPREAD * excess;
    Start { above: NEAR.above.max(far), barrier: NEAR.barrier.max(far), ..NEAR }
}

/// Computes the part of the intervals `core` of a window. Also returns the solution of the relaxation, unless it is beside the
/// plan. The multipliers of the relaxation stay in `space`.
pub fn part(
    planned: &Planned,
    core: &Range<usize>,
    effort: &Effort,
    space: &mut InteriorPoint<Relaxed>,
) -> (Part, Option<Solution>) {
    loosen(planned, &mut space.state.dual);
    let excess = excess(planned.rows, &space.state.dual);
    let tight = excess <= TIGHT;
    let starts = [if tight { BESIDE } else { near(excess) }, FAR];
    let lowered = (!tight).then(|| {
        let mut rows = planned.rows.clone();
        speed_limit::lower(&mut rows);
        rows
    });
    let planned = &Planned { rows: lowered.as_ref().unwrap_or(planned.rows), ..*planned };
    space.ends = planned.solved.ends;
    let (mut x, mut ends) = (vec![], planned.ends);
    for start in starts {
        let inside = 1.0 - start.below;
        x = planned.x.iter().map(|x| inside * x).collect();
        ends = std::array::from_fn(|end| match planned.ends[end] {
            WindowEnd::Fixed { w, slope } if !planned.at_ends[end] => {
                WindowEnd::Fixed { w: inside * w, slope: inside * slope }
            }
            known => known,
        });
        space.model.above = start.above;
        let own = Effort {
            tolerance: start.tolerance,
            max_iterations: MAX_ITERATIONS,
            barrier: start.barrier,
            warm: start.warm,
            ..*effort
        };
        let converged = space.solve(planned.rows, ends, &mut x, &own).outcome == Outcome::Converged;
        if converged {
            break;
        }
    }
    let part = balanced(planned, core, ends, &mut x, space);
    (part, lowered.map(|rows| Solution { rows, x }))
}

/// The best part that follows from the solution x of the relaxation while its multipliers are balanced (`settle`).
pub(super) fn balanced(
    planned: &Planned,
    core: &Range<usize>,
    ends: [WindowEnd; 2],
    x: &mut [f64],
    space: &mut InteriorPoint<Relaxed>,
) -> Part {
    let (mut best, mut loss) = tangent(planned, core, x, space);
    for _ in 0..BALANCES {
        if loss <= LOSS * best.time || !space.settle(planned.rows, &ends, x) {
            break;
        }
        let (part, less) = tangent(planned, core, x, space);
        if less < loss {
            (best, loss) = (part, less);
        }
    }
    best
}

/// The part from the tangent at x, and by how much the boxes lower it, in s.
fn tangent(
    planned: &Planned,
    core: &Range<usize>,
    x: &[f64],
    space: &mut InteriorPoint<Relaxed>,
) -> (Part, f64) {
    let terms = terms(planned, x, space);
    sum(planned, core, x, &terms, &space.ends)
}

/// The terms of all intervals of a window at x, with the prices of its ends. Changes the multipliers to admissible ones.
pub(super) fn terms(planned: &Planned, x: &[f64], space: &mut InteriorPoint<Relaxed>) -> Vec<Terms> {
    let Planned { rows, x: plan, .. } = *planned;
    let InteriorPoint { state, model: Relaxed { chord, prices, .. }, .. } = space;
    let mut terms = lagrangian(rows, plan, x, &mut state.dual, chord);
    for (end, (own, n)) in prices.iter().zip([0, rows.count() - 1]).enumerate() {
        let at = 2 * (n + end);
        terms[n].value += own.of([x[at], x[at + 1]]);
        terms[n].slope[2 * end] += own.price[0];
        terms[n].slope[2 * end + 1] += own.price[1] / rows.h(n);
    }
    terms
}

/// The part of the intervals `core` from their terms at x, and by how much the boxes lower it, in s.
pub(super) fn sum(
    planned: &Planned,
    core: &Range<usize>,
    x: &[f64],
    terms: &[Terms],
    end_rows: &[Option<EndRow>; 2],
) -> (Part, f64) {
    let Planned { rows, at_ends, x: plan, .. } = *planned;
    let x = &x[2 * core.start..2 * core.end + 2];
    let (mut time, mut fastest, mut least) = (0.0, 0.0, 0.0);
    let mut slope = vec![0.0; x.len()];
    let mut boxes = [[0.0, f64::INFINITY], [f64::NEG_INFINITY, f64::INFINITY]].repeat(core.len() + 1);
    let mut change = Vec::with_capacity(core.len());
    for n in core.clone() {
        let (own, h) = (&terms[n], rows.h(n));
        let from = 2 * (n - core.start);
        time += own.time;
        fastest += own.fastest;
        least += own.value;
        for (k, scale) in [1.0, h, 1.0, h].into_iter().enumerate() {
            slope[from + k] += own.slope[k] * scale;
        }
        for (at, [w, rise, fall]) in [from, from + 2].into_iter().zip(own.most) {
            boxes[at][1] = boxes[at][1].min(w);
            boxes[at + 1] = [boxes[at + 1][0].max(-fall), boxes[at + 1][1].min(rise)];
        }
        change.push(own.moves);
    }
    let last = x.len() - 2;
    for end in (0..2).filter(|&end| at_ends[end]) {
        let (at, sign) = (end * last, if end == 0 { 1.0 } else { -1.0 });
        match planned.ends[end] {
            WindowEnd::Rest { ramp, greatest } => {
                let dual = end_rows[end].map_or(0.0, |row| row.dual);
                let w = x[at];
                time += ramp.way() / plan[end * (plan.len() - 2)].sqrt();
                fastest += ramp.way() / greatest.sqrt();
                least += ramp.way() / w.sqrt() - dual * (1.0 - w / greatest);
                slope[at] += dual / greatest - 0.5 * ramp.way() / (w * w.sqrt());
                slope[at] += sign * ramp.slope() * slope[at + 1];
                (slope[at + 1], boxes[at][1]) = (0.0, boxes[at][1].min(greatest));
            }
            WindowEnd::Fixed { w, slope: known } => {
                least += slope[at] * (w - x[at]) + slope[at + 1] * (known - x[at + 1]);
                (slope[at], slope[at + 1], boxes[at][1]) = (0.0, 0.0, w);
            }
            WindowEnd::Free => {}
        }
    }
    narrow(&change, &mut boxes);
    let mut loss = 0.0;
    let (mut price, mut ends) = ([[0.0; 2]; 2], [[[0.0; 2]; 2]; 2]);
    for i in 0..x.len() {
        let end = if i < 2 { Some(0) } else { (i >= last).then_some(1) };
        match end.filter(|&end| !at_ends[end]) {
            Some(end) => {
                price[end][i % 2] = slope[i];
                ends[end][i % 2] = boxes[i];
                least -= slope[i] * x[i];
            }
            None => loss += slope[i] * x[i] - lowest(slope[i], boxes[i]),
        }
    }
    (Part { time, fastest, least: least - loss, price, boxes: ends }, loss)
}

/// The total excess of the multipliers of jerk over the weights c of the time, as a fraction of the sum of c.
fn excess(rows: &Constraints, dual: &[Lanes]) -> f64 {
    let layout = rows.layout();
    let (mut excess, mut length) = (0.0, 0.0);
    for (b, block) in rows.blocks.iter().enumerate() {
        for p in 0..COUNT {
            let rest = rest(&block.h, layout.of(dual, b, p), layout, p);
            for (rest, live) in rest.values().iter().zip(block.live.values()) {
                excess += (-rest).max(0.0) * live;
            }
        }
        length += block.h.values().iter().zip(block.live.values()).map(|(h, live)| h * live).sum::<f64>();
    }
    excess / length
}

/// c minus the sum of the multipliers of jerk at collocation point p of intervals of length h.
pub(super) fn rest(h: &Lanes, dual: &[Lanes], layout: RowLayout, p: usize) -> Lanes {
    let mut rest = h.map(|h| MASS[p] * h);
    for row in &dual[..layout.speed()] {
        for (rest, own) in rest.values_mut().iter_mut().zip(row.values()) {
            *rest -= own;
        }
    }
    rest
}

/// Sets `out` to multipliers of the limits before tightening that have the same gradients as those of the tightened limits. The
/// multiplier of y ≥ w^(−1/2) becomes what the multipliers of jerk leave of c.
pub(super) fn loosen(planned: &Planned, out: &mut Vec<Lanes>) {
    out.clone_from(&planned.solved.state.dual);
    let scale = |dual: &mut Lanes, tight: &Lanes, own: &Lanes| {
        for (lane, dual) in dual.values_mut().iter_mut().enumerate() {
            // Limits that were dropped have a factor of 0.
            if own.values()[lane] != 0.0 {
                *dual *= tight.values()[lane] / own.values()[lane];
            }
        }
    };
    let layout = planned.rows.layout();
    for (b, (own, tight)) in planned.rows.blocks.iter().zip(&planned.tight.blocks).enumerate() {
        for p in 0..COUNT {
            let dual = layout.of_mut(out, b, p);
            let [at, tight_at] = [&own.points[p], &tight.points[p]];
            scale(&mut dual[layout.speed()], &tight_at.speed, &at.speed);
            for row in &mut dual[..layout.speed()] {
                scale(row, &tight.jerk, &own.jerk);
            }
            for row in &mut dual[layout.acceleration()..] {
                scale(row, &tight_at.acceleration, &at.acceleration);
            }
            dual[layout.positive()] = rest(&own.h, dual, layout, p).map(|rest| rest.max(0.0));
        }
    }
}

/// The contributions of an interval to the bound.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Terms {
    /// The time of the plan and the time at the greatest speeds, in s.
    pub time: f64,
    pub fastest: f64,
    /// Value and local slope of the Lagrangian.
    pub value: f64,
    pub slope: [f64; 4],
    /// The greatest w, w' and −w' at both ends.
    pub most: [[f64; 3]; 2],
    /// How much w can rise and fall at most: the limits of w', integrated by the 3/8 rule, which is exact for the quadratic w'.
    pub moves: [f64; 2],
}

/// The terms of all intervals at a spline x, without prices. Changes the multipliers to admissible ones.
fn lagrangian(
    rows: &Constraints,
    plan: &[f64],
    x: &[f64],
    dual: &mut [Lanes],
    chord: &[[Lanes; COUNT]],
) -> Vec<Terms> {
    dispatch!(Level::new(), simd => lagrangian_on(simd, rows, plan, x, dual, chord))
}

#[inline(always)]
pub(super) fn lagrangian_on<S: Simd>(
    simd: S,
    rows: &Constraints,
    plan: &[f64],
    x: &[f64],
    dual: &mut [Lanes],
    chord: &[[Lanes; COUNT]],
) -> Vec<Terms> {
    let [plan, x] = [plan, x].map(Columns::new);
    let layout = rows.layout();
    let mut out = vec![Terms::default(); rows.count()];
    let zero = Register::all(simd, 0.0);
    for (b, (block, out)) in rows.blocks.iter().zip(out.chunks_mut(LANES)).enumerate() {
        let h = block.h.load(simd);
        let per_h = h.inverse();
        let [plan, u] = [&plan, &x].map(|spline| spline.local(b, h, block.live));
        let (mut time, mut fastest, mut value, mut slope) = (zero, zero, zero, [zero; 4]);
        let (mut most_at, mut moves) = ([[zero; 3]; COUNT], [zero; 2]);
        for p in 0..COUNT {
            let dual = layout.of_mut(dual, b, p);
            let cost = h * MASS[p];
            time += cost * pace(motion(p, per_h, &plan)[0]);
            most_at[p] = limits_at(simd, rows, b, p);
            let [most, rise, drop] = most_at[p];
            fastest += cost * pace(most);
            moves = [moves[0] + cost * rise, moves[1] + cost * drop];
            let mut jerk = zero;
            for row in &dual[..layout.speed()] {
                jerk += row.load(simd);
            }
            // The Lagrangian is bounded below in y only if the multipliers of jerk add up to at most the cost of y; the
            // multiplier of a chord adds to this cost.
            let chord = chord.get(b).map_or(Lanes::ZERO, |chord| chord[p]);
            let speed = dual[layout.speed()].values_mut().iter_mut();
            for ((speed, chord), over) in speed.zip(chord.values()).zip((jerk - cost).values()) {
                if *chord > 0.0 {
                    *speed = speed.max(over / chord);
                }
            }
            let cost = cost + dual[layout.speed()].load(simd) * chord;
            let most = cost * jerk.max(Register::all(simd, f64::MIN_POSITIVE)).inverse();
            let fit = Register::all(simd, 1.0).min(most);
            let mut fixed = -dual[layout.speed()].load(simd);
            for row in &mut dual[..layout.speed()] {
                *row = (*row * fit).into();
            }
            let [_, accelerations] = layout.pairs(dual);
            for (limit, pair) in rows.acceleration.iter().zip(accelerations) {
                let [up, down] = limit.most;
                fixed += -(pair[0].load(simd) * up + pair[1].load(simd) * down);
            }
            let last = (cost - jerk * fit).max(zero);
            let [w, w1, w2] = motion(p, per_h, &u);
            let (pull, _) = rows.pull(simd, b, p, dual);
            let pace = pace(w);
            value += fixed + last * pace - pull[0] * w - pull[1] * w1 - pull[2] * w2;
            project(p, per_h, &[-pull[0] - last * fall(pace), -pull[1], -pull[2]], &mut slope);
        }
        let [time, fastest, value] = [time, fastest, value].map(Register::values);
        let (slope, moves) = (slope.map(Register::values), moves.map(Register::values));
        let most = [0, LAST].map(|p| most_at[p].map(Register::values));
        for (lane, out) in out.iter_mut().enumerate() {
            *out = Terms {
                time: time[lane],
                fastest: fastest[lane],
                value: value[lane],
                slope: slope.map(|slope| slope[lane]),
                most: most.map(|most| most.map(|most| most[lane])),
                moves: moves.map(|moves| moves[lane]),
            };
        }
    }
    out
}

/// The greatest w, w' and −w' by the limits of speed and acceleration at collocation point p of a block.
#[inline(always)]
fn limits_at<S: Simd>(simd: S, rows: &Constraints, block: usize, p: usize) -> [Register<S>; 3] {
    let least = Register::all(simd, f64::MIN_POSITIVE);
    let w = rows.blocks[block].points[p].speed.load(simd).max(least).inverse();
    let mut most = [Register::all(simd, f64::INFINITY); 2];
    for (limit, [q1, q2, _]) in rows.acceleration.iter().zip(rows.q(block, p)) {
        let bend = q2.load(simd).abs() * w;
        let [with, against] =
            limit.most.map(|most| (bend + Register::all(simd, most / limit.per_mean)) * 2.0);
        // One of these is practically infinite and limits nothing: the one for the direction in which the axis does not move.
        let q1 = q1.load(simd);
        let [ahead, back] = [q1.max(least).inverse(), (-q1).max(least).inverse()];
        most[0] = (with * ahead).min(against * back).min(most[0]);
        most[1] = (against * ahead).min(with * back).min(most[1]);
    }
    [w, most[0], most[1]]
}

/// Lowers the greatest w of the boxes to what can be reached from station to station, forward and backward.
fn narrow(change: &[[f64; 2]], boxes: &mut [[f64; 2]]) {
    for n in 0..change.len() {
        boxes[2 * n + 2][1] = boxes[2 * n + 2][1].min(boxes[2 * n][1] + change[n][0]);
    }
    for n in (0..change.len()).rev() {
        boxes[2 * n][1] = boxes[2 * n][1].min(boxes[2 * n + 2][1] + change[n][1]);
    }
}

#[cfg(test)]
mod tests {
    use super::super::hermite::local;
    use super::super::profiles::{around, planned, random, relaxed_times, Winding};
    use super::super::window::ramps;
    use super::*;

    /// The time of the relaxation over the intervals `core`: jerk beyond its limit costs time there.
    fn relaxed_time(rows: &Constraints, x: &[f64], core: &Range<usize>) -> f64 {
        relaxed_times(rows, x)[core.clone()].iter().sum()
    }

    #[test]
    fn the_lagrangian_of_any_multipliers_is_below_the_time_and_above_its_tangents() {
        planned(&Winding::new(2.2), |own, _| {
            let mut random = random();
            let profiles = around(own.x, own.rows, 40);
            let (count, blocks) = (own.rows.count(), &own.rows.blocks);
            for _ in 0..20 {
                // Multipliers of one row or of all rows, up to more than the weights of the time.
                let (most, one) = (1.0 + random(), 8.0 * random());
                let of_row = |row: usize| if one < 0.0 || row == one as usize { most } else { 0.0 };
                let rows_of = |h: Lanes, p: usize| {
                    (0..own.rows.layout().count()).map(move |row| h.map(|h| MASS[p] * h * of_row(row)))
                };
                let dual: Vec<Lanes> =
                    blocks.iter().flat_map(|own| (0..COUNT).flat_map(|p| rows_of(own.h, p))).collect();
                let found: Vec<_> = profiles
                    .iter()
                    .map(|z| {
                        let terms = lagrangian(own.rows, z, z, &mut dual.clone(), &[]);
                        for (Terms { value, .. }, time) in terms.iter().zip(relaxed_times(own.rows, z)) {
                            assert!(*value <= time + 1e-12, "{value} and {time} s");
                        }
                        (z, terms)
                    })
                    .collect();
                for (from, to) in found.iter().zip(&found[1..]) {
                    for n in 0..count {
                        let [u, v] = [from.0, to.0].map(|z| local(z, n, own.rows.h(n)));
                        let [terms, next] = [from.1[n], to.1[n]];
                        let tangent =
                            terms.value + (0..4).map(|k| terms.slope[k] * (v[k] - u[k])).sum::<f64>();
                        assert!(
                            tangent <= next.value + 1e-12,
                            "{tangent} and {} s on interval {n}",
                            next.value
                        );
                    }
                }
            }
        });
    }

    #[test]
    fn no_profile_beats_the_bound_even_if_jerk_only_costs_time() {
        for turn in [0.6, 2.2] {
            planned(&Winding::new(turn), |own, effort| {
                let count = own.rows.count();
                let mut space = InteriorPoint::default();
                let bound = part(own, &(0..count), effort, &mut space).0.least;
                let times: Vec<f64> = around(own.x, own.rows, 300)
                    .iter()
                    .map(|z| relaxed_time(own.rows, z, &(0..count)) + ramps(&own.ends, z))
                    .collect();
                let least = times.iter().copied().fold(f64::INFINITY, f64::min);
                assert!((1.0..1.05).contains(&(least / bound)), "{least} s, {bound} s proven");
                // Other multipliers may prove less, but never more than the least time.
                let mut random = random();
                let known = space.state.dual.clone();
                for i in 0..30 {
                    let size = 10f64.powi(i % 6 - 5);
                    for (dual, known) in space.state.dual.iter_mut().zip(&known) {
                        *dual = known.map(|dual| dual * (1.0 + size * random()).abs());
                    }
                    let x: Vec<f64> = own.x.iter().map(|x| x * (1.0 + 0.3 * size)).collect();
                    let other = tangent(own, &(0..count), &x, &mut space).0.least;
                    assert!(other <= least, "{least} s, {other} s proven by multipliers {size} away");
                }
            });
        }
    }

    #[test]
    fn parts_add_up_and_hold_for_all_speeds_at_their_ends() {
        planned(&Winding::new(2.2), |own, effort| {
            let count = own.rows.count();
            let mut space = InteriorPoint::default();
            let (whole, _) = part(own, &(0..count), effort, &mut space);
            let cores = [0..count / 3, count / 3..2 * count / 3, 2 * count / 3..count];
            let parts = cores.clone().map(|core| {
                let at_ends = [core.start == 0, core.end == count];
                part(&Planned { at_ends, ..*own }, &core, effort, &mut space).0
            });
            assert!((join(&parts) / join(&[whole]) - 1.0).abs() < 1e-6);
            let [_, Part { least, price, .. }, _] = &parts;
            for z in around(own.x, own.rows, 100) {
                let [from, to] = [cores[1].start, cores[1].end].map(|n| [z[2 * n], z[2 * n + 1]]);
                let priced: f64 = (0..2).map(|i| price[0][i] * from[i] + price[1][i] * to[i]).sum();
                let time = relaxed_time(own.rows, &z, &cores[1]);
                assert!(time >= least + priced, "{time} s, {} s proven", least + priced);
            }
        });
    }
}
