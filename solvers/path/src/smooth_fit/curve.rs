//! The curve that is fitted to a run, and for each of its pieces the chords that it follows.

use super::offsets::Offsets;
use feedplan_geometry::spline::CompositeCurve;
use std::ops::Range;

/// The chords that a piece of the curve follows, and how closely.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Covered {
    /// First and last chord.
    pub first: usize,
    pub last: usize,
    /// Upper bound of the distances from the piece to the chords and from the chords to the piece, in mm.
    pub deviation: f64,
    /// Whether the tool stops at the start of this piece, because no smooth curve was found there.
    pub stop: bool,
}

impl Covered {
    pub fn new(first: usize, last: usize, deviation: f64) -> Self {
        Self { first, last, deviation, stop: false }
    }
}

/// The curve of a run. Pieces of degree 1 are lines, pieces of degree 5 parts of splines, pieces of degree 7 corners.
#[derive(Clone, Debug, Default)]
pub struct Smooth<const D: usize> {
    pub curve: CompositeCurve<D>,
    pub covered: Vec<Covered>,
    /// The number of B-splines and lines, and the number of their polynomials before these are cut.
    pub splines: usize,
    pub polynomials: usize,
    /// Chords whose corners are rounded one by one, with a stop before and after.
    pub corners: Vec<Range<usize>>,
    /// On which side of the polyline the curve lies, and how far away.
    pub offsets: Offsets,
}

impl<const D: usize> Smooth<D> {
    pub fn push(&mut self, control: &[[f64; D]], width: f64, covered: Covered) {
        self.curve.push(control, &[], width);
        self.covered.push(covered);
    }

    /// Calls `append`, with a stop before the pieces that it appends unless they are the first.
    pub fn after_stop(&mut self, append: impl FnOnce(&mut Self)) {
        let at = self.covered.len();
        append(self);
        if at > 0 && at < self.covered.len() {
            self.covered[at].stop = true;
        }
    }
}
