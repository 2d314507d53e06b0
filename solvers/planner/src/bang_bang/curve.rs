//! The kernel of all curves: polynomial pieces of any degree, rational ones, and joints whose tool is elsewhere.
//!
//! The limit curve is not convex here, and every switch is the first root of a Bernstein polynomial whose coefficients'
//! signs prove that none is missed. Where rounding leaves a pass without headway, a *remedy* is asked for: another cut
//! of the piece, then a stop; the run is planned anew with it.
//!
//! | file | content |
//! |---|---|
//! | `piece` | the hodograph of a piece, weights multiplied out |
//! | `cusp` | where all axes rest at once, as far as rounding can tell |
//! | `split` | cuts where an axis turns round or another velocity cap is the lowest |
//! | `part` | a part between two cuts, and that part as a pass travels it |
//! | `store` | sub-pieces from the backward pass to the forward one |
//! | `window` | what is left of a sub-piece ahead of a pass, with the bound on it |
//! | `pass` | one pass over one sub-piece: phases (`bang`), along the cap (`slide`), along the `limit_curve` |
//! | `check` | whether the phases keep the limits at some places, for all that rounding did |

mod check;
mod cusp;
mod part;
mod pass;
mod piece;
mod split;
mod store;
mod window;

use super::run::Between;
use super::time::{integral, NODES};
use super::Task;
use crate::arc_kind::ArcKind;
use crate::problem::{weights_of, TIP_AXES};
use crate::profile::{Profile, Row, NO_AXIS};
use check::keeps_limits;
use feedplan_geometry::polynomial::MOST;
use feedplan_geometry::quadratic::norm;
pub use part::Remedy;
use part::{Cap, Part, SubPiece};
use pass::{distance, Kind, Phase, State, Stuck};
use piece::Piece;
pub use split::Axes;
use split::{split, Cut, Limits};
use store::Store;

/// What the backward pass leaves for the forward pass, piece by piece from the end of a run; and space.
#[derive(Default)]
pub struct Space {
    cuts: Vec<Cut>,
    /// Parts of each piece from left to right.
    parts: Vec<Part>,
    /// Of each part from right to left: its sub-piece, and where its phases of K begin.
    subs: Store,
    offsets: Vec<usize>,
    bounds: Vec<Phase>,
    phases: Vec<Phase>,
    /// Cuts where a pass came to no end before, and those that this attempt asks for.
    remedies: Vec<Remedy>,
    asked: Vec<Remedy>,
}

impl Space {
    pub fn clear(&mut self) {
        self.parts.clear();
        self.subs.clear();
        self.offsets.clear();
        self.bounds.clear();
    }

    /// Begins an attempt with these remedies.
    pub fn set_remedies(&mut self, remedies: &[Remedy]) {
        self.remedies.clear();
        self.remedies.extend_from_slice(remedies);
        self.asked.clear();
    }

    /// What this attempt asks for; nothing if it succeeds.
    pub fn asked(&self) -> &[Remedy] {
        &self.asked
    }
}

/// Calls a function with the capacity of polynomials that a piece needs: that of quadratics, of cubics and conics, of
/// other polynomial pieces, of all. For many axes fewer capacities are compiled, since each takes the compiler some seconds:
/// there a piece of low degree has a greater capacity than it needs.
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

/// How many coefficients the polynomials of a piece have at most.
fn coefficients<const M: usize>(task: &Task<M>, i: usize) -> usize {
    let problem = task.problem;
    // A bound of the speed that is not constant adds one to what rational pieces need.
    let sloped = usize::from(task.chord.is_some());
    let of = |offset: &[usize], weight: &[f64]| {
        let degree = offset[i + 1] - offset[i] - 1;
        let rational = weights_of(weight, offset, i).iter().any(|&w| w != weight[offset[i]]);
        (degree, if rational { 8 * degree - 6 + sloped } else { 4 * degree - 2 })
    };
    let (degree, own) = of(problem.offset, problem.weight);
    let Some(tip) = problem.tip else { return own };
    let speed = tip.speed.of(i).len();
    let chord = if task.chord.is_some() { of(tip.offset, tip.weight).1 } else { 0 };
    own.max(2 * speed).max(2 * degree + speed).max(chord)
}

fn piece<const M: usize, const C: usize>(task: &Task<M>, i: usize) -> Piece<M, C> {
    let problem = task.problem;
    let speed_sq = problem.tip.map(|tip| (tip.speed.of(i), problem.width[i].powi(2)));
    Piece::new(problem.points(i), problem.weights(i), speed_sq).with_share(problem.share(i))
}

/// The tool's own piece where it is another one and its chord error is limited.
fn tip_piece<const M: usize, const C: usize>(task: &Task<M>, i: usize) -> Option<Piece<TIP_AXES, C>> {
    let tip = task.problem.tip.filter(|_| task.chord.is_some())?;
    let control = &tip.control[tip.offset[i]..tip.offset[i + 1]];
    // Where the tool stands still it has no chord.
    let moves = control.iter().any(|point| *point != control[0]);
    moves.then(|| Piece::new(control, weights_of(tip.weight, tip.offset, i), None))
}

/// The axes' speed squared at the tool's.
fn of_axes(tip_sq: f64, tip_share: f64) -> f64 {
    if tip_sq == 0.0 {
        0.0
    } else {
        tip_sq / tip_share
    }
}

/// Backward over piece `i`: from `at` at its end to `at` at its start; the number of its parts.
pub fn backward<const M: usize>(task: &Task<M>, i: usize, at: &mut Between, space: &mut Space) -> usize {
    with_capacity!(task, i, backward_over(task, i, at, space))
}

fn backward_over<const M: usize, const C: usize>(
    task: &Task<M>,
    i: usize,
    at: &mut Between,
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
            at.speed_sq = at.speed_sq.min(of_axes(at.tip_sq, sub.tip_share(true)));
        }
        space.subs.push(&sub);
        let phases = space.bounds.len();
        space.offsets.push(phases);
        let state = State { speed_sq: at.speed_sq };
        at.speed_sq = match pass::run::<M, C, true>(&sub.reversed(), state, &[], &mut space.bounds) {
            Ok(next) if !part.starts_at_rest() => next.speed_sq,
            Ok(_) => 0.0,
            Err(Stuck(x)) => {
                space.bounds.truncate(phases);
                space.asked.push(part.remedy(i, 1.0 - x));
                0.0
            }
        };
        at.tip_sq = at.speed_sq * sub.tip_share(false);
    }
    space.parts.len() - start
}

/// Forward over piece `i` of so many parts, the last that `backward` has left in the space; appends the phases.
pub fn forward<const M: usize>(
    task: &Task<M>,
    i: usize,
    parts: usize,
    at: &mut Between,
    space: &mut Space,
    out: &mut Profile,
) {
    with_capacity!(task, i, forward_over(task, i, parts, at, space, out));
}

fn forward_over<const M: usize, const C: usize>(
    task: &Task<M>,
    i: usize,
    parts: usize,
    at: &mut Between,
    space: &mut Space,
    out: &mut Profile,
) {
    let first = space.parts.len() - parts;
    for number in first..space.parts.len() {
        let part = space.parts[number];
        let sub = space.subs.pop::<M, C>(&part, &task.axes);
        let offset = space.offsets.pop().unwrap_or(0);
        if number == first {
            at.speed_sq = at.speed_sq.min(of_axes(at.tip_sq, sub.tip_share(false)));
        }
        if part.starts_at_rest() {
            at.speed_sq = 0.0;
        }
        space.phases.clear();
        let state = State { speed_sq: at.speed_sq };
        let kept = pass::run::<M, C, false>(&sub, state, &space.bounds[offset..], &mut space.phases)
            .and_then(|next| keeps_limits(&sub, &space.phases).map(|()| next.speed_sq));
        space.bounds.truncate(offset);
        at.speed_sq = kept.unwrap_or_else(|Stuck(x)| {
            space.asked.push(part.remedy(i, x));
            0.0
        });
        at.tip_sq = at.speed_sq * sub.tip_share(true);
        push(task, i, &part, &sub, &space.phases, out);
    }
    space.parts.truncate(first);
}

/// Appends the phases of the forward pass over one part.
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
        // p = (dt/dτ)² from π of x. At rest in a cusp p has no limit, and counts as 0.
        let p = |pi: f64, x: f64, rests: bool| {
            if rests && pi.is_infinite() {
                0.0
            } else {
                pi * weight(x).powi(4) * span * span
            }
        };
        let way = |k: usize| distance(sub, k, phase.x0, phase.x1);
        let sign = |k: usize| if part.negative >> k & 1 == 1 { -1.0 } else { 1.0 };
        let mut joins = true;
        let mut by_acceleration = |k: usize, a: f64| {
            // Way over mean speed, the faster speed from the way.
            let way = way(k);
            // Not with what comes before its axis turns, not even where phases too short to be kept lie in between.
            joins = phase.pi[0].is_finite() && phase.pi[1].is_finite() && sub.g[k].first() > 0.0;
            if way <= 0.0 {
                return 0.0;
            }
            2.0 * way / (phase.slow_sq.sqrt() + (phase.slow_sq + 2.0 * a * way).sqrt())
        };
        let (up, down) = (&sub.limits.up, &sub.limits.down);
        let (kind, axis, value, duration) = match phase.kind {
            Kind::Accelerating(k) => {
                (ArcKind::AxisAcceleration, k as u8, sign(k) * up[k], by_acceleration(k, up[k]))
            }
            Kind::Braking(k) => {
                (ArcKind::AxisAcceleration, k as u8, -sign(k) * down[k], by_acceleration(k, down[k]))
            }
            Kind::LimitCurve => continue,
            Kind::Cap => match sub.cap {
                Cap::Axis(k, v_sq) => (ArcKind::AxisVelocity, k as u8, v_sq, way(k) / v_sq.sqrt()),
                Cap::Feed(f) => (ArcKind::Feed, NO_AXIS, f, time_at_speed(sub, (f, f), phase.x0, phase.x1)),
                Cap::Speed([f0, f1]) => {
                    let time = time_at_speed(sub, (f0, f1), phase.x0, phase.x1);
                    if f0 == f1 && task.problem.share(number).is_none() {
                        (ArcKind::Feed, NO_AXIS, f0, time)
                    } else {
                        (ArcKind::SpeedLine, NO_AXIS, 0.0, time)
                    }
                }
            },
        };
        let joins = joins && !matches!(kind, ArcKind::SpeedLine);
        let rests = [matches!(phase.kind, Kind::Accelerating(_)), matches!(phase.kind, Kind::Braking(_))]
            .map(|slow| slow && phase.slow_sq == 0.0);
        let p = [p(phase.pi[0], phase.x0, rests[0]), p(phase.pi[1], phase.x1, rests[1])];
        out.push(number as u32, width, Row { kind, axis, value, t, p, duration, joins });
    }
}

/// ∫ √D/(ω² √f) dx: the time along a speed whose square f is linear in x.
fn time_at_speed<const M: usize, const C: usize>(
    sub: &SubPiece<M, C>,
    (f0, f1): (f64, f64),
    x0: f64,
    x1: f64,
) -> f64 {
    let rate = |x: [f64; NODES]| {
        let weight = sub.weight.values(x);
        // Next to a cusp the sum of squares has lost the digits that the tangents still have.
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
