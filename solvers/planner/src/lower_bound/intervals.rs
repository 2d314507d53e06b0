//! Divides a run into intervals: at first the phases of a profile, then halved where their bound is loose.

use crate::phases::Phases;

/// Marks an interval that belongs to no phase.
const NO_PHASE: u32 = u32::MAX;

/// Intervals in the order of the run; each piece has one or more.
#[derive(Default)]
pub struct Intervals {
    /// Index of the first interval of each piece.
    piece: Vec<usize>,
    /// t at the end, 1 at the end of a piece.
    pub end: Vec<f64>,
    /// The phase of the profile.
    pub phase: Vec<u32>,
    /// The greatest x at the end, from the backward sweep.
    pub reach: Vec<f64>,
    /// The least time [s].
    pub time: Vec<f64>,
}

impl Intervals {
    /// The intervals of a piece, counted from the start of the run.
    pub fn of_piece(&self, piece: usize) -> std::ops::Range<usize> {
        self.piece[piece]..self.piece[piece + 1]
    }

    /// Makes an interval of each phase, or two if its axis turns. Columns that are not those of a profile give valid intervals as
    /// well.
    ///
    /// `find_turn` returns a turn of an axis between two t of a piece.
    pub fn divide(
        &mut self,
        hint: &Phases,
        (first, last): (usize, usize),
        width: &[f64],
        find_turn: impl Fn(usize, usize, (f64, f64)) -> Option<f64>,
    ) {
        self.piece.clear();
        self.end.clear();
        self.phase.clear();
        let mut phase = hint.piece.partition_point(|&piece| (piece as usize) < first);
        for i in first..last {
            self.piece.push(self.end.len());
            // `own` is the longest phase since the last cut.
            let (mut from, mut own) = (0.0, NO_PHASE);
            while hint.piece.get(phase).is_some_and(|&piece| piece as usize == i) {
                if own == NO_PHASE || hint.duration[phase] > hint.duration[own as usize] {
                    own = phase as u32;
                }
                let end = (hint.u1[phase] / width[i]).min(1.0);
                if let Some(t) = find_turn(i, hint.axis[phase] as usize, (from, end)) {
                    if t > from && t < end {
                        self.push(t, own);
                        from = t;
                    }
                }
                if end > from && end < 1.0 {
                    self.push(end, own);
                    (from, own) = (end, NO_PHASE);
                }
                phase += 1;
            }
            self.push(1.0, own);
        }
        self.piece.push(self.end.len());
        self.fit();
    }

    fn push(&mut self, end: f64, phase: u32) {
        self.end.push(end);
        self.phase.push(phase);
    }

    fn fit(&mut self) {
        self.reach.resize(self.end.len(), f64::INFINITY);
        self.time.resize(self.end.len(), 0.0);
    }

    /// Halves the intervals of the phases whose bound is below their duration by more than the fraction `part`; returns their
    /// number. `middle` returns the t of the cut for a piece, counted from the start of the run, and the ends of the interval;
    /// `other` is working memory.
    pub fn halve(
        &mut self,
        hint: &Phases,
        part: f64,
        middle: impl Fn(usize, (f64, f64)) -> f64,
        other: &mut Self,
    ) -> usize {
        other.piece.clear();
        other.end.clear();
        other.phase.clear();
        let mut halved = 0;
        let mut known = 0;
        let mut loose = false;
        for i in 0..self.piece.len() - 1 {
            other.piece.push(other.end.len());
            let mut from = 0.0;
            for interval in self.of_piece(i) {
                let phase = self.phase[interval];
                if interval >= known {
                    // A new phase: decides for all its intervals at once.
                    while known < self.end.len() && self.phase[known] == phase {
                        known += 1;
                    }
                    let bound: f64 = self.time[interval..known].iter().sum();
                    loose = phase == NO_PHASE || bound < (1.0 - part) * hint.duration[phase as usize];
                }
                if loose {
                    let middle = middle(i, (from, self.end[interval]));
                    if middle > from && middle < self.end[interval] {
                        other.push(middle, phase);
                        halved += 1;
                    }
                }
                other.push(self.end[interval], phase);
                from = self.end[interval];
            }
        }
        other.piece.push(other.end.len());
        other.fit();
        std::mem::swap(self, other);
        halved
    }
}
