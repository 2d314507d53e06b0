//! A segment: its length [mm] and its limits along the path [mm, s], with the checks of these numbers.

use super::transition::Limits;
use feedplan_planner::problem::Fault;

/// Range of lengths and limits, in which no product of three of them over- or underflows.
const LEAST: f64 = 1e-12;
const GREATEST: f64 = 1e15;

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

impl Segment {
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

    /// Whether a speed can change to the other within its length, in either direction.
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
