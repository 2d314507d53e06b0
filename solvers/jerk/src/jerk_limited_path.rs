//! The jerk-limited planner on a path of the package: from rest to rest, by the length of the tool's way.
//!
//! A run is cut where the tool has to rest: at stops and at cusps, whose curvature has no bound. Between those a
//! corner is passed at its speed, and a joint where q'' jumps at the speed at which third differences of setpoints keep the
//! limits of jerk (`curvature_jumps`). Lines from rest to rest take sections of constant jerk.

use std::ops::Range;

use rayon::prelude::*;

use crate::by_length::{speed_sq, ByLength, Joint, Part};
use crate::jerk_arcs::{Arcs, SPEED_CUBIC};
use crate::jerk_limited::{self, Effort, End, Geometry, Limits, Profile};
use crate::s_curve;
use crate::stretches::{checked, over_stretches, stretches, Stretch};
use feedplan_planner::problem::{along, Fault, Problem};

/// A joint holds the speed where the plan is within this part of its cap.
const HELD: f64 = 0.998;
/// A stretch without a plan is cut so often, where the planner sees no speed.
const CUTS: u32 = 12;
/// Speeds tried for the greatest one that an end can have.
const TRIALS: u32 = 12;

/// The fastest profile with these jerk limits, in mm/s³.
///
/// A run of which a stretch is not planned when the deadline comes has no arcs; what is being planned then is the best
/// so far.
pub fn plan<const M: usize>(problem: &Problem<M>, jerk: &[f64; M], effort: &Effort) -> Result<Arcs, Fault> {
    over_stretches(problem, jerk, |stretch, limits, watch| {
        Task { problem, limits: *limits, effort: &Effort { watch, ..*effort } }.stretch(stretch)
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

/// A bound in s of the time of each stretch on the grids of a profile: see `jerk_limited::certify`. It is 0 for a stretch
/// that this planner did not plan as one, and for those that the deadline leaves no time for.
pub fn certified<const M: usize>(
    problem: &Problem<M>,
    jerk: &[f64; M],
    columns: &Columns,
    effort: &Effort,
) -> Result<Vec<f64>, Fault> {
    let limits = checked(problem, jerk)?;
    let stretches = stretches(problem);
    let place = |arc: usize| (columns.piece[arc] as usize, columns.u0[arc]);
    let count = columns.piece.len();
    let mut offsets = vec![];
    let mut arc = 0;
    for stretch in &stretches {
        let start = stretch.parts[0];
        while arc < count && place(arc) < (start.piece, start.u[0]) {
            arc += 1;
        }
        offsets.push(arc);
    }
    offsets.push(count);
    let watch = problem.watch.each(problem.width.len());
    let bound = |(i, stretch): (usize, &Stretch)| {
        if effort.expired() {
            return 0.0;
        }
        let effort = Effort { watch: watch.part(stretch.parts.len() as f64), ..*effort };
        let task = Task { problem, limits, effort: &effort };
        task.certified(stretch, columns, offsets[i]..offsets[i + 1]).unwrap_or(0.0)
    };
    Ok(stretches.par_iter().enumerate().map(bound).collect())
}

/// The planner of stretches.
pub struct Task<'a, const M: usize> {
    pub problem: &'a Problem<'a, M>,
    pub limits: Limits<M>,
    pub effort: &'a Effort<'a>,
}

impl<const M: usize> Task<'_, M> {
    /// The profile of a stretch; none that is begun after the deadline.
    pub fn stretch(&self, stretch: &Stretch) -> Result<Arcs, Fault> {
        if self.effort.expired() {
            return Ok(Arcs::unplanned());
        }
        self.plan(&stretch.parts, stretch.ends, 0)
    }

    /// The profile of parts between speeds at their ends; cut so often already.
    fn plan(&self, parts: &[Part], speeds: [f64; 2], cuts: u32) -> Result<Arcs, Fault> {
        let path = ByLength::new(self.problem, parts);
        let mut arcs = Arcs::default();
        if let Some((direction, feed)) = path.line() {
            if let Some(sections) = self.cross(path.total(), &direction, feed, speeds)? {
                arcs.push_sections(self.problem, &path, &sections, speeds[1]);
                return Ok(arcs);
            }
        }
        let joints = path.joints(&self.limits.jerk);
        let caps = path.caps(&joints);
        let problem = jerk_limited::Problem {
            geometry: &path,
            limits: self.limits,
            caps: &caps,
            ends: speeds.map(end),
        };
        let moving = speeds != [0.0; 2];
        match jerk_limited::plan(&problem, self.effort) {
            // The deadline came before the first step of all windows.
            Ok(plan) if plan.iterations == 0.0 && self.effort.expired() => Ok(Arcs::unplanned()),
            Ok(plan) => {
                arcs.push_profile(self.problem, &path, &self.limits.jerk, &plan.profile);
                arcs.excess.push(plan.excess);
                arcs.stopped = !plan.converged && self.effort.expired();
                for Joint { cap, jumps } in joints {
                    if jumps && plan.profile.at(cap.s)[0] >= HELD * cap.speed * cap.speed {
                        arcs.kinks.push(parts[path.part(cap.s)].piece as u32);
                    }
                }
                Ok(arcs)
            }
            // There is no plan to a moving end before it is found.
            Err(jerk_limited::Fault::NoPlan { .. }) if moving && self.effort.expired() => {
                Ok(Arcs::unplanned())
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

    /// The bound of a stretch; None where its arcs are no profile of this planner.
    fn certified(&self, stretch: &Stretch, columns: &Columns, arcs: Range<usize>) -> Option<f64> {
        let path = ByLength::new(self.problem, &stretch.parts);
        let is_cubic = |arc: &usize| columns.kind[*arc] == SPEED_CUBIC;
        let Some(first) = arcs.clone().find(is_cubic) else {
            let time = columns.duration[arcs].iter().sum();
            return path.line().map(|_| time);
        };
        let last = arcs.clone().rev().find(is_cubic)?;
        if (first..last).any(|arc| columns.p1[arc] == 0.0) {
            return None;
        }
        let knots = path.knots();
        let mut profile = Profile { ends: [0.0, path.total()], ..Profile::default() };
        let mut part = 0;
        for arc in first..=last {
            self.problem.watch.check_at(arc);
            let (piece, u) = (columns.piece[arc] as usize, [columns.u0[arc], columns.u1[arc]]);
            while path.parts[part].piece != piece || path.parts[part].u[1] <= u[0] {
                part += 1;
                path.parts.get(part)?;
            }
            if path.parts[part].u[1] < u[1] {
                return None;
            }
            let speed_sq = |u: f64, p: f64| p * speed_sq(self.problem, piece, u);
            if arc == first {
                let before = path.between(part, path.parts[part].u[0], u[0]);
                profile.s.push(knots[part] + before);
                profile.speed_sq.push(speed_sq(u[0], columns.p0[arc]));
                profile.slope.push(2.0 * columns.a0[arc]);
            }
            let ends = u[1] >= path.parts[part].u[1];
            let before = profile.s[profile.s.len() - 1];
            let s = if ends { knots[part + 1] } else { before + path.between(part, u[0], u[1]) };
            if s <= before {
                return None;
            }
            profile.s.push(s);
            profile.speed_sq.push(speed_sq(u[1], columns.p1[arc]));
            profile.slope.push(2.0 * columns.a1[arc]);
        }
        let caps = path.caps(&path.joints(&self.limits.jerk));
        let problem = jerk_limited::Problem {
            geometry: &path,
            limits: self.limits,
            caps: &caps,
            ends: stretch.ends.map(end),
        };
        Some(jerk_limited::certify(&problem, &profile, self.effort).least_time)
    }

    /// The quickest sections of a line with one feed between speeds at its ends; None where it does not join them, or
    /// where it may speed up and slow down by accelerations that differ.
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

    /// With a rest where the planner sees no speed, or half-way.
    fn cut(&self, path: &ByLength<M>, s: f64, cuts: u32) -> Result<Arcs, Fault> {
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
        let mut arcs = self.plan(&left, [0.0; 2], cuts + 1)?;
        let rest = self.plan(&right, [0.0; 2], cuts + 1)?;
        if arcs.is_unplanned() || rest.is_unplanned() {
            return Ok(Arcs::unplanned());
        }
        arcs.append(rest);
        Ok(arcs)
    }

    /// The fault of a stretch whose ends cannot both be met, with the greatest speed that can.
    fn out_of_reach(
        &self,
        path: &ByLength<M>,
        parts: &[Part],
        speeds: [f64; 2],
        caps: &[jerk_limited::SpeedCap],
    ) -> Result<Arcs, Fault> {
        let effort = Effort { deadline: None, tolerance: 1e-4, ..*self.effort };
        let possible = |speeds: [f64; 2]| {
            let problem =
                jerk_limited::Problem { geometry: path, limits: self.limits, caps, ends: speeds.map(end) };
            jerk_limited::plan(&problem, &effort).is_ok()
        };
        // The end is at fault where the start alone is possible.
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
