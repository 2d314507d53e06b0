//! A segment: its length [mm] and its limits along the path [mm, s], with the checks of these numbers.

use super::transition::Limits;
use feedplan_planner::problem::Fault;

/// Range of lengths and limits, in which no product of three of them over- or underflows.
const LEAST: f64 = 1e-12;
const GREATEST: f64 = 1e15;
/// At an end with an acceleration below the limit, the remaining part of the section with jerk takes at least the fraction `LEFT`
/// of the time of the part that is cut off (see `section`), and at least the fraction `DIGITS` of the length: shorter sections
/// would be only rounding.
const LEFT: f64 = 1e-5;
const DIGITS: f64 = 1e3 * f64::EPSILON;
/// An acceleration below the limit by no more than this fraction counts as the limit.
const AT_LIMIT: f64 = 1e-9;

/// A segment of path. Both speeds are limits: `allowable` by the machine (`path_limits`), `desired` by the program.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Segment {
    /// In mm; 0 is allowed.
    pub length: f64,
    /// In mm/s.
    pub allowable: f64,
    /// In mm/s.
    pub desired: f64,
    pub limits: Limits,
    /// The speed limit where it meets the next segment, in mm/s: 0 for an exact stop, infinity for no limit of its own.
    pub junction: f64,
}

/// How a segment begins or ends.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SegmentEnd {
    /// In mm/s.
    pub speed: f64,
    /// The absolute value of the acceleration, in mm/s²: a segment begins speeding up and ends slowing down.
    pub acceleration: f64,
}

impl SegmentEnd {
    pub fn moving(speed: f64) -> Self {
        Self { speed, acceleration: 0.0 }
    }

    /// The change of speed since the acceleration was 0, in mm/s.
    fn gained(&self, jerk: f64) -> f64 {
        0.5 * self.acceleration * self.acceleration / jerk
    }

    /// The speed when the acceleration was 0, in mm/s: below 0 if the end is at rest.
    pub fn before_cut(&self, jerk: f64) -> f64 {
        self.speed - self.gained(jerk)
    }

    /// The length travelled since the acceleration was 0, in mm.
    fn cut_length(&self, jerk: f64) -> f64 {
        let time = self.acceleration / jerk;
        time * (self.speed - 2.0 / 3.0 * self.gained(jerk))
    }
}

impl Segment {
    /// The length of the segment plus the parts that are cut off at ends with an acceleration, in mm.
    pub fn uncut_length(&self, ends: [SegmentEnd; 2]) -> f64 {
        let [from, to] = ends.map(|end| end.cut_length(self.limits.jerk));
        self.length + from + to
    }

    /// The time in s that remains of the section with jerk at an end with an acceleration; `bend` is the time of the whole
    /// section. 0 if the acceleration is the limit.
    pub fn bend_left(&self, end: SegmentEnd, bend: f64) -> f64 {
        let cut = end.acceleration / self.limits.jerk;
        if bend - cut > AT_LIMIT * cut {
            bend - cut
        } else {
            0.0
        }
    }

    /// The least peak of the speed between two ends, in mm/s; infinite if an acceleration is above the limit.
    pub fn least_peak(&self, ends: [SegmentEnd; 2]) -> f64 {
        let Limits { acceleration, jerk } = self.limits;
        let [from, to] = ends.map(|end| {
            let (a, length) = (end.acceleration, DIGITS * self.length);
            let digits = (2.0 * length / a).sqrt().min((6.0 * length / jerk).cbrt());
            let at_limit = a == 0.0 || a >= (1.0 - AT_LIMIT) * acceleration;
            let left = if at_limit { 0.0 } else { digits.max(LEFT * a / jerk) };
            if a / jerk + left > (1.0 + AT_LIMIT) * acceleration / jerk {
                return f64::INFINITY;
            }
            end.before_cut(jerk) + jerk * (a / jerk + left).powi(2)
        });
        from.max(to)
    }

    /// Whether the segment can be crossed between two ends.
    pub fn can_cross(&self, ends: [SegmentEnd; 2]) -> bool {
        let peak = self.least_peak(ends);
        let [from, to] = ends.map(|end| end.before_cut(self.limits.jerk));
        let needed = || self.limits.distance(from, peak) + self.limits.distance(peak, to);
        peak <= self.speed() && needed() <= self.uncut_length(ends)
    }

    /// The speed limit inside the segment, in mm/s.
    #[inline]
    pub fn speed(&self) -> f64 {
        self.allowable.min(self.desired)
    }

    /// The speed limit where it meets the next segment, in mm/s.
    #[inline]
    pub fn speed_into(&self, next: &Self) -> f64 {
        self.speed().min(next.speed()).min(self.junction)
    }

    /// Whether a speed can change to the other within the segment's length, in either direction.
    #[inline]
    pub fn joins(&self, from: f64, to: f64) -> bool {
        self.limits.joins(from, to, self.length)
    }

    /// Checks every number; `number` names the segment in the message.
    pub fn check(&self, number: usize) -> Result<(), Fault> {
        let limits = [
            ("allowable speed", self.allowable, "mm/s"),
            ("desired speed", self.desired, "mm/s"),
            ("acceleration limit", self.limits.acceleration, "mm/s²"),
            ("jerk limit", self.limits.jerk, "mm/s³"),
        ];
        let in_range = |value| (LEAST..=GREATEST).contains(&value);
        let fault = |what| Err(Fault::Input { piece: Some(number), what });
        if self.length != 0.0 && !in_range(self.length) {
            return fault(format!(
                "the length of segment {number} is {} mm: give 0 or {LEAST:e} to {GREATEST:e} mm",
                self.length
            ));
        }
        for (name, value, unit) in limits {
            if !in_range(value) {
                return fault(format!(
                    "the {name} of segment {number} is {value} {unit}: give {LEAST:e} to {GREATEST:e} {unit}"
                ));
            }
        }
        if self.junction.is_nan() || self.junction < 0.0 {
            return fault(format!(
                "the junction speed after segment {number} is {} mm/s: give 0 or more",
                self.junction
            ));
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_segment_that_cannot_be_planned_is_named_with_the_remedy() {
        let limits = Limits { acceleration: 500.0, jerk: 5e4 };
        let good = Segment { length: 1.0, allowable: 90.0, desired: 80.0, limits, junction: f64::INFINITY };
        assert_eq!(good.check(7), Ok(()));
        assert_eq!(Segment { length: 0.0, ..good }.check(7), Ok(()));
        let message = |segment: Segment| segment.check(7).unwrap_err().to_string();
        assert_eq!(
            message(Segment { length: -1.0, ..good }),
            "the length of segment 7 is -1 mm: give 0 or 1e-12 to 1e15 mm"
        );
        assert_eq!(
            message(Segment { limits: Limits { jerk: f64::NAN, ..limits }, ..good }),
            "the jerk limit of segment 7 is NaN mm/s³: give 1e-12 to 1e15 mm/s³"
        );
        assert_eq!(
            message(Segment { junction: -1.0, ..good }),
            "the junction speed after segment 7 is -1 mm/s: give 0 or more"
        );
    }
}
