//! The phases of a speed profile: their arrays, their start times, and what their numbers alone show to be wrong.

use std::ops::Range;

use super::columns::Columns;
use super::curve::Followed;
use super::phase_by_length::PhaseByLength;
use super::speed_by_length::{Pace, SpeedByLength};
use super::{EPS, ROUNDINGS};

/// The profile's arrays, one entry a phase; see `feedplan.profile.SpeedProfile`.
#[derive(Clone, Copy)]
pub struct Phases<'a> {
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
    /// Acceleration along the path at both ends, in mm/s².
    pub a0: &'a [f64],
    pub a1: &'a [f64],
    /// The factor of each axis in the speed that is constant on phases at the feed, one row a piece; empty if all are 1.
    pub share: &'a [f64],
    /// Number of pieces of the path.
    pub pieces: usize,
    /// Phase offsets of the runs.
    pub runs: &'a [i64],
}

#[cfg(test)]
impl<'a> Phases<'a> {
    /// The one phase of a path of one piece; it takes 1 s.
    pub fn of_one(
        kind: &'a [u8; 1],
        axis: &'a [u8; 1],
        value: &'a [f64; 1],
        u: &'a [f64; 2],
        p: &'a [f64; 2],
    ) -> Self {
        Self {
            piece: &[0],
            kind,
            axis,
            value,
            u0: &u[..1],
            u1: &u[1..],
            p0: &p[..1],
            p1: &p[1..],
            duration: &[1.0],
            a0: &[0.0],
            a1: &[0.0],
            share: &[],
            pieces: 1,
            runs: &[0, 1],
        }
    }
}

/// Numbers of the laws; see `feedplan.profile.PhaseLaw`.
pub const AXIS_ACCELERATION: u8 = 0;
pub const PARAMETER_ACCELERATION: u8 = 1;
pub const FEED: u8 = 2;
pub const AXIS_VELOCITY: u8 = 3;
pub const SPEED_LINE: u8 = 4;
pub const PATH_JERK: u8 = 5;
pub const SPEED_CUBIC: u8 = 6;

impl Phases<'_> {
    /// Number of phases.
    pub fn len(&self) -> usize {
        self.piece.len()
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.piece.is_empty()
    }

    /// Divides the phases `among` into groups of consecutive ones, with at most `most` phases on at most `most_pieces` pieces.
    pub fn groups(&self, among: Range<usize>, [most, most_pieces]: [usize; 2]) -> Vec<Range<usize>> {
        let (mut groups, mut start, mut pieces) = (Vec::new(), among.start, 1);
        for i in among.start + 1..=among.end {
            let is_next = i < among.end && self.piece[i] != self.piece[i - 1];
            if i == among.end || i - start == most || (is_next && pieces == most_pieces) {
                groups.push(start..i);
                (start, pieces) = (i, 1);
            } else {
                pieces += usize::from(is_next);
            }
        }
        groups
    }

    /// Whether the runs of the phases match those of the path, and the numbers of all phases can be used with `axes` axes or
    /// joints.
    pub fn fits(&self, path: &Followed, axes: usize) -> bool {
        let runs = self.runs;
        !self.is_empty()
            && runs.len() == path.runs.len()
            && runs.first() == Some(&0)
            && runs.last() == Some(&(self.len() as i64))
            && runs.windows(2).all(|pair| pair[0] <= pair[1])
            && self.have_good_numbers(axes).iter().all(|&good| good)
    }

    /// Start time of each phase, and end time of the last one, in s, including the pauses before and between the runs.
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

    /// Whether the numbers of each phase are finite and in their range, with `axes` axes or joints.
    pub fn have_good_numbers(&self, axes: usize) -> Vec<bool> {
        // 0 × x is NaN if x is not finite. One column follows the other, so that SIMD vectors are used.
        let mut nothing = vec![0.0; self.len()];
        for column in [self.value, self.u0, self.u1, self.p0, self.p1, self.duration, self.a0, self.a1] {
            for (sum, number) in nothing.iter_mut().zip(column) {
                *sum += 0.0 * number;
            }
        }
        let mut are_good: Vec<bool> = nothing.iter().map(|nothing| *nothing == 0.0).collect();
        for column in [self.p0, self.p1, self.duration] {
            for (good, number) in are_good.iter_mut().zip(column) {
                *good &= *number >= 0.0;
            }
        }
        for (i, good) in are_good.iter_mut().enumerate() {
            let kind = self.kind[i];
            let needs_axis = matches!(kind, AXIS_ACCELERATION | AXIS_VELOCITY);
            *good &= (self.piece[i] as usize) < self.pieces
                && kind <= SPEED_CUBIC
                && (!needs_axis || (self.axis[i] as usize) < axes)
                && (matches!(kind, PATH_JERK | SPEED_CUBIC) || (self.a0[i] == 0.0 && self.a1[i] == 0.0));
        }
        are_good
    }

    /// Whether the speed on phase `i` is given by the length of the path.
    pub fn is_by_length<const M: usize>(&self, i: usize, columns: &Columns<M>) -> bool {
        let kind = self.kind[i];
        matches!(kind, PATH_JERK | SPEED_CUBIC)
            || (kind == FEED && columns.are_axes() && self.counted::<M>(i) == [1.0; M])
    }

    /// Phase `i` on its piece; None if its speed is not given by the length of the path. Its numbers must be usable.
    pub fn by_length<const M: usize>(&self, i: usize, columns: &mut Columns<M>) -> Option<PhaseByLength<M>> {
        if !self.is_by_length(i, columns) {
            return None;
        }
        let (kind, piece, u) = (self.kind[i], self.piece[i] as usize, [self.u0[i], self.u1[i]]);
        let (scale, curve) = (columns.scale(), columns.curve(piece).clone());
        let slopes = curve.speeds(u, &scale);
        let mut speeds = [slopes[0] * self.p0[i].sqrt(), slopes[1] * self.p1[i].sqrt()];
        // Counted from the slower end, where the time depends most on the length. If that is the end of the phase, time runs
        // back.
        let anchored_at_end = kind != FEED && speeds[1] < speeds[0];
        let mut a = [self.a0[i], self.a1[i]];
        if anchored_at_end {
            speeds.reverse();
            a = [-a[1], -a[0]];
        }
        let (value, duration) = (self.value[i], self.duration[i]);
        let speed = |length: f64| match kind {
            FEED => SpeedByLength::Constant { speed: value.sqrt() },
            PATH_JERK => SpeedByLength::Jerk { start: Pace { v: speeds[0], a: a[0], j: value }, duration },
            _ => SpeedByLength::cubic(speeds.map(|v| v * v), a, length),
        };
        Some(PhaseByLength::new(curve, scale, u, anchored_at_end, duration, speed))
    }

    /// The factor of each axis in the speed that is constant on phase `i`.
    pub fn counted<const M: usize>(&self, i: usize) -> [f64; M] {
        let axes = self.share.len().checked_div(self.pieces).unwrap_or(0);
        let row = self.piece[i] as usize * axes;
        std::array::from_fn(|k| if k < axes { self.share[row + k] } else { 1.0 })
    }

    /// The acceleration along the path at an end of phase `i`, in mm/s²; None if its law gives none.
    pub fn end_acceleration(&self, i: usize, at_end: bool) -> Option<f64> {
        match self.kind[i] {
            FEED if self.counted::<9>(i) == [1.0; 9] => Some(0.0),
            PATH_JERK | SPEED_CUBIC => Some(if at_end { self.a1[i] } else { self.a0[i] }),
            _ => None,
        }
    }

    /// How far the change between the recorded accelerations at both ends of phase `i` is from its constant jerk times its
    /// duration, in mm/s², less what rounding may add; `width_rounding` is the relative rounding of its width.
    pub fn acceleration_error(&self, i: usize, width_rounding: f64) -> f64 {
        if self.kind[i] != PATH_JERK {
            return 0.0;
        }
        let (from, to, change) = (self.a0[i], self.a1[i], self.value[i] * self.duration[i]);
        let rounding = EPS * (to.abs() + from.abs() + change.abs()) + width_rounding * change.abs();
        (to - from - change).abs() - ROUNDINGS * rounding
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_group_has_no_more_phases_and_pieces_than_so_many() {
        let one = Phases::of_one(&[FEED], &[255], &[1.0], &[0.0, 1.0], &[1.0; 2]);
        let phases = Phases { piece: &[0, 0, 0, 1, 1, 1, 1, 1, 2], pieces: 3, ..one };
        assert_eq!(phases.groups(1..9, [3, 1]), [1..3, 3..6, 6..8, 8..9]);
        assert_eq!(phases.groups(2..4, [3, 1]), [2..3, 3..4]);
        assert_eq!(phases.groups(0..9, [6, 2]), [0..6, 6..9]);
        assert_eq!(phases.groups(0..9, [9, 2]), [0..8, 8..9]);
    }
}
