//! The backward recursion (Cheatham 2007, 4.3.2): from the standstill of the forward recursion back to its start, it
//! lowers the speeds at the ends of segments until every segment joins its ends.
//!
//! It first follows the forward recursion as if no profile were established: every speed is as high as the one after it allows,
//! and at most that of the forward recursion. Seen backward, rises have no dead spot, so that this only fails at the present
//! speed of the motion. In that case it joins the established profile, as early on the path as possible.

use super::buffer::Buffer;
use super::dead_spot::Fall;
use super::segment::Segment;

/// Sets `speeds` to those of the forward recursion, lowered until every segment joins its ends. If that fails at the start, they
/// begin with `established` speeds. Returns false if the whole established profile is to be kept.
pub fn recursion(
    buffer: &Buffer,
    established: impl Fn(usize) -> f64,
    forward: &[f64],
    speeds: &mut Vec<f64>,
) -> bool {
    speeds.clear();
    speeds.extend_from_slice(forward);
    for i in (1..speeds.len() - 1).rev() {
        speeds[i] = fresh::step(buffer.segment(i), speeds[i + 1], forward[i]);
    }
    fresh::first_segment(buffer.segment(0), speeds[1], forward[0]) || connect(buffer, established, speeds)
}

/// Joins the new speeds to the established profile. It begins at the first segment where the new speed at the start is not lower
/// than the established one, or that leads from the established speed to a new speed at its end that is not lower than the
/// established one. From there it goes back until the established speed is within reach. False if there is no such segment, or if
/// a step back fails.
fn connect(buffer: &Buffer, established: impl Fn(usize) -> f64, speeds: &mut [f64]) -> bool {
    let last = speeds.len() - 1;
    let meets = |&i: &usize| {
        let joined = buffer.segment(i).joins(established(i), speeds[i + 1]);
        speeds[i] >= established(i) || joined && speeds[i + 1] >= established(i + 1)
    };
    let Some(crossing) = (1..last).find(meets) else { return false };
    for i in (1..=crossing).rev() {
        let at = established::Situation {
            segment: buffer.segment(i),
            end: speeds[i + 1],
            established: established(i),
            limit: buffer.limit(i).unwrap_or(0.0),
        };
        match established::step(&at) {
            Some(established::Step::Converged) => {
                for j in 1..=i {
                    speeds[j] = established(j);
                }
                return true;
            }
            Some(established::Step::Kept(speed)) => speeds[i] = speed,
            None => return false,
        }
    }
    fresh::first_segment(buffer.segment(0), speeds[1], speeds[0])
}

/// No profile established (4.3.2.2): follow the forward recursion.
pub mod fresh {
    use super::Segment;

    /// The speed at the start of a segment with the speed `end` at its end.
    pub fn step(segment: &Segment, end: f64, forward: f64) -> f64 {
        converged(segment, end, forward).unwrap_or_else(|| nonconverged(segment, end))
    }

    /// a) The forward recursion's speed is out of reach: the highest speed.
    pub fn nonconverged(segment: &Segment, end: f64) -> f64 {
        segment.limits.highest(end, segment.length)
    }

    /// b) The forward recursion's speed is within reach.
    pub fn converged(segment: &Segment, end: f64, forward: f64) -> Option<f64> {
        segment.joins(forward, end).then_some(forward)
    }

    /// c) The first segment must start at the present speed of the motion.
    pub fn first_segment(segment: &Segment, end: f64, start: f64) -> bool {
        segment.joins(start, end)
    }
}

/// A profile is established (4.3.2.1): come back to it.
pub mod established {
    use super::{Fall, Segment};

    /// One segment on the way back.
    #[derive(Clone, Copy, Debug)]
    pub struct Situation<'a> {
        pub segment: &'a Segment,
        /// The new speed at the segment's end.
        pub end: f64,
        /// The established speed at the segment's start.
        pub established: f64,
        /// The speed limit at the segment's start.
        pub limit: f64,
    }

    /// The speed at the segment's start.
    #[derive(Clone, Copy, Debug, PartialEq)]
    pub enum Step {
        /// The established speed, as at all segments before.
        Converged,
        /// A speed higher than the established one.
        Kept(f64),
    }

    /// The speed at the segment's start; None if all speeds within reach are lower than the established one or break the limit.
    pub fn step(at: &Situation) -> Option<Step> {
        converged_increasing(at)
            .or_else(|| converged_decreasing(at))
            .or_else(|| jerk_limited(at))
            .or_else(|| decreasing(at))
            .filter(|step| !matches!(step, Step::Kept(speed) if *speed > at.limit))
    }

    /// a) The established profile is higher and within reach.
    pub fn converged_increasing(at: &Situation) -> Option<Step> {
        (at.established >= at.end && at.segment.joins(at.established, at.end)).then_some(Step::Converged)
    }

    /// b) The established profile lies in the dead spot: the lowest speed above it.
    pub fn jerk_limited(at: &Situation) -> Option<Step> {
        if !fall(at).stops() || at.established >= at.end {
            return None;
        }
        let reach = fall(at).reach();
        let dead = reach.lower.is_some_and(|lower| at.established > lower && at.established < reach.upper);
        dead.then_some(Step::Kept(reach.upper))
    }

    /// c) The established profile is lower than all speeds within reach: the lowest of these.
    pub fn decreasing(at: &Situation) -> Option<Step> {
        let lowest = fall(at).lowest();
        (at.established < lowest).then_some(Step::Kept(lowest))
    }

    /// d) The established profile is lower and within reach.
    pub fn converged_decreasing(at: &Situation) -> Option<Step> {
        (at.established < at.end && at.segment.joins(at.established, at.end)).then_some(Step::Converged)
    }

    /// Seen backward, a rise is a fall.
    fn fall(at: &Situation) -> Fall {
        Fall { limits: at.segment.limits, start: at.end, length: at.segment.length }
    }
}

#[cfg(test)]
mod tests {
    use super::established::{Situation, Step};
    use super::*;
    use crate::s_curve::transition::Limits;

    /// Perfect S-curves with J = 1: between V and V + ΔV lie (2 V + ΔV) √ΔV.
    fn segment(length: f64) -> Segment {
        let limits = Limits { acceleration: 10.0, jerk: 1.0 };
        Segment { length, allowable: 5.0, desired: 5.0, limits, junction: f64::INFINITY }
    }

    fn with<T>(length: f64, end: f64, established: f64, f: impl Fn(&Situation) -> T) -> T {
        f(&Situation { segment: &segment(length), end, established, limit: 5.0 })
    }

    #[test]
    fn nonconverged_keeps_the_highest_speed() {
        // From 2 mm/s down to 1 mm/s: 3 mm.
        assert!((fresh::nonconverged(&segment(3.0), 1.0) - 2.0).abs() < 1e-15);
        assert!((fresh::step(&segment(3.0), 1.0, 2.1) - 2.0).abs() < 1e-15);
    }

    #[test]
    fn converged_follows_the_forward_recursion() {
        assert_eq!(fresh::converged(&segment(3.0), 1.0, 1.9), Some(1.9));
        assert_eq!(fresh::converged(&segment(3.0), 1.0, 2.1), None);
        assert_eq!(fresh::step(&segment(3.0), 1.0, 1.9), 1.9);
    }

    #[test]
    fn the_first_segment_starts_at_the_speed_of_the_motion() {
        assert!(fresh::first_segment(&segment(1.0), 1.0, 0.0));
        assert!(!fresh::first_segment(&segment(0.9), 1.0, 0.0));
        assert!(!fresh::first_segment(&segment(3.0), 1.0, 2.1));
    }

    #[test]
    fn converged_increasing_joins_a_higher_profile() {
        assert_eq!(with(3.0, 1.0, 1.9, established::converged_increasing), Some(Step::Converged));
        assert_eq!(with(3.0, 1.0, 2.1, established::converged_increasing), None);
        assert_eq!(with(3.0, 1.0, 2.1, established::step), None);
        assert_eq!(with(3.0, 1.0, 1.9, established::step), Some(Step::Converged));
    }

    #[test]
    fn converged_decreasing_joins_a_lower_profile() {
        // From 0.75 up to 1 mm/s: 1.75·½ mm.
        assert_eq!(with(0.875, 1.0, 0.75, established::converged_decreasing), Some(Step::Converged));
        assert_eq!(with(0.875, 1.0, 0.7, established::converged_decreasing), None);
        assert_eq!(with(0.875, 1.0, 0.75, established::step), Some(Step::Converged));
    }

    #[test]
    fn decreasing_keeps_the_lowest_speed() {
        let Some(Step::Kept(speed)) = with(0.875, 1.0, 0.7, established::decreasing) else { panic!() };
        assert!((speed - 0.75).abs() < 1e-15);
        assert_eq!(with(0.875, 1.0, 0.7, established::step), Some(Step::Kept(speed)));
        assert_eq!(with(0.875, 1.0, 0.8, established::decreasing), None);
    }

    #[test]
    fn jerk_limited_keeps_the_speed_above_the_dead_spot() {
        // 1.05 mm before 1 mm/s: [0, 0.17…] and [0.5…, 1] are within reach.
        let Some(Step::Kept(speed)) = with(1.05, 1.0, 0.4, established::jerk_limited) else { panic!() };
        let peak = (1.0 - speed).sqrt();
        assert!((2.0 * peak - peak.powi(3) - 1.05).abs() < 1e-14 && speed > 0.4);
        assert_eq!(with(1.05, 1.0, 0.4, established::step), Some(Step::Kept(speed)));
        assert_eq!(with(1.05, 1.0, 0.1, established::jerk_limited), None);
        assert_eq!(with(0.95, 1.0, 0.4, established::jerk_limited), None);
    }

    #[test]
    fn a_speed_over_the_limit_is_not_kept() {
        let at = Situation { segment: &segment(0.875), end: 1.0, established: 0.7, limit: 0.74 };
        assert_eq!(established::step(&at), None);
    }

    #[test]
    fn a_jump_of_the_forward_recursion_is_mended() {
        // Forward: 0, 1, jump to 0.5, 0. Backward 0.875 mm before 0.5 mm/s: (1 + ΔV) √ΔV = 0.875 gives 0.897….
        let buffer: Buffer = [1.0, 0.875, 0.7].map(segment).into_iter().collect();
        let mut speeds = vec![];
        assert!(recursion(&buffer, |_| 0.0, &[0.0, 1.0, 0.5, 0.0], &mut speeds));
        assert_eq!((speeds[0], speeds[2], speeds[3]), (0.0, 0.5, 0.0));
        let change: f64 = speeds[1] - 0.5;
        assert!(((1.0 + change) * change.sqrt() - 0.875).abs() < 1e-14);
    }

    #[test]
    fn a_start_out_of_reach_keeps_the_established_beginning() {
        // The motion has 2 mm/s and its plan stands after 3 segments; the new plan jumps to 0.1 mm/s after the first.
        let buffer: Buffer = [1.3, 3.0, 3.0, 3.0].map(segment).into_iter().collect();
        let established = [2.0, 1.9, 1.0, 0.0, 0.0];
        let mut speeds = vec![];
        assert!(recursion(&buffer, |i| established[i], &[2.0, 0.1, 2.0, 1.5, 0.0], &mut speeds));
        assert_eq!(speeds, [2.0, 1.9, 2.0, 1.5, 0.0]);
        for i in 0..4 {
            assert!(buffer.segment(i).joins(speeds[i], speeds[i + 1]));
        }
        // No new speed is above the established profile, which is kept.
        let established = [2.0, 1.9, 1.8, 0.0];
        assert!(!recursion(&buffer, |i| established[i], &[2.0, 0.1, 0.0], &mut speeds));
    }
}
