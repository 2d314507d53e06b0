//! Computes the accelerations with which the lines of a chain turn back, at rest only for an instant: the greatest with which all
//! lines can be crossed.
//!
//! The greater the acceleration at the start of a line and the deceleration at its end, the less time the line takes: it is
//! nowhere slower than with lesser ones. But the acceleration must change from its value at an end to 0, and this takes some
//! length. The acceleration at one end of a line is therefore at most a number that rises with the acceleration at the other end.
//! There are greatest accelerations within all these bounds, and each line takes its least time with them. They are found from
//! the greatest accelerations of the axes by lowering both ends of each line that is too short, until no line is too short.

use feedplan_geometry::bisection::boundary;

use crate::s_curve::{Segment, SegmentEnd};

/// A line of a chain, and the speeds at its ends in mm/s, which are 0 where it turns back.
#[derive(Clone, Copy, Debug)]
pub struct Line {
    pub segment: Segment,
    pub speeds: [f64; 2],
}

impl Line {
    /// The ends of the line with these accelerations, in mm/s².
    pub fn ends(&self, accelerations: [f64; 2]) -> [SegmentEnd; 2] {
        [0, 1].map(|end| SegmentEnd { speed: self.speeds[end], acceleration: accelerations[end] })
    }

    fn can_cross(&self, accelerations: [f64; 2]) -> bool {
        self.segment.can_cross(self.ends(accelerations))
    }

    /// Both accelerations, lowered to at most the greatest common value with which the line can be crossed.
    fn lowered(&self, [from, to]: [f64; 2]) -> [f64; 2] {
        let at_most = |most: f64| [from.min(most), to.min(most)];
        let [most, _] = boundary(0.0, from.max(to), |most| self.can_cross(at_most(most)));
        at_most(most)
    }

    /// The greatest acceleration up to `most` at one end with which the line can be crossed, whatever the acceleration at the
    /// other end.
    pub fn alone(&self, end: usize, most: f64) -> f64 {
        let mut accelerations = [0.0; 2];
        accelerations[end] = most;
        if self.can_cross(accelerations) {
            most
        } else {
            self.lowered(accelerations)[end]
        }
    }
}

/// Lowers the accelerations in mm/s² at the turns between subruns and at both ends of the chain, until each line can be crossed.
pub fn lower(lines: &[Option<Line>], accelerations: &mut [f64]) {
    let mut settled = false;
    while !settled {
        settled = true;
        for i in (0..lines.len()).chain((0..lines.len()).rev()) {
            let own = [accelerations[i], accelerations[i + 1]];
            if let Some(line) = lines[i].filter(|line| !line.can_cross(own)) {
                accelerations[i..i + 2].copy_from_slice(&line.lowered(own));
                settled = false;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::s_curve::{self, Limits};
    use proptest::prelude::*;

    const LIMITS: Limits = Limits { acceleration: 3000.0, jerk: 5e4 };

    fn line(length: f64, speed: f64) -> Option<Line> {
        let segment =
            Segment { length, allowable: speed, desired: f64::INFINITY, limits: LIMITS, junction: 0.0 };
        Some(Line { segment, speeds: [0.0; 2] })
    }

    fn time(line: &Option<Line>, accelerations: [f64; 2]) -> f64 {
        let line = line.expect("a line");
        s_curve::cross(&line.segment, line.ends(accelerations)).iter().map(|section| section.duration).sum()
    }

    #[test]
    fn short_strokes_alike_swing_with_jerk_of_one_sign_each() {
        // From a to −a at −J: L = 2/3 a³/J² in the time 2 a/J; a little less where the next one has less.
        let mut a = vec![0.0, 3000.0, 3000.0, 3000.0, 3000.0, 0.0];
        let lines = [line(2.0, 250.0); 5];
        lower(&lines, &mut a);
        let expected = (1.5 * 2.0 * 5e4f64.powi(2)).cbrt();
        assert!(a[2] == a[3] && (1.0 - a[2] / expected).abs() < 3e-5, "{a:?}");
        assert!((time(&lines[2], [a[2], a[3]]) / (2.0 * expected / 5e4) - 1.0).abs() < 1e-8);
        // The first stroke starts without acceleration: a³/3 + (a²/2)^1.5 = L J².
        let first = (2.0 * 5e4f64.powi(2) / (1.0 / 3.0 + 0.125f64.sqrt())).cbrt();
        assert!((a[1] / first - 1.0).abs() < 3e-5, "{} for {first}", a[1]);
    }

    #[test]
    fn long_strokes_turn_back_with_the_greatest_acceleration() {
        let mut a = vec![0.0, 3000.0, 3000.0, 0.0];
        let lines = [line(100.0, 250.0); 3];
        lower(&lines, &mut a);
        assert_eq!(a, [0.0, 3000.0, 3000.0, 0.0]);
        // A rise that begins with the acceleration A is one that begins at the speed −A²/(2 J) without acceleration, with its
        // first part cut off, which takes A/J and has the length −A³/(3 J²). The rise takes V/A + A/(2 J) and has the length V/2
        // (V/A + A/J) − A³/(24 J²).
        let (v, a, j) = (250.0, 3000.0, 5e4);
        let rise = v / a + 0.5 * a / j;
        let way = 0.5 * v * (v / a + a / j) - (a * a / j) * (a / j) / 24.0;
        let expected = 2.0 * rise + (100.0 - 2.0 * way) / v;
        assert!(
            (time(&lines[1], [a, a]) - expected).abs() < 1e-12,
            "{} for {expected}",
            time(&lines[1], [a, a])
        );
    }

    fn lengths() -> impl Strategy<Value = (f64, f64)> {
        (-2.0..2.0f64, 0.0..2.7f64).prop_map(|(length, speed)| (10f64.powf(length), 10f64.powf(speed)))
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(500))]
        #[test]
        fn no_lower_acceleration_is_quicker_and_no_greater_one_possible(
            lengths in prop::collection::vec(lengths(), 2..8),
            which in 0..7usize,
            part in 0.0..1.0f64,
        ) {
            let lines: Vec<Option<Line>> = lengths.iter().map(|&(length, speed)| line(length, speed)).collect();
            let mut a = vec![3000.0; lines.len() + 1];
            (a[0], a[lines.len()]) = (0.0, 0.0);
            lower(&lines, &mut a);
            let total = |a: &[f64]| -> f64 { (0..lines.len()).map(|i| time(&lines[i], [a[i], a[i + 1]])).sum() };
            let at = 1 + which % (lines.len() - 1);
            let mut less = a.clone();
            less[at] *= part;
            lower(&lines, &mut less);
            prop_assert!(total(&a) <= total(&less) * (1.0 + 1e-12), "{a:?}: {} {less:?}: {}", total(&a), total(&less));
            let mut more = a.clone();
            more[at] = (1.0 + 4e-5) * a[at];
            let can = |i: usize| lines[i].expect("a line").can_cross([more[i], more[i + 1]]);
            prop_assert!(!(0..lines.len()).all(can), "{a:?}");
        }
    }
}
