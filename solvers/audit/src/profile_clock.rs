//! Finds the phase of a speed profile in which the setpoints are at a given time.
//!
//! The clock is set anew at the start of every run, since setpoints may wait at a stop for their next period.

use super::curve::Followed;
use super::nearest::Place;
use super::phases::Phases;
use super::rows::Row;
use super::{EPS, GAP_TOLERANCE, PASS_EXCESS, ROUNDINGS};

/// Number of phases that are tried one after the other for a later time, before a binary search.
const NEXT: usize = 8;

/// A profile with valid numbers, on the clock of the setpoints.
#[derive(Clone, Copy)]
pub struct ProfileClock<'a> {
    pub phases: Phases<'a>,
    /// Start of each phase and end of the last one on the clock of the profile, in s, pauses included; see `Phases::starts`.
    pub starts: &'a [f64],
    /// Starts of the runs on the clock of the setpoints, in s, as far as the setpoints have shown them: a stream may wait at a
    /// stop for its next period.
    pub run_starts: &'a [f64],
}

impl ProfileClock<'_> {
    pub fn phases_of(&self, run: usize) -> std::ops::Range<usize> {
        self.phases.runs[run] as usize..self.phases.runs[run + 1] as usize
    }

    /// Time in motion of a run, in s.
    pub fn motion_time(&self, run: usize) -> f64 {
        self.phases_of(run).last().map_or(0.0, |last| {
            self.starts[last] + self.phases.duration[last] - self.starts[self.phases_of(run).start]
        })
    }

    /// What to add to the times of the profile in a run to get those of the setpoints, in s; infinite where the start of the run
    /// is not known yet.
    pub fn shift(&self, run: usize) -> f64 {
        self.run_starts.get(run).map_or(f64::INFINITY, |start| start - self.starts[self.phases_of(run).start])
    }

    /// The run that `time` falls into.
    pub fn run_of(&self, time: f64) -> usize {
        self.run_starts.partition_point(|&start| start <= time).saturating_sub(1)
    }

    /// The phase of a run that `time` falls into, and the time since it began, in s; the first phase for earlier times (then that
    /// time is negative). None for a run without phases.
    pub fn phase_of(&self, run: usize, time: f64) -> Option<(usize, f64)> {
        let (phases, time) = (self.phases_of(run), time - self.shift(run));
        let passed = self.starts[phases.clone()].partition_point(|&start| start <= time);
        let phase = phases.start + passed.saturating_sub(1);
        (!phases.is_empty()).then(|| (phase, time - self.starts[phase]))
    }

    /// The phase that `time` falls into, searched forwards from the phase `from`.
    pub fn phase_from(&self, from: usize, time: f64) -> Option<usize> {
        let run = self.run_of(time);
        let (here, since) = (self.phases_of(run), time - self.shift(run));
        let has_begun = |phase: usize| here.contains(&phase) && self.starts[phase] <= since;
        let near = from..if has_begun(from) { from + NEXT } else { from };
        let found = near.into_iter().find(|&phase| !has_begun(phase + 1));
        found.or_else(|| self.phase_of(run, time).map(|(phase, _)| phase))
    }

    /// Approximate place of the profile at `time` on this phase: u as the cubic of the time that has the positions and speeds of
    /// both ends.
    pub fn place_about(&self, phase: usize, time: f64) -> Place {
        let phases = &self.phases;
        let since = time - self.shift(self.run_of(time)) - self.starts[phase];
        let (width, duration) = (phases.u1[phase] - phases.u0[phase], phases.duration[phase]);
        let x = (since / duration).clamp(0.0, 1.0);
        let speeds = [phases.p0[phase].sqrt(), phases.p1[phase].sqrt()].map(|speed| speed * duration);
        let (bend, rest) = (3.0 * width - 2.0 * speeds[0] - speeds[1], speeds[0] + speeds[1] - 2.0 * width);
        let u = phases.u0[phase] + x * (speeds[0] + x * (bend + x * rest));
        Place { piece: phases.piece[phase] as usize, u }
    }

    /// The start of the phase that `time` falls into.
    pub fn place_before(&self, path: &Followed, time: f64) -> Place {
        let run = self.run_of(time);
        match self.phase_of(run, time) {
            Some((phase, _)) => Place { piece: self.phases.piece[phase] as usize, u: self.phases.u0[phase] },
            None => Place { piece: (path.runs[run] as usize).min(path.len() - 1), u: 0.0 },
        }
    }

    /// Adds to `clock` the starts of the runs that the setpoints reach. A run starts when the pause before it is over, or at the
    /// next setpoint after that if it still stands on the stop. `away` gives the distance of a setpoint from the stop before a
    /// run, less rounding, in mm.
    pub fn extend<const M: usize>(
        &self,
        path: &Followed,
        period: f64,
        rows: &[Row<M>],
        mut away: impl FnMut(usize, &Row<M>) -> f64,
        clock: &mut Vec<f64>,
    ) {
        while clock.len() + 1 < self.phases.runs.len() {
            let run = clock.len();
            let due = match run.checked_sub(1) {
                None => path.start_dwell,
                Some(before) => clock[before] + self.motion_time(before) + path.dwell[before],
            };
            let slack = PASS_EXCESS * period + ROUNDINGS * EPS * due;
            let next = rows.partition_point(|row| row.t < due - slack);
            let on_time = |row: &Row<M>| row.t <= due + slack;
            clock.push(match &rows[next..] {
                [] => break,
                // At the end of the pause: only the next row shows whether the stream moves on or waits.
                [row] if on_time(row) => break,
                [row, rest @ ..] => {
                    let (here, later) = (away(run, row), rest.first().filter(|_| on_time(row)));
                    // A run may begin slowly. The stream waits, or has not quite arrived, as long as it does not move away from
                    // the stop.
                    match later.map(|later| (later, away(run, later))) {
                        Some((later, there)) if there <= GAP_TOLERANCE && there <= here => later.t,
                        _ if here <= GAP_TOLERANCE => row.t,
                        _ => due,
                    }
                }
            });
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::phases::PARAMETER_ACCELERATION;

    #[test]
    fn at_constant_acceleration_the_profile_is_where_it_is_about() {
        // u̇ from 1 to 3 mm/s in 2 s, from the tenth second of the setpoints on.
        let phases = Phases::of_one(&[PARAMETER_ACCELERATION], &[255], &[1.0], &[0.0, 4.0], &[1.0, 9.0]);
        let phases = Phases { duration: &[2.0], ..phases };
        let clock = ProfileClock { phases, starts: &[0.0, 2.0], run_starts: &[10.0] };
        for from in [0, 7] {
            for (time, u) in [(9.0, 0.0), (10.0, 0.0), (11.0, 1.5), (12.0, 4.0), (13.0, 4.0)] {
                assert_eq!(clock.phase_from(from, time), Some(0));
                assert_eq!(clock.place_about(0, time), Place { piece: 0, u });
            }
        }
    }
}
