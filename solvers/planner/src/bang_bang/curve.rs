//! The kernel `curve`: computes K and the fastest profile on polynomial pieces of any degree, on rational pieces, and on paths of
//! joints, where the tip has its own path, from control points, weights and the limits of the axes, the feed and the chord error.
//! Symbols: `bang_bang`.
//!
//! The limit curve is not convex here. Every switch is the first root of a Bernstein polynomial; the signs of its coefficients
//! prove that no earlier root is missed. Where rounding stops a pass, it requests a *remedy*: in the first attempt one more cut
//! of the piece, in later attempts a cut at which the plan stops. The run is then planned again.
//!
//! | file | content |
//! |---|---|
//! | `piece` | tangents and D of a piece, free of denominators |
//! | `chord` | the chord-error limit as lines of v² |
//! | `cusp` | where all axes rest at once, within rounding |
//! | `split` | the cuts of a piece |
//! | `part` | a part between two cuts, and the same part as a pass travels it |
//! | `store` | sub-pieces, kept from the backward pass for the forward one |
//! | `window` | the rest of a sub-piece ahead of a pass, with its ceiling |
//! | `pass` | one pass over one sub-piece: phases (`bang`), along the cap (`slide`), along the `limit_curve` |
//! | `check` | whether the phases keep the limits at some samples, in spite of rounding |

mod check;
mod chord;
mod cusp;
mod part;
mod pass;
mod piece;
mod split;
mod store;
mod window;

use super::time::{integral, NODES};
use super::{Junction, Task};
use crate::phase_law::PhaseLaw;
use crate::phases::NO_AXIS;
use crate::problem::{weights_of, TIP_AXES};
use crate::profile::{Profile, Row};
use check::keeps_limits;
use feedplan_geometry::polynomial::MOST;
use feedplan_geometry::quadratic::norm;
pub use part::{Axes, Remedy};
use part::{Cap, Part, SubPiece};
use pass::{axis_distance, Law, Phase, Stuck};
use piece::Piece;
use split::{split, Cut, Limits};
use store::Store;

/// The results of the backward pass, which goes from the end of a run to its start, for the forward pass; and working memory of
/// both.
#[derive(Default)]
pub struct Space {
    cuts: Vec<Cut>,
    /// Pieces from right to left, the parts of each piece from left to right.
    parts: Vec<Part>,
    /// For each part, from right to left: its sub-piece, and the index of its first phase of K in `controllable`.
    subs: Store,
    offsets: Vec<usize>,
    controllable: Vec<Phase>,
    phases: Vec<Phase>,
    /// Cuts and stops of this attempt, and those that it requests for the next one.
    remedies: Vec<Remedy>,
    requested: Vec<Remedy>,
}

impl Space {
    pub fn clear(&mut self) {
        self.parts.clear();
        self.subs.clear();
        self.offsets.clear();
        self.controllable.clear();
    }

    /// Begins an attempt with these remedies.
    pub fn set_remedies(&mut self, remedies: &[Remedy]) {
        self.remedies.clear();
        self.remedies.extend_from_slice(remedies);
        self.requested.clear();
    }

    /// Empty if the attempt succeeds.
    pub fn requested(&self) -> &[Remedy] {
        &self.requested
    }
}

/// Calls a function with a sufficient number of coefficients per polynomial: 11 for cubics and conics, 36 for other polynomial
/// pieces, `MOST` for all others. With more than 6 axes the capacity 11 is left out, since each capacity takes the compiler some
/// seconds.
macro_rules! with_capacity {
    ($task:expr, $i:expr, $function:ident($($argument:expr),*)) => {{
        let needed = coefficients($task, $i);
        if const { M <= 6 } && needed <= 11 {
            $function::<M, 11>($($argument),*)
        } else if needed <= 36 {
            $function::<M, 36>($($argument),*)
        } else {
            $function::<M, MOST>($($argument),*)
        }
    }};
}

/// The greatest number of coefficients of any polynomial on piece `i`.
fn coefficients<const M: usize>(task: &Task<M>, i: usize) -> usize {
    let problem = task.problem;
    // A sloped line of the chord-error limit adds one to the degree on rational pieces.
    let sloped = usize::from(task.chord.is_some());
    let count = |offset: &[usize], weight: &[f64]| {
        let degree = offset[i + 1] - offset[i] - 1;
        let rational = weights_of(weight, offset, i).iter().any(|&w| w != weight[offset[i]]);
        (degree, if rational { 8 * degree - 6 + sloped } else { 4 * degree - 2 })
    };
    let (degree, own) = count(problem.offset, problem.weight);
    let Some(tip) = problem.tip else { return own };
    let speed = tip.speed.of(i).len();
    let chord = if task.chord.is_some() { count(tip.offset, tip.weight).1 } else { 0 };
    own.max(2 * speed).max(2 * degree + speed).max(chord)
}

fn piece<const M: usize, const C: usize>(task: &Task<M>, i: usize) -> Piece<M, C> {
    let problem = task.problem;
    let speed_sq = problem.tip.map(|tip| (tip.speed.of(i), problem.width[i].powi(2)));
    let share = problem.share(i).copied();
    Piece { share, ..Piece::new(problem.points(i), problem.weights(i), speed_sq) }
}

/// The tip's own piece, where the axes are joints and the chord error is limited; None where the tip is at rest.
fn tip_piece<const M: usize, const C: usize>(task: &Task<M>, i: usize) -> Option<Piece<TIP_AXES, C>> {
    let tip = task.problem.tip.filter(|_| task.chord.is_some())?;
    let control = &tip.control[tip.offset[i]..tip.offset[i + 1]];
    // A tip at rest has no chord.
    let moves = control.iter().any(|point| *point != control[0]);
    moves.then(|| Piece::new(control, weights_of(tip.weight, tip.offset, i), None))
}

/// The sum of the squared axis velocities, from v² of the tip.
fn axes_speed_sq(tip_sq: f64, tip_share: f64) -> f64 {
    if tip_sq == 0.0 {
        0.0
    } else {
        tip_sq / tip_share
    }
}

/// Backward pass over piece `i`: takes `at` as the state at its end, sets it to the state at its start, and returns the number of
/// parts of the piece.
pub fn backward<const M: usize>(task: &Task<M>, i: usize, at: &mut Junction, space: &mut Space) -> usize {
    with_capacity!(task, i, backward_over(task, i, at, space))
}

fn backward_over<const M: usize, const C: usize>(
    task: &Task<M>,
    i: usize,
    at: &mut Junction,
    space: &mut Space,
) -> usize {
    let piece = piece::<M, C>(task, i);
    let start = space.parts.len();
    let tip = tip_piece::<M, C>(task, i);
    let limits =
        Limits { axes: &task.axes, feed_sq: task.problem.feed[i].powi(2), chord: task.chord.as_ref() };
    let remedies = space.remedies.iter().filter(|remedy| remedy.piece == i).copied();
    split(&piece, tip.as_ref(), &limits, remedies, &mut space.cuts, &mut space.parts);
    for number in (start..space.parts.len()).rev() {
        let part = space.parts[number];
        let sub = part.sub_piece(&piece, &task.axes);
        if number + 1 == space.parts.len() {
            at.speed_sq = at.speed_sq.min(axes_speed_sq(at.tip_sq, sub.tip_share(true)));
        }
        space.subs.push(&sub);
        let phases = space.controllable.len();
        space.offsets.push(phases);
        at.speed_sq = match pass::travel(&sub.reversed(), at.speed_sq, None, &mut space.controllable) {
            Ok(speed_sq) if !part.left.stops => speed_sq,
            Ok(_) => 0.0,
            Err(Stuck(x)) => {
                space.controllable.truncate(phases);
                space.requested.push(part.remedy(i, 1.0 - x));
                0.0
            }
        };
        at.tip_sq = at.speed_sq * sub.tip_share(false);
    }
    space.parts.len() - start
}

/// Forward pass over piece `i`, whose parts are the last `parts` ones stored by `backward`: sets `at` from the state at the start
/// to that at the end and appends the phases.
pub fn forward<const M: usize>(
    task: &Task<M>,
    i: usize,
    parts: usize,
    at: &mut Junction,
    space: &mut Space,
    out: &mut Profile,
) {
    with_capacity!(task, i, forward_over(task, i, parts, at, space, out));
}

fn forward_over<const M: usize, const C: usize>(
    task: &Task<M>,
    i: usize,
    parts: usize,
    at: &mut Junction,
    space: &mut Space,
    out: &mut Profile,
) {
    let first = space.parts.len() - parts;
    for number in first..space.parts.len() {
        let part = space.parts[number];
        let sub = space.subs.pop::<M, C>(&part, &task.axes);
        let offset = space.offsets.pop().unwrap_or(0);
        if number == first {
            at.speed_sq = at.speed_sq.min(axes_speed_sq(at.tip_sq, sub.tip_share(false)));
        }
        if part.left.stops {
            at.speed_sq = 0.0;
        }
        space.phases.clear();
        let kept = pass::travel(&sub, at.speed_sq, Some(&space.controllable[offset..]), &mut space.phases)
            .and_then(|speed_sq| keeps_limits(&sub, &space.phases).map(|()| speed_sq));
        space.controllable.truncate(offset);
        at.speed_sq = kept.unwrap_or_else(|Stuck(x)| {
            space.requested.push(part.remedy(i, x));
            0.0
        });
        at.tip_sq = at.speed_sq * sub.tip_share(true);
        push(task, i, &part, &sub, &space.phases, out);
    }
    space.parts.truncate(first);
}

/// Appends the phases of the forward pass over one part to the profile.
fn push<const M: usize, const C: usize>(
    task: &Task<M>,
    number: usize,
    part: &Part,
    sub: &SubPiece<M, C>,
    phases: &[Phase],
    out: &mut Profile,
) {
    let width = task.problem.width[number];
    let span = part.to - part.from;
    for phase in phases {
        let t = if phase.x1 == 1.0 { part.to } else { part.from + span * phase.x1 };
        let weight = |x: f64| sub.weight.value(x);
        // p = (dt/dτ)² from π, which refers to x. Where π is infinite because the axes rest in a cusp, 0 is written.
        let p = |pi: f64, x: f64, rests: bool| {
            if rests && pi.is_infinite() {
                0.0
            } else {
                pi * weight(x).powi(4) * span * span
            }
        };
        let distance = |k: usize| axis_distance(sub, k, phase.x0, phase.x1);
        let sign = |k: usize| if part.negative >> k & 1 == 1 { -1.0 } else { 1.0 };
        let mut joins = true;
        let mut by_acceleration = |k: usize, a: f64| {
            // Duration = distance / mean speed. The greater end speed follows from the smaller one, a and the distance.
            let distance = distance(k);
            // A phase that begins where its axis turns is not joined to the phase before it, even if phases between them were too
            // short to be kept.
            joins = phase.pi[0].is_finite() && phase.pi[1].is_finite() && sub.g[k].first() > 0.0;
            if distance <= 0.0 {
                return 0.0;
            }
            2.0 * distance / (phase.slow_sq.sqrt() + (phase.slow_sq + 2.0 * a * distance).sqrt())
        };
        let (up, down) = (&sub.limits.up, &sub.limits.down);
        let (law, axis, value, duration) = match phase.law {
            Law::Accelerating(k) => {
                (PhaseLaw::AxisAcceleration, k as u8, sign(k) * up[k], by_acceleration(k, up[k]))
            }
            Law::Braking(k) => {
                (PhaseLaw::AxisAcceleration, k as u8, -sign(k) * down[k], by_acceleration(k, down[k]))
            }
            Law::LimitCurve => continue,
            Law::Cap => match sub.cap {
                Cap::Axis(k, v_sq) => (PhaseLaw::AxisVelocity, k as u8, v_sq, distance(k) / v_sq.sqrt()),
                Cap::Feed(f) => (PhaseLaw::Feed, NO_AXIS, f, time_at_speed(sub, (f, f), phase.x0, phase.x1)),
                Cap::Speed([f0, f1]) => {
                    let time = time_at_speed(sub, (f0, f1), phase.x0, phase.x1);
                    if f0 == f1 && task.problem.share(number).is_none() {
                        (PhaseLaw::Feed, NO_AXIS, f0, time)
                    } else {
                        (PhaseLaw::SpeedLine, NO_AXIS, 0.0, time)
                    }
                }
            },
        };
        let joins = joins && !matches!(law, PhaseLaw::SpeedLine);
        let rests = [matches!(phase.law, Law::Accelerating(_)), matches!(phase.law, Law::Braking(_))]
            .map(|slow| slow && phase.slow_sq == 0.0);
        let p = [p(phase.pi[0], phase.x0, rests[0]), p(phase.pi[1], phase.x1, rests[1])];
        out.push(number as u32, width, Row { law, axis, value, t, p, duration, joins });
    }
}

/// ∫ √D/(ω² √f) dx: the time [s] along a cap whose v² = f is linear in x.
fn time_at_speed<const M: usize, const C: usize>(
    sub: &SubPiece<M, C>,
    (f0, f1): (f64, f64),
    x0: f64,
    x1: f64,
) -> f64 {
    let rate = |x: [f64; NODES]| {
        let weight = sub.weight.values(x);
        // Next to a cusp D has lost digits that the tangents still have, so √D is computed from the tangents.
        let speed = if sub.own_speed {
            let g = sub.g.each_ref().map(|g| g.values(x));
            std::array::from_fn(|i| norm(&g.map(|g| g[i])))
        } else {
            sub.speed.values(x).map(|speed| speed.max(0.0).sqrt())
        };
        std::array::from_fn(|i| speed[i] / ((f0 + x[i] * (f1 - f0)).sqrt() * weight[i] * weight[i]))
    };
    integral(&rate, x0, x1)
}
