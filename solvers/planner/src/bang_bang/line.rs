//! Both passes over a straight piece, by its length: the acceleration along it is constant, so v² is linear.
//!
//! However the piece is parametrised, even with a cusp C' = 0 at an end, the motion is the textbook trapezoid. Only
//! where the tangent reverses does it stop.

use super::quadratic::{Axes, Piece};
use crate::arc_kind::ArcKind;
use crate::profile::{Profile, Row, NO_AXIS};
use feedplan_geometry::quadratic::norm;

/// A shorter part of the length, or of v², than this is rounding.
const NO_PART: f64 = 1e-15;

/// A straight piece: C' = direction · r(t), r linear; where r changes sign the motion turns back.
pub struct Line {
    /// |r| at t = 0 and t = 1
    pub rate: [f64; 2],
    /// Where the motion turns back, if it does.
    pub turn: Option<f64>,
    /// Greatest acceleration along the line and the axis that sets it.
    pub acceleration: f64,
    pub axis: usize,
    /// Sign of that axis's tangent before and after the turn.
    pub sign: [f64; 2],
    /// Square of the greatest speed, and the axis that sets it, None for the feed.
    pub speed_sq: f64,
    pub speed_axis: Option<usize>,
    /// Square of that axis's velocity limit.
    pub axis_speed_sq: f64,
}

impl Line {
    #[inline(always)]
    /// The piece under this feed, None if it is curved.
    pub fn of<const M: usize>(piece: &Piece<M>, axes: &Axes<M>, feed: f64) -> Option<Self> {
        if !piece.is_straight(feed, axes.least) {
            return None;
        }
        let turns = piece.speed[1] < 0.0;
        let (left, right) = (&piece.left, &piece.right);
        // The difference of the ends is the direction after the turn, their sum the common direction without one.
        let sum: [f64; M] =
            std::array::from_fn(|k| if turns { right[k] - left[k] } else { right[k] + left[k] });
        let length = norm(&sum);
        let mut slowest = (0.0, 0);
        let (mut speed_sq, mut speed_axis) = (feed * feed, None);
        for k in 0..M {
            let component = sum[k].abs() / length;
            let need = component * axes.inverse[k];
            if need > slowest.0 {
                slowest = (need, k);
            }
            if component * component * speed_sq > axes.velocity_sq[k] {
                speed_sq = axes.velocity_sq[k] / (component * component);
                speed_axis = Some(k);
            }
        }
        let rate = [piece.speed[0].sqrt(), piece.speed[2].sqrt()];
        let sign = if sum[slowest.1] < 0.0 { -1.0 } else { 1.0 };
        Some(Self {
            rate,
            turn: turns.then(|| rate[0] / (rate[0] + rate[1])),
            acceleration: 1.0 / slowest.0,
            axis: slowest.1,
            sign: [if turns { -sign } else { sign }, sign],
            speed_sq,
            speed_axis,
            axis_speed_sq: speed_axis.map_or(0.0, |k| axes.velocity_sq[k]),
        })
    }
}

/// Backward: the greatest v² at the start from which `speed_sq` at the end can be met.
#[inline(always)]
pub fn backward(line: &Line, speed_sq: f64) -> f64 {
    let over = |length: f64, speed_sq: f64| line.speed_sq.min(speed_sq + 2.0 * line.acceleration * length);
    match line.turn {
        None => over(0.5 * (line.rate[0] + line.rate[1]), speed_sq),
        Some(turn) => over(0.5 * line.rate[0] * turn, 0.0),
    }
}

/// Forward from `start_sq`, at the end not above `end_sq`: appends the arcs and returns v² at the end.
/// `start_sq` is at most what `backward` gave for `end_sq`.
#[inline(always)]
pub fn forward<const M: usize>(
    line: &Line,
    axes: &Axes<M>,
    (start_sq, end_sq): (f64, f64),
    (number, width): (u32, f64),
    out: &mut Profile,
) -> f64 {
    let end_sq = end_sq.min(line.speed_sq);
    let [r0, r1] = line.rate;
    let mut over = |t: [f64; 2], span: f64, rate: [f64; 2], sign: f64, start_sq: f64, end_sq: f64| {
        let signed = sign * axes.acceleration[line.axis];
        Stretch { line, t, span, rate, signed, number, width }.forward(start_sq, end_sq, out)
    };
    match line.turn {
        None => over([0.0, 1.0], 1.0, line.rate, line.sign[0], start_sq, end_sq),
        Some(turn) => {
            over([0.0, turn], turn, [r0, 0.0], line.sign[0], start_sq, 0.0);
            over([turn, 1.0], r1 / (r0 + r1), [0.0, r1], line.sign[1], 0.0, end_sq)
        }
    }
}

/// A part of a straight piece on which the motion does not turn back.
struct Stretch<'a> {
    line: &'a Line,
    t: [f64; 2],
    /// t[1] − t[0], with all its digits
    span: f64,
    /// |C'| at its ends
    rate: [f64; 2],
    /// The acceleration of the limiting axis when the path speeds up.
    signed: f64,
    number: u32,
    width: f64,
}

/// A place on a stretch: t, |C'| and v² there.
#[derive(Clone, Copy)]
struct Place {
    t: f64,
    rate: f64,
    speed_sq: f64,
}

impl Stretch<'_> {
    #[inline(always)]
    fn forward(&self, start_sq: f64, end_sq: f64, out: &mut Profile) -> f64 {
        let a = self.line.acceleration;
        let length = 0.5 * (self.rate[0] + self.rate[1]) * self.span;
        let gain = 2.0 * a * length;
        let top_sq = self.line.speed_sq;
        let start_sq = start_sq.min(top_sq.min(end_sq + gain));
        let start = Place { t: self.t[0], rate: self.rate[0], speed_sq: start_sq };
        let end = |speed_sq: f64| Place { t: self.t[1], rate: self.rate[1], speed_sq };
        // Too short to reach the speed asked for at the end.
        if start_sq + gain <= end_sq {
            let last = end(start_sq + gain);
            self.push(out, start, last, length, Motion::SpeedUp);
            return last.speed_sq;
        }
        let last = end(end_sq);
        let peak_sq = (0.5 * (start_sq + end_sq + gain)).min(top_sq);
        let (first_part, last_part) = ((peak_sq - start_sq) / (2.0 * a), (peak_sq - end_sq) / (2.0 * a));
        let none = NO_PART * length;
        // Nothing between the two in a triangle.
        let cruise = if peak_sq < top_sq { 0.0 } else { (length - first_part - last_part).max(0.0) };
        let place = |before: f64, after: f64| {
            if after <= none {
                Place { speed_sq: peak_sq, ..last }
            } else if before <= after {
                self.after_start(before, peak_sq)
            } else {
                self.before_end(after, peak_sq)
            }
        };
        // Next to its start a place shows the shortest ramp that is more than rounding of v²; next to its end none does.
        let from = if peak_sq - start_sq <= NO_PART * peak_sq {
            Place { speed_sq: peak_sq, ..start }
        } else {
            place(first_part, cruise + last_part)
        };
        let to = if cruise > 0.0 { place(first_part + cruise, last_part) } else { from };
        self.push(out, start, from, first_part, Motion::SpeedUp);
        self.push(out, from, to, cruise, Motion::Cruise);
        self.push(out, to, last, last_part, Motion::SlowDown);
        end_sq
    }

    /// The place this length after the start; |C'|² is linear in the length.
    #[inline(always)]
    fn after_start(&self, length: f64, speed_sq: f64) -> Place {
        let [r0, r1] = self.rate;
        let slope = (r1 - r0) / self.span;
        let rate = (r0 * r0 + 2.0 * slope * length).max(0.0).sqrt();
        Place { t: (self.t[0] + 2.0 * length / (r0 + rate)).min(self.t[1]), rate, speed_sq }
    }

    /// The place this length before the end.
    #[inline(always)]
    fn before_end(&self, length: f64, speed_sq: f64) -> Place {
        let [r0, r1] = self.rate;
        let slope = (r1 - r0) / self.span;
        let rate = (r1 * r1 - 2.0 * slope * length).max(0.0).sqrt();
        Place { t: (self.t[1] - 2.0 * length / (r1 + rate)).max(self.t[0]), rate, speed_sq }
    }

    #[inline(always)]
    fn push(&self, out: &mut Profile, from: Place, to: Place, length: f64, motion: Motion) {
        // A ramp too short for its places to show it still says how fast the end is.
        let slows_down = matches!(motion, Motion::SlowDown) && to.speed_sq < from.speed_sq && to.rate > 0.0;
        if to.t <= from.t && !slows_down {
            return;
        }
        let (v0, v1) = (from.speed_sq.sqrt(), to.speed_sq.sqrt());
        let duration = 2.0 * length / (v0 + v1);
        let line = self.line;
        let axis = line.axis as u8;
        let (kind, axis, value) = match motion {
            // From rest at a cusp p is constant.
            Motion::SpeedUp if from.rate == 0.0 && v0 == 0.0 => (ArcKind::ParameterAcceleration, axis, 0.0),
            Motion::SlowDown if to.rate == 0.0 && v1 == 0.0 => (ArcKind::ParameterAcceleration, axis, 0.0),
            Motion::SpeedUp => (ArcKind::AxisAcceleration, axis, self.signed),
            Motion::SlowDown => (ArcKind::AxisAcceleration, axis, -self.signed),
            Motion::Cruise => match line.speed_axis {
                None => (ArcKind::Feed, NO_AXIS, line.speed_sq),
                Some(axis) => (ArcKind::AxisVelocity, axis as u8, line.axis_speed_sq),
            },
        };
        let p = |here: Place, there: Place| {
            if here.rate > 0.0 {
                here.speed_sq / (here.rate * here.rate)
            } else if here.speed_sq == 0.0 {
                // The limit: v² and |C'|² both grow in proportion to the length.
                there.speed_sq / (there.rate * there.rate)
            } else {
                f64::INFINITY
            }
        };
        let (t, p) = (to.t, [p(from, to), p(to, from)]);
        let joins = from.rate > 0.0;
        out.push(self.number, self.width, Row { kind, axis, value, t, p, duration, joins });
    }
}

/// What the tool does on a part of a straight piece.
#[derive(Clone, Copy)]
enum Motion {
    SpeedUp,
    Cruise,
    SlowDown,
}
