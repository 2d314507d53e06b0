//! The jerk-limited planner on a path of the package: from rest to rest, by the length of the tool's way.
//!
//! A run is cut where the tool has to rest: at stops and at cusps, whose curvature has no bound. Between those a
//! corner is passed at its speed, and a joint where q'' jumps at the speed at which the acceleration of no axis jumps
//! by more than its jerk limit allows in one servo period. Lines from rest to rest take sections of constant jerk.

use crate::bang_bang::Problem;
use crate::bang_bang_quadratic::Fault;
use crate::by_length::{ByLength, Part};
use crate::jerk_arcs::Arcs;
use crate::jerk_limited::{self, Effort, End, Limits};
use crate::s_curve;
use crate::stretches::over_stretches;

/// A joint holds the speed where the plan is within this part of its cap.
const HELD: f64 = 0.998;
/// A stretch without a plan is cut so often, where the planner sees no speed.
const CUTS: u32 = 12;
/// Speeds tried for the greatest one that an end can have.
const TRIALS: u32 = 12;

/// The fastest profile with these jerk limits, in mm/s³.
pub fn plan<const M: usize>(problem: &Problem<M>, jerk: &[f64; M], effort: &Effort) -> Result<Arcs, Fault> {
    over_stretches(problem, jerk, |stretch, limits| {
        Task { problem, limits: *limits, effort }.plan(&stretch.parts, stretch.ends, 0)
    })
}

/// The planner of stretches.
pub struct Task<'a, const M: usize> {
    pub problem: &'a Problem<'a, M>,
    pub limits: Limits<M>,
    pub effort: &'a Effort,
}

impl<const M: usize> Task<'_, M> {
    /// The profile of parts between speeds at their ends; cut so often already.
    pub fn plan(&self, parts: &[Part], speeds: [f64; 2], cuts: u32) -> Result<Arcs, Fault> {
        let path = ByLength::new(self.problem, parts);
        let mut arcs = Arcs::default();
        if speeds == [0.0; 2] {
            if let Some((direction, feed)) = path.line() {
                self.cross(&path, &direction, feed, &mut arcs)?;
                return Ok(arcs);
            }
        }
        let caps = path.caps(&self.limits.jerk);
        let speed_caps: Vec<_> = caps.iter().map(|(cap, _)| *cap).collect();
        let problem = jerk_limited::Problem {
            geometry: &path,
            limits: self.limits,
            caps: &speed_caps,
            ends: speeds.map(end),
        };
        let solve = |effort: &Effort| jerk_limited::plan(&problem, effort);
        let moving = speeds != [0.0; 2];
        let mut plan = solve(self.effort);
        if moving && plan.is_err() && self.effort.deadline.is_some() {
            // There is no plan to a moving end before it is found.
            plan = solve(&Effort { deadline: None, ..*self.effort });
        }
        match plan {
            Ok(plan) => {
                arcs.push_profile(self.problem, &path, &plan.profile);
                for (cap, jumps) in &caps {
                    if *jumps && plan.profile.at(cap.s)[0] >= HELD * cap.speed * cap.speed {
                        arcs.kinks.push(parts[path.part(cap.s)].piece as u32);
                    }
                }
                Ok(arcs)
            }
            Err(jerk_limited::Fault::Input(what)) => Err(Fault::Input { piece: Some(parts[0].piece), what }),
            Err(jerk_limited::Fault::NoPlan { .. }) if moving => {
                self.out_of_reach(&path, parts, speeds, &speed_caps)
            }
            Err(jerk_limited::Fault::NoPlan { s }) if cuts < CUTS => self.cut(&path, s, cuts),
            Err(jerk_limited::Fault::NoPlan { s }) => {
                let part = path.part(s);
                Err(Fault::Stuck { piece: parts[part].piece, u: path.locate(part, s) })
            }
        }
    }

    /// A line from rest to rest in one direction with one feed.
    fn cross(
        &self,
        path: &ByLength<M>,
        direction: &[f64; M],
        feed: f64,
        arcs: &mut Arcs,
    ) -> Result<(), Fault> {
        let most =
            |limit: &[f64; M]| (0..M).map(|k| limit[k] / direction[k].abs()).fold(f64::INFINITY, f64::min);
        let segment = s_curve::Segment {
            length: path.total(),
            allowable: most(&self.limits.velocity),
            desired: feed,
            limits: s_curve::Limits {
                acceleration: most(&self.limits.acceleration),
                jerk: most(&self.limits.jerk),
            },
            junction: 0.0,
        };
        arcs.push_sections(self.problem, path, &s_curve::plan(&[segment], 1)?);
        Ok(())
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
        arcs.append(self.plan(&right, [0.0; 2], cuts + 1)?);
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
