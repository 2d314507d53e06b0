//! The times of setpoints: every run starts on a setpoint, and takes whole periods together with the pause after it.

use std::sync::Arc;

use super::check::check;
use super::{PathData, Run, Sampler, STANDSTILL};
use feedplan_geometry::quadratic::norm;
use feedplan_geometry::watch::Watch;
use feedplan_planner::phases::Phases;

/// Greatest number of setpoints.
pub const MAX_COUNT: f64 = 2e9;

/// A run that ends less than this share of a period after a setpoint ends on that setpoint.
const SLACK: f64 = 1e-9;

impl<const M: usize> Sampler<M> {
    /// Computes the times of the setpoints. `phase_runs` are the phase offsets of the runs. The error is a sentence for the user.
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
}

/// Number of whole periods that a time takes, as f64 so that a huge number does not overflow.
fn periods_of(time: f64, period: f64) -> f64 {
    let exact = time / period;
    match time > 0.0 {
        true => (exact * (1.0 - 4.0 * f64::EPSILON) - SLACK).ceil().max(1.0),
        false => 0.0,
    }
}
