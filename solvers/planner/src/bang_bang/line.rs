//! The kernel `line`: computes the fastest profile of straight pieces (degree 1) from the length, the feed and the limits of the
//! axes. |C'| and the greatest acceleration along the line are constant, so v² is linear in the length: a trapezoid.

use super::quadratic::Axes;
use crate::bang_bang::tolerance::NEGLIGIBLE;
use crate::phase_law::PhaseLaw;
use crate::phases::NO_AXIS;
use crate::profile::{Profile, Row};
use feedplan_geometry::quadratic::norm;

/// A straight piece with its limits.
pub struct Line {
    length: f64,
    /// Greatest acceleration along the line [mm/s²], the axis that limits it, and the acceleration of that axis with its sign.
    acceleration: f64,
    axis: usize,
    signed: f64,
    /// Square of the greatest speed [mm²/s²]; the axis that limits it and the square of its velocity limit, or None if the feed
    /// limits it.
    speed_sq: f64,
    speed_axis: Option<(usize, f64)>,
}

impl Line {
    /// `chord` leads from the start of the line to its end.
    #[inline(always)]
    pub fn new<const M: usize>(chord: &[f64; M], axes: &Axes<M>, feed: f64) -> Self {
        let length = norm(chord);
        let mut slowest = (0.0, 0);
        let (mut speed_sq, mut speed_axis) = (feed * feed, None);
        for k in 0..M {
            let component = chord[k].abs() / length;
            let need = component * axes.inverse[k];
            if need > slowest.0 {
                slowest = (need, k);
            }
            if component * component * speed_sq > axes.velocity_sq[k] {
                speed_sq = axes.velocity_sq[k] / (component * component);
                speed_axis = Some((k, axes.velocity_sq[k]));
            }
        }
        let (need, axis) = slowest;
        let signed = axes.acceleration[axis].copysign(chord[axis]);
        Self { length, acceleration: 1.0 / need, axis, signed, speed_sq, speed_axis }
    }

    /// Backward: the greatest v² at the start from which `speed_sq` at the end can be reached.
    #[inline(always)]
    pub fn backward(&self, speed_sq: f64) -> f64 {
        self.speed_sq.min(speed_sq + 2.0 * self.acceleration * self.length)
    }

    /// Forward from `start_sq` to at most `end_sq`: appends the phases and returns v² at the end. `start_sq` is at
    /// most what `backward` returned for `end_sq`.
    #[inline(always)]
    pub fn forward(
        &self,
        (start_sq, end_sq): (f64, f64),
        (number, width): (u32, f64),
        out: &mut Profile,
    ) -> f64 {
        let (a, length, top_sq) = (self.acceleration, self.length, self.speed_sq);
        let gain = 2.0 * a * length;
        let end_sq = end_sq.min(top_sq);
        let start_sq = start_sq.min(top_sq.min(end_sq + gain));
        let mut from = State { t: 0.0, speed_sq: start_sq };
        let mut push = |to: State, distance: f64, motion: Motion| {
            self.push(from, to, distance, motion, (number, width), out);
            from = to;
        };
        // The line is too short to reach the requested end speed.
        if start_sq + gain <= end_sq {
            push(State { t: 1.0, speed_sq: start_sq + gain }, length, Motion::SpeedUp);
            return start_sq + gain;
        }
        let peak_sq = (0.5 * (start_sq + end_sq + gain)).min(top_sq);
        let (up, down) = ((peak_sq - start_sq) / (2.0 * a), (peak_sq - end_sq) / (2.0 * a));
        // A triangle has no cruise.
        let cruise = if peak_sq < top_sq { 0.0 } else { (length - up - down).max(0.0) };
        // t is computed from the nearer end to keep its digits. Next to t = 1 the shortest ramps are rounding.
        let state = |before: f64, after: f64| {
            let t = if after <= NEGLIGIBLE * length {
                1.0
            } else if before <= after {
                before / length
            } else {
                1.0 - after / length
            };
            State { t: t.clamp(0.0, 1.0), speed_sq: peak_sq }
        };
        // Next to t = 0, t resolves every ramp that changes v² by more than rounding.
        let is_ramp = peak_sq - start_sq > NEGLIGIBLE * peak_sq;
        let top = if is_ramp { state(up, cruise + down) } else { State { t: 0.0, speed_sq: peak_sq } };
        push(top, up, Motion::SpeedUp);
        if cruise > 0.0 {
            push(state(up + cruise, down), cruise, Motion::Cruise);
        }
        push(State { t: 1.0, speed_sq: end_sq }, down, Motion::SlowDown);
        end_sq
    }

    /// Appends a phase of length `distance` [mm].
    #[inline(always)]
    fn push(
        &self,
        from: State,
        to: State,
        distance: f64,
        motion: Motion,
        (number, width): (u32, f64),
        out: &mut Profile,
    ) {
        // A braking ramp too short to change t still sets the end speed.
        let slows_down = matches!(motion, Motion::SlowDown) && to.speed_sq < from.speed_sq;
        if to.t <= from.t && !slows_down {
            return;
        }
        let (law, axis, value) = match (motion, self.speed_axis) {
            (Motion::SpeedUp, _) => (PhaseLaw::AxisAcceleration, self.axis as u8, self.signed),
            (Motion::SlowDown, _) => (PhaseLaw::AxisAcceleration, self.axis as u8, -self.signed),
            (Motion::Cruise, None) => (PhaseLaw::Feed, NO_AXIS, self.speed_sq),
            (Motion::Cruise, Some((axis, speed_sq))) => (PhaseLaw::AxisVelocity, axis as u8, speed_sq),
        };
        let duration = 2.0 * distance / (from.speed_sq.sqrt() + to.speed_sq.sqrt());
        let p = [from, to].map(|state| state.speed_sq / (self.length * self.length));
        out.push(number, width, Row { law, axis, value, t: to.t, p, duration, joins: true });
    }
}

/// t and v² at a point of the line.
#[derive(Clone, Copy)]
struct State {
    t: f64,
    speed_sq: f64,
}

#[derive(Clone, Copy)]
enum Motion {
    SpeedUp,
    Cruise,
    SlowDown,
}
