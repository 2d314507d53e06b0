//! The moves of a program as chords, for a curve that is fitted to all of them alike.
//!
//! Arcs and splines are halved until their chords are within a small part of the tolerance, which is charged to it.

use std::ops::Range;

use super::{Fault, FollowError, FollowOptions, Moves, ARC, RAPID, SPLINE};
use crate::arc::arc_pieces;
use feedplan_geometry::conic::Conic;
use feedplan_geometry::quadratic::{dot, norm, sub};
use feedplan_geometry::spline::{bezier, CompositeCurve, Piece};

/// The part of the tolerance that chords of arcs and splines may use.
const CHORD: f64 = 0.02;
/// Points that are this close to the one before, in parts of the tolerance, are the same.
const SAME: f64 = 1e-3;
/// Halvings of a piece of an arc or a spline, at most.
const DEPTH: u32 = 14;
/// The part of the tolerance that is always left.
const LEAST_LEFT: f64 = 1e-2;

/// A chord and what it stands for.
#[derive(Clone, Copy, Debug)]
pub struct Chord {
    /// First and last move.
    pub first: u32,
    pub last: u32,
    pub feed: f64,
    /// Distance that the path may have from the moves, in mm.
    pub allowed: f64,
    /// How much of it the chord itself may need.
    pub charge: f64,
    /// The angle between the chord and the curve it stands for at its ends, in rad; None for a line.
    pub bow: Option<f64>,
}

impl Chord {
    /// What the curve may use of the tolerance.
    pub fn left(&self) -> f64 {
        (self.allowed - self.charge).max(LEAST_LEFT * self.allowed)
    }
}

/// Chords between points, one more than chords.
pub struct Chords<const M: usize> {
    pub points: Vec<[f64; M]>,
    pub chords: Vec<Chord>,
    /// The first move and the feed of those that are too short for a chord, before the first one.
    skipped: Option<(u32, f64)>,
}

impl<const M: usize> Moves<'_, M> {
    /// The chords of some moves, of which each starts where the one before ends. Moves that ask for the exact path
    /// are followed within the exact tolerance.
    pub fn chords(&self, options: &FollowOptions, range: Range<usize>) -> Result<Chords<M>, FollowError> {
        let start = vec![self.origin(range.start)];
        let mut out = Chords { points: start, chords: vec![], skipped: None };
        for i in range.clone() {
            self.check(i)?;
            let exact = self.tolerance[i] <= 0.0;
            let allowed = if exact { options.exact_tolerance } else { self.tolerance[i] };
            let feed = if self.kind[i] == RAPID { f64::INFINITY } else { self.feed[i] };
            let index = i as u32;
            let mut chord =
                Chord { first: index, last: index, feed, allowed, charge: SAME * allowed, bow: None };
            if self.kind[i] == ARC {
                let (pieces, deviation) = arc_pieces(&self.arc(i)?, 0.5 * CHORD * allowed)
                    .map_err(|error| FollowError { index: i, fault: Fault::Arc(error) })?;
                chord.charge += deviation;
                for piece in &pieces {
                    out.append_conic(piece, 0.5 * CHORD * allowed, DEPTH, &chord);
                }
            } else if self.kind[i] == SPLINE {
                for piece in self.spline(i)? {
                    out.append_spline(
                        &self.splines.piece(piece.index as usize),
                        CHORD * allowed,
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
        // No point has more of the middle control point than that in the middle.
        let off = distance(a, c, b) * piece.weight / (1.0 + piece.weight);
        if off <= limit || depth == 0 {
            let bow = bow(&sub(b, a), &sub(c, a)).max(bow(&sub(c, b), &sub(c, a)));
            self.push(*c, Chord { charge: chord.charge + off, bow: Some(bow), ..*chord });
        } else {
            self.append_conic(&piece.part(0.0, 0.5 * piece.width), limit, depth - 1, chord);
            self.append_conic(&piece.part(0.5 * piece.width, piece.width), limit, depth - 1, chord);
        }
    }

    fn append_spline(&mut self, piece: &Piece<M>, limit: f64, depth: u32, chord: &Chord) {
        let (control, last) = (piece.control, piece.degree());
        let (start, end) = (&control[0], &control[last]);
        let off = control.iter().fold(0.0, |most: f64, point| most.max(distance(start, end, point)));
        if off <= limit || depth == 0 {
            let way = sub(end, start);
            let bow = bow(&sub(&control[1], start), &way).max(bow(&sub(end, &control[last - 1]), &way));
            let bow = (last > 1).then_some(bow);
            self.push(*end, Chord { charge: chord.charge + off, bow, ..*chord });
        } else {
            let mut halves = CompositeCurve::default();
            bezier::split(piece, &[0.5 * piece.width], &mut halves);
            for half in halves.pieces() {
                self.append_spline(&half, limit, depth - 1, chord);
            }
        }
    }

    /// Appends a chord, or leaves it to its neighbour where it is too short.
    fn push(&mut self, point: [f64; M], mut chord: Chord) {
        let length = norm(&sub(&point, &self.points[self.points.len() - 1]));
        if length > SAME * chord.allowed {
            if let Some((first, feed)) = self.skipped.take().filter(|_| self.chords.is_empty()) {
                (chord.first, chord.feed) = (first, feed.min(chord.feed));
            }
            self.points.push(point);
            self.chords.push(chord);
        } else if let Some(last) = self.chords.last_mut() {
            (last.last, last.feed) = (chord.last, last.feed.min(chord.feed));
        } else {
            let (first, feed) = self.skipped.unwrap_or((chord.first, chord.feed));
            self.skipped = Some((first, feed.min(chord.feed)));
        }
    }

    /// Moves the last point to the end of the last move, from which it may be a short chord away.
    fn end_at(&mut self, end: [f64; M], range: &Range<usize>, allowed: f64) {
        let last = self.points.len() - 1;
        if self.points[last] == end {
            return;
        }
        if let Some((first, feed)) = self.skipped.filter(|_| self.chords.is_empty()) {
            self.points.push(end);
            let (last, charge) = (range.end as u32 - 1, SAME * allowed);
            self.chords.push(Chord { first, last, feed, allowed, charge, bow: None });
        } else if last > 0 {
            self.points[last] = end;
            if self.points[last - 1] == end {
                self.points.pop();
                self.chords.pop();
            }
        }
    }
}

/// The distance of a point from the segment between two others.
fn distance<const M: usize>(a: &[f64; M], b: &[f64; M], point: &[f64; M]) -> f64 {
    let (way, away) = (sub(b, a), sub(point, a));
    let length_sq = dot(&way, &way);
    let along = if length_sq > 0.0 { (dot(&away, &way) / length_sq).clamp(0.0, 1.0) } else { 0.0 };
    norm(&std::array::from_fn::<f64, M, _>(|k| away[k] - along * way[k]))
}

/// The angle between an edge and a chord; 0 where one has no length.
fn bow<const M: usize>(edge: &[f64; M], chord: &[f64; M]) -> f64 {
    crate::smooth_fit::polyline::angle(edge, chord)
}
