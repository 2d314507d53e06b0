//! The arcs of a speed profile: their arrays, when they begin, and what is wrong with their numbers alone.

use super::curve::{Curve, Followed};
use super::motion::{Law, Motion};

/// The profile's arrays, one entry an arc; see `feedplan.profile.SpeedProfile`.
#[derive(Clone, Copy)]
pub struct Arcs<'a> {
    pub piece: &'a [u32],
    pub kind: &'a [u8],
    pub axis: &'a [u8],
    pub value: &'a [f64],
    /// Local parameter at both ends, in mm, and p there, in mm²/s².
    pub u0: &'a [f64],
    pub u1: &'a [f64],
    pub p0: &'a [f64],
    pub p1: &'a [f64],
    /// In s.
    pub duration: &'a [f64],
    /// Arc offsets of the runs.
    pub runs: &'a [i64],
}

const AXIS_ACCELERATION: u8 = 0;
const FLAT: u8 = 1;
const FEED: u8 = 2;
const AXIS_VELOCITY: u8 = 3;
const CHORD: u8 = 4;

impl Arcs<'_> {
    /// Number of arcs.
    pub fn len(&self) -> usize {
        self.piece.len()
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.piece.is_empty()
    }

    /// When each arc begins, and when the last one ends, in s; pauses before and between the runs included.
    pub fn starts(&self, path: &Followed) -> Vec<f64> {
        let mut starts = Vec::with_capacity(self.len() + 1);
        let (mut time, mut run) = (path.start_dwell, 0);
        for (i, duration) in self.duration.iter().enumerate() {
            while run + 1 < self.runs.len() && self.runs[run + 1] <= i as i64 {
                time += path.dwell.get(run).copied().unwrap_or(0.0);
                run += 1;
            }
            starts.push(time);
            time += duration;
        }
        starts.push(time);
        starts
    }

    /// What is wrong with the numbers of arc `i` taken alone, if anything.
    pub fn has_bad_numbers(&self, i: usize, path: &Followed) -> bool {
        let piece = self.piece[i] as usize;
        if piece >= path.len() || self.kind[i] > CHORD {
            return true;
        }
        let needs_axis = matches!(self.kind[i], AXIS_ACCELERATION | AXIS_VELOCITY);
        let numbers = [self.value[i], self.u0[i], self.u1[i], self.p0[i], self.p1[i], self.duration[i]];
        (needs_axis && self.axis[i] as usize >= path.axes)
            || numbers.iter().any(|number| !number.is_finite())
            || self.p0[i] < 0.0
            || self.p1[i] < 0.0
            || self.duration[i] < 0.0
    }

    /// Arc `i` ready to be evaluated; its numbers must be good.
    pub fn motion<const M: usize>(&self, i: usize, curve: &Curve<M>) -> Motion<M> {
        let (p0, p1) = (self.p0[i], self.p1[i]);
        let ends = [curve.derivative(self.u0[i]), curve.derivative(self.u1[i])];
        let axis = self.axis[i] as usize;
        let anchored_at_end =
            self.kind[i] == AXIS_ACCELERATION && (ends[1][axis].powi(2) * p1 < ends[0][axis].powi(2) * p0);
        let (tangent, p_anchor, p_far) = if anchored_at_end { (ends[1], p1, p0) } else { (ends[0], p0, p1) };
        let law = match self.kind[i] {
            AXIS_ACCELERATION => Law::AxisAcceleration {
                axis,
                value: self.value[i],
                start_sq: tangent[axis].powi(2) * p_anchor,
            },
            FLAT => Law::Flat { root_p: p_anchor.sqrt() },
            FEED => Law::Feed { speed: self.value[i].sqrt() },
            AXIS_VELOCITY => Law::AxisVelocity { axis, speed: self.value[i].sqrt() },
            _ => Law::Chord { value: self.value[i] },
        };
        let width = self.u1[i] - self.u0[i];
        Motion::new(law, tangent, curve.second_derivative(), width, [p_anchor, p_far], anchored_at_end)
    }
}
