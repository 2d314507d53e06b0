//! Profiles of limited jerk as columns: phases along the pieces of a path, in the order of the path, from `sections` of constant
//! jerk or from the `spline` w(s) of the jerk-limited planner.
//!
//! There are three laws, of `feedplan.profile.PhaseLaw`: the feed is held, the jerk along the path is constant, or v² is a cubic
//! of the arc length. If a phase is cut at the end of a piece, both parts follow the law of the phase. Lengths in mm, times in s.

mod sections;
mod spline;

use crate::arc_length_path::{speed_sq, ArcLengthPath};
use crate::path_problem::Geometry;
use feedplan_planner::phase_law::PhaseLaw;
use feedplan_planner::phases::{Phase, Phases, NO_AXIS};
use feedplan_planner::problem::{greater, lesser, Problem};

/// A section shorter than this fraction of the time in which an axis reaches its greatest speed counts as rounding.
const SHORTEST: f64 = 1e-9;
/// The greatest relative difference of the accelerations of two profiles at a turn that a ramp can absorb; it takes some 90 times
/// this fraction of the limit of jerk.
const TAKEN_UP: f64 = 2e-3;

#[derive(Clone, Debug, Default, PartialEq)]
pub struct JerkProfile {
    pub phases: Phases,
    /// Offsets of the runs in the phases.
    pub runs: Vec<i64>,
    /// Pieces at whose start a jump of curvature limits the speed.
    pub kinks: Vec<u32>,
    /// The planner's estimate of the time above the least time, in s, of each subrun that it planned, in order.
    pub excess: Vec<f64>,
    /// A lower bound on the time of each run, in s, if the planner was asked for it; NaN without proof.
    pub lower_bound: Vec<f64>,
    /// Whether a deadline stopped the planner.
    pub stopped: bool,
    /// Time of the phases that were left out at the start of a piece, in s.
    left_out: f64,
    /// Piece and parameter where these phases begin.
    left_from: Option<(usize, f64)>,
}

/// Arc length along a subrun in mm, speed in mm/s and acceleration in mm/s².
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct State {
    pub s: f64,
    pub v: f64,
    pub a: f64,
}

impl State {
    /// Whether the tool is at rest with an acceleration, because the path turns back.
    fn turns(&self) -> bool {
        self.v == 0.0 && self.a != 0.0
    }

    /// The state after a time t in s with a constant jerk in mm/s³.
    pub fn after(&self, t: f64, jerk: f64) -> Self {
        let Self { s, v, a } = *self;
        Self {
            s: s + t * (v + t * (0.5 * a + t * jerk / 6.0)),
            v: (v + t * (a + 0.5 * t * jerk)).max(0.0),
            a: a + t * jerk,
        }
    }
}

/// A motion under one law between two states.
struct Movement {
    law: PhaseLaw,
    value: f64,
    ends: [State; 2],
    duration: f64,
}

impl JerkProfile {
    /// The profile of a subrun that a deadline left no time for.
    pub fn unplanned() -> Self {
        Self { stopped: true, lower_bound: vec![f64::NAN], ..Self::default() }
    }

    /// Whether the profile is that of `unplanned`.
    pub fn is_unplanned(&self) -> bool {
        self.stopped && self.phases.is_empty()
    }

    /// The profiles of all parts joined in this order, without runs.
    pub fn joined(parts: Vec<Self>) -> Self {
        let (mut all, mut phases) = (Self::default(), Vec::with_capacity(parts.len()));
        for part in parts {
            phases.push(part.phases);
            all.kinks.extend(part.kinks);
            all.excess.extend(part.excess);
            all.lower_bound.extend(part.lower_bound);
            all.stopped |= part.stopped;
        }
        Self { phases: Phases::joined(phases), ..all }
    }

    /// The size of the acceleration at the start or at the end, in mm/s².
    pub fn end_acceleration(&self, end: usize) -> f64 {
        let a = if end == 0 { self.phases.a0.first() } else { self.phases.a1.last() };
        a.map_or(0.0, |a| a.abs())
    }

    /// Whether another profile can follow this one at a turn where the acceleration may be at most `most`, in mm/s². A ramp can
    /// absorb a small difference of both accelerations.
    pub fn meets(&self, next: &Self, most: f64) -> bool {
        let [own, other] = [self.end_acceleration(1), next.end_acceleration(0)];
        let (change, greater) = ((own - other).abs(), own.max(other));
        let ramp = if own > other { self.has_ramp(1) } else { next.has_ramp(0) };
        self.is_unplanned()
            || next.is_unplanned()
            || change == 0.0
            || ramp && change <= TAKEN_UP * greater && greater + change <= most
    }

    /// Whether the first phase (`end` 0) or the last one (1), but not its neighbour too, has constant acceleration: the ramp from
    /// or to rest.
    fn has_ramp(&self, end: usize) -> bool {
        let Phases { kind, value, .. } = &self.phases;
        let is_steady = |at: usize| kind[at] == PhaseLaw::PathJerk as u8 && value[at] == 0.0;
        let (at, next) = if end == 0 { (0, 1) } else { (kind.len() - 1, kind.len().wrapping_sub(2)) };
        next < kind.len() && is_steady(at) && !is_steady(next)
    }

    /// Appends a movement between two parameters of a part. A movement too short to show in u is merged into its neighbour.
    fn push<const M: usize>(
        &mut self,
        path: &ArcLengthPath<M>,
        part: usize,
        [u0, u1]: [f64; 2],
        movement: &Movement,
    ) {
        let (problem, piece) = (path.problem, path.parts[part].piece);
        let u0 = self.left_from.take().filter(|from| from.0 == piece).map_or(u0, |from| from.1);
        let phases = &mut self.phases;
        let last = phases.len().wrapping_sub(1);
        let goes_on = last < phases.len() && phases.piece[last] as usize == piece && phases.u1[last] == u0;
        let speed = |u: f64, v: f64| if v == 0.0 { 0.0 } else { v * v / speed_sq(problem, piece, u) };
        let Movement { law, value, ends: [from, to], duration } = *movement;
        let turns = from.turns() || to.turns();
        if u1 <= u0 || !turns && duration <= SHORTEST * rise_time(problem) {
            let u1 = u1.max(u0);
            if goes_on {
                phases.duration[last] += duration;
                phases.u1[last] = u1;
                phases.p1[last] = speed(u1, to.v);
                phases.a1[last] = to.a;
            } else {
                self.left_out += duration;
                self.left_from = Some((piece, u0));
            }
            return;
        }
        phases.push(&Phase {
            piece: piece as u32,
            law,
            axis: NO_AXIS,
            value,
            u0,
            u1,
            p0: speed(u0, from.v),
            p1: speed(u1, to.v),
            duration: duration + std::mem::take(&mut self.left_out),
            a0: from.a,
            a1: to.a,
        });
    }

    /// Appends the path between two arc lengths of a subrun, passed at its feed in mm/s.
    pub fn push_held<const M: usize>(&mut self, path: &ArcLengthPath<M>, [from, to]: [f64; 2], feed: f64) {
        let state = State { s: 0.0, v: feed, a: 0.0 };
        let mut part = path.part(from);
        while part < path.parts.len() && path.knots()[part] < to {
            path.problem.watch.check_at(part);
            let u = [from, to].map(|s| path.locate(part, s));
            let duration = path.length_between(part, u[0], u[1]) / feed;
            let movement = Movement { law: PhaseLaw::Feed, value: feed * feed, ends: [state; 2], duration };
            self.push(path, part, u, &movement);
            part += 1;
        }
    }
}

/// The least time in which an axis reaches its greatest speed, in s.
fn rise_time<const M: usize>(problem: &Problem<M>) -> f64 {
    let (velocity, acceleration) = (lesser(&problem.max_velocity), greater(&problem.max_acceleration));
    let of_axis = |k: usize| velocity[k] / acceleration[k];
    (0..M).map(of_axis).fold(f64::INFINITY, f64::min)
}
