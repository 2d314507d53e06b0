//! The S-curve: the quickest change of speed without acceleration at either end (Cheatham 2007, 4.6–4.15).
//!
//! Symbols: A acceleration limit in mm/s², J jerk limit in mm/s³, V speeds in mm/s, ΔV = |V₁ − V₀|. Up to ΔV = A²/J the
//! acceleration rises to A_max = √(J ΔV) and falls at once, T = 2 A_max/J (4.9). Beyond, A is held between, and T =
//! ΔV/A + A/J. The length in mm is (V₀ + V₁) T/2 either way; 4.14 and 4.15 are the case without constant acceleration.

/// Greatest number of steps of `retreat`: they double, from one unit in the last place up to the number itself.
const RETREATS: usize = 60;
/// Steps of Newton's method on a cubic, starting at most half above its root: five reach rounding.
const CUBIC_STEPS: usize = 6;

/// The limits along the path of one segment.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Limits {
    /// A, in mm/s².
    pub acceleration: f64,
    /// J, in mm/s³.
    pub jerk: f64,
}

impl Limits {
    /// A²/J: the change of speed that just reaches A, in mm/s.
    #[inline]
    pub fn full_change(&self) -> f64 {
        self.acceleration * self.acceleration / self.jerk
    }

    /// T: the time of a change of speed, in seconds.
    #[inline]
    pub fn duration(&self, change: f64) -> f64 {
        if change <= self.full_change() {
            2.0 * (change / self.jerk).sqrt()
        } else {
            change / self.acceleration + self.acceleration / self.jerk
        }
    }

    /// dT/dΔV; infinite at 0.
    #[inline]
    pub fn duration_slope(&self, change: f64) -> f64 {
        if change <= self.full_change() {
            1.0 / (change * self.jerk).sqrt()
        } else {
            1.0 / self.acceleration
        }
    }

    /// The change of speed in mm/s that takes this time: the inverse of `duration`.
    pub fn change(&self, duration: f64) -> f64 {
        let full = 2.0 * self.acceleration / self.jerk;
        if duration <= full {
            0.25 * self.jerk * duration * duration
        } else {
            self.acceleration * (duration - 0.5 * full)
        }
    }

    /// The least length in mm for a change between two speeds, to the last bit the same both ways.
    #[inline]
    pub fn distance(&self, from: f64, to: f64) -> f64 {
        0.5 * (from + to) * self.duration((from - to).abs())
    }

    /// Whether a speed can change to the other within a length.
    #[inline]
    pub fn joins(&self, from: f64, to: f64, length: f64) -> bool {
        self.distance(from, to) <= length
    }

    /// The highest speed, in mm/s, that a rise reaches within a length: the positive root of 4.14 or, with constant
    /// acceleration, of (2 V₀ + ΔV)(ΔV + A²/J) = 2 A ΔS.
    pub fn highest(&self, start: f64, length: f64) -> f64 {
        if length == 0.0 {
            return start;
        }
        let Self { acceleration, jerk } = *self;
        let peak = cubic_root(2.0 * start * jerk, length * jerk * jerk);
        let change = if peak <= acceleration {
            peak * peak / jerk
        } else {
            let full = self.full_change();
            let (half, c) = (start + 0.5 * full, 2.0 * (acceleration * length - start * full));
            c / (half + (half * half + c).sqrt())
        };
        retreat(start + change, start, start + change, |end| self.joins(start, end, length))
    }
}

/// The positive root of p³ + a p = b with a, b ≥ 0. Newton's method starts above it, where one term alone equals b.
fn cubic_root(a: f64, b: f64) -> f64 {
    let mut p = b.cbrt().min(b / a);
    for _ in 0..CUBIC_STEPS {
        p -= (p * (p * p + a) - b) / (3.0 * p * p + a);
    }
    p
}

/// The first speed that `fits`, searched from `speed` towards `safe`: a computed root has rounding errors of numbers of this
/// `size`.
pub fn retreat(speed: f64, safe: f64, size: f64, fits: impl Fn(f64) -> bool) -> f64 {
    let (mut speed, mut step) = (speed, f64::EPSILON * size);
    for _ in 0..RETREATS {
        if fits(speed) {
            return speed;
        }
        speed = if speed > safe { (speed - step).max(safe) } else { (speed + step).min(safe) };
        step *= 2.0;
    }
    safe
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const LIMITS: Limits = Limits { acceleration: 500.0, jerk: 50_000.0 };

    #[test]
    fn a_perfect_s_curve_by_hand() {
        // A²/J = 5 mm/s: from 0 to 5 mm/s the acceleration just reaches 500 mm/s², 0.01 s up and 0.01 s down.
        assert_eq!(LIMITS.full_change(), 5.0);
        assert_eq!(LIMITS.duration(5.0), 0.02);
        assert_eq!(LIMITS.distance(0.0, 5.0), 0.05);
    }

    #[test]
    fn a_rise_with_constant_acceleration_by_hand() {
        // 0 to 100 mm/s: 0.01 s up, 0.19 s at 500 mm/s², 0.01 s down; half the speed on average.
        assert!((LIMITS.duration(100.0) - 0.21).abs() < 1e-15);
        assert!((LIMITS.distance(0.0, 100.0) - 10.5).abs() < 1e-12);
        assert!((LIMITS.highest(0.0, 10.5) - 100.0).abs() < 1e-12);
    }

    #[test]
    fn lengths_of_rise_and_fall_are_those_of_the_thesis() {
        // 4.14 and 4.15, and the parts 4.12 (its last term A³/(6 J²)) and 4.13 that make the first.
        let (start, peak, jerk) = (7.0, 300.0_f64, 50_000.0_f64);
        let (cubed, change) = (peak.powi(3) / (jerk * jerk), peak * peak / jerk);
        let concave = start * peak / jerk + cubed / 6.0;
        let convex = (2.0 * start + change) * peak / (2.0 * jerk) + cubed / 3.0;
        let rise = 2.0 * start * peak / jerk + cubed;
        assert!((concave + convex - rise).abs() < 1e-15);
        assert!((LIMITS.distance(start, start + change) - rise).abs() < 1e-15);
        let fall = 2.0 * start * peak / jerk - cubed;
        assert!((LIMITS.distance(start, start - change) - fall).abs() < 1e-15);
    }

    #[test]
    fn zero_length_leaves_the_speed_as_it_is() {
        assert_eq!(LIMITS.highest(0.0, 0.0), 0.0);
        assert_eq!(LIMITS.highest(30.0, 0.0), 30.0);
        assert_eq!(LIMITS.distance(30.0, 30.0), 0.0);
    }

    proptest! {
        #[test]
        fn the_highest_speed_uses_up_the_length(
            start in prop_oneof![Just(0.0), 1e-6..1e4f64],
            length in (-9.0..6.0f64).prop_map(|e| 10f64.powf(e)),
            acceleration in (-3.0..6.0f64).prop_map(|e| 10f64.powf(e)),
            jerk in (-3.0..9.0f64).prop_map(|e| 10f64.powf(e)),
        ) {
            let limits = Limits { acceleration, jerk };
            let highest = limits.highest(start, length);
            prop_assert!(highest >= start);
            prop_assert!(limits.joins(start, highest, length));
            let above = highest + 1e-12 * highest;
            prop_assert!(!limits.joins(start, above, length), "{} < {}", limits.distance(start, above), length);
        }

        #[test]
        fn change_is_the_inverse_of_duration(change in (-9.0..9.0f64).prop_map(|e| 10f64.powf(e))) {
            let again = LIMITS.change(LIMITS.duration(change));
            prop_assert!((again / change - 1.0).abs() < 1e-12);
        }

        #[test]
        fn the_slope_of_duration_is_its_difference(change in 0.01..50.0f64) {
            let step = 1e-6 * change;
            let difference = (LIMITS.duration(change + step) - LIMITS.duration(change - step)) / (2.0 * step);
            prop_assert!((LIMITS.duration_slope(change) / difference - 1.0).abs() < 1e-6);
        }
    }
}
