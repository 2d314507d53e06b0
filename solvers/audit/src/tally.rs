//! What an audit finds: for every limit the place with the greatest use.

use super::vectors;

/// The kinds of checks, by the names that users see.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(usize)]
pub enum Check {
    /// Numbers that are not finite, or out of their range.
    Numbers,
    /// Phases that do not cover the pieces in order: gaps in mm of the parameter.
    Order,
    /// Speed, in mm/s.
    Feed,
    /// Distance of the straight line between setpoints from the path, in mm.
    Chord,
    /// Speed at the ends of runs and at junctions, in mm/s.
    Junction,
    /// Jump of the speed at a junction, in mm/s.
    Continuity,
    /// Jump of the acceleration along the path, in mm/s²; at rest the acceleration itself.
    AccelerationContinuity,
    /// Difference of the recorded duration from the audit's own integral, relative.
    Duration,
    /// Distance between followed and programmed path, in mm.
    Deviation,
    /// Gap between pieces, and between the ends of path and program, in mm.
    Gap,
    /// Uneven time steps, in s.
    Grid,
    /// Distance of a setpoint from its place on the path, in mm.
    Place,
    /// Velocity of an axis, in mm/s.
    Velocity,
    /// Acceleration of an axis, in mm/s².
    Acceleration,
    /// Jerk of an axis, in mm/s³.
    Jerk,
    /// Jump of an axis velocity, in mm/s.
    Jump,
    /// Jump of an axis acceleration where the curvature jumps, in mm/s².
    AccelerationJump,
    /// Position of an axis against its travel, in mm.
    Travel,
    /// Recorded velocity of an axis against the change of position, in mm/s.
    RecordedVelocity,
    /// Recorded acceleration of an axis against the change of velocity, in mm/s².
    RecordedAcceleration,
}

/// Number of checks.
pub const CHECKS: usize = 20;

impl Check {
    /// All checks in the order of their numbers.
    pub const ALL: [Check; CHECKS] = [
        Check::Numbers,
        Check::Order,
        Check::Feed,
        Check::Chord,
        Check::Junction,
        Check::Continuity,
        Check::AccelerationContinuity,
        Check::Duration,
        Check::Deviation,
        Check::Gap,
        Check::Grid,
        Check::Place,
        Check::Velocity,
        Check::Acceleration,
        Check::Jerk,
        Check::Jump,
        Check::AccelerationJump,
        Check::Travel,
        Check::RecordedVelocity,
        Check::RecordedAcceleration,
    ];

    /// The name users see.
    pub fn name(self) -> &'static str {
        match self {
            Check::Numbers => "numbers",
            Check::Order => "order",
            Check::Feed => "feed",
            Check::Chord => "chord",
            Check::Junction => "junction",
            Check::Continuity => "continuity",
            Check::AccelerationContinuity => "acceleration_continuity",
            Check::Duration => "duration",
            Check::Deviation => "deviation",
            Check::Gap => "gap",
            Check::Grid => "grid",
            Check::Place => "place",
            Check::Velocity => "velocity",
            Check::Acceleration => "acceleration",
            Check::Jerk => "jerk",
            Check::Jump => "jump",
            Check::AccelerationJump => "acceleration_jump",
            Check::Travel => "travel",
            Check::RecordedVelocity => "recorded_velocity",
            Check::RecordedAcceleration => "recorded_acceleration",
        }
    }

    /// Whether each axis has its own worst value.
    pub fn per_axis(self) -> bool {
        self as usize >= Check::Velocity as usize
    }
}

/// The place with the greatest use of one limit so far.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Worst {
    /// The value measured there, less its rounding error bound.
    pub value: f64,
    pub limit: f64,
    /// `value / limit`; negative while nothing was measured, infinite for NaN.
    pub ratio: f64,
    /// In s from the start of the program.
    pub time: f64,
    /// Source line; 0 if it is not known.
    pub line: i32,
}

impl Worst {
    const NONE: Worst = Worst { value: 0.0, limit: f64::INFINITY, ratio: -1.0, time: 0.0, line: 0 };
}

/// The worst place of every limit, and the number of places that were evaluated.
#[derive(Clone, Debug)]
pub struct Tally<const M: usize> {
    pub worst: [[Worst; M]; CHECKS],
    pub samples: u64,
}

impl<const M: usize> Default for Tally<M> {
    fn default() -> Self {
        Self { worst: [[Worst::NONE; M]; CHECKS], samples: 0 }
    }
}

impl<const M: usize> Tally<M> {
    /// Keeps the value if its ratio to the limit is the greatest so far. NaN counts as the greatest.
    #[inline(always)]
    pub fn offer(&mut self, check: Check, axis: usize, value: f64, limit: f64, time: f64, line: i32) {
        self.offer_at(check, axis, value, limit, line, || time);
    }

    /// `offer` with a time that is computed only if the value is kept.
    #[inline(always)]
    pub fn offer_at(
        &mut self,
        check: Check,
        axis: usize,
        value: f64,
        limit: f64,
        line: i32,
        time: impl FnOnce() -> f64,
    ) {
        // Most values change nothing, and a product is faster than a ratio.
        if self.is_passed(check, axis, value, limit) {
            return;
        }
        let ratio = if value <= 0.0 { 0.0 } else { value / limit };
        self.offer_share(check, axis, (value, limit, ratio), line, time);
    }

    /// Whether values up to `most` change nothing. A NaN always does.
    #[inline(always)]
    pub fn is_passed(&self, check: Check, axis: usize, most: f64, limit: f64) -> bool {
        let known = self.worst[check as usize][axis].ratio;
        known >= 0.0 && most <= known * limit
    }

    /// Whether values that are not above 0 change nothing, whatever their limit.
    #[inline(always)]
    pub fn is_measured(&self, check: Check, axis: usize) -> bool {
        self.worst[check as usize][axis].ratio >= 0.0
    }

    /// The greatest value that changes nothing; NaN if nothing was measured yet. With an infinite limit any finite value changes
    /// nothing.
    pub fn most(&self, check: Check, axis: usize, limit: f64) -> f64 {
        match self.worst[check as usize][axis].ratio {
            known if known < 0.0 => f64::NAN,
            _ if limit == f64::INFINITY => f64::MAX,
            known => known * limit,
        }
    }

    /// The worst ratio of each axis.
    #[inline(always)]
    pub fn ratios(&self, check: Check) -> [f64; M] {
        vectors::vector_of(|k| self.worst[check as usize][k].ratio)
    }

    /// `offer_at` with the ratio of value and limit given.
    #[inline(always)]
    pub fn offer_share(
        &mut self,
        check: Check,
        axis: usize,
        (value, limit, ratio): (f64, f64, f64),
        line: i32,
        time: impl FnOnce() -> f64,
    ) {
        // The negated comparison also holds for a NaN, which must not get lost.
        #[allow(clippy::neg_cmp_op_on_partial_ord)]
        if !(ratio <= self.worst[check as usize][axis].ratio) {
            let value = if value < 0.0 { 0.0 } else { value };
            self.offer_ratio(check, axis, Worst { value, limit, ratio, time: time(), line });
        }
    }

    /// Keeps what was found if its ratio is the greatest so far; the ratio need not be that of value and limit.
    pub fn offer_ratio(&mut self, check: Check, axis: usize, mut found: Worst) {
        if found.ratio.is_nan() {
            found.ratio = f64::INFINITY;
        }
        let worst = &mut self.worst[check as usize][axis];
        if found.ratio > worst.ratio {
            *worst = found;
        }
    }

    /// Combines two tallies: the worse place for every limit, and all samples.
    pub fn merge(mut self, other: Self) -> Self {
        for (mine, theirs) in self.worst.iter_mut().flatten().zip(other.worst.iter().flatten()) {
            if theirs.ratio > mine.ratio {
                *mine = *theirs;
            }
        }
        self.samples += other.samples;
        self
    }

    /// The worst place of one check.
    pub fn get(&self, check: Check, axis: usize) -> &Worst {
        &self.worst[check as usize][axis]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_not_a_number_stays_the_worst() {
        let mut tally = Tally::<1>::default();
        tally.offer(Check::Feed, 0, 5.0, 10.0, 1.0, 7);
        tally.offer(Check::Feed, 0, f64::NAN, 10.0, 2.0, 8);
        tally.offer(Check::Feed, 0, 9.0, 10.0, 3.0, 9);
        let worst = tally.get(Check::Feed, 0);
        assert_eq!((worst.ratio, worst.line), (f64::INFINITY, 8));
        let merged = Tally::<1>::default().merge(tally);
        assert_eq!(merged.get(Check::Feed, 0).line, 8);
    }

    #[test]
    fn a_value_against_no_limit_at_all_fails_only_above_zero() {
        let mut tally = Tally::<1>::default();
        tally.offer(Check::Order, 0, 0.0, 0.0, 0.0, 1);
        assert_eq!(tally.get(Check::Order, 0).ratio, 0.0);
        tally.offer(Check::Order, 0, 1e-300, 0.0, 0.0, 2);
        assert_eq!(tally.get(Check::Order, 0).ratio, f64::INFINITY);
    }

    #[test]
    fn what_uses_no_more_than_the_worst_changes_nothing() {
        let mut tally = Tally::<1>::default();
        assert!(!tally.is_passed(Check::Velocity, 0, 0.0, 0.0));
        // An axis at rest, with a limit of 0 and with another one.
        tally.offer(Check::Velocity, 0, 0.0, 0.0, 0.0, 1);
        assert!(
            tally.is_passed(Check::Velocity, 0, 0.0, 0.0) && tally.is_passed(Check::Velocity, 0, 0.0, 2.0)
        );
        assert!(!tally.is_passed(Check::Velocity, 0, 1e-300, 2.0));
        assert!(!tally.is_passed(Check::Velocity, 0, f64::NAN, 2.0));
    }

    #[test]
    fn the_numbers_of_the_checks_are_their_places() {
        for (number, check) in Check::ALL.into_iter().enumerate() {
            assert_eq!(check as usize, number);
        }
    }
}
