//! What the exact planners and the bound share: limits checked once, runs planned in parallel, the chord-error limit.

use std::cell::RefCell;
use std::thread::LocalKey;

use rayon::prelude::*;

use crate::bang_bang::Problem;
use crate::bang_bang_quadratic::{Fault, Profile};
use feedplan_geometry::watch::Watch;

/// Runs are planned in parallel in groups of about this many pieces.
const GROUP: usize = 8192;

/// Limits of the axes, as sizes: of what is positive, of what is negative.
pub type Both<const M: usize> = [[f64; M]; 2];

/// The greater limit of both directions.
pub fn greater<const M: usize>(limits: &Both<M>) -> [f64; M] {
    std::array::from_fn(|k| limits[0][k].max(limits[1][k]))
}

/// The lesser limit of both directions.
pub fn lesser<const M: usize>(limits: &Both<M>) -> [f64; M] {
    std::array::from_fn(|k| limits[0][k].min(limits[1][k]))
}

/// The greatest multiple of a direction that the limits allow; infinite where all axes stand.
pub fn along<const M: usize>(limits: &Both<M>, direction: &[f64; M]) -> f64 {
    let of_axis = |k: usize| limits[usize::from(direction[k] < 0.0)][k] / direction[k].abs();
    (0..M).map(of_axis).fold(f64::INFINITY, f64::min)
}

/// Runs and limits of a problem; see `bang_bang_quadratic::Problem`.
pub struct Limits<'a, const M: usize> {
    pub runs: &'a [usize],
    pub feed: &'a [f64],
    pub junction_speed: &'a [f64],
    pub max_velocity: Both<M>,
    pub max_acceleration: Both<M>,
    pub chord_tolerance: f64,
    pub period: f64,
    pub start_speed: f64,
    pub end_speed: f64,
    pub watch: Watch<'a>,
}

impl<'a, const M: usize> Limits<'a, M> {
    /// Those of a path of any pieces.
    pub fn of(problem: &Problem<'a, M>) -> Self {
        Self {
            runs: problem.runs,
            feed: problem.feed,
            junction_speed: problem.junction_speed,
            max_velocity: problem.max_velocity,
            max_acceleration: problem.max_acceleration,
            chord_tolerance: problem.chord_tolerance,
            period: problem.period,
            start_speed: problem.start_speed,
            end_speed: problem.end_speed,
            watch: problem.watch,
        }
    }

    /// Every limit once: lengths, ranges, finite numbers.
    pub fn check(&self, count: usize) -> Result<(), Fault> {
        let wrong = |what: String| Err(Fault::Input { piece: None, what });
        let positive = |value: f64| value > 0.0 && value.is_finite();
        for (name, length, expected) in
            [("feeds", self.feed.len(), count), ("junction speeds", self.junction_speed.len(), count + 1)]
        {
            if length != expected {
                return wrong(format!("{length} {name} for {count} pieces: {expected} are needed"));
            }
        }
        let runs = self.runs;
        if runs.len() < 2
            || runs[0] != 0
            || runs[runs.len() - 1] != count
            || runs.windows(2).any(|run| run[0] >= run[1])
        {
            return wrong(format!(
                "the runs do not divide the {count} pieces: give rising offsets from 0 to {count}"
            ));
        }
        for (side, k) in (0..2).flat_map(|side| (0..M).map(move |k| (side, k))) {
            let (v, a) = (self.max_velocity[side][k], self.max_acceleration[side][k]);
            if !positive(v) {
                return wrong(format!("the velocity limit of axis {k} is {v} mm/s: give a positive number"));
            }
            if !positive(a) {
                return wrong(format!(
                    "the acceleration limit of axis {k} is {a} mm/s²: give a positive number"
                ));
            }
        }
        for (name, speed) in [("start", self.start_speed), ("end", self.end_speed)] {
            if !(speed >= 0.0 && speed.is_finite()) {
                return wrong(format!("the {name} speed is {speed} mm/s: give a finite number, 0 or more"));
            }
        }
        if self.chord_tolerance.is_nan() || self.chord_tolerance <= 0.0 {
            return wrong(format!(
                "the chord tolerance is {} mm: give a positive number",
                self.chord_tolerance
            ));
        }
        if self.chord_tolerance.is_finite() && !positive(self.period) {
            return wrong(format!("the servo period is {} s: give a positive number", self.period));
        }
        for (i, &feed) in self.feed.iter().enumerate() {
            if !positive(feed) {
                return Err(Fault::Input {
                    piece: Some(i),
                    what: format!("the feed is {feed} mm/s: give a positive finite number"),
                });
            }
        }
        for (i, &speed) in self.junction_speed.iter().enumerate() {
            if speed.is_nan() || speed < 0.0 {
                return Err(Fault::Input {
                    piece: Some(i.min(count - 1)),
                    what: format!("the junction speed is {speed} mm/s: give 0 or more"),
                });
            }
        }
        Ok(())
    }

    /// The profiles of all runs as one. `plan` gets the pieces of a run, the squares of the speeds at its ends, space
    /// and the profile to append to.
    pub fn over_runs<W: Default>(
        &self,
        space: Space<W>,
        plan: impl Fn((usize, usize), (f64, f64), &mut W, &mut Profile) -> Result<(), Fault> + Sync,
    ) -> Result<Profile, Fault> {
        let last_run = self.runs.len() - 2;
        let plans: Result<Vec<Profile>, Fault> = groups(self.runs)
            .par_iter()
            .map(|group| {
                let pieces = self.runs[group.end] - self.runs[group.start];
                let mut profile = Profile::with_capacity(2 * pieces);
                for run in group.clone() {
                    let ends = (self.runs[run], self.runs[run + 1]);
                    let start = if run == 0 { self.start_speed } else { 0.0 };
                    let end = if run == last_run { self.end_speed } else { 0.0 };
                    profile.runs.push(profile.len() as i64);
                    space.with_borrow_mut(|space| {
                        let planned = plan(ends, (start * start, end * end), space, &mut profile);
                        if ends.1 - ends.0 > MOST_KEPT {
                            *space = W::default();
                        }
                        planned
                    })?;
                }
                Ok(profile)
            })
            .collect();
        Ok(join(plans?))
    }
}

/// Space for one run, of each thread: kept from call to call, for the system takes its time to give some MB.
pub type Space<W> = &'static LocalKey<RefCell<W>>;

/// What a run of more pieces took is given back: some MB are kept at most.
const MOST_KEPT: usize = 4096;

/// Groups of neighbouring runs with about `GROUP` pieces each.
pub fn groups(runs: &[usize]) -> Vec<std::ops::Range<usize>> {
    let mut groups = vec![];
    let mut first = 0;
    for run in 0..runs.len() - 1 {
        if runs[run + 1] - runs[first] >= GROUP || run + 2 == runs.len() {
            groups.push(first..run + 1);
            first = run + 1;
        }
    }
    groups
}

/// One profile of all groups.
fn join(plans: Vec<Profile>) -> Profile {
    let mut plans = plans.into_iter();
    let mut all = plans.next().unwrap_or_default();
    for plan in plans {
        let offset = all.len() as i64;
        all.runs.extend(plan.runs.iter().map(|start| start + offset));
        all.append(plan);
    }
    all.runs.push(all.len() as i64);
    all
}

/// The chord-error limit where it can be lower than what the accelerations allow.
#[derive(Clone, Copy)]
pub struct ChordLimit {
    /// α = 8 δ/T²
    pub alpha: f64,
    /// 4 δ²/T²
    pub slow_sq: f64,
    /// δ
    pub tolerance: f64,
    /// The greatest acceleration that all axes have together.
    pub acceleration: f64,
}

impl ChordLimit {
    /// None if the limit never binds: v²/ρ is at most `acceleration` on any curve, and the limit nowhere below ρ α/2.
    pub fn new(tolerance: f64, period: f64, acceleration: f64) -> Option<Self> {
        let alpha = 8.0 * tolerance / (period * period);
        let slow_sq = 0.5 * alpha * tolerance;
        let binds = tolerance.is_finite() && alpha < 2.0 * acceleration;
        binds.then_some(Self { alpha, slow_sq, tolerance, acceleration })
    }
}
