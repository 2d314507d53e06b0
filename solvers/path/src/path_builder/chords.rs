//! The moves of a program as chords, the input of a smooth curve that is fitted to all moves alike.
//!
//! Arcs and splines are halved until their chords are within a small fraction of the tolerance; the fit gets the rest.

use std::ops::Range;

use crate::moves::{MoveError, Moves, PathOptions, ARC, SPLINE};
use crate::smooth_fit::polyline::angle;
use crate::tolerance::{CHORD, LEFT_TO_FIT, SAME_POINT};
use feedplan_geometry::conic::Conic;
use feedplan_geometry::quadratic::{norm, sub, Segment};
use feedplan_geometry::spline::{bezier, CompositeCurve, Piece};

/// The greatest number of halvings of a piece of an arc or a spline.
const DEPTH: u32 = 14;

/// A chord along one or more moves.
#[derive(Clone, Copy, Debug)]
pub struct Chord {
    /// First and last move.
    pub first: u32,
    pub last: u32,
    pub feed: f64,
    /// Allowed distance between path and moves, in mm.
    pub tolerance: f64,
    /// Bound of the distance between chord and moves, in mm: this part of the tolerance is used.
    pub used: f64,
    /// The greatest angle between chord and curve at their common ends, in rad; None for a line.
    pub end_angle: Option<f64>,
}

impl Chord {
    /// The part of the tolerance that is left to the fit, in mm.
    pub fn rest(&self) -> f64 {
        (self.tolerance - self.used).max(LEFT_TO_FIT * self.tolerance)
    }

    pub fn is_line(&self) -> bool {
        self.end_angle.is_none()
    }

    /// Takes the moves of the next chord, too; the smaller feed holds.
    fn take(&mut self, next: &Self) {
        (self.last, self.feed) = (next.last, self.feed.min(next.feed));
    }
}

/// Chords from point to point; there is one more point than chords.
pub struct Chords<const M: usize> {
    pub points: Vec<[f64; M]>,
    pub chords: Vec<Chord>,
    /// Moves before the first chord that are too short for a chord: the first of them, and their least feed.
    skipped: Option<(u32, f64)>,
}

impl<const M: usize> Moves<'_, M> {
    /// The chords of consecutive moves, each of which starts where the one before ends. For moves that ask for the exact path the
    /// exact tolerance is used.
    pub fn chords(&self, options: &PathOptions, range: Range<usize>) -> Result<Chords<M>, MoveError> {
        let start = vec![self.origin(range.start)];
        let mut out = Chords { points: start, chords: vec![], skipped: None };
        for i in range.clone() {
            self.check(i)?;
            let (_, tolerance) = self.allowed(i, options);
            let index = i as u32;
            let mut chord = Chord {
                first: index,
                last: index,
                feed: self.feed_of(i),
                tolerance,
                used: SAME_POINT * tolerance,
                end_angle: None,
            };
            if self.kind[i] == ARC {
                let (pieces, deviation) = self.arc_pieces(i, 0.5 * CHORD * tolerance)?;
                chord.used += deviation;
                for piece in &pieces {
                    out.append_conic(piece, 0.5 * CHORD * tolerance, DEPTH, &chord);
                }
            } else if self.kind[i] == SPLINE {
                for piece in self.spline(i)? {
                    out.append_spline(
                        &self.splines.piece(piece.index as usize),
                        CHORD * tolerance,
                        DEPTH,
                        &chord,
                    );
                }
            } else {
                out.push(self.target[i], chord);
            }
        }
        if let Some(last) = range.clone().last() {
            out.end_at(self.target[last], &range, options.exact_tolerance.max(self.tolerance[last]));
        }
        Ok(out)
    }
}

impl<const M: usize> Chords<M> {
    fn append_conic(&mut self, piece: &Conic<M>, limit: f64, depth: u32, chord: &Chord) {
        let [a, b, c] = &piece.control;
        // The middle of the piece is farthest from the chord.
        let off = Segment::new(a, c).distance_sq(b).sqrt() * piece.weight / (1.0 + piece.weight);
        if off <= limit || depth == 0 {
            let end_angle = angle(&sub(b, a), &sub(c, a)).max(angle(&sub(c, b), &sub(c, a)));
            self.push(*c, Chord { used: chord.used + off, end_angle: Some(end_angle), ..*chord });
        } else {
            self.append_conic(&piece.part(0.0, 0.5 * piece.width), limit, depth - 1, chord);
            self.append_conic(&piece.part(0.5 * piece.width, piece.width), limit, depth - 1, chord);
        }
    }

    fn append_spline(&mut self, piece: &Piece<M>, limit: f64, depth: u32, chord: &Chord) {
        let (control, last) = (piece.control, piece.degree());
        let (start, end) = (&control[0], &control[last]);
        let segment = Segment::new(start, end);
        let off = control.iter().fold(0.0, |most: f64, point| most.max(segment.distance_sq(point))).sqrt();
        if off <= limit || depth == 0 {
            let way = sub(end, start);
            let angles =
                [sub(&control[1], start), sub(end, &control[last - 1])].map(|edge| angle(&edge, &way));
            let end_angle = (last > 1).then_some(angles[0].max(angles[1]));
            self.push(*end, Chord { used: chord.used + off, end_angle, ..*chord });
        } else {
            let mut halves = CompositeCurve::default();
            bezier::split(piece, &[0.5 * piece.width], &mut halves);
            for half in halves.pieces() {
                self.append_spline(&half, limit, depth - 1, chord);
            }
        }
    }

    /// Appends a chord; if it is too short, its moves are added to the neighbouring chord instead.
    fn push(&mut self, point: [f64; M], mut chord: Chord) {
        let length = norm(&sub(&point, &self.points[self.points.len() - 1]));
        if length > SAME_POINT * chord.tolerance {
            if let Some((first, feed)) = self.skipped.take().filter(|_| self.chords.is_empty()) {
                (chord.first, chord.feed) = (first, feed.min(chord.feed));
            }
            self.points.push(point);
            self.chords.push(chord);
        } else if let Some(last) = self.chords.last_mut() {
            last.take(&chord);
        } else {
            let (first, feed) = self.skipped.unwrap_or((chord.first, chord.feed));
            self.skipped = Some((first, feed.min(chord.feed)));
        }
    }

    /// Moves the last point to the end of the last move, which may be too short for a chord.
    fn end_at(&mut self, end: [f64; M], range: &Range<usize>, tolerance: f64) {
        let last = self.points.len() - 1;
        if self.points[last] == end {
            return;
        }
        if let Some((first, feed)) = self.skipped.filter(|_| self.chords.is_empty()) {
            self.points.push(end);
            let (last, used) = (range.end as u32 - 1, SAME_POINT * tolerance);
            self.chords.push(Chord { first, last, feed, tolerance, used, end_angle: None });
        } else if last > 0 {
            self.points[last] = end;
            if self.points[last - 1] == end {
                self.points.pop();
                let removed = self.chords.pop();
                if let (Some(removed), Some(last)) = (removed, self.chords.last_mut()) {
                    last.take(&removed);
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_last_move_that_goes_nowhere_belongs_to_the_chord_before() {
        let chord = |first: u32, last: u32, feed: f64| Chord {
            first,
            last,
            feed,
            tolerance: 0.01,
            used: 0.0,
            end_angle: None,
        };
        // The last move goes back to 10 mm; it is too short for a chord of its own.
        let mut chords = Chords {
            points: vec![[0.0], [10.0], [10.0 + 1e-9]],
            chords: vec![chord(0, 0, 50.0), chord(1, 2, 20.0)],
            skipped: None,
        };
        chords.end_at([10.0], &(0..3), 0.01);
        assert_eq!(chords.points, [[0.0], [10.0]]);
        let [only] = chords.chords[..] else { panic!("{} chords", chords.chords.len()) };
        assert_eq!((only.first, only.last, only.feed), (0, 2, 20.0));
    }
}
