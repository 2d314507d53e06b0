//! Setpoints at the servo period: positions, velocities, accelerations and jerks of a profile on its path.
//!
//! Every run starts on a setpoint and its end is hit exactly: run r with time T_r and pause D_r takes
//! ceil((T_r + D_r)/period) periods, so the stream waits less than one period at a stop; a pause before the first
//! run takes whole periods as well. A setpoint is found
//! from its index alone (run, time in the run, arc, place on the arc), so any part of the stream can be computed
//! on its own, in parallel and with the same digits. The Newton–Raphson interpolator goes step by step instead.
//!
//! At a stop velocity, acceleration and jerk are 0. At a switching point, where the acceleration jumps, a
//! setpoint has the values of the arc that begins there.

mod check;
mod chunk;

use std::ops::Range;
use std::sync::Arc;

use rayon::prelude::*;

use self::check::check;
use self::chunk::Slices;
pub use self::chunk::{Chunk, Effort};
use crate::motion::{Motion, ProfileArc, Rates, State, TipSpeed};
use feedplan_geometry::quadratic::{dot, norm};
use feedplan_geometry::spline::CompositeCurve;
use feedplan_geometry::watch::Watch;

/// More setpoints than this are refused: their indices and arrays would serve nobody.
pub const MAX_COUNT: f64 = 2e9;

/// A run that ends this part of a period after a setpoint ends on it.
const SLACK: f64 = 1e-9;

/// An end is at rest when its p is 0, whatever the arc's law: a ramp may be too short for its places to show it. And when
/// its speed is this part of the speed at the other end of its arc: a rounding error of p leaves the square root of one.
const STANDSTILL: f64 = 1e-6;

/// A speed is none beside one so many times greater that a step gains.
const REST: f64 = 1e-9;

/// A Newton–Raphson step is repeated so often before halving; two or three times are usual.
const MAX_REPEATS: u32 = 20;

/// Setpoints computed by one task.
const BLOCK: usize = 4096;

/// How the place at the next setpoint is found.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Interpolator {
    /// Closed forms on arcs; length table and Sarfraz predictor-corrector elsewhere.
    Sarfraz,
    /// Zhang 4.2: step length from speed and tangential acceleration, then Newton–Raphson.
    Newton,
}

/// A run between stops.
#[derive(Clone, Debug)]
struct Run {
    arcs: Range<usize>,
    /// Setpoint on which the run starts.
    first: usize,
    periods: usize,
    /// Seconds from the start of the plan, pauses counted, to the start of the run.
    begin: f64,
    /// Time in motion in seconds.
    time: f64,
    last_piece: usize,
}

/// Where the Newton–Raphson interpolator stands: the setpoint it found last, in which run, on which arc.
#[derive(Clone, Copy, Debug)]
pub struct Resume {
    index: usize,
    arc: usize,
    u: f64,
}

/// What a path gives: the curve that the axes follow; where the feed is about another one, and where laws of jerk are,
/// the Bernstein coefficients of the squares of their speeds per parameter, with offsets; the source lines of the
/// pieces, runs as piece offsets, and the pauses before the first run and after each.
pub struct PathData<const M: usize> {
    pub curve: Arc<CompositeCurve<M>>,
    pub tip_speed: Option<(Vec<f64>, Vec<usize>)>,
    pub way_speed: Option<(Vec<f64>, Vec<usize>)>,
    /// What the axes count in the feed on each piece; empty where that is not by shares.
    pub feed_share: Vec<[f64; M]>,
    pub lines: Vec<i32>,
    pub runs: Vec<usize>,
    pub start_dwell: f64,
    pub dwell: Vec<f64>,
}

/// A profile on its path, ready to be read at any setpoint.
pub struct Sampler<const M: usize> {
    path: Arc<PathData<M>>,
    arcs: Vec<ProfileArc>,
    /// Time from the start of the arc's run.
    starts: Vec<f64>,
    runs: Vec<Run>,
    period: f64,
    count: usize,
    /// The path ends at a speed: the last setpoint has its true time.
    ends_moving: bool,
}

impl<const M: usize> PathData<M> {
    /// The motion along an arc.
    fn motion(&self, arc: &ProfileArc, with_lengths: bool) -> Motion<'_, M> {
        let i = arc.piece as usize;
        let share = self.feed_share.get(i).filter(|share| **share != [1.0; M]);
        Motion::new(self.curve.piece(i), self.speed_of(arc), share, arc, with_lengths)
    }

    /// The speed that the law of an arc is about, where it is not that of the axes.
    fn speed_of(&self, arc: &ProfileArc) -> Option<TipSpeed<'_>> {
        let i = arc.piece as usize;
        let speed = if arc.kind.is_along() { &self.way_speed } else { &self.tip_speed };
        speed.as_ref().map(|(coefficients, offsets)| TipSpeed {
            coefficients: &coefficients[offsets[i]..offsets[i + 1]],
            width: self.curve.width[i],
        })
    }
}

impl<const M: usize> Sampler<M> {
    /// Lays the time grid. `arc_runs` are the arc offsets of the runs. The error is a sentence for the user.
    pub fn new(
        path: Arc<PathData<M>>,
        arcs: Vec<ProfileArc>,
        arc_runs: &[usize],
        period: f64,
        watch: Watch,
    ) -> Result<Self, String> {
        check(&path, &arcs, arc_runs, watch)?;
        if !(period.is_finite() && period > 0.0) {
            return Err(format!("the period is {period} s: give a positive one"));
        }
        let mut starts = Vec::with_capacity(arcs.len());
        let (mut runs, mut ends_moving) = (Vec::with_capacity(path.dwell.len()), false);
        let mut first = periods_of(path.start_dwell, period);
        let mut begin = path.start_dwell;
        for r in 0..path.dwell.len() {
            let (arc_range, pieces) = (arc_runs[r]..arc_runs[r + 1], path.runs[r]..path.runs[r + 1]);
            let mut time = 0.0;
            for arc in &arcs[arc_range.clone()] {
                starts.push(time);
                time += arc.duration;
            }
            let last = r + 1 == path.dwell.len();
            if let Some(arc) = arcs[arc_range.clone()].last() {
                let motion = path.motion(arc, false);
                let speed = |u| norm(&motion.rates(&motion.at(u)).velocity);
                if arc.p1 > 0.0 && speed(arc.u1) > STANDSTILL * speed(arc.u0) {
                    let line = path.lines[arc.piece as usize];
                    if !last {
                        return Err(format!(
                            "line {line}: the profile ends run {} at {:.6} mm/s: only the last run may end in motion",
                            r + 1,
                            speed(arc.u1)
                        ));
                    }
                    if path.dwell[r] > 0.0 {
                        return Err(format!(
                            "line {line}: the plan ends at {:.6} mm/s, but the program pauses {} s there: plan with end speed 0",
                            speed(arc.u1),
                            path.dwell[r]
                        ));
                    }
                    ends_moving = true;
                }
            }
            let periods = periods_of(time + path.dwell[r], period);
            if first + periods > MAX_COUNT {
                return Err(format!(
                    "a period of {period} s makes more than {MAX_COUNT:.0} setpoints: use a larger period"
                ));
            }
            runs.push(Run {
                arcs: arc_range,
                first: first as usize,
                periods: periods as usize,
                begin,
                time,
                last_piece: pieces.end - 1,
            });
            first += periods;
            begin += time + path.dwell[r];
        }
        let count = first as usize + 1;
        let sampler = Self { path, arcs, starts, runs, period, count, ends_moving };
        match sampler.start() {
            Some((speed, ..)) if speed > 0.0 && sampler.path.start_dwell > 0.0 => Err(format!(
                "line {}: the plan begins at {speed:.6} mm/s, but the program pauses {} s there: plan with start speed 0",
                sampler.path.lines[0], sampler.path.start_dwell
            )),
            _ => Ok(sampler),
        }
    }

    /// Number of setpoints, the start of the path included.
    pub fn count(&self) -> usize {
        self.count
    }

    /// Time of the last setpoint in seconds.
    pub fn duration(&self) -> f64 {
        self.time(self.count - 1)
    }

    /// Each run: when it starts on the plan's own clock, when on that of the setpoints, and its time in motion.
    pub fn runs(&self) -> impl Iterator<Item = [f64; 3]> + '_ {
        self.runs.iter().map(|run| [run.begin, run.first as f64 * self.period, run.time])
    }

    /// Time of a setpoint in seconds.
    fn time(&self, index: usize) -> f64 {
        match self.runs.last() {
            Some(run) if self.ends_moving && index == self.count - 1 => {
                run.first as f64 * self.period + run.time
            }
            _ => index as f64 * self.period,
        }
    }

    /// The setpoints in a range. `resume` carries the state of the Newton–Raphson interpolator from one range to
    /// the next; without it, or going back, a run is followed again from its start.
    pub fn chunk(
        &self,
        range: Range<usize>,
        interpolator: Interpolator,
        resume: &mut Option<Resume>,
        watch: Watch,
    ) -> Chunk<M> {
        let mut chunk = Chunk::with_size(range.len());
        let parts = chunk.slices(range.start).split(&self.cuts(&range, interpolator));
        let results: Vec<(Effort, Option<Resume>)> = match interpolator {
            Interpolator::Sarfraz => {
                parts.into_par_iter().map(|part| (self.fill_by_time(part, watch), None)).collect()
            }
            Interpolator::Newton => {
                let resume = *resume;
                parts.into_par_iter().map(|part| self.fill_by_steps(part, resume, watch)).collect()
            }
        };
        for (effort, state) in results {
            chunk.effort.raise(effort.iterations, effort.length_error);
            *resume = state.or(*resume);
        }
        chunk
    }

    /// The states at times of the plan's own clock, in seconds: runs and pauses follow each other without waiting
    /// for whole periods. At the moment of a stop the tool rests; a time beyond an end gives that end.
    pub fn at(&self, times: &[f64], watch: Watch) -> Chunk<M> {
        let mut chunk = Chunk::with_size(times.len());
        let cuts: Vec<usize> = (0..times.len()).step_by(BLOCK).skip(1).collect();
        chunk.slices(0).split(&cuts).into_par_iter().for_each(|mut part| {
            let mut cursor = Cursor::new(self, false);
            for i in 0..part.t.len() {
                watch.check_at(i);
                let t = times[part.start + i];
                match self.runs.partition_point(|run| run.begin < t).checked_sub(1) {
                    None => self.set_start(&mut part, i),
                    Some(r) if t - self.runs[r].begin < self.runs[r].time => {
                        let arc = cursor.seek(&self.runs[r], t - self.runs[r].begin);
                        let state =
                            cursor.motion().at_time(t - self.runs[r].begin - self.starts[arc], self.period);
                        self.set(&mut part, i, arc, cursor.motion(), &state);
                    }
                    Some(r) => self.set_end(
                        &self.runs[r],
                        &mut part,
                        i,
                        self.ends_moving && r + 1 == self.runs.len(),
                    ),
                }
                part.t[i] = t;
            }
        });
        chunk
    }

    /// The states at places of the path, with their times on the plan's own clock. In the last place of a piece
    /// the arc that ends there counts.
    pub fn along(&self, pieces: &[u32], u: &[f64], watch: Watch) -> Chunk<M> {
        let mut chunk = Chunk::with_size(pieces.len());
        let cuts: Vec<usize> = (0..pieces.len()).step_by(BLOCK).skip(1).collect();
        chunk.slices(0).split(&cuts).into_par_iter().for_each(|mut part| {
            for i in 0..part.t.len() {
                watch.check_at(i);
                let (piece, u) = (pieces[part.start + i], u[part.start + i]);
                let after = self.arcs.partition_point(|arc| (arc.piece, arc.u1) < (piece, u));
                let Some(found) = self.arcs.get(after) else {
                    let run = &self.runs[self.runs.len() - 1];
                    self.set_end(run, &mut part, i, self.ends_moving);
                    part.t[i] = run.begin + run.time;
                    continue;
                };
                let run = &self.runs[self.runs.partition_point(|run| run.arcs.end <= after)];
                let motion = self.path.motion(found, false);
                let state = motion.at(u.clamp(found.u0, found.u1));
                self.set(&mut part, i, after, &motion, &state);
                part.t[i] = run.begin + self.starts[after] + motion.time(&state);
            }
        });
        chunk
    }

    /// Where a range is cut into tasks: anywhere, or between runs where the steps depend on each other.
    fn cuts(&self, range: &Range<usize>, interpolator: Interpolator) -> Vec<usize> {
        match interpolator {
            Interpolator::Sarfraz => range.clone().step_by(BLOCK).skip(1).collect(),
            Interpolator::Newton => {
                let inner = |run: &&Run| run.periods > 0 && run.first + 1 < range.end;
                let from = self.runs.partition_point(|run| run.first < range.start);
                self.runs[from..].iter().take_while(inner).map(|run| run.first + 1).collect()
            }
        }
    }

    /// The run that leads to a setpoint other than the first.
    fn run_of(&self, index: usize) -> &Run {
        &self.runs[self.runs.partition_point(|run| run.first < index) - 1]
    }

    /// Time in the run of its j-th setpoint; None where the tool has arrived.
    fn run_time(&self, run: &Run, j: usize) -> Option<f64> {
        let time = j as f64 * self.period;
        (j < run.periods && time < run.time).then_some(time)
    }

    fn fill_by_time(&self, mut part: Slices<M>, watch: Watch) -> Effort {
        let mut effort = Effort::default();
        let mut cursor = Cursor::new(self, false);
        let mut i = 0;
        while i < part.t.len() {
            let index = part.start + i;
            if index <= self.runs[0].first {
                self.set_start(&mut part, i);
                part.t[i] = self.time(index);
                i += 1;
                continue;
            }
            let run = self.run_of(index);
            let stop = part.t.len().min(run.first + run.periods + 1 - part.start);
            for i in i..stop {
                watch.check_at(i);
                let index = part.start + i;
                part.t[i] = self.time(index);
                let Some(time) = self.run_time(run, index - run.first) else {
                    self.set_end(run, &mut part, i, self.ends_moving && index + 1 == self.count);
                    continue;
                };
                let arc = cursor.seek(run, time);
                let state = cursor.motion().at_time(time - self.starts[arc], self.period);
                effort.raise(state.iterations, state.error * self.arcs[arc].duration / self.period);
                self.set(&mut part, i, arc, cursor.motion(), &state);
            }
            i = stop;
        }
        effort
    }

    /// Zhang 4.2, corrected. The paper's step v·T is of first order and stands still at rest: here it is of third
    /// order on the arc that it ends on, and is repeated for the time that the profile still has to go from the
    /// place reached, so that errors do not add up and every run ends on time.
    fn fill_by_steps(
        &self,
        mut part: Slices<M>,
        resume: Option<Resume>,
        watch: Watch,
    ) -> (Effort, Option<Resume>) {
        let mut effort = Effort::default();
        let begin = (self.runs[0].first + 1).saturating_sub(part.start).min(part.t.len());
        for i in 0..begin {
            self.set_start(&mut part, i);
            part.t[i] = self.time(part.start + i);
        }
        if begin == part.t.len() {
            return (effort, None);
        }
        let run = self.run_of(part.start + begin);
        let mut cursor = Cursor::new(self, true);
        let fresh = Resume { index: run.first, arc: run.arcs.start, u: f64::NAN };
        let known = resume.filter(|known| run.first < known.index && known.index < part.start + begin);
        let mut at = known.unwrap_or(fresh);
        while at.index + 1 < part.start + part.t.len() {
            at.index += 1;
            watch.check_at(at.index);
            let out = (at.index >= part.start).then(|| at.index - part.start);
            let Some(time) = self.run_time(run, at.index - run.first) else {
                if let Some(i) = out {
                    self.set_end(run, &mut part, i, self.ends_moving && at.index + 1 == self.count);
                    part.t[i] = self.time(at.index);
                }
                continue;
            };
            cursor.from(at.arc);
            let arc = cursor.seek(run, time);
            let motion = cursor.motion();
            if arc != at.arc || at.u.is_nan() {
                at = Resume { arc, u: self.arcs[arc].u0, ..at };
            }
            let (rounds, error) = self.step(motion, time - self.starts[arc], &mut at.u);
            effort.raise(rounds, error);
            if let Some(i) = out {
                self.set(&mut part, i, arc, motion, &motion.at(at.u));
                part.t[i] = self.time(at.index);
            }
        }
        (effort, Some(at))
    }

    /// Moves u to `time` on the arc; returns the rounds of Newton–Raphson and the length error left, in steps.
    fn step(&self, motion: &Motion<M>, time: f64, u: &mut f64) -> (u32, f64) {
        let (mut low, mut high) = motion.span();
        let (rounding, allowed) = (motion.length_rounding(), motion.step_error());
        let (mut rounds, mut whole) = (0, 0.0);
        for repeat in 0.. {
            let state = motion.at(*u);
            let left = time - motion.time(&state);
            let rates = motion.rates(&state);
            let step = step_length(&rates, left);
            if repeat == 0 {
                // The step may have begun on an earlier arc.
                whole = step_length(&rates, self.period).max(step.abs());
            }
            if left > 0.0 {
                low = low.max(*u);
            } else {
                high = high.min(*u);
            }
            let middle = 0.5 * (low + high);
            // The derivatives of the speed may be rounding where an axis turns round: the speed alone must agree.
            let off = step.abs().max(0.5 * left.abs() * norm(&rates.velocity));
            if off <= allowed * whole + 2.0 * rounding || !(low < middle && middle < high) {
                let error = if whole > 0.0 { (step.abs() + motion.length_error()) / whole } else { 0.0 };
                return (rounds, error);
            }
            let tolerance = 0.1 * allowed * whole + rounding;
            let located = motion.advance(*u, step, tolerance);
            rounds += located.iterations;
            // A large period can be too much for the series.
            let usable = low < located.u && located.u < high && repeat < MAX_REPEATS;
            *u = if usable { located.u } else { middle };
        }
        unreachable!("halving comes to an end")
    }

    fn set(&self, part: &mut Slices<M>, i: usize, arc: usize, motion: &Motion<M>, state: &State) {
        let (position, Rates { velocity, acceleration, jerk }) = motion.sample(state);
        let piece = self.arcs[arc].piece;
        part.position[i] = position;
        part.velocity[i] = velocity;
        part.acceleration[i] = acceleration;
        part.jerk[i] = jerk;
        part.line[i] = self.path.lines[piece as usize];
        part.piece[i] = piece;
        part.u[i] = state.u;
    }

    /// Speed, first arc and its motion where the path begins; a speed of 0 is exact.
    fn start(&self) -> Option<(f64, usize, Motion<'_, M>)> {
        let first = self.runs[0].arcs.clone().next()?;
        let arc = &self.arcs[first];
        let motion = self.path.motion(arc, false);
        let [begin, end] = [arc.u0, arc.u1].map(|u| norm(&motion.rates(&motion.at(u)).velocity));
        let rests = arc.p0 == 0.0 || begin <= STANDSTILL * end;
        Some((if rests { 0.0 } else { begin }, first, motion))
    }

    fn set_start(&self, part: &mut Slices<M>, i: usize) {
        if let Some((speed, arc, motion)) = self.start() {
            if speed > 0.0 {
                self.set(part, i, arc, &motion, &motion.at(self.arcs[arc].u0));
            }
        }
        part.position[i] = self.path.curve.control[0];
        part.line[i] = self.path.lines[0];
        part.piece[i] = 0;
        part.u[i] = 0.0;
    }

    /// The end of a run; `moving` where the path ends there at a speed.
    fn set_end(&self, run: &Run, part: &mut Slices<M>, i: usize, moving: bool) {
        let curve = &self.path.curve;
        if let (true, Some(arc)) = (moving, self.arcs[run.arcs.clone()].last()) {
            let motion = self.path.motion(arc, false);
            self.set(part, i, run.arcs.end - 1, &motion, &motion.at(arc.u1));
        }
        part.position[i] = curve.control[curve.offsets[run.last_piece + 1] - 1];
        part.line[i] = self.path.lines[run.last_piece];
        part.piece[i] = run.last_piece as u32;
        part.u[i] = curve.width[run.last_piece];
    }
}

/// Length of the step over `time`: v t + a t²/2 + j t³/6 with the first derivatives of the speed v, at most to
/// the standstill that a < 0 leads to.
fn step_length<const M: usize>(rates: &Rates<M>, time: f64) -> f64 {
    let Rates { velocity, acceleration, jerk } = rates;
    let v = norm(velocity);
    let (pull, push) = (norm(acceleration), norm(jerk));
    // The direction of a speed that is rounding beside what acceleration and jerk add says nothing.
    if v <= REST * (pull + 0.5 * push * time.abs()) * time.abs() {
        // Away from the standstill, forward or back in time; so the jerk pushes, where there is nothing else.
        let push = if pull <= REST * push * time.abs() { push } else { dot(acceleration, jerk) / pull };
        return time * time.abs() * (0.5 * pull + time.abs() * push / 6.0);
    }
    let a = dot(velocity, acceleration) / v;
    let across: [f64; M] = std::array::from_fn(|k| acceleration[k] - a * velocity[k] / v);
    let j = (dot(velocity, jerk) + dot(&across, &across)) / v;
    // Where v + a t + j t²/2 vanishes, if it does: not a number otherwise, which `min` leaves out.
    let time = if a < 0.0 { time.min(2.0 * v / ((a * a - 2.0 * v * j).sqrt() - a)) } else { time };
    time * (v + time * (0.5 * a + time * j / 6.0))
}

/// Whole periods of a run, as f64 so that absurd numbers stay numbers.
fn periods_of(time: f64, period: f64) -> f64 {
    let exact = time / period;
    match time > 0.0 {
        true => (exact * (1.0 - 4.0 * f64::EPSILON) - SLACK).ceil().max(1.0),
        false => 0.0,
    }
}

/// The arc at a time, kept from one setpoint to the next.
struct Cursor<'a, const M: usize> {
    sampler: &'a Sampler<M>,
    arc: usize,
    motion: Option<(usize, Motion<'a, M>)>,
    with_lengths: bool,
}

impl<'a, const M: usize> Cursor<'a, M> {
    fn new(sampler: &'a Sampler<M>, with_lengths: bool) -> Self {
        Self { sampler, arc: usize::MAX, motion: None, with_lengths }
    }

    fn from(&mut self, arc: usize) {
        self.arc = arc;
    }

    /// Goes to the arc of a run that contains the time.
    fn seek(&mut self, run: &Run, time: f64) -> usize {
        let starts = &self.sampler.starts;
        if !run.arcs.contains(&self.arc) || starts[self.arc] > time {
            self.arc = run.arcs.start + starts[run.arcs.clone()].partition_point(|&start| start <= time) - 1;
        }
        while self.arc + 1 < run.arcs.end && starts[self.arc + 1] <= time {
            self.arc += 1;
        }
        if self.motion.as_ref().is_none_or(|(arc, _)| *arc != self.arc) {
            let arc = &self.sampler.arcs[self.arc];
            self.motion = Some((self.arc, self.sampler.path.motion(arc, self.with_lengths)));
        }
        self.arc
    }

    fn motion(&self) -> &Motion<'a, M> {
        &self.motion.as_ref().expect("seek comes first").1
    }
}
