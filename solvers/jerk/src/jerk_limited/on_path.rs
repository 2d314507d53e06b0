//! The jerk-limited planner on a path of the package, with the problem's limits and jerk limits [mm/s³]: a profile of
//! phases over the pieces' parameters, and a lower bound on its time.
//!
//! Each subrun is planned along its arc length, except where its feed is held (`held`). Two more kinds of speed caps apply inside
//! it: a corner is passed at its speed, and a junction where q'' jumps at the speed at which third differences of setpoints keep
//! the limits of jerk (`curvature_jumps`). Lines get sections of constant jerk. Where the path turns back, the tool is at rest
//! only for an instant, and the acceleration continues (`turns`).

use std::mem::take;

use super::held::{caps_between, moving, stretches, Between, Stretch};
use super::refinement;
use super::turns::{lower, Line};
use super::windows::Rough;
use crate::arc_length_path::{ArcLengthPath, Junction, Part};
use crate::jerk_profile::JerkProfile;
use crate::path_problem::{self, Effort, End, Limits, SpeedCap};
use crate::s_curve::{self, Segment};
use crate::subruns::{over_chains, Chain, Subrun};
use feedplan_geometry::parallel::{consume, map, try_map};
use feedplan_planner::problem::{along, Fault, Problem};

/// A junction counts as limiting the speed where the plan reaches this fraction of its cap.
const HELD: f64 = 0.998;
/// A subrun without a plan is divided by stops where the planner finds no speed, at most this many times one within another.
const CUTS: u32 = 12;
/// Subruns that are no lines turn back with at most this fraction of the acceleration that lines allow, so that lines can reach
/// it.
const BELOW: f64 = 0.9999;
/// Rounds in which neighbouring subruns that do not meet are planned again with the lesser acceleration; after these they meet
/// with acceleration 0.
const ROUNDS: usize = 4;
/// The error of the grid counts as a fraction of the time of the whole subrun, and falls with the square of the resolution r. If
/// the planned stretches are the fraction p of the length, their resolution is r/√(1 + FINER (1/p − 1)), and at least `LEAST`:
/// the error is then at most about p + FINER (1 − p) times that of a subrun that is planned as a whole.
const FINER: f64 = 0.3;
const LEAST: f64 = 6.0;
/// The arc lengths of a stretch shorter than this fraction of its path have few correct digits.
const FEW_DIGITS: f64 = 1e-7;
/// Such a stretch is planned with this multiple of the resolution.
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
    over_chains(problem, jerk, |chains, limits, watch| {
        Task::new(problem, limits, &Effort { watch, ..*effort }).chains(chains)
    })
}

/// The subruns of a chain.
struct Strokes<'a, const M: usize> {
    paths: Vec<ArcLengthPath<'a, M>>,
    /// The line of each subrun that is a line.
    lines: Vec<Option<Line>>,
    /// The greatest accelerations at the ends of all subruns that the lines allow, in mm/s².
    accelerations: Vec<f64>,
}

/// A path between two ends, with rough plans of its stretches.
struct RoughPath {
    junctions: Vec<Junction>,
    caps: Vec<SpeedCap>,
    /// The resolution of the plans of its stretches.
    resolution: f64,
    stretches: Vec<RoughStretch>,
}

struct RoughStretch {
    stretch: Stretch,
    /// The rough plan; None for a stretch that holds its feed.
    rough: Option<Result<Rough, path_problem::Fault>>,
    phases: Option<JerkProfile>,
}

/// A chain with rough plans.
struct RoughChain<'a, const M: usize> {
    strokes: Strokes<'a, M>,
    /// The greatest accelerations at the ends of its subruns, in mm/s².
    greatest: Vec<f64>,
    /// Each subrun that is no line, with its index in the chain.
    known: Vec<(usize, RoughPath)>,
}

pub struct Task<'a, const M: usize> {
    pub problem: &'a Problem<'a, M>,
    pub limits: Limits<M>,
    pub effort: &'a Effort<'a>,
    /// The price of an interval, in s, on paths that are planned roughly together (`refinement`).
    price: f64,
}

impl RoughStretch {
    fn rough(&self) -> Option<&Rough> {
        self.rough.as_ref()?.as_ref().ok()
    }
}

impl<'a, const M: usize> Task<'a, M> {
    pub fn new(problem: &'a Problem<'a, M>, limits: &Limits<M>, effort: &'a Effort<'a>) -> Self {
        Self { problem, limits: *limits, effort, price: f64::INFINITY }
    }
}

impl<const M: usize> Task<'_, M> {
    /// The profiles of the subruns of some chains; unplanned after the deadline. All subruns are planned roughly first: this
    /// gives one price of an interval for all of them (`refinement`).
    pub fn chains(&self, chains: &[Chain]) -> Result<Vec<JerkProfile>, Fault> {
        let look = |i: usize| (!self.effort.expired()).then(|| self.rough_chain(&chains[i])).transpose();
        let known = try_map(chains.len(), 1, look)?;
        let paths = known.iter().flatten().flat_map(|chain| &chain.known);
        let roughs = paths.flat_map(|(_, own)| &own.stretches).filter_map(RoughStretch::rough);
        let price = refinement::price(roughs.map(|rough| &rough.losses));
        let task = Task { price, ..*self };
        let planned = consume(known, |i, known| match known {
            Some(known) => task.chain(&chains[i], known),
            None => Ok(vec![JerkProfile::unplanned(); chains[i].subruns.len()]),
        });
        Ok(planned.into_iter().collect::<Result<Vec<_>, Fault>>()?.concat())
    }

    /// Plans a chain roughly. Between two lines the tool turns back with the greatest acceleration that all lines allow. Other
    /// subruns take the accelerations up to these that are best for them, and the lines beside them take the same.
    fn rough_chain<'b>(&self, chain: &Chain<'b>) -> Result<RoughChain<'b, M>, Fault>
    where
        Self: 'b,
    {
        let mut strokes = self.strokes(chain)?;
        let Strokes { paths, lines, accelerations } = &mut strokes;
        let greatest = accelerations.clone();
        for i in 1..lines.len() {
            let most = BELOW * accelerations[i];
            accelerations[i] = match [lines[i - 1], lines[i]] {
                [None, None] => most,
                [Some(line), None] => line.alone(1, most),
                [None, Some(line)] => line.alone(0, most),
                _ => accelerations[i],
            };
        }
        let look = |i: usize| {
            let ends = ends_of(chain, i, accelerations, &greatest);
            lines[i].is_none().then(|| (i, self.of_subrun(chain, i, |own| own.rough_path(&paths[i], ends))))
        };
        let known = map(lines.len(), 1, look).into_iter().flatten().collect();
        Ok(RoughChain { strokes, greatest, known })
    }

    /// The profiles of a chain of subruns. Two neighbouring subruns that are no lines are planned again, with at most the lesser
    /// acceleration of both, until they meet.
    fn chain(&self, chain: &Chain, known: RoughChain<M>) -> Result<Vec<JerkProfile>, Fault> {
        let count = chain.subruns.len();
        let RoughChain { strokes: Strokes { paths, lines, mut accelerations }, greatest, known } = known;
        let plan = |i: usize, accelerations: &[f64], known: Option<RoughPath>| {
            let ends = ends_of(chain, i, accelerations, &greatest);
            self.of_subrun(chain, i, |own| {
                let known = known.unwrap_or_else(|| own.rough_path(&paths[i], ends));
                own.plan(&paths[i], ends, known, 0)
            })
        };
        let mut planned = vec![JerkProfile::default(); count];
        let mut open: Vec<(usize, Option<RoughPath>)> =
            known.into_iter().map(|(i, known)| (i, Some(known))).collect();
        for round in 0.. {
            if open.is_empty() {
                break;
            }
            let again = consume(take(&mut open), |_, (i, known)| (i, plan(i, &accelerations, known)));
            for (i, phases) in again {
                planned[i] = phases?;
            }
            for i in 1..count {
                if lines[i - 1].is_some()
                    || lines[i].is_some()
                    || planned[i - 1].meets(&planned[i], chain.turns[i - 1])
                {
                    continue;
                }
                let both = [planned[i - 1].end_acceleration(1), planned[i].end_acceleration(0)];
                accelerations[i] = if round < ROUNDS { both[0].min(both[1]) } else { 0.0 };
                let sides = [0, 1].into_iter().filter(|&side| both[side] > accelerations[i]);
                open.extend(sides.map(|side| (i - 1 + side, None)));
            }
            open.dedup_by_key(|(i, _)| *i);
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
        // The lower bound holds for all accelerations at the turns up to the greatest, whatever the plan takes there.
        if self.effort.proves {
            for i in 0..count {
                if let Some(line) = &lines[i] {
                    let fastest = s_curve::cross(&line.segment, line.ends([greatest[i], greatest[i + 1]]));
                    planned[i].lower_bound = vec![fastest.iter().map(|section| section.duration).sum()];
                } else if (i..i + 2).any(|turn| accelerations[turn] == 0.0 && greatest[turn] > 0.0) {
                    planned[i].lower_bound = plan(i, &greatest, None)?.lower_bound;
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
            map(chain.subruns.len(), 1, |i| ArcLengthPath::new(self.problem, &chain.subruns[i].parts));
        let line = |(path, subrun): (&ArcLengthPath<M>, &Subrun)| self.line(path, subrun.ends);
        let lines = paths.iter().zip(chain.subruns).map(line).collect::<Result<Vec<_>, _>>()?;
        let mut accelerations = [&[0.0], chain.turns, &[0.0]].concat();
        lower(&lines, &mut accelerations);
        Ok(Strokes { paths, lines, accelerations })
    }

    /// The profile of a subrun between its end speeds, at rest where these are 0; unplanned if the deadline has passed.
    pub fn subrun(&self, subrun: &Subrun) -> Result<JerkProfile, Fault> {
        let own = Chain { subruns: std::slice::from_ref(subrun), turns: &[] };
        Ok(self.chains(&[own])?.remove(0))
    }

    /// Does `work` on a subrun of a chain, with the subrun's share of the progress.
    fn of_subrun<T>(&self, chain: &Chain, i: usize, work: impl FnOnce(&Task<M>) -> T) -> T {
        let watch = self.effort.watch.part(chain.subruns[i].parts.len() as f64);
        work(&Task { effort: &Effort { watch, ..*self.effort }, ..*self })
    }

    /// Divides a path between two ends into stretches and plans them roughly.
    fn rough_path(&self, path: &ArcLengthPath<M>, ends: [End; 2]) -> RoughPath {
        let junctions = path.junctions(&self.limits.jerk);
        let caps = path.caps(&junctions);
        let stretches = stretches(self.problem, path, &self.limits, &junctions, ends);
        let planned = stretches.iter().filter(|stretch| stretch.held.is_none());
        let share = planned.map(|stretch| stretch.ends[1] - stretch.ends[0]).sum::<f64>() / path.total();
        let resolution = (self.effort.resolution / (1.0 + FINER * (1.0 / share - 1.0)).sqrt())
            .max(LEAST.min(self.effort.resolution));
        let mut known = RoughPath { junctions, caps, resolution, stretches: vec![] };
        let look = |stretch: Stretch| {
            let rough = stretch.held.is_none().then(|| {
                self.on_stretch(path, &stretch, &known, |_, problem, effort| Rough::new(problem, effort))
            });
            RoughStretch { stretch, rough, phases: None }
        };
        known.stretches = map(stretches.len(), 1, |i| look(stretches[i]));
        known
    }

    /// The profile of a path between two ends. `cuts` is the number of stops that were already inserted one within another.
    fn plan(
        &self,
        path: &ArcLengthPath<M>,
        ends: [End; 2],
        mut known: RoughPath,
        cuts: u32,
    ) -> Result<JerkProfile, Fault> {
        let moving = ends.iter().any(|end| matches!(end, End::Moving { .. }));
        match self.stretches(path, &mut known) {
            // The deadline came before the first iteration of any window.
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
            Err(path_problem::Fault::NoPlan { .. }) if moving => self.out_of_reach(path, ends, &known.caps),
            Err(path_problem::Fault::NoPlan { s }) if cuts < CUTS => self.cut(path, s, cuts),
            Err(path_problem::Fault::NoPlan { s }) => {
                let part = path.part(s);
                Err(Fault::Stuck { piece: path.parts[part].piece, u: path.locate(part, s) })
            }
        }
    }

    /// The phases of all stretches. A stretch that had no iteration before the deadline has no excess.
    fn stretches(
        &self,
        path: &ArcLengthPath<M>,
        known: &mut RoughPath,
    ) -> Result<Vec<JerkProfile>, path_problem::Fault> {
        let mut all = take(&mut known.stretches);
        loop {
            let is_alone = all.len() == 1;
            let planned = consume(all, |_, RoughStretch { stretch, rough, phases }| match phases {
                Some(phases) => (stretch, Ok(phases)),
                None => (stretch, self.stretch(path, &stretch, rough, known, is_alone)),
            });
            all = vec![];
            let mut failed = vec![];
            for (i, (stretch, planned)) in planned.into_iter().enumerate() {
                let phases = match planned {
                    Ok(phases) => Some(phases),
                    Err(path_problem::Fault::NoPlan { .. }) if !is_alone => {
                        failed.push(i);
                        None
                    }
                    Err(fault) => return Err(fault),
                };
                all.push(RoughStretch { stretch, rough: None, phases });
            }
            if failed.is_empty() {
                return Ok(all.into_iter().filter_map(|own| own.phases).collect());
            }
            // A stretch without a plan ends at a held feed that is too near: it is joined with two stretches before it and two
            // after it.
            for i in failed.into_iter().rev() {
                let joined = i.saturating_sub(2)..(i + 3).min(all.len());
                let (first, last) = (all[joined.start].stretch, all[joined.end - 1].stretch);
                let ends = [first.ends[0], last.ends[1]];
                let stretch = Stretch { ends, states: [first.states[0], last.states[1]], held: None };
                all.splice(joined, [RoughStretch { stretch, rough: None, phases: None }]);
            }
        }
    }

    fn stretch(
        &self,
        path: &ArcLengthPath<M>,
        stretch: &Stretch,
        rough: Option<Result<Rough, path_problem::Fault>>,
        known: &RoughPath,
        is_alone: bool,
    ) -> Result<JerkProfile, path_problem::Fault> {
        let Stretch { ends, held, .. } = *stretch;
        let mut phases = JerkProfile::default();
        if let Some(feed) = held {
            phases.push_held(path, ends, feed);
            phases.lower_bound.push((ends[1] - ends[0]) / feed);
            self.effort.watch.part((ends[1] - ends[0]) / path.total()).advance(1);
            self.kinks(path, known, |_| feed * feed, ends, &mut phases);
            return Ok(phases);
        }
        self.on_stretch(path, stretch, known, |own, problem, effort| {
            let mut price = self.price;
            let rough = rough.unwrap_or_else(|| {
                let rough = Rough::new(problem, effort)?;
                price = rough.price();
                Ok(rough)
            });
            let plan = rough.and_then(|rough| {
                // Joined with its neighbours, a stretch finds a first plan sooner than on a finer grid.
                if is_alone || rough.is_planned() {
                    rough.plan(problem, price, effort)
                } else {
                    Err(path_problem::Fault::NoPlan { s: own.within(ends[0]) })
                }
            });
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
            self.kinks(path, known, |s| plan.profile.at(own.within(s))[0], ends, &mut phases);
            Ok(phases)
        })
    }

    /// Does `work` on a stretch as a problem of its own, with its share of the effort.
    fn on_stretch<T>(
        &self,
        path: &ArcLengthPath<M>,
        &Stretch { ends, states, .. }: &Stretch,
        known: &RoughPath,
        work: impl FnOnce(&Between<M>, &path_problem::Problem<M>, &Effort) -> T,
    ) -> T {
        let own = Between::new(path, ends);
        let within = |cap: &SpeedCap| SpeedCap { s: own.within(cap.s), ..*cap };
        let caps: Vec<SpeedCap> = caps_between(&known.caps, ends).iter().map(within).collect();
        let moves = moving(self.problem, path, ends);
        let problem =
            path_problem::Problem { geometry: &own, limits: self.limits, moves, caps: &caps, ends: states };
        // Short intervals leave room below the limits for the rounding errors of such lengths.
        let few_digits = ends[1] - ends[0] < FEW_DIGITS * path.total();
        let resolution = if few_digits { FINER_THERE } else { 1.0 } * known.resolution;
        let watch = self.effort.watch.part((ends[1] - ends[0]) / path.total());
        let effort = Effort { resolution, watch, ..*self.effort };
        work(&own, &problem, &effort)
    }

    /// Adds to `phases.kinks` the pieces that begin at those junctions between two arc lengths where a jump of q'' limits the
    /// speed; w(s) is the square of the planned speed.
    fn kinks(
        &self,
        path: &ArcLengthPath<M>,
        RoughPath { junctions, .. }: &RoughPath,
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

    /// The fastest profile of a line with these accelerations at its ends, in mm/s².
    fn along_line(&self, path: &ArcLengthPath<M>, line: &Line, accelerations: [f64; 2]) -> JerkProfile {
        let ends = line.ends(accelerations);
        let mut phases = JerkProfile::default();
        phases.push_sections(path, &s_curve::cross(&line.segment, ends), ends[1]);
        phases
    }

    /// The path as a line with one feed; None if it is no such line, if it is too short for the speeds at its ends, or if its
    /// limits differ for speeding up and slowing down.
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

    /// The profile with a stop at s, where the planner finds no speed, or half-way if s is at an end.
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
        // The bounds of both parts hold only for plans with this stop.
        whole.lower_bound = vec![f64::NAN];
        Ok(whole)
    }

    /// The profile of parts between stops.
    fn between_stops(&self, parts: &[Part], cuts: u32) -> Result<JerkProfile, Fault> {
        let path = ArcLengthPath::new(self.problem, parts);
        match self.line(&path, [0.0; 2])? {
            Some(line) => Ok(self.along_line(&path, &line, [0.0; 2])),
            None => self.plan(&path, [End::Rest; 2], self.rough_path(&path, [End::Rest; 2]), cuts),
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
            let problem = path_problem::Problem { geometry: path, limits: self.limits, moves, caps, ends };
            let plan = super::plan(&problem, &effort);
            plan.is_ok()
        };
        // The end is at fault if the start alone can be met.
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

/// The ends of a subrun of a chain, with these accelerations in mm/s² at its turns; the lower bound is to hold for all
/// accelerations up to the greatest.
fn ends_of(chain: &Chain, i: usize, accelerations: &[f64], greatest: &[f64]) -> [End; 2] {
    [0, 1].map(|end| end_of(chain.subruns[i].ends[end], [accelerations[i + end], greatest[i + end]]))
}

/// The end of a path at a speed in mm/s; if it is at rest, with at most this acceleration in mm/s², and a lower bound for all
/// accelerations up to `greatest`.
fn end_of(speed: f64, [acceleration, greatest]: [f64; 2]) -> End {
    if speed > 0.0 {
        End::Moving { speed, acceleration: 0.0 }
    } else if acceleration > 0.0 {
        End::Turn { acceleration, greatest }
    } else {
        End::Rest
    }
}
