//! The jerk-limited planner on a path of the package, with the problem's limits and jerk limits [mm/s³]: a profile of
//! phases over the pieces' parameters, and a lower bound on its time.
//!
//! Each subrun is planned along its arc length, except where its feed is held (`held`). Two more speed caps hold inside
//! it: a corner is passed at its speed, and a junction where q'' jumps at the speed at which third differences of
//! setpoints keep the limits of jerk
//! (`curvature_jumps`). Lines take sections of constant jerk. Where the path turns back, the tool rests for no time, and
//! the acceleration goes on (`turns`).

use rayon::prelude::*;

use super::held::{caps_between, moving, stretches, Between, Stretch};
use super::moving_axes;
use super::turns::{lower, Line};
use crate::arc_length_path::{ArcLengthPath, Junction, Part};
use crate::jerk_profile::JerkProfile;
use crate::path_problem::{self, Effort, End, Limits, SpeedCap};
use crate::s_curve::{self, Segment};
use crate::subruns::{over_chains, Chain, Subrun};
use feedplan_planner::problem::{along, Fault, Problem};

/// A junction holds the speed where the plan is within this part of its cap.
const HELD: f64 = 0.998;
/// A subrun without a plan is cut at most this often where the planner finds no speed.
const CUTS: u32 = 12;
/// Other subruns turn back with at most this part of what lines can: a line must reach the rest.
const BELOW: f64 = 0.9999;
/// How often subruns are planned that do not meet, and meet without acceleration at last.
const ROUNDS: usize = 4;
/// The error of the grid counts as a part of the time of the whole subrun, and falls with the square of the resolution
/// r. Where the planned stretches are the part p of the length, their resolution is r/√(1 + FINER (1/p − 1)), and at
/// least `LEAST`: the error grows by about `FINER` over that of a subrun that is planned as a whole.
const FINER: f64 = 0.05;
const LEAST: f64 = 6.0;
/// A stretch shorter than this part of its path has lengths of few digits.
const FEW_DIGITS: f64 = 1e-7;
/// It is planned with so many times the resolution.
const FINER_THERE: f64 = 3.0;
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
    over_chains(problem, jerk, |chain, limits, watch| {
        Task { problem, limits: *limits, effort: &Effort { watch, ..*effort } }.chain(&chain)
    })
}

/// The subruns of a chain.
struct Strokes<'a, const M: usize> {
    paths: Vec<ArcLengthPath<'a, M>>,
    /// Those that are lines.
    lines: Vec<Option<Line>>,
    /// The greatest accelerations at their ends that the lines allow, in mm/s².
    accelerations: Vec<f64>,
}

pub struct Task<'a, const M: usize> {
    pub problem: &'a Problem<'a, M>,
    pub limits: Limits<M>,
    pub effort: &'a Effort<'a>,
}

impl<const M: usize> Task<'_, M> {
    /// The profiles of a chain of subruns; unplanned if the deadline has passed. Between them the tool turns back with
    /// the greatest accelerations that all lines allow. Other subruns are planned first, with what accelerations are
    /// the best for them; the lines beside them take the same. Two of those in a row are planned again, with at most the
    /// lesser of both, until they meet.
    fn chain(&self, chain: &Chain) -> Result<Vec<JerkProfile>, Fault> {
        let count = chain.subruns.len();
        if self.effort.expired() {
            return Ok(vec![JerkProfile::unplanned(); count]);
        }
        let Strokes { paths, lines, mut accelerations } = self.strokes(chain)?;
        let greatest = accelerations.clone();
        for i in 1..count {
            let most = BELOW * accelerations[i];
            accelerations[i] = match [lines[i - 1], lines[i]] {
                [None, None] => most,
                [Some(line), None] => line.alone(1, most),
                [None, Some(line)] => line.alone(0, most),
                _ => accelerations[i],
            };
        }
        let plan = |i: usize, accelerations: &[f64]| {
            let subrun = &chain.subruns[i];
            let watch = self.effort.watch.part(subrun.parts.len() as f64);
            let effort = Effort { watch, ..*self.effort };
            let ends =
                [0, 1].map(|end| end_of(subrun.ends[end], [accelerations[i + end], greatest[i + end]]));
            Task { effort: &effort, problem: self.problem, limits: self.limits }.plan(&paths[i], ends, 0)
        };
        let mut planned = vec![JerkProfile::default(); count];
        let mut open: Vec<usize> = (0..count).filter(|&i| lines[i].is_none()).collect();
        for round in 0.. {
            if open.is_empty() {
                break;
            }
            let again: Vec<JerkProfile> =
                open.par_iter().map(|&i| plan(i, &accelerations)).collect::<Result<_, _>>()?;
            for (&i, phases) in open.iter().zip(again) {
                planned[i] = phases;
            }
            open.clear();
            for i in 1..count {
                if lines[i - 1].is_some()
                    || lines[i].is_some()
                    || planned[i - 1].meets(&planned[i], chain.turns[i - 1])
                {
                    continue;
                }
                let both = [planned[i - 1].end_acceleration(1), planned[i].end_acceleration(0)];
                accelerations[i] = if round < ROUNDS { both[0].min(both[1]) } else { 0.0 };
                open.extend(
                    [0, 1].into_iter().filter(|&side| both[side] > accelerations[i]).map(|side| i - 1 + side),
                );
            }
            open.dedup();
        }
        for i in 0..count {
            if lines[i].is_none() && !planned[i].phases.is_empty() {
                let own = [0, 1].map(|end| planned[i].end_acceleration(end));
                accelerations[i] =
                    if i > 0 && lines[i - 1].is_none() { accelerations[i].min(own[0]) } else { own[0] };
                accelerations[i + 1] = own[1];
            }
        }
        for i in 0..count {
            for end in [0, 1] {
                let own = accelerations[i + end];
                if lines[i].is_none() && planned[i].end_acceleration(end) > own {
                    planned[i].turn_with(&paths[i], end, own);
                }
            }
        }
        lower(&lines, &mut accelerations);
        for i in 0..count {
            if let Some(line) = &lines[i] {
                planned[i] = self.along_line(&paths[i], line, [accelerations[i], accelerations[i + 1]]);
            }
        }
        // A bound holds with the greatest accelerations at the turns, whatever the plan takes there.
        if self.effort.proves {
            for i in 0..count {
                if let Some(line) = &lines[i] {
                    let fastest = s_curve::cross(&line.segment, line.ends([greatest[i], greatest[i + 1]]));
                    planned[i].lower_bound = vec![fastest.iter().map(|section| section.duration).sum()];
                } else if (i..i + 2).any(|turn| accelerations[turn] == 0.0 && greatest[turn] > 0.0) {
                    planned[i].lower_bound = plan(i, &greatest)?.lower_bound;
                }
            }
        }
        Ok(planned)
    }

    /// The paths and lines of a chain, with the greatest accelerations between them.
    fn strokes<'b>(&self, chain: &Chain<'b>) -> Result<Strokes<'b, M>, Fault>
    where
        Self: 'b,
    {
        let paths: Vec<ArcLengthPath<M>> =
            chain.subruns.par_iter().map(|subrun| ArcLengthPath::new(self.problem, &subrun.parts)).collect();
        let line = |(path, subrun): (&ArcLengthPath<M>, &Subrun)| self.line(path, subrun.ends);
        let lines = paths.iter().zip(chain.subruns).map(line).collect::<Result<Vec<_>, _>>()?;
        let mut accelerations = [&[0.0], chain.turns, &[0.0]].concat();
        lower(&lines, &mut accelerations);
        Ok(Strokes { paths, lines, accelerations })
    }

    /// The profile of a subrun that rests at its ends, or moves as it says; unplanned if the deadline has passed.
    pub fn subrun(&self, subrun: &Subrun) -> Result<JerkProfile, Fault> {
        let own = Chain { subruns: std::slice::from_ref(subrun), turns: &[] };
        Ok(self.chain(&own)?.remove(0))
    }

    /// The profile of a path between two ends, after this number of cuts.
    fn plan(&self, path: &ArcLengthPath<M>, ends: [End; 2], cuts: u32) -> Result<JerkProfile, Fault> {
        let junctions = path.junctions(&self.limits.jerk);
        let caps = path.caps(&junctions);
        let moving = ends.iter().any(|end| matches!(end, End::Moving { .. }));
        let own = stretches(self.problem, path, &self.limits, &junctions, ends);
        match self.stretches(path, own, &junctions, &caps) {
            // The deadline came before the first iteration of all windows.
            Ok(planned) if self.effort.expired() && planned.iter().all(|own| own.excess.is_empty()) => {
                Ok(JerkProfile::unplanned())
            }
            Ok(planned) => {
                let mut whole = JerkProfile::joined(planned);
                for parts in [&mut whole.excess, &mut whole.lower_bound] {
                    *parts = vec![parts.iter().sum()];
                }
                Ok(whole)
            }
            // A moving end has no plan before some iterations.
            Err(path_problem::Fault::NoPlan { .. }) if moving && self.effort.expired() => {
                Ok(JerkProfile::unplanned())
            }
            Err(path_problem::Fault::Input(what)) => {
                Err(Fault::Input { piece: Some(path.parts[0].piece), what })
            }
            Err(path_problem::Fault::NoPlan { .. }) if moving => self.out_of_reach(path, ends, &caps),
            Err(path_problem::Fault::NoPlan { s }) if cuts < CUTS => self.cut(path, s, cuts),
            Err(path_problem::Fault::NoPlan { s }) => {
                let part = path.part(s);
                Err(Fault::Stuck { piece: path.parts[part].piece, u: path.locate(part, s) })
            }
        }
    }

    /// The phases of all stretches. Those of one without an iteration before the deadline have no excess.
    fn stretches(
        &self,
        path: &ArcLengthPath<M>,
        own: Vec<Stretch>,
        junctions: &[Junction],
        caps: &[SpeedCap],
    ) -> Result<Vec<JerkProfile>, path_problem::Fault> {
        let planned = own.iter().filter(|stretch| stretch.held.is_none());
        let share = planned.map(|stretch| stretch.ends[1] - stretch.ends[0]).sum::<f64>() / path.total();
        let resolution = (self.effort.resolution / (1.0 + FINER * (1.0 / share - 1.0)).sqrt())
            .max(LEAST.min(self.effort.resolution));
        let effort = Effort { resolution, ..*self.effort };
        let mut all: Vec<(Stretch, Option<JerkProfile>)> = own.into_iter().map(|own| (own, None)).collect();
        loop {
            let plan = |(stretch, phases): &(Stretch, Option<JerkProfile>)| match phases {
                None => self.stretch(path, stretch, &effort, junctions, caps).map(Some),
                Some(_) => Ok(None),
            };
            let planned: Vec<_> = all.par_iter().map(plan).collect();
            let mut failed = vec![];
            for (i, planned) in planned.into_iter().enumerate() {
                match planned {
                    Ok(Some(phases)) => all[i].1 = Some(phases),
                    Ok(None) => {}
                    Err(path_problem::Fault::NoPlan { .. }) if all.len() > 1 => failed.push(i),
                    Err(fault) => return Err(fault),
                }
            }
            if failed.is_empty() {
                return Ok(all.into_iter().filter_map(|(_, phases)| phases).collect());
            }
            // Where the end of a stretch at its feed is too near, it is joined with the next ones.
            for i in failed.into_iter().rev() {
                let joined = i.saturating_sub(2)..(i + 3).min(all.len());
                let (first, last) = (all[joined.start].0, all[joined.end - 1].0);
                let ends = [first.ends[0], last.ends[1]];
                let whole = Stretch { ends, states: [first.states[0], last.states[1]], held: None };
                all.splice(joined, [(whole, None)]);
            }
        }
    }

    fn stretch(
        &self,
        path: &ArcLengthPath<M>,
        stretch: &Stretch,
        effort: &Effort,
        junctions: &[Junction],
        caps: &[SpeedCap],
    ) -> Result<JerkProfile, path_problem::Fault> {
        let Stretch { ends, states, held } = *stretch;
        let watch = effort.watch.part((ends[1] - ends[0]) / path.total());
        let mut phases = JerkProfile::default();
        if let Some(feed) = held {
            phases.push_held(path, ends, feed);
            phases.lower_bound.push((ends[1] - ends[0]) / feed);
            watch.advance(1);
            self.kinks(path, junctions, |_| feed * feed, ends, &mut phases);
            return Ok(phases);
        }
        let own = Between::new(path, ends);
        let within = |cap: &SpeedCap| SpeedCap { s: own.within(cap.s), ..*cap };
        let caps: Vec<SpeedCap> = caps_between(caps, ends).iter().map(within).collect();
        let problem =
            path_problem::Problem { geometry: &own, limits: self.limits, caps: &caps, ends: states };
        let moves = moving(self.problem, path, ends);
        // Short intervals leave room below the limits for the rounding of such lengths.
        let few_digits = ends[1] - ends[0] < FEW_DIGITS * path.total();
        let resolution = if few_digits { FINER_THERE } else { 1.0 } * effort.resolution;
        let plan = moving_axes::plan(&problem, &moves, &Effort { resolution, watch, ..*effort });
        let plan = plan.map_err(|fault| match fault {
            path_problem::Fault::NoPlan { s } => path_problem::Fault::NoPlan { s: own.outside(s) },
            fault => fault,
        })?;
        phases.push_profile(&own.path, &self.limits.jerk, &plan.profile);
        // The phases are kept until all stretches of the subrun are planned.
        phases.phases.shrink_to_fit();
        phases.stopped = !plan.converged && effort.expired();
        phases.lower_bound.push(plan.lower_bound);
        if plan.iterations > 0.0 {
            phases.excess.push(plan.excess);
        }
        self.kinks(path, junctions, |s| plan.profile.at(own.within(s))[0], ends, &mut phases);
        Ok(phases)
    }

    /// Adds the pieces of the junctions between two lengths whose jump limits the speed; w is its square at a length.
    fn kinks(
        &self,
        path: &ArcLengthPath<M>,
        junctions: &[Junction],
        w: impl Fn(f64) -> f64,
        [from, to]: [f64; 2],
        phases: &mut JerkProfile,
    ) {
        let first = junctions.partition_point(|junction| junction.cap.s <= from);
        for Junction { cap, jumps } in junctions[first..].iter().take_while(|junction| junction.cap.s <= to) {
            if *jumps && w(cap.s) >= HELD * cap.speed * cap.speed {
                phases.kinks.push(path.parts[path.part(cap.s)].piece as u32);
            }
        }
    }

    /// The quickest profile of a line with these accelerations at its ends.
    fn along_line(&self, path: &ArcLengthPath<M>, line: &Line, accelerations: [f64; 2]) -> JerkProfile {
        let ends = line.ends(accelerations);
        let mut phases = JerkProfile::default();
        phases.push_sections(path, &s_curve::cross(&line.segment, ends), ends[1]);
        phases
    }

    /// A line with one feed; None where it is too short for the speeds at its ends, or its limits differ for speeding up
    /// and down.
    fn line(&self, path: &ArcLengthPath<M>, speeds: [f64; 2]) -> Result<Option<Line>, Fault> {
        let Some((direction, feed)) = path.line() else { return Ok(None) };
        let Limits { velocity, acceleration, jerk } = &self.limits;
        let up = along(acceleration, &direction);
        if up != along(acceleration, &direction.map(|direction| -direction)) {
            return Ok(None);
        }
        let segment = Segment {
            length: path.total(),
            allowable: along(velocity, &direction),
            desired: feed,
            limits: s_curve::Limits { acceleration: up, jerk: along(&[*jerk; 2], &direction) },
            junction: 0.0,
        };
        segment.check(0)?;
        let line = Line { segment, speeds };
        Ok(segment.can_cross(line.ends([0.0; 2])).then_some(line))
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
        let both = vec![self.between_stops(&left, cuts + 1)?, self.between_stops(&right, cuts + 1)?];
        if both.iter().any(JerkProfile::is_unplanned) {
            return Ok(JerkProfile::unplanned());
        }
        let mut whole = JerkProfile::joined(both);
        // The bounds of both hold with the stop alone.
        whole.lower_bound = vec![f64::NAN];
        Ok(whole)
    }

    /// The profile of parts between stops.
    fn between_stops(&self, parts: &[Part], cuts: u32) -> Result<JerkProfile, Fault> {
        let path = ArcLengthPath::new(self.problem, parts);
        match self.line(&path, [0.0; 2])? {
            Some(line) => Ok(self.along_line(&path, &line, [0.0; 2])),
            None => self.plan(&path, [End::Rest; 2], cuts),
        }
    }

    /// The fault of a path that cannot meet both ends, with the greatest speed that can be met.
    fn out_of_reach(
        &self,
        path: &ArcLengthPath<M>,
        ends: [End; 2],
        caps: &[SpeedCap],
    ) -> Result<JerkProfile, Fault> {
        let effort = Effort { deadline: None, tolerance: 1e-4, ..*self.effort };
        let moves = moving(self.problem, path, [0.0, path.total()]);
        let speeds = ends.map(|end| end.speed());
        let possible = |speeds: [f64; 2]| {
            let ends = speeds.map(|speed| end_of(speed, [0.0; 2]));
            let problem = path_problem::Problem { geometry: path, limits: self.limits, caps, ends };
            moving_axes::plan(&problem, &moves, &effort).is_ok()
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
        let parts = path.parts;
        Err(if at == 0 {
            Fault::Start { piece: parts[0].piece, reachable: low }
        } else {
            Fault::End { piece: parts[parts.len() - 1].piece, reachable: low }
        })
    }
}

/// The end of a path at a speed in mm/s; at rest with an acceleration of at most this, in mm/s², where the bound is for
/// all up to another.
fn end_of(speed: f64, [acceleration, greatest]: [f64; 2]) -> End {
    if speed > 0.0 {
        End::Moving { speed, acceleration: 0.0 }
    } else if acceleration > 0.0 {
        End::Turn { acceleration, greatest }
    } else {
        End::Rest
    }
}
