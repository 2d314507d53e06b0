//! Setpoints at the servo period: positions, velocities, accelerations and jerks of a profile on its path.
//!
//! Every run starts on a setpoint, and its end is hit exactly: run r with time T_r and pause D_r takes ceil((T_r + D_r)/period)
//! periods, so the stream waits less than one period at a stop; a pause before the first run takes whole periods as well. A
//! setpoint is computed from its index alone (run, time in the run, phase, place on the phase), so any part of the stream can be
//! computed separately, in parallel and with identical results. The Newton–Raphson interpolator instead goes from setpoint to
//! setpoint.
//!
//! At a stop velocity, acceleration and jerk are 0. At a switch, where the acceleration jumps, a setpoint has the values of the
//! phase that begins there.
//!
//! | file | content |
//! |---|---|
//! | `path_data`, `check` | the path of a profile, and whether both fit together |
//! | `time_grid` | the setpoints of each run |
//! | `cursor` | the phase at a time, and the motion on it |
//! | `newton` | the Newton–Raphson interpolator |
//! | `chunk` | the columns of setpoints |

mod check;
mod chunk;
mod cursor;
mod newton;
mod path_data;
mod time_grid;

use std::ops::Range;
use std::sync::Arc;

use self::chunk::Slices;
pub use self::chunk::{Chunk, Effort};
use self::cursor::Cursor;
pub use self::path_data::PathData;
use crate::phase_motion::at_once::{Moments, TIMES};
use crate::phase_motion::{PhaseMotion, Rates, State};
use feedplan_geometry::parallel::consume;
use feedplan_geometry::quadratic::norm;
use feedplan_geometry::watch::Watch;
use feedplan_planner::phase_law::PhaseLaw;
use feedplan_planner::phases::{Phase, Phases};

/// A path begins or ends at rest if p is 0 there, for any law, because on a very short ramp the computed speed may not show it;
/// or if the speed there is below this share of that at the other end of the phase: a rounding error of p leaves its square root.
const STANDSTILL: f64 = 1e-6;

/// Number of setpoints computed by one task.
const BLOCK: usize = 1024;

/// How the place at the next setpoint is found.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Interpolator {
    /// Closed forms where a law has them; length table and Sarfraz predictor-corrector elsewhere.
    Sarfraz,
    /// Zhang 4.2, corrected: step length from speed, acceleration and jerk, then Newton–Raphson.
    Newton,
}

/// A run between stops.
#[derive(Clone, Debug)]
struct Run {
    phases: Range<usize>,
    /// Index of the setpoint on which the run starts.
    first: usize,
    periods: usize,
    /// Time from the start of the plan to the start of the run, pauses included, in s.
    begin: f64,
    /// Time in motion in s.
    time: f64,
    last_piece: usize,
}

/// The state of the Newton–Raphson interpolator: index, phase and parameter of the last setpoint found.
#[derive(Clone, Copy, Debug)]
pub struct Resume {
    index: usize,
    phase: usize,
    u: f64,
}

/// A profile on its path, ready to be evaluated at any setpoint.
pub struct Sampler<const M: usize> {
    path: Arc<PathData<M>>,
    phases: Arc<Phases>,
    /// Start of each phase, from the start of its run, in s.
    starts: Vec<f64>,
    runs: Vec<Run>,
    period: f64,
    count: usize,
    /// The path ends at a speed above 0: the last setpoint has the exact end time.
    ends_moving: bool,
}

impl<const M: usize> Sampler<M> {
    /// Number of setpoints, including the start of the path.
    pub fn count(&self) -> usize {
        self.count
    }

    /// Time of the last setpoint in s.
    pub fn duration(&self) -> f64 {
        self.time(self.count - 1)
    }

    /// For each run its start on the clock of the plan, its start on that of the setpoints, and its time in motion, all in s.
    pub fn runs(&self) -> impl Iterator<Item = [f64; 3]> + '_ {
        self.runs.iter().map(|run| [run.begin, run.first as f64 * self.period, run.time])
    }

    /// Time of a setpoint in s.
    fn time(&self, index: usize) -> f64 {
        match self.runs.last() {
            Some(run) if self.ends_moving && index == self.count - 1 => {
                run.first as f64 * self.period + run.time
            }
            _ => index as f64 * self.period,
        }
    }

    /// The setpoints in a range. `resume` carries the state of the Newton–Raphson interpolator from one range to the next;
    /// without it, or for an earlier range, a run is computed again from its start.
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
            Interpolator::Sarfraz => consume(parts, |_, part| (self.fill_by_time(part, watch), None)),
            Interpolator::Newton => {
                let resume = *resume;
                consume(parts, |_, part| self.fill_by_steps(part, resume, watch))
            }
        };
        for (effort, state) in results {
            chunk.effort.raise(effort.iterations, effort.length_error);
            *resume = state.or(*resume);
        }
        chunk
    }

    /// The motion at times on the clock of the plan, in s: there runs and pauses follow each other without waiting for whole
    /// periods. At a stop the tool is at rest; a time before the start or after the end gives that end.
    pub fn at(&self, times: &[f64], watch: Watch) -> Chunk<M> {
        let mut chunk = Chunk::with_size(times.len());
        let cuts: Vec<usize> = (0..times.len()).step_by(BLOCK).skip(1).collect();
        consume(chunk.slices(0).split(&cuts), |_, mut part| {
            let mut cursor = self.cursor();
            for i in 0..part.t.len() {
                watch.check_at(i);
                let t = times[part.start + i];
                match self.runs.partition_point(|run| run.begin < t).checked_sub(1) {
                    None => self.set_start(&mut part, i),
                    Some(r) if t - self.runs[r].begin < self.runs[r].time => {
                        let phase = cursor.seek(&self.runs[r].phases, t - self.runs[r].begin);
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

    /// The motion at places of the path, and their times on the clock of the plan. At the end of a piece it is that of the phase
    /// that ends there.
    pub fn along(&self, pieces: &[u32], u: &[f64], watch: Watch) -> Chunk<M> {
        let mut chunk = Chunk::with_size(pieces.len());
        let cuts: Vec<usize> = (0..pieces.len()).step_by(BLOCK).skip(1).collect();
        consume(chunk.slices(0).split(&cuts), |_, mut part| {
            // Places mostly come in the order of the path, many on one phase.
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

    /// Setpoints at which a range is cut into tasks: anywhere, or only between runs if each setpoint depends on the one before.
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

    fn cursor(&self) -> Cursor<'_, M> {
        Cursor::new(&self.path, &self.phases, &self.starts)
    }

    /// The run that contains a setpoint other than the first one.
    fn run_of(&self, index: usize) -> &Run {
        &self.runs[self.runs.partition_point(|run| run.first < index) - 1]
    }

    /// Time of the j-th setpoint of a run, from the start of the run in s; None where the tool has arrived.
    fn run_time(&self, run: &Run, j: usize) -> Option<f64> {
        let time = j as f64 * self.period;
        (j < run.periods && time < run.time).then_some(time)
    }

    fn fill_by_time(&self, mut part: Slices<M>, watch: Watch) -> Effort {
        let mut effort = Effort::default();
        let mut cursor = self.cursor();
        // Setpoints on one piece where v² is a cubic of the length: their indices, phases, and times since the start of the
        // phase.
        let mut moving: Vec<(usize, usize, f64)> = Vec::with_capacity(TIMES);
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
                let phase = cursor.find(&run.phases, time);
                let setpoint = (i, phase, time - self.starts[phase]);
                if self.phases.kind[phase] != PhaseLaw::SpeedCubic as u8 {
                    self.fill_alone(&mut part, setpoint, &mut cursor, &mut effort);
                    continue;
                }
                let is_on = |first: usize| self.phases.piece[first] == self.phases.piece[phase];
                if moving.len() == TIMES || moving.first().is_some_and(|&(_, first, _)| !is_on(first)) {
                    self.fill_at_once(&mut part, &moving, &mut cursor, &mut effort);
                    moving.clear();
                }
                moving.push(setpoint);
            }
            i = stop;
        }
        self.fill_at_once(&mut part, &moving, &mut cursor, &mut effort);
        effort
    }

    /// Computes one setpoint in motion.
    fn fill_alone(
        &self,
        part: &mut Slices<M>,
        (i, phase, t): (usize, usize, f64),
        cursor: &mut Cursor<'_, M>,
        effort: &mut Effort,
    ) {
        cursor.enter(phase);
        let state = cursor.motion().at_time(t, self.period);
        effort.raise(state.iterations, state.error * self.phases.duration[phase] / self.period);
        self.set(part, i, phase, cursor.motion(), &state);
    }

    /// Computes at most `TIMES` setpoints in motion on one piece.
    fn fill_at_once(
        &self,
        part: &mut Slices<M>,
        moving: &[(usize, usize, f64)],
        cursor: &mut Cursor<'_, M>,
        effort: &mut Effort,
    ) {
        let Some(&(_, first, _)) = moving.first() else { return };
        let mut times = [(self.phase(first), 0.0); TIMES];
        for (own, &(_, phase, t)) in times.iter_mut().zip(moving) {
            *own = (self.phase(phase), t);
        }
        let piece = cursor.piece(self.phases.piece[first]);
        let moments = Moments::new(&piece, &times[..moving.len()], self.period);
        for (lane, &setpoint) in moving.iter().enumerate() {
            let Some(moment) = moments.as_ref().and_then(|moments| moments.get(lane)) else {
                self.fill_alone(part, setpoint, cursor, effort);
                continue;
            };
            let (i, phase, _) = setpoint;
            effort.raise(moment.iterations, moment.error * self.phases.duration[phase] / self.period);
            self.set_sample(part, i, phase, moment.u, (moment.position, moment.rates));
        }
    }

    fn set(&self, part: &mut Slices<M>, i: usize, phase: usize, motion: &PhaseMotion<M>, state: &State) {
        self.set_sample(part, i, phase, state.u, motion.sample(state));
    }

    fn set_sample(
        &self,
        part: &mut Slices<M>,
        i: usize,
        phase: usize,
        u: f64,
        (position, Rates { velocity, acceleration, jerk }): ([f64; M], Rates<M>),
    ) {
        let piece = self.phases.piece[phase];
        part.position[i] = position;
        part.velocity[i] = velocity;
        part.acceleration[i] = acceleration;
        part.jerk[i] = jerk;
        part.line[i] = self.path.lines[piece as usize];
        part.piece[i] = piece;
        part.u[i] = u;
    }

    /// Speed, first phase and its motion at the start of the path; a speed of exactly 0 means rest.
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

    /// Sets the end of a run; `moving` where the path ends there at a speed above 0.
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
