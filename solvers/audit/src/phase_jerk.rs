//! Audits the accelerations along the path that a plan with limited jerk records, and their jumps where phases meet; for axes,
//! and for joints along the path of the tool.
//!
//! Where the path's curvature jumps, the acceleration does so too, however smooth v is. A third difference of setpoints whose
//! middle is at such a jump shows 3/4 of it over the period as a jerk: if this alone is above the limit, the setpoints break it.

use super::columns::Columns;
use super::phases::Phases;
use super::speed_by_length::Pace;
use super::station::Station;
use super::vectors::{distance, length};
use super::{Check, Limits, Tally, EPS, PASS_EXCESS, ROUNDINGS};

/// The greatest part of a jump of the acceleration, over a period, that a third difference of setpoints shows.
const MOST_SHOWN: f64 = 0.75;

/// A path and the profile on it.
#[derive(Clone, Copy)]
pub struct Jerks<'a, const M: usize> {
    pub phases: &'a Phases<'a>,
    pub limits: &'a Limits<M>,
    pub starts: &'a [f64],
    /// Pieces that meet at a smaller angle than this, in rad, meet without a corner.
    pub smooth: f64,
}

impl<const M: usize> Jerks<'_, M> {
    /// Checks the recorded accelerations of phase `i` against its jerk. A phase whose law does not limit the jerk breaks all jerk
    /// limits.
    pub fn alone(&self, i: usize, width_rounding: f64, is_by_length: bool, line: i32, tally: &mut Tally<M>) {
        let (phases, limits, start) = (self.phases, self.limits, self.starts[i]);
        let error = phases.acceleration_error(i, width_rounding);
        // Spread over the phase, the error is a jerk of that size over the duration.
        let negligible = self.negligible(phases.duration[i]);
        tally.offer(Check::AccelerationContinuity, 0, error, negligible, start, line);
        for k in (0..limits.axes).filter(|&k| !is_by_length && limits.jerk[k].is_finite()) {
            tally.offer(Check::Jerk, k, f64::INFINITY, limits.jerk[k], start, line);
        }
    }

    /// Checks that the acceleration is 0 at the start or the end of a run at rest.
    pub fn rest(&self, i: usize, at_end: bool, line: i32, tally: &mut Tally<M>) {
        let a = self.phases.end_acceleration(i, at_end).map_or(0.0, f64::abs);
        let time = self.starts[i] + if at_end { self.phases.duration[i] } else { 0.0 };
        tally.offer(Check::AccelerationContinuity, 0, a, self.negligible(0.0), time, line);
    }

    /// Checks the jump of the acceleration from phase `i` to phase `j`, the next one in its run.
    pub fn joint(&self, [i, j]: [usize; 2], columns: &mut Columns<M>, line: i32, tally: &mut Tally<M>) {
        let (phases, limits, time) = (self.phases, self.limits, self.starts[j]);
        let (Some(before), Some(after)) =
            (phases.end_acceleration(i, true), phases.end_acceleration(j, false))
        else {
            return; // reported with the phase itself
        };
        let rests = phases.p1[i] == 0.0 && phases.p0[j] == 0.0;
        if !rests {
            let change = (after - before).abs() - ROUNDINGS * EPS * (after.abs() + before.abs());
            if !(change <= 0.0 && tally.is_measured(Check::AccelerationContinuity, 0)) {
                tally.offer(Check::AccelerationContinuity, 0, change, self.negligible(0.0), time, line);
            }
        }
        let pieces = [i, j].map(|phase| phases.piece[phase] as usize);
        if if rests { before == 0.0 && after == 0.0 } else { pieces[0] == pieces[1] } {
            return;
        }
        let ends = [(pieces[0], phases.u1[i]), (pieces[1], phases.u0[j])]
            .map(|(piece, u)| columns.rounded_station(piece, u));
        let [Some((from, from_roundings)), Some((to, to_roundings))] = ends else {
            // Without a direction of the path the accelerations are not known: at rest that counts as a jump.
            for k in (0..limits.axes).filter(|_| rests) {
                tally.offer(Check::AccelerationContinuity, k, f64::INFINITY, limits.jerk[k], time, line);
            }
            return;
        };
        let is_corner = || {
            let directions = [&from, &to].map(|at| at.first.map(|x| x / length(&at.first)));
            let turn = distance(&directions[0], &directions[1]);
            turn.is_nan() || turn > self.smooth
        };
        // At a corner the velocities jump as well. At rest an acceleration can go on only where the path turns back along the
        // same line.
        if !rests && is_corner() {
            return;
        }
        let pace = |at: &Station<M>, p: f64, a: f64| Pace { v: at.slope * p.sqrt(), a, j: 0.0 };
        let (before, after) = (pace(&from, phases.p1[i], before), pace(&to, phases.p0[j], after));
        let [a, b] = [from.acceleration(before), to.acceleration(after)];
        let roundings = [from_roundings.acceleration(before), to_roundings.acceleration(after)];
        for k in 0..limits.axes {
            let step = (b[k] - a[k]).abs() - roundings[1][k] - roundings[0][k];
            let (check, limit) = if rests {
                (Check::AccelerationContinuity, PASS_EXCESS * limits.jerk[k] * limits.period)
            } else {
                (Check::AccelerationJump, limits.jerk[k] * limits.period / MOST_SHOWN)
            };
            tally.offer(check, k, step, limit, time, line);
        }
    }

    /// The greatest change of the acceleration over a time that is negligible for all axes, in mm/s²: over that time, or over a
    /// servo period if that is longer, it adds no more than `PASS_EXCESS` of the jerk limit.
    fn negligible(&self, time: f64) -> f64 {
        let least = self.limits.jerk[..self.limits.axes].iter().fold(f64::INFINITY, |least, &j| least.min(j));
        PASS_EXCESS * least * time.max(self.limits.period)
    }
}
