//! Both passes over one run, its arcs into the columns of the profile.

use super::check::keeps_limits;
use super::part::{Cap, Part, Remedy, SubPiece};
use super::pass::{self, distance, leading, Arc, Kind, State, Stuck};
use super::piece::Piece;
use super::split::{split, Cut, Limits};
use super::store::Store;
use super::time::time_at_speed;
use super::{Task, TIP_AXES};
use crate::arc_kind::ArcKind;
use crate::bang_bang_quadratic::{Fault, Profile, Row, Workspace as QuadraticWorkspace, NO_AXIS};
use crate::AxisBits;
use feedplan_geometry::polynomial::MOST;
use feedplan_geometry::quadratic::norm;

/// Two directions that differ by more than this at a cusp form a corner.
const SMOOTH_TURN: f64 = 1e-9;
/// A speed asked for at an end of the path may exceed what can be had by this part, which is rounding.
const REACHED: f64 = 1e-12;
/// A run in which rounding leaves a pass without headway is planned anew so often, with more cuts every time.
const MOST_ATTEMPTS: usize = 40;

/// Space for the passes, kept from run to run.
#[derive(Default)]
pub struct Workspace {
    cuts: Vec<Cut>,
    parts: Vec<Part>,
    /// Of each piece: its parts, of each part: its sub-piece and its arcs of the backward pass, last piece and last part
    /// first.
    pieces: Vec<std::ops::Range<usize>>,
    subs: Store,
    bounds: Vec<Arc>,
    offsets: Vec<usize>,
    arcs: Vec<Arc>,
    /// Cuts where a pass came to no end, and those that this attempt asks for.
    remedies: Vec<Remedy>,
    asked: Vec<Remedy>,
    /// For the pieces that the planner of quadratics takes.
    pub quadratic: QuadraticWorkspace,
}

impl Workspace {
    /// Empty, with room for what most runs of so many pieces need.
    fn clear(&mut self, pieces: usize) {
        self.quadratic.clear();
        self.parts.clear();
        self.parts.reserve(2 * pieces);
        self.pieces.clear();
        self.pieces.reserve(pieces);
        self.subs.clear();
        self.bounds.clear();
        self.bounds.reserve(2 * pieces);
        self.offsets.clear();
        self.offsets.reserve(2 * pieces);
    }
}

/// Plans the pieces `first..last` of the task from one speed squared of the tool to another; appends the arcs.
pub fn plan_run<const M: usize>(
    task: &Task<M>,
    (first, last): (usize, usize),
    (start_sq, end_sq): (f64, f64),
    space: &mut Workspace,
    out: &mut Profile,
) -> Result<(), Fault> {
    space.remedies.clear();
    let rows = out.len();
    for attempt in 0..MOST_ATTEMPTS {
        space.asked.clear();
        let reachable = backward(task, (first, last), end_sq, space)?;
        if space.asked.is_empty() {
            if start_sq > reachable * (1.0 + REACHED) {
                return Err(Fault::Start { piece: first, reachable: reachable.sqrt() });
            }
            let reached = forward(task, (first, last), start_sq.min(reachable), space, out)?;
            if space.asked.is_empty() {
                if reached < end_sq * (1.0 - REACHED) {
                    return Err(Fault::End { piece: last - 1, reachable: reached.sqrt() });
                }
                out.end_run();
                let stops = space.remedies.iter().filter(|remedy| remedy.stops);
                out.slowed.extend(stops.map(|remedy| remedy.piece as u32));
                return Ok(());
            }
            out.truncate(rows);
        }
        for remedy in &mut space.asked {
            // Other numbers may do; a stop simplifies.
            remedy.stops = attempt > 0;
        }
        space.remedies.append(&mut space.asked);
    }
    let Remedy { piece, t, .. } = space.remedies[space.remedies.len() - 1];
    Err(Fault::Stuck { piece, u: t * task.problem.width[piece] })
}

/// Calls a function with the capacity of polynomials that a piece needs: that of quadratics, of cubics and conics, of
/// other polynomial pieces, of all. For many axes fewer capacities are compiled, since each takes the compiler some seconds:
/// there a piece of low degree has a greater capacity than it needs.
macro_rules! with_capacity {
    ($task:expr, $i:expr, $function:ident($($argument:expr),*)) => {{
        let needed = $task.coefficients($i);
        if const { M <= 3 } && needed <= 6 {
            $function::<M, 6>($($argument),*)
        } else if const { M <= 6 } && needed <= 11 {
            $function::<M, 11>($($argument),*)
        } else if needed <= 36 {
            $function::<M, 36>($($argument),*)
        } else {
            $function::<M, MOST>($($argument),*)
        }
    }};
}

impl<const M: usize> Task<'_, M> {
    fn piece<const C: usize>(&self, i: usize) -> Piece<M, C> {
        let problem = self.problem;
        let speed_sq = problem.tip.map(|tip| (tip.speed.of(i), problem.width[i].powi(2)));
        Piece::new(
            &problem.control[problem.offset[i]..problem.offset[i + 1]],
            weights_of(problem.weight, problem.offset, i),
            speed_sq,
        )
        .with_share(problem.share(i))
    }

    /// The tool's own piece where it is another one and its chord error is limited.
    fn tip_piece<const C: usize>(&self, i: usize) -> Option<Piece<TIP_AXES, C>> {
        let tip = self.problem.tip.filter(|_| self.chord.is_some())?;
        let control = &tip.control[tip.offset[i]..tip.offset[i + 1]];
        // Where the tool stands still it has no chord.
        let moves = control.iter().any(|point| *point != control[0]);
        moves.then(|| Piece::new(control, weights_of(tip.weight, tip.offset, i), None))
    }

    /// How many coefficients the polynomials of a piece have at most.
    fn coefficients(&self, i: usize) -> usize {
        let problem = self.problem;
        // A bound of the speed that is not constant adds one to what rational pieces need.
        let sloped = usize::from(self.chord.is_some());
        let of = |offset: &[usize], weight: &[f64]| {
            let degree = offset[i + 1] - offset[i] - 1;
            let rational = weights_of(weight, offset, i).iter().any(|&w| w != weight[offset[i]]);
            (degree, if rational { 8 * degree - 6 + sloped } else { 4 * degree - 2 })
        };
        let (degree, own) = of(problem.offset, problem.weight);
        let Some(tip) = problem.tip else { return own };
        let speed = tip.speed.of(i).len();
        let chord = if self.chord.is_some() { of(tip.offset, tip.weight).1 } else { 0 };
        own.max(2 * speed).max(2 * degree + speed).max(chord)
    }
}

fn weights_of<'a>(weight: &'a [f64], offset: &[usize], i: usize) -> &'a [f64] {
    weight.get(offset[i]..offset[i + 1]).unwrap_or(&[])
}

/// Where parts meet.
#[derive(Clone, Copy)]
struct PartEnd<const M: usize> {
    /// The tangent is zero there.
    is_cusp: bool,
    /// The limit of its direction, of any length, with bits of the axes that move backward.
    lead: [f64; M],
    negative: AxisBits,
}

impl<const M: usize> PartEnd<M> {
    fn of<const C: usize>(sub: &SubPiece<M, C>, negative: AxisBits, at_end: bool) -> Self {
        Self { is_cusp: sub.cusp_order(at_end) > 0, lead: leading(sub, at_end), negative }
    }

    /// Of a piece that the planner of quadratics takes.
    fn of_quadratic((is_cusp, lead): (bool, [f64; M])) -> Self {
        Self { is_cusp, lead, negative: 0 }
    }

    fn direction(&self) -> [f64; M] {
        let length = norm(&self.lead);
        let sign = |k: usize| if self.negative >> k & 1 == 1 { -1.0 } else { 1.0 };
        std::array::from_fn(|k| sign(k) * self.lead[k] / length)
    }
}

/// The greatest v² where two parts meet: none in the corner of a cusp.
fn at_cusp<const M: usize>(before: &PartEnd<M>, after: &PartEnd<M>, speed_sq: f64) -> f64 {
    if !before.is_cusp && !after.is_cusp {
        return speed_sq;
    }
    let (before, after) = (before.direction(), after.direction());
    let turn = norm(&std::array::from_fn::<f64, M, _>(|k| before[k] - after[k]));
    if turn > SMOOTH_TURN {
        0.0
    } else {
        speed_sq
    }
}

/// Where a pass stands between two pieces.
struct Between<const M: usize> {
    state: State,
    /// The side that the pass has left.
    end: Option<PartEnd<M>>,
    /// The tool's speed squared there.
    tip_sq: f64,
}

/// The axes' speed squared at the tool's.
fn of_axes(tip_sq: f64, tip_share: f64) -> f64 {
    if tip_sq == 0.0 {
        0.0
    } else {
        tip_sq / tip_share
    }
}

/// The tool's greatest speed squared at the start of the run from which `end_sq` can be met; leaves the arcs in the
/// workspace.
fn backward<const M: usize>(
    task: &Task<M>,
    (first, last): (usize, usize),
    end_sq: f64,
    space: &mut Workspace,
) -> Result<f64, Fault> {
    space.clear(last - first);
    let mut at = Between { state: State { speed_sq: f64::INFINITY }, end: None, tip_sq: end_sq };
    for i in (first..last).rev() {
        task.watch.part(0.5).count(i);
        if i + 1 < last {
            at.tip_sq = task.problem.junction_speed[i + 1].powi(2);
        }
        if let Some(quadratic) = task.quadratic(i) {
            let [start, end] = quadratic.ends(i).map(PartEnd::of_quadratic);
            let mut speed_sq = at.state.speed_sq.min(at.tip_sq);
            if let Some(after) = &at.end {
                speed_sq = at_cusp(&end, after, speed_sq);
            }
            at.tip_sq = quadratic.backward_over(i, speed_sq, &mut space.quadratic)?;
            (at.state, at.end) = (State { speed_sq: at.tip_sq }, Some(start));
            space.pieces.push(space.parts.len()..space.parts.len());
        } else {
            with_capacity!(task, i, backward_over(task, i, &mut at, space));
        }
    }
    Ok(at.tip_sq)
}

/// Backward over piece `i`; `at.tip_sq` is a limit before, and what was reached after it.
fn backward_over<const M: usize, const C: usize>(
    task: &Task<M>,
    i: usize,
    at: &mut Between<M>,
    space: &mut Workspace,
) {
    let piece = task.piece::<C>(i);
    let start = space.parts.len();
    let tip = task.tip_piece::<C>(i);
    let limits =
        Limits { axes: &task.axes, feed_sq: task.problem.feed[i].powi(2), chord: task.chord.as_ref() };
    let remedies = space.remedies.iter().filter(|remedy| remedy.piece == i).copied();
    split(&piece, tip.as_ref(), &limits, remedies, &mut space.cuts, &mut space.parts);
    space.pieces.push(start..space.parts.len());
    let mut limited = false;
    for number in (start..space.parts.len()).rev() {
        let part = space.parts[number];
        let sub = part.sub_piece(&piece, &task.axes);
        let end = PartEnd::of(&sub, part.negative, true);
        if !std::mem::replace(&mut limited, true) {
            at.state.speed_sq = at.state.speed_sq.min(of_axes(at.tip_sq, sub.tip_share(true)));
        }
        if let Some(after) = &at.end {
            at.state.speed_sq = at_cusp(&end, after, at.state.speed_sq);
        }
        at.end = Some(PartEnd::of(&sub, part.negative, false));
        space.subs.push(&sub);
        space.offsets.push(space.bounds.len());
        let reversed = sub.reversed();
        let arcs = space.bounds.len();
        at.state = match pass::run::<M, C, true>(&reversed, at.state, &[], &mut space.bounds) {
            Ok(next) if !part.starts_at_rest() => next,
            Ok(_) => State { speed_sq: 0.0 },
            Err(Stuck(x)) => {
                space.bounds.truncate(arcs);
                space.asked.push(part.remedy(i, 1.0 - x));
                State { speed_sq: 0.0 }
            }
        };
        at.tip_sq = at.state.speed_sq * sub.tip_share(false);
    }
}

/// From `start_sq` of the tool under the arcs of the backward pass; appends the rows and returns the tool's speed
/// squared at the end.
fn forward<const M: usize>(
    task: &Task<M>,
    (first, last): (usize, usize),
    start_sq: f64,
    space: &mut Workspace,
    out: &mut Profile,
) -> Result<f64, Fault> {
    let mut at = Between { state: State { speed_sq: f64::INFINITY }, end: None, tip_sq: start_sq };
    let mut index = space.offsets.len();
    for i in first..last {
        task.watch.part(0.5).count(i);
        if i > first {
            at.tip_sq = task.problem.junction_speed[i].powi(2);
        }
        if let Some(quadratic) = task.quadratic(i) {
            let [start, end] = quadratic.ends(i).map(PartEnd::of_quadratic);
            let mut speed_sq = at.state.speed_sq.min(at.tip_sq);
            if let Some(before) = &at.end {
                speed_sq = at_cusp(before, &start, speed_sq);
            }
            at.tip_sq = quadratic.forward_over(i, speed_sq, &mut space.quadratic, out)?;
            (at.state, at.end) = (State { speed_sq: at.tip_sq }, Some(end));
        } else {
            let parts = space.pieces[last - 1 - i].clone();
            with_capacity!(task, i, forward_over(task, i, parts, &mut index, &mut at, space, out));
        }
    }
    Ok(at.tip_sq)
}

/// Forward over piece `i`; `index` counts down the arcs of the backward pass, `at.tip_sq` as there.
fn forward_over<const M: usize, const C: usize>(
    task: &Task<M>,
    i: usize,
    parts: std::ops::Range<usize>,
    index: &mut usize,
    at: &mut Between<M>,
    space: &mut Workspace,
    out: &mut Profile,
) {
    let mut limited = false;
    for number in parts {
        *index -= 1;
        let part = space.parts[number];
        let sub = space.subs.get::<M, C>(*index, &part, &task.axes);
        let start = PartEnd::of(&sub, part.negative, false);
        if !std::mem::replace(&mut limited, true) {
            at.state.speed_sq = at.state.speed_sq.min(of_axes(at.tip_sq, sub.tip_share(false)));
        }
        if let Some(before) = &at.end {
            at.state.speed_sq = at_cusp(before, &start, at.state.speed_sq);
        }
        if part.starts_at_rest() {
            at.state.speed_sq = 0.0;
        }
        at.end = Some(PartEnd::of(&sub, part.negative, true));
        let end = space.offsets.get(*index + 1).copied().unwrap_or(space.bounds.len());
        let bounds = &space.bounds[space.offsets[*index]..end];
        space.arcs.clear();
        let kept = pass::run::<M, C, false>(&sub, at.state, bounds, &mut space.arcs)
            .and_then(|next| keeps_limits(&sub, &space.arcs).map(|()| next));
        at.state = kept.unwrap_or_else(|Stuck(x)| {
            space.asked.push(part.remedy(i, x));
            State { speed_sq: 0.0 }
        });
        at.tip_sq = at.state.speed_sq * sub.tip_share(true);
        push(task, i, &part, &sub, &space.arcs, out);
    }
}

/// Appends the arcs of the forward pass over one part.
fn push<const M: usize, const C: usize>(
    task: &Task<M>,
    number: usize,
    part: &Part,
    sub: &SubPiece<M, C>,
    arcs: &[Arc],
    out: &mut Profile,
) {
    let width = task.problem.width[number];
    let span = part.to - part.from;
    for arc in arcs {
        let t = if arc.x1 == 1.0 { part.to } else { part.from + span * arc.x1 };
        let weight = |x: f64| sub.weight.value(x);
        // p = (dt/dτ)² from π of x. At rest in a cusp p has no limit, and counts as 0.
        let p = |pi: f64, x: f64, rests: bool| {
            if rests && pi.is_infinite() {
                0.0
            } else {
                pi * weight(x).powi(4) * span * span
            }
        };
        let way = |k: usize| distance(sub, k, arc.x0, arc.x1);
        let sign = |k: usize| if part.negative >> k & 1 == 1 { -1.0 } else { 1.0 };
        let mut joins = true;
        let mut by_acceleration = |k: usize, a: f64| {
            // Way over mean speed, the faster speed from the way.
            let way = way(k);
            // Not with what comes before its axis turns, not even where arcs too short to be kept lie in between.
            joins = arc.pi[0].is_finite() && arc.pi[1].is_finite() && sub.g[k].first() > 0.0;
            if way <= 0.0 {
                return 0.0;
            }
            2.0 * way / (arc.slow_sq.sqrt() + (arc.slow_sq + 2.0 * a * way).sqrt())
        };
        let (up, down) = (&sub.limits.up, &sub.limits.down);
        let (kind, axis, value, duration) = match arc.kind {
            Kind::Accelerating(k) => {
                (ArcKind::AxisAcceleration, k as u8, sign(k) * up[k], by_acceleration(k, up[k]))
            }
            Kind::Braking(k) => {
                (ArcKind::AxisAcceleration, k as u8, -sign(k) * down[k], by_acceleration(k, down[k]))
            }
            Kind::LimitCurve => continue,
            Kind::Cap => match sub.cap {
                Cap::Axis(k, v_sq) => (ArcKind::AxisVelocity, k as u8, v_sq, way(k) / v_sq.sqrt()),
                Cap::Feed(f) => (ArcKind::Feed, NO_AXIS, f, time_at_speed(sub, (f, f), arc.x0, arc.x1)),
                Cap::Speed([f0, f1]) => {
                    let time = time_at_speed(sub, (f0, f1), arc.x0, arc.x1);
                    if f0 == f1 && task.problem.share(number).is_none() {
                        (ArcKind::Feed, NO_AXIS, f0, time)
                    } else {
                        (ArcKind::SpeedLine, NO_AXIS, 0.0, time)
                    }
                }
            },
        };
        let joins = joins && !matches!(kind, ArcKind::SpeedLine);
        let rests = [matches!(arc.kind, Kind::Accelerating(_)), matches!(arc.kind, Kind::Braking(_))]
            .map(|slow| slow && arc.slow_sq == 0.0);
        let p = [p(arc.pi[0], arc.x0, rests[0]), p(arc.pi[1], arc.x1, rests[1])];
        out.push(number as u32, width, Row { kind, axis, value, t, p, duration, joins });
    }
}
