//! The forward recursion (Cheatham 2007, 4.3.1): computes speeds at the ends of segments that rise on the first segment and then
//! fall as fast as possible to standstill.
//!
//! It looks at as many segments as it takes to stop. Where the fall is too slow for a limit ahead, the speed jumps down to the
//! limit, and the backward recursion must remove this jump.

use super::buffer::Buffer;
use super::dead_spot::Fall;
use super::segment::Segment;

/// The input of a stage: one segment and the speeds at its ends.
#[derive(Clone, Copy, Debug)]
pub struct Situation<'a> {
    pub segment: &'a Segment,
    /// The speed at the segment's start.
    pub start: f64,
    /// The speed limit at the segment's end; None at the end of the buffer, where the motion must stand.
    pub allowable: Option<f64>,
}

impl Situation<'_> {
    fn fall(&self) -> Fall {
        Fall { limits: self.segment.limits, start: self.start, length: self.segment.length }
    }

    /// The speed limit at the segment's end; 0 at the end of the buffer.
    fn limit(&self) -> f64 {
        self.allowable.unwrap_or(0.0)
    }
}

/// The speed at the end of a segment.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Step {
    /// A speed that the segment joins with the speed at its start.
    Joined(f64),
    /// A limit that the segment cannot reach.
    Jump(f64),
}

/// Fills `speeds` with the speed at the start of the first segment and those at the ends of segments, up to standstill. True if
/// there is no jump.
pub fn recursion(buffer: &Buffer, start: f64, speeds: &mut Vec<f64>) -> bool {
    speeds.clear();
    speeds.push(start);
    let mut sound = true;
    let mut speed = start;
    for i in 0.. {
        let situation =
            Situation { segment: buffer.segment(i), start: speed, allowable: buffer.limit(i + 1) };
        let step = if i == 0 { acceleration::stage(&situation) } else { deceleration::stage(&situation) };
        speed = match step {
            Step::Joined(speed) => speed,
            Step::Jump(speed) => {
                sound = false;
                speed
            }
        };
        speeds.push(speed);
        if speed == 0.0 || situation.allowable.is_none() {
            break;
        }
    }
    sound
}

/// The acceleration stage: the highest possible speed at the end of the segment (4.3.1.1).
pub mod acceleration {
    use super::{Situation, Step};

    pub fn stage(at: &Situation) -> Step {
        unobstructed(at)
            .or_else(|| limited(at))
            .or_else(|| limited_decelerating(at))
            .or_else(|| jerk_constrained(at))
            .or_else(|| violating(at))
            .unwrap_or_else(|| end_of_buffer(at))
    }

    /// a) No limit in the way: the greatest rise.
    pub fn unobstructed(at: &Situation) -> Option<Step> {
        let highest = at.segment.limits.highest(at.start, at.segment.length);
        (highest <= at.limit()).then_some(Step::Joined(highest))
    }

    /// b) The limit ends the rise before the length does.
    pub fn limited(at: &Situation) -> Option<Step> {
        let limit = at.limit();
        (limit >= at.start && at.segment.limits.highest(at.start, at.segment.length) > limit)
            .then_some(Step::Joined(limit))
    }

    /// c) The limit is lower than the speed at the start and within reach.
    pub fn limited_decelerating(at: &Situation) -> Option<Step> {
        let limit = at.limit();
        (limit < at.start && at.segment.joins(at.start, limit)).then_some(Step::Joined(limit))
    }

    /// d) The limit lies in the dead spot: the highest speed below it.
    pub fn jerk_constrained(at: &Situation) -> Option<Step> {
        let limit = at.limit();
        if limit >= at.start || at.segment.joins(at.start, limit) || !at.fall().stops() {
            return None;
        }
        at.fall().reach().lower.filter(|&lower| lower < limit).map(Step::Joined)
    }

    /// e) The limit is below all speeds within reach.
    pub fn violating(at: &Situation) -> Option<Step> {
        at.allowable.map(Step::Jump)
    }

    /// f) The segment is the last and too short to stop.
    pub fn end_of_buffer(_: &Situation) -> Step {
        Step::Jump(0.0)
    }
}

/// The deceleration stage: the lowest possible speed at the end of the segment (4.3.1.2).
pub mod deceleration {
    use super::{Situation, Step};

    pub fn stage(at: &Situation) -> Step {
        stopped(at)
            .or_else(|| end_of_buffer(at))
            .or_else(|| unobstructed(at))
            .unwrap_or_else(|| violating(at))
    }

    /// a) No limit in the way: the greatest fall.
    pub fn unobstructed(at: &Situation) -> Option<Step> {
        let lowest = at.fall().lowest();
        (lowest <= at.limit()).then_some(Step::Joined(lowest))
    }

    /// b) The limit is below all speeds within reach.
    pub fn violating(at: &Situation) -> Step {
        Step::Jump(at.limit())
    }

    /// c) The segment is the last and too short to stop.
    pub fn end_of_buffer(at: &Situation) -> Option<Step> {
        at.allowable.is_none().then_some(Step::Jump(0.0))
    }

    /// d) Standstill.
    pub fn stopped(at: &Situation) -> Option<Step> {
        at.fall().stops().then_some(Step::Joined(0.0))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::s_curve::transition::Limits;

    /// Perfect S-curves with J = 1: a rise by ΔV from V takes (2 V + ΔV) √ΔV, a fall (2 V − ΔV) √ΔV.
    fn segment(length: f64) -> Segment {
        let limits = Limits { acceleration: 10.0, jerk: 1.0 };
        Segment { length, allowable: 5.0, desired: 5.0, limits, junction: f64::INFINITY }
    }

    fn with<T>(length: f64, start: f64, allowable: impl Into<Option<f64>>, f: impl Fn(&Situation) -> T) -> T {
        f(&Situation { segment: &segment(length), start, allowable: allowable.into() })
    }

    fn joined(step: Option<Step>) -> f64 {
        match step {
            Some(Step::Joined(speed)) => speed,
            other => panic!("{other:?}"),
        }
    }

    #[test]
    fn an_unobstructed_rise_takes_the_whole_length() {
        // From 1 to 2 mm/s: 3 mm.
        assert!((joined(with(3.0, 1.0, 2.1, acceleration::unobstructed)) - 2.0).abs() < 1e-15);
        assert_eq!(with(3.0, 1.0, 1.9, acceleration::unobstructed), None);
        assert!((joined(Some(with(3.0, 1.0, 2.1, acceleration::stage))) - 2.0).abs() < 1e-15);
    }

    #[test]
    fn a_limited_rise_ends_at_the_limit() {
        assert_eq!(joined(with(3.0, 1.0, 1.9, acceleration::limited)), 1.9);
        assert_eq!(with(3.0, 1.0, 2.1, acceleration::limited), None);
        assert_eq!(with(3.0, 1.0, 0.9, acceleration::limited), None);
        assert_eq!(with(3.0, 1.0, 1.9, acceleration::stage), Step::Joined(1.9));
    }

    #[test]
    fn a_lower_limit_is_met_where_the_length_suffices() {
        // From 1 to 0.75 mm/s: 1.75·½ mm.
        assert_eq!(joined(with(0.875, 1.0, 0.75, acceleration::limited_decelerating)), 0.75);
        assert_eq!(with(0.874, 1.0, 0.75, acceleration::limited_decelerating), None);
        assert_eq!(with(0.875, 1.0, 0.75, acceleration::stage), Step::Joined(0.75));
    }

    #[test]
    fn a_limit_in_the_dead_spot_leaves_the_highest_speed_below() {
        // 1.05 mm from 1 mm/s: ΔV = A² with 2 A − A³ = 1.05 leaves [0, 0.17…] and [0.5…, 1].
        let lower = joined(with(1.05, 1.0, 0.4, acceleration::jerk_constrained));
        let peak = (1.0 - lower).sqrt();
        assert!((2.0 * peak - peak.powi(3) - 1.05).abs() < 1e-14 && lower < 1.0 / 3.0);
        assert_eq!(with(1.05, 1.0, 0.4, acceleration::stage), Step::Joined(lower));
        assert_eq!(with(1.05, 1.0, 0.9, acceleration::jerk_constrained), None);
        assert_eq!(with(1.05, 1.0, 0.1, acceleration::jerk_constrained), None);
        assert_eq!(with(0.95, 1.0, 0.4, acceleration::jerk_constrained), None);
    }

    #[test]
    fn a_limit_out_of_reach_is_violated() {
        // Standstill takes 1 mm, 0.4 mm/s 1.4·√0.6 = 1.08 mm.
        assert_eq!(with(0.95, 1.0, 0.4, acceleration::stage), Step::Jump(0.4));
        assert_eq!(with(0.95, 1.0, 0.4, acceleration::violating), Some(Step::Jump(0.4)));
        assert_eq!(with(0.95, 1.0, None, acceleration::violating), None);
    }

    #[test]
    fn the_end_of_the_buffer_too_near_to_stop_is_a_jump() {
        assert_eq!(with(0.95, 1.0, None, acceleration::stage), Step::Jump(0.0));
        assert_eq!(with(0.95, 1.0, None, acceleration::end_of_buffer), Step::Jump(0.0));
        assert_eq!(with(1.0, 1.0, None, acceleration::stage), Step::Joined(0.0));
    }

    #[test]
    fn an_unobstructed_fall_is_the_greatest() {
        assert!((joined(with(0.875, 1.0, 0.8, deceleration::unobstructed)) - 0.75).abs() < 1e-15);
        assert_eq!(with(0.875, 1.0, 0.7, deceleration::unobstructed), None);
        assert!((joined(Some(with(0.875, 1.0, 0.8, deceleration::stage))) - 0.75).abs() < 1e-15);
    }

    #[test]
    fn a_fall_too_slow_for_a_limit_violates_it() {
        assert_eq!(with(0.875, 1.0, 0.7, deceleration::stage), Step::Jump(0.7));
        assert_eq!(with(0.875, 1.0, 0.7, deceleration::violating), Step::Jump(0.7));
    }

    #[test]
    fn a_fall_that_meets_the_end_of_the_buffer_jumps_to_standstill() {
        assert_eq!(with(0.875, 1.0, None, deceleration::stage), Step::Jump(0.0));
        assert_eq!(with(0.875, 1.0, None, deceleration::end_of_buffer), Some(Step::Jump(0.0)));
        assert_eq!(with(0.875, 1.0, 0.8, deceleration::end_of_buffer), None);
    }

    #[test]
    fn a_fall_that_can_stop_stops() {
        assert_eq!(with(1.0, 1.0, 0.5, deceleration::stage), Step::Joined(0.0));
        assert_eq!(with(1.0, 1.0, None, deceleration::stopped), Some(Step::Joined(0.0)));
        assert_eq!(with(0.99, 1.0, 0.5, deceleration::stopped), None);
    }

    #[test]
    fn a_recursion_rises_once_and_falls_until_it_stands() {
        // 1 mm from rest: to 1 mm/s; 0.875 mm to 0.75 mm/s; standstill from there takes 0.75^1.5 = 0.65 mm.
        let mut segments = [1.0, 0.875, 0.7, 9.0].map(segment);
        let mut speeds = vec![];
        assert!(recursion(&segments.into_iter().collect(), 0.0, &mut speeds));
        assert_eq!(speeds.len(), 4);
        for (speed, expected) in speeds.iter().zip([0.0, 1.0, 0.75, 0.0]) {
            assert!((speed - expected).abs() < 1e-14, "{speeds:?}");
        }
        // A limit of 0.5 mm/s after the second segment is too low: a jump, and on from there.
        segments[1].junction = 0.5;
        assert!(!recursion(&segments.into_iter().collect(), 0.0, &mut speeds));
        assert_eq!(speeds[2..], [0.5, 0.0]);
    }
}
