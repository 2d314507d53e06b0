//! Cells of a run: the arcs of a profile at first, then halved where their bound is poor.

use super::Hint;

/// No arc belongs to the cell.
const NO_ARC: u32 = u32::MAX;

/// Cells in the order of the run; a piece has one or more.
#[derive(Default)]
pub struct Cells {
    /// Offsets of the pieces.
    piece: Vec<usize>,
    /// t at the end, 1 at the end of a piece.
    pub end: Vec<f64>,
    /// The arc of the profile.
    pub arc: Vec<u32>,
    /// The greatest x at the end.
    pub reach: Vec<f64>,
    /// The least time.
    pub time: Vec<f64>,
}

impl Cells {
    /// The cells of a piece, counted from the start of the run.
    pub fn of_piece(&self, piece: usize) -> std::ops::Range<usize> {
        self.piece[piece]..self.piece[piece + 1]
    }

    /// The arcs of the profile as cells, in two where the arc's axis turns. What is no profile gives cells all the same.
    ///
    /// `turn` gives the place where an axis turns on a part of a piece.
    pub fn divide(
        &mut self,
        hint: &Hint,
        (first, last): (usize, usize),
        width: &[f64],
        turn: impl Fn(usize, usize, (f64, f64)) -> Option<f64>,
    ) {
        self.piece.clear();
        self.end.clear();
        self.arc.clear();
        let mut arc = hint.piece.partition_point(|&piece| (piece as usize) < first);
        for i in first..last {
            self.piece.push(self.end.len());
            // `own` is the longest arc since the last cut.
            let (mut from, mut own) = (0.0, NO_ARC);
            while hint.piece.get(arc).is_some_and(|&piece| piece as usize == i) {
                if own == NO_ARC || hint.duration[arc] > hint.duration[own as usize] {
                    own = arc as u32;
                }
                let end = (hint.u1[arc] / width[i]).min(1.0);
                if let Some(t) = turn(i, hint.axis[arc] as usize, (from, end)) {
                    if t > from && t < end {
                        self.push(t, own);
                        from = t;
                    }
                }
                if end > from && end < 1.0 {
                    self.push(end, own);
                    (from, own) = (end, NO_ARC);
                }
                arc += 1;
            }
            self.push(1.0, own);
        }
        self.piece.push(self.end.len());
        self.fit();
    }

    fn push(&mut self, end: f64, arc: u32) {
        self.end.push(end);
        self.arc.push(arc);
    }

    fn fit(&mut self) {
        self.reach.resize(self.end.len(), f64::INFINITY);
        self.time.resize(self.end.len(), 0.0);
    }

    /// Divides the cells of arcs whose bound misses more than this part of their duration at their `middle`, a function
    /// of the piece, counted from the start of the run, and the cell's ends; `other` is space for it.
    /// Returns how many there are.
    pub fn halve(
        &mut self,
        hint: &Hint,
        part: f64,
        middle: impl Fn(usize, (f64, f64)) -> f64,
        other: &mut Self,
    ) -> usize {
        other.piece.clear();
        other.end.clear();
        other.arc.clear();
        let mut halved = 0;
        let mut known = 0;
        let mut poor = false;
        for i in 0..self.piece.len() - 1 {
            other.piece.push(other.end.len());
            let mut from = 0.0;
            for cell in self.of_piece(i) {
                let arc = self.arc[cell];
                if cell >= known {
                    // All cells of the arc at once.
                    while known < self.end.len() && self.arc[known] == arc {
                        known += 1;
                    }
                    let bound: f64 = self.time[cell..known].iter().sum();
                    poor = arc == NO_ARC || bound < (1.0 - part) * hint.duration[arc as usize];
                }
                if poor {
                    let middle = middle(i, (from, self.end[cell]));
                    if middle > from && middle < self.end[cell] {
                        other.push(middle, arc);
                        halved += 1;
                    }
                }
                other.push(self.end[cell], arc);
                from = self.end[cell];
            }
        }
        other.piece.push(other.end.len());
        other.fit();
        std::mem::swap(self, other);
        halved
    }
}
