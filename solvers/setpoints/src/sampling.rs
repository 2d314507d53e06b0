//! Setpoints at the servo period: positions, velocities, accelerations and jerks of a profile on its path.
//!
//! Every run starts on a setpoint and its end is hit exactly: run r with time T_r and pause D_r takes
//! ceil((T_r + D_r)/period) periods, so the stream waits less than one period at a stop; a pause before the first run takes
//! whole periods as well. A setpoint is found from its index alone (run, time in the run, phase, place on the phase), so any
//! part of the stream can be computed on its own, in parallel and with the same digits. The Newton–Raphson interpolator goes
//! step by step instead.
//!
//! At a stop velocity, acceleration and jerk are 0. At a switching point, where the acceleration jumps, a
//! setpoint has the values of the phase that begins there.

mod check;
mod chunk;
mod path_data;

use std::ops::Range;
use std::rc::Rc;
use std::sync::Arc;

use rayon::prelude::*;

use self::check::check;
use self::chunk::Slices;
pub use self::chunk::{Chunk, Effort};
pub use self::path_data::PathData;
use crate::phase_motion::{PhaseMotion, PiecePath, Rates, State};
use feedplan_geometry::quadratic::{dot, norm};
use feedplan_geometry::watch::Watch;
use feedplan_planner::phases::{Phase, Phases};

/// More setpoints than this are refused: their indices and arrays would serve nobody.
pub const MAX_COUNT: f64 = 2e9;

/// A run that ends this part of a period after a setpoint ends on it.
const SLACK: f64 = 1e-9;

/// An end is at rest when its p is 0, whatever the phase's law, because a ramp may be too short for its places to show it;
/// and when its speed is this part of the speed at the other end of its phase: a rounding error of p leaves its square root.
const STANDSTILL: f64 = 1e-6;

/// A speed below this part of what a step gains is treated as rest.
const REST: f64 = 1e-9;

/// A Newton–Raphson step is repeated so often before halving; two or three times are usual.
const MAX_REPEATS: u32 = 20;

/// Setpoints computed by one task.
const BLOCK: usize = 4096;

/// How the place at the next setpoint is found.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Interpolator {
    /// Closed forms where a law has them; length table and Sarfraz predictor-corrector elsewhere.
    Sarfraz,
    /// Zhang 4.2: step length from speed and tangential acceleration, then Newton–Raphson.
    Newton,
}

/// A run between stops.
#[derive(Clone, Debug)]
struct Run {
    phases: Range<usize>,
    /// Setpoint on which the run starts.
    first: usize,
    periods: usize,
    /// Seconds from the start of the plan, pauses counted, to the start of the run.
    begin: f64,
    /// Time in motion in seconds.
    time: f64,
    last_piece: usize,
}

/// Where the Newton–Raphson interpolator stands: the setpoint it found last, in which run, on which phase.
#[derive(Clone, Copy, Debug)]
pub struct Resume {
    index: usize,
    phase: usize,
    u: f64,
}

/// A profile on its path, ready to be read at any setpoint.
pub struct Sampler<const M: usize> {
    path: Arc<PathData<M>>,
    phases: Arc<Phases>,
    /// Time from the start of the phase's run.
    starts: Vec<f64>,
    runs: Vec<Run>,
    period: f64,
    count: usize,
    /// The path ends at a speed: the last setpoint has its true time.
    ends_moving: bool,
}

impl<const M: usize> Sampler<M> {
    /// Lays the time grid. `phase_runs` are the phase offsets of the runs. The error is a sentence for the user.
    pub fn on(
        path: &Arc<PathData<M>>,
        phases: &Arc<Phases>,
        phase_runs: &[usize],
        period: f64,
        watch: Watch,
    ) -> Result<Self, String> {
        check(path, phases, phase_runs, watch)?;
        if !(period.is_finite() && period > 0.0) {
            return Err(format!("the period is {period} s: give a positive one"));
        }
        let mut starts = Vec::with_capacity(phases.len());
        let (mut runs, mut ends_moving) = (Vec::with_capacity(path.dwell.len()), false);
        let mut first = periods_of(path.start_dwell, period);
        let mut begin = path.start_dwell;
        for r in 0..path.dwell.len() {
            let (of_run, pieces) = (phase_runs[r]..phase_runs[r + 1], path.runs[r]..path.runs[r + 1]);
            let mut time = 0.0;
            for duration in &phases.duration[of_run.clone()] {
                starts.push(time);
                time += duration;
            }
            let last = r + 1 == path.dwell.len();
            if let Some(phase) = of_run.clone().last().and_then(|i| phases.get(i)) {
                let motion = path.motion(&phase);
                let speed = |u| norm(&motion.rates(&motion.at(u)).velocity);
                if phase.p1 > 0.0 && speed(phase.u1) > STANDSTILL * speed(phase.u0) {
                    let line = path.lines[phase.piece as usize];
                    if !last {
                        return Err(format!(
                            "line {line}: the profile ends run {} at {:.6} mm/s: only the last run may end in motion",
                            r + 1,
                            speed(phase.u1)
                        ));
                    }
                    if path.dwell[r] > 0.0 {
                        return Err(format!(
                            "line {line}: the plan ends at {:.6} mm/s, but the program pauses {} s there: plan with end speed 0",
                            speed(phase.u1),
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
                phases: of_run,
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
        let sampler =
            Self { path: path.clone(), phases: phases.clone(), starts, runs, period, count, ends_moving };
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
            let mut cursor = Cursor::new(self);
            for i in 0..part.t.len() {
                watch.check_at(i);
                let t = times[part.start + i];
                match self.runs.partition_point(|run| run.begin < t).checked_sub(1) {
                    None => self.set_start(&mut part, i),
                    Some(r) if t - self.runs[r].begin < self.runs[r].time => {
                        let phase = cursor.seek(&self.runs[r], t - self.runs[r].begin);
                        let state =
                            cursor.motion().at_time(t - self.runs[r].begin - self.starts[phase], self.period);
                        self.set(&mut part, i, phase, cursor.motion(), &state);
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
    /// the phase that ends there counts.
    pub fn along(&self, pieces: &[u32], u: &[f64], watch: Watch) -> Chunk<M> {
        let mut chunk = Chunk::with_size(pieces.len());
        let cuts: Vec<usize> = (0..pieces.len()).step_by(BLOCK).skip(1).collect();
        chunk.slices(0).split(&cuts).into_par_iter().for_each(|mut part| {
            // Places come mostly in the order of the path, many on one phase.
            let mut kept = None;
            for i in 0..part.t.len() {
                watch.check_at(i);
                let (piece, u) = (pieces[part.start + i], u[part.start + i]);
                let after = self.phases.up_to(piece, u);
                if after == self.phases.len() {
                    let run = &self.runs[self.runs.len() - 1];
                    self.set_end(run, &mut part, i, self.ends_moving);
                    part.t[i] = run.begin + run.time;
                    continue;
                }
                let run = &self.runs[self.runs.partition_point(|run| run.phases.end <= after)];
                if kept.as_ref().is_none_or(|(phase, _)| *phase != after) {
                    kept = Some((after, self.path.motion(&self.phase(after))));
                }
                let Some((_, motion)) = &kept else { unreachable!("a motion is kept") };
                let state = motion.at(u.clamp(self.phases.u0[after], self.phases.u1[after]));
                self.set(&mut part, i, after, motion, &state);
                part.t[i] = run.begin + self.starts[after] + state.pace.t;
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

    fn phase(&self, i: usize) -> Phase {
        self.phases.get(i).expect("all laws are known")
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
        let mut cursor = Cursor::new(self);
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
                let phase = cursor.seek(run, time);
                let state = cursor.motion().at_time(time - self.starts[phase], self.period);
                effort.raise(state.iterations, state.error * self.phases.duration[phase] / self.period);
                self.set(&mut part, i, phase, cursor.motion(), &state);
            }
            i = stop;
        }
        effort
    }

    /// Zhang 4.2, corrected. The paper's step v·T is of first order and stands still at rest: here it is of third
    /// order on the phase that it ends on, and is repeated for the time that the profile still has to go from the
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
        let mut cursor = Cursor::new(self);
        let fresh = Resume { index: run.first, phase: run.phases.start, u: f64::NAN };
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
            cursor.from(at.phase);
            let phase = cursor.seek(run, time);
            let motion = cursor.motion();
            if phase != at.phase || at.u.is_nan() {
                at = Resume { phase, u: self.phases.u0[phase], ..at };
            }
            let (rounds, error) = self.step(motion, time - self.starts[phase], &mut at.u);
            effort.raise(rounds, error);
            if let Some(i) = out {
                self.set(&mut part, i, phase, motion, &motion.at(at.u));
                part.t[i] = self.time(at.index);
            }
        }
        (effort, Some(at))
    }

    /// Moves u to `time` on the phase; returns the rounds of Newton–Raphson and the length error left, in steps.
    fn step(&self, motion: &PhaseMotion<M>, time: f64, u: &mut f64) -> (u32, f64) {
        let (mut low, mut high) = motion.span();
        let ([rounding, table_error], allowed) = (motion.path().length_errors(), motion.step_error());
        let (mut rounds, mut whole) = (0, 0.0);
        for repeat in 0.. {
            let state = motion.at(*u);
            let left = time - state.pace.t;
            let rates = motion.rates(&state);
            let step = step_length(&rates, left);
            if repeat == 0 {
                // The step may have begun on an earlier phase.
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
                let error = if whole > 0.0 { (step.abs() + table_error) / whole } else { 0.0 };
                return (rounds, error);
            }
            let tolerance = 0.1 * allowed * whole + rounding;
            let located = motion.path().advance(*u, step, tolerance);
            rounds += located.iterations;
            // A large period can be too much for the series.
            let usable = low < located.u && located.u < high && repeat < MAX_REPEATS;
            *u = if usable { located.u } else { middle };
        }
        unreachable!("halving comes to an end")
    }

    fn set(&self, part: &mut Slices<M>, i: usize, phase: usize, motion: &PhaseMotion<M>, state: &State) {
        let (position, Rates { velocity, acceleration, jerk }) = motion.sample(state);
        let piece = self.phases.piece[phase];
        part.position[i] = position;
        part.velocity[i] = velocity;
        part.acceleration[i] = acceleration;
        part.jerk[i] = jerk;
        part.line[i] = self.path.lines[piece as usize];
        part.piece[i] = piece;
        part.u[i] = state.u;
    }

    /// Speed, first phase and its motion where the path begins; a speed of 0 is exact.
    fn start(&self) -> Option<(f64, usize, PhaseMotion<'_, M>)> {
        let first = self.runs[0].phases.clone().next()?;
        let phase = self.phase(first);
        let motion = self.path.motion(&phase);
        let [begin, end] = [phase.u0, phase.u1].map(|u| norm(&motion.rates(&motion.at(u)).velocity));
        let rests = phase.p0 == 0.0 || begin <= STANDSTILL * end;
        Some((if rests { 0.0 } else { begin }, first, motion))
    }

    fn set_start(&self, part: &mut Slices<M>, i: usize) {
        if let Some((speed, phase, motion)) = self.start() {
            if speed > 0.0 {
                self.set(part, i, phase, &motion, &motion.at(self.phases.u0[phase]));
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
        if let (true, Some(last)) = (moving, run.phases.clone().last()) {
            let phase = self.phase(last);
            let motion = self.path.motion(&phase);
            self.set(part, i, last, &motion, &motion.at(phase.u1));
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

/// The phase at a time, kept from one setpoint to the next, and its piece, kept from one phase to the next.
struct Cursor<'a, const M: usize> {
    sampler: &'a Sampler<M>,
    phase: usize,
    piece: Option<(u32, Rc<PiecePath<'a, M>>)>,
    motion: Option<(usize, PhaseMotion<'a, M>)>,
}

impl<'a, const M: usize> Cursor<'a, M> {
    fn new(sampler: &'a Sampler<M>) -> Self {
        Self { sampler, phase: usize::MAX, piece: None, motion: None }
    }

    fn from(&mut self, phase: usize) {
        self.phase = phase;
    }

    /// Goes to the phase of a run that contains the time.
    fn seek(&mut self, run: &Run, time: f64) -> usize {
        let starts = &self.sampler.starts;
        if !run.phases.contains(&self.phase) || starts[self.phase] > time {
            self.phase =
                run.phases.start + starts[run.phases.clone()].partition_point(|&start| start <= time) - 1;
        }
        while self.phase + 1 < run.phases.end && starts[self.phase + 1] <= time {
            self.phase += 1;
        }
        if self.motion.as_ref().is_none_or(|(phase, _)| *phase != self.phase) {
            let phase = self.sampler.phase(self.phase);
            let piece = match self.piece.take() {
                Some((number, piece)) if number == phase.piece => piece,
                _ => Rc::new(self.sampler.path.piece(phase.piece as usize)),
            };
            self.piece = Some((phase.piece, piece.clone()));
            self.motion = Some((self.phase, PhaseMotion::new(piece, &phase)));
        }
        self.phase
    }

    fn motion(&self) -> &PhaseMotion<'a, M> {
        &self.motion.as_ref().expect("seek comes first").1
    }
}
