//! Audits what a method that limits jerk says of the acceleration along the path, and its jumps where phases meet.
//!
//! Where the path's curvature jumps A does so too, however smooth v is. A third difference of setpoints that lies half-way
//! over such a step shows 3/4 of it over the period as a jerk: with more than the limit of that alone, setpoints break it.

use super::curve::Curves;
use super::phases::Phases;
use super::speed_by_length::Pace;
use super::station::Station;
use super::vectors::{distance, length};
use super::{Check, Limits, Tally, EPS, PASS_EXCESS, ROUNDINGS};

/// Pieces that meet at a smaller angle than this, in rad, meet without a corner.
const SMOOTH: f64 = 1e-9;

/// The greatest part of a step of the acceleration over a period that a third difference of setpoints shows.
const MOST_SHOWN: f64 = 0.75;

/// A path and the profile on it.
#[derive(Clone, Copy)]
pub struct Jerks<'a, const M: usize> {
    pub phases: &'a Phases<'a>,
    pub limits: &'a Limits<M>,
    pub starts: &'a [f64],
}

impl<const M: usize> Jerks<'_, M> {
    /// The recorded accelerations of phase `i` against its jerk, and whether a law limits its jerk at all.
    pub fn alone(&self, i: usize, width_rounding: f64, is_by_length: bool, line: i32, tally: &mut Tally<M>) {
        let (phases, limits, start) = (self.phases, self.limits, self.starts[i]);
        let error = phases.acceleration_error(i, width_rounding);
        // An error that builds up over the phase is that much jerk.
        let negligible = self.negligible(phases.duration[i]);
        tally.offer(Check::AccelerationContinuity, 0, error, negligible, start, line);
        for k in (0..limits.axes).filter(|&k| !is_by_length && limits.jerk[k].is_finite()) {
            tally.offer(Check::Jerk, k, f64::INFINITY, limits.jerk[k], start, line);
        }
    }

    /// The acceleration at the start or the end of a run at rest.
    pub fn rest(&self, i: usize, at_end: bool, line: i32, tally: &mut Tally<M>) {
        let a = self.phases.end_acceleration(i, at_end).map_or(0.0, f64::abs);
        let time = self.starts[i] + if at_end { self.phases.duration[i] } else { 0.0 };
        tally.offer(Check::AccelerationContinuity, 0, a, self.negligible(0.0), time, line);
    }

    /// The step of the acceleration from phase `i` to phase `j`, the next one in its run.
    pub fn joint(&self, i: usize, j: usize, curves: &mut Curves<M>, line: i32, tally: &mut Tally<M>) {
        let (phases, time) = (self.phases, self.starts[j]);
        let (Some(before), Some(after)) =
            (phases.end_acceleration(i, true), phases.end_acceleration(j, false))
        else {
            return; // said of the phase itself
        };
        if phases.p1[i] == 0.0 && phases.p0[j] == 0.0 {
            self.at_rest([i, j], [before, after], curves, line, tally);
            return;
        }
        let change = (after - before).abs() - ROUNDINGS * EPS * (after.abs() + before.abs());
        tally.offer(Check::AccelerationContinuity, 0, change, self.negligible(0.0), time, line);
        if let Some(step) = self.step(i, j, curves) {
            for k in 0..self.limits.axes {
                let limit = self.limits.jerk[k] * self.limits.period / MOST_SHOWN;
                tally.offer(Check::AccelerationJump, k, step[k], limit, time, line);
            }
        }
    }

    /// The step of the acceleration where the tool rests between two phases. It goes on only where the path turns back along
    /// the line that it came on.
    fn at_rest(
        &self,
        [i, j]: [usize; 2],
        along: [f64; 2],
        curves: &mut Curves<M>,
        line: i32,
        tally: &mut Tally<M>,
    ) {
        let (phases, time) = (self.phases, self.starts[j]);
        let ends = [(i, phases.u1[i]), (j, phases.u0[j])];
        let axes: [[f64; M]; 2] = [0, 1].map(|side| {
            let (phase, u) = ends[side];
            let (tangent, a) = (curves.get(phases.piece[phase] as usize).derivative(u), along[side]);
            let size = length(&tangent);
            tangent.map(|x| if a == 0.0 { 0.0 } else { x / size * a })
        });
        for k in 0..self.limits.axes {
            let step = (axes[1][k] - axes[0][k]).abs();
            let rounding = ROUNDINGS * EPS * (axes[1][k].abs() + axes[0][k].abs());
            let step = if step.is_nan() { f64::INFINITY } else { step - rounding };
            let negligible = PASS_EXCESS * self.limits.jerk[k] * self.limits.period;
            tally.offer(Check::AccelerationContinuity, 0, step, negligible, time, line);
        }
    }

    /// By how much the acceleration of each axis jumps from phase `i` to phase `j`, less what may be rounding. None within a
    /// piece, at corners, where the velocities jump, and where the path has no direction.
    fn step(&self, i: usize, j: usize, curves: &mut Curves<M>) -> Option<[f64; M]> {
        let phases = self.phases;
        let pieces = [i, j].map(|phase| phases.piece[phase] as usize);
        if pieces[0] == pieces[1] {
            return None;
        }
        let curves = pieces.map(|piece| curves.get(piece).clone());
        let u = [phases.u1[i], phases.u0[j]];
        let directions = [0, 1].map(|side| {
            let tangent = curves[side].derivative(u[side]);
            let size = length(&tangent);
            tangent.map(|x| x / size)
        });
        if distance(&directions[0], &directions[1]).is_nan()
            || distance(&directions[0], &directions[1]) > SMOOTH
        {
            return None;
        }
        let side = |side: usize| {
            let (phase, at_end, p) =
                if side == 0 { (i, true, phases.p1[i]) } else { (j, false, phases.p0[j]) };
            let v = length(&curves[side].derivative(u[side])) * p.sqrt();
            let pace = Pace { v, a: phases.end_acceleration(phase, at_end)?, j: 0.0 };
            Station::new(&curves[side], u[side]).map(|station| station.acceleration(pace))
        };
        let (before, after) = (side(0)?, side(1)?);
        Some(std::array::from_fn(|k| {
            (after.value[k] - before.value[k]).abs() - after.rounding[k] - before.rounding[k]
        }))
    }

    /// A change of the acceleration over a time that means nothing to any axis: in that time, or in a servo period if that
    /// is longer, it adds no more than the pass mark to the jerk.
    pub fn negligible(&self, time: f64) -> f64 {
        let least = self.limits.jerk[..self.limits.axes].iter().fold(f64::INFINITY, |least, &j| least.min(j));
        PASS_EXCESS * least * time.max(self.limits.period)
    }
}
