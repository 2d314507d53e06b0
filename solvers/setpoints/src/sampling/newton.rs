//! The Newton–Raphson interpolator (Zhang et al. 2010, section 4.2, corrected): each setpoint from the one before, by a step
//! computed from speed, acceleration and jerk.

use super::chunk::Slices;
use super::{Effort, Resume, Sampler};
use crate::phase_motion::{PhaseMotion, Rates};
use feedplan_geometry::quadratic::{dot, norm};
use feedplan_geometry::watch::Watch;

/// A speed below this share of the speed gained in a step counts as rest.
const REST: f64 = 1e-9;

/// Limit of the Newton–Raphson steps before bisection; two or three are usual.
const MAX_REPEATS: u32 = 20;

impl<const M: usize> Sampler<M> {
    /// Computes the setpoints of a part of one run. The step v·T of the paper is of first order and does not leave rest. Here the
    /// step is of third order, on the phase on which it ends, and is repeated with the time that the profile still needs from the
    /// place reached. So errors do not accumulate, and every run ends on time.
    pub(super) fn fill_by_steps(
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
        let mut cursor = self.cursor();
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
            cursor.begin_at(at.phase);
            let phase = cursor.seek(&run.phases, time);
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

    /// Moves u to the place at `time` on the phase. Returns the number of Newton–Raphson rounds and the remaining length error,
    /// as a share of the step.
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
                // The step over the whole period may have begun on an earlier phase.
                whole = step_length(&rates, self.period).max(step.abs());
            }
            if left > 0.0 {
                low = low.max(*u);
            } else {
                high = high.min(*u);
            }
            let middle = 0.5 * (low + high);
            // Where an axis reverses, the derivatives of the speed may be mostly rounding: the step from the speed alone must be
            // small as well.
            let off = step.abs().max(0.5 * left.abs() * norm(&rates.velocity));
            if off <= allowed * whole + 2.0 * rounding || !(low < middle && middle < high) {
                let error = if whole > 0.0 { (step.abs() + table_error) / whole } else { 0.0 };
                return (rounds, error);
            }
            let tolerance = 0.1 * allowed * whole + rounding;
            let located = motion.path().advance(*u, step, tolerance);
            rounds += located.iterations;
            // With a large period the third-order step may be too inaccurate.
            let usable = low < located.u && located.u < high && repeat < MAX_REPEATS;
            *u = if usable { located.u } else { middle };
        }
        unreachable!("halving comes to an end")
    }
}

/// Length of the step over `time`: v t + a t²/2 + j t³/6 with v and its first derivatives; if a < 0, at most up to the
/// standstill.
fn step_length<const M: usize>(rates: &Rates<M>, time: f64) -> f64 {
    let Rates { velocity, acceleration, jerk } = rates;
    let v = norm(velocity);
    let (pull, push) = (norm(acceleration), norm(jerk));
    // A velocity that is only rounding beside what acceleration and jerk add has no meaningful direction.
    if v <= REST * (pull + 0.5 * push * time.abs()) * time.abs() {
        // The motion leaves the standstill both forwards and backwards in time, in the direction of the acceleration or, if that
        // is negligible, of the jerk.
        let push = if pull <= REST * push * time.abs() { push } else { dot(acceleration, jerk) / pull };
        return time * time.abs() * (0.5 * pull + time.abs() * push / 6.0);
    }
    let a = dot(velocity, acceleration) / v;
    let across: [f64; M] = std::array::from_fn(|k| acceleration[k] - a * velocity[k] / v);
    let j = (dot(velocity, jerk) + dot(&across, &across)) / v;
    // The time at which v + a t + j t²/2 vanishes; NaN if it does not, which `min` ignores.
    let time = if a < 0.0 { time.min(2.0 * v / ((a * a - 2.0 * v * j).sqrt() - a)) } else { time };
    time * (v + time * (0.5 * a + time * j / 6.0))
}
