//! The segments that the profiler knows ahead of the motion, and the speed limits [mm/s] where they meet.

use std::collections::VecDeque;

use super::segment::Segment;

/// Segments in order: the motion enters the first one and stands at the end of the last one.
#[derive(Clone, Debug, Default)]
pub struct Buffer {
    segments: VecDeque<Segment>,
}

impl Buffer {
    pub fn len(&self) -> usize {
        self.segments.len()
    }

    pub fn push(&mut self, segment: Segment) {
        self.segments.push_back(segment);
    }

    pub fn pop(&mut self) -> Option<Segment> {
        self.segments.pop_front()
    }

    #[inline]
    pub fn segment(&self, i: usize) -> &Segment {
        &self.segments[i]
    }

    /// The speed limit at the start of segment `i` ≥ 1, in mm/s; None at the end of the buffer.
    #[inline]
    pub fn limit(&self, i: usize) -> Option<f64> {
        self.segments.get(i).map(|next| self.segments[i - 1].speed_into(next))
    }
}

impl FromIterator<Segment> for Buffer {
    fn from_iter<T: IntoIterator<Item = Segment>>(segments: T) -> Self {
        Self { segments: segments.into_iter().collect() }
    }
}
