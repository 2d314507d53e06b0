//! The independent audit: samples what a plan claims and measures every limit by differences of its own.
//!
//! Nothing here comes from a planner, a fit or a sampler: positions are evaluated from the control points, times follow from
//! the law of each phase or are integrated numerically, accelerations are difference quotients. By the mean value theorem a
//! quotient exceeds a limit only where the motion does, so a broken limit found here is truly broken.
//!
//! The path: `vectors`, `number`, `elementary`, `polygon`, `hodographs`, `curve`, `nearest`; the program: `arc_slope`,
//! `moves`, `neighbours`, `close_places`, `deviation`. What is limited along the path: `station`, `columns` (its axes),
//! `joints` (joints, with a kinematics), `together` (at several places at once). The profile: `phases`, `phase_order`,
//! `quadrature`, `phase_motion`, `speed_by_length`, `bulge`, `phase_by_length`, `motion`, `phase_jerk`, `peak`, `chord`,
//! `profile`. Setpoints: `rows`, `differences`, `setpoints`; with their plan `tracking`, `profile_clock`, `profile_reader`,
//! `against_plan`. Loops: `parallel`. Other crates call `kernels`.

mod against_plan;
mod arc_slope;
mod bulge;
mod chord;
mod close_places;
mod columns;
pub mod curve;
mod deviation;
mod differences;
mod elementary;
mod hodographs;
pub mod joints;
pub mod kernels;
mod motion;
pub mod moves;
mod nearest;
mod neighbours;
mod number;
mod parallel;
mod peak;
mod phase_by_length;
mod phase_jerk;
mod phase_motion;
mod phase_order;
pub mod phases;
mod polygon;
mod profile;
pub mod profile_clock;
mod profile_reader;
mod quadrature;
mod rows;
pub mod setpoints;
mod speed_by_length;
mod station;
mod together;
pub mod tracking;
mod vectors;

/// Told of how many more phases, pieces or moves have been looked at; it may end the audit by unwinding.
pub type Seen<'a> = &'a (dyn Fn(usize) + Sync);

/// It is told of so many at a time.
const TOLD: usize = 64;

/// Tells of number `i` of a loop.
fn tell(seen: Seen, i: usize) {
    if i.is_multiple_of(TOLD) {
        seen(TOLD);
    }
}

/// A ratio of measured value to limit passes up to here: a millionth covers the planner's own rounding over
/// 100 000 pieces (some 1e-10) and means nothing to a machine.
pub const PASS_MARK: f64 = 1.0 + PASS_EXCESS;

/// What the pass mark allows beyond the limit.
pub const PASS_EXCESS: f64 = 1e-6;

/// Spacing of the numbers at 1.
pub const EPS: f64 = f64::EPSILON;

/// Roundings, in units of `EPS` of the magnitude, that one evaluated position or velocity may carry: some
/// sixteen operations of half a unit each lie on the way from the stored numbers to it.
pub const ROUNDINGS: f64 = 8.0;

/// How far, in mm, a setpoint may lie from its place on the path, beyond rounding: a nanometre.
pub const PLACE_TOLERANCE: f64 = 1e-6;

/// How far, in mm, the end of one piece may lie from the start of the next, beyond rounding.
pub const GAP_TOLERANCE: f64 = 1e-9;

/// What is checked. The name is how it appears to users.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(usize)]
pub enum Check {
    /// Numbers that are not finite, or out of their range.
    Numbers,
    /// Phases that do not cover the pieces in order, in mm of parameter.
    Order,
    /// Speed, in mm/s.
    Feed,
    /// Distance of the straight line between setpoints from the path, in mm.
    Chord,
    /// Speed at the ends of runs and at junctions, in mm/s.
    Junction,
    /// Jump of the speed at a junction, in mm/s.
    Continuity,
    /// Jump of the acceleration along the path, at rest from 0, in mm/s².
    AccelerationContinuity,
    /// Recorded duration against the audit's own integral, relative.
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

    /// Whether the check is kept for each axis on its own.
    pub fn per_axis(self) -> bool {
        self as usize >= Check::Velocity as usize
    }
}

/// The worst place found of one limit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Worst {
    /// The value measured there, less its rounding allowance.
    pub value: f64,
    pub limit: f64,
    /// `value / limit`; negative while nothing was measured, infinite for what is not a number.
    pub ratio: f64,
    /// In s from the start of the program.
    pub time: f64,
    /// Source line; 0 where none is known.
    pub line: i32,
}

impl Worst {
    const NONE: Worst = Worst { value: 0.0, limit: f64::INFINITY, ratio: -1.0, time: 0.0, line: 0 };
}

/// The worst of every limit, and how many samples were looked at.
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
    /// Keeps the value if no worse one was seen. What is not a number is the worst there is.
    #[inline(always)]
    pub fn offer(&mut self, check: Check, axis: usize, value: f64, limit: f64, time: f64, line: i32) {
        self.offer_at(check, axis, value, limit, line, || time);
    }

    /// The same where the time is computed only for a value that is kept.
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
        // Most values change nothing, and a product is had sooner than a ratio.
        if self.is_passed(check, axis, value, limit) {
            return;
        }
        let ratio = if value <= 0.0 { 0.0 } else { value / limit };
        self.offer_share(check, axis, (value, limit, ratio), line, time);
    }

    /// Whether a value up to `most` changes nothing; what is not a number always does.
    #[inline(always)]
    pub fn is_passed(&self, check: Check, axis: usize, most: f64, limit: f64) -> bool {
        let known = self.worst[check as usize][axis].ratio;
        known >= 0.0 && most <= known * limit
    }

    /// Whether a value that is not above 0 changes nothing, whatever its limit.
    #[inline(always)]
    pub fn is_measured(&self, check: Check, axis: usize) -> bool {
        self.worst[check as usize][axis].ratio >= 0.0
    }

    /// At most what a value may be to change nothing; not a number where nothing is known. A value against no limit only has to be a
    /// number.
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

    /// The same of value, limit and their ratio.
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

    /// The same where the ratio is not that of value and limit.
    pub fn offer_ratio(&mut self, check: Check, axis: usize, mut found: Worst) {
        if found.ratio.is_nan() {
            found.ratio = f64::INFINITY;
        }
        let worst = &mut self.worst[check as usize][axis];
        if found.ratio > worst.ratio {
            *worst = found;
        }
    }

    /// The worse of both, for every limit.
    pub fn merge(mut self, other: Self) -> Self {
        for (mine, theirs) in self.worst.iter_mut().flatten().zip(other.worst.iter().flatten()) {
            if theirs.ratio > mine.ratio {
                *mine = *theirs;
            }
        }
        self.samples += other.samples;
        self
    }

    /// The worst of one check.
    pub fn get(&self, check: Check, axis: usize) -> &Worst {
        &self.worst[check as usize][axis]
    }
}

/// Speeds that feeds are about: along X, Y, Z, along U, V, W, of all other axes, and of all together.
pub const FEEDS: usize = 4;

/// A limit of each axis in both directions, as sizes: of what is positive, of what is negative.
#[derive(Clone, Copy, Debug)]
pub struct Sided<const M: usize> {
    pub positive: [f64; M],
    pub negative: [f64; M],
}

impl<const M: usize> Sided<M> {
    /// The limit that holds for a value, by its sign.
    #[inline(always)]
    pub fn of(&self, axis: usize, value: f64) -> f64 {
        // Both are read, so that no branch follows a sign that changes often.
        let (positive, negative) = (self.positive[axis], self.negative[axis]);
        if value < 0.0 {
            negative
        } else {
            positive
        }
    }

    /// The limits that hold for a value of each axis.
    #[inline(always)]
    pub fn of_each(&self, values: &[f64; M]) -> [f64; M] {
        vectors::vector_of(|k| self.of(k, values[k]))
    }

    /// What a value is to be multiplied by for the share of its limit; a limit of 0 stays out of reach of 0 alone.
    fn inverse(&self) -> Self {
        let inverse = |limits: [f64; M]| limits.map(|limit| (1.0 / limit).min(f64::MAX));
        Self { positive: inverse(self.positive), negative: inverse(self.negative) }
    }

    /// The smaller limit.
    #[inline]
    pub fn least(&self, axis: usize) -> f64 {
        self.positive[axis].min(self.negative[axis])
    }

    /// The greater limit.
    #[inline]
    pub fn greatest(&self, axis: usize) -> f64 {
        self.positive[axis].max(self.negative[axis])
    }

    /// The greater limit of each axis.
    pub fn greater(&self) -> [f64; M] {
        std::array::from_fn(|k| self.greatest(k))
    }
}

/// The limits that hold everywhere.
#[derive(Clone, Copy, Debug)]
pub struct Limits<const M: usize> {
    /// Those beyond are 0, and their travel is not limited.
    pub axes: usize,
    /// In mm/s, mm/s² and mm/s³.
    pub velocity: Sided<M>,
    pub acceleration: Sided<M>,
    pub jerk: [f64; M],
    /// Whether jerk is judged; else it is only measured where that costs nothing.
    pub judges_jerk: bool,
    /// Jump of each axis velocity that is allowed at a corner, in mm/s.
    pub jump: [f64; M],
    /// What of it may show in differences of setpoints as an acceleration above the limit: nothing of a jump that is
    /// no more than the limit over a period.
    pub jump_beyond: [f64; M],
    /// Least and greatest position, in mm.
    pub travel: [[f64; 2]; M],
    /// What the velocity of each axis counts in each speed that a feed is about, 0 or 1.
    pub feed_axes: [[f64; M]; FEEDS],
    /// In mm; infinite: not limited.
    pub chord_tolerance: f64,
    /// Servo period in s.
    pub period: f64,
    /// Speeds at the two ends of the path, in mm/s.
    pub end_speeds: [f64; 2],
}

impl<const M: usize> Limits<M> {
    /// What of a velocity or a way counts in a speed that a feed is about.
    #[inline]
    pub fn counted(&self, feed: usize, of: &[f64; M]) -> [f64; M] {
        std::array::from_fn(|k| self.feed_axes[feed][k] * of[k])
    }

    /// How far the mean of the recorded velocities of one axis at both ends of a step may be from the mean velocity: an eighth of the
    /// way from the least acceleration to the greatest, and half of a jump.
    #[inline(always)]
    pub fn mean_velocity_off(&self, axis: usize, step: f64) -> f64 {
        let span = self.acceleration.positive[axis] + self.acceleration.negative[axis];
        0.125 * span * step + 0.5 * self.jump[axis]
    }

    /// The jump of one axis velocity that means nothing: over this time it adds no more than the pass mark to the acceleration.
    #[inline]
    pub fn negligible_jump(&self, axis: usize, time: f64) -> f64 {
        PASS_EXCESS * self.acceleration.least(axis) * time
    }
}

#[cfg(test)]
impl<const M: usize> Limits<M> {
    /// Nothing is limited.
    fn none() -> Self {
        let anything = Sided { positive: [f64::INFINITY; M], negative: [f64::INFINITY; M] };
        Self {
            axes: M,
            velocity: anything,
            acceleration: anything,
            jerk: [f64::INFINITY; M],
            judges_jerk: false,
            jump: [0.0; M],
            jump_beyond: [0.0; M],
            travel: [[f64::NEG_INFINITY, f64::INFINITY]; M],
            feed_axes: [[1.0; M]; FEEDS],
            chord_tolerance: f64::INFINITY,
            period: 1e-3,
            end_speeds: [0.0; 2],
        }
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
        // An axis that rests, with a limit and without one.
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
