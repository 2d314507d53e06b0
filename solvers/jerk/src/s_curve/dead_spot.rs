//! Computes the speeds that a fall from a speed V [mm/s] can reach within a length [mm]: one region, or two with a dead spot
//! between them (Cheatham 2007, 4.3.4).
//!
//! A fall by ΔV has the length D = (V − ΔV/2) T(ΔV), concave in ΔV: small falls are short, the longest fall ends at a
//! third of V (with perfect S-curves), and a fall to standstill is shorter than that one. For lengths between that of
//! standstill and the longest, speeds in the middle cannot be reached.
//!
//! The thesis counts up to three usable A_max. As 4.15 has at most two positive roots (Descartes: −A³ + 2VJ A − ΔS J² changes
//! sign twice), the third end is the acceleration limit, from which falls with constant acceleration continue to standstill.

use super::transition::{retreat, Limits};

/// Greatest number of Newton steps on a concave function, from the feasible side. Few are needed, except near the longest fall,
/// where both roots meet and every step only halves the error.
const STEPS: usize = 48;
/// A step below this fraction of the root is only rounding.
const CONVERGED: f64 = 4.0 * f64::EPSILON;

/// The speeds that a fall from V can reach.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Reach {
    /// The upper region is [upper, V].
    pub upper: f64,
    /// The lower region is [0, lower]; None if there is only one region.
    pub lower: Option<f64>,
    /// Number of A_max that end the regions.
    pub usable: Usable,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Usable {
    One,
    Two,
    Three,
}

/// A fall from a speed V within a length.
#[derive(Clone, Copy, Debug)]
pub struct Fall {
    pub limits: Limits,
    pub start: f64,
    pub length: f64,
}

impl Fall {
    pub fn reach(&self) -> Reach {
        self.one_usable().or_else(|| self.two_usable()).unwrap_or_else(|| self.three_usable())
    }

    #[inline]
    pub fn stops(&self) -> bool {
        self.limits.joins(self.start, 0.0, self.length)
    }

    pub fn lowest(&self) -> f64 {
        if self.stops() {
            0.0
        } else {
            self.start_of_dead_spot()
        }
    }

    /// One region: from V down to where A_1 ends it, or to standstill. None if there are two regions.
    pub fn one_usable(&self) -> Option<Reach> {
        let one = |upper| Some(Reach { upper, lower: None, usable: Usable::One });
        if self.distance(self.longest()) <= self.length {
            one(0.0)
        } else if !self.stops() {
            one(self.start_of_dead_spot())
        } else {
            None
        }
    }

    /// Two regions of perfect S-curves: from V down to where A_1 ends it, and from where A_2 begins it down to standstill. None
    /// if A is reached.
    pub fn two_usable(&self) -> Option<Reach> {
        (self.start <= self.limits.full_change()).then(|| self.two_regions(Usable::Two))
    }

    /// Two regions; the lower one consists of perfect S-curves between A_2 and A_3, the acceleration limit, and of falls with
    /// constant acceleration from there down to standstill.
    pub fn three_usable(&self) -> Reach {
        self.two_regions(Usable::Three)
    }

    fn two_regions(&self, usable: Usable) -> Reach {
        Reach { upper: self.start_of_dead_spot(), lower: Some(self.end_of_dead_spot()), usable }
    }

    /// D(ΔV), in mm.
    fn distance(&self, change: f64) -> f64 {
        (self.start - 0.5 * change) * self.limits.duration(change)
    }

    /// dD/dΔV.
    fn slope(&self, change: f64) -> f64 {
        (self.start - 0.5 * change) * self.limits.duration_slope(change) - 0.5 * self.limits.duration(change)
    }

    /// The ΔV of the longest fall.
    fn longest(&self) -> f64 {
        let perfect = 2.0 / 3.0 * self.start;
        let full = self.limits.full_change();
        if perfect <= full {
            perfect
        } else {
            self.start - 0.5 * full
        }
    }

    /// The lowest speed of the upper region; the length must be shorter than the longest fall.
    fn start_of_dead_spot(&self) -> f64 {
        if self.length == 0.0 {
            return self.start;
        }
        let (full, longest) = (self.limits.full_change(), self.longest());
        let change = if full >= longest || self.length <= self.distance(full) {
            self.perfect_change()
        } else {
            // (2 V − ΔV)(ΔV + A²/J) = 2 A ΔS, the smaller root.
            let half = self.start - 0.5 * full;
            let c = 2.0 * (self.limits.acceleration * self.length - self.start * full);
            c / (half + (half * half - c).max(0.0).sqrt())
        };
        let speed = self.start - change.min(longest);
        retreat(speed, self.start, self.start, |end| self.limits.joins(self.start, end, self.length))
    }

    /// The smaller root A_1 of 4.15, p (2 V J − p²) = ΔS J², as ΔV. The left side is concave, so that Newton steps stay below the
    /// root.
    fn perfect_change(&self) -> f64 {
        let jerk = self.limits.jerk;
        let (linear, constant) = (2.0 * self.start * jerk, self.length * jerk * jerk);
        let mut p = constant / linear;
        for _ in 0..STEPS {
            let slope = linear - 3.0 * p * p;
            let step = (constant - p * (linear - p * p)) / slope;
            if slope <= 0.0 || step <= CONVERGED * p {
                break;
            }
            p += step;
        }
        p * p / jerk
    }

    /// The highest speed of the lower region; standstill must be within reach.
    fn end_of_dead_spot(&self) -> f64 {
        // D is concave, so that Newton steps from standstill stay above the root.
        let mut change = self.start;
        for _ in 0..STEPS {
            let step = (self.distance(change) - self.length) / self.slope(change);
            if step.is_nan() || step <= CONVERGED * change {
                break;
            }
            change -= step;
        }
        let speed = self.start - change.max(self.longest());
        retreat(speed.max(0.0), 0.0, self.start, |end| self.limits.joins(self.start, end, self.length))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// No acceleration limit within reach: perfect S-curves from 1 mm/s with J = 1 mm/s³.
    fn perfect(length: f64) -> Fall {
        Fall { limits: Limits { acceleration: 10.0, jerk: 1.0 }, start: 1.0, length }
    }

    // With V = J = 1 and ΔV = A², 4.15 is D = 2 A − A³: 1 at standstill (A = 1), 1.0887 at the longest (A² = 2/3).

    #[test]
    fn a_short_length_has_one_usable_acceleration() {
        // A = ½: 2/2 − 1/8 = 7/8; standstill takes 1.
        let reach = perfect(0.875).one_usable().unwrap();
        assert!((reach.upper - 0.75).abs() < 1e-15);
        assert_eq!(reach.lower, None);
        assert_eq!(perfect(0.875).lowest(), reach.upper);
    }

    #[test]
    fn a_length_over_the_longest_fall_has_one_region_down_to_standstill() {
        let reach = perfect(1.09).one_usable().unwrap();
        assert_eq!((reach.upper, reach.lower, reach.usable), (0.0, None, Usable::One));
    }

    #[test]
    fn two_usable_accelerations_leave_a_dead_spot() {
        // ΔS = 1: 2 A − A³ = 1 at A = 1 and A = (√5 − 1)/2: only standstill and speeds over 1 − A² are reached.
        let golden = 0.5 * (5.0_f64.sqrt() - 1.0);
        let fall = perfect(1.0);
        assert_eq!(fall.one_usable(), None);
        let reach = fall.reach();
        assert_eq!(reach.usable, Usable::Two);
        assert!((reach.upper - (1.0 - golden * golden)).abs() < 1e-15);
        assert!(reach.lower.unwrap() < 1e-15);
    }

    #[test]
    fn three_usable_accelerations_end_the_lower_region_at_the_limit() {
        // A = 0.9 < √V: perfect S-curves end at V − A² = 0.19 after 2 A − A³ = 1.071, standstill by constant acceleration
        // after ½ (1/0.9 + 0.9) = 1.00556.
        let limits = Limits { acceleration: 0.9, jerk: 1.0 };
        let fall = Fall { limits, start: 1.0, length: 1.075 };
        assert_eq!((fall.one_usable(), fall.two_usable()), (None, None));
        let reach = fall.three_usable();
        assert_eq!(reach, fall.reach());
        // The roots of 2 A − A³ = 1.075 beside the longest fall.
        for (speed, low, high) in [(reach.upper, 0.333, 0.6), (reach.lower.unwrap(), 0.19, 0.333)] {
            assert!(speed > low && speed < high);
            let peak = (1.0 - speed).sqrt();
            assert!((2.0 * peak - peak.powi(3) - 1.075).abs() < 1e-14);
        }
        // With ΔS = 1.06 the lower region begins on the falls of constant acceleration.
        assert!(Fall { length: 1.06, ..fall }.reach().lower.unwrap() < 0.19);
    }

    #[test]
    fn without_length_only_the_present_speed_is_reached() {
        assert_eq!(perfect(0.0).lowest(), 1.0);
        assert_eq!(Fall { start: 0.0, ..perfect(0.0) }.lowest(), 0.0);
        assert_eq!(Fall { start: 0.0, ..perfect(3.0) }.reach().upper, 0.0);
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(2000))]
        #[test]
        fn regions_hold_all_speeds_that_a_scan_finds(
            length in 0.0..1.3f64,
            acceleration in 0.2..1.5f64,
            scale in (-3.0..3.0f64).prop_map(|e| 10f64.powf(e)),
        ) {
            // The longest fall is about 1.0887 without acceleration limit, longer with: V²/(2 A) and more.
            let limits = Limits { acceleration: acceleration * scale, jerk: scale };
            let length = length * (0.5 / acceleration + 0.5 * acceleration).max(1.0) * scale;
            let fall = Fall { limits, start: scale, length };
            let reach = fall.reach();
            for i in 0..=200 {
                let end = scale * f64::from(i) / 200.0;
                let inside = end >= reach.upper || reach.lower.is_some_and(|lower| end <= lower);
                let near = |edge: f64| (end - edge).abs() < 1e-9 * scale;
                if !near(reach.upper) && !reach.lower.is_some_and(near) {
                    prop_assert_eq!(limits.joins(scale, end, length), inside, "{} {:?}", end, reach);
                }
            }
            prop_assert!(limits.joins(scale, reach.upper, length));
            prop_assert!(reach.lower.is_none_or(|lower| limits.joins(scale, lower, length)));
            prop_assert_eq!(fall.lowest(), if reach.lower.is_some() { 0.0 } else { reach.upper });
        }
    }
}
