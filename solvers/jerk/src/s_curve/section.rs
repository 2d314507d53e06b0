//! Sections of constant jerk (the seven types of Cheatham 2007, figure 4.1), and how they fill a segment between two
//! ends.
//!
//! A segment is crossed by a rise, a constant speed and a fall, each where needed, at the highest speed inside it that
//! leaves room for both changes. The thesis's one S-curve per segment is the case without a peak.
//!
//! A rise that begins with an acceleration a is a rise that begins without acceleration, with its first part cut off: it would
//! have begun a/J earlier, at a speed lower by a²/(2 J). From rest, that speed is below 0, and the part that is cut off has the
//! length −a³/(3 J²). A fall is treated in the same way, backwards in time.

use super::segment::{Segment, SegmentEnd};
use super::transition::{retreat, Limits};

/// Greatest number of Newton steps on a convex function, from above; far fewer are needed.
const STEPS: usize = 60;
/// A section of constant speed over less than this fraction of the segment's length is only rounding of the changes before and
/// after it.
const ROUNDING: f64 = 8.0 * f64::EPSILON;

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SectionKind {
    ConcaveRise = 1,
    LinearRise = 2,
    ConvexRise = 3,
    ConstantSpeed = 4,
    ConvexFall = 5,
    LinearFall = 6,
    ConcaveFall = 7,
}

/// A section of constant jerk, with the state at its start.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Section {
    pub kind: SectionKind,
    /// In s since the start of the path.
    pub time: f64,
    /// In s.
    pub duration: f64,
    /// In mm along the path.
    pub position: f64,
    /// In mm/s.
    pub speed: f64,
    /// In mm/s².
    pub acceleration: f64,
    /// In mm/s³.
    pub jerk: f64,
}

impl Section {
    /// Position, speed and acceleration `t` seconds after the section's start (4.1–4.3).
    pub fn state(&self, t: f64) -> [f64; 3] {
        let Self { position, speed, acceleration, jerk, .. } = *self;
        [
            position + t * (speed + t * (acceleration / 2.0 + t * jerk / 6.0)),
            speed + t * (acceleration + t * jerk / 2.0),
            acceleration + t * jerk,
        ]
    }

    pub fn end(&self) -> [f64; 3] {
        self.state(self.duration)
    }
}

/// Where and when a segment begins.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SegmentStart {
    /// In s.
    pub time: f64,
    /// In mm.
    pub position: f64,
}

/// Appends the sections of a segment between two ends that it joins; returns where and when it ends.
pub fn cross(
    segment: &Segment,
    ends: [SegmentEnd; 2],
    start: SegmentStart,
    out: &mut Vec<Section>,
) -> SegmentStart {
    let end_position = start.position + segment.length;
    if segment.length == 0.0 {
        return SegmentStart { position: end_position, ..start };
    }
    let Limits { acceleration, jerk } = segment.limits;
    let peak = peak(segment, ends);
    let [from, to] = ends.map(|end| end.before_cut(jerk));
    let mut at = Cursor { start, speed: ends[0].speed, acceleration: ends[0].acceleration, out };

    let rise = ramp(peak - from, acceleration, jerk);
    at.section(SectionKind::ConcaveRise, segment.bend_left(ends[0], rise.bend), jerk);
    at.section(SectionKind::LinearRise, rise.hold, 0.0);
    at.section(SectionKind::ConvexRise, rise.bend, -jerk);

    let rest =
        segment.uncut_length(ends) - segment.limits.distance(from, peak) - segment.limits.distance(peak, to);
    at.set_speed(peak);
    if rest > ROUNDING * segment.length {
        at.section(SectionKind::ConstantSpeed, rest / peak, 0.0);
    }

    let fall = ramp(peak - to, acceleration, jerk);
    at.section(SectionKind::ConvexFall, fall.bend, -jerk);
    at.section(SectionKind::LinearFall, fall.hold, 0.0);
    at.section(SectionKind::ConcaveFall, segment.bend_left(ends[1], fall.bend), jerk);
    SegmentStart { time: at.start.time, position: end_position }
}

/// The highest speed inside a segment, in mm/s.
fn peak(segment: &Segment, ends: [SegmentEnd; 2]) -> f64 {
    let Segment { limits, .. } = *segment;
    let ([from, to], length) = (ends.map(|end| end.before_cut(limits.jerk)), segment.uncut_length(ends));
    let (low, high) = (from.min(to), from.max(to));
    let needed = |peak: f64| limits.distance(from, peak) + limits.distance(peak, to);
    // The peak is at most what each change alone can reach within the length; if an end has an acceleration and `low` is below 0,
    // at most what the greatest acceleration can reach.
    let reached = if low < 0.0 {
        (high.max(0.0).powi(2) + 2.0 * limits.acceleration * segment.length).sqrt()
    } else {
        limits.highest(low, length).min(limits.highest(high, length))
    };
    let least = segment.least_peak(ends);
    let most = segment.speed().min(reached).max(least);
    if needed(most) <= length {
        return most;
    }
    // The length needed is smooth and convex in q = √(peak − higher end): Newton's method comes from above.
    let mut q = (most - high).sqrt();
    for _ in 0..STEPS {
        let (excess, gap) = (q * q, high - low);
        let slope = |change: f64, sum: f64| {
            // d/dq of sum/2 T(change), where q/√change ≤ 1 stays finite at 0.
            let perfect = change <= limits.full_change();
            let per_q = if perfect {
                (excess / change.max(f64::MIN_POSITIVE)).sqrt() / limits.jerk.sqrt()
            } else {
                q / limits.acceleration
            };
            sum * per_q + q * limits.duration(change)
        };
        let total = slope(excess, 2.0 * high + excess) + slope(excess + gap, low + high + excess);
        let step = (needed(high + excess) - length) / total;
        q -= step;
        if step.is_nan() || step.abs() <= f64::EPSILON * q || q <= 0.0 {
            break;
        }
    }
    retreat((high + q * q).clamp(least, most), least, most, |peak| needed(peak) <= length)
}

/// The durations in s of a change of speed: of each of its two sections with jerk, and of the constant acceleration between them.
struct Ramp {
    bend: f64,
    hold: f64,
}

fn ramp(change: f64, acceleration: f64, jerk: f64) -> Ramp {
    let full = acceleration * acceleration / jerk;
    if change <= full {
        Ramp { bend: (change / jerk).sqrt(), hold: 0.0 }
    } else {
        Ramp { bend: acceleration / jerk, hold: (change - full) / acceleration }
    }
}

/// The state after the sections so far, and the list of sections.
struct Cursor<'a> {
    start: SegmentStart,
    speed: f64,
    acceleration: f64,
    out: &'a mut Vec<Section>,
}

impl Cursor<'_> {
    fn section(&mut self, kind: SectionKind, duration: f64, jerk: f64) {
        if duration <= 0.0 {
            return;
        }
        let SegmentStart { time, position } = self.start;
        let (speed, acceleration) = (self.speed, self.acceleration);
        let section = Section { kind, time, duration, position, speed, acceleration, jerk };
        let [position, speed, acceleration] = section.end();
        self.start = SegmentStart { time: time + duration, position };
        // A change of speed ends with an acceleration of exactly 0.
        let ends = matches!(kind, SectionKind::ConvexRise | SectionKind::ConcaveFall);
        self.speed = speed;
        self.acceleration = if ends { 0.0 } else { acceleration };
        self.out.push(section);
    }

    /// Replaces the speed after the sections so far by its exact value, without their rounding errors.
    fn set_speed(&mut self, speed: f64) {
        self.speed = speed;
    }
}

#[cfg(test)]
mod tests {
    use super::SectionKind::*;
    use super::*;

    fn segment(length: f64) -> Segment {
        Segment {
            length,
            allowable: 100.0,
            desired: 200.0,
            limits: Limits { acceleration: 500.0, jerk: 50_000.0 },
            junction: f64::INFINITY,
        }
    }

    fn sections(length: f64, from: f64, to: f64) -> Vec<Section> {
        let mut out = vec![];
        let ends = [from, to].map(SegmentEnd::moving);
        let end = cross(&segment(length), ends, SegmentStart::default(), &mut out);
        assert_eq!(end.position, length);
        let time: f64 = out.iter().map(|section| section.duration).sum();
        assert!((time - end.time).abs() < 1e-12);
        let last = out.last().unwrap().end();
        assert!((last[0] - length).abs() < 1e-12 && (last[1] - to).abs() < 1e-11 && last[2].abs() < 1e-9);
        out
    }

    fn kinds(sections: &[Section]) -> Vec<SectionKind> {
        sections.iter().map(|section| section.kind).collect()
    }

    #[test]
    fn all_seven_sections_by_hand() {
        // 100 mm from rest to rest: 0.21 s and 10.5 mm to 100 mm/s, 79 mm at 100 mm/s, 0.21 s down: 1.21 s.
        let all = sections(100.0, 0.0, 0.0);
        let expected =
            [ConcaveRise, LinearRise, ConvexRise, ConstantSpeed, ConvexFall, LinearFall, ConcaveFall];
        assert_eq!(kinds(&all), expected);
        let durations = [0.01, 0.19, 0.01, 0.79, 0.01, 0.19, 0.01];
        let speeds = [0.0, 2.5, 97.5, 100.0, 100.0, 97.5, 2.5];
        let accelerations = [0.0, 500.0, 500.0, 0.0, 0.0, -500.0, -500.0];
        // 2.5·0.01/3 mm in the first, 9.5 mm in the second, 0.99166… mm in the third.
        let positions =
            [0.0, 0.025 / 3.0, 9.5 + 0.025 / 3.0, 10.5, 89.5, 90.5 - 0.025 / 3.0, 100.0 - 0.025 / 3.0];
        for i in 0..7 {
            assert!((all[i].duration - durations[i]).abs() < 1e-14, "{i}");
            assert!((all[i].speed - speeds[i]).abs() < 1e-12, "{i}");
            assert!((all[i].acceleration - accelerations[i]).abs() < 1e-10, "{i}");
            assert!((all[i].position - positions[i]).abs() < 1e-12, "{i}");
        }
    }

    #[test]
    fn a_short_segment_peaks_half_way() {
        // Perfect S-curves up to V and down take L = 2 V √(V/J): 8 √(8e-5) mm for V = 4 mm/s.
        let all = sections(8.0 * 8e-5f64.sqrt(), 0.0, 0.0);
        assert_eq!(kinds(&all), [ConcaveRise, ConvexRise, ConvexFall, ConcaveFall]);
        assert!((all[2].speed - 4.0).abs() < 1e-13);
        // 18 mm have no room for 100 mm/s: 2 (V/2) (V/500 + 0.01) = 18 at the positive root of V² + 5 V = 9000.
        let all = sections(18.0, 0.0, 0.0);
        assert_eq!(kinds(&all), [ConcaveRise, LinearRise, ConvexRise, ConvexFall, LinearFall, ConcaveFall]);
        assert!((all[3].speed - 0.5 * (36_025.0_f64.sqrt() - 5.0)).abs() < 1e-12);
    }

    #[test]
    fn speeds_that_differ_rise_and_fall_in_either_order() {
        assert_eq!(kinds(&sections(50.0, 100.0, 0.0)), [ConstantSpeed, ConvexFall, LinearFall, ConcaveFall]);
        assert_eq!(kinds(&sections(50.0, 0.0, 100.0)), [ConcaveRise, LinearRise, ConvexRise, ConstantSpeed]);
        assert_eq!(kinds(&sections(50.0, 100.0, 100.0)), [ConstantSpeed]);
        let up = sections(20.0, 10.0, 60.0);
        let down = sections(20.0, 60.0, 10.0);
        assert_eq!(kinds(&up).len(), 7);
        let time = |all: &[Section]| all.iter().map(|section| section.duration).sum::<f64>();
        assert!((time(&up) - time(&down)).abs() < 1e-14);
    }

    #[test]
    fn a_segment_without_length_has_no_sections() {
        let mut out = vec![];
        let start = SegmentStart { time: 2.0, position: 3.0 };
        assert_eq!(cross(&segment(0.0), [SegmentEnd::moving(50.0); 2], start, &mut out), start);
        assert!(out.is_empty());
    }
}
