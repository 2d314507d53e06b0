//! The kernel of straight pieces, which have degree 1: |C'| is constant, the acceleration along the line too, so that v² is
//! linear in the length and the motion is a trapezoid.

use super::quadratic::Axes;
use crate::arc_kind::ArcKind;
use crate::bang_bang::tolerance::NO_PART;
use crate::profile::{Profile, Row, NO_AXIS};
use feedplan_geometry::quadratic::norm;

/// A straight piece with its limits.
pub struct Line {
    length: f64,
    /// Greatest acceleration along the line, the axis that sets it, and that axis's acceleration with its sign.
    acceleration: f64,
    axis: usize,
    signed: f64,
    /// Square of the greatest speed, and the axis that sets it with the square of its velocity limit, None for the feed.
    speed_sq: f64,
    speed_axis: Option<(usize, f64)>,
}

impl Line {
    /// From its start to its end, `way` apart.
    #[inline(always)]
    pub fn new<const M: usize>(way: &[f64; M], axes: &Axes<M>, feed: f64) -> Self {
        let length = norm(way);
        let mut slowest = (0.0, 0);
        let (mut speed_sq, mut speed_axis) = (feed * feed, None);
        for k in 0..M {
            let component = way[k].abs() / length;
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
        let signed = axes.acceleration[axis].copysign(way[axis]);
        Self { length, acceleration: 1.0 / need, axis, signed, speed_sq, speed_axis }
    }

    /// Backward: the greatest v² at the start from which `speed_sq` at the end can be met.
    #[inline(always)]
    pub fn backward(&self, speed_sq: f64) -> f64 {
        self.speed_sq.min(speed_sq + 2.0 * self.acceleration * self.length)
    }

    /// Forward from `start_sq`, at the end not above `end_sq`: appends the phases and returns v² at the end.
    /// `start_sq` is at most what `backward` gave for `end_sq`.
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
        let mut from = Place { t: 0.0, speed_sq: start_sq };
        let mut push = |to: Place, way: f64, motion: Motion| {
            self.push(from, to, way, motion, (number, width), out);
            from = to;
        };
        // Too short to reach the speed asked for at the end.
        if start_sq + gain <= end_sq {
            push(Place { t: 1.0, speed_sq: start_sq + gain }, length, Motion::SpeedUp);
            return start_sq + gain;
        }
        let peak_sq = (0.5 * (start_sq + end_sq + gain)).min(top_sq);
        let (up, down) = ((peak_sq - start_sq) / (2.0 * a), (peak_sq - end_sq) / (2.0 * a));
        // Nothing between the two in a triangle.
        let cruise = if peak_sq < top_sq { 0.0 } else { (length - up - down).max(0.0) };
        // From the nearer end, for the digits. Next to the end even the shortest ramp is rounding.
        let place = |before: f64, after: f64| {
            let t = if after <= NO_PART * length {
                1.0
            } else if before <= after {
                before / length
            } else {
                1.0 - after / length
            };
            Place { t: t.clamp(0.0, 1.0), speed_sq: peak_sq }
        };
        // Next to the start a place shows the shortest ramp that is more than rounding of v².
        let is_ramp = peak_sq - start_sq > NO_PART * peak_sq;
        let top = if is_ramp { place(up, cruise + down) } else { Place { t: 0.0, speed_sq: peak_sq } };
        push(top, up, Motion::SpeedUp);
        if cruise > 0.0 {
            push(place(up + cruise, down), cruise, Motion::Cruise);
        }
        push(Place { t: 1.0, speed_sq: end_sq }, down, Motion::SlowDown);
        end_sq
    }

    /// Appends a phase of this length.
    #[inline(always)]
    fn push(
        &self,
        from: Place,
        to: Place,
        way: f64,
        motion: Motion,
        (number, width): (u32, f64),
        out: &mut Profile,
    ) {
        // A ramp too short for its places to show it still says how fast the end is.
        let slows_down = matches!(motion, Motion::SlowDown) && to.speed_sq < from.speed_sq;
        if to.t <= from.t && !slows_down {
            return;
        }
        let (kind, axis, value) = match (motion, self.speed_axis) {
            (Motion::SpeedUp, _) => (ArcKind::AxisAcceleration, self.axis as u8, self.signed),
            (Motion::SlowDown, _) => (ArcKind::AxisAcceleration, self.axis as u8, -self.signed),
            (Motion::Cruise, None) => (ArcKind::Feed, NO_AXIS, self.speed_sq),
            (Motion::Cruise, Some((axis, speed_sq))) => (ArcKind::AxisVelocity, axis as u8, speed_sq),
        };
        let duration = 2.0 * way / (from.speed_sq.sqrt() + to.speed_sq.sqrt());
        let p = [from, to].map(|place| place.speed_sq / (self.length * self.length));
        out.push(number, width, Row { kind, axis, value, t: to.t, p, duration, joins: true });
    }
}

/// A place on the line: t and v² there.
#[derive(Clone, Copy)]
struct Place {
    t: f64,
    speed_sq: f64,
}

/// What the tool does in a phase.
#[derive(Clone, Copy)]
enum Motion {
    SpeedUp,
    Cruise,
    SlowDown,
}
