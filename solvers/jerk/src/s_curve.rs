//! The two-pass jerk-limited speed profiler of Cheatham 2007, "A Geometry-Based Motion Planner for Direct Machining and
//! Control", chapter 4: from segments of path with limits along the path [mm, s] to sections of constant jerk.
//!
//! The acceleration is 0 where segments meet, and a profile always ends at standstill on segments already known. When the motion
//! is about to enter a segment, the forward recursion raises the speed at its end as far as possible and falls to standstill; the
//! backward recursion lowers the speeds that break a limit ahead. If it fails, the established profile stays. The cost of a
//! segment is therefore that of looking ahead over the segments needed to stop, and over at most `look_ahead` segments.
//!
//! | module | what it computes |
//! |---|---|
//! | `segment` | a segment with its limits |
//! | `transition` | the S-curve: time, length and highest speed of a change (4.6–4.15) |
//! | `dead_spot` | the lower speeds that can be reached (4.3.4) |
//! | `buffer` | segments ahead, and the limits where they meet |
//! | `forward` | acceleration and deceleration stage (4.3.1) |
//! | `backward` | with and without an established profile (4.3.2) |
//! | `section` | the seven types of section (4.1), and how they fill a segment |
//! | `on_path` | the profiler on the package's own paths |
//!
//! Differences from the thesis:
//! - 4.12: the last term is A³/(6 J²), not 2 A³/(3 J²); only then do 4.12 and 4.13 add up to 4.14.
//! - 4.3.4 has at most two usable roots; the third end is the acceleration limit (see `dead_spot`).
//! - Sections of constant acceleration and constant speed are used; a segment may rise to a peak and fall again.
//! - The pseudocode of 4.3.3 joins the established profile wherever it can; near the standing end this is at once, and gains
//!   nothing. Here the backward recursion follows the forward one down to the present speed. It joins the established profile
//!   only if it cannot meet that speed, and as early on the path as it can.
//! - Zero-length segments, exact stops and speed limits at junctions are allowed.
//!
//! The speeds are not the highest possible: zero acceleration where segments meet costs time, most where segments are short
//! compared with the length of a change of speed (thesis, 7.1).

mod backward;
mod buffer;
mod dead_spot;
mod forward;
pub mod on_path;
mod section;
mod segment;
mod transition;

use std::collections::VecDeque;

use buffer::Buffer;
use feedplan_geometry::watch::Watch;
use feedplan_planner::problem::Fault;
pub use section::{Section, SectionKind};
pub use segment::{Segment, SegmentEnd};
pub use transition::Limits;

/// The streaming profiler: segments in, sections out.
#[derive(Clone, Debug)]
pub struct Profiler {
    look_ahead: usize,
    buffer: Buffer,
    /// The established profile: the speed at the start of every segment in the buffer, and 0 at the end.
    speeds: VecDeque<f64>,
    /// Only this many speeds, from the first one on, may differ from 0.
    moving: usize,
    start: section::SegmentStart,
    entered: usize,
    forward: Vec<f64>,
    backward: Vec<f64>,
}

impl Profiler {
    /// A profiler at rest that knows `look_ahead` segments beyond the one that the motion enters.
    pub fn new(look_ahead: usize) -> Self {
        Self {
            look_ahead,
            buffer: Buffer::default(),
            speeds: VecDeque::from([0.0]),
            moving: 0,
            start: section::SegmentStart::default(),
            entered: 0,
            forward: vec![],
            backward: vec![],
        }
    }

    /// Takes a segment; if the buffer is full, appends the sections of the oldest segment to `out`.
    pub fn push(&mut self, segment: Segment, out: &mut Vec<Section>) -> Result<(), Fault> {
        segment.check(self.entered + self.buffer.len())?;
        self.buffer.push(segment);
        self.speeds.push_back(0.0);
        if self.buffer.len() > self.look_ahead {
            self.enter(out);
        }
        Ok(())
    }

    /// After the last segment: appends the sections of the oldest one to `out`; false if none is left.
    pub fn drain(&mut self, out: &mut Vec<Section>) -> bool {
        self.buffer.len() > 0 && {
            self.enter(out);
            true
        }
    }

    /// The motion enters the first segment: its speeds are final from now on.
    fn enter(&mut self, out: &mut Vec<Section>) {
        self.plan();
        let start = self.speeds.pop_front().unwrap_or(0.0);
        if let Some(segment) = self.buffer.pop() {
            self.start =
                section::cross(&segment, [start, self.speeds[0]].map(SegmentEnd::moving), self.start, out);
            self.entered += 1;
            self.moving = self.moving.saturating_sub(1);
        }
    }

    /// Raises the established profile.
    fn plan(&mut self) {
        let Self { buffer, speeds, forward, backward, .. } = self;
        let sound = forward::recursion(buffer, speeds[0], forward);
        if !sound && !backward::recursion(buffer, |i| speeds[i], forward, backward) {
            return;
        }
        let plan: &[f64] = if sound { forward } else { backward };
        for i in plan.len()..self.moving {
            speeds[i] = 0.0;
        }
        for (speed, &planned) in speeds.iter_mut().zip(plan) {
            *speed = planned;
        }
        self.moving = plan.len();
    }
}

/// The sections of a whole path from rest to rest, with this look-ahead in segments.
pub fn plan(segments: &[Segment], look_ahead: usize, watch: Watch) -> Result<Vec<Section>, Fault> {
    let mut profiler = Profiler::new(look_ahead);
    let mut sections = Vec::with_capacity(4 * segments.len());
    for (i, &segment) in segments.iter().enumerate() {
        watch.each(segments.len()).count(i);
        profiler.push(segment, &mut sections)?;
    }
    while profiler.drain(&mut sections) {}
    Ok(sections)
}

/// The fastest sections of a segment between two ends that it joins.
pub fn cross(segment: &Segment, ends: [SegmentEnd; 2]) -> Vec<Section> {
    let mut sections = vec![];
    section::cross(segment, ends, section::SegmentStart::default(), &mut sections);
    sections
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// Short segments with limits that change much, so that the dead spot matters.
    fn segment() -> impl Strategy<Value = Segment> {
        (0.0..1.5f64, 0.2..3.0f64, 0.3..3.0f64, 0.3..3.0f64, 0..10u8).prop_map(
            |(length, allowable, acceleration, jerk, junction)| Segment {
                length,
                allowable,
                desired: 2.5,
                limits: Limits { acceleration, jerk },
                junction: f64::from(junction),
            },
        )
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(20_000))]
        #[test]
        fn the_established_profile_can_always_be_followed_to_standstill(
            segments in prop::collection::vec(segment(), 1..40),
            look_ahead in 1..20usize,
        ) {
            let mut profiler = Profiler::new(look_ahead);
            for segment in segments {
                profiler.push(segment, &mut vec![]).unwrap();
                let Profiler { buffer, speeds, .. } = &profiler;
                prop_assert_eq!(speeds.len(), buffer.len() + 1);
                prop_assert_eq!(speeds[buffer.len()], 0.0);
                for i in 0..buffer.len() {
                    prop_assert!(buffer.segment(i).joins(speeds[i], speeds[i + 1]), "{:?} at {}", speeds, i);
                    prop_assert!(speeds[i] <= buffer.segment(i).speed());
                    prop_assert!(buffer.limit(i + 1).is_none_or(|limit| speeds[i + 1] <= limit));
                }
            }
        }
    }
}
