//! The jerk-limited planner on a path of the package, with the problem's limits and jerk limits [mm/s³]: a profile of
//! phases over the pieces' parameters, and a lower bound on its time.
//!
//! Each subrun is planned along its arc length. Two more speed caps hold inside it: a corner is passed at its speed,
//! and a junction where q'' jumps at the speed at which third differences of setpoints keep the limits of jerk
//! (`curvature_jumps`). Lines from rest to rest take sections of constant jerk.

use std::ops::Range;

use rayon::prelude::*;

use crate::arc_length_path::{speed_sq, ArcLengthPath, Junction, Part};
use crate::jerk_limited::{self, Effort, End, Geometry, Limits, Profile};
use crate::jerk_profile::{JerkProfile, SPEED_CUBIC};
use crate::s_curve;
use crate::subruns::{checked, over_subruns, subruns, Subrun};
use feedplan_planner::problem::{along, Fault, Problem};

/// A junction holds the speed where the plan is within this part of its cap.
const HELD: f64 = 0.998;
/// A subrun without a plan is cut at most this often where the planner finds no speed.
const CUTS: u32 = 12;
/// Bisection steps for the greatest speed that an end can have.
const TRIALS: u32 = 12;

/// The fastest profile within these jerk limits, in mm/s³.
///
/// After the deadline, a run with an unplanned subrun has no phases, and subruns whose planning was stopped keep their
/// best plan so far.
pub fn plan<const M: usize>(
    problem: &Problem<M>,
    jerk: &[f64; M],
    effort: &Effort,
) -> Result<JerkProfile, Fault> {
    over_subruns(problem, jerk, |subrun, limits, watch| {
        Task { problem, limits: *limits, effort: &Effort { watch, ..*effort } }.subrun(subrun)
    })
}

/// Columns of a profile of this planner.
#[derive(Clone, Copy, Debug)]
pub struct Columns<'a> {
    pub piece: &'a [u32],
    pub kind: &'a [u8],
    pub u0: &'a [f64],
    pub u1: &'a [f64],
    pub p0: &'a [f64],
    pub p1: &'a [f64],
    pub a0: &'a [f64],
    pub a1: &'a [f64],
    pub duration: &'a [f64],
}

/// A lower bound on the time of each subrun, in s, on the grid of a profile: see `jerk_limited::certify`. It is 0 for a
/// subrun that this planner did not plan as a whole, and for those that the deadline leaves no time for.
pub fn certified<const M: usize>(
    problem: &Problem<M>,
    jerk: &[f64; M],
    columns: &Columns,
    effort: &Effort,
) -> Result<Vec<f64>, Fault> {
    let limits = checked(problem, jerk)?;
    let subruns = subruns(problem);
    let position = |phase: usize| (columns.piece[phase] as usize, columns.u0[phase]);
    let count = columns.piece.len();
    let mut offsets = vec![];
    let mut phase = 0;
    for subrun in &subruns {
        let start = subrun.parts[0];
        while phase < count && position(phase) < (start.piece, start.u[0]) {
            phase += 1;
        }
        offsets.push(phase);
    }
    offsets.push(count);
    let watch = problem.watch.each(problem.width.len());
    let lower_bound = |(i, subrun): (usize, &Subrun)| {
        if effort.expired() {
            return 0.0;
        }
        let effort = Effort { watch: watch.part(subrun.parts.len() as f64), ..*effort };
        let task = Task { problem, limits, effort: &effort };
        task.certified(subrun, columns, offsets[i]..offsets[i + 1]).unwrap_or(0.0)
    };
    Ok(subruns.par_iter().enumerate().map(lower_bound).collect())
}

pub struct Task<'a, const M: usize> {
    pub problem: &'a Problem<'a, M>,
    pub limits: Limits<M>,
    pub effort: &'a Effort<'a>,
}

impl<const M: usize> Task<'_, M> {
    /// The profile of a subrun; unplanned if the deadline has passed.
    pub fn subrun(&self, subrun: &Subrun) -> Result<JerkProfile, Fault> {
        if self.effort.expired() {
            return Ok(JerkProfile::unplanned());
        }
        self.plan(&subrun.parts, subrun.ends, 0)
    }

    /// The profile of parts between speeds at their ends in mm/s, after this number of cuts.
    fn plan(&self, parts: &[Part], speeds: [f64; 2], cuts: u32) -> Result<JerkProfile, Fault> {
        let path = ArcLengthPath::new(self.problem, parts);
        let mut phases = JerkProfile::default();
        if let Some((direction, feed)) = path.line() {
            if let Some(sections) = self.cross(path.total(), &direction, feed, speeds)? {
                phases.push_sections(self.problem, &path, &sections, speeds[1]);
                return Ok(phases);
            }
        }
        let junctions = path.junctions(&self.limits.jerk);
        let caps = path.caps(&junctions);
        let problem = jerk_limited::Problem {
            geometry: &path,
            limits: self.limits,
            caps: &caps,
            ends: speeds.map(end),
        };
        let moving = speeds != [0.0; 2];
        match jerk_limited::plan(&problem, self.effort) {
            // The deadline came before the first iteration of all windows.
            Ok(plan) if plan.iterations == 0.0 && self.effort.expired() => Ok(JerkProfile::unplanned()),
            Ok(plan) => {
                phases.push_profile(self.problem, &path, &self.limits.jerk, &plan.profile);
                phases.excess.push(plan.excess);
                phases.stopped = !plan.converged && self.effort.expired();
                for Junction { cap, jumps } in junctions {
                    if jumps && plan.profile.at(cap.s)[0] >= HELD * cap.speed * cap.speed {
                        phases.kinks.push(parts[path.part(cap.s)].piece as u32);
                    }
                }
                Ok(phases)
            }
            // A moving end has no plan before some iterations.
            Err(jerk_limited::Fault::NoPlan { .. }) if moving && self.effort.expired() => {
                Ok(JerkProfile::unplanned())
            }
            Err(jerk_limited::Fault::Input(what)) => Err(Fault::Input { piece: Some(parts[0].piece), what }),
            Err(jerk_limited::Fault::NoPlan { .. }) if moving => {
                self.out_of_reach(&path, parts, speeds, &caps)
            }
            Err(jerk_limited::Fault::NoPlan { s }) if cuts < CUTS => self.cut(&path, s, cuts),
            Err(jerk_limited::Fault::NoPlan { s }) => {
                let part = path.part(s);
                Err(Fault::Stuck { piece: parts[part].piece, u: path.locate(part, s) })
            }
        }
    }

    /// The lower bound of a subrun; None where its phases are no profile of this planner.
    fn certified(&self, subrun: &Subrun, columns: &Columns, phases: Range<usize>) -> Option<f64> {
        let path = ArcLengthPath::new(self.problem, &subrun.parts);
        let is_cubic = |phase: &usize| columns.kind[*phase] == SPEED_CUBIC;
        let Some(first) = phases.clone().find(is_cubic) else {
            let time = columns.duration[phases].iter().sum();
            return path.line().map(|_| time);
        };
        let last = phases.clone().rev().find(is_cubic)?;
        if (first..last).any(|phase| columns.p1[phase] == 0.0) {
            return None;
        }
        let knots = path.knots();
        let mut profile = Profile { ends: [0.0, path.total()], ..Profile::default() };
        let mut part = 0;
        for phase in first..=last {
            self.problem.watch.check_at(phase);
            let (piece, u) = (columns.piece[phase] as usize, [columns.u0[phase], columns.u1[phase]]);
            while path.parts[part].piece != piece || path.parts[part].u[1] <= u[0] {
                part += 1;
                path.parts.get(part)?;
            }
            if path.parts[part].u[1] < u[1] {
                return None;
            }
            let speed_sq = |u: f64, p: f64| p * speed_sq(self.problem, piece, u);
            if phase == first {
                let before = path.length_between(part, path.parts[part].u[0], u[0]);
                profile.s.push(knots[part] + before);
                profile.speed_sq.push(speed_sq(u[0], columns.p0[phase]));
                profile.slope.push(2.0 * columns.a0[phase]);
            }
            let ends = u[1] >= path.parts[part].u[1];
            let before = profile.s[profile.s.len() - 1];
            let s = if ends { knots[part + 1] } else { before + path.length_between(part, u[0], u[1]) };
            if s <= before {
                return None;
            }
            profile.s.push(s);
            profile.speed_sq.push(speed_sq(u[1], columns.p1[phase]));
            profile.slope.push(2.0 * columns.a1[phase]);
        }
        let caps = path.caps(&path.junctions(&self.limits.jerk));
        let problem = jerk_limited::Problem {
            geometry: &path,
            limits: self.limits,
            caps: &caps,
            ends: subrun.ends.map(end),
        };
        Some(jerk_limited::certify(&problem, &profile, self.effort).least_time)
    }

    /// The quickest sections of a line with one feed; None where it is too short, or its limits differ for speeding up
    /// and down.
    fn cross(
        &self,
        length: f64,
        direction: &[f64; M],
        feed: f64,
        speeds: [f64; 2],
    ) -> Result<Option<Vec<s_curve::Section>>, Fault> {
        let Limits { velocity, acceleration, jerk } = &self.limits;
        let up = along(acceleration, direction);
        if up != along(acceleration, &direction.map(|direction| -direction)) {
            return Ok(None);
        }
        let segment = s_curve::Segment {
            length,
            allowable: along(velocity, direction),
            desired: feed,
            limits: s_curve::Limits { acceleration: up, jerk: along(&[*jerk; 2], direction) },
            junction: 0.0,
        };
        s_curve::cross(&segment, speeds)
    }

    /// The profile with a stop at s, where the planner finds no speed, or half-way.
    fn cut(&self, path: &ArcLengthPath<M>, s: f64, cuts: u32) -> Result<JerkProfile, Fault> {
        let total = path.total();
        let s = if s > 1e-6 * total && s < (1.0 - 1e-6) * total { s } else { 0.5 * total };
        let part = path.part(s);
        let (u, at) = (path.locate(part, s), path.parts[part]);
        let mut left = path.parts[..=part].to_vec();
        let mut right = path.parts[part..].to_vec();
        if u <= at.u[0] {
            left.pop();
        } else {
            left[part].u[1] = u;
            right[0].u[0] = u;
        }
        if left.is_empty() {
            return Err(Fault::Stuck { piece: at.piece, u });
        }
        let mut phases = self.plan(&left, [0.0; 2], cuts + 1)?;
        let rest = self.plan(&right, [0.0; 2], cuts + 1)?;
        if phases.is_unplanned() || rest.is_unplanned() {
            return Ok(JerkProfile::unplanned());
        }
        phases.append(rest);
        Ok(phases)
    }

    /// The fault of a subrun that cannot meet both ends, with the greatest speed that can be met.
    fn out_of_reach(
        &self,
        path: &ArcLengthPath<M>,
        parts: &[Part],
        speeds: [f64; 2],
        caps: &[jerk_limited::SpeedCap],
    ) -> Result<JerkProfile, Fault> {
        let effort = Effort { deadline: None, tolerance: 1e-4, ..*self.effort };
        let possible = |speeds: [f64; 2]| {
            let problem =
                jerk_limited::Problem { geometry: path, limits: self.limits, caps, ends: speeds.map(end) };
            jerk_limited::plan(&problem, &effort).is_ok()
        };
        // The end is at fault where the start alone can be met.
        let at = usize::from(speeds[0] == 0.0 || (speeds[1] > 0.0 && possible([speeds[0], 0.0])));
        let with = |speed: f64| if at == 0 { [speed, 0.0] } else { [speeds[0], speed] };
        let (mut low, mut high) = (0.0, speeds[at]);
        for _ in 0..TRIALS {
            let middle = 0.5 * (low + high);
            if possible(with(middle)) {
                low = middle;
            } else {
                high = middle;
            }
        }
        Err(if at == 0 {
            Fault::Start { piece: parts[0].piece, reachable: low }
        } else {
            Fault::End { piece: parts[parts.len() - 1].piece, reachable: low }
        })
    }
}

fn end(speed: f64) -> End {
    if speed == 0.0 {
        End::Rest
    } else {
        End::Moving { speed, acceleration: 0.0 }
    }
}
