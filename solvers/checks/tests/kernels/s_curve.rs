//! The two-pass jerk-limited profiler: profiles computed by hand, random sequences of segments, numbers of any magnitude.

use feedplan_checks::{assert_none, seeds, Random};
use feedplan_geometry::watch::Watch;
use feedplan_jerk::s_curve::{plan, Limits, Profiler, Section, SectionKind, Segment};
use proptest::prelude::*;

/// A segment with the limits 100 mm/s, 500 mm/s², 50 000 mm/s³.
fn segment(length: f64) -> Segment {
    let limits = Limits { acceleration: 500.0, jerk: 50_000.0 };
    Segment { length, allowable: 100.0, desired: 100.0, limits, junction: f64::INFINITY }
}

fn time(sections: &[Section]) -> f64 {
    sections.last().map_or(0.0, |last| last.time + last.duration)
}

/// The time from rest to rest in seven sections or fewer (textbook, by halving for the peak).
fn seven_section_time(length: f64, speed: f64, acceleration: f64, jerk: f64) -> f64 {
    let ramp = |v: f64| {
        if v * jerk <= acceleration * acceleration {
            2.0 * (v / jerk).sqrt()
        } else {
            v / acceleration + acceleration / jerk
        }
    };
    let (mut low, mut high) = (0.0, speed);
    for _ in 0..200 {
        let middle = 0.5 * (low + high);
        if middle * ramp(middle) <= length {
            low = middle;
        } else {
            high = middle;
        }
    }
    let cruise = length - low * ramp(low);
    2.0 * ramp(low) + if low > 0.0 { cruise / low } else { 0.0 }
}

/// The sections of every segment in the order in which the profiler returns them.
fn stream(segments: &[Segment], look_ahead: usize) -> Vec<Vec<Section>> {
    let mut profiler = Profiler::new(look_ahead);
    let (mut all, mut out) = (vec![], vec![]);
    for (i, &segment) in segments.iter().enumerate() {
        profiler.push(segment, &mut out).expect("a segment that can be planned");
        if i >= look_ahead {
            all.push(std::mem::take(&mut out));
        }
    }
    while profiler.drain(&mut out) {
        all.push(std::mem::take(&mut out));
    }
    all
}

/// Checks every requirement on a profile; `close` is the relative size of rounding. Returns the first violation as a sentence.
fn check(segments: &[Segment], stream: &[Vec<Section>], close: f64) -> Result<(), String> {
    let (mut time, mut position, mut speed, mut before) = (0.0, 0.0, 0.0, 0.0_f64);
    if stream.len() != segments.len() {
        return Err(format!("{} of {} segments", stream.len(), segments.len()));
    }
    let top = segments.iter().fold(0.0_f64, |top, segment| top.max(segment.speed()));
    for (i, (segment, sections)) in segments.iter().zip(stream).enumerate() {
        let Limits { acceleration: a, jerk } = segment.limits;
        let limit = segment.speed();
        let start_time = time;
        let mut acceleration = 0.0;
        let end = position + segment.length;
        for section in sections {
            let fail = |what: &str| Err(format!("segment {i}: {what}: {section:?}"));
            if !(section.duration > 0.0 && section.duration.is_finite()) {
                return fail("no duration");
            }
            if (section.time - time).abs() > close * (time + section.duration) {
                return fail("a gap in time");
            }
            if (section.position - position).abs() > close * (end + 1e-300) {
                return fail("a jump in position");
            }
            if (section.speed - speed).abs() > close * limit.max(before) {
                return fail("a jump in speed");
            }
            if (section.acceleration - acceleration).abs() > close * a {
                return fail("a jump in acceleration");
            }
            let expected = match section.kind {
                SectionKind::ConcaveRise | SectionKind::ConcaveFall => jerk,
                SectionKind::ConvexRise | SectionKind::ConvexFall => -jerk,
                _ => 0.0,
            };
            if section.jerk != expected {
                return fail("another jerk than the limit or none");
            }
            // Acceleration does not change its sign within a section: its ends are the extremes of the speed.
            for t in [0.0, 0.5 * section.duration, section.duration] {
                let [_, v, acceleration] = section.state(t);
                if v > limit * (1.0 + close) || v < -close * limit {
                    return fail("speed out of its limits");
                }
                if acceleration.abs() > a * (1.0 + close) {
                    return fail("acceleration over its limit");
                }
            }
            time = section.time + section.duration;
            [position, speed, acceleration] = section.end();
        }
        let fail = |what: String| Err(format!("segment {i}: {what}"));
        if acceleration.abs() > close * a {
            return fail(format!("ends with acceleration {acceleration}"));
        }
        if (position - end).abs() > close * (end + 1e-300) {
            return fail(format!("ends at {position} mm for {end} mm"));
        }
        if speed > segment.junction + close * top {
            return fail(format!("{speed} mm/s over the junction's {} mm/s", segment.junction));
        }
        if (time - start_time) * limit < segment.length * (1.0 - close) - close * time * limit {
            return fail("faster than its greatest speed".into());
        }
        position = end;
        before = if sections.is_empty() { before } else { limit };
    }
    if speed.abs() > close * top {
        return Err(format!("ends at {speed} mm/s"));
    }
    let greatest = |of: fn(&Segment) -> f64| segments.iter().map(of).fold(0.0_f64, f64::max);
    let bound =
        seven_section_time(position, top, greatest(|s| s.limits.acceleration), greatest(|s| s.limits.jerk));
    if time < bound * (1.0 - close) {
        return Err(format!("{time} s beats the bound {bound} s of one segment with the greatest limits"));
    }
    Ok(())
}

/// Up to 40 segments: like those of a CAM system, or of any size, or all equal.
fn random_segments(random: &mut Random) -> Vec<Segment> {
    let count = 1 + random.below(40);
    let kind = random.below(4);
    let one = |random: &mut Random| {
        let (length, limits, allowable) = if kind == 0 {
            // Limits and lengths of any magnitude.
            let limits =
                Limits { acceleration: random.exponential(-3.0, 12.0), jerk: random.exponential(-3.0, 16.0) };
            (random.exponential(-10.0, 8.0), limits, random.exponential(-4.0, 8.0))
        } else {
            let limits =
                Limits { acceleration: random.exponential(5.0, 9.0), jerk: random.exponential(8.0, 13.0) };
            (random.exponential(-4.0, 4.0), limits, random.exponential(0.0, 6.0))
        };
        let desired = if random.chance(0.3) { random.between(0.2, 1.2) * allowable } else { 2.0 * allowable };
        let junction = match random.below(20) {
            0 => 0.0,
            1 | 2 => random.between(0.0, allowable),
            _ => f64::INFINITY,
        };
        let length = if random.chance(0.03) { 0.0 } else { length };
        Segment { length, allowable, desired, limits, junction }
    };
    let first = one(random);
    // Equal except for the speeds, or all equal.
    (0..count)
        .map(|_| match kind {
            2 => Segment { allowable: first.allowable * random.between(0.3, 1.0), ..first },
            3 => first,
            _ => one(random),
        })
        .collect()
}

#[test]
fn a_line_by_hand_takes_seven_sections() {
    // 0.21 s to 100 mm/s in 10.5 mm, 79 mm in 0.79 s, 0.21 s down.
    let sections = plan(&[segment(100.0)], 10, Watch::default()).unwrap();
    assert_eq!(sections.len(), 7);
    assert!((time(&sections) - 1.21).abs() < 1e-14);
}

#[test]
fn a_square_with_exact_stops_takes_four_lines() {
    let side = Segment { junction: 0.0, ..segment(100.0) };
    for look_ahead in [0, 1, 2, 10] {
        let sections = plan(&[side; 4], look_ahead, Watch::default()).unwrap();
        assert_eq!(sections.len(), 28);
        assert!((time(&sections) - 4.84).abs() < 1e-13);
    }
}

#[test]
fn a_line_cut_where_its_changes_end_takes_the_same_time() {
    let sections = plan(&[10.5, 79.0, 10.5].map(segment), 10, Watch::default()).unwrap();
    assert!((time(&sections) - 1.21).abs() < 1e-12);
}

#[test]
fn a_slow_segment_ahead_is_met_by_falling_in_time() {
    // 100 to 40 mm/s: 0.13 s and 9.1 mm at the end of the first; the second at 40 mm/s; from there up again.
    let slow = Segment { desired: 40.0, ..segment(40.0) };
    let sections = plan(&[segment(100.0), slow, segment(100.0)], 10, Watch::default()).unwrap();
    let line = 0.21 + (100.0 - 10.5 - 9.1) / 100.0 + 0.13;
    assert!((time(&sections) - (2.0 * line + 1.0)).abs() < 1e-12);
}

#[test]
fn a_desired_speed_below_the_allowable_one_is_kept() {
    let slow = Segment { desired: 50.0, ..segment(100.0) };
    let sections = plan(&[slow; 3], 10, Watch::default()).unwrap();
    // 0.11 s and 2.75 mm up and down.
    assert!((time(&sections) - (0.22 + (300.0 - 5.5) / 50.0)).abs() < 1e-12);
}

#[test]
fn segments_without_length_change_nothing() {
    let path = [0.0, 10.5, 0.0, 0.0, 79.0, 0.0, 10.5, 0.0].map(segment);
    assert!((time(&plan(&path, 10, Watch::default()).unwrap()) - 1.21).abs() < 1e-12);
    assert!(plan(&[segment(0.0); 3], 1, Watch::default()).unwrap().is_empty());
    assert!(plan(&[], 1, Watch::default()).unwrap().is_empty());
}

#[test]
fn a_wrong_segment_is_named() {
    let path = [segment(1.0), segment(1.0), segment(f64::NAN)];
    let message = plan(&path, 0, Watch::default()).unwrap_err().to_string();
    assert_eq!(message, "the length of segment 2 is NaN mm: give 0 or 1e-12 to 1e15 mm");
}

#[test]
fn random_segments_are_crossed_within_all_limits() {
    let mut failures = vec![];
    for seed in seeds(50_000) {
        let mut random = Random(seed);
        let segments = random_segments(&mut random);
        let look_ahead = random.below(50);
        if let Err(what) = check(&segments, &stream(&segments, look_ahead), 1e-9) {
            failures.push(format!("seed {seed}: {what}"));
        }
    }
    assert_none(&failures);
}

#[test]
fn a_stream_that_sees_far_enough_to_stop_gives_the_profile_of_the_whole() {
    let mut apart = 0;
    for seed in seeds(2_000) {
        let mut random = Random(seed);
        // Standstill from 200 mm/s takes at most 40 mm and 20 segments.
        let segments: Vec<Segment> = (0..200)
            .map(|_| Segment {
                length: random.between(2.0, 20.0),
                allowable: random.between(20.0, 200.0),
                desired: 150.0,
                limits: Limits {
                    acceleration: random.between(1000.0, 3000.0),
                    jerk: random.between(1e5, 1e6),
                },
                junction: if random.chance(0.1) { 0.0 } else { f64::INFINITY },
            })
            .collect();
        let whole = plan(&segments, segments.len(), Watch::default()).unwrap();
        assert_eq!(plan(&segments, 20, Watch::default()).unwrap(), whole, "seed {seed}");
        apart += usize::from(plan(&segments, 1, Watch::default()).unwrap() != whole);
    }
    assert!(apart > 0, "a look-ahead of one segment sees as much");
}

#[test]
fn the_unit_of_length_does_not_matter() {
    for seed in seeds(2_000) {
        let segments = random_segments(&mut Random(seed));
        let whole = time(&plan(&segments, 20, Watch::default()).unwrap());
        for unit in [1.0 / 1024.0, 1024.0] {
            let scaled: Vec<Segment> = segments
                .iter()
                .map(|segment| Segment {
                    length: unit * segment.length,
                    allowable: unit * segment.allowable,
                    desired: unit * segment.desired,
                    limits: Limits {
                        acceleration: unit * segment.limits.acceleration,
                        jerk: unit * segment.limits.jerk,
                    },
                    junction: unit * segment.junction,
                })
                .collect();
            let again = time(&plan(&scaled, 20, Watch::default()).unwrap());
            assert!((again - whole).abs() <= 1e-12 * whole, "seed {seed}: {again} s for {whole} s");
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(20_000))]
    #[test]
    fn numbers_of_any_size_are_planned(
        path in prop::collection::vec(
            (prop_oneof![1 => Just(None), 9 => (-12.0..15.0f64).prop_map(Some)], prop::array::uniform4(-12.0..15.0f64)),
            1..12,
        ),
        look_ahead in 0..12usize,
    ) {
        let power = |e: f64| 10f64.powf(e).clamp(1e-12, 1e15);
        let segments: Vec<Segment> = path
            .into_iter()
            .map(|(length, [speed, acceleration, jerk, junction])| Segment {
                length: length.map_or(0.0, power),
                allowable: power(speed),
                desired: power(speed),
                limits: Limits { acceleration: power(acceleration), jerk: power(jerk) },
                junction: power(junction),
            })
            .collect();
        let found = check(&segments, &stream(&segments, look_ahead), 1e-6);
        prop_assert!(found.is_ok(), "{found:?}");
    }
}
