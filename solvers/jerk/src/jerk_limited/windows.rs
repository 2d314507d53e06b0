//! Paths of any length: overlapping windows, solved in parallel and joined to one plan.
//!
//! At its ends a window has states (w, w') of the first plan, which is inside all limits; states of another window's optimum
//! would lie on its limits and leave almost no interior to start from. The effect of an end decays with the travel time from it:
//! two windows agree to 1e-8 within two or three stop times inside their overlap, and are blended there. If no blend keeps the
//! limits, both windows are solved as one. Only a few windows at a time are in memory.
//!
//! All windows are planned twice: roughly on a coarse grid, which shows where the grid needs short intervals, and then on the
//! grid with these short intervals.

use std::mem::take;
use std::ops::Range;
use std::sync::{Mutex, PoisonError};

use super::cases;
use super::constraints::Constraints;
use super::exact::Exact;
use super::hermite::duration;
use super::interior_point;
use super::lower_bound::{self, Part, Planned};
use super::prepare::{Prepared, Start, PREPARING};
use super::profile::{Plan, Profile};
use super::refinement::{self, Losses, RoughPlan, COARSE};
use super::relaxed::Relaxed;
use super::window::{ramps, Window, WindowReport};
use super::window_end::WindowEnd;
use super::working_space::InteriorPoint;
use crate::path_problem::{self, Effort, Fault, Problem};
use feedplan_geometry::parallel::{each_part, map, threads};
use feedplan_geometry::watch::Watch;

/// A window reaches this many stop times and intervals beyond its cuts. The number of stop times is the travel time of the first
/// plan beyond the cut (the optimum takes a third of it or more), divided by the time to stop from the greatest speed that the
/// envelope allows there.
const REACH: (f64, usize) = (11.0, 80);
/// Of this many stations from there outwards, a window ends at the one where the first plan uses its limits least: beside an end
/// on a limit there is almost no interior.
const EASE: usize = 20;
/// Least travel time from cut to cut, in stop times.
const LONG: f64 = 36.0;
/// Least length of the parts into which an interval is split, as a fraction of the path's length: rounding of the arc lengths
/// spoils shorter ones.
const SHORTEST: f64 = path_problem::SHORTEST / 16.0;
/// The fraction of the progress that the rough plans take.
const ROUGH: f64 = 0.3;
/// Windows per thread that are solved before their plans are joined.
const BATCH: usize = 8;
/// An overlap is divided into this many parts. Two windows are blended over the part where they agree best among those whose
/// blend keeps the limits; if there is none, the next number of parts is tried.
const BLENDS: [usize; 4] = [8, 4, 2, 1];
/// Greatest use of a limit by a blend: a little more than that allowed to a window.
const BLENDED: f64 = 1.0 + 5e-7;

/// The plan of least time.
pub fn plan<const M: usize>(problem: &Problem<M>, effort: &Effort) -> Result<Plan, Fault> {
    let rough = Rough::new(problem, effort)?;
    let price = rough.price();
    rough.plan(problem, price, effort)
}

/// A path planned roughly, on a coarse grid.
pub struct Rough {
    start: Start,
    /// Empty if no first plan was found.
    sections: Vec<Section>,
    pub losses: Losses,
}

impl Rough {
    /// Plans a problem roughly; `effort` is the effort of the final plan.
    pub fn new<const M: usize>(problem: &Problem<M>, effort: &Effort) -> Result<Self, Fault> {
        let coarse = Effort {
            resolution: effort.resolution / f64::from(COARSE),
            // A window has more intervals on the final grid.
            window: effort.window / 2,
            watch: effort.watch.part(ROUGH),
            ..*effort
        };
        let prepared = Prepared::new(problem, &coarse)?;
        let run = Run::new(&prepared, &coarse);
        let mut sections = if prepared.x.is_empty() { vec![] } else { run.sections() };
        run.roughly(&mut sections, effort.resolution);
        let losses = run.losses(&mut sections, effort.resolution);
        Ok(Self { start: prepared.start(), sections, losses })
    }

    /// Whether there is a first plan.
    pub fn is_planned(&self) -> bool {
        !self.sections.is_empty()
    }

    /// The price of an interval in s (see `refinement`) if this path is planned alone.
    pub fn price(&self) -> f64 {
        refinement::price(std::iter::once(&self.losses))
    }

    /// The plan of least time on the grid that results from this price of an interval, in s.
    pub fn plan<const M: usize>(
        self,
        problem: &Problem<M>,
        price: f64,
        effort: &Effort,
    ) -> Result<Plan, Fault> {
        let effort = Effort { watch: effort.watch.part(1.0 - ROUGH), ..*effort };
        let parts = self.parts(price, &effort);
        let Self { start, mut sections, .. } = self;
        let prepared = start.refined(problem, &parts, &effort);
        if prepared.x.is_empty() {
            return Err(Fault::NoPlan { s: prepared.grid.stations[0] });
        }
        let run = Run::new(&prepared, &effort);
        if sections.is_empty() {
            sections = run.sections();
        } else {
            run.refine(&mut sections, &parts);
        }
        run.plan(&sections)
    }

    /// The number of parts into which each interval of the coarse grid is to be split.
    fn parts(&self, price: f64, effort: &Effort) -> Vec<u32> {
        let stations = &self.start.grid.stations;
        let mut parts = self.losses.parts(price);
        if self.sections.is_empty() {
            parts.fill(COARSE);
        }
        for Section { core, .. } in self.sections.iter().filter(|section| section.rough.is_none()) {
            parts[core.clone()].fill(if effort.expired() { 1 } else { COARSE });
        }
        let shortest = SHORTEST * stations[stations.len() - 1];
        for (parts, pair) in parts.iter_mut().zip(stations.windows(2)) {
            *parts = (*parts).min(((pair[1] - pair[0]) / shortest) as u32).max(1);
        }
        parts
    }
}

/// A range of intervals that are solved as one window.
struct Section {
    /// All intervals, including the overlaps with other sections.
    range: Range<usize>,
    core: Range<usize>,
    rough: Option<RoughPlan>,
}

impl Section {
    /// A section with an empty core, for which no lower bound is computed.
    fn alone(range: Range<usize>) -> Self {
        Self { core: range.start..range.start, range, rough: None }
    }
}

struct Counts {
    converged: bool,
    /// Newton steps times intervals.
    steps: f64,
    /// In s; overlaps count in each of their windows.
    excess: f64,
}

impl Counts {
    fn add(&mut self, verdict: &WindowReport, intervals: usize) {
        self.converged &= verdict.converged;
        self.excess += verdict.excess;
        self.steps += (verdict.iterations * intervals) as f64;
    }
}

/// Working space for one window.
struct Space {
    window: Window,
    /// The window's limits before any tightening, for the lower bound.
    loose: Constraints,
    exact: InteriorPoint<Exact>,
    relaxed: InteriorPoint<Relaxed>,
}

impl Space {
    fn new<const M: usize>(Problem { limits, moves, .. }: &Problem<M>) -> Self {
        Self {
            window: Window::new(limits, moves),
            loose: Constraints::new(limits, moves),
            exact: InteriorPoint::default(),
            relaxed: InteriorPoint::default(),
        }
    }
}

struct Run<'a, const M: usize> {
    prepared: &'a Prepared<'a, M>,
    effort: &'a Effort<'a>,
    stations: &'a [f64],
    /// Working spaces that no thread uses at present, kept because the allocation of some MB takes long.
    idle: Mutex<Vec<Space>>,
}

/// The travel over a range of intervals: its time in s by the first plan, and the greatest speed in mm/s that the envelope
/// allows.
#[derive(Default)]
struct Drive {
    time: f64,
    speed: f64,
}

impl<'a, const M: usize> Run<'a, M> {
    fn new(prepared: &'a Prepared<'a, M>, effort: &'a Effort<'a>) -> Self {
        Self { prepared, effort, stations: &prepared.grid.stations, idle: Mutex::default() }
    }

    /// Solves all sections and joins them to one plan.
    fn plan(&self, sections: &[Section]) -> Result<Plan, Fault> {
        let mut x = self.prepared.x.clone();
        let mut parts = vec![];
        let watch = self.watch(sections);
        let mut counts = Counts { converged: true, steps: 0.0, excess: 0.0 };
        for (first, batch) in (0..).step_by(self.batch()).zip(sections.chunks(self.batch())) {
            if self.effort.expired() {
                counts.converged = false;
                break;
            }
            let solved = map(batch.len(), 1, |i| {
                let solved = self.solve(&batch[i]);
                watch.advance(batch[i].range.len());
                solved
            });
            for (at, (y, verdict, part)) in (first..).zip(solved) {
                parts.extend(part);
                let range = &sections[at].range;
                counts.add(&verdict, range.len());
                let before = if at == 0 { 0..0 } else { sections[at - 1].range.clone() };
                let joined = self.join(&mut x, before.end, range.start, &y).or_else(|| {
                    let both = Section::alone(before.start..range.end);
                    let (y, verdict, _) = self.solve(&both);
                    counts.add(&verdict, both.range.len());
                    self.join(&mut x, before.end, before.start, &y)
                });
                match joined {
                    Some(loss) => counts.excess += loss,
                    None => {
                        // The window is solved again from the station where the last one ends: there both have the state of the
                        // first plan.
                        let rest = Section::alone(before.end..range.end);
                        let (y, verdict, _) = self.solve(&rest);
                        counts.add(&verdict, rest.range.len());
                        counts.converged = false;
                        x[2 * before.end..2 * range.end + 2].copy_from_slice(&y);
                    }
                }
            }
        }
        for (kind, station) in self.prepared.ends.iter().zip([0, self.stations.len() - 1]) {
            if !kind.is_met(x[2 * station], x[2 * station + 1]) {
                return Err(Fault::NoPlan { s: self.stations[station] });
            }
        }
        let count = self.stations.len() - 1;
        let time: f64 = (0..count).map(|n| duration(&x, n, self.length(n))).sum();
        let time = time + ramps(&self.prepared.ends, &x);
        let lower_bound =
            if parts.len() == sections.len() { time * lower_bound::join(&parts) } else { f64::NAN };
        Ok(Plan {
            time,
            lower_bound,
            converged: counts.converged,
            excess: counts.excess,
            iterations: counts.steps / count as f64,
            profile: self.profile(&x),
        })
    }

    /// Computes the rough plan of each section; it stays None if none is found or the time is over.
    fn roughly(&self, sections: &mut [Section], resolution: f64) {
        let watch = self.watch(sections);
        let effort = interior_point::Effort { tolerance: refinement::tolerance(resolution), ..self.solver() };
        each_part(sections, 1, &|_, sections| {
            for Section { range, rough, .. } in sections {
                if self.effort.expired() {
                    return;
                }
                let x = &self.prepared.x[2 * range.start..2 * range.end + 2];
                let ends = self.ends(range, self.prepared.ends, x);
                *rough = self.in_space(|Space { window, exact, .. }| {
                    self.prepared.fill(range.clone(), window);
                    window.rows.drop_at_ends(&ends);
                    window.rough(ends, x, &effort, exact)
                });
                watch.advance(range.len());
            }
        });
    }

    /// The losses of all intervals, moved out of the rough plans; 0 in sections without a rough plan.
    fn losses(&self, sections: &mut [Section], resolution: f64) -> Losses {
        let (mut each, mut time) = (vec![0.0; self.stations.len() - 1], 0.0);
        for Section { range, core, rough } in sections {
            if let Some(rough) = rough {
                let own = core.start - range.start..core.end - range.start;
                each[core.clone()].copy_from_slice(&take(&mut rough.losses)[own]);
                time +=
                    core.clone().map(|n| duration(&rough.x, n - range.start, self.length(n))).sum::<f64>();
            }
        }
        Losses { each, unit: time / (resolution * resolution) }
    }

    /// Converts sections of the coarse grid to the fine grid, where coarse interval n was split into `parts[n]` parts.
    fn refine(&self, sections: &mut [Section], parts: &[u32]) {
        let mut starts = vec![0];
        starts.extend(parts.iter().scan(0, |end, &parts| {
            *end += parts as usize;
            Some(*end)
        }));
        let fine = |range: &Range<usize>| starts[range.start]..starts[range.end];
        for Section { range, core, rough } in sections {
            let own = fine(range);
            if let Some(rough) = rough {
                let lengths: Vec<f64> = own.clone().map(|n| self.length(n)).collect();
                rough.refine(&parts[range.clone()], &lengths);
            }
            (*range, *core) = (own, fine(core));
        }
    }

    /// The number of sections that are solved before their plans are joined.
    fn batch(&self) -> usize {
        BATCH * threads()
    }

    /// The progress of solving all sections, counted in intervals, overlaps included.
    fn watch(&self, sections: &[Section]) -> Watch<'_> {
        let intervals = sections.iter().map(|section| section.range.len()).sum();
        self.effort.watch.part(1.0 - PREPARING).each(intervals)
    }

    /// The length of an interval in mm.
    fn length(&self, n: usize) -> f64 {
        self.stations[n + 1] - self.stations[n]
    }

    /// Divides the path into sections, without rough plans.
    fn sections(&self) -> Vec<Section> {
        let cuts = self.cuts();
        let section = |(range, core): (_, &[usize])| Section { range, core: core[0]..core[1], rough: None };
        self.windows(&cuts).into_iter().zip(cuts.windows(2)).map(section).collect()
    }

    /// The ranges of the windows between these cuts, including their overlaps.
    fn windows(&self, cuts: &[usize]) -> Vec<Range<usize>> {
        let reach = |from: usize, to: usize| {
            let step = |n: usize| if to > from { n + 1 } else { n - 1 };
            let (mut n, mut drive) = (from, Drive::default());
            while n != to && (n.abs_diff(from) < REACH.1 || self.stops(&drive) < REACH.0) {
                drive = self.onward(&drive, n.min(step(n)));
                n = step(n);
            }
            let used = |n: usize| self.prepared.used[n - 1].max(self.prepared.used[n]);
            (0..EASE)
                .map(|further| if to > from { n + further } else { n.saturating_sub(further) })
                .filter(|station| station.abs_diff(from) < to.abs_diff(from))
                .min_by(|&a, &b| used(a).total_cmp(&used(b)))
                .unwrap_or(n)
        };
        let middle = |i: usize| (cuts[i] + cuts[i + 1]) / 2;
        let last = cuts.len() - 2;
        (0..=last)
            .map(|i| {
                let start = if i == 0 { 0 } else { reach(cuts[i], middle(i - 1)) };
                let end = if i == last { cuts[i + 1] } else { reach(cuts[i + 1], middle(i + 1)) };
                start..end
            })
            .collect()
    }

    /// The stations where windows are cut, including the ends of the path.
    fn cuts(&self) -> Vec<usize> {
        let count = self.stations.len() - 1;
        let mut cuts = vec![0];
        let (mut last, mut drive) = (0, Drive::default());
        for n in 0..count {
            drive = self.onward(&drive, n);
            if n + 1 - last >= self.effort.window && self.stops(&drive) >= LONG {
                cuts.push(n + 1);
                (last, drive) = (n + 1, Drive::default());
            }
        }
        // A short remainder belongs to the window before it.
        if cuts.len() > 1 && last < count {
            cuts.pop();
        }
        if cuts[cuts.len() - 1] < count {
            cuts.push(count);
        }
        cuts
    }

    /// The travel `drive`, extended by interval n.
    fn onward(&self, drive: &Drive, n: usize) -> Drive {
        let x = &self.prepared.x;
        let time = drive.time + duration(x, n, self.length(n));
        Drive { time, speed: drive.speed.max(self.prepared.speeds[n]) }
    }

    /// The time of a travel, in stop times.
    fn stops(&self, drive: &Drive) -> f64 {
        drive.time / self.prepared.slopes.stop_time(drive.speed)
    }

    /// Does work in a working space that no other thread uses.
    fn in_space<T>(&self, work: impl FnOnce(&mut Space) -> T) -> T {
        let idle = || self.idle.lock().unwrap_or_else(PoisonError::into_inner);
        let mut space = idle().pop().unwrap_or_else(|| Space::new(self.prepared.problem));
        let done = work(&mut space);
        idle().push(space);
        done
    }

    /// The effort for each window.
    fn solver(&self) -> interior_point::Effort<'_> {
        interior_point::Effort {
            tolerance: self.effort.tolerance,
            max_iterations: self.effort.max_iterations,
            deadline: self.effort.deadline,
            barrier: 1.0,
            warm: false,
            watch: self.effort.watch,
        }
    }

    /// Whether the start and the end of a window are those of the path.
    fn at_ends(&self, range: &Range<usize>) -> [bool; 2] {
        [range.start == 0, range.end + 1 == self.stations.len()]
    }

    /// The ends of a window: the ends of the path (`of_path`) where the window ends with the path, else the states of x.
    fn ends(&self, range: &Range<usize>, of_path: [WindowEnd; 2], x: &[f64]) -> [WindowEnd; 2] {
        let at_ends = self.at_ends(range);
        [0, 1].map(|end| {
            let at = end * (x.len() - 2);
            if at_ends[end] {
                of_path[end]
            } else {
                WindowEnd::Fixed { w: x[at], slope: x[at + 1] }
            }
        })
    }

    /// Solves a window between states of the first plan. Returns its plan, the report, and the lower bound of its core, if one is
    /// wanted.
    fn solve(&self, section: &Section) -> (Vec<f64>, WindowReport, Option<Part>) {
        self.in_space(|space| self.solve_in(space, section))
    }

    fn solve_in(&self, space: &mut Space, section: &Section) -> (Vec<f64>, WindowReport, Option<Part>) {
        let Section { range, core, rough } = section;
        let Space { window, loose, exact, relaxed } = space;
        let mut y = self.prepared.x[2 * range.start..2 * range.end + 2].to_vec();
        let [ends, bound_ends] =
            [self.prepared.ends, self.prepared.bound_ends].map(|of_path| self.ends(range, of_path, &y));
        let (at_ends, effort) = (self.at_ends(range), self.solver());
        self.prepared.fill(range.clone(), window);
        let proves = self.effort.proves && !core.is_empty();
        if proves {
            loose.copy(&window.rows, 0..range.len());
            loose.drop_at_ends(&bound_ends);
        }
        window.rows.drop_at_ends(&ends);
        let verdict = window.improve(ends, &mut y, rough.as_ref(), &effort, exact);
        // The lower bound starts from the multipliers of the plan, so it needs the same rows.
        loose.accelerates = window.rows.accelerates;
        let part = (proves && !self.effort.expired()).then(|| {
            let planned =
                Planned { rows: loose, tight: &window.rows, ends: bound_ends, at_ends, x: &y, solved: exact };
            let core = core.start - range.start..core.end - range.start;
            cases::part(&planned, &core, &effort, relaxed)
        });
        (y, verdict, part)
    }

    /// Continues x, planned up to the station `reached`, by the plan y from the station `start` on. Returns the time in s by
    /// which the overlap takes longer than the sum of the lesser times of both plans on each interval; None if no blend keeps the
    /// limits.
    fn join(&self, x: &mut [f64], reached: usize, start: usize, y: &[f64]) -> Option<f64> {
        let step = |n: usize| self.length(n);
        let least: f64 =
            (start..reached).map(|n| duration(x, n, step(n)).min(duration(y, n - start, step(n)))).sum();
        let (stations, blend) = self.blend(x, reached, start, y)?;
        x[2 * stations.start..][..blend.len()].copy_from_slice(&blend);
        x[2 * stations.end..2 * start + y.len()].copy_from_slice(&y[2 * (stations.end - start)..]);
        let time: f64 = (start..reached).map(|n| duration(x, n, step(n))).sum();
        Some(time - least)
    }

    /// A spline that leads from x to y within their overlap, and its stations; empty if y can follow x directly, without a blend.
    /// None if no blend keeps the limits.
    fn blend(&self, x: &[f64], reached: usize, start: usize, y: &[f64]) -> Option<(Range<usize>, Vec<f64>)> {
        let y_from = |station: usize| &y[2 * (station - start)..];
        // A plan that was not improved is still the first plan, and the other plan has the state of the first plan at its end.
        let same = |&station: &usize| x[2 * station..2 * station + 2] == y_from(station)[..2];
        if let Some(station) = [start, reached].into_iter().find(|station| start == reached || same(station))
        {
            return Some((station..station, vec![]));
        }
        let apart = |n: usize| (y_from(n)[0] / x[2 * n] - 1.0).abs();
        BLENDS.into_iter().filter(|&parts| reached - start >= parts).find_map(|parts| {
            // The candidates are these parts and those half-way between two of them.
            let size = (reached - start) / parts;
            let worst = |from: usize| (from..=from + size).map(apart).fold(0.0, f64::max);
            let starts = (0..2 * parts - 1).map(|i| start + i * size / 2);
            let mut starts: Vec<(usize, f64)> = starts.map(|from| (from, worst(from))).collect();
            starts.sort_by(|a, b| a.1.total_cmp(&b.1));
            starts.into_iter().find_map(|(from, _)| self.blend_on(from..from + size, x, y_from(from)))
        })
    }

    /// The spline that leads from x to y between two stations; None if it does not keep the limits. y begins at the first of
    /// them.
    fn blend_on(&self, stations: Range<usize>, x: &[f64], y: &[f64]) -> Option<(Range<usize>, Vec<f64>)> {
        let s = |station: usize| self.stations[station] - self.stations[stations.start];
        let length = s(stations.end);
        let mut blend = x[2 * stations.start..2 * stations.end + 2].to_vec();
        for (n, (z, y)) in blend.chunks_exact_mut(2).zip(y.chunks_exact(2)).enumerate() {
            let t = s(stations.start + n) / length;
            let (weight, rate) = (t * t * (3.0 - 2.0 * t), 6.0 * t * (1.0 - t) / length);
            let [w, slope] = [y[0] - z[0], y[1] - z[1]];
            z[0] += weight * w;
            z[1] += weight * slope + rate * w;
        }
        let holds = self.in_space(|Space { window, .. }| {
            self.prepared.fill(stations.clone(), window);
            window.holds(&blend, BLENDED)
        });
        holds.then_some((stations, blend))
    }

    /// The profile with its ramps.
    fn profile(&self, x: &[f64]) -> Profile {
        let knots = self.prepared.problem.geometry.knots();
        Profile {
            s: self.stations.to_vec(),
            speed_sq: x.iter().step_by(2).copied().collect(),
            slope: x.iter().skip(1).step_by(2).copied().collect(),
            ends: [knots[0], knots[knots.len() - 1]],
            powers: self.prepared.ends.map(|end| end.ramp().power),
        }
    }
}
